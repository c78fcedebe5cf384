"""Blocks of an NC text as words: each control's grammar, the table that a run of motion blocks becomes, and the line.

A *motion block* consists of axis, vector, knot, weight and feed words with at most one G word of group 01. Runs of
them make up nearly all of a file and are read together; every other line is taken apart on its own.

A grammar reads one line. For texts of millions of lines it reads once for every kind of line (`line_patterns`):
it says where in such a line the numbers stand and what their columns are called.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Floats, Ints

#: code of FANUC's curves, and what stands for those of controls that say it in words
NURBS, BSPLINE, POLY, SPL = 6.2, 901.0, 902.0, 903.0

#: G words of group 01 that a run may contain
MOTION_CODES = (0.0, 1.0, 2.0, 3.0, NURBS)

#: word around the number of a modulo axis that sends it the shorter way; a column of tables with the axis behind it
BY_WORD: Final = "DC"


#: a plus sign, which no code has, and zeros that say nothing in a whole number, but in the name of a program
_ZEROS: Final = re.compile(r"(?<=^[A-NP-Z])0+(?=\d+$)|(?<=^[A-FH-LNP-Z])\+(?:0+(?=\d+$))?(?=[\d.])")


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
        """Its text as tables have it: blanks left out, codes and whole numbers without leading zeros."""
        if self.name in ("G", "M") and self.text[:1] == self.name and not {*"+-"} & {*self.text}:  # no code has a sign
            return f"{self.name}{self.value:g}"
        return self.text if self.name == "block" else _ZEROS.sub("", self.text.replace(" ", "").replace("\t", ""))


def tools_first(words: Iterable[Word]) -> list[Word]:
    """Words of a block in the order in which they act: M6 takes the tool that T chooses, wherever that stands."""
    return sorted(words, key=lambda word: word.name != "T")


#: what a column of a motion block is: a word of the line, or a number that stands for what it says in words
Columns = dict[str, Word | float]


def numbers(columns: Columns) -> dict[str, float]:
    """Numbers of a single motion block."""
    return {name: word if isinstance(word, float) else word.value for name, word in columns.items()}


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


#: fields of a line but its number
_Parts: TypeAlias = tuple[tuple[Word, ...], tuple[str, ...], Word | None, bool, bool]


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


#: a number as controls write it
NUMBER: Final = r"[-+]?(?:\d+\.?\d*|\.\d+)"

#: such that are zero, not below zero, above zero
ZERO: Final = r"\+?(?:0+\.?0*|\.0+)"
NOT_NEGATIVE: Final = r"\+?(?:\d+\.?\d*|\.\d+)"
POSITIVE: Final = rf"(?=[+\d.]*[1-9]){NOT_NEGATIVE}"

#: no control reads so many digits before the point
_LARGEST: Final = 1e12

#: bytes at the end of a chunk in which the begin of a block is looked for first, and next
_TAILS: Final = 1 << 11, 1 << 16

#: lines that a grammar remembers
_REMEMBERED: Final = 4096

_HEAD: Final = re.compile(r"[ \t]*(/\d?)?[ \t]*")


class Lexer:
    """How a control spells its words."""

    #: one word at a time, in upper case
    word: re.Pattern[str]
    #: what the machine does not read
    comment: re.Pattern[str]
    #: the number of a block, before its words
    block_number = re.compile(r"N[ \t]*(\d+)[ \t]*")
    #: what a line begins with that can begin a curve, behind a line end
    begins: re.Pattern[bytes]
    #: lines between motion blocks that say nothing of the motion
    aside = re.compile(rb"[ \t\r]*")
    #: names of words that make a block move the tool or belong to a curve
    places: frozenset[str] = frozenset()
    #: names of words that are worth something else without a decimal point: read on their own, to be complained of
    points: frozenset[str] = frozenset()

    def line(self, text: bytes, number: int, name: str | None) -> Line:
        """Take one line apart.

        Raises
        ------
        InputError
            CS501 where it is not made of words.
        """
        try:
            return Line(number, *self._parts(text))
        except InputError as error:
            raise InputError(error.code, error.what, error.hint, file=name, line=number) from None

    @cached_property
    def _parts(self) -> Callable[[bytes], _Parts]:
        """Fields of a line but its number: a line beside the motion is met three times, and in most programs again."""
        return lru_cache(_REMEMBERED)(self._taken_apart)

    def _taken_apart(self, text: bytes) -> _Parts:
        text = text.removesuffix(b"\n").removesuffix(b"\r")
        line = text.decode("latin-1")
        comments = tuple(next(filter(None, match.groups()), "").strip(" \t") for match in self.comment.finditer(line))
        rest = self.comment.sub(lambda match: " " * len(match[0]), text.upper().decode("latin-1")).rstrip(" \t")
        head = _HEAD.match(rest)
        place = head.end() if head else 0
        block_number = None
        if found := self.block_number.match(rest, place):
            block_number = Word("N", float(found[1]), found[0].strip(), *found.span(1))
            place = found.end()
        tape = rest[place:] == "%"
        words = [] if tape else self.words(rest, place)
        return tuple(words), comments, block_number, bool(head and head[1]), tape

    def words(self, rest: str, place: int) -> list[Word]:
        """Words of a line from a place on; raises CS501, without the line."""
        words: list[Word] = []
        while place < len(rest):
            match = self.word.match(rest, place)
            found = self.named(match) if match else None
            if match is None or found is None or any(abs(word.value) > _LARGEST for word in found):
                what = f"{rest[place : place + 20]!r} is no NC word"
                raise InputError("CS501", what, "give a file written for this control")
            words += found
            place = match.end()
            while place < len(rest) and rest[place] in " \t":
                place += 1
        return words

    def named(self, match: re.Match[str]) -> Iterable[Word] | None:
        """Words of one match of `word`; None where it is none after all."""
        raise NotImplementedError

    def motion(self, line: Line) -> Columns | None:
        """Columns of a motion block; None where the line is something else."""
        given = {word.name: word for word in line.words}
        code = given["G"].text if "G" in given else ""
        # no control knows a code with a sign: such a line is read on its own, to be complained of
        signed = code[:1] == "G" and ("-" in code or "+" in code)
        alone = signed or len(given) < len(line.words) or any(map(self.without_point, line.words))
        return None if alone else self.block(given)

    def without_point(self, word: Word) -> bool:
        """Whether a number may be counted in the least increment of the control; zero is zero in any case."""
        return word.name in self.points and word.value != 0.0 and "." not in word.text

    def block(self, given: Mapping[str, Word]) -> Columns | None:
        """Columns of a block with such words; None where they are no motion block."""
        raise NotImplementedError

    def unfolded(self, chunk: bytes) -> bytes:
        """Return the text with every block on one line, and as many lines as before."""
        return chunk

    def cut(self, piece: bytes) -> int:
        """Where to cut a text so that no curve is cut in two: behind a line end; 0 where there is no such place."""
        for tail in (*_TAILS, len(piece)):
            found = [match.start() for match in self.begins.finditer(piece, max(len(piece) - tail, 0))]
            if found:
                return found[-1] + 1
        return 0


def number_of(match: re.Match[str], group: str | int, name: str) -> Word:
    """Word whose number is a group of a match."""
    start, stop = match.span(group)
    return Word(name, float(match[group]), match[0].strip(), start, stop)


def fixed(match: re.Match[str], name: str, value: float) -> Word:
    """Word that is always written alike."""
    return Word(name, value, match[0].strip())
