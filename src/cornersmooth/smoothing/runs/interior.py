"""The smoothest spline within the tolerances: a primal-dual interior-point method on many windows at once.

Minimised is ∫w·|C‴|² + Σp·|x|² where x·M·x ≤ r² for the deviation x at every sample: a convex quadratic objective
with convex quadratic constraints (Boyd and Vandenberghe, Convex Optimization, 11.7). M = I + k·O·Oᵀ is round about the
tool axis O. The matrix of a step has 3 by 3 blocks on seven diagonals. What begins within its bounds stays there; what
begins outside is led inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.runs.banded import Gather, Windows, couplings, keep_in_planes, solve_blocks

#: steps at most, and the share of the way to the bounds that each may go
STEPS, BACK_OFF = 40, 0.95

#: how much the barrier falls in a step
_CENTRE = 0.25

#: gap over the objective that is begun with, far from the solution and near it
COLD, WARM = 1.0, 0.3

#: part of the slope of the objective at the beginning that may be left without multipliers at the end
SETTLED = 0.1

#: least slack that is begun with: of what is outside its bounds, and of what touches them
_LEAST_SLACK = 0.02


@dataclass(frozen=True)
class Task:
    """Tip or axis point of some windows, in units of the tolerance: c control points, m samples."""

    near: Gather  # samples at the control points
    smooth: Gather  # spans at the control points
    windows: Windows
    sample_window: Ints  # window of each sample
    penalty: Floats  # p over the first part of the objective at the beginning, (m,)
    weight: Floats  # of the squared third derivatives, times the widths, (spans,)
    axis: Floats  # O at the samples, (m, 3)
    stretch: Floats  # k > -1, (m,)
    radius: Floats  # r, (m,)
    normal: Floats | None = None  # control points do not move along it, (c, 3); 0 where they move as they like


def smoothest(task: Task, off: Floats, jerk: Floats, enough: float, begin: float) -> Floats:
    """Change of the control points (c, 3) that makes the windows as smooth as their bounds allow.

    It begins with deviations (m, 3) at the samples and third derivatives (spans, 3). The bound of what is left to gain,
    over the objective, is `begin` at the beginning, as far as it is known (`COLD` or `WARM`), and ends the steps at
    `enough`.
    """
    windows, axis = task.windows, np.ascontiguousarray(task.axis.T)
    off, jerk, coupled = np.ascontiguousarray(off.T), np.ascontiguousarray(jerk.T), couplings(windows.free)
    each = np.arange(len(windows.count))  # every window has samples
    first, first_span = (np.searchsorted(of, each) for of in (task.sample_window, windows.span_window))

    def metric(off: Floats) -> Floats:
        """M·x of deviations (3, m)."""
        return off + task.stretch * product(axis, off) * axis

    def total(values: Floats) -> Floats:
        """(windows,) sums of values at the samples (m,)."""
        return np.add.reduceat(values, first)

    def roughness(weight: Floats) -> Floats:
        """(windows,) the first part of the objective."""
        return np.add.reduceat(weight * product(jerk, jerk), first_span)

    change = np.zeros((3, len(windows.free)))
    begun = roughness(task.weight)
    weight = task.weight / np.where(begun > 0.0, begun, 1.0)[windows.span_window]
    stiff = task.smooth.bands(weight)
    many = total(np.ones(len(task.radius)))
    pull = metric(off)
    slack = (task.radius**2 - product(off, pull)) / 2.0
    inside = slack >= _LEAST_SLACK * task.radius
    room = np.where(inside, slack, _LEAST_SLACK * task.radius)
    penalty = np.where(begun > 0.0, 1.0, 0.0)[task.sample_window] * task.penalty
    cost = roughness(weight) + total(penalty * product(off, off))
    force = np.maximum(begin * cost / many, 1e-12)[task.sample_window] / room  # the multipliers
    ahead: Floats = np.ones(len(each))  # part of the slope at the beginning that no multipliers hold yet
    for _ in range(STEPS):
        gap = total(room * force)
        bent = force / room
        barrier = (_CENTRE * gap / many)[task.sample_window] / room + bent * (room - slack)
        right = -task.smooth.sum_rows(weight * jerk) - task.near.sum_rows(barrier * pull + penalty * off)
        bands = task.near.bands(_bend(axis, force * task.stretch, force + penalty, bent, pull))
        bands[..., :3] += stiff
        if task.normal is not None:
            keep_in_planes(bands, right, task.normal)
        step = solve_blocks(bands, right, coupled)
        step_off, step_jerk = task.near.apply_rows(step), task.smooth.apply_rows(step)
        step_pull = metric(step_off)
        along = product(pull, step_off)
        step_force = barrier - force + bent * along
        step_room = slack - room - along
        square = product(step_off, step_pull)
        reach = np.minimum.reduceat(_reach((inside, slack, room, force), (along, square, step_room, step_force)), first)
        reach = np.minimum(1.0, BACK_OFF * reach)
        outside = total((slack < -1e-3).astype(np.float64)) > 0
        done = (gap <= enough * cost) & (ahead <= SETTLED) & ~outside
        reach[done] = 0.0
        ahead = ahead * (1.0 - reach)
        change += reach[windows.window] * step
        by_sample = reach[task.sample_window]
        off += by_sample * step_off
        pull += by_sample * step_pull
        jerk += reach[windows.span_window] * step_jerk
        force = force + by_sample * step_force
        slack = slack - by_sample * (along + 0.5 * by_sample * square)
        room = np.where(inside, slack, np.maximum(room + by_sample * step_room, slack))
        inside = inside | (slack >= room)
        cost = roughness(weight) + total(penalty * product(off, off))
        if done.all():
            break
    return np.ascontiguousarray(change.T)


def _reach(now: tuple[Bools, Floats, Floats, Floats], step: tuple[Floats, Floats, Floats, Floats]) -> Floats:
    """(m,) share of the step that keeps the bounds of each sample."""
    inside, slack, room, force = now
    along, square, step_room, step_force = step
    with np.errstate(divide="ignore", invalid="ignore"):
        # the root of |off + r·step| = radius, in the form without cancellation
        root = np.sqrt(np.maximum(along * along + 2.0 * slack * square, 0.0))
        primal = np.where(along > 0.0, 2.0 * slack / (along + root), (root - along) / square)
        primal = np.where(square > 0.0, primal, np.inf)
        linear = np.where(step_room < 0.0, -room / step_room, np.inf)
        dual = np.where(step_force < 0.0, -force / step_force, np.inf)
    return np.minimum(np.where(inside, primal, linear), dual)


def _bend(axis: Floats, lean: Floats, even: Floats, bent: Floats, pull: Floats) -> Floats:
    """(m, 6) second derivatives of the bounds and of the penalty: xx, yy, zz, xy, xz, yz."""
    (x, y, z), (a, b, c) = pull, axis
    bx, by, bz, la, lb = bent * x, bent * y, bent * z, lean * a, lean * b
    out = np.empty((len(bent), 6))
    out[:, 0] = even + bx * x + la * a
    out[:, 1] = even + by * y + lb * b
    out[:, 2] = even + bz * z + lean * c * c
    out[:, 3] = bx * y + la * b
    out[:, 4] = bx * z + la * c
    out[:, 5] = by * z + lb * c
    return out


def product(one: Floats, other: Floats) -> Floats:
    """(m,) products of columns (3, m)."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
