"""Angles of both solutions made continuous along a cut, and at the pole where cuts on either side of it meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import pole_angle, solutions, wrap
from cornersmooth.model import Bools, Floats, Ints

#: A step of an angle larger than this (degrees) is followed on its way, to see which way round it goes and how far.
WIDE_STEP = 30.0
#: So many points are looked at on the way.
WIDE_STEP_POINTS = 15


def meet_at_pole(
    machine: Machine, axis: Floats, steady: Ints, begins: Ints, through: Bools, enter: Floats, leave: Floats
) -> None:
    """Take the second angles to the pole in place, where stretches meet there.

    On the way to the pole that angle turns by less than 180 degrees, from pose to pose through the pole by up to 360.
    """
    stretches = np.flatnonzero(through)
    if not len(stretches):
        return
    start, end = steady[begins[stretches] - 1], steady[begins[stretches]]
    inside = np.where((end - start > 1)[:, None], axis[start + 1], axis[start] + axis[end])
    angle = pole_angle(machine, inside)[:, None]
    enter[stretches, :, 1] += wrap(angle - enter[stretches, :, 1])
    leave[stretches - 1, :, 1] += wrap(angle - leave[stretches - 1, :, 1])


@dataclass(frozen=True)
class WideSteps:
    """How far the angles go on wide steps into rows: (w,) and twice (w, 2, 2) degrees, unwrapped."""

    row: Ints
    low: Floats
    high: Floats


def unwrap(machine: Machine, axis: Floats, start: Ints, end: Ints, angles: Floats, broken: Bools) -> WideSteps:
    """Make both branches of angles (e + 1, 2, 2), degrees, continuous from the first row on, in place.

    Steps lead from the poses `start` to `end` (e,); after a broken one the turns are counted from 0 again.
    """
    step = np.diff(angles, axis=0)
    change = -np.round(step / 360)
    wide = np.flatnonzero(~broken & (np.abs(step + 360 * change).max(axis=(1, 2)) > WIDE_STEP))
    steps = np.zeros((1, len(wide), 2, 2))
    if len(wide):
        # A wide step: the sum of the short ones on the way says which way round it goes.
        share = (np.arange(1, WIDE_STEP_POINTS + 1) / (WIDE_STEP_POINTS + 1))[:, None, None]
        between = axis[start[wide]] * (1 - share) + axis[end[wide]] * share
        length = np.linalg.norm(between, axis=2, keepdims=True)
        between = np.where(length > 0, between / np.where(length > 0, length, 1.0), axis[start[wide]])
        on_way = solutions(machine, between.reshape(-1, 3)).angles.reshape(WIDE_STEP_POINTS, -1, 2, 2)
        steps = np.diff(np.concatenate((angles[wide][None], on_way, angles[wide + 1][None])), axis=0)
        steps -= 360 * np.round(steps / 360)
        change[wide] = np.round((steps.sum(axis=0) - step[wide]) / 360)
    if change.any():
        turns = np.cumsum(change, axis=0)
        if broken.any():
            base = np.maximum.accumulate(np.where(broken, np.arange(len(broken)), -1))
            turns -= np.where(base[:, None, None] >= 0, turns[base], 0.0)
        angles[1:] += 360 * turns
    way = angles[wide] + np.cumsum(steps, axis=0)
    return WideSteps(wide, way.min(axis=0), way.max(axis=0))
