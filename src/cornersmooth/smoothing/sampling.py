"""The smoothed motion as rows: dense lines (tip and axis vector) or lines and curves (control points).

u = ½ is always a point of the dense lines, so they keep the deviation of the curve: on either half the curve's distance
from its leg is convex, and a chord of it lies no farther from the leg than its ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cornersmooth.geometry import nurbs
from cornersmooth.geometry.arcs import arc_lines, arc_points, divided
from cornersmooth.geometry.ragged import ranges, starts
from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.slices import joined_rows
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.runs.rows import NO_ROWS, SectionRows, run_lines, section_rows, some_at_once
from cornersmooth.smoothing.segments import Segments, inner_points, lines_per_half, segments_of
from cornersmooth.vectors import unit


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
    #: (r,): Row of `Program.arcs` where the tool gets here on a circle or helix about that arc's axis, -1 where it
    #: gets here straight; None where the program has no such rows.
    arc: Ints | None = None
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
    #: (r,): Of dense rows: share of the parameter of the curve that they are on, above 0; NaN on straight motion.
    place: Floats | None = None


@dataclass(frozen=True)
class _Batch:
    """Poses begin to end − 1 and the rows they make, filled in place."""

    poses: Ints
    first: Ints  # row of the first, for each pose
    last: Ints  # row after the last
    rows: Rows


#: knots that go with the control points of a transition; the last four are 1
KNOTS = (0.0, 0.0, 0.0, 0.0, 0.5)


def dense_rows(
    smoothed: SmoothProgram, circles: Ints | None = None, poses: int = 16384, *, halves: Ints | None = None
) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines with tool vectors, in batches of about `poses` poses.

    `circles` (k,) is the number of circular arcs that each arc of the program is written as, 0 for lines. `halves` (k,)
    are lines for each half of the transitions in place of `lines_per_half`: straight lines are left whole then.
    """
    return _rows(smoothed, curves=False, divide=halves is None, circles=circles, poses=poses, halves=halves)


