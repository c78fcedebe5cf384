"""Rows of different length, one after the other in flat arrays: index arithmetic."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cornersmooth.model import Floats, Ints


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
    return begin[row] + place


def batches(counts: Ints, size: int) -> Ints:
    """Rows at which batches of about `size` elements begin, a row or more in each, and the end of the last."""
    return np.append(np.flatnonzero(np.diff(np.cumsum(counts) // size, prepend=-1)), len(counts))


def split(rows: Ints, counts: Ints, size: int) -> list[Ints]:
    """Some rows in parts of about `size` elements each, of which a row has its count."""
    gone = np.cumsum(counts)
    return [part for part in np.split(rows, np.searchsorted(gone, np.arange(size, gone[-1:].sum(), size))) if len(part)]


def search(values: Floats, counts: Ints, row: Ints, place: Floats, side: Literal["left", "right"] = "left") -> Ints:
    """`np.searchsorted` within rows: indices (m,) into values (n,), which are from 0 on and ascending in each row."""
    last = values[starts(counts)[1:] - 1]
    base = starts(np.floor(last).astype(np.int64) + 2)[:-1].astype(np.float64)
    inside = np.clip(place, -0.5, last[row] + 0.5)  # rows lie more than 1 apart
    return np.searchsorted(values + np.repeat(base, counts), inside + base[row], side=side)
