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
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.runs.rows import SectionRows, run_lines, section_rows, some_at_once
from cornersmooth.smoothing.segments import Segments, lines_per_half, segments_of
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


@dataclass(frozen=True)
class _Batch:
    """Poses begin to end − 1 and the rows they make, filled in place."""

    poses: Ints
    first: Ints  # row of the first, for each pose
    last: Ints  # row after the last
    tip: Floats
    other: Floats
    move: Ints


@dataclass(frozen=True)
class _RunRows:
    """Rows of whole runs, m in path order, and the poses of the program that they replace."""

    move: Ints
    tip: Floats
    other: Floats
    inside: Bools
    sections: SectionRows | None = None

    @classmethod
    def lines(cls, smoothed: SmoothProgram) -> _RunRows:
        """Ends of lines, with unit axes."""
        program, runs = smoothed.program, smoothed.runs
        inside = np.zeros(len(program), np.bool_)
        found = [(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)))]
        if runs is not None:
            found += [run_lines(part, program, smoothed.settings) for part in some_at_once(runs)]
        pose, tip, axis = map(np.concatenate, zip(*found, strict=True))
        inside[pose] = True
        return cls(pose, tip, axis, inside)

    @classmethod
    def curves(cls, smoothed: SmoothProgram) -> _RunRows:
        """Control points of sections."""
        runs = smoothed.runs
        if runs is None:
            return cls.lines(smoothed)
        parts = [vars(section_rows(part, smoothed.program)) for part in some_at_once(runs)]
        rows = SectionRows(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
        inside = np.zeros(len(smoothed.program), np.bool_)
        inside[runs.pose] = True
        inside[runs.pose[starts(runs.count)[:-1]]] = False
        inside[rows.move] = True
        return cls(rows.move, rows.points[:, :3], rows.points[:, 3:], inside, rows)

    def replace(self, counts: Ints, segments: Segments) -> Ints:
        """Counts of rows with those of the runs in their places."""
        segments.lines[self.inside] = 1
        return np.where(self.inside, np.bincount(self.move, minlength=len(counts)), counts)

    def fill(self, batch: _Batch) -> tuple[Ints, slice]:
        """Put tips and axes into their rows; returns these rows of the batch, and which rows of the runs they are."""
        here = np.flatnonzero(self.inside[batch.poses])
        own = slice(*np.searchsorted(self.move, (batch.poses[0], batch.poses[-1] + 1)))
        at = ranges(batch.first[here], batch.last[here] - batch.first[here])
        batch.tip[at], batch.other[at] = self.tip[own], self.other[own]
        return at, own

    def fill_curves(self, batch: _Batch, curve: NDArray[np.int8], joined: Bools, spline: Floats) -> None:
        """Put the control points into their rows."""
        if self.sections is not None:
            at, own = self.fill(batch)
            curve[at], joined[at] = self.sections.number[own], self.sections.number[own] == 1
            spline[at, 0], spline[at, 2] = self.sections.knot[own], self.sections.last_knot[own]


#: knots that go with the control points of a transition; the last four are 1
KNOTS = (0.0, 0.0, 0.0, 0.0, 0.5)


def dense_rows(smoothed: SmoothProgram, circles: Ints | None = None, poses: int = 16384) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines with tool vectors, in batches of about `poses` poses.

    `circles` (k,) is the number of circular arcs that each arc of the program is written as, 0 for lines.
    """
    program, corners = smoothed.program, smoothed.corners
    segments = segments_of(smoothed, dense=True)
    halves = lines_per_half(smoothed)
    counts = np.where(segments.skip, 0, segments.lines)
    rounded = corners.pose[corners.smoothed]
    counts[rounded] = np.where(segments.has_line[rounded], segments.lines[rounded], 0) + 2 * np.abs(
        halves[corners.smoothed]
    )
    arc_counts = _arc_row_counts(smoothed, circles)
    runs = _RunRows.lines(smoothed)
    counts = runs.replace(counts, segments)
    for batch in _batches(smoothed, counts, arc_counts, poses):
        sharp = (segments.row[batch.poses] < 0) & (batch.last > batch.first)
        at = batch.last[sharp] - 1
        batch.tip[at], batch.other[at] = program.tip[batch.poses[sharp]], program.axis[batch.poses[sharp]]
        _fill_divided(smoothed, segments, batch)
        _fill_transitions(smoothed, segments, batch, halves)
        _fill_arcs(smoothed, batch, arc_counts)
        runs.fill(batch)
        yield Rows(batch.tip, batch.other, batch.move, *_no_curves(len(batch.tip)))


def curve_rows(smoothed: SmoothProgram, *, divide: bool = False, poses: int = 16384) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines and curve pairs with axis points, in batches of about `poses` poses.

    `divide` says whether lines in which the axis turns much are divided: not all controls run the axis point straight.
    """
    program, corners, height = smoothed.program, smoothed.corners, smoothed.settings.axis_length
    segments = segments_of(smoothed, dense=divide)
    counts = np.where(segments.has_line, segments.lines, 0) + np.where(segments.row >= 0, 5, 0)
    counts[segments.skip] = 0
    arc_counts = _arc_row_counts(smoothed)
    sections = _RunRows.curves(smoothed)
    counts = sections.replace(counts, segments)
    for batch in _batches(smoothed, counts, arc_counts, poses):
        row = segments.row[batch.poses]
        if divide:
            _fill_divided(smoothed, segments, batch)
            batch.other[:] = batch.tip + height * batch.other
        sharp = (row < 0) & (batch.last > batch.first)
        pose, at = batch.poses[sharp], batch.last[sharp] - 1
        batch.tip[at] = program.tip[pose]
        batch.other[at] = program.tip[pose] + height * program.axis[pose]
        _fill_arcs(smoothed, batch, arc_counts, height)

        curve, joined = _no_curves(len(batch.tip))
        spline = np.tile((0.0, 1.0, 0.0), (len(batch.tip), 1))
        pose, first = batch.poses[row >= 0], batch.last[row >= 0] - 5
        if len(pose):
            tip_curve, axis_curve = nurbs.control_points(program, corners, segments.row[pose], height)
            at = first[:, None] + np.arange(5)
            batch.tip[at], batch.other[at] = tip_curve, axis_curve
            curve[at] = np.arange(1, 6)
            spline[at, 0], spline[at[:, -1], 2] = KNOTS, 1.0
            spline[at, 1] = nurbs.full_weights(corners.weights[segments.row[pose]])
            line = segments.has_line[pose]
            joined[first] = ~line
            batch.tip[first[line] - 1], batch.other[first[line] - 1] = tip_curve[line, 0], axis_curve[line, 0]
        sections.fill_curves(batch, curve, joined, spline)
        yield Rows(batch.tip, batch.other, batch.move, curve, joined, spline=spline)


def _no_curves(count: int) -> tuple[NDArray[np.int8], Bools]:
    return np.zeros(count, np.int8), np.zeros(count, np.bool_)


def _arc_row_counts(smoothed: SmoothProgram, circles: Ints | None = None) -> Ints:
    """(k,) number of rows of each arc."""
    if not len(smoothed.program.arcs):
        return np.zeros(0, np.int64)
    lines = arc_lines(smoothed.program, smoothed.settings)
    return lines if circles is None else np.where(circles > 0, circles, lines)


def _batches(smoothed: SmoothProgram, counts: Ints, arc_counts: Ints, poses: int) -> Iterator[_Batch]:
    """Batches of empty rows, `counts` of them for each pose, `arc_counts` for each arc."""
    program = smoothed.program
    counts[program.arcs.pose] = arc_counts
    for begin in range(0, len(program), poses):
        own = np.arange(begin, min(begin + poses, len(program)))
        last = np.cumsum(counts[own])
        total = int(last[-1])
        yield _Batch(
            own, last - counts[own], last, np.zeros((total, 3)), np.zeros((total, 3)), np.repeat(own, counts[own])
        )


def _fill_arcs(smoothed: SmoothProgram, batch: _Batch, arc_counts: Ints, height: float | None = None) -> None:
    """Points of the arcs in the batch with their axes or axis points."""
    arcs = smoothed.program.arcs.pose
    inside = np.flatnonzero((arcs >= batch.poses[0]) & (arcs <= batch.poses[-1]))
    if not len(inside):
        return
    local, share = divided(arc_counts[inside])
    rows = inside[local]
    where = np.flatnonzero(np.isin(batch.move, arcs[inside]))
    tip, axis = arc_points(smoothed.program, rows, share)
    batch.tip[where] = tip
    batch.other[where] = axis if height is None else tip + height * axis


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
        batch.tip[where], batch.other[where] = points[:, 1:], unit(levers[:, 1:])
        batch.move[where[:, len(u) // 2 :]] = segments.following[poses[chosen]][:, None]
        first = segments.has_line[poses[chosen]]
        at = where[first, 0] - 1
        batch.tip[at], batch.other[at] = points[first, 0], unit(levers[first, 0])


def _fill_divided(smoothed: SmoothProgram, segments: Segments, batch: _Batch) -> None:
    """Inner points of the straight remainders that are written as several lines."""
    program, settings = smoothed.program, smoothed.settings
    construction = construction_of(settings.method)
    lines = np.where(segments.has_line[batch.poses] & (batch.last > batch.first), segments.lines[batch.poses], 1)
    for number in np.unique(lines):
        if number < 2:
            continue
        pose, first = batch.poses[lines == number], batch.first[lines == number]
        start = segments.start[pose]
        fraction, axis = construction.divide(program, settings, segments.remainders(pose), int(number))
        rows = first[:, None] + np.arange(number - 1)
        step = program.tip[pose] - program.tip[start]
        batch.tip[rows] = program.tip[start][:, None] + fraction[..., None] * step[:, None]
        batch.other[rows] = axis
