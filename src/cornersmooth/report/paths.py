"""The two motions that pages and pictures show: the original path, and the written one with its deviations.

Deviations along the path are those of Figures 10, 11 and 16 of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import angle_between, dot, norm
from cornersmooth.geometry.arcs import poses_and_arcs
from cornersmooth.model import Bools, Floats, Ints, Move, Program
from cornersmooth.nc_reader.elements import Element, NcProgram
from cornersmooth.nc_reader.tool import written_at
from cornersmooth.settings import Settings
from cornersmooth.verify.batches import Batches
from cornersmooth.verify.deviation import Gap, together
from cornersmooth.verify.match import Match
from cornersmooth.verify.motions import nearest_places
from cornersmooth.verify.passage import MOST_BREAKS
from cornersmooth.verify.task import Task

#: segments on either side in which the common pose is looked for
_REACH = 2


@dataclass(frozen=True)
class Deviation:
    """How far written poses are from the original, at the poses of it that come nearest to tip and axis point together.

    k rows; all but the first two are NaN where nothing is compared, as in rapids.
    """

    pose: Ints  #: (k,): original pose that the original move leads to
    share: Floats  #: (k,): where on the original move, 1 at its end; NaN where nothing is compared
    #: (k,) mm: axis points as in `Task`: with an axis tolerance, what the axis is off, where that shows as the
    #: tolerance
    tip: Floats
    axis_point: Floats
    angle: Floats  #: (k,) degrees


def deviation_at(task: Task, nc: NcProgram, element: Ints, share: Floats) -> Deviation:
    """Deviation of poses of a program that was read, given by path elements (k,), ascending, and shares of them."""
    pose, numbers = np.zeros(len(element), np.int64), np.full((4, len(element)), np.nan)
    for batch in Batches(task, nc.events, nc.retracts).of([nc]):
        match = Match.of(task, batch)
        last = match.motion.last
        start, end = last[:-1], last[1:]
        feeding = np.flatnonzero(
            (match.section[start] == match.section[end]) & (match.section[end] >= 0) & (end <= _looked_at(match))
        )
        own = feeding + match.first + 1
        rows = np.flatnonzero(np.isin(element, own + batch.offset))
        of, some = np.searchsorted(own, element[rows] - batch.offset), share[rows]
        six = task.six(*written_at(match.nc, own[of], some))
        filled = _filled(match)
        # somewhere between the places of the element's ends
        low, high = filled[start[feeding]][of], filled[end[feeding]][of]
        vertex = end[feeding][of]
        limits = match.low[vertex], match.high[vertex]
        middle = np.clip((low + some * (high - low)).astype(np.int64), *limits)
        place = nearest_places(six, match.path.points, middle, _REACH, *limits)
        place, _ = together(match, six, place, vertex)
        gap = Gap.of(task, (six - match.path.at(place)).T)
        owner, fraction = match.original.trail.located(place)
        pose[rows] = match.original.pose[owner]
        numbers[:, rows] = fraction, gap.tip, gap.axis_point, np.degrees(gap.angle)
    return Deviation(pose, *numbers)


def _looked_at(match: Match) -> int:
    """Last vertex that was looked at: the verification ends where the motions have parted many times."""
    rows = [found.row for metric, found in match.breaks if metric == "both"]
    return rows[-1] if len(rows) >= MOST_BREAKS else len(match.place)


def _filled(match: Match) -> Floats:
    """Places (v,) of all vertices: where the motions part, between the next that are known or the ends of stretches."""
    place, rows = match.place.copy(), match.stretches
    for end, at in (("last", "end"), ("first", "start")):
        vertex = match.motion.last[rows[end] - match.first]
        place[vertex] = np.where(match.on[vertex], place[vertex], rows[at][:, 0])
    known, path = np.flatnonzero(np.isfinite(place)), match.path
    way = np.cumsum(norm(np.diff(match.six, axis=0, prepend=match.six[:1])))
    between = np.interp(way, way[known], path.lengths_at(place[known]))
    return np.where(match.on, place, np.interp(between, path.length, np.arange(len(path.length))))


#: points on every line and on every curve or arc: so many in all, between the least and the most of each
_POINTS = 6000
_ON_LINES, _ON_CURVES = (2, 16), (8, 32)

#: elements from which lines have a point each
_MANY = 100_000

#: steps to the nearest point of a move
_STEPS = 3

#: points whose distance is found at a time: what that needs does not grow with the text
_AT_ONCE = 65_536

#: chords of an original arc
_ARC_CHORD = np.radians(3.0)


@dataclass(frozen=True)
class OriginalPath:
    """The CL path as a polyline, k points; arcs in chords."""

    tip: Floats  #: (k, 3)
    axis: Floats  #: (k, 3)
    pose: Ints  #: (k,): pose that each point belongs to or leads to
    rapid: Bools  #: (k,): whether the tool gets here at rapid speed
    breaks: Bools  #: (k,): whether nothing is drawn into the point: the tool does not come from the point before
    way: Floats  #: (n,) mm: length of the tip path up to every pose of the program


@dataclass(frozen=True)
class WrittenPath:
    """Points of the written path, m of them in order."""

    tip: Floats  #: (m, 3)
    axis: Floats  #: (m, 3)
    element: Ints  #: (m,): path element of the text, the first with a single point
    share: Floats  #: (m,): where on it, 1 at its end
    rapid: Bools  #: (m,)
    pose: Ints  #: (m,): pose that the original move leads to which the point belongs to
    way: Floats  #: (m,) mm: length of the original tip path up to there; never falls
    #: (m,) mm: Distance of the tip from the original tip path, and of the axis point from its path; NaN in rapids.
    tip_off: Floats
    axis_off: Floats
    angle_off: Floats  #: (m,) degrees
    feed: Floats  #: (m,) mm/min: NaN in rapids, and where the text gives none
    curvature: Floats  #: (m,) 1/mm
    cl_line: Ints  #: (m,)
    nc_line: Ints  #: (m,)

    def __len__(self) -> int:
        return len(self.element)


def original_path(program: Program) -> OriginalPath:
    """Polyline of a program."""
    pose, tip, axis = poses_and_arcs(program, _ARC_CHORD)
    kind = program.kind[pose]
    breaks = np.append(True, (kind[:-1] == Move.FROM) & (kind[1:] != Move.ARC))[: len(pose)]
    step = np.where(breaks, 0.0, norm(np.diff(tip, axis=0, prepend=tip[:1])))
    rapid = np.isin(kind, (Move.RAPID, Move.HOLE))
    last = np.flatnonzero(np.append(pose[1:] != pose[:-1], True))[: len(program)]
    return OriginalPath(tip, axis, pose, rapid, breaks, np.cumsum(step)[last])


def written_path(program: Program, nc: NcProgram, original: OriginalPath, settings: Settings) -> WrittenPath:
    """Points of a text that was read, each with its place on the original and its deviation."""
    length, own_axis = settings.axis_length, settings.axis_tolerance
    bent = np.isin(nc.kind, (Element.ARC, Element.CURVE))
    share_of_each = _POINTS // len(nc)
    lines = int(np.clip(share_of_each, *_ON_LINES)) if len(nc) < _MANY else 1
    rapid = nc.kind == Element.RAPID
    pieces = np.where(rapid, 1, np.where(bent, int(np.clip(share_of_each, *_ON_CURVES)), lines))
    pieces[:1] = 1
    element = np.repeat(np.arange(len(nc)), pieces)
    share = (np.arange(len(element)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1) / pieces[element]
    tip, axis = written_at(nc, element, share)
    end = (share == 1.0) | bent[element]  # vertices of the path: ends of lines, and all points of curves
    found = deviation_at(Task.of(program, settings.tolerance, length, own_axis), nc, element, share)
    start = original.way[np.maximum(found.pose - 1, 0)]
    way = _continued(start + found.share * (original.way[found.pose] - start), tip, original)
    there = np.isfinite(found.share)
    pose = np.where(there, found.pose, np.minimum(np.searchsorted(original.way, way), len(program) - 1))
    straight = np.flatnonzero(there & (program.kind[pose] == Move.LINEAR))
    second = () if own_axis is not None else ((found.axis_point, length),)
    for first in range(0, len(straight), _AT_ONCE):
        some = straight[first : first + _AT_ONCE]
        for off, height in ((found.tip, 0.0), *second):
            near = _distance(program, tip[some] + height * axis[some], pose[some], found.share[some], height)
            off[some] = np.minimum(off[some], near)
    return WrittenPath(
        tip=tip,
        axis=axis,
        element=element,
        share=share,
        rapid=rapid[element],
        pose=pose,
        way=way,
        tip_off=found.tip,
        axis_off=found.axis_point,
        angle_off=found.angle,
        feed=np.where(nc.per_revolution[element], np.nan, nc.feed[element]),
        curvature=_curvature(tip, end, rapid[element]),
        cl_line=program.line[pose],
        nc_line=nc.line[element],
    )


def _distance(program: Program, points: Floats, pose: Ints, share: Floats, height: float) -> Floats:
    """Distance (k,) of points from the original path of the point at `height` on the tool axis.

    The common pose that `deviation_at` finds serves tip and axis point together. Each alone is nearer, on the same
    move or on one beside it; steps of Gauss and Newton find where.
    """
    least = np.full(len(points), np.inf)
    linear = program.kind == Move.LINEAR
    linear[:1] = False
    for beside in (-1, 0, 1):
        move = np.clip(pose + beside, 1, len(program) - 1)
        at = np.clip(share - beside, 0.0, 1.0)
        start, step = program.tip[move - 1], program.tip[move] - program.tip[move - 1]
        lean, turn = program.axis[move - 1], program.axis[move] - program.axis[move - 1]
        for rest in range(_STEPS, -1, -1):
            leaning = lean + at[:, None] * turn
            length = norm(leaning)[:, None]
            arm = points - (start + at[:, None] * step + height * leaning / length)
            if not rest:
                break
            axis = leaning / length
            rate = step + height * (turn - dot(turn, axis)[:, None] * axis) / length
            size = dot(rate, rate)
            at = np.clip(at + np.divide(dot(arm, rate), size, out=np.zeros_like(size), where=size > 0.0), 0.0, 1.0)
        least = np.where(linear[move], np.minimum(least, norm(arm)), least)
    return least


def _continued(place: Floats, tip: Floats, original: OriginalPath) -> Floats:
    """Places on the original for all points: between known ones in proportion to the way, and never falling."""
    length = np.cumsum(norm(np.diff(tip, axis=0, prepend=tip[:1])))
    known = np.flatnonzero(np.isfinite(place))
    end = float(original.way[-1])
    if not len(known):
        return length * (end / length[-1] if length[-1] else 0.0)
    first, last = known[0], known[-1]
    way = np.interp(length, length[known], np.maximum.accumulate(place[known]))
    way[:first] = np.maximum(place[first] - (length[first] - length[:first]), 0.0)
    way[last + 1 :] = np.minimum(place[last] + (length[last + 1 :] - length[last]), end)
    way[known] = place[known]
    return np.maximum.accumulate(way)


def _curvature(tip: Floats, end: Bools, rapid: Bools) -> Floats:
    """Turn of the path at its vertices over the way that goes with each, 1/mm; on a line that of its end."""
    vertex = np.flatnonzero(end)
    step = np.diff(tip[vertex], axis=0)
    length = norm(step)
    found = np.zeros(len(vertex))
    if len(vertex) > 2:
        moving = (length[:-1] > 0.0) & (length[1:] > 0.0) & ~rapid[vertex[1:-1]] & ~rapid[vertex[2:]]
        turn = np.where(moving, angle_between(step[:-1], step[1:]), 0.0)
        found[1:-1] = np.divide(2.0 * turn, length[:-1] + length[1:], out=np.zeros_like(turn), where=moving)
    return found[np.minimum(np.searchsorted(vertex, np.arange(len(tip))), max(len(vertex) - 1, 0))]


def thinned(points: Floats, weight: Floats, must: Bools, most: int) -> Ints:
    """Rows (r,) of a path (n, 3) to keep, ascending: about so many at most, beside those that must stay.

    Of every group of neighbours its first and last point are kept, the one farthest from the chord between them, and
    the one of the largest weight, where NaN counts as nothing.
    """
    n = len(points)
    if n <= most:
        return np.arange(n)
    size = -(-4 * n // most)
    first = np.arange(0, n, size)
    last = np.minimum(first + size, n) - 1
    group = np.arange(n) // size
    start = points[first][group]
    chord = (points[last] - points[first])[group]
    length, arm = norm(chord), points - start
    off = np.where(length < 1e-9, norm(arm), norm(np.cross(arm, chord)) / np.maximum(length, 1e-12))
    keep = must.copy()
    keep[first] = keep[last] = True
    for values in (off, np.nan_to_num(weight, nan=-1.0)):
        keep[_largest(values, first, group)] = True
    return np.flatnonzero(keep)


def _largest(values: Floats, first: Ints, group: Ints) -> Ints:
    """First row with the largest value in each group."""
    top = np.maximum.reduceat(values, first)
    rows = np.flatnonzero(values == top[group])
    _, one = np.unique(group[rows], return_index=True)
    return rows[one]
