"""A second, wider look for what an original vertex is near to, where the first one has found nothing near enough.

Where many short blocks lie within a digit or two of a corner - the pole, and machines that know nothing of the tip,
have such - the nearest blocks may be farther off than a look around a place goes.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.match import Match
from cornersmooth.verify.polyline import Polyline
from cornersmooth.verify.rapids import digit_errors

#: original vertices of a batch that are looked at once more, and written segments looked at for each
_MOST_ROWS, _MOST_SEGMENTS = 2048, 1 << 14


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
    around = _Around(match)
    for k in rows[:_MOST_ROWS].tolist():
        first, last = around.vertices(int(vertex[k]))
        first = max(first, int(low[k]), int(segment[k]) - _MOST_SEGMENTS // 2)
        last = min(last, int(high[k]) + 1, int(segment[k]) + _MOST_SEGMENTS // 2)
        if last <= first:
            continue
        begin = six[first:last]
        way = six[first + 1 : last + 1] - begin
        rest = path.six[vertex[k]] - begin
        size = np.einsum("ij,ij->i", way, way)
        share = np.einsum("ij,ij->i", rest, way)
        share = np.clip(np.divide(share, size, out=np.zeros_like(share), where=size > 0), 0.0, 1.0)
        rest -= share[:, None] * way
        off = np.einsum("ij,ij->i", rest, rest)
        best = int(np.argmin(off))
        if off[best] < square[k].sum():
            segment[k], at[k] = first + best, share[best]


def nearest_alone(
    point: Floats, six: Floats, segment: Ints, low: Ints, high: Ints, radius: float, column: slice
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
    column : slice
        Which of tip and axis point counts.

    Returns
    -------
    segment : (k,) int64
    fraction : (k,) float64
    distance : (k,) float64, mm
        inf where the known segment itself is not that near, and beyond the first `_MOST_ROWS` rows.
    """
    found, fraction, distance = segment.copy(), np.zeros(len(point)), np.full(len(point), np.inf)
    for k in range(min(len(point), _MOST_ROWS)):
        first = max(int(low[k]), int(segment[k]) - _MOST_SEGMENTS // 2)
        last = min(int(high[k]) + 1, int(segment[k]) + _MOST_SEGMENTS // 2)
        vertex = six[first : last + 1, column]
        rest = point[k, column] - vertex
        outside = np.einsum("ij,ij->i", rest, rest) > radius**2
        here = int(segment[k]) - first
        before, behind = np.flatnonzero(outside[: here + 1]), np.flatnonzero(outside[here + 1 :])
        begin = max(int(before[-1]) if len(before) else 0, 0)
        end = here + 1 + int(behind[0]) if len(behind) else len(vertex) - 1
        way, rest = np.diff(vertex[begin : end + 1], axis=0), rest[begin:end]
        size = np.einsum("ij,ij->i", way, way)
        share = np.einsum("ij,ij->i", rest, way)
        share = np.clip(np.divide(share, size, out=np.zeros_like(share), where=size > 0), 0.0, 1.0)
        rest = rest - share[:, None] * way
        off = np.sqrt(np.einsum("ij,ij->i", rest, rest))
        if here < end and off[here - begin] <= radius:  # else the known place is not on what is allowed
            best = int(np.argmin(off))
            found[k], fraction[k], distance[k] = first + begin + best, share[best], off[best]
    return found, fraction, distance


def passed_nearby(match: Match, vertex: Ints, tip: Floats, axis: Floats) -> Bools:
    """(k,) whether poses are named exactly by any element whose place is within `Matcher.near` of theirs.

    Poses a digit apart are not told apart by their distance, nor are those between which the path goes to and fro.

    Parameters
    ----------
    match : Match
    vertex : (k,) int64
        The poses as vertices of the original.
    tip, axis : (k, 3) float64
    """
    found = np.zeros(len(vertex), np.bool_)
    if not len(vertex):
        return found
    around = _Around(match)
    for k in range(min(len(vertex), _MOST_ROWS)):
        first, last = around.vertices(int(vertex[k]))
        element = np.unique(match.written.trail.owner[first : min(last, first + _MOST_SEGMENTS) + 1])
        same, _ = digit_errors(match.nc, element, tip[k], axis[k], match.axis_length)
        found[k] = same.any()
    return found


class _Around:
    """Written vertices by their places along the original."""

    def __init__(self, match: Match) -> None:
        self.length, self.near = match.path.length, match.near
        self.on = np.flatnonzero(match.on)
        self.place = np.maximum.accumulate(match.path.length_at(match.segment[self.on], match.fraction[self.on]))

    def vertices(self, vertex: int) -> tuple[int, int]:
        """First and last written vertex that may have to do with an original one."""
        middle = self.length[vertex]
        first = max(int(np.searchsorted(self.place, middle - self.near)) - 1, 0)
        last = min(int(np.searchsorted(self.place, middle + self.near, side="right")), len(self.on) - 1)
        return int(self.on[first]), int(self.on[last])


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
