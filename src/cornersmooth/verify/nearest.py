"""Distances between poses and motions: at one common pose, and for tip and axis point each on its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.polyline import Polyline

#: which distance is made smallest: tip and axis point together, or one of them
Metric = Literal["both", "tip", "axis point"]

#: columns of a row of both that count for each
COLUMNS: Final[dict[Metric, slice]] = {"both": slice(0, 6), "tip": slice(0, 3), "axis point": slice(3, 6)}

#: segments that the nearest place may be away from where it is looked for, and looked at together at first
_MOST_STEPS, _AHEAD = 200, 2

#: segments looked at on either side of a repeated pose
_BEYOND_REPEATED = 4

#: squared distance that is none, and one by which nothing is nearer: arithmetic must not choose between ways, mm²
_NOTHING, _TIE = 1e-9, 1e-13

#: segments taken at a time, so that the work arrays stay in the cache
_BLOCK = 8192


@dataclass(frozen=True)
class Gap:
    """How far poses are from a motion, k rows.

    Parameters
    ----------
    tip, axis_point : (k,) float64, mm
    angle : (k,) float64, rad
        Between the tool axes.
    """

    tip: Floats
    axis_point: Floats
    angle: Floats

    @property
    def larger(self) -> Floats:
        """(k,) the larger of the two distances."""
        return np.maximum(self.tip, self.axis_point)


def distance_between(points: Floats, others: Floats | float) -> Floats:
    """(k,) distances of points taken pairwise."""
    away = points - others
    distance: Floats = np.sqrt(np.einsum("ij,ij->i", away, away))
    return distance


def larger_square(away: Floats) -> Floats:
    """(k,) the larger of the squares of both halves, tip and axis point, of differences (k, 6)."""
    tip, point = away[:, :3], away[:, 3:]
    square: Floats = np.maximum(np.einsum("ij,ij->i", tip, tip), np.einsum("ij,ij->i", point, point))
    return square


def foot_share(away: Floats, way: Floats) -> Floats:
    """(...,) fractions of segments (..., d) at which they are nearest to points, `away` (..., d) from their starts."""
    size = np.einsum("...i,...i->...", way, way)
    share: Floats = np.einsum("...i,...i->...", away, way)
    np.divide(share, size, out=share, where=size > 0)
    return np.clip(share, 0.0, 1.0, out=share)


def nearest_places(
    point: Floats, vertices: Floats, middle: Ints, reach: int, low: Ints, high: Ints, metric: Metric = "both"
) -> tuple[Ints, Floats, Floats]:
    """Nearest place on a trail among the segments around a given one, and the distance.

    Parameters
    ----------
    point : (k, 6) float64
        Tip and axis point.
    vertices : (v, 6) float64
        Of the trail, contiguous; segment j runs from vertex j to j+1.
    middle : (k,) int64
        Segment around which to look.
    reach : int
        Segments on either side.
    low, high : (k,) int64
        First and last segment allowed; where there is none the result is `middle`.
    metric : Metric

    Returns
    -------
    segment : (k,) int64
    fraction : (k,) float64
    square : (k,) float64, mm²
        Of the distance.
    """
    columns = COLUMNS[metric]
    steps = np.array([0, *(sign * k for k in range(1, reach + 1) for sign in (-1, 1))])
    segment, fraction, square = np.empty(len(point), np.int64), np.empty(len(point)), np.empty(len(point))
    size = max(_BLOCK // len(steps), 1)
    for begin in range(0, len(point), size):
        part = slice(begin, begin + size)
        j = np.clip(middle[part, None] + steps, low[part, None], high[part, None])
        t, d = _on_segments(point[part, None, columns], vertices, j, columns)
        best = np.argmax(d <= d.min(axis=1, keepdims=True) + _TIE, axis=1)
        each = np.arange(len(j))
        segment[part], fraction[part], square[part] = j[each, best], t[each, best], d[each, best]
    return segment, fraction, square


def _on_segments(own: Floats, vertices: Floats, segment: Ints, columns: slice) -> tuple[Floats, Floats]:
    """Fractions (k, m) of the nearest places of points (k, 1, 6 or 3) on segments (k, m), and the squared distances."""
    start, difference = vertices.take(segment, axis=0), vertices.take(segment + 1, axis=0)
    if columns != slice(0, 6):
        start, difference = start[..., columns], difference[..., columns]
    difference -= start
    away = own - start
    t = foot_share(away, difference)
    difference *= t[..., None]
    away -= difference
    return t, np.einsum("...i,...i->...", away, away)


def nearest_from(point: Floats, path: Polyline, about: Floats, low: Ints, high: Ints) -> tuple[Ints, Floats, Floats]:
    """Nearest places of points from path lengths on, where the distance grows no more.

    Parameters
    ----------
    point : (k, 6) float64
    path : Polyline
    about : (k,) float64, mm
        Path length where to begin to look.
    low, high : (k,) int64
        First and last segment allowed.

    Returns
    -------
    As `nearest_places`.
    """
    middle = np.clip(np.searchsorted(path.length, about, side="right") - 1, low, high)
    segment, fraction, square = nearest_places(point, path.six, middle, 1, low, high)
    moved = climb(point, path.six, middle, low, high, segment, fraction)
    ended = np.flatnonzero(((fraction <= 0.0) | (fraction >= 1.0)) & (square > _NOTHING))
    beside = np.stack([np.clip(segment[ended] + step, 0, len(path.six) - 2) for step in (-1, 0, 1)])
    stuck = ended[(path.length[beside] == path.length[beside + 1]).any(axis=0)]
    if len(stuck):  # at a repeated pose, beyond which it may be nearer
        own, part = point[stuck], (low[stuck], high[stuck])
        there, share, _ = nearest_places(own, path.six, segment[stuck], _BEYOND_REPEATED, *part)
        climb(own, path.six, segment[stuck], *part, there, share)
        segment[stuck], fraction[stuck] = there, share
        moved = np.union1d(moved, stuck)
    away = point[moved] - path.point_at(segment[moved], fraction[moved])
    square[moved] = np.einsum("ij,ij->i", away, away)
    return segment, fraction, square


def climb(
    point: Floats,
    vertices: Floats,
    middle: Ints,
    low: Ints,
    high: Ints,
    segment: Ints,
    at: Floats,
    metric: Metric = "both",
) -> Ints:
    """Go on to nearer segments, in place, from where the look around `middle` has led away from it; say which rows.

    Blocks in rotary words may have become many short lines, and the nearest is then not next door.
    """
    columns = COLUMNS[metric]
    moved = rows = np.flatnonzero(segment != middle)
    ahead, left = _AHEAD, _MOST_STEPS
    while len(rows) and left:
        ahead = min(ahead, left)
        heading = np.sign(segment[rows] - middle[rows])
        ways = segment[rows, None] + heading[:, None] * np.arange(ahead + 1)
        j = np.clip(ways, low[rows, None], high[rows, None])
        t, d = _on_segments(point[rows, None, columns], vertices, j, columns)
        nearer = np.column_stack((d[:, 1:] < d[:, :-1] - _TIE, np.zeros(len(rows), np.bool_)))
        steps = np.argmin(nearer, axis=1)
        each = np.arange(len(rows))
        segment[rows], at[rows] = j[each, steps], t[each, steps]
        rows = rows[steps == ahead]
        left -= ahead
        ahead *= 2
    return moved
