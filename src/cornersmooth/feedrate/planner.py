"""From a program and limits to a time law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.feedrate.between import fastest
from cornersmooth.feedrate.intervals import FINER, PLAIN, Intervals, Resolution, path_limits
from cornersmooth.feedrate.machine_axes import MachineAxes, follow
from cornersmooth.feedrate.path import Path, build_path
from cornersmooth.feedrate.speed_problem import around, make_grid
from cornersmooth.feedrate.timelaw import TimeLaw, crossing_time, rest_to_rest
from cornersmooth.kinematics import Machine
from cornersmooth.model import Floats, Ints, Program, SmoothProgram
from cornersmooth.settings import Limits, Settings

Baseline = Literal["exact_stop", "velocity_jump"]
Progress = Callable[[int, int], None]

#: elements of a path planned together where axes are looked at closely, which takes 0.1 MB an element; more where no
#: stop is in between
PORTION = 4096


def plan(
    smooth_program: SmoothProgram,
    limits: Limits | None = None,
    *,
    machine: Machine | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan the motion along the smoothed path.

    Path speed, tangential acceleration, centripetal acceleration and tangential jerk of the tip stay within the
    limits at every moment; the motion stops where a statement acts between feed moves, at reversals, and where the tip
    stands still while the axis turns. Other sharp corners are passed with a jump of velocity of at most
    ``accel · period``.

    Parameters
    ----------
    machine : Machine, optional
        Keep the limits of its five axes.
    progress : callable, optional
        Called with (work done, work in all).

    Returns
    -------
    TimeLaw
        Of the whole program: seconds, mm, degrees.

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
    return plan_along(path, limits, None if machine is None else follow(machine, path), progress=progress)


def direct(
    program: Program,
    limits: Limits | None = None,
    baseline: Baseline = "exact_stop",
    *,
    settings: Settings | None = None,
    machine: Machine | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan the motion along the original path.

    It raises what `cornersmooth.feedrate.plan` does, and SettingsError CS230 for another baseline.

    Parameters
    ----------
    baseline : {"exact_stop", "velocity_jump"}
        What happens at corners: a stop at the end of every move, or a jump of velocity of at most ``accel · period``,
        that is a speed of at most ``accel · period / (2·sin(α/2))``; where corners follow one another within a
        period, that is the limit of all of them together.
    settings : Settings, optional
        Says which repeated poses are one.
    machine : Machine, optional
        Keep the limits of its five axes; at corners none jumps by more than its acceleration allows in one period.

    Returns
    -------
    TimeLaw
        Of the whole program: seconds, mm, degrees.
    """
    limits = Limits() if limits is None else limits
    settings = Settings() if settings is None else settings
    if baseline not in get_args(Baseline):
        raise SettingsError("CS230", f"unknown baseline {baseline!r}", f"use one of {', '.join(get_args(Baseline))}")
    path = build_path(program, None, settings, limits, stop_everywhere=baseline == "exact_stop")
    return plan_along(path, limits, None if machine is None else follow(machine, path), progress=progress)


def passed(path: Path, limits: Limits, machine_axes: MachineAxes | None) -> Path:
    """Path with the speeds at which its junctions are passed, by the way and by the axes of a machine."""
    if machine_axes is not None:
        path = replace(path, junction_speed=np.minimum(path.junction_speed, machine_axes.jump_speeds(limits.period)))
    return replace(path, junction_speed=_not_crowded(path, limits.period))


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


def plan_along(
    path: Path,
    limits: Limits,
    machine_axes: MachineAxes | None,
    resolution: Resolution | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan the motion along a path, with the axes of a machine that follow it."""
    borders = [0, len(path)] if machine_axes is None else _portions(path)
    phases, junctions, edges = [], [path.junction_speed[:1]], [np.zeros(1)]
    for begin, stop in pairwise(borders):
        own = path.part(begin, stop)
        own_axes = None if machine_axes is None else replace(machine_axes, path=own)
        report = None if progress is None else partial(_report, progress, len(path), begin, stop)
        own, found = _plan_part(own, limits, own_axes, resolution, report)
        found[1] = found[1] + edges[-1][-1]
        edges.append(edges[-1][-1] + own.edge[1:])
        phases.append(found)
        junctions.append(own.junction_speed[1:])
    duration, way, speed, rising, rate, constant = (np.concatenate(parts) for parts in zip(*phases, strict=True))
    return TimeLaw(
        time=np.concatenate(([0.0], np.cumsum(duration))),
        way=np.append(way, edges[-1][-1:]),
        speed=speed,
        accel=rising,
        jerk=constant,
        rate=rate,
        path=replace(path, junction_speed=np.concatenate(junctions)),
        limits=limits,
        edge=np.concatenate(edges),
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
    machine_axes: MachineAxes | None,
    resolution: Resolution | None,
    progress: Progress | None,
) -> tuple[Path, list[Floats]]:
    """Plan from a stop to a stop: the path with its speeds at junctions, and phases of the law."""
    path = passed(path, limits, machine_axes)
    found = path_limits(path, limits, machine_axes, resolution or FINER)
    level = found.level
    parts = [_level_runs(found, np.flatnonzero(level))]
    if not level.all():
        parts.append(_uneven_runs(found, np.flatnonzero(~level), resolution, progress))
    run, *phases = (np.concatenate([part[i] for part in parts]) for i in range(7))
    order = np.argsort(run, kind="stable")
    order = order[phases[0][order] > 0.0]
    return path, [phase[order] for phase in phases]


def _level_runs(limits: Intervals, runs: Ints) -> tuple[Floats | Ints, ...]:
    """Phases of runs with one speed limit: S-curves in closed form."""
    first = limits.run[runs]
    begin, end, limit = limits.edge[first], limits.edge[limits.run[runs + 1]], np.sqrt(limits.cap[first])
    duration, signed, _ = rest_to_rest(end - begin, limit, limits.accel[runs], limits.jerk[runs])
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


def _uneven_runs(
    limits: Intervals, runs: Ints, resolution: Resolution | None, progress: Progress | None
) -> tuple[Floats | Ints, ...]:
    """Phases of runs whose speed limit changes on the way: one per cell."""
    resolution = resolution or (FINER if limits.aligned else PLAIN)
    grid = make_grid(limits, runs, resolution)
    batch, c = fastest(grid, limits, resolution, progress)
    z, slope, bend = (batch.forms * around(c)).sum(axis=1)
    v, a = np.sqrt(z), 0.5 * slope  # at the start of each cell
    first, last = grid.first, grid.last
    after_v = np.append(v[1:], 0.0)
    ends = np.zeros(len(v), np.bool_)
    ends[first] = ends[last] = True
    duration = crossing_time(grid.width, np.where(ends, 1.0, v + after_v), np.where(ends, 0.0, bend))
    constant = np.zeros(len(v))
    for end, speed in ((first, after_v), (last, v)):
        duration[end] = 3.0 * grid.width[end] / speed[end]
        constant[end] = 6.0 * grid.width[end] / duration[end] ** 3
    return runs[grid.run], duration, grid.start, v, a, bend, constant
