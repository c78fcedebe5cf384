"""The cutting motion as segments, the surface that the tool leaves, and distances to the volume that it sweeps.

Points on the surface are those of the envelope, by closed form.

In a segment tip and axis point move evenly, and the axis is the direction between them. On the circle of height h and
radius ρ the points of the envelope are those whose velocity lies in the tool surface. With the outward normal
N = cos ψ·n − sin ψ·O (n the radial unit vector, ψ the drop of the normal) and the tool turning without spin,
N·velocity = 0 becomes

    n · [cos ψ (A′ + h O′) + ρ sin ψ O′] = sin ψ (O · A′),

an equation p cos φ + q sin φ = c for the angle of n about the axis: two points, left and right of the motion, or none.

The distance to the volume is the least over the motion of that to the tool.
A tree of points on the tool axis finds stretches of the motion that may be nearest. They are halved, and left out by
bounds: no point of the tool moves farther than the ends of its axis and its rim do. Golden sections settle what is left
and has its minimum inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from cornersmooth.arrays import dot, norm, spread, unit
from cornersmooth.geometry.arcs import divided, poses_and_arcs
from cornersmooth.geometry.tool import Tool
from cornersmooth.model import Bools, Floats, Ints, Move, Program
from cornersmooth.nc_reader import NcProgram
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.tool import directions, written_at

#: largest turn of an arc within one segment, rad: off the arc by its radius times 3e-7
_ARC_STEP = 1.5e-3

#: segments of one written curve
_CURVE_PARTS = 64


@dataclass(frozen=True)
class RuledMotion:
    """Segments of a cutting motion, m rows in order."""

    #: (m, 2, 3): mm and unit vectors at start and end
    tip: Floats
    axis: Floats
    line: Ints  #: (m,): CL or NC line
    joined: Bools  #: (m,): whether the segment goes on where the one before ends

    def __len__(self) -> int:
        return len(self.line)

    def at(self, segment: Ints, share: Floats) -> tuple[Floats, Floats]:
        """Tip and unit axis (k, 3) at shares (k,) of segments (k,)."""
        tip, axis = self.tip[segment], self.axis[segment]
        place = tip[:, 0] + share[:, None] * (tip[:, 1] - tip[:, 0])
        leaning = axis[:, 0] + share[:, None] * (axis[:, 1] - axis[:, 0])
        return place, unit(leaning)

    def parts(self, longest: float, height: float, aside: float) -> Parts:
        """Cut into parts in which the tip and the point at `height` move about `longest` mm at most.

        `aside` is the distance from the axis up to which points are of interest.
        """
        step = self.tip[:, 1] - self.tip[:, 0]
        top = step + height * (self.axis[:, 1] - self.axis[:, 0])
        count = np.maximum(np.ceil(np.maximum(norm(step), norm(top)) / longest), 1.0).astype(np.int64)
        segment, number = spread(count)
        low, high = number / count[segment], (number + 1) / count[segment]
        ends = [self.at(segment, share) for share in (low, high)]
        turn = ends[1][1] - ends[0][1]
        ways = [norm(ends[1][0] - ends[0][0] + up * turn) for up in (0.0, height)]
        return Parts(self, segment, low, high, np.maximum(*ways) + aside * norm(turn))


@dataclass(frozen=True)
class Parts:
    """Parts of the segments of a motion, p of them."""

    motion: RuledMotion
    segment: Ints  #: (p,)
    #: (p,): shares of the segment where the part begins and ends
    low: Floats
    high: Floats
    way: Floats  #: (p,) mm: how far any point of interest moves at most

    def __len__(self) -> int:
        return len(self.segment)

    @cached_property
    def _gone(self) -> Floats:
        """(p + 1,) way up to each part, and to the end."""
        return np.concatenate(([0.0], np.cumsum(self.way)))

    def moved(self, low: Floats | Ints, high: Floats | Ints) -> Floats:
        """How far any point of interest moves at most between places: numbers of parts, and shares of them."""
        places = np.arange(len(self) + 1)
        return np.interp(high, places, self._gone) - np.interp(low, places, self._gone)

    def stretches(self, longest: float) -> tuple[Ints, Ints]:
        """First parts (s,) of stretches without gaps, about `longest` mm or one part long, and the parts behind."""
        gap = (self.low == 0.0) & ~self.motion.joined[self.segment]
        begins = gap | (np.diff(np.floor(self._gone / longest)) > 0.0)
        first = np.flatnonzero(begins)
        return first, np.append(first[1:], len(self))

    def at(self, part: Ints, share: Floats) -> tuple[Floats, Floats]:
        """Tip and unit axis (k, 3) at shares (k,) of parts (k,)."""
        low = self.low[part]
        return self.motion.at(self.segment[part], low + share * (self.high[part] - low))


def original_cuts(program: Program) -> RuledMotion:
    """Feed moves of a CL program; arcs in short chords."""
    cutting = (program.kind == Move.LINEAR) | (program.kind == Move.ARC)
    cutting[:1] = False
    cutting[1:] &= (program.kind[:-1] != Move.FROM) | (program.kind[1:] == Move.ARC)
    pose, tip, axis = poses_and_arcs(program, _ARC_STEP)
    return _segments(tip, axis, program.line[pose], cutting[pose])


def written_cuts(nc: NcProgram) -> RuledMotion:
    """Feed elements of an NC text; arcs and curves in short chords."""
    pieces = np.ones(len(nc), np.int64)
    pieces[nc.arcs.element] = np.maximum(np.ceil(nc.arcs.sweep / _ARC_STEP), 1.0).astype(np.int64)
    pieces[nc.curves.element] = _CURVE_PARTS
    if pieces.max(initial=1) == 1:
        tip, axis, element = nc.tip, directions(nc, nc.tip, nc.second), np.arange(len(nc))
    else:
        element, share = divided(pieces)
        tip, axis = written_at(nc, element, share)
    cutting = nc.kind != Element.RAPID
    cutting[:1] = False
    return _segments(tip, axis, nc.line[element], cutting[element])


def _segments(tip: Floats, axis: Floats, line: Ints, cutting: Bools) -> RuledMotion:
    """Segments into those poses (n, 3) that are reached cutting; without those that do not move."""
    moved = np.ones(len(tip), np.bool_)
    moved[1:] = (tip[1:] != tip[:-1]).any(axis=1) | (axis[1:] != axis[:-1]).any(axis=1)
    end = np.flatnonzero(cutting & moved)
    end = end[end > 0]
    joined = np.zeros(len(end), np.bool_)
    # nothing between two segments but poses that repeat
    travelled = np.cumsum(moved & ~cutting)
    joined[1:] = travelled[end[1:]] == travelled[end[:-1]]
    tips, axes = (np.stack((each[end - 1], each[end]), axis=1) for each in (tip, axis))
    return RuledMotion(tips, axes, line[end], joined)


#: a step that is shorter, mm, has no direction
_NO_WAY = 1e-12


@dataclass(frozen=True)
class EnvelopePoints:
    """Points on an envelope, k of them."""

    #: (k, 3): mm; outward unit normal of the tool, so into the material
    point: Floats
    normal: Floats
    station: Ints  #: (k,): where along the path, counted from 0
    level: Ints  #: (k,): which point of the tool's profile, from the lowest
    side: Ints  #: 0 left of the motion, seen against the tool axis, 1 right
    line: Ints  #: (k,): CL line


def envelope_points(
    motion: RuledMotion, tool: Tool, edge: float, *, levels: int = 7, stations: int = 2000
) -> EnvelopePoints:
    """Points on the envelope of a motion, up to the cutting `edge`, mm, over the tip.

    There are `levels` points on the flank, and as many on a corner arc, at about `stations` places along the path:
    within segments, evenly, and the corners between them, where the normal is that halfway between both sides.
    """
    out, up, drop = _levels(tool, edge, levels)
    within, share, corner = _stations(motion, stations)
    sides = [_normals(motion, within, share, out, up, drop)]
    place = [motion.at(within, share)]
    order = [2 * within]
    if len(corner):
        before = _normals(motion, corner - 1, np.ones(len(corner)), out, up, drop)
        after = _normals(motion, corner, np.zeros(len(corner)), out, up, drop)
        both = before + after
        size = norm(both)[..., None]
        sides.append(np.divide(both, size, out=np.full_like(both, np.nan), where=size > 1e-6))
        place.append(motion.at(corner, np.zeros(len(corner))))
        order.append(2 * corner - 1)
    normal = np.concatenate(sides)  # (stations, sides, levels, 3)
    tip, axis = (np.concatenate(parts) for parts in zip(*place, strict=True))
    key = np.concatenate(order)
    rank = np.argsort(key, kind="stable")
    normal, tip, axis, key = normal[rank], tip[rank], axis[rank], key[rank]
    centre = tip[:, None] + up[:, None] * axis[:, None]
    point = centre[:, None] + out[:, None] * normal
    outward = np.sqrt(1.0 - drop * drop)[:, None] * normal - drop[:, None] * axis[:, None, None]
    there = np.isfinite(point).all(axis=-1)
    station, side, level = np.nonzero(there)
    return EnvelopePoints(
        point=point[there],
        normal=outward[there],
        station=station,
        level=level,
        side=side,
        line=motion.line[(key + 1) // 2][station] if len(key) else np.zeros(0, np.int64),
    )


def _levels(tool: Tool, edge: float, levels: int) -> tuple[Floats, Floats, Floats]:
    low = tool.side_from
    # in the middle of bands: an edge at the lower end belongs to the bottom as well
    flank = low + (edge - low) * (np.arange(levels) + 0.5) / levels if edge > low else np.zeros(0)
    arc = np.zeros(0)
    if tool.corner_radius > 0.0:
        lowest, highest = np.radians(90.0 - tool.tip_angle), np.radians(tool.taper)
        arc = np.sin(np.linspace(lowest, highest, levels + 1)[: levels + (not len(flank))])
        arc = arc[1:] if tool.centre_out == 0.0 else arc  # a ball's lowest point belongs to both sides
    elif not len(flank):
        flank = np.array([low])
    return tool.profile(arc, flank)


def _stations(motion: RuledMotion, stations: int) -> tuple[Ints, Floats, Ints]:
    """Segments and shares of them, and segments at whose starts points are taken: evenly among all.

    A segment has several where there are few: at inner corners most is cut too deep just where the next one begins to
    cut.
    """
    every = np.arange(len(motion))
    few = max(stations // 2, 1)
    segment, corner = (
        rows if len(rows) <= few else rows[np.unique(np.linspace(0, len(rows) - 1, few).astype(np.int64))]
        for rows in (every, every[motion.joined])
    )
    count = max(few // max(len(segment), 1), 1)
    share = (np.arange(count) + 0.5) / count
    return np.repeat(segment, count), np.tile(share, len(segment)), corner


def _normals(motion: RuledMotion, segment: Ints, share: Floats, out: Floats, up: Floats, drop: Floats) -> Floats:
    """Radial unit vectors (s, 2, l, 3) of the envelope's points, left and right; NaN where there is none."""
    tip, axis = motion.tip[segment], motion.axis[segment]
    way = tip[:, 1] - tip[:, 0]
    leaning = axis[:, 0] + share[:, None] * (axis[:, 1] - axis[:, 0])
    length = norm(leaning)[:, None]
    o = leaning / length
    turn = (axis[:, 1] - axis[:, 0]) / length
    turn = turn - dot(turn, o)[:, None] * o
    cosine = np.sqrt(1.0 - drop * drop)
    lever = (cosine * up + out * drop)[:, None]
    wanted = cosine[:, None] * way[:, None] + lever * turn[:, None]  # (s, l, 3)
    along = drop * dot(way, o)[:, None]
    flat = wanted - dot(wanted, o[:, None])[..., None] * o[:, None]
    size = norm(flat)
    size = np.where(size > _NO_WAY, size, np.nan)
    ahead, share_ahead = flat / size[..., None], along / size
    with np.errstate(invalid="ignore"):
        share_aside = np.sqrt(1.0 - share_ahead**2)  # NaN where the whole circle goes ahead or behind
    left = np.cross(o[:, None], ahead)
    sides = [share_ahead[..., None] * ahead + sign * share_aside[..., None] * left for sign in (1.0, -1.0)]
    return np.stack(sides, axis=1)


