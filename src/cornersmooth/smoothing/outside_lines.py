"""Lines whose ends are beside the path, for a control that rounds corners by itself.

A control that blends from line to line runs inside of every bend: where lines end on the path, it uses one side of the
tolerance only. So chords may be nearly twice as far off, and their ends move outwards until both sides are used alike:
they are a linear spline that is nearest to the path in the maximum norm, by least squares that are weighted anew
(Lawson 1961). A chord is off an even bend by 4u(1 − u) of its sagitta, of which Chebyshev's weight has the mean ½: so
that is what they begin with.

Each line is as long as that lets it be. The axis point moves evenly with words that are so near to the path.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cornersmooth.arrays import Bools, Floats, Ints, some_rows, square
from cornersmooth.smoothing.long_lines import LANE, LineLimits, Vertices, farthest, fewest_lines, halfway, without_lag

#: times the limits that chords may be off: moving their ends does not balance them perfectly
_CHORD = 1.8

#: rows after which a line ends on the path in any case
_LANE = 2 * LANE

#: places at which a line is compared with the path while rows to lead it to are tried
_INSIDE = 5

#: rounds of weighting anew, the least weight of what is nowhere near the limits, and the share next to an end of a line
_WEIGHTS, _LEAST_WEIGHT, _NEXT = 8, 0.3, 1e-3

#: rounds of making lines shorter where moving them does not bring them within the limits; by what chords come nearer
_ROUNDS, _NEARER = 8, 0.85

#: degrees or parts of a vector by which words change for their effect on the axis point
_LITTLE = 1e-4


def faster_lines(
    rows: Vertices, limits: LineLimits, ends_reached: Callable[[Vertices, Ints], Floats]
) -> tuple[Vertices, Ints]:
    """Vertices of which some were moved off the path, where lines are faster so, and rows (k,) at which lines end.

    Rows that are `fixed`, and one of so many others, stay on the path, and lines are compared between these.
    `ends_reached` says when the control reaches the ends of lines (k,), s.
    """
    if len(rows.parameter) < 3 or rows.parameter[-1] <= rows.parameter[0]:  # one line, or a tool that stands
        return rows, fewest_lines(rows, limits)
    stays, near = rows.fixed.copy(), _Near.of(rows, limits)
    stays[::_LANE] = stays[-1:] = True
    straight = farthest(stays, partial(_reaches, near, np.ones(len(stays)), limits.turn))
    moved, outside = _outside(rows, near, limits, stays)
    before, after = (
        np.diff(ends_reached(some, kept)[stays[kept]])  # from one row that stays to the next
        for some, kept in ((rows, without_lag(rows, limits, straight)), (moved, outside))
    )
    faster = np.append(after < before, False)[np.cumsum(stays) - 1]
    own = np.flatnonzero(~faster | stays)
    ends = np.zeros(len(stays), np.bool_)
    ends[own[fewest_lines(replace(some_rows(rows, own), fixed=stays[own]), limits)]] = True
    ends[outside[faster[outside]]] = True
    tip, words = (np.where(faster[:, None], *both) for both in ((moved.tip, rows.tip), (moved.words, rows.words)))
    return replace(rows, tip=tip, words=words), np.flatnonzero(ends)


def _outside(rows: Vertices, near: _Near, limits: LineLimits, stays: Bools) -> tuple[Vertices, Ints]:
    """Vertices of which some were moved off the path, and the rows (k,) at which lines end, ascending.

    Where lines cannot be moved to within the limits, they are on the path.
    """
    ends, room = np.zeros(len(stays), np.bool_), np.full(len(stays), _CHORD)
    part, place, again = np.cumsum(stays), near.place.copy(), np.arange(len(stays))
    for _ in range(_ROUNDS):
        some, own = some_rows(near, again), some_rows(rows, again)
        kept = farthest(stays[again], partial(_reaches, some, room[again], limits.turn))
        kept = without_lag(own, limits, kept)
        ends[again] = False
        ends[again[kept]] = True
        moved = _moved(some, kept, stays[again[kept]], *_shares(own, kept, own.parameter))
        place[again[kept]] = moved
        far = (_off(own, limits, kept, moved) > 1.0) & (np.diff(kept) > 1)  # else from one row to the next
        if not far.any():
            break
        beside = np.convolve(far, np.ones(3))[1:-1] > 0.5
        room[again[np.append(np.repeat(beside, np.diff(kept)), False)]] *= _NEARER
        # all lines between two ends that stay are looked for anew
        parts = np.unique(part[again[kept[:-1][far]]])
        again = again[np.isin(part[again], parts) | (stays[again] & np.isin(part[again] - 1, parts))]
    else:
        ends[again] = False
        ends[again[fewest_lines(replace(some_rows(rows, again), fixed=stays[again]), limits)]] = True
        place[again] = near.place[again]
    return replace(rows, tip=place[:, :3], words=place[:, 3:]), np.flatnonzero(ends)


def _shares(rows: Vertices, kept: Ints, parameter: Floats) -> tuple[Ints, Floats]:
    """Line between rows at which lines end, and how far along it, at parameters of all rows, or between rows."""
    line = np.append(np.repeat(np.arange(len(kept) - 1), np.diff(kept)), len(kept) - 2)[: len(parameter)]
    s = rows.parameter[kept]
    length = np.diff(s)
    return line, (parameter - s[line]) / np.where(length > 0.0, length, 1.0)[line]


def _along(ends: Floats, line: Ints, share: Floats) -> Floats:
    """(r, d) places on lines."""
    return ends[line] + share[:, None] * np.diff(ends, axis=0)[line]


@dataclass(frozen=True)
class _Near:
    """What tip and axis point are off where words are all but those of the path, r rows."""

    place: Floats  #: (r, 3 + d) tips and words
    parameter: Floats  #: (r,)
    tip_off: Floats  #: (r, 3) from the original motion, over the limit
    axis_point_off: Floats  #: (r, 3)
    effect: Floats  #: (r, 3, d) that words have on the axis point, over the limit
    scale: tuple[float, float]  #: one over the limits of tip and axis point

    @classmethod
    def of(cls, rows: Vertices, limits: LineLimits) -> _Near:
        axis, (of_tip, of_axis) = limits.axis_of(rows.words), (1.0 / limits.tip, 1.0 / limits.axis_point)
        changed = rows.words[None] + _LITTLE * np.eye(rows.words.shape[1])[:, None]
        effect = [(limits.axis_of(words) - axis) * (limits.axis_length * of_axis / _LITTLE) for words in changed]
        tip_off = of_tip * (rows.tip - rows.original_tip)
        axis_point = rows.tip + limits.axis_length * axis
        return cls(
            np.hstack((rows.tip, rows.words)),
            rows.parameter,
            tip_off,
            of_axis * (axis_point - rows.original_axis_point),
            np.stack(effect, axis=-1),
            (of_tip, of_axis),
        )

    def off(self, row: slice | Ints, place: Floats) -> Floats:
        """(...,) share of the limits in use where tips and words of rows are some others (..., 3 + d)."""
        away = place - self.place[row]
        tip, effect = away[..., :3], self.effect[row]
        axis_point = self.axis_point_off[row] + self.scale[1] * tip
        for word in range(effect.shape[-1]):
            axis_point += effect[..., word] * away[..., 3 + word, None]
        return np.sqrt(np.maximum(square(self.tip_off[row] + self.scale[0] * tip), square(axis_point)))


def _reaches(near: _Near, room: Floats, turn: float, begin: Ints, end: Ints) -> Bools:
    """(q,) whether lines between rows are off by no more than the room of some rows inside."""
    inside = begin + (end - begin) * np.arange(1, _INSIDE + 1)[:, None] // (_INSIDE + 1)
    way, low = near.place[end] - near.place[begin], near.parameter[begin]
    share = (near.parameter[inside] - low) / np.maximum(near.parameter[end] - low, np.finfo(np.float64).tiny)
    off = near.off(inside, near.place[begin] + share[..., None] * way)
    far = (off > room[inside]).any(axis=0) | (np.abs(way[:, 3:]).max(axis=1, initial=0.0) > turn)
    return ~far | (end == begin + 1)


def _moved(near: _Near, kept: Ints, stays: Bools, line: Ints, share: Floats) -> Floats:
    """(k, d) tips and words of the ends of lines where they are nearest to the path."""
    pinned = np.flatnonzero(stays)
    best, least = near.place[kept], np.full(len(pinned) - 1, np.inf)
    gaps = np.diff(near.parameter, prepend=near.parameter[0], append=near.parameter[-1])
    weight = (gaps[1:] + gaps[:-1]) / np.sqrt(np.maximum(share * (1.0 - share), _NEXT))
    for _ in range(_WEIGHTS):
        weight *= len(weight) / weight.sum()
        at = _fitted(near.place, kept, line, share, weight, pinned)
        off = near.off(slice(None), _along(at, line, share))
        worst = np.maximum.reduceat(off[:-1], kept[pinned[:-1]])  # between two ends that stay
        inner = np.append(np.repeat(worst < least, np.diff(pinned)), False)
        least = np.minimum(worst, least)
        best[inner] = at[inner]
        weight *= np.maximum(off, _LEAST_WEIGHT)
    best[pinned] = near.place[kept[pinned]]
    return best


def _off(rows: Vertices, limits: LineLimits, kept: Ints, ends: Floats) -> Floats:
    """(k − 1,) largest share of the limits in use on lines from row to row whose ends are others (k, 3 + d)."""
    off = np.zeros(len(rows.parameter))
    for seen in (rows, halfway(rows, limits)) if limits.rotary else (rows,):
        place = _along(ends, *_shares(rows, kept, seen.parameter))
        tip = place[:, :3]
        axis_point = tip + limits.axis_length * limits.axis_of(place[:, 3:])
        used = limits.used(tip, axis_point, seen.original_tip, seen.original_axis_point)
        off[: len(used)] = np.maximum(off[: len(used)], used)
    most: Floats = np.maximum.reduceat(off[:-1], kept[:-1])
    return most


def _fitted(data: Floats, kept: Ints, line: Ints, share: Floats, weight: Floats, pinned: Ints) -> Floats:
    """(k, d) ends of lines with the least weighted squares of what rows (r, d) are off at their shares of lines."""
    left, right = weight * (1.0 - share), weight * share
    both = np.column_stack((left * (1.0 - share), right * share, left * share))
    of_lines = np.add.reduceat(both[:-1], kept[:-1])
    of_left, of_right = (np.add.reduceat(part[:-1, None] * data[:-1], kept[:-1]) for part in (left, right))
    bands, wanted = np.zeros((2, len(kept))), np.zeros((len(kept), data.shape[1]))
    bands[1, :-1], bands[0, 1:] = of_lines[:, 0], of_lines[:, 2]
    bands[1, 1:] += of_lines[:, 1]
    wanted[:-1] = of_left
    wanted[1:] += of_right
    stiff = 1e-9 * bands[1]
    stiff[pinned] = 1e9 * bands[1].max()
    bands[1] += stiff
    wanted += stiff[:, None] * data[kept]
    from scipy.linalg import solveh_banded  # it loads longer than all else of a short run

    found: Floats = solveh_banded(bands, wanted, check_finite=False)
    return found
