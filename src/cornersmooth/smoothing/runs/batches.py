"""Some windows of runs made smooth: samples, what they may deviate, and the rounds of tip and axis point.

The smoothest tip is solved first, then the smoothest lever from tip to axis point, which the rotary axes follow. Then
the tip goes out of its way for the lever: where both deviate to opposite sides the lever has twice the room. At
constant H the axis point is off by what its curve is off across the axis O, and by what the tip is off along it. So the
tip leaves along the axis what the fit needs across it, and the axis point uses across the axis what the tip has left.

Where poses sample a surface deviations cost something, so that neighbouring passes get the same curve. Where all axes
of a run lie in one plane the lever does not leave it: an axis of the machine would tremble.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.arrays import dot, norm, ranges, some_rows, spread, square, starts
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.runs.banded import TAPS, Gather, Windows
from cornersmooth.smoothing.runs.fitting import holding_poses
from cornersmooth.smoothing.runs.interior import COLD, WARM, Task, smoothest
from cornersmooth.smoothing.runs.polylines import Pieces, Polylines, Samples

#: share of the tolerance that the samples may use
SHARE = 0.97

#: share of the tolerance between the fit and the bounds
ROOM = 0.02

#: how much less the axis point's curve is bound along the axis than across it (the square of it)
ALONG = 0.1

#: least and largest share of its tolerance that the tip leaves to the axis point across the axis
LEAST_LEFT, MOST_LEFT = 0.5, 0.9

#: spans on either side that the weight of a span looks at, its power of the mean square of C‴, and the least mean over
#: the largest of the window
NEIGHBOURS, POWER, LEAST_MEAN = 1, 0.75, 1e-12

#: levers that differ by less than this part of the coordinates are the same
STILL = 1e-14

#: axes of a run lie in a plane where their axis points are off it by at most this share of their tolerance
FLAT = 0.01

#: what the third derivative of the tip counts beside that of the lever: rotary axes have less jerk to give
TIP_COUNTS = 0.3

#: the same where the tip may go out of its way for the lever, and the tip is much faster than the lever
OWN_WAY = 0.5

#: cost of a deviation as large as the tolerance where poses sample a surface, over the objective at the beginning of a
#: round; and spans on either side that tell whether they do (docs/global.md, neighbouring passes)
PENALTY, SURROUNDINGS = 6.0, 12

#: largest squared ratio of the lever's speed to that of a tip that moves
_LARGEST_RATIO = 1e100


@dataclass(frozen=True)
class Problem:
    """What is the same for all windows of a program."""

    lines: Polylines
    splines: Splines
    pieces: Pieces
    rough: Floats  # control points of the fit, (controls, 6), mm
    tolerances: tuple[float, float]  # of tip and axis point, mm
    axis_length: float  # H, mm

    @cached_property
    def first_piece(self) -> Ints:
        """(spans + 1,) where the pieces of each span begin."""
        return starts(np.bincount(self.pieces.span, minlength=len(self.splines.span_run)))

    @cached_property
    def sampled(self) -> Floats:
        """(spans,) share of the spans around each that hold poses: near 1 where these sample a surface."""
        splines = self.splines
        count = starts(holding_poses(splines, self.lines).astype(np.int64))
        first = splines.span_first[splines.span_run], splines.span_first[splines.span_run + 1]
        span = np.arange(len(splines.span_run))
        low, high = np.maximum(span - SURROUNDINGS, first[0]), np.minimum(span + SURROUNDINGS + 1, first[1])
        return (count[high] - count[low]) / (high - low)

    @cached_property
    def lever(self) -> Floats:
        """(poses, 3) mm: from tip to axis point."""
        return self.lines.point[:, 3:] - self.lines.point[:, :3]

    @cached_property
    def room(self) -> Floats:
        """(poses,) share of its tolerance that the axis point may use in the segment from each pose.

        Where it has a larger tolerance than the tip it may be off by what it turns in the segment, or as the tip.
        """
        turned = norm(np.diff(self.lever, axis=0, append=self.lever[-1:]))
        return np.minimum(np.maximum(turned, self.tolerances[0]) / self.tolerances[1], 1.0)

    @cached_property
    def first_lever(self) -> Floats:
        """(runs, 3) mm: that at the start of each run."""
        return self.lever[self.lines.first[:-1]]

    @cached_property
    def still(self) -> Bools:
        """(runs,) bool: the axis does not turn at all; it must not tremble then, least of all at a machine's pole."""
        run = spread(self.lines.count)[0]
        size = np.abs(self.lines.point).max(axis=1)
        off = np.abs(self.lever - self.first_lever[run]).max(axis=1) > STILL * np.maximum(size, self.axis_length)
        return np.bincount(run, off, minlength=len(self.lines.count)) == 0

    @cached_property
    def normal(self) -> Floats:
        """(runs, 3) normal of the plane that all axes of a run lie in; 0 where there is none, or one axis alone."""
        lever, first = self.lever, self.lines.first[:-1]
        normal = np.linalg.eigh(np.add.reduceat(lever[:, :, None] * lever[:, None, :], first)).eigenvectors[:, :, 0]
        off = np.maximum.reduceat(np.abs(dot(lever, normal[spread(self.lines.count)[0]])), first)
        flat = (off <= FLAT * self.tolerances[1]) & ~self.still
        return np.where(flat[:, None], normal, 0.0)


