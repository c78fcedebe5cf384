"""Texts that rows choose from, laid out in columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cornersmooth.text.layout import WORD, put

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]


class Choices:
    """One text for each of m rows; `ids` (m,) or () say which.

    Texts are filled up on the right, or with `align_right` on the left: zero bytes that are together are dropped
    together.
    """

    def __init__(self, texts: Sequence[bytes], ids: ArrayLike, count: int, *, align_right: bool) -> None:
        given = np.asarray(ids)
        self._ids = np.full(count, given) if given.ndim == 0 else given
        if self._ids.shape != (count,):
            raise ValueError(f"ids of shape {given.shape} for {count} rows")
        if count and not 0 <= self._ids.min() <= self._ids.max() < len(texts):
            raise IndexError(f"ids from {self._ids.min()} to {self._ids.max()} for {len(texts)} texts")
        refuse_zero_bytes(texts)
        used = np.bincount(self._ids, minlength=len(texts)).tolist()
        texts = [text if number else b"" for text, number in zip(texts, used, strict=True)]
        longest = max(map(len, texts), default=0)
        self.width = next((w for w in (0, 1, 2, 4) if longest <= w), -(-longest // WORD) * WORD)
        fill = bytes.rjust if align_right else bytes.ljust
        table = np.frombuffer(b"".join(fill(text, self.width, b"\0") for text in texts), np.uint8)
        element = min(self.width, WORD)
        self._columns = [
            np.ascontiguousarray(table.reshape(-1, self.width)[:, column : column + element]).view(f"u{element}")[:, 0]
            for column in range(0, self.width, WORD)
        ]

    def write(self, start: int, stop: int, matrix: Bytes, column: int) -> None:
        """Write the texts of rows `start` to `stop` from `column` on."""
        for place, values in enumerate(self._columns):
            put(matrix, column + place * WORD, values.take(self._ids[start:stop]))


def refuse_zero_bytes(texts: Sequence[bytes]) -> None:
    """Raise ValueError where a text has a zero byte: it would be lost with those that fill up."""
    for text in texts:
        if b"\0" in text:
            raise ValueError(f"zero byte in {text!r}")
