"""Where the path is rounded and how far each transition reaches: design 3.1 to 3.3.

Every function works on whole arrays of corners; memory is bounded by working through them in blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Corners, Floats, Ints, LimitedBy, Program, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing import nurbs
from cornersmooth.smoothing.neighbours import find_neighbours, norm
from cornersmooth.smoothing.synchronise import synchronisation_report

#: corners worked on at once: their intermediate arrays fit the processor's cache
BLOCK = 16384

#: parameters u at which the deviation at constant H is evaluated; it is largest near u = ½
_PROBES = 0.5 * np.array([0.5, 0.7, 0.8, 0.87, 0.92, 0.96, 0.98, 1.0])

#: share of the tolerance left to what lies between two probes of a flat maximum
_BETWEEN_PROBES = 1e-3

#: relative size of what is only arithmetic
_EXACT = 1e-10


class Legs(NamedTuple):
    """The two segments at g corners, in space and seen from the tool axis.

    Parameters
    ----------
    tip_in, tip_out : (g, 3) float64, mm
        Tip segments into and out of the corner (D⁻, D⁺ of the tip).
    turn_in, turn_out : (g, 3) float64, mm
        H times the change of the axis vector along them, so that ``tip + turn`` is the axis-point segment.
    axis : (g, 3) float64
        Unit axis at the corner.
    """

    tip_in: Floats
    tip_out: Floats
    turn_in: Floats
    turn_out: Floats
    axis: Floats


@dataclass
class _Block:
    """What a method computes for a block of g corners; the names are those of `Corners`."""

    status: NDArray[np.uint8]
    limited_by: NDArray[np.uint8]
    trim_in: Floats
    trim_out: Floats
    axis_trim_in: Floats
    axis_trim_out: Floats
    tip_error: Floats
    axis_error: Floats
    orientation_error: Floats
    sync_residual: Floats
    jump_in: Floats
    jump_out: Floats


def place_corners(program: Program, settings: Settings, progress: Callable[[int, int], None] | None = None) -> Corners:
    """Round every corner of the program that can be rounded.

    Parameters
    ----------
    progress : callable, optional
        Called with (corners done, corners in all) after each block.

    Returns
    -------
    Corners
        One row for every inner pose of every chain.
    """
    around = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    pose = np.flatnonzero(around.inner)
    before, after = around.previous[pose], around.following[pose]
    status = _what_forbids(program, settings, pose, after, around.duplicate[pose])
    method = _zhang2016 if settings.method == "zhang2016" else _proportional

    k = len(pose)
    weights = np.broadcast_to(np.array(settings.weights), (k, 2))
    ratio = np.broadcast_to(np.float64(settings.ratio), (k,))
    whole = _Block(
        status=status,
        limited_by=np.zeros(k, np.uint8),
        **{
            name: np.zeros(k)
            for name in _Block.__dataclass_fields__
            if name not in ("status", "limited_by", "sync_residual", "jump_in", "jump_out")
        },
        **{name: np.full(k, np.nan) for name in ("sync_residual", "jump_in", "jump_out")},
    )
    if settings.method == "proportional":  # the same fractions on both curves: one array
        whole.axis_trim_in, whole.axis_trim_out = whole.trim_in, whole.trim_out
    for start in range(0, k, BLOCK):
        rows = start + np.flatnonzero(status[start : start + BLOCK] == Status.SMOOTHED)
        if len(rows):
            legs = _legs(program, settings.axis_length, pose[rows], before[rows], after[rows])
            part = method(legs, weights[rows], ratio[rows], settings)
            for name in _Block.__dataclass_fields__:
                getattr(whole, name)[rows] = getattr(part, name)
        if progress is not None:
            progress(min(start + BLOCK, k), k)
    return Corners(pose=pose, before=before, after=after, weights=weights, ratio=ratio, **vars(whole))


def _what_forbids(
    program: Program, settings: Settings, pose: Ints, after: Ints, duplicate: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Status of every corner as far as its surroundings decide it, geometry apart."""
    status = np.full(len(pose), Status.SMOOTHED, np.uint8)
    after = np.maximum(after, 0)
    feed_in, feed_out = program.feed[pose], program.feed[after]
    same = (feed_in == feed_out) | (np.isnan(feed_in) & np.isnan(feed_out))
    same_mode = program.feed_mode[pose] == program.feed_mode[after]
    status[~same_mode | (~same & (not settings.round_feed_changes))] = Status.FEED_CHANGE
    status[program.keep[pose] != 0] = Status.KEPT
    status[after == 0] = Status.TOO_SHORT
    status[duplicate] = Status.DUPLICATE
    return status


