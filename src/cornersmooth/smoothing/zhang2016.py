"""`method="zhang2016"`: the paper as published (docs/method.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cornersmooth.arrays.vectors import angle_between, dot, norm, unit
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
    legs_at,
    put,
    refuse_turns,
)
from cornersmooth.smoothing.proportional import EXACT
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import Segments, lines_of, segments_of
from cornersmooth.smoothing.self_check import (
    TOGETHER,
    Motion,
    Original,
    bounded,
    chord_sag,
    most_taken,
    motion_of,
    parts_gone,
    sums,
    taken,
)
from cornersmooth.smoothing.synchronise import (
    REPORT_PARAMETERS,
    matching_parameters,
    synchronisation_report,
    synchronised,
)

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

#: where transitions of other weights than 1 are looked at: they may bend within little of the parameter
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
                some = rows[part]
                legs = legs_at(
                    program, settings.axis_length, corners.pose[some], corners.before[some], corners.after[some]
                )
                placed = self.sized(legs, settings, most[part])
                if np.isfinite(most[part]).all():
                    placed.status[placed.status == Status.TOO_SHORT] = Status.STRAYS
                put(corners, some, placed, legs.shift)

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
        tip, axis = (legs.tip_in, legs.tip_out), (legs.tip_in + legs.turn_in, legs.tip_out + legs.turn_out)
        (tip_sizes, tip_sine), (axis_sizes, axis_sine) = _turn(*tip), _turn(*axis)
        g = len(tip_sine)
        factor = 2.0 * float(nurbs.deviation_factor(np.array(settings.weights)))  # 2·w1/(3(w1+w2)) in the paper
        spare = legs.spare(settings)
        by_tolerance = np.minimum(
            divide(settings.common_tolerance + spare, factor * tip_sine),
            divide(settings.axis_point_tolerance + spare, factor * axis_sine),
        )
        halves = np.minimum(*tip_sizes) / 2.0, np.minimum(*axis_sizes) / 2.0

        status = np.full(g, Status.SMOOTHED, np.uint8)
        status[(tip_sine == 0.0) & (axis_sine == 0.0)] = Status.STRAIGHT
        sizes = np.hypot(tip_sizes[0], axis_sizes[0]) * np.hypot(tip_sizes[1], axis_sizes[1])
        cosine = (dot(*tip) + dot(*axis)) / sizes
        refuse_turns(status, cosine, half_cosine(legs, settings.axis_length), settings)

        # the size: the length (15) of both curves where their segments have room for it
        size = np.minimum(np.minimum(by_tolerance, np.maximum(*halves)), most)
        rows = np.flatnonzero(status == Status.SMOOTHED)
        found, last, step, power = np.zeros((4, g)), np.ones(g), np.ones(g), np.ones(g)
        for number in range(rounds):
            found[:, rows], share = _measured(legs, settings, rows, *(np.minimum(half, size)[rows] for half in halves))
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
        tip_length, axis_length = np.minimum(halves[0], size), np.minimum(halves[1], size)
        short = np.maximum(tip_length, axis_length) <= 4.0 * settings.tip_resolution
        status[(status == Status.SMOOTHED) & short] = Status.TOO_SHORT
        smoothed = status == Status.SMOOTHED
        tip_length, axis_length = np.where(smoothed, tip_length, 0.0), np.where(smoothed, axis_length, 0.0)
        by_segment = (np.minimum(*halves) < size) | (np.maximum(*halves) <= size)
        limited_by = np.where(by_segment, LimitedBy.SEGMENT, LimitedBy.TOLERANCE).astype(np.uint8)
        limited_by[~smoothed] = LimitedBy.NOTHING
        tip_trims, axis_trims = (
            [np.divide(length, size, out=np.zeros(g), where=size > 0.0) for size in sizes]
            for length, sizes in ((tip_length, tip_sizes), (axis_length, axis_sizes))
        )
        return Placed(
            status,
            limited_by,
            *(tip_trims[0], tip_trims[1], axis_trims[0], axis_trims[1]),
            tip_error=factor * tip_length * tip_sine,  # equation (10)
            axis_error=factor * axis_length * axis_sine,
            orientation_error=np.where(smoothed, found[3], 0.0),
            extra={
                name: np.where(smoothed, values, np.nan) for name, values in zip(EXTRA, (*found[:3], size), strict=True)
            },
        )

    def points(self, smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
        """The axis-point curve at the synchronised parameters: equations (20) to (22) and, at the ends, (26)."""
        corners, height = smoothed.corners, smoothed.settings.axis_length
        weights = np.array(smoothed.settings.weights)
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
        """Axes with the axis-point curve at its own parameter v(u): equations (20) to (23).

        v(u) is followed from u = 0 over a common set of parameters and interpolated in between.
        """
        distinct, which = np.unique(rows, return_inverse=True)
        tip_curve, axis_curve = nurbs.control_points(program, corners, distinct, settings.axis_length)
        weights = np.array(settings.weights)
        v, _ = matching_parameters(tip_curve, axis_curve, weights, REPORT_PARAMETERS, settings.axis_length)
        cell = np.clip(np.searchsorted(REPORT_PARAMETERS, u, side="right") - 1, 0, len(REPORT_PARAMETERS) - 2)
        part = (u - REPORT_PARAMETERS[cell]) / (REPORT_PARAMETERS[cell + 1] - REPORT_PARAMETERS[cell])
        at = v[which, cell] + part * (v[which, cell + 1] - v[which, cell])
        tips = nurbs.evaluate(tip_curve[which], weights, u[:, None])[:, 0]
        return unit(nurbs.evaluate(axis_curve[which], weights, at[:, None])[:, 0] - tips)

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


def _turn(leg_in: Floats, leg_out: Floats) -> tuple[tuple[Floats, Floats], Floats]:
    """Lengths of legs, and the sine of half the angle between them; 0 where a leg has no length (no direction)."""
    sizes = norm(leg_in), norm(leg_out)
    return sizes, np.where(np.minimum(*sizes) > 0.0, norm(unit(leg_out) - unit(leg_in)) / 2.0, 0.0)


@dataclass(frozen=True)
class _Transitions:
    """Transitions at g corners."""

    tip_legs: tuple[Floats, Floats]
    axis_legs: tuple[Floats, Floats]
    trims: tuple[Floats, ...]  # of the tip in and out, of the axis point in and out
    original: Original
    spare: Floats

    @classmethod
    def of(cls, legs: Legs, trims: Sequence[Floats], settings: Settings) -> _Transitions:
        tips, turns = (legs.tip_in, legs.tip_out), (legs.turn_in, legs.turn_out)
        cut = [trim[:, None] * leg for trim, leg in zip(trims, (*tips, *sums(tips, turns)), strict=True)]
        original = Original(tips, turns, settings.axis_length * legs.axis)
        return cls((cut[0], cut[1]), (cut[2], cut[3]), tuple(trims), original, legs.spare(settings))

    def bounded(
        self, parameters: tuple[Floats, Floats], missing: Floats, settings: Settings
    ) -> tuple[Floats, Floats, Ints]:
        """(g,) mm that the axis point is off its path at most; (g,) the share of ε in use at most; where that is none.

        There is no bound for a tolerance of the axis.
        """
        weights = np.array(settings.weights)
        factor = float(nurbs.deviation_factor(weights))
        errors = (
            factor * norm(self.tip_legs[1] - self.tip_legs[0]),
            factor * norm(self.axis_legs[1] - self.axis_legs[0]),
        )
        gone = parts_gone(self.trims, parameters, weights)
        off, both = bounded(gone, missing, self.original, errors, settings.axis_length)
        share = _most_share(off, both, self.spare, settings)
        return off, share, np.flatnonzero(share > 1.0)

    def motion(
        self, rows: Ints, parameters: tuple[Floats, Floats], settings: Settings
    ) -> tuple[Motion, Original, Floats]:
        """Poses of some, the segments that they are measured against, and what is left of the tolerances."""
        (u, v), weights = parameters, np.array(settings.weights)
        tip_legs, axis_legs = ((one[0][rows], one[1][rows]) for one in (self.tip_legs, self.axis_legs))
        at, trims = (u, v if len(v) == 1 else v[rows]), tuple(trim[rows] for trim in self.trims)
        original = self.original.some(rows)
        gone = parts_gone(trims, at, weights)
        return motion_of(tip_legs, axis_legs, gone, original.lever, at, weights), original, self.spare[rows]

    def missing_at(self, u: Floats, weights: Floats, height: float) -> Floats:
        """(g,) mm: the largest ``||Q(u) − P(u)| − H|`` at common parameters (m,)."""
        turns = np.stack(self.axis_legs, axis=1) - np.stack(self.tip_legs, axis=1)
        levers = self.original.lever[:, None] + nurbs.leg_coefficients(u, weights)[:, 1:] @ turns
        return np.abs(norm(levers) - height).max(axis=1)

    def missing_at_ends(self, height: float) -> Floats:
        """(g,) mm: the larger ``||Q − P| − H|`` of both ends of the curves."""
        (tip_in, tip_out), (axis_in, axis_out), lever = self.tip_legs, self.axis_legs, self.original.lever
        ends = norm(lever + tip_in - axis_in), norm(lever - tip_out + axis_out)
        return np.maximum(*(np.abs(end - height) for end in ends))


def _measured(
    legs: Legs, settings: Settings, rows: Ints, tip_length: Floats, axis_length: Floats
) -> tuple[tuple[Floats, ...], Floats]:
    """Residual, jumps and turn of transitions with these lengths (15), and what of the tolerances they take (g,)."""
    legs = Legs(*(values[rows] for values in legs))
    tips = legs.tip_in, legs.tip_out
    axes = sums(tips, (legs.turn_in, legs.turn_out))
    trims = [divide(length, norm(leg)) for each, length in ((tips, tip_length), (axes, axis_length)) for leg in each]
    made = _Transitions.of(legs, [np.where(np.isfinite(trim), trim, 0.0) for trim in trims], settings)
    weights = np.array(settings.weights)
    u = REPORT_PARAMETERS if settings.weights == (1.0, 1.0) and settings.axis_tolerance is None else _MORE_PARAMETERS
    both, lever = (made.tip_legs, made.axis_legs), made.original.lever
    v, *report = synchronisation_report(*both, lever, weights, settings.axis_length, u)
    lines = settings.round_feed_changes
    if lines:
        (u, at), missing = _joined(u, v), np.maximum(report[0], made.missing_at_ends(settings.axis_length))
    else:  # controls run curves at common parameters
        at, missing = u[None], made.missing_at(u, weights, settings.axis_length)
    off, share, doubtful = made.bounded((u, at), missing, settings)
    passing = off + (settings.chord if lines else 0.0)
    most = *made.motion(doubtful, (u, at), settings), settings, len(u) // 2, passing[doubtful] if lines else None
    share[doubtful] = most_taken(*most)
    return tuple(report), share


def _most_share(off: Floats, both: Floats, spare: Floats, settings: Settings) -> Floats:
    """(g,) bound of what is taken of the tolerances, from those of `bounded`; none for a tolerance of the axis."""
    share: Floats = np.maximum(off, both / TOGETHER) / (settings.common_tolerance + spare)
    return share if settings.axis_tolerance is None else np.full_like(share, np.inf)


def _joined(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Parameters of lines, which begin and end where straight motion does: equation (26)."""
    return np.concatenate(([0.0], u, [1.0])), np.pad(v, ((0, 0), (1, 1)), constant_values=((0, 0), (0.0, 1.0)))


