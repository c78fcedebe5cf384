"""The free space of two polylines: which pairs of places are near each other, and which of them can be reached.

A *row* is a vertex of the own polyline against all places of the path; a *cell* is a segment of one against a segment
of the other. What is free of a cell is convex, so what can be reached of it is known from its edges (Alt and Godau,
Computing the Fréchet distance between two polygonal curves, 1995).

Points are columns of arrays (3h, ...): h triples, each of which has to keep the radius on its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.chain import Path
from cornersmooth.verify.motions import parts_of

#: what is reached of a row: by segment of the path the lowest and the highest fraction
Reached: TypeAlias = dict[int, tuple[float, float]]

#: speed only: rows whose edges are worked out together, segments of them up to which that is worth while, and segments
#: that are worked out beyond those reached
_ROWS, _NARROW, _AHEAD = 32, 128, 32

#: fraction of a segment by which two ways of working out the same place may differ
_HAIR = 1e-9

#: share by which the radius is wider where it is looked which of the reached places lead on
_WIDER = 1.0 + 1e-6

#: bend of steps where what can be reached is worked out exactly, in radii: it is taken off the radius; and the most
#: parts of a step there
FINE: Final = 1e-5
_MOST_PARTS: Final = 256

#: gives points (k, 3h) of the own motion at vertex numbers (k,) with fractions of the steps behind them
Inner = Callable[[Floats], Floats]

#: edges of a row of cells: from fraction, to fraction, by column; nothing is free where the first is the larger
_Edges: TypeAlias = tuple[list[float], list[float], list[float], list[float]]


def free_interval(point: Floats, start: Floats, way: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Fractions of segments at which every triple is within a radius of a point; the first is larger where none is.

    Points, starts and ways of segments are (3h, ...), radii (...), mm. Nothing is within a negative one.
    """
    square = np.where(radius < 0.0, -1.0, radius * radius)
    low, high = np.asarray(0.0), np.asarray(1.0)
    for c in range(0, len(way), 3):
        own, away = way[c : c + 3], point[c : c + 3] - start[c : c + 3]
        size = np.einsum("i...,i...->...", own, own)
        safe = np.where(size > 0.0, size, 1.0)
        foot = np.einsum("i...,i...->...", own, away) / safe
        rest = away - foot * own  # from the foot point: no difference of large squares
        left = square - np.einsum("i...,i...->...", rest, rest)
        half = np.where(size > 0.0, np.sqrt(np.maximum(left, 0.0) / safe), np.inf)
        low = np.where(left < 0.0, np.inf, np.maximum(low, foot - half))
        high = np.where(left < 0.0, -np.inf, np.minimum(high, foot + half))
    return low, high


