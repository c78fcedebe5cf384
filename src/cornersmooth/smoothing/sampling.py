"""The smoothed motion as rows: dense lines (tip and axis vector) or lines and curves (control points).

u = ½ is always a point of the dense lines, so they keep the deviation of the curve: on either half the curve's distance
from its leg is convex, and a chord of it lies no farther from the leg than its ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.smoothing import nurbs
from cornersmooth.smoothing.arcs import arc_lines, arc_points, divided
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.corner_table import Remainders
from cornersmooth.smoothing.segments import Segments, lines_per_half, segments_of
from cornersmooth.vectors import unit


@dataclass(frozen=True)
class Rows:
    """A stretch of the smoothed motion, r rows in path order.

    Parameters
    ----------
    tip : (r, 3) float64, mm
        End of a line, or a control point of the tip curve.
    other : (r, 3) float64
        Unit axis vector in dense rows; axis point (mm) or control point of the axis-point curve in curve rows.
    move : (r,) int64
        Pose whose move the row belongs to; lines after the middle of a transition are of the next. Never decreasing.
        Feed, kind and the place of statements follow from it.
    curve : (r,) int8
        0 for the end of a line; 1 to 5 for a control point of a transition.
    joined : (r,) bool
        First control points that are the end of the row before, with no line between.
    weights : (r, 2) float64 or None
        w1 and w2 of the transition the row belongs to, in curve rows.
    arc : (r,) int64 or None
        Row of `Program.arcs` where the tool gets here on a circle or helix about that arc's axis, -1 where it gets here
        straight; None where the program has no such rows.
    rate : (r,) float64 or None
        Moves per minute (inverse time) of rows that are timed so, NaN for the others; None where none is.
    spline : (r, 3) float64 or None
        Of control points of curves that are not the five-point curve: knot, weight and, in the last row of a curve, the
        last knot.
    """

    tip: Floats
    other: Floats
    move: Ints
    curve: NDArray[np.int8]
    joined: Bools
    weights: Floats | None = None
    arc: Ints | None = None
    rate: Floats | None = None
    spline: Floats | None = None


@dataclass(frozen=True)
class _Block:
    """Poses begin to end − 1 and the rows they make, filled in place."""

    poses: Ints
    first: Ints  # row of the first, for each pose
    last: Ints  # row after the last
    tip: Floats
    other: Floats
    move: Ints


def dense_rows(smoothed: SmoothProgram, circles: Ints | None = None, poses: int = 16384) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines with tool vectors, in blocks of about `poses` poses.

    Parameters
    ----------
    circles : (k,) int64, optional
        Number of circular pieces that each arc of the program is written as, 0 for lines; all lines by default.

    Yields
    ------
    Rows
        `other` holds unit vectors; every `curve` is 0.
    """
    program, corners = smoothed.program, smoothed.corners
    segments = segments_of(smoothed, dense=True)
    halves = lines_per_half(smoothed)
    counts = np.where(segments.skip, 0, segments.lines)
    rounded = corners.pose[corners.smoothed]
    counts[rounded] = np.where(segments.has_line[rounded], segments.lines[rounded], 0) + 2 * np.abs(
        halves[corners.smoothed]
    )
    pieces = _pieces(smoothed, circles)
    for block in _blocks(smoothed, counts, pieces, poses):
        sharp = (segments.row[block.poses] < 0) & (block.last > block.first)
        at = block.last[sharp] - 1
        block.tip[at], block.other[at] = program.tip[block.poses[sharp]], program.axis[block.poses[sharp]]
        _fill_divided(smoothed, segments, block)
        _fill_transitions(smoothed, segments, block, halves)
        arc = _fill_arcs(smoothed, block, pieces, circles)
        yield Rows(block.tip, block.other, block.move, *_no_curves(len(block.tip)), arc=arc)


