"""How far the written path is from the original at each corner: what a measurement of the program finds.

`Corners.tip_error` and `Corners.axis_error` compare both motions at a common parameter. The paths are as near or
nearer: where the legs are unequal, the curve passes the corner nearest beside u = ½. The distance from the corner
itself decides, as the path runs on the inner side of it and turns in one sense.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.methods import METHODS
from cornersmooth.model import Floats, Ints, SmoothProgram
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import lines_of
from cornersmooth.vectors import dot, norm

#: corners looked at together
_BATCH = 4096

#: points of the first look at a curve, rounds of looking closer, and points of each
_FIRST, _ROUNDS, _CLOSER = 17, 5, 7

#: cosine between the path at u = ½ and the way to the corner below which that is the nearest point
_SQUARE = 1e-5


@dataclass(frozen=True)
class _Transitions:
    """Transitions of g corners, seen from the corners."""

    tip: Floats  # trimmed legs of the tip, (g, 2, 3), mm
    turn: Floats  # those of the lever H·axis
    lever: Floats  # H·axis of the corner, (g, 3), mm
    weights: Floats  # (2,)
    ratio: float
    height: float

    @classmethod
    def of(cls, smoothed: SmoothProgram, rows: Ints) -> _Transitions:
        program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
        height = settings.axis_length
        _, *tip = nurbs.trimmed_legs(program.tip, corners, rows)
        axis, *turn = nurbs.trimmed_legs(program.axis, corners, rows)
        legs = np.stack(tip, axis=1), height * np.stack(turn, axis=1)
        return cls(*legs, height * axis, np.array(settings.weights), settings.ratio, height)

    def only(self, rows: Ints) -> _Transitions:
        return replace(self, tip=self.tip[rows], turn=self.turn[rows], lever=self.lever[rows])

    def at(self, u: Floats) -> tuple[Floats, Floats]:
        """Tips less the corner and levers, (g, m, 3), at parameters (m,) or (g, m)."""
        shares = nurbs.leg_coefficients(u, self.weights, self.ratio)
        tip, lever = shares[..., 1:] @ self.tip, self.lever[:, None, :] + shares[..., 1:] @ self.turn
        return tip, lever * (self.height / norm(lever))[..., None]

    def axis_point(self, u: Floats) -> Floats:
        """Axis points less the axis point of the corner, (g, m, 3)."""
        tip, lever = self.at(u)
        return tip + lever - self.lever[:, None, :]


def path_distances(smoothed: SmoothProgram, rows: Ints, *, dense: bool) -> tuple[Floats, Floats]:
    """Distances (g,) of tip path and axis-point path from the original ones at some corners, mm; 0 where not smoothed.

    For the paper's method they are the errors by its equation (10). With `dense`, transitions are written as lines.
    """
    corners = smoothed.corners
    tip, axis_point = corners.tip_error[rows].copy(), corners.axis_error[rows].copy()
    if not METHODS[smoothed.settings.method].one_parameter:
        return tip, axis_point
    own_axis = smoothed.settings.axis_tolerance is not None  # then it has no path of its own
    for begin in range(0, len(rows), _BATCH):
        chosen = begin + np.flatnonzero(corners.smoothed[rows[begin : begin + _BATCH]])
        if not len(chosen):
            continue
        transitions = _Transitions.of(smoothed, rows[chosen])
        lines = lines_of(smoothed, rows[chosen]) if dense else None
        tip[chosen] = _passing(transitions, lines, tip[chosen], whole=False)
        if not own_axis:
            axis_point[chosen] = _passing(transitions, lines, axis_point[chosen], whole=True)
    return tip, axis_point


def _passing(transitions: _Transitions, lines: Ints | None, common: Floats, *, whole: bool) -> Floats:
    """How near tip path or (`whole`) axis-point path pass the corner, no farther than at the common parameter."""

    def point_at(some: _Transitions, u: Floats) -> Floats:
        return some.axis_point(u) if whole else some.at(u)[0]

    near = point_at(transitions, np.array([0.5 - 1e-5, 0.5, 0.5 + 1e-5]))
    along, off = near[:, 2] - near[:, 0], near[:, 1]
    aslant = np.flatnonzero(np.abs(dot(along, off)) > _SQUARE * norm(along) * norm(off))
    passing = common.copy()
    if lines is None:
        some = transitions.only(aslant)
        passing[aslant] = np.minimum(common[aslant], _nearest_on_curve(lambda u: point_at(some, u), len(aslant)))
        return passing
    for number in np.unique(lines[aslant]):
        chosen = aslant[lines[aslant] == number]
        some = transitions.only(chosen)
        tip, lever = some.at(np.concatenate(([0.0], nodes(int(number)))))
        passing[chosen] = np.minimum(common[chosen], _nearest_on_lines(some, tip, lever, whole=whole))
    return passing


def _nearest_on_curve(point_at: Callable[[Floats], Floats], count: int) -> Floats:
    """(count,) least distance of curves from their corners; `point_at` takes parameters (count, m) to points."""
    low, step, points = np.zeros(count), 1.0 / (_FIRST - 1), _FIRST
    for _ in range(_ROUNDS):
        point = point_at(low[:, None] + step * np.arange(points))
        square = dot(point, point)
        best = np.clip(square.argmin(axis=1), 1, points - 2)
        low, step, points = low + (best - 1) * step, 2.0 * step / (_CLOSER - 1), _CLOSER
    before, middle, behind = (np.take_along_axis(square, (best + k)[:, None], axis=1)[:, 0] for k in (-1, 0, 1))
    bend = before - 2.0 * middle + behind
    # the vertex of the parabola through the three
    drop = np.divide((before - behind) ** 2, 8.0 * bend, out=np.zeros(count), where=bend > 0.0)
    return np.sqrt(np.maximum(np.minimum(np.minimum(before, behind), middle - drop), 0.0))


def _nearest_on_lines(transitions: _Transitions, tip: Floats, lever: Floats, *, whole: bool) -> Floats:
    """(g,) least distance of lines between tips and levers (g, m, 3) from the corners."""
    point = tip + lever - transitions.lever[:, None, :] if whole else tip
    start, way = point[:, :-1], np.diff(point, axis=1)
    size = dot(way, way)
    share = np.clip(np.divide(-dot(start, way), size, out=np.zeros_like(size), where=size > 0), 0.0, 1.0)[..., None]
    nearest = start + share * way
    if whole:  # the control turns the tool between the ends of a line
        turned = lever[:, :-1] + share * np.diff(lever, axis=1)
        turned *= (transitions.height / norm(turned))[..., None]
        nearest = tip[:, :-1] + share * np.diff(tip, axis=1) + turned - transitions.lever[:, None, :]
    return norm(nearest).min(axis=1)
