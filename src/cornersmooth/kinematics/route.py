"""Rotary angles along a whole path: continuous, inside the limits, calm at the pole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import Finding, InputError
from cornersmooth.kinematics.choice import LIMIT_SLACK, PREFERENCE_COST, NoChoiceError, Pieces, choose
from cornersmooth.kinematics.findings import limit_error, pole_finding, reach_error, rewind_finding, swap_finding
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.orientation import (
    Solutions,
    angle_between,
    closest_second,
    passes_pole,
    solutions,
    tool_axis,
)
from cornersmooth.model import Bools, Floats, Ints, Move

#: A step of the first angle larger than this (degrees) is followed on its way to see which way round it goes.
WIDE_STEP = 90.0
#: So many points are looked at on the way.
WIDE_STEP_POINTS = 15


@dataclass(frozen=True)
class RotaryPath:
    """Rotary words of n poses.

    Parameters
    ----------
    angles : (n, 2) float64, degrees
        In the order of `Machine.axes`, unwrapped: no step by a whole turn but for rewinds in rapids.
    deviation : (n,) float64, degrees
        Angle between the axis that the angles give and the one asked for: 0 but for poses at the pole, where it stays
        within the tolerance given.
    findings : tuple of Finding
        Passages near the pole, rewinds, changes of solution.
    """

    angles: Floats
    deviation: Floats
    findings: tuple[Finding, ...]


def rotary_angles(
    machine: Machine,
    tip: Floats,
    axis: Floats,
    *,
    tolerance: float,
    rapid: Bools | None = None,
    line: Ints | None = None,
    file: str | None = None,
) -> RotaryPath:
    """Rotary angles of a path: one solution and one turn per pose, chosen with a look ahead over the whole path.

    Parameters
    ----------
    machine : Machine
    tip : (n, 3) float64, mm
    axis : (n, 3) float64
        Unit vectors in part coordinates.
    tolerance : float, degrees
        By how much the axis may deviate near the pole, where the first angle is then free to turn ahead of time.
        Also how far outside the reach of the machine an axis may lie (digits of the file) and be taken as on its edge.
    rapid : (n,) bool
        The move into the pose does not cut, so that solution and turn may change in it; only the first by default.
    line : (n,) int64
        Source lines for messages.
    file : str, optional
        For messages.

    Raises
    ------
    InputError
        The machine cannot reach an axis (CS361), or not within the limits of its rotary axes (CS362).
    """
    n = len(axis)
    line = np.zeros(n, np.int64) if line is None else line
    rapid = np.zeros(n, np.bool_) if rapid is None else rapid
    if n == 0:
        return RotaryPath(np.zeros((0, 2)), np.zeros(0), ())
    found = solutions(machine, axis)
    if (outside := found.beyond > tolerance).any():
        pose = int(np.argmax(outside))
        raise reach_error(machine, axis[pose], float(found.beyond[pose]), int(line[pose]), file)
    # Half of the tolerance as cone: two axes inside it are then within the tolerance of each other.
    cone = found.pole_distance <= tolerance / 2
    run: Ints = np.cumsum(rapid, dtype=np.int64)
    steady = np.flatnonzero(~cone)
    swaps = np.zeros(0, np.int64)
    if len(steady):
        angles = np.full((n, 2), np.nan)
        angles[steady], swaps = _steady_angles(machine, axis, found, steady, run, tolerance, line, file)
        _fill_cone(machine, tip, axis, angles, np.flatnonzero(cone), steady, run)
    else:
        angles = np.zeros((n, 2))
        angles[:, 0] = np.clip(0.0, *machine.limits[0])
        angles[:, 1] = closest_second(machine, axis, angles[:, 0])
    poses = np.flatnonzero(cone)
    angles[poses] = _into_limits(angles[poses], machine.limits)
    deviation = np.zeros(n)
    off = np.flatnonzero(cone | (found.beyond > 0))
    deviation[off] = angle_between(tool_axis(machine, angles[off]), axis[off])
    if (over := deviation > tolerance).any():
        pose = int(np.argmax(over))
        raise limit_error(machine, found.angles[pose], machine.limits, None, int(line[pose]), 0, file)
    findings = pole_finding(machine, tip, axis, angles, found.pole_distance, rapid, line)
    findings += rewind_finding(machine, angles, rapid, line) + swap_finding(machine, swaps, line)
    return RotaryPath(angles, deviation, findings)


def rapid_moves(kind: NDArray[np.uint8]) -> Bools:
    """Poses of a program whose move does not cut, so that solution and turn may change in it: (n,) bool.

    Everything but linear feed moves and arcs, and what follows a start position that is stated, not moved to.
    """
    rapid: Bools = (kind != Move.LINEAR) & (kind != Move.ARC)
    rapid[1:] |= kind[:-1] == Move.FROM
    rapid[:1] = True
    return rapid


def _steady_angles(
    machine: Machine,
    axis: Floats,
    found: Solutions,
    steady: Ints,
    run: Ints,
    tolerance: float,
    line: Ints,
    file: str | None,
) -> tuple[Floats, Ints]:
    """Angles of the poses outside the cone, (s, 2), and the poses before which a rapid changes the solution."""
    start, end = steady[:-1], steady[1:]
    free = run[start] != run[end]
    through = ~free & ((end - start > 1) | passes_pole(machine, axis[start], axis[end], tolerance / 2))
    angles = found.angles[steady]  # [pose, branch, axis]
    turns = _turns_inside(machine, axis, steady, angles, free | through)
    first = np.concatenate(([0], 1 + np.flatnonzero(free | through)))
    piece = np.zeros(len(steady), np.int64)
    piece[first[1:]] = 1
    piece = np.cumsum(piece)
    unwrapped = angles + 360 * (turns - turns[first][piece])
    pieces = Pieces(
        first=unwrapped[first],
        last=unwrapped[np.append(first[1:], len(steady)) - 1],
        low=np.minimum.reduceat(unwrapped, first, axis=0),
        high=np.maximum.reduceat(unwrapped, first, axis=0),
        free=np.concatenate(([True], free[first[1:] - 1])),
        dislike=_dislike(machine, angles[0]),
    )
    try:
        branch, extra = choose(pieces, machine.limits)
    except NoChoiceError as stuck:
        raise _stuck_error(machine, stuck, piece, unwrapped, found, steady, run, line, file) from stuck
    solution = branch[piece]
    swaps = end[free & (solution[1:] != solution[:-1])]
    return unwrapped[np.arange(len(steady)), solution] + 360 * extra[piece], swaps


def _turns_inside(machine: Machine, axis: Floats, steady: Ints, angles: Floats, broken: Bools) -> Floats:
    """Whole turns that make both branches continuous where nothing breaks the path: (s, 2, 2), from 0."""
    step = np.diff(angles, axis=0)
    change = -np.round(step / 360)
    wide = np.flatnonzero(~broken & (np.abs(step + 360 * change).max(axis=(1, 2)) > WIDE_STEP))
    if len(wide):
        # A wide step: the sum of the short ones on the way says which way round it goes.
        share = (np.arange(1, WIDE_STEP_POINTS + 1) / (WIDE_STEP_POINTS + 1))[:, None, None]
        between = axis[steady[wide]] * (1 - share) + axis[steady[wide + 1]] * share
        length = np.linalg.norm(between, axis=2, keepdims=True)
        between = np.where(length > 0, between / np.where(length > 0, length, 1.0), axis[steady[wide]])
        on_way = solutions(machine, between.reshape(-1, 3)).angles.reshape(WIDE_STEP_POINTS, -1, 2, 2)
        steps = np.diff(np.concatenate((angles[wide][None], on_way, angles[wide + 1][None])), axis=0)
        steps -= 360 * np.round(steps / 360)
        change[wide] = np.round((steps.sum(axis=0) - step[wide]) / 360)
    change[broken] = 0
    return np.concatenate((np.zeros((1, 2, 2)), np.cumsum(change, axis=0)))


def _dislike(machine: Machine, start: Floats) -> Floats:
    """Cost that the preference of the machine puts on either branch at the start of the path, degrees."""
    if machine.preferred is None:
        return np.zeros(2)
    name, sign = machine.preferred
    wrong = sign * start[:, machine.names.index(name)] < 0
    return np.where(wrong, PREFERENCE_COST, 0.0)


def _fill_cone(
    machine: Machine, tip: Floats, axis: Floats, angles: Floats, poses: Ints, steady: Ints, run: Ints
) -> None:
    """Angles of the poses inside the cone, in place.

    Between two poses outside, the first angle goes evenly with the length of the path from the one's to the other's;
    towards the end of a cut it stays, and before the start of one it waits already. The second follows the axis.
    """
    if not len(poses):
        return
    after = np.searchsorted(steady, poses)
    before = np.maximum(after - 1, 0)
    left, right = steady[before], steady[np.minimum(after, len(steady) - 1)]
    from_left = (left < poses) & (run[left] == run[poses])
    to_right = (right > poses) & (run[right] == run[poses])
    # Waiting angle of a cut without any pose outside: where the axis stands after the last one, or will stand first.
    left_angles = angles[np.where(left < poses, left, right)]
    right_angles = angles[right]
    length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))))
    start, end = np.minimum(left + 1, len(tip) - 1), np.maximum(right - 1, 0)
    span, gone = length[end] - length[start], length[poses] - length[start]
    count = end - start
    even = np.where(count > 0, (poses - start) / np.maximum(count, 1), 0.5)
    share = np.where(span > 0, gone / np.where(span > 0, span, 1.0), even)
    share = np.where(from_left & to_right, share, np.where(to_right, 1.0, 0.0))
    first = left_angles[:, 0] + share * (right_angles[:, 0] - left_angles[:, 0])
    guess = np.where((share < 0.5)[:, None], left_angles, right_angles)[:, 1]
    second = closest_second(machine, axis[poses], first)
    angles[poses, 0] = first
    angles[poses, 1] = second + 360 * np.round((guess - second) / 360)


def _into_limits(angles: Floats, limits: Floats) -> Floats:
    """Angles clipped to the limits: at the pole only, where the axis hardly notices."""
    clipped: Floats = np.clip(angles, limits[:, 0], limits[:, 1])
    return clipped


def _stuck_error(
    machine: Machine,
    stuck: NoChoiceError,
    piece: Ints,
    unwrapped: Floats,
    found: Solutions,
    steady: Ints,
    run: Ints,
    line: Ints,
    file: str | None,
) -> InputError:
    """Message for the pose that no choice gets beyond."""
    limits = machine.limits
    members = np.flatnonzero(piece == stuck.piece)
    furthest, words = 0, unwrapped[members[0], 0]
    for branch, *turns in stuck.states:
        path = unwrapped[members, branch] + 360 * np.array(turns)
        outside = (path < limits[:, 0] - LIMIT_SLACK) | (path > limits[:, 1] + LIMIT_SLACK)
        first = int(np.argmax(outside.any(axis=1)))
        if first >= furthest:
            furthest, words = first, path[first]
    pose = int(steady[members[furthest]])
    start = int(np.searchsorted(run, run[pose]))
    return limit_error(machine, found.angles[pose], limits, words, int(line[pose]), int(line[start]), file)