def curve_rows(smoothed: SmoothProgram, *, divide: bool = False, poses: int = 16384) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines and curve pairs, in blocks of about `poses` poses.

    Parameters
    ----------
    divide : bool
        Whether lines in which the axis turns much are divided: for controls that do not run the axis point straight.

    Yields
    ------
    Rows
        `other` holds axis points; a transition is five rows.
    """
    program, corners, height = smoothed.program, smoothed.corners, smoothed.settings.axis_length
    segments = segments_of(smoothed, dense=divide)
    counts = np.where(segments.has_line, segments.lines, 0) + np.where(segments.row >= 0, 5, 0)
    counts[segments.skip] = 0
    pieces = _pieces(smoothed)
    for block in _blocks(smoothed, counts, pieces, poses):
        row = segments.row[block.poses]
        if divide:
            _fill_divided(smoothed, segments, block)
            block.other[:] = block.tip + height * block.other
        sharp = (row < 0) & (block.last > block.first)
        pose, at = block.poses[sharp], block.last[sharp] - 1
        block.tip[at] = program.tip[pose]
        block.other[at] = program.tip[pose] + height * program.axis[pose]
        _fill_arcs(smoothed, block, pieces, height=height)

        curve, joined = _no_curves(len(block.tip))
        weights = np.ones((len(block.tip), 2))
        pose, first = block.poses[row >= 0], block.last[row >= 0] - 5
        if len(pose):
            tip_curve, axis_curve = nurbs.control_points(program, corners, segments.row[pose], height)
            places = first[:, None] + np.arange(5)
            block.tip[places], block.other[places] = tip_curve, axis_curve
            curve[places] = np.arange(1, 6)
            weights[places] = corners.weights[segments.row[pose]][:, None, :]
            line = segments.has_line[pose]
            joined[first] = ~line
            block.tip[first[line] - 1], block.other[first[line] - 1] = tip_curve[line, 0], axis_curve[line, 0]
        yield Rows(block.tip, block.other, block.move, curve, joined, weights)


def _no_curves(count: int) -> tuple[NDArray[np.int8], Bools]:
    return np.zeros(count, np.int8), np.zeros(count, np.bool_)


def _pieces(smoothed: SmoothProgram, circles: Ints | None = None) -> Ints:
    """(k,) number of rows of each arc."""
    if not len(smoothed.program.arcs):
        return np.zeros(0, np.int64)
    lines = arc_lines(smoothed.program, smoothed.settings)
    return lines if circles is None else np.where(circles > 0, circles, lines)


def _blocks(smoothed: SmoothProgram, counts: Ints, pieces: Ints, poses: int) -> Iterator[_Block]:
    """Blocks of empty rows, `counts` of them for each pose, `pieces` for each arc."""
    program = smoothed.program
    counts[program.arcs.pose] = pieces
    for begin in range(0, len(program), poses):
        own = np.arange(begin, min(begin + poses, len(program)))
        last = np.cumsum(counts[own])
        total = int(last[-1])
        yield _Block(
            own, last - counts[own], last, np.zeros((total, 3)), np.zeros((total, 3)), np.repeat(own, counts[own])
        )


def _fill_arcs(
    smoothed: SmoothProgram, block: _Block, pieces: Ints, circles: Ints | None = None, height: float | None = None
) -> Ints | None:
    """Points of the arcs in the block with their axes or axis points; returns `Rows.arc`."""
    arcs = smoothed.program.arcs.pose
    inside = np.flatnonzero((arcs >= block.poses[0]) & (arcs <= block.poses[-1]))
    if not len(inside):
        return None
    local, share = divided(pieces[inside])
    rows = inside[local]
    where = np.flatnonzero(np.isin(block.move, arcs[inside]))
    tip, axis = arc_points(smoothed.program, rows, share)
    block.tip[where] = tip
    block.other[where] = axis if height is None else tip + height * axis
    if circles is None:
        return None
    arc = np.full(len(block.tip), -1, np.int64)
    arc[where] = np.where(circles[rows] > 0, rows, -1)
    return arc


def nodes(lines: int) -> Floats:
    """Parameters u of the points of a transition after its first: both halves, the middle, the end."""
    number = abs(lines)
    s = (np.arange(1, number + 1) / number) ** (2.0 / 3.0 if lines > 0 else 1.0)
    u = 0.5 * s
    return np.concatenate((u, 1.0 - u[-2::-1], [1.0]))


def _fill_transitions(smoothed: SmoothProgram, segments: Segments, block: _Block, halves: Ints) -> None:
    """Points of the transitions of the block, first point included; corners of equal count together."""
    construction = construction_of(smoothed.settings.method)
    here = segments.row[block.poses] >= 0
    poses, last = block.poses[here], block.last[here]
    rows = segments.row[poses]
    number = halves[rows]
    for lines in np.unique(number):
        chosen = np.flatnonzero(number == lines)
        u = nodes(int(lines))
        points, levers = construction.points(smoothed, rows[chosen], u)
        where = (last[chosen] - len(u))[:, None] + np.arange(len(u))
        block.tip[where], block.other[where] = points[:, 1:], unit(levers[:, 1:])
        block.move[where[:, len(u) // 2 :]] = segments.following[poses[chosen]][:, None]
        first = segments.has_line[poses[chosen]]
        at = where[first, 0] - 1
        block.tip[at], block.other[at] = points[first, 0], unit(levers[first, 0])


def _fill_divided(smoothed: SmoothProgram, segments: Segments, block: _Block) -> None:
    """Inner points of the straight remainders that are written as several lines."""
    program, settings = smoothed.program, smoothed.settings
    construction = construction_of(settings.method)
    lines = np.where(segments.has_line[block.poses] & (block.last > block.first), segments.lines[block.poses], 1)
    for number in np.unique(lines):
        if number < 2:
            continue
        pose, first = block.poses[lines == number], block.first[lines == number]
        start = segments.start[pose]
        remainders = Remainders(
            start,
            pose,
            np.stack((segments.entry[pose], segments.exit[pose]), axis=1),
            np.stack((segments.axis_entry[pose], segments.axis_exit[pose]), axis=1),
        )
        fraction, axis = construction.divide(program, settings, remainders, int(number))
        rows = first[:, None] + np.arange(number - 1)
        step = program.tip[pose] - program.tip[start]
        block.tip[rows] = program.tip[start][:, None] + fraction[..., None] * step[:, None]
        block.other[rows] = axis
