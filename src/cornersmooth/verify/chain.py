"""A chain of nearest places: the cheap proof that two polylines can be run beside each other, forward only.

If all pairs of a chain are within the radius and in order, the motions between two neighbouring pairs are, too: there
both are straight, and the distance of two points that move straight is convex. How the places are found does not
matter: a bad guess costs time.

The *bend* b of a segment is an eighth of the largest second derivative of the motion along it, by its fraction t: the
motion leaves the chord by at most ``4 b t (1 - t)``, its sagitta. Between two pairs with differences D and E

    |(1 - t) D + t E|² = (1 - t) D² + t E² - t (1 - t) |D - E|²

so with a bend b between them they prove it where, with α = r² - D², β = r² - E², γ = 8 b r + 4 b² - |D - E|²,

    (1 - t) α + t β ≥ γ t (1 - t) for all t, which is √γ ≤ √α + √β:

the smallest value of α / t + β / (1 - t) is (√α + √β)². Where neighbours differ much, a bend costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.free_space import largest_square

#: looks at a row that is not near where it was expected (speed only)
_LOOKS = 3

#: how far a row may be from where it is expected, as a share of the way and in radii (speed only)
_SLACK, _RADII = 0.05, 100.0


@dataclass(frozen=True)
class Path:
    """A polyline with path lengths.

    Parameters
    ----------
    points : (m + 1, 3h) float64, mm
    length : (m + 1,) float64, mm
        Path length up to every vertex, in 3h dimensions.
    bend : (m,) float64, mm
        How far the motion may leave each segment.
    gate : (m + 1,) float64, mm
        Radius at each vertex.
    """

    points: Floats
    length: Floats
    bend: Floats
    gate: Floats

    @classmethod
    def of(cls, points: Floats, radius: float, *, gate: Floats | None = None, bend: Floats | None = None) -> Path:
        """Make it of vertices."""
        step = points[1:] - points[:-1]
        length = np.zeros(len(points))
        np.cumsum(np.sqrt(np.einsum("ij,ij->i", step, step)), out=length[1:])
        limit = np.full(len(points), radius) if gate is None else np.minimum(gate, radius)
        return cls(points, length, np.zeros(len(step)) if bend is None else bend, limit)

    @property
    def segments(self) -> int:
        """How many."""
        return len(self.points) - 1

    @cached_property
    def bent(self) -> bool:
        """Whether any of the segments is."""
        return bool(self.bend.any())

    def length_at(self, place: float) -> float:
        """Path length up to a place, mm."""
        k = min(int(place), self.segments - 1)
        return float(self.length[k] + (place - k) * (self.length[k + 1] - self.length[k]))


@dataclass(frozen=True)
class Window:
    """Segments of a path from `first` on, as columns."""

    first: int
    start: Floats  #: (3h, w)
    way: Floats
    inverse: Floats  #: 1 / |way|²
    length: Floats  #: (w + 1,)

    @classmethod
    def of(cls, path: Path, low: float, high: float) -> Window:
        """Those from one path length to another."""
        first = max(int(np.searchsorted(path.length, low)) - 3, 0)
        stop = min(int(np.searchsorted(path.length, high)) + 3, path.segments)
        first = min(first, stop - 1)
        points = np.ascontiguousarray(path.points[first : stop + 1].T)
        way = points[:, 1:] - points[:, :-1]
        size = np.einsum("ij,ij->j", way, way)
        inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
        return cls(first, points[:, :-1], way, inverse, path.length[first : stop + 1])

    def segment_at(self, length: Floats) -> Ints:
        """Segment, counted in the window, at path lengths."""
        k: Ints = np.clip(np.searchsorted(self.length, length, side="right") - 1, 0, self.way.shape[1] - 1)
        return k

    def nearest(self, points: Floats, length: Floats) -> Floats:
        """Places near points (3h, k), from path lengths on: a step along the tangent, then the neighbours."""
        k = self.segment_at(length)
        away = points - self.start.take(k, axis=1)
        ahead = np.einsum("ij,ij->j", away, self.way.take(k, axis=1)) * self.inverse[k]
        k = self.segment_at(self.length[k] + ahead * (self.length[k + 1] - self.length[k]))
        best: Floats | None = None
        place: Floats = np.zeros(0)
        for step in (0, -1, 1):
            j = np.clip(k + step, 0, self.way.shape[1] - 1)
            way = self.way.take(j, axis=1)
            away = points - self.start.take(j, axis=1)
            at = np.einsum("ij,ij->j", away, way) * self.inverse.take(j)
            np.clip(at, 0.0, 1.0, out=at)
            away -= at * way
            square = np.einsum("ij,ij->j", away, away)
            at += j
            if best is None:
                best, place = square, at
            else:
                nearer = square < best
                np.copyto(best, square, where=nearer)
                np.copyto(place, at, where=nearer)
        place += self.first
        return place


@dataclass(frozen=True)
class Sections:
    """Parts of the own motion that are run beside parts of the path, one after the other, both in order.

    What lies between two of them is not looked at.

    Parameters
    ----------
    first, last : (s,) int64
        Own vertices.
    start, stop : (s,) float64
        Places on the path beside them; the latter are vertices.
    open : bool
        Whether the last section goes on behind its last vertex: that may be anywhere before `stop`.
    """

    first: Ints
    last: Ints
    start: Floats
    stop: Floats
    open: bool = False

    @classmethod
    def whole(cls, last: int, stop: int, *, open_end: bool = False) -> Sections:
        """One section: all of both motions."""
        return cls(np.array([0]), np.array([last]), np.array([0.0]), np.array([float(stop)]), open_end)

    def of(self, rows: Ints) -> tuple[Ints, Bools]:
        """Section of each row, or the one before, and whether it is inside."""
        number = np.maximum(np.searchsorted(self.first, rows, side="right") - 1, 0)
        return number, (rows >= self.first[number]) & (rows <= self.last[number])

    def behind(self, number: int, row: int, place: float) -> Sections:
        """The rest of them from a row in section `number` on, counted from that row."""
        first, start = self.first[number:] - row, self.start[number:].copy()
        first[0], start[0] = 0, place
        return Sections(first, self.last[number:] - row, start, self.stop[number:], self.open)


@dataclass(frozen=True)
class Chain:
    """Places of rows, and where they prove nothing.

    Parameters
    ----------
    place : (n,) float64
        Ascending.
    bad : (n,) bool
        Whether the row, or the step from the row before it, is not proved.
    """

    place: Floats
    bad: Bools


def points_at(path: Floats, place: Floats, first: int = 0) -> Floats:
    """(3h, k) points of a polyline (m + 1, 3h) at places; rows before `first` are left out of it."""
    k = np.minimum(place.astype(np.int64) - first, len(path) - 2)
    start: Floats = path.take(k, axis=0)
    return np.ascontiguousarray((start + (place - first - k)[:, None] * (path.take(k + 1, axis=0) - start)).T)


def chain(own: Floats, bend: Floats, path: Path, radius: float, sections: Sections) -> Chain:
    """Go along the own polyline, and take for each vertex the nearest place around where it should be.

    Parameters
    ----------
    own : (3h, n) float64, mm
    bend : (n - 1,) float64, mm
        Of each segment of it.
    path : Path
    radius : float, mm
    sections : Sections
        The first begins at the first vertex, and is free there.
    """
    count = own.shape[1]
    step = own[:, 1:] - own[:, :-1]
    gone = np.zeros(count)
    np.cumsum(np.sqrt(np.einsum("ij,ij->j", step, step)), out=gone[1:])
    number, inside = sections.of(np.arange(count))
    low, high = sections.start[number], sections.stop[number]
    place, near = _places(own, gone, path, radius, (sections, number))
    np.clip(place, low, high, out=place)
    place[~near] = low[~near]
    place[sections.first] = sections.start
    place[~inside] = sections.stop[number[~inside]]
    np.maximum.accumulate(place, out=place)
    ends = slice(None, -1 if sections.open else None)
    place[sections.last[ends]] = sections.stop[ends]
    away = own - points_at(path.points, place)
    bad = largest_square(away) > radius * radius
    rows, vertices, share = passed(own, step, path.points, place)
    beside = path.points[vertices].T - own[:, rows] - share * step[:, rows]
    beside_square = largest_square(beside)
    limit = np.minimum(radius, path.gate[vertices] - 4.0 * bend[rows] * share * (1.0 - share))
    bad[rows[(beside_square > limit * limit) | (limit < 0.0)] + 1] = True
    if path.bent or bend.any():
        bad |= _bent(bend, path, radius, place, (rows, vertices, share), (away, -beside))
    bad[~inside] = False
    firsts = sections.first[1:]
    bad[firsts] = largest_square(away[:, firsts]) > radius * radius  # the step to it is none of its section
    bad[0] = False
    return Chain(place, bad)


def _places(own: Floats, gone: Floats, path: Path, radius: float, where: tuple[Sections, Ints]) -> tuple[Floats, Bools]:
    """Nearest places of all rows, and which of them are near; the number of the section of each row is known."""
    sections, number = where
    begin = np.array([path.length_at(place) for place in sections.start.tolist()])
    expected = (begin - gone[sections.first])[number] + gone
    place, near = sections.start[number], np.zeros(len(gone), np.bool_)
    rows = np.arange(len(gone))
    for _ in range(_LOOKS):
        low, high = float(expected[rows].min()), float(expected[rows].max())
        slack = _SLACK * (high - low) + _RADII * radius
        window = Window.of(path, low - slack, high + slack)
        found = window.nearest(own[:, rows] if len(rows) < len(gone) else own, expected[rows])
        place[rows] = found
        square = largest_square(own[:, rows] - points_at(path.points, found))
        near[rows] = square <= radius * radius
        rows = rows[~near[rows]]
        if not len(rows) or len(rows) == len(gone):
            break
        # from the last row of the section before that is near
        last = np.where(near, np.arange(len(gone)), 0)
        np.maximum.accumulate(last, out=last)
        last = np.maximum(last, sections.first[number])[rows]
        k = np.minimum(place[last].astype(np.int64), path.segments - 1)
        there = path.length[k] + (place[last] - k) * (path.length[k + 1] - path.length[k])
        expected[rows] = there + gone[rows] - gone[last]
    return place, near


def near_places(own: Floats, path: Path, radius: float, start: float, stop: float) -> list[tuple[int, float]]:
    """The first row (3h, n) that is near the path, if any, and its place; the path was left at `start`."""
    step = own[:, 1:] - own[:, :-1]
    gone = np.concatenate(([0.0], np.cumsum(np.sqrt(np.einsum("ij,ij->j", step, step)))))
    only = Sections(np.array([0]), np.array([len(gone) - 1]), np.array([start]), np.array([stop]))
    place, near = _places(own, gone, path, radius, (only, np.zeros(len(gone), np.int64)))
    first = np.flatnonzero(near & (place >= start) & (place <= stop))[:1].tolist()
    return [(row, float(place[row])) for row in first]


def passed(own: Floats, step: Floats, path: Floats, place: Floats) -> tuple[Ints, Ints, Floats]:
    """Vertices of the path that are passed on the steps of a chain, in order.

    Returns
    -------
    row, vertex : (k,) int64
        The row that the step begins at.
    share : (k,) float64
        Fraction of the step, ascending along each: as near to the vertex as that allows.
    """
    vertex = np.arange(int(place[0]) + 1, int(place[-1]) + 1)
    row = np.clip(np.searchsorted(place, vertex, side="left") - 1, 0, max(len(place) - 2, 0))
    way = step[:, row]
    size = np.einsum("ij,ij->j", way, way)
    share = np.einsum("ij,ij->j", path[vertex].T - own[:, row], way)
    share = np.clip(np.divide(share, size, out=np.zeros_like(size), where=size > 0.0), 0.0, 1.0)
    share = np.clip(np.maximum.accumulate(row + share) - row, 0.0, 1.0) if len(row) else share
    return row, vertex, share


def _bent(
    bend: Floats,
    path: Path,
    radius: float,
    place: Floats,
    passing: tuple[Ints, Ints, Floats],
    differences: tuple[Floats, Floats],
) -> Bools:
    """Whether the bends let the motion leave the radius on the step to each row."""
    rows, vertices, share = passing
    count, more = len(place), len(rows)
    before = np.searchsorted(rows, np.arange(count), side="left")  # vertices passed before each row
    at_rows, at_vertices = np.arange(count) + before, np.arange(more) + rows + 1
    away = np.empty((len(differences[0]), count + more))
    away[:, at_rows], away[:, at_vertices] = differences
    step = np.empty(count + more, np.int64)  # the step that leads from each pair on
    on_own, on_path = np.zeros(count + more), np.empty(count + more)
    step[at_rows], step[at_vertices], on_own[at_vertices] = np.arange(count), rows, share
    on_path[at_rows], on_path[at_vertices] = place, vertices
    # from pair to pair: fractions of the step, and of the segment, on which both run
    step = step[:-1]
    on_row = np.zeros(count + more, np.bool_)
    on_row[at_rows] = True
    one, other = on_own[:-1], np.where(on_row[1:], 1.0, on_own[1:])
    segment = np.minimum(on_path[:-1].astype(np.int64), path.segments - 1)
    low, high = on_path[:-1] - segment, np.minimum(on_path[1:] - segment, 1.0)
    mine, theirs = bend[step], path.bend[segment]
    off_one = 4.0 * (mine * one * (1.0 - one) + theirs * low * (1.0 - low))
    off_other = 4.0 * (mine * other * (1.0 - other) + theirs * high * (1.0 - high))
    between = mine * (other - one) ** 2 + theirs * (high - low) ** 2
    wrong = np.zeros(len(step), np.bool_)
    for c in range(0, len(away), 3):
        size = np.sqrt(np.einsum("ij,ij->j", away[c : c + 3], away[c : c + 3]))
        apart = away[c : c + 3, 1:] - away[c : c + 3, :-1]
        apart_size = np.maximum(np.sqrt(np.einsum("ij,ij->j", apart, apart)) - off_one - off_other, 0.0)
        alpha = radius * radius - (size[:-1] + off_one) ** 2
        beta = radius * radius - (size[1:] + off_other) ** 2
        gamma = 8.0 * between * radius + 4.0 * between * between - apart_size * apart_size
        room = np.sqrt(np.maximum(alpha, 0.0)) + np.sqrt(np.maximum(beta, 0.0))
        bent = (mine > 0.0) | (theirs > 0.0)
        wrong |= bent & ((alpha < 0.0) | (beta < 0.0) | (gamma > room * room))
    bad = np.zeros(count, np.bool_)
    bad[step[wrong] + 1] = True
    return bad
