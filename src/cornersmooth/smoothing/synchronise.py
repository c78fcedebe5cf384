"""Synchronisation of the two curves in the paper's method: equations (20) to (22).

For a parameter u of the tip curve, v is sought on the axis-point curve with |Q(v) − P(u)| = H. That is ill posed: on
the paper's own Table 1 there is no root at u = 0 of the third position and two over half of the range. So the root
is followed on the branch that starts nearest to v = u, and v never runs backwards. Where there is no root the v that
comes closest to H is taken, and what is missing is reported as the residual.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats, Ints
from cornersmooth.vectors import angle_between, norm

#: parameters of the tip curve at which residual and jumps are reported
REPORT_PARAMETERS = np.linspace(0.0, 1.0, 9)

#: what is missing of ``|Q(v) − P(u)| = H`` at parameters v of some rows
Excess = Callable[[Floats, Ints | slice], Floats]

_GRID = np.linspace(0.0, 1.0, 33)
_HALVINGS = 36

#: an excess that is none, mm, and parameters that do not differ; secants that are tried before halving
_NO_EXCESS, _NO_STEP, _SECANTS = 1e-13, 4e-13, 12


def matching_parameters(
    tip_curve: Floats, axis_curve: Floats, weights: Floats, u: Floats, axis_length: float
) -> tuple[Floats, Floats]:
    """Parameters v(u) (g, m) with |Q(v) − P(u)| = H as nearly as possible, never decreasing, and what is missing, mm.

    Control points (g, 5, 3) are those of P and Q, u (m,) ascends.
    """
    tips = nurbs.evaluate(tip_curve, weights, u)
    grid = nurbs.evaluate(axis_curve, weights, _GRID)
    v = np.zeros((len(tip_curve), len(u)))
    low_limit, target = np.zeros(len(v)), np.full(len(v), u[0])
    for j, step in enumerate(np.diff(u, append=u[-1])):
        tip = tips[:, j]

        def excess(parameter: Floats, rows: Ints | slice, tip: Floats = tip) -> Floats:
            points = nurbs.evaluate(axis_curve[rows], weights[rows], parameter[:, None])[:, 0]
            return norm(points - tip[rows]) - axis_length

        v[:, j] = low_limit = _follow(norm(grid - tip[:, None]) - axis_length, low_limit, target, excess)
        target = np.clip(low_limit + step, 0.0, 1.0)
    return v, np.abs(norm(nurbs.evaluate(axis_curve, weights, v) - tips) - axis_length)


def _follow(values: Floats, low_limit: Floats, target: Floats, excess: Excess) -> Floats:
    """One step of the branch: the root at or above `low_limit` nearest to `target`, else the smallest excess.

    `values` (g, grid) are the excess on the grid.
    """
    # the cell that holds the limit counts from the limit on
    at_limit = excess(low_limit, slice(None))
    values = np.where(low_limit[:, None] > _GRID, at_limit[:, None], values)
    parameters = np.maximum(_GRID, low_limit[:, None])
    crossing = (values[:, :-1] <= 0.0) != (values[:, 1:] <= 0.0)
    has_root = crossing.any(axis=1)
    found = np.empty(len(values))
    rows = np.flatnonzero(has_root)
    if len(rows):
        at, wanted, limit = parameters[rows], target[rows], low_limit[rows]
        distance = np.maximum(at[:, :-1] - wanted[:, None], wanted[:, None] - at[:, 1:])
        cell = np.argmin(np.where(crossing[rows], np.maximum(distance, 0.0), np.inf), axis=1)
        each = np.arange(len(rows))
        ends = (values[rows, cell], values[rows, cell + 1])
        root = _roots(at[each, cell], at[each, cell + 1], ends, lambda parameter: excess(parameter, rows))
        # an exact root at the limit, as at the two ends of a well synchronised corner, is kept exactly
        exact = (np.abs(at_limit[rows]) <= 1e-12) & (np.abs(wanted - limit) <= np.abs(wanted - root))
        found[rows] = np.where(exact, limit, root)
    rest = np.flatnonzero(~has_root)
    if len(rest):
        found[rest] = _closest(values[rest], parameters[rest], lambda parameter: excess(parameter, rest))
    return found


def _roots(low: Floats, high: Floats, ends: tuple[Floats, Floats], excess: Callable[[Floats], Floats]) -> Floats:
    """Roots between pairs of parameters whose excess is known: by secants (Illinois), then by bisection."""
    (one, other), negative_low = ends, ends[0] <= 0.0
    root, best = np.where(np.abs(one) < np.abs(other), low, high), np.minimum(np.abs(one), np.abs(other))
    kept = np.zeros(len(low), np.int8)  # which end the last secant has left where it was: 1 the high one, -1 the low
    for step in range(_SECANTS + _HALVINGS):
        part = one / np.where(one == other, -1.0, one - other) if step < _SECANTS else 0.5
        middle = low + np.clip(part, 0.0, 1.0) * (high - low)
        value = excess(middle)
        same = (value <= 0.0) == negative_low
        low, high = np.where(same, middle, low), np.where(same, high, middle)
        # an end that stays twice counts half, so that it does not stay for ever
        one = np.where(same, value, np.where(kept < 0, one / 2.0, one))
        other = np.where(same, np.where(kept > 0, other / 2.0, other), value)
        kept = np.where(same, np.int8(1), np.int8(-1))
        root, best = np.where(np.abs(value) < best, middle, root), np.minimum(np.abs(value), best)
        if ((best <= _NO_EXCESS) | (high - low <= _NO_STEP)).all():
            break
    return root


def _closest(values: Floats, parameters: Floats, excess: Callable[[Floats], Floats]) -> Floats:
    """Parameter with the smallest ``|excess|``: grid minimum refined by ternary search in its two cells."""
    rows = np.arange(len(values))
    best = np.argmin(np.abs(values), axis=1)
    low = parameters[rows, np.maximum(best - 1, 0)]
    high = parameters[rows, np.minimum(best + 1, len(_GRID) - 1)]
    for _ in range(_HALVINGS):
        third = (high - low) / 3.0
        left, right = low + third, high - third
        keep_left = np.abs(excess(left)) <= np.abs(excess(right))
        low, high = np.where(keep_left, low, left), np.where(keep_left, right, high)
    middle = 0.5 * (low + high)
    candidates = np.stack((middle, low, high, parameters[rows, best]))
    misses = np.abs(np.stack([excess(candidate) for candidate in candidates]))
    return candidates[np.argmin(misses, axis=0), rows]


def synchronisation_report(
    tip_legs: tuple[Floats, Floats],
    axis_legs: tuple[Floats, Floats],
    lever: Floats,
    weights: Floats,
    ratio: Floats,
    axis_length: float,
) -> tuple[Floats, Floats, Floats, Floats]:
    """How far the paper's synchronisation of g corners is from what it asks for, (g,) each.

    `tip_legs` and `axis_legs` (g, 3), mm, lead from the first control point to the corner and from there to the last
    one; `lever` is H times the axis at the corner. Gives the largest ``||Q−P|−H|`` over `REPORT_PARAMETERS` (mm);
    angles (rad) between the axis of the transition and that of the straight motion before it and after it, and between
    the axis at u = ½ and that at the corner.
    """
    tip_curve = nurbs.five_points(np.zeros_like(lever), *tip_legs, ratio)
    axis_curve = nurbs.five_points(lever, *axis_legs, ratio)
    v, residual = matching_parameters(tip_curve, axis_curve, weights, REPORT_PARAMETERS, axis_length)
    half = len(REPORT_PARAMETERS) // 2
    tops = nurbs.evaluate(axis_curve, weights, v[:, [0, half, -1]])
    tips = nurbs.evaluate(tip_curve, weights, REPORT_PARAMETERS[[half]])[:, 0]
    jumps = (angle_between(axis_curve[:, at] - tip_curve[:, at], tops[:, at // 2] - tip_curve[:, at]) for at in (0, 4))
    return residual.max(axis=1), *jumps, angle_between(tops[:, 1] - tips, lever)
