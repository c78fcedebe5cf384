"""Rows of words with numbers, such as ``G1 X9.9838 Y-0.8170 F250.``, many at a time.

Every row of a block is laid out in the same columns of a byte matrix, cells as wide as the largest number of their
column: word, sign, digits from right to left in groups of up to four, copied from tables as one element each. What a
row does not need stays zero, and one pass over the matrix drops the zeros.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cornersmooth.errors import OutputError
from cornersmooth.model import Bools, Ints
from cornersmooth.text.ticks import TICK_LIMIT

BLOCK: Final = 8192  #: rows laid out at a time
GROUP: Final = 4  #: digits in a full group
_END: Final = b"\1"  #: stands behind each row that is taken by itself

Bytes = NDArray[np.uint8]
Table = NDArray[np.unsignedinteger[Any]]  #: entries are unsigned integers of as many bytes as the group has characters


@dataclass(frozen=True)
class RowFormat:
    """How the words of a row are written."""

    words: tuple[bytes, ...]  #: What comes before each number, blanks included: ``(b"X", b" Y", b" Z")``
    decimals: tuple[int, ...]  #: Digits after the point of each number; 0 writes no point unless `trim`
    plus: bool = False  #: Write ``+`` before numbers that are not negative
    trim: bool = False  #: Drop trailing zeros but keep the point: ``12.``, ``0.5``
    #: Write ``0.5`` rather than ``.5``. A number never is without any digit: zero is ``0.`` at least where trimmed.
    leading_zero: bool = True

    def rows(
        self,
        ticks: Ints,
        prefix: Sequence[bytes],
        prefix_id: ArrayLike,
        suffix: Sequence[bytes],
        suffix_id: ArrayLike,
        left_out: Bools | None = None,
    ) -> bytes:
        """Text of rows: prefix, words with their numbers, suffix.

        `ticks` (m, c) are numbers in steps of their last digit, from `to_ticks`. Prefixes and suffixes, which carry the
        line end, are chosen by ids (m,) or (). Words that a row has not are `left_out` (m, c); where its prefix is
        empty, too, the row begins without a blank. CS301 for ticks beyond `TICK_LIMIT`.
        """
        ticks = np.asarray(ticks, np.int64)
        m = len(ticks)
        if not m:
            return b""
        heads, tails = (_chosen(*ends, m) for ends in ((prefix, prefix_id), (suffix, suffix_id)))
        lowest, highest = ([int(extreme(column)) for column in ticks.T] for extreme in (np.min, np.max))
        largest = [max(-low, high) for low, high in zip(lowest, highest, strict=True)]
        if max(largest, default=0) > TICK_LIMIT:
            raise OutputError("CS301", "a number is too large to be written", "please report this with the input file")
        digits = tuple(len(str(n // 10**places)) for n, places in zip(largest, self.decimals, strict=True))
        sizes = heads.itemsize, tails.itemsize
        layout, drop = lay_out(self, digits, tuple(low < 0 for low in lowest), *sizes), None
        if left_out is not None:
            empty = np.array([not text for text in prefix])[np.broadcast_to(prefix_id, m)]
            blank = np.array([word[:1] == b" " for word in self.words])
            first = np.argmin(left_out, axis=1)
            drop = left_out, np.where(empty & blank[first], first, -1)
        return b"".join(_write_blocks(ticks, layout, heads, tails, drop))

    def each(
        self,
        ticks: Ints,
        prefix: Sequence[bytes],
        prefix_id: ArrayLike,
        suffix: Sequence[bytes],
        suffix_id: ArrayLike,
        left_out: Bools | None = None,
    ) -> list[bytes]:
        """Text of each of these rows."""
        ended = [text + _END for text in suffix]
        return self.rows(ticks, prefix, prefix_id, ended, suffix_id, left_out).split(_END)[:-1]


def interleave(which: Ints, rows: Sequence[list[bytes]]) -> bytes:
    """Put rows together in order: `which` (n,) says from which list each comes."""
    following = [iter(some) for some in rows]
    return b"".join([next(following[own]) for own in which.tolist()])


def _chosen(texts: Sequence[bytes], ids: ArrayLike, count: int) -> NDArray[np.void]:
    """(m,) text of each of so many rows, filled up with zero bytes; `ids` (m,) or () say which."""
    own = np.broadcast_to(ids, count)
    if any(b"\0" in text for text in texts):  # it would be lost with those that fill up
        raise ValueError("zero byte in a text")
    used = np.bincount(own, minlength=len(texts)).tolist()
    longest = max(len(text) for text, number in zip(texts, used, strict=True) if number)
    filled = b"".join(text[:longest].ljust(longest, b"\0") for text in texts)
    return np.frombuffer(filled, f"V{longest}").take(own) if longest else np.zeros(count, "V0")


def _write_blocks(
    ticks: Ints, layout: Layout, heads: NDArray[np.void], tails: NDArray[np.void], drop: tuple[Bools, Ints] | None
) -> Iterator[bytes]:
    """Write rows a block at a time; `drop` are words (m, c) that they have not, and whose blank (m,), -1 for none."""
    m = len(ticks)
    matrix = np.repeat(layout.template[None, :], min(BLOCK, m), axis=0)
    for start in range(0, m, BLOCK):
        here = slice(start, min(start + BLOCK, m))
        block = matrix[: here.stop - start]
        if drop is not None and start:
            block[:] = layout.template
        _put(block, 0, heads[here])
        for column, cell in enumerate(layout.cells):
            cell.write(ticks[here, column], block)
        if drop is not None:
            words, blank = (part[here] for part in drop)
            for column, (first, last) in enumerate(layout.spans):
                block[words[:, column], first:last] = 0
                block[blank == column, first] = 0
        _put(block, layout.tail, tails[here])
        yield block.tobytes().translate(None, b"\0")


def _put(matrix: Bytes, column: int, values: NDArray[Any]) -> None:
    """Store one element for each row, its bytes from `column` on."""
    if values.itemsize:
        matrix[:, column : column + values.itemsize].view(values.dtype)[:, 0] = values


@cache
def _whole_table(digits: int) -> Table:
    """(3 · 10**digits,) digits before the point: all leading zeros dropped, then the last digit kept, then all."""
    shown = _characters(digits)
    bare = np.where(np.logical_or.accumulate(shown != ord("0"), axis=1), shown, 0)
    units = bare.copy()
    units[:, -1] = shown[:, -1]
    return _packed(bare, units, shown)


@cache
def _part_table(digits: int, point: bool) -> Table:
    """(2 · 10**digits,) digits after the point: all, then without trailing zeros; `point` puts one in front of them."""
    shown = _characters(digits)
    trimmed = np.where(np.logical_or.accumulate(shown[:, ::-1] != ord("0"), axis=1)[:, ::-1], shown, 0)
    return _packed(*(np.insert(group, 0, ord("."), axis=1) if point else group for group in (shown, trimmed)))


def _characters(digits: int) -> Bytes:
    """(10**digits, digits) ASCII digits of 0, 1, 2, ..."""
    power = 10 ** np.arange(digits)[::-1]
    return (np.arange(10**digits)[:, None] // power % 10 + ord("0")).astype(np.uint8)


def _packed(*groups: NDArray[Any]) -> Table:
    packed: Table = np.concatenate(groups).astype(np.uint8).view(f"u{groups[0].shape[1]}")[:, 0]
    packed.flags.writeable = False
    return packed


@dataclass(frozen=True)
class Group:
    """Digits that are written together: their column, how many, and the texts of all their values in every style."""

    column: int
    digits: int
    table: Table

    def write(self, matrix: Bytes, numbers: Ints, style: Ints | Bools | int) -> None:
        """Write the last digits of (r,) numbers; `style` chooses the part of the table."""
        _put(matrix, self.column, self.table.take(numbers + style * 10**self.digits))

    def split(self, numbers: Ints) -> tuple[Ints, Ints]:
        """Cut off the last digits: what is left, and the group's values."""
        left = numbers // 10**self.digits
        return left, numbers - left * 10**self.digits


