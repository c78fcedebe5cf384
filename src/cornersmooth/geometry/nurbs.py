"""The five-point curve: a cubic B-spline on the knots {0, 0, 0, 0, ½, 1, 1, 1, 1}; the paper's NURBS with weights of 1.

Paper equations (3), (4) and (9). Each half is a Bézier cubic, and the second one mirrors the first. Seen from the
corner X, with the legs a from the first control point to X and b from X to the last, and inner ones at ρ = 2/3 of them,
in s = 2u of the first half:

    first half:   X − σ·a + β·(b − a),    σ = 1 − s,   β = ρ·s³/4
    second half:  X + σ·b + β·(b − a),    σ, β at the mirrored parameter

X − σ·a and X + σ·b are poses of the original motion, so β·(b − a) is the deviation at a common parameter; β is largest
at u = ½, where it is c = ρ/4 and σ = 0.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.model import Bools, Corners, Floats, Ints, Program

RATIO: Final = 2.0 / 3.0  #: distance of the second control point from the corner over that of the first

#: the factor c: equations (10) to (12) without the sine
DEVIATION: Final = RATIO / 4.0

#: control points (5,) in the points of the first half by powers of s = 2u: equation (4)
POWERS: Final = np.array([[4.0, 0, 0, 0, 0], [-12, 12, 0, 0, 0], [12, -18, 6, 0, 0], [-4, 7, -4, 1, 0]]) / 4.0


def basis(u: Floats, order: int = 0) -> Floats:
    """Polynomial basis (m, 5) at parameters (m,) in [0, 1], equation (4), or its first or second derivative."""
    second = np.asarray(u, np.float64) > 0.5
    factors = np.array([[1, 1, 1, 1], [0, 1, 2, 3], [0, 0, 2, 6]])[order, order:] * 2.0**order
    s = 2.0 * np.where(second, 1.0 - u, u)
    values = (s[..., None] ** np.arange(4 - order) * factors) @ POWERS[order:]
    return np.where(second[..., None], (-1.0) ** order * values[..., ::-1], values)


def leg_coefficients(u: Floats) -> Floats:
    """Coefficients (..., m, 3) of corner, incoming and outgoing leg in the points of curves at parameters (..., m)."""
    u = np.asarray(u, np.float64)
    second = u > 0.5
    s = 2.0 * np.where(second, 1.0 - u, u)
    beta = RATIO / 4.0 * s * s * s
    reach = 1.0 - s + beta
    return np.stack((np.ones_like(u), -np.where(second, beta, reach), np.where(second, reach, beta)), axis=-1)


def control_points(
    program: Program, corners: Corners, rows: Ints | Bools | slice, axis_length: float
) -> tuple[Floats, Floats]:
    """Control points (g, 5, 3) of the tip curve P and of the axis-point curve Q of some corners, mm: equation (9).

    Those of corners that are not smoothed are all at the corner.
    """
    poses = [column[rows] for column in (corners.pose, corners.before, corners.after)]
    curves, trims = [], (corners.trim_in, corners.trim_out, corners.axis_trim_in, corners.axis_trim_out)
    for height, (trim_in, trim_out) in ((0.0, trims[:2]), (axis_length, trims[2:])):
        corner, before, after = (program.tip.take(at, axis=0) + height * program.axis.take(at, axis=0) for at in poses)
        legs = (corner - before) * trim_in[rows][:, None], (after - corner) * trim_out[rows][:, None]
        curves.append(five_points(corner, *legs))
    return curves[0], curves[1]


def five_points(corner: Floats, leg_in: Floats, leg_out: Floats) -> Floats:
    """Control points (g, 5, 3) of corners and legs in and out (g, 3): equations (5) to (9)."""
    points = np.repeat(corner[:, None, :], 5, axis=1)
    points[:, 0] -= leg_in
    points[:, 1] -= RATIO * leg_in
    points[:, 3] += RATIO * leg_out
    points[:, 4] += leg_out
    return points


def evaluate(points: Floats, u: Floats) -> Floats:
    """Points (g, m, 3) of curves by equation (3): control points (g, 5, 3), parameters (m,) or (g, m)."""
    return basis(u) @ points


def derivatives(points: Floats, u: Floats) -> tuple[Floats, Floats, Floats]:
    """Points and first two derivatives by u, (g, m, 3) each, of curves (g, 5, 3) at common parameters (m,)."""
    return basis(u) @ points, basis(u, 1) @ points, basis(u, 2) @ points
