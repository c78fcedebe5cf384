"""`method="zhang2016"`: the paper as published (docs/method.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any, Final

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.model import Bools, Corners, Floats, Ints, LimitedBy, Program, SmoothProgram, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import Construction
from cornersmooth.smoothing.corner_table import (
    Legs,
    Placed,
    Remainders,
    divide,
    half_angle_cosine,
    with_rows,
)
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import Segments, lines_of, segments_of
from cornersmooth.smoothing.self_check import distances, passing
from cornersmooth.smoothing.synchronise import REPORT_PARAMETERS, matching_parameters, synchronisation_report
from cornersmooth.vectors import angle_between, dot, norm, unit

#: what `Corners.extra` holds: the largest ``||Q−P|−H|`` that the synchronisation leaves (mm), and the jumps of the axis
#: at both ends of the transition (rad)
EXTRA = ("sync_residual", "jump_in", "jump_out")

#: parameters at which transitions are measured, u = ½ in the middle, and corners measured at once
_SAMPLES: Final = np.linspace(0.0, 1.0, 17)
_MEASURED: Final = 1024

#: part of the tolerance for corners that leave it: the bound (10) holds for each curve, not for the synchronised motion
_SMALLER: Final = 0.99

#: for the last digits of sums
_HAIR: Final = 1.0 + 1e-9

#: parts in which what is left of segments is measured
_PARTS: Final = 16

#: how far tip and axis point may be from a common pose, in what is allowed for each: nearly what verification allows
_TOGETHER: Final = 1.8

#: steps back that the digits of most controls do not show, mm
_LEAST_BACK: Final = 1e-4


def place_zhang2016(legs: Legs, settings: Settings) -> Placed:
    """Trim tip and axis-point segments each on its own, as the paper does: equations (10), (15), (16) and (19).

    (16) and (19) give the curve with the larger sine the tolerance and the other one its share by the ratio of the
    sines; put into (15) that is one and the same length for both: 3(w1+w2)ε/(2·w1·max(sin α/2, sin β/2)).
    """
    axis_in, axis_out = legs.tip_in + legs.turn_in, legs.tip_out + legs.turn_out
    tip_lengths = norm(legs.tip_in), norm(legs.tip_out)
    axis_lengths = norm(axis_in), norm(axis_out)
    sine_tip = _half_turn_sine(legs.tip_in, legs.tip_out, *tip_lengths)
    sine_axis = _half_turn_sine(axis_in, axis_out, *axis_lengths)
    weights = np.broadcast_to(np.array(settings.weights), (len(sine_tip), 2))
    ratio = np.broadcast_to(np.float64(settings.ratio), (len(sine_tip),))
    factor = 2.0 * nurbs.deviation_factor(weights, ratio)  # 2·w1/(3(w1+w2)) at the paper's ratio
    by_tolerance = np.minimum(
        divide(settings.common_tolerance, factor * sine_tip), divide(settings.axis_point_tolerance, factor * sine_axis)
    )
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
        extra={
            name: np.where(smoothed, values, np.nan)
            for name, values in zip(EXTRA, (residual, jump_in, jump_out), strict=True)
        },
    )


def _half_turn_sine(leg_in: Floats, leg_out: Floats, length_in: Floats, length_out: Floats) -> Floats:
    """Sine of half the angle between the legs; 0 where a leg has no length (equation (9) has no direction there)."""
    proper = (length_in > 0.0) & (length_out > 0.0)
    safe_in, safe_out = np.where(proper, length_in, 1.0), np.where(proper, length_out, 1.0)
    difference = leg_out / safe_out[:, None] - leg_in / safe_in[:, None]
    return np.where(proper, norm(difference) / 2.0, 0.0)


class Zhang2016(Construction):
    """The paper as published: every curve trimmed on its own, with a parameter of its own."""

    extra = EXTRA

    def smooth(
        self,
        program: Program,
        settings: Settings,
        progress: Callable[[int, int], None] | None = None,
        processes: int = 1,
    ) -> SmoothProgram:
        """Smooth a whole program; corners whose motion leaves the tolerance get a smaller one, or stay sharp."""
        smoothed = super().smooth(program, settings, progress, processes)
        rows = _straying_transitions(smoothed)
        if len(rows):
            smaller = super().smooth(program, settings.but(tolerance=_SMALLER * settings.tolerance), None, processes)
            smoothed = replace(smoothed, corners=with_rows(smoothed.corners, smaller.corners, rows))
        for strays in (_straying_transitions, _straying_remainders):
            rows = strays(smoothed)
            if len(rows):
                smoothed = replace(smoothed, corners=_left_sharp(smoothed.corners, rows))
        return smoothed

    def place(self, legs: Legs, settings: Settings) -> Placed:
        """Trim by the paper's equations; half of each segment is the most."""
        return place_zhang2016(legs, settings)

    def points(self, smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
        """The axis-point curve at the synchronised parameters."""
        corners, height = smoothed.corners, smoothed.settings.axis_length
        weights = corners.weights[rows]
        tip_curve, axis_curve = nurbs.control_points(smoothed.program, corners, rows, height)
        v, _ = matching_parameters(tip_curve, axis_curve, weights, u, height)
        points = nurbs.evaluate(tip_curve, weights, np.concatenate(([0.0], u)))
        tops = nurbs.evaluate(axis_curve, weights, np.concatenate((np.zeros((len(rows), 1)), v), axis=1))
        tops[:, -1] = axis_curve[:, -1]  # the straight motion behind starts from its own axis: equation (26)
        return points, tops - points

    def divide(
        self, program: Program, settings: Settings, remainders: Remainders, number: int
    ) -> tuple[Floats, Floats]:
        """Equal parts of the tip segment and of the great circle: equations (24) to (28)."""
        height = settings.axis_length
        start = program.axis[remainders.start]
        step = program.tip[remainders.end] - program.tip[remainders.start]
        axis_step = step + height * (program.axis[remainders.end] - start)
        ends = [height * start + remainders.axis[:, [at]] * axis_step - remainders.tip[:, [at]] * step for at in (0, 1)]
        share = np.arange(1, number) / number
        fraction: Floats = remainders.tip[:, :1] + share * (remainders.tip[:, 1:] - remainders.tip[:, :1])
        axis = _great_circle(unit(ends[0]), unit(ends[1]), share)
        # the motion that all methods are measured against is ruled: where the two differ by more than a line may
        ruled = unit(ends[0][:, None] + share[:, None] * (ends[1] - ends[0])[:, None])
        apart = height * norm(axis - ruled).max(axis=1) > settings.interpolation_tolerance
        return fraction, np.where(apart[:, None, None], ruled, axis)

    def axes(self, program: Program, corners: Corners, settings: Settings, rows: Ints, u: Floats) -> Floats:
        """Axes with the axis-point curve at its own parameter v(u): equations (20) to (22).

        v(u) is followed from u = 0 over a common set of parameters and interpolated in between.
        """
        distinct, which = np.unique(rows, return_inverse=True)
        tip_curve, axis_curve = nurbs.control_points(program, corners, distinct, settings.axis_length)
        weights = corners.weights[distinct]
        v, _ = matching_parameters(tip_curve, axis_curve, weights, REPORT_PARAMETERS, settings.axis_length)
        cell = np.clip(np.searchsorted(REPORT_PARAMETERS, u, side="right") - 1, 0, len(REPORT_PARAMETERS) - 2)
        part = (u - REPORT_PARAMETERS[cell]) / (REPORT_PARAMETERS[cell + 1] - REPORT_PARAMETERS[cell])
        at = v[which, cell] + part * (v[which, cell + 1] - v[which, cell])
        tips = nurbs.evaluate(tip_curve[which], weights[which], u[:, None])[:, 0]
        return unit(nurbs.evaluate(axis_curve[which], weights[which], at[:, None])[:, 0] - tips)

    def report_columns(self, corners: Corners, rows: Ints) -> dict[str, Floats]:
        """What the synchronisation leaves at every corner."""
        residual, jump_in, jump_out = (corners.extra[name][rows] for name in EXTRA)
        return {
            "sync_residual_mm": residual,
            "joint_jump_in_deg": np.degrees(jump_in),
            "joint_jump_out_deg": np.degrees(jump_out),
        }

    def report_summary(self, corners: Corners) -> dict[str, float]:
        """The largest of what the synchronisation leaves."""
        residual, jump_in, jump_out = (corners.extra[name][corners.smoothed] for name in EXTRA)
        jump = max(jump_in.max(initial=0.0), jump_out.max(initial=0.0))
        return {
            "max_sync_residual_mm": float(residual.max(initial=0.0)),
            "max_joint_jump_deg": float(np.degrees(jump)),
        }

    def summary_text(self, summary: Mapping[str, Any]) -> str:
        """One line about what the synchronisation leaves."""
        return (
            f"largest ||Q-P|-H| {summary['max_sync_residual_mm']:.4g} mm, "
            f"largest jump of the axis at a joint {summary['max_joint_jump_deg']:.4g} deg"
        )


CONSTRUCTION = Zhang2016()


def _straying_transitions(smoothed: SmoothProgram) -> Ints:
    """Rows of corners whose transitions stray."""
    return _those(np.flatnonzero(smoothed.corners.smoothed), lambda rows: _strays(smoothed, rows))


def _those(rows: Ints, stray: Callable[[Ints], Bools]) -> Ints:
    """Rows that stray, looked at some at once."""
    parts = np.split(rows, np.arange(_MEASURED, len(rows), _MEASURED))
    return np.concatenate([part[stray(part)] for part in parts if len(part)] or [rows])


def _straying_remainders(smoothed: SmoothProgram) -> Ints:
    """Rows of corners beside segments of which the transitions leave what strays.

    There tip and axis are out of step by what the two were cut unlike.
    """
    segments = segments_of(smoothed, dense=False)
    unlike = (segments.entry != segments.axis_entry) | (segments.exit != segments.axis_exit)
    pose = np.flatnonzero(unlike & segments.has_line & (segments.start >= 0))
    pose = _those(pose, lambda some: _remainder_strays(smoothed, segments, some))
    rows = np.unique(segments.row[np.concatenate((segments.start[pose], pose))])
    beside: Ints = rows[rows >= 0]
    return beside


def _strays(smoothed: SmoothProgram, rows: Ints) -> Bools:
    """(g,) whether transitions stray, as synchronised lines or, as controls run both curves, at common parameters."""
    found = np.zeros(len(rows), np.bool_)
    number = lines_of(smoothed, rows)
    for count in np.unique(number):
        same = np.flatnonzero(number == count)
        tips, levers = CONSTRUCTION.points(smoothed, rows[same], nodes(int(count)))
        found[same] = _beyond(smoothed, rows[same], _halved(tips), _halved(unit(levers)))
    tip_curve, axis_curve = nurbs.control_points(
        smoothed.program, smoothed.corners, rows, smoothed.settings.axis_length
    )
    tips, tops = (nurbs.evaluate(one, smoothed.corners.weights[rows], _SAMPLES) for one in (tip_curve, axis_curve))
    return found | _beyond(smoothed, rows, tips, tops - tips)


def _beyond(smoothed: SmoothProgram, rows: Ints, tip: Floats, lever: Floats) -> Bools:
    """(g,) whether sampled transitions are farther from the original than the method allows."""
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    poses = np.stack((corners.before[rows], corners.pose[rows], corners.after[rows]), axis=1)
    axis = unit(lever)
    found = _off_the_motion(smoothed, poses, tip, axis)
    corner, direction, height = program.tip[poses[:, 1]], program.axis[poses[:, 1]], settings.axis_scale
    passed = passing(corner, tip)
    away = tip - corner[:, None], height * (axis - direction[:, None])
    if settings.axis_tolerance is None:
        passed = np.maximum(passed, passing(corner + height * direction, tip + height * axis))
        away = away[0], away[0] + away[1]
    at_corner = np.maximum(norm(away[0]), norm(away[1]))
    if settings.lines == "long":  # of the points around the corner only that of its own parameter is sure to be kept
        passed = np.maximum(passed, at_corner[:, tip.shape[1] // 2])
    elif settings.axis_tolerance is not None:  # both at one pose
        passed = np.maximum(passed, at_corner.min(axis=1))
    return found | (passed > _HAIR * settings.common_tolerance)


def _remainder_strays(smoothed: SmoothProgram, segments: Segments, pose: Ints) -> Bools:
    """(g,) whether what is left of the segments into some poses strays, divided as it is written, or as it is run."""
    program, settings = smoothed.program, smoothed.settings
    start = segments.start[pose]
    at = [
        np.stack((one[pose], other[pose]), axis=1)
        for one, other in ((segments.entry, segments.exit), (segments.axis_entry, segments.axis_exit))
    ]
    fraction, axis = CONSTRUCTION.divide(program, settings, Remainders(start, pose, *at), _PARTS)
    tips = (program.tip[pose] - program.tip[start])[:, None]
    tip = program.tip[start][:, None] + fraction[..., None] * tips
    return _off_the_motion(smoothed, np.stack((start, pose), axis=1), tip, axis)


def _off_the_motion(smoothed: SmoothProgram, poses: Ints, tip: Floats, axis: Floats) -> Bools:
    """(g,) whether samples are farther from the original through `poses`, or go back along it by more, than allowed."""
    settings = smoothed.settings
    height, own_axis = settings.axis_scale, settings.axis_tolerance is not None
    alone_tip, alone_axis, together, backwards = distances(
        smoothed.program, height, poses, tip, axis, own_axis=own_axis
    )
    off = together if own_axis else np.maximum(np.maximum(alone_tip, alone_axis), together / _TOGETHER)
    steps = settings.tip_resolution, settings.axis_point_resolution * (height / settings.axis_length), _LEAST_BACK
    beyond: Bools = (off.max(axis=1) > _HAIR * settings.common_tolerance) | (backwards > 2.0 * max(steps))
    return beyond


def _halved(points: Floats) -> Floats:
    """Points (g, m, 3) with those in the middle between them."""
    halved = np.repeat(points, 2, axis=1)[:, :-1]
    halved[:, 1::2] = (points[:, 1:] + points[:, :-1]) / 2.0
    return halved


def _left_sharp(corners: Corners, rows: Ints) -> Corners:
    """Corners without the transitions of some rows."""
    k = len(corners)
    nothing: dict[str, Any] = dict.fromkeys(("tip_error", "axis_error", "orientation_error", *_TRIMS), np.zeros(k))
    status, limited_by = np.full(k, Status.STRAYS, np.uint8), np.full(k, LimitedBy.NOTHING, np.uint8)
    return with_rows(corners, replace(corners, status=status, limited_by=limited_by, extra={}, **nothing), rows)


_TRIMS: Final = tuple(item.name for item in fields(Corners) if "trim" in item.name)


def _great_circle(one: Floats, other: Floats, share: Floats) -> Floats:
    """Unit vectors (g, m, 3) from `one` (g, 3) to `other` at shares (m,) of the angle: what equation (27) means."""
    angle, share = angle_between(one, other)[:, None, None], share[:, None]
    one, other = one[:, None], other[:, None]
    sine = np.sin(angle)
    turned = np.sin((1.0 - share) * angle) * one + np.sin(share * angle) * other
    return unit(np.where(sine < 1e-12, (1.0 - share) * one + share * other, turned))
