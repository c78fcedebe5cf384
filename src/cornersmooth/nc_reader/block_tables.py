"""Text to tables: runs of motion blocks at once, and the other lines one by one.

Lines of few digit patterns are nearly every text and are read by `line_patterns`. Where a chunk has too many patterns,
or numbers of another kind, its lines are known by what stands between the numbers, which are parsed all at once.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import InputError
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.line_patterns import Group, LinePatterns, lines_of, merged
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


class RunLines(Protocol):
    """Lines of a chunk, of which those that stand in runs can be read together."""

    def bulk(self) -> Bools:
        """(l,) whether each line can be read in a run."""

    def columns(self, rows: Ints) -> dict[str, Floats] | None:
        """Numbers of lines that stand in a run, NaN where a line has none; None if the run is none."""


def read_lines(
    data: bytes | Readable,
    name: str | None,
    lexer: Lexer,
    *,
    patterns: LinePatterns | None = None,
    number: int = 1,
    show: Callable[[bytes], None] = lambda lines: None,
) -> Iterator[Table | Line]:
    """Give out the text in order, as runs of motion blocks and as other lines.

    Parameters
    ----------
    data : bytes or file, open at its start
    lexer : Lexer
        Of the control.
    patterns : LinePatterns, optional
        Those met so far in the same text.
    number : int
        Of the first line.
    show : callable
        Gets lines in which the digits of all others stand, before these are given out.

    Raises
    ------
    InputError
        CS501 where a line is not made of words.
    """
    patterns = patterns or LinePatterns(lexer)
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
    lines: RunLines, chunk: bytes, number: int, lexer: Lexer, name: str | None
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
        self._numbers = find_numbers(text, lexer)
        kinds = _BLOCK_NUMBER.sub(rb"\g<1>0", self._numbers.marked()).split(b"\n")[:-1]
        known = {kind: _LineKind.of(kind.replace(_MARK, _ANY_NUMBER), lexer) for kind in set(kinds)}
        self._kinds = [known[kind] for kind in kinds]

    def bulk(self) -> Bools:
        """(l,) whether each line can be read in a run."""
        return np.array([kind is not None for kind in self._kinds])

    def columns(self, rows: Ints) -> dict[str, Floats] | None:
        """Numbers of lines that stand in a run, NaN where a line has none; None if the run is none."""
        kinds = [self._kinds[row] for row in rows.tolist()]
        try:
            values = self._numbers.values
        except NumberError:  # too large
            return None
        begin = self._numbers.first[rows]
        order = {kind: k for k, kind in enumerate(dict.fromkeys(kinds))}
        label = np.array([order[kind] for kind in kinds])
        groups: list[Group] = []
        for kind, k in order.items():
            assert kind is not None
            own = np.flatnonzero(label == k)
            numbers = [
                np.full(len(own), column) if isinstance(column, float) else values[begin[own] + column]
                for column in kind.columns.values()
            ]
            groups.append((own, tuple(kind.columns), numbers))
        return merged(groups, len(rows))


@dataclass(frozen=True)
class Numbers:
    """Where the numbers of a text are that differ from block to block (`Lexer.measure`), m of them."""

    text: NDArray[np.uint8]  #: (n,): ends with a line end
    start: Ints  #: (m,)
    stop: Ints  #: (m,)

    def marked(self) -> bytes:
        """The text with a mark instead of each number."""
        marked, kept = self.text.copy(), ~self._inside
        marked[marked == _MARK[0]] = ord("?")
        marked[self.start] = _MARK[0]
        kept[self.start] = True
        return marked[kept].tobytes()

    @cached_property
    def values(self) -> Floats:
        """(m,) The numbers."""
        written, kept = np.where(self._inside, self.text, ord(" ")), self._inside.copy()
        kept[self.stop] = True
        return parse_numbers(written[kept].astype(np.uint8).tobytes())

    @cached_property
    def first(self) -> Ints:
        """(l,) Number of the first one of each line, or behind it."""
        ends = np.flatnonzero(self.text == _LINE_END)
        return np.searchsorted(self.start, np.concatenate(([0], ends[:-1] + 1)))

    @cached_property
    def _inside(self) -> Bools:
        """(n,) whether a byte belongs to a number."""
        edges = np.zeros(len(self.text) + 1, np.int8)
        edges[self.start] = 1
        edges[self.stop] -= 1
        return np.cumsum(edges[:-1], dtype=np.int8) > 0


def find_numbers(text: bytes, lexer: Lexer) -> Numbers:
    """Numbers of a text as `Lexer.measure` finds them; those of most controls all at once."""
    raw = np.frombuffer(text, np.uint8)
    if lexer.measure is Lexer.measure:
        return Numbers(raw, *_plain_numbers(raw))
    spans = np.array([match.span() for match in lexer.measure.finditer(text)], np.int64).reshape(-1, 2)
    return Numbers(raw, spans[:, 0], spans[:, 1])


def _plain_numbers(raw: NDArray[np.uint8]) -> tuple[Ints, Ints]:
    """Starts and stops of `Lexer.measure`: digits with a point, perhaps a sign before; a second point ends them."""
    point = raw == ord(".")
    edges = np.flatnonzero(np.diff(point | _digit(raw), prepend=False, append=False))
    start, stop = edges[::2], edges[1::2]
    points = np.append(np.flatnonzero(point), [len(raw)] * 2)
    own = np.searchsorted(points, start)
    stop = np.minimum(stop, points[own + 1])
    with_point = (points[own] < stop) & (stop - start > 1)
    start, stop = start[with_point], stop[with_point]
    before, farther = (np.where(start >= k, raw[start - k], _LINE_END) for k in (1, 2))
    signed = (before == ord("+")) | (before == ord("-"))
    taken = (farther == ord("G")) | (farther == ord(".")) | _digit(farther)
    free = before != ord("G")
    return (start - (signed & ~taken))[free], stop[free]


def _digit(raw: NDArray[np.uint8]) -> Bools:
    return raw - np.uint8(ord("0")) <= np.uint8(9)


@dataclass(frozen=True, eq=False)
class _LineKind:
    """What lines have in common that differ in their numbers only."""

    count: int  #: numbers of a line
    columns: dict[str, int | float]  #: which of them stands in a column, or the value that all lines have there

    @classmethod
    def of(cls, kind: bytes, lexer: Lexer) -> _LineKind | None:
        """Kind of a line in which all numbers are `_ANY_NUMBER`; None for lines that are read on their own."""
        try:
            line = lexer.line(kind, 0, None)
        except InputError:
            return None
        found = None if line.comments or line.skipped else lexer.motion(line)
        if found is None:
            return None
        place = {match.start(): k for k, match in enumerate(re.finditer(re.escape(_ANY_NUMBER), kind))}
        columns: dict[str, int | float] = {}
        for name, word in found.items():
            if isinstance(word, float) or word.start not in place:
                columns[name] = word if isinstance(word, float) else word.value
            else:
                columns[name] = place[word.start]
        return cls(len(place), columns)
