"""Cells over the path coordinate: fine where the speed has to change quickly, coarse where it does not.

Near a place that is passed with speed v the speed changes over lengths of about v·√(v/J), the way covered while the
jerk changes it by as much as itself. Cells start with a part of that length at every change of the speed limit and
grow in proportion to the distance from it, whatever the elements of the path are: a thousand short lines at one feed
are one long cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.feedrate.intervals import Intervals, Resolution
from cornersmooth.model import Bools, Floats, Ints

#: smallest size of a cell over the length of the path: smaller ones would be lost in the digits of the coordinate
SMALLEST = 1e-12
#: what a coordinate may be off by rounding, over the length of the path
_LAST_DIGITS = 16.0 * np.finfo(np.float64).eps


@dataclass(frozen=True)
class Grid:
    """Cells of some runs, in order."""

    start: Floats  #: (n,) mm
    width: Floats  #: (n,) mm
    cap: Floats  #: (n,): bound of v² over the whole cell
    #: (n,): limits along the path
    accel: Floats
    jerk: Floats
    first: Ints  #: (r,): first cell of each run

    @property
    def last(self) -> Ints:
        """(r,) last cell of each run."""
        return np.append(self.first[1:], len(self.start)) - 1

    @property
    def run(self) -> Ints:
        """(n,) number of the run that each cell belongs to."""
        return np.repeat(np.arange(len(self.first)), self.last - self.first + 1)

    def of(self, cells: Ints) -> Grid:
        """Some cells; which of them are the first of runs is not known."""
        return replace(self, start=self.start[cells], width=self.width[cells], cap=self.cap[cells])


def make_grid(limits: Intervals, runs: Ints, resolution: Resolution) -> Grid:
    """Cells for the given runs.

    Parameters
    ----------
    runs : (r,) int64
        Which runs, ascending.
    """
    begin, end = limits.edge[limits.run[runs]], limits.edge[limits.run[runs + 1]]
    accel, jerk = limits.accel[runs], limits.jerk[runs]
    # intervals of all runs, and the bound of the one before
    counts = limits.run[runs + 1] - limits.run[runs]
    run = np.repeat(np.arange(len(runs)), counts)
    leads = np.cumsum(counts) - counts
    interval = np.arange(len(run)) + (limits.run[runs] - leads)[run]
    low, cap = limits.edge[interval], limits.cap[interval]
    before = np.concatenate((cap[:1], cap[:-1]))
    before[leads] = cap[leads]
    half_speed = cap**0.75 / (6.0 * np.sqrt(jerk[run]))
    change = cap != before
    # a junction, which has no way, has the jerk of what is beside it
    agile = limits.agile[interval]
    agile = np.minimum(np.maximum(agile, np.concatenate((agile[:1], agile[:-1]))), jerk[run])

    # the cells next to the stops
    front, back = _end_cells(half_speed, run, low, change, begin, end, accel, jerk)
    if limits.aligned:
        front = np.minimum(front, limits.edge[limits.run[runs] + 1] - begin)
        back = np.minimum(back, end - limits.edge[limits.run[runs + 1] - 1])
    smallest = SMALLEST * limits.edge[-1]
    least = np.minimum(smallest, (end - begin) / 12.0)  # else a cell far along the path may have no length at all
    front, back = np.maximum(resolution.end * front, least), np.maximum(resolution.end * back, least)

    # knots where the size of the cells is given: where the limit changes, and next to the end cells
    slow = np.sqrt(np.minimum(cap, before))
    inside = np.ones(len(run), np.bool_) if limits.aligned else change
    size = np.where(change, resolution.part * slow**1.5 / np.sqrt(agile), np.inf)[inside]
    inner = np.clip(low, (begin + front)[run], (end - back)[run])[inside]
    knot = np.concatenate((begin + front, inner, end - back))
    size = np.concatenate((resolution.growth * front, size, resolution.growth * back))
    # in order along the path; the ends of a run enclose its changes
    rank = np.repeat([0, 1, 2], (len(runs), len(inner), len(runs)))
    run = np.concatenate((np.arange(len(runs)), run[inside], np.arange(len(runs))))
    order = np.lexsort((knot, rank, run))
    knot, size, run = knot[order], size[order], run[order]

    g = resolution.growth
    size = np.maximum(size, smallest)
    size = g * knot + np.minimum.accumulate(size - g * knot)
    size = -g * knot + np.minimum.accumulate((size + g * knot)[::-1])[::-1]
    left = np.flatnonzero((run[1:] == run[:-1]) & (np.diff(knot) > (smallest if limits.aligned else -1.0)))
    right = left + 1
    gap = knot[right] - knot[left]
    peak = 0.5 * (size[left] + size[right] + g * gap)
    up, down = (np.log(np.maximum(peak / size[side], 1.0)) / g for side in (left, right))
    # cells of one size, over the gaps that no cell lies across
    of_gap = np.arange(len(gap)) if limits.aligned else run[left]
    low_at, high_at = (np.searchsorted(of_gap, np.arange(of_gap[-1] + 1), side=side) for side in ("left", "right"))
    summed = np.concatenate(([0.0], np.cumsum(up + down)))
    amount, owner = summed[high_at] - summed[low_at], run[left[low_at]]
    share = amount / np.bincount(owner, amount)[owner]
    cells = np.ceil(np.maximum(amount, resolution.fewest * share)).astype(np.int64)

    # borders at equal parts of ∫ds/size, found in closed form between two knots
    of_border = np.repeat(np.arange(len(cells)), cells)
    number = np.arange(len(of_border)) - np.repeat(np.cumsum(cells) - cells, cells)
    target = summed[low_at][of_border] + amount[of_border] * number / cells[of_border]
    at = np.clip(np.searchsorted(summed, target, side="right") - 1, low_at[of_border], high_at[of_border] - 1)
    rest = target - summed[at]
    forth = size[left][at] * np.expm1(g * np.minimum(rest, up[at])) / g
    back_way = size[right][at] * np.expm1(g * np.clip(up[at] + down[at] - rest, 0.0, down[at])) / g
    border = np.where(rest <= up[at], knot[left][at] + forth, knot[right][at] - back_way)

    # two more cells per run, next to the stops
    count = np.bincount(owner, cells).astype(np.int64)
    after = np.cumsum(count)
    start = np.insert(border, np.append(after, after - count), np.append(end - back, begin))
    first = np.cumsum(count + 2) - (count + 2)
    stop = np.append(start[1:], 0.0)
    stop[first + count + 1] = end
    accel, jerk = (np.repeat(limit, count + 2) for limit in (accel, jerk))
    return _in_cells(limits, Grid(start, stop - start, np.full(len(start), np.inf), accel, jerk, first), runs)


def _in_cells(limits: Intervals, grid: Grid, runs: Ints) -> Grid:
    """Cells with the lowest limit of all intervals that each meets."""
    owner = runs[grid.run]
    begin, end, stop = limits.run[owner], limits.run[owner + 1], grid.start + grid.width
    # so that a junction on a border counts for both cells: by more than the last digits of the coordinate
    slack = np.minimum(1e-9 * grid.width + _LAST_DIGITS * limits.edge[-1], grid.width / 4.0)
    low = np.clip(np.searchsorted(limits.edge, grid.start - slack, side="right") - 1, begin, end - 1)
    high = np.clip(np.searchsorted(limits.edge, stop + slack, side="left"), low + 1, end)
    met = np.stack((low, high), axis=1).ravel()
    return replace(grid, cap=np.minimum.reduceat(np.append(limits.cap, np.inf), met)[::2])


def _end_cells(
    half_speed: Floats,
    run: Ints,
    low: Floats,
    change: Bools,
    begin: Floats,
    end: Floats,
    accel: Floats,
    jerk: Floats,
) -> tuple[Floats, Floats]:
    """Longest cells at the start and at the end of each run in which constant jerk loses no time.

    That is the way from rest until the acceleration limit is reached, or half of a speed limit (`half_speed`), or a
    quarter of the time of the fastest motion from rest to rest; a limit further on matters when it is low and near.
    """
    cells = []
    for distance in (low - begin[run], end[run] - low):
        cell = np.minimum(accel**3 / (6.0 * jerk**2), (end - begin) / 12.0)
        near = np.maximum(half_speed, distance / 12.0)
        np.minimum.at(cell, run[change], near[change])
        cells.append(cell)
    outermost = np.full((2, len(begin)), np.inf)
    at_begin = low <= begin[run]
    np.minimum.at(outermost[0], run[at_begin], half_speed[at_begin])
    last = np.append(run[1:] != run[:-1], True)
    np.minimum.at(outermost[1], run[last], half_speed[last])
    return np.minimum(cells[0], outermost[0]), np.minimum(cells[1], outermost[1])
