"""Eight digits at a time: the one place where characters become integers.

A byte string read as a little-endian word has its last character on top. Once the values of eight digits stand in the
bytes of a word, three multiplications join them to pairs, to fours, to all.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]
DIGITS: Final = 8  #: digits that one word holds
_NIBBLES: Final = 0x0F0F0F0F0F0F0F0F
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
