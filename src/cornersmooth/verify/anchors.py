"""Where long stretches are cut: *anchors*, written vertices whose place on the original leaves no doubt."""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.walking import Lane, Track

#: how much longer or shorter than the written path the original may be between two anchors, as a first guess
_LENGTH_LOW, _LENGTH_HIGH = 0.97, 1.25

#: places tried for an anchor before the lane is made longer, and written vertices between them
_ANCHOR_TRIALS, _ANCHOR_STRIDE = 5, 7

#: a vertex is in doubt where the path comes back to it after so many times its distances, and this part of `near`
_FOLD: Final = 4.0
_SLACK: Final = 0.05

#: lanes that are cut at once between two anchors
_COARSE: Final = 16

#: original segments looked at for many anchors at a time
_AT_ONCE: Final = 1 << 14


def cut_lane(
    six: Floats,
    written_length: Floats,
    track: Track,
    lane: Lane,
    size: int,
    near: float,
) -> list[Lane]:
    """Cut one lane at anchors about `size` vertices apart.

    Parameters
    ----------
    six : (v, 6) float64
        Written vertices.
    written_length : (v,) float64
        Path length up to every vertex, mm.
    track : Track
    lane : (first, last, start, stop, fraction)
        As in `Lanes`.
    size : int
    near : float, mm
        An anchor lies no farther from the original, and nothing else of the original comes so near to it.

    Returns
    -------
    list of lanes
        At least one; they join where they are cut.
    """
    first, last, start, stop, fraction = lane
    lanes = []
    target = first + size
    while target < last - size // 2:
        anchor = None
        for trial in range(_ANCHOR_TRIALS):
            vertex = target + trial * _ANCHOR_STRIDE
            if vertex < last:
                gone = written_length[vertex] - written_length[first]
                anchor = find_anchor(six[vertex], gone, track, start, fraction, stop, near)
            if anchor is not None:
                break
        if anchor is None:
            target += size
            continue
        segment, at = anchor
        lanes.append((first, vertex, start, segment + 1, fraction))
        first, start, fraction = vertex, segment, at
        target = vertex + size
    lanes.append((first, last, start, stop, fraction))
    return lanes


def find_anchor(
    point: Floats, gone: float, track: Track, start: int, fraction: float, stop: int, near: float
) -> tuple[int, float] | None:
    """Place of a written vertex on the original, `gone` mm after `fraction` of `start`; None where it is in doubt."""
    origin = track.length[start] + fraction * (track.length[start + 1] - track.length[start])
    for low, high in ((_LENGTH_LOW, _LENGTH_HIGH), (0.0, 2 * _LENGTH_HIGH)):
        a, b = np.searchsorted(track.length, (origin + low * gone - near, origin + high * gone + 2 * near))
        a, b = max(int(a) - 1, start), min(int(b) + 1, stop)
        if a >= b:
            continue
        row = track.row[a:b]
        away = point - row[:, :6]
        t = np.clip(np.einsum("ij,ij->i", away, row[:, 6:12]) * row[:, 12], 0.0, 1.0)
        away -= t[:, None] * row[:, 6:12]
        d = np.einsum("ij,ij->i", away, away)
        close = np.flatnonzero(d <= 4 * near * near)
        best = int(np.argmin(d))
        if d[best] > near * near:
            continue
        place = track.length[a:b] + t * (track.length[a + 1 : b + 1] - track.length[a:b])
        if a > start and place[best] - track.length[a] <= 2 * near:  # what comes before may be nearer
            continue
        if track.length[a + close[-1]] - track.length[a + close[0] + 1] > 8 * near:
            return None
        if _folded(d[close], d[best], place[close] - place[best], near).any():
            return None
        return a + best, float(t[best])
    return None


def _folded(square: Floats, least: Floats, way: Floats, near: float) -> Bools:
    """Whether the path comes back to a vertex after `way` mm: there it is in doubt which of both is its place.

    Parameters
    ----------
    square, least : (k,) float64, mm²
        Squared distances of one place and of the nearest.
    way : (k,) float64, mm
        Path between the two.
    near : float, mm
    """
    folded: Bools = np.abs(way) > _FOLD * (np.sqrt(square) + np.sqrt(least)) + _SLACK * near
    return folded


