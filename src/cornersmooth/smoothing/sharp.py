"""Corners that stay sharp: the tool cuts on in another direction, and nothing rounds the path there.

Most are rows of `Corners`. The others are between moves of different kinds, which no method rounds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import angle_between
from cornersmooth.geometry.arcs import arc_tangents
from cornersmooth.model import Floats, Ints, Move, Program, SmoothProgram, Status, Trait
from cornersmooth.smoothing.construction import BATCH, STRAIGHT_ON, legs_at
from cornersmooth.smoothing.proportional import CornerLengths


def sharp_rows(smoothed: SmoothProgram) -> Ints:
    """Rows of `Corners` that are not rounded although the path turns there, ascending.

    What forbids to round a pose says nothing of its turn, so that is looked at here, as `Status.STRAIGHT` is found.
    """
    corners, program, settings = smoothed.corners, smoothed.program, smoothed.settings
    rows = np.flatnonzero(~corners.rounded & ~np.isin(corners.status, Status.having(Trait.NO_CORNER)))
    turns = corners.after[rows] >= 0
    known = rows[turns]
    straight = [np.zeros(0, np.bool_)]
    for part in np.split(known, np.arange(BATCH, len(known), BATCH)):
        legs = legs_at(program, settings.axis_length, corners.pose[part], corners.before[part], corners.after[part])
        measured = CornerLengths(legs, settings)
        straight.append(measured.status == Status.STRAIGHT)
    turns[turns] = ~np.concatenate(straight)
    return rows[turns]


class OtherCorners(NamedTuple):
    """Corners between moves of different kinds, g of them in path order."""

    pose: Ints
    status: NDArray[np.uint8]  # `Status.ARC` or `Status.RAPID`
    tip_turn: Floats  # change of direction of the tip path, degrees
    axis_turn: Floats  # the same of the axis-point path


def other_corners(program: Program, axis_length: float) -> OtherCorners:
    """Find the corners of a path that are no poses inside a chain, where it turns by more than `STRAIGHT_ON`."""
    arc, step = program.kind == Move.ARC, np.diff(program.tip, axis=0, prepend=program.tip[:1])
    turn = axis_length * np.diff(program.axis, axis=0, prepend=program.axis[:1])
    cuts = arc | (program.kind == Move.LINEAR)
    cuts[:1] = False  # nothing to come from
    cuts[1:] &= ~np.isin(program.kind[:-1], (Move.FROM, Move.HOLE))
    still = (cuts & ~arc) | (program.kind == Move.RAPID)
    still[still] = ~(step[still].any(axis=1) | turn[still].any(axis=1))
    moving = np.flatnonzero(~still)
    one, other = moving[:-1], moving[1:]
    rapids = np.cumsum(still & (program.kind == Move.RAPID))
    meet = cuts[one] & cuts[other] & (arc[one] | arc[other] | (rapids[other] > rapids[one]))
    one, other = one[meet], other[meet]
    begins, ends = step.copy(), step
    rows = np.arange(len(program.arcs))
    begins[program.arcs.pose], ends[program.arcs.pose] = (arc_tangents(program, rows, share) for share in (0.0, 1.0))
    tip = np.degrees(angle_between(ends[one], begins[other]))
    axis = np.degrees(angle_between(ends[one] + turn[one], begins[other] + turn[other]))
    bent = np.maximum(tip, axis) > STRAIGHT_ON
    status = np.where(arc[one] | arc[other], Status.ARC, Status.RAPID).astype(np.uint8)
    return OtherCorners(one[bent], status[bent], tip[bent], axis[bent])
