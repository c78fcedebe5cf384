"""Runs of a whole program, some at a time: each group is fitted, solved, proved and measured for itself.

A group is as large as keeps the arrays small, whatever the length of the program; several processes work on groups side
by side. A run that is a group of its own is shared window by window instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.processes import map_in_processes
from cornersmooth.smoothing.runs.lines import largest_curvature, points_at
from cornersmooth.smoothing.runs.polylines import Polylines
from cornersmooth.smoothing.runs.ranges import spread, starts
from cornersmooth.smoothing.runs.solving import RunCurves, solve_runs
from cornersmooth.smoothing.runs.splines import Splines
from cornersmooth.vectors import angle_between, norm

#: poses of a group, about
GROUP = 2500


@dataclass(frozen=True)
class AtPoses:
    """Curves at the n poses of their runs.

    Parameters
    ----------
    tip, axis : (n,) float64, mm
        Deviation of tip and axis point at common parameters.
    turn : (n,) float64, rad
        Deviation of the axis.
    curvature : (n,) float64, 1/mm
        Largest curvature of the tip's curve in the halves of the segments beside the pose.
    """

    tip: Floats
    axis: Floats
    turn: Floats
    curvature: Floats


def solve_groups(
    lines: Polylines,
    tolerances: tuple[float, float],
    axis_length: float,
    progress: Callable[[int, int], None] | None = None,
    *,
    processes: int = 1,
) -> tuple[RunCurves, AtPoses]:
    """Find the smoothest pair of splines for every run, and measure them at the poses.

    Parameters
    ----------
    lines : Polylines
        Runs of 3 distinct poses or more.
    tolerances : (float, float), mm
        Of the tip and of the axis point at constant H.
    axis_length : float, mm
        H.
    progress : callable, optional
        Called with (poses done, poses in all).
    processes : int
        Processes that work; the result does not depend on it.
    """
    group = np.cumsum(lines.count) // GROUP
    first = np.flatnonzero(np.concatenate(([True], group[1:] != group[:-1], [True])))
    alone = len(first) == 2

    def share_of_one(done: int, total: int) -> None:
        if progress is not None:
            progress(len(lines.s) * done // total, len(lines.s))

    def settle(number: int) -> tuple[RunCurves, AtPoses]:
        runs = slice(first[number], first[number + 1])
        poses = slice(lines.first[runs.start], lines.first[runs.stop])
        own = Polylines(lines.point[poses], lines.count[runs], lines.s[poses], lines.step)
        told, many = (share_of_one, processes) if alone else (None, 1)
        curves = solve_runs(own, tolerances, axis_length, told, processes=many)
        return curves, _measured(curves)

    found = []
    for number, solved in enumerate(map_in_processes(settle, range(len(first) - 1), 1 if alone else processes)):
        found.append(solved)
        if progress is not None:
            progress(int(lines.first[first[number + 1]]), len(lines.s))
    curves = [part for part, _ in found]
    whole = RunCurves(
        lines=lines,
        splines=Splines(
            np.concatenate([part.splines.knot for part in curves]),
            np.concatenate([part.splines.count for part in curves]),
        ),
        control=np.concatenate([part.control for part in curves]),
        tip_bound=np.concatenate([part.tip_bound for part in curves]),
        axis_bound=np.concatenate([part.axis_bound for part in curves]),
        kept=np.concatenate([part.kept for part in curves]),
    )
    names = ("tip", "axis", "turn", "curvature")
    return whole, AtPoses(*(np.concatenate([getattr(part, name) for _, part in found]) for name in names))


def _measured(curves: RunCurves) -> AtPoses:
    lines, splines = curves.lines, curves.splines
    run, _ = spread(lines.count)
    base = starts(splines.knot[splines.first[1:] - 1].astype(np.int64) + 1)[:-1]
    keys = splines.knot + np.repeat(base, splines.count)
    knot = np.searchsorted(keys, lines.s + base[run], side="right") - 1
    knot = np.clip(knot, splines.first[run], splines.first[run + 1] - 2)
    tip, axis = points_at(curves.control, splines, knot - run, lines.s)
    lever = lines.point[:, 3:] - lines.point[:, :3]
    size = norm(lever)[:, None]
    off = tip - lines.point[:, :3]
    top = off + size * axis - lever
    curvature = largest_curvature(lines, splines, curves.control)
    return AtPoses(norm(off), norm(top), angle_between(axis, lever / size), curvature)
