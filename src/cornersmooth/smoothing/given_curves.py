"""Curves that the CL file gives: written as they are where the output has curves, in lines elsewhere.

A curve that begins or ends at a corner leaves its outermost lines to the rounding of that corner.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cornersmooth.arrays import angle_between, joined_rows, norm, some_runs, spread, starts, unit
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints, Keep, LimitedBy, Program, Runs, SmoothProgram, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import RUN_CURVATURE, STRAIGHT_ON, find_neighbours
from cornersmooth.smoothing.runs.rows import clamped, largest_curvature, polylines_of

#: lines that a curve leaves to the rounding of a corner at its end. The pose between them goes along the tangent at the
#: curve by this part of a line: then both motions are off by as much, namely by so many times what a chord is
_LINES, _ALONG, _MOVED = 2, 2.0 / 3.0, 2.0

#: poses of a curve that is worth one
_FEWEST = 4


def beside_chords(program: Program, settings: Settings) -> tuple[Program, Settings]:
    """Take what the moves are off the curves of the file off ε, as `one_corner_each` does with what it moves."""
    curves = program.curves
    assert curves is not None
    points = _at_height(curves.bezier, settings.axis_length)
    bend = 0.75 * np.diff(points, 2, axis=1).reshape(len(points), -1, 3)  # see `verify.bending`
    off, moved = norm(bend).max(axis=1), np.zeros(len(program)) if program.moved is None else program.moved.copy()
    for pose in (curves.pose - 1, curves.pose):
        np.maximum.at(moved, pose, off)
    return replace(program, moved=moved), settings.but(pose_shift=float(moved.max()))


def given_runs(program: Program, settings: Settings) -> tuple[Program, Settings, Runs | None]:
    """The curves of the file as runs, at the axis length; those that end at corners are shorter by two lines there.

    Where ε has room, the pose between these lines goes to where the tangent of the curve leads, and counts as moved.
    """
    runs = None if program.curves is None else program.curves.runs
    if runs is None:
        return program, settings, None
    assert program.moved is not None
    runs = replace(runs, control=_at_height(runs.control, settings.axis_length))
    begins, ends = (_LINES * turns for turns in _bends(program, settings, runs))
    left = runs.count - begins - ends >= _FEWEST
    if not left.any():
        return program, settings, None
    runs = _shorter(some_runs(runs, left), begins[left], ends[left])
    for turns, ahead in ((begins[left], 1), (ends[left], -1)):
        program = _towards(program, runs, turns > 0, ahead, settings.common_tolerance / 2.0)
    assert program.moved is not None
    return program, settings.but(pose_shift=float(program.moved.max())), runs


def _towards(program: Program, runs: Runs, which: Bools, ahead: int, most: float) -> Program:
    """Move the poses beside the begins (ahead 1) or ends (-1) of some runs to where their tangents lead.

    Those that would be off by more than `most` stay, mm.
    """
    assert program.moved is not None
    place, control = starts(runs.count), starts(runs.knot_count + 2)
    at, own = (place[:-1], control[:-1]) if ahead > 0 else (place[1:] - 1, control[1:] - 1)
    around = runs.pose[at] - ahead * np.arange(3)[:, None]
    off = _MOVED * program.moved[np.clip(around, 0, len(program) - 1)].max(axis=0)
    which = which & (off <= most)
    (end, beside, _), own, off = around[:, which], own[which], off[which]
    way = runs.control[own] - runs.control[own + ahead]
    size = norm(program.tip[beside] - program.tip[end]) + norm(program.axis[beside] - program.axis[end])
    unit_size = norm(way[:, :3]) + norm(way[:, 3:] - way[:, :3]) / norm(runs.control[own, 3:] - runs.control[own, :3])
    point = runs.control[own] + (_ALONG * size / unit_size)[:, None] * way
    tip, axis, moved = program.tip.copy(), program.axis.copy(), program.moved.copy()
    tip[beside], axis[beside] = point[:, :3], unit(point[:, 3:] - point[:, :3])
    for pose in around[:, which]:
        moved[pose] = np.maximum(moved[pose], off)
    return replace(program, tip=tip, axis=axis, moved=moved)


def _shorter(runs: Runs, begins: Ints, ends: Ints) -> Runs:
    """Runs without so many lines (r,) at their begins and ends."""
    pose = starts(runs.count)
    run, place = spread(runs.count)
    kept = (place >= begins[run]) & (place < runs.count[run] - ends[run])
    count = runs.count - begins - ends
    begin, end = runs.s[pose[:-1] + begins], runs.s[pose[1:] - 1 - ends]
    splines = Splines(runs.knot, runs.knot_count)
    _, _, _, points = clamped(splines, runs.control, np.arange(len(runs)), begin, end)
    owner = spread(runs.knot_count)[0]
    inner = (runs.knot > begin[owner]) & (runs.knot < end[owner])
    owner = np.concatenate((np.arange(len(runs)), owner[inner], np.arange(len(runs))))
    knot = np.concatenate((begin, runs.knot[inner], end))
    order = np.lexsort((knot, owner))
    return replace(
        runs,
        pose=runs.pose[kept],
        count=count,
        s=runs.s[kept] - np.repeat(begin, count),
        knot=(knot - begin[owner])[order],
        knot_count=np.bincount(owner),
        control=points,
    )


def _bends(program: Program, settings: Settings, runs: Runs) -> tuple[Ints, Ints]:
    """(r,) each, for begins and ends of runs: 1 where the path turns between curve and line beside it, else 0."""
    around = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    pose, control = starts(runs.count), starts(runs.knot_count + 2)
    found = []
    for at, outermost, next_to_it, neighbour in (
        (pose[:-1], control[:-1], control[:-1] + 1, around.previous),
        (pose[1:] - 1, control[1:] - 1, control[1:] - 2, around.following),
    ):
        beside, own = neighbour[runs.pose[at]], runs.control[outermost]
        way = own - np.hstack((program.tip[beside], program.tip[beside] + settings.axis_length * program.axis[beside]))
        tangent = runs.control[next_to_it] - own
        turn = np.maximum(*(angle_between(way[:, part], tangent[:, part]) for part in (slice(3), slice(3, 6))))
        found.append(((beside >= 0) & (turn > np.radians(STRAIGHT_ON))).astype(np.int64))
    return found[0], found[1]


def without(program: Program, runs: Runs) -> Program:
    """The program with all poses of runs kept: no method touches them."""
    keep = program.keep.copy()
    keep[runs.pose] = Keep.CURVE
    return replace(program, keep=keep)


def with_runs(smoothed: SmoothProgram, program: Program, runs: Runs) -> SmoothProgram:
    """The program, which was smoothed without its runs, with them."""
    corners, settings = smoothed.corners, smoothed.settings
    run, place = spread(runs.count)
    inner = np.flatnonzero((place > 0) & (place < runs.count[run] - 1))
    rows = np.searchsorted(corners.pose, runs.pose[inner])
    corners.status[rows], corners.limited_by[rows] = Status.IN_RUN, LimitedBy.TOLERANCE
    for turns, ends in zip(_bends(program, settings, runs), (place == 0, place == runs.count[run] - 1), strict=True):
        on = np.isin(corners.pose, runs.pose[ends][turns == 0]) & (corners.status == Status.KEPT)
        corners.status[on & (program.keep[corners.pose] == Keep.NO)] = Status.STRAIGHT
    if RUN_CURVATURE in corners.extra:
        lines = polylines_of(runs, program, settings.axis_length)
        bends = largest_curvature(lines, Splines(runs.knot, runs.knot_count), runs.control)
        corners.extra[RUN_CURVATURE][rows] = bends[inner]
    if smoothed.runs is not None:
        runs = joined_rows((smoothed.runs, runs))
        runs = some_runs(runs, np.argsort(runs.pose[starts(runs.count)[:-1]], kind="stable"))
    return replace(smoothed, program=program, runs=runs)


def _at_height(points: Floats, height: float) -> Floats:
    """Points (..., 6) of tip and 1 mm up the tool axis, with the latter at another height."""
    tip, other = points[..., :3], points[..., 3:]
    return np.concatenate((tip, tip + height * (other - tip)), axis=-1)
