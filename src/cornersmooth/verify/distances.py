"""How far the vertices of each motion of a batch are from the other: amounts for people, which decide nothing.

At common poses they are the distances at the places that prove the decision: all that is proved keeps within them. Of
tips and of axis points alone the nearest places are looked for beside those.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.match import Match
from cornersmooth.verify.motions import inner_points
from cornersmooth.verify.nearest import COLUMNS, Metric, larger_square, nearest_places
from cornersmooth.verify.task import Task

#: segments on either side of a place among which a nearer one is looked for
_REACH: Final = 2

#: distances from a place, in steps, through which parabolas are laid, one after the other
_WIDTHS: Final = (1 / 8, 1 / 64, 1 / 512)


@dataclass(frozen=True)
class Gap:
    """How far poses are from a motion, k rows."""

    tip: Floats  #: (k,) mm
    axis_point: Floats  #: (k,) mm
    angle: Floats  #: (k,) rad: between the tool axes

    @classmethod
    def of(cls, task: Task, away: Floats) -> Gap:
        """That of differences (k, 6) of tips and axis points."""
        turned = away[:, 3:] if task.own_axis else away[:, 3:] - away[:, :3]
        tip, axis_point, turn = (np.sqrt(np.einsum("ij,ij->i", off, off)) for off in (away[:, :3], away[:, 3:], turned))
        return cls(tip, axis_point, 2.0 * np.arcsin(np.minimum(turn / (2.0 * task.axis_length), 1.0)))


@dataclass(frozen=True)
class Reached:
    """What vertices of one motion find on the other, k rows."""

    vertex: Ints  #: (k,): the vertices
    gap: Gap  #: at a common pose
    place: Floats  #: (k,): where on the other polyline: segment plus fraction
    mine: bool  #: whether they are written vertices


def of_written(match: Match) -> Reached:
    """Every written vertex that has a place, against the polyline of the original there."""
    vertex = np.flatnonzero(match.on)
    away = match.away if len(vertex) == len(match.away) else match.away[vertex]
    return Reached(vertex, Gap.of(match.task, away), match.place[vertex], True)


def of_original(match: Match) -> Reached:
    """Every vertex of the original that is passed, against the written motion."""
    vertex, row, share = match.passing
    first, last = match.runs
    point = match.path.points[vertex]
    place = nearest_places(point, match.six, row, 1, first[row], last[row] - 1)
    away = _written(match, place) - point
    far = np.flatnonzero(larger_square(away) > match.tolerance**2)
    if len(far):  # the sum of both squares is least there, but not the larger: the place that is proved
        place[far] = row[far] + share[far]
        away[far] = _written(match, place[far]) - point[far]
    return Reached(vertex, Gap.of(match.task, away), place, False)


def nearest(match: Match, reached: Reached, rows: Ints, metric: Metric) -> Floats:
    """(k,) distances of some rows from the nearest place of the other motion: of tips, or of axis points."""
    vertex = reached.vertex[rows]
    if reached.mine:
        own, other, middle, low, high = match.six, match.path.points, match.segment, match.low, match.high
        middle, low, high = middle[vertex], low[vertex], high[vertex]
    else:
        own, other = match.path.points, match.six
        middle = np.minimum(reached.place[rows].astype(np.int64), len(other) - 2)
        first, last = match.runs
        low, high = first[middle], last[middle] - 1
    point, columns = own[vertex], COLUMNS[metric]
    best = nearest_places(point, other, middle, _REACH, low, high, metric)
    first_place, last_place = low.astype(np.float64), high + 1.0

    def square(place: Floats) -> Floats:
        away = ((match.path.at(place) if reached.mine else _written(match, place)) - point)[:, columns]
        return np.einsum("ij,ij->i", away, away)

    least = square(best)
    for width in _WIDTHS:
        centre = np.clip(best, first_place + width, last_place - width)  # a bent step may go on in the next one
        before, here, after = (square(centre + side) for side in (-width, 0.0, width))
        bend = before - 2.0 * here + after
        shift = np.divide(width * (before - after), 2.0 * bend, out=np.zeros_like(bend), where=bend > 0.0)
        best = np.clip(centre + np.clip(shift, -1.0, 1.0), first_place, last_place)
        least = np.minimum.reduce((least, before, here, after))
    return np.sqrt(np.minimum(least, square(best)))


def _written(match: Match, place: Floats) -> Floats:
    """(k, 6) points of the written motion at places of its polyline."""
    six, segment = match.six, np.minimum(place.astype(np.int64), len(match.six) - 2)
    share = place - segment
    points = six.take(segment, axis=0)
    points += share[:, None] * (six.take(segment + 1, axis=0) - points)
    bent = np.flatnonzero((match.motion.bend[segment] > 0.0) & (share > 0.0) & (share < 1.0))
    if len(bent):
        points[bent] = inner_points(match.nc, match.motion, match.task, place[bent], match.first)
    return points
