"""Halves of five-point curves as rational cubics: points, arc length, curvature, and the way back from arc length.

On each half of its parameter range the curve is one rational Bézier cubic (Boehm's knot insertion at u = ½). Written in
powers of t ∈ [0, 1] it is evaluated by Horner's rule, every curve at parameters of its own. Coordinates are relative to
the corner, so that short transitions far from the origin keep their digits.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb

import numpy as np

from cornersmooth.feedrate.limits import Limits
from cornersmooth.geometry import nurbs
from cornersmooth.model import Bools, Corners, Floats, Ints, Program
from cornersmooth.vectors import norm

#: tip lengths up to this are no motion of the tip, mm
STANDSTILL = 1e-7

#: curves worked on at once: their intermediate arrays fit the processor's cache
TOGETHER = 512

#: Bernstein coefficients of the five basis functions on the first half: Bézier point j is Σ w_i·P_i·_TO_BEZIER[j, i]
_TO_BEZIER = np.array([[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0.25, 0.5, 0.25, 0]])
_CUBIC = np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]], np.float64)
_FIRST = _CUBIC @ _TO_BEZIER
_SECOND = _CUBIC @ _TO_BEZIER[::-1, ::-1]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS

#: intervals of a half over which lengths are summed and curvature is bounded; shorter towards u = ½, where the curve
#: turns most
INTERVALS = 12
_PROGRESS = 1.0 - np.linspace(1.0, 0.0, INTERVALS + 1) ** 1.7
_NEWTON_STEPS = 3
#: points among which the slowest of a curve is searched for, rounds of closer search, and the least share of the curve
#: over which a slow point may be felt
_SEARCHED, _ROUNDS, _LEAST_FELT = 25, 4, 1e-6
#: parameter beside an end at which the tangent is taken where there is none at the end itself
_BESIDE = 1e-3
#: a radius of curvature below this is a cusp and is passed with the speed for this radius, mm
SMALLEST_RADIUS = 1e-6
#: samples of the curvature per interval, and rounds of closer sampling where it is largest
_SAMPLES = 4
_CLOSER = 3


def half_curves(points: Floats, weights: Floats, half: Ints) -> Floats:
    """Powers of t of w·P and w on one half each.

    Parameters
    ----------
    points : (g, 5, 3) float64
    weights : (g, 2) float64
    half : (g,) int64
        0 for u ≤ ½, 1 for u ≥ ½; t runs with u on both.

    Returns
    -------
    (g, 4, 4) float64
        ``[:, k]`` belongs to t^k; the last of the four coordinates is w.
    """
    w = nurbs.full_weights(weights)[..., None]
    weighted = np.concatenate((points * w, w), axis=-1)
    powers: Floats = np.where(half[:, None, None] == 0, _FIRST @ weighted, _SECOND @ weighted)
    return powers


def polynomial(points: Floats, weights: Floats | None = None) -> Floats:
    """Powers of t (g, d + 1, 4), as in `half_curves`, of curves of degree d.

    Parameters
    ----------
    points : (g, d + 1, 3) float64
        Bézier points.
    weights : (g, d + 1) float64, optional
        All 1 by default.
    """
    convert = _to_powers(points.shape[1] - 1)
    powers = np.zeros((*points.shape[:2], 4))
    if weights is None:
        powers[:, :, :3] = convert @ points
        powers[:, 0, 3] = 1.0
        return powers
    powers[:, :, :3] = convert @ (points * weights[..., None])
    powers[:, :, 3] = weights @ convert.T
    return powers


@cache
def _to_powers(degree: int) -> Floats:
    """(d + 1, d + 1) coefficients of t^k in the Bernstein polynomials of a degree."""
    return np.array(
        [
            [(-1) ** (k + i) * comb(degree, k) * comb(k, i) if i <= k else 0 for i in range(degree + 1)]
            for k in range(degree + 1)
        ],
        np.float64,
    )


def corner_halves(
    program: Program, corners: Corners, rows: Ints, half: Ints, axis_length: float
) -> tuple[Floats, Floats]:
    """`half_curves` of the tip and of the axis point of some corners, relative to the corner's tip."""
    tip_curve, axis_curve = nurbs.control_points(program, corners, rows, axis_length)
    origin = program.tip[corners.pose[rows]][:, None, :]
    weights = corners.weights[rows]
    return half_curves(tip_curve - origin, weights, half), half_curves(axis_curve - origin, weights, half)


def evaluate(powers: Floats, t: Floats) -> Floats:
    """(g, m, 3) points at the parameters t (g, m)."""
    return np.moveaxis(_derivatives(powers, t, 0)[0], 0, -1)


