"""`shape="auto"`: the weight of the corner's control point from the turn (docs/shape.md).

With weights (1, 1, w2, 1, 1) a smaller w2 makes the curve rounder in the middle: less curvature at u = ½, more towards
its ends, and a shorter transition for the same deviation. For equal legs and a turn 2β the jerk at unit speed,
max sqrt(κ′² + κ⁴), is smallest at w2 ≈ 1 − (1 − cos β)(1 + cos^2.5 β), whether ε or the segments set the length. With
unequal legs the curve turns most off its middle and the gain is lost: the weight goes back to 1 as the shorter leg
comes near half of the longer.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.settings import WEIGHT_DECIMALS
from cornersmooth.smoothing.legs import Legs
from cornersmooth.vectors import dot, square

_POWER = 2.5

#: ratios of the tip legs between which the weight goes from 1 to that of equal legs
_UNEQUAL, _EQUAL = 0.55, 0.85

#: weights this near to 1 are 1: they gain less than a hundredth of the speed, and the polynomial curve is quicker
_NEAR_ONE = 0.01

#: smallest weight; reached by turns that stay sharp
_SMALLEST = 0.05


def corner_weight(legs: Legs) -> Floats:
    """Weight w2 of the third control point: (g,) in [0.05, 1] with the decimals that controls keep; w1 is 1.

    It is the larger of what suits the tip curve and what suits the axis-point curve, so that neither is worse off than
    with all weights 1.
    """
    axis_in, axis_out = legs.tip_in + legs.turn_in, legs.tip_out + legs.turn_out
    tip = square(legs.tip_in), square(legs.tip_out)
    axis = square(axis_in), square(axis_out)
    # legs of the transition are in proportion to D/m(D)
    size = tip[0] + axis[0], tip[1] + axis[1]
    weight = np.maximum(
        _weight(dot(legs.tip_in, legs.tip_out), *tip, *size), _weight(dot(axis_in, axis_out), *axis, *size)
    )
    weight[weight > 1.0 - _NEAR_ONE] = 1.0
    return np.round(np.maximum(weight, _SMALLEST), WEIGHT_DECIMALS).astype(np.float64)


def _weight(scalar: Floats, square_in: Floats, square_out: Floats, size_in: Floats, size_out: Floats) -> Floats:
    """Weight that suits one of the curves, from the products of its segments; 1 where a segment has no length."""
    product = np.sqrt(square_in * square_out)
    proper = product > 0.0
    cosine = np.divide(scalar, product, out=np.ones_like(scalar), where=proper)
    half = np.sqrt(np.clip(0.5 + 0.5 * cosine, 0.0, 1.0))  # cos β
    one, other = square_in * size_out, square_out * size_in
    ratio = np.sqrt(np.minimum(one, other) / np.where(proper, np.maximum(one, other), 1.0))
    share = np.clip((ratio - _UNEQUAL) / (_EQUAL - _UNEQUAL), 0.0, 1.0)
    weight: Floats = 1.0 - share * (1.0 - half) * (1.0 + half**_POWER)
    return weight
