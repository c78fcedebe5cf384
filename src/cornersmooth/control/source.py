"""Text to tables: bytes, or a file that may still be growing, as runs of motion blocks and other lines."""

from __future__ import annotations

import io
import mmap
import os
import stat
import time
from bisect import bisect_left
from codecs import BOM_UTF8
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO, Final, Protocol

import numpy as np

from cornersmooth.control.line_patterns import LinePatterns, Lines
from cornersmooth.control.words import Lexer, Line, Table, numbers, table_of
from cornersmooth.errors import InputError

#: bytes read at a time
CHUNK = 1 << 20

#: bytes that are taken of a pipe or device
_LARGEST: Final = 2 << 30

#: seconds between two looks at a file that grows
_PAUSE: Final = 0.003


def unreadable(error: OSError, name: str | None) -> InputError:
    """Say why a text cannot be read."""
    return InputError("CS500", f"cannot read: {error.strerror}", "check name and rights", file=name)


def readable_twice(text: bytes | str | os.PathLike[str]) -> bytes | str | os.PathLike[str]:
    """Return the path of a file as it is, and all that comes out of a pipe or device.

    Raises
    ------
    InputError
        CS500: more comes out than any program holds.
    """
    if isinstance(text, bytes):
        return text
    try:
        mode = os.stat(text).st_mode
        if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
            return text
        with Path(text).open("rb") as stream:
            data = stream.read(_LARGEST + 1)
    except OSError:  # who opens it says why
        return text
    if len(data) > _LARGEST:
        raise InputError("CS500", "a pipe or device gives more than 2 GB", "name a file", file=os.fspath(text))
    return data


class Source:
    """A text that is read from its beginning on, by one process: the one that made it or one forked from that.

    Parameters
    ----------
    text : bytes or path

    Raises
    ------
    InputError
        CS500 where a file cannot be read.
    """

    def __init__(self, text: bytes | str | os.PathLike[str]) -> None:
        self._text: bytes | BinaryIO
        if isinstance(text, bytes):
            self._text = text
        else:
            try:
                self._text = open(text, "rb", buffering=0)  # noqa: SIM115 - see `close`
            except OSError as error:
                raise unreadable(error, str(text)) from error
        self._place = 0
        self._owner = os.getpid()
        self._whole = mmap.mmap(-1, 1)  # shared with forked processes

    def finish(self) -> None:
        """Say that the text grows no more."""
        self._whole[0] = 1

    def close(self) -> None:
        """Close the file in this process."""
        if not isinstance(self._text, bytes):
            self._text.close()

    def begin(self) -> None:
        """Read from the beginning, again if need be."""
        self._place = 0

    def read(self, size: int) -> bytes:
        """Next bytes, so many unless the text ends."""
        start, parts = self._place, list[bytes]()
        if isinstance(self._text, bytes):
            parts.append(self._text[start : start + size])
        else:
            size = min(size, self._size(start + size) - start)
            self._text.seek(start)
            while size > 0 and (part := self._text.read(size)):
                parts.append(part)
                size -= len(part)
        self._place += sum(map(len, parts))
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _size(self, wanted: int) -> int:
        """Bytes there are: at least so many, unless the text is shorter; BrokenPipeError where its writer has gone."""
        file = self._text
        assert not isinstance(file, bytes)
        while True:
            whole = self._whole[0]  # before the size: a text that has grown is whole afterwards
            size = os.fstat(file.fileno()).st_size
            if size >= wanted or whole:
                return size
            if os.getpid() != self._owner and os.getppid() != self._owner:
                raise BrokenPipeError
            time.sleep(_PAUSE)


class Readable(Protocol):
    """What text is read from."""

    def read(self, size: int, /) -> bytes:
        """Next bytes, so many unless the text ends."""


def read_lines(
    data: bytes | Readable,
    name: str | None,
    lexer: Lexer,
    show: Callable[[list[bytes]], None] = lambda lines: None,
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
            show(patterns.fresh)
            patterns.fresh.clear()
        number += yield from _in_order(lines, number, lexer, name)


def _chunks(data: bytes | Readable, lexer: Lexer) -> Iterator[bytes]:
    """Pieces of the text, cut where no curve is cut in two."""
    file = io.BytesIO(data) if isinstance(data, bytes) else data
    rest, mark = b"", BOM_UTF8
    while True:
        more = file.read(CHUNK)
        chunk, mark = (rest + more).removeprefix(mark), b""
        cut = lexer.cut(chunk) if len(more) == CHUNK else len(chunk)
        chunk, rest = chunk[:cut], chunk[cut:]
        if cut:
            yield chunk if chunk.endswith(b"\n") else chunk + b"\n"
        if len(more) < CHUNK:
            return


def _in_order(lines: Lines, number: int, lexer: Lexer, name: str | None) -> Generator[Table | Line, None, int]:
    """Give out the lines of a chunk, runs as tables and the others one by one; return how many there are.

    Asides within a run follow it. Comments of motion blocks come before these.
    """
    bulk = lines.bulk()
    within = bulk.copy()
    within[[row for row in np.flatnonzero(~bulk).tolist() if lexer.aside.fullmatch(lines.line(row))]] = True
    edges = np.flatnonzero(np.diff(within, prepend=~within[0], append=~within[-1]))
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        rows = start + np.flatnonzero(bulk[start:stop])
        single = (start + np.flatnonzero(~bulk[start:stop])).tolist()
        before = bisect_left(single, rows[0]) if len(rows) else len(single)
        yield from _one_by_one(lines, single[:before], number, lexer, name)
        if len(rows):
            yield Table(number + rows, lines.columns(rows))
        yield from _one_by_one(lines, single[before:], number, lexer, name)
    return len(bulk)


def _one_by_one(
    lines: Lines, rows: Sequence[int], number: int, lexer: Lexer, name: str | None
) -> Iterator[Table | Line]:
    """Give out lines that are in no run: those that are motion blocks for all that, as with a comment, as tables."""
    blocks: list[tuple[int, Mapping[str, float]]] = []
    for row in rows:
        line = lexer.line(lines.line(row), number + row, name)
        columns = None if line.skipped else lexer.motion(line)
        if columns is not None:
            blocks.append((line.number, numbers(columns)))
            line = Line(line.number, (), line.comments)
        elif blocks and (line.words or line.tape):
            yield table_of(blocks)
            blocks = []
        if columns is None or line.comments:
            yield line
    if blocks:
        yield table_of(blocks)
