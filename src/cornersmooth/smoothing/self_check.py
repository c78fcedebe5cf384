"""How much of the tolerance the paper's motion takes: its equations do not bound it (docs/method.md).

Equation (10) bounds each of the two curves, not the motion that their synchronisation makes of them. Which pose of the
original belongs to a parameter is known: with σ and β as in `cornersmooth.geometry.nurbs`, the tip at u is β·(b − a)
from the pose that is the share σ(u) of the leg away from the corner, and the same holds of the axis point at v. As both
only go forward, so do the poses. Nothing is searched for.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from cornersmooth.arrays.vectors import norm, square, unit
from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats, Ints
from cornersmooth.settings import Settings

#: how far tip and axis point may be from a common pose, in what is allowed for each: nearly what verification allows
TOGETHER: Final = 1.8

#: for what lies between two samples
_BETWEEN: Final = 0.98

#: nothing is divided by less
_LEAST: Final = 1e-30


class Motion(NamedTuple):
    """Sampled poses (g, m) about g corners, or between g pairs of them; vectors (g, m, 3), mm."""

    tip: Floats  # from the tip of the corner
    lever: Floats  # from tip to axis point
    #: of the segment that tip, and axis point, are on: parts gone from the corner, below 0 before it, (g, m)
    tip_at: Floats
    axis_at: Floats


def parts_gone(trims: tuple[Floats, ...], parameters: tuple[Floats, Floats], weights: Floats) -> tuple[Floats, Floats]:
    """(g, m) parts of the segments that tips and axis points are away from corners at u (m,) and v (g, m).

    `trims` (g,) are those of the tip in and out, and of the axis point in and out; parts before the corner are below 0.
    """
    paper = bool((weights == 1.0).all())  # then σ is 1 − 2u, and 2v − 1 behind the corner
    (u, v), found = parameters, []
    for at, (trim_in, trim_out) in ((u[None], trims[:2]), (v, trims[2:])):
        away = 2.0 * at - 1.0 if paper else nurbs.leg_coefficients(at, weights)[..., 1:].sum(axis=-1)
        found.append(away * np.where(away < 0.0, trim_in[:, None], trim_out[:, None]))
    return found[0], found[1]


def motion_of(
    tip_legs: tuple[Floats, Floats],
    axis_legs: tuple[Floats, Floats],
    gone: tuple[Floats, Floats],
    lever: Floats,
    parameters: tuple[Floats, Floats],
    weights: Floats,
) -> Motion:
    """Transitions at parameters u (m,) and v (g, m), where `parts_gone` are gone; legs (g, 3) are those of the curves.

    `weights` (2,).
    """
    of_tip, of_axis = (nurbs.leg_coefficients(at, weights)[..., 1:] for at in (parameters[0][None], parameters[1]))
    tip = of_tip @ np.stack(tip_legs, axis=1)
    return Motion(tip, lever[:, None] + of_axis @ np.stack(axis_legs, axis=1) - tip, *gone)


class Original(NamedTuple):
    """The segments about g corners, (g, 3) each: into it and out of it."""

    tips: tuple[Floats, Floats]
    turns: tuple[Floats, Floats]  # the axis-point segments less those of the tip
    lever: Floats

    def some(self, rows: Ints) -> Original:
        """Those of some corners."""
        tips, turns = ((one[0][rows], one[1][rows]) for one in (self.tips, self.turns))
        return Original(tips, turns, self.lever[rows])

    def at(self, part: Floats) -> tuple[Floats, Floats]:
        """Tips from that of the corner, and levers, (g, m, 3), at parts (g, m) of the segments."""
        before = (part < 0.0)[..., None]
        tip, turn = (np.where(before, one[0][:, None], one[1][:, None]) for one in (self.tips, self.turns))
        return part[..., None] * tip, self.lever[:, None] + part[..., None] * turn


def taken(motion: Motion, original: Original, spare: Floats, settings: Settings, *, reserve: float = 0.0) -> Floats:
    """(g, m) what each pose takes of the tolerances, 1 for the whole. `reserve`, mm, is left free at the axis point."""
    height = settings.axis_scale
    axis = unit(motion.lever)
    common = settings.common_tolerance + spare[:, None]
    tip, lever = original.at(motion.tip_at)
    off_tip = norm(motion.tip - tip)
    if settings.axis_tolerance is not None:  # both at one pose
        return np.maximum(off_tip, height * norm(axis - unit(lever)) + reserve) / common
    own_tip, own_lever = original.at(motion.axis_at)
    own = norm(motion.tip - own_tip + height * (axis - unit(own_lever))) + reserve
    together = np.maximum(off_tip, own) + _out_of_step(motion.tip_at, motion.axis_at, original)
    return np.maximum(own, together / TOGETHER) / common


def bounded(
    gone: tuple[Floats, Floats], missing: Floats, original: Original, errors: tuple[Floats, Floats], height: float
) -> tuple[Floats, Floats]:
    """(g,) mm: bounds of what the axis point is off its path, and of what both are off a common pose.

    By the control polygons the tip is within `errors[0]` of its path, and Q within `errors[1]` of the straight path of
    the axis point: equation (10). The axis point is off Q by what is `missing` (g,) of |Q − P| = H, and its path is off
    the straight one by what the chord of the turn leaves of H. `gone` are `parts_gone`.
    """
    own = errors[1] + missing + chord_sag(original, height)
    return own, np.maximum(errors[0], own) + _out_of_step(*gone, original).max(axis=1)


def chord_sag(original: Original, height: float) -> Floats:
    """(g,) mm: what the chord of the larger turn leaves of the height at most."""
    shortest = np.sqrt(np.maximum(height**2 - np.maximum(*map(square, original.turns)) / 4.0, 0.0))
    return height - shortest


def _out_of_step(tip_at: Floats, axis_at: Floats, original: Original) -> Floats:
    """(g, m) mm: what tip and axis point are off the pose between their own at which they are off by as much."""
    sizes = [
        np.where(at < 0.0, norm(one[0])[:, None], norm(one[1])[:, None])
        for at, one in ((tip_at, original.tips), (axis_at, sums(original.tips, original.turns)))
    ]
    apart = np.abs(tip_at - axis_at) * sizes[0] * sizes[1] / np.maximum(sizes[0] + sizes[1], _LEAST)
    # one before the corner, one behind it: the pose is that of the corner
    return np.where(tip_at * axis_at < 0.0, np.maximum(np.abs(tip_at) * sizes[0], np.abs(axis_at) * sizes[1]), apart)


def sums(tips: tuple[Floats, Floats], turns: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Axis-point segments in and out, (g, 3) each."""
    return tips[0] + turns[0], tips[1] + turns[1]


def most_taken(
    motion: Motion, original: Original, spare: Floats, settings: Settings, middle: int, passing: Floats | None
) -> Floats:
    """(g,) what transitions take at most; `middle` is the sample at u = ½.

    `passing`, mm, bounds how far lines pass the axis point of the corner; None for curves, which pass it at u = ½.
    """
    share = taken(motion, original, spare, settings)
    most: Floats = np.maximum(np.delete(share, middle, axis=1).max(axis=1) / _BETWEEN, share[:, middle])
    if settings.axis_tolerance is not None:
        return most
    axis = unit(motion.lever[:, middle]) - unit(original.lever)
    at_corner = norm(motion.tip[:, middle] + settings.axis_scale * axis)
    if passing is not None and settings.lines != "long":  # of long lines only the point at u = ½ is sure to be kept
        at_corner = np.minimum(at_corner, passing)
    return np.maximum(most, at_corner / (settings.common_tolerance + spare))