def straying_lines(smoothed: SmoothProgram, rows: Ints) -> Ints:
    """Rows whose transitions stray at the ends of their lines: v follows on from one end to the next.

    One line for each half ends where `_measured` has looked.
    """
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    rows = rows[corners.smoothed[rows]]
    if not settings.round_feed_changes or not len(rows):
        return rows[:0]
    weights, height = np.array(settings.weights), settings.axis_length
    number = lines_of(smoothed, rows)
    rows, number = rows[np.abs(number) > 1], number[np.abs(number) > 1]
    found = [rows[:0]]
    order = np.argsort(number, kind="stable")
    cuts = np.union1d(np.flatnonzero(np.diff(number[order])) + 1, np.arange(BATCH, len(rows), BATCH))
    for part in np.split(order, cuts) if len(rows) else ():
        some, u = rows[part], nodes(int(number[part[0]]))[:-1]
        legs = legs_at(program, height, corners.pose[some], corners.before[some], corners.after[some])
        trims = [
            column[some] for column in (corners.trim_in, corners.trim_out, corners.axis_trim_in, corners.axis_trim_out)
        ]
        made = _Transitions.of(legs, trims, settings)
        v, missing = synchronised(made.tip_legs, made.axis_legs, made.original.lever, weights, u, height)
        missing = np.maximum(missing.max(axis=1), made.missing_at_ends(height))
        parameters = _joined(u, v)
        doubtful = made.bounded(parameters, missing, settings)[2]
        share = taken(*made.motion(doubtful, parameters, settings), settings)
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
    cuts = (segments.entry, segments.exit), (segments.axis_entry, segments.axis_exit)
    for part in np.split(pose, np.arange(BATCH, len(pose), BATCH)):
        start = segments.start[part]
        step = program.tip[part] - program.tip[start]
        lever = settings.axis_length * program.axis[start]
        turn = settings.axis_length * program.axis[part] - lever
        ends = [[values[part, None] for values in pair] for pair in cuts]
        none, original = np.zeros(len(part)), Original((step, step), (turn, turn), lever)
        # at one pose |Q − P| is H but for the chord of the turn; the tip is `apart` from that of the axis point
        apart = np.maximum(*(np.abs(of_tip - of_axis) for of_tip, of_axis in zip(*ends, strict=True)))
        missing = chord_sag(original, settings.axis_length) + apart[:, 0] * norm(step)
        off, both = bounded((apart, 0.0 * apart), missing, original, (none, none + reserve), settings.axis_length)
        doubtful = np.flatnonzero(_most_share(off, both, none, settings) > 1.0)

        tip_at, axis_at = (low[doubtful] + _PARTS * (high - low)[doubtful] for low, high in ends)
        original = original.some(doubtful)
        (step, _), (turn, _), lever = original
        tip = tip_at[..., None] * step[:, None]
        motion = Motion(tip, lever[:, None] + axis_at[..., None] * (step + turn)[:, None] - tip, tip_at, axis_at)
        share = taken(motion, original, none[doubtful], settings, reserve=reserve)
        found.append(part[doubtful[share.max(axis=1) > 1.0]])
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
