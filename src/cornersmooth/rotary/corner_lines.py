"""Corners as lines in rotary angles: for those few that no curve meets, where the first rotary axis turns too fast."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.geometry.ragged import starts
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import continued
from cornersmooth.model import Floats, Ints, SmoothProgram
from cornersmooth.rotary.remainders import RotaryMotion, lever_points, tip_points
from cornersmooth.rotary.subdivision import fill, insertions
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import lines_of
from cornersmooth.vectors import unit


@dataclass(frozen=True)
class CornerLines:
    """Points of some corners from joint to joint, q rows in path order; even angles between them keep the tolerance."""

    row: Ints  #: (q,) row of `Corners`, ascending
    tip: Floats  #: (q, 3), mm
    angles: Floats  #: (q, 2), degrees
    unsolved: Ints  #: (v,) rows of `Corners` in which the axis jumps: no division helps


def corner_lines(smoothed: SmoothProgram, machine: Machine, motion: RotaryMotion, chosen: Ints) -> CornerLines:
    """Points of corners with ascending numbers in `RotaryMotion.rows`: those of dense lines and more (or CS362)."""
    program, corners = smoothed.program, smoothed.corners
    rows = motion.rows[chosen]
    halves = lines_of(smoothed, rows)
    counts = 2 * np.abs(halves) + 1
    first, total = starts(counts)[:-1], int(counts.sum())
    tip, lever, angles = np.zeros((total, 3)), np.zeros((total, 3)), np.zeros((total, 2))
    for number in np.unique(halves):
        group = np.flatnonzero(halves == number)
        u = np.concatenate(([0.0], nodes(int(number))))
        where = first[group, None] + np.arange(len(u))
        weights = corners.weights[rows[group]]
        tip[where] = nurbs.evaluate(tip_points(smoothed, rows[group]), weights, u)
        lever[where] = nurbs.evaluate(lever_points(smoothed, rows[group]), weights, u)
        guess, branch = motion.followed.interpolated(chosen[group], u)
        words, _ = continued(
            machine, unit(lever[where].reshape(-1, 3)), guess.reshape(-1, 2), branch.ravel(), motion.cone
        )
        angles[where] = words.reshape(guess.shape)
    angles[first] = motion.end.angles[corners.pose[rows]]
    angles[first + counts - 1] = motion.start.angles[corners.after[rows]]
    owner = np.repeat(rows, counts)
    between = np.zeros(total, np.bool_)
    between[first] = True
    line, file = program.line[corners.pose[owner]], program.source.name
    more = insertions(machine, tip, lever, angles, tolerance=2 * motion.cone, rapid=between, line=line, file=file)
    filled = fill(tip, lever, angles, more)
    return CornerLines(owner[filled.pose], filled.tip, filled.angles, np.unique(owner[more.unsolved]))
