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

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.motions import largest_square

#: rows that are looked for together: at least, at first, at most (speed only)
_BLOCKS = 64, 512, 8192

#: how far a row may be from where it is expected, as a share of the way and in radii (speed only)
_SLACK, _RADII = 0.05, 100.0


@dataclass(frozen=True)
class Path:
    """A polyline with path lengths."""

    points: Floats  #: (m + 1, 3h) mm
    length: Floats  #: (m + 1,) mm: path length up to every vertex, in 3h dimensions
    bend: Floats  #: (m,) mm: how far the motion may leave each segment
    #: Gives points (k, 3h) of the motion at places (k,); None where it is straight.
    exact: Callable[[Floats], Floats] | None = None

    @classmethod
    def of(cls, points: Floats, bend: Floats | None = None, exact: Callable[[Floats], Floats] | None = None) -> Path:
        """Make it of vertices."""
        step = points[1:] - points[:-1]
        length = np.zeros(len(points))
        np.cumsum(np.sqrt(np.einsum("ij,ij->i", step, step)), out=length[1:])
        return cls(points, length, np.zeros(len(step)) if bend is None else bend, exact)

    def only(self, columns: slice) -> Path:
        """Tips or axis points alone."""
        return Path.of(
            np.ascontiguousarray(self.points[:, columns]), self.bend, lambda place: self.at(place)[:, columns]
        )

    @property
    def segments(self) -> int:
        """How many."""
        return len(self.points) - 1

    @cached_property
    def bent(self) -> bool:
        """Whether any of the segments is."""
        return bool(self.bend.any())

    def at(self, place: Floats) -> Floats:
        """(k, 3h) points of the motion at places."""
        return points_at(self.points, place).T if self.exact is None else self.exact(place)

    def length_at(self, place: float) -> float:
        """Path length up to a place, mm."""
        return float(self.lengths_at(np.array([place]))[0])

    def lengths_at(self, place: Floats) -> Floats:
        """(k,) path lengths up to places, mm."""
        k = np.minimum(place.astype(np.int64), self.segments - 1)
        start = self.length.take(k)
        return start + (place - k) * (self.length.take(k + 1) - start)


@dataclass(frozen=True)
class Window:
    """Segments of a path that lead somewhere, as columns."""

    number: Ints  #: (w,) of the segments
    start: Floats  #: (3h, w)
    way: Floats
    inverse: Floats  #: 1 / |way|²
    length: Floats  #: (w + 1,)
    sharp: Bools  #: (w + 1,): whether the path turns by a right angle or more at their ends

    @classmethod
    def of(cls, path: Path, low: float, high: float) -> Window:
        """Those from one path length to another."""
        first = max(int(np.searchsorted(path.length, low)) - 3, 0)
        stop = min(int(np.searchsorted(path.length, high)) + 3, path.segments)
        first = min(first, stop - 1)
        points = np.ascontiguousarray(path.points[first : stop + 1].T)
        way = points[:, 1:] - points[:, :-1]
        size = np.einsum("ij,ij->j", way, way)
        number, start, length = np.arange(first, stop), points[:, :-1], path.length[first : stop + 1]
        if not size.all():
            kept = np.flatnonzero(size > 0.0)
            kept = kept if len(kept) else np.zeros(1, np.int64)
            number, start, way, size = number[kept], start[:, kept], way[:, kept], size[kept]
            length = np.append(length[kept], length[-1])
        inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
        sharp = np.zeros(len(number) + 1, np.bool_)
        sharp[1:-1] = np.einsum("ij,ij->j", way[:, 1:], way[:, :-1]) <= 0.0
        return cls(number, start, way, inverse, length, sharp)

    def segment_at(self, length: Floats) -> Ints:
        """Segment, counted in the window, at path lengths."""
        return np.clip(np.searchsorted(self.length, length, side="right") - 1, 0, self.way.shape[1] - 1)

    def nearest(self, points: Floats, length: Floats, radius: float) -> tuple[Floats, Floats]:
        """Places near points (3h, k), from path lengths on: a step along the tangent, then the neighbours.

        With the squares of the distances of the farthest of their triples.
        """
        k = self.segment_at(length)
        away = points - self.start.take(k, axis=1)
        ahead = np.einsum("ij,ij->j", away, self.way.take(k, axis=1)) * self.inverse[k]
        k = self.segment_at(self.length[k] + ahead * (self.length[k + 1] - self.length[k]))
        at, square, farthest = self._on(points, k)
        place = at + self.number.take(k)
        # beyond the nearer end nothing is nearer to what is farther from it than from the segment, but at sharp turns
        behind = at >= 0.5
        nearer_end, along = np.where(behind, 1, -1), np.where(behind, 1.0 - at, at)
        beyond_end = (along * along <= square * self.inverse.take(k)) | self.sharp.take(k + behind)
        for beyond, wanted in ((nearer_end, beyond_end), (-nearer_end, farthest > radius * radius)):
            rows = np.flatnonzero(wanted)
            j = np.clip(k.take(rows) + beyond.take(rows), 0, self.way.shape[1] - 1)
            at, other, other_farthest = self._on(points.take(rows, axis=1), j)
            better = np.flatnonzero(other < square.take(rows))
            rows, j = rows.take(better), j.take(better)
            place[rows], square[rows] = self.number.take(j) + at.take(better), other.take(better)
            farthest[rows] = other_farthest.take(better)
        return place, farthest

    def _on(self, points: Floats, k: Ints) -> tuple[Floats, Floats, Floats]:
        """Fractions at which segments are nearest to points; the squares of the distances, whole and of a triple."""
        way = self.way.take(k, axis=1)
        away = points - self.start.take(k, axis=1)
        at = np.einsum("ij,ij->j", away, way) * self.inverse.take(k)
        np.clip(at, 0.0, 1.0, out=at)
        away -= at * way
        squares = [np.einsum("ij,ij->j", away[c : c + 3], away[c : c + 3]) for c in range(0, len(away), 3)]
        if len(squares) == 1:
            return at, squares[0], squares[0].copy()
        return at, squares[0] + squares[1], np.maximum(*squares)