def curve_rows(smoothed: SmoothProgram, *, divide: bool = False, poses: int = 16384) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines and curve pairs with axis points, in batches of about `poses` poses.

    `divide` says whether lines in which the axis turns much are divided: not all controls run the axis point straight.
    """
    none = np.zeros(0, np.int64)
    return _rows(smoothed, curves=True, divide=divide, circles=None, poses=poses, halves=none)


def _rows(
    smoothed: SmoothProgram, *, curves: bool, divide: bool, circles: Ints | None, poses: int, halves: Ints | None
) -> Iterator[Rows]:
    program, height = smoothed.program, smoothed.settings.axis_length
    segments = segments_of(smoothed, dense=divide)
    halves = lines_per_half(smoothed) if halves is None else halves
    runs, replaced = _of_runs(smoothed, curves=curves)
    segments.lines[replaced] = 1
    counts = np.where(segments.has_line, segments.lines, 0)
    rounded = np.flatnonzero(segments.row >= 0)
    counts[rounded] += 5 if curves else 2 * np.abs(halves[segments.row[rounded]])
    counts[segments.skip] = 0
    counts = np.where(replaced, np.bincount(runs.move, minlength=len(counts)), counts)
    if len(program.arcs):
        lines = arc_lines(program, smoothed.settings)
        counts[program.arcs.pose] = lines if circles is None else np.where(circles > 0, circles, lines)
    for batch in _batches(counts, poses, curves=curves):
        rows = batch.rows
        sharp = (segments.row[batch.poses] < 0) & (batch.last > batch.first)
        pose, at = batch.poses[sharp], batch.last[sharp] - 1
        rows.tip[at], rows.other[at] = program.tip[pose], program.axis[pose]
        if divide:
            _fill_divided(smoothed, segments, batch)
        _fill_arcs(smoothed, batch, counts)
        if curves:
            rows.other[:] = rows.tip + height * rows.other
            _fill_curves(smoothed, segments, batch)
        else:
            _fill_transitions(smoothed, segments, batch, halves)
        here = np.flatnonzero(replaced[batch.poses])
        at = ranges(batch.first[here], batch.last[here] - batch.first[here])
        own = slice(*np.searchsorted(runs.move, (batch.poses[0], batch.poses[-1] + 1)))
        rows.tip[at], rows.other[at] = runs.points[own, :3], runs.points[own, 3:]
        if rows.place is not None:
            rows.place[at] = runs.knot[own]
        if rows.spline is not None:
            rows.curve[at], rows.joined[at] = runs.number[own], runs.number[own] == 1
            rows.spline[at, 0], rows.spline[at, 2] = runs.knot[own], runs.last_knot[own]
        yield rows


def _of_runs(smoothed: SmoothProgram, *, curves: bool) -> tuple[SectionRows, Bools]:
    """Rows of whole runs, ends of lines or control points of sections, and the poses (n,) that they replace."""
    program, runs = smoothed.program, smoothed.runs
    replaced = np.zeros(len(program), np.bool_)
    if runs is None:
        return NO_ROWS, replaced
    replaced[np.delete(runs.pose, starts(runs.count)[:-1])] = True
    parts = some_at_once(runs)
    made = (section_rows(p, program) if curves else run_lines(p, program, smoothed.settings) for p in parts)
    return joined_rows(made), replaced


def _batches(counts: Ints, poses: int, *, curves: bool) -> Iterator[_Batch]:
    """Batches of empty rows, `counts` of them for each pose."""
    for begin in range(0, len(counts), poses):
        own = np.arange(begin, min(begin + poses, len(counts)))
        last = np.cumsum(counts[own])
        total = int(last[-1])
        rows = Rows(
            np.zeros((total, 3)),
            np.zeros((total, 3)),
            np.repeat(own, counts[own]),
            np.zeros(total, np.int8),
            np.zeros(total, np.bool_),
            spline=np.tile((0.0, 1.0, 0.0), (total, 1)) if curves else None,
            place=None if curves else np.full(total, np.nan),
        )
        yield _Batch(own, last - counts[own], last, rows)


def _fill_arcs(smoothed: SmoothProgram, batch: _Batch, counts: Ints) -> None:
    pose = smoothed.program.arcs.pose
    inside = np.flatnonzero((pose >= batch.poses[0]) & (pose <= batch.poses[-1]))
    if not len(inside):
        return
    local, share = divided(counts[pose[inside]])
    at = np.flatnonzero(np.isin(batch.rows.move, pose[inside]))
    batch.rows.tip[at], batch.rows.other[at] = arc_points(smoothed.program, inside[local], share)


def _fill_curves(smoothed: SmoothProgram, segments: Segments, batch: _Batch) -> None:
    corners, rows = smoothed.corners, batch.rows
    here = segments.row[batch.poses] >= 0
    pose, first = batch.poses[here], batch.last[here] - 5
    row, at = segments.row[pose], first[:, None] + np.arange(5)
    tip, top = nurbs.control_points(smoothed.program, corners, row, smoothed.settings.axis_length)
    rows.tip[at], rows.other[at], rows.curve[at] = tip, top, np.arange(1, 6)
    assert rows.spline is not None
    rows.spline[at, 0], rows.spline[at[:, -1], 2] = KNOTS, 1.0
    rows.spline[at, 1] = nurbs.full_weights(corners.weights[row])
    line = segments.has_line[pose]
    rows.joined[first] = ~line
    rows.tip[first[line] - 1], rows.other[first[line] - 1] = tip[line, 0], top[line, 0]


def nodes(lines: int) -> Floats:
    """Parameters u of the points of a transition after its first: both halves, the middle, the end."""
    number = abs(lines)
    s = (np.arange(1, number + 1) / number) ** (2.0 / 3.0 if lines > 0 else 1.0)
    u = 0.5 * s
    return np.concatenate((u, 1.0 - u[-2::-1], [1.0]))


def _fill_transitions(smoothed: SmoothProgram, segments: Segments, batch: _Batch, halves: Ints) -> None:
    """Points of the transitions of the batch, first point included; corners of equal count together."""
    construction = construction_of(smoothed.settings.method)
    here = segments.row[batch.poses] >= 0
    poses, last = batch.poses[here], batch.last[here]
    rows = segments.row[poses]
    number = halves[rows]
    for lines in np.unique(number):
        chosen = np.flatnonzero(number == lines)
        u = nodes(int(lines))
        points, levers = construction.points(smoothed, rows[chosen], u)
        where = (last[chosen] - len(u))[:, None] + np.arange(len(u))
        batch.rows.tip[where], batch.rows.other[where] = points[:, 1:], unit(levers[:, 1:])
        assert batch.rows.place is not None
        batch.rows.place[where] = u
        batch.rows.move[where[:, len(u) // 2 :]] = smoothed.corners.after[rows[chosen]][:, None]
        first = segments.has_line[poses[chosen]]
        at = where[first, 0] - 1
        batch.rows.tip[at], batch.rows.other[at] = points[first, 0], unit(levers[first, 0])


def _fill_divided(smoothed: SmoothProgram, segments: Segments, batch: _Batch) -> None:
    """Inner points of the straight remainders that are written as several lines."""
    lines = np.where(segments.has_line[batch.poses] & (batch.last > batch.first), segments.lines[batch.poses], 1)
    for number in np.unique(lines):
        if number < 2:
            continue
        pose, first = batch.poses[lines == number], batch.first[lines == number]
        rows = first[:, None] + np.arange(number - 1)
        batch.rows.tip[rows], batch.rows.other[rows] = inner_points(smoothed, segments, pose, int(number))
