"""Cubic B-splines of a CL file: NX's records of them, and Creo's.

NX::

    GOTO/x,y,z            start: the first control point
    NURBS/
    KNOT/0.04,0.37,...,1  inner knots and the last one, without the three (four) that repeat the ends
    CNTRL/x,y,z           further control points; the last one is the end

The meaning of the rows is nowhere published; it was established on a real file (70 curves, 1,413 control points). In
every curve K knots come with K+2 control points, as in a clamped cubic that starts at the position before it; and with
that reading the control legs are proportional to the differences of the Greville abscissae, first and last leg
included, within 1 % in most curves: each curve runs at constant speed, as it should.

Creo's MOVNRB, of the tip and of a point up the tool axis::

    MOVNRB / M5AXIS, LENGTH, 10.0      or M3AXIS; the second curve is LENGTH above the first
    MOVNRB / ON, order, knots, 0, control points, length of the curve
    MOVNRB / 1, all knots              in statements of at most 24 numbers
    MOVNRB / 2, control points of the tip
    MOVNRB / 3, those of the second curve
    MOVNRB / NEXT
    GOTO / ...                         the same motion as points
    MOVNRB / OFF

Source: PTC, Creo help, "CL Output for NURBS Interpolation". All readers agree on the points: they are taken where they
are not on the curve, where that is no cubic, or where anything else is among them, such as another feed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import joined_rows, unit
from cornersmooth.cl.poses import AXIS_NOISE, System
from cornersmooth.model import Curves, Floats, Ints, Move, Runs

DEGREE: Final = 3

#: knots are equal or differ by this part of the last one; NX prints seven decimals
LEAST_STEP: Final = 1e-9

#: lines for every control point at most; more would be no tool path
MOST_LINES: Final = 1000

#: steps of the parameter of a curve: knots are written with three decimals, and a control takes so long a curve at once
_STEPS: Final = 4e6


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
    """A cubic B-spline of the tip, or of tip and second point, in m pieces whose chords stay near; as written."""

    knots: Floats  #: (c + 4,)
    control: Floats  #: (c, 3 or 6)
    u: Floats  #: (m + 1,): ends of the pieces
    bezier: Floats  #: (m, 4, 3 or 6): control points of each piece
    first: int = 0  #: pose that it starts from

    @property
    def points(self) -> Floats:
        """(m + 1, 3 or 6) ends of the pieces."""
        return np.concatenate((self.bezier[:1, 0], self.bezier[:, 3]))

    def placed(self, system: System, first: int) -> Cubic:
        """The same from a pose, in the first coordinate system."""
        control, bezier = (
            system.points(points.reshape(-1, 3)).reshape(points.shape) for points in (self.control, self.bezier)
        )
        return replace(self, control=control, bezier=bezier, first=first)


def cubic(knots: Floats, control: Floats, tolerance: float) -> Cubic | None:
    """Cut a curve into pieces at its knots and where chords would leave tip or second point by more than a tolerance.

    None if there would be more than `MOST_LINES` a control point.
    """
    from scipy.interpolate import BSpline  # which takes long to load

    spline = BSpline(knots, control, DEGREE)
    slope = spline.derivative()
    edges = np.unique(knots[DEGREE : len(control) + 1])
    whole = _bezier(spline(edges), slope(edges), edges)
    # a chord is off by at most an eighth of the largest second derivative, which lies in the hull of its control points
    bend = 0.75 * _largest(np.diff(whole, 2, axis=1))
    with np.errstate(over="ignore", invalid="ignore"):
        pieces = np.ceil(np.sqrt(bend / tolerance))
    if not pieces.sum() <= MOST_LINES * len(control):
        return None
    pieces = np.maximum(pieces, 1).astype(np.int64)
    step = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    u = np.append(np.repeat(edges[:-1], pieces) + step * np.repeat(np.diff(edges) / pieces, pieces), edges[-1])
    bezier = _bezier(spline(u), slope(u), u)
    if knots[len(control)] == knots[-1]:
        bezier[-1, 3] = control[-1]
    return Cubic(knots, control, u, bezier)


def _bezier(points: Floats, slopes: Floats, u: Floats) -> Floats:
    """Control points of the pieces between places with points and derivatives."""
    third = np.diff(u)[:, None] / 3.0
    inner = points[:-1] + third * slopes[:-1], points[1:] - third * slopes[1:]
    return np.stack((points[:-1], *inner, points[1:]), axis=1)


def _largest(differences: Floats) -> Floats:
    """(m,) the largest of rows (m, k, 3 or 6), of tip and second point each by itself."""
    return np.linalg.norm(differences.reshape(*differences.shape[:2], -1, 3), axis=3).max(axis=(1, 2), initial=0.0)


def curves_of(
    cubics: list[Cubic], scale: float, axis: Floats, exact: NDArray[np.bool_], kind: NDArray[np.uint8]
) -> Curves | None:
    """The curves of a program in mm, with points 1 mm up the tool axis; under cutter compensation they are lines."""
    poses, pieces, runs = [], [], []
    for one in cubics:
        pose = one.first + np.arange(len(one.u))
        fixed = one.control.shape[1] == 3 and np.ptp(axis[pose], axis=0).max() > AXIS_NOISE
        elsewhere = kind[pose[0]] in (Move.FROM, Move.HOLE)  # the tool does not come from that pose
        if fixed or elsewhere or exact[pose].any() or (kind[pose[1:]] != Move.LINEAR).any():
            continue
        control, bezier = (_raised(scale * points, axis[pose[1]]) for points in (one.control, one.bezier))
        poses.append(pose[1:])
        pieces.append(bezier)
        runs += _as_run(one, pose, control)
    if not poses:
        return None
    return Curves(np.concatenate(poses), np.concatenate(pieces), joined_rows(runs) if runs else None)


def _raised(points: Floats, axis: Floats) -> Floats:
    """Points (..., 3 or 6) of tip, with second points about 1 mm up the tool axis."""
    tip, way = points[..., :3], points[..., 3:] - points[..., :3] if points.shape[-1] == 6 else axis
    return np.concatenate((tip, tip + way / np.linalg.norm(way.reshape(-1, 3)[0])), axis=-1)


def _as_run(one: Cubic, pose: Ints, control: Floats) -> list[Runs]:
    """The whole curve, where controls take it: clamped, and without repeated knots."""
    inner = one.knots[DEGREE : len(control) + 1]
    clamped = one.knots[0] == inner[0] and one.knots[-1] == inner[-1]
    s, knot = (np.rint((u - inner[0]) * (_STEPS / (inner[-1] - inner[0]))) for u in (one.u, inner))
    if not clamped or (np.diff(s) < 1.0).any() or (np.diff(knot) < 1.0).any():
        return []
    count, none = np.array([len(pose)]), np.zeros(1)
    return [Runs(pose, count, s, 1.0 / _STEPS, knot, np.array([len(knot)]), control, none, none)]


#: how far points may be from the curve, and axes from its own, in units of the file and radians; the same of its start
NEAR: Final = 1e-3
AT_START: Final = 1e-5

#: where chords are as near as at the tip: LENGTH may be less than any tool, units of the file
REACH: Final = 40.0

#: statements of control points, and what they are of
TIP, SECOND = 2, 3


@dataclass
class Spline:
    """Rows of a record as they come in; lengths as written."""

    line: int
    order: int
    sizes: tuple[int, int]  #: numbers of knots and of control points that are announced
    five: bool  #: whether there is a second curve
    rows: dict[int, list[float]] = field(default_factory=lambda: {1: [], TIP: [], SECOND: []})
    passing: bool = False  #: whether the points follow
    #: (m, 7) parts of the points: tip, axis (NaN for none), line
    points: list[Floats] = field(default_factory=list)

    @property
    def complaint(self) -> str | None:
        """What is wrong with knots and control points, if anything."""
        knots, points = self.sizes
        if not 2 <= self.order <= points or knots != points + self.order:
            return f"order {self.order}, {knots} knots and {points} control points are no curve"
        wanted = {1: knots, TIP: 3 * points, SECOND: 3 * points * self.five}
        wrong = [kind for kind, count in wanted.items() if len(self.rows[kind]) != count]
        if wrong:
            return f"MOVNRB/{wrong[0]} has {len(self.rows[wrong[0]])} numbers, not {wanted[wrong[0]]}"
        along = np.array(self.rows[1])
        inside = along[self.order - 1 : points + 1]
        if not (np.isfinite(along).all() and (np.diff(along) >= 0.0).all() and inside[-1] > inside[0]):
            return "its knots do not ascend"
        return None

    def cubic(self, start: Floats, tolerance: float) -> Cubic | None:
        """The curve from where the tool is, tip and axis (6,); its first point is there but for the last digits.

        None where it does not start there, or does not pass by its points.
        """
        knots, count = np.array(self.rows[1]), self.sizes[1]
        inside = knots[DEGREE : count + 1]
        if self.order != DEGREE + 1 or bad_knots((inside - inside[0]) / (inside[-1] - inside[0])) is not None:
            return None
        kinds = (TIP, SECOND) if self.five else (TIP,)
        control = np.hstack([np.array(self.rows[kind]).reshape(-1, 3) for kind in kinds])
        if self.five:
            up = control[:, 3:] - control[:, :3]
            if not up.any(axis=1).all():
                return None
            control[:, 3:] = control[:, :3] + REACH * up / np.linalg.norm(up[0])
        if knots[0] == knots[DEGREE] and np.abs(control[0, :3] - start[:3]).max() <= AT_START:
            control[0] += np.tile(start[:3] - control[0, :3], len(kinds))
        found = cubic(knots, control, tolerance)
        if found is None:
            return None
        path = found.points
        if self.five:
            path[:, 3:] = unit(path[:, 3:] - path[:, :3])
        begin = np.abs(path[0] - start[: path.shape[1]]).max()
        end = np.abs(path[-1, :3] - np.vstack(self.points)[-1, :3]).max() if self.points else 0.0
        near = begin <= AT_START and end <= NEAR
        return found if near and all(self._near(path, point) for rows in self.points for point in rows) else None

    def _near(self, path: Floats, point: Floats) -> bool:
        """Whether a path passes by a point with its axis."""
        way = np.diff(path, axis=0)
        square = np.maximum(np.einsum("ij,ij->i", way[:, :3], way[:, :3]), 1e-300)
        part = np.clip(np.einsum("ij,ij->i", point[:3] - path[:-1, :3], way[:, :3]) / square, 0.0, 1.0)
        near = path[:-1] + part[:, None] * way
        off = np.linalg.norm(near[:, :3] - point[:3], axis=1) <= NEAR
        if self.five and not np.isnan(point[3]):
            off &= np.linalg.norm(near[:, 3:] - point[3:6], axis=1) <= NEAR
        return bool(off.any())
