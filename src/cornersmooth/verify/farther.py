"""A second, wider look for what an original vertex is near to, where the first one has found nothing near enough.

The walk stays on a segment as long as the next is not clearly nearer. Where many short blocks lie within a digit or two
of a corner - the pole, and machines that know nothing of the tip, have such - it leaves the segment late, and the
nearest blocks are then farther back than a look around its place goes.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.blocks import Block, Matcher
from cornersmooth.verify.stops import digit_errors
from cornersmooth.verify.walking import Track

#: original vertices of a block that are looked at once more, and written segments looked at for each
_MOST_ROWS, _MOST_SEGMENTS = 2048, 1 << 14


def look_farther(
    matcher: Matcher, block: Block, vertex: Ints, low: Ints, high: Ints, segment: Ints, at: Floats
) -> None:
    """Find nearer written segments for original vertices that are farther than the tolerance, in place.

    All written vertices are looked at whose places are within `Matcher.near` of the vertex, along the original.

    Parameters
    ----------
    matcher : Matcher
    block : Block
    vertex : (k,) int64
    low, high : (k,) int64
        First and last segment allowed.
    segment, at : (k,) int64, float64
        Where they have been found.
    """
    six, track = block.six, matcher.track
    start = six.take(segment, axis=0)
    away = track.six.take(vertex, axis=0) - start - at[:, None] * (six.take(segment + 1, axis=0) - start)
    square = away * away
    rows = np.flatnonzero(np.maximum(square[:, :3].sum(axis=1), square[:, 3:].sum(axis=1)) > matcher.tolerance**2)
    if not len(rows):
        return
    around = _Around(matcher, block)
    for k in rows[:_MOST_ROWS].tolist():
        first, last = around.vertices(int(vertex[k]))
        first = max(first, int(low[k]), int(segment[k]) - _MOST_SEGMENTS // 2)
        last = min(last, int(high[k]) + 1, int(segment[k]) + _MOST_SEGMENTS // 2)
        if last <= first:
            continue
        begin = six[first:last]
        way = six[first + 1 : last + 1] - begin
        rest = track.six[vertex[k]] - begin
        size = np.einsum("ij,ij->i", way, way)
        share = np.einsum("ij,ij->i", rest, way)
        share = np.clip(np.divide(share, size, out=np.zeros_like(share), where=size > 0), 0.0, 1.0)
        rest -= share[:, None] * way
        off = np.einsum("ij,ij->i", rest, rest)
        best = int(np.argmin(off))
        if off[best] < square[k].sum():
            segment[k], at[k] = first + best, share[best]


def passed_nearby(matcher: Matcher, block: Block, vertex: Ints, tip: Floats, axis: Floats) -> Bools:
    """(k,) whether poses are named exactly by any element whose place is within `Matcher.near` of theirs.

    Poses a digit apart are not told apart by their distance, nor are those between which the path goes to and fro.

    Parameters
    ----------
    matcher : Matcher
    block : Block
    vertex : (k,) int64
        The poses as vertices of the original.
    tip, axis : (k, 3) float64
    """
    found = np.zeros(len(vertex), np.bool_)
    if not len(vertex):
        return found
    around = _Around(matcher, block)
    for k in range(min(len(vertex), _MOST_ROWS)):
        first, last = around.vertices(int(vertex[k]))
        element = np.unique(block.written.trail.owner[first : min(last, first + _MOST_SEGMENTS) + 1])
        same, _ = digit_errors(matcher.nc, element, tip[k], axis[k], matcher.axis_length)
        found[k] = same.any()
    return found


class _Around:
    """Written vertices by their places along the original."""

    def __init__(self, matcher: Matcher, block: Block) -> None:
        self.length, self.near = matcher.track.length, matcher.near
        self.on = np.flatnonzero(block.on)
        self.place = np.maximum.accumulate(matcher.track.way(block.segment[self.on], block.fraction[self.on]))

    def vertices(self, vertex: int) -> tuple[int, int]:
        """First and last written vertex that may have to do with an original one."""
        middle = self.length[vertex]
        first = max(int(np.searchsorted(self.place, middle - self.near)) - 1, 0)
        last = min(int(np.searchsorted(self.place, middle + self.near, side="right")), len(self.on) - 1)
        return int(self.on[first]), int(self.on[last])


def way_apart(track: Track, here: float, there: float) -> float:
    """How far the original goes away from one place on its way to another, mm; places are path lengths.

    Less than the length of the way where it goes to and fro.
    """
    length = track.length
    low, high = np.searchsorted(length, sorted((here, there)))
    if min(here, there) < 0 or high == len(length) or high - low > _MOST_SEGMENTS:
        return abs(there - here)
    ends = []
    for place in (here, there):
        k = min(int(np.searchsorted(length, place, side="right")), len(length) - 1)
        share = (place - length[k - 1]) / max(length[k] - length[k - 1], 1e-300)
        ends.append(track.six[k - 1] + share * (track.six[k] - track.six[k - 1]))
    return float(np.linalg.norm(np.vstack((track.six[low:high], ends[1])) - ends[0], axis=1).max())
