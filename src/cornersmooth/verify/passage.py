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
from cornersmooth.verify.chain import Path, chain, near_places
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
    walk = Walk.along(path, radius, gate=gate, bend=path_bend)
    bend = np.zeros(max(len(own) - 1, 0)) if own_bend is None else own_bend
    place, breaks, whole = [], [], True
    for first in range(0, max(len(own) - 1, 1), chunk):
        rows = slice(first, min(first + chunk, len(own) - 1) + 1)
        part = walk.take(own[rows], bend[rows.start : rows.stop - 1], final=rows.stop == len(own))
        place.append(part.place[1 if first else 0 :])
        breaks += [replace(one, row=one.row + first) for one in part.breaks]
        whole = whole and part.whole
        if not whole:
            place.append(np.full(len(own) - rows.stop, np.nan))
            break
    return Passage(np.concatenate(place), tuple(breaks), whole)


@dataclass
class Walk:
    """Goes along a path as the own motion comes in, chunk by chunk; begins at the start of the path.

    Parameters
    ----------
    path : Path
    radius : float, mm
    """

    path: Path
    radius: float
    _own: Floats | None = None  #: (k, 3h) last vertices, to look back on
    _bend: Floats = field(default_factory=lambda: np.zeros(0))
    _place: Floats = field(default_factory=lambda: np.zeros(0))
    _known: int = 0  #: row of them at whose place and nowhere else the motion begins; -1: forgotten
    _left: float = 0.0  #: last place that was reached before a break
    _breaks: int = 0  #: how many so far

    @classmethod
    def along(cls, path: Floats, radius: float, *, gate: Floats | None = None, bend: Floats | None = None) -> Walk:
        """Begin; as of `passage`."""
        if len(path) == 1:
            path, bend = np.repeat(path, 2, axis=0), None
            gate = None if gate is None else np.repeat(gate, 2)
        step = path[1:] - path[:-1]
        length = np.zeros(len(path))
        np.cumsum(np.sqrt(np.einsum("ij,ij->i", step, step)), out=length[1:])
        limit = np.full(len(path), radius) if gate is None else np.minimum(gate, radius)
        return cls(Path(path, length, np.zeros(len(path) - 1) if bend is None else bend, limit), radius)

    def take(self, own: Floats, bend: Floats, *, final: bool, inner: Inner | None = None) -> Passage:
        """Go on.

        Parameters
        ----------
        own : (n, 3h) float64, mm
            The next vertices; from the second time on the first of them is the last of those before.
        bend : (n - 1,) float64, mm
        final : bool
            Whether there are no more: the last one has to come to the end of the path.
        inner : callable, optional
            Gives more points of bent steps; vertices are counted in `own`.

        Returns
        -------
        Passage
            Of these vertices.
        """
        if len(own) == 1 and self._own is None:
            if not final:
                raise ValueError("the first chunk of a motion has one vertex only")
            found = self.take(np.repeat(own, 2, axis=0), np.zeros(1), final=True)  # it stands still
            return Passage(found.place[:1], tuple(replace(one, row=0) for one in found.breaks[:1]), found.whole)
        part = _Part(self, own, bend, final=final)
        part.decide(inner)
        kept = max(part.last - LOOK_BACK[-1], 0)
        self._own, self._bend, self._place = part.own[kept:], part.bend[kept:], part.place[kept:]
        self._known, self._left = max(part.known - kept, -1), part.left
        self._breaks += len(part.breaks)
        given = part.number[part.start :] == np.floor(part.number[part.start :])
        return Passage(part.place[part.start :][given], tuple(part.breaks), part.whole)


