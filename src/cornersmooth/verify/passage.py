"""Whether one motion can be run beside another, both forward only, so that they always keep within a radius.

That is the Fréchet distance of two polylines, decided. A `chain` of nearest places proves it nearly everywhere; where
it does not, what can be reached is worked out exactly (`free_space`), from a few rows before.

The answer has three values. A place where the motions part is a `Break`: it is proved where nothing is near a vertex,
or all was looked at from where the motion is known to begin; else what lies too far back may lead on, or a guessed
place may be the wrong one, and it is *not proved*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.arrays import distinct
from cornersmooth.model import Floats, Ints
from cornersmooth.verify.chain import Path, Sections, chain, points_at
from cornersmooth.verify.free_space import FINE, Around, Inner, free_interval, lowest
from cornersmooth.verify.motions import UNBOUND, largest_square
from cornersmooth.verify.task import CL_SHARE

#: rows before one that is not proved from which on it is worked out exactly, one after the other; farther back nothing
#: is looked at, and the answer is NOT VERIFIED
LOOK_BACK: Final = (3, 32, 256, 2048)

#: rows within which the first two of them must come back to the chain (speed only)
_SOON: Final = 64

#: radii of path length around a break where it is looked for what is off, and where to go on (which faults are named)
AROUND: Final = 200.0

#: parts that a bent step is divided into where it is not proved, as often as its bend is not fine
PARTS: Final = 8

#: how many times longer than some rows the path beside them may be; where it is longer, the answer may be NOT VERIFIED
LONGER: Final = 4.0

#: vertices after a break, ever farther apart, that are tried to go on with (which faults are named after it)
_TRIED: Final = 48

#: segments around a break among which it is looked for where to go on, at most (as above)
_WIDEST: Final = 1 << 16

#: breaks after which nothing more is looked at
MOST_BREAKS: Final = 20


@dataclass(frozen=True)
class Break:
    """Where the motions part."""

    row: int  #: the first vertex of the own polyline that cannot be reached
    place: float  #: last place on the path (segment plus fraction) that was reached before
    proved: bool  #: False: NOT VERIFIED, as what was looked at before it was not enough.


class Passage:
    """Decides whether a motion can be run beside a path, section by section; all lengths in mm.

    It has vertices (n, 3h), each triple of which has to keep the radius by itself, and bends (n - 1,) of the steps
    between them. `inner` gives points of bent steps, by numbers of vertices and fractions.
    """

    def __init__(
        self,
        own: Floats,
        bend: Floats,
        path: Path,
        radius: float,
        sections: Sections,
        inner: Inner | None = None,
    ) -> None:
        self.path, self.radius, self._inner = path, radius, inner
        self.breaks: list[Break] = []  #: where the motions part; nothing is looked at after the most
        # vertices, bends of the steps from them, their places, and their numbers, with fractions of those put between
        self._own, self._bend = own, bend
        self._place, self._number = np.full(len(own), np.nan), np.arange(len(own), dtype=np.float64)
        # sections: the first vertices that are not decided, and the last ones; places where they begin and end
        self._first, self._last = sections.first.copy(), sections.last.copy()
        self._begin, self._stop, self._guessed = sections.start.copy(), sections.stop, sections.guessed
        self._left = 0.0  # last place that was reached before a break
        section = 0
        while section < len(self._first) and len(self.breaks) < MOST_BREAKS:
            section = self._go_on(section)

    @property
    def place(self) -> Floats:
        """(n,) a place on the path, segment plus fraction, for every vertex, ascending.

        The two motions can be run beside each other through all of them. NaN where there is none, from a break on.
        """
        return self._place[self._number == np.floor(self._number)]

    def _meets(self, row: int, place: float) -> bool:
        """Whether a vertex is near a place of the path."""
        off = largest_square(self._own[row] - points_at(self.path.points, np.array([place]))[:, 0])
        return bool(off <= self.radius**2)

    def _go_on(self, section: int) -> int:
        """Find places for vertices from the first of a section on, or a break; return the section to go on with."""
        row, begin = int(self._first[section]), float(self._begin[section])
        if np.isnan(self._place[row]) and not self._meets(row, begin):
            return self._break(section, Break(row, begin, not self._guessed[section]))
        bad = self._prove(section, row, begin)
        while len(bad):
            one = int(np.searchsorted(self._first, bad[0], side="right")) - 1
            gaps = np.flatnonzero(np.diff(bad) > LOOK_BACK[0])
            last = min(int(bad[gaps[0] if len(gaps) else -1]), int(bad[0]) + _SOON, int(self._last[one]))
            found = self._repair(one, int(bad[0]), last)
            if isinstance(found, Break):
                return self._break(one, found)
            bad = bad[bad > found]
        return len(self._first)

    def _prove(self, section: int, row: int, begin: float) -> Ints:
        """Find places for vertices from one on by the chain; return those that it does not prove.

        Bent steps are divided as long as they are what is in the way.
        """
        sections = self._sections().behind(section, row, begin)
        found = chain(np.ascontiguousarray(self._own[row:].T), self._bend[row:], self.path, self.radius, sections)
        _, inside = sections.of(np.arange(len(found.place)))
        self._place[row:] = np.where(found.bad | ~inside, np.nan, found.place)
        # whether more is wrong need not be known so well
        bent = np.flatnonzero(found.bad & ~found.far & (not self.breaks)) + row
        while len(bent) and self._inner is not None and self._divide(bent, self._inner):
            bent = self._prove_again(row)
        return self._missing(row)[0]

    def _sections(self) -> Sections:
        return Sections(self._first, self._last, self._begin, self._stop, self._guessed)

    def _missing(self, row: int) -> tuple[Ints, Ints]:
        """Vertices from one on that have no place, and their sections."""
        rows = row + np.flatnonzero(np.isnan(self._place[row:]))
        number, inside = self._sections().of(rows)
        return rows[inside], number[inside]

    def _prove_again(self, row: int) -> Ints:
        """Find places by the chain for vertices that have none, from one on; return those where bends are in the way.

        Each run of them is a section, between the two vertices around it.
        """
        rows, number = self._missing(row)
        new = np.append(True, (np.diff(rows) > 1) | (np.diff(number) > 0))
        first, number = rows[new] - 1, number[new]
        last = np.minimum(rows[np.append(new[1:], True)] + 1, self._last[number])
        known = (first >= self._first[number]) & ~np.isnan(self._place[np.maximum(first, 0)])
        first, last, number = first[known], last[known], number[known]
        if not len(first):
            return first
        stop = np.where(np.isnan(self._place[last]), self._stop[number], self._place[last])
        size = last - first + 1
        ends = np.cumsum(size)
        at = np.repeat(first - ends + size, size) + np.arange(ends[-1])
        sections = Sections(ends - size, ends - 1, self._place[first], stop, self._guessed[number])
        bend = self._bend[np.minimum(at[:-1], len(self._bend) - 1)]
        found = chain(np.ascontiguousarray(self._own[at].T), bend, self.path, self.radius, sections)
        inner = np.ones(len(at), np.bool_)
        inner[ends - size] = False
        self._place[at[inner]] = np.where(found.bad, np.nan, found.place)[inner]
        return at[found.bad & ~found.far & inner]

    def _divide(self, bad: Ints, inner: Inner) -> bool:
        """Put points into the bent steps to some vertices and from them; say whether there were any."""
        steps = distinct(np.concatenate((bad - 1, bad)))
        steps = steps[steps < len(self._own) - 1]
        steps = steps[(self._bend[steps] > FINE * self.radius) & (self._bend[steps] < UNBOUND)]
        if not len(steps):
            return False
        share = np.arange(1, PARTS) / PARTS
        begin, end = self._number[steps], self._number[steps + 1]
        number = (begin[:, None] + share * (end - begin)[:, None]).ravel()
        at = np.repeat(steps + 1, PARTS - 1)
        self._own = np.insert(self._own, at, inner(number), axis=0)
        self._number, self._place = np.insert(self._number, at, number), np.insert(self._place, at, np.nan)
        for rows in (self._first, self._last):
            rows += (PARTS - 1) * np.searchsorted(steps, rows)
        bend = self._bend.copy()
        bend[steps] /= PARTS**2
        self._bend = np.insert(bend, at, bend[np.repeat(steps, PARTS - 1)])
        return True

    def _repair(self, section: int, first: int, last: int) -> int | Break:
        """Work out exactly how to come past some vertices; return one after them that has a place."""
        known, end, stop = int(self._first[section]), int(self._last[section]), float(self._stop[section])
        sure = not self._guessed[section]
        if first == known:
            return Break(first, float(self._begin[section]), sure)
        found = Break(first, float(self._place[first - 1]), False)
        for back in LOOK_BACK[: 2 if self.breaks else None]:
            begin = max(first - back, known)
            until = end if back > _SOON else min(last + _SOON, end)
            rows, steps = slice(begin, until + 1), slice(begin, until)
            own = self._own[rows], self._bend[steps], self._number[rows]
            top = self._within_reach(begin, until, stop)
            # the first nearly always leads on, and takes a thousandth of the time
            for fine in (CL_SHARE, FINE)[: 1 if self.breaks else None]:
                around = Around.of(own, self.path, self.radius, float(self._place[begin]), top, self._inner, fine)
                goal = around.goal(self._place[rows], last - begin, math.nan if until < end else stop)
                if goal is not None:
                    return self._settle(begin, around, goal)
            if not around.reached[0] and begin > known:  # what bends take off leaves nothing of that place
                continue
            if around.reached[-1] and until < end:
                continue
            reached = begin + around.row_reached
            row = max(reached, first)  # the chain has proved what is before that
            proved = begin == known or not self._is_near(reached, known, top)
            found = Break(row, around.farthest(), sure and proved and row == reached and not self.breaks)
            if proved:
                break
        return found

    def _is_near(self, row: int, known: int, top: int) -> bool:
        """Whether a vertex may be near a place up to a vertex of the path, and not before that of an earlier one."""
        bottom = min(int(self._place[known]), top - 1)
        start = self.path.points[bottom:top].T
        way = self.path.points[bottom + 1 : top + 1].T - start
        low, high = free_interval(self._own[row][:, None], start, way, np.asarray(self.radius))
        return bool((low <= high).any())

    def _within_reach(self, begin: int, until: int, stop: float) -> int:
        """Vertex of the path before which some rows end, if they run beside it."""
        path = self.path
        step = np.diff(self._own[begin : until + 1], axis=0)
        gone = float(np.sqrt(np.einsum("ij,ij->i", step, step)).sum())
        length = path.length_at(float(self._place[begin])) + LONGER * gone + AROUND * self.radius
        return min(int(np.searchsorted(path.length, length)) + 1, max(math.ceil(stop), 1))

    def _settle(self, begin: int, around: Around, goal: float) -> int:
        """Give vertices the first places from which another place, of the last row reached, can be reached."""
        between = around.space.between(around.reached, around.inward(goal))
        count = int(np.searchsorted(around.at, len(between)))
        end = begin + count - 1
        self._place[begin : end + 1] = [around.outward(lowest(between[k])) for k in around.at[:count].tolist()]
        self._place[end] = goal
        return end

    def _break(self, section: int, found: Break) -> int:
        """Take down a break, and find where to go on: the section that it is in, or the next."""
        self.breaks.append(replace(found, row=int(np.ceil(self._number[found.row]))))
        self._left = found.place
        self._place[found.row :] = np.nan
        return self._resume(section, found.row)

    def _resume(self, section: int, row: int) -> int:
        """Go on with a vertex from one on that is near the path again, or with the next section.

        It gets a place: the nearest to where the path was left.
        """
        path, end, left = self.path, int(self._last[section]), self.path.length_at(self._left)
        bottom, top = int(self._begin[section]), math.ceil(self._stop[section])
        tried = row + distinct(np.geomspace(1, max(end - row, 1), _TRIED).astype(np.int64)) - 1
        for width, rows in ((AROUND, tried), (AROUND * AROUND, tried[::6])):
            low, high = np.searchsorted(path.length, (left - width * self.radius, left + width * self.radius)).tolist()
            segments = slice(max(low - 1, bottom), min(high + 1, top, low + _WIDEST))
            if segments.start >= segments.stop or row >= end:
                continue
            start = path.points[segments].T
            way = path.points[segments.start + 1 : segments.stop + 1].T - start
            for k in rows.tolist():
                bend = self._bend[max(k - 1, 0) : k + 1].max(initial=0.0)
                at, other = free_interval(self._own[k][:, None], start, way, self.radius - bend - path.bend[segments])
                free = np.flatnonzero(at <= other)
                if len(free):
                    place = segments.start + free + np.clip(self._left - segments.start - free, at[free], other[free])
                    self._first[section] = k
                    self._begin[section] = self._place[k] = place[np.argmin(np.abs(place - self._left))]
                    return section
        self._place[end] = np.nan
        return section + 1
