"""Proof that runs keep ε: bounds of the deviation at common parameters over whole stretches, not at samples.

Between neighbouring knots and poses the curve less the original motion is one cubic in each coordinate, and a cubic
stays within the hull of its Bernstein points. For the tip that is all. The axis point b = tip + H·axis is measured at
constant H: with ΔA, ΔB the deviations of both curves, δ = ΔB − ΔA, and O, l direction and length of the original lever,

    b′ − b = ΔA + (H/l′)·(δ − O(O·δ)) − (H/l′)·q·O        l′ = |l·O + δ|,   0 ≤ q ≤ |δ|²/(2(l + O·δ))

With O and H/l taken from the middle of the stretch this is a cubic again; what it leaves out is bounded.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.runs.polylines import Pieces, Polylines

#: parts that every stretch is looked at in, first and where that is not enough
PARTS, MORE_PARTS = 2, 12

#: places of the Bernstein points of a straight motion
_THIRDS = np.arange(4) / 3.0

#: stretches looked at together
_BLOCK = 32768


def bounds(
    splines: Splines, control: Floats, lines: Polylines, pieces: Pieces, axis_length: float, enough: tuple[float, float]
) -> Floats:
    """(p, 2) mm: bounds of the deviation of tip and axis point on every piece; above `enough` it looks closely."""
    proven = np.zeros((len(pieces.span), 2))
    for begin in range(0, len(proven), _BLOCK):
        rows = np.arange(begin, min(begin + _BLOCK, len(proven)))
        proven[rows] = _bound(splines, control, lines, pieces, rows, axis_length, PARTS)
        doubtful = rows[(proven[rows] > enough).any(axis=1)]
        if len(doubtful):
            closer = _bound(splines, control, lines, pieces, doubtful, axis_length, MORE_PARTS)
            proven[doubtful] = np.minimum(proven[doubtful], closer)
    return proven


def _bound(
    splines: Splines, control: Floats, lines: Polylines, pieces: Pieces, rows: Ints, axis_length: float, parts: int
) -> Floats:
    largest = np.zeros((len(rows), 2))
    span, segment = pieces.span[rows], pieces.segment[rows]
    hull = splines.bezier(control, span, pieces.low[rows], pieces.high[rows])
    start, step = lines.point[segment], lines.point[segment + 1] - lines.point[segment]
    length = lines.s[segment + 1] - lines.s[segment]
    low, width = (pieces.low[rows] - lines.s[segment]) / length, (pieces.high[rows] - pieces.low[rows]) / length
    original = start[:, None] + (low[:, None] + width[:, None] * _THIRDS)[:, :, None] * step[:, None]
    whole_off, whole_levers = hull - original, original[:, :, 3:] - original[:, :, :3]
    ends = np.arange(parts + 1) / parts
    whole = Splines(np.array([0.0, 1.0]), np.array([2]))
    for cut in whole.bernstein(np.zeros(parts, np.int64), ends[:-1], ends[1:]):
        off, levers = cut @ whole_off, cut @ whole_levers
        np.maximum(largest[:, 0], _longest(off[:, :, :3]), out=largest[:, 0])
        np.maximum(largest[:, 1], _axis_bound(off, levers, axis_length), out=largest[:, 1])
    return largest


def _axis_bound(off: Floats, levers: Floats, axis_length: float) -> Floats:
    """(g,) bounds from Bernstein points (g, 4, 6) of the deviation and levers (g, 4, 3) on the stretch."""
    tip, swing = off[:, :, :3], off[:, :, 3:] - off[:, :, :3]
    middle = (levers[:, 0] + levers[:, 3]) / 2.0
    size = np.sqrt((middle**2).sum(axis=1))
    direction = middle / size[:, None]
    half_way = np.sqrt(((levers[:, 3] - levers[:, 0]) ** 2).sum(axis=1)) / 2.0
    factor = axis_length / size
    across = swing - (swing @ direction[:, :, None]) * direction[:, None]
    first = _longest(tip + factor[:, None, None] * across)
    # every lever of the stretch is within half_way of the one in the middle
    largest = _longest(swing)
    shortest = np.maximum(size - half_way - largest, 1e-9 * axis_length)
    turned = np.minimum(half_way / size, 1.0)  # sine of the angle to the middle, at most
    steepest = axis_length / shortest
    rest = (steepest * turned + (steepest - axis_length / (size + half_way + largest))) * largest
    return first + rest + steepest * largest**2 / (2.0 * shortest)


def _longest(vectors: Floats) -> Floats:
    """(g,) length of the longest of the vectors (g, k, 3)."""
    return np.sqrt((vectors**2).sum(axis=2).max(axis=1))
