"""Deviation: where the motions part, how far they are apart at most, and which poses are missed that must be exact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.distances import Gap, Reached, nearest, of_original, of_written
from cornersmooth.verify.exact_poses import digit_errors
from cornersmooth.verify.findings import AXIS_OFF, Findings, Violation, Where
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import COLUMNS, Metric, on_segments
from cornersmooth.verify.passage import AROUND, LONGER, MOST_BREAKS, Break
from cornersmooth.verify.task import ARITHMETIC

#: rows for which tip and axis point are looked at each on its own at a time: only the largest are wanted
_SOME: Final = 16

#: vertices and segments around a break that are looked at for what is said of it
_MOST_ROWS, _MOST_SEGMENTS = 256, 4096


def check_breaks(match: Match, found: Findings) -> None:
    """Both motions must be run beside each other within the tolerance: CS521, CS522, CS523, CS525, CS527."""
    for metric, one in match.breaks:
        _say(match, found, metric, one)
    if not match.whole and match.breaks:
        line = int(match.nc_lines(np.array([match.breaks[-1][1].row]))[0])
        found.unlooked.append((line, f"what comes after {MOST_BREAKS} places where the motions part"))


def _say(match: Match, found: Findings, metric: Metric, one: Break) -> None:
    """Take down one break: what is off around it, or else that the order is wrong."""
    task, limit, around = match.task, match.tolerance + ARITHMETIC, _Around.of(match, one)
    off: dict[str, float] = {}
    lines = _lines(match, one.place, int(around.rows[0]))
    for name in COLUMNS:
        off[name], place, row = around.farthest(match, name)
        where = _lines(match, place, row)
        if name == "both":
            gap = around.worst(match)
            found.take_worst("together_tip", Where(float(gap.tip[0]), *where))
            found.take_worst("together_axis_point", Where(float(gap.axis_point[0]), *where))
            found.take_worst("orientation", Where(float(gap.angle[0]), *where))
            found.poses.append(around.poses(match))
            lines = where if off[name] > limit else lines
        elif off[name] > limit and metric in (name, "both") and not (name == "axis_point" and task.own_axis):
            found.take_worst(name, Where(off[name], *where))
            found.violations.append(Violation("CS521" if name == "tip" else "CS522", place, *where, off[name]))
    if max(off["tip"], 0.0 if task.own_axis else off["axis_point"]) > limit:
        return
    if off["both"] <= limit and not one.proved:
        found.unlooked.append((lines[1], "the order of the motion"))
        return
    code, amount = "CS523" if off["both"] <= limit else "CS525", off["both"]
    if code == "CS525" and task.own_axis:
        code, amount = AXIS_OFF, float(np.degrees(gap.angle[0]))
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
        end = int(np.flatnonzero(match.section == match.section[row])[-1])
        whole = min(int(match.motion.last[match.motion.owner[row]]), end)  # what is off at its end begins before it
        again = whole + 1 + np.flatnonzero(match.on[whole + 1 : end + 1])
        resumed = int(again[0]) if len(again) else end + 1
        last = min(max(resumed - 1, row), end, row + _MOST_ROWS)
        here, stop = path.length_at(one.place), float(match.high[row] + 1)
        vertices = np.arange(int(one.place) + 1, int(stop) + 1)
        if len(again):
            stop = float(match.place[resumed])
            vertices = vertices[: int(np.ceil(stop)) - int(one.place) - 1]
        elif last < end or match.goes_on:  # no farther than the rows that are looked at
            way = np.diff(match.six[max(row - 1, 0) : last + 1], axis=0)
            longest = LONGER * float(np.sqrt(np.einsum("ij,ij->i", way, way)).sum()) + AROUND * match.tolerance
            length = here + longest
            stop, vertices = min(stop, float(np.searchsorted(path.length, length))), vertices[:0]
        radius = AROUND * match.tolerance
        low, high = np.searchsorted(path.length, (here - radius, path.length_at(stop) + radius)).tolist()
        low = min(max(low - 1, int(match.low[row])), int(match.high[row]))
        high = max(min(high, int(match.high[row]) + 1, low + _MOST_SEGMENTS), low + 1)
        vertices = vertices[:_MOST_SEGMENTS]
        steps = np.arange(max(row - 1, 0), max(min(resumed, end, last + 1), row))
        vertices = vertices if len(steps) else vertices[:0]
        return cls(np.arange(row, last + 1), np.arange(low, high), vertices, steps)

    def farthest(self, match: Match, metric: Metric) -> tuple[float, float, int]:
        """The largest distance of the vertices of both motions, mm; place and written vertex.

        The latter are those of the first that is beyond the tolerance: there it begins.
        """
        columns, path, limit = COLUMNS[metric], match.path.points, match.tolerance + ARITHMETIC
        share, off, nearest = _distances(match.six[self.rows], path, self.segments, columns)
        k = _first_or_worst(off, limit)
        found = float(off.max()), float(self.segments[nearest[k]] + share[k]), int(self.rows[k])
        if len(self.vertices):
            _, off, nearest = _distances(path[self.vertices], match.six, self.steps, columns)
            k = _first_or_worst(off, limit)
            if off.max() > found[0]:  # else the written vertices tell more
                place, row = float(self.vertices[k]), int(self.steps[nearest[k]]) + 1
                found = (float(off.max()), place, row) if found[0] <= limit else (float(off.max()), *found[1:])
        return found

    def worst(self, match: Match) -> Gap:
        """That of the written vertex that is farthest off both paths at common places."""
        share, off, nearest = _distances(match.six[self.rows], match.path.points, self.segments, COLUMNS["both"])
        k = int(off.argmax())
        place = self.segments[nearest[k : k + 1]] + share[k : k + 1]
        return Gap.of(match.task, match.six[self.rows[k : k + 1]] - match.path.at(place))

    def poses(self, match: Match) -> Floats:
        """How far the original poses are from the written motion."""
        trail, vertices = match.original.trail, self.vertices
        vertices = vertices[trail.fraction[vertices] == 1]
        point, pose = match.path.points[vertices], match.original.pose[trail.owner[vertices]]
        if not len(vertices):
            return np.zeros((5, 0))
        share, _, nearest = _distances(point, match.six, self.steps, COLUMNS["both"])
        step, at = self.steps[nearest], share[:, None]
        six = match.six[step] + at * (match.six[step + 1] - match.six[step])
        gap = Gap.of(match.task, six - point)
        return np.array((pose, gap.tip, gap.axis_point, gap.angle, match.nc_lines(step + 1)))


def _first_or_worst(off: Floats, limit: float) -> int:
    """The first that is beyond a limit, or the largest."""
    return int(np.argmax(off > limit)) if off.max() > limit else int(off.argmax())


def _distances(point: Floats, vertices: Floats, segments: Ints, columns: slice) -> tuple[Floats, Floats, Ints]:
    """Of points (k, 6): fraction, distance (k,) and which of segments (m,) is nearest.

    Of both, tip and axis point, the larger distance at the nearest common place.
    """
    segments = np.broadcast_to(segments, (len(point), len(segments)))
    share, square = on_segments(point[:, None, columns], vertices, segments, columns)
    if columns == slice(0, 6):
        start = vertices[segments]
        away = point[:, None] - start - share[..., None] * (vertices[segments + 1] - start)
        square = np.maximum((away[..., :3] ** 2).sum(axis=2), (away[..., 3:] ** 2).sum(axis=2))
    nearest, each = square.argmin(axis=1), np.arange(len(point))
    return share[each, nearest], np.sqrt(square[each, nearest]), nearest


def measure_written(match: Match, found: Findings) -> None:
    """Take down how far written vertices are from the original."""
    reached = of_written(match)
    lines = match.cl_lines(reached.place), match.nc_lines(reached.vertex)
    _largest(match, found, reached, lines)


def measure_original(match: Match, found: Findings) -> None:
    """Take down how far vertices of the original are from the written motion, and poses that must be passed: CS524."""
    reached = of_original(match)
    original = match.original
    pose = original.pose[original.trail.owner[reached.vertex]]
    row = np.minimum(reached.place.astype(np.int64) + 1, len(match.six) - 1)
    nc_line = match.nc_lines(row)
    _largest(match, found, reached, (original.program.line[pose], nc_line))
    gap, whole = reached.gap, original.trail.fraction[reached.vertex] == 1
    columns: Floats = np.array((pose, gap.tip, gap.axis_point, gap.angle, nc_line))
    found.poses.append(columns[:, whole])
    _check_exact_poses(match, found, reached.vertex[whole], row[whole])


def _largest(match: Match, found: Findings, reached: Reached, lines: tuple[Ints, Ints]) -> None:
    """Take what the vertices of one of the two motions found; only the largest are looked at closely."""
    gap = reached.gap
    found.note("together_tip", gap.tip, *lines)
    found.note("together_axis_point", gap.axis_point, *lines)
    found.note("orientation", gap.angle, *lines)
    alone: tuple[tuple[Metric, Floats], ...] = (("tip", gap.tip), ("axis_point", gap.axis_point))
    for name, known in alone:
        rows, some = np.flatnonzero(known > found.worst[name].value), _SOME
        while len(rows):
            first = rows[np.argpartition(-known[rows], some)[:some]] if len(rows) > some else rows
            off = np.minimum(nearest(match, reached, first, name), known[first])
            found.note(name, off, lines[0][first], lines[1][first])
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
    pose = np.array([vertex])
    return any(match.reachable.may_be_at(end, pose)[0] for end in ends[exact].tolist())
