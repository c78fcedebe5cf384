"""Which of the two solutions, and in which turn, for every stretch of a path: the cheapest choice inside the limits.

On a stretch the solution cannot change without a jump. Between two of them is a rapid, where everything may change, or
a passage through the pole, where the two solutions meet. Dynamic programming looks ahead over the whole path. A cut
that no choice keeps inside the limits is divided into parts that can be kept: as few as there can be.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import pole_angle, solutions, wrap
from cornersmooth.model import Bools, Floats, Ints

NO_TURN = 1e-6  #: Turns of a rotary axis below this (degrees) are rounding.
#: What a full turn back of an axis in a rapid costs, in degrees of rotation: so much that rotation never outweighs it.
REWIND_COST = 1e9
#: What a start on the solution that is not preferred costs, in degrees of rotation: more than any start turn.
PREFERENCE_COST = 1e3
START_TURN_COST = 1e-3  #: What each turn costs by which a path starts away from zero: it only breaks ties.
#: Words may pass their limits by so much (degrees): rounding of the solution, far below the last digit of a word.
LIMIT_SLACK = 1e-9
#: An axis with room for more turns is taken as endless first; only where that fails its turns are searched.
MANY_TURNS = 8
#: More states than these are not searched: axes with many turns are then kept within `MANY_TURNS` of zero.
MOST_STATES = 1000
CHUNK = 1 << 20  #: Numbers that the costs of the steps between states may take up at a time.


@dataclass(frozen=True)
class Stretches:
    """Angles of p stretches on both branches, unwrapped from the first pose of each stretch; degrees."""

    #: first, last: (p, 2, 2); ``[stretch, branch, axis]`` at the first and at the last pose, or at the pole where
    #: stretches meet
    first: Floats
    last: Floats
    #: low, high: (p, 2, 2); extremes over the stretch
    low: Floats
    high: Floats
    free: Bools  #: (p,) A rapid leads into the stretch, not a passage through the pole. True for the first stretch.
    dislike: Floats  #: (2,) what a start of the path on either branch costs

    def __len__(self) -> int:
        return len(self.first)


@dataclass(eq=False)
class NoChoiceError(Exception):
    """No choice keeps the path inside the limits.

    In `states` (s, 3), branch and turns of both axes, the stretch can be entered; all of them leave the limits there.
    """

    stretch: int  #: the first that cannot be reached
    states: Ints


def choose(stretches: Stretches, limits: Floats) -> tuple[Ints, Floats]:
    """Branch (p,) of every stretch, and whole turns (p, 2) to add to its angles; NoChoiceError where there are none.

    The limits (2, 2), degrees, are the lowest and highest word of each axis, infinite where there is none.
    """
    finite = np.isfinite(limits[:, 0]) & np.isfinite(limits[:, 1])
    narrow = finite & (limits[:, 1] - limits[:, 0] <= 360 * MANY_TURNS)
    branch, fixed = search(stretches, np.where(narrow[:, None], limits, [[-np.inf, np.inf]]))
    turns = _nearest_turns(stretches, branch, fixed, narrow)
    if _start_inside(stretches, branch, turns, limits):
        return branch, turns
    branch, fixed = search(stretches, limits)
    return branch, _nearest_turns(stretches, branch, fixed, finite)


def turns_inside(low: Floats, high: Floats, limits: Floats) -> tuple[Floats, Floats]:
    """Fewest and most whole turns (..., 2) that bring angles from `low` to `high` (..., 2) inside the limits."""
    fewest: Floats = np.ceil((limits[:, 0] - LIMIT_SLACK - low) / 360)
    most: Floats = np.floor((limits[:, 1] + LIMIT_SLACK - high) / 360)
    return fewest, most


def _nearest_turns(stretches: Stretches, branch: Ints, fixed: Floats, known: Bools) -> Floats:
    """Count the turns without a rewind; those of axes that are `known` are taken as they are."""
    index = np.arange(len(stretches))
    first, last = stretches.first[index, branch], stretches.last[index, branch]
    turns = np.zeros((len(stretches), 2))
    turns[1:] = -np.cumsum(np.round((first[1:] - last[:-1]) / 360), axis=0)
    return np.where(known, fixed, turns)


def _start_inside(stretches: Stretches, branch: Ints, turns: Floats, limits: Floats) -> bool:
    """Shift the whole path by the fewest turns that bring it inside the limits, in place; false if none do."""
    index = np.arange(len(stretches))
    low = (stretches.low[index, branch] + 360 * turns).min(axis=0)
    high = (stretches.high[index, branch] + 360 * turns).max(axis=0)
    fewest, most = turns_inside(low, high, limits)
    if (fewest > most).any():
        return False
    turns += np.clip(0, fewest, most)
    return True


def search(stretches: Stretches, limits: Floats) -> tuple[Ints, Floats]:
    """Search the careful way: every branch and every turn that the limits allow; axes without limits carry no turns.

    Returns and raises as `choose`, with turns 0 for axes without limits.
    """
    finite = np.isfinite(limits[:, 0]) & np.isfinite(limits[:, 1])
    branch, turns = _states(limits, finite)
    start = stretches.dislike[branch] + np.abs(stretches.first[0]).sum(axis=1)[branch]
    size = max(1, CHUNK // (2 * len(branch) ** 2))
    origins: list[Ints] = []
    best = entered = start + START_TURN_COST * np.abs(turns[:, 0]) + START_TURN_COST * np.abs(turns[:, 1])
    for begin in range(0, len(stretches), size):
        here = slice(begin, min(begin + size, len(stretches)))
        low, high = (ends[here][:, branch] + 360 * turns for ends in (stretches.low, stretches.high))
        inside = (low >= limits[:, 0] - LIMIT_SLACK) & (high <= limits[:, 1] + LIMIT_SLACK)
        before = np.maximum(np.arange(here.start, here.stop) - 1, 0)  # the first stretch has none: its row is not used
        # [stretch, from, to, axis]
        off = stretches.first[here][:, None, branch] - stretches.last[before][:, branch, None]
        nearest = -np.round(off / 360)
        change = np.where(finite, turns - turns[:, None], nearest)
        rewind = np.where(stretches.free[here], REWIND_COST, np.inf)[:, None, None, None]
        steps = (np.abs(off + 360 * change) + np.where(change == nearest, 0.0, rewind)).sum(axis=3)
        for p, (fits, step) in enumerate(zip(inside[..., 0] & inside[..., 1], steps, strict=True), begin):
            if p:
                total = best[:, None] + step
                origins.append(total.argmin(axis=0))
                entered = total.min(axis=0)
            best = np.where(fits, entered, np.inf)
            if best.min() == np.inf:
                open_ = np.isfinite(entered)
                raise NoChoiceError(p, np.column_stack((branch, turns))[open_].astype(np.int64))
    path = [int(best.argmin())]
    for origin in reversed(origins):
        path.append(int(origin[path[-1]]))
    return branch[path[::-1]], turns[path[::-1]]


def _states(limits: Floats, finite: Bools) -> tuple[Ints, Floats]:
    """Branches (s,), and whole turns (s, 2) that bring angles in (-180, 180] inside the limits; 0 for axes without."""
    low = np.where(finite, np.ceil((np.where(finite, limits[:, 0], 0) - 180) / 360), 0)
    high = np.where(finite, np.floor((np.where(finite, limits[:, 1], 0) + 180) / 360), 0)
    if 2 * np.prod(high - low + 1) > MOST_STATES:
        low, high = np.maximum(low, -MANY_TURNS), np.minimum(high, MANY_TURNS)
    states = np.array([*product((0, 1), *(np.arange(least, most + 1) for least, most in zip(low, high, strict=True)))])
    return states[:, 0].astype(np.int64), states[:, 1:]


@dataclass(eq=False)
class CutTooFarError(Exception):
    """Cuts that no choice keeps inside the limits, unless they are left after `poses` (k,), ascending."""

    poses: Ints


def too_far(stretches: Stretches, limits: Floats) -> Ints:
    """Stretches that are inside the limits on no branch and in no turn: (k,) int64."""
    fewest, most = turns_inside(stretches.low, stretches.high, limits)
    return np.flatnonzero((fewest > most).any(axis=2).min(axis=1))


def parts_of_cut(angles: Floats, low: Floats, high: Floats, limits: Floats, states: Ints | None = None) -> Ints | None:
    """Rows (k,) of a stretch after which the cut is left, so that all parts are inside the limits: as few as can be.

    None where a single move, or the way in, leaves the limits. Angles (m, 2, 2) are ``[row, branch, axis]`` in degrees,
    unwrapped: at each row, and extremes on the way into it. The stretch is entered in some `states` of `NoChoiceError`.
    """
    begin, left = 0, list[int]()
    while True:
        reached = _farthest(angles[begin:], low[begin:], high[begin:], limits)
        if states is not None and not left:
            reached = max(
                first_outside(low[:, own] + 360 * turns, high[:, own] + 360 * turns, limits)
                for own, turns in zip(states[:, 0], states[:, 1:], strict=True)
            )
        if begin + reached == len(angles):
            return np.array(left, np.int64)
        if reached < 1 + bool(left):
            return None
        begin += reached - 1
        left.append(begin)


def first_outside(low: Floats, high: Floats, limits: Floats) -> int:
    """First row (m, 2) outside of the limits; the number of rows where none is."""
    beyond = np.maximum(limits[:, 0] - low, high - limits[:, 1]).max(axis=1) > LIMIT_SLACK
    return int(np.argmax(beyond)) if beyond.any() else len(low)


def _farthest(angles: Floats, low: Floats, high: Floats, limits: Floats) -> int:
    """First row outside of the limits for the branch and the turns that reach farthest from the first row on."""
    lowest = np.minimum.accumulate(np.concatenate((angles[:1], low[1:])))
    highest = np.maximum.accumulate(np.concatenate((angles[:1], high[1:])))
    fewest, most = turns_inside(lowest, highest, limits)  # as long as a whole number lies between both
    outside = (fewest > most).any(axis=2)
    return int(np.where(outside.any(axis=0), outside.argmax(axis=0), len(angles)).max())


#: A step of an angle larger than this (degrees) is followed on its way, to see which way round it goes and how far.
WIDE_STEP = 30.0
WIDE_STEP_POINTS = 15  #: So many points are looked at on the way.


def meet_at_pole(
    machine: Machine, axis: Floats, steady: Ints, begins: Ints, through: Bools, enter: Floats, leave: Floats
) -> None:
    """Take the second angles to the pole in place, where stretches meet there.

    On the way to the pole that angle turns by less than 180 degrees, from pose to pose through the pole by up to 360.
    """
    stretches = np.flatnonzero(through)
    if not len(stretches):
        return
    start, end = steady[begins[stretches] - 1], steady[begins[stretches]]
    inside = np.where((end - start > 1)[:, None], axis[start + 1], axis[start] + axis[end])
    angle = pole_angle(machine, inside)[:, None]
    enter[stretches, :, 1] += wrap(angle - enter[stretches, :, 1])
    leave[stretches - 1, :, 1] += wrap(angle - leave[stretches - 1, :, 1])


@dataclass(frozen=True)
class WideSteps:
    """How far the angles go on wide steps into rows: (w,) and twice (w, 2, 2) degrees, unwrapped."""

    row: Ints
    low: Floats
    high: Floats


def unwrap(machine: Machine, axis: Floats, start: Ints, end: Ints, angles: Floats, broken: Bools) -> WideSteps:
    """Make both branches of angles (e + 1, 2, 2), degrees, continuous from the first row on, in place.

    Steps lead from the poses `start` to `end` (e,); after a broken one the turns are counted from 0 again.
    """
    step = np.diff(angles, axis=0)
    change = -np.round(step / 360)
    wide = np.flatnonzero(~broken & (np.abs(step + 360 * change).max(axis=(1, 2)) > WIDE_STEP))
    steps = np.zeros((1, len(wide), 2, 2))
    if len(wide):
        # A wide step: the sum of the short ones on the way says which way round it goes.
        share = (np.arange(1, WIDE_STEP_POINTS + 1) / (WIDE_STEP_POINTS + 1))[:, None, None]
        on_way = solutions(
            machine, ruled_axis(axis[start[wide]], axis[end[wide]], share).reshape(-1, 3)
        ).angles.reshape(WIDE_STEP_POINTS, -1, 2, 2)
        steps = np.diff(np.concatenate((angles[wide][None], on_way, angles[wide + 1][None])), axis=0)
        steps -= 360 * np.round(steps / 360)
        change[wide] = np.round((steps.sum(axis=0) - step[wide]) / 360)
    if change.any():
        turns = np.cumsum(change, axis=0)
        if broken.any():
            base = np.maximum.accumulate(np.where(broken, np.arange(len(broken)), -1))
            turns -= np.where(base[:, None, None] >= 0, turns[base], 0.0)
        angles[1:] += 360 * turns
    way = angles[wide] + np.cumsum(steps, axis=0)
    return WideSteps(wide, way.min(axis=0), way.max(axis=0))


def ruled_axis(start: Floats, end: Floats, share: Floats) -> Floats:
    """Unit axes (..., 3) at shares of ways on which both ends run evenly; the first axis where they cancel out."""
    direction = start * (1 - share) + end * share
    length = np.linalg.norm(direction, axis=-1, keepdims=True)
    return np.where(length > 0, direction / np.where(length > 0, length, 1.0), start)


def limit_error(
    machine: Machine, both: Floats, words: Floats | None, line: int, file: str | None, since: int = 0
) -> InputError:
    """Say that a rotary word leaves its limits: with either solution alone, or because the cut began on the other one.

    `both` (2, 2) are the solutions of the pose, `words` (2,) those at which the furthest choice leaves the limits; the
    cut starts at the line `since`, 0 where unknown.
    """
    limits = machine.limits
    turned = both + 360 * np.round((limits.clip(-1e6, 1e6).mean(axis=1) - both) / 360)
    excess = np.maximum(np.maximum(limits[:, 0] - turned, turned - limits[:, 1]), 0.0)
    alone = bool((excess.max(axis=1) > NO_TURN).all())
    shown = turned[int(np.argmin(excess.max(axis=1)))] if alone or words is None else words
    over = np.maximum(limits[:, 0] - shown, shown - limits[:, 1])
    axis = int(np.argmax(over))
    name = machine.names[axis]
    limit = limits[axis, 0] if shown[axis] < limits[axis, 0] else limits[axis, 1]
    text = f"{name} would have to go to {shown[axis]:.3f} deg, its limit is {limit:g} deg"
    if alone or words is None:
        hint = "turn the part or use a machine with more travel"
    else:
        text += f", in a cut from line {since} on" if since else ", in one cut"
        hint = (
            "interrupt the cut with a retract in rapid before, so that the axis can turn back, or give --rewind, "
            "for a control that has a retract"
        )
    return InputError("CS362", text, hint, file=file, line=line or None)
