"""Curves of runs as control points to be written: sections of a limited number of points, C² where they meet.

A section is clamped at both ends, so that a control that takes so many control points in a curve and no more can run
it, and a reader finds a position on the path every so often. Its control points are the blossoms of the run's spline at
the knots of the section: knot insertion, which changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Floats, Ints, Program, Runs
from cornersmooth.smoothing.runs.ranges import spread, starts
from cornersmooth.smoothing.runs.splines import Splines

#: knot intervals of a section, whose control points `Rows.curve` counts to 127, and its parameter in steps beyond which
#: it ends as soon as it can
SPANS, LONGEST = 120, 5e6

#: knot intervals among which the widest is looked for where a section is to end
CHOICE = 12

#: knots are written in thousands of steps: three decimals hold them
STEPS_PER_UNIT = 1000.0


@dataclass(frozen=True)
class SectionRows:
    """Control points of all sections in path order, m rows.

    Parameters
    ----------
    move : (m,) int64
        Pose in whose segment the section ends.
    number : (m,) int64
        1 for the first control point of a section.
    points : (m, 6) float64, mm
        Tip and axis point.
    knot : (m,) float64
        Knot that goes with each control point, from 0.
    last_knot : (m,) float64
        The last knot of the section in its last row, else 0.
    """

    move: Ints
    number: Ints
    points: Floats
    knot: Floats
    last_knot: Floats


def section_rows(runs: Runs, program: Program) -> SectionRows:
    """Cut the runs into sections; poses behind which a statement stands are ends of sections."""
    splines = Splines(runs.knot, runs.knot_count)
    begin_run, begin_s, end_s = _cuts(runs, splines, program)
    # distinct knots of every section: its ends and the run's knots between
    base = starts(splines.knot[splines.first[1:] - 1].astype(np.int64) + 2)[:-1].astype(np.float64)
    keys = splines.knot + np.repeat(base, splines.count)
    inside = np.searchsorted(keys, begin_s + base[begin_run], side="right")
    after = np.searchsorted(keys, end_s + base[begin_run], side="left")
    spans = after - inside + 1
    # clamped knots u of a section with m spans: m + 7, control points m + 3
    section, place = spread(spans + 7)
    inner = np.clip(inside[section] + place - 4, 0, len(splines.knot) - 1)
    u = splines.knot[inner]
    u = np.where(place <= 3, begin_s[section], np.where(place >= spans[section] + 3, end_s[section], u))
    first_u = starts(spans + 7)[:-1]
    owner, number = spread(spans + 3)
    arguments = u[(first_u[owner] + number + 1)[:, None] + np.arange(3)]
    # any span that the control point belongs to: the run's span at the middle of one of the section's
    local = np.clip(number - 1, 0, spans[owner] - 1)
    low = u[first_u[owner] + local + 3]
    knot = np.searchsorted(keys, low + base[begin_run[owner]], side="right") - 1
    span = knot - begin_run[owner]
    points = splines.blossom(span, arguments, runs.control)
    last = number == spans[owner] + 2
    return SectionRows(
        move=_moves(runs, begin_run, end_s)[owner],
        number=number + 1,
        points=points,
        knot=(u[first_u[owner] + number] - begin_s[owner]) / STEPS_PER_UNIT,
        last_knot=np.where(last, (end_s - begin_s)[owner], 0.0) / STEPS_PER_UNIT,
    )


def _cuts(runs: Runs, splines: Splines, program: Program) -> tuple[Ints, Floats, Floats]:
    """Run, start and end of every section.

    Sections end in the middle of wide knot intervals: beside a sharp corner, where knots are close together, a place on
    the path may belong to either segment, and whoever reads the text would have to guess.
    """
    row, place = spread(splines.count)
    outermost = (place == 0) | (place == splines.count[row] - 1)
    # where so many intervals are full, the widest of the next few; never the last ones of a run
    step = SPANS - CHOICE - 1
    full = np.flatnonzero((place % step == 0) & (place > 0))
    near = full[:, None] + np.arange(CHOICE)
    left = splines.count[row[full]] - 1 - place[full]
    allowed = np.arange(CHOICE) < left[:, None] - 4
    width = np.diff(splines.knot, append=0.0)[np.minimum(near, len(splines.knot) - 1)]
    widest = near[np.arange(len(full)), np.where(allowed, width, -1.0).argmax(axis=1)][allowed.any(axis=1)]
    # the intervals in which a section gets too long
    long = np.floor(splines.knot / LONGEST)
    crossing = np.flatnonzero((long[1:] != long[:-1]) & (row[1:] == row[:-1]))
    crossing = crossing[splines.count[row[crossing]] - 1 - place[crossing] > 4]
    inside = np.concatenate((widest, crossing))
    middle = np.floor((splines.knot[inside] + splines.knot[inside + 1]) / 2.0)
    stands = np.zeros(len(program) + 1, np.bool_)
    for statement in program.statements:
        stands[statement.pose] = True
    run, index = spread(runs.count)
    at_pose = stands[runs.pose + 1] & (index > 0) & (index < runs.count[run] - 1)
    all_run = np.concatenate((row[outermost], row[inside], run[at_pose]))
    all_s = np.concatenate((splines.knot[outermost], middle, runs.s[at_pose]))
    pairs = np.unique(np.stack((all_run, all_s.astype(np.int64)), axis=1), axis=0)
    same = np.flatnonzero(pairs[1:, 0] == pairs[:-1, 0])
    return pairs[same, 0], pairs[same, 1].astype(np.float64), pairs[same + 1, 1].astype(np.float64)


def _moves(runs: Runs, run: Ints, s: Floats) -> Ints:
    """Pose in whose segment each place lies; a pose is in the segment that leads to it."""
    first = starts(runs.count)
    base = starts(runs.s[first[1:] - 1].astype(np.int64) + 2)[:-1].astype(np.float64)
    keys = runs.s + np.repeat(base, runs.count)
    at = np.searchsorted(keys, s + base[run], side="left")
    poses: Ints = runs.pose[at]
    return poses
