"""Distance of points to the volume that a moving tool sweeps: the least over the motion of the distance to the tool.

Places of the motion that may be nearest are found by a tree of points on the tool axis. What is left is settled by
bounds, since no point of the tool moves farther than the ends of its axis and its rim do, and then by golden sections.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from cornersmooth.arrays.vectors import dot, norm
from cornersmooth.geometry.tool import Tool
from cornersmooth.model import Floats, Ints
from cornersmooth.surface.motion import Parts, RuledMotion

#: pairs of point and part that are looked at together
_TOGETHER = 1_000_000

#: golden sections of a part: to 1e-9 of it
_SECTIONS = 43
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)

#: a part is followed up where it could be nearer by this, mm
_NEARER = 1e-9

#: samples of a part before bounds decide
_SAMPLES = np.linspace(0.0, 1.0, 5)


#: signed distances, mm, of points `out` from the axis and `up` above the tip to what cuts
Cutter = Callable[[Floats, Floats], Floats]


def distance_to_motion(points: Floats, motion: RuledMotion, tool: Tool, edge: float, *, reach: float) -> Floats:
    """Signed distances (k,), mm, of points (k, 3) to a tool's swept volume: negative inside, NaN beyond `reach`.

    What is higher over the tip than the cutting `edge`, mm, does not cut.
    """
    found = np.full(len(points), np.nan)
    if not len(motion) or not len(points):
        return found
    top = edge + reach
    widest = float(max(tool.side_radius(np.array([max(top, tool.side_from)]))[0], 0.5 * tool.diameter))
    step = max(0.5 * widest, reach)
    parts = motion.parts(step, top, widest)
    heights = np.linspace(0.0, top, max(int(np.ceil(top / step)), 1) + 1)
    middle, axis = parts.at(np.arange(len(parts)), np.full(len(parts), 0.5))
    nodes = (middle[:, None] + heights[:, None] * axis[:, None]).reshape(-1, 3)
    tree = cKDTree(nodes, compact_nodes=False, balanced_tree=False)
    # from the point to the tool's surface, in to the axis, up to a node, and back over half the way of a part
    far = reach + widest + 0.5 * (heights[1] - heights[0]) + 0.5 * step
    counts = tree.query_ball_point(points, far, return_length=True)

    def cutter(out: Floats, up: Floats) -> Floats:
        return np.maximum(tool.distance(out, up), up - edge)  # nothing above the edge cuts

    begin = 0
    while begin < len(points):
        end = begin + max(int(np.searchsorted(np.cumsum(counts[begin:]), _TOGETHER)), 1)
        near = tree.query_ball_point(points[begin:end], far, return_sorted=False)
        number = np.repeat(np.arange(len(near)), counts[begin:end])
        if len(number):
            part = np.concatenate([np.asarray(rows, np.int64) for rows in near]) // len(heights)
            key = np.unique(number * len(parts) + part)
            found[begin:end] = _least(points[begin:end], parts, cutter, key // len(parts), key % len(parts))
        begin = end
    found[found > reach] = np.nan
    return found


def _least(points: Floats, parts: Parts, cutter: Cutter, number: Ints, part: Ints) -> Floats:
    """Least distance of each point over its pairs with parts; pairs are sorted by point."""
    sampled = np.stack(
        [_distances(points[number], parts, cutter, part, np.full(len(number), share)) for share in _SAMPLES]
    )
    least = np.full(len(points), np.nan)
    first = np.flatnonzero(np.concatenate(([True], number[1:] != number[:-1])))
    owners = number[first]
    least[owners] = np.minimum.reduceat(sampled.min(axis=0), first)
    # between neighbouring samples the distance falls by no more than the tool moves there
    fall = 0.5 * parts.way[part] / (len(_SAMPLES) - 1)
    bound = 0.5 * (sampled[:-1] + sampled[1:]) - fall
    cell, pair = np.nonzero(bound < least[number] - _NEARER)
    if len(pair):
        low, high = _SAMPLES[cell], _SAMPLES[cell + 1]
        closer = _golden(points[number[pair]], parts, cutter, part[pair], low, high)
        np.fmin.at(least, number[pair], closer)
    return least


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
