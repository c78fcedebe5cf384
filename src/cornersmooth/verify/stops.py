"""Stops of the CL file, and which elements of the program reach them: a small automaton.

A *stop* is a pose that divides the motion: the end of a rapid, a hole, the very first pose. The program reaches them in
order. A *trace* says which stop it has reached, and whether it is in a hole or after a stop. Each element leads from
the traces that are possible to those that are possible after it, and only these are carried on: a trace with which an
element does not agree ends there. Where one is left, all before it is certain.

A program without a trace is wrong. Then the traces that lived longest go on with each fault that explains the element:
a stop is missing, the element is one too many, it ends elsewhere. What they say of faults are the problems.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from cornersmooth.model import Ints, Move
from cornersmooth.nc_reader.ahead import Ahead
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.tool import beyond_digits, directions, moving_rapids
from cornersmooth.statements.cycles import Drilling, drillings
from cornersmooth.statements.tool_changes import ToolChanges
from cornersmooth.verify.along_tool import AlongTool
from cornersmooth.verify.feeds import feed_at, out_of_hole
from cornersmooth.verify.holes import HoleLines
from cornersmooth.verify.task import Task

#: elements that are given out together
TOGETHER: Final = 1 << 14

#: stops after a fault among which that of an element is looked for, and traces that are carried on after one: they
#: decide what is named, and never whether a program passes
_AFTER_FAULT: Final = 64

#: elements before those that are certain that are still looked at
BEFORE: Final = 16

#: elements looked through at a time where only one thing can happen, at first
_FIRST_LOOK: Final = 16


class Step(NamedTuple):
    """A stop that is reached."""

    move: int  #: the move that ends there
    element: int  #: the element that ends there; the first one of a hole; the first feed move out of a hole
    opens: bool  #: whether feed moves may follow, rather than a hole
    last: int  #: last move before the next stop


class Hole(NamedTuple):
    """A hole that is drilled."""

    move: int
    first: int  #: the first element that belongs to it
    leaves: int  #: the element with which the tool leaves it
    cycle: Drilling


class Part(NamedTuple):
    """Elements that are certain: up to `stop`, that excluded."""

    stop: int
    steps: list[Step]


@dataclass(slots=True, eq=False)
class _Trace:
    """What the program may have reached."""

    stop: int  #: number of the last stop
    begin: int  #: the first element in a hole, or the first that is after a stop, as of `Step`
    inside: bool = False  #: whether it is in a hole
    back: _Trace | None = None  #: what it was before
    end: int = 0  #: first element that does not belong to the hole before
    problems: tuple[Problem, ...] = ()  #: what is wrong on the way from there
    cost: tuple[int, int] = (0, 0)  #: faults so far, and holes left out

    @property
    def key(self) -> tuple[int, int]:
        """Traces with the same go on alike."""
        return self.stop, self.begin if self.inside else -1

    def with_fault(self, problem: Problem) -> _Trace:
        """The same, with one more problem."""
        return replace(self, problems=(*self.problems, problem), cost=(self.cost[0] + 1, self.cost[1]))


class Stops:
    """Finds the elements, at least one, that reach the stops of the CL file, and checks them and the holes."""

    def __init__(self, task: Task, ahead: Ahead, changes: ToolChanges, along: AlongTool) -> None:
        self._task, self._ahead, self._changes, self._along = task, ahead, changes, along
        self.lines = HoleLines(task.original, ahead, task.axis_length, task.tolerance)
        #: rapids, holes and feeds out of holes, two numbers for each: the move and the element that begin it
        self.acts = array("q")
        self.holes: list[Hole] = []
        #: CS561 for holes that the program leaves out and may leave out if requested
        self.left_out: list[Problem] = []
        self.moves_left_out: set[int] = set()
        #: holes that an element may be the way up from, by the element: it also ends at the rapid behind them
        self.ways_up: dict[int, range] = {}
        #: CS531 a rapid goes elsewhere, CS532 one is missing, CS533 one too many; CS536 a feed move too many; of holes
        self.problems: list[Problem] = []
        self._steps: list[Step] = []
        self._find_stops()

    def _find_stops(self) -> None:
        """Find holes, and rapids that move the tool by more than digits show or come out of a hole, from anywhere."""
        lines, original = self.lines, self._task.original
        hole, rapid = lines.kind == Move.HOLE, np.flatnonzero(lines.kind == Move.RAPID)
        before = np.maximum(rapid - 1, 0)
        turned = np.linalg.norm(lines.axis[rapid] - lines.axis[before], axis=1) * lines.axis_length > lines.room
        moved = turned | hole[before] | beyond_digits(self._ahead.nc, lines.tip[rapid] - lines.tip[before])
        chosen = hole.copy()
        chosen[rapid[moved]] = chosen[:1] = True
        fed = ~chosen
        fed[rapid] = False
        self.moves: Ints = np.flatnonzero(chosen)
        self._move: list[int] = [*self.moves.tolist(), len(chosen)]
        self._hole: list[bool] = [*hole[self.moves].tolist(), False]
        self._holes = np.flatnonzero(hole[self.moves])  # among the stops
        #: whether feed moves follow each stop, and whether moves before the next lead anywhere from it
        self._fed: list[bool] = np.logical_or.reduceat(fed, self.moves).tolist()
        self._leads = cache(lambda stop: lines.leads(self._move[stop], self._move[stop + 1]))
        cycles = drillings(original.program, original.pose[hole].tolist())
        self._cycles: dict[int, Drilling] = dict(zip(np.flatnonzero(hole).tolist(), cycles, strict=True))

    # ------------------------------------------------------------------ reading

    def parts(self) -> Iterator[Part]:
        """Give out what is certain as it is read; all but the last `BEFORE` of that may be forgotten then."""
        ahead = self._ahead
        alive, element, given = [_Trace(-1, -1)], 0, 0
        while ahead.has(element):
            following = self._pass(alive[0], element) if len(alive) == 1 else element
            if following == element:
                alive, following = self._after(alive, element), element + 1
            element = following
            if element - given >= TOGETHER:
                best = min(alive, key=lambda one: one.cost)
                alive = [best] if best.cost[0] else alive  # after a fault that will do
            if len(alive) == 1:
                self._take(alive[0])
                sure = min(element, alive[0].begin) if alive[0].inside else element
                if sure - given >= TOGETHER:
                    yield Part(sure, self._steps)
                    given, self._steps = sure, []
        self._end(alive, element)
        yield Part(element, self._steps)

    def _pass(self, trace: _Trace, element: int) -> int:
        """First element from one on with which anything but going on along feed moves or the next rapids can happen."""
        ahead, lines, k = self._ahead, self.lines, trace.stop
        if trace.inside or k < 0:
            return element
        hole = self._hole[k + 1]
        if hole and (not self._fed[k] or lines.at(self._move[k + 1] - 1, element - 1)):
            return element
        size = _FIRST_LOOK if hole else TOGETHER
        begin = element
        while ahead.has(element) and element - begin < TOGETHER:
            stop = int(min(ahead.count, element + size, self._along.next_retract(element)))
            if stop == element:
                return element
            rapids = moving_rapids(ahead.nc, max(element - ahead.base, 1), stop - ahead.base) + ahead.base
            if hole:
                window = np.arange(element, stop)
                there = lines.exact(np.full(len(window), self._move[k + 1] - 1), window)
                rapids = np.concatenate((rapids, window[there] + 1))
            elif len(rapids):
                nearest = np.searchsorted(self._holes, k + 1)
                last = int(self._holes[nearest]) if nearest < len(self._holes) else len(self.moves)
                stops = self.moves[k + 1 : min(k + 1 + len(rapids), last)]
                exact = lines.exact(stops, rapids[: len(stops)])
                count = int(np.argmin(np.append(exact, False)))
                if count:
                    self._take(trace)
                    for one in rapids[:count].tolist():
                        trace.stop, trace.begin = trace.stop + 1, one
                        self._open(trace)
                    return int(rapids[count - 1]) + 1
            if len(rapids):
                return max(int(rapids.min()), element)
            element, size = stop, 2 * size
        return element

    # ------------------------------------------------------------------ the automaton

    def _after(self, alive: list[_Trace], element: int) -> list[_Trace]:
        """Traces after an element, from those before it."""
        if self._along.comes_back(element):
            self._check_return(element)
        stands = self.lines.stands(element)
        if stands and self.lines.feeds(element):
            return alive
        found: dict[tuple[int, int], _Trace] = {}

        def put(traces: Iterable[_Trace]) -> None:
            for one in traces:
                if one.cost < found.setdefault(one.key, one).cost:
                    found[one.key] = one

        if stands:  # a rapid for the digits of a stop alone
            put(one for one in alive if not self._comes_down_first(one.stop, element))
        for trace in alive:
            if not stands:
                put(self._from(trace, element))
            elif trace.inside or self._moved_on(trace.stop, element, -1):
                put(self._takes(trace, element))
        if stands and not found:  # it comes down to a hole that is left out
            put(one for trace in alive for one in self._from(trace, element))
        if found:
            return list(found.values())
        if self._along.stays(element):
            self.lines.forget()
            return self._after(alive, element)
        for trace in alive:
            put(self._with_fault(trace, element))
        return sorted(found.values(), key=lambda one: one.cost)[:_AFTER_FAULT]

    def _comes_down_first(self, stop: int, element: int) -> bool:
        """Whether the tool comes down from a retract to where it was, to go to another place in rapid from there.

        Unless a rapid of the CL file that leads nowhere, the last before the next stop, has it there.
        """
        if not self._along.comes_down_first(element) or self.lines.stands(element + 1):
            return False
        move = self._move[stop + 1] - 1
        there = move > self._move[stop] and self.lines.kind[move] == Move.RAPID
        first, behind = self._changes.elements_of(int(self._task.original.pose[move]))
        return not (there and first <= element < behind)

    def _moved_on(self, stop: int, element: int, begin: int) -> bool:
        """Whether no move between a stop and the next leads anywhere, or elements after one have run up to the last."""
        if stop < 0 or not self._leads(stop):
            return True
        return element - 1 > begin and self.lines.at(self._move[stop + 1] - 1, element - 1)

    def _check_return(self, element: int) -> None:
        """Complain of an element that goes on with a cut, but if the CL file has a pose where that was left."""
        lines, rapid = self.lines, not self.lines.feeds(element)
        if not lines.goes_to(element - 1, rapid=rapid):
            at_feed = "the tool goes on at feed with a cut that it has left, and does not come from above"
            text = "the tool comes back in rapid to where it has left a cut" if rapid else at_feed
            self.problems.append(Problem("CS582", 0, lines.nc_line(element), text))

    def _from(self, trace: _Trace, element: int) -> Iterator[_Trace]:
        """Traces to which an element leads from one without a fault."""
        taken = False
        for here in self._on(trace, element):
            for one in self._takes(here, element):
                taken = True
                yield one
            # of holes that may be left out the first that the element may belong to
            if taken and here is not trace and here.inside and not self._over(here.stop, element):
                return

    def _on(self, trace: _Trace, element: int) -> Iterator[_Trace]:
        """A trace, and those at later stops before an element, which begins a hole or need not be in the program."""
        here: _Trace | None = trace
        while here is not None:
            yield here
            here = self._goes_on(here, element)

    def _takes(self, trace: _Trace, element: int) -> Iterator[_Trace]:
        """Traces after an element that stays at a stop, reaches the next, or leads out of a hole."""
        lines, k = self.lines, trace.stop
        move, following, feeds = self._move[k], self._move[k + 1], lines.feeds(element)
        reaches = k + 1 < len(self.moves) and not self._hole[k + 1] and (not feeds or k < 0)
        reaches = reaches and lines.at(following, element)
        if not trace.inside:
            if reaches:
                yield _Trace(k + 1, element, False, trace, cost=trace.cost)
            elif k >= 0 and (self._is_fed(k, element) if feeds else self._negligible(k, element)):
                yield trace
            return
        if self._over(k, element):
            yield trace
        if feeds and self._fed[k]:
            block = lines.block(element)
            out = element - 1 if lines.at(move + 1, element - 1) else block.stop - 1
            if out < element or lines.is_straight(block):  # on the way out nothing else is looked at
                yield trace if out > element else self._fed_out(trace, element, out)
        elif reaches and self._done(k, element):
            yield self._finished(trace, _Trace(k + 1, element, False, trace), element)

    def _goes_on(self, trace: _Trace, element: int) -> _Trace | None:
        """Trace at the next stop before an element: it begins a hole, or nothing need be there in the program."""
        lines, k, t = self.lines, trace.stop, trace.stop + 1
        if t == len(self.moves):
            return None
        if trace.inside:
            passes = self._done(k, element)
        else:
            begin = trace.begin - (k >= 0 and self._hole[k])  # out of a hole the first feed move may be the last, too
            passes = self._moved_on(k, element, begin)
        if passes and self._hole[t] and (self._over(t, element) or self._may_be_left_out(t)):
            there = self._finished(trace, _Trace(t, element, True, trace), element)
            return None if there.problems else there
        if not passes or not trace.inside or self._hole[t] or not lines.at(self._move[t], element - 1):
            return None
        first, behind = self._changes.elements_of(int(self._task.original.pose[self._move[t]]))
        if not first <= element - 1 < behind:
            return None
        if lines.fed_above(self._move[k], element - 1, self._cycles[self._move[k]]):  # a rapid written as a feed move
            return None
        return self._finished(trace, _Trace(t, element - 1, False, trace), element)

    def _with_fault(self, trace: _Trace, element: int) -> Iterator[_Trace]:
        """Traces to which an element leads from one with a fault."""
        lines, feeds, first = self.lines, self.lines.feeds(element), trace.stop + 1
        surplus = ("CS533", "a rapid that the CL file does not have, or a feed move written as one")
        code, text = ("CS536", "feed moves that the CL file does not have") if feeds else surplus
        yield trace.with_fault(lines.problem(code, self._move[first], element, text))
        moves = self.moves[first : first + _AFTER_FAULT]
        elements = np.full(len(moves), element)
        hole = lines.kind[moves] == Move.HOLE
        fits = np.where(hole, ~np.isnan(lines.heights(moves, elements)), lines.exact(moves, elements) & (not feeds))
        here = trace
        for t, fit in enumerate(fits.tolist(), first):
            there = self._finished(here, _Trace(t, element, self._hole[t], here), element)
            if fit and there.cost[0] > trace.cost[0]:
                yield there
            elif fit:
                text = "motion that the CL file does not have"
                yield there.with_fault(lines.problem("CS534", self._move[first], element, text))
            elif t == first and not self._hole[t] and (not feeds or t == 0):
                amount = float(lines.missed(moves[:1], elements[:1])[1][0])
                text = "a rapid does not end at its pose"
                yield there.with_fault(lines.problem("CS531", self._move[t], element, text, amount))
            here = self._without(here, t, element)

    def _without(self, trace: _Trace, stop: int, element: int) -> _Trace:
        """Trace at the next stop, which is missing before an element; a hole is noted where it is left."""
        if self._hole[stop]:
            return self._finished(trace, _Trace(stop, element, True, trace), element)
        there = self._finished(trace, _Trace(stop, element - 1 if trace.inside else trace.begin, False, trace), element)
        lines, move, ahead = self.lines, self._move[stop], self._ahead
        first = max(min(trace.begin, element - 1), ahead.base)
        away = ahead.nc.tip[first - ahead.base : max(element, first + 1) - ahead.base] - lines.tip[move]
        near = first + int(np.argmin(np.linalg.norm(away, axis=1)))
        text = "a rapid of the CL file is missing, or is written as a feed move"
        return there.with_fault(lines.problem("CS532", move, near, text))

    def _fed_out(self, trace: _Trace, element: int, out: int) -> _Trace:
        """The trace out of a hole, which an element has left at feed."""
        there = self._finished(trace, _Trace(trace.stop, out, False, trace), element)
        if out == element:
            nc, own, move = self._ahead.nc, element - self._ahead.base, self._move[trace.stop]
            for wrong in feed_at(self._task, nc, own, move + 1, out_of_hole(self._task, nc, own, move)):
                there = there.with_fault(wrong)
        return there

    def _finished(self, trace: _Trace, there: _Trace, element: int) -> _Trace:
        """The trace out of another before an element, with what is wrong with the hole that it comes from."""
        there.cost = trace.cost
        if not trace.inside:
            return there
        lines, k = self.lines, trace.stop
        move = self._move[k]
        there.end = element
        before = lines.height(move, element - 1) if element > trace.begin else math.inf
        if (before < -lines.room or not there.inside) and self._ahead.has(element) and not lines.feeds(element):
            there.end += lines.height(move, element) > before  # the way up is the hole's, wherever else it leads
        found, left = lines.check(move, range(trace.begin, there.end), self._cycles[move])
        if self._along.next_retract(trace.begin) != trace.begin and (slant := lines.slant(move, trace.begin)):
            text = f"a rapid goes aslant to a hole, {slant:.4f} mm: across at the higher level, then down"
            found.append(lines.problem("CS563", move, trace.begin, text, slant))
        if there.stop > k and not self._done(k, element):
            found.append(lines.problem("CS535", move + 1, element - 1, "feed moves of the CL file are missing"))
        there.problems, there.cost = tuple(found), (trace.cost[0] + len(found), trace.cost[1] + left)
        return there

    # ------------------------------------------------------------------ what an element may be

    def _over(self, stop: int, element: int) -> bool:
        """Whether an element ends in the line of a hole, and no tool change parts it from that."""
        if not self._ahead.has(element):
            return False
        first, behind = self._changes.elements_of(int(self._task.original.pose[self._move[stop]]))
        return first <= element < behind and self.lines.over(self._move[stop], element)

    def _may_be_left_out(self, stop: int) -> bool:
        cycle = self._cycles[self._move[stop]]
        return cycle.tap or not cycle.depth > self.lines.room

    def _done(self, stop: int, element: int) -> bool:
        """Whether no move between a hole and the next stop leads away from where the tool is before an element."""
        return all(self.lines.at(move, element - 1) for move in range(self._move[stop] + 1, self._move[stop + 1]))

    def _is_fed(self, stop: int, element: int) -> bool:
        """Whether a feed move may follow a stop; only before holes, elsewhere the decision finds it."""
        return self._fed[stop] or not self._hole[stop + 1] or self.lines.at(self._move[stop + 1] - 1, element)

    def _negligible(self, stop: int, element: int) -> bool:
        """Whether an element moves the tool by no more than digits show, and not down first."""
        nc, at = self._ahead.nc, element - self._ahead.base
        both = slice(at - 1, at + 1)
        turn = self.lines.axis_length * np.ptp(directions(nc, nc.tip[both], nc.second[both]), axis=0)
        still = at > 0 and not beyond_digits(nc, np.diff(nc.tip[both], axis=0))[0] and max(turn) <= self.lines.room
        return still and not self._comes_down_first(stop, element)

    # ------------------------------------------------------------------ what is certain

    def _end(self, alive: list[_Trace], element: int) -> None:
        """Take down the rest at the end of the program."""
        last = len(self.moves) - 1
        best = min(alive, key=lambda one: one.cost)
        alive = sorted(alive, key=lambda one: -one.stop)
        ends = [here for trace in alive for here in self._on(trace, element) if here.stop == last]
        ends = [self._finished(here, _Trace(last + 1, element, True, here), element) for here in ends]
        if not ends:
            for t in range(best.stop + 1, last + 1):
                best = self._without(best, t, element)
            ends.append(self._finished(best, _Trace(last + 1, element, True, best), element))
        self._take(min(ends, key=lambda one: one.cost))

    def _take(self, trace: _Trace) -> None:
        """Take down what has happened up to a trace."""
        chain = [trace]
        while (before := chain[-1].back) is not None:
            chain.append(before)
        self.problems += chain[-1].problems
        for before, one in pairwise(reversed(chain)):
            self.problems += one.problems
            if before.inside:
                self._drilled(before, one.end, left=one.cost[1] > before.cost[1])
            if not one.inside and (before.inside or one.begin > before.begin):
                self._open(one)
                if before.inside and one.end > one.begin and not self._hole[one.stop]:
                    self._note_way_up(before, one)
            elif one.inside and not before.inside and one.stop < len(self.moves):
                self._steps.append(Step(self._move[one.stop], one.begin, False, -1))
        trace.back, trace.problems = None, ()

    def _open(self, trace: _Trace) -> None:
        last, move, before = self._move[trace.stop + 1] - 1, self._move[trace.stop], trace.begin - 1
        if self._hole[trace.stop]:  # the first move that leads anywhere from where the hole is left
            leads = (one for one in range(move + 1, last) if not self.lines.at(one, before))
            self.acts.extend((next(leads, last), trace.begin))
        elif not self._is_way_out(trace.begin):
            self.acts.extend((move, trace.begin))
        self._steps.append(Step(move, trace.begin, True, last))

    def _note_way_up(self, hole: _Trace, trace: _Trace) -> None:
        """Take down from which holes the element that reaches a rapid may be the way up.

        It is the first that goes up, and no higher than the cycle does, or than where the tool came from.
        """
        lines, first, element, nc = self.lines, trace.stop, trace.begin, self._ahead.nc
        came_from = nc.tip[max(hole.begin - 1 - self._ahead.base, 0)]
        goes_up = element == hole.begin or lines.feeds(element - 1)
        while goes_up and first and self._hole[first - 1] and self._over(first - 1, element):
            move = self._move[first - 1]
            highest = max(self._cycles[move].level, float((came_from - lines.tip[move]) @ lines.axis[move]))
            left = first == trace.stop or (move in self.moves_left_out and element == hole.begin)
            if not left or lines.height(move, element) > highest + lines.tolerance:
                break
            first -= 1
        if first < trace.stop:
            self.ways_up[element] = range(self._move[first], self._move[trace.stop])

    def _is_way_out(self, element: int) -> bool:
        """Whether an element belongs to the block with which the tool leaves the last hole."""
        if not self.holes:
            return False
        leaves, lines = self.holes[-1].leaves, self.lines
        return element <= leaves or (leaves >= self._ahead.base and lines.nc_line(element) == lines.nc_line(leaves))

    def _drilled(self, trace: _Trace, end: int, *, left: bool) -> None:
        """Take down a hole."""
        lines, move = self.lines, self._move[trace.stop]
        group = [one for one in range(trace.begin, end) if lines.over(move, one)]
        if left:
            cycle = self._cycles[move]
            text = f"a hole of the CL file is not {'tapped' if cycle.tap else 'drilled'}"
            self.left_out.append(lines.problem("CS561", move, group[0] if group else -1, text))
            self.moves_left_out.add(move)
        elif group:
            fed = [one for one in group if lines.feeds(one)]
            inside = [one + 1 for one in group if lines.height(move, one) < -lines.room] or fed[-1:] or group[:1]
            self.holes.append(Hole(move, group[0], min(inside[-1], end), self._cycles[move]))
            self.acts.extend((move, group[0]))
