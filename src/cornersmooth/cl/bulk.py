"""The fast path: runs of plain GOTO lines, found by one expression and converted a chunk at a time.

Everything that is not surely plain is left to the careful reader of `grammar`; both give the same bits.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.text import parse_numbers

#: bytes of a chunk: enough to make the fixed cost of a chunk small, little enough to stay in cache
CHUNK: Final = 1 << 20

#: no machine reaches farther, in units of the file
FARTHEST: Final = 1e7

_THREE: Final = rb" *+[-+0-9.]++, *+[-+0-9.]++, *+[-+0-9.]++"

#: lines of three or six numbers, the axis also in a line of its own; not one before a line of further numbers
_PLAIN: Final = re.compile(
    rb"(?:^GOTO {0,3}+/%b(?:,(?: *+\$\n)?+%b)?+ *+\n){1,10000}(?![-+. \t0-9])" % (_THREE, _THREE), re.MULTILINE
)


class Part(NamedTuple):
    """Consecutive lines of a file: plain GOTO lines, or others."""

    first: int  #: number of the first line of the text, from 1
    text: bytes = b""  #: of lines that are not surely plain
    poses: Floats | None = None  #: (m, 7): tip and axis as written, with NaN where a pose has no axis, and line
    follows: str = "GOTO"  #: what comes after the text


def parts(data: bytes) -> Iterator[Part]:
    """Cut a text, whose last line has an end, too."""
    begin, line = 0, 1
    while begin < len(data):
        end = _chunk_end(data, begin)
        text = data[begin:end]
        at = 0
        for start, stop, after, poses in find_plain(text, line) or ():
            if at < start:
                yield Part(line, text[at:start])
            yield Part(line, poses=poses)
            at, line = stop, after
        if at < len(text):
            yield Part(line, text[at:], follows="GOTO" if end < len(data) else "the end of the file")
        begin, line = end, line + text.count(b"\n", at)


def _chunk_end(data: bytes, start: int) -> int:
    """A chunk ends before a GOTO line."""
    if len(data) - start <= CHUNK:
        return len(data)
    stop = data.rfind(b"\nGOTO", start + CHUNK // 2, start + CHUNK)
    if stop < 0:
        stop = data.find(b"\nGOTO", start + CHUNK)
    return len(data) if stop < 0 else stop + 1


def find_plain(text: bytes, first: int) -> list[tuple[int, int, int, Floats]] | None:
    """Find and convert the runs of plain GOTO statements; None if any of them needs care.

    Of each run: its first byte, and byte and line after it, and its poses, (m, 7) as in `Part`. The text begins with
    line `first`.
    """
    spans = [found.span() for found in _PLAIN.finditer(text)]
    if not spans:
        return None
    plain = b"".join([text[start:stop] for start, stop in spans])
    chosen = plain.translate(None, b"GOT/ $")
    letters = np.frombuffer(plain, np.uint8)
    line = np.arange(plain.count(b"\n"))
    if b"$" in plain:  # axes have lines of their own
        chosen = chosen.replace(b",\n", b",")
        line = np.searchsorted(np.flatnonzero(letters == ord("\n")), np.flatnonzero(letters == ord("G")))
    try:
        values = parse_numbers(chosen)
    except ValueError:
        return None
    poses = np.full((len(line), 7), np.nan)
    if len(values) == 6 * len(poses):
        poses[:, :6] = values.reshape(-1, 6)
    else:
        count = _numbers_of_lines(chosen)
        begin, six = np.cumsum(count) - count, count == 6
        poses[:, :3] = values[begin[:, None] + np.arange(3)]
        poses[six, 3:6] = values[begin[six, None] + np.arange(3, 6)]
    if not (np.abs(poses[:, :3]) <= FARTHEST).all():
        return None
    counts = [text.count(b"GOTO", start, stop) for start, stop in spans]
    lines = first + np.searchsorted(np.flatnonzero(np.frombuffer(text, np.uint8) == ord("\n")), spans)
    size = lines[:, 1] - lines[:, 0]
    poses[:, 6] = line + np.repeat(lines[:, 0] - np.cumsum(size) + size, counts)
    runs = zip(spans, lines[:, 1].tolist(), np.cumsum(counts).tolist(), counts, strict=True)
    return [(start, stop, after, poses[end - count : end]) for (start, stop), after, end, count in runs]


def _numbers_of_lines(text: bytes) -> Ints:
    letters = np.frombuffer(text, np.uint8)
    ends = letters[(letters == ord(",")) | (letters == ord("\n"))] == ord("\n")
    return np.diff(np.flatnonzero(ends), prepend=-1)
