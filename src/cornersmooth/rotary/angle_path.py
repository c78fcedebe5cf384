"""Rotary angles along a whole path: continuous, inside the limits, calm at the pole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import joined_rows, norm
from cornersmooth.errors import Finding, InputError
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import (
    angle_between,
    closest_second,
    passes_pole,
    solutions,
    tool_axis,
)
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.rotary.branch_choice import (
    LIMIT_SLACK,
    NO_TURN,
    PREFERENCE_COST,
    CutTooFarError,
    NoChoiceError,
    Stretches,
    WideSteps,
    choose,
    first_outside,
    limit_error,
    meet_at_pole,
    parts_of_cut,
    too_far,
    unwrap,
)

CHUNK = 1 << 15  #: Poses worked on at a time, so that memory is needed for their angles and little else.
#: A cut counts as near the pole where the first rotary axis turns by so many times what the tool axis turns by.
NEAR_POLE = 20.0
#: Rounds of dividing cuts, after which limits are an error; a round divides all cuts that are too far by themselves.
REWIND_ROUNDS = 100


@dataclass(frozen=True)
class RotaryPath:
    """Rotary words of n poses."""

    angles: Floats  #: (n, 2), degrees; in the order of `Machine.axes`, unwrapped but for rewinds in rapids
    findings: tuple[Finding, ...]


def rotary_angles(
    machine: Machine,
    tip: Floats,
    axis: Floats,
    *,
    tolerance: float,
    rapid: Bools | None = None,
    left: Bools | None = None,
    divide: bool = False,
    still: Bools | None = None,
    still_tolerance: float = 0.0,
    line: Ints | None = None,
    file: str | None = None,
) -> RotaryPath:
    """Rotary angles of a path: one solution and one turn per pose, chosen with a look ahead over the whole path.

    Tips (n, 3) are in mm, axes unit vectors. Near the pole the axis may deviate by the tolerance, degrees, so that the
    first angle can turn ahead of time, and as far may it lie outside the reach of the machine. Solution and turn may
    change in moves to `rapid` poses (n,), which do not cut, and to `left` ones, which repeat the pose before, after
    which a cut is left. Through `still` poses (`still_poses`) nothing is cut: there the axis need not deviate but by
    `still_tolerance`, degrees, what the digits of the words account for. CS361: the machine cannot reach an axis.
    CS362: not within the limits of its rotary axes; CutTooFarError instead where cuts that leave the limits are to be
    divided, and can be.
    """
    n = len(axis)
    line = np.zeros(n, np.int64) if line is None else line
    rapid = np.zeros(n, np.bool_) if rapid is None else rapid
    left = np.zeros(n, np.bool_) if left is None else left
    if n == 0:
        return RotaryPath(np.zeros((0, 2)), ())
    cone = np.full(n, tolerance / 2)
    if still is not None:
        cone[still] = still_tolerance / 2
    at_pole, steady, beyond, both = _sorted_poses(machine, axis, tolerance, cone, line, file)
    del cone  # with millions of poses every array counts
    run = np.cumsum(rapid | left, dtype=np.int32)
    swaps = np.zeros(0, np.int64)
    if len(steady):
        angles, swaps = _Steady(machine, axis, steady, both, run, line, file).angles(tolerance, divide)
        del both
        if len(at_pole):
            known, angles = angles, np.full((n, 2), np.nan)
            angles[steady] = known
            length = np.cumsum(np.linalg.norm(np.diff(tip, axis=0, prepend=tip[:1]), axis=1))  # up to each pose
            for here in _chunks(len(at_pole)):
                _fill_cone(machine, length, axis, angles, at_pole[here], steady, run)
    else:
        angles = np.zeros((n, 2))
        angles[:, 0] = np.clip(0.0, *machine.limits[0])
        for here in _chunks(n):
            angles[here, 1] = closest_second(machine, axis[here], angles[here, 0])
    angles[at_pole] = np.clip(angles[at_pole], *machine.limits.T)  # at the pole the axis hardly notices
    for off in (at_pole, beyond):
        for some in (off[here] for here in _chunks(len(off))):
            if (over := angle_between(tool_axis(machine, angles[some]), axis[some]) > tolerance).any():
                pose = int(some[np.argmax(over)])
                both = solutions(machine, axis[pose : pose + 1]).angles[0]
                raise limit_error(machine, both, None, int(line[pose]), file)
    findings = pole_finding(machine, tip, axis, angles, rapid | left, line)
    findings += rewind_finding(machine, angles, rapid & ~left, line)
    if len(machine.names) == 2:
        findings += swap_finding(machine, swaps[~left[swaps]], line)
    return RotaryPath(angles, findings)


def rewound_angles(
    machine: Machine, tip: Floats, axis: Floats, *, rapid: Bools, still: Bools, line: Ints, **how: Any
) -> tuple[RotaryPath, Ints, Bools]:
    """Rotary angles of a path in which cuts are left, where nothing else keeps the limits.

    Parameters, those of `how` among them, and errors are those of `rotary_angles`. Where a cut is left its pose is in
    the path twice, before and after the turn of the axes; returns besides the row of the path given (m,), and the
    second rows (m,) of such pairs.
    """
    source, left = np.arange(len(tip)), np.zeros(len(tip), np.bool_)
    for number in range(REWIND_ROUNDS + 1):
        how |= {"rapid": rapid[source], "still": still[source], "line": line[source], "left": left}
        try:
            path = rotary_angles(machine, tip[source], axis[source], divide=number < REWIND_ROUNDS, **how)
            break
        except CutTooFarError as far:
            behind = far.poses + 1
            source, left = np.insert(source, behind, source[far.poses]), np.insert(left, behind, True)
    return path, source, left


def _sorted_poses(
    machine: Machine, axis: Floats, tolerance: float, cones: Floats, line: Ints, file: str | None
) -> tuple[Ints, Ints, Ints, Floats]:
    """Poses in their cones of the pole, degrees, those outside and their solutions, and those just out of reach."""
    n, count = len(axis), 0
    angles, steady = np.empty((n, 2, 2)), np.empty(n, np.int64)
    cone, beyond = [], []
    for here in _chunks(n):
        found = solutions(machine, axis[here])
        if (outside := found.beyond > tolerance).any():
            pose = here.start + int(np.argmax(outside))
            raise reach_error(machine, axis[pose], float(found.beyond[pose - here.start]), int(line[pose]), file)
        inside = found.pole_distance <= cones[here]
        own = np.flatnonzero(~inside)
        angles[count : count + len(own)] = found.angles[own] if len(own) < len(inside) else found.angles
        steady[count : count + len(own)] = here.start + own
        count += len(own)
        cone.append(here.start + np.flatnonzero(inside))
        beyond.append(here.start + np.flatnonzero(found.beyond > 0))
    return np.concatenate(cone), steady[:count], np.concatenate(beyond), angles[:count]


@dataclass(frozen=True)
class _Steady:
    """Poses outside the cone of the pole."""

    machine: Machine
    axis: Floats  #: of all poses, as those below but for the solutions
    steady: Ints  #: (s,) which they are
    unwrapped: Floats  #: (s, 2, 2) their solutions, which change in place
    run: NDArray[np.int32]
    line: Ints
    file: str | None

    def angles(self, tolerance: float, divide: bool) -> tuple[Floats, Ints]:
        """Angles (s, 2), and poses before which a rapid changes branch."""
        machine, axis, steady, unwrapped, run = self.machine, self.axis, self.steady, self.unwrapped, self.run
        dislike = np.zeros(2)
        if machine.preferred is not None:
            name, sign = machine.preferred
            dislike[sign * unwrapped[0, :, machine.names.index(name)] < 0] = PREFERENCE_COST
        free, first = [np.ones(1, np.bool_)], [np.zeros(1, np.int64)]
        wide = [WideSteps(np.zeros(0, np.int64), *np.zeros((2, 0, 2, 2)))]
        for here in _chunks(len(steady)):
            rows = slice(max(here.start, 1), here.stop)
            start, end = steady[rows.start - 1 : rows.stop - 1], steady[rows]
            rests = run[start] != run[end]
            broken = rests | (end - start > 1) | passes_pole(machine, axis[start], axis[end], tolerance / 2)
            found = unwrap(machine, axis, start, end, unwrapped[rows.start - 1 : rows.stop], broken)
            wide.append(WideSteps(found.row + rows.start, found.low, found.high))
            breaks = np.flatnonzero(broken)
            first.append(rows.start + breaks)
            free.append(rests[breaks])
        begins = np.concatenate(first)
        enter, leave = unwrapped[begins], unwrapped[np.append(begins[1:], len(steady)) - 1]
        meet_at_pole(machine, axis, steady, begins, ~np.concatenate(free), enter, leave)
        low, high = np.minimum.reduceat(unwrapped, begins, axis=0), np.maximum.reduceat(unwrapped, begins, axis=0)
        way = joined_rows(wide)
        owner = np.searchsorted(begins, way.row, side="right") - 1
        np.minimum.at(low, owner, way.low)
        np.maximum.at(high, owner, way.high)
        stretches = Stretches(enter, leave, low, high, np.concatenate(free), dislike)
        stretch = np.repeat(np.arange(len(begins), dtype=np.int32), np.diff(begins, append=len(steady)))
        try:
            branch, turns = choose(stretches, machine.limits)
        except NoChoiceError as stuck:
            if divide and (left := self._left(stretches, stuck, begins, way)):
                raise CutTooFarError(steady[left]) from None
            raise self._error(stuck, stretch, way) from stuck
        angles = np.empty((len(steady), 2))
        for here in _chunks(len(steady)):
            own = stretch[here]
            angles[here] = unwrapped[here][np.arange(len(own)), branch[own]] + 360 * turns[own]
        swaps = begins[1:][stretches.free[1:] & (branch[1:] != branch[:-1])]
        return angles, steady[swaps]

    def _extremes(self, members: Ints, way: WideSteps) -> tuple[Floats, Floats]:
        """Lowest and highest angles on the way into rows that follow one another: twice (m, 2, 2)."""
        low, high = self.unwrapped[members], self.unwrapped[members]
        own = (way.row >= members[0]) & (way.row <= members[-1])
        row = way.row[own] - members[0]
        low[row], high[row] = np.minimum(low[row], way.low[own]), np.maximum(high[row], way.high[own])
        return low, high

    def _left(self, stretches: Stretches, stuck: NoChoiceError, begins: Ints, way: WideSteps) -> list[int]:
        """Rows after which cuts are left: in the one that is stuck, and in all that fit in no turn; none if no use."""
        ends, limits, left = np.append(begins[1:], len(self.unwrapped)), self.machine.limits, list[int]()
        for number in np.union1d(too_far(stretches, limits), stuck.stretch).tolist():
            members = np.arange(begins[number], ends[number])
            states = stuck.states if number == stuck.stretch else None
            rows = parts_of_cut(self.unwrapped[members], *self._extremes(members, way), limits, states)
            if rows is None:
                return []
            left += members[rows].tolist()
        return left

    def _error(self, stuck: NoChoiceError, stretch: NDArray[np.int32], way: WideSteps) -> InputError:
        """Message for the pose that no choice gets beyond."""
        limits = self.machine.limits
        members = np.flatnonzero(stretch == stuck.stretch)
        low, high = self._extremes(members, way)
        furthest, words = 0, self.unwrapped[members[0], 0]
        for branch, *turns in stuck.states:
            least, most = low[:, branch] + 360 * np.array(turns), high[:, branch] + 360 * np.array(turns)
            first = first_outside(least, most, limits)
            if first >= furthest:
                furthest, words = first, np.where(least[first] < limits[:, 0] - LIMIT_SLACK, least[first], most[first])
        pose = int(self.steady[members[furthest]])
        start = int(np.searchsorted(self.run, self.run[pose]))
        both = solutions(self.machine, self.axis[pose : pose + 1]).angles[0]
        return limit_error(self.machine, both, words, int(self.line[pose]), self.file, int(self.line[start]))


def _fill_cone(
    machine: Machine, length: Floats, axis: Floats, angles: Floats, poses: Ints, steady: Ints, run: NDArray[np.int32]
) -> None:
    """Angles of poses inside the cone, in place; `length` is that of the path up to each pose."""
    # the first angle goes evenly with the length between two poses outside, and waits at the ends of a cut
    after = np.searchsorted(steady, poses)
    before = np.maximum(after - 1, 0)
    left, right = steady[before], steady[np.minimum(after, len(steady) - 1)]
    from_left = (left < poses) & (run[left] == run[poses])
    to_right = (right > poses) & (run[right] == run[poses])
    # Waiting angle of a cut without any pose outside: its place after the last one, or before the first.
    left_angles = angles[np.where(left < poses, left, right)]
    right_angles = angles[right]
    start, end = np.minimum(left + 1, len(length) - 1), np.maximum(right - 1, 0)
    span, gone = length[end] - length[start], length[poses] - length[start]
    count = end - start
    even = np.where(count > 0, (poses - start) / np.maximum(count, 1), 0.5)
    share = np.where(span > 0, gone / np.where(span > 0, span, 1.0), even)
    share = np.where(from_left & to_right, share, np.where(to_right, 1.0, 0.0))
    first = left_angles[:, 0] + share * (right_angles[:, 0] - left_angles[:, 0])
    # Which turn of the second angle: both sides say the same, but where the axis goes over from pole to pole.
    pole = machine.axes[0].unit
    follows = to_right & (~from_left | ((axis[poses] @ pole > 0) == (axis[end] @ pole > 0)))
    guess = np.where(follows, right_angles[:, 1], left_angles[:, 1])
    second = closest_second(machine, axis[poses], first)
    angles[poses, 0] = first
    angles[poses, 1] = second + 360 * np.round((guess - second) / 360)


def _chunks(n: int) -> Iterator[slice]:
    """Rows 0 to n - 1, some at a time."""
    return (slice(begin, min(begin + CHUNK, n)) for begin in range(0, n, CHUNK))


def reach_error(machine: Machine, axis: Floats, beyond: float, line: int, file: str | None) -> InputError:
    """Say that no rotary angles give this axis."""
    vector = ", ".join(f"{number:.6f}" for number in axis)
    return InputError(
        "CS361",
        f"tool axis ({vector}) is {beyond:.3f} deg beyond the reach of {' and '.join(machine.names)} of {machine.name}",
        "turn the part or use a machine that reaches it; --method proportional turns the tool no farther than poses",
        file=file,
        line=line or None,
    )


def pole_finding(
    machine: Machine, tip: Floats, axis: Floats, angles: Floats, rapid: Bools, line: Ints
) -> tuple[Finding, ...]:
    """Cuts near the pole, where the first rotary axis turns fast: where, how close, how fast."""
    if len(machine.names) < 2:
        return ()
    turn, tilt = np.abs(np.diff(angles[:, 0])), norm(np.diff(axis, axis=0))
    edges = np.flatnonzero((turn > NO_TURN) & (turn > NEAR_POLE * np.degrees(tilt)) & ~rapid[1:])
    if not len(edges):
        return ()
    turns, lengths = turn[edges], norm(tip[edges + 1] - tip[edges])
    rates = np.where(lengths > 0, turns / np.where(lengths > 0, lengths, 1.0), np.inf)
    worst = int(np.argmax(rates))
    closest = float(solutions(machine, axis[np.union1d(edges, edges + 1)]).pole_distance.min())
    name = machine.names[0]
    speed = f"{rates[worst]:.4g} deg/mm" if np.isfinite(rates[worst]) else "with the tip standing still"
    text = (
        f"the tool axis comes within {closest:.3g} deg of the pole of {name}, which turns fast there: "
        f"{turns[worst]:.4g} deg in one move, {speed}"
    )
    passages = 1 + int(np.count_nonzero(np.diff(edges) > 1))
    return (Finding("CS363", "warning", int(line[edges[worst] + 1]), text, passages),)


def rewind_finding(machine: Machine, angles: Floats, rapid: Bools, line: Ints) -> tuple[Finding, ...]:
    """Rapids in which an axis turns back by whole turns to stay inside its limits."""
    rapids = np.flatnonzero(rapid[1:])
    step, findings = np.abs(angles[rapids + 1] - angles[rapids]), list[Finding]()
    for axis, name in enumerate(machine.names):
        moves = np.flatnonzero(step[:, axis] > 180 + NO_TURN)
        if len(moves):
            text = f"{name} turns back by {step[moves[0], axis]:.4g} deg in a rapid, to stay inside its limits"
            findings.append(Finding("CS364", "warning", int(line[rapids[moves[0]] + 1]), text, len(moves)))
    return tuple(findings)


def swap_finding(machine: Machine, swaps: Ints, line: Ints) -> tuple[Finding, ...]:
    """Rapids in which the rotary axes go over to their other solution."""
    if not len(swaps):
        return ()
    text = f"{' and '.join(machine.names)} go over to their other solution in a rapid: keep clear of the part there"
    return (Finding("CS365", "note", int(line[swaps[0]]), text, len(swaps)),)
