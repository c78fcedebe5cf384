"""Corners that stay sharp: the tool cuts on in another direction, and nothing rounds the path there.

Most are rows of `Corners`. The others are ends of arcs, which no method rounds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cornersmooth.model import Floats, Ints, Move, Program, SmoothProgram, Status
from cornersmooth.smoothing.arcs import arc_tangents
from cornersmooth.smoothing.corner_table import BATCH
from cornersmooth.smoothing.legs import legs_at
from cornersmooth.smoothing.proportional import wanted
from cornersmooth.vectors import angle_between

#: degrees below which the path goes straight on: numbers of arcs are rounded in CL files
STRAIGHT_ON = 1.0

#: no corner: it turns by less than the output can show, or repeats a pose
_NO_CORNER = (Status.STRAIGHT, Status.DUPLICATE)


def sharp_rows(smoothed: SmoothProgram) -> Ints:
    """Rows of `Corners` that are not rounded although the path turns there, ascending.

    What forbids to round a pose says nothing of its turn, so that is looked at here, as `Status.STRAIGHT` is found.
    """
    corners, program, settings = smoothed.corners, smoothed.program, smoothed.settings
    rows = np.flatnonzero(~corners.rounded & ~np.isin(corners.status, _NO_CORNER))
    turns = corners.after[rows] >= 0
    known = rows[turns]
    straight = [np.zeros(0, np.bool_)]
    for part in np.split(known, np.arange(BATCH, len(known), BATCH)):
        legs = legs_at(program, settings.axis_length, corners.pose[part], corners.before[part], corners.after[part])
        measured = wanted(legs, corners.weights[part], corners.ratio[part], settings)
        straight.append(measured.status == Status.STRAIGHT)
    turns[turns] = ~np.concatenate(straight)
    return rows[turns]


class ArcCorners(NamedTuple):
    """Ends of arcs at which the path turns, g of them in path order.

    Parameters
    ----------
    pose : (g,) int64
    tip_turn, axis_turn : (g,) float64, degrees
        Change of direction of the tip path and of the axis-point path.
    """

    pose: Ints
    tip_turn: Floats
    axis_turn: Floats


def arc_corners(program: Program, axis_length: float) -> ArcCorners:
    """Find the poses where an arc meets a line or another arc, and the path turns by more than `STRAIGHT_ON`."""
    if not len(program.arcs):
        return ArcCorners(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    arc = program.kind == Move.ARC
    step = np.diff(program.tip, axis=0, prepend=program.tip[:1])
    turn = axis_length * np.diff(program.axis, axis=0, prepend=program.axis[:1])
    cuts = arc | (program.kind == Move.LINEAR)
    cuts[:1] = False  # nothing to come from
    cuts[1:] &= ~np.isin(program.kind[:-1], (Move.FROM, Move.HOLE))
    moving = np.flatnonzero(arc | ~cuts | step.any(axis=1) | turn.any(axis=1))
    one, other = moving[:-1], moving[1:]
    meet = cuts[one] & cuts[other] & (arc[one] | arc[other])
    one, other = one[meet], other[meet]
    starts, ends = step.copy(), step
    rows = np.arange(len(program.arcs))
    starts[program.arcs.pose], ends[program.arcs.pose] = (
        arc_tangents(program, rows, 0.0),
        arc_tangents(program, rows, 1.0),
    )
    tip = np.degrees(angle_between(ends[one], starts[other]))
    axis = np.degrees(angle_between(ends[one] + turn[one], starts[other] + turn[other]))
    bent = np.maximum(tip, axis) > STRAIGHT_ON
    return ArcCorners(one[bent], tip[bent], axis[bent])
