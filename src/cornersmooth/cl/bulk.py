"""The fast path: plain GOTO lines, recognised and converted a chunk at a time.

Deleting digits, signs, points and blanks from a chunk leaves a few bytes a line that say what kind of line it is:
``GOTO/,,,,,`` is a GOTO of six numbers. They are compared as eight-byte words, all lines at once. Everything that is
not surely plain is left to the careful reader of `grammar`; both give the same bits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.text import parse_numbers

#: bytes of a chunk: enough to make the fixed cost of a chunk small, little enough to stay in cache
CHUNK: Final = 1 << 20

#: no machine reaches farther, in units of the file
FARTHEST: Final = 1e7

_DIGITS: Final = b"0123456789+-. \t"
_LETTERS: Final = b"GOT/ \t"
_PADDING: Final = b"\n" * 16

_THREE, _SIX = 1, 2

#: first bytes of a line that may hold further numbers
_NUMERIC: Final = np.isin(np.arange(256), np.frombuffer(b"0123456789+-. \t", np.uint8))

Words = NDArray[np.uint64]


@dataclass(frozen=True)
class Chunk:
    """Consecutive lines of a file."""

    lines: list[bytes]  #: all lines, without their ends; empty where all of them are plain
    count: int  #: number of lines
    size: int  #: number of bytes
    first: int  #: number of the first line, from 1
    runs: Ints  #: (k, 2): ranges [start, stop) of lines that are plain GOTO statements, ascending
    begins: Ints  #: (k+1,): first pose of every run; the last is the number of poses
    poses: Floats  #: (m, 7): tip and axis as written, with NaN where a pose has no axis, and line


def chunks(data: bytes) -> Iterator[Chunk]:
    """Cut a text, whose last line has an end, too, into chunks that end before a GOTO line; find the plain GOTOs."""
    start, first = 0, 1
    while start < len(data):
        stop = _chunk_end(data, start)
        text = data[start:stop]
        chunk = find_plain(text, first) or _all_careful(text, first)
        yield chunk
        start = stop
        first += chunk.count


def _chunk_end(data: bytes, start: int) -> int:
    if len(data) - start <= CHUNK:
        return len(data)
    stop = data.rfind(b"\nGOTO", start + CHUNK // 2, start + CHUNK)
    if stop < 0:
        stop = data.find(b"\nGOTO", start + CHUNK)
    return len(data) if stop < 0 else stop + 1


def _all_careful(text: bytes, first: int) -> Chunk:
    lines, none = text.split(b"\n")[:-1], np.zeros((0, 2), np.int64)
    return Chunk(lines, len(lines), len(text), first, none, np.zeros(1, np.int64), np.zeros((0, 7)))


def _words(text: bytes) -> Words:
    """Eight-byte words at every byte of a text that ends in `_PADDING`."""
    return np.ndarray((len(text) - 7,), "<u8", text, strides=(1,))


def _word(text: bytes) -> np.uint64:
    return np.uint64(int.from_bytes(text, "little"))


def _mask(length: int) -> np.uint64:
    return np.uint64((1 << 8 * length) - 1)


def _line_starts(text: bytes) -> Ints:
    """Offsets of all lines, and the end."""
    ends = np.flatnonzero(np.frombuffer(text, np.uint8) == ord("\n"))
    return np.concatenate(([0], ends + 1))


def find_plain(text: bytes, first: int) -> Chunk | None:
    """Find and convert the plain GOTO statements; None if there are none or any of them needs care."""
    starts = _line_starts(text)
    taken, pair = _classify(text, starts[:-1])
    plain = taken > 0
    plain[1:] |= pair[:-1]
    if not plain.any():
        return None
    edges = np.flatnonzero(np.diff(plain, prepend=False, append=False)).reshape(-1, 2)
    values = _convert(text, starts[edges], int(np.count_nonzero(pair)))
    goto = taken[taken > 0]
    own_axis = goto == _SIX
    count = np.where(own_axis, 6, 3)
    if values is None or count.sum() != len(values):
        return None
    poses = np.full((len(goto), 7), np.nan)
    if own_axis.all():
        poses[:, :6] = values.reshape(-1, 6)
    else:
        begin = np.cumsum(count) - count
        poses[:, :3] = values[begin[:, None] + np.arange(3)]
        poses[own_axis, 3:6] = values[begin[own_axis, None] + np.arange(3, 6)]
    if not (np.abs(poses[:, :3]) <= FARTHEST).all():
        return None
    poses[:, 6] = np.flatnonzero(taken) + first
    before = np.concatenate(([0], np.cumsum(taken > 0)))
    begins = np.concatenate((before[edges[:, 0]], [len(poses)]))
    lines = [] if plain.all() else text.split(b"\n")[:-1]
    return Chunk(lines, len(plain), len(text), first, edges, begins, poses)


def _classify(text: bytes, starts: Ints) -> tuple[NDArray[np.uint8], Bools]:
    """Say of every line whether it is a plain GOTO (0, `_THREE`, `_SIX`), and whether that goes on in the next line."""
    residue = text.translate(None, _DIGITS) + _PADDING
    words = _words(residue)
    left = _line_starts(residue)[: len(starts)]
    head, tail = words[left], words[left + 8]
    three = head == _word(b"GOTO/,,\n")
    four = head == _word(b"GOTO/,,,")
    six = four & (tail & _mask(3) == _word(b",,\n"))
    upper = four & (tail & _mask(2) == _word(b"$\n"))  # x, y, z, $
    lower = head & _mask(3) == _word(b",,\n")  # i, j, k

    raw = _words(text + _PADDING)[starts]
    slash = raw & _mask(5) == _word(b"GOTO/")
    if not slash.all():
        for start in (b"GOTO /", b"GOTO  /", b"GOTO   /"):
            slash |= raw & _mask(len(start)) == _word(start)
    upper &= slash
    upper[:-1] &= lower[1:]
    upper[-1:] = False

    # a line of further numbers belongs to the statement before it; a blank may stand in front of one
    numeric = np.zeros(len(starts) + 2, np.bool_)
    numeric[:-2] = _NUMERIC[(raw & _mask(1)).astype(np.uint8)]
    numeric[1:-2] &= ~upper[:-1]
    upper &= ~numeric[2:]
    taken = np.where(six & slash & ~numeric[1:-1], _SIX, np.where(three & slash & ~numeric[1:-1], _THREE, 0))
    taken[upper] = _SIX
    return taken.astype(np.uint8), upper


def _convert(text: bytes, spans: Ints, pairs: int) -> Floats | None:
    """Numbers of the lines in some ranges of bytes; None where one is not simply written."""
    whole = len(spans) == 1 and spans[0, 1] - spans[0, 0] == len(text)
    chosen = text if whole else b"".join([text[a:b] for a, b in spans.tolist()])
    if _has_inner_blank(chosen):
        return None
    chosen = chosen.translate(None, _LETTERS)
    if pairs:
        joined = chosen.replace(b",$\n", b",")
        if len(chosen) - len(joined) != 2 * pairs:
            return None
        chosen = joined
    if b",\n" in chosen or chosen.endswith(b","):
        return None
    try:
        return parse_numbers(chosen)
    except ValueError:
        return None


def _has_inner_blank(chosen: bytes) -> bool:
    """Whether a blank stands between two digits or points, where it could separate or mean nothing."""
    if b" " not in chosen and b"\t" not in chosen:
        return False
    letters = np.frombuffer(chosen, np.uint8)
    blank = (letters == ord(" ")) | (letters == ord("\t"))
    digit = (letters - np.uint8(ord("0")) <= 9) | (letters == ord("."))
    behind = np.flatnonzero(digit[:-1] & blank[1:]) + 1  # blanks that follow a digit
    if not len(behind):
        return False
    solid = np.flatnonzero(~blank)
    after = letters[solid[np.searchsorted(solid, behind)]]
    return bool(~np.isin(after, np.frombuffer(b",$\n", np.uint8)).all())
