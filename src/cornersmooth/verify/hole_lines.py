"""Which elements of a text are over a hole, at its pose or in it, and feed as its cycle does."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.nc_reader.ahead import Ahead
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.tool import directions
from cornersmooth.statements.cycles import Drilling
from cornersmooth.statements.tool_changes import ToolChanges
from cornersmooth.verify.cl_motion import Original
from cornersmooth.verify.rapids import digit_errors
from cornersmooth.verify.task import ARITHMETIC

#: moves behind a hole in which the next feed move or hole is looked for
_NEXT = 16

#: last printed digits that a point may be beside its hole
_STEPS = 1.0

#: elements whose heights over a hole are worked out together, as long as the text stays at that hole
_WINDOW = 16


class HoleLines:
    """Lines through the poses of holes, along the tool.

    Parameters
    ----------
    axis_length, tolerance : float, mm
    """

    def __init__(
        self, original: Original, ahead: Ahead, axis_length: float, tolerance: float, changes: ToolChanges
    ) -> None:
        self.ahead, self.axis_length, self.tolerance = ahead, axis_length, tolerance
        self._changes, self._pose = changes, original.pose
        program = original.program
        self.tip, self.axis = program.tip[original.pose], program.axis[original.pose]
        self.line, self.kind = program.line[original.pose], program.kind[original.pose]
        self._heights: tuple[int, int, list[float]] = (-1, 0, [])  # move, first element, heights

    @property
    def room(self) -> float:
        """Distance that the printed digits account for, mm."""
        nc = self.ahead.nc
        axis_step = nc.second_step * (self.axis_length if nc.second_is == "vector" else 1.0)
        return min(_STEPS * (nc.tip_step + axis_step), self.tolerance)

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

    def height(self, move: int, element: int) -> float:
        """The same of one element; those behind it are worked out along with it."""
        known, first, heights = self._heights
        if move != known or not 0 <= element - first < len(heights):
            stop = min(element + _WINDOW, self.ahead.count)
            first, heights = element, self.heights(move, np.arange(element, stop)).tolist()
            self._heights = move, first, heights
        return heights[element - first]

    def over(self, move: int, element: int) -> bool:
        """Whether there is such an element, and it ends in the line of the hole."""
        return self.has(move, element) and not math.isnan(self.height(move, element))

    def stays(self, move: int, element: int) -> bool:
        """Whether a move ends where an element has left the tool."""
        return bool(self.exact(move, np.array([element]))[0])

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

    def near(self, move: int, others: slice) -> Bools:
        """(k,) whether others are to the pose of a move, as far as the digits show."""
        apart, turned = (np.linalg.norm(values[others] - values[move], axis=1) for values in (self.tip, self.axis))
        same: Bools = (apart <= self.room) & (turned * self.axis_length <= 2 * self.room)
        return same

    @cached_property
    def same_as_next(self) -> Bools:
        """(m - 1,) whether each move is to the same hole as the one behind it."""
        apart, turned = (np.linalg.norm(np.diff(values, axis=0), axis=1) for values in (self.tip, self.axis))
        same: Bools = (apart <= self.room) & (turned * self.axis_length <= 2 * self.room)
        return same

    def in_line(self, move: int, other: int) -> bool:
        """Whether the pose of another move is in the line of a hole, as far as the digits show."""
        away, turned = (values[other] - values[move] for values in (self.tip, self.axis))
        beside = np.linalg.norm(away - (away @ self.axis[move]) * self.axis[move])
        return bool(beside <= self.room and np.linalg.norm(turned) * self.axis_length <= 2 * self.room)

    def goes_on(self, move: int) -> bool:
        """Whether the next move of the CL file that is no rapid, too, is along the line of a hole."""
        others = np.flatnonzero(self.kind[move + 1 : move + 1 + _NEXT] != Move.RAPID)
        if not len(others):
            return False
        return self.in_line(move, move + 1 + int(others[0]))

    def comes_in_rapid(self, move: int) -> bool:
        """Whether a move is a rapid that leads somewhere, from a pose that the text knows."""
        if move < 1 or self.kind[move] != Move.RAPID or self.kind[move - 1] == Move.HOLE:
            return False
        return not self.same_as_next[move - 1]

    def passes(self, move: int, elements: Ints) -> list[int]:
        """Elements among some that may be a move: they end exactly at its pose, in rapid where it comes so."""
        found = elements[self.exact(move, elements)].tolist()
        return [k for k in found if not self.feeds([k])] if self.comes_in_rapid(move) else found

    def feeds(self, group: list[int]) -> list[int]:
        """Elements of a group that are no rapids."""
        kind, base, rapid = self.ahead.nc.kind, self.ahead.base, int(Element.RAPID)
        return [k for k in group if kind[k - base] != rapid]

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
        return fed is not None and self.height(move, fed) >= -self.room

    def last_above(self, hole: int, element: int, cycle: Drilling) -> int:
        """Last feed, from an element on, to the pose before a hole, if any, before the text goes into it.

        What is fed to the pose of a hole of no depth may drill that.
        """
        found = element
        while self.over(hole, element) and self.height(hole, element) >= -self.room:
            if self.kind[hole - 1] != Move.RAPID and self.feeds([element]) and not cycle.depth <= self.room:
                found = element if self.exact(hole - 1, np.array([element]))[0] else found
            element += 1
        return found

    def drills(self, move: int, element: int, cycle: Drilling) -> bool:
        """Whether the text drills a hole from an element on: to its depth, no farther, at the cycle's feeds."""
        while self.over(move, element):
            if self.feeds([element]):
                height = self.height(move, element)
                if self.wrong_feed(element, cycle) or height < -cycle.depth - self.room:
                    return False
                if height <= self.room - cycle.depth:
                    return True
            element += 1
        return False

    def tapped(self, move: int, element: int, cycle: Drilling) -> bool:
        """Whether the first feed in a hole, from an element on, is that of its thread."""
        fed = self.first_feed(move, element)
        if fed is None:
            return False
        nc, own = self.ahead.nc, fed - self.ahead.base
        near = abs(nc.feed[own] - cycle.feed) <= 2 * nc.feed_room[own]
        return bool(nc.per_revolution[own] and near)

    def wrong_feed(self, element: int, cycle: Drilling) -> bool:
        """Whether the feed of an element is not that of a cycle."""
        nc, own = self.ahead.nc, element - self.ahead.base
        least = nc.least_feed[own]  # of a plan, which may lower it
        off = nc.feed[own] - cycle.feed
        return bool(
            not np.isnan(cycle.feed)
            and (
                np.isnan(nc.feed[own])
                or (off > ARITHMETIC if least else abs(off) > 2 * nc.feed_room[own])
                or nc.per_revolution[own] != cycle.per_revolution
            )
        )

    def nc_line(self, element: int) -> int:
        """NC line of an element."""
        return int(self.ahead.nc.line[element - self.ahead.base])

    def repeats(self, first: int, stop: int, move: int) -> bool:
        """Whether a neighbour in a run of holes is the same hole."""
        return bool(self.same_as_next[max(move - 1, first) : min(move + 1, stop - 1)].any())