def end_tangents(powers: Floats) -> Floats:
    """Unit tangents (2, g, 3) at t = 0 and t = 1; where the curve comes to a stand there, a little inside of it."""
    found = np.zeros((2, len(powers), 3))
    for side, places in enumerate(((0.0, _BESIDE), (1.0, 1.0 - _BESIDE))):
        slopes = [np.moveaxis(_derivatives(powers, np.full((len(powers), 1), t), 1)[1], 0, -1)[:, 0] for t in places]
        own, inside = (norm(slope)[:, None] for slope in slopes)
        found[side] = np.where(own > _BESIDE * inside, slopes[0], slopes[1])
        found[side] /= np.maximum(norm(found[side]), np.finfo(np.float64).tiny)[:, None]
    return found


def _derivatives(powers: Floats, t: Floats, order: int) -> list[Floats]:
    """Point and derivatives by t up to `order`, (3, g, m) each: coordinates first, so that arrays run along t."""
    by_coordinate = powers.transpose(2, 1, 0)[..., None]  # (4, power, g, 1)
    factor = np.ones(powers.shape[1])
    plain = []
    rational = bool(by_coordinate[3, 1:].any())
    if not rational:  # w is 1 throughout
        by_coordinate = by_coordinate[:3]
    for derivative in range(order + 1):
        if derivative:
            factor = factor[1:] * np.arange(1, len(factor))
            by_coordinate = by_coordinate[:, 1:]
        value = by_coordinate[:, -1] * factor[-1]
        for k in range(len(factor) - 2, -1, -1):
            value = value * t + by_coordinate[:, k] * factor[k]
        plain.append(np.broadcast_to(value, (len(value), *t.shape)))
    if not rational:
        return plain
    w = plain[0][3]
    point = plain[0][:3] / w
    found = [point]
    if order > 0:
        found.append((plain[1][:3] - plain[1][3] * point) / w)
    if order > 1:
        found.append((plain[2][:3] - 2.0 * plain[1][3] * found[1] - plain[2][3] * point) / w)
    return found


def _size(vectors: Floats) -> Floats:
    """Length of vectors whose coordinates come first."""
    size: Floats = np.sqrt(vectors[0] ** 2 + vectors[1] ** 2 + vectors[2] ** 2)
    return size


def interval_borders(half: Ints) -> Floats:
    """(g, INTERVALS + 1) parameters t that divide the halves, dense towards u = ½."""
    borders: Floats = np.where(half[:, None] == 0, _PROGRESS, 1.0 - _PROGRESS[::-1])
    borders[half > 1] = np.linspace(0.0, 1.0, INTERVALS + 1)  # a cubic that is no half of a transition
    return borders


def interval_lengths(powers: Floats, borders: Floats) -> Floats:
    """Arc lengths (g, p) between neighbouring parameters `borders` (g, p + 1), by Gauss-Legendre with 5 points."""
    return _lengths(powers, borders[:, :-1], np.diff(borders, axis=1))


def _lengths(powers: Floats, low: Floats, step: Floats) -> Floats:
    """Arc lengths (g, p) from the parameters `low` to `low` + `step`."""
    g, p = low.shape
    t = low[..., None] + step[..., None] * _NODES
    speed = _size(_derivatives(powers, t.reshape(g, p * len(_NODES)), 1)[1]).reshape(g, p, len(_NODES))
    lengths: Floats = np.einsum("gpn,n->gp", speed, _WEIGHTS) * step
    return lengths


def lengths_before(powers: Floats, half: Ints, t: Floats) -> Floats:
    """Arc lengths (g, q) from the start of halves to parameters t (g, q), of which `parameters_at` is the inverse.

    Where the tip all but stands the quadrature misses a little, here and there alike.
    """
    borders = interval_borders(half)
    lengths = np.concatenate((np.zeros((len(powers), 1)), np.cumsum(interval_lengths(powers, borders), axis=1)), axis=1)
    interval = np.clip((borders[:, None, :] <= t[..., None]).sum(axis=2) - 1, 0, INTERVALS - 1)
    low = np.take_along_axis(borders, interval, axis=1)
    return np.take_along_axis(lengths, interval, axis=1) + _lengths(powers, low, t - low)