class _Part:
    """The last vertices of what was looked at before, and those of a chunk."""

    def __init__(self, walk: Walk, own: Floats, bend: Floats, *, final: bool) -> None:
        self.path, self.radius, self.final = walk.path, walk.radius, final
        self.start, self.known, self.left = 0, walk._known, walk._left
        self.begins = walk._own is None
        if walk._own is None:
            self.own, self.bend = own, bend
            self.place = np.full(len(own), np.nan)
        else:
            self.start = len(walk._own) - 1
            self.own, self.bend = np.concatenate((walk._own, own[1:])), np.concatenate((walk._bend, bend))
            self.place = np.concatenate((walk._place, np.full(len(own) - 1, np.nan)))
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
        """Find places for all vertices, or breaks."""
        row: int | None = self.start
        if self.begins:
            if self._meets(0, 0):
                self.place[0] = 0.0
            else:
                row = self._break(0, 0.0, proved=True)
        elif np.isnan(self.place[self.start]):
            row = self._resume(self.start)
        while row is not None and row < self.last:
            row = self._go_on(row, inner)

    def _meets(self, row: int, vertex: int) -> bool:
        """Whether a vertex is near one of the path."""
        off = largest_square(self.own[row] - self.path.points[vertex])
        return bool(off <= float(self.path.gate[vertex]) ** 2)

    def _go_on(self, row: int, inner: Inner | None) -> int | None:
        """Go on from a vertex that has a place; return the next to go on from, or None where there is none."""
        while True:
            columns = np.ascontiguousarray(self.own[row:].T)
            found = chain(columns, self.bend[row:], self.path, self.radius, float(self.place[row]), final=self.final)
            if self.final:
                found.bad[-1] |= not self._meets(-1, -1)
            bad = np.flatnonzero(found.bad) + row
            if not len(bad) or inner is None or not self._divide(row, bad, inner):
                break
        self.place[row:] = np.where(found.bad, np.nan, found.place)
        guess = np.concatenate((self.place[:row], found.place))
        while len(bad):
            gaps = np.flatnonzero(np.diff(bad) > LOOK_BACK[0])
            end = self._repair(int(bad[0]), int(bad[gaps[0] if len(gaps) else -1]), guess)
            if isinstance(end, Break):
                return self._break(end.row, end.place, proved=end.proved)
            bad = bad[bad > end]
        return self.last

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
        bend = self.bend.copy()
        bend[steps] /= PARTS**2
        self.bend = np.insert(bend, at, bend[np.repeat(steps, PARTS - 1)])
        return True

    def _repair(self, first: int, last: int, guess: Floats) -> int | Break:
        """Work out exactly how to come past some vertices; return one after them that has a place."""
        stop = first
        reached: list[Reached] = []
        begin, proved, end = first, False, self.path.segments - 1
        for back in LOOK_BACK:
            begin = max(first - back, self.known, 0)
            stop = self.last if back > _SOON else min(last + _SOON, self.last)
            space = self._space(slice(begin, stop + 1))
            reached = [space.along(0, float(self.place[begin]))]
            for row, here in space.sweep(0, reached[0]):
                reached.append(here)
                at = begin + row
                if not here:
                    break
                if at > last and not np.isnan(self.place[at]) and holds(here, float(guess[at]), end):
                    return self._settle(space, begin, reached, float(guess[at]))
            else:
                if stop == self.last and not self.final:
                    return self._settle(space, begin, reached, lowest(reached[-1]))
                if stop == self.last and holds(reached[-1], end + 1.0, end) and self._meets(-1, -1):
                    return self._settle(space, begin, reached, float(self.path.segments))
                if stop < self.last:
                    continue
                reached.append({})  # the end is not
            proved = begin == self.known or self._all_known(space, reached)
            if proved or begin == 0:
                break
        top = max(reached[-2])
        return Break(min(begin + len(reached) - 1, self.last), top + reached[-2][top][1], proved)

    def _space(self, rows: slice) -> FreeSpace:
        path = self.path
        own, bend = self.own[rows].T, self.bend[rows.start : rows.stop - 1]
        return FreeSpace(own, path.points.T, self.radius, bend, path.bend, path.gate)

    def _settle(self, space: FreeSpace, begin: int, reached: list[Reached], place: float) -> int:
        """Give vertices the first places from which another place of the last of them can be reached."""
        end = begin + len(reached) - 1
        self.place[begin : end + 1] = [lowest(one) for one in space.between(reached, place)]
        self.place[end] = place
        return end

    def _all_known(self, space: FreeSpace, reached: list[Reached]) -> bool:
        """Whether all that is free of one of some rows was reached."""
        length = self.path.length
        for row in range(len(reached) - 1, -1, -1):
            if reached[row]:
                here, beyond = length[min(reached[row])], AROUND * self.radius
                low, high = np.searchsorted(length, (here - beyond, here + beyond)).tolist()
                if is_all(space, row, reached[row], slice(max(low - 1, 0), min(high + 1, self.path.segments))):
                    return True
        return False

    def _break(self, row: int, place: float, *, proved: bool) -> int | None:
        """Take down a break, and find where to go on."""
        self.breaks.append(Break(int(np.ceil(self.number[row])), place, proved))
        self.left = place
        if len(self.breaks) >= self.most:
            self.whole = False
            return None
        self.place[row:] = np.nan
        return self._resume(row)

    def _resume(self, row: int) -> int | None:
        """First vertex from one on that is near the path again: it gets a place, the nearest to where it was left."""
        path = self.path
        left = path.length_at(self.left)
        for width, rows in ((AROUND, 64), (AROUND * AROUND, 4)):
            low, high = np.searchsorted(path.length, (left - width * self.radius, left + width * self.radius)).tolist()
            segments = slice(max(low - 1, 0), min(high + 1, path.segments, low + _WIDEST))
            stop = min(row + rows, self.last + 1)
            space = self._space(slice(row, stop)) if stop - row > 1 else self._space(slice(row - 1, stop))
            start = space.path[:, segments]
            way = space.path[:, segments.start + 1 : segments.stop + 1] - start
            for k in range(row, stop):
                one = k - stop
                radius = space.row_radius(slice(space.own.shape[1] + one, space.own.shape[1] + one + 1), segments)[0]
                at, other = free_interval(space.own[:, one, None], start, way, radius)
                free = np.flatnonzero(at <= other)
                if len(free):
                    place = segments.start + free + np.clip(self.left - segments.start - free, at[free], other[free])
                    return self._begin_at(k, float(place[np.argmin(np.abs(place - self.left))]))
        columns = np.ascontiguousarray(self.own[row:].T)
        for k, place in near_places(columns, path, self.radius, self.left):
            return self._begin_at(row + k, place)
        return None

    def _begin_at(self, row: int, place: float) -> int:
        self.known, self.place[row] = row, place
        return row
