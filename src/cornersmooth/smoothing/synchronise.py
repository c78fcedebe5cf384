"""Synchronisation of the two curves in the paper's method: equations (20) to (22) (docs/method.md).

For a parameter u of the tip curve, v is sought on the axis-point curve with |Q(v) − P(u)| = H, in the knot interval of
u. That is ill posed: on the paper's own Table 1 there is no root at u = 0 of the third position and two over half of
the range. So the root is followed on the branch that starts nearest to v = u, and v never runs backwards. Where there
is no root the v that comes closest to H is taken, and what is missing is reported as the residual.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats, Ints
from cornersmooth.vectors import angle_between, square

#: parameters of the tip curve at which residual and jumps are reported
REPORT_PARAMETERS = np.linspace(0.0, 1.0, 9)

#: what is zero where something is looked for, and its derivative, at parameters of rows
_Wanted = Callable[[Floats, Ints], tuple[Floats, Floats]]

_GRID = np.linspace(0.0, 1.0, 33)

#: an excess that is none, mm; steps of a parameter that are none; steps of Newton, or halves where these lead outside
_NO_EXCESS, _NO_STEP, _STEPS = 1e-13, 1e-12, 60

#: how far from where it is expected a root is looked for without the grid, and in how many steps of Newton
_NEAR, _NEAR_STEPS, _SHORT = 1.0 / 16.0, 6, 1e-7

#: Bézier points of the first half of the five-point curve, and the powers of their cubic
_HALF = np.array([[4.0, 0, 0, 0, 0], [0, 4, 0, 0, 0], [0, 2, 2, 0, 0], [0, 1, 2, 1, 0]]) / 4.0
_POWERS = np.array([[1.0, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) @ _HALF


@dataclass(frozen=True)
class _Excess:
    """``|Q(v) − P| − H`` of g axis-point curves and points P, with its derivatives by v."""

    powers: Floats  # (4, 4, 2 g): coordinates times weight, weight; of both halves, the second from its end
    tip: Floats  # (3, g)
    axis_length: float

    def some(self, rows: Ints) -> Floats:
        """Powers of some curves."""
        return self.powers[:, :, np.concatenate((rows, rows + self.powers.shape[2] // 2))]

    @classmethod
    def of(cls, axis_curve: Floats, weights: Floats, axis_length: float) -> _Excess:
        """Those of curves (g, 5, 3) about the origin."""
        w = nurbs.full_weights(weights)[:, None]
        points = np.concatenate((w * axis_curve, np.broadcast_to(w, (*axis_curve.shape[:2], 1))), axis=2)
        both = np.concatenate((points, points[:, ::-1]))
        return cls(np.einsum("kp,gpc->kcg", _POWERS, both, optimize=True), np.zeros((3, len(axis_curve))), axis_length)

    def __call__(self, v: Floats, rows: Ints) -> tuple[Floats, Floats]:
        """Equation (21) as a length, mm, and its derivative, at parameters (k,) of the curves of rows."""
        return self._derivatives(v, rows, bends=False)[:2]

    def bends(self, v: Floats, rows: Ints) -> tuple[Floats, Floats]:
        """First and second derivative."""
        return self._derivatives(v, rows, bends=True)[1:]

    def _derivatives(self, v: Floats, rows: Ints, *, bends: bool) -> tuple[Floats, Floats, Floats]:
        second = v > 0.5
        c0, c1, c2, c3 = np.take(self.powers, rows + second * (self.powers.shape[2] // 2), axis=2)
        s = np.where(second, 1.0 - v, v)
        s += s
        c3s = c3 * s
        value, slope = ((c3s + c2) * s + c1) * s + c0, (3.0 * c3s + 2.0 * c2) * s + c1
        point, weight = value[:3] / value[3], value[3]
        away = point - self.tip[:, rows]
        rate = (slope[:3] - point * slope[3]) / weight
        length = np.sqrt(np.maximum(_dot(away, away), np.finfo(np.float64).tiny))
        first = _dot(away, rate) / length
        change = first
        if bends:
            bend = 6.0 * c3s + 2.0 * c2
            turn = (bend[:3] - point * bend[3] - 2.0 * slope[3] * rate) / weight
            change = 4.0 * (_dot(rate, rate) + _dot(away, turn) - first * first) / length
        return length - self.axis_length, np.where(second, -2.0, 2.0) * first, change


def _dot(one: Floats, other: Floats) -> Floats:
    return np.einsum("ck,ck->k", one, other)


def matching_parameters(
    tip_curve: Floats, axis_curve: Floats, weights: Floats, u: Floats, axis_length: float
) -> tuple[Floats, Floats]:
    """Parameters v(u) (g, m) with |Q(v) − P(u)| = H as nearly as possible, never decreasing, and what is missing, mm.

    Equations (20) and (21).
    Control points (g, 5, 3) are those of P and Q; weights (2,) are those of all, u (m,) ascends.
    """
    centre = axis_curve[:, 2:3]
    tips = nurbs.evaluate(tip_curve - centre, weights, u)
    grid = nurbs.evaluate(axis_curve - centre, weights, _GRID)
    every, of_grid = _Excess.of(axis_curve - centre, weights, axis_length), square(grid)
    v, missing = np.zeros((2, len(tip_curve), len(u)))
    low_limit, target = np.zeros(len(v)), np.full(len(v), u[0])
    for j, step in enumerate(np.diff(u, append=u[-1])):
        # the paper solves (21) in the knot interval of u, n = 3 or 4: so both are ½ together
        low, high = float(u[j] >= 0.5) / 2.0, (1.0 + float(u[j] > 0.5)) / 2.0
        low_limit, target = np.maximum(low_limit, low), np.clip(target, low, high)
        excess = replace(every, tip=np.ascontiguousarray(tips[:, j].T))
        if low == high:
            v[:, j] = low
            missing[:, j] = np.abs(excess(v[:, j], np.arange(len(v)))[0])
        else:
            v[:, j] = _near(low_limit, high, target, excess)
        rows = np.flatnonzero(np.isnan(v[:, j]))
        if len(rows):
            tip, own = tips[rows, j], slice(*np.searchsorted(_GRID, (low, high + _NO_STEP)))
            square_off = of_grid[rows, own] + square(tip)[:, None] - 2.0 * (grid[rows, own] @ tip[..., None])[..., 0]
            here = replace(excess, powers=every.some(rows), tip=excess.tip[:, rows])
            values = np.sqrt(square_off) - axis_length
            v[rows, j], missing[rows, j] = _follow(_GRID[own], values, low_limit[rows], target[rows], here)
        low_limit = v[:, j]
        target = low_limit + step
    return v, missing


def _near(low_limit: Floats, high: float, target: Floats, excess: _Excess) -> Floats:
    """Roots that Newton finds near the targets, where the excess only rises or falls in between; NaN for none."""
    found, rows = np.full(len(target), np.nan), np.arange(len(target))
    here, sign = target, np.zeros(len(target))
    for number in range(_NEAR_STEPS):
        value, slope = excess(here, rows)
        sign = np.sign(slope) if number == 0 else sign
        to = here - np.divide(value, slope, out=np.full_like(value, np.inf), where=slope != 0.0)
        none = np.abs(value) <= _NO_EXCESS
        to[none] = here[none]
        inside = (np.abs(to - target[rows]) <= _NEAR) & (np.sign(slope) == sign) & (to <= high)
        # the step after one so short is none, as each squares the one before
        done = inside & (none | (np.abs(to - here) <= _SHORT)) & (to >= low_limit[rows])
        found[rows[done]] = to[done]
        stays = inside & ~done & (to >= 0.0)
        rows, here, sign = rows[stays], to[stays], sign[stays]
        if not len(rows):
            break
    return found


def _follow(grid: Floats, values: Floats, low_limit: Floats, target: Floats, excess: _Excess) -> tuple[Floats, Floats]:
    """One step of the branch: the root at or above `low_limit` nearest to `target`, else the smallest excess.

    `values` (g, m) are the excess on the grid (m,). Gives the parameters, and what is missing there.
    """
    # the cell that holds the limit counts from the limit on
    each = np.arange(len(values))
    at_limit = excess(low_limit, each)[0]
    values = np.where(low_limit[:, None] > grid, at_limit[:, None], values)
    parameters = np.maximum(grid, low_limit[:, None])
    crossing = (values[:, :-1] <= 0.0) != (values[:, 1:] <= 0.0)
    distance = np.maximum(parameters[:, :-1] - target[:, None], target[:, None] - parameters[:, 1:])
    cell = np.argmin(np.where(crossing, np.maximum(distance, 0.0), np.inf), axis=1)
    has_root = crossing[each, cell]
    best = np.maximum(np.argmin(np.abs(values), axis=1), np.searchsorted(grid, low_limit, side="right") - 1)
    # without a root, the smallest excess of the grid is between its neighbours
    low = np.where(has_root, cell, np.maximum(best - 1, 0))
    high = np.where(has_root, cell + 1, np.minimum(best + 1, len(grid) - 1))
    ends, start = (parameters[each, low], parameters[each, high]), np.where(has_root, target, parameters[each, best])
    side = np.where(values[each, low] <= 0.0, -1.0, 1.0)

    def wanted(v: Floats, rows: Ints) -> tuple[Floats, Floats]:
        """What is zero at the place that is looked for, and its derivative; above zero behind it."""
        root, sign = has_root[rows], side[rows]
        if root.all():
            value, slope = excess(v, rows)
            return -sign * value, -sign * slope
        value, slope = excess(v, rows)
        first, bend = excess.bends(v, rows)
        return np.where(root, -sign * value, sign * first), np.where(root, -sign * slope, sign * bend)

    found = _zero(ends, start, wanted)
    between = np.flatnonzero(~has_root & (side * excess(found, each)[0] < 0.0))  # two roots in a cell of the grid
    if len(between):
        first, middle = target[between] <= found[between], found[between]
        ends = np.where(first, ends[0][between], middle), np.where(first, middle, ends[1][between])
        sign = np.where(first, -side[between], side[between])

        def crossed(v: Floats, rows: Ints) -> tuple[Floats, Floats]:
            value, slope = excess(v, between[rows])
            return sign[rows] * value, sign[rows] * slope

        found[between] = _zero(ends, target[between], crossed)
    # an exact root at the limit, as at the two ends of a well synchronised corner, is kept exactly
    kept = has_root & (np.abs(at_limit) <= 1e-12) & (np.abs(target - low_limit) <= np.abs(target - found))
    found = np.where(kept, low_limit, found)
    missing = np.abs(excess(found, each)[0])
    worse = ~has_root & (np.abs(values[each, best]) < missing)
    return np.where(worse, parameters[each, best], found), np.where(worse, np.abs(values[each, best]), missing)


def _zero(ends: tuple[Floats, Floats], start: Floats, wanted: _Wanted) -> Floats:
    """Where something rises through zero between two ends, or the end towards which it would: steps of Newton.

    A step that leads out of what is left between the ends is replaced by half of the way.
    """
    low, high = ends[0].copy(), ends[1].copy()
    found = np.clip(start, low, high)
    pending = np.arange(len(found))
    for number in range(_STEPS):
        here = found[pending]
        value, slope = wanted(here, pending)
        low[pending] = np.where(value <= 0.0, here, low[pending])
        high[pending] = np.where(value >= 0.0, here, high[pending])
        to = here - np.divide(value, slope, out=np.full_like(value, np.inf), where=slope > 0.0)
        outside = ~((to > low[pending]) & (to < high[pending]))
        if number == 0:  # what lies beyond an end is found there
            to = np.where(outside, np.where(value < 0.0, high[pending], low[pending]), to)
        else:
            to = np.where(outside, (low[pending] + high[pending]) / 2.0, to)
        done = (np.abs(value) <= _NO_EXCESS) | (np.abs(to - here) <= _NO_STEP)
        found[pending] = np.where(np.abs(value) <= _NO_EXCESS, here, to)
        pending = pending[~done]
        if not len(pending):
            break
    return found


def synchronisation_report(
    tip_legs: tuple[Floats, Floats],
    axis_legs: tuple[Floats, Floats],
    lever: Floats,
    weights: Floats,
    axis_length: float,
    u: Floats = REPORT_PARAMETERS,
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """How far g corners are from what equations (17), (18) and (20) ask for, (g,) each.

    `tip_legs` and `axis_legs` (g, 3), mm, lead from the first control point to the corner and from there to the last
    one; `lever` is H times the axis at the corner. Gives v (g, m) at u (m,), ½ in the middle; the largest ``||Q−P|−H|``
    there, mm; angles, rad, between the axis of the transition and that of the straight motion before it and after it,
    and between the axis at u = ½ and that at the corner.
    """
    tip_curve = nurbs.five_points(np.zeros_like(lever), *tip_legs)
    axis_curve = nurbs.five_points(lever, *axis_legs)
    v, residual = matching_parameters(tip_curve, axis_curve, weights, u, axis_length)
    half = len(u) // 2
    tops = nurbs.evaluate(axis_curve, weights, v[:, [0, half, -1]])
    tips = nurbs.evaluate(tip_curve, weights, u[[half]])[:, 0]
    jumps = (angle_between(axis_curve[:, at] - tip_curve[:, at], tops[:, at // 2] - tip_curve[:, at]) for at in (0, 4))
    return v, residual.max(axis=1), *jumps, angle_between(tops[:, 1] - tips, lever)
