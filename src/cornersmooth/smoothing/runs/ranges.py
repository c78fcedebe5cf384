"""Index arithmetic for rows of different length that stand one behind the other in a flat array."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Ints


def starts(counts: Ints) -> Ints:
    """(k + 1,) where each row begins, and where the last ends."""
    return np.concatenate((np.zeros(1, np.int64), np.cumsum(counts, dtype=np.int64)))


def spread(counts: Ints) -> tuple[Ints, Ints]:
    """Row of every element, and its place within the row."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(starts(counts)[:-1], counts)


def ranges(begin: Ints, counts: Ints) -> Ints:
    """Concatenation of ``begin[i] .. begin[i] + counts[i] - 1``."""
    row, place = spread(counts)
    whole: Ints = begin[row] + place
    return whole
