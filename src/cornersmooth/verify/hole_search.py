"""Where holes are in a text: the first element of a run of holes, those of each hole, and what follows them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cornersmooth.model import Move
from cornersmooth.statements.cycles import Drilling
from cornersmooth.statements.tool_changes import NEVER
from cornersmooth.verify.hole_lines import HoleLines

#: elements looked through at a time for the beginning of a run
_WINDOW = 512

#: elements behind the pose before a run in which the run is looked for before the pose is taken for a passing one
_UNDECIDED = 1 << 16

#: elements in which it is looked for what a cycle asks for, where the text first goes over its hole
_DOUBTFUL = 1 << 12

#: elements between runs of holes that are given out together
_TOGETHER = 1 << 14


class HoleSearch(HoleLines):
    """Looks for holes in the text."""

    def starts(self, move: int, hole: int, element: int, asked: Drilling) -> Iterator[tuple[int, bool]]:
        """Look for the first element of a run of holes, and say how far it is not yet met, and where it is.

        It is behind the pose before it, where the text goes over to the first hole. There need be nothing at a hole
        whose cycle cannot be carried out. A text that never goes over to it has its holes, if any, behind
        where it has met that pose, or behind what has been given out as before them. Where feed moves run along the
        hole, too, it is the first time that the text does what the cycle asks for. It is always behind the last tool
        change before the hole, and where that stands between the pose and the hole, right behind it.
        """
        reached: int | None = None
        doubtful: int | None = None
        cycle, begin, given = asked.if_drilled, element, element
        while self.ahead.has(begin) and self.of_its_tool(hole)[0] == NEVER:  # the tool is still to come
            begin = min(begin + _WINDOW, self.ahead.count)
            if begin - given >= _TOGETHER:
                yield begin, False
                given = begin
        move = max(move, self.first_of_tool(hole))
        begin = max(element, self.of_its_tool(hole)[0])
        if move == hole:  # nothing but what is said again after the change is between it and the hole
            while self.has(hole, begin) and self.exact(hole - 1, np.array([begin]))[0] and not self.over(hole, begin):
                begin += 1
            yield begin, True
            return
        visits, seen, before = self.visits(move, hole), 0, -2
        left_out = bool(np.isnan(cycle.depth)) and not cycle.tap
        stays = left_out and self.in_line(hole, hole - 1)  # then nothing need be over it
        while self.ahead.has(begin + _WINDOW) or self.ahead.has(begin):
            window = np.arange(begin, min(begin + _WINDOW, self.ahead.count, self.of_its_tool(hole)[1]))
            if not len(window):
                break
            for k in self.passes(hole - 1, window):
                seen, before = seen + (k > before + 1), k  # the same place twice: as new
                if seen < visits:
                    continue
                reached = k if reached is None or k == reached + 1 else reached
                if stays or not self.over(hole, k + 1):
                    continue
                if self.stays(hole - 1, k + 1) and not self.feeds([k + 1]):  # a rapid that does not leave the pose
                    continue
                if cycle.tap and k > reached and not self.tapped(hole, k + 1, asked):
                    continue
                if left_out:
                    yield k + 1, True
                    return
                if cycle.tap and self.feeds_above(hole, k + 1):
                    continue
                if cycle.tap or self.drills(hole, k + 1, cycle):
                    yield self.last_above(hole, k, cycle) + 1, True
                    return
                doubtful = k + 1 if doubtful is None else doubtful
            begin += len(window)
            if doubtful is not None and begin - doubtful > _DOUBTFUL:
                break
            if reached is not None and (stays or cycle.tap):
                break
            if reached is not None and begin - reached > _UNDECIDED:
                reached = None
            if reached is None and doubtful is None and begin - given >= _TOGETHER:
                yield begin, False
                given = begin
        if doubtful is not None:
            yield doubtful, True
            return
        yield (max(given, self.of_its_tool(hole)[0]) if reached is None else reached + 1), True

    def visits(self, move: int, hole: int) -> int:
        """How often the moves before a hole, from one on, come to the pose before it and must pass it exactly."""
        here = self.near(hole - 1, slice(move, hole)) & (self.kind[move:hole] != Move.HOLE)
        if self.comes_in_rapid(hole - 1):
            here &= self.kind[move:hole] == Move.RAPID
            # one that leads nowhere is not in the text
            here[1:] &= (self.kind[move : hole - 1] == Move.HOLE) | ~self.same_as_next[move : hole - 1]
        ends = np.append(self.kind[move + 1 : hole] != Move.LINEAR, True) | (self.kind[move:hole] == Move.RAPID)
        ends[0] |= move == 0  # the first pose of all
        begins = here & ~np.append(False, here[:-1])
        return max(len(np.unique(np.cumsum(begins)[here & ends])), 1)

    def consume(
        self, first: int, stop: int, element: int, cycles: list[Drilling], *, again: bool
    ) -> Iterator[tuple[list[int], int]]:
        """Give out the elements of each hole, and the first element behind them.

        Where the next cycle is for the same hole, the first rapid out of it behind its depth ends this one.

        A hole that is not tapped as its cycle says becomes one of a cycle that asks for nothing, in `cycles`, too.

        `again`: the next run begins in the last of these holes. Where nothing is drilled in it now, only what stays
        where the cycle was entered belongs to this run.
        """
        asked = tuple(cycles)
        group: list[int] = []
        for move in range(first, stop):
            before, group = group, []
            repeated = move > first and asked[move - 1 - first] == asked[move - first]
            cycle = cycles[move - first]
            untapped = cycle.tap and not self.tapped(move, element, cycle)
            fed = untapped and self.first_feed(move, element) is not None
            if repeated and self.same_as_next[move - 1] and not fed:
                cycles[move - first] = cycles[move - 1 - first]
            elif untapped:
                cycles[move - first] = cycle.if_drilled
            depth = cycles[move - first].depth
            deep = left = False
            entered = np.nan
            if again and np.isnan(cycles[-1].depth) and move == stop - 1 and first:
                entered = max(float((self.tip[first - 1] - self.tip[move]) @ self.axis[move]), 0.0)
            while self.has(move, element):
                height = self.height(move, element)
                if math.isnan(height) or abs(height - entered) > self.room:
                    break
                fed = bool(self.feeds([element]))
                down = not group or height < self.height(move, group[-1]) - self.room
                if (left and (fed or down)) or (fed and math.isnan(depth) and self.goes_on(move)):
                    break  # what goes on behind a hole, or is fed where nothing is drilled, is not the hole's
                group.append(element)
                element += 1
                deep = deep or height <= self.room - depth
                left = left or (deep and height > self.room)
            if not group:  # the same hole again
                group = [k for k in before if not math.isnan(self.height(move, k))]
            yield group, element

    def give_back(self, move: int, group: list[int], cycle: Drilling, end: int) -> tuple[list[int], int, int]:
        """Elements of the last hole, and the first of what follows and its move: the way out may be the CL file's own.

        A rapid may be both, the retreat and the next pose; a feed move is not the hole's then.
        """
        if not group:
            return group, end, self._leads_away(move, end)
        feeds = self.feeds(group)
        for k in range(len(group) if not feeds else 0):
            if (going_on := self._goes_on_as(move, group[k:])) is not None:
                return group[: k + 1], group[k], going_on  # the first may be both
        deepest = -1
        if feeds and not np.isnan(cycle.depth):
            height = self.heights(move - 1, np.array(feeds))
            # the next cycle may go into the same hole: the first to be deep enough ends this one
            done = height <= self.room - cycle.depth
            deepest = feeds[int(np.argmax(done) if done.any() else np.argmin(height))]
        low = self.of_its_tool(move)[0]
        if not feeds:  # of several holes one above another the last is met first
            low = max(low, next(iter(self.passes(move - 1, np.array(group))), low))
        behind = np.array([k for k in group if k > deepest and k >= low], np.int64)
        same = behind[self.exact(move, behind)] if len(behind) else behind
        if not len(same):
            return group, end, move
        if self.kind[move] == Move.RAPID and len(rapid := same[~np.isin(same, self.feeds(same.tolist()))]):
            same = rapid
        first = int(same[0])
        if self.ahead.has(end) and self.stays(move, end):
            bored = cycle.feed_out and first == deepest + 1
            fed = self.kind[move] != Move.RAPID and bool(self.feeds([end])) and not self.feeds([first])
            if bored or fed:
                return group, end, move  # the cycle's own way out, and then the CL file's to the same place
        keep = first if self.feeds([first]) else first + 1
        while not feeds and keep in same:  # where the tool stands it is still over a hole that is not drilled
            keep += 1
        return [k for k in group if k < keep], first, move

    def _goes_on_as(self, move: int, group: list[int]) -> int | None:
        """First move from one on that leads somewhere, if the rapids of a group are just these moves, one by one."""
        first: int | None = None
        for element in group:
            while move < len(self.tip) and self.kind[move] != Move.HOLE and self.stays(move, element - 1):
                move += 1
            if move == len(self.tip) or element < self.of_its_tool(move)[0]:
                return None
            if self.kind[move] != Move.RAPID or not self.exact(move, np.array([element]))[0]:
                return None
            first = move if first is None else first
            move += 1
        return first

    def _leads_away(self, move: int, element: int) -> int:
        """First move from one on that leads away from where the tool is, before an element."""
        while move < len(self.tip) and self.kind[move] != Move.HOLE and self.stays(move, element - 1):
            if self.has(move, element) and self.stays(move, element):
                return move
            move += 1
        return move
