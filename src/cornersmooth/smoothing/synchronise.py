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

from cornersmooth.arrays.vectors import angle_between
from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats, Ints

#: parameters of the tip curve at which residual and jumps are reported
REPORT_PARAMETERS = np.linspace(0.0, 1.0, 9)

#: what is zero where something is looked for, and its derivative, at parameters of rows
_Wanted = Callable[[Floats, Ints], tuple[Floats, Floats]]

_GRID = np.linspace(0.0, 1.0, 33)

#: an excess that is none, mm; steps of a parameter that are none; steps of Newton, or halves where these lead outside
_NO_EXCESS, _NO_STEP, _STEPS = 1e-13, 1e-12, 60

#: how far from where it is expected a root is looked for without the grid, and in how many steps of Newton
_NEAR, _NEAR_STEPS, _SHORT = 1.0 / 16.0, 4, 1e-7

#: shares of the control points in weight, σ and β of the first half
_OF_SHARES = np.array([[1.0, 1, 1, 1, 1], [1, nurbs.RATIO, 0, -nurbs.RATIO, 0], [0, 0, 0, nurbs.RATIO, 0]])

#: Bézier points of the first half of the five-point curve, and the powers of their cubic
_HALF = np.array([[4.0, 0, 0, 0, 0], [0, 4, 0, 0, 0], [0, 2, 2, 0, 0], [0, 1, 2, 1, 0]]) / 4.0
_POWERS = np.array([[1.0, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) @ _HALF


@dataclass(frozen=True)
class _Excess:
    """``(|Q(v) − P|² − H²) / 2H`` of g corners and points P in one half of v: zero where ``|Q(v) − P|`` is H.

    With σ and β as in `cornersmooth.geometry.nurbs`, Q(v) is σ·l + β·d from the corner, so this is a form in σ and β.
    """

    terms: Floats  # (6, g): of 1, σ, β, σ², σβ and β²
    powers: Floats  # (3, 4): weight, and σ and β times weight, in powers of s
    paper: bool  # all weights are 1: then σ is 1 − s, and β is s³/6
    second: bool  # half, in which s runs from the end of the curve to its middle
    axis_length: float

    def __call__(self, v: Floats, rows: Ints) -> tuple[Floats, Floats]:
        """Equation (21) as a length, mm, and its derivative, at parameters (k,) of the curves of rows."""
        return self._derivatives(v, np.take(self.terms, rows, axis=1), bends=False)[:2]

    def bends(self, v: Floats, rows: Ints) -> tuple[Floats, Floats]:
        """First and second derivative."""
        return self._derivatives(v, np.take(self.terms, rows, axis=1), bends=True)[1:]

    def on(self, grid: Floats) -> Floats:
        """(g, m) the excess at common parameters (m,)."""
        s = 2.0 * (1.0 - grid if self.second else grid)
        weight, sigma, beta = self.powers @ s ** np.arange(4)[:, None]
        sigma, beta = sigma / weight, beta / weight
        return self.terms.T @ np.stack((sigma**0, sigma, beta, sigma**2, sigma * beta, beta**2))

    def missing(self, v: Floats) -> Floats:
        """``||Q(v) − P| − H|``, mm."""
        squared = self.axis_length * (self.axis_length + 2.0 * self._derivatives(v, self.terms, bends=False)[0])
        return np.abs(np.sqrt(np.maximum(squared, 0.0)) - self.axis_length)

    def only_roots(self, v: Floats) -> Floats:
        """(m, g) roots, or the end that comes nearest to one, where the excess surely never turns; NaN elsewhere.

        It is a polynomial p of degree 6 in s then. Newton starts from the parameters (m,).
        """
        if not self.paper:
            return np.full(self.terms.shape[1:], np.nan)
        one, c_s, c_b, c_ss, c_sb, c_bb = self.terms
        of_beta = nurbs.RATIO / 4.0
        p0, p1, p2 = one + c_s + c_ss, -c_s - 2.0 * c_ss, c_ss
        p3, p4, p6 = of_beta * (c_b + c_sb), -of_beta * c_sb, of_beta**2 * c_bb
        least = p1 + np.minimum(3.0 * p3, 0.0) + np.minimum(4.0 * p4, 0.0)
        most = p1 + 2.0 * p2 + np.maximum(3.0 * p3, 0.0) + np.maximum(4.0 * p4, 0.0) + 6.0 * p6
        turns = (least <= 0.0) & (most >= 0.0)
        here = np.broadcast_to(2.0 * (1.0 - v if self.second else v)[:, None], p0.shape)
        for _ in range(_NEAR_STEPS):
            tail = p4 + here * here * p6
            value = p0 + here * (p1 + here * (p2 + here * (p3 + here * tail)))
            slope = p1 + here * (2.0 * p2 + here * (3.0 * p3 + here * (4.0 * tail + 2.0 * here * here * p6)))
            last, here = here, np.clip(here - value / np.where(turns, 1.0, slope), 0.0, 1.0)
        near = ~turns & (np.abs(here - last) <= _SHORT)
        return np.where(near, 1.0 - here / 2.0 if self.second else here / 2.0, np.nan)

    def _derivatives(self, v: Floats, terms: Floats, *, bends: bool) -> tuple[Floats, Floats, Floats]:
        one, c_s, c_b, c_ss, c_sb, c_bb = terms
        s, turned = (2.0 - 2.0 * v, -2.0) if self.second else (2.0 * v, 2.0)
        (sigma, d_sigma, s2), (beta, d_beta, b2) = self._shares(s)
        mixed = c_sb * beta
        by_sigma, by_beta = c_s + mixed + 2.0 * c_ss * sigma, c_b + c_sb * sigma + 2.0 * c_bb * beta
        value = one + sigma * (c_s + mixed + c_ss * sigma) + beta * (c_b + c_bb * beta)
        slope = by_sigma * d_sigma + by_beta * d_beta
        bend = slope
        if bends:
            bend = by_sigma * s2 + by_beta * b2
            bend += 2.0 * (c_ss * d_sigma**2 + c_sb * d_sigma * d_beta + c_bb * d_beta**2)
        return value, turned * slope, 4.0 * bend

    def _shares(self, s: Floats) -> tuple[tuple[Floats, Floats | float, Floats | float], tuple[Floats, Floats, Floats]]:
        """Values and first two derivatives by s of σ and β."""
        if self.paper:
            of_beta = nurbs.RATIO / 4.0 * s
            return (1.0 - s, -1.0, 0.0), (of_beta * s * s, 3.0 * of_beta * s, 6.0 * of_beta)
        (w, w1, w2), *both = (
            (((p3 * s + p2) * s + p1) * s + p0, (3.0 * p3 * s + 2.0 * p2) * s + p1, 6.0 * p3 * s + 2.0 * p2)
            for p0, p1, p2, p3 in self.powers
        )
        values = [value / w for value, *_ in both]
        rates = [(rate - value * w1) / w for value, (_, rate, _) in zip(values, both, strict=True)]
        bends = [(n[2] - value * w2 - 2.0 * rate * w1) / w for value, rate, n in zip(values, rates, both, strict=True)]
        sigma, beta = zip(values, rates, bends, strict=True)
        return sigma, beta


def _dot(one: Floats, other: Floats) -> Floats:
    return np.einsum("ck,ck->k", one, other)


def matching_parameters(
    tip_curve: Floats, axis_curve: Floats, weights: Floats, u: Floats, axis_length: float
) -> tuple[Floats, Floats]:
    """Parameters v(u) (g, m) with |Q(v) − P(u)| = H as nearly as possible, never decreasing, and what is missing, mm.

    Equations (20) and (21).
    Control points (g, 5, 3) are those of P and Q; weights (2,) are those of all, u (m,) ascends.
    """
    lever = axis_curve[:, 2] - tip_curve[:, 2]
    legs = [(curve[:, 2] - curve[:, 0], curve[:, 4] - curve[:, 2]) for curve in (tip_curve, axis_curve)]
    return synchronised(legs[0], legs[1], lever, weights, u, axis_length)


def synchronised(
    tip_legs: tuple[Floats, Floats],
    axis_legs: tuple[Floats, Floats],
    lever: Floats,
    weights: Floats,
    u: Floats,
    axis_length: float,
) -> tuple[Floats, Floats]:
    """`matching_parameters` of curves by their legs in and out, and by levers at the corners, (g, 3) each."""
    lever, *legs = (np.ascontiguousarray(values.T) for values in (lever, *tip_legs, *axis_legs))
    bend, away, paper = legs[3] - legs[2], (lever, legs[0], legs[1]), bool((weights == 1.0).all())
    shares = nurbs.leg_coefficients(u, weights) * (1.0, -1.0, -1.0)  # of `away` in P less the corner of Q
    first, other = np.triu_indices(3)
    pairs = np.stack([_dot(away[i], away[j]) for i, j in zip(first, other, strict=True)])
    pairs[0] -= axis_length**2
    powers = (nurbs.full_weights(weights) * _OF_SHARES) @ _POWERS.T
    halves = []
    for second, leg in enumerate((-legs[2], legs[3])):
        own = shares[(u > 0.5) == second]
        squares = own[:, first] * own[:, other] * np.where(first == other, 1.0, 2.0) @ pairs
        terms = (squares, *(2.0 * own @ np.stack([_dot(one, part) for part in away]) for one in (leg, bend)))
        terms += _dot(leg, leg), 2.0 * _dot(leg, bend), _dot(bend, bend)
        every = np.stack([np.broadcast_to(term, squares.shape) for term in terms]) / (2.0 * axis_length)
        halves.append(_Excess(every, powers, paper, bool(second), axis_length))

    # the paper solves (21) in the knot interval of u, n = 3 or 4: so both are ½ together
    v, missing = np.empty((2, len(u), lever.shape[1]))
    last, before = np.zeros(lever.shape[1]), 0.0
    for half in halves:
        own = (u > 0.5) == half.second
        found = half.only_roots(u[own])
        found[u[own] == 0.5] = 0.5
        found = np.maximum.accumulate(found, axis=0)
        rows = np.flatnonzero(np.isnan(found[-1:]).any(axis=0))
        if len(rows):
            found[:, rows] = _in_turn(replace(half, terms=half.terms[..., rows]), u[own], last[rows], before)
        v[own], missing[own] = found, half.missing(found)
        if len(found):
            last, before = found[-1], u[own][-1]
    return v.T, missing.T


def _in_turn(half: _Excess, u: Floats, last: Floats, before: float) -> Floats:
    """(m, g) v where the excess may turn: the root is followed from one parameter to the next, from `last` (g,) on."""
    v = np.full((len(u), len(last)), 0.5)
    low, high = float(half.second) / 2.0, (1.0 + half.second) / 2.0
    for j, step in enumerate(np.diff(u, prepend=before)):
        if u[j] != 0.5:
            low_limit, target = np.maximum(last, low), np.clip(last + step, low, high)
            excess = replace(half, terms=half.terms[:, j])
            v[j] = _near(low_limit, high, target, excess)
            left = np.flatnonzero(np.isnan(v[j]))
            if len(left):
                excess = replace(excess, terms=excess.terms[:, left])
                own = _GRID[slice(*np.searchsorted(_GRID, (low, high + _NO_STEP)))]
                v[j, left] = _follow(own, excess.on(own), low_limit[left], target[left], excess)
        last = v[j]
    return v


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


def _follow(grid: Floats, values: Floats, low_limit: Floats, target: Floats, excess: _Excess) -> Floats:
    """One step of the branch: the root at or above `low_limit` nearest to `target`, else the smallest excess.

    `values` (g, m) are the excess on the grid (m,).
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
    v, residual = synchronised(tip_legs, axis_legs, lever, weights, u, axis_length)
    half = len(u) // 2
    of_tip, of_axis = (nurbs.leg_coefficients(at, weights)[..., 1:] for at in (u[[0, half, -1]], v[:, [0, half, -1]]))
    tips, axes = of_tip @ np.stack(tip_legs, axis=1), of_axis @ np.stack(axis_legs, axis=1)
    levers = lever[:, None] + axes - tips
    before, after = lever - axis_legs[0] + tip_legs[0], lever + axis_legs[1] - tip_legs[1]
    jumps = (angle_between(one, levers[:, at]) for one, at in ((before, 0), (after, 2)))
    return v, residual.max(axis=1), *jumps, angle_between(levers[:, 1], lever)
