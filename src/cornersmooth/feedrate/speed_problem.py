"""Limits of speed profiles as rows of an optimisation problem over cells, for many runs at once (`interior_point`).

Cells over the path coordinate are fine where the speed has to change quickly, and coarse where it does not.

Near a place that is passed with speed v the speed changes over lengths of about v·√(v/J), the way covered while the
jerk changes it by as much as itself. Cells start with a part of that length at every change of the speed limit and
grow in proportion to the distance from it, whatever the elements of the path are: a thousand short lines at one feed
are one long cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from typing import NamedTuple

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
    """Cells for the given runs (r,), ascending."""
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


#: last coefficients of a window that stay at the crawl: its last two nodes then neither accelerate nor brake
CRAWLING = 3
#: the bound of z in cells without one
FREE = 1e30
#: places of every cell, over its length, that are looked at; rows keep the limits at every other one
PLACES = np.array((0.0, 0.25, 0.5, 0.75, 1.0))
#: the profile that the iteration starts from, over what the limits let a constant one be
START = 0.5


class Rows(NamedTuple):
    """R limits in every cell: |left·c| ≤ z^(−1/2) with z = right·c + `one`, over the coefficients at and beside it."""

    left: Floats  #: (3, R, n)
    right: Floats  #: (3, n): zero where `one` is 1, so that the limit is |left·c| ≤ 1
    one: float

    def of(self, cells: Ints, free: Bools) -> Rows:
        """Those of some cells, some of them free of limits."""
        left, right = (np.take(part, cells, axis=-1) for part in (self.left, self.right))  # contiguous along cells
        left[..., free] = 0.0
        right[:, free] = (1.0 - self.one) * _OWN
        return Rows(left, right, self.one)

    def values(self, around: Floats) -> tuple[Floats, Floats]:
        """Left sides (R, n), and right·c (n,), for coefficients (3, n) before, of and after each cell."""
        return np.einsum("irn,in->rn", self.left, around), np.einsum("in,in->n", self.right, around)


#: weights of the coefficient of a cell itself
_OWN = np.array(((0.0,), (1.0,), (0.0,)))


@dataclass(frozen=True)
class Batch:
    """Independent runs solved together, one Bézier coefficient c of z = v² for each cell of the grid.

    Cells at the ends of a run are driven with constant jerk; their coefficients are z where they meet the next cell.
    """

    #: (3, 3, n): z and z′ at the start of each cell and z″/2 in it, over the coefficients before, of and after it
    forms: Floats
    weight: Floats  #: (n,): the time is about Σ weight/√c
    steepest: Floats  #: (2, n): |z′| and |z″|/2 over their limits
    #: (r,): first and last cell of each run
    first: Ints
    last: Ints
    #: (r,): That coefficient over its neighbour where the run starts (ends) at rest; NaN where it does not.
    first_ratio: Floats
    last_ratio: Floats
    frozen: Bools  #: (n,): coefficients that keep their value
    rows: tuple[Rows, ...]

    def __len__(self) -> int:
        return len(self.weight)

    def stretches(self, first: Ints, last: Ints) -> tuple[Ints, Batch]:
        """Cells of some stretches of runs, (s,) first and last of each, and the batch of these alone.

        Where a stretch cuts a run its coefficients are frozen at the cut.
        """
        size = last - first + 1
        after = np.cumsum(size)
        begin, end = after - size, after - 1
        cells = np.repeat(first - begin, size) + np.arange(after[-1])
        own = np.searchsorted(self.first, first, side="right") - 1
        front, back = first > self.first[own], last < self.last[own]
        cut, frozen = np.zeros(len(cells), np.bool_), self.frozen[cells]
        cut[begin[front]] = cut[end[back]] = True
        frozen[begin[front, None] + np.arange(2)] = frozen[end[back, None] - np.arange(CRAWLING)] = True
        part = Batch(
            forms=np.take(self.forms, cells, axis=-1),
            weight=self.weight[cells],
            steepest=np.take(self.steepest, cells, axis=-1),
            first=begin,
            last=end,
            first_ratio=np.where(front, np.nan, self.first_ratio[own]),
            last_ratio=np.where(back, np.nan, self.last_ratio[own]),
            frozen=frozen,
            rows=tuple(rows.of(cells, cut) for rows in self.rows),
        )
        return cells, part

    @cached_property
    def ends(self) -> list[int]:
        """Number of limits up to the end of each of `rows`."""
        return list(accumulate(rows.left.shape[1] for rows in self.rows))

    def of_limits(self) -> Floats:
        """Room (2, R, n) for one number for each side of each limit."""
        return np.empty((2, self.ends[-1], len(self)))

    def by_rows(self, of_limits: Floats) -> list[Floats]:
        """Views of such numbers that belong to each of `rows`."""
        return [of_limits[:, end - rows.left.shape[1] : end] for rows, end in zip(self.rows, self.ends, strict=True)]

    def slacks(self, c: Floats) -> tuple[Floats, list[Floats]]:
        """(2, R, n) distances of all limits to both sides, and z (n,) of the right sides of each of `rows`."""
        near, slack, places = around(c), self.of_limits(), []
        for rows, into in zip(self.rows, self.by_rows(slack), strict=True):
            left, z = rows.values(near)
            places.append(z + rows.one)
            right = 1.0 / np.sqrt(places[-1])
            np.subtract(right, left, out=into[0])
            np.add(right, left, out=into[1])
        return slack, places

    def tightened(self, factor: Floats) -> Batch:
        """The same with all limits but those of speed over `factor` (n,)."""
        rows = (rows._replace(left=factor * rows.left) for rows in self.rows[1:])
        return replace(self, rows=(self.rows[0], *rows))

    def start(self) -> Floats:
        """Coefficients of profiles that keep every limit with room to spare: constant but for the ends of runs."""
        c = np.ones(len(self))
        self.follow(c)
        slowest = START / np.maximum.reduceat(self.use(c), self.first)
        return c * np.repeat(slowest, self.last - self.first + 1)

    def use(self, c: Floats) -> Floats:
        """(n,) how many times too large coefficients are for the limits of each cell."""
        use = np.full(len(self), 1e-300)
        for rows in self.rows:
            left, z = rows.values(around(c))
            # left sides grow with z, the right side of jerk limits falls with its root
            power = 1.0 if rows.one else 2.0 / 3.0
            np.maximum(use, (np.abs(left).max(axis=0) * np.sqrt(z + rows.one)) ** power, out=use)
        return use

    def follow(self, c: Floats) -> None:
        """Set the end coefficients of the runs from their neighbours."""
        for end, ratio, inward in ((self.first, self.first_ratio, 1), (self.last, self.last_ratio, -1)):
            at_rest = ~np.isnan(ratio)
            c[end[at_rest]] = ratio[at_rest] * c[end[at_rest] + inward]


def problem_of(grid: Grid, derivatives: Floats, bounds: Floats) -> Batch:
    """The optimisation problem of all runs of a grid.

    From the first three derivatives (3, d, n, 5) of d quantities at `PLACES` of each cell, and their limits (3, d, n)
    of speed, acceleration and jerk.
    """
    n, first, last = len(grid.start), grid.first, grid.last
    end = np.zeros(n, np.bool_)
    end[first] = end[last] = True
    inner = np.where(end, 0.0, grid.width)
    both = behind(inner) + inner
    node = np.ones(n, np.bool_)  # at the start of each cell
    node[first] = False
    safe, nothing = np.where(node, both, 1.0), np.zeros(n)
    level = np.where(node, np.stack((inner / safe, behind(inner) / safe, nothing)), 0.0)
    rise = np.where(node, 2.0 / safe, 0.0)
    slope = np.stack((-rise, rise, nothing))
    rise_after = np.append(rise[1:], 0.0)
    bend = np.stack((rise, -rise - rise_after, rise_after)) / (2.0 * np.where(end, 1.0, grid.width))
    bend[:, end] = 0.0

    # of the way itself and of the quantities, over the limits of acceleration and jerk
    own = np.zeros((3, 1, n, len(PLACES)))
    own[0] = 1.0
    one, two, three = np.concatenate((own, derivatives), axis=1)
    accel = 1.0 / np.concatenate((grid.accel[None], bounds[1]))[..., None]
    jerk = 1.0 / np.concatenate((grid.jerk[None], bounds[2]))[..., None]
    steepest = np.stack([np.abs(part * one).max(axis=(0, 2)) for part in (0.5 * accel, jerk)])
    none, linear, curved = np.zeros((3, n)), [], []
    for place in range(0, len(PLACES), 2):
        q1, q2, q3, x = one[..., place], two[..., place], three[..., place], PLACES[place] * grid.width
        z, steep = level + x * (slope + x * bend), slope + 2.0 * x * bend
        first_order, second, third = ((forms[:, None] * (1.0 - end)) for forms in (z, steep, bend))
        accels = accel[..., 0] * (q2 * first_order + 0.5 * q1 * second)
        jerks = jerk[..., 0] * (q3 * first_order + 1.5 * q2 * second + q1 * third)
        # of the way itself the ends of cells are enough, and of its z′ one of them, which is the start of the next
        linear.append(accels[:, 0 if place == len(PLACES) - 1 else 1 :])
        curved.append(Rows(jerks[:, 1 if 0 < place < len(PLACES) - 1 else 0 :], np.where(end, _OWN, z), 0.0))
    # inside a cell z is nowhere larger than at its ends and its coefficient
    coefficient = np.tile(_OWN, n)
    curved.append(Rows(jerk[:1, :, 0] * bend[:, None], coefficient, 0.0))
    curved = [rows for rows in curved if rows.left.size]

    cap = np.where(node, np.minimum(grid.cap, behind(grid.cap)), FREE)
    caps = np.stack((level / cap, np.where(end, 0.0, coefficient / grid.cap)), axis=1)
    weight = inner / 3.0
    weight = weight + behind(inner) / 3.0 + np.append(inner[1:], 0.0) / 3.0
    weight[end] += 3.0 * grid.width[end]
    return Batch(
        forms=np.stack((level, slope, bend)),
        weight=weight,
        steepest=steepest,
        first=first,
        last=last,
        first_ratio=1.0 / (1.0 + 2.0 * grid.width[first + 1] / (3.0 * grid.width[first])),
        last_ratio=1.0 / (1.0 + 2.0 * grid.width[last - 1] / (3.0 * grid.width[last])),
        frozen=np.zeros(n, np.bool_),
        rows=(Rows(caps, none, 1.0), Rows(np.concatenate(linear, axis=1), none, 1.0), *curved),
    )


def around(c: Floats) -> Floats:
    """(3, n) the values before, of and after each cell; zero beside the ends."""
    return np.stack((behind(c), c, ahead(c)))


def ahead(values: Floats) -> Floats:
    """``values[k + 1]`` at k, zero at the last."""
    return np.append(values[1:], 0.0)


def behind(values: Floats) -> Floats:
    """``values[k - 1]`` at k, zero at the first."""
    return np.concatenate((np.zeros(1), values[:-1]))
