"""`method="global"`: one pair of cubic B-splines for a whole run of corners (docs/global.md)."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.arrays import angle_between, batches, joined_rows, ranges, some_runs, spread, starts
from cornersmooth.errors import Finding
from cornersmooth.model import Bools, Corners, Floats, Ints, LimitedBy, Program, Runs, SmoothProgram, Status, Trait
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import RUN_CURVATURE, Progress, find_neighbours, place_corners
from cornersmooth.smoothing.proportional import Proportional
from cornersmooth.smoothing.runs.polylines import Polylines
from cornersmooth.smoothing.runs.rows import TURNING
from cornersmooth.smoothing.runs.solving import STEP, measured, solve_runs
from cornersmooth.system.processes import map_in_processes

#: poses of runs that are solved together, about
GROUP = 2500

#: degrees: where the axis turns by more in a segment, output in curves (which cannot change F inside one) has no run.
#: Between two control points so far apart nothing but the curve itself tells where the tool is.
STEEPEST = 30.0


class GlobalRuns(Proportional):
    """Corners of a run are rounded together; those of runs that cannot be are rounded one by one."""

    extra = (RUN_CURVATURE,)

    def smooth(
        self, program: Program, settings: Settings, progress: Progress | None = None, processes: int = 1
    ) -> SmoothProgram:
        """Round every corner by itself, then replace whole runs by one pair of curves.

        Groups of runs are solved side by side, or the windows of one: whole-program arrays stay few.
        """
        corners = place_corners(program, settings, self)
        pose, count, steep = find_runs(program, settings, corners)
        findings = program.findings
        if len(steep):
            text = f"corner rounded by itself: the tool axis turns by more than {STEEPEST:g} deg in one move of its run"
            findings = (*findings, Finding("CS229", "note", int(program.line[steep[0]]), text, len(steep)))
        if not len(count):
            return SmoothProgram(program, corners, settings, findings)
        first = batches(count, GROUP)
        begin, alone = starts(count)[first], len(first) == 2

        def solve(number: int) -> _Solved:
            poses, runs = pose[begin[number] : begin[number + 1]], count[first[number] : first[number + 1]]
            return _solve(program, settings, poses, runs, *((progress, processes) if alone else (None, 1)))

        parts: list[_Solved] = []
        for number, solved in enumerate(map_in_processes(solve, range(len(first) - 1), 1 if alone else processes)):
            rows = np.searchsorted(corners.pose, solved.pose)
            corners.status[rows], corners.limited_by[rows] = Status.IN_RUN, LimitedBy.TOLERANCE
            corners.trim_in[rows] = corners.trim_out[rows] = 0.0  # those of the axis point are the same arrays
            for name, values in solved.columns.items():
                column = corners.extra[name] if name in corners.extra else getattr(corners, name)
                column[rows] = values
            parts.append(solved)
            if progress is not None:
                progress(int(begin[number + 1]), len(pose))
        runs, lost = joined_rows(part.runs for part in parts), np.concatenate([part.left for part in parts])
        if len(lost):
            text = "corner rounded by itself: the curves of its run were not proved to keep the tolerance"
            findings = (*findings, Finding("CS226", "note", int(program.line[lost[0]]), text, len(lost)))
        return SmoothProgram(program, corners, settings, findings, runs if len(runs) else None)


@dataclass(frozen=True)
class _Solved:
    """Some runs with the curves that keep their tolerances, and what these are at the corners."""

    runs: Runs
    pose: Ints  # the corners of `runs`
    columns: dict[str, Floats]  # what `Corners` holds of them
    left: Ints  # corners of runs that were not proved


def _solve(
    program: Program, settings: Settings, pose: Ints, count: Ints, progress: Progress | None, processes: int
) -> _Solved:
    point = np.hstack((program.tip[pose], program.tip[pose] + settings.axis_length * program.axis[pose]))
    # what turning the axis inside a line is worth at the axis point is left free
    turning = TURNING * settings.tolerance * (settings.axis_length / settings.axis_scale)
    shift = 0.0 if program.moved is None else float(program.moved[pose].max())
    spare = settings.curve_share * (settings.pose_shift - shift)
    tolerances = settings.tip_tolerance + spare, settings.axis_point_tolerance + spare - turning
    back = _backwards(point, count)
    lines = Polylines.through(point[_turned(count, back)], count, STEP * min(tolerances))
    curves = solve_runs(lines, tolerances, settings.axis_length, progress, processes=processes)
    splines, kept, whole, order = curves.splines, curves.kept, lines.s[lines.first[1:] - 1], _turned(count, back)

    def ahead(s: Floats, counts: Ints) -> Floats:
        owner, own = spread(counts)[0], _turned(counts, back)
        return np.where(back[owner], whole[owner] - s[own], s[own])

    knot, control = ahead(splines.knot, splines.count), curves.control[_turned(splines.count + 2, back)]
    bounds = curves.tip_bound + shift, curves.axis_bound + shift
    runs = Runs(pose, count, ahead(lines.s, count), lines.step, knot, splines.count, control, *bounds)
    run, place = spread(count)
    inner = (place > 0) & (place < count[run] - 1)
    known = inner & kept[run]
    names = ("tip_error", "axis_error", "orientation_error", RUN_CURVATURE)
    columns = {name: values[order][known] for name, values in zip(names, measured(curves), strict=True)}
    return _Solved(some_runs(runs, kept), pose[known], columns, pose[inner & ~kept[run]])


def corner_by_corner(smoothed: SmoothProgram) -> SmoothProgram:
    """Take back the curves of runs, which a machine cannot follow."""
    program, whole, corners = smoothed.program, smoothed.runs, deepcopy(smoothed.corners)
    assert whole is not None
    alone = place_corners(program, smoothed.settings, CONSTRUCTION)
    run, place = spread(whole.count)
    rows = np.searchsorted(corners.pose, whole.pose[(place > 0) & (place < whole.count[run] - 1)])
    for name in vars(corners).keys() - {"extra"}:
        getattr(corners, name)[rows] = getattr(alone, name)[rows]
    for column in corners.extra.values():
        column[rows] = np.nan
    text = "corner rounded by itself: curves of runs would leave the limits of a rotary axis"
    finding = Finding("CS239", "note", int(program.line[corners.pose[rows[0]]]), text, len(rows))
    return replace(smoothed, corners=corners, findings=(*smoothed.findings, finding), runs=None)


def _backwards(point: Floats, count: Ints) -> Bools:
    """(r,) bool: runs that are solved from their end, so that there and back the curve is the same.

    The longest way in any coordinate from the first to the last pose leads upwards; on a ring, that between their
    neighbours.
    """
    first, last = starts(count)[:-1], starts(count)[1:] - 1
    way, inner = point[last] - point[first], point[last - 1] - point[first + 1]
    way = np.where(way.any(axis=1, keepdims=True), way, inner)
    return way[np.arange(len(way)), np.abs(way).argmax(axis=1)] < 0.0


def _turned(count: Ints, back: Bools) -> Ints:
    """Rows of runs with those of some of them in reverse: its own inverse."""
    run, place = spread(count)
    return starts(count)[run] + np.where(back[run], count[run] - 1 - place, place)


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
    ends, turns = Status.having(Trait.ENDS_RUN), {*Status.having(Trait.PASSED_BY)} - {*Status.having(Trait.NO_CORNER)}
    joins = inner & ~np.isin(status[pose], ends)
    bent = joins & np.isin(status[pose], sorted(turns))
    # a run is a row of segments whose inner poses all join; segment i leads from pose i to pose i + 1
    segment = np.flatnonzero(chain[1:] == chain[:-1])
    if not len(segment):
        return pose[:0], pose[:0], pose[:0]
    begins = ~joins[segment]
    run = np.cumsum(begins) - 1
    first = segment[begins]
    number = np.bincount(run)
    wanted = np.bincount(run, bent[segment]) > 0
    turn = angle_between(program.axis[pose[segment]], program.axis[pose[segment + 1]])
    steepest = np.inf if settings.round_feed_changes else np.radians(STEEPEST)
    steep = wanted & (np.bincount(run, turn > steepest) > 0)
    wanted &= ~steep
    left = pose[ranges(first[steep] + 1, number[steep] - 1)]
    return pose[ranges(first[wanted], number[wanted] + 1)], number[wanted] + 1, left


CONSTRUCTION = GlobalRuns()
