"""Deviation: how far the two motions are apart at most, and which poses are missed that must be passed exactly."""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.common_place import axis_off_of_original, axis_off_of_written
from cornersmooth.verify.distances import (
    Distances,
    Reached,
    common_gaps_of_original,
    own_gaps_of_original,
    own_gaps_of_written,
)
from cornersmooth.verify.findings import AXIS_OFF, Findings, Poses
from cornersmooth.verify.hull_bounds import hull_gaps
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import distance_between
from cornersmooth.verify.rapids import ARITHMETIC, digit_errors

#: rows of a batch for which tip and axis point are looked at each on its own: at a time at first, and those that are
#: farther than the tolerance from a common pose at a time
_OWN_ROWS, _SOME_OWN_ROWS = 16, 256

#: rows farther than the tolerance from which on the worst of them tell enough, if most of these are off by themselves
_MANY_OVER = 1024

#: poses of a batch that are missed where they are looked for, and looked for at other places, at most
_MOST_MISSED: Final = 1024

#: how many tolerances tip and axis point may be away from one common pose, though each is near its own path
TOGETHER: Final = 2.0


def check_written(distances: Distances, found: Findings) -> None:
    """Written vertices must be near the original: CS521, CS522, CS525, CS527."""
    match, written = distances.match, distances.written
    cl_line = _cl_lines_near(distances, written.place)
    nc_line = match.nc.line[match.written.trail.owner[written.vertex]]
    _take(distances, found, written, (cl_line, nc_line), written.place, mine=True)


def check_original(distances: Distances, found: Findings) -> None:
    """The written motion must come near the vertices of the original: CS521, CS522, CS525, CS527."""
    match, theirs = distances.match, distances.original
    original = match.original
    pose = original.pose[original.trail.owner[theirs.vertex]]
    cl_line = original.program.line[pose]
    segment = np.minimum(theirs.place.astype(np.int64) + 1, len(match.six) - 1)
    nc_line = match.nc.line[match.written.trail.owner[segment]]
    _take(distances, found, theirs, (cl_line, nc_line), theirs.vertex.astype(np.float64), mine=False)
    gap, whole = theirs.gap, original.trail.fraction[theirs.vertex] == 1
    found.poses.append(Poses(pose[whole], gap.tip[whole], gap.axis_point[whole], gap.angle[whole], nc_line[whole]))


def _cl_lines_near(distances: Distances, place: Floats) -> Ints:
    original = distances.match.original
    rows = np.minimum(place.astype(np.int64) + 1, len(original.trail) - 1)
    lines: Ints = original.program.line[original.pose[original.trail.owner[rows]]]
    return lines


def _take(
    distances: Distances, found: Findings, reached: Reached, lines: tuple[Ints, Ints], place: Floats, *, mine: bool
) -> None:
    """Take what the vertices of one of the two motions found."""
    match, (cl_line, nc_line) = distances.match, lines
    result, gap, limit = found.largest, reached.gap, match.tolerance + ARITHMETIC
    result.together_tip.update(gap.tip, cl_line, nc_line)
    result.together_axis_point.update(gap.axis_point, cl_line, nc_line)
    result.orientation.update(gap.angle, cl_line, nc_line)
    together = TOGETHER * match.tolerance + match.margin
    own_gaps = own_gaps_of_written if mine else own_gaps_of_original
    own_axis = match.task.own_axis
    axis_off = axis_off_of_written if mine else axis_off_of_original
    known = np.zeros(len(gap.tip), np.bool_)
    tip, axis = gap.tip.copy(), gap.axis_point.copy()

    def look(rows: Ints) -> None:
        tip[rows], axis[rows] = own_gaps(match, reached, rows)
        if own_axis:
            axis[rows] = axis_off(match, reached, rows)
        known[rows] = True

    over = np.flatnonzero(gap.larger > limit)
    order = over[np.argsort(-gap.larger[over])]
    for begin in range(0, len(order), _SOME_OWN_ROWS):
        rows = order[begin : begin + _SOME_OWN_ROWS]
        look(rows)
        off = int(np.count_nonzero(np.maximum(tip[rows], axis[rows]) > limit))
        if len(over) > _MANY_OVER and 2 * off > _SOME_OWN_ROWS:
            break  # the program is off everywhere: that is found already
    for values, worst in ((tip, result.tip), (axis, result.axis_point)):
        some = _OWN_ROWS
        while True:
            best = max(worst.value, float(values[known].max(initial=0.0)))
            rows = np.flatnonzero(~known & (values > best))
            if not len(rows):
                break
            if len(rows) > some:
                rows = rows[np.argpartition(-values[rows], some)[:some]]
            look(rows)
            some *= 2
        rows = np.flatnonzero(known)
        worst.update(values[rows], cl_line[rows], nc_line[rows])
    over = over[known[over]]
    apart = over[(gap.larger[over] > together) & (np.maximum(tip, axis)[over] <= limit)]
    if len(apart) and not own_axis:
        amount = gap.larger[apart] if mine else common_gaps_of_original(match, reached, apart)
        still = amount > together  # a step from a knot is not exact where the axis turns much before the next
        apart, amount = apart[still], amount[still]
        if len(apart):
            found.violations.add(525, place[apart], cl_line[apart], nc_line[apart], amount)
    for code, values in ((521, tip), (522, axis)):
        broken = over[values[over] > limit]
        if len(broken):
            _broken(match, found, code, place[broken], cl_line[broken], nc_line[broken], values[broken])


