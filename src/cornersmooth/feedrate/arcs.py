"""Circular and helical moves as Taylor series."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats, Ints, Program
from cornersmooth.vectors import dot


def series(program: Program, moves: Ints, fraction: Floats | float) -> Floats:
    """Taylor coefficients (4, k, 3) of the tip by the fraction of the way along the arcs into these poses, mm."""
    rows = np.searchsorted(program.arcs.pose, moves)
    start = program.tip[moves - 1]
    sweep, normal = program.arcs.sweep[rows][:, None], program.arcs.normal[rows]
    radius = start - program.arcs.centre[rows]
    radius -= dot(radius, normal)[:, None] * normal
    rise = dot(program.tip[moves] - start, normal)[:, None] * normal
    angle = sweep * np.reshape(fraction, (-1, 1))
    arm = np.cos(angle) * radius + np.sin(angle) * np.cross(normal, radius)  # Rodrigues
    across = np.cross(normal, arm)
    tip = start - radius + arm + rise * np.reshape(fraction, (-1, 1))
    return np.stack((tip, sweep * across + rise, -(sweep**2) * arm / 2.0, -(sweep**3) * across / 6.0))
