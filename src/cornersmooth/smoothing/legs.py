"""The segments at corners."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cornersmooth.model import Floats, Ints, Program
from cornersmooth.vectors import norm


class Legs(NamedTuple):
    """The two segments at g corners, in space and seen from the tool axis.

    Parameters
    ----------
    tip_in, tip_out : (g, 3) float64, mm
        Tip segments into and out of the corner (D⁻, D⁺ of the tip).
    turn_in, turn_out : (g, 3) float64, mm
        H times the change of the axis vector along them, so that ``tip + turn`` is the axis-point segment.
    axis : (g, 3) float64
        Unit axis at the corner.
    """

    tip_in: Floats
    tip_out: Floats
    turn_in: Floats
    turn_out: Floats
    axis: Floats


def legs_at(program: Program, axis_length: float, pose: Ints, before: Ints, after: Ints) -> Legs:
    """Segments at the corners `pose` with their neighbours `before` and `after`, (g,) each."""
    tip, axis = program.tip, program.axis
    corner, direction = tip[pose], axis[pose]
    return Legs(
        corner - tip[before],
        tip[after] - corner,
        axis_length * (direction - axis[before]),
        axis_length * (axis[after] - direction),
        direction,
    )


def half_angle_cosine(turn: Floats, axis_length: float) -> Floats:
    """Cosine of half the axis change, from its chord ``|turn| = 2 H sin(θ/2)``."""
    sine = norm(turn) / (2.0 * axis_length)
    return np.sqrt(np.maximum(0.0, 1.0 - sine * sine))


def divide(numerator: Floats | float, denominator: Floats) -> Floats:
    """Quotient; infinity where the denominator is zero."""
    quotient: Floats = np.divide(numerator, denominator, out=np.full_like(denominator, np.inf), where=denominator > 0.0)
    return quotient