def _broken(
    match: Match, found: Findings, code: int, place: Floats, cl_line: Ints, nc_line: Ints, amount: Floats
) -> None:
    """Take down where tip or axis are beyond what they may."""
    if code == 522 and match.task.own_axis:
        code, amount = AXIS_OFF, match.task.degrees(amount)
    found.violations.add(code, place, cl_line, nc_line, amount)


def check_curves(distances: Distances, found: Findings) -> None:
    """Curves must be near the original between their knots too: CS521, CS522, CS527."""
    match = distances.match
    limit = match.tolerance + ARITHMETIC
    gaps = hull_gaps(match, limit)
    if gaps is None:
        return
    place, element, tip, axis = gaps
    cl_line = _cl_lines_near(distances, place)
    nc_line = match.nc.line[element]
    for code, values, worst in ((521, tip, found.largest.tip), (522, axis, found.largest.axis_point)):
        worst.update(values, cl_line, nc_line)
        broken = np.flatnonzero(values > limit)
        if len(broken):
            _broken(match, found, code, place[broken], cl_line[broken], nc_line[broken], values[broken])


def check_exact_poses(distances: Distances, found: Findings) -> None:
    """Poses that may not be rounded must be ends of elements, to the printed digits: CS524."""
    match, theirs = distances.match, distances.original
    original = match.original
    rows = np.flatnonzero(original.trail.fraction[theirs.vertex] == 1)
    move = original.trail.owner[theirs.vertex[rows]]
    rows = rows[match.task.exact[move]]
    if not len(rows):
        return
    move = original.trail.owner[theirs.vertex[rows]]
    pose = original.pose[move]
    tip, axis = original.program.tip[pose], original.program.axis[pose]
    trail, first = match.written.trail, match.written.first
    owner = trail.owner[np.minimum(theirs.place[rows].astype(np.int64) + 1, len(trail) - 1)]
    exact = np.zeros(len(rows), np.bool_)
    amount, nearest = np.full(len(rows), np.inf), owner
    for step in range(-2, 2):
        element = np.clip(owner + step, first, first + len(trail.last) - 1)
        same, off = digit_errors(match.nc, element, tip, axis, match.task.axis_length)
        exact |= same
        nearest = np.where(off < amount, element, nearest)
        amount = np.minimum(amount, off)
    missed = np.flatnonzero(~exact)
    for k in missed[:_MOST_MISSED].tolist():
        exact[k] = _passed_elsewhere(distances, int(rows[k]), tip[k], axis[k])
    missed = np.flatnonzero(~exact)
    if len(missed):
        found.violations.add(
            524,
            theirs.vertex[rows[missed]].astype(np.float64),
            original.program.line[pose[missed]],
            match.nc.line[nearest[missed]],
            amount[missed],
        )


def _passed_elsewhere(distances: Distances, row: int, tip: Floats, axis: Floats) -> bool:
    """Whether an element that names a pose may stand for it though its place is another, near it or on another turn."""
    match, theirs = distances.match, distances.original
    trail = match.written.trail
    beside = min(int(theirs.place[row]) + 1, len(trail) - 1)
    window = distances.windows.around(beside)
    if window is None:
        return False
    ends = trail.last[trail.last >= window.vertex]
    ends = ends[ends < window.vertex + len(window.low)]
    pose = theirs.vertex[row : row + 1]
    ends = ends[distance_between(match.six[ends], match.path.six[pose]) <= match.near]
    ends = ends[[window.may_be_at(end, pose)[0] for end in ends.tolist()]]
    element = trail.owner[ends]
    return bool(digit_errors(match.nc, element, tip, axis, match.task.axis_length)[0].any())
