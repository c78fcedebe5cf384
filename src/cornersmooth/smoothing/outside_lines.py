"""Lines whose ends are beside the path, for a control that rounds corners by itself.

A control that blends from line to line runs inside of every bend: where lines end on the path, it uses one side of the
tolerance only. So chords may be nearly twice as far off, and their ends move outwards until both sides are used alike:
they are a linear spline that is nearest to the path in the maximum norm, by least squares that are weighted anew
(Lawson 1961). A chord is off an even bend by 4u(1 − u) of its sagitta, of which Chebyshev's weight has the mean ½: so
that is what they begin with.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cornersmooth.arrays import Floats, Ints
from cornersmooth.arrays.slices import some_rows
from cornersmooth.arrays.vectors import norm
from cornersmooth.smoothing.long_lines import LANE, LineLimits, Vertices, fewest_lines

#: times the limits that chords may be off: moving their ends does not balance them perfectly
_CHORD = 1.8

#: rows after which a line ends in any case: there are stations between
_LANE = 4 * LANE

#: rounds of weighting anew, the least weight of what is nowhere near the limits, and the share next to an end of a line
_WEIGHTS, _LEAST_WEIGHT, _NEXT = 12, 0.3, 1e-3

#: rounds of making lines shorter where moving them does not bring them within the limits; by what chords come nearer
_ROUNDS, _NEARER = 8, 0.85


def lines_outside(rows: Vertices, limits: LineLimits) -> tuple[Vertices, Ints]:
    """Vertices of which some were moved off the path, and the rows (k,) at which lines end, ascending.

    Rows that are `fixed` stay on the path. Where lines cannot be moved to within the limits, they are on the path.
    """
    count = len(rows.parameter)
    if count < 3 or rows.parameter[-1] <= rows.parameter[0]:  # one line, or a tool that stands
        return rows, fewest_lines(rows, limits)
    fixed, room = rows.fixed.copy(), np.full(count, _CHORD)
    fixed[::_LANE] = fixed[-1] = True
    rows, part = replace(rows, fixed=fixed), np.cumsum(fixed)
    place, ends, again = np.hstack((rows.tip, rows.words)), np.zeros(count, np.bool_), np.arange(count)
    for number in range(_ROUNDS + 1):
        some = replace(some_rows(rows, again), room=room[again] if number < _ROUNDS else None)
        kept = fewest_lines(some, limits, _LANE)
        ends[again] = False
        ends[again[kept]] = True
        if some.room is None:
            place[again] = np.hstack((some.tip, some.words))
            break
        place[again[kept]], off = _moved(some, kept, limits)
        far = (off > 1.0) & (np.diff(kept) > 1)  # no line is shorter than from one row to the next
        if not far.any():
            break
        beside = np.convolve(far, np.ones(3))[1:-1] > 0.5
        room[again[np.append(np.repeat(beside, np.diff(kept)), False)]] *= _NEARER
        # all lines between two ends that stay are looked for anew
        parts = np.unique(part[again[kept[:-1][far]]])
        again = again[np.isin(part[again], parts) | (fixed[again] & np.isin(part[again] - 1, parts))]
    return replace(rows, tip=place[:, :3], words=place[:, 3:]), np.flatnonzero(ends)


def _moved(rows: Vertices, kept: Ints, limits: LineLimits) -> tuple[Floats, Floats]:
    """(k, d) tips and words of the ends of lines where they are nearest to the path, and (k − 1,) what lines are off.

    That is in shares of the limits.
    """
    pinned, s = np.flatnonzero(rows.fixed[kept]), rows.parameter[kept]
    line = np.append(np.repeat(np.arange(len(kept) - 1), np.diff(kept)), len(kept) - 2)  # of each row
    length = np.diff(s)
    share = (rows.parameter - s[line]) / np.where(length > 0.0, length, 1.0)[line]
    data = np.hstack((rows.tip, rows.words))
    best, least, found = data[kept], np.full(len(pinned) - 1, np.inf), np.zeros(len(kept) - 1)
    gaps = np.diff(rows.parameter, prepend=rows.parameter[0], append=rows.parameter[-1])
    weight = (gaps[1:] + gaps[:-1]) / np.sqrt(np.maximum(share * (1.0 - share), _NEXT))
    for _ in range(_WEIGHTS):
        weight *= len(weight) / weight.sum()
        at = _fitted(data, kept, line, share, weight, pinned)
        off = _off(rows, limits, at, line, share)
        of_lines = np.maximum.reduceat(off[:-1], kept[:-1])
        worst = np.maximum.reduceat(of_lines, pinned[:-1])  # of lines between two ends that stay
        better = np.repeat(worst < least, np.diff(pinned))
        least = np.minimum(worst, least)
        found[better] = of_lines[better]
        inner = np.append(better, False)
        best[inner] = at[inner]
        weight *= np.maximum(off, _LEAST_WEIGHT)
    best[pinned] = data[kept[pinned]]
    return best, found


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
    stiff = np.full(len(kept), 1e-9 * bands[1].max())
    stiff[pinned] *= 1e18
    bands[1] += stiff
    wanted += stiff[:, None] * data[kept]
    from scipy.linalg import solveh_banded  # it loads longer than all else of a short run

    found: Floats = solveh_banded(bands, wanted, check_finite=False)
    return found


def _off(rows: Vertices, limits: LineLimits, ends: Floats, line: Ints, share: Floats) -> Floats:
    """(r,) share of the limits in use at rows, at their shares of lines."""
    place = ends[line] + share[:, None] * (ends[line + 1] - ends[line])
    tip = place[:, :3]
    axis_point = tip + limits.axis_length * limits.axis_of(place[:, 3:])
    off_tip, off_axis_point = norm(tip - rows.original_tip), norm(axis_point - rows.original_axis_point)
    return np.maximum(off_tip / limits.tip, off_axis_point / limits.axis_point)
