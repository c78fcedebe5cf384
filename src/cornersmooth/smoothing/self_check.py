"""How much of the tolerance the paper's motion takes: its equations do not bound it (docs/method.md).

Equation (10) bounds each of the two curves, not the motion that their synchronisation makes of them. Which pose of the
original belongs to a parameter is known: with σ and β as in `cornersmooth.geometry.nurbs`, the tip at u is β·(b − a)
from the pose that is the share σ(u) of the leg away from the corner, and the same holds of the axis point at v. As both
only go forward, so do the poses. Nothing is searched for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from cornersmooth.arrays import angle_between, norm, some_rows, square, unit
from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats, Ints
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import Legs
from cornersmooth.smoothing.synchronise import synchronised

#: how far tip and axis point may be from a common pose, in what is allowed for each: nearly what verification allows
TOGETHER: Final = 1.8

#: for what lies between two samples
_BETWEEN: Final = 0.98

#: nothing is divided by less
_LEAST: Final = 1e-30

#: u (m,) of the tip curve, and v (g, m), or (1, m) for all, of the axis-point curve
Parameters = tuple[Floats, Floats]


class Motion(NamedTuple):
    """Sampled poses (g, m) about g corners, or between g pairs of them; vectors (g, m, 3), mm."""

    tip: Floats  # from the tip of the corner
    lever: Floats  # from tip to axis point
    #: of the segment that tip, and axis point, are on: parts gone from the corner, below 0 before it, (g, m)
    tip_at: Floats
    axis_at: Floats


@dataclass(frozen=True)
class Original:
    """The segments about g corners, into it and out of it, mm."""

    tips: Floats  # (g, 2, 3)
    turns: Floats  # (g, 2, 3) the axis-point segments less those of the tip
    lever: Floats  # (g, 3) H times the axis at the corner
    spare: Floats  # (g,) what is left of the tolerances

    @classmethod
    def of(cls, legs: Legs, settings: Settings) -> Original:
        """Those of legs."""
        tips, turns = np.stack((legs.tip_in, legs.tip_out), axis=1), np.stack((legs.turn_in, legs.turn_out), axis=1)
        return cls(tips, turns, settings.axis_length * legs.axis, legs.spare(settings))

    @property
    def segments(self) -> Floats:
        """(g, 2, 2, 3) those of tip and axis point."""
        return np.stack((self.tips, self.tips + self.turns), axis=1)

    def at(self, part: Floats) -> tuple[Floats, Floats]:
        """Tips from that of the corner, and levers, (g, m, 3), at parts (g, m) of the segments."""
        before = (part < 0.0)[..., None]
        tip, turn = (np.where(before, one[:, :1], one[:, 1:]) for one in (self.tips, self.turns))
        return part[..., None] * tip, self.lever[:, None] + part[..., None] * turn

    def out_of_step(self, tip_at: Floats, axis_at: Floats) -> Floats:
        """(g, m) mm: what tip and axis point are off the pose between their own at which they are off by as much."""
        sizes = norm(self.segments)[..., None]
        tip, axis = (np.where(at < 0.0, sizes[:, k, 0], sizes[:, k, 1]) for k, at in enumerate((tip_at, axis_at)))
        apart = np.abs(tip_at - axis_at) * tip * axis / np.maximum(tip + axis, _LEAST)
        # one before the corner, one behind it: the pose is that of the corner
        return np.where(tip_at * axis_at < 0.0, np.maximum(np.abs(tip_at) * tip, np.abs(axis_at) * axis), apart)


def taken(motion: Motion, original: Original, settings: Settings, *, reserve: float = 0.0) -> Floats:
    """(g, m) what each pose takes of the tolerances, 1 for the whole. `reserve`, mm, is left free at the axis point."""
    height = settings.axis_scale
    axis = unit(motion.lever)
    common = settings.common_tolerance + original.spare[:, None]
    tip, lever = original.at(motion.tip_at)
    off_tip = norm(motion.tip - tip)
    if settings.axis_tolerance is not None:  # both at one pose
        return np.maximum(off_tip, height * norm(axis - unit(lever)) + reserve) / common
    own_tip, own_lever = original.at(motion.axis_at)
    own = norm(motion.tip - own_tip + height * (axis - unit(own_lever))) + reserve
    together = np.maximum(off_tip, own) + original.out_of_step(motion.tip_at, motion.axis_at)
    return np.maximum(own, together / TOGETHER) / common


def bounded(
    gone: Parameters, missing: Floats, original: Original, errors: Floats, settings: Settings
) -> tuple[Floats, Floats]:
    """(g,) mm: bound of what the axis point is off its path; (g,) bound of the share of ε in use.

    By the control polygons the tip is within ``errors[:, 0]`` of its path, and Q within ``errors[:, 1]`` of the
    straight path of the axis point: equation (10). The axis point is off Q by what is `missing` (g,) of |Q − P| = H,
    and its path is off the straight one by what the chord of the turn leaves of H. `gone` are parts of the segments.
    There is no bound for a tolerance of the axis.
    """
    height = settings.axis_length
    chord = np.sqrt(np.maximum(height**2 - square(original.turns).max(axis=1) / 4.0, 0.0))  # of the larger turn
    own = errors[:, 1] + missing + height - chord
    both = np.maximum(errors[:, 0], own) + original.out_of_step(*gone).max(axis=1)
    share = np.maximum(own, both / TOGETHER) / (settings.common_tolerance + original.spare)
    return own, share if settings.axis_tolerance is None else np.full_like(share, np.inf)


def most_taken(motion: Motion, original: Original, settings: Settings, middle: int, passing: Floats | None) -> Floats:
    """(g,) what transitions take at most; `middle` is the sample at u = ½.

    `passing`, mm, bounds how far lines pass the axis point of the corner; None for curves, which pass it at u = ½.
    """
    share = taken(motion, original, settings)
    most: Floats = np.maximum(np.delete(share, middle, axis=1).max(axis=1) / _BETWEEN, share[:, middle])
    if settings.axis_tolerance is not None:
        return most
    axis = unit(motion.lever[:, middle]) - unit(original.lever)
    at_corner = norm(motion.tip[:, middle] + settings.axis_scale * axis)
    if passing is not None and settings.lines != "long":  # of long lines only the point at u = ½ is sure to be kept
        at_corner = np.minimum(at_corner, passing)
    return np.maximum(most, at_corner / (settings.common_tolerance + original.spare))


@dataclass(frozen=True)
class Transitions:
    """Transitions at g corners that take some parts of their segments."""

    trims: Floats  # (g, 2, 2) of tip and axis point, in and out
    original: Original
    settings: Settings

    @cached_property
    def legs(self) -> Floats:
        """(g, 2, 2, 3) mm: of both curves, in and out."""
        return self.trims[..., None] * self.original.segments

    def some(self, rows: Ints) -> Transitions:
        """Those of some corners."""
        return Transitions(self.trims[rows], some_rows(self.original, rows), self.settings)

    def synchronised(self, u: Floats) -> Parameters:
        """Parameters v(u) (g, m), and what is missing there, mm: equations (20) and (21)."""
        return synchronised(self.legs, self.original.lever, u, self.settings.axis_length)

    def motion(self, parameters: Parameters) -> Motion:
        """Poses at parameters."""
        tip, axis = (nurbs.leg_coefficients(at)[..., 1:] @ self.legs[:, k] for k, at in enumerate(parameters))
        return Motion(tip, self.original.lever[:, None] + axis - tip, *self.gone(parameters))

    def missing(self, parameters: Parameters) -> Floats:
        """(g,) mm: the largest ``||Q − P| − H|``."""
        return np.abs(norm(self.motion(parameters).lever) - self.settings.axis_length).max(axis=1)

    def gone(self, parameters: Parameters) -> Parameters:
        """(g, m) parts of the segments that tips and axis points are away from corners; below 0 before these."""
        found = []
        for at, trims in zip(parameters, np.moveaxis(self.trims, 0, -1)[..., None], strict=True):
            away = 2.0 * at - 1.0
            found.append(away * np.where(away < 0.0, trims[0], trims[1]))
        return found[0], found[1]

    def bounded(self, parameters: Parameters, missing: Floats) -> tuple[Floats, Floats]:
        """`bounded` at parameters."""
        errors = nurbs.DEVIATION * norm(self.legs[:, :, 1] - self.legs[:, :, 0])
        return bounded(self.gone(parameters), missing, self.original, errors, self.settings)

    def report(self, u: Floats, parameters: Parameters) -> tuple[Floats, Floats, Floats]:
        """Jumps of the axis at both joints, and its turn at u = ½ from that at the corner, rad, (g,) each.

        Jumps are between the transition and the straight motion, which equations (17) and (18) forbid.
        """
        half = len(u) // 2
        lever = self.motion((u[[0, half, -1]], parameters[1][:, [0, half, -1]])).lever
        straight = self.motion(ENDS).lever
        before, behind = (angle_between(straight[:, k], lever[:, 2 * k]) for k in range(2))
        return before, behind, angle_between(lever[:, 1], self.original.lever)


#: both ends of the curves together
ENDS: Final = np.array([0.0, 1.0]), np.array([[0.0, 1.0]])
