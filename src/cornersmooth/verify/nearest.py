"""Distances between poses, and the nearest places of points on polylines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.chain import Path

#: which distance is made smallest: tip and axis point together, or one of them
Metric = Literal["both", "tip", "axis point"]

#: columns of a row of both that count for each
COLUMNS: Final[dict[Metric, slice]] = {"both": slice(0, 6), "tip": slice(0, 3), "axis point": slice(3, 6)}

#: points taken at a time, so that the work arrays stay in the cache (speed only)
_BLOCK: Final = 8192


@dataclass(frozen=True)
class Gap:
    """How far poses are from a motion, k rows."""

    tip: Floats  #: (k,) mm
    axis_point: Floats  #: (k,) mm
    angle: Floats  #: (k,) rad: between the tool axes

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
) -> Floats:
    """Nearest places on a polyline among the segments around given ones.

    Parameters
    ----------
    point : (k, 6) float64
        Tip and axis point.
    vertices : (v, 6) float64
        Segment j runs from vertex j to j + 1.
    middle : (k,) int64
        Segment around which to look.
    reach : int
        Segments on either side.
    low, high : (k,) int64
        First and last segment allowed.

    Returns
    -------
    (k,) float64
        Segment plus fraction.
    """
    columns = COLUMNS[metric]
    steps = np.array([0, *(sign * k for k in range(1, reach + 1) for sign in (-1, 1))])
    place = np.empty(len(point))
    size = max(_BLOCK // len(steps), 1)
    for begin in range(0, len(point), size):
        part = slice(begin, begin + size)
        j = np.clip(middle[part, None] + steps, low[part, None], high[part, None])
        share, square = on_segments(point[part, None, columns], vertices, j, columns)
        best = np.argmin(square, axis=1)
        each = np.arange(len(j))
        place[part] = j[each, best] + share[each, best]
    return place


def on_segments(own: Floats, vertices: Floats, segment: Ints, columns: slice) -> tuple[Floats, Floats]:
    """Fractions (k, m) of the nearest places of points (k, 1, d) on segments (k, m), and the squared distances."""
    start = vertices.take(segment, axis=0)[..., columns]
    way = vertices.take(segment + 1, axis=0)[..., columns] - start
    away = own - start
    share = foot_share(away, way)
    away -= share[..., None] * way
    return share, np.einsum("...i,...i->...", away, away)


def places_on_each(point: Floats, path: Path, low: int, high: int) -> tuple[Floats, Floats]:
    """Path lengths of the places nearest to a point (6,) on each of some segments, and the squared distances."""
    segment = np.arange(low, high + 1)
    share, square = on_segments(point[None, None], path.points, segment[None], slice(0, 6))
    begin = path.length[segment]
    return begin + share[0] * (path.length[segment + 1] - begin), square[0]
