"""Deviation along the written path, for tables and pictures such as Figures 10, 11 and 16 of the paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays.slices import joined_rows, some_rows
from cornersmooth.model import Floats, Ints, Program
from cornersmooth.nc_reader.elements import NcProgram
from cornersmooth.nc_reader.tool import written_at
from cornersmooth.verify.batches import Batches
from cornersmooth.verify.deviation import Gap, of_original
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import nearest_places
from cornersmooth.verify.task import Task

#: segments on either side in which the common pose is looked for
_REACH = 2


@dataclass(frozen=True)
class Distribution:
    """Deviations along the feed moves in path order: of written poses from the original, and of its poses from them."""

    way: Floats  #: (k,) mm: length of the original path, rapids included, up to the original pose
    #: (k,) mm: axis points as in `Task`: with an axis tolerance, what the axis is off, where that shows as the
    #: tolerance
    tip: Floats
    axis_point: Floats
    angle: Floats  #: (k,) degrees
    share: Floats  #: (k,): where on the original move, 1 at its end
    fraction: Floats  #: (k,): where on the written element, as in `written_at`; 0 for rows of original poses
    pose: Ints  #: (k,): original pose that the original move leads to
    element: Ints  #: (k,): written element that was sampled, -1 for rows of original poses
    cl_line: Ints  #: (k,)
    nc_line: Ints  #: (k,)

    def __len__(self) -> int:
        return len(self.way)


def deviation_along(
    program: Program,
    nc: NcProgram,
    *,
    tolerance: float,
    axis_length: float = 10.0,
    axis_tolerance: float | None = None,
    samples: int = 8,
) -> Distribution:
    """Measure the deviation at `samples` even parameters of every path element, and at every original pose.

    It is that at the poses of the original that come nearest to tip and axis point together.
    """
    task = Task.of(program, tolerance, axis_length, axis_tolerance)
    parts = [Distribution(*np.zeros((6, 0)), *np.zeros((4, 0), np.int64))]
    for batch in Batches(task, nc.events, nc.retracts).of([nc]):
        matched = Match.of(task, batch)
        parts += [_of_elements(matched, batch.offset, samples), _of_poses(matched)]
    found = joined_rows(parts)
    return some_rows(found, np.argsort(found.way, kind="stable"))


def _of_poses(match: Match) -> Distribution:
    reached = of_original(match)
    original = match.original
    pose = original.pose[original.trail.owner[reached.vertex]]
    nc_line = match.nc_lines(np.minimum(reached.place.astype(np.int64) + 1, len(match.six) - 1))
    gap, way = reached.gap, match.path.length[reached.vertex]
    share, none = original.trail.fraction[reached.vertex], np.zeros(len(pose))
    places = pose, np.full(len(pose), -1), original.program.line[pose], nc_line
    return Distribution(way, gap.tip, gap.axis_point, np.degrees(gap.angle), share, none, *places)


def _of_elements(match: Match, offset: int, samples: int) -> Distribution:
    last = match.motion.last
    start, end = last[:-1], last[1:]
    feeding = np.flatnonzero((match.section[start] == match.section[end]) & (match.section[end] >= 0))
    # where the motions part places are those between the next that are known
    known, count = np.flatnonzero(match.on), len(match.place)
    filled = np.interp(np.arange(count), known, match.place[known]) if len(known) else 1.0 * match.low
    element = np.repeat(feeding + match.first + 1, samples)
    share = np.tile(np.arange(1, samples + 1) / samples, len(feeding))
    tip, axis = written_at(match.nc, element, share)
    # somewhere between the places of the element's ends
    low, high = filled[start[feeding]], filled[end[feeding]]
    place = np.repeat(low, samples) + share * np.repeat(high - low, samples)
    vertex = np.repeat(end[feeding], samples)
    limits = match.low[vertex], match.high[vertex]
    middle = np.clip(place.astype(np.int64), *limits)
    six = match.task.six(tip, axis)
    place = nearest_places(six, match.path.points, middle, _REACH, *limits)
    original = match.original
    owner, fraction = original.move_at(place)
    gap = Gap.of(match.task, six - match.task.six(*original.at(owner, fraction)))
    way = match.path.lengths_at(place)
    pose = original.pose[owner]
    places = pose, element + offset, original.program.line[pose], match.nc.line[element]
    return Distribution(way, gap.tip, gap.axis_point, np.degrees(gap.angle), fraction, share, *places)
