"""Columns of numbers with the same number of decimals, read eight digits at a time.

What posts write is regular: in one column of motion blocks every number has the same decimals. Its digits, without
the point, then fit one machine word, and the value is that integer over a power of ten: exactly what `float` gives.
Whatever is not regular is left to `cornersmooth.text.parse_numbers`.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Ints

Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]

#: bytes that must stand before the first number, so that a word that ends with it can be fetched
MARGIN: Final = 16

#: numbers taken at a time; the work arrays stay in the cache
_BLOCK: Final = 1 << 13

#: digits that one word holds
_WORD: Final = 8

#: longest text that is looked at as a constant column
_SHORT: Final = 4

_POINT, _MINUS = ord("."), ord("-")

_LOW = np.uint64(0x0F0F0F0F0F0F0F0F)
_ZEROS = np.uint64(0x3030303030303030)
_HIGH_HALF = np.uint64(0xF0F0F0F0F0F0F0F0)
_SIX = np.uint64(0x0606060606060606)
#: keeps the last k bytes of a word
_KEEP = np.array([0] + [((1 << (8 * k)) - 1) << (64 - 8 * k) for k in range(1, 9)], np.uint64)


def words_of(raw: Bytes) -> Words:
    """(n - 7,) view of a text: the eight bytes from every place on, as one number."""
    return np.ndarray((len(raw) - 7,), np.dtype("<u8"), buffer=raw.data, strides=(1,))


def read_column(raw: Bytes, words: Words, start: Ints, end: Ints) -> Floats | None:
    """Read the numbers of one column.

    Parameters
    ----------
    raw : (n,) uint8
        The text, with at least `MARGIN` bytes before the first number.
    words : (n - 7,) uint64
        `words_of` it.
    start, end : (k,) int64
        First byte of every number, and the byte behind it.

    Returns
    -------
    (k,) float64, or None where a field is no number or has too many digits for this way of reading.
    """
    same = _constant(words, start, end, raw[start[0] : end[0]].tobytes())
    if same is not None:
        return same
    values = np.empty(len(start))
    decimals = _decimals(raw, int(start[0]), int(end[0]))
    for begin in range(0, len(start), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        own_start, own_end = start[part], end[part]
        block = _read_block(raw, words, own_start, own_end, decimals)
        if block is None:
            block = _read_mixed(raw, words, own_start, own_end)
        if block is None:
            return None
        values[part] = block
    return values


def _decimals(raw: Bytes, start: int, end: int) -> int:
    """Return the decimals of a number as written, -1 without a point."""
    text = raw[start:end].tobytes()
    point = text.find(b".")
    return len(text) - 1 - point if point >= 0 else -1


def _read_mixed(raw: Bytes, words: Words, start: Ints, end: Ints) -> Floats | None:
    """Numbers with different decimals: one round for each."""
    values = np.empty(len(start))
    rows = np.arange(len(start))
    while len(rows):
        decimals = _decimals(raw, int(start[rows[0]]), int(end[rows[0]]))
        same = np.ones(len(rows), np.bool_)
        if decimals >= 0:
            same = (raw[end[rows] - 1 - decimals] == _POINT) & (end[rows] - start[rows] > decimals)
        elif len(rows) > 1:  # without a point the rest cannot be told apart by one place
            same[1:] = False
        chosen = rows[same]
        block = _read_block(raw, words, start[chosen], end[chosen], decimals)
        if block is None:
            return None
        values[chosen] = block
        rows = rows[~same]
    return values


def _constant(words: Words, start: Ints, end: Ints, first: bytes) -> Floats | None:
    """Column that is the same short text throughout."""
    length = len(first)
    if not 0 < length <= _SHORT or not ((end - start) == length).all():
        return None
    tail = words[end - 8] >> np.uint64(64 - 8 * length)
    if not (tail == tail[0]).all():
        return None
    try:
        return np.full(len(start), float(first))
    except ValueError:
        return None


def _read_block(raw: Bytes, words: Words, start: Ints, end: Ints, decimals: int) -> Floats | None:
    if decimals >= _WORD:
        return None
    minus = raw.take(start) == _MINUS
    count = end - start - minus  # digits, and the point
    word = words[end - 8]
    if decimals >= 0:
        count -= 1
        if not (raw.take(end - 1 - decimals) == _POINT).all():
            return None
        word = _without_point(raw, word, end, decimals)
    if count.min() < 1 or count.max() > _WORD:
        return None
    keep = _KEEP.take(count)
    if (((word ^ _ZEROS) & _HIGH_HALF) & keep).any() or (((word & _LOW) + _SIX) & _HIGH_HALF & keep).any():
        return None
    word &= _LOW
    word &= keep
    # eight decimal digits to an integer: pairs, then fours, then all (first digit in the lowest byte)
    word = (word * np.uint64(10) + (word >> np.uint64(8))) & np.uint64(0x00FF00FF00FF00FF)
    word = (word * np.uint64(100) + (word >> np.uint64(16))) & np.uint64(0x0000FFFF0000FFFF)
    word = (word * np.uint64(10000) + (word >> np.uint64(32))) & np.uint64(0x00000000FFFFFFFF)
    values = word.astype(np.float64)
    np.negative(values, out=values, where=minus)
    if decimals > 0:
        values /= 10.0**decimals
    return values


def _without_point(raw: Bytes, word: Words, end: Ints, decimals: int) -> Words:
    """Close the gap that the point leaves: the bytes before it move one place towards the end."""
    high = _KEEP[decimals]
    before = (word << np.uint64(8)) & ~high
    first = raw.take(end - _WORD - 1).astype(np.uint64)  # the byte that comes in at the low end
    closed: Words = (word & high) | before | first
    return closed
