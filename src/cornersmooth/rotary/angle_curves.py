"""Smoothed orientation as NURBS in rotary axes: the angles as further axes of the tip curve.

A control such as FANUC's G6.2 runs rotary axes on the knots and weights of the tip curve. So both angles get control
points of their own, such that the tool axis they give follows the direction of Q(u) − P(u).

Where the angles run evenly on both segments of a corner, their five control points follow from the corner as those of
the tip do. Elsewhere knots are inserted, which leaves the tip curve as it is: value and first two derivatives are kept
at both joints, and the points between are fitted. The derivatives are those of the straight lines beside, or, where
that would take many knots, those of the ruled motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cornersmooth.errors import Finding, SettingsError
from cornersmooth.geometry import nurbs
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import continued
from cornersmooth.methods import DEFAULT_METHOD, METHODS
from cornersmooth.model import Floats, Ints, SmoothProgram
from cornersmooth.rotary.angle_fit import (
    MEASURE_SAMPLES,
    Targets,
    end_points,
    fit,
    fit_samples,
    leg_derivatives,
    measured,
)
from cornersmooth.rotary.corner_lines import CornerLines, corner_lines
from cornersmooth.rotary.remainders import RotaryMotion, lever_points, rotary_motion, tip_points
from cornersmooth.rotary.subdivision import Insertions
from cornersmooth.settings import WEIGHT_DECIMALS

#: Numbers of equal knot intervals of the curves, from the five-point curve on: n intervals have n + 3 control points.
SPANS = (2, 4, 8, 16, 32)
#: Knots with more intervals than this would need more than three decimals in [0, 1]: they run to a higher end.
SPANS_PER_UNIT = 8
#: Numbers of knot intervals in the order of trial, and whether the rates of the ruled motion hold at the joints.
TRIALS = tuple((spans, False) for spans in SPANS[:3]) + tuple((spans, True) for spans in SPANS[1:])
#: Share of the allowance that a curve may take at its samples.
SHARE = 0.95
#: An allowance below this share of the tolerance is nothing.
LEAST_ALLOWANCE = 1e-3
#: Samples on curves that are worked on at a time: their intermediate arrays fit the processor's cache.
CHUNK = 1 << 15


@dataclass(frozen=True)
class CurveGroup:
    """Curves that share a knot vector: g curves with p control points each.

    A block holds the knot, X Y Z, both rotary words and the weight of one control point (FANUC B-63324EN/03 4.17); the
    last four knots have blocks of their own. The first control point is the current position.
    """

    smoothed: SmoothProgram
    row: Ints  #: (g,) rows of `Corners`, ascending
    knots: Floats  #: (p + 4,) as they are to be written: from 0, with three decimals at most
    #: (g, p) as they are to be written: with three decimals at most. All of a curve may have a power of two as common
    #: factor.
    weights: Floats
    angles: Floats  #: (g, p, 2), degrees; control points of the rotary angles in the order of `Machine.axes`

    def __len__(self) -> int:
        return len(self.row)

    @property
    def points(self) -> int:
        """Control points of each curve."""
        return int(self.angles.shape[1])

    def tips(self, chosen: slice) -> Floats:
        """Control points of the tip of some curves, in mm: the same curves as those of the five points, exactly."""
        rows = self.row[chosen]
        tip = tip_points(self.smoothed, rows)
        spans = self.points - nurbs.DEGREE
        if spans == SPANS[0]:
            return tip
        return nurbs.refinement(spans).control_points(tip, nurbs.full_weights(self.smoothed.corners.weights[rows]))


@dataclass(frozen=True)
class RotaryCurves:
    """Smoothed corners in rotary angles, and the straight motion between them."""

    #: by the number of control points: 5, 7, 11, 19, 35; every smoothed corner is in one of them or in `lines`
    groups: tuple[CurveGroup, ...]
    lines: CornerLines  #: corners that no curve meets, as points of dense lines
    points: Ints  #: (k,) control points of each row of `Corners`; 0 where it is not smoothed or belongs to `lines`
    #: (n, 2), degrees; angles at the poses that are passed; NaN where nothing is written (`Status.DUPLICATE`,
    #: `Move.FROM`). At a rounded pose what its axis would need.
    pose_angles: Floats
    inserted: Insertions  #: points that the straight remainders need, as in `RotaryMotion`
    findings: tuple[Finding, ...]  #: those of `rotary_angles`, and of corners that no curve meets


def angle_allowance(smoothed: SmoothProgram, angle_resolution: float) -> Floats:
    """What ε leaves for the fit of the orientation at each corner: (k,) degrees, 0 or more.

    An axis that is off by δ moves the axis point by 2H sin(δ/2). Half of `angle_resolution` (degrees), the step of the
    written angles, is taken off for each of the two.
    """
    settings = smoothed.settings
    height = settings.axis_scale
    left = settings.tolerance - math.sqrt(3) / 2 * settings.tip_resolution - smoothed.corners.axis_error
    left -= height * math.radians(angle_resolution)
    allowance: Floats = np.degrees(2 * np.arcsin(np.clip(left / (2 * height), 0.0, 1.0)))
    return allowance


def rotary_curves(
    smoothed: SmoothProgram,
    machine: Machine,
    *,
    tolerance: float,
    allowance: Floats | None = None,
    angle_resolution: float = 0.0,
) -> RotaryCurves:
    """Control points of the rotary angles for all smoothed corners, on the knots and weights of their tip curves.

    The tool axis may be off that of the ruled motion by the tolerance, degrees, on straight motion, and by the
    allowance (k,) (`angle_allowance`) on the curve of each row of `Corners`; those with nothing left become `lines`.
    `angle_resolution` is the step of the written angles. CS254: a method in which more than one parameter drives P and
    Q. CS255: a tolerance that is not positive. InputError as in `rotary_angles`.
    """
    if not METHODS[smoothed.settings.method].one_parameter:
        raise SettingsError(
            "CS254",
            f"method {smoothed.settings.method} has no curves in rotary axes",
            f"use the method {DEFAULT_METHOD}, or write lines",
        )
    corners = smoothed.corners
    allowed = np.full(len(corners), tolerance) if allowance is None else np.minimum(allowance, tolerance)
    if not tolerance > 0:
        raise SettingsError("CS255", f"orientation tolerance is {tolerance:g} deg", "give a positive angle")
    allowed = np.where(allowed < LEAST_ALLOWANCE * tolerance, 0.0, allowed)
    motion = rotary_motion(smoothed, machine, tolerance, allowed, angle_resolution)
    work = _Work(smoothed, machine, motion, allowed)
    found, pending = [], np.arange(len(motion.rows))
    for spans, ruled in TRIALS:
        more, pending = work.trial(spans, ruled, pending)
        found += more
    lines = corner_lines(smoothed, machine, motion, pending)
    findings = motion.findings + _lines_finding(smoothed, machine, motion.rows[pending])
    rows, pose_angles, inserted = motion.rows, motion.pose_angles, motion.inserted
    del work, motion  # as large as what is made of it
    groups, points = [], np.zeros(len(corners), np.int64)
    for spans in SPANS:
        if same := [part for part in found if part.angles.shape[1] == spans + nurbs.DEGREE]:
            groups.append(_group(smoothed, rows, spans, same))
            points[groups[-1].row] = groups[-1].points
    return RotaryCurves(tuple(groups), lines, points, pose_angles, inserted, findings)


@dataclass(frozen=True)
class _Found:
    """Curves that keep their tolerance: numbers of corners in `RotaryMotion.rows`, and `CurveGroup.angles`."""

    numbers: Ints
    angles: Floats


@dataclass(frozen=True)
class _Work:
    """All smoothed corners; methods take their numbers in `RotaryMotion.rows`."""

    smoothed: SmoothProgram
    machine: Machine
    motion: RotaryMotion
    allowed: Floats

    def trial(self, spans: int, ruled: bool, chosen: Ints) -> tuple[list[_Found], Ints]:
        """Curves on so many knot intervals, and the corners that are left over."""
        found, open_ = [], [chosen[:0]]
        if spans == SPANS[0]:
            corners, rows = self.smoothed.corners, self.motion.rows[chosen]
            even = self.motion.even[corners.pose[rows]] & self.motion.even[corners.after[rows]]
            open_.append(chosen[~even])
            chosen = chosen[even]
        size = max(1, CHUNK // (MEASURE_SAMPLES * spans))
        for begin in range(0, len(chosen), size):
            part = chosen[begin : begin + size]
            points, error = self.curves(spans, ruled, part)
            met = error <= SHARE * self.allowed[self.motion.rows[part]]
            if met.any():
                found.append(_Found(part[met], points[met]))
            open_.append(part[~met])
        return found, np.sort(np.concatenate(open_))

    def curves(self, spans: int, ruled: bool, chosen: Ints) -> tuple[Floats, Floats]:
        """Angle control points (g, p, 2) of some corners, and their errors (g,): infinite outside of the limits."""
        refined, targets = nurbs.refinement(spans), self.targets(chosen, ruled)
        if spans == SPANS[0]:
            start, end = end_points(refined, targets)
            middle = (start[:, 2:] + end[:, :1]) / 2  # the same, but for where two transitions are joined
            points = np.concatenate((start[:, :2], middle, end[:, 1:]), axis=1)
        else:
            fitted = fit_samples(refined)
            points = fit(self.machine, refined, targets, self.exact(targets, chosen, fitted), fitted)
        error, extremes = measured(self.machine, refined, targets, points)
        limits = self.machine.limits
        slack = self.allowed[self.motion.rows[chosen], None]
        inside = (extremes[:, :, 0] >= limits[:, 0] - slack) & (extremes[:, :, 1] <= limits[:, 1] + slack)
        return points, np.where(inside.all(axis=1), error, np.inf)

    def targets(self, chosen: Ints, ruled: bool) -> Targets:
        """What the curves of some corners have to follow."""
        corners, motion = self.smoothed.corners, self.motion
        rows = motion.rows[chosen]
        weights = nurbs.full_weights(corners.weights[rows])
        slope, bend = (part[:, None] for part in leg_derivatives(weights, corners.ratio[rows]))
        conditions = []
        for side, pose, trim in (
            (motion.ruled_end if ruled else motion.end, corners.pose[rows], corners.trim_in[rows, None]),
            (motion.ruled_start if ruled else motion.start, corners.after[rows], -corners.trim_out[rows, None]),
        ):
            along, across = trim * side.slope[pose], trim**2 * side.bend[pose]
            conditions.append((side.angles[pose], along * slope, along * bend + across * slope**2))
        return Targets(lever_points(self.smoothed, rows), weights, conditions[0], conditions[1])

    def exact(self, targets: Targets, chosen: Ints, samples: Floats) -> Floats:
        """Angles that give the wanted axes of some corners at common parameters: (g, m, 2) degrees."""
        guess, branch = self.motion.followed.interpolated(chosen, samples)
        axis = targets.axis(samples).reshape(-1, 3)
        angles, _ = continued(self.machine, axis, guess.reshape(-1, 2), branch.ravel(), self.motion.cone)
        return angles.reshape(guess.shape)


def _group(smoothed: SmoothProgram, smooth_rows: Ints, spans: int, found: list[_Found]) -> CurveGroup:
    """All curves on so many knot intervals, as they are to be written; `smooth_rows` as in `RotaryMotion.rows`."""
    refined = nurbs.refinement(spans)
    numbers = np.sort(np.concatenate([part.numbers for part in found]))
    rows = smooth_rows[numbers]
    angles = np.empty((len(rows), refined.points, 2))
    for part in found:
        angles[np.searchsorted(numbers, part.numbers)] = part.angles
    own = refined.homogeneous(nurbs.full_weights(smoothed.corners.weights[rows]))
    return CurveGroup(
        smoothed=smoothed,
        row=rows,
        knots=refined.knots * max(1, spans // SPANS_PER_UNIT),
        weights=np.round(own * weight_factors(own)[:, None], WEIGHT_DECIMALS),
        angles=angles,
    )


def _lines_finding(smoothed: SmoothProgram, machine: Machine, lines: Ints) -> tuple[Finding, ...]:
    """Corners that have to be written as lines."""
    if not len(lines):
        return ()
    first = int(smoothed.program.line[smoothed.corners.pose[lines[0]]])
    text = f"no curve in {' and '.join(machine.names)} keeps the tolerance at this corner: it is written as lines"
    return (Finding("CS366", "note", first, text, len(lines)),)


def weight_factors(weights: Floats) -> Floats:
    """Smallest powers of two (g,) that leave refined weights (g, p) no more decimals than controls keep.

    The own five weights of each curve have no more decimals than that.
    """
    factors = np.ones(len(weights))
    scale = 10.0**WEIGHT_DECIMALS
    pending = np.arange(len(weights))
    # Dyadic parameters have at most log2(spans / 2) binary digits, three of them make a blossom, the knot ½ two more.
    for _ in range(3 * (SPANS[-1].bit_length() - 2) + 2):
        ticks = weights[pending] * (factors[pending] * scale)[:, None]
        inexact = (np.abs(ticks - np.round(ticks)) > 1e-6).any(axis=1)
        pending = pending[inexact]
        if not len(pending):
            break
        factors[pending] *= 2.0
    return factors
