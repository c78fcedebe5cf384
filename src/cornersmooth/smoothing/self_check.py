"""Which transitions of the paper's method keep the tolerance: measured, as its equations do not guarantee it.

Equation (10) bounds each of the two curves, not the motion that their synchronisation makes of them. So transitions,
and what they leave of the segments between them, are sampled and measured here against the original motion.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.model import Bools, Floats, Ints, Program, SmoothProgram
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import inner_points, lines_of, segments_of
from cornersmooth.vectors import dot, norm, square, unit

#: parameters at which transitions are measured, u = ½ in the middle, parts in which what is left of segments is
#: measured, and corners or segments measured at once
_SAMPLES, _PARTS, _MEASURED = np.linspace(0.0, 1.0, 17), 16, 512

#: for the last digits of sums
_HAIR: Final = 1.0 + 1e-9

#: how far tip and axis point may be from a common pose, in what is allowed for each: nearly what verification allows
_TOGETHER: Final = 1.8

#: steps back that the digits of most controls do not show, mm
_LEAST_BACK: Final = 1e-4

#: parts of every segment of the original in which the nearest pose is looked for, and steps to it from there
_GRID: Final = 24
_STEPS: Final = 3

#: length below which a direction has no meaning
_LEAST: Final = 1e-30


def straying_transitions(smoothed: SmoothProgram) -> Ints:
    """Rows of corners whose transitions stray."""
    return _those(np.flatnonzero(smoothed.corners.smoothed), lambda rows: _transitions_stray(smoothed, rows))


def straying_remainders(smoothed: SmoothProgram) -> Ints:
    """Rows of corners beside segments of which the transitions leave what strays.

    There tip and axis are out of step by what the two were cut unlike.
    """
    segments = segments_of(smoothed, dense=False)

    def stray(pose: Ints) -> Bools:
        ends = np.stack((segments.start[pose].astype(np.int64), pose), axis=1)
        return _off_the_motion(smoothed, ends, *inner_points(smoothed, segments, pose, _PARTS))

    unlike = (segments.entry != segments.axis_entry) | (segments.exit != segments.axis_exit)
    pose = _those(np.flatnonzero(unlike & segments.has_line & (segments.start >= 0)), stray)
    rows = np.unique(segments.row[np.concatenate((segments.start[pose], pose))])
    return rows[rows >= 0]


def _those(rows: Ints, stray: Callable[[Ints], Bools]) -> Ints:
    """Rows that stray, looked at some at once."""
    parts = np.split(rows, np.arange(_MEASURED, len(rows), _MEASURED))
    return np.concatenate([part[stray(part)] for part in parts if len(part)] or [rows])


def _transitions_stray(smoothed: SmoothProgram, rows: Ints) -> Bools:
    """(g,) whether transitions stray, as synchronised lines or, as controls run both curves, at common parameters."""
    settings, weights = smoothed.settings, smoothed.corners.weights[rows]
    found = np.zeros(len(rows), np.bool_)
    number = lines_of(smoothed, rows)
    for count in np.unique(number):
        same = np.flatnonzero(number == count)
        tips, levers = construction_of(settings.method).points(smoothed, rows[same], nodes(int(count)))
        found[same] = _beyond(smoothed, rows[same], _halved(tips), _halved(unit(levers)))
    curves = nurbs.control_points(smoothed.program, smoothed.corners, rows, settings.axis_length)
    tips, tops = (nurbs.evaluate(one, weights, _SAMPLES) for one in curves)
    return found | _beyond(smoothed, rows, tips, tops - tips)


def _halved(points: Floats) -> Floats:
    """Points (g, m, 3) with those in the middle between them."""
    halved = np.repeat(points, 2, axis=1)[:, :-1]
    halved[:, 1::2] = (points[:, 1:] + points[:, :-1]) / 2.0
    return halved


def _beyond(smoothed: SmoothProgram, rows: Ints, tip: Floats, lever: Floats) -> Bools:
    """(g,) whether sampled transitions are farther from the original than the method allows."""
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    poses = np.stack((corners.before[rows], corners.pose[rows], corners.after[rows]), axis=1)
    axis = unit(lever)
    corner, direction, height = program.tip[poses[:, 1]], program.axis[poses[:, 1]], settings.axis_scale
    passed = passing(corner, tip)
    away = tip - corner[:, None], height * (axis - direction[:, None])
    if settings.axis_tolerance is None:
        passed = np.maximum(passed, passing(corner + height * direction, tip + height * axis))
        away = away[0], away[0] + away[1]
    at_corner = np.maximum(norm(away[0]), norm(away[1]))
    if settings.lines == "long":  # of the points around the corner only that of its own parameter is sure to be kept
        passed = np.maximum(passed, at_corner[:, tip.shape[1] // 2])
    elif settings.axis_tolerance is not None:  # both at one pose
        passed = np.maximum(passed, at_corner.min(axis=1))
    return _off_the_motion(smoothed, poses, tip, axis) | (passed > _HAIR * settings.common_tolerance)


def _off_the_motion(smoothed: SmoothProgram, poses: Ints, tip: Floats, axis: Floats) -> Bools:
    """(g,) whether samples are farther from the original through `poses`, or go back along it by more, than allowed."""
    settings = smoothed.settings
    height, own_axis = settings.axis_scale, settings.axis_tolerance is not None
    *alone, together, backwards = distances(smoothed.program, height, poses, tip, axis, own_axis=own_axis)
    off = together if own_axis else np.maximum(np.maximum(*alone), together / _TOGETHER)
    steps = settings.tip_resolution, settings.axis_point_resolution * (height / settings.axis_length), _LEAST_BACK
    return (off.max(axis=1) > _HAIR * settings.common_tolerance) | (backwards > 2.0 * max(steps))


def distances(
    program: Program, axis_length: float, poses: Ints, tip: Floats, axis: Floats, *, own_axis: bool = False
) -> tuple[Floats, Floats, Floats, Floats]:
    """How far sampled poses (g, m) are from the original motion through some poses (g, q) of a program, mm.

    Gives (g, m) distances from the path of the tip, from that of the axis point, and of both from the pose that is
    nearest in six dimensions; and (g,) by how much that pose goes back along the original, at most. With `own_axis` the
    axis point is H times the axis wherever the tip is.
    """
    own = tip, axis_length * axis if own_axis else tip + axis_length * axis
    tips, axes = program.tip[poses.T][:, :, None], program.axis[poses.T][:, :, None]
    ways, turns = np.diff(tips, axis=0), np.diff(axes, axis=0)  # of each segment, (q - 1, g, 1, 3)

    def original(share: Floats) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Tips and axis points (q - 1, g, m, 3), and their slopes, at shares (q - 1, g, m) of the segments."""
        part = share[..., None]
        ruled = axes[:-1] + part * turns
        size = np.maximum(norm(ruled), _LEAST)[..., None]
        lever = axis_length * ruled / size
        turning = axis_length * (turns - dot(ruled, turns)[..., None] * ruled / size**2) / size
        point = tips[:-1] + part * ways
        return ((point, lever), (ways, turning)) if own_axis else ((point, point + lever), (ways, ways + turning))

    grid = np.linspace(0.0, 1.0, _GRID + 1)
    on_grid, _ = original(np.broadcast_to(grid, (*ways.shape[:2], len(grid))))

    def nearest(*chosen: int) -> tuple[Floats, Floats, Floats, Ints]:
        """Distances of both from the pose at which those `chosen` are nearest together, and where that is."""
        squares: Floats = sum(square(own[k][:, :, None] - on_grid[k][:, :, None]) for k in chosen)  # type: ignore[assignment]
        share = found = grid[squares.argmin(axis=-1)]
        best = np.full(share.shape, np.inf)
        for _ in range(_STEPS + 1):  # those of Gauss and Newton
            here, slope = original(share)
            away = sum(square(own[k] - here[k]) for k in chosen)
            found, best = np.where(away < best, share, found), np.minimum(away, best)
            towards = sum(dot(own[k] - here[k], slope[k]) for k in chosen)
            steep = sum(square(slope[k]) for k in chosen)
            share = np.clip(share + towards / np.maximum(steep, _LEAST), 0.0, 1.0)
        here, _ = original(found)
        leg = best.argmin(axis=0)
        chosen_of = (norm(own[0] - here[0]), norm(own[1] - here[1]), found)
        tip_off, axis_off, share = (np.take_along_axis(one, leg[None], axis=0)[0] for one in chosen_of)
        return tip_off, axis_off, share, leg

    swings = axis_length * turns if own_axis else ways + axis_length * turns
    size = np.sqrt(square(ways) + square(swings))[..., 0].T
    *common, share, leg = nearest(0, 1)
    row = np.arange(len(poses))[:, None]
    length = (np.cumsum(size, axis=1) - size)[row, leg] + share * size[row, leg]
    back = (np.maximum.accumulate(length, axis=1) - length).max(axis=1)
    return nearest(0)[0], nearest(1)[1], np.maximum(*common), back


def passing(point: Floats, path: Floats) -> Floats:
    """(g,) distance of points (g, 3) from polylines (g, m, 3), mm."""
    start, way = path[:, :-1] - point[:, None], np.diff(path, axis=1)
    share = np.clip(-dot(start, way) / np.maximum(square(way), _LEAST), 0.0, 1.0)
    return norm(start + share[..., None] * way).min(axis=1)
