"""NC text to words: line by line where it matters, whole runs of motion blocks at once where nothing else stands.

A *motion block* consists of axis, vector, knot, weight and feed words with at most one G word of group 01. Runs of
them make up nearly all of a file; they become the columns of a `Table`. Every other line is given out on its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import InputError
from cornersmooth.model import Floats, Ints
from cornersmooth.text import NumberError, parse_numbers

#: letters of a motion block; N is a block number and says nothing
MOTION_LETTERS = "GXYZIJKUVWFRPN"

#: letters that make a block move the tool or belong to a curve
_PLACE_LETTERS = frozenset("XYZUVWIJK")

#: G words of group 01 that a run may contain
MOTION_CODES = (0.0, 1.0, 2.0, 3.0, 6.2)

#: bytes read at a time
CHUNK = 1 << 22

_NOT_LETTERS = b"0123456789.-+ \t\r"
_TO_BLANKS = bytes(32 if chr(code).isalpha() or code == 13 else code for code in range(128)) + bytes(range(128, 256))
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*")
_COMMENT = re.compile(r"\(([^)]*)\)|;(.*)$")

#: a number for every letter; sums of them tell sets of letters apart, which `_Signatures` then compares in full
_MARK = np.zeros(256, np.int64)
_MARK[1:] = np.random.default_rng(1).integers(1, 1 << 52, 255)


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


def read_lines(data: bytes | memoryview, name: str | None) -> Iterator[Table | Line]:
    """Give out the text in order, as runs of motion blocks and as other lines.

    Raises
    ------
    InputError
        CS501 where a line is not made of words.
    """
    signatures = _Signatures()
    number = 1
    start = 0
    size = len(data)
    while start < size:
        stop = _cut(data, start, size)
        chunk = bytes(data[start:stop])
        if not chunk.endswith(b"\n"):
            chunk += b"\n"
        yield from _read_chunk(chunk, number, signatures, name)
        number += chunk.count(b"\n")
        start = stop


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


def motion_row(line: Line) -> dict[str, float] | None:
    """Words of a motion block as a dict, or None where the line is something else."""
    row = {letter: value for letter, value, _ in line.words}
    letters = set(row)
    if len(row) != len(line.words) or not letters <= set(MOTION_LETTERS) or not letters & _PLACE_LETTERS:
        return None
    if "G" in row and row["G"] not in MOTION_CODES:
        return None
    return row


def table_of(rows: list[tuple[int, dict[str, float]]]) -> Table:
    """Motion blocks that were read one by one, as a table."""
    letters = sorted({letter for _, row in rows for letter in row})
    return Table(
        np.array([number for number, _ in rows], np.int64),
        {letter: np.array([row.get(letter, np.nan) for _, row in rows]) for letter in letters},
    )


def _cut(data: bytes | memoryview, start: int, size: int) -> int:
    """End of the chunk from `start`: in front of a block with a G word, so that no curve is cut in two."""
    stop = start + CHUNK
    while stop < size:
        piece = bytes(data[start:stop])
        cut = piece.rfind(b"\nG")
        if cut >= 0:
            return start + cut + 1
        stop += CHUNK
    return size


class _Signatures:
    """The letter sequences of lines met so far, and whether such lines can be read in runs."""

    def __init__(self) -> None:
        self.letters: list[bytes] = []
        self.bulk: list[bool] = []

    def classify(self, letters: NDArray[np.uint8], start: Ints, end: Ints) -> Ints:
        """Index into `letters` for every line; the lines' letters are ``letters[start:end]``."""
        marks = _MARK.take(letters)
        marks[end] = 0  # line ends
        sums = np.add.reduceat(marks, start)
        length = end - start
        index = np.full(len(start), -1, np.int64)
        tried = 0
        while True:
            for known in range(tried, len(self.letters)):
                self._match(known, letters, start, length, sums, index)
            tried = len(self.letters)
            missing = np.flatnonzero(index < 0)
            if not len(missing):
                return index
            first = missing[0]
            self._learn(letters[start[first] : end[first]].tobytes())

    def _match(
        self, known: int, letters: NDArray[np.uint8], start: Ints, length: Ints, sums: Ints, index: Ints
    ) -> None:
        pattern = np.frombuffer(self.letters[known], np.uint8)
        rows = np.flatnonzero((sums == _MARK[pattern].sum()) & (length == len(pattern)) & (index < 0))
        if len(rows) and len(pattern):
            same = (letters[start[rows][:, None] + np.arange(len(pattern))] == pattern).all(axis=1)
            rows = rows[same]
        index[rows] = known

    def _learn(self, signature: bytes) -> None:
        text = signature.decode("latin-1")
        self.letters.append(signature)
        self.bulk.append(
            len(set(text)) == len(text) and set(text) <= set(MOTION_LETTERS) and bool(set(text) & _PLACE_LETTERS)
        )


def _read_chunk(chunk: bytes, number: int, signatures: _Signatures, name: str | None) -> Iterator[Table | Line]:
    letters = np.frombuffer(chunk.translate(None, _NOT_LETTERS), np.uint8)
    end = np.flatnonzero(letters == 10)
    start = np.concatenate(([0], end[:-1] + 1))
    index = signatures.classify(letters, start, end)
    bulk = np.array(signatures.bulk)[index]
    stops = np.flatnonzero(np.frombuffer(chunk, np.uint8) == 10) + 1  # byte after each line end
    starts = np.concatenate(([0], stops[:-1]))
    edges = np.flatnonzero(np.diff(bulk, prepend=~bulk[0], append=~bulk[-1]))
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if bulk[first]:
            text = chunk[starts[first] : stops[last - 1]]
            table = _read_run(text, index[first:last], number + first, signatures)
            if table is not None:
                yield table
                continue
        for row in range(first, last):
            yield tokenise(chunk[starts[row] : stops[row]], number + row, name)


def _read_run(text: bytes, index: Ints, number: int, signatures: _Signatures) -> Table | None:
    """Numbers of a run of lines with known letters; None where they are not what the letters promise."""
    raw = np.frombuffer(text, np.uint8)
    if ((raw[:-1] >= ord("A")) & (raw[1:] <= ord(" "))).any():  # a letter without its number right behind it
        return None
    patterns = [letters.decode("latin-1") for letters in signatures.letters]
    count = np.array([len(pattern) for pattern in patterns])[index]
    try:
        values = parse_numbers(text.translate(_TO_BLANKS))
    except NumberError:
        return None
    if len(values) != count.sum():
        return None
    line = np.arange(number, number + len(index))
    kinds = np.flatnonzero(np.bincount(index, minlength=len(patterns)))
    if len(kinds) == 1:
        pattern = patterns[kinds[0]]
        columns = dict(zip(pattern, values.reshape(-1, len(pattern)).T, strict=True))
    else:
        first = np.cumsum(count) - count
        columns = {letter: np.full(len(index), np.nan) for kind in kinds for letter in patterns[kind]}
        for kind in kinds:
            rows = np.flatnonzero(index == kind)
            place = first[rows]
            for k, letter in enumerate(patterns[kind]):
                columns[letter][rows] = values[place + k]
    if "G" in columns:
        code = columns["G"]
        if not (np.isnan(code) | np.isin(code, MOTION_CODES)).all():
            return None
    return Table(line, columns)
