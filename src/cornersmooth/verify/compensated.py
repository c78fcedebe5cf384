"""Blocks under cutter compensation: each is one move of the CL file, from its start to its end, digit for digit.

The control leads the tool aside on the first block of compensation, and back on the first block behind it: how far that
is hangs on the length of the block. So there a way that is divided is another way.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move, Program
from cornersmooth.nc_reader.elements import Curves, Element, Elements, Event, NcArcs
from cornersmooth.nc_reader.tool import leads_somewhere
from cornersmooth.verify.motions import digit_errors
from cornersmooth.verify.result import Findings
from cornersmooth.verify.task import Task

#: words of compensation, and whether they switch it on
_WORDS: Final = {40.0: False, 41.0: True, 42.0: True}
_OPTIONS: Final = {"LEFT": True, "RIGHT": True, "ON": True, "OFF": False, "NOMORE": False}

_WHAT: Final = "a block under cutter compensation, or that ends it, that is no move of the CL file from end to end"


@dataclass
class _State:
    """Follows compensation along some motion."""

    on: bool = False
    ending: bool = False  #: it is off, and nothing has moved in the plane since

    def feeds(self, changes: Sequence[tuple[int, bool]], rapid: Bools, ways: Floats) -> Bools:
        """(m,) which moves (m, 3) are feeds under compensation or end it; `changes`: first moves, and whether on."""
        found = np.zeros(len(rapid), np.bool_)
        leads_back = rapid | ways[:, :2].any(axis=1)
        for (first, on), (stop, _) in pairwise([(0, self.on), *changes, (len(rapid), False)]):
            self.ending, self.on = not on and (self.ending or self.on), on
            back = np.flatnonzero(leads_back[first:stop])
            if self.ending and len(back):
                self.ending = False
                found[first : first + int(back[0]) + 1] = True
            else:
                found[first:stop] = on or self.ending
        return found & ~rapid


class Compensated:
    """Compares the feed moves under compensation, and those that end it, in their order."""

    def __init__(self, task: Task, events: Sequence[Event], found: Findings) -> None:
        self._task, self._events, self._found = task, events, found
        self._parts: list[Elements] = []

    def watch(self, chunks: Iterable[Elements]) -> Iterator[Elements]:
        """Give out the elements of a program; then note the first block that is no move of the CL file."""
        state, before, offset, read = _State(), np.full((1, 6), np.inf), 0, 0
        for nc in chunks:
            stop = bisect_left(self._events, offset + len(nc), key=lambda event: event.element)
            words, read = self._events[read:stop], stop
            some = [one for one in words if one.letter == "G" and one.value in _WORDS]
            changes = [(one.element - offset, _WORDS[one.value]) for one in some]
            if len(nc) and (changes or state.on or state.ending):
                ways = np.diff(np.hstack((nc.tip, nc.second)), axis=0, prepend=before)
                under = state.feeds(changes, nc.kind == Element.RAPID, ways)
                under &= leads_somewhere(nc, *np.hsplit(ways, 2)) | (nc.kind == Element.ARC)
                under[:-1] &= nc.line[1:] != nc.line[:-1]  # rotary words make several lines of a block
                bare = replace(nc, curves=Curves(), arcs=NcArcs())  # only ends are compared
                self._parts += [bare.only(under)] if under.any() else []
            before = np.hstack((nc.tip[-1:], nc.second[-1:])) if len(nc) else before
            offset += len(nc)
            yield nc
        if self._parts:
            self._compare(Elements.joined(self._parts), *_compensated_poses(self._task.original.program))

    def _compare(self, nc: Elements, poses: Ints, within: Bools) -> None:
        """Compare blocks with moves of the CL file; arcs within may be written in parts. Nothing is behind a fault."""
        rows, line = np.arange(len(nc)), 0
        while len(rows):
            right = self._exact(nc, rows[: len(poses)], poses[: len(rows)])
            count = int(np.argmin(np.append(right, False)))
            line = int(nc.line[rows[max(count - 1, 0)]])
            rows, poses, within = rows[count:], poses[count:], within[count:]
            if len(rows) and not within[:1].any():
                self._found.unlooked.append((int(nc.line[rows[0]]), _WHAT))
                return
            ends = np.flatnonzero(self._exact(nc, rows, np.full(len(rows), poses[0]))) if len(rows) else rows
            rows = rows[int(ends[0]) if len(ends) else len(rows) :]
        if len(poses):
            self._found.unlooked.append((line, _WHAT))

    def _exact(self, nc: Elements, rows: Ints, poses: Ints) -> Bools:
        """(k,) whether elements end exactly at poses."""
        program = self._task.original.program
        return digit_errors(nc, rows, program.tip[poses], program.axis[poses], self._task.axis_length)[0]


def _compensated_poses(program: Program) -> tuple[Ints, Bools]:
    """(k,) poses at the ends of feed moves that lead somewhere under compensation, or end it; which are arcs within."""
    words = ((one.pose, one.args[0] if one.args else "") for one in program.statements if one.word == "CUTCOM")
    changes = [(pose, _OPTIONS[word]) for pose, word in words if isinstance(word, str) and word in _OPTIONS]
    if not changes:
        return np.zeros(0, np.int64), np.zeros(0, np.bool_)
    ways = np.diff(program.tip, axis=0, prepend=np.inf)
    turned = np.diff(program.axis, axis=0, prepend=np.inf).any(axis=1)
    arc = program.kind == Move.ARC
    found = _State().feeds(changes, ~(arc | (program.kind == Move.LINEAR)), ways)
    poses = np.flatnonzero(found & (ways.any(axis=1) | turned | arc))
    at, on = (np.array(values) for values in zip((-1, False), *changes, strict=True))
    return poses, arc[poses] & on[np.searchsorted(at, poses, side="right") - 1].astype(np.bool_) & ~np.isin(poses, at)
