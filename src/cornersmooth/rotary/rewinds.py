"""A cut that no choice of angles keeps inside the limits, in parts that can be kept: as few as there can be."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.rotary.branch_choice import LIMIT_SLACK, NoChoiceError, Stretches, turns_inside


class CutTooFarError(Exception):
    """Cuts that no choice keeps inside the limits, unless they are left after `poses` (k,), ascending."""

    def __init__(self, poses: Ints) -> None:
        super().__init__(poses)
        self.poses = poses


def too_far(stretches: Stretches, limits: Floats) -> Ints:
    """Stretches that are inside the limits on no branch and in no turn: (k,) int64."""
    fewest, most = turns_inside(stretches.low, stretches.high, limits)
    return np.flatnonzero(np.logical_and.reduce(np.logical_or.reduce(fewest > most, axis=2), axis=1))


def parts_of_cut(
    angles: Floats, low: Floats, high: Floats, limits: Floats, stuck: NoChoiceError | None = None
) -> Ints | None:
    """Rows (k,) of a stretch after which the cut is left, so that all parts of it are inside the limits.

    None where a single move, or the way in, leaves the limits. Angles (m, 2, 2) are ``[row, branch, axis]`` in degrees,
    unwrapped: at each row, and extremes on the way into it. `stuck` says in which states the stretch can be entered.
    """
    count, begin = len(angles), 0
    left: list[int] = []
    while True:
        if stuck is not None and not left:
            stop = max(_first_outside(low, high, limits, state[0], state[1:]) for state in stuck.states.astype(float))
        else:
            stop = begin + _farthest(angles[begin:], low[begin:], high[begin:], limits)
        if stop == count:
            return np.array(left, np.int64)
        if stop - 1 < begin or (stop - 1 == begin and left):
            return None
        begin = stop - 1
        left.append(begin)


def _first_outside(low: Floats, high: Floats, limits: Floats, branch: float, turns: Floats) -> int:
    """First row outside of the limits; the number of rows where none is."""
    own = int(branch)
    beyond = np.maximum(limits[:, 0] - low[:, own] - 360 * turns, high[:, own] + 360 * turns - limits[:, 1])
    rows = np.flatnonzero(beyond.max(axis=1) > LIMIT_SLACK)
    return int(rows[0]) if len(rows) else len(low)


def _farthest(angles: Floats, low: Floats, high: Floats, limits: Floats) -> int:
    """First row outside of the limits for the branch and the turns that reach farthest from the first row on."""
    lowest = np.minimum.accumulate(np.concatenate((angles[:1], low[1:])))
    highest = np.maximum.accumulate(np.concatenate((angles[:1], high[1:])))
    fewest, most = turns_inside(lowest, highest, limits)  # as long as a whole number lies between both
    outside = (fewest > most).any(axis=2)
    return int(np.where(outside.any(axis=0), outside.argmax(axis=0), len(angles)).max())
