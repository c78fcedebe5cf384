"""Circular and helical moves: length, directions, points."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats, Ints, Program
from cornersmooth.vectors import dot, norm


def shape(program: Program, moves: Ints) -> tuple[Floats, Floats, Floats]:
    """Lengths (k,) mm and unit tangents at start and end (k, 3) of the arcs into these poses."""
    rows = arc_rows(program, moves)
    table = program.arcs
    radius = _radii(program, moves)
    pitch = _pitches(program, moves)  # per radian
    length = table.sweep[rows] * np.hypot(norm(radius), pitch)
    tangents = []
    for arm in (radius, _turned(table.normal[rows], radius, table.sweep[rows])):
        along = np.cross(table.normal[rows], arm) + pitch[:, None] * table.normal[rows]
        tangents.append(along / norm(along)[:, None])
    return length, tangents[0], tangents[1]


def curvature(program: Program, moves: Ints) -> Floats:
    """Curvature of the arcs into these poses, 1/mm: r/(r² + p²), p the pitch per radian."""
    r = norm(_radii(program, moves))
    kappa: Floats = r / (r * r + _pitches(program, moves) ** 2)
    return kappa


def points(program: Program, moves: Ints, fraction: Floats) -> Floats:
    """Tip positions (k, 3) at a fraction of the way along the arcs into these poses, mm."""
    rows = arc_rows(program, moves)
    table = program.arcs
    arm = _radii(program, moves)
    start = program.tip[moves - 1]
    normal = table.normal[rows]
    swept = table.sweep[rows] * fraction
    turned = _turned(normal, arm, swept)
    found: Floats = start - arm + turned + (_pitches(program, moves) * swept)[:, None] * normal
    return found


def arc_rows(program: Program, moves: Ints) -> Ints:
    """Rows of `Program.arcs` of the arcs into these poses."""
    return np.searchsorted(program.arcs.pose, moves)


def _radii(program: Program, moves: Ints) -> Floats:
    """Vectors from the arc's axis to its start, across the axis."""
    rows = arc_rows(program, moves)
    arm = program.tip[moves - 1] - program.arcs.centre[rows]
    normal = program.arcs.normal[rows]
    across: Floats = arm - dot(arm, normal)[:, None] * normal
    return across


def _pitches(program: Program, moves: Ints) -> Floats:
    rows = arc_rows(program, moves)
    rise = dot(program.tip[moves] - program.tip[moves - 1], program.arcs.normal[rows])
    pitch: Floats = rise / program.arcs.sweep[rows]
    return pitch


def _turned(normal: Floats, arm: Floats, angle: Floats) -> Floats:
    """Vectors across unit `normal` turned about it (Rodrigues)."""
    turned: Floats = np.cos(angle)[:, None] * arm + np.sin(angle)[:, None] * np.cross(normal, arm)
    return turned


def series(program: Program, moves: Ints, fraction: Floats) -> Floats:
    """Taylor coefficients (4, k, 3) of the tip by the fraction of the way along the arcs into these poses, mm."""
    rows = arc_rows(program, moves)
    sweep, normal = program.arcs.sweep[rows][:, None], program.arcs.normal[rows]
    arm = _turned(normal, _radii(program, moves), sweep[:, 0] * fraction)
    across = np.cross(normal, arm)
    rise = (_pitches(program, moves)[:, None] * sweep) * normal
    return np.stack(
        (points(program, moves, fraction), sweep * across + rise, -(sweep**2) * arm / 2.0, -(sweep**3) * across / 6.0)
    )
