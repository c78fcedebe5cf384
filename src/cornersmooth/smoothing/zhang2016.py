"""`method="zhang2016"`: the paper as published (docs/method.md)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cornersmooth.arrays import angle_between, dot, norm, some_rows, unit
from cornersmooth.geometry import nurbs
from cornersmooth.model import Corners, Floats, Ints, LimitedBy, Program, SmoothProgram, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import (
    BATCH,
    Construction,
    Legs,
    Placed,
    Progress,
    divide,
    half_cosine,
    legs_of,
    put,
    refuse_turns,
)
from cornersmooth.smoothing.proportional import EXACT
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import Segments, lines_of, segments_of
from cornersmooth.smoothing.self_check import (
    ENDS,
    Motion,
    Original,
    Parameters,
    Transitions,
    most_taken,
    taken,
)
from cornersmooth.smoothing.synchronise import matching_parameters

#: parameters of the tip curve at which residual and jumps are reported
REPORT_PARAMETERS: Final = np.linspace(0.0, 1.0, 9)

#: what `Corners.extra` holds: the largest ``||Q−P|−H|`` that the synchronisation leaves (mm), the jumps of the axis at
#: both ends of the transition (rad), and the length (15) of a curve whose segments have room for it (mm)
EXTRA = ("sync_residual", "jump_in", "jump_out", "size")

#: rounds of making transitions smaller until they keep the tolerance; parts of a segment at which what transitions
#: leave of it is looked at; by what both its transitions become smaller where it strays, and how often
_ROUNDS: Final = 30
_LEAST_POWER: Final = 0.1
_PARTS: Final = np.array([0.25, 0.5, 0.75])
_SMALLER: Final = 0.7
_TIMES: Final = 12

#: where transitions are looked at that keep a tolerance of the axis: there is no bound for it
_MORE_PARAMETERS: Final = np.linspace(0.0, 1.0, 33)

#: a size whose motion takes the tolerance but for this is the size that just keeps it
_JUST: Final = 1e-6


class Zhang2016(Construction):
    """The paper as published: every curve trimmed on its own, with a parameter of its own."""

    extra = EXTRA

    def smooth(
        self, program: Program, settings: Settings, progress: Progress | None = None, processes: int = 1
    ) -> SmoothProgram:
        """Smooth a whole program; corners beside segments whose rest strays get smaller, or stay sharp."""
        smoothed = super().smooth(program, settings, progress, processes)
        corners, every = smoothed.corners, np.arange(len(smoothed.corners))

        def again(rows: Ints, most: Floats) -> None:
            for part in np.split(np.arange(len(rows)), np.arange(BATCH, len(rows), BATCH)):
                legs = legs_of(smoothed, rows[part])
                placed = self.sized(legs, settings, most[part])
                if np.isfinite(most[part]).all():
                    placed.status[placed.status == Status.TOO_SHORT] = Status.STRAYS
                put(corners, rows[part], placed, legs.shift)

        rows = np.flatnonzero(corners.status == Status.STRAYS)
        again(rows, np.full(len(rows), np.inf))
        rows = np.union1d(straying_lines(smoothed, every), straying_remainders(smoothed))
        for number in range(_TIMES):
            if not len(rows):
                break
            again(rows, (0.0 if number == _TIMES - 1 else _SMALLER) * corners.extra["size"][rows])
            rows = np.union1d(straying_lines(smoothed, rows), straying_remainders(smoothed, rows))
        return smoothed

    def place(self, legs: Legs, settings: Settings) -> Placed:
        """Trim tip and axis-point segments each on its own, as the paper does; what does not keep ε so strays."""
        return self.sized(legs, settings, np.full(len(legs.axis), np.inf), rounds=1)

    def sized(self, legs: Legs, settings: Settings, most: Floats, rounds: int = _ROUNDS) -> Placed:
        """Place transitions (g,) of a length of at most `most`, mm, that just keeps ε: equations (10) to (16) and (19).

        (16) and (19) give the curve with the larger sine the tolerance and the other one its share by the ratio of the
        sines; put into (15) that is one and the same length for both: 3(w1+w2)ε/(2·w1·max(sin α/2, sin β/2)).
        """
        original = Original.of(legs, settings)
        segments = original.segments
        sizes, sines = norm(segments), norm(unit(segments[:, :, 1]) - unit(segments[:, :, 0])) / 2.0
        sines[sizes.min(axis=2) == 0.0] = 0.0  # a leg of no length has no direction
        g = len(sines)
        factor = 2.0 * nurbs.DEVIATION  # 2·w1/(3(w1+w2)) in the paper
        allowed = np.array((settings.common_tolerance, settings.axis_point_tolerance)) + original.spare[:, None]
        by_tolerance = divide(allowed, factor * sines).min(axis=1)
        halves = sizes.min(axis=2) / 2.0

        status = np.full(g, Status.SMOOTHED, np.uint8)
        status[(sines == 0.0).all(axis=1)] = Status.STRAIGHT
        cosine = dot(segments[:, :, 0], segments[:, :, 1]).sum(axis=1) / norm(np.swapaxes(sizes, 1, 2)).prod(axis=1)
        refuse_turns(status, cosine, half_cosine(legs, settings.axis_length), settings)

        # the size: the length (15) of both curves where their segments have room for it
        size = np.minimum(np.minimum(by_tolerance, halves.max(axis=1)), most)
        rows = np.flatnonzero(status == Status.SMOOTHED)
        found, last, step, power = np.zeros((4, g)), np.ones(g), np.ones(g), np.ones(g)
        for number in range(rounds):
            lengths = np.minimum(halves[rows], size[rows, None])
            found[:, rows], share = _measured(_trimmed(some_rows(original, rows), sizes[rows], lengths, settings))
            over = share > 1.0 + EXACT
            rows, share = rows[over], share[over]
            if not len(rows):
                break
            if number:  # the share goes with a power of the size: a secant of the logarithms
                power[rows] = np.clip(np.log(last[rows] / share) / -np.log(step[rows]), _LEAST_POWER, 1.0)
            keeping = (1.0 - _JUST) / share
            last[rows], step[rows] = share, np.maximum(keeping ** (1.0 / power[rows]), np.minimum(keeping, 0.5))
            size[rows] *= step[rows] if number < _ROUNDS // 2 else 0.5
        status[rows] = Status.STRAYS
        lengths = np.minimum(halves, size[:, None])
        status[(status == Status.SMOOTHED) & (lengths.max(axis=1) <= 4.0 * settings.tip_resolution)] = Status.TOO_SHORT
        smoothed = status == Status.SMOOTHED
        lengths[~smoothed] = 0.0
        by_segment = (halves.min(axis=1) < size) | (halves.max(axis=1) <= size)
        limited_by = np.where(by_segment, LimitedBy.SEGMENT, LimitedBy.TOLERANCE).astype(np.uint8)
        limited_by[~smoothed] = LimitedBy.NOTHING
        (tip_in, tip_out), (axis_in, axis_out) = np.moveaxis(_trimmed(original, sizes, lengths, settings).trims, 0, -1)
        tip_error, axis_error = (factor * lengths * sines).T  # equation (10)
        found[:3, ~smoothed], found[3, ~smoothed], size[~smoothed] = np.nan, 0.0, np.nan
        extra = dict(zip(EXTRA, (*found[:3], size), strict=True))
        trims = tip_in, tip_out, axis_in, axis_out
        return Placed(status, limited_by, *trims, tip_error, axis_error, found[3], extra)

    def points(self, smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
        """The axis-point curve at the synchronised parameters: equations (20) to (22) and, at the ends, (26)."""
        corners, height = smoothed.corners, smoothed.settings.axis_length
        tip_curve, axis_curve = nurbs.control_points(smoothed.program, corners, rows, height)
        v, _ = matching_parameters(tip_curve, axis_curve, u, height)
        points = nurbs.evaluate(tip_curve, np.concatenate(([0.0], u)))
        tops = nurbs.evaluate(axis_curve, np.concatenate((np.zeros((len(rows), 1)), v), axis=1))
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
        """Axes with the axis-point curve at its own parameter v(u): equations (20) to (23).

        v(u) is followed from u = 0 over a common set of parameters and interpolated in between.
        """
        distinct, which = np.unique(rows, return_inverse=True)
        tip_curve, axis_curve = nurbs.control_points(program, corners, distinct, settings.axis_length)
        v, _ = matching_parameters(tip_curve, axis_curve, REPORT_PARAMETERS, settings.axis_length)
        cell = np.clip(np.searchsorted(REPORT_PARAMETERS, u, side="right") - 1, 0, len(REPORT_PARAMETERS) - 2)
        part = (u - REPORT_PARAMETERS[cell]) / (REPORT_PARAMETERS[cell + 1] - REPORT_PARAMETERS[cell])
        at = v[which, cell] + part * (v[which, cell + 1] - v[which, cell])
        tips = nurbs.evaluate(tip_curve[which], u[:, None])[:, 0]
        return unit(nurbs.evaluate(axis_curve[which], at[:, None])[:, 0] - tips)

    def report_columns(self, corners: Corners, rows: Ints) -> dict[str, Floats]:
        """What the synchronisation leaves at every corner."""
        residual, jump_in, jump_out = (corners.extra[name][rows] for name in EXTRA[:3])
        return {
            "sync_residual_mm": residual,
            "joint_jump_in_deg": np.degrees(jump_in),
            "joint_jump_out_deg": np.degrees(jump_out),
        }

    def report_summary(self, corners: Corners) -> dict[str, float]:
        """The largest of what the synchronisation leaves."""
        residual, jump_in, jump_out = (corners.extra[name][corners.smoothed] for name in EXTRA[:3])
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


def _trimmed(original: Original, sizes: Floats, lengths: Floats, settings: Settings) -> Transitions:
    """Transitions of lengths (g, 2) on segments of some sizes (g, 2, 2); a segment of no size has none."""
    trims = np.divide(lengths[..., None], sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
    return Transitions(trims, original, settings)


def _measured(made: Transitions) -> tuple[tuple[Floats, ...], Floats]:
    """Residual, jumps and turn of transitions, and what of the tolerances they take (g,)."""
    settings = made.settings
    u = REPORT_PARAMETERS if settings.axis_tolerance is None else _MORE_PARAMETERS
    v, residual = made.synchronised(u)
    most, report = residual.max(axis=1), made.report(u, (u, v))
    if settings.round_feed_changes:
        parameters, missing = _joined(u, v), np.maximum(most, made.missing(ENDS))
    else:  # controls run curves at common parameters
        parameters = u, u[None]
        missing = made.missing(parameters)
    off, share = made.bounded(parameters, missing)
    doubtful = np.flatnonzero(share > 1.0)
    passing = off[doubtful] + settings.chord if settings.round_feed_changes else None
    some = made.some(doubtful)
    middle = len(parameters[0]) // 2
    share[doubtful] = most_taken(some.motion(_of(parameters, doubtful)), some.original, settings, middle, passing)
    return (most, *report), share


def _of(parameters: Parameters, rows: Ints) -> Parameters:
    """Those of some corners."""
    u, v = parameters
    return u, v if len(v) == 1 else v[rows]


def _joined(u: Floats, v: Floats) -> Parameters:
    """Parameters of lines, which begin and end where straight motion does: equation (26)."""
    return np.concatenate(([0.0], u, [1.0])), np.pad(v, ((0, 0), (1, 1)), constant_values=((0, 0), (0.0, 1.0)))


def straying_lines(smoothed: SmoothProgram, rows: Ints) -> Ints:
    """Rows whose transitions stray at the ends of their lines: v follows on from one end to the next.

    One line for each half ends where `_measured` has looked.
    """
    corners, settings = smoothed.corners, smoothed.settings
    rows = rows[corners.smoothed[rows]]
    if not settings.round_feed_changes or not len(rows):
        return rows[:0]
    number = lines_of(smoothed, rows)
    rows, number = rows[np.abs(number) > 1], number[np.abs(number) > 1]
    found = [rows[:0]]
    order = np.argsort(number, kind="stable")
    cuts = np.union1d(np.flatnonzero(np.diff(number[order])) + 1, np.arange(BATCH, len(rows), BATCH))
    columns = corners.trim_in, corners.trim_out, corners.axis_trim_in, corners.axis_trim_out
    for part in np.split(order, cuts) if len(rows) else ():
        some, u = rows[part], nodes(int(number[part[0]]))[:-1]
        trims = np.stack([column[some] for column in columns], axis=1).reshape(-1, 2, 2)
        made = Transitions(trims, Original.of(legs_of(smoothed, some), settings), settings)
        v, residual = made.synchronised(u)
        parameters, missing = _joined(u, v), np.maximum(residual.max(axis=1), made.missing(ENDS))
        doubtful = np.flatnonzero(made.bounded(parameters, missing)[1] > 1.0)
        made = made.some(doubtful)
        share = taken(made.motion(_of(parameters, doubtful)), made.original, settings)
        found.append(some[doubtful[share.max(axis=1) > 1.0 + 1e-6]])
    return np.concatenate(found)


def straying_remainders(smoothed: SmoothProgram, rows: Ints | slice = slice(None)) -> Ints:
    """Rows of corners beside segments of which the transitions leave what strays; only segments beside `rows` count.

    There tip and axis are out of step by what the two were cut unlike.
    """
    program, settings = smoothed.program, smoothed.settings
    segments = segments_of(smoothed, dense=False)
    unlike = (segments.entry != segments.axis_entry) | (segments.exit != segments.axis_exit)
    beside = np.zeros(len(program), np.bool_)
    beside[smoothed.corners.pose[rows]] = True
    pose = np.flatnonzero(unlike & segments.has_line & (segments.start >= 0) & (beside | beside[segments.start]))
    found, reserve = [pose[:0]], settings.interpolation_tolerance
    #: (n, 2) where the rests of the segments of tip and axis point begin, and where they end
    low = np.column_stack((segments.entry, segments.axis_entry))
    high = np.column_stack((segments.exit, segments.axis_exit))
    for part in np.split(pose, np.arange(BATCH, len(pose), BATCH)):
        start = segments.start[part]
        step = program.tip[part] - program.tip[start]
        lever = settings.axis_length * program.axis[start]
        turn = settings.axis_length * program.axis[part] - lever
        spare = np.zeros(len(part))
        original = Original(np.stack((step, step), axis=1), np.stack((turn, turn), axis=1), lever, spare)
        tip_at, axis_at = (low[part, k, None] + _PARTS * (high - low)[part, k, None] for k in range(2))
        tip = original.at(tip_at)[0]
        motion = Motion(tip, sum(original.at(axis_at)) - tip, tip_at, axis_at)
        share = taken(motion, original, settings, reserve=reserve)
        found.append(part[share.max(axis=1) > 1.0])
    pose = np.concatenate(found)
    rows = np.unique(segments.row[np.concatenate((segments.start[pose], pose))])
    return rows[rows >= 0]


def _great_circle(one: Floats, other: Floats, share: Floats) -> Floats:
    """Unit vectors (g, m, 3) from `one` (g, 3) to `other` at shares (m,) of the angle: what equation (27) means."""
    angle, share = angle_between(one, other)[:, None, None], share[:, None]
    one, other = one[:, None], other[:, None]
    sine = np.sin(angle)
    turned = np.sin((1.0 - share) * angle) * one + np.sin(share * angle) * other
    return unit(np.where(sine < 1e-12, (1.0 - share) * one + share * other, turned))