@dataclass(frozen=True)
class Cell:
    """One number of a row: the column of its sign (None where it needs none), its groups from right to left."""

    form: RowFormat
    sign: int | None
    whole: tuple[Group, ...]
    part: tuple[Group, ...]

    def write(self, ticks: Ints, matrix: Bytes) -> None:
        """Write (r,) numbers into (r, width) rows."""
        if self.sign is not None:
            other = ord("+") if self.form.plus else 0
            matrix[:, self.sign] = (ticks < 0).view(np.uint8) * np.uint8(ord("-") - other) + np.uint8(other)
        left = np.abs(ticks)
        ended: Bools | bool = self.form.trim  # whether digits may be dropped: only zeros follow
        for group in self.part:
            left, values = group.split(left)
            group.write(matrix, values, ended)
            if self.form.trim:
                ended = (values == 0) & ended
        # a zero before the point stays where the layout has one, and where it is all there is
        alone: Bools | bool = ended if self.part and not self.form.leading_zero else True
        for group in self.whole[:-1]:
            left, values = group.split(left)
            group.write(matrix, values, np.where(left > 0, 2, alone))
            alone = False
        self.whole[-1].write(matrix, left, alone)


@dataclass(frozen=True)
class Layout:
    """Columns of a row."""

    template: Bytes  #: (width,): A row with its constant characters; zero bytes where others are written
    cells: tuple[Cell, ...]
    spans: tuple[tuple[int, int], ...]  #: first column of each word with its number, and the one behind it
    tail: int  #: first column of what stands behind the numbers; what stands before them begins in column 0


@lru_cache(maxsize=256)
def lay_out(form: RowFormat, digits: tuple[int, ...], negative: tuple[bool, ...], head: int, tail: int) -> Layout:
    """Lay out rows: `head` columns, each word with a number, `tail` columns.

    Every number has at most so many `digits` before the point, and a place for its sign where some of its column are
    `negative`.
    """
    row = bytearray(head)

    def add(characters: bytes) -> int:
        row.extend(characters)
        return len(row) - len(characters)

    cells, spans = [], []
    for word, places, before_point, some_negative in zip(form.words, form.decimals, digits, negative, strict=True):
        start = add(word)
        sign = add(b"\0") if form.plus or some_negative else None
        whole = [Group(add(bytes(n)), n, _whole_table(n)) for n in _groups(before_point, leading=(1, 2, GROUP))]
        part: list[Group] = []
        for n in _groups(places, leading=(1, 2, 3, GROUP)):
            with_point = n % 2 == 1  # elements have 2 or 4 bytes: the point makes an odd group even
            if not part and not with_point:
                add(b".")
            part.append(Group(add(bytes(n + with_point)), n, _part_table(n, with_point)))
        if not part and form.trim:
            add(b".")
        cells.append(Cell(form, sign, tuple(whole[::-1]), tuple(part[::-1])))
        spans.append((start, len(row)))
    behind = add(bytes(tail))
    return Layout(np.frombuffer(bytes(row), np.uint8), tuple(cells), tuple(spans), behind)


def _groups(digits: int, leading: tuple[int, ...]) -> list[int]:
    """Sizes of the groups of a run of digits: full ones, and first the smallest of `leading` that holds the rest."""
    if not digits:
        return []
    full = (digits - 1) // GROUP
    first = next(size for size in leading if size >= digits - full * GROUP)
    return [first] + [GROUP] * full