def solve_windows(
    problem: Problem, windows: Windows, control: Floats, tight: Floats, gaps: tuple[float, ...], *, near: bool
) -> Floats:
    """Return new control points (c, 6), mm, of the windows, rows as in `windows.control`.

    `tight` (pieces, 2) is the share of what they may use that tip and axis point of each piece are left, `gaps` what
    may be left to gain, over the objective, in each round, and `near` whether `control` is near the solution.
    """
    moved = control[windows.control].copy()
    there = _Places(problem, windows, tight)
    width = problem.splines.width[windows.span]
    rough = problem.rough[windows.control]
    run = problem.splines.control_run[windows.control]
    normal, still = problem.normal[run], problem.still[run]
    for gap in gaps:
        weight = width * even_weights(problem.splines, windows, moved)
        for part, tolerance in enumerate(problem.tolerances):
            own = slice(3 * part, 3 * part + 3)
            if part:  # across its plane the lever stays that of the fit
                moved[:, own] += across(normal, rough[:, 3:] - rough[:, :3] - moved[:, 3:] + moved[:, :3])
            off = there.deviation(moved, part)
            task = there.axis_task(weight, there.deviation(moved, 0), normal) if part else there.tip_task(weight)
            jerk = task.smooth.apply(moved[:, own])
            if part:
                jerk -= task.smooth.apply(moved[:, :3])
            elif near:
                free = moved[:, 3:] - across(normal, moved[:, 3:])
                jerk -= followed(problem.splines, windows, moved)[:, None] * task.smooth.apply(free)
            jerk /= tolerance
            moved[:, own] += tolerance * smoothest(task, off, jerk, gap, WARM if near else COLD)
        moved[still, 3:] = moved[still, :3] + problem.first_lever[run[still]]
        near = True
    return moved


class _Places:
    """Samples of some windows and how far they may be off, in units of the tolerances."""

    def __init__(self, problem: Problem, windows: Windows, tight: Floats) -> None:
        splines, pieces = problem.splines, problem.pieces
        self.problem, self.windows = problem, windows
        number = problem.first_piece[windows.span + 1] - problem.first_piece[windows.span]
        rows = ranges(problem.first_piece[windows.span], number)
        own = some_rows(pieces, rows)
        samples = Samples.of(splines, problem.lines, own)
        span = np.repeat(np.arange(len(windows.span)), number)[samples.piece]
        begins = np.concatenate(([True], samples.piece[1:] != samples.piece[:-1]))
        before = np.where(begins, np.maximum(rows - 1, 0)[samples.piece], rows[samples.piece])
        tight = tight * np.stack((np.ones(len(pieces.span)), problem.room[pieces.segment]), axis=1)
        # a piece ends where the next begins
        self.limit = SHARE * np.minimum(tight[rows][samples.piece], tight[before])  # (m, 2)
        self.near = Gather(windows.local[span], samples.basis, len(windows.control))
        self.smooth = Gather(windows.local, splines.third[windows.span], len(windows.control))
        self.target = samples.target
        lever = samples.target[:, 3:] - samples.target[:, :3]
        length = norm(lever)
        off = self.near.apply(problem.rough[windows.control]) - samples.target
        self.rough = off / np.repeat(problem.tolerances, 3)  # (m, 6)
        self.axis, self.short = lever / length[:, None], length / problem.axis_length  # the lever's length over H
        self.normal = problem.normal[splines.span_run[windows.span[span]]]  # (m, 3) of the plane of the axes, or 0
        self.sample_window = windows.span_window[span]
        length_of_samples = (own.high - own.low)[samples.piece] / np.bincount(samples.piece)[samples.piece]
        length_of_windows = np.bincount(windows.span_window, splines.width[windows.span])
        share = length_of_samples / length_of_windows[self.sample_window]
        self.penalty = PENALTY * share * problem.sampled[windows.span[span]]

    def deviation(self, moved: Floats, part: int) -> Floats:
        """(m, 3) of tip or axis point from control points (c, 6)."""
        own = slice(3 * part, 3 * part + 3)
        return (self.near.apply(moved[:, own]) - self.target[:, own]) / self.problem.tolerances[part]

    def tip_task(self, weight: Floats) -> Task:
        """The tip; |across|² + (1 + k)·along² ≤ r² leaves the axis point its part.

        Where the lever stays in a plane, what is across that counts as what is along the axis. Left is one direction,
        in the plane and across the axis, so there is one metric for both: I + k·O·Oᵀ, with that direction as O.
        """
        off, (tip, axis) = self.rough[:, 3:], self.limit.T
        off = off - across(self.normal, off)
        wide = np.sqrt(np.maximum(dot(off, off) - dot(self.axis, off) ** 2, 0.0)) / self.short + ROOM
        left = np.clip(wide / axis, LEAST_LEFT, MOST_LEFT)
        unit = self.problem.tolerances[0] / self.problem.tolerances[1]
        stretch = np.maximum((tip * unit / axis) ** 2 / (1.0 - left**2) - 1.0, 0.0)
        flat = np.asarray(self.normal.any(axis=1))
        direction = np.where(flat[:, None], np.cross(self.normal, self.axis), self.axis)
        radius = np.where(flat, tip / np.sqrt(1.0 + stretch), tip)
        stretch = np.where(flat, 1.0 / (1.0 + stretch) - 1.0, stretch)
        radius = np.maximum(radius, _size(direction, stretch, self.rough[:, :3]) + ROOM)
        return Task(*self._common, weight, direction, stretch, radius)

    def axis_task(self, weight: Floats, tip_off: Floats, normal: Floats) -> Task:
        """The axis point, from the deviation (m, 3) of the tip; control points do not go along the normals (c, 3)."""
        along = dot(self.axis, tip_off) * self.problem.tolerances[0] / self.problem.tolerances[1]
        radius = self.short * np.sqrt(np.maximum(self.limit[:, 1] ** 2 - along**2, 0.0))
        stretch = np.full(len(radius), ALONG - 1.0)
        radius = np.maximum(radius, _size(self.axis, stretch, self.rough[:, 3:]) + ROOM)
        return Task(*self._common, weight, self.axis, stretch, radius, normal)

    @property
    def _common(self) -> tuple[Gather, Gather, Windows, Ints, Floats]:
        """What all tasks have, the first of their fields."""
        return self.near, self.smooth, self.windows, self.sample_window, self.penalty


