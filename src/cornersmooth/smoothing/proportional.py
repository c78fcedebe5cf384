"""`method="proportional"`: tip and axis-point segment are cut by the same fraction on each side (docs/method.md)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import dot, norm, square, unit
from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats, Ints, LimitedBy, SmoothProgram, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import (
    STRAIGHT_ON,
    Construction,
    Legs,
    Placed,
    divide,
    half_cosine,
    refuse_turns,
)

if TYPE_CHECKING:
    from cornersmooth.smoothing.segments import Segments

#: parameters u at which the deviation at constant H is evaluated; it is largest near u = ½
_PROBES = 0.5 * np.array([0.5, 0.7, 0.8, 0.87, 0.92, 0.96, 0.98, 1.0])

#: share of the tolerance left to what lies between two probes of a flat maximum
BETWEEN_PROBES = 1e-3

#: relative size of what is only arithmetic
EXACT = 1e-10

#: while the lever turns by less than this many times the deviation, relative to it, the deviation is largest at u = ½:
#: half of what is proven
_TILT = 1.5


def keep(length: Floats, rows: Ints, measure: Callable[[Floats, Ints], Floats], tolerance: Floats) -> Floats:
    """Lengths of the given rows, shortened until the measured deviation keeps the tolerances (of all rows)."""
    length = length.copy()
    pending = rows
    while len(pending):
        deviation = measure(length[pending], pending)
        over = deviation > tolerance[pending] * (1.0 + EXACT)
        pending = pending[over]
        length[pending] *= tolerance[pending] / deviation[over] * (1.0 - EXACT)
    return length[rows]


class CornerLengths:
    """What g corners ask for, and how far transitions are from the original motion as functions of their length, mm.

    Methods take the lengths of all corners, or of some with their rows.
    """

    def __init__(self, legs: Legs, settings: Settings) -> None:
        self.legs, self.settings, self.axis_length = legs, settings, settings.axis_length
        axis_in, axis_out = legs.tip_in + legs.turn_in, legs.tip_out + legs.turn_out
        self.length_in = np.sqrt((square(legs.tip_in) + square(axis_in)) / 2.0)  # m(D⁻), mm
        self.length_out = np.sqrt((square(legs.tip_out) + square(axis_out)) / 2.0)
        per_in, per_out = 1.0 / self.length_in[:, None], 1.0 / self.length_out[:, None]
        self.bend_tip = legs.tip_out * per_out - legs.tip_in * per_in  # (U⁺ − U⁻)_A
        self.bend_turn = legs.turn_out * per_out - legs.turn_in * per_in  # (U⁺ − U⁻)_B − (U⁺ − U⁻)_A
        # deviation over length: tip, axis point, axis point less tip
        bends = self.bend_tip, self.bend_tip + self.bend_turn, self.bend_turn
        self.per_tip, per_axis, self.per_turn = (nurbs.DEVIATION * norm(bend) for bend in bends)
        #: lengths that the tolerances allow, mm
        self.by_tolerance = np.minimum(
            divide(settings.tip_tolerance + legs.spare(settings), self.per_tip),
            divide(settings.axis_point_tolerance + legs.spare(settings), per_axis),
        )
        self.half_cosine = half_cosine(legs, settings.axis_length)

        self.room = np.minimum(self.length_in, self.length_out) / 2.0
        flat_tip = self.per_tip * self.room <= settings.tip_resolution / 2.0
        flat_axis = per_axis * self.room <= max(settings.tip_resolution, settings.axis_point_resolution) / 2.0
        cosine = (dot(legs.tip_in, legs.tip_out) + dot(axis_in, axis_out)) / (2.0 * self.length_in * self.length_out)
        #: as far as the geometry of the corner decides it
        flat = np.where(cosine >= np.cos(np.radians(STRAIGHT_ON)), Status.STRAIGHT, Status.TOO_SHORT)
        self.status = np.where(flat_tip & flat_axis, flat, Status.SMOOTHED).astype(np.uint8)
        refuse_turns(self.status, cosine, self.half_cosine, settings)

    def middle(self, length: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """|b′−b| at u = ½, where b is the axis point of the corner itself, mm."""
        offset = (nurbs.DEVIATION * length)[:, None]
        lever = self.axis_length * self.legs.axis[rows]
        turned = lever + offset * self.bend_turn[rows]  # Q − P
        turned *= (self.axis_length / norm(turned))[:, None]
        return norm(offset * self.bend_tip[rows] + turned - lever)

    def middle_turn(self, length: Floats) -> Floats:
        """Angle between the axis at u = ½ and that of the corner, rad."""
        axis = self.legs.axis
        shift = (nurbs.DEVIATION * length / self.axis_length)[:, None] * self.bend_turn
        along = dot(shift, axis)
        across = np.sqrt(np.maximum(square(shift) - along * along, 0.0))
        return np.arctan2(across, 1.0 + along)

    def probe(self, length: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """Largest |b′−b| at common parameters over both halves, mm."""
        reach = length[:, None]
        shares = nurbs.leg_coefficients(_PROBES)
        beta = shares[:, 2]
        sigma = -shares[:, 1] - beta
        lever = self.axis_length * self.legs.axis[rows][:, None, :]
        shift = (beta * reach)[..., None]
        tip_shift = shift * self.bend_tip[rows][:, None, :]
        turn_shift = shift * self.bend_turn[rows][:, None, :]
        largest = np.zeros(len(length))
        sides = (
            (-1.0, self.legs.turn_in[rows] * (1.0 / self.length_in[rows, None])),
            (1.0, self.legs.turn_out[rows] * (1.0 / self.length_out[rows, None])),
        )
        for side, rate in sides:
            original = lever + (side * sigma * reach)[..., None] * rate[:, None, :]  # B − A of the ruled motion
            rounded = original + turn_shift
            away = rounded / norm(rounded)[..., None] - original / norm(original)[..., None]
            largest = np.maximum(largest, norm(tip_shift + self.axis_length * away).max(axis=1))
        return largest


def _largest_in_the_middle(lengths: CornerLengths, length: Floats, turned: Floats) -> NDArray[np.bool_]:
    """Rows whose deviation at constant H is surely largest at u = ½; `turned` is (Q−P)−(B−A) there, mm.

    The deviation where the original motion is at σ, as in `cornersmooth.geometry.nurbs`, is at most f(σ)·(E + G·σ),
    with E the deviation at u = ½, f = β/c, and G the lever's turn over the half times H|O′−O|. So E is the largest
    while f·(1 + σ·G/E) ≤ 1. As f is (1−σ)³, G may be up to 3E.
    """
    legs = lengths.legs
    turn = np.maximum(norm(legs.turn_in) * (1.0 / lengths.length_in), norm(legs.turn_out) * (1.0 / lengths.length_out))
    turn *= length / lengths.axis_length
    return (2.0 * turn * turned <= _TILT * lengths.middle(length)) & (turn < 0.5)


class Proportional(Construction):
    """Tip and axis-point segment are trimmed by the same fraction, and one parameter drives both curves."""

    def place(self, legs: Legs, settings: Settings) -> Placed:
        """Give every corner the length that the tolerances and its segments allow: half of the shorter one at most."""
        lengths = CornerLengths(legs, settings)
        room, status, per_tip, per_turn = lengths.room, lengths.status, lengths.per_tip, lengths.per_turn
        limited_by = np.where(lengths.by_tolerance <= room, LimitedBy.TOLERANCE, LimitedBy.SEGMENT).astype(np.uint8)
        length = np.minimum(room, lengths.by_tolerance)

        # The construction runs on chords of the sphere, the tolerance is about b = tip + H·axis at constant H.
        # The bound |b′−b| ≤ |A′−A| + H|O′−O| proves most corners; the others are shortened until they keep it.
        axis_length, allowed = settings.axis_length, settings.axis_point_tolerance + legs.spare(settings)
        shortest_lever = axis_length * lengths.half_cosine - length * per_turn  # below |B−A| of both motions
        bound = length * (per_tip + divide(axis_length * per_turn, np.maximum(shortest_lever, 0.0)))
        doubtful = (status == Status.SMOOTHED) & (bound > allowed * (1.0 + EXACT))
        peaks = _largest_in_the_middle(lengths, length, length * per_turn)
        probed = np.flatnonzero(doubtful & ~peaks)
        for rows, measure, share in (
            (np.flatnonzero(doubtful & peaks), lengths.middle, 1.0),
            (probed, lengths.probe, 1.0 - BETWEEN_PROBES),
        ):
            shortened = keep(length, rows, measure, share * allowed)
            limited_by[rows[shortened < length[rows]]] = LimitedBy.TOLERANCE
            length[rows] = shortened
        status[(status == Status.SMOOTHED) & (length <= 4.0 * settings.tip_resolution)] = Status.TOO_SHORT

        sharp = status != Status.SMOOTHED
        length[sharp], limited_by[sharp] = 0.0, LimitedBy.NOTHING
        axis_error = lengths.middle(length)
        axis_error[probed] = np.maximum(axis_error[probed], lengths.probe(length[probed], probed))
        trims = length / lengths.length_in, length / lengths.length_out
        return Placed(status, limited_by, *trims, *trims, per_tip * length, axis_error, lengths.middle_turn(length))

    def points(self, smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
        """Both curves at the same parameters."""
        corners = smoothed.corners
        shares = nurbs.leg_coefficients(np.concatenate(([0.0], u)))
        pose, before, after = corners.pose[rows], corners.before[rows], corners.after[rows]
        trim_in, trim_out = corners.trim_in[rows, None], corners.trim_out[rows, None]
        legs = np.empty((2, len(rows), 3, 3))
        for own, values in zip(legs, (smoothed.program.tip, smoothed.program.axis), strict=True):
            own[:, 0] = here = values.take(pose, axis=0)
            np.multiply(here - values.take(before, axis=0), trim_in, out=own[:, 1])
            np.multiply(values.take(after, axis=0) - here, trim_out, out=own[:, 2])
        return shares @ legs[0], shares @ legs[1]

    def divide(self, smoothed: SmoothProgram, segments: Segments, pose: Ints, number: int) -> tuple[Floats, Floats]:
        """Equal angles of the ruled motion: tan φ is linear in the fraction, φ the angle from the middle."""
        axis = smoothed.program.axis
        first = axis[segments.start[pose]]
        turn = axis[pose] - first
        slope = np.tan(np.arcsin(np.minimum(norm(turn) / 2.0, 1.0)))[:, None]
        low, high = (np.arctan((2.0 * end[pose, None] - 1.0) * slope) for end in (segments.entry, segments.exit))
        angle = low + (high - low) * (np.arange(1, number) / number)
        fraction: Floats = (np.tan(angle) / slope + 1.0) / 2.0
        return fraction, unit(first[:, None] + fraction[..., None] * turn[:, None])


CONSTRUCTION = Proportional()
