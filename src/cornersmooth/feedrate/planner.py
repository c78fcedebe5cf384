"""From a program and limits to a time law."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Literal

import numpy as np

from cornersmooth.feedrate import lookahead, scurve
from cornersmooth.feedrate.axis_limits import AxisLimits, LimitCoefficients, find_limit_coefficients
from cornersmooth.feedrate.grid import Resolution, make_grid
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.machine_axes import MachineAxes, follow
from cornersmooth.feedrate.path import Path, build_path
from cornersmooth.feedrate.signed_limits import ROUGH, Given, faster
from cornersmooth.feedrate.speed_limits import SpeedLimits, find_speed_limits
from cornersmooth.feedrate.timelaw import TimeLaw, crossing_time
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Floats, Ints, Program, SmoothProgram
from cornersmooth.settings import Settings

Baseline = Literal["exact_stop", "velocity_jump"]
Progress = Callable[[int, int], None]

#: elements of a path planned together where axes are looked at closely, which takes 0.1 MB an element; more where no
#: stop is in between
PORTION = 4096


def plan(
    smooth_program: SmoothProgram,
    limits: Limits | None = None,
    *,
    axes: Sequence[AxisLimits] = (),
    machine: Machine | None = None,
    resolution: Resolution | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan the motion along the smoothed path.

    Path speed, tangential acceleration, centripetal acceleration and tangential jerk of the tip stay within the
    limits at every moment; the motion stops where a statement acts between feed moves, at reversals, and where the tip
    stands still while the axis turns. Other sharp corners are passed with a jump of velocity of at most
    ``accel · period``.

    Parameters
    ----------
    smooth_program : SmoothProgram
    limits : Limits, optional
    axes : sequence of AxisLimits, optional
        Limits of axes whose position is a function of tip and tool axis.
    machine : Machine, optional
        Keep the limits of its five axes.
    resolution : Resolution, optional
        How fine the cells are that the speed is planned in.
    progress : callable, optional
        Called with (work done, work in all).

    Raises
    ------
    SettingsError
        A feed move has no feed in mm/min and `Limits.feed` is not given, or the machine has no dynamics.
    InputError
        The machine does not reach a tool axis.
    """
    limits = Limits() if limits is None else limits
    path = build_path(
        smooth_program.program, smooth_program.corners, smooth_program.settings, limits, runs=smooth_program.runs
    )
    return plan_path(path, limits, axes=axes, machine=machine, resolution=resolution, progress=progress)


