"""The written motion in batches, each with the stretches of the CL path that it is run beside.

A *stretch* is the run of feed moves between two stops (see `parse`). Many short stretches make a batch; a long one is
cut anywhere. The place of a cut on the CL path is guessed, so each batch can be decided by itself: where the motions
can be run beside each other through all guessed places, they can be. Where not, it is not proved that they cannot.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final, TypeAlias

import numpy as np

from cornersmooth.model import Floats, Move
from cornersmooth.nc_reader.elements import Ahead, Element, Elements, Event, Problem
from cornersmooth.nc_reader.tool import directions, leads_somewhere
from cornersmooth.verify.acts import Acts
from cornersmooth.verify.along_tool import AlongTool
from cornersmooth.verify.feeds import feed_at, out_of_hole
from cornersmooth.verify.holes import straight
from cornersmooth.verify.match import Batch
from cornersmooth.verify.motions import ARITHMETIC
from cornersmooth.verify.nearest import COLUMNS, largest_square, nearest_places
from cornersmooth.verify.parse import BEFORE, Parse, Part
from cornersmooth.verify.passage import AROUND, LONGER
from cornersmooth.verify.task import Task

#: elements in a batch; half as many where there are curves, which have more vertices
BATCH: Final = 1 << 15

#: a stretch, see `Batch.stretches`
_STRETCH: Final = np.dtype(
    [("first", "i8"), ("last", "i8"), ("start", "f8", 3), ("end", "f8", 3), ("stop", "i8"), ("guessed", "?")]
)

#: a row of it
_Row: TypeAlias = tuple[int, int, Floats, Floats, int, bool]

#: share of the way, on either side, within which a place is guessed at first (speed only)
_NEAR: Final = 0.05


class Batches:
    """Makes batches of the elements of a text, as they come, counted in all of it; `events`, `retracts` grow along."""

    def __init__(self, task: Task, events: Sequence[Event], retracts: Sequence[int]) -> None:
        self.task, self._events, self.retracts = task, events, retracts
        self.acts = Acts()
        self.elements = 0
        self.room = 0.0  #: mm: distance that the printed digits account for
        # the stretch that has no end yet: where it begins, as a move and in the text, and (3,) on the CL path, perhaps
        # guessed; and the last move that it may have
        self._move, self._element, self._move_last, self._place = -1, 0, -1, np.zeros(3)
        self._continued = self._guessed = False
        self._told = False  # whether a lack of motion between its stops has been written
        self._ratio = 1.0  # how long the CL path is beside the written one, of the last batch that was cut
        self._pending: list[_Row] = []

    @property
    def _most(self) -> int:
        return BATCH // 2 if len(self._ahead.nc.curves) else BATCH

    def of(self, chunks: Iterable[Elements]) -> Iterator[Batch]:
        """Give out all batches of a text."""
        original = self.task.original
        ahead = self._ahead = Ahead(self._standing(nc for nc in chunks if len(nc)))
        if ahead.has(0) and len(original.pose):
            along = AlongTool(ahead, self.retracts, self._events, self.acts)
            parse = Parse(self.task, ahead, self._events, along, self.acts)
            self.room = parse.lines.room
            for part in parse.parts():
                yield from self._take(part)
            yield from self._close(len(original.pose) - 1, ahead.count - 1)
            yield from self._flush()
        elif ahead.count:
            text = "motion that the CL file does not have"
            self.acts.problems.append(Problem("CS534", 0, int(ahead.nc.line[0]), text))
            while ahead.has(ahead.count):
                ahead.forget(ahead.count - 1)
        elif len(original.pose):
            line = int(original.program.line[original.pose[0]])
            self.acts.problems.append(Problem("CS534", line, 0, "the program lacks motion of the CL file"))
        self.elements = ahead.count

    def _standing(self, chunks: Iterable[Elements]) -> Iterator[Elements]:
        """Give out elements, and take down which lead nowhere: a full circle ends where it begins, and does."""
        offset, ends = 0, [np.full((1, 3), np.inf)] * 2
        for nc in chunks:
            ways = [np.diff(one, axis=0, prepend=before) for one, before in zip((nc.tip, nc.second), ends, strict=True)]
            rows = np.flatnonzero(np.abs(ways[0][:, 0]) <= 2.0 * nc.tip_step)  # most do not, by X alone
            rows = rows[straight(nc.kind[rows]) & ~leads_somewhere(nc, ways[0][rows], ways[1][rows])]
            self.acts.still.update((offset + rows).tolist())
            offset, ends = offset + len(nc), [nc.tip[-1:], nc.second[-1:]]
            yield nc

    def _take(self, part: Part) -> Iterator[Batch]:
        """Take the stops among more elements."""
        for move, element, opens, last, within in part.steps:
            yield from self._close(move - (not within), element - (not within))
            if opens:
                self._open(move, element)
                self._move_last = last
            else:
                yield from self._flush()
                self._move = -1
        if self._move >= 0 and part.stop - 1 - self._element > self._most + self._most // 2:
            yield from self._cut_open(part.stop - 1)
        wanted = [part.stop - BEFORE, *(one[0] - 2 for one in self._pending[:1])]
        self._ahead.forget(min([*wanted, self._element - 2] if self._move >= 0 else wanted))

    def _open(self, move: int, element: int) -> None:
        """Begin a stretch at a stop."""
        task, nc, at = self.task, self._ahead.nc, element - self._ahead.base
        original = task.original
        kind = int(original.program.kind[original.pose[move]])
        if move == 0 and nc.kind[at] != Element.RAPID:
            text = "the first rapid is written as a feed move"
            line = int(original.program.line[original.pose[move]])
            rapid = Problem("CS532", line, int(nc.line[at]), text)
            self.acts.problems += [rapid] if kind == Move.RAPID else feed_at(task, nc, at, move, 0.0)
        # out of a hole the way begins anywhere
        place = out_of_hole(task, nc, at, move) if kind == Move.HOLE else float(original.trail.last[move])
        self._move, self._element, self._place = move, element, np.full(3, place)
        self._continued = self._guessed = self._told = False

    def _close(self, move_last: int, element_last: int) -> Iterator[Batch]:
        """End the stretch."""
        if self._move < 0:
            return
        cl_moves, nc_moves = move_last > self._move, element_last > self._element
        if cl_moves != nc_moves and not self._told:
            self._stands(move_last, element_last, cl_moves=cl_moves)
        if not (cl_moves and nc_moves):
            return
        stop = int(self.task.original.trail.last[move_last])
        while element_last - self._element > self._most + self._most // 2:
            yield from self._cut(self._element + self._most, stop)
        waiting = self._pending
        if waiting and (element_last - waiting[0][0] > self._most or stop - waiting[0][2][0] > 2 * self._most):
            yield from self._flush()
        start, end = np.minimum(self._place, stop), np.full(3, float(stop))
        self._pending.append((self._element, element_last, start, end, stop, self._guessed))

    def _cut_open(self, last: int) -> Iterator[Batch]:
        """Give out what is kept of a stretch whose end is not known yet, but its last element."""
        if self._move < self._move_last:
            while last - self._element > self._most + self._most // 2:
                yield from self._cut(self._element + self._most, int(self.task.original.trail.last[self._move_last]))
            return
        # nothing of the CL path is left for what is kept: it may only stay where it is
        yield from self._flush()
        yield from self._close(self._move, last)
        self._element, self._continued = last, True

    def _cut(self, element: int, stop: int) -> Iterator[Batch]:
        """Give out a long stretch up to an element."""
        yield from self._flush()
        start = np.minimum(self._place, stop)
        end = self._guess(element, start, stop)
        yield self._batch([(self._element, element, start, end, stop, True)], goes_on=True)
        self._element, self._place, self._continued, self._guessed = element, end, True, True

    def _guess(self, element: int, start: Floats, stop: int) -> Floats:
        """(3,) places near the end of an element on a stretch, which has run from places on: the nearest ones.

        They are looked for where they should be, and if nothing is near there on all that may have been passed.
        """
        path, nc = self.task.path, self._ahead.part(self._element, element + 1)
        six = self.task.six(nc.tip, directions(nc, nc.tip, nc.second))
        gone, begin = float(np.linalg.norm(np.diff(six, axis=0), axis=1).sum()), path.length_at(float(start[0]))
        around, found = AROUND * self.task.radius, start.copy()
        for k, (metric, (_, radius)) in enumerate(self.task.runs.items()):
            for low, high in ((1.0 - _NEAR, 1.0 + _NEAR), (0.0, LONGER)):
                ends = begin + np.array((low, high)) * self._ratio * gone + np.array((-around, around))
                window = np.clip(np.searchsorted(path.length, ends) - 1, int(start[k]), stop - 1)
                first, last = window[:1], window[1:]
                reach = int(last[0] - first[0]) // 2 + 1
                found[k:] = nearest_places(six[-1:], path.points, (first + last) // 2, reach, first, last, metric)
                off = (six[-1:] - path.at(found[k : k + 1]))[:, COLUMNS[metric]]
                if largest_square(off.T)[0] <= radius**2:
                    break
        if gone > around:
            self._ratio = (path.length_at(float(found[0])) - begin) / gone
        return np.clip(found, start, stop)

    def _flush(self) -> Iterator[Batch]:
        """Give out what waits."""
        if self._pending:
            yield self._batch(self._pending)
            self._pending = []

    def _batch(self, rows: list[_Row], *, goes_on: bool = False) -> Batch:
        """Put some stretches into a batch."""
        lead = int(self._continued and rows[0][0] == self._element)
        begin, last = rows[0][0] - lead, rows[-1][1]
        table = np.array(rows, _STRETCH)
        table["first"] -= begin
        table["last"] -= begin
        return Batch(
            nc=self._ahead.part(begin, last + 1),
            offset=begin,
            stretches=table,
            continued=bool(lead),
            goes_on=goes_on,
        )

    def _stands(self, move_last: int, element_last: int, *, cl_moves: bool) -> None:
        """Say if between two stops one motion leaves the place where the other stands: CS535, CS536."""
        task, path, original = self.task, self.task.path, self.task.original
        part = self._ahead.part(self._element, element_last + 1)
        motion = self.task.motion(part)
        place = path.at(self._place[:1])
        if cl_moves:
            start, stop = int(self._place[0]), int(original.trail.last[move_last])
            own, bend = np.concatenate((place, path.points[start + 1 : stop + 1])), path.bend[start:stop]
            text, code, other = "feed moves of the CL file are missing", "CS535", motion.six[0]
        else:
            own, bend = motion.six, motion.bend
            text, code, other = "feed moves that the CL file does not have", "CS536", place[0]
        off = np.sqrt(largest_square((own - other).T))
        if not cl_moves:  # rapids that lead nowhere were passed, though digits of a fine ε show them
            off[part.kind[motion.owner] == Element.RAPID] = 0.0
        # out of a hole it may begin beside the path
        amount = float((np.maximum(off[1:], off[:-1]) + bend).max(initial=float(off[0])))
        if amount > task.tolerance + ARITHMETIC:
            self._told = True
            nc, base = self._ahead.nc, self._ahead.base
            move = min(self._move + 1, len(original.pose) - 1)
            element = min(self._element + 1 - base, len(nc) - 1)
            line = int(original.program.line[original.pose[move]])
            self.acts.problems.append(Problem(code, line, int(nc.line[element]), text, amount))
