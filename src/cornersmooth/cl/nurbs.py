"""NX's NURBS records: a cubic B-spline of the tool tip, read as lines.

::

    GOTO/x,y,z            start: the first control point
    NURBS/
    KNOT/0.04,0.37,...,1  inner knots and the last one, without the three (four) that repeat the ends
    CNTRL/x,y,z           further control points; the last one is the end

The meaning of the rows is nowhere published; it was established on a real file (70 curves, 1,413 control points). In
every curve K knots come with K+2 control points, as in a clamped cubic that starts at the position before it; and with
that reading the control legs are proportional to the differences of the Greville abscissae, first and last leg
included, within 1 % in most curves: each curve runs at constant speed, as it should.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints

DEGREE: Final = 3

#: the lines stay this many printed digits near the curve
CURVE_DIGITS: Final = 5

#: knots are equal or differ by this part of the last one; NX prints seven decimals
LEAST_STEP: Final = 1e-9

#: lines for every control point at most; more would be no tool path
MOST_LINES: Final = 1000


@dataclass
class Curve:
    """Rows of a NURBS record as they come in; lengths as written."""

    line: int
    knots: list[float] = field(default_factory=list)
    points: list[tuple[float, float, float]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    decimals: int = 0

    @property
    def complaint(self) -> str | None:
        """What is wrong with knots and control points, if anything."""
        if not self.knots or len(self.points) != len(self.knots) + DEGREE - 1:
            return f"{len(self.knots)} knots and {len(self.points)} control points are no cubic"
        ascend = all(low <= high for low, high in pairwise((0.0, *self.knots)))
        if not ascend or not 0 < self.knots[0] <= self.knots[-1] < math.inf:
            return "its knots do not ascend from above 0"
        knots = np.array([0.0, *self.knots]) / self.knots[-1]
        steps = np.diff(knots)
        if steps[0] == 0 or ((steps > 0) & (steps < LEAST_STEP)).any():
            return "two of its knots are nearly the same"
        if (knots[:-2] == knots[2:]).any():
            return "a knot is repeated more than once"
        if np.count_nonzero(knots == knots[-1]) > 1:
            return "its last knot is repeated"
        return None


def lines_of(curve: Curve, start: tuple[float, float, float], tolerance: float) -> tuple[Floats, Ints] | None:
    """Points on a curve without a complaint (m, 3), whose chords stay within a tolerance of it, and their lines (m,).

    The start is its first control point and is left out; the end is not. None if there would be more than `MOST_LINES`
    points a control point.
    """
    from scipy.interpolate import BSpline  # which takes long to load

    control = np.array([start, *curve.points])
    inner = np.array(curve.knots) / curve.knots[-1]
    knots = np.concatenate((np.zeros(DEGREE + 1), inner, np.ones(DEGREE)))
    spans = np.unique(knots)
    # chord error of a piece of length h is at most h²/8·max|C″|, and C″ lies in the hull of its control points
    spline = BSpline(knots, control, DEGREE)
    size = np.linalg.norm(spline.derivative(2).c, axis=1)
    first = np.searchsorted(knots, spans[:-1], side="right") - 1 - DEGREE  # first control point of the span
    largest = np.maximum(size[first], size[first + 1])
    with np.errstate(over="ignore"):
        pieces = np.ceil(np.diff(spans) * np.sqrt(largest / (8 * tolerance)))
    if not pieces.sum() <= MOST_LINES * len(control):
        return None
    pieces = np.maximum(pieces, 1).astype(np.int64)
    begin = np.cumsum(pieces) - pieces
    step = np.arange(1, pieces.sum() + 1) - np.repeat(begin, pieces)
    u = np.repeat(spans[:-1], pieces) + step * np.repeat(np.diff(spans) / pieces, pieces)
    u[np.cumsum(pieces) - 1] = spans[1:]
    points: Floats = spline(u)
    points[-1] = control[-1]
    greville = (knots[2:-2] + knots[1:-3] + knots[3:-1]) / DEGREE
    near = np.clip(np.searchsorted(greville, u), 1, len(curve.lines)) - 1
    return points, np.array(curve.lines, np.int64)[near]
