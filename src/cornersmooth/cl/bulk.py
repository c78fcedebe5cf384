"""The fast path: runs of plain GOTO lines, found by one expression and converted a chunk at a time.

Everything that is not surely plain is left to the careful reader of `grammar`; both give the same bits.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.system.processes import map_in_processes
from cornersmooth.text import parse_numbers

#: bytes of a chunk: enough to make the fixed cost of a chunk small, little enough to stay in cache
CHUNK: Final = 1 << 20

#: chunks for which no other process is begun
_FEW: Final = 16

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


def parts(data: bytes, processes: int = 1) -> Iterator[Part]:
    """Cut a text, whose last line has an end, too; `processes` look for what is plain in a long one."""
    chunks, line = [*_chunks(data)], 1
    plain = map_in_processes(lambda chunk: find_plain(data[chunk]), chunks, processes if len(chunks) > _FEW else 1)
    for chunk, runs in zip(chunks, plain, strict=True):
        text, first, at = data[chunk], line, 0
        for start, stop, after, poses in runs or ():
            if at < start:
                yield Part(line, text[at:start])
            poses[:, 6] += first
            yield Part(int(poses[0, 6]), poses=poses)
            at, line = stop, first + after
        if at < len(text):
            yield Part(line, text[at:], follows="GOTO" if chunk.stop < len(data) else "the end of the file")
        line += text.count(b"\n", at)


def _chunks(data: bytes) -> Iterator[slice]:
    """A chunk ends before a GOTO line."""
    begin = 0
    while begin < len(data):
        stop = -1 if len(data) - begin <= CHUNK else data.rfind(b"\nGOTO", begin + CHUNK // 2, begin + CHUNK)
        if stop < 0:
            stop = data.find(b"\nGOTO", begin + CHUNK)
        end = len(data) if stop < 0 else stop + 1
        yield slice(begin, end)
        begin = end


def find_plain(text: bytes) -> list[tuple[int, int, int, Floats]] | None:
    """Find and convert the runs of plain GOTO statements; None if any of them needs care.

    Of each run: its first byte, and byte and line after it, and its poses, (m, 7) as in `Part`. Lines count from 0.
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
        letters = np.frombuffer(chosen, np.uint8)
        ends = letters[(letters == ord(",")) | (letters == ord("\n"))] == ord("\n")
        count = np.diff(np.flatnonzero(ends), prepend=-1)
        begin, six = np.cumsum(count) - count, count == 6
        poses[:, :3] = values[begin[:, None] + np.arange(3)]
        poses[six, 3:6] = values[begin[six, None] + np.arange(3, 6)]
    if not (np.abs(poses[:, :3]) <= FARTHEST).all():
        return None
    counts = [text.count(b"GOTO", start, stop) for start, stop in spans]
    lines = np.searchsorted(np.flatnonzero(np.frombuffer(text, np.uint8) == ord("\n")), spans)
    size = lines[:, 1] - lines[:, 0]
    poses[:, 6] = line + np.repeat(lines[:, 0] - np.cumsum(size) + size, counts)
    runs = zip(spans, lines[:, 1].tolist(), np.cumsum(counts).tolist(), counts, strict=True)
    return [(start, stop, after, poses[end - count : end]) for (start, stop), after, end, count in runs]
