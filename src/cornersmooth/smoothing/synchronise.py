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

#: what is zero where something is looked for, and its derivative, at parameters of rows
_Wanted = Callable[[Floats, Ints], tuple[Floats, Floats]]

_GRID = np.linspace(0.0, 1.0, 33)

#: an excess that is none, mm; steps of a parameter that are none; steps of Newton, or halves where these lead outside
_NO_EXCESS, _NO_STEP, _STEPS = 1e-13, 1e-12, 60

#: how far from where it is expected a root is looked for without the grid, and in how many steps of Newton
_NEAR, _NEAR_STEPS, _SHORT = 1.0 / 16.0, 4, 1e-7

#: weight, σ and β of the first half by powers of s, and products of two of them
_OF_POINTS = np.array([[1.0, 1, 1, 1, 1], [1, nurbs.RATIO, 0, -nurbs.RATIO, 0], [0, 0, 0, nurbs.RATIO, 0]])
_SHARES = _OF_POINTS @ nurbs.POWERS.T
_PAIRS = np.triu_indices(3)
_PRODUCTS = np.array([np.convolve(one, other) for one, other in zip(*(_SHARES[k] for k in _PAIRS), strict=True)]).T


@dataclass(frozen=True)
class _Excess:
    """``(|Q(v) − P|² − H²) / 2H`` of g corners and points P in one half of v: zero where ``|Q(v) − P|`` is H.

    With σ and β as in `cornersmooth.geometry.nurbs`, Q(v) is σ·l + β·d from the corner: a polynomial in s, which runs
    from the outer end of the half to its middle.
    """

    powers: Floats  # (7, g): the excess by powers of s
    second: bool  # half
    axis_length: float

    def __call__(self, v: Floats, rows: Ints | slice = slice(None)) -> tuple[Floats, Floats, Floats]:
        """Equation (21) as a length, mm, with two derivatives, at parameters (k,) of the curves of rows."""
        s, turned = self._place(v), -2.0 if self.second else 2.0
        value, slope, bend = _polynomial(self.powers[:, rows], s)
        return value, turned * slope, 4.0 * bend

    def on(self, grid: Floats) -> Floats:
        """(g, m) the excess at common parameters (m,)."""
        return self.powers.T @ self._place(grid) ** np.arange(7)[:, None]

    def missing(self, v: Floats) -> Floats:
        """``||Q(v) − P| − H|``, mm."""
        squared = self.axis_length * (self.axis_length + 2.0 * self(v)[0])
        return np.abs(np.sqrt(np.maximum(squared, 0.0)) - self.axis_length)

    def _place(self, v: Floats) -> Floats:
        return 2.0 * (1.0 - v if self.second else v)