def cut_finely(
    six: Floats, written_length: Floats, track: Track, lane: Lane, size: int, near: float, candidates: Ints
) -> list[Lane]:
    """Cut one lane at anchors about `size` vertices apart, few of them one after another and the rest at once.

    Parameters
    ----------
    six, written_length, track, lane, size, near
        As in `cut_lane`.
    candidates : (c,) int64
        Vertices that may become anchors, ascending.

    Returns
    -------
    list of lanes
        At least one; they join where they are cut.
    """
    coarse = cut_lane(six, written_length, track, lane, size * _COARSE, near)
    first, last, start, stop, fraction = (np.array(column) for column in zip(*coarse, strict=True))
    origin = track.way(start, fraction)
    count = np.maximum((last - first) // size - 1, 0)
    owner = np.repeat(np.arange(len(coarse)), count)
    target = first[owner] + size * (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count) + 1)
    vertex = candidates[np.minimum(np.searchsorted(candidates, target), len(candidates) - 1)]
    fits = (vertex > first[owner]) & (vertex < last[owner])
    fits &= np.diff(vertex, prepend=-1) > 0
    vertex, owner = vertex[fits], owner[fits]
    gone = written_length[vertex] - written_length[first[owner]]
    about = origin[owner], gone
    segment, at = _find_anchors(six, vertex, about, track, start[owner], stop[owner], near)
    # between the coarse anchors, and in order
    place = segment + at
    edge = np.array([lane[-1] + lane[2] for lane in coarse] + [np.inf])
    good = (segment >= 0) & (place >= edge[owner]) & (place <= edge[owner + 1])
    vertex, segment, at, place = vertex[good], segment[good], at[good], place[good]
    good = place >= np.maximum.accumulate(place) if len(place) else good[:0]
    cuts = [(lane[0], lane[2], lane[4]) for lane in coarse]
    cuts += zip(vertex[good].tolist(), segment[good].tolist(), at[good].tolist(), strict=True)
    cuts.sort(key=lambda cut: cut[0])
    ends = [(vertex, segment + 1) for vertex, segment, _ in cuts[1:]] + [(lane[1], lane[3])]
    return [(vertex, end, segment, stop, at) for (vertex, segment, at), (end, stop) in zip(cuts, ends, strict=True)]


def _find_anchors(
    six: Floats, vertex: Ints, about: tuple[Floats, Floats], track: Track, start: Ints, stop: Ints, near: float
) -> tuple[Ints, Floats]:
    """(k,) places of written vertices on the original, as `find_anchor` does, -1 where they are in doubt.

    Each is looked for between the segments `start` and `stop`; `about` is where its lane begins on the original, a path
    length, and how far it is from there.
    """
    origin, gone = about
    low = np.searchsorted(track.length, origin + _LENGTH_LOW * gone - near) - 1
    high = np.searchsorted(track.length, origin + _LENGTH_HIGH * gone + 2 * near) + 1
    low, high = np.maximum(low, start), np.minimum(high, stop)
    size = np.maximum(high - low, 0)
    found, at = np.full(len(vertex), -1), np.zeros(len(vertex))
    some = np.flatnonzero(size)
    total = np.cumsum(size[some])
    parts = np.split(some, np.searchsorted(total, np.arange(_AT_ONCE, int(total[-1]), _AT_ONCE))) if len(some) else []
    for rows in parts:
        if not len(rows):
            continue
        count = size[rows]
        begin = np.cumsum(count) - count
        segment = np.arange(int(count.sum())) + np.repeat(low[rows] - begin, count)
        row = track.row[segment]
        away = np.repeat(six[vertex[rows]], count, axis=0)
        away -= row[:, :6]
        t = np.clip(np.einsum("ij,ij->i", away, row[:, 6:12]) * row[:, 12], 0.0, 1.0)
        away -= t[:, None] * row[:, 6:12]
        d = np.einsum("ij,ij->i", away, away)
        least = np.minimum.reduceat(d, begin)
        best = np.flatnonzero(d == np.repeat(least, count))
        best = best[np.searchsorted(best, begin)]
        close = np.flatnonzero(d <= 4 * near * near)
        ends = begin + count
        place = track.way(segment, t)
        way = place - np.repeat(place[best], count)
        folded = (d <= 4 * near * near) & _folded(d, np.repeat(least, count), way, near)
        clear = ~np.logical_or.reduceat(folded, begin)
        clear &= least <= near * near
        clear &= (low[rows] == start[rows]) | (place[best] - track.length[low[rows]] > 2 * near)
        clear[clear] &= (
            track.length[segment[close[np.searchsorted(close, ends[clear]) - 1]]]
            - track.length[segment[close[np.searchsorted(close, begin[clear])]] + 1]
            <= 8 * near
        )
        found[rows[clear]], at[rows[clear]] = segment[best[clear]], t[best[clear]]
    return found, at
