"""The corners that a page lists, the ones that matter first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cornersmooth.arrays import angle_between, some_rows
from cornersmooth.model import Bools, Floats, Ints, LimitedBy, Program, SmoothProgram, Status
from cornersmooth.report.tables import corner_table, path_distances
from cornersmooth.report.verdict import other_corners, sharp_rows
from cornersmooth.verify import Verification

#: rounded corners that are listed, beside all sharp ones and all out of tolerance
_MOST_ROUNDED = 3000

#: sharp corners that are listed, the largest turns first
_MOST_SHARP = 20_000

#: corners that turn by less are straight, degrees
_STRAIGHT = 0.5

#: deviation below which a pose of a foreign text is passed exactly, as a part of the tolerance
_EXACT = 0.02

#: what becomes of a corner, as the page names it (behind the colon what limits it); its colours follow this order
KINDS = ("out of tolerance", "sharp", "rounded: tolerance", "rounded: segment", "rounded")


@dataclass(frozen=True)
class CornerList:
    """Corners in the order of what matters: out of tolerance, sharp by turn, rounded by their deviation."""

    pose: Ints  #: (k,)
    kind: Ints  #: (k,): index into `KINDS`
    reason: Ints  #: (k,): index into `reasons`
    reasons: tuple[str, ...]
    #: (k,) degrees: change of direction of the tip path and of the axis-point path
    turn: Floats
    axis_turn: Floats
    length: Floats  #: (k,) mm: what the transition takes of the tip path
    #: (k,) mm: deviation at the corner: measured in the text where it was, else that of the construction
    tip_off: Floats
    axis_off: Floats
    #: (k,): 0 where no text was read
    cl_line: Ints
    nc_line: Ints
    counts: dict[str, int]  #: all corners of the program by kind, listed or not; straight ones as ``"straight"``


def smoothed_corners(smoothed: SmoothProgram, found: Verification | None, *, dense: bool) -> CornerList:
    """Corners of a program that was smoothed here."""
    corners, tolerance = smoothed.corners, smoothed.settings.tolerance
    off = np.maximum(corners.tip_error, corners.axis_error)
    if found is not None:
        measured = np.fmax(found.pose_tip, found.pose_axis_point)[corners.pose]
        off = np.where(np.isfinite(measured), measured, off)
    out = off > tolerance
    sharp = np.zeros(len(corners), np.bool_)
    sharp[sharp_rows(smoothed)] = True
    sharp &= ~out
    others = other_corners(smoothed.program, smoothed.settings.axis_length)
    kind = np.where(out, 0, np.where(sharp, 1, 1 + corners.limited_by.astype(np.int64)))
    kind[~out & (corners.status == Status.IN_RUN)] = len(KINDS) - 1
    counts = _counts(kind, ~corners.rounded & ~sharp & ~out)
    counts[KINDS[1]] += len(others.pose)
    rounded = np.flatnonzero(corners.rounded & ~out)
    rounded = rounded[np.argsort(-off[rounded], kind="stable")][:_MOST_ROUNDED]
    rows = np.concatenate((np.flatnonzero(out), np.flatnonzero(sharp), rounded))
    table, nothing = corner_table(smoothed, rows, dense=dense), np.zeros(len(others.pose))
    tip, axis = (np.append(error, nothing) for error in path_distances(smoothed, rows, dense=dense))
    pose, own = np.append(corners.pose[rows], others.pose), corners.smoothed[rows]
    if found is not None:
        tip = np.where(np.isfinite(found.pose_tip[pose]), found.pose_tip[pose], tip)
        axis = np.where(np.isfinite(found.pose_axis_point[pose]), found.pose_axis_point[pose], axis)
    reason = np.where(own, len(Status) - 1 + corners.limited_by[rows], corners.status[rows]).astype(np.int64)
    return _ranked(
        pose,
        kind=np.append(kind[rows], np.ones(len(others.pose), np.int64)),
        reason=np.append(reason, others.status),
        reasons=(*(each.key.replace("_", " ") for each in Status), *(each.key for each in LimitedBy if each)),
        turn=np.append(table["tip_angle_deg"], others.tip_turn),
        axis_turn=np.append(table["axis_angle_deg"], others.axis_turn),
        length=np.append(table["tip_length_in_mm"] + table["tip_length_out_mm"], nothing),
        tip_off=tip,
        axis_off=axis,
        cl_line=smoothed.program.line[pose],
        nc_line=np.zeros(len(pose), np.int64) if found is None else found.pose_nc_line[pose],
        counts=counts,
    )


def measured_corners(program: Program, found: Verification) -> CornerList:
    """Corners of a program whose text somebody wrote: what was measured there says what became of them."""
    inner = np.zeros(len(program), np.bool_)
    for first, last in program.chains.tolist():
        inner[first + 1 : last] = True
    pose = np.flatnonzero(inner)
    height = found.axis_length if found.axis_tolerance is None else 0.0
    turn, axis_turn = (_turns(points, pose) for points in (program.tip, program.tip + height * program.axis))
    off = np.fmax(found.pose_tip[pose], found.pose_axis_point[pose])
    out = off > found.tolerance
    straight = (np.maximum(turn, axis_turn) < _STRAIGHT) & ~out
    kind = np.where(out, 0, np.where(off > _EXACT * found.tolerance, len(KINDS) - 1, 1))
    listed = np.flatnonzero(~straight)
    rounded = listed[kind[listed] == len(KINDS) - 1]
    drop = rounded[np.argsort(-off[rounded], kind="stable")][_MOST_ROUNDED:]
    rows = np.setdiff1d(listed, drop, assume_unique=True)
    own = pose[rows]
    return _ranked(
        own,
        kind=kind[rows],
        reason=np.minimum(kind[rows], 2),
        reasons=("off the path", "passed exactly", "rounded"),
        turn=turn[rows],
        axis_turn=axis_turn[rows],
        length=np.full(len(rows), np.nan),
        tip_off=found.pose_tip[own],
        axis_off=found.pose_axis_point[own],
        cl_line=program.line[own],
        nc_line=found.pose_nc_line[own],
        counts=_counts(kind, straight),
    )


def _counts(kind: Ints, straight: Bools) -> dict[str, int]:
    """How many corners are of each kind, the straight ones apart."""
    counts = {name: int(np.count_nonzero((kind == index) & ~straight)) for index, name in enumerate(KINDS)}
    return counts | {"straight": int(np.count_nonzero(straight))}


def _turns(points: Floats, pose: Ints) -> Floats:
    """Change of direction of a path at its points, degrees; 0 beside a step of no length."""
    before, after = points[pose] - points[pose - 1], points[pose + 1] - points[pose]
    moving = before.any(axis=1) & after.any(axis=1)
    return np.degrees(np.where(moving, angle_between(before, after), 0.0))


def _ranked(pose: Ints, **columns: Any) -> CornerList:
    """Corners in the order of what matters, without the least of very many sharp ones."""
    listed = CornerList(pose, **columns)
    rank = np.minimum(listed.kind, 2)
    by = np.where(rank == 1, np.maximum(listed.turn, listed.axis_turn), np.fmax(listed.tip_off, listed.axis_off))
    order = np.lexsort((listed.pose, -np.nan_to_num(by), rank))
    sharp = np.flatnonzero(rank[order] == 1)
    return some_rows(listed, np.delete(order, sharp[_MOST_SHARP:]))
