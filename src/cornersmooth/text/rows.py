"""Rows of words with numbers, such as ``G1 X9.9838 Y-0.8170 F250.``, many at a time.

Every row of a block is laid out in the same columns of a byte matrix, cells as wide as the largest number of their
column: word, sign, digits in groups of four from tables. What a row does not need stays zero, and one pass over the
matrix drops the zeros.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cornersmooth.errors import OutputError
from cornersmooth.model import Bools, Ints
from cornersmooth.text.layout import WORD, Bytes, Layout, lay_out, put
from cornersmooth.text.ticks import MOST_DECIMALS, TICK_LIMIT

#: rows laid out at a time
BLOCK: Final = 8192

#: rows side by side in `_by_column`
FOLD: Final = 256

#: bytes of a row that are counted in one byte for each column of words
WIDEST: Final = 255 * WORD


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


@dataclass(frozen=True)
class RowFormat:
    """How the words of a row are written.

    Raises
    ------
    ValueError
        For words and decimals that do not match, zero bytes in words, or decimals out of range.
    """

    words: tuple[bytes, ...]  #: What comes before each number, blanks included: ``(b"X", b" Y", b" Z")``
    decimals: tuple[int, ...]  #: Digits after the point of each number; 0 writes no point unless `trim`
    plus: bool = False  #: Write ``+`` before numbers that are not negative
    trim: bool = False  #: Drop trailing zeros but keep the point: ``12.``, ``0.5``
    #: Write ``0.5`` rather than ``.5``. A number never is without any digit: zero is ``0.`` at least where trimmed.
    leading_zero: bool = True

    def __post_init__(self) -> None:
        if len(self.words) != len(self.decimals):
            raise ValueError(f"{len(self.words)} words with {len(self.decimals)} decimals")
        if not all(0 <= places <= MOST_DECIMALS for places in self.decimals):
            raise ValueError(f"decimals are {self.decimals}: give whole numbers from 0 to {MOST_DECIMALS}")
        refuse_zero_bytes(self.words)

    def rows(
        self,
        ticks: Ints,
        prefix: Sequence[bytes],
        prefix_id: ArrayLike,
        suffix: Sequence[bytes],
        suffix_id: ArrayLike,
        left_out: Bools | None = None,
    ) -> tuple[bytes, Ints]:
        """Write rows: prefix, words with their numbers, suffix. Give the text, and where rows start and the last ends.

        `ticks` (m, c) are numbers in steps of their last digit, from `to_ticks`. Prefixes and suffixes, which carry the
        line end, are chosen by ids (m,) or (). Words that a row has not are `left_out` (m, c); where its prefix is
        empty, too, the row begins without a blank. CS301 for ticks beyond `TICK_LIMIT`.
        """
        ticks = np.asarray(ticks, np.int64)
        if ticks.ndim != 2 or ticks.shape[1] != len(self.words):
            raise ValueError(f"ticks of shape {ticks.shape} for {len(self.words)} words")
        m = len(ticks)
        if not m:
            return b"", np.zeros(1, np.int64)
        heads = Choices(prefix, prefix_id, m, align_right=True)
        tails = Choices(suffix, suffix_id, m, align_right=False)
        layout, drop = self._lay_out(ticks, heads.width, tails.width), None
        if left_out is not None:
            empty = np.array([not text for text in prefix])[np.broadcast_to(prefix_id, m)]
            blank = np.array([word[:1] == b" " for word in self.words])
            first = np.argmin(left_out, axis=1)
            drop = left_out, np.where(empty & blank[first], first, -1)
        blocks = list(_write_blocks(ticks, layout, heads, tails, drop))
        offsets = np.zeros(m + 1, np.int64)
        np.cumsum(np.concatenate([lengths for _, lengths in blocks]), out=offsets[1:])
        return b"".join([text for text, _ in blocks]), offsets

    def _lay_out(self, ticks: Ints, head: int, tail: int) -> Layout:
        """Lay out rows for (m, c) ticks between so many bytes at either end."""
        lowest, highest = _by_column(np.minimum, ticks), _by_column(np.maximum, ticks)
        if lowest and not -TICK_LIMIT <= min(lowest) <= max(highest) <= TICK_LIMIT:
            raise OutputError("CS301", "a number is too large to be written", "please report this with the input file")
        largest = [max(-low, high) for low, high in zip(lowest, highest, strict=True)]
        digits = tuple(len(str(n // 10**places)) for n, places in zip(largest, self.decimals, strict=True))
        layout = lay_out(self, digits, tuple(low < 0 for low in lowest), head, tail)
        if len(layout.template) > WIDEST:
            raise ValueError(f"rows of {len(layout.template)} bytes are wider than {WIDEST}")
        return layout


def _by_column(extreme: np.ufunc, ticks: Ints) -> list[int]:
    """Smallest or largest of each column; many rows side by side take a tenth of the time of one below the other."""
    m, columns = ticks.shape
    rest = ticks[m - m % FOLD :]
    if m >= FOLD:
        folded = extreme.reduce(ticks[: m - m % FOLD].reshape(m // FOLD, FOLD * columns), axis=0)
        rest = np.concatenate((folded.reshape(FOLD, columns), rest))
    return extreme.reduce(rest, axis=0).tolist()


def _write_blocks(
    ticks: Ints, layout: Layout, heads: Choices, tails: Choices, drop: tuple[Bools, Ints] | None
) -> Iterator[tuple[bytes, Ints]]:
    """Write rows a block at a time; give the text of each block and the sizes of its rows.

    `drop` is what rows have not: (m, c) words, and the blank of a word (m,), -1 for none.
    """
    m, width = len(ticks), len(layout.template)
    matrix = np.repeat(layout.template[None, :], min(BLOCK, m), axis=0)
    for start in range(0, m, BLOCK):
        stop = min(start + BLOCK, m)
        block = matrix[: stop - start]
        if drop is not None and start:
            block[:] = layout.template
        heads.write(start, stop, block, 0)
        for column, cell in enumerate(layout.cells):
            cell.write(ticks[start:stop, column], block)
        if drop is not None:
            words, blank = (part[start:stop] for part in drop)
            for column, (first, last) in enumerate(layout.spans):
                block[words[:, column], first:last] = 0
                block[blank == column, first] = 0
        tails.write(start, stop, block, layout.tail)
        used = block != 0
        # compress takes the same time for every pattern; a Boolean index is slower for many short runs
        text = block.reshape(-1).compress(used.reshape(-1)).tobytes()
        yield text, _count_by_row(used.view(np.uint64).reshape(-1, width // WORD))


def _count_by_row(used: NDArray[np.uint64]) -> Ints:
    """Count the true bytes of each row: eight sums in the bytes of a word, which are then added."""
    sums = used[:, 0].copy()
    for column in range(1, used.shape[1]):
        sums += used[:, column]
    low = np.uint64(0x00FF00FF00FF00FF)
    pairs = (sums & low) + (sums >> np.uint64(8) & low)
    return (pairs * np.uint64(0x0001000100010001) >> np.uint64(48)).astype(np.int64)


def interleave(which: Ints, texts: Sequence[tuple[bytes, Ints]]) -> bytes:
    """Put texts of rows together in order: `which` (n,) is the text that has each row.

    Texts come with the places (m + 1,) where their rows begin and end.
    """
    edges = [0, *(1 + np.flatnonzero(which[1:] != which[:-1])).tolist(), len(which)]
    at = [0] * len(texts)
    parts = []
    for first, last in pairwise(edges):
        own = int(which[first])
        text, offsets = texts[own]
        stop = at[own] + last - first
        parts.append(text[offsets[at[own]] : offsets[stop]])
        at[own] = stop
    return b"".join(parts)