def interval_curvatures(powers: Floats, borders: Floats) -> Floats:
    """Upper ends of the curvature (g, p) between neighbouring parameters, 1/mm.

    Sampled, and sampled again ever more closely around the largest sample.
    """
    g, p = len(powers), borders.shape[1] - 1
    inner = np.linspace(0.0, 1.0, _SAMPLES + 1)[:-1]
    step = np.diff(borders, axis=1)
    t = np.concatenate(
        ((borders[:, :-1, None] + step[..., None] * inner).reshape(g, p * _SAMPLES), borders[:, -1:]), axis=1
    )
    kappa = curvature(powers, t)
    of_piece = np.arange(p)[:, None] * _SAMPLES + np.arange(_SAMPLES + 1)
    largest = kappa[:, of_piece].max(axis=2)
    rows = np.arange(g)
    best = kappa.argmax(axis=1)
    low, high = t[rows, np.maximum(best - 1, 0)], t[rows, np.minimum(best + 1, t.shape[1] - 1)]
    part = np.linspace(0.0, 1.0, 9)
    for _ in range(_CLOSER):
        near = low[:, None] + (high - low)[:, None] * part
        kappa = curvature(powers, near)
        at = kappa.argmax(axis=1)
        interval = np.clip((borders <= near[rows, at][:, None]).sum(axis=1) - 1, 0, p - 1)
        largest[rows, interval] = np.maximum(largest[rows, interval], kappa[rows, at])
        low, high = near[rows, np.maximum(at - 1, 0)], near[rows, np.minimum(at + 1, 8)]
    found: Floats = largest
    return found


def slowest(powers: Floats) -> tuple[Floats, Floats, Floats]:
    """Where curves are slowest by their parameter, that speed (mm), and the share over which it is felt, (g, 2) each.

    The square of the speed of a cubic has up to two minima; where there is one, both columns are the same. Sampled, and
    sampled again ever more closely.
    """
    g = len(powers)
    t = np.broadcast_to(np.linspace(0.0, 1.0, _SEARCHED), (g, _SEARCHED))
    speed = np.broadcast_to(_size(_derivatives(powers, t, 1)[1]), t.shape)
    wide = np.concatenate((speed[:, :1], speed, speed[:, -1:]), axis=1)
    smallest = np.where((speed <= wide[:, :-2]) & (speed <= wide[:, 2:]), speed, np.inf)
    both = np.argsort(smallest, axis=1, kind="stable")[:, :2]
    rows = np.arange(g)
    both[:, 1] = np.where(np.isfinite(smallest[rows, both[:, 1]]), both[:, 1], both[:, 0])
    places, speeds, shares = np.zeros((g, 2)), np.zeros((g, 2)), np.zeros((g, 2))
    for column, at in enumerate(both.T):
        low, high = t[rows, np.maximum(at - 1, 0)], t[rows, np.minimum(at + 1, _SEARCHED - 1)]
        for _ in range(_ROUNDS):
            near = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, 9)
            _, d1, d2 = _derivatives(powers, near, 2)
            speed = np.broadcast_to(_size(d1), near.shape)
            at = speed.argmin(axis=1)
            low, high = near[rows, np.maximum(at - 1, 0)], near[rows, np.minimum(at + 1, 8)]
        least, bend = speed[rows, at], np.broadcast_to(_size(d2), near.shape)[rows, at]
        places[:, column], speeds[:, column] = near[rows, at], least
        felt = least / np.maximum(bend, np.maximum(least, np.finfo(np.float64).tiny))
        shares[:, column] = np.clip(felt, _LEAST_FELT, 1.0)
    return places, speeds, shares


def curvature(powers: Floats, t: Floats) -> Floats:
    """Curvature (g, m) at the parameters t (g, m), 1/mm; 0 where the curve is straight up to rounding."""
    _, d1, d2 = _derivatives(powers, t, 2)
    across = _size(np.cross(d1, d2, axis=0))
    speed = _size(d1)
    straight = across <= 1e-12 * speed * _size(d2)
    kappa: Floats = np.where(straight, 0.0, across / np.where(straight, 1.0, speed**3))
    return kappa


def _turns_back(powers: Floats, borders: Floats) -> Bools:
    """(g, p) bool: intervals on which the curve turns by more than a right angle."""
    _, d1 = _derivatives(powers, borders, 1)
    back: Bools = (d1[:, :, 1:] * d1[:, :, :-1]).sum(axis=0) < 0.0
    return back


