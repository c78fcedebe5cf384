"""Text to tables: runs of motion blocks at once, and the other lines one by one.

Lines of few digit patterns are nearly every text and are read by `line_patterns`. Where a chunk has too many patterns,
or numbers of another kind, its lines are known by what stands between the numbers, which are parsed all at once.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Generator, Iterator
from functools import cache, cached_property
from typing import Final, Protocol

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.line_patterns import Group, LinePatterns, Lines, lines_of, merged
from cornersmooth.nc_reader.words import Line, Table
from cornersmooth.text import NumberError, parse_numbers

#: bytes read at a time
CHUNK = 1 << 21

#: stands for a number where only the kind of line matters: no sign or digit may stand before or behind it
_ANY_NUMBER: Final = b"+1.5"
_LINE_END: Final = np.uint8(ord("\n"))
#: stands for it in a text that is searched for kinds of lines
_MARK: Final = b"\x01"
_BLOCK_NUMBER: Final = re.compile(rb"^(N?)\d+(?= )", re.MULTILINE)


class Readable(Protocol):
    """What text is read from."""

    def read(self, size: int, /) -> bytes:
        """Next bytes, at most so many; none at the end."""


def read_lines(
    data: bytes | Readable,
    name: str | None,
    lexer: Lexer,
    show: Callable[[bytes], None] = lambda lines: None,
) -> Iterator[Table | Line]:
    """Give out the text in order, as runs of motion blocks and as other lines.

    Parameters
    ----------
    data : bytes or file, open at its start
    show : callable
        Gets lines in which the digits of all others stand, before these are given out.

    Raises
    ------
    InputError
        CS501 where a line is not made of words.
    """
    patterns, number = LinePatterns(lexer), 1
    for chunk in _chunks(data, lexer):
        chunk = lexer.unfolded(chunk)
        lines = lines_of(chunk, patterns)
        if lines is None or patterns.fresh:
            show(chunk if lines is None else b"\n".join(patterns.fresh))
            patterns.fresh.clear()
        number += yield from _in_order(lines or LetteredLines(chunk, lexer), chunk, number, lexer, name)


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


def _in_order(
    lines: Lines | LetteredLines, chunk: bytes, number: int, lexer: Lexer, name: str | None
) -> Generator[Table | Line, None, int]:
    """Give out the lines of a chunk, runs as tables and the others one by one; return how many there are.

    Lines of runs that turn out to be none are given out one by one, too; asides within a run follow it.
    """
    bulk = lines.bulk()

    @cache
    def ends() -> Ints:  # most chunks of some texts have no line that is read on its own
        return np.flatnonzero(np.frombuffer(chunk, np.uint8) == _LINE_END)

    def text(row: int) -> bytes:
        return chunk[int(ends()[row - 1]) + 1 if row else 0 : int(ends()[row])]

    within = bulk.copy()
    if lexer.aside is not None:
        others = np.flatnonzero(~bulk).tolist()
        within[[row for row in others if lexer.aside.fullmatch(text(row))]] = True
    edges = np.flatnonzero(np.diff(within, prepend=~within[0], append=~within[-1]))
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        rows = start + np.flatnonzero(bulk[start:stop])
        columns = lines.columns(rows) if len(rows) else None
        single = np.arange(start, stop)
        if columns is not None:
            single = single[~bulk[start:stop]]
            before = int(np.searchsorted(single, rows[0]))
            for row in single[:before].tolist():
                yield lexer.line(text(row), number + row, name)
            yield Table(number + rows, columns)
            single = single[before:]
        for row in single.tolist():
            yield lexer.line(text(row), number + row, name)
    return len(bulk)


class LetteredLines:
    """Lines known by what stands between their numbers: slower than digit patterns, for numbers of any kind.

    Parameters
    ----------
    text : bytes
        Ends with a line end.
    """

    def __init__(self, text: bytes, lexer: Lexer) -> None:
        self._text, self._lexer = text, lexer
        marked = lexer.measure.sub(_MARK, text.replace(_MARK, b"?"))
        kinds = _BLOCK_NUMBER.sub(rb"\g<1>0", marked).split(b"\n")[:-1]
        known = {kind: _line_kind(kind.replace(_MARK, _ANY_NUMBER), lexer) for kind in set(kinds)}
        self._kinds = [known[kind] for kind in kinds]
        self._counts = [kind.count(_MARK) for kind in kinds]

    def bulk(self) -> Bools:
        """(l,) whether each line can be read in a run."""
        return np.array([kind is not None for kind in self._kinds])

    @cached_property
    def _numbers(self) -> tuple[Floats, Ints]:
        """All numbers, and which is the first one of each line."""
        values = parse_numbers(b"\n".join([*self._lexer.measure.findall(self._text), b""]))
        return values, np.cumsum([0, *self._counts[:-1]])

    def columns(self, rows: Ints) -> dict[str, Floats] | None:
        """Numbers of lines that stand in a run, NaN where a line has none; None if the run is none."""
        try:
            values, first = self._numbers
        except NumberError:  # too large
            return None
        begin = first[rows]
        own: dict[int, tuple[_Kind, list[int]]] = {}
        for place, row in enumerate(rows.tolist()):
            kind = self._kinds[row]
            assert kind is not None
            own.setdefault(id(kind), (kind, []))[1].append(place)
        groups: list[Group] = []
        for kind, places in own.values():
            numbers = [
                np.full(len(places), column) if isinstance(column, float) else values[begin[places] + column]
                for column in kind.values()
            ]
            groups.append((places, tuple(kind), numbers))
        return merged(groups, len(rows))


#: columns of lines that differ in their numbers only: which number stands there, or the value that all have
_Kind = dict[str, int | float]


def _line_kind(line: bytes, lexer: Lexer) -> _Kind | None:
    """Kind of a line in which all numbers are `_ANY_NUMBER`; None for lines that are read on their own."""
    try:
        taken = lexer.line(line, 0, None)
    except InputError:
        return None
    found = None if taken.comments or taken.skipped else lexer.motion(taken)
    if found is None:
        return None
    return {
        name: word
        if isinstance(word, float)
        else line[: word.start].count(_ANY_NUMBER)
        if line.startswith(_ANY_NUMBER, word.start) and not word.fixed
        else word.value
        for name, word in found.items()
    }
