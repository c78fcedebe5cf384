"""Blocks of an NC text as words: the table that a run of motion blocks becomes, and the single line.

A *motion block* consists of axis, vector, knot, weight and feed words with at most one G word of group 01. Runs of
them make up nearly all of a file and are read together; every other line is taken apart on its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Floats, Ints

#: code of FANUC's curves, and what stands for those of controls that say it in words
NURBS, BSPLINE, POLY, SPL = 6.2, 901.0, 902.0, 903.0

#: G words of group 01 that a run may contain
MOTION_CODES = (0.0, 1.0, 2.0, 3.0, NURBS)

#: word around the number of a modulo axis that sends it the shorter way; a column of tables with the axis behind it
BY_WORD: Final = "DC"


class Word(NamedTuple):
    """A word of a line."""

    name: str  #: the same for all controls where it means the same: vectors are I J K, second points U V W
    value: float
    text: str  #: as written
    #: start, stop: where in the line the digits stand that may differ from block to block; equal where the word is
    #: always the same, as G1 is
    start: int = 0
    stop: int = 0

    @property
    def fixed(self) -> bool:
        """Whether the word has no number of its own."""
        return self.start == self.stop

    @property
    def spelling(self) -> str:
        """Its text as tables have it: blanks left out, codes without leading zeros."""
        if self.name in ("G", "M") and self.text[:1] == self.name and not {*"+-"} & {*self.text}:  # no code has a sign
            return f"{self.name}{self.value:g}"
        return self.text if self.name == "block" else self.text.replace(" ", "").replace("\t", "")


def tools_first(words: Iterable[Word]) -> list[Word]:
    """Words of a block in the order in which they act: M6 takes the tool that T chooses, wherever that stands."""
    return sorted(words, key=lambda word: word.name != "T")


#: what a column of a motion block is: a word of the line, or a number that stands for what it says in words
Columns = dict[str, Word | float]


@dataclass(frozen=True)
class Table:
    """A run of motion blocks: one column per letter, NaN where a block has no such word."""

    line: Ints  #: (r,): NC line of each block
    columns: dict[str, Floats]  #: only letters that occur

    def __len__(self) -> int:
        return len(self.line)

    @property
    def closed(self) -> bool:
        """Whether it starts with a G word, so that what stands before it ends no curve in it."""
        first = self.columns.get("G")
        return first is not None and not np.isnan(first[0])

    def row(self, row: int) -> dict[str, float]:
        """Words of one block."""
        return {letter: float(column[row]) for letter, column in self.columns.items() if not np.isnan(column[row])}

    def column(self, letter: str) -> Floats:
        """(r,) float64: the words of one letter, NaN where there is none."""
        found = self.columns.get(letter)
        return np.full(len(self), np.nan) if found is None else found

    def last_before(self, row: int, letters: Iterable[str]) -> dict[str, float]:
        """Words of some letters that stand last before a row."""
        given = {letter: self.columns[letter][:row] for letter in letters if letter in self.columns}
        return {letter: float(part[~np.isnan(part)][-1]) for letter, part in given.items() if not np.isnan(part).all()}

    def rows_with(self, letters: Iterable[str], code: float) -> Ints:
        """Rows with any of some words, but for arcs, whose I J K are no vector; `code` is the G word before the run."""
        given = np.any([~np.isnan(self.column(letter)) for letter in letters], axis=0)
        own, _ = filled(self.column("G"), code)
        return np.flatnonzero(given & (own != 2) & (own != 3))


def filled(values: Floats, before: float) -> tuple[Floats, Ints]:
    """Give what was written last in each row, and in which row, -1 for before."""
    missing, row = np.isnan(values), np.arange(len(values))
    if not missing.any():
        return values, row
    last = np.maximum.accumulate(np.where(missing, -1, row))
    return np.where(last < 0, before, values[last]), last


@dataclass(frozen=True)
class Line:
    """One line that is not part of a run."""

    number: int
    words: tuple[Word, ...]  #: without the block number
    comments: tuple[str, ...] = ()
    block_number: Word | None = None
    skipped: bool = False  #: whether a slash stands before the block: the operator chooses whether it is executed
    tape: bool = False  #: whether it is a bare ``%``


def refused(line: Line, what: str, hint: str) -> InputError:
    """Error for words that make it impossible to tell where the tool is."""
    return InputError("CS503", what, hint, line=line.number)


def table_of(rows: Sequence[tuple[int, Mapping[str, float]]]) -> Table:
    """Motion blocks that were read one by one, as a table."""
    letters = sorted({letter for _, row in rows for letter in row})
    return Table(
        np.array([number for number, _ in rows], np.int64),
        {letter: np.array([row.get(letter, np.nan) for _, row in rows]) for letter in letters},
    )


def joined_tables(tables: Sequence[Table], few: int) -> Sequence[Table]:
    """Neighbouring tables as few tables, in order.

    One, where a curve may go on from one table into the next, or where they have no more than `few` rows each.
    """
    if len(tables) == 1 or (all(table.closed for table in tables) and sum(map(len, tables)) > few * len(tables)):
        return tables
    letters = sorted({letter for table in tables for letter in table.columns})
    line = np.concatenate([table.line for table in tables])
    return [Table(line, {name: np.concatenate([table.column(name) for table in tables]) for name in letters})]
