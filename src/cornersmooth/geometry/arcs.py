"""Arcs and helices as points: all arcs of a program at once.

Between its start and end an arc turns evenly about its axis. What rounding in the file leaves between the turned start
and the end is spread evenly over the arc, and so are the height of a helix and a change of the tool axis: tip and axis
are functions of one share, from 0 at the start to 1 at the end.
"""

from __future__ import annotations

import math

import numpy as np

from cornersmooth.arrays import dot, norm, spread
from cornersmooth.model import Floats, Ints, Program
from cornersmooth.settings import Settings

#: share of the tolerance that a chord may take where `Settings.chord` would allow more: the rest is for arithmetic
_MOST_OF_TOLERANCE = 0.9
#: largest turn about the arc's axis in one chord, rad: coarser chords of small arcs would not look like an arc
_LARGEST_STEP = math.pi / 2.0
#: parameters at which curves are compared with their arcs: the middle and the ends are on them
_PROBES = np.linspace(0.0, 1.0, 17)[1:-1]

#: axes of the planes G17, G18 and G19 in the order in which a right-handed turn about the third goes round:
#: X to Y about Z, Z to X about Y, Y to Z about X
PLANES = np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]])
FIRST_PLANE = 17


def arc_radii(program: Program) -> Floats:
    """(k,) mean of the distances of start and end from the axis, mm."""
    start, end = _radius_vectors(program)
    return (norm(start) + norm(end)) / 2.0


def arc_lines(program: Program, settings: Settings) -> Ints:
    """(k,) number of lines for each arc within the chord tolerance, at the tip and at the axis point."""
    chord = min(
        settings.chord,
        _MOST_OF_TOLERANCE * min(settings.tip_tolerance, settings.axis_point_tolerance),
    )
    start, end = _radius_vectors(program)
    radius = np.maximum(norm(start), norm(end))
    flat = radius <= chord
    step = 2.0 * np.arccos(1.0 - np.where(flat, 1.0, chord / np.where(flat, 1.0, radius)))
    lines = np.ceil(program.arcs.sweep / np.minimum(step, _LARGEST_STEP) - 1e-9)
    # the axis turns about a sphere of radius H, and fastest in the middle where equal shares are not equal angles
    pose = program.arcs.pose
    half = np.arcsin(np.minimum(norm(program.axis[pose] - program.axis[pose - 1]) / 2.0, 1.0))
    bend = settings.axis_length * (1.0 + 2.0 * np.tan(np.minimum(half, math.radians(80.0))))
    turning = np.ceil(2.0 * half * np.sqrt(bend / (8.0 * chord)) - 1e-9)
    return np.maximum(np.maximum(lines, turning), 1).astype(np.int64)


def arc_points(program: Program, rows: Ints, share: Floats) -> tuple[Floats, Floats]:
    """Tips (m, 3), mm, and unit tool axes (m, 3) on arcs.

    `rows` (m,) are those of `Program.arcs`, `share` (m,) is from 0 at the start of the arc to 1 at its end; ends are
    exact.
    """
    pose = program.arcs.pose[rows]
    tip = arc_series(program, rows, share)[0]
    first, last = program.axis[pose - 1], program.axis[pose]
    axis = first + share[:, None] * (last - first)
    length = norm(axis)
    axis = np.where((length > 0.0)[:, None], axis / np.where(length > 0.0, length, 1.0)[:, None], last)
    ends = share >= 1.0
    tip[ends], axis[ends] = program.tip[pose[ends]], last[ends]
    return tip, axis


def arc_series(program: Program, rows: Ints, share: float | Floats) -> Floats:
    """(4, m, 3) tips on arcs, as of `arc_points`, and their derivatives by the share over 1, 2 and 6: Taylor series.

    The parts: radius vector at the start, direction there as long as that, and what rounding leaves at the end.
    """
    arcs, share = program.arcs, np.reshape(share, (-1, 1))
    pose, normal, sweep = arcs.pose[rows], arcs.normal[rows], arcs.sweep[rows][:, None]
    radius = program.tip[pose - 1] - arcs.centre[rows]
    radius -= dot(radius, normal)[:, None] * normal
    side = np.cross(normal, radius)
    closing = program.tip[pose] - program.tip[pose - 1]
    closing -= (np.cos(sweep) - 1.0) * radius + np.sin(sweep) * side
    cosine, sine = np.cos(sweep * share), np.sin(sweep * share)
    swung, across = (cosine - 1.0) * radius + sine * side, cosine * side - sine * radius
    tip = program.tip[pose - 1] + swung + share * closing
    return np.stack((tip, sweep * across + closing, -(sweep**2) / 2.0 * (swung + radius), -(sweep**3) / 6.0 * across))


