"""Whether one motion can be run beside another, both forward only, so that they always keep within a radius.

That is the Fréchet distance of two polylines, decided. A `chain` of nearest places proves it nearly everywhere; where
it does not, what can be reached is worked out exactly (`free_space`), from a few rows before.

The answer has three values. A place where the motions part is a `Break`: it is proved where all that is free of a row
before it was reached, and yet nothing behind it is; else what lies too far back may lead on, and it is *not proved*.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.around import Around, Inner, Rows
from cornersmooth.verify.chain import Path, Sections, chain, points_at
from cornersmooth.verify.free_space import free_interval, is_all, largest_square, lowest

#: rows before one that is not proved from which on it is worked out exactly, one after the other; farther back nothing
#: is looked at, and the answer is NOT VERIFIED
LOOK_BACK: Final = (3, 32, 256, 2048)

#: rows within which the first two of them must come back to the chain (speed only)
_SOON: Final = 64

#: radii of path length within which all that is free of a row must have been reached to prove a break: where a path
#: comes back to the same place after a longer way the answer may be NO where it should be NOT VERIFIED
AROUND: Final = 200.0

#: parts that a bent step is divided into where it is not proved, as often as its bend is not tiny, in radii
PARTS: Final = 8
_TINY: Final = 1e-4

#: how many times longer than some rows the path beside them may be; where it is longer, the answer may be NOT VERIFIED
LONGER: Final = 4.0

#: vertices after a break, ever farther apart, that are tried to go on with (which faults are named after it)
_TRIED: Final = 48

#: segments around a break among which it is looked for where to go on, at most (as above)
_WIDEST: Final = 1 << 16

#: breaks after which nothing more is looked at
MOST_BREAKS: Final = 100


@dataclass(frozen=True)
class Break:
    """Where the motions part."""

    row: int  #: the first vertex of the own polyline that cannot be reached
    place: float  #: last place on the path (segment plus fraction) that was reached before
    proved: bool  #: False: NOT VERIFIED, as what was looked at before it was not enough.


@dataclass(frozen=True)
class Passage:
    """The answer."""

    #: (n,): A place on the path, segment plus fraction, for every vertex of the own polyline, ascending: beside each
    #: other the two motions can be run through all of them. NaN where there is none, from a break on.
    place: Floats
    breaks: tuple[Break, ...] = ()
    #: whether all of the own motion was looked at: not after `MOST_BREAKS`, nor where it never came back to the path
    whole: bool = True

    @property
    def passed(self) -> bool:
        """Whether the motions are proved to keep within the radius."""
        return not self.breaks and self.whole


@dataclass
class Walk:
    """Goes along a path as the own motion comes in, chunk by chunk."""

    path: Path
    radius: float  #: mm
    _own: Floats | None = None  #: (k, 3h) last vertices of a section that goes on, to look back on
    _bend: Floats = field(default_factory=lambda: np.zeros(0))
    _place: Floats = field(default_factory=lambda: np.zeros(0))
    _known: int = 0  #: row of them at whose place and nowhere else the motion begins; -1: forgotten
    _left: float = 0.0  #: last place that was reached before a break
    _breaks: int = 0  #: how many so far

    def take(self, own: Floats, bend: Floats, sections: Sections, inner: Inner | None = None) -> Passage:
        """Go on.

        Parameters
        ----------
        own : (n, 3h) float64, mm
            The next vertices. After an open section the first of them is the last of those before, and the first
            section is the rest of that one.
        bend : (n - 1,) float64, mm
        sections : Sections
            Where a section of one vertex has more than one place, the motion stands still.
        inner : callable, optional
            Gives more points of bent steps; vertices are counted in `own`.

        Returns
        -------
        Passage
            Of these vertices; NaN between sections.
        """
        if self._breaks >= MOST_BREAKS:
            return Passage(np.full(len(own), np.nan), (), False)
        part = _Part(self, own, bend, sections)
        part.decide(inner)
        if sections.open:
            kept = max(part.last - LOOK_BACK[-1], int(part.known[-1]), 0)
            self._own, self._bend, self._place = part.own[kept:], part.bend[kept:], part.place[kept:]
            self._known = max(int(part.known[-1]) - kept, -1)
        else:
            self._own = None
        self._left = part.left
        self._breaks += len(part.breaks)
        number = part.number[part.start :]
        return Passage(part.place[part.start :][number == np.floor(number)], tuple(part.breaks), part.whole)


class _Part:
    """The last vertices of what was looked at before, and those of a chunk."""

    def __init__(self, walk: Walk, own: Floats, bend: Floats, sections: Sections) -> None:
        self.path, self.radius, self.left = walk.path, walk.radius, walk._left
        self.start = 0
        self.first, self.ends = sections.first.copy(), sections.last.copy()
        self.begin, self.stop, self.open = sections.start.copy(), sections.stop, sections.open
        if walk._own is None:
            self.own, self.bend = own, bend
            self.place = np.full(len(own), np.nan)
            self.known = self.first.copy()
        else:
            self.start = len(walk._own) - 1
            self.own, self.bend = np.concatenate((walk._own, own[1:])), np.concatenate((walk._bend, bend))
            self.place = np.concatenate((walk._place, np.full(len(own) - 1, np.nan)))
            self.first += self.start
            self.ends += self.start
            self.known = self.first.copy()
            self.first[0], self.known[0], self.begin[0] = self.start, walk._known, walk._place[-1]
        #: of each vertex in the chunk, with fractions where it was put between two
        self.number = np.arange(len(self.own), dtype=np.float64) - self.start
        self.most = MOST_BREAKS - walk._breaks
        self.breaks: list[Break] = []
        self.whole = True

    @property
    def last(self) -> int:
        """The last vertex."""
        return len(self.own) - 1

    def decide(self, inner: Inner | None) -> None:
        """Find places for all vertices of sections, or breaks."""
        section = 0
        while section < len(self.first) and self.whole:
            section = self._go_on(section, inner)

    def meets(self, row: int, place: float) -> bool:
        """Whether a vertex is near a place of the path."""
        off = largest_square(self.own[row] - points_at(self.path.points, np.array([place]))[:, 0])
        return bool(off <= self.radius**2)

    def _go_on(self, section: int, inner: Inner | None) -> int:
        """Go on from the first vertex of a section; return the section to go on with."""
        row, begin = int(self.first[section]), float(self.begin[section])
        if np.isnan(begin):  # the motion has not come back to the path yet
            return self._resume(section, row)
        if np.isnan(self.place[row]) and not self.meets(row, begin):
            return self._break(section, Break(row, begin, True))
        bad = self._prove(section, row, begin, inner)
        while len(bad):
            one = int(np.searchsorted(self.first, bad[0], side="right")) - 1
            gaps = np.flatnonzero(np.diff(bad) > LOOK_BACK[0])
            last = min(int(bad[gaps[0] if len(gaps) else -1]), int(bad[0]) + _SOON, int(self.ends[one]))
            end = self._repair(one, int(bad[0]), last, inner)
            if isinstance(end, Break):
                after = self._next(one, end.row)
                if after is None or len(self.breaks) + 1 >= self.most:
                    return self._break(one, end)
                self._take_down(end)
                self.place[end.row : after] = np.nan
                self._begin_at(one, after, float(self.place[after]))
                end = after
            bad = bad[bad > end]
        return len(self.first)

    def _prove(self, section: int, row: int, begin: float, inner: Inner | None) -> Ints:
        """Find places for vertices from one on by the chain; return those that it does not prove.

        Bent steps are divided as long as they are what is in the way.
        """
        while True:
            sections = Sections(self.first, self.ends, self.begin, self.stop, self.open)
            columns = np.ascontiguousarray(self.own[row:].T)
            rest = sections.behind(section, row, begin)
            found = chain(columns, self.bend[row:], self.path, self.radius, rest)
            bent = np.flatnonzero(found.bad & ~found.far) + row
            if not len(bent) or inner is None or not self._divide(row, bent, inner):
                break
        _, inside = rest.of(np.arange(len(found.place)))
        self.place[row:] = np.where(found.bad | ~inside, np.nan, found.place)
        return np.flatnonzero(found.bad) + row

    def _divide(self, row: int, bad: Ints, inner: Inner) -> bool:
        """Put points into bent steps, from a row on, to some vertices and beside them; say whether there were any."""
        steps = np.unique(np.concatenate((bad - 2, bad - 1, bad)))
        steps = steps[(steps >= row) & (steps < self.last)]
        steps = steps[self.bend[steps] > _TINY * self.radius]
        if not len(steps):
            return False
        share = np.arange(1, PARTS) / PARTS
        begin, end = self.number[steps], self.number[steps + 1]
        number = (begin[:, None] + share * (end - begin)[:, None]).ravel()
        at = np.repeat(steps + 1, PARTS - 1)
        self.own = np.insert(self.own, at, inner(number), axis=0)
        self.number, self.place = np.insert(self.number, at, number), np.insert(self.place, at, np.nan)
        for rows in (self.first, self.ends, self.known):
            rows += (PARTS - 1) * np.searchsorted(steps, rows)
        bend = self.bend.copy()
        bend[steps] /= PARTS**2
        self.bend = np.insert(bend, at, bend[np.repeat(steps, PARTS - 1)])
        return True

    def _repair(self, section: int, first: int, last: int, inner: Inner | None) -> int | Break:
        """Work out exactly how to come past some vertices; return one after them that has a place."""
        known, end, stop = int(self.known[section]), int(self.ends[section]), int(self.stop[section])
        unfinished = self.open and section == len(self.first) - 1
        if first == known:
            return Break(first, float(self.begin[section]), True)
        found = Break(first, float(self.place[first - 1]), False)
        # whether more is wrong need not be known so well
        for back in LOOK_BACK[: 2 if self.breaks or self.most < MOST_BREAKS else None]:
            begin = max(first - back, known, 0)
            until = end if back > _SOON else min(last + _SOON, end)
            rows = Rows(begin, *(values[begin : until + 1] for values in (self.own, self.bend[:until], self.number)))
            top = self._within_reach(begin, until, stop)
            ends = -1 if until < end else None if unfinished else stop
            for fine in (False, True):
                around = Around.of(rows, self.path, self.radius, float(self.place[begin]), top, inner, fine=fine)
                goal = around.goal(self.place[begin : until + 1], last - begin, ends)
                if goal is not None:
                    return self._settle(around, goal)
                if not around.bent:
                    break
            if not around.reached[0] and begin not in (known, 0):  # what bends take off leaves nothing of that place
                continue
            if around.reached[-1] and until < end:
                continue
            proved = begin == known or self._all_known(around, section)
            row = max(around.row_reached, first)  # the chain has proved what is before that
            found = Break(row, around.farthest(), proved and row == around.row_reached)
            if proved or begin == 0:
                break
        return found

    def _within_reach(self, begin: int, until: int, stop: int) -> int:
        """Vertex of the path before which some rows end, if they run beside it."""
        path = self.path
        step = np.diff(self.own[begin : until + 1], axis=0)
        gone = float(np.sqrt(np.einsum("ij,ij->i", step, step)).sum())
        length = path.length_at(float(self.place[begin])) + LONGER * gone + AROUND * self.radius
        return min(int(np.searchsorted(path.length, length)) + 1, stop)

    def _settle(self, around: Around, goal: float) -> int:
        """Give vertices the first places from which another place, of the last row reached, can be reached."""
        between = around.space.between(around.reached, around.inward(goal))
        count = int(np.searchsorted(around.at, len(between)))
        begin, end = around.begin, around.begin + count - 1
        self.place[begin : end + 1] = [around.outward(lowest(between[k])) for k in around.at[:count].tolist()]
        self.place[end] = goal
        return end

    def _all_known(self, around: Around, section: int) -> bool:
        """Whether all that is free of one of some rows was reached."""
        path, first, stop = self.path, int(self.begin[section]), int(self.stop[section])
        for row in range(len(around.reached) - 1, -1, -1):
            reached = around.reached[row]
            if reached:
                here, beyond = path.length_at(around.outward(float(min(reached)))), AROUND * self.radius
                low, high = np.searchsorted(path.length, (here - beyond, here + beyond)).tolist()
                low, high = max(low - 1, first), min(high + 1, stop)
                low_here, high_here = (np.searchsorted(around.places, at) for at in (low, high))
                inside = slice(int(low_here), min(int(high_here), len(around.places) - 1))
                point = around.space.own[:, row]
                beside = slice(low, around.base), slice(around.top, high)
                if is_all(around.space, row, reached, inside) and not any(self._free(point, k) for k in beside):
                    return True
        return False

    def _free(self, point: Floats, segments: slice) -> bool:
        """Whether any of some segments of the path is near a point (3h,)."""
        if segments.start >= segments.stop:
            return False
        start = self.path.points[segments].T
        way = self.path.points[segments.start + 1 : segments.stop + 1].T - start
        low, high = free_interval(point[:, None], start, way, np.asarray(self.radius))
        return bool((low <= high).any())

    def _next(self, section: int, row: int) -> int | None:
        """The first vertex of a section after one that the chain has proved."""
        known = np.flatnonzero(~np.isnan(self.place[row + 1 : self.ends[section]]))
        return row + 1 + int(known[0]) if len(known) else None

    def _take_down(self, found: Break) -> None:
        """Take down a break."""
        self.breaks.append(replace(found, row=int(np.ceil(self.number[found.row]))))
        self.left = found.place
        self.whole = len(self.breaks) < self.most

    def _break(self, section: int, found: Break) -> int:
        """Take down a break, and find where to go on: the section that it is in."""
        self._take_down(found)
        self.place[found.row :] = np.nan
        return self._resume(section, found.row)

    def _resume(self, section: int, row: int) -> int:
        """Go on with a vertex from one on that is near the path again, or with the next section.

        It gets a place: the nearest to where the path was left.
        """
        path, end, left = self.path, int(self.ends[section]), self.path.length_at(self.left)
        bottom, top = int(np.nan_to_num(self.begin[section])), int(self.stop[section])
        tried = row + np.unique(np.geomspace(1, max(end - row, 1), _TRIED).astype(np.int64)) - 1
        for width, rows in ((AROUND, tried), (AROUND * AROUND, tried[::6])):
            low, high = np.searchsorted(path.length, (left - width * self.radius, left + width * self.radius)).tolist()
            segments = slice(max(low - 1, bottom), min(high + 1, top, low + _WIDEST))
            if segments.start >= segments.stop or row >= end:
                continue
            start = path.points[segments].T
            way = path.points[segments.start + 1 : segments.stop + 1].T - start
            for k in rows.tolist():
                bend = self.bend[max(k - 1, 0) : k + 1].max(initial=0.0)
                at, other = free_interval(self.own[k][:, None], start, way, self.radius - bend - path.bend[segments])
                free = np.flatnonzero(at <= other)
                if len(free):
                    place = segments.start + free + np.clip(self.left - segments.start - free, at[free], other[free])
                    return self._begin_at(section, k, float(place[np.argmin(np.abs(place - self.left))]))
        self.place[end] = np.nan
        return section + 1

    def _begin_at(self, section: int, row: int, place: float) -> int:
        self.first[section] = self.known[section] = row
        self.begin[section] = self.place[row] = place
        return section
