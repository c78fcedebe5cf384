"""Places of written vertices on the original, found for all of them at once where there is no doubt.

Both motions are nearly equally long, so that the path length tells where about a vertex is, and the nearest segment is
found from there: first for few vertices, which tell more exactly where about those between them are. Where the places
of a lane then follow one another and none is far off, they are what a walker would find, and more exactly; every other
lane is left to the walker.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.nearest import climb, nearest_places, nearest_segments
from cornersmooth.verify.stops import ARITHMETIC
from cornersmooth.verify.walking import Lanes, Track

#: of so many vertices the place of one is found first
_STRIDE = 32

#: how much longer one motion may be than the other between neighbouring vertices, in distances that are doubtful
_SHORTCUT = 2.0

#: segments looked at on either side of a repeated pose
_BEYOND_REPEATED = 4


def glide(
    six: Floats, length: Floats, track: Track, lanes: Lanes, far: float
) -> tuple[Ints, Ints, Floats, Floats, Bools]:
    """Find the places of all vertices of lanes but their first.

    Parameters
    ----------
    six : (v, 6) float64
        Written vertices.
    length : (v,) float64, mm
        Path length up to them.
    track : Track
    lanes : Lanes
        k of them, in order.
    far : float, mm
        From this distance on a place is doubtful.

    Returns
    -------
    vertex, segment : (n,) int64
    fraction, distance : (n,) float64
    good : (k,) bool
        Lanes whose places leave no doubt.
    """
    first, start = lanes.first, lanes.start
    count = lanes.last - first
    owner = np.repeat(np.arange(len(lanes)), count)
    head = np.cumsum(count) - count
    vertex = np.arange(len(owner)) + (first + 1 - head)[owner]
    begin = track.way(start, lanes.fraction)
    end = track.length[lanes.stop]
    joined = np.flatnonzero(first[1:] == lanes.last[:-1])
    end[joined] = begin[joined + 1]
    way = length[lanes.last] - length[first]
    scale = np.divide(end - begin, way, out=np.zeros(len(way)), where=way > 0)
    about = length[vertex]
    about -= length[first][owner]
    about *= scale[owner]
    about += begin[owner]
    point = six.take(vertex, axis=0)
    low, high = start[owner], (lanes.stop - 1)[owner]
    few = np.arange(_STRIDE - 1, len(owner), _STRIDE)
    segment, fraction, _ = _nearest(point[few], track, about[few], low[few], high[few])
    off = track.way(segment, fraction) - about[few]
    some = np.flatnonzero(count)
    known = np.concatenate((head[some], (head + count)[some] - 1, few))
    order = np.argsort(known, kind="stable")
    about += np.interp(np.arange(len(owner)), known[order], np.append(np.zeros(2 * len(some)), off)[order])
    segment, fraction, square = _nearest(point, track, about, low, high)
    distance = np.sqrt(square)
    gone = track.way(segment, fraction)
    step = gone - np.concatenate(([0.0], gone[:-1]))
    step[head[some]] = gone[head[some]] - begin[some]
    # a rounding is shorter than its corner by no more than twice its deviation: else a part is left out, or run again
    apart = np.abs(step - (length[vertex] - length[vertex - 1]))
    doubtful = (step < -ARITHMETIC) | (distance > far) | (apart > _SHORTCUT * far)
    tail = some[np.isin(some, joined)]
    last = head[tail] + count[tail] - 1
    good = np.ones(len(lanes), np.bool_)
    good[owner[np.flatnonzero(doubtful)]] = False
    good[tail[np.abs(gone[last] - end[tail]) > _SHORTCUT * far]] = False
    return vertex, segment, fraction, distance, good


def _nearest(point: Floats, track: Track, about: Floats, low: Ints, high: Ints) -> tuple[Ints, Floats, Floats]:
    """Nearest places of points (k, 6) from path lengths on: segment, fraction, and square of the distance."""
    middle = np.clip(np.searchsorted(track.length, about, side="right") - 1, low, high)
    segment, fraction, square = nearest_places(point, track.six, middle, 1, low, high)
    moved = climb(point, track.six, middle, low, high, segment, fraction)
    ended = np.flatnonzero(((fraction <= 0.0) | (fraction >= 1.0)) & (square > ARITHMETIC))
    flat = track.row[np.maximum(segment[ended] - 1, 0), 12] == 0
    flat |= (track.row[segment[ended], 12] == 0) | (track.row[segment[ended] + 1, 12] == 0)
    stuck = ended[flat]
    if len(stuck):  # at a repeated pose, beyond which it may be nearer
        own, part = point[stuck], (low[stuck], high[stuck])
        there, share = nearest_segments(own, track.six, segment[stuck], _BEYOND_REPEATED, *part)
        climb(own, track.six, segment[stuck], *part, there, share)
        segment[stuck], fraction[stuck] = there, share
        moved = np.union1d(moved, stuck)
    away = track.away(point[moved], segment[moved], fraction[moved])
    square[moved] = np.einsum("ij,ij->i", away, away)
    return segment, fraction, square
