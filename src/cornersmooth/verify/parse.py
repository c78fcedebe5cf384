"""The program as a parse: it does the acts of the CL file one after the other, and nothing else.

An *act* is a rapid, a run of feed moves, or a hole. Rapids and holes are known digit for digit, so they divide both
motions alike; what is between two of them is decided by itself. A *stop* is the pose where a run begins: the end of a
rapid, a hole, the very first pose.

Where the next element does not begin the next act, that is the fault, at its line. What is looked for behind a fault
decides what is named, and never whether a program passes.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Generator, Iterator, Sequence
from itertools import count
from typing import Final

import numpy as np

from cornersmooth.model import Move
from cornersmooth.nc_reader.elements import Ahead, Element, Event
from cornersmooth.nc_reader.tool import moving_rapids
from cornersmooth.verify.acts import Acts, Stops, Words
from cornersmooth.verify.along_tool import AlongTool
from cornersmooth.verify.feeds import feed_at, out_of_hole
from cornersmooth.verify.holes import Hole, HoleLines
from cornersmooth.verify.stretches import Stretches
from cornersmooth.verify.task import Task

#: elements that are given out together
TOGETHER: Final = 1 << 14

#: stops and elements behind a fault among which the next that fits is looked for
_AFTER_FAULT: Final = 64


class Parse:
    """Goes through the acts of the CL file and the elements of a program, at least one, side by side."""

    def __init__(self, task: Task, ahead: Ahead, events: Sequence[Event], retracts: Sequence[int], acts: Acts) -> None:
        self._task, self._ahead, self._words, self.acts = task, ahead, Words(events), acts
        self._along, self.stretches = AlongTool(ahead, retracts, events, acts), Stretches(task, ahead, acts)
        self.lines = HoleLines(task, ahead, acts.still)
        stops = Stops.of(task, self.lines)
        self.moves, self._move, self._hole, self._holes = stops.moves, stops.move, stops.hole, stops.holes
        self._fed, self._cycles, self._stated, self._loads = stops.fed, stops.cycles, stops.stated, stops.loads
        self._given = 0  #: elements given out so far
        self._begun = -1  #: the element with which the run begins that goes on; -1 within a hole and in front of all
        self._from: tuple[int, ...] = ()  # the move and the element that a run of feed moves begins with
        # where a run may be divided next: first element and move, and how far the tool has gone, mm
        self._looked, self._cut_at, self._gone = 0, 0, 0.0

    def parts(self) -> Iterator[int]:
        """Give out up to which element, that excluded, all is certain: all but the last `BEFORE` may be forgotten."""
        stop, element, last = -1, 0, len(self.moves) - 1
        while True:
            stop, element = yield from self._run(stop, element)
            if self._hole[stop + 1] and (self._over(stop + 1, element) or self._may_be_left_out(stop + 1)):
                stop, element = self._drill(stop + 1, element)
            elif self._reaches(stop + 1, element):
                self._open(stop + 1, element)
                stop, element = stop + 1, element + 1
            elif self._ahead.has(element):
                stop, element = self._fault(stop, element)
            elif stop < last:
                stop = self._lack(stop + 1, element)
            else:
                break
            yield from self._certain(element)
        self._end_run(self._move[-1], element)
        yield element

    def _certain(self, element: int) -> Iterator[int]:
        if element - self._given >= TOGETHER:
            yield element
            self._given = element

    def _run(self, stop: int, element: int) -> Generator[int, None, tuple[int, int]]:
        """Go along feed moves, and the rapids behind them, up to a hole or to what is no act of the CL file."""
        ahead, lines, along = self._ahead, self.lines, self._along
        met = -1  # behind the last pose before a hole
        while ahead.has(element):
            hole = self._hole[stop + 1]
            if self._begun < 0 or (hole and not self._fed[stop]):  # no feed move may follow
                return stop, self._pass_idle(stop, element)
            if along.next_retract(element) == element:
                along.leave_cut(element)
                behind = self._pass_idle(stop, element)
                if behind == element and not lines.feeds(element) and lines.stands(element):
                    break
                element = behind
                if not ahead.has(element):
                    break
            if hole and met < 0 and lines.at(self._move[stop + 1] - 1, element - 1):
                met = element
            end = int(min(ahead.count, element + TOGETHER, max(along.next_retract(element + 1), element + 1)))
            if hole:
                rapids = element + np.flatnonzero(
                    ahead.nc.kind[element - ahead.base : end - ahead.base] == Element.RAPID
                )
            else:
                rapids = moving_rapids(ahead.nc, max(element - ahead.base, 1), end - ahead.base) + ahead.base
            if not hole and len(rapids):
                nearest = np.searchsorted(self._holes, stop + 1)
                last = int(self._holes[nearest]) if nearest < len(self._holes) else len(self.moves)
                stops = self.moves[stop + 1 : min(stop + 1 + len(rapids), last)]
                count = int(np.argmin(np.append(lines.exact(stops, rapids[: len(stops)]), False)))
                for one in rapids[:count].tolist():
                    self._divide(stop, one)
                    stop, element = stop + 1, one + 1
                    self._open(stop, one)
                if count:
                    yield from self._certain(element)
                    continue
            feeds_to = int(rapids[0]) if len(rapids) else end
            if hole:
                window = np.arange(element, feeds_to)
                there = np.flatnonzero(lines.exact(np.full(len(window), self._move[stop + 1] - 1), window))
                met = element + int(there[-1]) + 1 if len(there) else met
            self._divide(stop, feeds_to if met < 0 else min(met, feeds_to))
            if len(rapids):
                element = self._pass_idle(stop, feeds_to)
                if element == feeds_to or (met == feeds_to and self._over(stop + 1, element)):
                    break
                continue
            element = feeds_to
            yield from self._certain(element if met < 0 else met)
        known = met >= 0 and (self._over(stop + 1, met) or self._may_be_left_out(stop + 1))
        return stop, met if known else element

    def _divide(self, stop: int, end: int) -> None:
        """Divide a run where an element in front of `end` ends at the pose of a statement, and words are behind it."""
        element, self._looked = self._looked, max(self._looked, end)
        stated = (bisect_left(self._stated, one) for one in (self._cut_at, self._move[stop + 1]))
        if not (moves := self._stated[slice(*stated)]) or end <= element:
            return
        lines, nc, base = self.lines, self._ahead.nc, self._ahead.base
        first = max(element - 1, base)
        ends = self._task.ends(nc, slice(first - base, end - base))
        ways = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        gone = self._gone + np.append(0.0, np.cumsum(ways))
        self._gone = float(gone[-1])
        length, last = self._task.path.length, self._task.original.trail.last
        elements = sorted({event.element for event in self._words.between(element, end)})
        for one, near in zip(elements, lines.poses_near(elements, moves), strict=True):
            there = [move for move in near if move >= self._cut_at and lines.at(move - 1, one - 1)]
            if there:
                way = gone[max(one - 1 - first, 0)] + length[last[self._move[stop]]]
                # of those that are there again the nearest, and of those within the tolerance the first
                off = np.abs(length[last[np.array(there) - 1]] - way)
                move = there[int(np.argmin(np.maximum(off, self._task.tolerance)))]
                self.acts.cuts.extend((move, one))
                self._cut_at = move + 1
                if move - 1 > self._move[stop] and one - 1 > self._begun:
                    self.stretches.end(move - 1, one - 1)
                    self.stretches.begin(move - 1, one - 1, self._move[stop + 1] - 1)

    def _pass_idle(self, stop: int, element: int) -> int:
        """First element from one on that leads anywhere: posts add others beside retracts."""
        lines, along, following = self.lines, self._along, stop + 1
        while self._ahead.has(element):
            rapid = not lines.feeds(element)
            along.check_return(element, lines)
            due = self._due(following, element)
            if self._reaches(due, element) and (due == following or self._is_there(due, element)):
                break
            if lines.stands(element) and not (rapid and stop >= 0 and self._comes_down_first(stop, element)):
                element += 1
            elif self._hole[due] and self._over(due, element):
                break
            elif along.stays(element):
                lines.forget()
            else:
                break
        return element

    def _reaches(self, stop: int, element: int) -> bool:
        """Whether an element leads to a rapid of the CL file, or to the first pose."""
        lines = self.lines
        if stop == len(self.moves) or self._hole[stop]:
            return False
        there = self._ahead.has(element) and (stop == 0 or not lines.feeds(element))
        if not (there and lines.at(self._move[stop], element)):
            return False
        changed = stop > 0 and self._hole[stop - 1] and not self._has_tool(self._move[stop], element - 1)
        return changed or not lines.stands(element) or not lines.at(self._move[stop], element - 1)

    def _drill(self, stop: int, begin: int) -> tuple[int, int]:
        """Take a hole: a cycle of the control, or what leads to its depth and out again, and the rapids behind that."""
        lines, move, end, lowest = self.lines, self._move[stop], begin, math.inf  # of the feed moves
        left = self._is_left_out(stop, begin)
        while not left and self._over(stop, end):
            block = lines.block(end)
            if lines.is_cycle(block):
                end = block.stop
                break
            lowest = min(lowest, lines.height(move, end)) if lines.feeds(end) else lowest
            end += 1
            if lowest <= lines.room - self._cycles[move].depth and lines.height(move, end - 1) >= -lines.room:
                break
        return self._leave(stop, begin, self._up_to_act(stop, end, left=left))

    def _up_to_act(self, stop: int, end: int, *, left: bool) -> int:
        """First element from one on that is no rapid in the line of a hole, or belongs to the act behind it.

        Where that is a hole, too, the rapids that go up belong to this one, or all if this one is left out.
        """
        lines, move, following = self.lines, self._move[stop], stop + 1
        while self._over(stop, end) and not lines.feeds(end):
            if self._hole[following]:
                stays = left or lines.stands(end) or lines.height(move, end) > lines.begins(move, end)
            else:
                stays = not (self._is_there(following, end) and self._reaches(following, end))
                stays &= not (self._is_there(following, end - 1) and self._begins(following + 1, end))
            if not stays:
                break
            end += 1
        return end

    def _is_left_out(self, stop: int, begin: int) -> bool:
        """Whether a hole may be left out, and the first feed move in its line belongs to what is behind it."""
        if not self._may_be_left_out(stop):
            return False
        lines, cycle = self.lines, self._cycles[self._move[stop]]
        fed = next(one for one in count(begin) if not self._over(stop, one) or lines.feeds(one))
        if not self._over(stop, fed):
            return True
        others = self._fed[stop] or (self._hole[stop + 1] and self._over(stop + 1, fed))
        others |= any(self._is_there(stop + 1, one) for one in range(begin - 1, fed))
        carries = math.isnan(cycle.feed) or lines.carries(fed, cycle.feed, per_revolution=cycle.per_revolution)
        return others and (math.isnan(cycle.depth) or not carries)

    def _begins(self, stop: int, element: int) -> bool:
        """Whether an element begins a hole, or what follows holes that may be left out."""
        due = self._due(stop, element)
        return self._over(due, element) if self._hole[due] else self._reaches(due, element)

    def _due(self, stop: int, element: int) -> int:
        """The first stop from one on that is no hole left out without any element in its line."""
        while self._hole[stop] and self._may_be_left_out(stop) and not self._over(stop, element):
            stop += 1
        return stop

    def _is_in_doubt(self, stop: int, element: int) -> bool:
        """Whether nobody can tell which of holes in one line an element belongs to: a cycle of the control tells."""
        lines, moves = self.lines, [self._move[one] for one in (stop - 1, stop + 1) if one >= 0 and self._hole[one]]
        fed = next((one for one in range(element, self._ahead.count) if lines.feeds(one)), element)
        move = self._move[stop]
        alike = any(self._load(move) == self._load(one) and lines.in_line(move, one) for one in moves)
        return alike and self._over(stop, element) and not lines.is_cycle(lines.block(fed))

    def _load(self, move: int) -> int:
        """How many tool changes are in front of a move."""
        return bisect_right(self._loads, self._task.original.pose[move])

    def _leave(self, stop: int, begin: int, end: int) -> tuple[int, int]:
        """Take down a hole that some elements belong to."""
        lines, move = self.lines, self._move[stop]
        if self._begun >= 0:
            self.stretches.end(move - 1, begin - 1)
            self.stretches.leave()
        self._end_run(move, begin)
        behind = end  # the way up is the hole's, wherever else it leads
        if self._over(stop, end) and not lines.feeds(end) and not self._hole[stop + 1]:
            behind += int(end == begin or lines.height(move, end) > lines.begins(move, end))
        hole = Hole.of(lines, move, range(begin, behind), self._cycles[move])
        found = hole.problems()
        if any(one.code != "CS541" for one in found) and self._is_in_doubt(stop, begin):
            self.acts.unlooked.append((lines.nc_line(begin), "holes above one another in one line"))
            found = []
        if hole.first == begin and self._along.next_retract(begin) != begin and (slant := lines.slant(move, begin)):
            text = f"a rapid goes aslant to a hole, {slant:.4f} mm: across at the higher level, then down"
            found.append(lines.problem("CS563", move, begin, text, slant))
        self.acts.problems += found
        begins = hole.first >= 0
        if hole.left_out:
            text = f"a hole of the CL file is not {'tapped' if hole.cycle.tap else 'drilled'}"
            self.acts.left_out[move] = lines.problem("CS561", move, hole.first, text)
            begins = begins and self._words.tool_changes(hole.first) > self._words.tool_changes(hole.first - 1)
        elif begins:
            self.acts.holes.append(hole)
        self.acts.begins.extend((move, hole.first) if begins else ())
        return self._go_out(hole, stop, begin, end)

    def _go_out(self, hole: Hole, stop: int, begin: int, end: int) -> tuple[int, int]:
        """Begin the run of feed moves that leads out of a hole, or take the rapid that its way up is."""
        ahead, lines, move, following = self._ahead, self.lines, self._move[stop], stop + 1
        while self._fed[stop] and ahead.has(end) and lines.feeds(end) and lines.stands(end):
            end += 1
        if self._fed[stop] and ahead.has(end) and lines.feeds(end):
            block = lines.block(end)
            out = end - 1 if lines.at(move + 1, end - 1) else block.stop - 1
            if out >= end and not lines.is_straight(block):
                text = "feed moves that the CL file does not have"
                self.acts.problems.append(lines.problem("CS536", move, end, text))
            if out == end:
                nc, own = ahead.nc, end - ahead.base
                self.acts.problems += feed_at(self._task, nc, own, move + 1, out_of_hole(self._task, nc, own, move))
            self._open(stop, out)
            return stop, max(out, end - 1) + 1
        if not self._done(stop, end):
            text = "feed moves of the CL file are missing"
            self.acts.problems.append(lines.problem("CS535", move + 1, end - 1, text))
        if following < len(self.moves) and not self._hole[following]:
            if self._reaches(following, end):
                self._open(following, end, up=self._is_way_up(following, begin, end))
                return following, end + 1
            there = self._is_there(following, end - 1)
            if there and not (lines.feeds(end - 1) and hole.fed_above(lines.height(move, end - 1))):
                reached = next(one for one in range(end - 1, -1, -1) if not lines.stands(one))
                self._open(following, reached, up=self._is_way_up(following, begin, reached))
                return following, end
        return stop, end

    def _fault(self, stop: int, element: int) -> tuple[int, int]:
        """What an element is that begins no act: one too many, one that ends elsewhere, or one behind a lack."""
        lines, first, feeds = self.lines, stop + 1, self.lines.feeds(element)
        fits = np.flatnonzero(lines.reach(self.moves[first:][:_AFTER_FAULT], element))
        if len(fits) and fits[0] > 0:  # else it is no act for another reason
            for one in range(first, first + int(fits[0])):
                self._lack(one, element)
            return first + int(fits[0]) - 1, element
        after = range(element + 1, element + _AFTER_FAULT)  # if the next one goes to where it should, this is too many
        following = next((k for k in after if not self._ahead.has(k) or not lines.feeds(k)), element)
        rapid = first < len(self.moves) and not self._hole[first] and (not feeds or first == 0)
        if rapid and not self._reaches(first, following):
            amount = float(lines.missed(self.moves[first : first + 1], np.array([element]))[1][0])
            text = "a rapid does not end at its pose"
            self.acts.problems.append(lines.problem("CS531", self._move[first], element, text, amount))
            self._open(first, element)
            return first, element + 1
        code, text = "CS536", "feed moves that the CL file does not have"
        if not feeds:
            code, text = "CS533", "a rapid that the CL file does not have, or a feed move written as one"
        self.acts.problems.append(lines.problem(code, self._move[first], element, text))
        return stop, element + 1

    def _lack(self, stop: int, element: int) -> int:
        """A stop is missing before an element."""
        if self._hole[stop]:
            self._leave(stop, element, element)
            return stop
        lines, move, ahead = self.lines, self._move[stop], self._ahead
        first = max(self._begun if self._begun >= 0 else element - 1, ahead.base)
        away = ahead.nc.tip[first - ahead.base : max(element, first + 1) - ahead.base] - lines.tip[move]
        near = first + int(np.argmin(np.linalg.norm(away, axis=1)))
        text = "a rapid of the CL file is missing, or is written as a feed move"
        self.acts.problems.append(lines.problem("CS532", move, near, text))
        return stop

    def _comes_down_first(self, stop: int, element: int) -> bool:
        """Whether the tool comes down from a retract to where it was, to go to another place in rapid from there.

        Unless a rapid of the CL file that leads nowhere, the last before the next stop, has it there.
        """
        if not self._along.comes_down_first(element) or self.lines.stands(element + 1):
            return False
        move = self._move[stop + 1] - 1
        there = move > self._move[stop] and self.lines.kind[move] == Move.RAPID
        return not (there and self._has_tool(move, element))

    def _over(self, stop: int, element: int) -> bool:
        """Whether an element ends in the line of a hole, and no tool change parts it from that."""
        has = self._ahead.has(element) and self._has_tool(self._move[stop], element)
        return has and self.lines.over(self._move[stop], element)

    def _has_tool(self, move: int, element: int) -> bool:
        """Whether as many tool changes are in front of an element as in front of a move."""
        return self._load(move) == self._words.tool_changes(element)

    def _is_there(self, stop: int, element: int) -> bool:
        """Whether an element ends at the pose of a rapid of the CL file, and no tool change parts it from that."""
        known = stop < len(self.moves) and not self._hole[stop] and element >= 0
        return known and self.lines.at(self._move[stop], element) and self._has_tool(self._move[stop], element)

    def _may_be_left_out(self, stop: int) -> bool:
        cycle = self._cycles[self._move[stop]]
        return cycle.tap or not cycle.depth > self.lines.room

    def _done(self, stop: int, element: int) -> bool:
        """Whether no move between a hole and the next stop leads away from where the tool is before an element."""
        return all(self.lines.at(move, element - 1) for move in range(self._move[stop] + 1, self._move[stop + 1]))

    def _open(self, stop: int, element: int, *, up: bool = False) -> None:
        """Take down the begin of a run: a rapid, which may be the way `up` from a hole, or the way out of one."""
        last, move = self._move[stop + 1] - 1, self._move[stop]
        first = move + self._hole[stop]
        if not up:
            self.acts.begins.extend((first, element))
        self._end_run(move, element)
        self.stretches.end(move - 1, element - 1)
        self.stretches.begin(move, element, last)
        self._from = (first, element) if self._fed[stop] else ()
        self._begun, self._looked, self._cut_at, self._gone = element, element + 1, first + 1, 0.0

    def _end_run(self, move: int, element: int) -> None:
        """Take down a run of feed moves that ends before a move and an element."""
        self.acts.runs.extend((*self._from, move, element) if self._from else ())
        self._from, self._begun = (), -1

    def _is_way_up(self, stop: int, begin: int, element: int) -> bool:
        """Whether the element that reaches a rapid is the way up from the hole before it: then the rapid leads nowhere.

        It is the first that goes up, no higher than the cycle does, or than where the tool came from; no words are in
        front of it.
        """
        lines, nc, first = self.lines, self._ahead.nc, stop - 1
        holes = self.acts.holes
        if holes and (element <= holes[-1].leaves or lines.block(element).start <= holes[-1].leaves):
            return True
        left_out = self._move[first] in self.acts.left_out
        if self._words.acting(element) or not (left_out or element == begin or lines.feeds(element - 1)):
            return False
        move, came_from = self._move[first], nc.tip[max(begin - 1 - self._ahead.base, 0)]
        highest = max(self._cycles[move].level, float((came_from - lines.tip[move]) @ lines.axis[move]))
        return self._over(first, element) and lines.height(move, element) <= highest + lines.tolerance
