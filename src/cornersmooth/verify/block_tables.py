"""Runs of motion blocks, read at once: chunks of text to tables, and other lines given out one by one."""

from __future__ import annotations

import io
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.text import NumberError, parse_numbers
from cornersmooth.verify.fixed import MARGIN, read_column, words_of
from cornersmooth.verify.lexer import Lexer
from cornersmooth.verify.line_patterns import LinePatterns, lines_of
from cornersmooth.verify.words import Line, Table

#: bytes read at a time
CHUNK = 1 << 20

_TO_BLANKS = bytes(32 if chr(code).isalpha() or code in b"\r," else code for code in range(128)) + b" " * 128
#: bytes that are no part of a number and no blank between words
_SPEAKS = bytes(code not in b"0123456789.-+ \t\r" for code in range(256))

_LINE_END, _BLANK = 10, 32


class Readable(Protocol):
    """What text is read from."""

    def read(self, size: int, /) -> bytes:
        """Next bytes, at most so many; none at the end."""


def read_lines(
    data: bytes | Readable,
    name: str | None,
    lexer: Lexer | None = None,
    *,
    patterns: LinePatterns | None = None,
    number: int = 1,
) -> Iterator[Table | Line]:
    """Give out the text in order, as runs of motion blocks and as other lines.

    Parameters
    ----------
    data : bytes or file, open at its start
    name : str or None
        For messages.
    lexer : Lexer, optional
        Of the control; single letters by default.
    patterns : LinePatterns, optional
        Those met so far in the same text.
    number : int
        Of the first line.

    Raises
    ------
    InputError
        CS501 where a line is not made of words.
    """
    lexer = lexer or Lexer()
    if patterns is None:
        patterns = LinePatterns(lexer.columns, numbered=lexer.numbered)
    for chunk in _chunks(data, lexer):
        number += yield from _read_chunk(chunk, number, lexer, patterns, name)


def _chunks(data: bytes | Readable, lexer: Lexer) -> Iterator[bytes]:
    """Pieces of the text, cut where no curve is cut in two."""
    file = io.BytesIO(data) if isinstance(data, bytes) else data
    rest = b""
    while True:
        more = file.read(CHUNK)
        chunk = rest + more
        if not chunk:
            return
        cut = lexer.cut(chunk) if more else len(chunk)
        chunk, rest = chunk[:cut], chunk[cut:]
        if not cut:
            continue
        if not chunk.endswith(b"\n"):
            chunk += b"\n"
        yield chunk


class _Signatures:
    """The letter sequences of lines met so far, and the columns of those that can be read in runs."""

    def __init__(self, lexer: Lexer) -> None:
        self.lexer = lexer
        self.letters: list[bytes] = []
        self.columns: list[tuple[str, ...] | None] = []

    def classify(self, letters: NDArray[np.uint8], start: Ints, end: Ints) -> Ints:
        """Index into `letters` for every line; the lines' letters are ``letters[start:end]``."""
        length = end - start
        head = np.where(length > 0, letters[np.minimum(start, len(letters) - 1)], 0)
        index = np.full(len(start), -1, np.int64)
        tried = 0
        while True:
            for known in range(tried, len(self.letters)):
                self._match(known, letters, start, length, head, index)
            tried = len(self.letters)
            missing = np.flatnonzero(index < 0)
            if not len(missing):
                return index
            first = missing[0]
            self._learn(letters[start[first] : end[first]].tobytes())

    def _match(
        self, known: int, letters: NDArray[np.uint8], start: Ints, length: Ints, head: NDArray[np.uint8], index: Ints
    ) -> None:
        pattern = np.frombuffer(self.letters[known], np.uint8)
        same = length == len(pattern)
        if len(pattern):
            same &= head == pattern[0]
        same &= index < 0
        rows = np.flatnonzero(same)
        if len(rows) and len(pattern) > 1:
            found = letters[start[rows][:, None] + np.arange(1, len(pattern))]
            rows = rows[(found == pattern[1:]).all(axis=1)]
        index[rows] = known

    def _learn(self, signature: bytes) -> None:
        self.letters.append(signature)
        self.columns.append(self.lexer.columns(signature))


@dataclass(frozen=True)
class _Chunk:
    """Lines of a chunk, and where the letters and numbers of each are.

    Parameters
    ----------
    raw : (n,) uint8
        The text behind `MARGIN` line ends.
    place : (p,) int64
        Every byte that is no digit, point, sign or blank: letters, line ends, anything strange.
    first, last : (l,) int64
        Each line's letters are ``place[first:last]``; ``place[last]`` is its end.
    index : (l,) int64
        Signature of each line.
    """

    raw: NDArray[np.uint8]
    place: Ints
    first: Ints
    last: Ints
    index: Ints

    def text(self, row: int, stop: int) -> bytes:
        """Lines ``row`` to ``stop`` (excluded) as written."""
        begin = int(self.place[self.last[row - 1]]) + 1 if row else MARGIN
        return self.raw[begin : int(self.place[self.last[stop - 1]]) + 1].tobytes()


def _read_chunk(
    chunk: bytes, number: int, lexer: Lexer, patterns: LinePatterns, name: str | None
) -> Generator[Table | Line, None, int]:
    """Give out the lines of a chunk and return how many there are."""
    chunk = lexer.unfolded(chunk)
    text = lexer.respell(chunk)
    lines = lines_of(text, patterns)
    if lines is None:
        yield from _read_carefully(chunk, text, number, _Signatures(lexer), name)
        return text.count(b"\n")

    def table(start: int, stop: int) -> Table | None:
        return lexer.table(Table(np.arange(number + start, number + stop), lines.columns(start, stop)))

    yield from _in_order(lines.bulk(), table, lines.text, chunk, text, number, lexer, name)
    return len(lines.start)


