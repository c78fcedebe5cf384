"""Where along the CL path written vertices may be if both motions are run in order and never leave the tolerance.

Where the path goes to and fro by less than the tolerance a text may stand for any of its turns, and the place that is
found for a vertex is one of many. All of them are found here: two polylines are run in order within a distance r if a
monotone curve leads through the free space of their diagram, whose cells are pairs of segments and whose free part is
where they are within r of each other (Alt and Godau, "Computing the Fréchet distance between two polygonal curves",
1995). What is reached forwards from the one end and backwards from the other is where a vertex may be.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import distance_between, nearest_places

#: how far on either side of a vertex the motions are followed, in `Match.near`; halved so often if that is too much
AROUND: Final = 32.0
_HALVED: Final = 6

#: vertices beyond that among which the one nearest to its place is where they are followed from
_ANCHORS: Final = 32

#: pairs of a written and an original segment that are looked at, at most
MOST_PAIRS: Final = 100_000

#: windows of a batch that may be out of order, tips and axis points alone too, before no more are looked at
_MOST_FAILED: Final = 8


@dataclass(frozen=True)
class Window:
    """Places that the vertices of a piece of the text may have; n vertices, m segments.

    Parameters
    ----------
    vertex, segment : int
        The first of each.
    inner : (int, int)
        First and last vertex that are far enough from the ends, where places are taken to be known.
    places : (float, float)
        Of the first and the last vertex, in segments from the first.
    low, high : (n, m) float64
        First and last fraction of a segment at which a vertex may be; NaN where it may not be on it.
    alone : bool
        Whether tips and axis points are each run in order within the tolerance, if only on their own.
    """

    vertex: int
    segment: int
    inner: tuple[int, int]
    places: tuple[float, float]
    low: Floats
    high: Floats
    alone: bool = True

    @property
    def passed(self) -> bool:
        """Whether the whole piece is run in order within the tolerance."""
        return bool((~np.isnan(self.low)).any(axis=1).all())

    def segments(self, vertex: int) -> Ints:
        """Segments of the CL path that a vertex may be on, ascending."""
        return self.segment + np.flatnonzero(~np.isnan(self.low[vertex - self.vertex]))

    def may_be_at(self, vertex: int, pose: Ints) -> Bools:
        """(k,) whether a vertex may be at vertices of the CL path."""
        low, high = self.low[vertex - self.vertex], self.high[vertex - self.vertex]
        ends = np.zeros(len(low) + 1, np.bool_)
        ends[:-1] |= low == 0.0
        ends[1:] |= high == 1.0
        inside = (pose >= self.segment) & (pose <= self.segment + len(low))
        found: Bools = inside & ends[np.clip(pose - self.segment, 0, len(low))]
        return found


class Windows:
    """The pieces of a batch around vertices that are asked for; one piece answers for all that are well inside it."""

    def __init__(self, match: Match) -> None:
        self.match = match
        self.known: list[Window] = []
        self.failed = 0
        #: vertices whose order was asked for and not looked at
        self.unlooked: list[int] = []
        self.length = match.path.length_at(match.segment, match.fraction)

    def around(self, vertex: int) -> Window | None:
        """Return the piece around a vertex; None where it is too long, or too many have failed."""
        for window in self.known:
            if window.inner[0] <= vertex <= window.inner[1]:
                return window
        if self.failed >= _MOST_FAILED or not self.match.on[vertex]:
            return None
        found = self._of(vertex)
        self.failed += found is not None and not found.alone
        self.known += [] if found is None else [found]
        return found

    def disordered(self, vertex: int) -> Window | None:
        """Return the piece around a vertex where not even tips and axis points are in order, each on its own."""
        found = self.around(vertex)
        if found is None:
            self.unlooked.append(vertex)
        return None if found is None or found.alone else found

    def _of(self, vertex: int) -> Window | None:
        match, length = self.match, self.length
        begin, end = np.flatnonzero(match.stretch == match.stretch[vertex])[[0, -1]].tolist()
        own, goal = length[begin : end + 1], int(match.high[end]) + 1
        around = AROUND * match.near
        for _ in range(_HALVED):
            low, high = length[vertex] - around, length[vertex] + around
            first = self._anchor(begin + int(np.searchsorted(own, low)) - _ANCHORS, begin, vertex)
            last = self._anchor(begin + int(np.searchsorted(own, high, side="right")), vertex, end)
            segment, place = int(match.segment[first]), float(match.place[last])
            if last == end and match.until == np.inf:  # with it the way ends, wherever else it may be near
                off = distance_between(match.six[[last]], match.path.six[[goal]])[0]
                place = float(goal) if off <= match.near else place
            stop = max(int(np.ceil(place)), segment + 1)
            if (last - first) * (stop - segment) <= MOST_PAIRS:
                break
            around /= 2.0
        else:
            return None
        if last <= first:
            return None
        inner = begin + np.searchsorted(own, [length[vertex] - around / 2.0, length[vertex] + around / 2.0])
        inner[0] = begin if first == begin else max(inner[0], first)
        inner[1] = end if last == end else min(inner[1], last)
        places = float(match.fraction[first]), place - segment
        own, path = match.six[first : last + 1], match.path.six[segment : stop + 1]
        found = passage(own, path, places, match.tolerance + match.slack)
        window = Window(first, segment, (int(inner[0]), int(inner[1])), places, *found)
        return window if window.passed else replace(window, alone=self._each_alone(own, path))

    def _each_alone(self, own: Floats, path: Floats) -> bool:
        """Whether tips and axis points are each run in order within the tolerance, on their own."""
        match, ends = self.match, np.array([0, len(path) - 2])
        for column in ((0, 1, 2, 0, 1, 2), (3, 4, 5, 3, 4, 5)):
            mine, theirs = own[:, column], path[:, column]
            _, at, square = nearest_places(mine[[0, -1]], theirs, ends, 0, ends, ends)
            off = float(np.sqrt(square.max() / 2.0))
            low, _ = passage(mine, theirs, (at[0], ends[1] + at[1]), max(match.tolerance, off) + match.slack)
            if np.isnan(low).all(axis=1).any():
                return False
        return True

    def _anchor(self, first: int, low: int, high: int) -> int:
        """Vertex from `first` on, from `low` to `high`, that is nearest to its place; an end where that is reached."""
        if first <= low:
            return low
        if first + _ANCHORS > high:
            return high
        return first + int(np.argmin(self.match.distance[first : first + _ANCHORS]))


def passage(own: Floats, path: Floats, places: tuple[float, float], radius: float) -> tuple[Floats, Floats]:
    """First and last fractions (n, m) of segments of a path (m + 1, 6) at which vertices (n, 6) may be.

    The first vertex is at the first of two places (segment plus fraction), the last one at the other.
    """
    across = _free(own, path, radius)
    along = tuple(part.T for part in _free(path, own, radius))
    low = _reached(across, (along[0], along[1]), places[0])
    back = tuple(1.0 - part[::-1, ::-1] for part in across[::-1])
    back_along = tuple(1.0 - part[::-1, ::-1] for part in along[::-1])
    high = 1.0 - _reached((back[0], back[1]), (back_along[0], back_along[1]), len(path) - 1 - places[1])[::-1, ::-1]
    neither = ~(low <= high)
    low[neither] = high[neither] = np.nan
    return low, high


def _free(points: Floats, path: Floats, radius: float) -> tuple[Floats, Floats]:
    """First and last fraction (k, m) of segments within the radius of points (k, 6), at tip and axis point; or NaN."""
    way = path[1:] - path[:-1]
    low, high = np.zeros((len(points), len(way))), np.ones((len(points), len(way)))
    for column in (slice(0, 3), slice(3, 6)):
        step, start = way[:, column], path[:-1, column]
        size = np.einsum("ij,ij->i", step, step)
        towards = points[:, column] @ step.T - np.einsum("ij,ij->i", start, step)
        rest = points[:, None, column] - start
        square = np.einsum("kmi,kmi->km", rest, rest) - radius**2
        root = np.sqrt(np.maximum(towards**2 - size * square, 0.0))
        stands = size == 0.0
        divisor = np.where(stands, 1.0, size)
        outside = np.where(stands, square > 0.0, towards**2 < size * square)
        low = np.maximum(low, np.where(outside, np.inf, np.where(stands, 0.0, (towards - root) / divisor)))
        high = np.minimum(high, np.where(outside, -np.inf, np.where(stands, 1.0, (towards + root) / divisor)))
    none = ~(low <= high)
    low[none] = high[none] = np.nan
    return low, high


def _reached(across: tuple[Floats, Floats], along: tuple[Floats, Floats], start: float) -> Floats:
    """First fraction (n, m) of each segment at which each vertex is reached from a place of the first one; or NaN.

    Parameters
    ----------
    across : of (n, m) float64
        Free part of segments at vertices.
    along : of (n − 1, m + 1) float64
        Free part of what joins vertices at those of the path.
    start : float
    """
    (low, high), found = across, np.full_like(across[0], np.nan)
    first = min(int(start), low.shape[1] - 1)
    if low[0, first] <= start - first + _HAIR and start - first - _HAIR <= high[0, first]:
        found[0, first] = min(max(start - first, low[0, first]), high[0, first])
    # at the first vertex only the place is known, and what the path may run through from there on
    for j in range(first + 1, low.shape[1]):
        if np.isnan(found[0, j - 1]) or high[0, j - 1] < 1.0 or not low[0, j] <= 0.0:
            break
        found[0, j] = 0.0
    for i in range(len(low) - 1):
        here, row, free_low, free_high = found[i].tolist(), found[i + 1], low[i + 1].tolist(), high[i + 1].tolist()
        lows, highs = along[0][i].tolist(), along[1][i].tolist()
        below = np.nan  # first fraction of the written segment at which it is at the path's vertex j
        for j, reached in enumerate(here):
            if below == below:  # not NaN
                row[j] = free_low[j]
            elif reached <= free_high[j]:
                row[j] = max(free_low[j], reached)
            if reached == reached:
                below = lows[j + 1]
            elif below == below:
                below = max(below, lows[j + 1]) if max(below, lows[j + 1]) <= highs[j + 1] else np.nan
    return found


#: what arithmetic may make of a fraction
_HAIR: Final = 1e-9
