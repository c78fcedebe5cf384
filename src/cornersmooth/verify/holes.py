"""A hole is a line through its pose along the tool: what is on it, and whether it is drilled as its cycle says."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.nc_reader.elements import Ahead, Element, Problem
from cornersmooth.nc_reader.tool import beyond_digits, directions, leads_somewhere
from cornersmooth.statements.cycles import Drilling
from cornersmooth.verify.cl_motion import Original, selecting
from cornersmooth.verify.motions import digit_errors
from cornersmooth.verify.nearest import COLUMNS, on_segments
from cornersmooth.verify.task import ARITHMETIC

#: how far above the last depth a rapid ends at least, as a share of a peck, and no more than so many mm; by how many mm
#: the last peck may be deeper: nothing worth a peck is left
_ABOVE, _LEAST_ABOVE, _REST = 1.0 / 32.0, 0.1, 0.01

#: elements that are compared with a pose together, as the next ones will be wanted, too
_WINDOW = 16

#: a direction along which no two poses of a usual part are at the same place
_ASLANT: Final = np.array([0.48, 0.6, 0.64])


class HoleLines:
    """Compares ends of elements with poses and holes of the CL file; lengths in mm."""

    def __init__(self, original: Original, ahead: Ahead, axis_length: float, tolerance: float) -> None:
        self.ahead, self.axis_length, self.tolerance = ahead, axis_length, tolerance
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

    def negligible(self, element: int) -> bool:
        """Whether an element moves the tool by no more than digits show."""
        nc, at = self.ahead.nc, element - self.ahead.base
        both = slice(max(at - 1, 0), at + 1)
        turn = self.axis_length * np.ptp(directions(nc, nc.tip[both], nc.second[both]), axis=0)
        return at > 0 and not beyond_digits(nc, np.diff(nc.tip[both], axis=0))[0] and max(turn) <= self.room

    def heights(self, moves: Ints, elements: Ints) -> Floats:
        """(k,) mm above the poses of holes at the ends of straight elements; NaN beside a hole or with another axis."""
        nc, own = self.ahead.nc, elements - self.ahead.base
        # what the printed angles of a tilted plane leave open
        lean = np.where(nc.tip_room[own] > 0.0, nc.second_room[own], 0.0)
        over = self._above(moves, nc.tip[own], directions(nc, nc.tip[own], nc.second[own]), lean)
        return np.where(_straight(nc.kind[own]), over, np.nan)

    def _above(self, moves: Ints, tip: Floats, axis: Floats, lean: Floats | float = 0.0) -> Floats:
        """(k,) mm above the poses of holes at tips (k, 3); NaN beside a hole or with another axis."""
        away = tip - self.tip[moves]
        height = np.einsum("ij,ij->i", away, self.axis[moves])
        beside = np.linalg.norm(away - height[:, None] * self.axis[moves], axis=1)
        turned = np.linalg.norm(axis - self.axis[moves], axis=1) * self.axis_length
        on = (beside <= self.room + lean * np.abs(height)) & (turned <= 2 * self.room + lean * self.axis_length)
        return np.where(on, height, np.nan)

    def at(self, move: int, element: int) -> bool:
        """Whether an element ends exactly at the pose of a move, or stands after one that does."""
        while element > self.ahead.base and not self._of("exact", move, element) and self.stands(element):
            element -= 1
        return element >= 0 and bool(self._of("exact", move, element))

    def height(self, move: int, element: int) -> float:
        """Height of one element, as of `heights`."""
        return self._of("heights", move, element) if element >= 0 else math.nan

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
        return bool(self._of("standing", -1, element))

    def standing(self, _: Ints, elements: Ints) -> Bools:
        """(k,) whether elements lead nowhere: a full circle ends where it begins, and does."""
        nc, own = self.ahead.nc, elements - self.ahead.base
        ways = (values[own] - values[np.maximum(own - 1, 0)] for values in (nc.tip, nc.second))
        return (own > 0) & _straight(nc.kind[own]) & ~leads_somewhere(nc, *ways)

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

    def fed_above(self, move: int, element: int, cycle: Drilling) -> bool:
        """Whether a feed move ends above a hole, where no cycle feeds."""
        highest = max(cycle.clearance, cycle.level) + self.room
        return self.feeds(element) and self.height(move, element) > highest

    def check(self, move: int, elements: range, cycle: Drilling) -> tuple[list[Problem], bool]:
        """What is wrong with a hole that has some elements, and whether it is left out as it may be.

        CS541 a wrong feed, CS561 a hole is missing, CS562 a wrong depth, CS563 a rapid inside or beside a hole, CS564 a
        feed that is not a hole's.
        """
        height = {k: h for k in elements if not (math.isnan(h := self.height(move, k)) or self.stands(k))}
        feeds = [k for k in height if self.feeds(k)]
        found: list[Problem] = []

        def say(code: str, element: int, text: str, amount: float = math.nan) -> None:
            found.append(self.problem(code, move, element, text, amount))

        tapped = bool(feeds) and self.carries(feeds[0], cycle.feed, per_revolution=True)
        if math.isnan(cycle.depth) or (cycle.tap and not tapped):
            if feeds:
                say("CS564", feeds[0], "the cycle does not say what is fed here")
            elif height and height[lowest := min(height, key=lambda k: height[k])] < -self.room:
                depth = -height[lowest]
                say("CS563", lowest, f"a rapid goes {depth:.4f} mm into the uncut hole", depth)
            return found, cycle.tap or not feeds
        if not feeds:
            if cycle.depth > self.room:
                say("CS561", next(iter(height), -1), "a hole of the CL file is not drilled")
            return found, False
        first, last = next(iter(height)), next(reversed(height))
        deepest = min(feeds, key=lambda k: height[k])
        if abs(off := height[deepest] + cycle.depth) > self.room:
            text = f"a hole is {abs(off):.4f} mm too {'shallow' if off > 0 else 'deep'}"
            say("CS562", deepest, text, abs(off))
        after = next((k for k in height if k > deepest), deepest)
        if cycle.feed_out and not self.feeds(after):
            say("CS563", after, "a rapid leaves a hole that the tool is to leave at feed")
        fed_out = next((k for k in feeds if height[k] > height.get(k - 1, math.inf) + self.room), 0)
        if fed_out and not cycle.feed_out:
            say("CS564", fed_out, "the tool goes up at feed in a hole that it is to leave in rapid")
        before = self.height(move, max(first - 1, 0))
        beside = math.isnan(before)
        low = [(last, cycle.level)] if move + 1 < len(self.tip) and not self.in_line(move, move + 1) else []
        if beside and not self.feeds(first) and move and self.kind[move - 1] == Move.HOLE:
            way, turn = (values[move - 1] - values[move] for values in (self.tip, self.axis))
            if np.linalg.norm(turn) * self.axis_length <= 2 * self.room:
                low.append((first, cycle.level + min(float(way @ self.axis[move]), 0.0)))
        for k, level in low:
            if self.room < (amount := level - height[k]) < cycle.level + self.room:  # within it, another fault
                text = f"a rapid beside a hole runs {amount:.4f} mm below the height of its cycle (RTRCTO, RAPTO)"
                say("CS563", k, text, amount)
        if self.feeds(first) and beside:
            say("CS563", first, "a feed move enters a hole from the side")
        if self.feeds(first) and before < -self.room and self.kind[move - 1] == Move.HOLE:
            say("CS563", first, f"a rapid goes {-before:.4f} mm into the uncut hole", -before)
        free = 0.0 if math.isnan(cycle.clearance) else cycle.clearance  # height down to which rapids may go
        drilled, deep, above = 0.0, False, math.inf
        gap = _gap(cycle) + self.room
        begins = height.get(feeds[0] - 1, self.height(move, max(feeds[0] - 1, 0)))
        if begins > max(cycle.clearance, 0.0) + self.room:
            say(
                "CS564",
                feeds[0],
                f"feeding begins {begins:.4f} mm above the hole, the cycle says {cycle.clearance:g} (RAPTO)",
            )
        for k, here in height.items():
            if self.feeds(k):
                if not (math.isnan(cycle.feed) or self.carries(k, cycle.feed, per_revolution=cycle.per_revolution)):
                    feed = self.ahead.nc.feed[k - self.ahead.base]
                    say("CS541", k, f"the feed is {feed:g}, the cycle says {cycle.feed:g}")
                down = above > here
                if down and self.fed_above(move, k, cycle):
                    say("CS564", k, "a feed move ends above the heights of the cycle")
                cut = deep or (drilled > self.room and self.room < -here)
                if down and cut and -here <= drilled + ARITHMETIC:
                    say("CS562", k, "a hole is drilled again")
                deep = deep or here <= self.room - cycle.depth
                drilled, free = max(drilled, -here), min(free, here)
            elif here < above and drilled > self.room and here + drilled < gap:
                say("CS563", k, "a rapid goes down onto the bottom of a hole, or short of it")
            elif deep and here < above and here < -self.room:
                say("CS563", k, "a rapid goes down into a hole that is drilled")
            elif here < free - self.room:
                where = "into the uncut hole" if free <= 0.0 else "below the height where the feed begins (RAPTO)"
                say("CS563", k, f"a rapid goes {free - here:.4f} mm {where}", free - here)
            above = here
        if above < -self.room:
            say("CS563", last, "the tool leaves a hole sideways", -above)
        if cycle.steps or not cycle.pecking:
            for k, text in self._wrong_pecks(height, cycle):
                say("CS562", k, text)
        return found, False

    def _wrong_pecks(self, height: dict[int, float], cycle: Drilling) -> Iterator[tuple[int, str]]:
        """Elements that end pecks which are not those of the cycle, and what is wrong; heights in order.

        A control may count the first from where feeding begins, and the last one takes what is left.
        """
        pecks: list[tuple[int, float, float]] = []  # the last element of each, its depth, how high the tool was before
        above = top = math.inf
        fed = False
        for k, here in height.items():
            feeds = self.feeds(k) and here < above
            if feeds:
                pecks[len(pecks) - fed :] = [(k, -here, pecks[-1][2] if fed else top if pecks else above)]
            top = here if feeds or top == math.inf else max(top, here)
            fed, above = feeds, here
        if not cycle.steps:
            yield from ((k, "a hole is drilled in pecks that the cycle does not have") for k, _, _ in pecks[1:2])
        done, steps = 0.0, [*cycle.steps, *cycle.steps[-1:] * len(pecks)]
        for number, ((k, depth, before), step) in enumerate(zip(pecks, steps, strict=False)):
            last, peck = number == len(pecks) - 1, depth - done
            least = -math.inf if last else step - max(before, 0.0) if not number else step
            out, clear = before > self.room, before >= -self.room or done <= self.room
            stays = number and before + done < _gap(cycle) - self.room
            if not least - self.room <= peck <= step + (_REST if last else 0.0) + self.room:
                yield k, f"a peck is {peck:.4f} mm deep, the cycle says {step:g}"
            elif stays or (number and not (clear or cycle.breaks_chips)):
                yield k, "the tool does not come up between pecks as the cycle says"
            elif number and cycle.breaks_chips and out and before + done > 2.0 * step + self.room:
                yield k, "the tool leaves the hole between pecks that break chips in it"
            done = depth


def _gap(cycle: Drilling) -> float:
    """How far above the last depth of a peck rapids end at least, mm."""
    return min(_ABOVE * min(cycle.steps, default=0.0), _LEAST_ABOVE)


def _straight(kind: NDArray[np.uint8]) -> Bools:
    """(k,) whether elements of some kinds are no arcs and no curves."""
    return (kind == Element.RAPID) | (kind == Element.LINE)