def _in_order(
    bulk: Bools,
    table_of: Callable[[int, int], Table | None],
    text_of: Callable[[int], bytes],
    chunk: bytes,
    text: bytes,
    number: int,
    lexer: Lexer,
    name: str | None,
) -> Iterator[Table | Line]:
    """Runs as tables, and one by one the other lines and those of runs that turn out to be none."""
    edges = np.flatnonzero(np.diff(bulk, prepend=~bulk[0], append=~bulk[-1]))
    written: list[bytes] = []
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if bulk[start]:
            table = table_of(start, stop)
            if table is not None:
                yield table
                continue
        if text is not chunk and not written:
            written = chunk.split(b"\n")
        for row in range(start, stop):
            yield lexer.line(written[row] if written else text_of(row), number + row, name)


def _read_carefully(
    chunk: bytes, text: bytes, number: int, signatures: _Signatures, name: str | None
) -> Iterator[Table | Line]:
    lexer = signatures.lexer
    raw = np.frombuffer(b"\n" * MARGIN + text, np.uint8)
    place = np.flatnonzero(np.frombuffer(text.translate(_SPEAKS), np.bool_)) + MARGIN
    letters = raw[place]
    last = np.flatnonzero(letters == _LINE_END)
    first = np.concatenate(([0], last[:-1] + 1))
    found = _Chunk(raw, place, first, last, signatures.classify(letters, first, last))
    bulk = np.array([columns is not None for columns in signatures.columns])[found.index]

    def table(start: int, stop: int) -> Table | None:
        return _read_run(found, start, stop, signatures, number)

    def line(row: int) -> bytes:
        return found.text(row, row + 1)

    yield from _in_order(bulk, table, line, chunk, text, number, lexer, name)


def _read_run(chunk: _Chunk, start: int, stop: int, signatures: _Signatures, number: int) -> Table | None:
    """Run of lines with known letters; None where the numbers are not what the letters promise."""
    if not _begin_with_letters(chunk, start, stop, numbered=signatures.lexer.numbered):
        return None
    index = chunk.index[start:stop]
    patterns = {k: signatures.columns[k] or () for k in np.flatnonzero(np.bincount(index)).tolist()}
    fields = _fields(chunk, start, stop, index, patterns)
    if fields is None:
        fields = _irregular_fields(chunk, start, stop, index, patterns, numbered=signatures.lexer.numbered)
    if fields is None:
        return None
    columns: dict[str, Floats] = {}
    for rows, pattern, numbers in fields:
        for letter, values in zip(pattern, numbers, strict=True):
            if len(patterns) == 1:
                columns[letter] = values
            else:
                column = columns.setdefault(letter, np.full(stop - start, np.nan))
                column[rows] = values
    return signatures.lexer.table(Table(np.arange(number + start, number + stop), columns))


def _begin_with_letters(chunk: _Chunk, start: int, stop: int, *, numbered: bool) -> bool:
    """Whether lines begin with their first letter, or with a number and a blank before it."""
    begin = _line_starts(chunk, start, stop)
    end = chunk.place[chunk.first[start:stop]]
    if not numbered:
        return bool((begin == end).all())
    if not ((end - begin >= 2) & (chunk.raw[end - 1] == _BLANK)).all():
        return False
    return read_column(chunk.raw, words_of(chunk.raw), begin, end - 1) is not None


def _line_starts(chunk: _Chunk, start: int, stop: int) -> Ints:
    """First byte of lines."""
    ends = chunk.place[chunk.last[max(start - 1, 0) : stop - 1]] + 1
    return ends if start else np.concatenate(([MARGIN], ends))


_Patterns = dict[int, tuple[str, ...]]
_Fields = list[tuple[Ints, tuple[str, ...], list[Floats]]]


def _fields(chunk: _Chunk, start: int, stop: int, index: Ints, patterns: _Patterns) -> _Fields | None:
    """Numbers of every signature's lines, column by column; None where the columns are not regular."""
    raw, words = chunk.raw, words_of(chunk.raw)
    first = chunk.first[start:stop]
    found: _Fields = []
    for k, pattern in patterns.items():
        rows = np.flatnonzero(index == k)
        own = first[rows]
        numbers: list[Floats] = []
        for column in range(len(pattern)):
            begin = chunk.place[own + column] + 1
            end = chunk.place[own + column + 1]
            end = end - (raw[end - 1] <= _BLANK)
            values = read_column(raw, words, begin, end)
            if values is None:
                return None
            numbers.append(values)
        found.append((rows, pattern, numbers))
    return found


def _irregular_fields(
    chunk: _Chunk, start: int, stop: int, index: Ints, patterns: _Patterns, *, numbered: bool
) -> _Fields | None:
    """Numbers of all lines at once."""
    text = chunk.text(start, stop)
    raw = np.frombuffer(text, np.uint8)
    if ((raw[:-1] >= ord("A")) & (raw[1:] <= _BLANK)).any():  # a letter without its number right behind it
        return None
    try:
        values = parse_numbers(text.translate(_TO_BLANKS))
    except NumberError:
        return None
    count = chunk.last[start:stop] - chunk.first[start:stop] + numbered
    if len(values) != count.sum():
        return None
    first = np.cumsum(count) - count + numbered
    found: _Fields = []
    for k, pattern in patterns.items():
        rows = np.flatnonzero(index == k)
        found.append((rows, pattern, [values[first[rows] + column] for column in range(len(pattern))]))
    return found
