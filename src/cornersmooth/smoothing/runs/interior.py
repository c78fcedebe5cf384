"""The smoothest spline within the tolerances: a primal-dual interior-point method on all windows at once.

Minimised is ∫w·|C‴|² where |deviation| ≤ radius at every sample: a convex quadratic objective with convex quadratic
constraints (Boyd and Vandenberghe, Convex Optimization, 11.7). The matrix of a step has 3 by 3 blocks on seven
diagonals. Tip and axis point share the knots and nothing else, so they are solved one after the other. Every iterate
keeps the constraints, so the last one does, whenever it ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.runs.banded import Gather, solve_blocks
from cornersmooth.smoothing.runs.ranges import ranges
from cornersmooth.smoothing.runs.samples import Samples
from cornersmooth.smoothing.runs.splines import Splines
from cornersmooth.smoothing.runs.windows import Windows

#: steps at most, and the share of the way to the bounds that each may go
STEPS, BACK_OFF = 40, 0.95

#: how much the barrier falls in a step
_CENTRE = 0.1

#: part of the way to a better curve that is begun from, and the gap over the objective that the multipliers begin with
NEARLY, COLD, WARM = 0.9, 1.0, 0.3


@dataclass(frozen=True)
class Task:
    """One half (tip or axis point) of the windows' problem, in units of the tolerance.

    Parameters
    ----------
    near, smooth : Gather
        Samples and spans at the control points.
    weight : (spans,) float64
        Of the squared third derivatives.
    radius : (m,) float64
    free : (c,) bool
    control_window, sample_window, span_window : int64
    windows : int
    """

    near: Gather
    smooth: Gather
    weight: Floats
    radius: Floats
    free: Bools
    sample_window: Ints
    span_window: Ints
    control_window: Ints
    windows: int


def smoothest(
    splines: Splines,
    windows: Windows,
    samples: Samples,
    control: Floats,
    radius: Floats,
    tolerances: tuple[float, float],
    weight: Floats,
    gap: float,
    tried: Floats | None = None,
) -> Floats:
    """Return new control points (c, 6) of the windows, rows as in `windows.control`.

    Parameters
    ----------
    control : (controls, 6) float64, mm
        Of the splines; they keep the radii.
    weight : (spans,) float64
        Of the squared third derivative in each span.
    gap : float
        Bound of what is left to gain, over the objective, that ends the steps.
    tried : (controls, 6) float64, mm, optional
        Better control points that need not keep the radii: begun is on the way to them.
    radius : (m, 2) float64, mm
        For tip and axis point at the samples.
    """
    first = samples.first_of_spans(len(splines.span_run))
    number = first[windows.span + 1] - first[windows.span]
    rows = ranges(first[windows.span], number)
    span_window = np.repeat(np.arange(len(windows.count)), windows.count)
    near = Gather(np.repeat(windows.local, number), samples.basis[rows], len(windows.control))
    width = splines.width[windows.span]
    smooth = Gather(windows.local, splines.third[windows.span], len(windows.control))
    own_weight = width * weight[windows.span]
    moved = control[windows.control].copy()
    for part, tolerance in enumerate(tolerances):
        own = slice(3 * part, 3 * part + 3)
        task = Task(
            near,
            smooth,
            own_weight,
            radius[rows, part] / tolerance,
            windows.free,
            np.repeat(span_window, number),
            span_window,
            windows.window,
            len(windows.count),
        )
        off = (near.apply(moved[:, own]) - samples.target[rows, own]) / tolerance
        if tried is not None:
            way = (tried[windows.control, own] - moved[:, own]) / tolerance
            step = near.apply(way)
            slack = (task.radius**2 - _square(off)) / 2.0
            share = NEARLY * _reach(task, off, step, slack, np.ones_like(slack), np.zeros_like(slack))
            moved[:, own] += tolerance * share[windows.window][:, None] * way
            off += share[task.sample_window][:, None] * step
        jerk = smooth.apply(moved[:, own]) / tolerance
        cost = np.bincount(span_window, own_weight * _square(jerk), minlength=task.windows)
        task = replace(task, weight=own_weight / np.where(cost > 0.0, cost, 1.0)[span_window])
        moved[:, own] += tolerance * _solve(task, off, jerk, gap, COLD if tried is None else WARM)
    return moved


def _solve(task: Task, off: Floats, jerk: Floats, enough: float, begin: float) -> Floats:
    """Steps from deviations (m, 3) and third derivatives (spans, 3) to the change of the control points (c, 3)."""
    change = np.zeros((len(task.free), 3))
    stiff = task.smooth.bands(task.weight)
    many = np.bincount(task.sample_window, minlength=task.windows)
    slack = (task.radius**2 - _square(off)) / 2.0
    cost = np.bincount(task.span_window, task.weight * _square(jerk), minlength=task.windows)
    force = np.maximum(begin * cost / many, 1e-12)[task.sample_window] / slack  # the multipliers
    for _ in range(STEPS):
        gap = np.bincount(task.sample_window, slack * force, minlength=task.windows)
        barrier = (_CENTRE * gap / many)[task.sample_window] / slack
        right = -task.smooth.sums(task.weight[:, None] * jerk) - task.near.sums(barrier[:, None] * off)
        bands = task.near.bands(_bend(force, slack, off))
        bands[..., :3] += stiff
        step = solve_blocks(bands, right, task.free)
        step_off, step_jerk = task.near.apply(step), task.smooth.apply(step)
        along = _dot(off, step_off)
        step_force = barrier - force + force / slack * along
        reach = _reach(task, off, step_off, slack, force, step_force)
        done = gap <= enough * cost
        reach[done] = 0.0
        change += reach[task.control_window][:, None] * step
        by_sample = reach[task.sample_window]
        off = off + by_sample[:, None] * step_off
        jerk = jerk + reach[task.span_window][:, None] * step_jerk
        force = force + by_sample * step_force
        slack = (task.radius**2 - _square(off)) / 2.0
        cost = np.bincount(task.span_window, task.weight * _square(jerk), minlength=task.windows)
        if done.all():
            break
    return change


def _reach(task: Task, off: Floats, step: Floats, slack: Floats, force: Floats, step_force: Floats) -> Floats:
    """(windows,) share of the step that keeps the bounds of all samples."""
    square, along = _square(step), _dot(off, step)
    with np.errstate(divide="ignore", invalid="ignore"):
        # the root of |off + r·step| = radius, in the form without cancellation
        root = np.sqrt(along**2 + 2.0 * slack * square)
        primal = np.where(along > 0.0, 2.0 * slack / (along + root), (root - along) / square)
        dual = np.where(step_force < 0.0, -force / step_force, np.inf)
    bound = np.minimum(np.where(square > 0.0, primal, np.inf), dual)
    least = np.full(task.windows, np.inf)
    np.minimum.at(least, task.sample_window, bound)
    return np.minimum(1.0, BACK_OFF * least)


def _bend(force: Floats, slack: Floats, off: Floats) -> Floats:
    """(m, 6) second derivatives of the bounds: xx, yy, zz, xy, xz, yz."""
    pull = force / slack
    x, y, z = off.T
    return np.stack(
        (force + pull * x * x, force + pull * y * y, force + pull * z * z, pull * x * y, pull * x * z, pull * y * z),
        axis=1,
    )


def _square(vectors: Floats) -> Floats:
    return _dot(vectors, vectors)


def _dot(one: Floats, other: Floats) -> Floats:
    products: Floats = np.einsum("ij,ij->i", one, other)
    return products
