"""`method="global"`: one pair of cubic B-splines for a whole run of corners (docs/global.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cornersmooth.errors import Finding
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import ranges, spread, starts
from cornersmooth.model import Bools, Corners, Floats, Ints, LimitedBy, Program, Runs, SmoothProgram, Status, Trait
from cornersmooth.settings import Settings
from cornersmooth.slices import some_runs
from cornersmooth.smoothing.construction import RUN_CURVATURE
from cornersmooth.smoothing.corner_table import with_rows
from cornersmooth.smoothing.neighbours import find_neighbours
from cornersmooth.smoothing.proportional import Proportional
from cornersmooth.smoothing.runs.polylines import Polylines
from cornersmooth.smoothing.runs.rows import TURNING
from cornersmooth.smoothing.runs.solving import STEP, AtPoses, RunCurves, solve_groups
from cornersmooth.smoothing.transition import place_corners
from cornersmooth.vectors import angle_between

#: degrees: where the axis turns by more in a segment, output in curves (which cannot change F inside one) has no run.
#: Between two control points so far apart nothing but the curve itself tells where the tool is.
STEEPEST = 30.0


class GlobalRuns(Proportional):
    """Corners of a run are rounded together; those of runs that cannot be are rounded one by one."""

    def smooth(
        self,
        program: Program,
        settings: Settings,
        progress: Callable[[int, int], None] | None = None,
        processes: int = 1,
    ) -> SmoothProgram:
        """Round every corner by itself, then replace whole runs by one pair of curves."""
        corners = place_corners(program, settings, self)
        pose, count, steep = find_runs(program, settings, corners)
        findings = program.findings if not len(steep) else (*program.findings, _steep(program, steep))
        if not len(count):
            return SmoothProgram(program, corners, settings, findings)
        point = np.hstack((program.tip[pose], program.tip[pose] + settings.axis_length * program.axis[pose]))
        tolerances = settings.tip_tolerance, settings.axis_point_tolerance - TURNING * _turning(settings)
        back = _backwards(point, count)
        order = _turned(count, back)
        lines = Polylines.through(point[order], count, STEP * min(tolerances))
        curves, found = solve_groups(lines, tolerances, settings.axis_length, progress, processes=processes)
        curves = _turned_curves(curves, back)
        found = AtPoses(found.tip[order], found.axis[order], found.turn[order], found.curvature[order])
        runs = _kept(curves, pose)
        if not curves.kept.all():
            first = int(pose[lines.first[:-1][~curves.kept][0]])
            findings = (*findings, _one_by_one(program, first, curves, count))
        return SmoothProgram(program, _with_runs(corners, runs, curves, found), settings, findings, runs)


def corner_by_corner(smoothed: SmoothProgram, runs: Bools) -> SmoothProgram:
    """Take back the curves of some runs, which a machine cannot follow: (r,) of `SmoothProgram.runs`."""
    program, whole, corners = smoothed.program, smoothed.runs, smoothed.corners
    assert whole is not None
    own = place_corners(program, smoothed.settings, CONSTRUCTION)
    run, place = spread(whole.count)
    rows = np.searchsorted(corners.pose, whole.pose[runs[run] & (place > 0) & (place < whole.count[run] - 1)])
    text = "corner rounded by itself: the curves of its run would leave the limits of a rotary axis"
    finding = Finding("CS239", "note", int(program.line[corners.pose[rows[0]]]), text, len(rows))
    return replace(
        smoothed,
        corners=with_rows(corners, own, rows),
        findings=(*smoothed.findings, finding),
        runs=None if runs.all() else some_runs(whole, ~runs),
    )


def _backwards(point: Floats, count: Ints) -> Bools:
    """(r,) bool: runs that are solved from their end, so that there and back the curve is the same.

    The longest way in any coordinate from the first to the last pose leads upwards; on a ring, that between their
    neighbours.
    """
    first, last = starts(count)[:-1], starts(count)[1:] - 1
    way, inner = point[last] - point[first], point[last - 1] - point[first + 1]
    way = np.where(way.any(axis=1, keepdims=True), way, inner)
    back: Bools = way[np.arange(len(way)), np.abs(way).argmax(axis=1)] < 0.0
    return back


def _turned(count: Ints, back: Bools) -> Ints:
    """Rows of runs with those of some of them in reverse: its own inverse."""
    run, place = spread(count)
    order: Ints = starts(count)[run] + np.where(back[run], count[run] - 1 - place, place)
    return order


def _turned_curves(curves: RunCurves, back: Bools) -> RunCurves:
    """The same curves, some of them from their other end."""
    lines, splines = curves.lines, curves.splines
    whole = lines.s[lines.first[1:] - 1]

    def turned(s: Floats, count: Ints) -> Floats:
        run, order = spread(count)[0], _turned(count, back)
        places: Floats = np.where(back[run], whole[run] - s[order], s[order])
        return places

    poses = _turned(lines.count, back)
    return replace(
        curves,
        lines=Polylines(lines.point[poses], lines.count, turned(lines.s, lines.count), lines.step),
        splines=Splines(turned(splines.knot, splines.count), splines.count),
        control=curves.control[_turned(splines.count + 2, back)],
    )


def _turning(settings: Settings) -> float:
    """What the tolerance at `Settings.axis_scale` is worth at the axis point, mm."""
    return settings.tolerance * (settings.axis_length / settings.axis_scale)


def find_runs(program: Program, settings: Settings, corners: Corners) -> tuple[Ints, Ints, Ints]:
    """Poses of the runs that have a corner to round, repeated poses left out, and their number in each run.

    Runs in which the axis turns steeply are left to rounding corner by corner where the output is curves; third come
    the poses of their corners.
    """
    around = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    chains = program.chains
    pose = ranges(chains[:, 0], chains[:, 1] - chains[:, 0] + 1)
    chain, place = spread(chains[:, 1] - chains[:, 0] + 1)
    distinct = ~around.duplicate[pose] | (place == 0)
    pose, chain = pose[distinct], chain[distinct]
    status = np.full(len(program), Status.KEPT, np.uint8)
    status[corners.pose] = corners.status
    inner = np.zeros(len(pose), np.bool_)
    inner[1:-1] = (chain[1:-1] == chain[:-2]) & (chain[1:-1] == chain[2:])
    joins = inner & ~np.isin(status[pose], Status.having(Trait.ENDS_RUN))
    bent = joins & np.isin(status[pose], (Status.SMOOTHED, Status.TOO_SHORT))
    # a run is a row of segments whose inner poses all join; segment i leads from pose i to pose i + 1
    segment = np.flatnonzero(chain[1:] == chain[:-1])
    if not len(segment):
        return pose[:0], pose[:0], pose[:0]
    begins = ~joins[segment]
    run = np.cumsum(begins) - 1
    first = segment[begins]
    number = np.bincount(run)
    wanted = np.bincount(run, bent[segment]) > 0
    if not settings.round_feed_changes:
        turn = angle_between(program.axis[pose[segment]], program.axis[pose[segment + 1]])
        steep = wanted & (np.bincount(run, turn > np.radians(STEEPEST)) > 0)
        wanted &= ~steep
    else:
        steep = np.zeros(len(wanted), np.bool_)
    left = pose[ranges(first[steep] + 1, number[steep] - 1)]
    return pose[ranges(first[wanted], number[wanted] + 1)], number[wanted] + 1, left


def _kept(curves: RunCurves, pose: Ints) -> Runs:
    """The runs that keep their tolerances."""
    lines, splines, kept = curves.lines, curves.splines, curves.kept
    poses = np.repeat(kept, lines.count)
    return Runs(
        pose=pose[poses],
        count=lines.count[kept],
        s=lines.s[poses],
        step=lines.step,
        knot=splines.knot[np.repeat(kept, splines.count)],
        knot_count=splines.count[kept],
        control=curves.control[kept[splines.control_run]],
        tip_bound=curves.tip_bound[kept],
        axis_bound=curves.axis_bound[kept],
    )


def _with_runs(corners: Corners, runs: Runs, curves: RunCurves, found: AtPoses) -> Corners:
    """Corners with those of the runs marked, and what is known of them."""
    run, place = spread(runs.count)
    inner = np.flatnonzero((place > 0) & (place < runs.count[run] - 1))
    rows = np.searchsorted(corners.pose, runs.pose[inner])
    status, limited_by = corners.status.copy(), corners.limited_by.copy()
    status[rows], limited_by[rows] = Status.IN_RUN, LimitedBy.TOLERANCE
    values = {name: getattr(corners, name).copy() for name in ("tip_error", "axis_error", "orientation_error")}
    known = np.repeat(curves.kept, curves.lines.count)
    for name, column in (("tip_error", found.tip), ("axis_error", found.axis), ("orientation_error", found.turn)):
        values[name][rows] = column[known][inner]
    curvature = np.full(len(corners), np.nan)
    curvature[rows] = found.curvature[known][inner]
    trim_in, trim_out = corners.trim_in.copy(), corners.trim_out.copy()
    trim_in[rows] = trim_out[rows] = 0.0
    return replace(
        corners,
        status=status,
        limited_by=limited_by,
        trim_in=trim_in,
        trim_out=trim_out,
        axis_trim_in=trim_in,
        axis_trim_out=trim_out,
        extra={**corners.extra, RUN_CURVATURE: curvature},
        **values,
    )


def _steep(program: Program, pose: Ints) -> Finding:
    text = f"corner rounded by itself: the tool axis turns by more than {STEEPEST:g} deg in one move of its run"
    return Finding("CS229", "note", int(program.line[pose[0]]), text, len(pose))


def _one_by_one(program: Program, pose: int, curves: RunCurves, count: Ints) -> Finding:
    kept: Bools = curves.kept
    corners = int((count[~kept] - 2).sum())
    text = "corner rounded by itself: the curves of its run were not proved to keep the tolerance"
    return Finding("CS226", "note", int(program.line[pose]), text, corners)


CONSTRUCTION = GlobalRuns()
