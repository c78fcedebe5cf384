"""Whether one motion can be run beside another, both forward only, so that they always keep within a radius.

That is the Fréchet distance of two polylines, decided. A `chain` of nearest places proves it nearly everywhere; where
it does not, what can be reached is worked out exactly (`free_space`), from a few rows before.

The answer has three values. A place where the motions part is a `Break`: it is proved where all that is free of a row
before it was reached, and yet nothing behind it is; else what lies too far back may lead on, and it is *not proved*.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.chain import Path, Sections, chain, near_places, points_at
from cornersmooth.verify.free_space import FreeSpace, Reached, free_interval, holds, is_all, largest_square, lowest

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
_TINY: Final = 1e-6

#: segments around a break among which it is looked for where to go on, at most (which faults are named after it)
_WIDEST: Final = 1 << 16

#: breaks after which nothing more is looked at
MOST_BREAKS: Final = 100

#: vertices of the own polyline that are looked at together (speed only: they fit the cache)
CHUNK: Final = 8192

#: gives points (k, 3h) of the own motion at vertex numbers (k,) with fractions of the steps behind them
Inner = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Break:
    """Where the motions part.

    Parameters
    ----------
    row : int
        The first vertex of the own polyline that cannot be reached.
    place : float
        Last place on the path (segment plus fraction) that was reached before.
    proved : bool
        False: NOT VERIFIED, as what was looked at before it was not enough.
    """

    row: int
    place: float
    proved: bool


@dataclass(frozen=True)
class Passage:
    """The answer.

    Parameters
    ----------
    place : (n,) float64
        A place on the path, segment plus fraction, for every vertex of the own polyline, ascending: beside each other
        the two motions can be run through all of them. NaN where there is none, from a break on.
    breaks : tuple of Break
    whole : bool
        Whether all of the own motion was looked at: not after `MOST_BREAKS`, nor where it never came back to the path.
    """

    place: Floats
    breaks: tuple[Break, ...] = ()
    whole: bool = True

    @property
    def passed(self) -> bool:
        """Whether the motions are proved to keep within the radius."""
        return not self.breaks and self.whole


def passage(
    own: Floats,
    path: Floats,
    radius: float,
    *,
    gate: Floats | None = None,
    own_bend: Floats | None = None,
    path_bend: Floats | None = None,
    chunk: int = CHUNK,
) -> Passage:
    """Decide whether two polylines can be run beside each other within a radius, both forward only.

    Parameters
    ----------
    own, path : (n, 3h), (m + 1, 3h) float64, mm
        Vertices: h triples of coordinates, each of which has to keep the radius by itself: tips alone (h = 1), or tips
        and axis points (h = 2). At least one vertex each.
    radius : float, mm
    gate : (m + 1,) float64, mm, optional
        Radius at vertices of the path, where that is smaller.
    own_bend, path_bend : (n - 1,), (m,) float64, mm, optional
        By how much the motions may leave each segment: an eighth of the largest second derivative by its fraction.
        They are proved to be within the radius, not their chords.
    chunk : int
        Own vertices that are looked at together; the verdict does not depend on it.

    Returns
    -------
    Passage
        ``passed`` is a proof. Time is about linear: 0.2 µs for a vertex where the polylines are near, 20 µs where what
        can be reached has to be worked out.
    """
    if len(path) == 1:
        path, path_bend = np.repeat(path, 2, axis=0), None
        gate = None if gate is None else np.repeat(gate, 2)
    if len(own) == 1:
        found = passage(np.repeat(own, 2, axis=0), path, radius, gate=gate, path_bend=path_bend)
        return Passage(found.place[:1], tuple(replace(one, row=0) for one in found.breaks[:1]), found.whole)
    walk = Walk(Path.of(path, radius, gate=gate, bend=path_bend), radius)
    bend = np.zeros(len(own) - 1) if own_bend is None else own_bend
    place, breaks, whole = [], [], True
    for first in range(0, len(own) - 1, chunk):
        rows = slice(first, min(first + chunk, len(own) - 1) + 1)
        sections = Sections.whole(rows.stop - rows.start - 1, len(path) - 1, open_end=rows.stop < len(own))
        part = walk.take(own[rows], bend[rows.start : rows.stop - 1], sections)
        place.append(part.place[1 if first else 0 :])
        breaks += [replace(one, row=one.row + first) for one in part.breaks]
        whole = whole and part.whole
        if not whole:
            place.append(np.full(len(own) - rows.stop, np.nan))
            break
    return Passage(np.concatenate(place), tuple(breaks), whole)


@dataclass
class Walk:
    """Goes along a path as the own motion comes in, chunk by chunk.

    Parameters
    ----------
    path : Path
    radius : float, mm
    """

    path: Path
    radius: float
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

    def _meets(self, row: int, place: float) -> bool:
        """Whether a vertex is near a place of the path, or within the gate at its vertex."""
        off = largest_square(self.own[row] - points_at(self.path.points, np.array([place]))[:, 0])
        limit = self.path.gate[int(place)] if place == int(place) else self.radius
        return bool(off <= float(limit) ** 2)

    def _go_on(self, section: int, inner: Inner | None) -> int:
        """Go on from the first vertex of a section; return the section to go on with."""
        row, begin = int(self.first[section]), float(self.begin[section])
        if np.isnan(begin):  # the motion has not come back to the path yet
            return self._resume(section, row)
        if np.isnan(self.place[row]) and not self._meets(row, begin):
            return self._break(section, Break(row, begin, True))
        while True:
            sections = Sections(self.first, self.ends, self.begin, self.stop, self.open)
            columns = np.ascontiguousarray(self.own[row:].T)
            rest = sections.behind(section, row, begin)
            found = chain(columns, self.bend[row:], self.path, self.radius, rest)
            for end, stop in zip(rest.last[: -1 if self.open else None], rest.stop, strict=False):
                if self.path.gate[int(stop)] < self.radius:
                    found.bad[end] |= not self._meets(row + int(end), float(stop))
            bad = np.flatnonzero(found.bad) + row
            if not len(bad) or inner is None or not self._divide(row, bad, inner):
                break
        _, inside = rest.of(np.arange(len(found.place)))
        self.place[row:] = np.where(found.bad | ~inside, np.nan, found.place)
        guess = np.concatenate((self.place[:row], found.place))
        while len(bad):
            one = int(np.searchsorted(self.first, bad[0], side="right")) - 1
            gaps = np.flatnonzero(np.diff(bad) > LOOK_BACK[0])
            last = min(int(bad[gaps[0] if len(gaps) else -1]), int(self.ends[one]))
            end = self._repair(one, int(bad[0]), last, guess)
            if isinstance(end, Break):
                return self._break(one, end)
            bad = bad[bad > end]
        return len(self.first)

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

    def _repair(self, section: int, first: int, last: int, guess: Floats) -> int | Break:
        """Work out exactly how to come past some vertices; return one after them that has a place."""
        known, stop = int(self.known[section]), float(self.stop[section])
        end, top = int(self.ends[section]), int(stop)
        unfinished = self.open and section == len(self.first) - 1
        if first == known:
            return Break(first, float(self.begin[section]), True)
        reached: list[Reached] = []
        begin, proved = first, False
        for back in LOOK_BACK:
            begin = max(first - back, known, 0)
            until = end if back > _SOON else min(last + _SOON, end)
            space = self._space(slice(begin, until + 1), top)
            reached = [space.along(0, float(self.place[begin]))]
            for row, here in space.sweep(0, reached[0]):
                reached.append(here)
                at = begin + row
                if not here:
                    break
                if last < at < end and not np.isnan(self.place[at]) and holds(here, float(guess[at]), top - 1):
                    return self._settle(space, begin, reached, float(guess[at]))
            else:
                if until == end and unfinished:
                    return self._settle(space, begin, reached, lowest(reached[-1]))
                if until == end and holds(reached[-1], stop, top - 1) and self._meets(end, stop):
                    return self._settle(space, begin, reached, stop)
                if until < end:
                    continue
                reached.append({})  # the end is not
            proved = begin == known or self._all_known(space, reached, self.begin[section])
            if proved or begin == 0:
                break
        highest = max(reached[-2])
        return Break(min(begin + len(reached) - 1, end), highest + reached[-2][highest][1], proved)

    def _space(self, rows: slice, top: int) -> FreeSpace:
        """Rows against the path up to a vertex."""
        path = self.path
        own, bend = self.own[rows].T, self.bend[rows.start : rows.stop - 1]
        return FreeSpace(own, path.points[: top + 1].T, self.radius, bend, path.bend[:top], path.gate[: top + 1])

    def _settle(self, space: FreeSpace, begin: int, reached: list[Reached], place: float) -> int:
        """Give vertices the first places from which another place of the last of them can be reached."""
        end = begin + len(reached) - 1
        self.place[begin : end + 1] = [lowest(one) for one in space.between(reached, place)]
        self.place[end] = place
        return end

    def _all_known(self, space: FreeSpace, reached: list[Reached], start: float) -> bool:
        """Whether all that is free of one of some rows was reached."""
        length, top = self.path.length, space.path.shape[1] - 1
        for row in range(len(reached) - 1, -1, -1):
            if reached[row]:
                here, beyond = length[min(reached[row])], AROUND * self.radius
                low, high = np.searchsorted(length, (here - beyond, here + beyond)).tolist()
                if is_all(space, row, reached[row], slice(max(low - 1, int(start), 0), min(high + 1, top))):
                    return True
        return False

    def _break(self, section: int, found: Break) -> int:
        """Take down a break, and find where to go on: the section that it is in."""
        row = found.row
        self.breaks.append(replace(found, row=int(np.ceil(self.number[row]))))
        self.left = found.place
        if len(self.breaks) >= self.most:
            self.whole = False
        self.place[row:] = np.nan
        return self._resume(section, row)

    def _resume(self, section: int, row: int) -> int:
        """Go on with the first vertex from one on that is near the path again, or with the next section.

        It gets a place: the nearest to where the path was left.
        """
        path, end = self.path, int(self.ends[section])
        bottom, top = int(np.nan_to_num(self.begin[section])), int(self.stop[section])
        left = path.length_at(self.left)
        for width, rows in ((AROUND, 64), (AROUND * AROUND, 4)):
            low, high = np.searchsorted(path.length, (left - width * self.radius, left + width * self.radius)).tolist()
            segments = slice(max(low - 1, bottom), min(high + 1, top, low + _WIDEST))
            if segments.start >= segments.stop:
                continue
            start = path.points[segments].T
            way = path.points[segments.start + 1 : segments.stop + 1].T - start
            for k in range(row, min(row + rows, end)):
                bend = self.bend[max(k - 1, 0) : k + 1].max(initial=0.0)
                at, other = free_interval(self.own[k][:, None], start, way, self.radius - bend - path.bend[segments])
                free = np.flatnonzero(at <= other)
                if len(free):
                    place = segments.start + free + np.clip(self.left - segments.start - free, at[free], other[free])
                    return self._begin_at(section, k, float(place[np.argmin(np.abs(place - self.left))]))
        columns = np.ascontiguousarray(self.own[row : end + 1].T)
        for k, place in near_places(columns, path, self.radius, self.left, top):
            if row + k < end:
                return self._begin_at(section, row + k, place)
        self.place[end] = np.nan
        return section + 1

    def _begin_at(self, section: int, row: int, place: float) -> int:
        self.first[section] = self.known[section] = row
        self.begin[section] = self.place[row] = place
        return section
