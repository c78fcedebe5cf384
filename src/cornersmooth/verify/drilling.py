"""Holes: which path elements drill them, and whether they do it properly.

A hole is a line through its pose along the tool axis. Between the pose before a run of holes and the pose behind it,
the text may move only along these lines, one after another in the order of the CL file, and rapidly from line to line
above the holes. How often it retracts is its own affair. How deep they are the CYCLE statements say
(`cycles`), as far as they do so without any doubt.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from cornersmooth.model import Move
from cornersmooth.nc_reader.ahead import Ahead
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.statements.cycles import Drilling, drillings
from cornersmooth.statements.tool_changes import ToolChanges
from cornersmooth.verify.cl_motion import Original
from cornersmooth.verify.hole_check import check_hole
from cornersmooth.verify.hole_search import HoleSearch

#: elements held of what has been given out
_KEPT = 16

#: holes of a run that are checked together, at least
_TOGETHER = 1 << 8


class Between(NamedTuple):
    """Elements between two runs of holes, and the moves that they belong to; the elements may come in several parts.

    Parameters
    ----------
    move_first, move_last : int
        Both included.
    first, stop : int
        Elements; the latter is excluded.
    final : bool
        Whether no more elements belong to these moves.
    """

    move_first: int
    move_last: int
    first: int
    stop: int
    final: bool


class Holes:
    """Finds the elements of all holes, and checks them.

    Parameters
    ----------
    axis_length, tolerance : float, mm
    """

    def __init__(
        self, original: Original, ahead: Ahead, axis_length: float, tolerance: float, changes: ToolChanges
    ) -> None:
        self._original, self._ahead = original, ahead
        self._search = HoleSearch(original, ahead, axis_length, tolerance, changes)
        #: elements that belong to holes, ascending, three numbers for each: its own, the first move that it may belong
        #: to, and the last: over holes that are not drilled the tool may be there for the next
        self.elements = array("q")
        #: moves of the holes at whose bottom the tool waits, and for how many ms
        self.dwells: list[tuple[int, float]] = []
        #: moves of the holes to be tapped in which something is fed
        self.taps: list[int] = []
        #: CS561 for holes that the text leaves out and may leave out if asked: taps, cycles that are not understood
        self.left_out: list[Problem] = []
        #: CS561 a hole is missing, CS562 a wrong depth, CS563 a rapid inside a hole, CS564 a feed that is not a hole's
        self.problems: list[Problem] = []
        #: first move behind the last run that leads somewhere
        self._went_on = 0

    def between(self) -> Iterator[Between]:
        """Say what lies before, between and behind the runs of holes, as it is read."""
        original, ahead = self._original, self._ahead
        hole = original.program.kind[original.pose] == Move.HOLE
        moves = len(original.pose)
        edges = np.flatnonzero(np.diff(hole, prepend=False, append=False))
        all_cycles = drillings(original.program, original.pose[hole].tolist())
        move = element = used = 0
        runs = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
        for number, (first, stop) in enumerate(runs):
            cycles = all_cycles[used : used + stop - first]
            used += stop - first
            if first > move and not self._search.stands(move, first, element):
                for begin, found in self._search.starts(move, first, element, cycles[0]):
                    yield Between(move, first - 1, element, begin, found)
                    element = begin
                    ahead.forget(element - _KEPT)
            above = runs[number + 1][0] if number + 1 < len(runs) else None
            again = above is not None and self._search.same_hole(stop - 1, above)
            element = self._drilled(first, stop, element, cycles, again=again)
            ahead.forget(element - _KEPT)
            # the move out of the last hole starts wherever the tool has been left
            loose = stop < moves and original.program.kind[original.pose[stop]] != Move.RAPID
            move = self._went_on if self._went_on > stop else stop - 1 if loose else stop
        while ahead.has(element):
            yield Between(move, moves - 1, element, ahead.count, False)
            element = ahead.count
            ahead.forget(element - _KEPT)
        there = move + 1 if move < moves and hole[move] else move  # out of a hole the way begins anywhere
        while element == ahead.count and there < moves and self._search.stays(there, element - 1):
            move = there = there + 1  # the tool is there
        yield Between(move, moves - 1, element, element, True)

    def _drilled(self, first: int, stop: int, start: int, cycles: list[Drilling], *, again: bool) -> int:
        """Check the holes of a run; return the first element behind them."""
        search = self._search
        groups: list[list[int]] = []  # elements of holes that are not checked yet, and of those before them
        begin, element = first, start
        for group, element in search.consume(first, stop, start, cycles, again=again):
            # no later hole has to do with those before one that is fed in
            if len(groups) >= _TOGETHER and search.feeds(groups[-1]) and not set(group) & set(groups[-1]):
                self._check(begin, groups, (first, stop), cycles[begin - first : begin - first + len(groups)])
                begin, groups = begin + len(groups), []
                self._ahead.forget(min(group, default=element) - _KEPT)
            groups.append(group)
        self._went_on = stop
        if stop < len(self._original.pose):
            groups[-1], element, self._went_on = search.give_back(stop, groups[-1], cycles[-1], element)
        self._check(begin, groups, (first, stop), cycles[begin - first :])
        return element

    def _check(self, begin: int, groups: list[list[int]], run: tuple[int, int], cycles: list[Drilling]) -> None:
        """Check holes from `begin` on, of a run that has first and stop, and take down what belongs to them."""
        search = self._search
        for k, (group, cycle) in enumerate(zip(groups, cycles, strict=True)):
            move, fed = begin + k, bool(search.feeds(group))
            for one in group:  # of several in one hole the first: what follows may leave nothing in the text
                if one > (self.elements[-3] if self.elements else -1) and not search.stands_still(one):
                    last = move if fed else begin + self._latest(one, begin, groups, k, run[1])
                    self.elements.extend((one, move, last))
            shared = k and np.isnan(cycle.depth) and set(group) & set(groups[k - 1])
            if not shared:  # looked at there
                self.problems += check_hole(search, move, group, cycle, alone=not search.repeats(*run, move))
            if group and cycle.dwell:
                self.dwells.append((move, cycle.dwell))
            if cycle.tap and not np.isnan(cycle.depth):
                self.taps.append(move)
            elif np.isnan(cycle.depth) and (cycle.tap or not fed):
                near = search.nc_line(group[0]) if group else 0
                text = f"a hole of the CL file is not {'tapped' if cycle.tap else 'drilled'}"
                self.left_out.append(Problem("CS561", int(search.line[move]), near, text))

    def _latest(self, element: int, begin: int, groups: list[list[int]], k: int, stop: int) -> int:
        """Which of the holes from `begin` on is the last that an element of one may belong to."""
        while begin + k + 1 < stop and not self._search.feeds(groups[k]) and self._search.over(begin + k + 1, element):
            k += 1
        return k