@dataclass(frozen=True)
class FreeSpace:
    """Own polyline against path."""

    own: Floats  #: (3h, n) mm
    path: Floats  #: (3h, m + 1) mm
    radius: float  #: mm
    #: mm: how far the motions may leave these segments: it is taken off the radius
    own_bend: Floats
    path_bend: Floats

    def row_radius(self, row: slice, segments: slice) -> Floats:
        """(rows, segments) radius at which rows are free."""
        rows = np.arange(row.start, row.stop)
        last = self.own.shape[1] - 2
        bend = np.maximum(self.own_bend[np.clip(rows - 1, 0, last)], self.own_bend[np.clip(rows, 0, last)])
        return self.radius - bend[:, None] - self.path_bend[segments]

    def along(self, row: int, place: float) -> Reached:
        """What is reached of a row from one place of it on, if it is free: that, and what is beyond without a break."""
        first = min(int(place), self.path.shape[1] - 2)
        start, share = self.path[:, first:-1], place - first
        radius = self.row_radius(slice(row, row + 1), slice(first, first + start.shape[1]))[0]
        low, high = free_interval(self.own[:, row, None], start, self.path[:, first + 1 :] - start, radius)
        if not low[0] - _HAIR <= share <= high[0] + _HAIR:
            return {}
        high[0] = max(high[0], share)
        goes_on = (high[:-1] >= 1.0) & (low[1:] <= 0.0) & (high[1:] >= 0.0)
        count = len(high) if goes_on.all() else 1 + int(np.argmin(goes_on))
        found: Reached = {first - 1: (1.0, 1.0)} if place == first > 0 else {}
        found[first] = share, float(high[0])
        return found | {first + k: (0.0, end) for k, end in enumerate(high[1:count].tolist(), 1)}

    def sweep(self, row: int, reached: Reached) -> Iterator[tuple[int, Reached]]:
        """Go on from what is reached of a row; the last that is given out is the last row, or one with nothing."""
        count, last = self.path.shape[1] - 1, self.own.shape[1] - 1
        begin, first, stop = row, 0, 0
        edges: list[_Edges] = []
        while row < last and reached:
            low, top = min(reached), max(reached)
            if row - begin >= len(edges) or low < first or (top + 1 >= stop and stop < count):
                begin, first, stop = row, low, min(max(2 * top - low, top) + _AHEAD, count)
                edges = self._edges(row, first, stop)
            new: Reached = {}
            below: float | None = None
            k = low
            up_low, up_high, right_low, right_high = edges[row - begin]
            while k < count and (k <= top or below is not None):
                if k >= stop:
                    begin, stop = row, min(first + 2 * (stop - first), count)
                    edges = self._edges(row, first, stop)
                    up_low, up_high, right_low, right_high = edges[0]
                c, here = k - first, reached.get(k)
                if up_low[c] <= up_high[c]:
                    if below is not None:
                        new[k] = up_low[c], up_high[c]
                    elif here is not None and here[0] <= up_high[c]:
                        new[k] = max(up_low[c], here[0]), up_high[c]
                if right_low[c] > right_high[c]:
                    below = None
                elif here is not None:
                    below = right_low[c]
                elif below is not None:
                    below = max(below, right_low[c])
                    below = below if below <= right_high[c] else None
                k += 1
            row, reached = row + 1, new
            yield row, reached

    def _edges(self, row: int, first: int, stop: int) -> list[_Edges]:
        """What is free of the upper and of the right edge of cells in rows from one on, segments `first` to `stop`."""
        rows = _ROWS if stop - first <= _NARROW else 1
        rows = min(rows, self.own.shape[1] - 1 - row)
        segments, ahead = slice(first, stop), slice(row + 1, row + 1 + rows)
        start = self.path[:, None, segments]
        end = self.path[:, None, first + 1 : stop + 1]
        own = self.own[:, row : row + rows, None]
        upper = self.own[:, ahead, None]
        up = free_interval(upper, start, end - start, self.row_radius(ahead, segments))
        beside = np.append(self.path_bend[first + 1 : stop + 1], 0.0)[: stop - first]
        bend = np.maximum(self.path_bend[segments], beside)
        radius = self.radius - bend - self.own_bend[row : row + rows, None]
        right = free_interval(end, own, upper - own, radius)
        return list(zip(*(values.tolist() for values in (*up, *right)), strict=True))

    def between(self, rows: list[Reached], place: float) -> list[Reached]:
        """What of rows, forward from some place, can be reached, and from there the place in the last of them."""
        first, stop, last = min(map(min, rows)), max(map(max, rows)) + 1, len(rows) - 1
        # nothing is proved here, and what is free at one point only should not be lost by rounding
        own, path = self.own[:, last::-1], self.path[:, first : stop + 1][:, ::-1]
        bends = self.own_bend[:last][::-1], self.path_bend[first:stop][::-1]
        part, count = FreeSpace(own, path, self.radius * _WIDER, *bends), stop - first
        back = [part.along(0, count - (place - first))]
        back += [reached for _, reached in part.sweep(0, back[0])]
        found = []
        for forward, reached in zip(rows, reversed(back), strict=True):
            here: Reached = {}
            for k, (low, high) in forward.items():
                other = reached.get(count - 1 - (k - first))
                if other is not None and max(low, 1.0 - other[1]) <= min(high, 1.0 - other[0]) + _HAIR:
                    here[k] = max(low, 1.0 - other[1]), min(high, 1.0 - other[0])
            found.append(here)
        return found


def holds(reached: Reached, place: float, last: int) -> bool:
    """Whether a place is reached; a vertex of the path is where the segment behind it begins: it has been passed."""
    k = min(int(place), last)
    return k in reached and reached[k][0] <= place - k <= reached[k][1]


def lowest(reached: Reached) -> float:
    """First place that is reached; before the vertex at the end of a segment that is not passed."""
    k = min(reached)
    return min(k + reached[k][0], float(np.nextafter(k + 1.0, 0.0)))


