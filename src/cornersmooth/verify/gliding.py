"""Places of written vertices on the original, found for all of them at once where there is no doubt.

Between two anchors both motions are nearly equally long, so that the path length tells where about a vertex is, and
the nearest segment is found from there. Where the places of a lane then follow one another and none is far off, they
are what a walker would find, and more exactly; every other lane is left to the walker.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.nearest import climb, nearest_places
from cornersmooth.verify.stops import ARITHMETIC
from cornersmooth.verify.walking import Lanes, Track

#: how much longer one motion may be than the other between neighbouring vertices, in distances that are doubtful
_SHORTCUT = 2.0


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
    first, start, high = lanes.first, lanes.start, lanes.stop - 1
    count = lanes.last - first
    owner = np.repeat(np.arange(len(lanes)), count)
    head = np.cumsum(count) - count
    vertex = np.arange(len(owner)) + (first + 1 - head)[owner]
    begin = track.length[start] + lanes.fraction * (track.length[start + 1] - track.length[start])
    end = track.length[lanes.stop]
    joined = np.flatnonzero(first[1:] == lanes.last[:-1])
    end[joined] = begin[joined + 1]
    way = length[lanes.last] - length[first]
    scale = np.divide(end - begin, way, out=np.zeros(len(way)), where=way > 0)
    about = length[vertex]
    about -= length[first][owner]
    about *= scale[owner]
    about += begin[owner]
    low, high = start[owner], high[owner]
    middle = np.clip(np.searchsorted(track.length, about, side="right") - 1, low, high)
    point = six.take(vertex, axis=0)
    segment, fraction, square = nearest_places(point, track.six, middle, 1, low, high)
    moved = climb(point, track.six, middle, low, high, segment, fraction)
    square[moved] = _squares(point[moved], track, segment[moved], fraction[moved])
    distance = np.sqrt(square)
    gone = track.length[segment]
    gone += fraction * (track.length[segment + 1] - gone)
    step = gone - np.concatenate(([0.0], gone[:-1]))
    some = np.flatnonzero(count)
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


def _squares(point: Floats, track: Track, segment: Ints, fraction: Floats) -> Floats:
    row = track.row[segment]
    away = point - row[:, :6] - fraction[:, None] * row[:, 6:12]
    square: Floats = np.einsum("ij,ij->i", away, away)
    return square
