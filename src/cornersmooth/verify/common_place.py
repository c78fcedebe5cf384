"""How far tip and tool axis are off at one place, where the axis has a tolerance of its own.

What is promised then is a place of the other motion at which the tip is within ε and the axis within its tolerance.
Both together are nearest somewhere else than either alone, so the place is looked for at which the larger of the two
is smallest, each measured in its tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.tool import written_at
from cornersmooth.verify.distances import REACH, Reached, elements_around, owner_fraction
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import nearest_places

#: places looked at on every move or element, and rounds of halving around the best of them
_PLACES: Final = np.linspace(0.0, 1.0, 17)
_ROUNDS: Final = 32

#: poses looked at at a time
_ROWS: Final = 256

#: section of an interval in which the larger part is kept
_GOLDEN: Final = (np.sqrt(5.0) - 1.0) / 2.0

#: how many times as far moves and elements are looked at where those around a place are all beyond, and the most
_FARTHER: Final = 8
_MOST: Final = 128

#: tip and axis (k, 3) at fractions (k,) of owners (k,)
Motion = Callable[[Ints, Floats], tuple[Floats, Floats]]

#: moves or elements (m, e) that are so many away at most from some of the poses (m,) looked at
Around = Callable[[Ints, int], Ints]


def axis_off_of_written(match: Match, reached: Reached, rows: Ints) -> Floats:
    """What is off at the best place of the original for some written vertices, mm: see `_least`."""
    trail, original = match.written.trail, match.original
    vertex = reached.vertex[rows]
    moves = _moves_around(match, match.segment[vertex], match.low[vertex], match.high[vertex])
    known = reached.gap.tip[rows], reached.gap.axis_point[rows]
    return _least(match, original.at, moves, (trail.tip[vertex], trail.axis[vertex]), known)


def axis_off_of_original(match: Match, reached: Reached, rows: Ints) -> Floats:
    """What is off at the best place of the written motion for some original vertices, mm: see `_least`."""
    segment = np.minimum(reached.place[rows].astype(np.int64), len(match.six) - 2)
    vertex, trail = reached.vertex[rows], match.original.trail

    def motion(element: Ints, fraction: Floats) -> tuple[Floats, Floats]:
        return written_at(match.nc, element, fraction)

    known = reached.gap.tip[rows], reached.gap.axis_point[rows]
    pose = trail.tip[vertex], trail.axis[vertex]

    def elements(some: Ints, reach: int) -> Ints:
        return elements_around(match, segment[some], reach)

    return _least(match, motion, elements, pose, known)


def axis_off_at(match: Match, tip: Floats, axis: Floats, middle: Ints, reach: int, low: Ints, high: Ints) -> Floats:
    """What is off at the best place of the original for any written poses (k, 3), from path segments (k,) on, mm."""
    original, trail = match.original, match.original.trail
    middle, at, _ = nearest_places(match.task.six(tip, axis), match.path.six, middle, reach, low, high)
    gap = match.task.gap(tip, axis, *original.at(*owner_fraction(trail.owner, trail.fraction, middle, at)))
    return _least(match, original.at, _moves_around(match, middle, low, high), (tip, axis), (gap.tip, gap.axis_point))


def _moves_around(match: Match, *segments: Ints) -> Around:
    """Moves of the original around path segments (k,), from the first to the last allowed."""
    theirs, first, last = (match.original.trail.owner[segment + 1] for segment in segments)

    def moves(some: Ints, reach: int) -> Ints:
        near = theirs[some, None] + np.arange(-reach, reach + 1)
        clipped: Ints = np.clip(near, first[some, None], last[some, None])
        return clipped

    return moves


def _least(
    match: Match, motion: Motion, around: Around, pose: tuple[Floats, Floats], known: tuple[Floats, Floats]
) -> Floats:
    """(k,) mm: what the axis is off at the best of all places, or the tip where that is more and beyond ε.

    Few moves or elements `around` each pose are looked at, and more where these are beyond. What tips and axes of the
    poses are off at a place that is known is in `known`, mm.
    """
    found, best = np.array(known[1]), np.maximum(*known)
    for reach in (REACH, min(_FARTHER * REACH * match.parts, _MOST)):
        rows = np.flatnonzero(best > match.tolerance)
        for begin in range(0, len(rows), _ROWS):
            some = rows[begin : begin + _ROWS]
            least, turned = _least_among(match, motion, around(some, reach), (pose[0][some], pose[1][some]))
            best[some] = np.minimum(least, best[some])
            found[some] = np.where(best[some] > match.tolerance, best[some], turned)
    return found


def _least_among(match: Match, motion: Motion, owners: Ints, pose: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """(m,) the larger of tip and axis at the best place on moves or elements (m, e), and the axis there, mm."""
    tip, axis = pose

    def off(owner: Ints, at: Floats) -> tuple[Floats, Floats]:
        """Of tip and axis (k, m), at fractions `at` of owners (k, m)."""
        there = motion(owner.ravel(), at.ravel())
        wide = np.repeat(np.arange(len(tip)), owner.shape[1])
        gap = match.task.gap(tip[wide], axis[wide], *there)
        return gap.tip.reshape(owner.shape), gap.axis_point.reshape(owner.shape)

    shape = (len(tip), owners.shape[1] * len(_PLACES))
    first = np.maximum(*off(np.repeat(owners, len(_PLACES), axis=1), np.tile(_PLACES, owners.shape).reshape(shape)))
    first = first.reshape(*owners.shape, len(_PLACES))
    most = np.argsort(first.min(axis=2), axis=1, kind="stable")[:, : 2 * REACH + 1]
    owners = np.take_along_axis(owners, most, axis=1)
    # on each for itself: they may be of very different length
    best = np.take_along_axis(first, most[..., None], axis=1).argmin(axis=2)
    low = _PLACES[np.maximum(best - 1, 0)]
    high = _PLACES[np.minimum(best + 1, len(_PLACES) - 1)]
    for _ in range(_ROUNDS):
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        falls = np.maximum(*off(owners, right)) < np.maximum(*off(owners, left))
        low, high = np.where(falls, left, low), np.where(falls, high, right)
    both = off(np.hstack((owners, owners, owners)), np.hstack((low, (low + high) / 2.0, high)))
    larger = np.maximum(*both)
    row, which = np.arange(len(tip)), larger.argmin(axis=1)
    return larger[row, which], both[1][row, which]
