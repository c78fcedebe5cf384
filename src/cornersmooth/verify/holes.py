"""A hole is a line through its pose along the tool: what is on it, and whether it is drilled as its cycle says."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import chain
from typing import Final, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.nc_reader.elements import Ahead, Element, Elements, Problem
from cornersmooth.nc_reader.tool import directions, leads_somewhere
from cornersmooth.statements.cycles import Drilling
from cornersmooth.verify.motions import ARITHMETIC, COLUMNS, digit_errors, on_segments
from cornersmooth.verify.task import Task, selecting

#: how far above the last depth a rapid ends at least, as a share of a peck, and no more than so many mm; by how many mm
#: the last peck may be deeper: nothing worth a peck is left
_ABOVE, _LEAST_ABOVE, _REST = 1.0 / 32.0, 0.1, 0.01

#: elements that are compared with a pose together, as the next ones will be wanted, too
_WINDOW = 16

#: a direction along which no two poses of a usual part are at the same place
_ASLANT: Final = np.array([0.48, 0.6, 0.64])

#: code of a fault, its element, a text, and how much, mm
_Fault: TypeAlias = tuple[str, int, str, float]


class HoleLines:
    """Compares ends of elements with poses and holes of the CL file; lengths in mm."""

    def __init__(self, task: Task, ahead: Ahead, still: Set[int]) -> None:
        original, axis_length, tolerance = task.original, task.axis_length, task.tolerance
        self.ahead, self.axis_length, self.tolerance, self._still = ahead, axis_length, tolerance, still
        program, nc, chosen = original.program, ahead.nc, selecting(original.pose)
        self.tip, self.axis = program.tip[chosen], program.axis[chosen]
        self.line, self.kind = program.line[chosen], program.kind[chosen]
        axis_step = nc.second_step * (axis_length if nc.second_is == "vector" else 1.0)
        #: distance that the printed digits account for, mm
        self.room = min(nc.tip_step + axis_step, tolerance)
        #: by what and move: first element, and what is known of it and of those after it
        self._known: dict[tuple[str, int], tuple[int, list[float]]] = {}

    def exact(self, moves: Ints, elements: Ints) -> Bools:
        """(k,) whether elements end exactly at the poses of moves."""
        return self.missed(moves, elements)[0]

    def missed(self, moves: Ints, elements: Ints) -> tuple[Bools, Floats]:
        """(k,) whether elements end exactly at the poses of moves, and by how much, mm, they miss them."""
        own = elements - self.ahead.base
        return digit_errors(self.ahead.nc, own, self.tip[moves], self.axis[moves], self.axis_length)

    def poses_near(self, elements: Sequence[int], moves: Sequence[int]) -> Iterator[list[int]]:
        """For each element, those of moves that begin about where the element in front of it ends."""
        nc, tip = self.ahead.nc, self.tip[np.asarray(moves) - 1] @ _ASLANT
        order = np.argsort(tip)
        before = np.array(elements, np.int64) - 1 - self.ahead.base
        room = 2.0 * (nc.tip_step + nc.tip_room[before]) + ARITHMETIC
        end = nc.tip[before] @ _ASLANT
        bounds = (np.searchsorted(tip, end + far, sorter=order).tolist() for far in (-room, room))
        return (sorted(moves[k] for k in order[first:last]) for first, last in zip(*bounds, strict=True))

    def reach(self, moves: Ints, element: int) -> Bools:
        """Which moves, rapids and holes, an element may lead to."""
        elements = np.full(len(moves), element)
        rapid = self.exact(moves, elements) & (not self.feeds(element))
        return np.where(self.kind[moves] == Move.HOLE, ~np.isnan(self.heights(moves, elements)), rapid)

    def heights(self, moves: Ints, elements: Ints) -> Floats:
        """(k,) mm above the poses of holes at the ends of straight elements; NaN beside a hole or with another axis."""
        return np.where(_straight(self.ahead.nc.kind[elements - self.ahead.base]), self.ends(moves, elements), np.nan)

    def ends(self, moves: Ints, elements: Ints) -> Floats:
        """The same of elements of any kind."""
        nc, own = self.ahead.nc, elements - self.ahead.base
        # what the printed angles of a tilted plane leave open
        lean = np.where(nc.tip_room[own] > 0.0, nc.second_room[own], 0.0)
        return self._above(moves, nc.tip[own], directions(nc, nc.tip[own], nc.second[own]), lean)

    def _above(self, moves: Ints, tip: Floats, axis: Floats, lean: Floats | float = 0.0) -> Floats:
        """(k,) mm above the poses of holes at tips (k, 3); NaN beside a hole or with another axis."""
        away = tip - self.tip[moves]
        height = np.einsum("ij,ij->i", away, self.axis[moves])
        beside = np.linalg.norm(away - height[:, None] * self.axis[moves], axis=1)
        turned = np.linalg.norm(axis - self.axis[moves], axis=1) * self.axis_length
        on = (beside <= self.room + lean * np.abs(height)) & (turned <= 2 * self.room + lean * self.axis_length)
        return np.where(on, height, np.nan)

    def at(self, move: int, element: int) -> bool:
        """Whether an element ends exactly at the pose of a move."""
        return element >= 0 and bool(self._of("exact", move, element))

    def height(self, move: int, element: int) -> float:
        """Height of one element, as of `heights`."""
        return self._of("heights", move, element) if element >= 0 else math.nan

    def begins(self, move: int, element: int) -> float:
        """Height at which an element begins, whatever leads there."""
        return self._of("ends", move, max(element - 1, 0))

    def over(self, move: int, element: int) -> bool:
        """Whether an element ends in the line of a hole."""
        return not math.isnan(self.height(move, element))

    def _of(self, what: str, move: int, element: int) -> float:
        """What holds for an element; that of those after it is worked out along with it."""
        first, values = self._known.get((what, move), (0, []))
        if not 0 <= element - first < len(values):
            window = np.arange(element, min(element + _WINDOW, self.ahead.count))
            first, values = element, getattr(self, what)(np.full(len(window), move), window).tolist()
            if len(self._known) > _WINDOW:
                self._known.pop(next(iter(self._known)))
            self._known[what, move] = first, values
        return values[element - first]

    def forget(self) -> None:
        """Forget what is known of elements: one has been put elsewhere."""
        self._known.clear()

    def goes_to(self, element: int, *, rapid: bool) -> bool:
        """Whether the CL file goes to where an element ends, if need be in rapid; it does in and over all its holes."""
        moves, holes = np.flatnonzero((self.kind == Move.RAPID) | (not rapid)), np.flatnonzero(self.kind == Move.HOLE)
        there = self.exact(moves, np.full(len(moves), element))
        return bool(there.any() or not np.isnan(self.heights(holes, np.full(len(holes), element))).all())

    def feeds(self, element: int) -> bool:
        """Whether an element is no rapid."""
        return int(self.ahead.nc.kind[element - self.ahead.base]) != Element.RAPID

    def stands(self, element: int) -> bool:
        """Whether an element leads nowhere."""
        return element in self._still

    def block(self, element: int) -> range:
        """Elements of the block of one: rotary words make several lines of it."""
        line, base = self.ahead.nc.line, self.ahead.base
        first, stop = (int(np.searchsorted(line, line[element - base], side=side)) for side in ("left", "right"))
        return range(base + first, base + stop)

    def is_cycle(self, block: range) -> bool:
        """Whether a block is a hole cycle of the control: the only ones that are rapids and feed moves."""
        kinds = self.ahead.nc.kind[block.start - self.ahead.base : block.stop - self.ahead.base]
        return len(block) > 1 and bool((kinds == Element.RAPID).any() and (kinds == Element.LINE).any())

    def is_straight(self, block: range) -> bool:
        """Whether the tip goes straight on elements, within the tolerance."""
        nc, own = self.ahead.nc, np.array(block) - self.ahead.base
        way = nc.tip[[max(own[0] - 1, 0), *own]]
        chord = np.zeros((len(own) - 1, 1), np.int64)
        _, beside = on_segments(way[1:-1, None], way[[0, -1]], chord, COLUMNS["tip"])
        return bool(_straight(nc.kind[own]).all() and (beside <= self.tolerance**2).all())

    def in_line(self, move: int, other: int) -> bool:
        """Whether the pose of another move is in the line of a hole, as far as the digits show."""
        return not np.isnan(self._above(np.array([move]), self.tip[[other]], self.axis[[other]]))[0]

    def nc_line(self, element: int) -> int:
        """NC line of an element."""
        return int(self.ahead.nc.line[element - self.ahead.base])

    def problem(self, code: str, move: int, element: int, text: str, amount: float = math.nan) -> Problem:
        """Something wrong at a move, or beyond the last, and at an element, or at none if that is negative."""
        nc_line = self.nc_line(element) if element >= 0 else 0
        return Problem(code, int(self.line[min(move, len(self.line) - 1)]), nc_line, text, amount)

    def slant(self, move: int, element: int) -> float:
        """Height, mm, that a rapid loses on its way from beside a hole to above it, or gains between two holes.

        Zero where it leads from one pose of the CL file to the other, and where the tool turns.
        """
        nc, own = self.ahead.nc, np.array([element - 1, element]) - self.ahead.base
        if not 0 <= own[0] < len(nc) - 1 or self.feeds(element):
            return 0.0
        if move and self.at(move - 1, element - 1) and self.at(move, element):
            return 0.0
        way, axis = nc.tip[own[1]] - nc.tip[own[0]], self.axis[move]
        along = float(way @ axis)
        turned = np.linalg.norm(np.diff(directions(nc, nc.tip[own], nc.second[own]), axis=0)) * self.axis_length
        rises = along > 0.0 and self.kind[max(move - 1, 0)] != Move.HOLE
        none = rises or turned > 2 * self.room or np.linalg.norm(way - along * axis) <= self.tolerance
        return 0.0 if none else max(abs(along) - self.tolerance - float(nc.tip_room[own].sum()), 0.0)

    def carries(self, element: int, feed: float, *, per_revolution: bool) -> bool:
        """Whether an element has a feed."""
        return bool(self.ahead.nc.carry(element - self.ahead.base, feed, per_revolution))


@dataclass(frozen=True)
class Hole:
    """A hole of the CL file, and what a program does in it: by moves, or by a cycle of the control."""

    lines: HoleLines
    move: int
    cycle: Drilling
    first: int  #: the first element in its line; -1 where there is none
    bottom: int  #: the element behind its deepest feed move: it may wait before that
    leaves: int  #: the element with which the tool leaves it
    before: float  #: mm above its pose, where the tool comes from; NaN beside its line
    height: dict[int, float]  #: the same of the ends of its elements that lead anywhere, in their order
    feeds: list[int]  #: those of them that are no rapids

    @classmethod
    def of(cls, lines: HoleLines, move: int, elements: range, cycle: Drilling) -> Self:
        """Make it of elements, of which those count that end in its line."""
        over = {k: height for k in elements if not math.isnan(height := lines.height(move, k))}
        fed = [k for k in over if lines.feeds(k)]
        bottom = 1 + min(fed, default=elements.stop, key=lambda k: over[k])
        while bottom < elements.stop and lines.stands(bottom):  # a block may be there twice
            bottom += 1
        inside = [k + 1 for k, height in over.items() if height < -lines.room] or fed[-1:] or [*over][:1] or [-1]
        moved = {k: height for k, height in over.items() if not lines.stands(k)}
        before = lines.begins(move, next(iter(moved))) if moved else math.nan
        feeds = [k for k in fed if k in moved]
        first = next(iter(over), -1)
        return cls(lines, move, cycle, first, bottom, min(inside[-1], elements.stop), before, moved, feeds)

    @property
    def left_out(self) -> bool:
        """Whether it is left out, as it may be."""
        tapped = bool(self.feeds) and self.lines.carries(self.feeds[0], self.cycle.feed, per_revolution=True)
        open_ = math.isnan(self.cycle.depth) or (self.cycle.tap and not tapped)
        return open_ and (self.cycle.tap or not self.feeds)

    def problems(self) -> list[Problem]:
        """What is wrong with it.

        CS541 a wrong feed, CS561 it is missing, CS562 a wrong depth, CS563 a rapid inside or beside it, CS564 a feed
        that is not a hole's.
        """
        cycle, room = self.cycle, self.lines.room
        found: Iterator[_Fault]
        if math.isnan(cycle.depth) or self.left_out:
            found = self._in_left_out()
        elif not self.feeds:
            missing = "CS561", next(iter(self.height), -1), "a hole of the CL file is not drilled", math.nan
            found = iter([missing] if cycle.depth > room else [])
        else:
            pecks = self._in_pecks() if cycle.steps or not cycle.pecking else iter(())
            found = chain(self._around(), self._step_by_step(), pecks)
        return [self.lines.problem(code, self.move, k, text, amount) for code, k, text, amount in found]

    def _in_left_out(self) -> Iterator[_Fault]:
        """What is wrong where it is left out: a feed move, or a rapid into it."""
        if self.feeds:
            yield "CS564", self.feeds[0], "the cycle does not say what is fed here", math.nan
        elif self.height and (depth := -min(self.height.values())) > self.lines.room:
            lowest = min(self.height, key=lambda k: self.height[k])
            yield "CS563", lowest, f"a rapid goes {depth:.4f} mm into the uncut hole", depth

    def _around(self) -> Iterator[_Fault]:
        """What is wrong with its depth, with where the tool comes from, and with where it goes."""
        lines, move, cycle, height, feeds = self.lines, self.move, self.cycle, self.height, self.feeds
        room = lines.room
        first, last = next(iter(height)), next(reversed(height))
        deepest = min(feeds, key=lambda k: height[k])
        if abs(off := height[deepest] + cycle.depth) > room:
            yield "CS562", deepest, f"a hole is {abs(off):.4f} mm too {'shallow' if off > 0 else 'deep'}", abs(off)
        after = next((k for k in height if k > deepest), deepest)
        if cycle.feed_out and not lines.feeds(after):
            yield "CS563", after, "a rapid leaves a hole that the tool is to leave at feed", math.nan
        fed_out = next((k for k in feeds if height[k] > height.get(k - 1, math.inf) + room), 0)
        if fed_out and not cycle.feed_out:
            yield "CS564", fed_out, "the tool goes up at feed in a hole that it is to leave in rapid", math.nan
        beside, behind_hole = math.isnan(self.before), lines.kind[move - 1] == Move.HOLE
        low = [(last, cycle.level)] if move + 1 < len(lines.tip) and not lines.in_line(move, move + 1) else []
        if beside and not lines.feeds(first) and move and behind_hole:
            way, turn = (values[move - 1] - values[move] for values in (lines.tip, lines.axis))
            if np.linalg.norm(turn) * lines.axis_length <= 2 * room:
                low.append((first, cycle.level + min(float(way @ lines.axis[move]), 0.0)))
        for k, level in low:
            if room < (amount := level - height[k]) < cycle.level + room:  # within it, another fault
                text = f"a rapid beside a hole runs {amount:.4f} mm below the height of its cycle (RTRCTO, RAPTO)"
                yield "CS563", k, text, amount
        if lines.feeds(first) and beside:
            yield "CS563", first, "a feed move enters a hole from the side", math.nan
        if lines.feeds(first) and self.before < -room and behind_hole:
            yield "CS563", first, f"a rapid goes {-self.before:.4f} mm into the uncut hole", -self.before
        if (begins := lines.begins(move, feeds[0])) > max(cycle.clearance, 0.0) + room:
            text = f"feeding begins {begins:.4f} mm above the hole, the cycle says {cycle.clearance:g} (RAPTO)"
            yield "CS564", feeds[0], text, math.nan
        if height[last] < -room:
            yield "CS563", last, "the tool leaves a hole sideways", -height[last]

    def _step_by_step(self) -> Iterator[_Fault]:
        """What is wrong with each move in it: its feed, and how deep it goes."""
        lines, cycle, room = self.lines, self.cycle, self.lines.room
        free = 0.0 if math.isnan(cycle.clearance) else cycle.clearance  # height down to which rapids may go
        drilled, above = -math.inf, math.inf
        for k, here in self.height.items():
            deep = drilled >= cycle.depth - room
            if lines.feeds(k):
                if not (math.isnan(cycle.feed) or lines.carries(k, cycle.feed, per_revolution=cycle.per_revolution)):
                    feed = lines.ahead.nc.feed[k - lines.ahead.base]
                    yield "CS541", k, f"the feed is {feed:g}, the cycle says {cycle.feed:g}", math.nan
                if here < above and self.fed_above(here):
                    yield "CS564", k, "a feed move ends above the heights of the cycle", math.nan
                cut = deep or (drilled > room and room < -here)
                if here < above and cut and -here <= drilled + ARITHMETIC:
                    yield "CS562", k, "a hole is drilled again", math.nan
                drilled, free = max(drilled, -here), min(free, here)
            elif here < above and drilled > room and here + drilled < _gap(cycle) + room:
                yield "CS563", k, "a rapid goes down onto the bottom of a hole, or short of it", math.nan
            elif deep and here < above and here < -room:
                yield "CS563", k, "a rapid goes down into a hole that is drilled", math.nan
            elif here < free - room:
                where = "into the uncut hole" if free <= 0.0 else "below the height where the feed begins (RAPTO)"
                yield "CS563", k, f"a rapid goes {free - here:.4f} mm {where}", free - here
            above = here

    def fed_above(self, height: float) -> bool:
        """Whether a feed move at a height is above those at which a cycle feeds."""
        return height > max(self.cycle.clearance, self.cycle.level) + self.lines.room

    def _in_pecks(self) -> Iterator[_Fault]:
        """Elements that end pecks which are not those of the cycle, and what is wrong.

        A control may count the first from where feeding begins, and the last one takes what is left.
        """
        cycle, room = self.cycle, self.lines.room
        pecks: list[tuple[int, float, float]] = []  # the last element of each, its depth, how high the tool was before
        above = top = math.inf
        fed = False
        for k, here in self.height.items():
            feeds = self.lines.feeds(k) and here < above
            if feeds:
                pecks[len(pecks) - fed :] = [(k, -here, pecks[-1][2] if fed else top if pecks else above)]
            top = here if feeds or top == math.inf else max(top, here)
            fed, above = feeds, here
        if not cycle.steps:
            yield from (
                ("CS562", k, "a hole is drilled in pecks that the cycle does not have", math.nan)
                for k, _, _ in pecks[1:2]
            )
        done, steps = 0.0, [*cycle.steps, *cycle.steps[-1:] * len(pecks)]
        for number, ((k, depth, before), step) in enumerate(zip(pecks, steps, strict=False)):
            last, peck = number == len(pecks) - 1, depth - done
            least = -math.inf if last else step - max(before, 0.0) if not number else step
            out, clear = before > room, before >= -room or done <= room
            stays = number and before + done < _gap(cycle) - room
            text = ""
            if not least - room <= peck <= step + (_REST if last else 0.0) + room:
                text = f"a peck is {peck:.4f} mm deep, the cycle says {step:g}"
            elif stays or (number and not (clear or cycle.breaks_chips)):
                text = "the tool does not come up between pecks as the cycle says"
            elif number and cycle.breaks_chips and out and before + done > 2.0 * step + room:
                text = "the tool leaves the hole between pecks that break chips in it"
            if text:
                yield "CS562", k, text, math.nan
            done = depth


def _gap(cycle: Drilling) -> float:
    """How far above the last depth of a peck rapids end at least, mm."""
    return min(_ABOVE * min(cycle.steps, default=0.0), _LEAST_ABOVE)


def leads_nowhere(nc: Elements, rows: Ints, way: Floats, turn: Floats) -> Bools:
    """(k,) whether elements, whose ways (k, 3) are given, lead nowhere; arcs and curves never do."""
    return _straight(nc.kind[rows]) & ~leads_somewhere(nc, way, turn)


def _straight(kind: NDArray[np.uint8]) -> Bools:
    """(k,) whether elements of some kinds are no arcs and no curves."""
    return (kind == Element.RAPID) | (kind == Element.LINE)
