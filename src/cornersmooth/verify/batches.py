"""The written motion in batches, each with its stretches and the place of every vertex on the CL path.

A *stretch* is the run of feed moves between two stops (see `stops`). Many short stretches make a batch; a long one is
cut anywhere, as the decision (`passage`) goes on from where the motion has been reached.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Move
from cornersmooth.nc_reader.ahead import Ahead
from cornersmooth.nc_reader.elements import Element, Elements, Event, Problem
from cornersmooth.statements.tool_changes import ToolChanges
from cornersmooth.verify.decision import Decision
from cornersmooth.verify.motions import Motion, written_motion
from cornersmooth.verify.nearest import Metric
from cornersmooth.verify.passage import Break
from cornersmooth.verify.stops import Step, Stops, out_of_hole
from cornersmooth.verify.task import Task

#: elements in a batch
BATCH: Final = 1 << 14

#: a stretch in a batch: it begins at the end of one element and ends with another; where it begins on the CL path
#: (segment and fraction), and its last segment plus one
STRETCH: Final = np.dtype(
    [("first", np.int64), ("last", np.int64), ("start", np.int64), ("stop", np.int64), ("fraction", np.float64)]
)


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Elements that are decided at once, and then measured."""

    nc: Elements
    offset: int  #: number of the first of them in the whole text
    stretches: NDArray[Any]  #: elements are counted in this batch
    motion: Motion  #: the polyline of the elements from the end of the first stretch's `first` on, v vertices
    #: (v,): segment plus fraction of the CL path, ascending; NaN where a vertex is none of a stretch, or not reached
    place: Floats
    breaks: tuple[tuple[Metric, Break], ...]  #: where the motions part, and what does
    whole: bool  #: whether all was decided
    #: whether the first stretch begins in the batch before: one more element stands in front of it
    continued: bool
    goes_on: bool  #: whether the last stretch goes on in the next batch

    @property
    def first(self) -> int:
        """Element at the end of which it begins."""
        return int(self.stretches["first"][0])

    @property
    def last(self) -> int:
        """Its last element."""
        return int(self.stretches["last"][-1])


@dataclass
class Reached:
    """What is known of stops: elements of the text, and the CL path length where they are, and where they begin."""

    element: array[int] = field(default_factory=lambda: array("q"))
    length: array[float] = field(default_factory=lambda: array("d"))
    begin: array[float] = field(default_factory=lambda: array("d"))


class Batches:
    """Makes batches of the elements of a text, as they come.

    Parameters
    ----------
    events : sequence of Event
        Words of the text, which grow as it is read.
    """

    def __init__(self, task: Task, events: Sequence[Event]) -> None:
        self.task, self._events = task, events
        self.decision = Decision(task)
        self.problems: list[Problem] = []
        self.stops = Reached()
        #: elements of holes, as of `Holes`
        self.holes = array("q")
        #: moves of holes at whose bottom the tool waits, and ms
        self.dwells: list[tuple[int, float]] = []
        self.taps: list[int] = []
        self.left_out: list[Problem] = []
        self.elements = 0

    def of(self, chunks: Iterable[Elements]) -> Iterator[Batch]:
        """Give out all batches of a text."""
        task = self.task
        moves = len(task.original.pose)
        ahead = Ahead(nc for nc in chunks if len(nc))
        if not ahead.has(0) or not moves:
            if ahead.count or moves:
                self._lacking(int(ahead.nc.line[0]) if ahead.count else None)
            while ahead.has(ahead.count):
                ahead.forget(ahead.count - 1)
            self.elements = ahead.count
            return
        stops = Stops(task, ahead, ToolChanges(task.original.program, self._events))
        self.holes, self.dwells = stops.elements, stops.dwells
        self.taps, self.left_out = stops.taps, stops.left_out
        part, first = _Part(self, ahead.nc), 0
        for sure in stops.parts():
            yield from part.take(ahead.part(first, sure.stop), sure.steps)
            first = sure.stop
        yield from part.end()
        self.elements = ahead.count
        self.problems += stops.problems

    def _lacking(self, surplus: int | None) -> None:
        """Say that only one of the two motions has anything; `surplus` is the NC line of motion without any."""
        original = self.task.original
        line = 0 if surplus is not None else int(original.program.line[original.pose[0]])
        text = "the program lacks motion of the CL file" if surplus is None else "motion that the CL file does not have"
        self.problems.append(Problem("CS534", line, surplus or 0, text))


