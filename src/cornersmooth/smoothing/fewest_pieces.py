"""A polyline in as few lines and arcs as ε allows, which turn no more than it does where they meet.

From every vertex the piece goes to the farthest vertex that a line, or an arc in a main plane, reaches within ε. The
third coordinate of an arc runs evenly with its angle, as in a helix. Ends are vertices, so no number is new but radii.

Where pieces meet they turn by at most `KINK`, or by what the polyline turns there, at a `CORNER` by `KINK` more. They
must leave room for the edge behind their end. So a search never fails: the edge of the polyline itself is allowed.

An arc through two points has one number: half of its turn, β. A point sees the chord, of length L, under the angle of
the arc that goes through it. That gives the β of each vertex, and of each edge where it is nearest to the centre. To be
off by d there changes β by d·L/(r₁·r₂), with the distances r₁ and r₂ from the ends. So each point leaves an interval of
β, and each tangent where pieces meet another one. What is chosen is measured once more with the written radius.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.arrays import dot, norm, split, spread, starts, unit
from cornersmooth.geometry.arcs import FIRST_PLANE, PLANES
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.long_lines import TOGETHER

#: rad; by how much pieces may turn where they meet and the polyline does not
KINK: Final = math.radians(1.9)

#: rad; a vertex that turns by more is a corner of the part
CORNER: Final = math.radians(8.0)

#: rows after which a piece ends in any case; so many parts are worked on side by side
LANE: Final = 256

#: half of the largest turn of an arc: near half a turn the rounding of the radius moves its middle too far
_LARGEST: Final = math.radians(75.0)

#: vertices before the farthest that are tried where the piece to it turns too much at its end
_BACK: Final = 6

#: steps of the radius that the chord of an arc is long, at least
_SHORTEST: Final = 20.0

#: share of a tangent's room that is planned with: the rest is for the rounding of the radius
_PLANNED: Final = 0.98

#: rad; where a piece may turn by more, its tangent is measured but not chosen
_WIDE: Final = 0.5

#: kinds of pieces while they are looked for
_LINE, _ARC = 0, 1


@dataclass(frozen=True)
class Polyline:
    """Parts of a path that follow one another, r vertices."""

    point: Floats  #: (r, 3) mm
    fixed: Bools  #: (r,): a piece ends here in any case
    begins: Bools  #: (r,): a part begins here, no piece leads here


@dataclass(frozen=True)
class PieceLimits:
    """What pieces must keep."""

    tolerance: float  #: mm
    planes: tuple[int, ...] = ()  #: of 17, 18 and 19, those in which arcs may lie; none for lines alone
    flat: bool = False  #: whether arcs have no rise
    step: float = 1e-3  #: mm; step of written radii
    largest: float = 5000.0  #: mm; largest radius
    slope: float = math.inf  #: rad; how steeply arcs may rise


@dataclass(frozen=True)
class Pieces:
    """Lines and arcs, q of them in path order."""

    start: Ints  #: (q,) start, end: vertices
    end: Ints
    plane: Ints  #: (q,) 0 for a line, else 17, 18 or 19
    radius: Ints  #: (q,) in steps; negative where it goes clockwise


@dataclass(frozen=True)
class _Found:
    """What was found of q pieces that were tried."""

    near: Bools  #: (q,) whether they keep the tolerance
    good: Bools  #: (q,) and the tangents at both ends, too
    plane: Ints
    radius: Ints
    leaves: Floats  #: (q, 3) direction at the end

    @classmethod
    def none(cls, count: int) -> _Found:
        """Make room for some."""
        no = np.zeros(count, np.bool_)
        return cls(no, no.copy(), np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros((count, 3)))

    def put(self, at: Ints | Bools, other: _Found) -> None:
        """Take over what was found of some."""
        for name, values in vars(other).items():
            getattr(self, name)[at] = values


class _Search:
    """All parts of a polyline between fixed vertices, side by side."""

    def __init__(self, path: Polyline, limits: PieceLimits) -> None:
        self.point, self.limits = path.point, limits
        count, edge = len(path.point), np.diff(path.point, axis=0)
        edge[path.begins[1:]] = 0.0
        lanes = path.fixed | path.begins
        lanes[-1:] = True
        apart = lanes | np.append(path.begins[1:], True)
        lanes = apart.copy()
        lanes[::LANE] = True
        #: (r, 3) direction of the edge behind each vertex; no number where there is none
        self.ahead = np.full((count, 3), np.nan)
        self.ahead[:-1] = unit(edge)
        self.ahead[np.append(path.begins[1:], True)] = np.nan
        behind = np.full((count, 3), np.nan)
        behind[1:] = self.ahead[:-1]
        turn = np.arccos(np.clip(dot(self.ahead, behind), -1.0, 1.0))
        #: (r,) rad: by how much pieces may turn at each vertex
        self.room = np.maximum(np.nan_to_num(turn), KINK) + np.where(turn > CORNER, KINK, 0.0)
        self.room[lanes & ~apart] /= 2.0  # parts on both sides are worked on at once
        rows = np.flatnonzero(lanes)
        goes = ~path.begins[rows[1:]]
        self.begin, self.stop = rows[:-1][goes], rows[1:][goes]

    def pieces(self) -> Pieces:
        """Find the pieces of all parts."""
        made: list[tuple[Ints, ...]] = []
        at, stop = self.begin.copy(), self.stop
        count = len(at)
        enters = self.ahead[at]
        enters[self.room[at] >= KINK] = np.nan  # no piece before it that has to be met
        kind, near, beyond = np.zeros(count, np.int64), at + 1, stop + 1
        best, tried = at + 1, _Found.none(count)  # the farthest good end, and what leads there
        tried.leaves[:] = self.ahead[at]
        back = np.zeros(count, np.int64)
        arcs = bool(self.limits.planes)
        while len(at):
            done = (beyond - near <= 1) & ((best >= near) | (back >= _BACK) | (near - back <= best))
            turns = done & (kind == _LINE) & arcs & (stop - at > 1)
            ended = done & ~turns
            if turns.any():  # arcs are worth a look where they reach farther than lines
                kind[turns], back[turns] = _ARC, 0
                near[turns] = np.maximum(best[turns], at[turns] + 1)
                beyond[turns] = stop[turns] + 1
                ended |= turns & (near >= stop)
            if ended.any():
                made.append((at[ended], best[ended], tried.plane[ended], tried.radius[ended]))
                at[ended], enters[ended] = best[ended], tried.leaves[ended]
                going = at < stop
                kind[ended], back[ended] = _LINE, 0
                near[ended], beyond[ended], best[ended] = at[ended] + 1, stop[ended] + 1, at[ended] + 1
                fresh = ended & going
                tried.plane[fresh] = tried.radius[fresh] = 0
                tried.leaves[fresh] = self.ahead[at[fresh]]
                if not going.all():
                    at, stop, enters, kind = at[going], stop[going], enters[going], kind[going]
                    near, beyond, best, back = near[going], beyond[going], best[going], back[going]
                    tried = _Found(*(values[going] for values in vars(tried).values()))
                continue
            searching = beyond - near > 1
            doubled = np.minimum(np.maximum(2 * near - at, near + 1), stop)
            target = np.where(beyond > stop, doubled, (near + beyond) // 2)
            back[~searching] += 1
            target = np.where(searching, target, near - back)
            found = self._try(at, target, enters, kind)
            near = np.where(searching & found.near, target, near)
            beyond = np.where(searching, np.where(found.near, beyond, target), beyond)
            beyond = np.where(searching & (near == stop), stop + 1, beyond)
            better = found.good & (target > best)
            best = np.where(better, target, best)
            tried.put(better, _Found(*(values[better] for values in vars(found).values())))
        none = np.zeros(0, np.int64)
        whole = [np.concatenate((none, *some)) for some in zip(*made, strict=True)] or [none] * 4
        order = np.argsort(whole[0], kind="stable")
        return Pieces(*(values[order] for values in whole))

    def _try(self, at: Ints, end: Ints, enters: Floats, kind: Ints) -> _Found:
        """Try lines or arcs from some vertices to others."""
        found = _Found.none(len(at))
        for which, attempt in ((_LINE, self._lines), (_ARC, self._arcs)):
            rows = np.flatnonzero(kind == which)
            for part in split(rows, (end - at)[rows], TOGETHER):
                found.put(part, attempt(at[part], end[part], enters[part]))
        return found

    def _lines(self, at: Ints, end: Ints, enters: Floats) -> _Found:
        line, place = spread(end - at - 1)
        row = at[line] + 1 + place
        way = self.point[end] - self.point[at]
        length = norm(way)
        direction = unit(way)
        gone = self.point[row] - self.point[at][line]
        along = dot(gone, direction[line])
        off = norm(gone - along[:, None] * direction[line])
        bad = np.bincount(line[off > self.limits.tolerance], minlength=len(at)) > 0
        # in order: never back, and never beyond the ends
        follows = line[1:] == line[:-1]
        back = line[1:][follows & (np.diff(along) < 0.0)]
        bad |= np.bincount(back, minlength=len(at)) > 0
        bad |= np.bincount(line[(along < 0.0) | (along > length[line])], minlength=len(at)) > 0
        near = ~bad & (length > 0.0)
        good = near & self._meets(at, end, enters, direction, direction)
        none = np.zeros(len(at), np.int64)
        return _Found(near, good, none, none.copy(), direction)

    def _meets(self, at: Ints, end: Ints, enters: Floats, leaves: Floats, ends: Floats) -> Bools:
        """Whether pieces turn no more than they may, at their start and at their end."""
        ahead = self.ahead[end]
        starts_well = np.isnan(enters[:, 0]) | (dot(enters, leaves) >= np.cos(self.room[at]) - 1e-12)
        ends_well = np.isnan(ahead[:, 0]) | (dot(ahead, ends) >= np.cos(self.room[end]) - 1e-12)
        return starts_well & ends_well

    def _arcs(self, at: Ints, end: Ints, enters: Floats) -> _Found:
        limits = self.limits
        plane = self._planes(at, end)
        chords = _Chords(self.point, at, end, plane, _SHORTEST * limits.step)
        fit = chords.long & (end - at > 1)
        if limits.flat:
            fit &= chords.rise == 0.0
        mean = chords.mean()
        fit &= np.abs(mean) <= _LARGEST
        mean = np.where(fit, mean, 0.0)
        lowest, highest = chords.room(mean, limits.tolerance)
        slope = chords.slope(mean)
        fit &= (lowest <= highest) & (np.abs(slope) <= limits.slope)
        # tangents at both ends, where they have to be met
        turned, half = chords.window(enters, self.room[at], slope)
        low_in, high_in = np.maximum(lowest, -turned - half), np.minimum(highest, -turned + half)
        near = fit & (low_in <= high_in)
        turned, half = chords.window(self.ahead[end], self.room[end], slope)
        low_out, high_out = np.maximum(low_in, turned - half), np.minimum(high_in, turned + half)
        whole = low_out <= high_out
        beta = np.clip(mean, np.where(whole, low_out, low_in), np.where(whole, high_out, high_in))
        # what is written is measured once more
        size = chords.safe / (2.0 * np.maximum(np.abs(np.sin(beta)), 1e-12))
        ticks = np.rint(np.minimum(size, 2.0 * limits.largest) / limits.step)
        size = ticks * limits.step
        written = near & (size <= limits.largest) & (2.0 * size > chords.safe)
        beta = np.sign(beta) * np.arcsin(np.where(written, chords.safe / (2.0 * np.where(written, size, 1.0)), 0.0))
        written &= np.abs(beta) <= _LARGEST + 1e-3
        written &= chords.keeps(np.where(written, beta, 1.0), beta, size, limits.tolerance)
        first, last = chords.tangents(beta, slope)
        good = written & whole & self._meets(at, end, enters, first, last)
        radius = np.where(good, np.sign(beta) * ticks, 0.0).astype(np.int64)
        return _Found(near, good, plane + FIRST_PLANE, radius, last)

    def _planes(self, at: Ints, end: Ints) -> Ints:
        """Of each part the plane, less 17, that it lies in most nearly of those that are allowed."""
        a, b, middle = self.point[at], self.point[end], self.point[(at + end) // 2]
        normal = np.abs(np.cross(middle - a, b - middle))
        normal[:, [axis for axis, plane in ((2, 17), (1, 18), (0, 19)) if plane not in self.limits.planes]] = -1.0
        return 2 - np.argmax(normal, axis=1)


class _Chords:
    """c parts of a polyline beside their chords: x along it, y across it in the plane of an arc, w off the plane."""

    def __init__(self, point: Floats, at: Ints, end: Ints, plane: Ints, shortest: float) -> None:
        self.axes, self.own = PLANES[plane], np.arange(len(at))
        across, up, self.rise = self._local(point[end] - point[at], self.own)
        length = np.hypot(across, up)
        self.long = length > shortest
        #: (c,) length of the chord in the plane, where it is long enough; else 1
        self.safe = np.where(self.long, length, 1.0)
        self.cosine, self.sine = across / self.safe, up / self.safe
        self.line, place = spread(end - at)  # part of each edge
        self.begin = starts(end - at)[:-1]
        row = at[self.line] + place
        ends = (self._seen(point[row + k] - point[at][self.line]) for k in (0, 1))
        #: (e, 2) both ends of each edge
        self.x, self.y, self.w = (np.column_stack(pair) for pair in zip(*ends, strict=True))
        self.dx, self.dy = np.diff(self.x)[:, 0], np.diff(self.y)[:, 0]

    def _local(self, vectors: Floats, which: Ints) -> tuple[Floats, Floats, Floats]:
        """Vectors along the axes of the plane of some parts."""
        first, second, third = np.take_along_axis(vectors, self.axes[which], axis=1).T
        return first, second, third

    def _seen(self, gone: Floats) -> tuple[Floats, Floats, Floats]:
        u, v, w = self._local(gone, self.line)
        cosine, sine = self.cosine[self.line], self.sine[self.line]
        return u * cosine + v * sine, v * cosine - u * sine, w

    def mean(self) -> Floats:
        """(c,) β of the arcs that lie in the middle of the edges, all in all."""
        ends = [np.concatenate((values[:, 1], values.mean(axis=1))) for values in (self.x, self.y)]
        sees, per = _seen(ends[0], ends[1], np.tile(self.safe[self.line], 2))
        weight, sees = (per**2).reshape(2, -1).sum(axis=0), (sees * per**2).reshape(2, -1).sum(axis=0)
        found: Floats = np.add.reduceat(sees, self.begin) / np.maximum(np.add.reduceat(weight, self.begin), 1e-300)
        return found

    def _points(self, beta: Floats) -> Iterator[tuple[Floats, Floats, Floats]]:
        """Vertices, and where edges are nearest to the centre: along the chord, off it, and height off the arc."""
        safe, squared = self.safe[self.line], self.dx**2 + self.dy**2
        centre = (self.safe / (2.0 * np.tan(np.where(beta == 0.0, 1e-9, beta))))[self.line]
        to_centre = (safe / 2.0 - self.x[:, 0]) * self.dx + (centre - self.y[:, 0]) * self.dy
        nearest = np.clip(to_centre / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
        for part in (np.ones_like(nearest), nearest):
            here, off, high = (values[:, 0] + part * np.diff(values)[:, 0] for values in (self.x, self.y, self.w))
            yield here, off, high - self.rise[self.line] * _share(here / safe, beta[self.line])

    def room(self, beta: Floats, tolerance: float) -> tuple[Floats, Floats]:
        """(c,) least and largest β within a tolerance, at the heights of one; none where edges go back."""
        count, safe = len(self.own), self.safe[self.line]
        lowest, highest = np.full(count, -_LARGEST), np.full(count, _LARGEST)
        # in order: x never falls, and stays between the ends
        wrong = (self.dx < 0.0) | (self.x[:, 0] < 0.0) | (self.x[:, 1] > safe * (1.0 + 1e-12))
        for here, off, high in self._points(beta):
            sees, per = _seen(here, off, safe)
            left = tolerance**2 - high**2
            wrong |= left <= 0.0
            with np.errstate(divide="ignore"):
                width = np.sqrt(np.maximum(left, 1e-300)) / per
            lowest = np.maximum(lowest, np.maximum.reduceat(sees - width, self.begin))
            highest = np.minimum(highest, np.minimum.reduceat(sees + width, self.begin))
        return np.where(np.bincount(self.line[wrong], minlength=count) == 0, lowest, np.inf), highest

    def slope(self, beta: Floats) -> Floats:
        """(c,) rad; how steeply arcs rise."""
        arc = self.safe * beta / np.where(beta == 0.0, 1.0, np.sin(beta)) + (beta == 0.0) * self.safe
        found: Floats = np.arctan2(self.rise, arc)
        return found

    def window(self, direction: Floats, room: Floats, slope: Floats) -> tuple[Floats, Floats]:
        """Angle from the chord to a direction in the plane, and how far a tangent may be off it."""
        du, dv, dw = self._local(direction, self.own)
        turned = np.arctan2(dv * self.cosine - du * self.sine, du * self.cosine + dv * self.sine)
        off = np.abs(np.arcsin(np.clip(dw, -1.0, 1.0)) - slope)
        half = np.sqrt(np.maximum((_PLANNED * room) ** 2 - off**2, 0.0)) / np.cos(slope)
        free = np.isnan(du) | (room > _WIDE)
        return np.where(free, 0.0, turned), np.where(free, np.inf, np.where(off > room, -1.0, half))

    def keeps(self, safe_beta: Floats, beta: Floats, size: Floats, tolerance: float) -> Bools:
        """(c,) whether arcs of a size are within a tolerance; of no use where they are none."""
        across = (self.safe / (2.0 * np.tan(safe_beta)))[self.line]
        far = np.zeros(len(self.line), np.bool_)
        for here, off, high in self._points(beta):
            round_ = np.hypot(here - self.safe[self.line] / 2.0, off - across) - size[self.line]
            far |= round_**2 + high**2 > tolerance**2
        return np.bincount(self.line[far], minlength=len(self.own)) == 0

    def tangents(self, beta: Floats, slope: Floats) -> Iterator[Floats]:
        """Directions (c, 3) at the start and at the end of arcs."""
        for angle in (-beta, beta):
            found = np.zeros((len(beta), 3))
            along = np.column_stack(
                (
                    np.cos(angle) * self.cosine - np.sin(angle) * self.sine,
                    np.cos(angle) * self.sine + np.sin(angle) * self.cosine,
                    np.tan(slope),
                )
            )
            np.put_along_axis(found, self.axes, along, axis=1)
            yield unit(found)


def _seen(x: Floats, y: Floats, length: Floats) -> tuple[Floats, Floats]:
    """β of the arcs over a chord through some points, and the way that a change of β moves them by there."""
    rest = length - x
    per = np.hypot(x, y) * np.hypot(rest, y) / length
    ends = per < 1e-12
    return np.where(ends, 0.0, np.arctan2(-y, rest) - np.arctan2(y, x)), np.where(ends, 0.0, per)


def _share(along: Floats, beta: Floats) -> Floats:
    """Part of an arc's turn at a part of its chord."""
    sine = np.sin(beta)
    angle = np.arcsin(np.clip((2.0 * along - 1.0) * sine, -1.0, 1.0))
    bent = np.abs(beta) > 1e-6
    return np.where(bent, (angle / np.where(bent, beta, 1.0) + 1.0) / 2.0, along)


def fewest_pieces(path: Polyline, limits: PieceLimits) -> Pieces:
    """Find as few lines and arcs as reach along a polyline within a tolerance, in order."""
    return _Search(path, limits).pieces()
