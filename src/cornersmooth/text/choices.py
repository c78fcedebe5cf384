"""Texts that rows choose from: short ones are laid out with the row, long ones put in afterwards."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cornersmooth.text.layout import WORD, put

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]

#: size of the largest text that is laid out with its row
LONGEST_LAID_OUT: Final = 32


class Choices:
    """One text for each of m rows.

    Parameters
    ----------
    ids : (m,) or () int
        Which text each row has.
    align_right : bool
        Fill up on the left rather than on the right: zero bytes that are together are dropped together.
    """

    def __init__(self, texts: Sequence[bytes], ids: ArrayLike, count: int, *, align_right: bool) -> None:
        self._texts = texts
        given = np.asarray(ids)
        self._ids = np.full(count, given) if given.ndim == 0 else given
        if self._ids.shape != (count,):
            raise ValueError(f"ids of shape {given.shape} for {count} rows")
        if count and not 0 <= self._ids.min() <= self._ids.max() < len(texts):
            raise IndexError(f"ids from {self._ids.min()} to {self._ids.max()} for {len(texts)} texts")
        refuse_zero_bytes(texts)
        used = np.bincount(self._ids, minlength=len(texts)).tolist()
        inside = [
            text if number and len(text) <= LONGEST_LAID_OUT else b"" for text, number in zip(texts, used, strict=True)
        ]
        self._outside = np.array([len(text) if len(text) > LONGEST_LAID_OUT else 0 for text in texts], np.int64)
        longest = max(map(len, inside), default=0)
        self.width = next((w for w in (0, 1, 2, 4) if longest <= w), -(-longest // WORD) * WORD)
        fill = bytes.rjust if align_right else bytes.ljust
        table = np.frombuffer(b"".join(fill(text, self.width, b"\0") for text in inside), np.uint8)
        element = min(self.width, WORD)
        self._columns = [
            np.ascontiguousarray(table.reshape(-1, self.width)[:, column : column + element]).view(f"u{element}")[:, 0]
            for column in range(0, self.width, WORD)
        ]

    def write(self, start: int, stop: int, matrix: Bytes, column: int) -> None:
        """Write the laid-out texts of rows `start` to `stop` from `column` on."""
        for place, values in enumerate(self._columns):
            put(matrix, column + place * WORD, values.take(self._ids[start:stop]))

    def outside(self, start: int, stop: int) -> Ints:
        """Sizes of the texts of rows `start` to `stop` that are not laid out, 0 for the others."""
        return self._outside.take(self._ids[start:stop])

    @property
    def all_laid_out(self) -> bool:
        """Whether no text is too long for that."""
        return not self._outside.any()

    def __getitem__(self, row: int) -> bytes:
        return self._texts[int(self._ids[row])]


def refuse_zero_bytes(texts: Sequence[bytes]) -> None:
    """Raise ValueError where a text has a zero byte: it would be lost with those that fill up."""
    for text in texts:
        if b"\0" in text:
            raise ValueError(f"zero byte in {text!r}")


def splice(text: bytes, lengths: Ints, start: int, heads: Choices, tails: Choices) -> tuple[bytes, Ints]:
    """Put the long texts of rows `start`, `start` + 1, ... before and after what is laid out of them.

    Parameters
    ----------
    lengths : (r,) int64
        Size of each row in it.

    Returns
    -------
    text : bytes
    lengths : (r,) int64
    """
    before, after = (texts.outside(start, start + len(lengths)) for texts in (heads, tails))

    def pieces() -> Iterator[bytes]:
        done = 0
        end = np.cumsum(lengths)
        for row in np.flatnonzero(before + after).tolist():
            if before[row]:
                yield text[done : end[row] - lengths[row]]
                yield heads[start + row]
                done = end[row] - lengths[row]
            if after[row]:
                yield text[done : end[row]]
                yield tails[start + row]
                done = end[row]
        yield text[done:]

    return b"".join(pieces()), lengths + before + after
