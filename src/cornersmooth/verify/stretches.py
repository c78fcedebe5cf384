"""The written motion in batches, each with the stretches of the CL path that it is run beside.

A *stretch* is the run of feed moves between two stops (see `parse`). Many short stretches make a batch; a long one is
cut anywhere. The place of a cut on the CL path is guessed, so each batch can be decided by itself: where the motions
can be run beside each other through all guessed places, they can be. Where not, it is not proved that they cannot.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np

from cornersmooth.model import Floats, Move
from cornersmooth.nc_reader.elements import Ahead, Element, Problem
from cornersmooth.verify.acts import Acts
from cornersmooth.verify.feeds import feed_at, out_of_hole
from cornersmooth.verify.match import Batch
from cornersmooth.verify.motions import ARITHMETIC, COLUMNS, largest_square, nearest_places
from cornersmooth.verify.passage import AROUND, LONGER
from cornersmooth.verify.task import Task

#: elements before those that are certain that are still looked at
BEFORE: Final = 16

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


class Stretches:
    """Makes batches of the stretches that a text runs beside the CL path, as they begin and end."""

    def __init__(self, task: Task, ahead: Ahead, acts: Acts) -> None:
        self.task, self._ahead, self.acts = task, ahead, acts
        self.ready: list[Batch] = []  #: what has not been given out yet
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

    def take(self, stop: int) -> list[Batch]:
        """Give out what is ready where elements up to `stop`, that excluded, are certain."""
        if 0 <= self._move < self._move_last:
            self._cut_up_to(stop - 1, self._move_last)
        wanted = [stop - BEFORE, *(one[0] - 2 for one in self._pending[:1])]
        self._ahead.forget(min([*wanted, self._element - 2] if self._move >= 0 else wanted))
        ready, self.ready = self.ready, []
        return ready

    def leave(self) -> None:
        """Nothing is run beside the path until the next stretch begins."""
        self._flush()
        self._move = -1

    def begin(self, move: int, element: int, move_last: int) -> None:
        """Begin a stretch at a stop; it ends with a move up to the last one."""
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
        self._move, self._element, self._move_last, self._place = move, element, move_last, np.full(3, place)
        self._continued = self._guessed = self._told = False

    def end(self, move_last: int, element_last: int) -> None:
        """End the stretch, if one has begun."""
        if self._move < 0:
            return
        cl_moves, nc_moves = move_last > self._move, element_last > self._element
        if cl_moves != nc_moves and not self._told:
            self._stands(move_last, element_last, cl_moves=cl_moves)
        if not (cl_moves and nc_moves):
            return
        stop = self._cut_up_to(element_last, move_last)
        waiting = self._pending
        if waiting and (element_last - waiting[0][0] > self._most or stop - waiting[0][2][0] > 2 * self._most):
            self._flush()
        start, end = np.minimum(self._place, stop), np.full(3, float(stop))
        self._pending.append((self._element, element_last, start, end, stop, self._guessed))

    def _cut_up_to(self, last: int, move_last: int) -> int:
        """Give out a long stretch but its last elements, of those up to one; return the end of its last move."""
        stop = int(self.task.original.trail.last[move_last])
        while last - self._element > self._most + self._most // 2:
            self._flush()
            start, element = np.minimum(self._place, stop), self._element + self._most
            end = self._guess(element, start, stop)
            self._make([(self._element, element, start, end, stop, True)], goes_on=True)
            self._element, self._place, self._continued, self._guessed = element, end, True, True
        return stop

    def _guess(self, element: int, start: Floats, stop: int) -> Floats:
        """(3,) places near the end of an element on a stretch, which has run from places on: the nearest ones.

        They are looked for where they should be, and if nothing is near there on all that may have been passed.
        """
        path, nc = self.task.path, self._ahead.part(self._element, element + 1)
        six = self.task.ends(nc, slice(None))
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

    def _flush(self) -> None:
        """Make a batch of what waits."""
        if self._pending:
            self._make(self._pending)
            self._pending = []

    def _make(self, rows: list[_Row], *, goes_on: bool = False) -> None:
        """Put some stretches into a batch."""
        lead = int(self._continued and rows[0][0] == self._element)
        begin, last = rows[0][0] - lead, rows[-1][1]
        table = np.array(rows, _STRETCH)
        table["first"] -= begin
        table["last"] -= begin
        nc = self._ahead.part(begin, last + 1)
        self.ready.append(Batch(nc=nc, offset=begin, stretches=table, continued=bool(lead), goes_on=goes_on))

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
