"""Creo's MOVNRB records: B-splines of the tip, and of a point up the tool axis, read as lines near them.

::

    MOVNRB / M5AXIS, LENGTH, 10.0      or M3AXIS; the second curve is LENGTH above the first
    MOVNRB / ON, order, knots, 0, control points, length of the curve
    MOVNRB / 1, all knots              in statements of at most 24 numbers
    MOVNRB / 2, control points of the tip
    MOVNRB / 3, those of the second curve
    MOVNRB / NEXT
    GOTO / ...                         the same motion as points
    MOVNRB / OFF

Source: PTC, Creo help, "CL Output for NURBS Interpolation". All readers agree on the points: they are taken where they
are not on the curve, or where anything else is among them, such as another feed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cornersmooth.cl.nurbs import MOST_LINES
from cornersmooth.model import Floats

#: how far points may be from the curve, and axes from its own, in units of the file and radians
NEAR: Final = 1e-3

_HIGHEST_ORDER: Final = 24

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
        if not 2 <= self.order <= _HIGHEST_ORDER or knots != points + self.order:
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

    def path(self, tolerance: float) -> Floats | None:
        """(k, 6) tips and tool axes (NaN for none) on a curve without a complaint, whose chords stay near it.

        None if there would be more than `MOST_LINES` a control point, or where tip and second point are the same.
        """
        from scipy.interpolate import BSpline  # which takes long to load

        degree, count = self.order - 1, self.sizes[1]
        kinds = (TIP, SECOND) if self.five else (TIP,)
        control = np.hstack([np.array(self.rows[kind]).reshape(-1, 3) for kind in kinds])
        knots = np.array(self.rows[1])
        spans = np.unique(knots[degree : count + 1])
        spline = BSpline(knots, control, degree)
        # chord error of a piece of length h is at most h²/8·max|C″|, and C″ lies in the hull of its control points
        bend = np.zeros(len(spans) - 1)
        if degree > 1:
            size = np.linalg.norm(spline.derivative(2).c.reshape(-1, len(kinds), 3), axis=2).max(axis=1)
            first = np.searchsorted(knots, spans[:-1], side="right") - 1 - degree
            bend = np.max([size[first + k] for k in range(degree - 1)], axis=0)
        with np.errstate(over="ignore", invalid="ignore"):
            pieces = np.ceil(np.diff(spans) * np.sqrt(bend / (8.0 * tolerance)))
        if not pieces.sum() <= MOST_LINES * count:
            return None
        pieces = np.maximum(pieces, 1).astype(np.int64)
        begin = np.cumsum(pieces) - pieces
        step = np.arange(pieces.sum()) - np.repeat(begin, pieces)
        u = np.append(np.repeat(spans[:-1], pieces) + step * np.repeat(np.diff(spans) / pieces, pieces), spans[-1])
        found: Floats = spline(u)
        if not self.five:
            return np.hstack((found, np.full((len(u), 3), np.nan)))
        axis = found[:, 3:] - found[:, :3]
        length = np.linalg.norm(axis, axis=1, keepdims=True)
        return np.hstack((found[:, :3], axis / length)) if (length > 0.0).all() else None

    def passes_by(self, path: Floats, start: tuple[float, float, float]) -> bool:
        """Whether the path begins at a tip, and passes by the points in order and ends with the last of them."""
        points = np.vstack(self.points) if self.points else path[-1:]
        begin = math.dist(start, path[0, :3].tolist())
        end = math.dist(points[-1, :3].tolist(), path[-1, :3].tolist())
        return max(begin, end) <= NEAR and all(self._near(path, point) for point in points)

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
