"""Creo's MOVNRB records: cubic B-splines of the tip, and of a point up the tool axis.

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
are not on the curve, where that is no cubic, or where anything else is among them, such as another feed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cornersmooth.arrays.vectors import unit
from cornersmooth.cl.nurbs import DEGREE, Cubic, bad_knots, cubic
from cornersmooth.model import Floats

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
