"""Nearest places of points on polylines of tips and axis points."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

from cornersmooth.model import Floats, Ints

#: which distance is meant: of tip and axis point together, or of one of them
Metric = Literal["both", "tip", "axis_point"]

#: columns of a row of both that count for each
COLUMNS: Final[dict[Metric, slice]] = {"both": slice(0, 6), "tip": slice(0, 3), "axis_point": slice(3, 6)}

#: points taken at a time, so that the work arrays stay in the cache (speed only)
_BLOCK: Final = 8192


def largest_square(away: Floats) -> Floats:
    """Square (...) of the longest of the triples of vectors (3h, ...)."""
    squares = [np.einsum("i...,i...->...", away[c : c + 3], away[c : c + 3]) for c in range(0, len(away), 3)]
    return np.maximum(*squares) if len(squares) == 2 else np.asarray(squares[0])


def nearest_places(
    point: Floats, vertices: Floats, middle: Ints, reach: int, low: Ints, high: Ints, metric: Metric = "both"
) -> Floats:
    """(k,) nearest places of points (k, 6) on a polyline of vertices (v, 6): segment plus fraction.

    They are looked for `reach` segments on either side of `middle`, from `low` to `high`, all (k,).
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
    size = np.einsum("...i,...i->...", way, way)
    share = np.einsum("...i,...i->...", away, way)
    np.divide(share, size, out=share, where=size > 0)
    np.clip(share, 0.0, 1.0, out=share)
    away -= share[..., None] * way
    return share, np.einsum("...i,...i->...", away, away)
