"""Poses that are almost doubled become one corner (docs/method.md).

Without it, the short segment between them limits the transitions at both, or leaves no room for any.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.arrays.vectors import norm, unit
from cornersmooth.geometry.ragged import ranges, starts
from cornersmooth.model import Bools, Floats, Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing.construction import distance

#: part of the tolerance within which poses may be one corner, and how much farther away all other poses must be
_SHARE: Final = 0.5
_APART: Final = 4.0

#: steps of the digits within which poses are one corner wherever the others are: a transition between two such corners
#: is shorter than the digits show
_STEPS: Final = 8.0


def one_corner_each(program: Program, settings: Settings) -> tuple[Program, Settings]:
    """Move poses that are almost doubled onto one place; the settings take the largest move off ε.

    Poses that must be passed exactly stay, and others move onto them. All stay where nothing is almost doubled.
    """
    settings = settings.but(pose_shift=0.0)  # that of a program which was smoothed before
    limit = _SHARE * settings.common_tolerance / settings.curve_share
    fine = min(limit, max(_STEPS * settings.tip_resolution, settings.duplicate_distance))
    size = _steps(program, settings.axis_length)
    short = size <= limit
    if not (short & (size > 0.0)).any():
        return program, settings
    gone = np.cumsum(np.where(short, size, 0.0))
    begin, end = (np.flatnonzero(short & ~np.roll(short, by)) for by in (1, -1))
    first, count = begin - 1, end - begin + 2
    total, around = gone[end] - gone[first], np.minimum(size[first], np.append(size, np.inf)[end + 1])
    cell = np.where((total <= limit) & (_APART * total <= around), np.inf, fine)

    # of every pose in these runs: the pose that its cells are counted from, and the pinned one behind it
    pose, run = ranges(first, count), np.repeat(np.arange(len(first)), count)
    pinned, place = _pinned(program)[pose], np.arange(len(pose))
    anchor = np.maximum.accumulate(np.where(pinned | (pose == first[run]), place, 0))
    ahead = np.minimum.accumulate(np.where(pinned, place, len(place))[::-1])[::-1]
    ahead = np.where((ahead < starts(count)[run + 1]), ahead, place)
    at, length = gone[pose], cell[run]
    number = np.floor((at - at[anchor]) / length + np.where(pinned[anchor], 0.5, 0.0))
    joins = pinned[ahead] & (at[ahead] - at <= length / 2.0)
    anchor, number = np.where(joins, ahead, anchor), np.where(joins, 0.0, number)
    new = np.append(True, (anchor[1:] != anchor[:-1]) | (number[1:] != number[:-1]))

    group, opens = np.cumsum(new) - 1, np.flatnonzero(new)
    closes = np.append(opens[1:], len(place)) - 1
    own = np.flatnonzero(pinned)
    opens_at, closes_at = opens.copy(), closes
    opens_at[group[own]] = closes_at[group[own]] = own
    one, other = pose[opens_at], pose[closes_at]
    tip, axis = (program.tip[one] + program.tip[other]) / 2.0, unit(program.axis[one] + program.axis[other])
    step, turn = tip[group] - program.tip[pose], settings.axis_length * (axis[group] - program.axis[pose])
    shift = np.maximum.reduceat(np.maximum(norm(step), norm(step + turn)), opens)
    several = np.bincount(group)[group] > 1
    here, into = pose[several], group[several]
    if not shift[into].any():
        return program, settings
    moved, tips, axes = np.zeros(len(program)), program.tip.copy(), program.axis.copy()
    tips[here], axes[here], moved[here] = tip[into], axis[into], shift[into]
    return replace(program, tip=tips, axis=axes, moved=moved), settings.but(pose_shift=float(moved.max()))


def _steps(program: Program, axis_length: float) -> Floats:
    """(n,) mm: how far tip or axis point go in the move into each pose; infinite where it is in no chain."""
    chains = program.chains
    pose = ranges(chains[:, 0] + 1, chains[:, 1] - chains[:, 0])
    size = np.full(len(program), np.inf)
    size[pose] = distance(program, pose, pose - 1, axis_length)
    return size


def _pinned(program: Program) -> Bools:
    """(n,) whether poses stay: ends of chains, what must be passed exactly, curves, and where the feed changes."""
    pinned = (program.keep != 0) | program.acted[1:]
    if program.curves is not None:
        pinned[program.curves.pose] = pinned[program.curves.pose - 1] = True
    pinned[program.chains.ravel()] = True
    pinned[:-1] |= program.feed_changes(np.arange(1, len(program)), np.arange(len(program) - 1))
    return pinned
