"""How far proportional transitions are from the original motion at constant H, and how long they may be for it.

The construction runs on chords of the sphere, controls keep tip and direction: what is measured is b = tip + H·axis
(docs/method.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.legs import Legs
from cornersmooth.vectors import dot, norm, square

#: parameters u at which the deviation at constant H is evaluated; it is largest near u = ½
_PROBES = 0.5 * np.array([0.5, 0.7, 0.8, 0.87, 0.92, 0.96, 0.98, 1.0])

#: share of the tolerance left to what lies between two probes of a flat maximum
BETWEEN_PROBES = 1e-3

#: relative size of what is only arithmetic
EXACT = 1e-10


@dataclass(frozen=True)
class Bends:
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
        along = dot(shift, axis)
        across = np.sqrt(np.maximum(square(shift) - along * along, 0.0))
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


def keep(length: Floats, rows: Ints, measure: Callable[[Floats, Ints], Floats], tolerance: float) -> Floats:
    """Lengths of the given rows, shortened until the measured deviation keeps the tolerance."""
    length = length.copy()
    pending = rows
    while len(pending):
        deviation = measure(length[pending], pending)
        over = deviation > tolerance * (1.0 + EXACT)
        pending = pending[over]
        length[pending] *= tolerance / deviation[over] * (1.0 - EXACT)
    return length[rows]
