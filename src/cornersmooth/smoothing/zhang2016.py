"""`method="zhang2016"`: the paper as published (design 3.1)."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats, LimitedBy, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing import nurbs
from cornersmooth.smoothing.legs import Legs, Placed, divide, half_angle_cosine
from cornersmooth.smoothing.synchronise import synchronisation_report
from cornersmooth.vectors import dot, norm


def place_zhang2016(legs: Legs, weights: Floats, ratio: Floats, settings: Settings) -> Placed:
    """Trim tip and axis-point segments each on its own, as the paper does: equations (10), (15), (16) and (19).

    (16) and (19) give the curve with the larger sine the tolerance and the other one its share by the ratio of the
    sines; put into (15) that is one and the same length for both: 3(w1+w2)ε/(2·w1·max(sin α/2, sin β/2)).
    """
    axis_in, axis_out = legs.tip_in + legs.turn_in, legs.tip_out + legs.turn_out
    tip_lengths = norm(legs.tip_in), norm(legs.tip_out)
    axis_lengths = norm(axis_in), norm(axis_out)
    sine_tip = _half_turn_sine(legs.tip_in, legs.tip_out, *tip_lengths)
    sine_axis = _half_turn_sine(axis_in, axis_out, *axis_lengths)
    factor = 2.0 * nurbs.deviation_factor(weights, ratio)  # 2·w1/(3(w1+w2)) at the paper's ratio
    by_tolerance = divide(settings.tolerance, factor * np.maximum(sine_tip, sine_axis))
    tip_room, axis_room = np.minimum(*tip_lengths) / 2.0, np.minimum(*axis_lengths) / 2.0
    tip_length, axis_length = np.minimum(tip_room, by_tolerance), np.minimum(axis_room, by_tolerance)

    status = np.full(len(tip_length), Status.SMOOTHED, np.uint8)
    status[(sine_tip == 0.0) & (sine_axis == 0.0)] = Status.STRAIGHT
    # the six-dimensional turn, as for the proportional method
    scalar = dot(legs.tip_in, legs.tip_out) + dot(axis_in, axis_out)
    sizes = np.hypot(tip_lengths[0], axis_lengths[0]) * np.hypot(tip_lengths[1], axis_lengths[1])
    status[scalar < np.cos(np.radians(settings.reversal_angle)) * sizes] = Status.REVERSAL
    half_cosine = np.minimum(
        half_angle_cosine(legs.turn_in, settings.axis_length), half_angle_cosine(legs.turn_out, settings.axis_length)
    )
    status[half_cosine < np.cos(np.radians(settings.max_axis_step / 2.0)) - 1e-12] = Status.AXIS_STEP
    status[(status == Status.SMOOTHED) & (np.maximum(tip_length, axis_length) <= 4.0 * settings.tip_resolution)] = (
        Status.TOO_SHORT
    )
    smoothed = status == Status.SMOOTHED
    tip_length, axis_length = np.where(smoothed, tip_length, 0.0), np.where(smoothed, axis_length, 0.0)
    by_segment = (tip_length < by_tolerance) | (axis_length < by_tolerance)
    limited_by = np.where(by_segment, LimitedBy.SEGMENT, LimitedBy.TOLERANCE).astype(np.uint8)
    limited_by[~smoothed] = LimitedBy.NOTHING

    trims = [
        np.where(size > 0.0, length / np.where(size > 0.0, size, 1.0), 0.0)
        for length, sizes in ((tip_length, tip_lengths), (axis_length, axis_lengths))
        for size in sizes
    ]
    residual, jump_in, jump_out, orientation = synchronisation_report(
        (trims[0][:, None] * legs.tip_in, trims[1][:, None] * legs.tip_out),
        (trims[2][:, None] * axis_in, trims[3][:, None] * axis_out),
        settings.axis_length * legs.axis,
        weights,
        ratio,
        settings.axis_length,
    )
    nothing = np.full(len(tip_length), np.nan)
    return Placed(
        status=status,
        limited_by=limited_by,
        trim_in=trims[0],
        trim_out=trims[1],
        axis_trim_in=trims[2],
        axis_trim_out=trims[3],
        tip_error=factor * tip_length * sine_tip,  # equation (10)
        axis_error=factor * axis_length * sine_axis,
        orientation_error=np.where(smoothed, orientation, 0.0),
        sync_residual=np.where(smoothed, residual, nothing),
        jump_in=np.where(smoothed, jump_in, nothing),
        jump_out=np.where(smoothed, jump_out, nothing),
    )


def _half_turn_sine(leg_in: Floats, leg_out: Floats, length_in: Floats, length_out: Floats) -> Floats:
    """Sine of half the angle between the legs; 0 where a leg has no length (equation (9) has no direction there)."""
    proper = (length_in > 0.0) & (length_out > 0.0)
    safe_in, safe_out = np.where(proper, length_in, 1.0), np.where(proper, length_out, 1.0)
    difference = leg_out / safe_out[:, None] - leg_in / safe_in[:, None]
    return np.where(proper, norm(difference) / 2.0, 0.0)
