"""Curves between their knots: bounds by control points, and a search where the bounds do not settle it.

The part of a curve between two knots lies in the hull of its own control points, and the distance from a straight
segment is a convex function; so no point of it is farther from a segment than the farthest control point.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.curves import CurveGroup
from cornersmooth.nc_reader.tool import directions, unit, written_at
from cornersmooth.verify.common_place import axis_off_at
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import foot_share, larger_square, nearest_places

#: samples between two knots where the hull alone does not settle it
_SAMPLES = 32

#: segments of the original that are looked at beyond both ends of a curve
_BESIDE = 3

#: curves searched at a time, and those at most that leave the tolerance at knots: these are found already
_CURVES_AT_ONCE, _MOST_KNOWN = 1 << 12, 256

#: part of the largest deviation of a curve's ends by which its hull may exceed it unsearched
_HULL_SLACK = 1e-3


def hull_gaps(match: Match, limit: float) -> tuple[Floats, Ints, Floats, Floats] | None:
    """Deviations from the original of those curves whose hull reaches beyond the tolerance between two knots.

    Returns
    -------
    place : (k,) float64
        On the original trail.
    element : (k,) int64
    tip, axis_point : (k,) float64, mm
        None where there is no such curve.
    """
    suspects = [_suspects(match, group, limit) for group in match.written.curves]
    if not suspects:
        return None
    element, reached, at_knots = (np.concatenate(columns) for columns in zip(*suspects, strict=True))
    # curves that leave the tolerance at their knots already are said to: of those only the farthest are looked at
    known = np.flatnonzero(at_knots > limit)
    known = known[np.argsort(-reached[known], kind="stable")[:_MOST_KNOWN]]
    element = element[np.sort(np.append(np.flatnonzero(at_knots <= limit), known))]
    if not len(element):
        return None
    trail, first = match.written.trail, match.written.first
    end = trail.last[element - first]
    begin = np.where(element > first, trail.last[np.maximum(element - first - 1, 0)], 0)
    begin = np.where(match.on[begin], begin, end)  # a stretch begins in the middle of nothing
    # a curve may lead past many segments: it is looked at from its middle to both of its ends
    low, high = np.minimum(match.segment[begin], match.segment[end]), match.segment[end]
    reach = np.exp2(np.ceil(np.log2(_BESIDE + (high - low + 1) // 2))).astype(np.int64)
    tip, axis = np.zeros(len(element)), np.zeros(len(element))
    for size in np.unique(reach).tolist():
        of_size = np.flatnonzero(reach == size)
        for start in range(0, len(of_size), _CURVES_AT_ONCE):
            rows = of_size[start : start + _CURVES_AT_ONCE]
            tip[rows], axis[rows] = _searched(match, element[rows], (low[rows] + high[rows]) // 2, size)
    return match.place[end - 1], element, tip, axis


def _searched(match: Match, element: Ints, middle: Ints, reach: int) -> tuple[Floats, Floats]:
    """(k,) largest deviations of tip and axis point at samples of curves, from segments around `middle` (k,)."""
    grid = np.linspace(0.0, 1.0, 2 * _SAMPLES + 1)
    owner = np.repeat(element, len(grid))
    tip, axis = written_at(match.nc, owner, np.tile(grid, len(element)))
    six = match.task.six(tip, axis)
    vertex = match.written.trail.last[owner - match.written.first]
    result = []
    if match.task.own_axis:
        middle_of = np.repeat(middle, len(grid))
        off = axis_off_at(match, tip, axis, middle_of, reach, match.low[vertex], match.high[vertex])
    for metric in ("tip", "axis point"):
        if metric == "axis point" and match.task.own_axis:
            result.append(off.reshape(len(element), len(grid)))
            continue
        segment, at, _ = nearest_places(
            six,
            match.path.six,
            np.repeat(middle, len(grid)),
            reach,
            match.low[vertex],
            match.high[vertex],
            metric,
        )
        theirs = match.original.trail
        their_tip = theirs.tip[segment] + at[:, None] * (theirs.tip[segment + 1] - theirs.tip[segment])
        their_axis = unit(theirs.axis[segment] + at[:, None] * (theirs.axis[segment + 1] - theirs.axis[segment]))
        gap = match.task.gap(tip, axis, their_tip, their_axis)
        result.append((gap.tip if metric == "tip" else gap.axis_point).reshape(len(element), len(grid)))
    return result[0].max(axis=1), result[1].max(axis=1)


def _suspects(match: Match, group: CurveGroup, limit: float) -> tuple[Ints, Floats, Floats]:
    """Curves with a control point between knots farther than the tolerance and than the knots.

    Returns their elements (k,), and the distances of their farthest control points and knots, mm.
    """
    trail, first = match.written.trail, match.written.first
    element = match.nc.curves.element[group.index]
    end = trail.last[element - first]
    keep = match.on[end].copy()
    if len(group.spans) == 3 and group.points.shape[1] == 5:
        keep &= ~_plain_corners(match, group, end)
    if not keep.any():
        return element[:0], np.zeros(0), np.zeros(0)
    group, element, end = group.only(keep), element[keep], end[keep]
    spans = len(group.spans) - 1
    doubtful = np.zeros(len(element), np.bool_)
    reached, at_knots = np.zeros(len(element)), np.zeros(len(element))
    for k in range(spans):
        inner, _ = group.bezier(k)
        before, after = end - (spans - k), end - (spans - k) + 1
        ends = np.maximum(_off(match, match.six[before], before), _off(match, match.six[after], before))
        for point in range(1, inner.shape[1] - 1):
            tip = inner[:, point, :3]
            axis = directions(match.nc, tip, inner[:, point, 3:])
            six = match.task.six(tip, axis)
            off = np.minimum(_off(match, six, before), _off(match, six, after))
            doubtful |= (off > limit) & (off > ends * (1 + _HULL_SLACK))
            np.maximum(reached, off, out=reached)
        np.maximum(at_knots, ends, out=at_knots)
    return element[doubtful], reached[doubtful], at_knots[doubtful]


def _plain_corners(match: Match, group: CurveGroup, end: Ints) -> Bools:
    """(k,) whether a five-point curve has its middle point on an original vertex and the others on lines to it.

    Then each half is farthest from its leg at the middle knot, whatever the weights: its hull has no other point off
    the leg.
    """
    nc, points = match.nc, group.points
    if nc.second_is != "point" or match.task.own_axis:
        return np.zeros(len(points), np.bool_)
    # second points at any distance from the tip, all of a curve as many times as far as the axis points
    lever = points[..., 3:] - points[..., :3]
    share = match.task.axis_length / np.linalg.norm(lever[:, 2], axis=1)
    points = np.concatenate((points[..., :3], points[..., :3] + share[:, None, None] * lever), axis=2)
    corner = np.minimum(match.segment[end - 2] + 1, len(match.path.six) - 1)
    off = points[:, 2] - match.path.six.take(corner, axis=0)
    room = match.margin**2
    plain: Bools = np.einsum("ij,ij->i", off, off) <= room
    for outer, inner in ((0, 1), (4, 3)):
        leg = points[:, outer] - points[:, 2]
        way = points[:, inner] - points[:, 2]
        size = np.einsum("ij,ij->i", leg, leg)
        share = np.divide(np.einsum("ij,ij->i", way, leg), size, out=np.zeros(len(leg)), where=size > 0)
        way -= share[:, None] * leg
        plain &= (share >= 0) & (share <= 1) & (np.einsum("ij,ij->i", way, way) <= room)
    return plain


def _off(match: Match, six: Floats, vertex: Ints) -> Floats:
    """Larger distance, of tip or axis point, from the original segment that a vertex lies on."""
    segment = match.segment[vertex]
    start = match.path.six.take(segment, axis=0)
    way = match.path.six.take(segment + 1, axis=0)
    way -= start
    away = six - start
    away -= foot_share(away, way)[:, None] * way
    return np.sqrt(larger_square(away))
