"""The smoothed motion in as few lines as ε allows (`lines="long"`).

From every vertex, a point of the smoothed motion, a line goes to the farthest vertex that it can reach within ε: a
control must be able to stop within the lines that it has read.

A line is compared with the original motion at a common parameter, the length of the original in six dimensions. Both
run evenly between points at which the original is known, so the tips are farthest apart at one of these. Rotary words
bend the motion, so they are also compared halfway.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from cornersmooth.arrays import dot, norm, split, spread, square, starts
from cornersmooth.model import Bools, Floats, Ints, Move, SmoothProgram, Status, Trait

#: rows after which a line ends in any case; so many parts are worked on side by side
LANE = 512

#: rows at which lines are tested at once: intermediate arrays fit the processor's cache
TOGETHER = 1 << 16

#: mm by which the parameter goes on while a word changes by one
_PER_WORD = 1e-3

#: rounds of adding vertices where the axis point would lag
_ROUNDS = 4

#: share of ε that is used: the rest is for what turns between two points at which the original is known
_USED = 0.98


@dataclass(frozen=True)
class Vertices:
    """Points of the smoothed motion at which lines may end, r rows in path order."""

    tip: Floats  #: (r, 3) mm
    words: Floats  #: (r, d): run evenly along a line: tool vectors, or rotary words in degrees
    original_tip: Floats  #: (r, 3) mm
    original_axis_point: Floats  #: (r, 3) mm
    parameter: Floats  #: (r,) mm: never decreasing
    fixed: Bools  #: (r,): a line ends here in any case
    position: Floats | None = None  #: (r, 3) mm: of the linear axes, where these run straight and not the tip


@dataclass(frozen=True)
class LineLimits:
    """What a line must keep."""

    #: mm: largest distances from the original motion at a common parameter
    tip: float
    axis_point: float
    turn: float  #: largest change of any word in one line, in the unit of the words
    axis_length: float  #: mm
    #: unit tool axes (m, 3) of words (m, d); tips (m, 3) of positions of the linear axes (m, 3) and words
    axis_of: Callable[[Floats], Floats]
    #: mm: how far the tip may be off a corner that the control rounds by itself, and the axis point lag there
    #: (`lags`)
    blend: float = 0.0
    lag: float = np.inf
    tip_of: Callable[[Floats, Floats], Floats] | None = None
    rotary: bool = False  #: whether words are angles: the tool axis then does not run evenly with them

    def used(self, tip: Floats, axis_point: Floats, original_tip: Floats, original_axis_point: Floats) -> Floats:
        """(m,) share of the limits in use where tips and axis points (m, 3) are compared with the original, mm."""
        return np.maximum(norm(tip - original_tip) / self.tip, norm(axis_point - original_axis_point) / self.axis_point)


def segments_of_rows(move: Ints, begin: int, end: int) -> tuple[Ints, Bools]:
    """Pose that the segment of each row starts from, -1 before the first, and whether it is the last row of its move.

    `move` (n,) is that of all rows; the rows from `begin` to `end` are chosen.
    """
    end = min(end, len(move))
    before = max(int(np.searchsorted(move, move[begin])) - 1, 0)  # last row of the move before
    own = move[before : end + 1]
    last = np.append(own[1:] != own[:-1], True)[: end - before]
    first = np.concatenate(([True], last))[: end - before]
    starts = np.concatenate(([-1], own[: end - before][last]))
    return starts[np.cumsum(first) - 1][begin - before :], last[begin - before :]


def vertices(
    smoothed: SmoothProgram, tip: Floats, axis: Floats, words: Floats, move: Ints, start: Ints, at_pose: Bools
) -> Vertices:
    """Find where the original motion is at the rows of the smoothed one, which are as in `Rows` and `Vertices`.

    `start` and `at_pose` are those of `segments_of_rows`.
    """
    program, height = smoothed.program, smoothed.settings.axis_length
    known = np.maximum(start, 0)
    from_tip, to_tip = program.tip[known], program.tip[move]
    from_axis, to_axis = height * program.axis[known], height * program.axis[move]
    way, turn = to_tip - from_tip, to_axis - from_axis
    whole = (square(way) + square(way + turn)) / 2.0  # m(D)²
    gone, lever = tip - from_tip, height * axis - from_axis
    along = (dot(gone, way) + dot(gone + lever, way + turn)) / 2.0
    share = np.clip(np.divide(along, whole, out=np.ones_like(whole), where=whole > 0.0), 0.0, 1.0)
    share[at_pose] = 1.0
    moves_behind = 2.0 * np.cumsum(np.concatenate(([False], at_pose[:-1])))
    share = np.maximum.accumulate(share + moves_behind) - moves_behind  # it may not fall within a move
    lengths = np.sqrt(whole)
    behind = np.concatenate(([0.0], np.cumsum(np.where(at_pose, lengths, 0.0))[:-1]))
    here = from_tip + share[:, None] * way
    axis_here = from_axis + share[:, None] * turn
    axis_here *= (height / np.maximum(norm(axis_here), np.finfo(np.float64).tiny))[:, None]
    parameter = behind + share * lengths
    # where only words change, as at the pole of a machine, the parameter goes on too
    parameter[1:] += _PER_WORD * np.cumsum(np.abs(np.diff(words, axis=0)).max(axis=1, initial=0.0))
    return Vertices(tip, words, here, here + axis_here, parameter, _fixed(smoothed, move, at_pose))


def _fixed(smoothed: SmoothProgram, move: Ints, at_pose: Bools) -> Bools:
    """(r,) bool: rows at which something happens, or which the smoothed motion passes exactly."""
    program, corners = smoothed.program, smoothed.corners
    n = len(program)
    exact = np.ones(n, np.bool_)
    exact[corners.pose[np.isin(corners.status, Status.having(Trait.PASSED_BY))]] = False
    spoken = np.zeros(n + 1, np.int64)
    np.add.at(spoken, [min(statement.pose, n) for statement in program.statements], 1)
    statements_before = np.concatenate(([0], np.cumsum(spoken)))  # row i + 1: those before pose i
    after = np.append(move[1:], move[-1:])
    fixed = (program.kind[move] != Move.LINEAR) | (program.kind[after] != Move.LINEAR)
    fixed |= program.feed_changes(move, after)
    fixed |= at_pose & (exact[move] | (statements_before[after + 1] > statements_before[move + 1]))
    fixed[:1] = fixed[-1:] = True
    return fixed


def fewest_lines(rows: Vertices, limits: LineLimits) -> Ints:
    """Rows at which lines end, ascending, the first and the last row among them, and each after `LANE` others."""
    count = len(rows.parameter)
    if count < 3:
        return np.arange(count)
    ends = rows.fixed.copy()
    ends[::LANE] = True
    between = halfway(rows, limits) if limits.rotary else None
    return without_lag(rows, limits, farthest(ends, partial(_reaches, rows, between, limits)))


def farthest(ends: Bools, reaches: Callable[[Ints, Ints], Bools]) -> Ints:
    """Rows at which lines end, ascending: of (r,) those that are `ends`, and each that is the farthest from the last.

    It is found by doubling and halving, in all parts between ends at once. `reaches` says whether lines lead from rows
    (q,) to others (q,), the next of which they always reach.
    """
    begin = np.flatnonzero(ends)
    at, stop = begin[:-1].copy(), begin[1:].copy()
    kept = ends.copy()
    near, beyond = at + 1, stop + 1  # the farthest row known to be reached, the nearest known not to be
    while len(at):
        done = beyond - near == 1
        reached = near[done]
        kept[reached] = True
        at[done], near[done], beyond[done] = reached, reached + 1, stop[done] + 1
        going = at < stop
        if not going.all():
            at, stop, near, beyond = at[going], stop[going], near[going], beyond[going]
        untried = beyond > stop
        target = np.where(untried, np.minimum(2 * near - at, stop), (near + beyond) // 2)
        target = np.where(near == stop, stop, target)
        good = reaches(at, target)
        near = np.where(good, target, near)
        beyond = np.where(good, np.where(target == stop, stop + 1, beyond), target)
    return np.flatnonzero(kept)


def lags(tip: Floats, lever: Floats, blend: float) -> Floats:
    """Estimate (v,) of how far the axis point lags at vertices where a control rounds corners by itself, mm.

    Two lines of length l run together over half of the shorter one, so a change of the axis point's way per way of the
    tip by κ is worth up to κ·l/4. Where unit tangents of the tip differ by δ, κ·blend/δ is the most.
    `lever` is H times the tool axis.
    """
    found = np.zeros(len(tip))
    way = np.diff(tip, axis=0)
    length = norm(way)
    moving = length > 0.0
    per = np.where(moving, length, 1.0)[:, None]
    turn, change = norm(np.diff(way / per, axis=0)), norm(np.diff(np.diff(lever, axis=0) / per, axis=0))
    together = np.minimum(length[1:], length[:-1]) / 4.0
    rounded = np.divide(blend, turn, out=np.full_like(turn, np.inf), where=turn > 0.0)
    found[1:-1] = np.where(moving[1:] & moving[:-1], change * np.minimum(together, rounded), 0.0)
    return found


def without_lag(rows: Vertices, limits: LineLimits, kept: Ints) -> Ints:
    """Rows beside vertices at which the axis point would lag too far are vertices too: short lines bound it."""
    for _ in range(_ROUNDS if np.isfinite(limits.lag) and len(kept) > 2 else 0):
        lever = limits.axis_length * limits.axis_of(rows.words[kept])
        far = kept[lags(rows.tip[kept], lever, limits.blend) > limits.lag]
        more = np.unique(np.concatenate((kept, far - 1, far + 1)))
        if len(more) == len(kept):
            break
        kept = more
    return kept


def halfway(rows: Vertices, limits: LineLimits) -> Vertices:
    """(r − 1) vertices between those given: rotary words bend tool axis and tip there the most."""

    def mean(values: Floats) -> Floats:
        return (values[:-1] + values[1:]) / 2.0

    means: dict[str, Any] = {name: mean(column) for name, column in vars(rows).items() if column is not None}
    found = replace(rows, **means)
    lever = found.original_axis_point - found.original_tip
    lever *= (limits.axis_length / np.maximum(norm(lever), np.finfo(np.float64).tiny))[:, None]
    return replace(found, original_axis_point=found.original_tip + lever)


def _reaches(rows: Vertices, between: Vertices | None, limits: LineLimits, start: Ints, end: Ints) -> Bools:
    """(q,) bool: whether lines from some rows to others keep the limits, at rows and at vertices between them."""
    good = np.abs(rows.words[end] - rows.words[start]).max(axis=1) <= limits.turn
    good |= end == start + 1
    long_enough = np.flatnonzero(good & (end > start + 1))
    for part in split(long_enough, (end - start - 1)[long_enough], TOGETHER):
        good[part] = _keeps(rows, between, limits, start[part], end[part])
    return good


def _keeps(rows: Vertices, between: Vertices | None, limits: LineLimits, start: Ints, end: Ints) -> Bools:
    kept = _off(rows, rows, limits, start, end, start + 1) <= _USED
    if between is not None:
        left = np.flatnonzero(kept)
        if len(left):
            kept[left] = _off(rows, between, limits, start[left], end[left], start[left]) <= _USED
    if rows.position is not None:
        kept &= _in_order(rows, limits, start, end)
    return kept


def _in_order(rows: Vertices, limits: LineLimits, start: Ints, end: Ints) -> Bools:
    """(q,) bool: whether the tool never goes back along the original, where axes that run evenly bend its way."""
    line, place = spread(end - start + 1)
    row = place + start[line]
    way = np.diff(np.hstack(_on_lines(rows, limits, start, end, line, rows.parameter[row])), axis=0)
    original = np.diff(np.hstack((rows.original_tip[row], rows.original_axis_point[row])), axis=0)
    back = (line[1:] == line[:-1]) & ((way * original).sum(axis=1) < 0.0)
    return np.bincount(line[1:][back], minlength=len(start)) == 0


def _off(rows: Vertices, seen: Vertices, limits: LineLimits, start: Ints, end: Ints, first: Ints) -> Floats:
    """(q,) largest share of the limits in use on lines between rows, at those `seen` from the first (q,) to the end."""
    count = end - first
    line, place = spread(count)
    row = place + first[line]
    tip, axis_point = _on_lines(rows, limits, start, end, line, seen.parameter[row])
    off = limits.used(tip, axis_point, seen.original_tip[row], seen.original_axis_point[row])
    return np.maximum.reduceat(off, starts(count)[:-1])


def _on_lines(
    rows: Vertices, limits: LineLimits, start: Ints, end: Ints, line: Ints, s: Floats
) -> tuple[Floats, Floats]:
    """Tips and axis points (m, 3) on some `line` (m,) of those from `start` to `end` (q,), at parameters s (m,)."""
    begin, finish, low = start[line], end[line], rows.parameter[start]
    length = rows.parameter[end] - low
    share = ((s - low[line]) / np.where(length > 0.0, length, 1.0)[line])[:, None]
    way = rows.tip if rows.position is None else rows.position
    words, tip = (values[begin] + share * (values[finish] - values[begin]) for values in (rows.words, way))
    if limits.tip_of is not None:
        tip = limits.tip_of(tip, words)
    return tip, tip + limits.axis_length * limits.axis_of(words)