def parameters_at(powers: Floats, half: Ints, which: Ints, distance: Floats) -> Floats:
    """Parameters t (q,) at arc length `distance` (q,) from the start of the halves `which` (q,)."""
    borders = interval_borders(half)
    lengths = np.concatenate((np.zeros((len(powers), 1)), np.cumsum(interval_lengths(powers, borders), axis=1)), axis=1)
    interval = np.clip((lengths[which] <= distance[:, None]).sum(axis=1) - 1, 0, INTERVALS - 1)
    low, high = borders[which, interval], borders[which, interval + 1]
    missing = distance - lengths[which, interval]
    whole = np.maximum(lengths[which, interval + 1] - lengths[which, interval], np.finfo(np.float64).tiny)
    t = low + (high - low) * np.clip(missing / whole, 0.0, 1.0)
    curves = powers[which]
    for _ in range(_NEWTON_STEPS):
        gone = interval_lengths(curves, np.stack((low, t), axis=1))[:, 0]
        speed = _size(_derivatives(curves, t[:, None], 1)[1])[:, 0]
        t = np.clip(t + (missing - gone) / np.maximum(speed, np.finfo(np.float64).tiny), low, high)
    found: Floats = t
    return found


def half_lengths(program: Program, corners: Corners, axis_length: float) -> tuple[Floats, Floats]:
    """Tip lengths (2, k) of the two halves of every smoothed corner, mm, and angles of the axis over them, rad.

    The angle is only worked out where the tip stands still.
    """
    lengths, angles = np.zeros((2, len(corners))), np.zeros((2, len(corners)))
    for rows in _groups(np.flatnonzero(corners.smoothed)):
        for side in range(2):
            half = np.full(len(rows), side)
            tip, axis_point = corner_halves(program, corners, rows, half, axis_length)
            lengths[side, rows] = interval_lengths(tip, interval_borders(half)).sum(axis=1)
            still = np.flatnonzero(
                ~(corners.trim_in[rows] + corners.trim_out[rows] > 0.0) | (lengths[side, rows] <= STANDSTILL)
            )
            angles[side, rows[still]] = turned_angle(tip[still], axis_point[still], half[still])
    return lengths, angles


def turned_angle(tip: Floats, axis_point: Floats, half: Ints) -> Floats:
    """Angle (g,) that the axis sweeps over each half, rad."""
    axis = axis_vectors(tip, axis_point, interval_borders(half))
    step = norm(np.diff(axis, axis=1))
    swept: Floats = (2.0 * np.arcsin(np.minimum(0.5 * step, 1.0))).sum(axis=1)
    return swept


def axis_vectors(tip: Floats, axis_point: Floats, t: Floats) -> Floats:
    """Unit vectors (g, m, 3) from the tip curves to the axis-point curves at equal parameters t (g, m)."""
    lever = evaluate(axis_point, t) - evaluate(tip, t)
    unit: Floats = lever / norm(lever)[..., None]
    return unit


def curvature_limits(
    curves: Callable[[Ints], tuple[Floats, Ints]], speed: Floats, limits: Limits
) -> tuple[Ints, Floats, Floats]:
    """Where curvature asks for less than the feed.

    Parameters
    ----------
    curves : callable
        Powers of the tip's curves and which halves they are, for some of g curves.
    speed : (g,) float64, mm/s

    Returns
    -------
    which : (b,) int64
        The curves that are slowed down, ascending.
    share : (b, INTERVALS) float64
        Parts of their length.
    cap : (b, INTERVALS) float64, (mm/s)²
        v² at most, per part.
    """
    which, shares, bounds = [], [], []
    for group in _groups(np.arange(len(speed))):
        tip, half = curves(group)
        borders = interval_borders(half)
        # a look at the borders alone leaves few curves that need the careful one
        rough = curvature(tip, borders).max(axis=1)
        turning_back = _turns_back(tip, borders)
        slowed = np.flatnonzero((2.0 * rough * speed[group] ** 2 > limits.centripetal_accel) | turning_back.any(axis=1))
        if not len(slowed):
            continue
        tip, borders = tip[slowed], borders[slowed]
        kappa, share = interval_curvatures(tip, borders), interval_lengths(tip, borders)
        # a interval that turns back must be bent by that much; where no sample shows it, it is a cusp
        cusp = turning_back[slowed] & (kappa * share < 1.0)
        kappa = np.where(cusp, np.inf, kappa)
        fastest = speed[group[slowed], None] ** 2
        kappa = np.clip(kappa, limits.centripetal_accel / fastest, 1.0 / SMALLEST_RADIUS)
        which.append(group[slowed])
        shares.append(share)
        bounds.append(np.minimum(limits.centripetal_accel / kappa, fastest))
    if not which:
        return np.zeros(0, np.int64), np.zeros((0, INTERVALS)), np.zeros((0, INTERVALS))
    return np.concatenate(which), np.concatenate(shares), np.concatenate(bounds)


def _groups(rows: Ints) -> list[Ints]:
    return [rows[at : at + TOGETHER] for at in range(0, len(rows), TOGETHER)]