@dataclass
class Around:
    """Some rows against a part of the path, both perhaps divided more finely, and what of them is reached."""

    space: FreeSpace
    at: Ints  #: (k,): where the rows are among those of the space
    places: Floats  #: (m + 1,): of the vertices of the space on the whole path
    start: float  #: the place of the first row
    reached: list[Reached] = field(default_factory=list)  #: row by row of the space, from that place on

    @classmethod
    def of(
        cls,
        rows: tuple[Floats, Floats, Floats],
        path: Path,
        radius: float,
        start: float,
        top: int,
        inner: Inner | None,
        fine: float,
    ) -> Around:
        """Rows against the path from the place of the first up to a vertex.

        They are vertices (k, 3h), the bends (k - 1,) of their steps, and their numbers (k,) for `Inner`. Bent steps and
        segments are divided until so `fine`, in radii, but no steps that are looked back on: of these nothing is known
        but their ends.
        """
        own, bend, number = rows
        base = min(int(start), top - 1)
        cl_side = parts_of(path.bend[base:top], fine * radius, _MOST_PARTS)
        known = np.zeros(len(bend)) if inner is None else np.where(number[:-1] < 0.0, 0.0, bend)
        nc_side = parts_of(known, fine * radius, _MOST_PARTS)
        at, places = np.append(0, np.cumsum(nc_side)), _divided(np.arange(base, top + 1), cl_side)
        points = np.empty((own.shape[1], at[-1] + 1))
        points[:, at] = own.T
        between = np.setdiff1d(np.arange(at[-1] + 1), at, assume_unique=True)
        if inner is not None and len(between):
            points[:, between] = inner(_divided(number, nc_side)[between]).T
        bends = np.repeat(bend / nc_side**2, nc_side), np.repeat(path.bend[base:top] / cl_side**2, cl_side)
        return cls(FreeSpace(points, path.at(places).T, radius, *bends), at, places, start)

    @property
    def row_reached(self) -> int:
        """The first row after the last of which something is reached; the last row if that is."""
        count = len(self.reached) - (not self.reached[-1])
        return min(int(np.searchsorted(self.at, count)), len(self.at) - 1)

    def inward(self, place: float) -> float:
        """A place of the whole path, counted here."""
        k = min(max(int(np.searchsorted(self.places, place, side="right")) - 1, 0), len(self.places) - 2)
        start, end = self.places[k : k + 2].tolist()
        return float(k + min((place - start) / (end - start), 1.0))

    def outward(self, place: float) -> float:
        """A place counted here, on the whole path; before a vertex that is not passed."""
        k = min(int(place), len(self.places) - 2)
        start, end = self.places[k : k + 2].tolist()
        there = start + (place - k) * (end - start)
        return float(min(there, np.nextafter(end, start)) if place < k + 1 else there)

    def goal(self, known: Floats, last: int, stop: float) -> float | None:
        """Go along the rows to one after the `last` that the chain does not prove, or to the end; None if that fails.

        Of the rows places (k,) by the chain are `known`, else NaN. The last row has to end at place `stop` of the
        path, at a known place if it is NaN.
        """
        final, end = len(self.places) - 2, len(self.at) - 1
        self.reached = [self.space.along(0, self.inward(self.start))]
        if not self.reached[0]:
            return None
        at = 1
        for row, here in self.space.sweep(0, self.reached[0]):
            self.reached.append(here)
            if not here:
                return None
            if row < self.at[at]:
                continue
            goes_on = last < at < end and self.places[0] <= known[at] <= self.places[-1]
            if goes_on and holds(here, self.inward(float(known[at])), final):
                return float(known[at])
            at = min(at + 1, end)
        there = stop <= self.places[-1] and holds(self.reached[-1], self.inward(stop), final)
        return stop if there else None

    def farthest(self) -> float:
        """Last place that was reached."""
        row = next((reached for reached in reversed(self.reached) if reached), None)
        if row is None:
            return self.start
        highest = max(row)
        return self.outward(highest + row[highest][1])


def _divided(values: Floats | Ints, parts: Ints) -> Floats:
    """Ascending values (n + 1,) with as many equal parts between neighbours (n,) as wanted."""
    at = np.append(0, np.cumsum(parts))
    return np.interp(np.arange(at[-1] + 1), at, values)
