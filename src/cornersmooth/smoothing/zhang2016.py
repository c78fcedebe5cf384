"""`method="zhang2016"`: the paper as published (docs/method.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, Final

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.model import Corners, Floats, Ints, LimitedBy, Program, SmoothProgram, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import (
    Construction,
    Legs,
    Placed,
    Progress,
    divide,
    half_cosine,
    refuse_turns,
    with_rows,
)
from cornersmooth.smoothing.segments import Segments
from cornersmooth.smoothing.self_check import straying_remainders, straying_transitions
from cornersmooth.smoothing.synchronise import REPORT_PARAMETERS, matching_parameters, synchronisation_report
from cornersmooth.vectors import angle_between, dot, norm, unit

#: what `Corners.extra` holds: the largest ``||Q−P|−H|`` that the synchronisation leaves (mm), and the jumps of the axis
#: at both ends of the transition (rad)
EXTRA = ("sync_residual", "jump_in", "jump_out")

#: part of the tolerance for corners that leave it: the bound (10) holds for each curve, not for the synchronised motion
_SMALLER: Final = 0.99


class Zhang2016(Construction):
    """The paper as published: every curve trimmed on its own, with a parameter of its own."""

    extra = EXTRA

    def smooth(
        self, program: Program, settings: Settings, progress: Progress | None = None, processes: int = 1
    ) -> SmoothProgram:
        """Smooth a whole program; corners whose motion leaves the tolerance get a smaller one, or stay sharp."""
        smoothed = super().smooth(program, settings, progress, processes)
        rows = straying_transitions(smoothed)
        if len(rows):
            smaller = super().smooth(program, settings.but(tolerance=_SMALLER * settings.tolerance), None, processes)
            smoothed = replace(smoothed, corners=with_rows(smoothed.corners, smaller.corners, rows))
        for strays in (straying_transitions, straying_remainders):
            rows = strays(smoothed)
            if len(rows):
                smoothed = replace(smoothed, corners=_left_sharp(smoothed.corners, rows))
        return smoothed

    def place(self, legs: Legs, settings: Settings) -> Placed:
        """Trim tip and axis-point segments each on its own, as the paper does: equations (10), (15), (16) and (19).

        (16) and (19) give the curve with the larger sine the tolerance and the other one its share by the ratio of the
        sines; put into (15) that is one and the same length for both: 3(w1+w2)ε/(2·w1·max(sin α/2, sin β/2)).
        """
        tip, axis = (legs.tip_in, legs.tip_out), (legs.tip_in + legs.turn_in, legs.tip_out + legs.turn_out)
        (tip_sizes, tip_sine), (axis_sizes, axis_sine) = _turn(*tip), _turn(*axis)
        g = len(tip_sine)
        factor = 2.0 * nurbs.deviation_factor(
            np.array(settings.weights), settings.ratio
        )  # 2·w1/(3(w1+w2)) in the paper
        by_tolerance = np.minimum(
            divide(settings.common_tolerance, factor * tip_sine),
            divide(settings.axis_point_tolerance, factor * axis_sine),
        )
        tip_length, axis_length = (
            np.minimum(np.minimum(*sizes) / 2.0, by_tolerance) for sizes in (tip_sizes, axis_sizes)
        )

        status = np.full(g, Status.SMOOTHED, np.uint8)
        status[(tip_sine == 0.0) & (axis_sine == 0.0)] = Status.STRAIGHT
        sizes = np.hypot(tip_sizes[0], axis_sizes[0]) * np.hypot(tip_sizes[1], axis_sizes[1])
        cosine = (dot(*tip) + dot(*axis)) / sizes
        refuse_turns(status, cosine, half_cosine(legs, settings.axis_length), settings)
        short = np.maximum(tip_length, axis_length) <= 4.0 * settings.tip_resolution
        status[(status == Status.SMOOTHED) & short] = Status.TOO_SHORT
        smoothed = status == Status.SMOOTHED
        tip_length, axis_length = np.where(smoothed, tip_length, 0.0), np.where(smoothed, axis_length, 0.0)
        by_segment = (tip_length < by_tolerance) | (axis_length < by_tolerance)
        limited_by = np.where(by_segment, LimitedBy.SEGMENT, LimitedBy.TOLERANCE).astype(np.uint8)
        limited_by[~smoothed] = LimitedBy.NOTHING

        tip_trims, axis_trims = (
            [np.divide(length, size, out=np.zeros(g), where=size > 0.0) for size in sizes]
            for length, sizes in ((tip_length, tip_sizes), (axis_length, axis_sizes))
        )
        *left, orientation = synchronisation_report(
            (tip_trims[0][:, None] * tip[0], tip_trims[1][:, None] * tip[1]),
            (axis_trims[0][:, None] * axis[0], axis_trims[1][:, None] * axis[1]),
            settings.axis_length * legs.axis,
            np.broadcast_to(np.array(settings.weights), (g, 2)),
            np.broadcast_to(np.float64(settings.ratio), (g,)),
            settings.axis_length,
        )
        return Placed(
            status,
            limited_by,
            *(tip_trims[0], tip_trims[1], axis_trims[0], axis_trims[1]),
            tip_error=factor * tip_length * tip_sine,  # equation (10)
            axis_error=factor * axis_length * axis_sine,
            orientation_error=np.where(smoothed, orientation, 0.0),
            extra={name: np.where(smoothed, values, np.nan) for name, values in zip(EXTRA, left, strict=True)},
        )

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

    def divide(self, smoothed: SmoothProgram, segments: Segments, pose: Ints, number: int) -> tuple[Floats, Floats]:
        """Equal parts of the tip segment and of the great circle: equations (24) to (28)."""
        tip, axes, start = smoothed.program.tip, smoothed.program.axis, segments.start[pose]
        height, step = smoothed.settings.axis_length, tip[pose] - tip[start]
        axis_step = step + height * (axes[pose] - axes[start])
        low, high = segments.entry[pose, None], segments.exit[pose, None]
        both = (low, segments.axis_entry[pose, None]), (high, segments.axis_exit[pose, None])
        ends = [height * axes[start] + of_axis * axis_step - of_tip * step for of_tip, of_axis in both]
        share = np.arange(1, number) / number
        fraction: Floats = low + share * (high - low)
        axis = _great_circle(unit(ends[0]), unit(ends[1]), share)
        # the motion that all methods are measured against is ruled: where the two differ by more than a line may
        ruled = unit(ends[0][:, None] + share[:, None] * (ends[1] - ends[0])[:, None])
        apart = height * norm(axis - ruled).max(axis=1) > smoothed.settings.interpolation_tolerance
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


def _turn(leg_in: Floats, leg_out: Floats) -> tuple[tuple[Floats, Floats], Floats]:
    """Lengths of legs, and the sine of half the angle between them; 0 where a leg has no length (no direction)."""
    sizes = norm(leg_in), norm(leg_out)
    return sizes, np.where(np.minimum(*sizes) > 0.0, norm(unit(leg_out) - unit(leg_in)) / 2.0, 0.0)


def _left_sharp(corners: Corners, rows: Ints) -> Corners:
    k = len(corners)
    names = (item.name for item in fields(Corners) if "trim" in item.name or "error" in item.name)
    nothing: dict[str, Any] = dict.fromkeys(names, np.zeros(k))
    status, limited_by = np.full(k, Status.STRAYS, np.uint8), np.full(k, LimitedBy.NOTHING, np.uint8)
    return with_rows(corners, replace(corners, status=status, limited_by=limited_by, extra={}, **nothing), rows)


def _great_circle(one: Floats, other: Floats, share: Floats) -> Floats:
    """Unit vectors (g, m, 3) from `one` (g, 3) to `other` at shares (m,) of the angle: what equation (27) means."""
    angle, share = angle_between(one, other)[:, None, None], share[:, None]
    one, other = one[:, None], other[:, None]
    sine = np.sin(angle)
    turned = np.sin((1.0 - share) * angle) * one + np.sin(share * angle) * other
    return unit(np.where(sine < 1e-12, (1.0 - share) * one + share * other, turned))
