"""Blocks of an NC text as words: the table that a run of motion blocks becomes, and the single line.

A *motion block* consists of axis, vector, knot, weight and feed words with at most one G word of group 01. Runs of
them make up nearly all of a file and are read by `block_tables`; every other line is taken apart here on its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Floats, Ints

#: letters of a motion block; N is a block number and says nothing
MOTION_LETTERS = "GXYZIJKUVWFRPN"

#: letters that make a block move the tool or belong to a curve
PLACE_LETTERS = frozenset("XYZUVWIJK")

#: code of FANUC's curves, and what stands for those of controls that say it in words
NURBS, BSPLINE, POLY, SPL = 6.2, 901.0, 902.0, 903.0

#: G words of group 01 that a run may contain
MOTION_CODES = (0.0, 1.0, 2.0, 3.0, NURBS)

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*")
_COMMENT = re.compile(r"\(([^)]*)\)|;(.*)$")


@dataclass(frozen=True)
class Table:
    """A run of motion blocks: one column per letter, NaN where a block has no such word.

    Parameters
    ----------
    line : (r,) int64
        NC line of each block.
    columns : dict of str to (r,) float64
        Only letters that occur.
    """

    line: Ints
    columns: dict[str, Floats]

    def __len__(self) -> int:
        return len(self.line)

    def column(self, letter: str) -> Floats:
        """(r,) float64: the words of one letter, NaN where there is none."""
        found = self.columns.get(letter)
        return np.full(len(self), np.nan) if found is None else found

    def rows_with(self, letters: Iterable[str], code: float) -> Ints:
        """Rows with any of some words, but for arcs, whose I J K are no vector; `code` is the G word before the run."""
        given = np.any([~np.isnan(self.column(letter)) for letter in letters], axis=0)
        own = self.column("G")
        last = np.maximum.accumulate(np.where(np.isnan(own), -1, np.arange(len(own))))
        own = np.where(last < 0, code, own[last])
        rows: Ints = np.flatnonzero(given & (own != 2) & (own != 3))
        return rows


@dataclass(frozen=True)
class Line:
    """One line that is not part of a run.

    Parameters
    ----------
    number : int
    words : tuple of (letter, value, text)
    comments : tuple of str
    """

    number: int
    words: tuple[tuple[str, float, str], ...]
    comments: tuple[str, ...]


def tokenise(text: bytes, number: int, name: str | None) -> Line:
    """Take one line apart.

    Raises
    ------
    InputError
        CS501
    """
    line = text.decode("latin-1").strip()
    comments = tuple((first or second or "").strip() for first, second in _COMMENT.findall(line))
    rest = _COMMENT.sub("", line).strip().upper().lstrip("/").lstrip()
    if rest == "%":
        rest = ""
    words = []
    place = 0
    while place < len(rest):
        match = _WORD.match(rest, place)
        if match is None:
            raise InputError(
                "CS501",
                f"{rest[place : place + 20]!r} is no NC word",
                "give a file written for this control",
                file=name,
                line=number,
            )
        words.append((match[1], float(match[2]), match[0].strip()))
        place = match.end()
    return Line(number, tuple(words), comments)


def table_of(rows: list[tuple[int, dict[str, float]]]) -> Table:
    """Motion blocks that were read one by one, as a table."""
    letters = sorted({letter for _, row in rows for letter in row})
    return Table(
        np.array([number for number, _ in rows], np.int64),
        {letter: np.array([row.get(letter, np.nan) for _, row in rows]) for letter in letters},
    )
