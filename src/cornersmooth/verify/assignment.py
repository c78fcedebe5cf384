"""The best monotone correspondence of two short polylines, for places that are in doubt.

Every written vertex gets a segment of the original, never an earlier one than the vertex before; every original vertex
that is passed on the way counts with its distance from the written segment on which it is passed. Among all such
assignments the one with the least sum of powers of the distances is found by dynamic programming, a row at a time.
The power is high, so that it is the largest distances that decide.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints

#: of the squared distance, in tolerances
_POWER = 3

#: distance, in tolerances, beyond which all is equally bad: sums of larger ones would drown what decides
_FARTHEST: Final = 20.0

#: written vertices around a doubtful one that are assigned anew with it; then those around what is still in doubt, for
#: near the pole many blocks stand still; of both the largest number of pairs that are looked at for one window, and of
#: windows in a block
ROUNDS = ((60, 4_000_000, 40), (500, 1_000_000, 16), (3000, 2_000_000, 4))


def doubtful_windows(doubtful: Bools, stretch: Ints, around: int, most: int) -> list[tuple[int, int]]:
    """First and last vertex of the windows to assign anew, `most` of them; both ends are taken to be right."""
    rows = np.flatnonzero(doubtful)
    if not len(rows):
        return []
    edges = np.flatnonzero(np.append(True, np.diff(stretch) != 0))
    ends = np.append(edges[1:], len(stretch)) - 1
    number = np.searchsorted(edges, rows, side="right") - 1
    first = np.maximum(rows - around, edges[number])
    last = np.minimum(rows + around, ends[number])
    # no window ends beside what is in doubt; they may overlap
    new = np.append(True, (np.diff(rows) > around) | (np.diff(number) != 0))
    starts = np.flatnonzero(new)
    stops = np.append(starts[1:], len(rows)) - 1
    return list(zip(first[starts].tolist(), last[stops].tolist(), strict=True))[:most]


def assign(
    six: Floats, path: Floats, start: float, stop: float, tolerance: float, most_pairs: int
) -> tuple[Ints, Floats, Bools] | None:
    """Assign the vertices of a window whose ends are at known places.

    Parameters
    ----------
    six : (v, 6) float64
        Written vertices.
    path : (n, 6) float64
        Vertices of the original.
    start, stop : float
        Places (segment plus fraction) of the first and the last vertex.
    tolerance : float, mm
    most_pairs : int
        Of vertices and segments.

    Returns
    -------
    segment : (v,) int64
    fraction : (v,) float64
    backward : (v,) bool
        Whether a vertex lies behind the one before it on its segment.
        None where the window is too large.
    """
    low = min(int(start), len(path) - 2)
    high = max(int(np.ceil(stop)) - 1, low)
    count = high - low + 1
    if len(six) < 3 or len(six) * count > most_pairs:
        return None
    begin = path[low : high + 1]
    ways = path[low + 1 : high + 2] - begin
    sizes = np.einsum("ij,ij->i", ways, ways)
    fraction, square = _project(six, begin, ways, np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0))
    cost = np.minimum(square / tolerance**2, _FARTHEST**2) ** _POWER
    # original vertices between the segments, against written segments
    way = six[1:] - six[:-1]
    size = np.einsum("ij,ij->i", way, way)
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
    _, passed = _project(begin[1:], six[:-1], way, inverse)
    passing = np.concatenate(
        ([np.zeros(len(way))], np.cumsum(np.minimum(passed / tolerance**2, _FARTHEST**2) ** _POWER, axis=0))
    ).T
    # going back on one segment counts like being so far off: else a path that runs to and fro is all on its first line
    back = np.maximum(fraction[:-1] - fraction[1:], 0.0) ** 2 * sizes
    back = np.minimum(back / tolerance**2, _FARTHEST**2) ** _POWER
    columns = np.arange(count)
    best = np.where(columns == 0, 0.0, np.inf)
    came = np.zeros((len(six), count), np.int32)
    for k in range(1, len(six)):
        reached = best - passing[k - 1]
        least = np.append(np.inf, np.minimum.accumulate(reached)[:-1])
        is_new = np.append(True, reached[1:] < least[1:])
        before = np.append(0, np.maximum.accumulate(np.where(is_new, columns, 0))[:-1])
        moved = least + passing[k - 1]
        stayed = best + back[k - 1]
        came[k] = np.where(stayed <= moved, columns, before)
        best = np.minimum(stayed, moved) + cost[k]
    segment = np.zeros(len(six), np.int64)
    segment[-1] = count - 1
    for k in range(len(six) - 1, 0, -1):
        segment[k - 1] = came[k, segment[k]]
    at = fraction[np.arange(len(six)), segment]
    at[0], at[-1] = start - low, stop - high
    place = segment + at
    held = np.maximum.accumulate(place)
    backward = held > place
    at = np.clip(held - segment, 0.0, 1.0)
    return segment + low, at, backward


def _project(point: Floats, start: Floats, way: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """Fractions and squared distances (points, segments) of every point on every segment."""
    along = point @ way.T - np.einsum("ij,ij->i", start, way)
    fraction = np.clip(along * inverse, 0.0, 1.0)
    away = point[:, None, :] - start[None, :, :] - fraction[:, :, None] * way[None, :, :]
    return fraction, np.einsum("ijk,ijk->ij", away, away)
