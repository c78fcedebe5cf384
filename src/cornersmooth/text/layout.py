"""Where each character of a row goes: columns of a byte matrix, wide enough for every row of a call.

A number is written from right to left, a group of up to four digits at a time, copied from tables of digits as one
element each. Zero bytes are no characters: rows are squeezed when they are complete.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Ints

if TYPE_CHECKING:
    from cornersmooth.text.rows import RowFormat

Bytes = NDArray[np.uint8]
#: entries are unsigned integers of as many bytes as the group has characters
Table = NDArray[np.unsignedinteger[Any]]

#: digits in a full group
GROUP = 4

#: row widths are multiples of so many bytes, for what looks at rows by words
WORD = 8


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


def put(matrix: Bytes, column: int, values: NDArray[Any]) -> None:
    """Store one element for each row, its bytes from `column` on."""
    matrix[:, column : column + values.itemsize].view(values.dtype)[:, 0] = values


@dataclass(frozen=True)
class Group:
    """Digits that are written together: their column, how many, and the texts of all their values in every style."""

    column: int
    digits: int
    table: Table

    def put(self, matrix: Bytes, values: Ints, style: Ints | Bools | int) -> None:
        """Write (r,) values; `style` chooses the row of the table, one for all or one for each."""
        if isinstance(style, int):
            put(matrix, self.column, self.table[int(style)].take(values))
        else:
            put(matrix, self.column, self.table.reshape(-1).take(values + style * 10**self.digits))

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
            group.put(matrix, values, ended)
            if self.form.trim:
                ended = (values == 0) & ended
        # a zero before the point stays where the layout has one, and where it is all there is
        alone: Bools | bool = ended if self.part and not self.form.leading_zero else True
        for group in self.whole[:-1]:
            left, values = group.split(left)
            group.put(matrix, values, np.where(left > 0, 2, alone))
            alone = False
        self.whole[-1].put(matrix, left, alone)


@dataclass(frozen=True)
class Layout:
    """Columns of a row."""

    #: (width,): A row with its constant characters; zero bytes where others are written. The width is a multiple of
    #: `WORD`.
    template: Bytes
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
        whole = [Group(add(bytes(n)), n, whole_table(n)) for n in _groups(before_point, leading=(1, 2, GROUP))]
        part: list[Group] = []
        for n in _groups(places, leading=(1, 2, 3, GROUP)):
            with_point = n % 2 == 1  # elements have 2 or 4 bytes: the point makes an odd group even
            if not part and not with_point:
                add(b".")
            part.append(Group(add(bytes(n + with_point)), n, part_table(n, with_point)))
        if not part and form.trim:
            add(b".")
        cells.append(Cell(form, sign, tuple(whole[::-1]), tuple(part[::-1])))
        spans.append((start, len(row)))
    behind = add(bytes(tail))
    add(bytes(-len(row) % WORD if row else WORD))
    return Layout(np.frombuffer(bytes(row), np.uint8), tuple(cells), tuple(spans), behind)


def _groups(digits: int, leading: tuple[int, ...]) -> list[int]:
    """Sizes of the groups of a run of digits: full ones, and first the smallest of `leading` that holds the rest."""
    if not digits:
        return []
    full = (digits - 1) // GROUP
    first = next(size for size in leading if size >= digits - full * GROUP)
    return [first] + [GROUP] * full