def direct(
    program: Program,
    limits: Limits | None = None,
    baseline: Baseline = "exact_stop",
    *,
    settings: Settings | None = None,
    machine: Machine | None = None,
    resolution: Resolution | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan the motion along the original path.

    Parameters
    ----------
    program : Program
    limits : Limits, optional
    baseline : {"exact_stop", "velocity_jump"}
        What happens at corners: a stop at the end of every move, or a jump of velocity of at most ``accel · period``,
        that is a speed of at most ``accel · period / (2·sin(α/2))``; where corners follow one another within a
        period, that is the limit of all of them together.
    settings : Settings, optional
        Says which repeated poses are one.
    machine : Machine, optional
        Keep the limits of its five axes; at corners none jumps by more than its acceleration allows in one period.

    Raises
    ------
    SettingsError
        A feed move has no feed in mm/min and `Limits.feed` is not given, or the machine has no dynamics.
    InputError
        The machine does not reach a tool axis.
    """
    limits = Limits() if limits is None else limits
    settings = Settings() if settings is None else settings
    path = build_path(program, None, settings, limits, stop_everywhere=baseline == "exact_stop")
    return plan_path(path, limits, machine=machine, resolution=resolution, progress=progress)


def _not_crowded(path: Path, period: float) -> Floats:
    """Speeds (m + 1,) at which jumps that follow one another within a period ask for no more together than one may.

    At a speed v a corner uses the share v/v₁ of a jump, where v₁ is its own speed limit. Corners at distances d are
    d/v apart in time, so the sum over a period stays within one jump where v² ≤ v₁·d/T.
    """
    found = path.junction_speed.copy()
    sharp = np.flatnonzero(np.isfinite(found[1:-1])) + 1
    apart = (path.length[sharp - 1] + path.length[sharp]) / 2.0
    found[sharp] = np.minimum(found[sharp], np.sqrt(found[sharp] * apart / period))
    return found


def plan_path(
    path: Path,
    limits: Limits,
    *,
    axes: Sequence[AxisLimits] = (),
    machine: Machine | None = None,
    resolution: Resolution | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan the motion along any path."""
    machine_axes = None if machine is None else follow(machine, path)
    borders = [0, len(path)] if machine_axes is None else _portions(path)
    start = np.concatenate(([0.0], np.cumsum(path.length)))
    phases, junctions, end = [], [path.junction_speed[:1]], 0.0
    for begin, stop in pairwise(borders):
        own = path.part(begin, stop)
        own_axes = None if machine_axes is None else replace(machine_axes, path=own)
        report = None if progress is None else partial(_report, progress, len(path), begin, stop)
        own, found, length = _plan_part(own, limits, axes, own_axes, resolution, report)
        found[1] = found[1] + start[begin]
        phases.append(found)
        junctions.append(own.junction_speed[1:])
        end = start[begin] + length
    duration, way, speed, rising, rate, constant = (np.concatenate(parts) for parts in zip(*phases, strict=True))
    return TimeLaw(
        time=np.concatenate(([0.0], np.cumsum(duration))),
        way=np.append(way, end),
        speed=speed,
        accel=rising,
        jerk=constant,
        rate=rate,
        path=replace(path, junction_speed=np.concatenate(junctions)),
        limits=limits,
        edge=start,
        machine_axes=machine_axes,
    )


def _portions(path: Path) -> list[int]:
    """Elements at which parts of about `PORTION` elements begin and end, all of them stops."""
    stops, borders = np.flatnonzero(path.junction_speed == 0.0), [0]
    while len(path) - borders[-1] > PORTION:
        farthest = np.searchsorted(stops, borders[-1] + PORTION, side="right") - 1
        following = np.searchsorted(stops, borders[-1], side="right")
        borders.append(int(stops[max(farthest, following)]))
    return borders if borders[-1] == len(path) > 0 else [*borders, len(path)]


def _report(progress: Progress, elements: int, begin: int, end: int, done: int, of: int) -> None:
    """Pass on what is done of some elements."""
    progress(begin * of + (end - begin) * done, elements * of)


def _plan_part(
    path: Path,
    limits: Limits,
    axes: Sequence[AxisLimits],
    machine_axes: MachineAxes | None,
    resolution: Resolution | None,
    progress: Progress | None,
) -> tuple[Path, list[Floats], float]:
    """Plan from a stop to a stop: the path with its speeds at junctions, phases of the law, and the length."""
    if machine_axes is not None:
        path = replace(path, junction_speed=np.minimum(path.junction_speed, machine_axes.jump_speeds(limits.period)))
    path = replace(path, junction_speed=_not_crowded(path, limits.period))
    speed_limits = find_speed_limits(path, limits)
    runs = len(speed_limits.run) - 1
    lead = speed_limits.element[:-1]  # first element of each run
    accel = np.where(path.rapid[lead], limits.rapid_limits[1], limits.accel)
    jerk = np.where(path.rapid[lead], limits.rapid_limits[2], limits.jerk)
    accel = np.where(path.turning[lead], limits.angular_limits[1], accel)
    jerk = np.where(path.turning[lead], limits.angular_limits[2], jerk)

    if runs:
        lowest = np.minimum.reduceat(speed_limits.cap, speed_limits.run[:-1])
        highest = np.maximum.reduceat(speed_limits.cap, speed_limits.run[:-1])
        level = lowest == highest
    else:
        level = np.zeros(0, np.bool_)
    coefficients = find_limit_coefficients(path, limits, speed_limits, axes, machine_axes)
    if coefficients is not None and runs:
        level &= ~_exceeding(coefficients, accel, jerk, lowest)
    parts = [_level_runs(speed_limits, np.flatnonzero(level), accel, jerk)]
    uneven = np.flatnonzero(~level)
    if len(uneven):
        parts.append(_uneven_runs(speed_limits, coefficients, uneven, accel, jerk, resolution, progress))
    run, *phases = (np.concatenate([part[i] for part in parts]) for i in range(7))
    order = np.argsort(run, kind="stable")
    order = order[phases[0][order] > 0.0]
    return path, [phase[order] for phase in phases], float(speed_limits.edge[-1])


def _level_runs(speed_limits: SpeedLimits, runs: Ints, accel: Floats, jerk: Floats) -> tuple[Floats | Ints, ...]:
    """Phases of runs with one speed limit: S-curves in closed form."""
    begin, end = speed_limits.edge[speed_limits.run[runs]], speed_limits.edge[speed_limits.run[runs + 1]]
    limit = np.sqrt(speed_limits.cap[speed_limits.run[runs]])
    duration, signed, _ = scurve.rest_to_rest(end - begin, limit, accel[runs], jerk[runs])
    way, speed, rising = np.empty_like(duration), np.empty_like(duration), np.empty_like(duration)
    x, v, a = begin, np.zeros(len(runs)), np.zeros(len(runs))
    for phase in range(duration.shape[1]):
        way[:, phase], speed[:, phase], rising[:, phase] = x, v, a
        t, j = duration[:, phase], signed[:, phase]
        x = x + t * (v + t * (a / 2.0 + t * j / 6.0))
        v = np.maximum(v + t * (a + t * j / 2.0), 0.0)
        a = a + t * j
    zero = np.zeros(duration.size)
    return (
        np.repeat(runs, duration.shape[1]),
        duration.ravel(),
        way.ravel(),
        speed.ravel(),
        rising.ravel(),
        zero,
        signed.ravel(),
    )


def _exceeding(coefficients: LimitCoefficients, accel: Floats, jerk: Floats, cap: Floats) -> Bools:
    """(r,) bool: runs in which vectors ask for more than the limits of the path speed."""
    begin = coefficients.speed_limits.run[:-1]
    slope, level, bend, cross, cube = np.maximum.reduceat(coefficients.rows, begin, axis=1)
    more: Bools = (slope > 0.5 / accel) | (bend > 1.0 / jerk) | (level > 0.0) | (cross > 0.0) | (cube > 0.0)
    return more | (np.minimum.reduceat(coefficients.speed_limits.cap, begin) < cap)


def _uneven_runs(
    speed_limits: SpeedLimits,
    coefficients: LimitCoefficients | None,
    runs: Ints,
    accel: Floats,
    jerk: Floats,
    resolution: Resolution | None,
    progress: Progress | None,
) -> tuple[Floats | Ints, ...]:
    """Phases of runs whose speed limit changes on the way: one per cell."""
    more = None if coefficients is None else coefficients.speed_limits
    given = Given(speed_limits, coefficients, runs, accel[runs], jerk[runs])
    grid = make_grid(speed_limits, runs, accel[runs], jerk[runs], resolution, more)
    batch = given.problem(grid)
    if coefficients is None or coefficients.samples is None:
        c = lookahead.solve_runs(batch, grid, progress)
    else:
        c = faster(given, grid, batch, lookahead.solve_runs(batch, grid, progress, gap=ROUGH))
    of_cell = lookahead.run_of_cells(grid)
    z, slope, bend = batch.forms(c)
    v, a = np.sqrt(z), 0.5 * slope  # at the end of each cell
    before_v = np.concatenate(([0.0], v[:-1]))
    before_a = np.concatenate(([0.0], a[:-1]))
    rate = np.concatenate(([0.0], bend[:-1]))  # of the cell itself
    first, last = grid.first, grid.last
    moving = np.where(np.isin(np.arange(len(v)), np.concatenate((first, last))), 1.0, before_v + v)
    duration = crossing_time(grid.width, moving, rate)
    constant = np.zeros(len(v))
    duration[first] = 3.0 * grid.width[first] / v[first]
    duration[last] = 3.0 * grid.width[last] / before_v[last]
    for end in (first, last):
        constant[end] = 6.0 * grid.width[end] / duration[end] ** 3
        rate[end] = 0.0
    before_v[first] = 0.0
    before_a[first] = 0.0
    return runs[of_cell], duration, grid.start, before_v, before_a, rate, constant