#: pairs of point and stretch, or cell, that are looked at together
_TOGETHER = 1_000_000

#: golden sections of a part: to 1e-9 of it
_SECTIONS = 43
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)

#: a part is followed up where it could be nearer by this, mm
_NEARER = 1e-9

#: share of a part that is halved no further
_CELL = 0.25

#: share of a cell by which its slope at an end is seen: where it rises from there, the end is the nearest
_SLOPE = 1e-6


#: signed distances, mm, of points `out` from the axis and `up` above the tip to what cuts
Cutter = Callable[[Floats, Floats], Floats]


def distance_to_motion(
    points: Floats, motion: RuledMotion, tool: Tool, edge: float, *, reach: float, deepest: float = np.inf
) -> Floats:
    """Signed distances (k,), mm, of points (k, 3) to a tool's swept volume: negative inside, NaN beyond `reach`.

    What is higher over the tip than the cutting `edge`, mm, does not cut. Of a point deeper than `deepest`, mm, it is
    known only that it is.
    """
    found = np.full(len(points), np.nan)
    if not len(motion) or not len(points):
        return found
    top = edge + reach
    widest = float(max(tool.side_radius(np.array([max(top, tool.side_from)]))[0], 0.5 * tool.diameter))
    step = max(0.5 * widest, reach)
    parts = motion.parts(step, top, widest)
    heights = np.linspace(0.0, top, max(int(np.ceil(top / step)), 1) + 1)
    first, stop = parts.stretches(step)
    part = (first + stop) // 2
    middle, axis = parts.at(part, np.full(len(first), 0.5))
    nodes = (middle[:, None] + heights[:, None] * axis[:, None]).reshape(-1, 3)
    tree = cKDTree(nodes, compact_nodes=False, balanced_tree=False)
    # from the point to the tool's surface, in to the axis, up to a node, and back over the way to an end of its stretch
    back = max(parts.moved(first, part + 1).max(), parts.moved(part, stop).max())
    far = reach + widest + 0.5 * (heights[1] - heights[0]) + back
    counts = tree.query_ball_point(points, far, return_length=True)

    def cutter(out: Floats, up: Floats) -> Floats:
        return np.maximum(tool.distance(out, up), up - edge)  # nothing above the edge cuts

    begin = 0
    while begin < len(points):
        end = begin + max(int(np.searchsorted(np.cumsum(counts[begin:]), _TOGETHER)), 1)
        near = tree.query_ball_point(points[begin:end], far, return_sorted=False)
        number = np.repeat(np.arange(len(near)), counts[begin:end])
        if len(number):
            stretch = np.concatenate([np.asarray(rows, np.int64) for rows in near]) // len(heights)
            number, stretch = np.divmod(np.unique(number * len(first) + stretch), len(first))
            search = _Search(points[begin:end], parts, cutter, -deepest, found[begin:end])
            search.settle(search.between(number, first[stretch], stop[stretch]))
        begin = end
    found[found > reach] = np.nan
    return found