@dataclass(frozen=True)
class Sections:
    """Parts of the own motion that are run beside parts of the path, one after the other, both in order.

    What lies between two of them is not looked at.
    """

    #: (s,): own vertices
    first: Ints
    last: Ints
    #: (s,): places on the path beside them
    start: Floats
    stop: Floats
    guessed: Bools  #: (s,): whether either place is only guessed

    def of(self, rows: Ints) -> tuple[Ints, Bools]:
        """Section of each row, or the one before, and whether it is inside."""
        number = np.maximum(np.searchsorted(self.first, rows, side="right") - 1, 0)
        return number, (rows >= self.first[number]) & (rows <= self.last[number])

    def behind(self, number: int, row: int, place: float) -> Sections:
        """The rest of them from a row in section `number` on, counted from that row."""
        first, start = self.first[number:] - row, self.start[number:].copy()
        first[0], start[0] = 0, place
        return Sections(first, self.last[number:] - row, start, self.stop[number:], self.guessed[number:])


@dataclass(frozen=True)
class Chain:
    """Places of rows, and where they prove nothing."""

    place: Floats  #: (n,): ascending
    bad: Bools  #: (n,): whether the row, or the step from the row before it, is not proved
    far: Bools  #: (n,): whether it is not because vertices are farther apart: dividing the step proves nothing


def points_at(path: Floats, place: Floats) -> Floats:
    """(3h, k) points of a polyline (m + 1, 3h) at places."""
    k = np.minimum(place.astype(np.int64), len(path) - 2)
    start: Floats = path.take(k, axis=0)
    return np.ascontiguousarray((start + (place - k)[:, None] * (path.take(k + 1, axis=0) - start)).T)