class _Part:
    """A part of both motions without holes, as it is read.

    Element numbers are those of the whole text; `self.held` begins with number `self.base`.
    """

    def __init__(self, batches: Batches, nc: Elements) -> None:
        self.batches, self.task = batches, batches.task
        self.held, self.base = nc.part(0, 0), 0
        #: the stretch that has no end yet: where it begins, as a move and in the text, and on the CL path; and the last
        #: move that it may have
        self.move, self.element, self.move_last = -1, 0, -1
        self.start, self.fraction, self.share = 0, 0.0, 0.0
        self.continued = False
        #: whether a lack of motion between its stops has been said, and where the tool was at the end of it if not
        self.told = False
        self.origin: tuple[Floats, Floats] | None = None
        self.pending: list[tuple[int, int, int, int, float]] = []

    def take(self, nc: Elements, steps: list[Step]) -> Iterator[Batch]:
        """Take more elements, and the stops among them."""
        self.held = Elements.joined([self.held, nc])
        for move, element, opens, last in steps:
            yield from self._close(move - 1, element - 1)
            if opens:
                self._open(move, element)
                self.move_last = last
            else:
                yield from self._flush()
                self.move = -1
        stop = self.base + len(self.held)
        if self.move >= 0 and stop - 1 - self.element > BATCH + BATCH // 2:
            yield from self._cut_open(stop - 1)
        first = min(self.pending[0][0] if self.pending else stop, self.element if self.move >= 0 else stop) - 2
        if first > self.base:
            self.held, self.base = self.held.part(first - self.base, len(self.held)), first

    def end(self) -> Iterator[Batch]:
        """Give out the rest."""
        yield from self._close(len(self.task.original.pose) - 1, self.base + len(self.held) - 1)
        yield from self._flush()

    def _open(self, move: int, element: int) -> None:
        """Begin a stretch at a stop."""
        task, at = self.task, element - self.base
        original = task.original
        kind = int(original.program.kind[original.pose[move]])
        path, last_vertex = task.path, original.trail.last
        start = int(last_vertex[move])
        there = begin = float(path.length[start])
        if move == 0 and kind == Move.RAPID and self.held.kind[at] != Element.RAPID:
            text = "the first rapid is written as a feed move"
            line = int(original.program.line[original.pose[move]])
            self.batches.problems.append(Problem("CS532", line, int(self.held.line[at]), text))
        if kind == Move.HOLE:  # out of it the way begins anywhere
            there = path.length_at(out_of_hole(task, self.held, at, move)[0])
        self.move, self.element, self.continued, self.told, self.origin = move, element, False, False, None
        self.start, self.fraction, self.share = start, 0.0, 0.0
        if there > begin:
            self.start, self.fraction = path.place_at(there)
            self.share = (there - begin) / float(path.length[last_vertex[move + 1]] - begin)
        self.batches.stops.element.append(element)
        self.batches.stops.length.append(there)
        before = last_vertex[max(move - (kind == Move.RAPID), 0)]
        self.batches.stops.begin.append(float(path.length[before]))

    def _close(self, move_last: int, element_last: int) -> Iterator[Batch]:
        """End the stretch."""
        if self.move < 0:
            return
        theirs, ours = move_last > self.move, element_last > self.element
        if theirs != ours and not self.told:
            self._lost(move_last, element_last, theirs=theirs)
        if not (theirs and ours):
            return
        stop = int(self.task.original.trail.last[move_last])
        while element_last - self.element > BATCH + BATCH // 2:
            yield from self._cut(self.element + BATCH, stop)
        start, fraction = self.start, self.fraction
        if start >= stop:
            start, fraction = stop - 1, 1.0
        if self.pending and (element_last - self.pending[0][0] > BATCH or stop - self.pending[0][2] > 2 * BATCH):
            yield from self._flush()
        self.pending.append((self.element, element_last, start, stop, fraction))

    def _cut_open(self, last: int) -> Iterator[Batch]:
        """Give out what is held of a stretch whose end is not known yet, but its last element."""
        if self.move < self.move_last:
            while last - self.element > BATCH + BATCH // 2:
                yield from self._cut(self.element + BATCH, int(self.task.original.trail.last[self.move_last]))
            return
        # nothing of the CL path is left for what is held: it may only stay where it is
        yield from self._flush()
        yield from self._close(self.move, last)
        at = self.element - self.base
        self.origin = self.origin or (self.held.tip[at].copy(), self.held.second[at].copy())
        self.element, self.continued = last, True

    def _cut(self, element: int, stop: int) -> Iterator[Batch]:
        """Give out a long stretch up to an element."""
        yield from self._flush()
        start, fraction = (self.start, self.fraction) if self.start < stop else (stop - 1, 1.0)
        yield self._batch([(self.element, element, start, stop, fraction)], goes_on=True)
        place = self.batches.decision.reached
        self.start = min(int(place), stop - 1)
        self.element, self.fraction, self.continued = element, place - self.start, True

    def _flush(self) -> Iterator[Batch]:
        """Give out what waits."""
        if self.pending:
            yield self._batch(self.pending)
            self.pending = []

    def _batch(self, rows: list[tuple[int, int, int, int, float]], *, goes_on: bool = False) -> Batch:
        task, lead = self.task, int(self.continued and rows[0][0] == self.element)
        begin = rows[0][0] - lead
        table = np.array(rows, STRETCH)
        table["first"] -= begin
        table["last"] -= begin
        elements = self.held.part(begin - self.base, rows[-1][1] + 1 - self.base)
        first = int(table["first"][0])
        part = elements.part(first, len(elements))
        motion = written_motion(part, task.tolerance, task.axis_length, own_axis=task.own_axis)
        ends = motion.last[table["first"] - first], motion.last[table["last"] - first]
        place, breaks, whole = self.batches.decision.take(part, motion, ends, table, goes_on=goes_on)
        return Batch(
            nc=elements,
            offset=begin,
            stretches=table,
            motion=motion,
            place=place,
            breaks=breaks,
            whole=whole,
            continued=bool(lead),
            goes_on=goes_on,
        )

    def _lost(self, move_last: int, element_last: int, *, theirs: bool) -> None:
        """Say that only one of the two motions moves between two stops."""
        task, nc = self.task, self.held
        original = task.original
        program = original.program
        if theirs:
            poses = original.pose[self.move : move_last + 1]
            tip, other, scale = program.tip[poses], program.axis[poses], task.axis_length
            tip[0] += self.share * (tip[1] - tip[0])
            other[0] += self.share * (other[1] - other[0])
            text, code = "feed moves of the CL file are missing", "CS535"
        else:
            part = slice(self.element - self.base, element_last + 1 - self.base)
            tip, other = nc.tip[part], nc.second[part]
            scale = task.axis_length if nc.second_is == "vector" else 1.0
            text, code = "feed moves that the CL file does not have", "CS536"
        from_tip, from_other = (tip[0], other[0]) if theirs or self.origin is None else self.origin
        extent = np.abs(tip - from_tip).max() + scale * np.abs(other - from_other).max()
        if extent > task.margin(nc):
            self.told = True
            move = min(self.move + 1, len(original.pose) - 1)
            element = min(self.element + 1 - self.base, len(nc) - 1)
            line = int(program.line[original.pose[move]])
            self.batches.problems.append(Problem(code, line, int(nc.line[element]), text, float(extent)))