@dataclass(frozen=True)
class _Cells:
    """Pairs of a point and a cell of the motion between two places: the number of a part, and a share of it."""

    number: Ints  #: (q,): of the point
    low: Floats
    high: Floats
    #: (q,) mm: distance of the point at both places
    at_low: Floats
    at_high: Floats

    def __len__(self) -> int:
        return len(self.number)

    def rows(self, some: Bools | slice) -> _Cells:
        return _Cells(*(each[some] for each in vars(self).values()))


@dataclass(frozen=True)
class _Search:
    """Points whose least distance to the parts of a motion is being found."""

    points: Floats
    parts: Parts
    cutter: Cutter
    deepest: float  #: mm; what is deeper inside is not looked at closely
    least: Floats  #: (k,) mm: so far, NaN where nothing was looked at

    def between(self, number: Ints, first: Ints, stop: Ints) -> _Cells:
        """Cells of points with stretches of parts."""
        low, high = first.astype(np.float64), stop.astype(np.float64)
        return _Cells(number, low, high, self._along(number, first, low), self._along(number, stop - 1, high))

    def _along(self, number: Ints, part: Ints, place: Floats) -> Floats:
        return _distances(self.points[number], self.parts, self.cutter, part, place - part)

    def settle(self, cells: _Cells) -> None:
        """Halve cells that may be nearer, and find the least in those that are small."""
        while True:
            np.fmin.at(self.least, cells.number, np.minimum(cells.at_low, cells.at_high))
            # between two places the distance falls by no more than the tool moves there
            bound = 0.5 * (cells.at_low + cells.at_high - self.parts.moved(cells.low, cells.high))
            least = self.least[cells.number]
            cells = cells.rows((bound < least - _NEARER) & (least > self.deepest))
            if not (cells.high - cells.low > _CELL).any():
                return self._end(cells)
            if len(cells) > _TOGETHER:
                half = len(cells) // 2
                self.settle(cells.rows(slice(half)))
                cells = cells.rows(slice(half, None))
                continue
            middle = 0.5 * (cells.low + cells.high)
            middle = np.where(cells.high - cells.low > 1.0, np.floor(middle), middle)
            there = self._along(cells.number, middle.astype(np.int64), middle)
            halves = ((cells.low, middle), (middle, cells.high), (cells.at_low, there), (there, cells.at_high))
            cells = _Cells(np.tile(cells.number, 2), *map(np.concatenate, halves))

    def _end(self, cells: _Cells) -> None:
        """Least in cells of one part: it is at an end unless the distance falls from both."""
        part, step = cells.low.astype(np.int64), _SLOPE * (cells.high - cells.low)
        inside = self._along(cells.number, part, cells.low + step) < cells.at_low
        inside &= self._along(cells.number, part, cells.high - step) < cells.at_high
        cells, part = cells.rows(inside), part[inside]
        points = self.points[cells.number]
        closer = _golden(points, self.parts, self.cutter, part, cells.low - part, cells.high - part)
        np.fmin.at(self.least, cells.number, closer)


def _golden(points: Floats, parts: Parts, cutter: Cutter, part: Ints, low: Floats, high: Floats) -> Floats:
    """Least distance between two shares of a part: it has one minimum there, exactly so where the axis is steady."""
    one, other = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_one = _distances(points, parts, cutter, part, one)
    at_other = _distances(points, parts, cutter, part, other)
    for _ in range(_SECTIONS):
        left = at_one < at_other
        low, high = np.where(left, low, one), np.where(left, other, high)
        fresh = np.where(left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        value = _distances(points, parts, cutter, part, fresh)
        one, other = np.where(left, fresh, other), np.where(left, one, fresh)
        at_one, at_other = np.where(left, value, at_other), np.where(left, at_one, value)
    return np.minimum(at_one, at_other)


def _distances(points: Floats, parts: Parts, cutter: Cutter, part: Ints, share: Floats) -> Floats:
    tip, axis = parts.at(part, share)
    arm = points - tip
    up = dot(arm, axis)
    return cutter(norm(arm - up[:, None] * axis), up)