def _legs(program: Program, axis_length: float, pose: Ints, before: Ints, after: Ints) -> Legs:
    tip, axis = program.tip, program.axis
    corner, direction = tip[pose], axis[pose]
    return Legs(
        corner - tip[before],
        tip[after] - corner,
        axis_length * (direction - axis[before]),
        axis_length * (axis[after] - direction),
        direction,
    )


def _half_angle_cosine(turn: Floats, axis_length: float) -> Floats:
    """Cosine of half the axis change, from its chord ``|turn| = 2 H sin(θ/2)``."""
    sine = norm(turn) / (2.0 * axis_length)
    return np.sqrt(np.maximum(0.0, 1.0 - sine * sine))


def _divide(numerator: Floats | float, denominator: Floats) -> Floats:
    """Quotient; infinity where the denominator is zero."""
    quotient: Floats = np.divide(numerator, denominator, out=np.full_like(denominator, np.inf), where=denominator > 0.0)
    return quotient


def _proportional(legs: Legs, weights: Floats, ratio: Floats, settings: Settings) -> _Block:
    """Trim tip and axis-point segment by the same fraction on each side: design 3.2."""
    axis_length = settings.axis_length
    axis_in, axis_out = legs.tip_in + legs.turn_in, legs.tip_out + legs.turn_out
    # m(D): length of the six-dimensional segment
    length_in = np.sqrt((_square(legs.tip_in) + _square(axis_in)) / 2.0)
    length_out = np.sqrt((_square(legs.tip_out) + _square(axis_out)) / 2.0)
    per_in, per_out = 1.0 / length_in[:, None], 1.0 / length_out[:, None]
    bend_tip = legs.tip_out * per_out - legs.tip_in * per_in  # (U⁺ − U⁻)_A
    bend_turn = legs.turn_out * per_out - legs.turn_in * per_in  # (U⁺ − U⁻)_B − (U⁺ − U⁻)_A
    bend_axis = bend_tip + bend_turn  # (U⁺ − U⁻)_B
    factor = nurbs.deviation_factor(weights, ratio)
    per_length_tip, per_length_axis, per_length_turn = (factor * norm(v) for v in (bend_tip, bend_axis, bend_turn))

    room = np.minimum(length_in, length_out) / 2.0
    wanted = np.minimum(
        _divide(settings.tip_tolerance, per_length_tip), _divide(settings.axis_point_tolerance, per_length_axis)
    )
    half_cosine = np.minimum(
        _half_angle_cosine(legs.turn_in, axis_length), _half_angle_cosine(legs.turn_out, axis_length)
    )
    limited_by = np.where(wanted < room, LimitedBy.TOLERANCE, LimitedBy.SEGMENT).astype(np.uint8)
    length = np.minimum(room, wanted)
    if settings.orientation_tolerance is not None:
        reach = axis_length * half_cosine * np.sin(np.radians(settings.orientation_tolerance))
        turnable = _divide(reach, per_length_turn)
        limited_by[turnable < length] = LimitedBy.ORIENTATION
        length = np.minimum(length, turnable)

    status = np.full(len(length), Status.SMOOTHED, np.uint8)
    flat_tip = per_length_tip * room <= settings.tip_resolution / 2.0
    flat_axis = per_length_axis * room <= max(settings.tip_resolution, settings.axis_point_resolution) / 2.0
    status[flat_tip & flat_axis] = Status.STRAIGHT
    cosine = (_dot(legs.tip_in, legs.tip_out) + _dot(axis_in, axis_out)) / (2.0 * length_in * length_out)
    status[cosine < np.cos(np.radians(settings.reversal_angle))] = Status.REVERSAL
    status[half_cosine < np.cos(np.radians(settings.max_axis_step / 2.0)) - 1e-12] = Status.AXIS_STEP

    # The construction runs on chords of the sphere, the promise is about b = tip + H·axis at constant H. The bound
    # |b′−b| ≤ |A′−A| + H|O′−O| proves most corners; the others are evaluated and shortened until they keep it.
    bends = _Bends(legs, per_in, per_out, bend_tip, bend_turn, weights, ratio, factor, axis_length)
    shortest_lever = axis_length * half_cosine - length * per_length_turn  # below |B−A| of both motions
    bound = length * (per_length_tip + _divide(axis_length * per_length_turn, np.maximum(shortest_lever, 0.0)))
    doubtful = (status == Status.SMOOTHED) & (bound > settings.axis_point_tolerance * (1.0 + _EXACT))
    # with all weights 1 the deviation at s = 2u is at most s³·(E + G·(1−s)), E that at u = ½ and G the lever's turn
    # over the half times H|O′−O|; so while G < 3E, here with a margin of two, the largest is E itself
    turn = np.maximum(norm(legs.turn_in) * per_in[:, 0], norm(legs.turn_out) * per_out[:, 0]) * length / axis_length
    tilt = 2.0 * turn * length * per_length_turn
    peaks = (tilt <= 1.5 * bends.middle(length)) & (turn < 0.5) & (weights == 1.0).all(axis=1)
    probed = np.flatnonzero(doubtful & ~peaks)
    for rows, measure, share in (
        (np.flatnonzero(doubtful & peaks), bends.middle, 1.0),
        (probed, bends.probe, 1.0 - _BETWEEN_PROBES),
    ):
        shortened = _keep(length, rows, measure, share * settings.axis_point_tolerance)
        limited_by[rows[shortened < length[rows]]] = LimitedBy.TOLERANCE
        length[rows] = shortened
    shortest = 4.0 * settings.tip_resolution
    status[(status == Status.SMOOTHED) & (length <= shortest)] = Status.TOO_SHORT

    smoothed = status == Status.SMOOTHED
    length = np.where(smoothed, length, 0.0)
    limited_by[~smoothed] = LimitedBy.NOTHING
    axis_error = bends.middle(length)
    if len(probed):
        axis_error[probed] = np.maximum(axis_error[probed], bends.probe(length[probed], probed))
    trim_in, trim_out = length / length_in, length / length_out
    nothing = np.full(len(length), np.nan)
    return _Block(
        status=status,
        limited_by=limited_by,
        trim_in=trim_in,
        trim_out=trim_out,
        axis_trim_in=trim_in,
        axis_trim_out=trim_out,
        tip_error=per_length_tip * length,
        axis_error=axis_error,
        orientation_error=bends.middle_turn(length),
        sync_residual=nothing,
        jump_in=nothing,
        jump_out=nothing,
    )