def chain(own: Floats, bend: Floats, path: Path, radius: float, sections: Sections) -> Chain:
    """Go along the own polyline, and take for each vertex the nearest place around where it should be.

    It has vertices (3h, n) and bends (n - 1,), mm. The first section begins at the first vertex, and is free there.
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
    place[sections.last] = sections.stop
    away = own - points_at(path.points, place)
    away_square = largest_square(away)
    bad = away_square > radius * radius
    rows, vertices, share = passed(own, step, path.points, place)
    beside = path.points.take(vertices, axis=0).T - own.take(rows, axis=1) - share * step.take(rows, axis=1)
    beside_square = largest_square(beside)
    bad[rows[beside_square > radius * radius] + 1] = True
    far = bad
    if path.bent or bend.any():
        far = away_square > radius * radius
        least = np.sqrt(beside_square) - 4.0 * bend[rows] * share * (1.0 - share)
        far[rows[least > radius] + 1] = True
        farthest = np.maximum(away_square[:-1], away_square[1:])
        np.maximum.at(farthest, rows, beside_square)
        bad |= _bent(bend, path, radius, place, (rows, vertices, share), (away, -beside), farthest)
    bad[~inside] = False
    firsts = sections.first[1:]
    bad[firsts] = largest_square(away[:, firsts]) > radius * radius  # the step to it is none of its section
    bad[0] = False
    return Chain(place, bad, far)


def _places(own: Floats, gone: Floats, path: Path, radius: float, where: tuple[Sections, Ints]) -> tuple[Floats, Bools]:
    """Nearest places of all rows, and which of them are near; the number of the section of each row is known.

    Block by block, as one motion may be longer than the other: each is looked for from where the last one was found.
    """
    sections, number = where
    begin, left = path.lengths_at(sections.start), gone[sections.first]
    place, near = np.empty(len(gone)), np.empty(len(gone), np.bool_)
    row, size, ratio = 0, _BLOCKS[1], 1.0
    while row < len(gone):
        rows = slice(row, row + size)
        k = number[rows]
        expected = begin[k] + ratio * (gone[rows] - left[k])
        low, high = float(expected.min()), float(expected.max())
        slack = _SLACK * (high - low) + _RADII * radius
        place[rows], square = Window.of(path, low - slack, high + slack).nearest(own[:, rows], expected, radius)
        close = square <= radius * radius
        known, count = row + np.flatnonzero(close)[-1:], len(close)
        if size > _BLOCKS[0] and not close[-1]:
            count, size = int(known[0]) + 1 - row if len(known) else 0, max(size // 4, _BLOCKS[0])
        else:
            size = min(2 * size, _BLOCKS[2])
        near[row : row + count] = close[:count]
        row += count
        if len(known):
            section, last = int(number[known[0]]), int(known[0])
            there = path.length_at(float(place[last]))
            if gone[last] - left[section] > _RADII * radius:
                ratio = min(max((there - begin[section]) / (gone[last] - left[section]), 0.5), 2.0)
            begin[section], left[section] = there, gone[last]
    return place, near


def passed(own: Floats, step: Floats, path: Floats, place: Floats) -> tuple[Ints, Ints, Floats]:
    """Rows where steps begin, vertices of the path that are passed on them, in order, and fractions of the steps (k,).

    The latter ascend along each step: as near to the vertex as that allows.
    """
    vertex = np.arange(int(place[0]) + 1, int(place[-1]) + 1)
    row = np.clip(np.searchsorted(place, vertex, side="left") - 1, 0, max(len(place) - 2, 0))
    way = step.take(row, axis=1)
    size = np.einsum("ij,ij->j", way, way)
    share = np.einsum("ij,ij->j", path.take(vertex, axis=0).T - own.take(row, axis=1), way)
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
    farthest: Floats,
) -> Bools:
    """Whether the bends let the motion leave the radius on the step to each row.

    The chords of each step keep within the square of `farthest` (n - 1,), and it leaves them by no more than its bends.
    """
    rows, vertices, share = passing
    bad, segment = np.zeros(len(place), np.bool_), np.minimum(place.astype(np.int64), path.segments - 1)
    most = np.maximum(path.bend[segment[:-1]], path.bend[segment[1:]])
    np.maximum.at(most, rows, path.bend[np.minimum(vertices, path.segments - 1)])
    near = np.sqrt(farthest) + most + bend > radius
    steps, passed_there = np.flatnonzero(near), np.flatnonzero(near[rows])
    rows, vertices, share = rows[passed_there], vertices[passed_there], share[passed_there]
    # from pair to pair: the first is a row or a vertex that is passed on its step, the second the next of these
    before = np.searchsorted(rows, steps)
    at_vertices, at_rows = np.arange(len(rows)) + np.searchsorted(steps, rows) + 1, np.arange(len(steps)) + before
    count = len(steps) + len(rows)
    to_rows = np.append(at_rows[1:], count)[: len(steps)] - 1
    pairs = np.empty((2, len(differences[0]), count))
    pairs[0][:, at_rows], pairs[1][:, to_rows] = (differences[0].take(steps + k, axis=1) for k in (0, 1))
    pairs[0][:, at_vertices] = pairs[1][:, at_vertices - 1] = differences[1].take(passed_there, axis=1)
    step = np.empty(count, np.int64)
    step[at_rows], step[at_vertices] = steps, rows
    # fractions of the step, and places on the path
    one, other, on_path, to_path = np.zeros(count), np.ones(count), np.empty(count), np.empty(count)
    one[at_vertices] = other[at_vertices - 1] = share
    on_path[at_vertices] = to_path[at_vertices - 1] = vertices
    on_path[at_rows], to_path[to_rows] = place[steps], place[steps + 1]
    segment = np.minimum(on_path.astype(np.int64), path.segments - 1)
    low, high = on_path - segment, np.minimum(to_path - segment, 1.0)
    mine, cl_side = bend[step], path.bend[segment]
    off_one = 4.0 * (mine * one * (1.0 - one) + cl_side * low * (1.0 - low))
    off_other = 4.0 * (mine * other * (1.0 - other) + cl_side * high * (1.0 - high))
    between = mine * (other - one) ** 2 + cl_side * (high - low) ** 2
    wrong = np.zeros(count, np.bool_)
    for c in range(0, pairs.shape[1], 3):
        start, end = pairs[:, c : c + 3]
        size, end_size, apart = (np.sqrt(np.einsum("ij,ij->j", off, off)) for off in (start, end, end - start))
        apart = np.maximum(apart - off_one - off_other, 0.0)
        alpha = radius * radius - (size + off_one) ** 2
        beta = radius * radius - (end_size + off_other) ** 2
        gamma = 8.0 * between * radius + 4.0 * between * between - apart * apart
        room = np.sqrt(np.maximum(alpha, 0.0)) + np.sqrt(np.maximum(beta, 0.0))
        bent = (mine > 0.0) | (cl_side > 0.0)
        wrong |= bent & ((alpha < 0.0) | (beta < 0.0) | (gamma > room * room))
    bad[step[wrong] + 1] = True
    return bad
