"""Curves of runs as what is written: lines, or sections of control points.

A line between two points of the curve in one segment of the original motion is no farther from it than its ends. So a
point for every pose keeps the tolerance, and more are put only where lines would cut the curve.

Sections are clamped at both ends, as controls take so many control points in a curve, and C² where they meet. Their
control points are the blossoms of the run's spline at the knots of the section.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import angle_between, batches, norm, search, some_runs, spread, starts, unit
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints, Program, Runs
from cornersmooth.settings import STANDING, Settings
from cornersmooth.smoothing.runs.polylines import Pieces, Polylines
from cornersmooth.smoothing.segments import MOST_LINES, lines_for_feed, turn_limit

#: share of ε that turning the axis inside a line may take; `global_runs` leaves it free
TURNING = 0.02

#: speed below which the tip stands still, mm per piece
_STANDING = 1e-30

#: pieces measured together
_TOGETHER = 8192

#: poses of runs made to rows together, about
_POSES = 20_000

#: knot intervals of a section, whose control points `Rows.curve` counts to 127, and its longest parameter in steps
SPANS, LONGEST = 120, 5e6

#: knot intervals among which the widest is looked for where a section is to end
CHOICE = 12

#: knots are written in thousands of steps: three decimals hold them
STEPS_PER_UNIT = 1000.0


def polylines_of(runs: Runs, program: Program, axis_length: float) -> Polylines:
    """The original motion of the runs."""
    tip, axis = program.tip[runs.pose], program.axis[runs.pose]
    return Polylines(np.hstack((tip, tip + axis_length * axis)), runs.count, runs.s, runs.step)


def some_at_once(runs: Runs) -> Iterator[Runs]:
    """Parts of the runs, so that arrays stay small."""
    for begin, end in pairwise(batches(runs.count, _POSES).tolist()):
        here = np.zeros(len(runs), np.bool_)
        here[begin:end] = True
        yield some_runs(runs, here)


def points_at(control: Floats, splines: Splines, span: Ints, s: Floats) -> tuple[Floats, Floats]:
    """Tips (mm) and unit axes (m, 3) on the curves at places s of the spans."""
    points = splines.points(control, span, s)
    return points[:, :3], unit(points[:, 3:] - points[:, :3])


def largest_curvature(lines: Polylines, splines: Splines, control: Floats) -> Floats:
    """(n,) 1/mm: largest curvature of the tip curves in the halves of the segments beside each pose of the runs."""
    largest = np.zeros(len(lines.s))
    pieces = Pieces.of(splines, lines)
    at = np.linspace(0.0, 1.0, 17)
    slope = np.stack(((1.0 - at) ** 2, 2.0 * at * (1.0 - at), at**2), axis=1)
    bend = np.stack((1.0 - at, at), axis=1)
    for begin in range(0, len(pieces.span), _TOGETHER):
        rows = slice(begin, begin + _TOGETHER)
        span, segment, low, high = pieces.span[rows], pieces.segment[rows], pieces.low[rows], pieces.high[rows]
        hull = splines.bezier(control[:, :3], span, low, high)
        first, second = 3.0 * slope @ np.diff(hull, axis=1), 6.0 * bend @ np.diff(hull, 2, axis=1)
        speed = norm(first)
        # a tip that stands still has no curvature
        least = np.maximum(1e-6 * (high - low)[:, None] * lines.step, _STANDING)
        curvature = np.divide(norm(np.cross(first, second)), speed**3, out=np.zeros_like(speed), where=speed > least)
        middle = (lines.s[segment] + lines.s[segment + 1])[:, None] / 2.0
        nearer = segment[:, None] + (low[:, None] + at * (high - low)[:, None] > middle)
        np.maximum.at(largest, nearer, curvature)
    return largest


@dataclass(frozen=True)
class Rows:
    """A part of the smoothed motion, r rows in path order."""

    tip: Floats  #: (r, 3) mm: end of a line, or a control point of the tip curve
    #: (r, 3): unit axis vector in dense rows; axis point (mm) or control point of the axis-point curve in curve rows
    other: Floats
    #: (r,): Pose whose move the row belongs to; lines after the middle of a transition are of the next. Never
    #: decreasing. Feed, kind and the place of statements follow from it.
    move: Ints
    #: 0 for the end of a line; 1 to 5 for a control point of a transition, from 1 on for one of a section of a run
    curve: NDArray[np.int8]
    joined: Bools  #: (r,): first control points that are the end of the row before, with no line between
    #: (r,): Moves per minute (inverse time) of rows that are timed so, NaN for the others; None where none is.
    rate: Floats | None = None
    #: (r, 3): Of control points: knot, weight and, in the last row of a curve, the last knot, zero elsewhere. None in
    #: rows of lines.
    spline: Floats | None = None
    #: (r,) mm: How far the control may round the corner at each row by itself; None where one value holds for all.
    blend: Floats | None = None
    #: (r,): Rows at which the tool comes back into a cut that it has left at the row before; None where there is
    #: none.
    left: Bools | None = None


def run_lines(runs: Runs, program: Program, settings: Settings) -> Rows:
    """Ends of the lines that runs are written as."""
    lines, splines = polylines_of(runs, program, settings.axis_length), Splines(runs.knot, runs.knot_count)
    pieces = Pieces.of(splines, lines)
    segment, first = np.unique(pieces.segment, return_index=True)  # one piece or more for every segment
    effort = _effort(runs, splines, lines, pieces, program, settings)
    number = np.clip(np.ceil(np.add.reduceat(effort, first) - 1e-9), 1, MOST_LINES).astype(np.int64)
    row, place = spread(number)
    last = place == number[row] - 1
    # equal shares of the effort; a little is added so that it grows everywhere
    width, beyond = pieces.high - pieces.low, np.append(first[1:], len(effort))
    grown = effort + 1e-9 * width / np.repeat(np.add.reduceat(width, first), beyond - first)
    reached = np.concatenate(([0.0], np.cumsum(grown)))
    begin, end = reached[first], reached[beyond]
    target = begin[row] + (place + 1) / number[row] * (end - begin)[row]
    piece = np.clip(np.searchsorted(reached, target, side="left") - 1, first[row], beyond[row] - 1)
    share = (target - reached[piece]) / grown[piece]
    s = pieces.low[piece] + np.clip(share, 0.0, 1.0) * width[piece]
    s[last], piece[last] = pieces.high[beyond - 1], beyond - 1

    pose, span = segment[row] + 1, pieces.span[piece]
    tip, axis = points_at(runs.control, splines, span, s)
    ends = last & np.isin(pose, lines.first[1:] - 1)  # of runs, which are passed exactly
    point = lines.point[pose[ends]]
    tip[ends], axis[ends] = point[:, :3], unit(point[:, 3:] - point[:, :3])
    return Rows(tip, axis, runs.pose[pose], np.zeros(len(tip), np.int8), np.zeros(len(tip), np.bool_))


def _effort(
    runs: Runs, splines: Splines, lines: Polylines, pieces: Pieces, program: Program, settings: Settings
) -> Floats:
    """(p,) lines that each piece asks for: by its bend and the chord tolerance, and by the turn of the axis."""
    hull = splines.bezier(runs.control, pieces.span, pieces.low, pieces.high)
    bends = 6.0 * np.diff(hull, 2, axis=1)  # second derivatives at both ends, over the whole piece
    size = np.maximum(norm(bends[..., :3]), norm(bends[..., 3:])).max(axis=1)
    way = norm(hull[:, 3, :3] - hull[:, 0, :3])
    change = 3.0 * ((hull[:, 3] - hull[:, 2]) - (hull[:, 1] - hull[:, 0]))
    along = np.maximum(way, STANDING)
    kinks = norm(change[:, :3]) / along, norm(change[:, 3:] - change[:, :3]) / (settings.axis_length * along)
    feed = program.feed_at(runs.pose[pieces.segment + 1])
    by_chord = lines_for_feed(settings, np.sqrt(size / (8.0 * settings.chord)), way, feed, kinks)
    levers = lines.point[:, 3:] - lines.point[:, :3]
    turn = np.concatenate((angle_between(levers[:-1], levers[1:]), [0.0]))[pieces.segment]
    turned = angle_between(hull[:, 0, 3:] - hull[:, 0, :3], hull[:, 3, 3:] - hull[:, 3, :3])
    by_turn = turned / turn_limit(settings, turn / 2.0, TURNING * settings.tolerance)
    return np.maximum(by_chord, by_turn)


def section_rows(runs: Runs, program: Program) -> Rows:
    """Cut the runs into sections; poses with a statement after them are ends of sections."""
    splines = Splines(runs.knot, runs.knot_count)
    run, begin, end = section_ends(runs, splines, program)
    owner, number, knot, points = clamped(splines, runs.control, run, begin, end)
    last_knot = np.where(np.append(number[1:] == 1, True), (end - begin)[owner], 0.0)
    spline = np.stack((knot / STEPS_PER_UNIT, np.ones(len(knot)), last_knot / STEPS_PER_UNIT), axis=1)
    move = runs.pose[search(runs.s, runs.count, run, end)][owner]  # a pose is in the segment that leads to it
    return Rows(points[:, :3], points[:, 3:], move, number.astype(np.int8), number == 1, spline=spline)


def clamped(
    splines: Splines, control: Floats, run: Ints, begin: Floats, end: Floats
) -> tuple[Ints, Ints, Floats, Floats]:
    """Parts of splines, `run` (k,) from `begin` to `end`, as curves of their own, clamped at both ends, in path order.

    Of each control point (m,): its part, its number from 1 on, the knot that goes with it from 0 on, itself (m, d).
    """
    # distinct knots of every part: its ends and the spline's knots between
    inside = search(splines.knot, splines.count, run, begin, side="right")
    after = search(splines.knot, splines.count, run, end)
    spans = after - inside + 1
    # clamped knots u of a part with m spans: m + 7, control points m + 3
    part, place = spread(spans + 7)
    inner = np.clip(inside[part] + place - 4, 0, len(splines.knot) - 1)
    u = splines.knot[inner]
    u = np.where(place <= 3, begin[part], np.where(place >= spans[part] + 3, end[part], u))
    first_u = starts(spans + 7)[:-1]
    owner, number = spread(spans + 3)
    arguments = u[(first_u[owner] + number + 1)[:, None] + np.arange(3)]
    # any span that the control point belongs to: the spline's span at the start of one of the part's
    local = np.clip(number - 1, 0, spans[owner] - 1)
    low = u[first_u[owner] + local + 3]
    points = splines.blossom(splines.span_at(run[owner], low), arguments, control)
    return owner, number + 1, u[first_u[owner] + number] - begin[owner], points


def section_ends(runs: Runs, splines: Splines, program: Program) -> tuple[Ints, Floats, Floats]:
    """Run, start and end of every section.

    Sections end in the middle of wide knot intervals, away from sharp corners: there a place belongs to one segment.
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