@dataclass(frozen=True)
class _Bends:
    """Deviation of proportional transitions from the original motion at constant H, as functions of their length.

    Methods take the lengths (mm) of all corners, or of some with their rows.
    """

    legs: Legs
    per_in: Floats  # 1/m(D⁻), (g, 1)
    per_out: Floats
    bend_tip: Floats  # (U⁺ − U⁻)_A
    bend_turn: Floats  # (U⁺ − U⁻)_B − (U⁺ − U⁻)_A
    weights: Floats
    ratio: Floats
    factor: Floats
    axis_length: float

    def middle(self, length: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """|b′−b| at u = ½, where b is the axis point of the corner itself, mm."""
        offset = (self.factor[rows] * length)[:, None]
        lever = self.axis_length * self.legs.axis[rows]
        turned = lever + offset * self.bend_turn[rows]  # Q − P
        turned *= (self.axis_length / norm(turned))[:, None]
        return norm(offset * self.bend_tip[rows] + turned - lever)

    def middle_turn(self, length: Floats) -> Floats:
        """Angle between the axis at u = ½ and that of the corner, rad."""
        axis = self.legs.axis
        shift = (self.factor * length / self.axis_length)[:, None] * self.bend_turn
        along = _dot(shift, axis)
        across = np.sqrt(np.maximum(_square(shift) - along * along, 0.0))
        return np.arctan2(across, 1.0 + along)

    def probe(self, length: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """Largest |b′−b| at common parameters over both halves, mm."""
        reach, inner = length[:, None], self.ratio[rows][:, None]
        sway = nurbs.rational_basis(_PROBES, self.weights[rows])  # (g, probes, 5)
        beta = inner * sway[..., 3]
        sigma = sway[..., 0] + inner * (sway[..., 1] - sway[..., 3])
        lever = self.axis_length * self.legs.axis[rows][:, None, :]
        shift = (beta * reach)[..., None]
        tip_shift = shift * self.bend_tip[rows][:, None, :]
        turn_shift = shift * self.bend_turn[rows][:, None, :]
        largest = np.zeros(len(length))
        sides = (
            (-1.0, self.legs.turn_in[rows] * self.per_in[rows]),
            (1.0, self.legs.turn_out[rows] * self.per_out[rows]),
        )
        for side, rate in sides:
            original = lever + (side * sigma * reach)[..., None] * rate[:, None, :]  # B − A of the ruled motion
            rounded = original + turn_shift
            away = rounded / norm(rounded)[..., None] - original / norm(original)[..., None]
            largest = np.maximum(largest, norm(tip_shift + self.axis_length * away).max(axis=1))
        return largest


def _keep(length: Floats, rows: Ints, measure: Callable[[Floats, Ints], Floats], tolerance: float) -> Floats:
    """Lengths of the given rows, shortened until the measured deviation keeps the tolerance."""
    length = length.copy()
    pending = rows
    while len(pending):
        deviation = measure(length[pending], pending)
        over = deviation > tolerance * (1.0 + _EXACT)
        pending = pending[over]
        length[pending] *= tolerance / deviation[over] * (1.0 - _EXACT)
    return length[rows]


def _zhang2016(legs: Legs, weights: Floats, ratio: Floats, settings: Settings) -> _Block:
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
    by_tolerance = _divide(settings.tolerance, factor * np.maximum(sine_tip, sine_axis))
    tip_room, axis_room = np.minimum(*tip_lengths) / 2.0, np.minimum(*axis_lengths) / 2.0
    tip_length, axis_length = np.minimum(tip_room, by_tolerance), np.minimum(axis_room, by_tolerance)

    status = np.full(len(tip_length), Status.SMOOTHED, np.uint8)
    status[(sine_tip == 0.0) & (sine_axis == 0.0)] = Status.STRAIGHT
    # the six-dimensional turn, as for the proportional method
    dot = _dot(legs.tip_in, legs.tip_out) + _dot(axis_in, axis_out)
    sizes = np.hypot(tip_lengths[0], axis_lengths[0]) * np.hypot(tip_lengths[1], axis_lengths[1])
    status[dot < np.cos(np.radians(settings.reversal_angle)) * sizes] = Status.REVERSAL
    half_cosine = np.minimum(
        _half_angle_cosine(legs.turn_in, settings.axis_length), _half_angle_cosine(legs.turn_out, settings.axis_length)
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
    return _Block(
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


def _square(vectors: Floats) -> Floats:
    return _dot(vectors, vectors)


def _dot(one: Floats, other: Floats) -> Floats:
    product: Floats = np.einsum("...i,...i->...", one, other)
    return product
