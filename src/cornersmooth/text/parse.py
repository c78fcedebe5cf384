"""Text to float64, a block at a time, without a Python loop over numbers.

The bytes of a block that are not digits (separators, points, signs) cut it into fields. The digits on either side of
a point are fetched as eight-byte words and turned into integers by three multiplications, all fields at once.
Mantissa and power of ten are exact in float64, so their quotient is the correctly rounded value: what `float` gives.
Fields that do not fit (exponents, more digits than float64 holds) go to `float` itself, one by one.

A byte string read as a little-endian word has its last character on top. Once the values of eight digits stand in the
bytes of a word, three multiplications join them to pairs, to fours, to all.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints

BLOCK: Final = 1 << 16  #: bytes taken at a time: the block and the arrays made from it stay in the second-level cache
_LOOK_BACK: Final = 256  #: bytes searched at a time for the separator that a block ends with
#: bytes in front of a block in its work area, so that the words of its first field are fetched like all others
_MARGIN: Final = 16
#: what a number may consist of; `float` alone would also take ``1_000``, ``nan`` and ``inf``
_ALPHABET: Final = b"0123456789+-.eEdD"
_FORTRAN: Final = bytes.maketrans(b"dD", b"eE")
_WHITE: Final = b" \t\r\n"
_SEPARATOR, _POINT, _SIGN, _OTHER = range(4)
_KIND: Final = np.full(256, _OTHER, np.uint8)
_KIND[list(_WHITE + b",")] = _SEPARATOR
_KIND[list(b".")] = _POINT
_KIND[list(b"+-")] = _SIGN
_POWER: Final = np.array([float(f"1e{n}") for n in range(23)])  #: powers of ten that float64 holds exactly
_EXACT: Final = 2.0**53  #: mantissas below are exact in float64


def parse_numbers(data: bytes) -> Floats:
    """(m,) all numbers of a text, each bit for bit what `float` makes of it.

    Numbers are between any mix of blanks, tabs, line ends and commas. Exponents may be written with D. ValueError for
    a field that is no number, or one that float64 cannot hold: who reads it again with care says where.
    """
    text = np.frombuffer(data, np.uint8)
    # every separator is at or below the comma: never fewer places than numbers, and untouched ones cost no memory
    places = sum(np.count_nonzero(text[k : k + BLOCK] <= ord(",")) for k in range(0, len(text), BLOCK))
    numbers = np.empty(places + 1)
    count = start = 0
    while start < len(text):
        stop = _block_end(text, start)
        found = _parse_block(text[start:stop])
        numbers[count : count + len(found)] = found
        count += len(found)
        start = stop
    return numbers[:count]


def _block_end(text: Bytes, start: int) -> int:
    """End of the block that begins at `start`: just after a separator, or the end of the text."""
    stop = start + BLOCK
    while stop < len(text):
        tail = text[max(start, stop - _LOOK_BACK) : stop]
        separators = np.flatnonzero(_KIND.take(tail) == _SEPARATOR)
        if len(separators):
            return stop - len(tail) + int(separators[-1]) + 1
        stop += BLOCK
    return len(text)


def _parse_block(block: Bytes) -> Floats:
    """Parse the whole fields of a block."""
    area = np.zeros(_MARGIN + len(block) + 1, np.uint8)
    area[_MARGIN:-1] = block
    area[-1] = ord("\n")  # closes the last field
    text = area[_MARGIN:]

    special = np.flatnonzero(text - np.uint8(ord("0")) > 9)  # what is below "0" wraps round to large numbers
    kind = _KIND.take(text.take(special))
    end = special.compress(kind == _SEPARATOR)
    start = np.concatenate(([0], end[:-1] + 1))
    filled = start < end
    if not filled.all():
        start, end = start.compress(filled), end.compress(filled)
    if not len(end):
        return np.empty(0)

    first = text.take(start)
    minus = first == ord("-")
    signed = minus | (first == ord("+"))
    point, careful = _find_points(special.compress(kind == _POINT), start, end)
    whole = point - start - signed  # digits before the point
    part = np.maximum(end - point - 1, 0)  # digits after it
    careful |= (whole > DIGITS) | (part > 2 * DIGITS) | (whole + part == 0)
    if len(special) != np.count_nonzero(kind <= _POINT) + np.count_nonzero(signed):
        strange = special.compress(kind >= _SIGN)
        strange = strange[~np.isin(strange, start[signed])]
        careful[np.searchsorted(end, strange)] = True
    part[careful] = 0

    scale = _POWER.take(part)
    mantissa = _digits(area, point, whole) * scale
    mantissa += _digits(area, end, np.minimum(part, DIGITS))
    if part.max() > DIGITS:
        mantissa += _digits(area, end - DIGITS, np.maximum(part - DIGITS, 0)) * _POWER[DIGITS]
    careful |= mantissa >= _EXACT  # below it every term and the sum are exact
    numbers = mantissa / scale
    numbers *= 1.0 - 2.0 * minus
    if careful.any():
        raw = block.tobytes()
        for i in np.flatnonzero(careful).tolist():
            numbers[i] = _careful(raw[start[i] : end[i]])
    return numbers


def _find_points(points: Ints, start: Ints, end: Ints) -> tuple[Ints, Bools]:
    """Place of the point in each field, the field's end where it has none; and which fields have more than one."""
    if len(points) == len(end) and (start <= points).all() and (points < end).all():
        return points, np.zeros(len(end), np.bool_)
    first = np.searchsorted(points, start)
    count = np.searchsorted(points, end) - first
    return np.where(count > 0, np.append(points, 0)[first], end), count > 1


def _digits(area: Bytes, stop: Ints, count: Ints) -> Words:
    """Read the integers whose `count` (0 to 8) digits end before `stop`."""
    word = words_of(area)[stop + (_MARGIN - DIGITS)].view("<u8")
    word &= LAST_DIGITS.take(count, mode="clip")  # other counts are read with care afterwards
    return join_digits(word)


def _careful(field: bytes) -> float:
    """Read one field by `float`, once it is sure to be plain decimal."""
    number = float("nan" if field.translate(None, _ALPHABET) else field.translate(_FORTRAN))
    if not math.isfinite(number):
        raise ValueError(field)
    return number


Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]
DIGITS: Final = 8  #: digits that one word holds
_NIBBLES: Final = 0x0F0F0F0F0F0F0F0F  #: the value of an ASCII digit in each byte
#: keeps the values of the last k digits of a word, k from 0 to 8
LAST_DIGITS: Final = np.array([(((1 << (8 * k)) - 1) << (64 - 8 * k)) & _NIBBLES for k in range(9)], np.uint64)
_PAIRS, _FOURS = np.uint64(0x00FF00FF00FF00FF), np.uint64(0x0000FFFF0000FFFF)  #: what to keep of pairs and of fours


def words_of(text: Bytes) -> NDArray[np.void]:
    """(n - 7,) view of a text, the eight bytes from every place on; take some and view them as ``<u8``."""
    return np.ndarray((len(text) - DIGITS + 1,), f"V{DIGITS}", buffer=text.data, strides=(1,))


def join_digits(words: Words) -> Words:
    """Turn words of eight digit values, masked by `LAST_DIGITS`, into integers, in place."""
    words *= np.uint64((10 << 8) + 1)
    words >>= np.uint64(8)
    words &= _PAIRS
    words *= np.uint64((10**2 << 16) + 1)
    words >>= np.uint64(16)
    words &= _FOURS
    words *= np.uint64((10**4 << 32) + 1)
    words >>= np.uint64(32)
    return words
