"""Cubic B-splines of a CL file: NX's records of them.

NX::

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
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import norm
from cornersmooth.cl.poses import AXIS_NOISE, System
from cornersmooth.model import Curves, Floats, Ints, Move

DEGREE: Final = 3

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

    @property
    def complaint(self) -> str | None:
        """What is wrong with knots and control points, if anything."""
        if not self.knots or len(self.points) != len(self.knots) + DEGREE - 1:
            return f"{len(self.knots)} knots and {len(self.points)} control points are no cubic"
        ascend = all(low <= high for low, high in pairwise((0.0, *self.knots)))
        if not ascend or not 0 < self.knots[0] <= self.knots[-1] < math.inf:
            return "its knots do not ascend from above 0"
        return bad_knots(np.array([0.0, *self.knots]) / self.knots[-1])

    def cubic(self, start: tuple[float, float, float], tolerance: float) -> Cubic | None:
        """The curve without a complaint, from where the tool is."""
        inner = np.array(self.knots) / self.knots[-1]
        knots = np.concatenate((np.zeros(DEGREE + 1), inner, np.ones(DEGREE)))
        return cubic(knots, np.array([start, *self.points]), tolerance)

    def lines_at(self, u: Floats) -> Ints:
        """Lines of the file that places on the curve belong to."""
        inner = np.array([0.0, 0.0, 0.0, *self.knots, *(2 * self.knots[-1:])]) / self.knots[-1]
        greville = (inner[2:] + inner[1:-1] + inner[:-2]) / DEGREE
        near = np.clip(np.searchsorted(greville, u), 1, len(self.lines)) - 1
        return np.array(self.lines, np.int64)[near]


def bad_knots(knots: Floats) -> str | None:
    """What is wrong with ascending distinct or repeated knots between the ends of a curve, from 0 to 1, if anything."""
    steps = np.diff(knots)
    if steps[0] == 0 or ((steps > 0) & (steps < LEAST_STEP)).any():
        return "two of its knots are nearly the same"
    if (knots[:-2] == knots[2:]).any():
        return "a knot is repeated more than once"
    if np.count_nonzero(knots == knots[-1]) > 1:
        return "its last knot is repeated"
    return None


@dataclass(frozen=True)
class Cubic:
    """A cubic B-spline of the tip in m pieces whose chords stay near; as written."""

    u: Floats  #: (m + 1,): ends of the pieces
    bezier: Floats  #: (m, 4, 3): control points of each piece
    first: int = 0  #: pose that it starts from

    @property
    def points(self) -> Floats:
        """(m + 1, 3) ends of the pieces."""
        return np.concatenate((self.bezier[:1, 0], self.bezier[:, 3]))

    def placed(self, system: System, first: int) -> Cubic:
        """The same from a pose, in the first coordinate system."""
        bezier = system.points(self.bezier.reshape(-1, 3)).reshape(self.bezier.shape)
        return replace(self, bezier=bezier, first=first)


def cubic(knots: Floats, control: Floats, tolerance: float) -> Cubic | None:
    """Cut a curve into pieces at its knots and where chords would leave it by more than a tolerance.

    It ends at its last control point. None if there would be more than `MOST_LINES` a control point.
    """
    from scipy.interpolate import BSpline  # which takes long to load

    spline = BSpline(knots, control, DEGREE)
    slope = spline.derivative()
    edges = np.unique(knots[DEGREE : len(control) + 1])
    whole = _bezier(spline(edges), slope(edges), edges)
    # a chord is off by at most an eighth of the largest second derivative, which lies in the hull of its control points
    bend = 0.75 * norm(np.diff(whole, 2, axis=1)).max(axis=1, initial=0.0)
    with np.errstate(over="ignore", invalid="ignore"):
        pieces = np.ceil(np.sqrt(bend / tolerance))
    if not pieces.sum() <= MOST_LINES * len(control):
        return None
    pieces = np.maximum(pieces, 1).astype(np.int64)
    step = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    u = np.append(np.repeat(edges[:-1], pieces) + step * np.repeat(np.diff(edges) / pieces, pieces), edges[-1])
    bezier = _bezier(spline(u), slope(u), u)
    bezier[-1, 3] = control[-1]
    return Cubic(u, bezier)


def _bezier(points: Floats, slopes: Floats, u: Floats) -> Floats:
    """Control points of the pieces between places with points and derivatives."""
    third = np.diff(u)[:, None] / 3.0
    inner = points[:-1] + third * slopes[:-1], points[1:] - third * slopes[1:]
    return np.stack((points[:-1], *inner, points[1:]), axis=1)


def curves_of(
    cubics: list[Cubic], scale: float, axis: Floats, exact: NDArray[np.bool_], kind: NDArray[np.uint8]
) -> Curves | None:
    """The curves of a program in mm, with points 1 mm up the tool axis; under cutter compensation they are lines."""
    poses, pieces = [], []
    for one in cubics:
        pose = one.first + np.arange(len(one.u))
        turned = np.ptp(axis[pose], axis=0).max() > AXIS_NOISE
        elsewhere = kind[pose[0]] in (Move.FROM, Move.HOLE)  # the tool does not come from that pose
        if turned or elsewhere or exact[pose].any() or (kind[pose[1:]] != Move.LINEAR).any():
            continue
        poses.append(pose[1:])
        bezier = scale * one.bezier
        pieces.append(np.concatenate((bezier, bezier + axis[pose[1]] / np.linalg.norm(axis[pose[1]])), axis=-1))
    return Curves(np.concatenate(poses), np.concatenate(pieces)) if poses else None
