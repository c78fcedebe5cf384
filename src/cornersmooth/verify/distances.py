"""How far the vertices of each motion of a batch are from the other: amounts for people, which decide nothing.

The decision gives places between which the nearest ones are; here they are looked for close by.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.tool import WrittenAt
from cornersmooth.verify.match import Match
from cornersmooth.verify.motions import inner_points
from cornersmooth.verify.nearest import (
    COLUMNS,
    Gap,
    Metric,
    distance_between,
    larger_square,
    nearest_places,
)

#: segments on either side of a place among which a nearer one is looked for
_REACH: Final = 2

#: bend, mm, from which on a place on a bent step is refined; how often, with a parabola through three points
_BENT: Final = 1e-9
_ROUNDS: Final = 2

#: golden section, and how often: down to 1e-7 of two steps
_GOLDEN: Final = (1.0 + math.sqrt(5.0)) / 2.0
_SECTIONS: Final = 34


@dataclass(frozen=True)
class Reached:
    """What vertices of one motion find on the other, k rows.

    Parameters
    ----------
    vertex : (k,) int64
        The vertices.
    gap : Gap
    place : (k,) float64
        Where on the other polyline: segment plus fraction.
    """

    vertex: Ints
    gap: Gap
    place: Floats


def of_written(match: Match) -> Reached:
    """Every written vertex that has a place, against the polyline of the original there."""
    vertex = np.flatnonzero(match.on)
    away = match.away if len(vertex) == len(match.away) else match.away[vertex]
    turned = away[:, 3:] if match.task.own_axis else away[:, 3:] - away[:, :3]
    tip, axis_point, turn = (np.sqrt(np.einsum("ij,ij->i", part, part)) for part in (away[:, :3], away[:, 3:], turned))
    angle = 2.0 * np.arcsin(np.minimum(turn / (2.0 * match.task.axis_length), 1.0))
    return Reached(vertex, Gap(tip, axis_point, angle), match.place[vertex])


def _place_of_written(match: Match, rows: Ints, metric: Metric) -> Floats:
    limits = match.low[rows], match.high[rows]
    return nearest_places(match.six[rows], match.path.points, match.segment[rows], _REACH, *limits, metric)


def gap_of_written(match: Match, rows: Ints, place: Floats) -> Gap:
    """Of written vertices (k,) from poses of the original at places (k,)."""
    six = match.six[rows]
    tip, axis = match.original.pose_at(place)
    return match.task.gap(six[:, :3], match.task.axis_of(six), tip, axis)


def written_together(match: Match, reached: Reached, rows: Ints) -> Gap:
    """Of rows of `of_written` from the nearest pose of the original."""
    vertex = reached.vertex[rows]
    place = _place_of_written(match, vertex, "both")
    six = match.six[vertex]

    def squares(place: Floats) -> Floats:
        return larger_square(match.task.six(*match.original.pose_at(place)) - six)

    low, high = np.maximum(place - 1.0, match.low[vertex]), np.minimum(place + 1.0, match.high[vertex] + 1.0)
    return gap_of_written(match, vertex, _lowest_between(squares, low, high))


def of_original(match: Match) -> Reached:
    """Every vertex of the original that is passed, against the written motion."""
    passing = match.passing
    place = passing.row + passing.share
    point = match.path.points[passing.vertex]
    row = passing.row
    first, last = match.runs
    limits = first[row], last[row] - 1
    place = nearest_places(point, match.six, row, 1, *limits)
    segment, tip, axis = _refined(match, point, place, "both")
    original = match.original.trail.axis[passing.vertex]
    far = np.flatnonzero(match.task.gap(tip, axis, point[:, :3], original).larger > match.tolerance)
    if len(far):  # the sum of both squares is least there, but not the larger
        here = segment[far]
        nc, runs = match.nc.part(match.first, len(match.nc)), (first[row[far]], last[row[far]])

        def squares(number: Floats) -> Floats:
            return larger_square(inner_points(nc, match.motion, match.task, number) - point[far])

        here = _lowest_between(squares, np.maximum(here - 1.0, runs[0]), np.minimum(here + 1.0, runs[1]))
        six = inner_points(nc, match.motion, match.task, here)
        segment[far], tip[far], axis[far] = here, six[:, :3], match.task.axis_of(six)
    return Reached(passing.vertex, match.task.gap(tip, axis, point[:, :3], original), segment)


def written_alone(match: Match, reached: Reached, rows: Ints, metric: Metric) -> Floats:
    """(k,) distances of tips, or of axis points, of rows of `of_written`, each on its own."""
    vertex = reached.vertex[rows]
    gap = gap_of_written(match, vertex, _place_of_written(match, vertex, metric))
    off: Floats = np.minimum(_known(reached, rows, metric), gap.tip if metric == "tip" else gap.axis_point)
    return off


def original_alone(match: Match, reached: Reached, rows: Ints, metric: Metric) -> Floats:
    """(k,) distances of tips, or of axis points, of rows of `of_original`, each on its own."""
    point, columns = match.path.points[reached.vertex[rows]], COLUMNS[metric]
    middle = np.minimum(reached.place[rows].astype(np.int64), len(match.six) - 2)
    first, last = match.runs
    place = nearest_places(point, match.six, middle, _REACH, first[middle], last[middle] - 1, metric)
    _, tip, axis = _refined(match, point, place, metric)
    off = distance_between(match.task.six(tip, axis)[:, columns], point[:, columns])
    return np.minimum(_known(reached, rows, metric), off)


def _known(reached: Reached, rows: Ints, metric: Metric) -> Floats:
    """How far each is at a common pose, which is never nearer than on its own."""
    return (reached.gap.tip if metric == "tip" else reached.gap.axis_point)[rows]


def _refined(match: Match, point: Floats, place: Floats, metric: Metric) -> tuple[Floats, Floats, Floats]:
    """Places on the written polyline, refined where it is bent, and tip and axis (k, 3) there."""
    motion, columns = match.motion, COLUMNS[metric]
    segment = np.minimum(place.astype(np.int64), len(match.six) - 2)
    at = place - segment
    six = motion.six.take(segment, axis=0)
    six += at[:, None] * (motion.six.take(segment + 1, axis=0) - six)
    tip, axis = six[:, :3], match.task.axis_of(six)
    bent = np.flatnonzero(motion.bend[segment] > _BENT)
    if not len(bent):
        return place, tip, axis
    segment, at, point = segment[bent], at[bent], point[bent][:, columns]
    owner, end = motion.owner[segment + 1], motion.fraction[segment + 1]
    start = np.where(motion.owner[segment] == owner, motion.fraction[segment], 0.0)
    size = end - start
    low, high = np.maximum(start - size, 0.0), np.minimum(end + size, 1.0)
    written = WrittenAt(match.nc, owner + match.first)

    def squares(fraction: Floats) -> Floats:
        away = match.task.six(*written.at(fraction))[:, columns] - point
        square: Floats = np.einsum("ij,ij->i", away, away)
        return square

    origin, step = start + at * size, size / 4.0
    middle = np.clip(origin, low + step, high - step)
    points = [middle, middle - step, middle + step]
    values = [squares(fraction) for fraction in points]
    for _ in range(_ROUNDS):
        best = np.clip(_lowest(points[:3], values[:3]), low, high)
        points.insert(0, best)
        values.insert(0, squares(best))
    points.append(origin)
    values.append(squares(origin))
    here = np.choose(np.argmin(values, axis=0), points)
    tip[bent], axis[bent] = written.at(here)
    place = place.copy()
    place[bent] = segment + np.clip((here - start) / size, 0.0, 1.0)
    return place, tip, axis


def _lowest_between(value: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """(k,) where a function that falls and then rises is lowest between bounds: golden section."""
    low, high = low.copy(), high.copy()
    for _ in range(_SECTIONS):
        left, right = high - (high - low) / _GOLDEN, low + (high - low) / _GOLDEN
        falls = value(left) > value(right)
        low, high = np.where(falls, left, low), np.where(falls, high, right)
    lowest: Floats = (low + high) / 2.0
    return lowest


def _lowest(points: list[Floats], values: list[Floats]) -> Floats:
    """(k,) where parabolas through three values are lowest; the first point where they are not curved."""
    one, two = points[0] - points[1], points[0] - points[2]
    first, second = one * (values[0] - values[2]), two * (values[0] - values[1])
    below = 2.0 * (first - second)
    found: Floats = points[0] - np.divide(
        one * first - two * second, below, out=np.zeros_like(below), where=np.abs(below) > 0.0
    )
    return found