def across(normal: Floats, vectors: Floats) -> Floats:
    """(m, 3) the parts of vectors across planes; nothing where the normal is 0."""
    return dot(normal, vectors)[:, None] * normal


def followed(splines: Splines, windows: Windows, control: Floats) -> Floats:
    """(spans,) share t of the axis point that the tip follows: |A‴ − t·B‴|² is what the tip makes least.

    That is the quadratic model of (r·|A‴|)³ + |(B − A)‴|³ at the curve known so far; r grows where the tip is slow.
    """
    tip, lever = control[:, :3], control[:, 3:] - control[:, :3]
    ahead, behind = windows.local + TAPS - 1, windows.local
    way, turn = (square(part[ahead] - part[behind]) for part in (tip, lever))
    own, others = (np.sqrt(_third_squares(splines, windows, part)) for part in (tip, lever))
    stands = turn > _LARGEST_RATIO * way  # and the tool turns: the tip follows nothing
    own *= (OWN_WAY**2 * (1.0 + np.where(stands, 0.0, turn / np.maximum(way, 1e-300)))) ** 1.5
    return np.where(stands, 0.0, others / np.maximum(own + others, 1e-300))


def even_weights(splines: Splines, windows: Windows, control: Floats) -> Floats:
    """(spans,) weights of |C‴|²: |C‴|^(-5/3) at the curve known so far, with the mean over neighbouring spans.

    That is the quadratic model of ∫|C‴|^(1/3), the time of a machine that is limited by its jerk.
    """
    curve = np.hstack((TIP_COUNTS * control[:, :3], control[:, 3:] - control[:, :3]))
    mean = _third_squares(splines, windows, curve)
    window = windows.span_window
    largest = np.zeros(len(windows.count))
    np.maximum.at(largest, window, mean)
    relative = mean / np.where(largest > 0.0, largest, 1.0)[window]
    return np.maximum(relative, LEAST_MEAN) ** (-POWER)


def _third_squares(splines: Splines, windows: Windows, curve: Floats) -> Floats:
    """(spans,) mean square of the third derivative over each span and its neighbours, from control points (c, d)."""
    third = np.zeros((len(windows.span), curve.shape[1]))
    for k in range(TAPS):
        third += splines.third[windows.span, k, None] * curve[windows.local + k]
    window, width = windows.span_window, splines.width[windows.span]
    own = width * np.square(third).sum(axis=1)
    total, length = own.copy(), width.copy()
    for shift in range(1, NEIGHBOURS + 1):
        same = np.where(window[shift:] == window[:-shift], 1.0 - shift / (NEIGHBOURS + 1.0), 0.0)
        for sums, values in ((total, own), (length, width)):
            sums[shift:] += same * values[:-shift]
            sums[:-shift] += same * values[shift:]
    return total / length


def _size(axis: Floats, stretch: Floats, off: Floats) -> Floats:
    """(m,) lengths of deviations in the metric I + k·O·Oᵀ."""
    return np.sqrt(np.maximum(dot(off, off) + stretch * dot(axis, off) ** 2, 0.0))
