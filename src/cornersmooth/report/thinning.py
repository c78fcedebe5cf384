"""Fewer points for long paths, without losing what matters."""

from __future__ import annotations

import numpy as np

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
    length = np.maximum(np.linalg.norm(chord, axis=1), 1e-12)
    arm = points - start
    off = np.linalg.norm(np.cross(arm, chord), axis=1) / length
    flat = np.linalg.norm(chord, axis=1) < 1e-9
    off[flat] = np.linalg.norm(arm[flat], axis=1)
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
