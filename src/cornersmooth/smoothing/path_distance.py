"""How far the written path is from the original at each corner: what a measurement of the program finds.

`Corners.tip_error` and `Corners.axis_error` compare both motions at a common parameter. The paths are as near or
nearer: where the legs are unequal, the curve passes the corner nearest beside u = ½. The distance from the corner
itself decides, as the path runs on the inner side of it and turns in one sense.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.methods import METHODS
from cornersmooth.model import Floats, Ints, SmoothProgram
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import lines_of
from cornersmooth.vectors import dot, norm, square, unit

#: corners looked at together
_BATCH = 2048

#: lines per half that stand for a curve: their distance is larger than that of the curve by 1e-4 of it at most
_FINE = 64

#: parameters beside the middle, and the cosine between the path there and the way to the corner below which the middle
#: is the nearest point
_MIDDLE = np.array([0.5 - 1e-5, 0.5, 0.5 + 1e-5])
_SQUARE = 1e-5


def path_distances(smoothed: SmoothProgram, rows: Ints, *, dense: bool) -> tuple[Floats, Floats]:
    """Distances (g,) of tip path and axis-point path from the original ones at some corners, mm; 0 where not smoothed.

    For the paper's method they are the errors by its equation (10). With `dense`, transitions are written as lines.
    """
    corners, settings = smoothed.corners, smoothed.settings
    errors = corners.tip_error[rows].copy(), corners.axis_error[rows].copy()
    if not METHODS[settings.method].one_parameter:
        return errors
    # with a tolerance of its own the axis has no path
    found = errors if settings.axis_tolerance is None else errors[:1]
    for begin in range(0, len(rows), _BATCH):
        chosen = begin + np.flatnonzero(corners.smoothed[rows[begin : begin + _BATCH]])
        aslant = np.zeros(len(chosen), np.bool_)
        for point, _, _ in _seen_from_corners(smoothed, rows[chosen], _MIDDLE)[: len(found)]:
            along, off = point[:, 3] - point[:, 1], point[:, 2]
            aslant |= np.abs(dot(along, off)) > _SQUARE * norm(along) * norm(off)
        chosen = chosen[aslant]
        number = lines_of(smoothed, rows[chosen]) if dense else np.full(len(chosen), _FINE)
        for lines in np.unique(number):
            some = chosen[number == lines]
            seen = _seen_from_corners(smoothed, rows[some], nodes(int(lines)))
            for error, (point, tip, lever) in zip(found, seen, strict=False):
                error[some] = np.minimum(error[some], _passing(point, tip, lever))
    return errors


def _seen_from_corners(smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[tuple[Floats, Floats, Floats], ...]:
    """Tips and axis points (g, 1 + m, 3) on transitions, less those of the corners, each with its tips and levers."""
    program, pose, height = smoothed.program, smoothed.corners.pose[rows], smoothed.settings.axis_length
    tips, levers = construction_of(smoothed.settings.method).points(smoothed, rows, u)
    tips, levers = tips - program.tip[pose][:, None], height * unit(levers)
    tops = tips - height * program.axis[pose][:, None]
    return (tips, tips, np.zeros_like(tips)), (tops + levers, tops, levers)


def _passing(point: Floats, tip: Floats, lever: Floats) -> Floats:
    """(g,) least distance from 0 of lines through points (g, m, 3); the control turns the lever between their ends."""
    start, way = point[:, :-1], np.diff(point, axis=1)
    size = square(way)
    share = np.clip(np.divide(-dot(start, way), size, out=np.zeros_like(size), where=size > 0), 0.0, 1.0)[..., None]
    turned = unit(lever[:, :-1] + share * np.diff(lever, axis=1)) * norm(lever[:, :1])[..., None]
    return norm(tip[:, :-1] + share * np.diff(tip, axis=1) + turned).min(axis=1)