def arc_weights(turn: Floats, decimals: int | None) -> Floats:
    """(m,) weight of the inner control points of `arc_curves` that turn so far, rad; all 1 without decimals."""
    exact: Floats = (1.0 + 2.0 * np.cos(turn / 2.0)) / 3.0
    return np.ones(len(turn)) if decimals is None else np.round(exact, decimals)


def arc_curves(program: Program, rows: Ints, begin: Floats, end: Floats, weight: Floats) -> Floats:
    """Control points (m, 4, 3), mm, of cubic curves beside arcs `rows` (m,) from one share (m,) to another.

    Outer weights are 1. With the inner weight ``(1 + 2 cos(turn / 2)) / 3`` a curve is a circle: a rational quadratic
    one with its degree raised (Piegl and Tiller, The NURBS Book, 7.3). The inner points lie so far along the tangents
    that the middle of the curve is on the arc, whatever the weight (m,): one that is rounded, or 1.
    """
    share = end - begin
    turn = program.arcs.sweep[rows] * share
    lever = (share * (1.0 + 3.0 * weight) / (3.0 * weight) * np.tan(turn / 4.0) / turn)[:, None]
    first, last = (arc_points(program, rows, at)[0] for at in (begin, end))
    slopes = (arc_series(program, rows, at)[1] for at in (begin, end))
    leaving, arriving = (lever * slope for slope in slopes)
    return np.stack((first, first + leaving, last - arriving, last), axis=1)


def curve_deviation(program: Program, rows: Ints, begin: Floats, end: Floats, weight: Floats) -> Floats:
    """(m,) mm: how far curves of `arc_curves` are from their arcs at the same turns, at some places between."""
    points = arc_curves(program, rows, begin, end, weight)
    weights = np.stack((np.ones_like(weight), weight, weight, np.ones_like(weight)), axis=1)
    normal, centre, sweep = program.arcs.normal[rows], program.arcs.centre[rows], program.arcs.sweep[rows]
    ahead = np.cross(normal, points[:, 0] - centre)
    back = np.cross(ahead, normal)
    worst = np.zeros(len(rows))
    for u in _PROBES.tolist():
        basis = weights * (np.array([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3]))
        point = (basis[:, None, :] @ points)[:, 0] / basis.sum(axis=1)[:, None]
        turned = np.arctan2(dot(point - centre, ahead), dot(point - centre, back))
        there, _ = arc_points(program, rows, begin + turned / sweep)
        worst = np.maximum(worst, norm(point - there))
    return worst


def poses_and_arcs(program: Program, step: float) -> tuple[Ints, Floats, Floats]:
    """Poses of a program and places on its arcs, turns of `step` (rad) apart at most.

    Gives the pose that each leads to (m,), tips (m, 3), mm, and unit axes (m, 3).
    """
    arcs, row = program.arcs, np.full(len(program), -1, np.int64)
    pieces = np.ones(len(program), np.int64)
    pieces[arcs.pose], row[arcs.pose] = np.maximum(np.ceil(arcs.sweep / step), 1.0), np.arange(len(arcs))
    pose, share = divided(pieces)
    tip, axis = program.tip[pose], program.axis[pose]
    bow = np.flatnonzero(row[pose] >= 0)
    tip[bow], axis[bow] = arc_points(program, row[pose[bow]], share[bow])
    return pose, tip, axis


def divided(counts: Ints) -> tuple[Ints, Floats]:
    """Rows and shares of the ends of the parts when arc r is divided into ``counts[r]`` equal parts."""
    rows, place = spread(counts)
    share: Floats = (place + 1) / counts[rows]
    return rows, share


def _radius_vectors(program: Program) -> tuple[Floats, Floats]:
    """Vectors from the axis of each arc to its start and to its end, (k, 3) mm."""
    arcs = program.arcs
    vectors = []
    for point in (program.tip[arcs.pose - 1], program.tip[arcs.pose]):
        offset = point - arcs.centre
        vectors.append(offset - dot(offset, arcs.normal)[:, None] * arcs.normal)
    return vectors[0], vectors[1]
