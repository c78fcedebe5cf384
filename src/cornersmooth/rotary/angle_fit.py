"""Control points of rotary angles on given knots and weights: fixed at the ends, least squares between them.

What is made small is the angle between the tool axes, not the error of the angles: near the pole the first angle may be
far off. Gauss and Newton's method starts from the exact angles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.geometry.nurbs import Refinement
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import angle_between, radians, rotate, tool_axis
from cornersmooth.model import Floats

#: Fitted at so many samples in each knot interval, measured at so many.
FIT_SAMPLES, MEASURE_SAMPLES = 6, 8
#: Linearisations.
ROUNDS = 3
#: How much an error of an angle counts by itself beside that of the axis: it only decides where the axis does not.
TAME = 1e-9
#: Control points at each end that value, first and second derivative determine.
FIXED = 3


@dataclass(frozen=True)
class Targets:
    """What g curves of axis directions have to follow."""

    levers: Floats  #: (g, 5, 3) control points of Q − P on the five-point knots
    weights: Floats  #: (g, 5)
    #: start, end: three (g, 2), degrees; angle and its first two derivatives with respect to u at u = 0, and those with
    #: respect to 1 − u at u = 1
    start: tuple[Floats, Floats, Floats]
    end: tuple[Floats, Floats, Floats]

    def axis(self, u: Floats) -> Floats:
        """Unit axes wanted at common parameters: (m,) -> (g, m, 3)."""
        pairs = self.weights[:, 1:3]
        same = len(pairs) and bool((pairs == pairs[0]).all())
        lever = nurbs.evaluate(self.levers, pairs[0] if same else pairs, u)
        axis: Floats = lever / np.sqrt(np.einsum("gmd,gmd->gm", lever, lever))[:, :, None]
        return axis


def leg_derivatives(weights: Floats, ratio: Floats) -> tuple[Floats, Floats]:
    """First and second derivative, at its start, of the share of the leg that a curve has passed: (g,) each."""
    slope, bend = _end_derivatives(np.stack((np.zeros_like(ratio), weights[:, 1] * (1 - ratio), weights[:, 2]), axis=1))
    weight_slope, _ = _end_derivatives(weights[:, :3])
    return slope, bend - 2 * weight_slope * slope


def end_points(refined: Refinement, targets: Targets) -> tuple[Floats, Floats]:
    """First three and last three angle control points (g, 3, 2) that give the values and derivatives at the ends."""
    weights = refined.homogeneous(targets.weights)
    ends = []
    for conditions, own, five in (
        (targets.start, weights[:, :FIXED], targets.weights[:, :3]),
        (targets.end, weights[:, : -FIXED - 1 : -1], targets.weights[:, :1:-1]),
    ):
        value, slope, bend = conditions
        weight_slope, weight_bend = (part[:, None] for part in _end_derivatives(five))
        first = weight_slope * value + slope  # of weight times angle, with the weight 1 at the end
        second = weight_bend * value + 2 * weight_slope * slope + bend
        step = 1.0 / refined.spans
        one = value + first * step / 3
        two = one + (first + second * step / 2) * 2 * step / 3
        ends.append(np.stack((value, one, two), axis=1) / own[:, :, None])
    return ends[0], ends[1][:, ::-1]


def fit(machine: Machine, refined: Refinement, targets: Targets, exact: Floats, samples: Floats) -> Floats:
    """Control points of the angles (g, p, 2), degrees, for p > 6.

    The angles `exact` (g, m, 2), continuous, give the wanted axes at the parameters `samples` (m,).
    """
    start, end = end_points(refined, targets)
    shares = refined.rational_basis(samples, refined.homogeneous(targets.weights))
    inner = shares[:, :, FIXED:-FIXED]
    given = shares[:, :, :FIXED] @ start + shares[:, :, -FIXED:] @ end
    wanted = targets.axis(samples)
    count = inner.shape[2]
    points = np.concatenate((start, np.zeros((len(start), count, 2)), end), axis=1)
    scale = np.radians(1.0) ** 2
    angles = exact
    for _ in range(ROUNDS):
        slopes = axis_derivatives(machine, angles)
        missing = wanted - tool_axis(machine, angles.reshape(-1, 2)).reshape(wanted.shape)
        metric = np.einsum("gmda,gmdb->gmab", slopes, slopes)
        aim = np.einsum("gmab,gmb->gma", metric, angles - given) + np.einsum("gmda,gmd->gma", slopes, missing)
        aim += TAME * scale * (exact - given)
        metric[:, :, (0, 1), (0, 1)] += TAME * scale
        transposed = inner.transpose(0, 2, 1)
        matrix = np.empty((len(start), 2, count, 2, count))
        for a, b in ((0, 0), (0, 1), (1, 1)):
            matrix[:, a, :, b] = transposed @ (inner * metric[:, :, a, b, None])
        matrix[:, 1, :, 0] = matrix[:, 0, :, 1]
        right = (transposed @ aim).transpose(0, 2, 1).reshape(len(start), 2 * count, 1)
        found = np.linalg.solve(matrix.reshape(len(start), 2 * count, 2 * count), right)
        points[:, FIXED:-FIXED] = found.reshape(len(start), 2, count).transpose(0, 2, 1)
        angles = shares @ points
    return points


def fit_samples(refined: Refinement) -> Floats:
    """Parameters at which curves are fitted."""
    count = FIT_SAMPLES * refined.spans
    return (np.arange(count) + 0.5) / count


def measured(machine: Machine, refined: Refinement, targets: Targets, points: Floats) -> tuple[Floats, Floats]:
    """Largest angle (g,) between the axis of the angles and the one wanted, and extremes of the angles, degrees.

    The extremes are (g, 2, 2) ``[curve, axis, lowest or highest]``.
    """
    samples = np.linspace(0.0, 1.0, MEASURE_SAMPLES * refined.spans + 1)
    angles = refined.rational_basis(samples, refined.homogeneous(targets.weights)) @ points
    axis = tool_axis(machine, angles.reshape(-1, 2)).reshape(*angles.shape[:2], 3)
    error = angle_between(axis, targets.axis(samples)).max(axis=1)
    return error, np.stack((angles.min(axis=1), angles.max(axis=1)), axis=2)


def axis_derivatives(machine: Machine, angles: Floats) -> Floats:
    """Derivatives of the tool axis with respect to both angles, per degree: (..., 2) -> (..., 3, 2)."""
    flat = angles.reshape(-1, 2)
    first, second = machine.axes
    axis = tool_axis(machine, flat)
    turned = rotate(first.unit, first.sign * radians(flat[:, 0]), second.unit[None, :])
    slopes: Floats = np.stack(
        (first.sign * np.cross(first.unit, axis), second.sign * np.cross(turned, axis)), axis=2
    ) * np.radians(1.0)
    shaped: Floats = slopes.reshape(*angles.shape[:-1], 3, 2)
    return shaped


def _end_derivatives(points: Floats) -> tuple[Floats, Floats]:
    """First two derivatives at u = 0 of the polynomial five-point curve from its first three points: (g, 3) -> (g,)."""
    one, two = 6 * (points[:, 1] - points[:, 0]), 3 * (points[:, 2] - points[:, 1])
    return one, 4 * (two - one)
