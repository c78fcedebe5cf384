"""Places of few vertices of a long stretch, one group after another: a guide to the places of all, and where to cut.

How far a vertex is along the CL path is known from the last vertex whose place is known, by the path length between
the two; so an error never adds up. Where nothing is found there, the text has left its way: then it is looked for
farther on.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.nearest import foot_share, nearest_from
from cornersmooth.verify.polyline import Polyline

#: of so many vertices the place of one is found first
STRIDE: Final = 32

#: vertices from which on a stretch is long: shorter ones are gone through evenly from end to end, as far as that goes
LONG: Final = 8192

#: vertices in a group, at most
_GROUP: Final = 64

#: how much longer one motion may be than the other, where the last group tells nothing else
_LOW, _HIGH = 0.8, 1.25

#: how much of a written path that mistakes have made longer belongs to the original; what is near it is on its way
_LEAST = 0.25

#: how much longer than the written path the original may be where the way is lost, and segments looked at
_REACH, _MOST_SEGMENTS = 2.5, 1 << 17

#: a vertex is in doubt where the path comes back to it after so many times its distances, and this part of `near`
_FOLD, _SLACK = 4.0, 0.05

#: a cut lies no nearer to the ends of its segment than this part of it: so it is clear to which side vertices belong
_INNER: Final = 0.2

#: places found that are looked at for a cut, with the vertices between them; cuts tried; and how far around them, in
#: `near`, the path must not come back
_LOOKED_AT, _TRIED, _AROUND = 64, 32, 100.0


def guide(
    six: Floats, length: Floats, path: Polyline, begin: float, limits: tuple[int, int], far: float
) -> tuple[Ints, Floats, Floats]:
    """Find the places of every `STRIDE`-th vertex of a stretch as far as they are without doubt.

    Parameters
    ----------
    six : (v, 6) float64
        Written vertices.
    length : (v,) float64, mm
        Path length up to them.
    path : Polyline
        The CL path.
    begin : float, mm
        Path length at the place of the first vertex.
    limits : tuple of int
        First and last segment allowed.
    far : float, mm
        From this distance on a place is doubtful.

    Returns
    -------
    vertex : (k,) int64
        The first vertex, and others.
    place : (k,) float64, mm
        Path length at their places, ascending.
    distance : (k,) float64, mm
    """
    rows = np.arange(STRIDE, len(six), STRIDE)
    vertices, places, distances = [np.zeros(1, np.int64)], [np.array([begin])], [np.zeros(1)]
    here, gone, ratio = float(begin), float(length[0]), 1.0
    k, size, lost = 0, 1, 0
    while k < len(rows):
        group = rows[k : k + size]
        point = six.take(group, axis=0)
        way = length[group] - gone
        low, high = (np.full(len(group), limit) for limit in limits)
        segment, fraction, square = nearest_from(point, path, here + ratio * way, low, high)
        found = path.length_at(segment, fraction)
        # those that are off are left out, as long as what is behind them follows what is before
        close = np.flatnonzero(square <= far * far)
        step, own = np.diff(found[close], prepend=here), np.diff(way[close], prepend=0.0)
        follows = (step >= _LEAST * own - 2 * far) & (step >= 0) & (step <= _HIGH * own + 2 * STRIDE * far)
        good = close if follows.all() else close[: int(np.argmin(follows))]
        count = len(good)
        if not count and len(group) > 1:
            size //= 2
            continue
        if not count:
            lost += 1
            k += 1
            ratio = 1.0
            if lost & (lost - 1):  # seldom, where the text is off everywhere
                continue
            ahead = _farther_on(point[0], path, here, float(way[0]), limits, far)
            if ahead is None:
                continue
            found, square, good = np.array([ahead[0]]), np.array([ahead[1]]), np.zeros(1, np.int64)
        else:
            k += int(good[-1]) + 1
            ratio = float(np.clip((found[good[-1]] - here) / max(way[good[-1]], 1e-9), _LOW, _HIGH))
        vertices.append(group[good])
        places.append(found[good])
        distances.append(np.sqrt(square[good]))
        here, gone, lost = float(found[good[-1]]), float(length[group[good[-1]]]), 0
        size = min(2 * size, _GROUP) if 2 * count > len(group) else max(size // 2, 1)
    return np.concatenate(vertices), np.concatenate(places), np.concatenate(distances)


def _farther_on(
    point: Floats, path: Polyline, here: float, way: float, limits: tuple[int, int], far: float
) -> tuple[float, float] | None:
    """Path length and squared distance of the only place near a vertex beyond one already found; None if there is none.

    The vertex is `way` farther along the written path.
    """
    low, high = np.searchsorted(path.length, (here - far, here + _REACH * way + 2 * far)).tolist()
    low = max(low - 1, limits[0])
    high = min(high, limits[1], low + _MOST_SEGMENTS)
    if high < low:
        return None
    place, square = places_on_each(point, path, low, high)
    best = int(np.argmin(square))
    close = place[square <= 4 * far * far]
    if square[best] > far * far or place[best] < here or close.max() - close.min() > 8 * far:
        return None
    return float(place[best]), float(square[best])


def places_on_each(point: Floats, path: Polyline, low: int, high: int) -> tuple[Floats, Floats]:
    """Path lengths of the nearest places on each of some segments, and the squared distances."""
    start = path.six[low : high + 1]
    way = path.six[low + 1 : high + 2] - start
    away = point - start
    share = foot_share(away, way)
    away -= share[:, None] * way
    begin = path.length[low : high + 1]
    place = begin + share * (path.length[low + 1 : high + 2] - begin)
    return place, np.einsum("ij,ij->i", away, away)


def cut(
    six: Floats,
    length: Floats,
    found: tuple[Ints, Floats, Floats],
    path: Polyline,
    limits: tuple[int, int],
    allowed: Bools,
    wanted: int,
    margins: tuple[float, float],
) -> tuple[int, float] | None:
    """Choose where to cut a long stretch: the vertex, not far before `wanted`, and the path length at its place.

    There must be no doubt about the place: the vertex lies on the path, if there is such a one, its neighbours follow
    one another as they should, and the path does not come back to it.

    Parameters
    ----------
    six, length, path, limits
        As of `guide`.
    found : as `guide` returns it
    allowed : (v,) bool
        Vertices where it may be cut.
    wanted : int
    margins : tuple of float, mm
        Distance that printed digits account for, and that within which a vertex is on its way.

    Returns
    -------
    vertex, place or None
        None where there is none.
    """
    vertex, place, distance = found
    margin, near = margins
    known = np.diff(vertex) == STRIDE
    known &= (distance[:-1] <= near) & (distance[1:] <= near) & (vertex[:-1] > 0) & (vertex[1:] <= wanted)
    rows = np.flatnonzero(known & (vertex[:-1] >= wanted // 2))[-_LOOKED_AT:]
    if not len(rows):
        return None
    candidate = (vertex[rows][:, None] + np.arange(STRIDE)).ravel()
    candidate = candidate[allowed[candidate]]
    about = np.interp(length[candidate], length[vertex], place)
    low, high = (np.full(len(candidate), limit) for limit in limits)
    segment, fraction, square = nearest_from(six[candidate], path, about, low, high)
    inside = (fraction >= _INNER) & (fraction <= 1 - _INNER) & (square <= near * near)
    candidate, off = candidate[inside], np.sqrt(square[inside])
    at = path.length_at(segment[inside], fraction[inside])
    order = np.lexsort((-candidate, np.maximum(off, margin)))  # the latest of those that lie on the path, else nearest
    for k in order[:_TRIED].tolist():
        if _clear(six[candidate[k]], path, float(at[k]), float(off[k]), near):
            return int(candidate[k]), float(at[k])
    return (int(candidate[order[0]]), float(at[order[0]])) if len(order) else None


def _clear(point: Floats, path: Polyline, place: float, distance: float, near: float) -> bool:
    """Whether no other place in its neighbourhood could be that of a vertex as well."""
    around = _AROUND * near
    low, high = np.searchsorted(path.length, (place - around, place + around)).tolist()
    places, square = places_on_each(point, path, max(low - 1, 0), min(high, len(path.length) - 2))
    close = square <= 4 * near * near
    away = np.abs(places - place)[close]
    return not (away > _FOLD * (np.sqrt(square[close]) + distance) + _SLACK * near).any()