def _polynomial(powers: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
    """Value and first two derivatives of polynomials (p, ...): Horner's rule."""
    value, slope, bend = powers[-1] * s + powers[-2], powers[-1], np.zeros(())
    for power in powers[-3::-1]:
        bend = bend * s + slope
        slope = slope * s + value
        value = value * s + power
    return value, slope, 2.0 * bend


def matching_parameters(tip_curve: Floats, axis_curve: Floats, u: Floats, axis_length: float) -> tuple[Floats, Floats]:
    """Parameters v(u) (g, m) with |Q(v) − P(u)| = H as nearly as possible, never decreasing, and what is missing, mm.

    Equations (20) and (21).
    Control points (g, 5, 3) are those of P and Q; u (m,) ascends.
    """
    curves = np.stack((tip_curve, axis_curve), axis=1)
    lever = axis_curve[:, 2] - tip_curve[:, 2]
    return synchronised(curves[:, :, [2, 4]] - curves[:, :, [0, 2]], lever, u, axis_length)


def synchronised(legs: Floats, lever: Floats, u: Floats, axis_length: float) -> tuple[Floats, Floats]:
    """`matching_parameters` of both curves by their legs in and out (g, 2, 2, 3), and by levers at the corners."""
    (tip_in, tip_out), (axis_in, axis_out) = np.ascontiguousarray(np.moveaxis(legs, 0, -1))
    bend, away = axis_out - axis_in, np.stack((np.ascontiguousarray(lever.T), tip_in, tip_out))
    shares = nurbs.leg_coefficients(u) * (1.0, -1.0, -1.0)  # of `away` in P less the corner of Q
    first, other = _PAIRS
    pairs = _dot(away[first], away[other]) * np.where(first == other, 1.0, 2.0)[:, None]
    pairs[0] -= axis_length**2
    halves = []
    for second, leg in enumerate((-axis_in, axis_out)):
        own = shares[(u > 0.5) == second]
        terms = [own[:, first] * own[:, other] @ pairs, *(2.0 * own @ _dot(one, away) for one in (leg, bend))]
        terms += [_dot(leg, leg), 2.0 * _dot(leg, bend), _dot(bend, bend)]
        every = np.stack([np.broadcast_to(term, terms[0].shape) for term in terms]) / (2.0 * axis_length)
        powers = (_PRODUCTS @ every.reshape(6, -1)).reshape(7, *every.shape[1:])
        halves.append(_Excess(powers, bool(second), axis_length))

    # the paper solves (21) in the knot interval of u, n = 3 or 4: so both are ½ together
    v, missing = np.empty((2, len(u), len(lever)))
    last, before = np.zeros(len(lever)), 0.0
    for half in halves:
        own = (u > 0.5) == half.second
        found = _in_turn(half, u[own], last, before)
        v[own], missing[own] = found, half.missing(found)
        if len(found):
            last, before = found[-1], u[own][-1]
    return v.T, missing.T


def _dot(one: Floats, other: Floats) -> Floats:
    """Products of columns (..., 3, g)."""
    return (one * other).sum(axis=-2)


def _in_turn(half: _Excess, u: Floats, last: Floats, before: float) -> Floats:
    """(m, g) v: the root is followed from one parameter to the next, from `last` (g,) on."""
    v = np.full((len(u), len(last)), 0.5)
    low, high = float(half.second) / 2.0, (1.0 + half.second) / 2.0
    for j, step in enumerate(np.diff(u, prepend=before)):
        if u[j] != 0.5:
            low_limit, target = np.maximum(last, low), np.clip(last + step, low, high)
            excess = replace(half, powers=half.powers[:, j])
            v[j] = _near(low_limit, high, target, excess)
            left = np.flatnonzero(np.isnan(v[j]))
            if len(left):
                excess = replace(excess, powers=excess.powers[:, left])
                own = _GRID[slice(*np.searchsorted(_GRID, (low, high + _NO_STEP)))]
                v[j, left] = _follow(own, excess, low_limit[left], target[left])
        last = v[j]
    return v


def _near(low_limit: Floats, high: float, target: Floats, excess: _Excess) -> Floats:
    """Roots that Newton finds near the targets, where the excess only rises or falls in between; NaN for none."""
    found, rows = np.full(len(target), np.nan), np.arange(len(target))
    here, sign = target, np.zeros(len(target))
    for number in range(_NEAR_STEPS):
        value, slope, _ = excess(here, rows)
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


def _follow(grid: Floats, excess: _Excess, low_limit: Floats, target: Floats) -> Floats:
    """One step of the branch: the root at or above `low_limit` nearest to `target`, else the smallest excess."""
    # the cell of the grid that holds the limit counts from the limit on
    each = np.arange(len(target))
    at_limit = excess(low_limit)[0]
    values = np.where(low_limit[:, None] > grid, at_limit[:, None], excess.on(grid))
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
        (value, slope, bend), root, sign = excess(v, rows), has_root[rows], side[rows]
        return np.where(root, -sign * value, sign * slope), np.where(root, -sign * slope, sign * bend)

    found = _zero(ends, start, wanted)
    between = np.flatnonzero(~has_root & (side * excess(found)[0] < 0.0))  # two roots in a cell of the grid
    if len(between):
        first, middle = target[between] <= found[between], found[between]
        ends = np.where(first, ends[0][between], middle), np.where(first, middle, ends[1][between])
        has_root[between], side[between] = True, np.where(first, side[between], -side[between])
        found[between] = _zero(ends, target[between], lambda v, rows: wanted(v, between[rows]))
    # an exact root at the limit, as at the two ends of a well synchronised corner, is kept exactly
    kept = has_root & (np.abs(at_limit) <= 1e-12) & (np.abs(target - low_limit) <= np.abs(target - found))
    found = np.where(kept, low_limit, found)
    worse = ~has_root & (np.abs(values[each, best]) < np.abs(excess(found)[0]))
    return np.where(worse, parameters[each, best], found)


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
