"""The corners of a program as a method of smoothing meets them, and what it makes of them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Corners, Floats, Ints, Program
from cornersmooth.vectors import norm

#: corners worked on at once: their intermediate arrays fit the processor's cache
BATCH = 16384


class Legs(NamedTuple):
    """The two segments at g corners, (g, 3) each."""

    tip_in: Floats  # D⁻ of the tip, mm
    tip_out: Floats  # D⁺ of the tip, mm
    turn_in: Floats  # H times the change of the axis vector, mm: ``tip + turn`` is the axis-point segment
    turn_out: Floats
    axis: Floats  # unit axis at the corner


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


class Remainders(NamedTuple):
    """What transitions leave of g segments."""

    start: Ints  # poses at the ends of the segments, (g,)
    end: Ints
    tip: Floats  # fractions of the tip segment at which the remainder starts and ends, (g, 2)
    axis: Floats  # the same of the axis-point segment


@dataclass
class Placed:
    """Transitions of g corners; the names are those of `Corners`."""

    status: NDArray[np.uint8]
    limited_by: NDArray[np.uint8]
    trim_in: Floats
    trim_out: Floats
    axis_trim_in: Floats
    axis_trim_out: Floats
    tip_error: Floats
    axis_error: Floats
    orientation_error: Floats
    extra: dict[str, Floats] = field(default_factory=dict)


def with_rows(corners: Corners, others: Corners, rows: Ints) -> Corners:
    """Corners with some rows of others; extra columns that those lack are NaN there."""

    def taken(values: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
        values = values.copy()
        values[rows] = other[rows]
        return values

    missing = np.full(len(corners), np.nan)
    extra = {name: taken(values, others.extra.get(name, missing)) for name, values in corners.extra.items()}
    names = (item.name for item in fields(Corners) if item.name != "extra")
    columns: dict[str, Any] = {name: taken(getattr(corners, name), getattr(others, name)) for name in names}
    return Corners(**columns, extra=extra)
