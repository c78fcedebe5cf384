"""A second, wider look for what an original vertex is near to, where the first one has found nothing near enough.

The walk stays on a segment as long as the next is not clearly nearer. Where many short blocks lie within a digit or two
of a corner - the pole, and machines that know nothing of the tip, have such - it leaves the segment late, and the
nearest blocks are then farther back than a look around its place goes.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats, Ints
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
    on = np.flatnonzero(block.on)
    own = block.segment[on]
    place = np.maximum.accumulate(track.length[own] + block.fraction[on] * (track.length[own + 1] - track.length[own]))
    for k in rows[:_MOST_ROWS].tolist():
        middle = track.length[vertex[k]]
        first = on[max(int(np.searchsorted(place, middle - matcher.near)) - 1, 0)]
        last = on[min(int(np.searchsorted(place, middle + matcher.near, side="right")), len(on) - 1)]
        first = max(int(first), int(low[k]), int(segment[k]) - _MOST_SEGMENTS // 2)
        last = min(int(last), int(high[k]) + 1, int(segment[k]) + _MOST_SEGMENTS // 2)
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


def passed_nearby(matcher: Matcher, element: int, first: int, last: int, tip: Floats, axis: Floats) -> bool:
    """Whether a pose is named exactly by an element near the one it was found at.

    All elements count up to the first that ends elsewhere: poses a digit apart are not told apart by their distance.

    Parameters
    ----------
    matcher : Matcher
    element : int
    first, last : int
        Elements allowed.
    tip, axis : (1, 3) float64
    """
    for begin, step in ((element - 1, -1), (element, 1)):
        k = begin
        while first <= k <= last:
            same, off = digit_errors(matcher.nc, np.array([k]), tip, axis, matcher.axis_length)
            if same[0]:
                return True
            if off[0] > matcher.margin:
                break
            k += step
    return False


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
