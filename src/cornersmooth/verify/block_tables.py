"""Text to tables: runs of motion blocks at once, and the other lines one by one.

Lines of few digit patterns are nearly every text and are read by `line_patterns`. Where a chunk has too many patterns,
or numbers of another kind, its lines are known by their letters, and the numbers of a run are parsed together.
"""

from __future__ import annotations

import io
import re
from collections.abc import Generator, Iterator
from typing import Final, Protocol

import numpy as np

from cornersmooth.model import Bools, Floats
from cornersmooth.text import NumberError, parse_numbers
from cornersmooth.verify.lexer import Lexer
from cornersmooth.verify.line_patterns import SILENT, LinePatterns, lines_of, merged
from cornersmooth.verify.words import Line, Table

#: bytes read at a time
CHUNK = 1 << 20

#: all but numbers to blanks
_TO_BLANKS: Final = bytes(code if code in SILENT + b"\n" else ord(" ") for code in range(256))

#: a line that does not begin with its first letter; one that does not begin with its number and a blank
_ODD_BEGIN: Final = re.compile(rb"^[-+.0-9 \t\r]", re.MULTILINE)
_ODD_NUMBER: Final = re.compile(rb"^(?!\d+ +[^-+.0-9 \t\r\n])", re.MULTILINE)

#: a letter without its number right behind it
_BARE: Final = re.compile(rb"[^-+.0-9 \t\r\n](?![-+.0-9])")


class Readable(Protocol):
    """What text is read from."""

    def read(self, size: int, /) -> bytes:
        """Next bytes, at most so many; none at the end."""


class RunLines(Protocol):
    """Lines of a chunk, of which those that stand in runs can be read together."""

    def bulk(self) -> Bools:
        """(l,) whether each line can be read in a run."""

    def columns(self, first: int, last: int) -> dict[str, Floats] | None:
        """Numbers of lines ``first`` to ``last`` (excluded), NaN where a line has none; None if the run is none."""


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


def _read_chunk(
    chunk: bytes, number: int, lexer: Lexer, patterns: LinePatterns, name: str | None
) -> Generator[Table | Line, None, int]:
    """Give out the lines of a chunk and return how many there are."""
    chunk = lexer.unfolded(chunk)
    text = lexer.respell(chunk)
    lines = lines_of(text, patterns) or LetteredLines(text, lexer)
    return (yield from _in_order(lines, chunk, number, lexer, name))


def _in_order(
    lines: RunLines, chunk: bytes, number: int, lexer: Lexer, name: str | None
) -> Generator[Table | Line, None, int]:
    """Runs as tables, and one by one the other lines and those of runs that turn out to be none."""
    bulk = lines.bulk()
    edges = np.flatnonzero(np.diff(bulk, prepend=~bulk[0], append=~bulk[-1]))
    written: list[bytes] = []
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        columns = lines.columns(start, stop) if bulk[start] else None
        table = lexer.table(Table(np.arange(number + start, number + stop), columns)) if columns else None
        if table is not None:
            yield table
            continue
        written = written or chunk.split(b"\n")
        for row in range(start, stop):
            yield lexer.line(written[row], number + row, name)
    return len(bulk)


class LetteredLines:
    """Lines known by their letters alone: slower than patterns, for numbers of any kind.

    Parameters
    ----------
    text : bytes
        Ends with a line end.
    lexer : Lexer
    """

    def __init__(self, text: bytes, lexer: Lexer) -> None:
        self._lines = text.split(b"\n")[:-1]
        self._numbered = lexer.numbered
        letters = text.translate(None, SILENT).split(b"\n")[:-1]
        known = {signature: lexer.columns(signature) for signature in set(letters)}
        self._names = [known[signature] for signature in letters]

    def bulk(self) -> Bools:
        """(l,) whether each line can be read in a run."""
        return np.array([names is not None for names in self._names])

    def columns(self, first: int, last: int) -> dict[str, Floats] | None:
        """Numbers of lines ``first`` to ``last`` (excluded), NaN where a line has none; None if the run is none."""
        run = b"\n".join(self._lines[first:last])
        if (_ODD_NUMBER if self._numbered else _ODD_BEGIN).search(run) or _BARE.search(run):
            return None
        names = [found or () for found in self._names[first:last]]
        count = np.array([len(found) for found in names]) + self._numbered
        try:
            values = parse_numbers(run.translate(_TO_BLANKS))
        except NumberError:
            return None
        if len(values) != count.sum():
            return None
        begin = np.cumsum(count) - count + self._numbered
        kinds = {found: k for k, found in enumerate(dict.fromkeys(names))}
        kind = np.array([kinds[found] for found in names])
        groups = ((np.flatnonzero(kind == k), found) for found, k in kinds.items())
        return merged(
            ((rows, found, [values[begin[rows] + place] for place in range(len(found))]) for rows, found in groups),
            last - first,
        )
