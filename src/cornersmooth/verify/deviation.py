"""Deviation: where the motions part, how far they are apart at most, and which poses are missed that must be exact.

Amounts decide nothing. At common poses they are the distances at the places that prove the decision: all that is proved
keeps within them. Of tips and of axis points alone the nearest places are looked for beside those.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.chain import points_at
from cornersmooth.verify.feeds import reach
from cornersmooth.verify.match import Match
from cornersmooth.verify.motions import (
    ARITHMETIC,
    COLUMNS,
    Metric,
    digit_errors,
    largest_square,
    nearest_places,
    on_segments,
)
from cornersmooth.verify.passage import AROUND, LONGER, LOOK_BACK, Break
from cornersmooth.verify.result import AXIS_OFF, Findings, Violation, Where
from cornersmooth.verify.task import Task

#: places nearer to a vertex of the CL path are at it, in segments
_HAIR: Final = 1e-9

#: segments on either side of a place among which a nearer one is looked for at first
_REACH: Final = 2

#: places between two at which a distance is worked out, in so many rounds at most: to a billionth of the way
_SHARES, _ROUNDS = np.linspace(0.0, 1.0, 33), 8

#: the neighbours of a place
_SIDES: Final = np.array([[-1], [1]])

#: mm: rounds end where the next could not find less by more
_NO_LESS: Final = 1e-9

#: rows for which tip and axis point are looked at each on its own at a time: only the largest are wanted
_SOME: Final = 16

#: where a bent step is looked at between its ends: what quarters miss is a 16th of its bend, so less than ε / 100
_INSIDE: Final = np.arange(1, 4) / 4

#: vertices and segments around a break that are looked at for what the message has of it
_MOST_ROWS, _MOST_SEGMENTS = 256, 4096


@dataclass(frozen=True)
class Gap:
    """How far poses are from a motion, k rows."""

    tip: Floats  #: (k,) mm
    axis_point: Floats  #: (k,) mm
    angle: Floats  #: (k,) rad: between the tool axes

    @classmethod
    def of(cls, task: Task, away: Floats) -> Gap:
        """That of differences (6, k) of tips and axis points."""
        turned = away[3:] if task.own_axis else away[3:] - away[:3]
        tip, axis_point, turn = (np.sqrt(np.einsum("ij,ij->j", off, off)) for off in (away[:3], away[3:], turned))
        return cls(tip, axis_point, 2.0 * np.arcsin(np.minimum(turn / (2.0 * task.axis_length), 1.0)))


@dataclass(frozen=True)
class Reached:
    """What vertices of one motion find on the other, or points of the steps behind them, k rows."""

    vertex: Ints  #: (k,): the vertices
    six: Floats  #: (k, 6): tips and axis points
    gap: Gap  #: at a common pose
    place: Floats  #: (k,): where on the other polyline: segment plus fraction
    mine: bool  #: whether they are written


def of_written(match: Match) -> Reached:
    """Every written vertex that has a place, against the polyline of the original there."""
    vertex = np.flatnonzero(match.on)
    six = match.six.take(vertex, axis=0)
    place, away = together(match, six, match.place[vertex], vertex)
    return Reached(vertex, six, Gap.of(match.task, away), place, True)


def of_bent_steps(match: Match, ends: Reached, least: float) -> Reached:
    """What written steps have between their ends, which may be more than `least`: by their bend more than at these."""
    most = np.zeros(len(match.six))
    most[ends.vertex] = np.maximum(ends.gap.tip, ends.gap.axis_point)
    bend = match.motion.bend
    step = np.flatnonzero(match.step & (bend > 0.0) & (np.maximum(most[:-1], most[1:]) + bend > least))
    number = (step[:, None] + _INSIDE).ravel()
    vertex = number.astype(np.int64)
    six = match.motion.at(number)
    start = match.place[vertex]
    place, away = together(match, six, start + (number - vertex) * (match.place[vertex + 1] - start), vertex)
    return Reached(vertex, six, Gap.of(match.task, away), place, True)


def together(match: Match, six: Floats, place: Floats, vertex: Ints) -> tuple[Floats, Floats]:
    """Common poses (k,) on the CL path of written points (k, 6), around places near them, and differences (6, k).

    The sum of both squares is least at the places; where that is not enough, the larger of both is. The points are in
    the stretches of written vertices (k,).
    """
    away = six.T - points_at(match.path.points, place)
    if len(far := np.flatnonzero(largest_square(away) > match.task.radius**2)):
        place, near = place.copy(), np.arange(-_REACH, _REACH + 1)  # segment by segment: at corners it falls twice
        segment = place[far].astype(np.int64)[:, None] + near
        segment = np.clip(segment, match.low[vertex[far], None], match.high[vertex[far], None]).astype(np.float64)
        ends, points = segment.ravel(), np.repeat(six[far], len(near), axis=0)
        found, off = (
            one.reshape(segment.shape) for one in _least(match.path.at, points, COLUMNS["both"], ends, ends + 1.0)
        )
        place[far] = found[np.arange(len(far)), off.argmin(axis=1)]
        away[:, far] = (six[far] - match.path.at(place[far])).T
    return place, away


def of_original(match: Match) -> Reached:
    """Every vertex of the original that is passed, against the step of the written motion on which it is."""
    vertex, row, share = match.passing
    place, point = row + share, match.path.points.take(vertex, axis=0)
    away = _written(match, place) - point
    # the sum of both squares is least there, and where that is not enough the larger of both has to be
    if len(far := np.flatnonzero(largest_square(away.T) > match.task.radius**2)):
        first, last = match.runs
        ends = np.maximum(row[far] - 1.0, first[row[far]]), np.minimum(row[far] + 2.0, last[row[far]])
        place[far], _ = _least(lambda where: _written(match, where), point[far], COLUMNS["both"], *ends)
        away[far] = _written(match, place[far]) - point[far]
    return Reached(vertex, point, Gap.of(match.task, away.T), place, False)


def nearest(match: Match, reached: Reached, rows: Ints, metric: Metric, least: float) -> Floats:
    """(k,) distances of some rows from the nearest place of the other motion: of tips, or of axis points.

    Where they are not above `least`, or not the largest, they may be too small by twice the bend of the motion.
    """
    vertex, six, middle = reached.vertex[rows], reached.six[rows], reached.place[rows].astype(np.int64)
    if reached.mine:
        other, low, high = match.path.points, match.low[vertex], match.high[vertex]
    else:
        other, middle = match.six, np.minimum(middle, len(match.six) - 2)
        first, last = match.runs
        low, high = first[middle], last[middle] - 1
    best, far, reach = np.empty(len(rows)), np.arange(len(rows)), _REACH
    while len(far) and reach <= _MOST_SEGMENTS:  # where lines are much shorter than ε, many are near
        best[far] = nearest_places(six[far], other, middle[far], reach, low[far], high[far], metric)
        more = np.abs(best[far].astype(np.int64) - middle[far]) >= reach
        if match.task.apart:  # where each is run on its own, a tip that stands is passed
            more |= largest_square((six[far].T - points_at(other, best[far]))[COLUMNS[metric]]) > match.tolerance**2
        far, reach = far[more], 4 * reach
    segment = np.clip((best + _SIDES / 2.0).astype(np.int64), low, high)  # that it is on, and that beside it
    way = (other[segment + 1] - other[segment])[..., COLUMNS[metric]]
    bend = (match.path if reached.mine else match.motion).bend[segment].max(axis=0)
    chord = np.sqrt(largest_square((six.T - points_at(other, best))[COLUMNS[metric]]))
    distance = chord - bend
    if len(bent := np.flatnonzero((bend > 0.0) & (chord + bend > max(least, distance.max())))):
        # farther along chords these alone are farther than the bends could take away
        room = 2.0 * np.sqrt(bend * (chord + bend)) / np.maximum(np.linalg.norm(way, axis=2).min(axis=0), ARITHMETIC)
        near = best + np.minimum(room, 0.5) * _SIDES
        at = match.path.at if reached.mine else lambda where: _written(match, where)
        distance[bent] = _least(at, six[bent], COLUMNS[metric], *np.clip(near, low, high + 1.0)[:, bent])[1]
    return distance


def _least(
    at: Callable[[Floats], Floats], points: Floats, columns: slice, low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """(k,) places between two nearest to points (k, 6), and distances of the farther triple.

    Exact where a motion is straight: there the distance is convex, and falls below the least of three by no more than
    the others are above it.
    """
    each = np.arange(len(low))
    for _ in range(_ROUNDS):
        place = low + _SHARES[:, None] * (high - low)
        away = at(place.ravel()).reshape(*place.shape, -1) - points
        square = largest_square(np.moveaxis(away[..., columns], 2, 0))
        best = square.argmin(axis=0)
        sides = np.clip(best + _SIDES, 0, len(_SHARES) - 1)
        (low, high), least = place[sides, each], np.sqrt(square[best, each])
        if (np.sqrt(square[sides, each]) <= least + _NO_LESS).all():
            break
    return place[best, each], least


def _written(match: Match, place: Floats) -> Floats:
    """(k, 6) points of the written motion at places of its polyline."""
    points = points_at(match.six, place).T
    segment = np.minimum(place.astype(np.int64), len(match.six) - 2)
    bent = np.flatnonzero((match.motion.bend[segment] > 0.0) & (place > segment) & (place < segment + 1))
    if len(bent):
        points[bent] = match.motion.at(place[bent])
    return points


def check_breaks(match: Match, found: Findings) -> None:
    """Both motions must be run beside each other within the tolerance: CS521, CS522, CS523, CS525, CS527."""
    found.breaks = match.nc_lines(np.array([one.row for _, one in match.breaks], np.int64)).tolist()
    for metric, one in match.breaks:
        _say(match, found, metric, one)


def _say(match: Match, found: Findings, metric: Metric, one: Break) -> None:
    """Take down one break: what is off around it, or else that the order is wrong."""
    task, limit, around = match.task, match.tolerance + ARITHMETIC, _Around.of(match, one)
    off: dict[str, float] = {}
    lines, turned = _lines(match, one.place, int(around.rows[0])), 0.0
    for name in COLUMNS:
        distance, place, step = around.distances(match, name)
        row = np.maximum(np.ceil(step), around.rows[0]).astype(np.int64)
        off[name] = float(distance.max())
        k = int(np.argmax(distance > limit)) if off[name] > limit else int(distance.argmax())  # there it begins
        where = _lines(match, float(place[k]), int(row[k]))
        if name == "both":
            gap = Gap.of(task, (_written(match, step) - match.path.at(place)).T)
            around.note(match, found, gap, row)
            farthest = int(distance[: len(around.rows)].argmax())
            turned = float(gap.angle[farthest])
            found.take_worst("together_tip", Where(float(gap.tip[farthest]), *where))
            found.take_worst("together_axis_point", Where(float(gap.axis_point[farthest]), *where))
            found.take_worst("orientation", Where(turned, *where))
            lines = where if off[name] > limit else lines
        elif off[name] > limit and metric in (name, "both") and not (name == "axis_point" and task.own_axis):
            code = "CS521" if name == "tip" else "CS522"
            found.take_worst(name, Where(off[name], *where))
            found.violations.append(Violation(code, float(place[k]), *where, off[name]))
    if max(off["tip"], 0.0 if task.own_axis else off["axis_point"]) > limit:
        return
    if off["both"] <= limit and not one.proved:
        found.unlooked.append((lines[1], "the order of the motion"))
        return
    code, amount = "CS523" if off["both"] <= limit else "CS525", off["both"]
    if code == "CS525" and task.own_axis:
        code, amount = AXIS_OFF, float(np.degrees(turned))
    found.violations.append(Violation(code, one.place, *lines, amount))


def _lines(match: Match, place: float, row: int) -> tuple[int, int]:
    """CL line that leads to a place, and NC line that leads to a written vertex."""
    return int(match.cl_lines(np.array([place]))[0]), int(match.nc_lines(np.array([row]))[0])


@dataclass(frozen=True)
class _Around:
    """What is around a break."""

    #: written vertices from the break to where the motions are together again, and segments of the CL path near them
    rows: Ints
    segments: Ints
    #: vertices of the CL path between the two places, and steps of the written motion near them
    vertices: Ints
    steps: Ints

    @classmethod
    def of(cls, match: Match, one: Break) -> _Around:
        """Find it."""
        path, row = match.path, max(one.row, 0)
        first, end = np.flatnonzero(match.section == match.section[row])[[0, -1]].tolist()
        whole = min(int(match.motion.last[match.motion.owner[row]]), end)  # what is off at its end begins before it
        again = whole + 1 + np.flatnonzero(match.on[whole + 1 : end + 1])
        resumed = int(again[0]) if len(again) else end + 1
        last = min(max(resumed - 1, row), end, row + _MOST_ROWS)
        here, near = path.length_at(one.place), AROUND * match.tolerance
        stop, vertices = float(match.high[row] + 1), np.zeros(0, np.int64)
        if last == resumed - 1 and len(again):
            stop = float(match.place[resumed])
            vertices = np.arange(int(one.place) + 1, math.ceil(stop))
        elif last == end and not match.goes_on:
            vertices = np.arange(int(one.place) + 1, int(stop) + 1)
        else:  # no farther than the rows that are looked at
            way = np.diff(match.six[max(row - 1, 0) : last + 1], axis=0)
            longest = LONGER * float(np.linalg.norm(way, axis=1).sum()) + near
            stop = min(stop, float(np.searchsorted(path.length, here + longest)))
        low, high = np.searchsorted(path.length, (here - near, path.length_at(stop) + near)).tolist()
        low = min(max(low - 1, int(match.low[row])), int(match.high[row]))
        high = max(min(high, int(match.high[row]) + 1, low + _MOST_SEGMENTS), low + 1)
        before = max(row - LOOK_BACK[1], first)  # what is passed late may be near what has been run before
        steps = np.arange(before, max(min(resumed, end, last + 1), before + 1))
        return cls(np.arange(row, last + 1), np.arange(low, high), vertices[:_MOST_SEGMENTS], steps)

    def distances(self, match: Match, metric: Metric) -> tuple[Floats, Floats, Floats]:
        """(k,) distances of vertices of both motions, mm, and places on both: written vertices first."""
        columns, path = COLUMNS[metric], match.path.points
        at, off = _nearest(match.six[self.rows], path, self.segments, columns)
        step, other = _nearest(path[self.vertices], match.six, self.steps, columns)
        if len(far := np.flatnonzero(other > match.tolerance)):  # off the chords, but perhaps not off the bent steps
            ends = np.maximum(step[far] - 0.5, self.steps[0]), np.minimum(step[far] + 0.5, self.steps[-1] + 1.0)
            points = path[self.vertices[far]]
            other[far] = _least(lambda where: _written(match, where), points, columns, *ends)[1]
        return np.append(off, other), np.append(at, self.vertices), np.append(self.rows, step)

    def note(self, match: Match, found: Findings, gap: Gap, row: Ints) -> None:
        """Take down how far original poses are from the written motion, of all that was looked at."""
        trail = match.original.trail
        whole = np.flatnonzero(trail.fraction[self.vertices] == 1)
        pose, some = match.original.pose[trail.owner[self.vertices[whole]]], len(self.rows) + whole
        lines = match.nc_lines(row[some])
        found.poses.append(np.array((pose, gap.tip[some], gap.axis_point[some], gap.angle[some], lines)))


def _nearest(point: Floats, vertices: Floats, segments: Ints, columns: slice) -> tuple[Floats, Floats]:
    """(k,) nearest places of points (k, 6) on segments (m,), and distances.

    Of both, tip and axis point, the larger distance at the nearest common place.
    """
    segments = np.broadcast_to(segments, (len(point), len(segments)))
    share, square = on_segments(point[:, None, columns], vertices, segments, columns)
    if columns == COLUMNS["both"]:
        start = vertices[segments]
        away = point[:, None] - start - share[..., None] * (vertices[segments + 1] - start)
        square = np.maximum((away[..., :3] ** 2).sum(axis=2), (away[..., 3:] ** 2).sum(axis=2))
    nearest, each = square.argmin(axis=1), np.arange(len(point))
    return segments[each, nearest] + share[each, nearest], np.sqrt(square[each, nearest])


def measure_written(match: Match, found: Findings) -> None:
    """Take down how far written vertices are from the original."""
    reached = of_written(match)
    _largest(match, found, reached, lambda k: (match.cl_lines(reached.place[k]), match.nc_lines(reached.vertex[k])))
    inner = of_bent_steps(match, reached, min(found.worst[name].value for name in ("tip", "axis_point")))
    _largest(match, found, inner, lambda k: (match.cl_lines(inner.place[k]), match.nc_lines(inner.vertex[k] + 1)))


def measure_original(match: Match, found: Findings) -> None:
    """Take down how far vertices of the original are from the written motion, and poses that must be passed: CS524."""
    reached = of_original(match)
    original = match.original
    pose = original.pose[original.trail.owner[reached.vertex]]
    row = np.minimum(reached.place.astype(np.int64) + 1, len(match.six) - 1)
    nc_line = match.nc_lines(row)
    _largest(match, found, reached, lambda k: (original.program.line[pose[k]], nc_line[k]))
    gap, whole = reached.gap, original.trail.fraction[reached.vertex] == 1
    columns: Floats = np.array((pose, gap.tip, gap.axis_point, gap.angle, nc_line))
    found.poses.append(columns[:, whole])
    _check_exact_poses(match, found, reached.vertex[whole], row[whole])


def _largest(match: Match, found: Findings, reached: Reached, lines: Callable[[Ints], tuple[Ints, Ints]]) -> None:
    """Take what the vertices of one of the two motions found; only the largest are looked at closely.

    `lines` of rows: those of the CL file and of the text.
    """
    gap = reached.gap
    if not len(gap.tip):
        return
    together = {"together_tip": gap.tip, "together_axis_point": gap.axis_point, "orientation": gap.angle}
    for name, values in together.items():
        row = np.array([values.argmax()])
        found.note(name, values[row], *lines(row))
    alone: tuple[tuple[Metric, Floats], ...] = (("tip", gap.tip), ("axis_point", gap.axis_point))
    for name, known in alone:
        rows, some = np.flatnonzero(known > found.worst[name].value), _SOME
        while len(rows):
            first = rows[np.argpartition(-known[rows], some)[:some]] if len(rows) > some else rows
            off = np.minimum(nearest(match, reached, first, name, found.worst[name].value), known[first])
            found.note(name, off, *lines(first))
            rows = np.setdiff1d(rows[known[rows] > found.worst[name].value], first, assume_unique=True)
            some *= 4


def _check_exact_poses(match: Match, found: Findings, vertex: Ints, row: Ints) -> None:
    """Poses that may not be rounded must be ends of elements, to the printed digits: CS524."""
    original, task = match.original, match.task
    move = original.trail.owner[vertex]
    chosen = np.flatnonzero(task.exact[move])
    if not len(chosen):
        return
    vertex, row, move = vertex[chosen], row[chosen], move[chosen]
    pose = original.pose[move]
    tip, axis = original.program.tip[pose], original.program.axis[pose]
    owner, first, count = match.owner[row], match.first, len(match.motion.last)
    exact = np.zeros(len(row), np.bool_)
    amount, nearest = np.full(len(row), np.inf), owner
    for step in range(-2, 2):
        element = np.clip(owner + step, first, first + count - 1)
        same, off = digit_errors(match.nc, element, tip, axis, task.axis_length)
        exact |= same
        nearest = np.where(off < amount, element, nearest)
        amount = np.minimum(amount, off)
    for k in np.flatnonzero(~exact).tolist():
        exact[k] = _passed_elsewhere(match, int(vertex[k]), tip[k], axis[k])
    missed = np.flatnonzero(~exact)
    if len(missed):
        columns = vertex, original.program.line[pose], match.nc.line[nearest], amount
        rows = zip(*(column[missed].tolist() for column in columns), strict=True)
        found.violations += [Violation("CS524", *row) for row in rows]


def _passed_elsewhere(match: Match, vertex: int, tip: Floats, axis: Floats) -> bool:
    """Whether an element that names a pose may stand for it though its place is another, near it or on another turn."""
    ends = match.motion.last[match.on[match.motion.last]]
    here, around = match.path.length[vertex], AROUND * match.tolerance
    length = match.path.lengths_at(match.place[ends])
    ends = ends[slice(*np.searchsorted(length, (here - around, here + around)).tolist())]
    tips, axes = np.tile(tip, (len(ends), 1)), np.tile(axis, (len(ends), 1))
    exact, _ = digit_errors(match.nc, match.owner[ends], tips, axes, match.task.axis_length)
    ends = ends[exact]
    limits, six, place = (match.low[ends], match.high[ends]), match.six[ends], match.place[ends]
    first, last = (reach(match.task, six, place, limits, way) for way in (-1, 1))
    return bool(((first <= vertex + _HAIR) & (vertex - _HAIR <= last)).any())
