"""Which original segment every written vertex belongs to, in order.

A walker goes along the written trail and takes the original segment along with it: it stays on a segment until the
next one is clearly nearer, and never goes back. Many walkers go at once, one per lane, a step of each at a time, so
that the work is whole-array work. Lanes are the stretches between rapids; long ones are cut at anchors: written
vertices whose place on the original leaves no doubt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Bools, Floats, Ints

#: a stretch to walk as single numbers: see `Lanes`
Lane = tuple[int, int, int, int, float]

#: segments a walker that has lost its way looks ahead
LOOK_AHEAD = 12


@dataclass(frozen=True)
class Track:
    """Original segments, n of them, ready to project on: segment k runs from vertex k to vertex k+1.

    Parameters
    ----------
    six : (n + 1, 6) float64
        The vertices: tip and axis point.
    row : (n + 1, 13) float64
        Start (6), difference (6), inverse square of the length (0 where that is 0).
    length : (n + 1,) float64
        Path length up to every vertex, mm.
    following : (n + 1,) int64
        The next segment that has a length.
    """

    six: Floats
    row: Floats
    length: Floats
    following: Ints

    @classmethod
    def of(cls, six: Floats) -> Track:
        """Make it from vertices (n + 1, 6)."""
        count = max(len(six) - 1, 0)
        row = np.zeros((count + 1, 13))
        row[:, :6] = six
        np.subtract(six[1:], six[:-1], out=row[:-1, 6:12])
        square = np.einsum("ij,ij->i", row[:, 6:12], row[:, 6:12])
        np.divide(1.0, square, out=row[:, 12], where=square > 0)
        length = np.concatenate(([0.0], np.cumsum(np.sqrt(square[:-1]))))
        moving = np.where(row[:, 12] > 0, np.arange(count + 1), count + 1)
        following = np.append(np.minimum.accumulate(moving[::-1])[::-1][1:], count + 1)
        return cls(six, row, length, following)

    def way(self, segment: Ints, fraction: Floats) -> Floats:
        """(k,) path length up to places, mm."""
        start = self.length[segment]
        way: Floats = start + fraction * (self.length[segment + 1] - start)
        return way

    def away(self, point: Floats, segment: Ints, fraction: Floats) -> Floats:
        """(k, 6) from places to points, mm."""
        row = self.row[segment]
        away: Floats = point - row[:, :6] - fraction[:, None] * row[:, 6:12]
        return away


@dataclass(frozen=True)
class Lanes:
    """Stretches to walk: written vertices ``first`` to ``last``, original vertices ``start`` to ``stop``.

    Parameters
    ----------
    first, last : (k,) int64
        The walk begins at vertex `first`, which is at `fraction` of segment `start`.
    start, stop : (k,) int64
        First segment, and last segment plus one.
    fraction : (k,) float64
    """

    first: Ints
    last: Ints
    start: Ints
    stop: Ints
    fraction: Floats

    def __len__(self) -> int:
        return len(self.first)

    @classmethod
    def of(cls, lanes: list[Lane]) -> Lanes:
        """Make a table of them."""
        return cls(*(np.array(column) for column in zip(*lanes, strict=True)))


#: what `walk` returns
Walked = tuple[Ints, Floats, Bools, Floats]


def nowhere(count: int) -> Walked:
    """Vertices in no lane."""
    return np.zeros(count, np.int64), np.full(count, -1.0), np.zeros(count, np.bool_), np.full(count, np.inf)


def walk(six: Floats, track: Track, lanes: Lanes, margin: float, lost: float) -> Walked:
    """Assign the vertices of all lanes.

    Parameters
    ----------
    six : (v, 6) float64
        Written vertices.
    track : Track
    lanes : Lanes
    margin : float, mm
        The next segment must be nearer by so much to be taken before this one ends.
    lost : float, mm
        From this distance on the walker looks further ahead.

    Returns
    -------
    segment : (v,) int64
    fraction : (v,) float64
        On its segment; -1 for vertices in no lane.
    backward : (v,) bool
        Whether the vertex lies more than `margin` behind the one before it, as seen from its segment.
    distance : (v,) float64, mm
        From its place, in six dimensions: neither tip nor axis point is farther; inf where a lane starts.
    """
    segment, fraction, backward, distance = nowhere(len(six))
    vertex, last = lanes.first.copy(), lanes.last
    here, least, end = lanes.start.copy(), lanes.fraction.copy(), lanes.stop - 1
    segment[vertex], fraction[vertex] = here, least
    vertex += 1
    square_margin = margin * margin
    active = vertex <= last
    while True:
        if not active.all():
            keep = np.flatnonzero(active)
            if not len(keep):
                return segment, fraction, backward, distance
            vertex, last, here, least, end = vertex[keep], last[keep], here[keep], least[keep], end[keep]
        point = six.take(vertex, axis=0)
        own = track.row.take(here, axis=0)
        after = track.following.take(here)
        away = point - own[:, :6]
        t = np.einsum("ij,ij->i", away, own[:, 6:12]) * own[:, 12]
        on = np.minimum(np.maximum(t, least), 1.0)
        away -= on[:, None] * own[:, 6:12]
        d = np.sqrt(np.einsum("ij,ij->i", away, away))
        more = after <= end
        ended = (t >= 1.0) | (own[:, 12] == 0)
        # elsewhere the next segment cannot be nearer by the margin
        ask = np.flatnonzero((ended | (d > margin)) & more)
        d_follow = np.full(len(d), np.inf)
        d_follow[ask] = _distance(point.take(ask, axis=0), track.row.take(after.take(ask), axis=0))
        advance = (ended & (d_follow <= d)) | (d_follow < d - margin)
        behind = (least - t) > 0
        jump = np.flatnonzero(more & ~advance & ((d > lost) | (behind & (d > margin))))
        if len(jump):
            ahead = _look_ahead(point[jump], track, here[jump], end[jump], d[jump] - margin, margin)
            advance[jump] = ahead > here[jump]
            after[jump] = np.where(ahead > here[jump], ahead, after[jump])
        place = ~advance
        at = vertex[place]
        segment[at], fraction[at], distance[at] = here[place], on[place], d[place]
        if behind.any():
            back = (least - t) ** 2 > square_margin * own[:, 12]
            backward[at] = (behind & back & (own[:, 12] > 0))[place]
        least = np.where(place, on, 0.0)
        here = np.where(advance, after, here)
        vertex += place
        active = vertex <= last


def _distance(point: Floats, row: Floats) -> Floats:
    """Distance of points (k, 6) from segments, rows of a track."""
    away = point - row[:, :6]
    t = np.einsum("ij,ij->i", away, row[:, 6:12])
    t *= row[:, 12]
    np.clip(t, 0.0, 1.0, out=t)
    away -= t[:, None] * row[:, 6:12]
    distance: Floats = np.sqrt(np.einsum("ij,ij->i", away, away))
    return distance


def _look_ahead(point: Floats, track: Track, here: Ints, end: Ints, beat: Floats, margin: float) -> Ints:
    """Nearest of the next segments, if nearer than `beat`, a later one only by a margin; `here` where there is none."""
    best = here.copy()
    for step in range(1, LOOK_AHEAD + 1):
        d = _distance(point, track.row[np.minimum(here + step, end)])
        nearer = (d < beat) & (here + step <= end)
        best[nearer] = here[nearer] + step
        beat = np.where(nearer, d - margin, beat)
    return best
