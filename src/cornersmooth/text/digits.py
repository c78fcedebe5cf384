"""Tables of digits: groups of up to four, ready to be copied into rows of text as one element each.

A zero byte is no character: rows are squeezed when they are complete.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: entries are unsigned integers of as many bytes as the group has characters
Table = NDArray[np.unsignedinteger[Any]]


@cache
def whole_table(digits: int) -> Table:
    """(3, 10**digits) digits before the point, of a group of 1, 2 or 4.

    By what stands around the group: row 0 drops all leading zeros, row 1 keeps the last digit, row 2 keeps all.
    """
    shown = _characters(digits)
    significant = np.logical_or.accumulate(shown != ord("0"), axis=1)
    bare = np.where(significant, shown, 0)
    units = bare.copy()
    units[:, -1] = shown[:, -1]
    return _pack(bare, units, shown)


@cache
def part_table(digits: int, point: bool) -> Table:
    """(2, 10**digits) digits after the point, of a group of 1 to 4; `point` puts the point in front of them.

    Row 0 keeps all digits, row 1 drops trailing zeros.
    """
    shown = _characters(digits)
    significant = np.logical_or.accumulate(shown[:, ::-1] != ord("0"), axis=1)[:, ::-1]
    trimmed = np.where(significant, shown, 0)
    if point:
        shown, trimmed = (np.insert(group, 0, ord("."), axis=1) for group in (shown, trimmed))
    return _pack(shown, trimmed)


def _characters(digits: int) -> NDArray[np.uint8]:
    """(10**digits, digits) ASCII digits of 0, 1, 2, ..."""
    power = 10 ** np.arange(digits)[::-1]
    return (np.arange(10**digits)[:, None] // power % 10 + ord("0")).astype(np.uint8)


def _pack(*groups: NDArray[np.uint8]) -> Table:
    stacked = np.ascontiguousarray(np.stack(groups), np.uint8)
    packed: Table = stacked.view(f"u{stacked.shape[-1]}")[..., 0]
    packed.flags.writeable = False
    return packed
