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

from cornersmooth.model import Floats
from cornersmooth.verify.chain import Path, Sections, chain, points_at
from cornersmooth.verify.free_space import FINE, Around, Inner, free_interval, lowest
from cornersmooth.verify.motions import largest_square

#: rows before one that is not proved from which on it is worked out exactly, one after the other; farther back nothing
#: is looked at, and the answer is NOT VERIFIED
LOOK_BACK: Final = (3, 32, 256, 2048)

#: rows within which the first two of them must come back to the chain (speed only)
_SOON: Final = 64

#: radii of path length around a break where it is looked for what is off, and where to go on (which faults are named)
AROUND: Final = 200.0

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
        most: int = MOST_BREAKS,
    ) -> None:
        self.path, self.radius, self._inner = path, radius, inner
        self.breaks: list[Break] = []  #: where the motions part; nothing is looked at after `most`
        self._own, self._bend = own, bend
        #: (n,) a place on the path, segment plus fraction, for every vertex, ascending: the motions can be run beside
        #: each other through all of them. NaN where there is none, from a break on
        self.place = np.full(len(own), np.nan)
        # the first vertices are those that are not decided, and begin at these places
        self._sections = replace(sections, first=sections.first.copy(), start=sections.start.copy())
        self._left = 0.0  # last place that was reached before a break
        section = 0
        while section < len(self._sections.first) and len(self.breaks) < most:
            section = self._go_on(section)

    def _meets(self, row: int, place: float) -> bool:
        """Whether a vertex is near a place of the path."""
        off = largest_square(self._own[row] - points_at(self.path.points, np.array([place]))[:, 0])
        return bool(off <= self.radius**2)

    def _go_on(self, section: int) -> int:
        """Find places for vertices from the first of a section on, or a break; return the section to go on with."""
        row, begin = int(self._sections.first[section]), float(self._sections.start[section])
        if np.isnan(self.place[row]) and not self._meets(row, begin):
            return self._break(section, Break(row, begin, not self._sections.guessed[section]))
        sections = self._sections.behind(section, row, begin)
        own = np.ascontiguousarray(self._own[row:].T)
        place, unproved = chain(own, self._bend[row:], self.path, self.radius, sections)
        self.place[row:] = np.where(unproved | ~sections.of(np.arange(len(place)))[1], np.nan, place)
        bad = row + np.flatnonzero(unproved)
        while len(bad):
            one = int(np.searchsorted(self._sections.first, bad[0], side="right")) - 1
            gaps = np.flatnonzero(np.diff(bad) > LOOK_BACK[0])
            last = min(int(bad[gaps[0] if len(gaps) else -1]), int(bad[0]) + _SOON, int(self._sections.last[one]))
            found = self._repair(one, int(bad[0]), last)
            if isinstance(found, Break):
                return self._break(one, found)
            bad = bad[bad > found]
        return len(self._sections.first)

    def _repair(self, section: int, first: int, last: int) -> int | Break:
        """Work out exactly how to come past some vertices; return one after them that has a place."""
        known, end, stop = (
            int(self._sections.first[section]),
            int(self._sections.last[section]),
            float(self._sections.stop[section]),
        )
        sure = not self._sections.guessed[section]
        if first == known:
            return Break(first, float(self._sections.start[section]), sure)
        found = Break(first, float(self.place[first - 1]), False)
        for back in LOOK_BACK[: 2 if self.breaks else None]:
            begin = max(first - back, known)
            until = end if back > _SOON else min(last + _SOON, end)
            rows, steps = slice(begin, until + 1), slice(begin, until)
            own, top = (self._own[rows], self._bend[steps], begin), self._within_reach(begin, until, stop)
            for fine in FINE:
                around = Around.of(own, self.path, self.radius, float(self.place[begin]), top, self._inner, fine)
                goal = around.goal(self.place[rows], last - begin, math.nan if until < end else stop)
                if goal is not None:
                    return self._settle(begin, around, goal)
            if not around.reached[0] and begin > known:  # what bends take off leaves nothing of that place
                continue
            if around.reached[-1] and until < end:
                continue
            reached = begin + around.row_reached
            row = max(reached, first)  # the chain has proved what is before that
            proved = begin == known or not self._is_near(reached, known, top)
            found = Break(row, around.farthest(), sure and proved and row == reached)
            if proved:
                break
        return found

    def _is_near(self, row: int, known: int, top: int) -> bool:
        """Whether a vertex may be near a place up to a vertex of the path, and not before that of an earlier one."""
        bottom = min(int(self.place[known]), top - 1)
        start = self.path.points[bottom:top].T
        way = self.path.points[bottom + 1 : top + 1].T - start
        low, high = free_interval(self._own[row][:, None], start, way, np.asarray(self.radius))
        return bool((low <= high).any())

    def _within_reach(self, begin: int, until: int, stop: float) -> int:
        """Vertex of the path before which some rows end, if they run beside it."""
        path = self.path
        step = np.diff(self._own[begin : until + 1], axis=0)
        gone = float(np.sqrt(np.einsum("ij,ij->i", step, step)).sum())
        length = path.length_at(float(self.place[begin])) + LONGER * gone + AROUND * self.radius
        return min(int(np.searchsorted(path.length, length)) + 1, max(math.ceil(stop), 1))

    def _settle(self, begin: int, around: Around, goal: float) -> int:
        """Give vertices the first places from which another place, of the last row reached, can be reached."""
        between = around.space.between(around.reached, around.inward(goal))
        count = int(np.searchsorted(around.at, len(between)))
        end = begin + count - 1
        self.place[begin : end + 1] = [around.outward(lowest(between[k])) for k in around.at[:count].tolist()]
        self.place[end] = goal
        return end

    def _break(self, section: int, found: Break) -> int:
        """Take down a break, and find where to go on: the section that it is in, or the next."""
        self.breaks.append(found)
        self._left = found.place
        self.place[found.row :] = np.nan
        return self._resume(section, found.row)

    def _resume(self, section: int, row: int) -> int:
        """Go on with a vertex from one on that is near the path again, or with the next section.

        It gets a place: the nearest to where the path was left.
        """
        path, end, left = self.path, int(self._sections.last[section]), self.path.length_at(self._left)
        bottom, top = int(self._sections.start[section]), math.ceil(self._sections.stop[section])
        tried = row + np.unique(np.geomspace(1, max(end - row, 1), _TRIED).astype(np.int64)) - 1
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
                    self._sections.first[section] = k
                    self._sections.start[section] = self.place[k] = place[np.argmin(np.abs(place - self._left))]
                    return section
        self.place[end] = np.nan
        return section + 1
