"""Where holes are in a text: which elements are over them, in them, and do what their cycles ask for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.nc_reader.ahead import Ahead
from cornersmooth.nc_reader.elements import Element, Problem
from cornersmooth.statements.cycles import Drilling
from cornersmooth.statements.tool_changes import NEVER, ToolChanges
from cornersmooth.verify.polyline import Original, directions
from cornersmooth.verify.rapids import ARITHMETIC, digit_errors

#: elements looked through at a time for the beginning of a run
_WINDOW = 512

#: elements behind the pose before a run in which the run is looked for before the pose is taken for a passing one
_UNDECIDED = 1 << 16

#: elements in which it is looked for what a cycle asks for, where the text first goes over its hole
_DOUBTFUL = 1 << 12

#: moves behind a hole in which the next feed move or hole is looked for
_NEXT = 16

#: elements between runs of holes that are given out together
_TOGETHER = 1 << 14

#: last printed digits that a point may be beside its hole
_STEPS = 1.0


class HoleSearch:
    """Looks for holes in the text.

    Parameters
    ----------
    original : Original
    ahead : Ahead
    axis_length : float, mm
    changes : ToolChanges
    """

    def __init__(self, original: Original, ahead: Ahead, axis_length: float, changes: ToolChanges) -> None:
        self.ahead, self.axis_length = ahead, axis_length
        self._changes, self._pose = changes, original.pose
        program = original.program
        self.tip, self.axis = program.tip[original.pose], program.axis[original.pose]
        self.line, self.kind = program.line[original.pose], program.kind[original.pose]

    @property
    def room(self) -> float:
        """Distance that the printed digits account for, mm."""
        nc = self.ahead.nc
        return _STEPS * (nc.tip_step + nc.second_step * (self.axis_length if nc.second_is == "vector" else 1.0))

    def of_its_tool(self, move: int) -> tuple[int, int]:
        """First element that a move may have, and the first behind those, as far as tool changes tell."""
        return self._changes.elements_of(int(self._pose[move]))

    def first_of_tool(self, move: int) -> int:
        """First move behind the last tool change before a move, or the first of all."""
        return int(np.searchsorted(self._pose, self._changes.pose_of(int(self._pose[move]))))

    def has(self, move: int, element: int) -> bool:
        """Whether there is such an element, and no tool change parts it from a move."""
        if not self.ahead.has(element):
            return False
        stop = self.of_its_tool(move)[1]
        return element < stop or (element == stop and self.stands_still(element))

    def stands_still(self, element: int) -> bool:
        """Whether an element is a rapid that leads nowhere, as one that is left out of the path."""
        nc, at = self.ahead.nc, element - self.ahead.base
        if at < 1 or nc.kind[at] != Element.RAPID:
            return False
        return bool((nc.tip[at] == nc.tip[at - 1]).all() and (nc.second[at] == nc.second[at - 1]).all())

    def exact(self, move: int, elements: Ints) -> Bools:
        """(k,) whether elements end exactly at a move's pose; none that are not at hand, as behind the last."""
        at = elements - self.ahead.base
        same = (at >= 0) & (at < len(self.ahead.nc))
        tip, axis = (np.broadcast_to(values[move], (int(same.sum()), 3)) for values in (self.tip, self.axis))
        same[same] = digit_errors(self.ahead.nc, at[same], tip, axis, self.axis_length)[0]
        return same

    def heights(self, move: int, elements: Ints) -> Floats:
        """(k,) mm above the hole's pose at the ends of elements; NaN beside the hole or with another axis."""
        nc, own = self.ahead.nc, elements - self.ahead.base
        away = nc.tip[own] - self.tip[move]
        height = away @ self.axis[move]
        beside = np.linalg.norm(away - height[:, None] * self.axis[move], axis=1)
        turned = np.linalg.norm(directions(nc, nc.tip[own], nc.second[own]) - self.axis[move], axis=1)
        # what the printed angles of a tilted plane leave open
        lean = np.where(nc.tip_room[own] > 0.0, nc.second_room[own], 0.0)
        on = beside <= self.room + lean * np.abs(height)
        on &= turned * self.axis_length <= 2 * self.room + lean * self.axis_length
        return np.where(on, height, np.nan)

    def stands(self, move: int, hole: int, element: int) -> bool:
        """Whether the moves before a hole lead nowhere: the tool is there, and goes on over the hole if it goes on.

        Behind it may come the end of the text or another tool, where the hole is not drilled.
        """
        if not element or element < self.of_its_tool(hole)[0]:
            return False
        if self.has(hole, element) and not self.over(hole, element):
            return False
        return all(self.exact(k, np.array([element - 1]))[0] for k in range(move, hole))

    def same_hole(self, one: int, other: int) -> bool:
        """Whether two moves are to the same hole."""
        return bool(self.near(one, slice(other, other + 1))[0])

    def goes_on(self, move: int) -> bool:
        """Whether the next move of the CL file that is no rapid, too, is along the line of a hole."""
        others = np.flatnonzero(self.kind[move + 1 : move + 1 + _NEXT] != Move.RAPID)
        if not len(others):
            return False
        return self.in_line(move, move + 1 + int(others[0]))

    def in_line(self, move: int, other: int) -> bool:
        """Whether the pose of another move is in the line of a hole, as far as the digits show."""
        away, turned = (values[other] - values[move] for values in (self.tip, self.axis))
        beside = np.linalg.norm(away - (away @ self.axis[move]) * self.axis[move])
        return bool(beside <= self.room and np.linalg.norm(turned) * self.axis_length <= 2 * self.room)

    def near(self, move: int, others: slice) -> Bools:
        """(k,) whether others are to the pose of a move, as far as the digits show."""
        apart, turned = (np.linalg.norm(values[others] - values[move], axis=1) for values in (self.tip, self.axis))
        same: Bools = (apart <= self.room) & (turned * self.axis_length <= 2 * self.room)
        return same

    def over(self, move: int, element: int) -> bool:
        """Whether there is such an element, and it ends in the line of the hole."""
        return self.has(move, element) and not np.isnan(self.heights(move, np.array([element]))[0])

    def visits(self, move: int, hole: int) -> int:
        """How often the moves before a hole, from one on, come to the pose before it and must pass it exactly."""
        here = self.near(hole - 1, slice(move, hole)) & (self.kind[move:hole] != Move.HOLE)
        if self.comes_in_rapid(hole - 1):
            here &= self.kind[move:hole] == Move.RAPID
        ends = np.append(self.kind[move + 1 : hole] != Move.LINEAR, True) | (self.kind[move:hole] == Move.RAPID)
        ends[0] |= move == 0  # the first pose of all
        begins = here & ~np.append(False, here[:-1])
        return max(len(np.unique(np.cumsum(begins)[here & ends])), 1)

    def comes_in_rapid(self, move: int) -> bool:
        """Whether a move is a rapid that leads somewhere, from a pose that the text knows."""
        if move < 1 or self.kind[move] != Move.RAPID or self.kind[move - 1] == Move.HOLE:
            return False
        return not self.near(move - 1, slice(move, move + 1))[0]

    def passes(self, move: int, elements: Ints) -> list[int]:
        """Elements among some that may be a move: they end exactly at its pose, in rapid where it comes so."""
        found = elements[self.exact(move, elements)].tolist()
        return [k for k in found if not self.feeds([k])] if self.comes_in_rapid(move) else found

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

    def first_feed(self, move: int, element: int) -> int | None:
        """The first feed along a hole, from an element on; None where the text leaves it before."""
        while self.over(move, element):
            if self.feeds([element]):
                return element
            element += 1
        return None

    def feeds_above(self, move: int, element: int) -> bool:
        """Whether the first feed along a hole, from an element on, stays above its pose, as no cycle does."""
        fed = self.first_feed(move, element)
        return fed is not None and bool(self.heights(move, np.array([fed]))[0] >= -self.room)

    def last_above(self, hole: int, element: int, cycle: Drilling) -> int:
        """Last feed, from an element on, to the pose before a hole, if any, before the text goes into it.

        What is fed to the pose of a hole of no depth may drill that.
        """
        found = element
        while self.over(hole, element) and self.heights(hole, np.array([element]))[0] >= -self.room:
            if self.kind[hole - 1] != Move.RAPID and self.feeds([element]) and not cycle.depth <= self.room:
                found = element if self.exact(hole - 1, np.array([element]))[0] else found
            element += 1
        return found

    def drills(self, move: int, element: int, cycle: Drilling) -> bool:
        """Whether the text drills a hole from an element on: to its depth, no farther, at the cycle's feeds."""
        while self.over(move, element):
            if self.feeds([element]):
                height = self.heights(move, np.array([element]))[0]
                if self.wrong_feed(element, cycle) or height < -cycle.depth - self.room:
                    return False
                if height <= self.room - cycle.depth:
                    return True
            element += 1
        return False

    def wrong_feed(self, element: int, cycle: Drilling) -> bool:
        """Whether the feed of an element is not that of a cycle."""
        nc, own = self.ahead.nc, element - self.ahead.base
        return bool(
            not np.isnan(cycle.feed)
            and (
                np.isnan(nc.feed[own])
                or abs(nc.feed[own] - cycle.feed) > 2 * abs(nc.feed_room[own])
                or (np.isnan(nc.feed_room[own]) and nc.feed[own] > cycle.feed + ARITHMETIC)
                or nc.per_revolution[own] != cycle.per_revolution
            )
        )

    def consume(
        self, first: int, stop: int, element: int, cycles: list[Drilling], *, again: bool
    ) -> tuple[list[list[int]], int]:
        """Elements of each hole, and the element behind them all.

        Where the next cycle is for the same hole, the first rapid out of it behind its depth ends this one.

        A hole that is not tapped as its cycle says becomes one of a cycle that asks for nothing, in `cycles`, too.

        `again`: the next run begins in the last of these holes. Where nothing is drilled in it now, only what stays
        where the cycle was entered belongs to this run.
        """
        groups: list[list[int]] = []
        asked = tuple(cycles)
        for move in range(first, stop):
            group: list[int] = []
            repeated = move > first and asked[move - 1 - first] == asked[move - first]
            cycle = cycles[move - first]
            untapped = cycle.tap and not self.tapped(move, element, cycle)
            fed = untapped and self.first_feed(move, element) is not None
            if repeated and self.same_hole(move - 1, move) and not fed:
                cycles[move - first] = cycles[move - 1 - first]
            elif untapped:
                cycles[move - first] = cycle.if_drilled
            depth = cycles[move - first].depth
            deep = left = False
            entered = np.nan
            if again and np.isnan(cycles[-1].depth) and move == stop - 1 and first:
                entered = max(float((self.tip[first - 1] - self.tip[move]) @ self.axis[move]), 0.0)
            while self.has(move, element):
                height = self.heights(move, np.array([element]))[0]
                if np.isnan(height) or abs(height - entered) > self.room:
                    break
                fed = bool(self.feeds([element]))
                down = not group or height < self.heights(move, np.array(group[-1:]))[0] - self.room
                if (left and (fed or down)) or (fed and np.isnan(depth) and self.goes_on(move)):
                    break  # what goes on behind a hole, or is fed where nothing is drilled, is not the hole's
                group.append(element)
                element += 1
                deep = deep or height <= self.room - depth
                left = left or (deep and height > self.room)
            if not group and groups and groups[-1]:  # the same hole again
                before = np.array(groups[-1])
                group = before[~np.isnan(self.heights(move, before))].tolist()
            groups.append(group)
        return groups, element

    def tapped(self, move: int, element: int, cycle: Drilling) -> bool:
        """Whether the first feed in a hole, from an element on, is that of its thread."""
        fed = self.first_feed(move, element)
        if fed is None:
            return False
        nc, own = self.ahead.nc, fed - self.ahead.base
        near = abs(nc.feed[own] - cycle.feed) <= 2 * abs(nc.feed_room[own])
        return bool(nc.per_revolution[own] and near)

    def feeds(self, group: list[int]) -> list[int]:
        """Elements of a group that are no rapids."""
        return [k for k in group if self.ahead.nc.kind[k - self.ahead.base] != Element.RAPID]

    def nc_line(self, element: int) -> int:
        """NC line of an element."""
        return int(self.ahead.nc.line[element - self.ahead.base])

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

    def stays(self, move: int, element: int) -> bool:
        """Whether a move ends where an element has left the tool."""
        return bool(self.exact(move, np.array([element]))[0])

    def repeats(self, first: int, stop: int, move: int) -> bool:
        """Whether a neighbour in a run of holes is the same hole."""
        return any(first <= other < stop and self.same_hole(move, other) for other in (move - 1, move + 1))

    def check(self, move: int, group: list[int], cycle: Drilling, *, alone: bool) -> list[Problem]:
        """Depth, feeds and rapids of one hole; `alone`: it is drilled once."""
        cl_line, feeds = int(self.line[move]), self.feeds(group)
        known = not np.isnan(cycle.depth)
        if not feeds:
            if known and cycle.depth > self.room:
                near = self.nc_line(group[0]) if group else 0
                return [Problem("CS561", cl_line, near, "a hole of the CL file is not drilled")]
            return []
        if not known:
            return [Problem("CS564", cl_line, self.nc_line(feeds[0]), "the cycle does not say what is fed here")]
        problems = []
        height = dict(zip(group, self.heights(move, np.array(group)).tolist(), strict=True))
        before = self.heights(move, np.array([max(group[0] - 1, 0)]))[0]
        deepest = min(feeds, key=lambda k: height[k])
        off = height[deepest] + cycle.depth
        if abs(off) > self.room:
            text = f"a hole is {abs(off):.4f} mm too {'shallow' if off > 0 else 'deep'}"
            problems.append(Problem("CS562", cl_line, self.nc_line(deepest), text, abs(off)))
        behind = [k for k in group if k > deepest][:1]
        if cycle.feed_out and behind and not self.feeds(behind):
            line = self.nc_line(behind[0])
            problems.append(Problem("CS563", cl_line, line, "a rapid leaves a hole that the tool is to leave at feed"))
        drilled = 0.0
        for k in group:
            line = self.nc_line(k)
            if not self.feeds([k]):
                if height[k] < -drilled - self.room and not self._own_rapid(move, k):
                    amount = -drilled - height[k]
                    text = f"a rapid goes {amount:.4f} mm into the uncut hole"
                    problems.append(Problem("CS563", cl_line, line, text, amount))
            else:
                if k == group[0] and np.isnan(before):
                    problems.append(Problem("CS563", cl_line, line, "a feed move enters a hole from the side"))
                if self.wrong_feed(k, cycle):
                    text = f"the feed is {self.ahead.nc.feed[k - self.ahead.base]:g}, the cycle says {cycle.feed:g}"
                    problems.append(Problem("CS541", cl_line, line, text))
                down = height.get(k - 1, np.inf) > height[k]
                if alone and down and drilled > self.room and self.room < -height[k] <= drilled + ARITHMETIC:
                    problems.append(Problem("CS562", cl_line, line, "a hole is drilled again"))
                drilled = max(drilled, -height[k])
        if height[group[-1]] < -self.room:
            text = "the tool leaves a hole sideways"
            problems.append(Problem("CS563", cl_line, self.nc_line(group[-1]), text, -height[group[-1]]))
        return problems

    def _own_rapid(self, move: int, element: int) -> bool:
        """Whether the CL file itself goes there in rapid just before the hole, wherever that is."""
        while move > 0 and self.kind[move - 1] == Move.RAPID:
            move -= 1
            if self.stays(move, element):
                return True
        return False
