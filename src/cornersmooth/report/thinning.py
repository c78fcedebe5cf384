"""Fewer points for long paths, without losing what matters."""

from __future__ import annotations

import numpy as np

from cornersmooth.arrays.vectors import norm
from cornersmooth.model import Bools, Floats, Ints


def thinned(points: Floats, weight: Floats, must: Bools, most: int) -> Ints:
    """Rows (r,) of a path (n, 3) to keep, ascending: about so many at most, beside those that must stay.

    Of every group of neighbours its first and last point are kept, the one farthest from the chord between them, and
    the one of the largest weight, where NaN counts as nothing.
    """
    n = len(points)
    if n <= most:
        return np.arange(n)
    size = -(-4 * n // most)
    first = np.arange(0, n, size)
    last = np.minimum(first + size, n) - 1
    group = np.arange(n) // size
    start = points[first][group]
    chord = (points[last] - points[first])[group]
    length, arm = norm(chord), points - start
    off = np.where(length < 1e-9, norm(arm), norm(np.cross(arm, chord)) / np.maximum(length, 1e-12))
    keep = must.copy()
    keep[first] = keep[last] = True
    for values in (off, np.nan_to_num(weight, nan=-1.0)):
        keep[_largest(values, first, group)] = True
    return np.flatnonzero(keep)


def _largest(values: Floats, first: Ints, group: Ints) -> Ints:
    """First row with the largest value in each group."""
    top = np.maximum.reduceat(values, first)
    rows = np.flatnonzero(values == top[group])
    _, one = np.unique(group[rows], return_index=True)
    return rows[one]
