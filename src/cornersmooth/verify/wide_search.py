"""A second, wider look for what an original vertex is near to, where the first one has found nothing near enough.

Where many short blocks lie within a digit or two of a corner - the pole, and machines that know nothing of the tip,
have such - the nearest blocks may be farther off than a look around a place goes.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import COLUMNS, Metric, foot_share, nearest_places
from cornersmooth.verify.polyline import Polyline
from cornersmooth.verify.rapids import ARITHMETIC

#: original vertices of a batch that are looked at once more, and written segments looked at for each
_MOST_ROWS, _MOST_SEGMENTS = 2048, 1 << 14

#: segments that are looked at in one go; and on either side of a place at first
_AT_ONCE, _FEW = 1 << 16, 8


def look_farther(match: Match, vertex: Ints, low: Ints, high: Ints, segment: Ints, at: Floats) -> None:
    """Find nearer written segments for original vertices that are farther than the tolerance, in place.

    All written vertices are looked at whose places are within `Matcher.near` of the vertex, along the original.

    Parameters
    ----------
    match : Match
    vertex : (k,) int64
    low, high : (k,) int64
        First and last segment allowed.
    segment, at : (k,) int64, float64
        Where they have been found.
    """
    six, path = match.six, match.path
    start = six.take(segment, axis=0)
    away = path.six.take(vertex, axis=0) - start - at[:, None] * (six.take(segment + 1, axis=0) - start)
    square = away * away
    rows = np.flatnonzero(np.maximum(square[:, :3].sum(axis=1), square[:, 3:].sum(axis=1)) > match.tolerance**2)
    if not len(rows):
        return
    rows = rows[:_MOST_ROWS]
    first, last = _Around(match).vertices(vertex[rows])
    first = np.maximum.reduce((first, low[rows], segment[rows] - _MOST_SEGMENTS // 2))
    last = np.minimum.reduce((last, high[rows] + 1, segment[rows] + _MOST_SEGMENTS // 2))
    some = last > first
    rows, first, last = rows[some], first[some], last[some]
    if not len(rows):
        return
    for part in _even_parts(last - first):
        own, count = rows[part], (last - first)[part]
        begins = np.cumsum(count) - count
        among = np.arange(count.sum()) + np.repeat(first[part] - begins, count)
        begin = six.take(among, axis=0)
        way = six.take(among + 1, axis=0) - begin
        rest = np.repeat(path.six[vertex[own]], count, axis=0) - begin
        share = foot_share(rest, way)
        rest -= share[:, None] * way
        off = np.einsum("ij,ij->i", rest, rest)
        least = np.minimum.reduceat(off, begins)
        best = np.flatnonzero(off == np.repeat(least, count))
        best = best[np.searchsorted(best, begins)]  # the first of each
        nearer = np.flatnonzero(least < square[own].sum(axis=1))
        segment[own[nearer]], at[own[nearer]] = among[best[nearer]], share[best[nearer]]


def _even_parts(count: Ints) -> list[slice]:
    """Rows that are taken at a time, so that no more than about `_AT_ONCE` segments are looked at."""
    edges = np.flatnonzero(np.diff(np.cumsum(count) // _AT_ONCE, prepend=-1))
    return [slice(a, b) for a, b in zip(edges.tolist(), [*edges[1:].tolist(), len(count)], strict=True)]


def nearest_alone(
    point: Floats, six: Floats, segment: Ints, low: Ints, high: Ints, radius: float, metric: Metric
) -> tuple[Ints, Floats, Floats]:
    """Nearest place for tip or axis point alone, as far as the path stays near on either side of a known place.

    Where tool axes turn much, tip and axis point may keep the tolerance many short segments apart. Only what is
    connected within `radius` counts, so that another turn of a spiral does not.

    Parameters
    ----------
    point : (k, 6) float64
    six : (v, 6) float64
        Vertices of the path.
    segment : (k,) int64
        Where on it the points are.
    low, high : (k,) int64
        First and last segment allowed.
    radius : float, mm
    metric : Metric
        Which of tip and axis point counts.

    Returns
    -------
    segment : (k,) int64
    fraction : (k,) float64
    distance : (k,) float64, mm
        inf where the known segment itself is not that near, and beyond the first `_MOST_ROWS` rows.
    """
    column = COLUMNS[metric]
    found, fraction, distance = segment.copy(), np.zeros(len(point)), np.full(len(point), np.inf)
    rows = np.flatnonzero((low <= segment) & (segment <= high))[:_MOST_ROWS]
    square = nearest_places(point[rows], six, segment[rows], 0, segment[rows], segment[rows], metric)[2]
    rows = rows[square <= (radius + ARITHMETIC) ** 2]
    for reach in (_FEW, _MOST_SEGMENTS // 2):
        step = max(_AT_ONCE // (2 * reach), 1)
        left = []
        for begin in range(0, len(rows), step):
            own = rows[begin : begin + step]
            middle, limits = segment[own], (low[own], high[own])
            whole, near, *place = _connected(point[own, column], six[:, column], middle, limits, radius, reach)
            whole |= reach > _FEW
            left.append(own[~whole])
            own = own[whole & near]
            found[own], fraction[own], distance[own] = (values[whole & near] for values in place)
        rows = np.concatenate(left) if left else rows[:0]
    return found, fraction, distance


def _connected(
    point: Floats, vertices: Floats, middle: Ints, limits: tuple[Ints, Ints], radius: float, reach: int
) -> tuple[Bools, Bools, Ints, Floats, Floats]:
    """Nearest places (k,) on what is connected with segments and near, `reach` segments on either side at most.

    Returns whether the path is left on either side within the reach, or ends there; whether the segment itself is
    near; segments, fractions and distances.
    """
    low, high = limits
    offset = np.arange(
        -min(reach, int((middle - low).max(initial=0))), min(reach, int((high - middle).max(initial=0))) + 2
    )
    index = middle[:, None] + offset
    vertex = vertices.take(np.clip(index, 0, len(vertices) - 1), axis=0)
    rest = point[:, None] - vertex
    outside = np.einsum("kmi,kmi->km", rest, rest) > radius**2
    # segments count from the last vertex outside in front of the known one to the first behind it
    behind, columns = offset > 0, np.arange(len(offset))
    begin = np.where((outside | (index <= low[:, None])) & ~behind, columns, -1).max(axis=1)
    end = np.where((outside | (index > high[:, None])) & behind, columns, len(offset)).min(axis=1)
    whole = (begin >= 0) & (end < len(offset))
    way = np.diff(vertex, axis=1)
    share = foot_share(rest[:, :-1], way)
    rest = rest[:, :-1] - share[..., None] * way
    off = np.sqrt(np.einsum("kmi,kmi->km", rest, rest))
    near = off[:, int(np.flatnonzero(offset == 0)[0])] <= radius
    off[(columns[:-1] < begin[:, None]) | (columns[:-1] >= end[:, None])] = np.inf
    best = np.argmin(off, axis=1)
    here = np.arange(len(point))
    return whole, near, middle + offset[best], share[here, best], off[here, best]


class _Around:
    """Written vertices by their places along the original."""

    def __init__(self, match: Match) -> None:
        self.length, self.near = match.path.length, match.near
        self.on = np.flatnonzero(match.on)
        self.place = np.maximum.accumulate(match.path.length_at(match.segment[self.on], match.fraction[self.on]))

    def vertices(self, vertex: Ints) -> tuple[Ints, Ints]:
        """(k,) first and last written vertex that may have to do with original ones."""
        middle = self.length[vertex]
        first = np.maximum(np.searchsorted(self.place, middle - self.near) - 1, 0)
        last = np.minimum(np.searchsorted(self.place, middle + self.near, side="right"), len(self.on) - 1)
        return self.on[first], self.on[last]


def way_apart(path: Polyline, here: float, there: float) -> float:
    """How far the original goes away from one place on its way to another, mm; places are path lengths.

    Less than the length of the way where it goes to and fro.
    """
    length = path.length
    low, high = np.searchsorted(length, sorted((here, there)))
    if min(here, there) < 0 or high == len(length) or high - low > _MOST_SEGMENTS:
        return abs(there - here)
    ends = []
    for place in (here, there):
        k = min(int(np.searchsorted(length, place, side="right")), len(length) - 1)
        share = (place - length[k - 1]) / max(length[k] - length[k - 1], 1e-300)
        ends.append(path.six[k - 1] + share * (path.six[k] - path.six[k - 1]))
    return float(np.linalg.norm(np.vstack((path.six[low:high], ends[1])) - ends[0], axis=1).max())
