"""Distance of points to the volume that a moving tool sweeps: the least over the motion of the distance to the tool.

A tree of points on the tool axis finds stretches of the motion that may be nearest. They are halved, and left out by
bounds: no point of the tool moves farther than the ends of its axis and its rim do. Golden sections settle what is left
and has its minimum inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cornersmooth.arrays import dot, norm
from cornersmooth.geometry.tool import Tool
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.surface.motion import Parts, RuledMotion

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
