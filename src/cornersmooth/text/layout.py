"""Where each character of a row goes: columns of a byte matrix, wide enough for every row of a call.

A number is written from right to left, a group of digits at a time. Zero bytes are no characters.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.text.digits import Table, part_table, whole_table

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Bools = NDArray[np.bool_]

#: digits in a full group
GROUP = 4

#: row widths are multiples of so many bytes, for what looks at rows by words
WORD = 8


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

    sign: int | None
    whole: tuple[Group, ...]
    part: tuple[Group, ...]
    plus: bool
    trim: bool
    leading_zero: bool

    def write(self, ticks: Ints, matrix: Bytes) -> None:
        """Write (r,) numbers into (r, width) rows."""
        if self.sign is not None:
            other = ord("+") if self.plus else 0
            matrix[:, self.sign] = (ticks < 0).view(np.uint8) * np.uint8(ord("-") - other) + np.uint8(other)
        left = np.abs(ticks)
        ended: Bools | bool = self.trim  # whether digits may be dropped: only zeros follow
        for group in self.part:
            left, values = group.split(left)
            group.put(matrix, values, ended)
            if self.trim:
                ended = (values == 0) & ended
        # a zero before the point stays where it is asked for, and where it is all there is
        alone: Bools | bool = ended if self.part and not self.leading_zero else True
        for group in self.whole[:-1]:
            left, values = group.split(left)
            group.put(matrix, values, np.where(left > 0, 2, alone))
            alone = False
        self.whole[-1].put(matrix, left, alone)


@dataclass
class Layout:
    """Columns of a row, added from left to right.

    Parameters
    ----------
    template : bytearray
        A row with its constant characters; zero bytes where others are written.
    cells : list of Cell
    """

    template: bytearray = field(default_factory=bytearray)
    cells: list[Cell] = field(default_factory=list)

    def add(self, characters: bytes) -> int:
        """Add columns to the template; return the first."""
        self.template += characters
        return len(self.template) - len(characters)

    def add_number(
        self, lowest: int, highest: int, decimals: int, *, plus: bool, trim: bool, leading_zero: bool
    ) -> None:
        """Add the columns of a number that has from `lowest` to `highest` ticks."""
        sign = self.add(b"\0") if lowest < 0 or plus else None
        digits = len(str(max(-lowest, highest) // 10**decimals))
        whole = [Group(self.add(bytes(n)), n, whole_table(n)) for n in _groups(digits, leading=(1, 2, GROUP))]
        part: list[Group] = []
        for n in _groups(decimals, leading=(1, 2, 3, GROUP)):
            with_point = n % 2 == 1  # elements have 2 or 4 bytes: the point makes an odd group even
            if not part and not with_point:
                self.add(b".")
            part.append(Group(self.add(bytes(n + with_point)), n, part_table(n, with_point)))
        if not part and trim:
            self.add(b".")
        self.cells.append(Cell(sign, tuple(whole[::-1]), tuple(part[::-1]), plus, trim, leading_zero))

    def fill_up(self) -> None:
        """Round the width up to whole words, at least one."""
        self.add(bytes(-len(self.template) % WORD if self.template else WORD))


def _groups(digits: int, leading: tuple[int, ...]) -> list[int]:
    """Sizes of the groups of a run of digits: full ones, and first the smallest of `leading` that holds the rest."""
    if not digits:
        return []
    full = (digits - 1) // GROUP
    first = next(size for size in leading if size >= digits - full * GROUP)
    return [first] + [GROUP] * full
