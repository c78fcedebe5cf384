"""Text to tables: runs of motion blocks at once, and the other lines one by one."""

from __future__ import annotations

import io
from bisect import bisect_left
from collections.abc import Callable, Generator, Iterator
from typing import Protocol

import numpy as np

from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.line_patterns import LinePatterns, Lines
from cornersmooth.nc_reader.words import Line, Table

#: bytes read at a time
CHUNK = 1 << 20


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
        lines = Lines.of(chunk, patterns)
        if patterns.fresh:
            show(b"\n".join(patterns.fresh))
            patterns.fresh.clear()
        number += yield from _in_order(lines, number, lexer, name)


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


def _in_order(lines: Lines, number: int, lexer: Lexer, name: str | None) -> Generator[Table | Line, None, int]:
    """Give out the lines of a chunk, runs as tables and the others one by one; return how many there are.

    Asides within a run follow it.
    """
    bulk = lines.bulk()
    within = bulk.copy()
    within[[row for row in np.flatnonzero(~bulk).tolist() if lexer.aside.fullmatch(lines.line(row))]] = True
    edges = np.flatnonzero(np.diff(within, prepend=~within[0], append=~within[-1]))
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        rows = start + np.flatnonzero(bulk[start:stop])
        single = (start + np.flatnonzero(~bulk[start:stop])).tolist()
        before = bisect_left(single, rows[0]) if len(rows) else len(single)
        for row in single[:before]:
            yield lexer.line(lines.line(row), number + row, name)
        if len(rows):
            yield Table(number + rows, lines.columns(rows))
        for row in single[before:]:
            yield lexer.line(lines.line(row), number + row, name)
    return len(bulk)
