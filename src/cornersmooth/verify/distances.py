"""How far the vertices of each motion of a batch are from the other: amounts for people, which decide nothing.

The decision gives places between which the nearest ones are; here they are looked for close by.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.match import Match
from cornersmooth.verify.motions import inner_points
from cornersmooth.verify.nearest import COLUMNS, Gap, Metric, larger_square, nearest_places

#: segments on either side of a place among which a nearer one is looked for
_REACH: Final = 2

#: places that are compared, and how often: down to 1e-7 of two steps
_SHARES: Final = np.linspace(0.0, 1.0, 9)
_ROUNDS: Final = 12


@dataclass(frozen=True)
class Reached:
    """What vertices of one motion find on the other, k rows."""

    vertex: Ints  #: (k,): the vertices
    gap: Gap  #: at a common pose: the nearest but for the bends of the other motion
    place: Floats  #: (k,): where on the other polyline: segment plus fraction
    mine: bool  #: whether they are written vertices


def of_written(match: Match) -> Reached:
    """Every written vertex that has a place, against the polyline of the original there."""
    vertex = np.flatnonzero(match.on)
    away = match.away if len(vertex) == len(match.away) else match.away[vertex]
    turned = away[:, 3:] if match.task.own_axis else away[:, 3:] - away[:, :3]
    tip, axis_point, turn = (np.sqrt(np.einsum("ij,ij->i", part, part)) for part in (away[:, :3], away[:, 3:], turned))
    angle = 2.0 * np.arcsin(np.minimum(turn / (2.0 * match.task.axis_length), 1.0))
    return Reached(vertex, Gap(tip, axis_point, angle), match.place[vertex], True)


def of_original(match: Match) -> Reached:
    """Every vertex of the original that is passed, against the written motion."""
    vertex, row = match.passing.vertex, match.passing.row
    first, last = match.runs
    point = match.path.points[vertex]
    place = nearest_places(point, match.six, row, 1, first[row], last[row] - 1)
    six = _written(match, place)
    far = np.flatnonzero(larger_square(six - point) > match.tolerance**2)
    if len(far):  # the sum of both squares is least there, but not the larger
        limits = first[row[far]].astype(np.float64), last[row[far]].astype(np.float64)
        place[far] = _nearest(lambda at: _written(match, at), point[far], place[far], limits, "both")
        six[far] = _written(match, place[far])
    return Reached(vertex, _gap(match, six, point), place, False)


def nearest(match: Match, reached: Reached, rows: Ints, metric: Metric) -> Gap:
    """Of some rows at the nearest pose of the other motion: for both, where the larger distance is least."""
    vertex = reached.vertex[rows]
    if reached.mine:
        own, other, low, high = match.six, match.path.points, match.low[vertex], match.high[vertex]
        middle = match.segment[vertex]
    else:
        own, other = match.path.points, match.six
        middle = np.minimum(reached.place[rows].astype(np.int64), len(other) - 2)
        first, last = match.runs
        low, high = first[middle], last[middle] - 1
    point = own[vertex]
    place = nearest_places(point, other, middle, _REACH, low, high, metric)
    limits = low.astype(np.float64), (high + 1).astype(np.float64)

    def motion(place: Floats) -> Floats:
        return match.task.six(*match.original.pose_at(place)) if reached.mine else _written(match, place)

    return _gap(match, motion(_nearest(motion, point, place, limits, metric)), point)


def gap_of_written(match: Match, rows: Ints, place: Floats) -> Gap:
    """Of written vertices (k,) from poses of the original at places (k,)."""
    return _gap(match, match.task.six(*match.original.pose_at(place)), match.six[rows])


def _gap(match: Match, six: Floats, other: Floats) -> Gap:
    return match.task.gap(six[:, :3], match.task.axis_of(six), other[:, :3], match.task.axis_of(other))


def _written(match: Match, place: Floats) -> Floats:
    """(k, 6) points of the written motion at places of its polyline."""
    six, segment = match.six, np.minimum(place.astype(np.int64), len(match.six) - 2)
    points = six.take(segment, axis=0)
    points += (place - segment)[:, None] * (six.take(segment + 1, axis=0) - points)
    bent = np.flatnonzero(match.motion.bend[segment] > 0.0)
    if len(bent):
        points[bent] = inner_points(match.nc, match.motion, match.task, place[bent], match.first)
    return points


def _nearest(
    motion: Callable[[Floats], Floats], point: Floats, place: Floats, limits: tuple[Floats, Floats], metric: Metric
) -> Floats:
    """(k,) places around given ones where a motion is nearest to points (k, 6): between ever finer places."""
    low, high = np.maximum(place - 1.0, limits[0]), np.minimum(place + 1.0, limits[1])
    each, best = np.arange(len(place)), place
    least = _square(motion(place) - point, metric)
    several = np.repeat(point, len(_SHARES), axis=0)
    for _ in range(_ROUNDS):
        at = low[:, None] + _SHARES * (high - low)[:, None]
        square = _square(motion(at.ravel()) - several, metric).reshape(at.shape)
        k = square.argmin(axis=1)
        low, high = at[each, np.maximum(k - 1, 0)], at[each, np.minimum(k + 1, len(_SHARES) - 1)]
        best = np.where(square[each, k] < least, at[each, k], best)
        least = np.minimum(least, square[each, k])
    return best


def _square(away: Floats, metric: Metric) -> Floats:
    """(k,) squares of distances, of both the larger one."""
    if metric == "both":
        return larger_square(away)
    found: Floats = np.einsum("ij,ij->i", away[:, COLUMNS[metric]], away[:, COLUMNS[metric]])
    return found
