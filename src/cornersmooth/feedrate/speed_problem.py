"""Limits of speed profiles as rows of an optimisation problem, for many runs at once (see `interior_point`)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from cornersmooth.feedrate.grid import Grid
from cornersmooth.model import Bools, Floats, Ints

#: last coefficients of a window that stay at the crawl: its last two nodes then neither accelerate nor brake
CRAWLING = 3
#: the right side of a limit in slots without a cell
FREE = 1e30
#: the profile that the iteration starts from, over what the limits let a constant one be at each place
START = 0.5
#: most that the logarithm of this profile changes from slot to slot: cells are as long as changes of speed need
RATE = 0.08
#: by what the logarithm is lowered where the profile is beyond a limit, how often, and after how often `RATE` halves
LOWER, LOWERINGS, FLATTER = 0.5, 40, 10


class Row(NamedTuple):
    """One limit in every slot: z·`level` + z′·`slope` + z″/2·`bend` ≤ `right`, or ≤ z^(−1/2) where `right` is None.

    z and z′ are those of node k (`at` 0), of node k + 1 (`at` 1), or z is coefficient k (`at` 2) or k + 1 (`at` 3).
    """

    at: int
    level: Floats | None
    slope: Floats | None
    bend: Floats | None
    right: Floats | None

    def of(self, slots: slice | Bools) -> Row:
        """A copy of some slots."""
        parts = (self.level, self.slope, self.bend, self.right)
        level, slope, bend, right = (None if part is None else part[slots].copy() for part in parts)
        return Row(self.at, level, slope, bend, right)

    def free(self, slots: slice) -> None:
        """Take the limit away from some slots."""
        for part in (self.level, self.slope, self.bend):
            if part is not None:
                part[slots] = 0.0


def both_signs(at: int, level: Floats | None, slope: Floats, bend: Floats | None, right: Floats | None) -> list[Row]:
    """A limit of an amount: |level·z + slope·z′ + bend·z″/2| ≤ `right`, or z^(−1/2)."""
    minus = (None if level is None else -level), -slope, (None if bend is None else -bend)
    return [Row(at, level, slope, bend, right), Row(at, *minus, right)]


@dataclass(frozen=True)
class Batch:
    """Independent runs solved together. A run of m cells has m + 2 slots, one per coefficient.

    Slot k of a run holds coefficient k, node k (between coefficients k and k+1; m + 1 of them) and cell k (coefficients
    k to k+2; m of them). Slots without node or cell hold inert rows.
    """

    #: (n,): node k: z = near·c[k] + far·c[k+1], z′ = slope·(c[k+1] − c[k])
    near: Floats
    far: Floats
    slope: Floats
    bend: Floats  #: (3, n): cell k: z″/2 = Σ bend[i]·c[k+i]
    weight: Floats  #: (n,): the time is about Σ weight/√c
    #: (r,): slots of the first and last coefficient of each run
    first: Ints
    last: Ints
    #: (r,): That coefficient over its neighbour where the run starts (ends) at rest; NaN where it does not.
    first_ratio: Floats
    last_ratio: Floats
    frozen: Bools  #: (n,): coefficients that keep their value
    rows: tuple[Row, ...]  #: all limits

    def __len__(self) -> int:
        return len(self.near)

    def slots(self, chosen: slice | Bools, runs: Bools | Ints) -> Batch:
        """Some slots on their own; `runs` (r,) are those that lie in them."""
        size = (self.last - self.first + 1)[runs]
        last = np.cumsum(size) - 1
        return Batch(
            near=self.near[chosen].copy(),
            far=self.far[chosen].copy(),
            slope=self.slope[chosen].copy(),
            bend=self.bend[:, chosen].copy(),
            weight=self.weight[chosen],
            first=last + 1 - size,
            last=last,
            first_ratio=self.first_ratio[runs],
            last_ratio=self.last_ratio[runs],
            frozen=self.frozen[chosen].copy(),
            rows=tuple(row.of(chosen) for row in self.rows),
        )

    def of(self, runs: Bools) -> Batch:
        """The problem of some runs, (r,) bool."""
        return self.slots(np.repeat(runs, self.last - self.first + 1), runs)

    def window(self, begin: int, end: int) -> Batch:
        """Slots `begin` to `end`; where a run is cut its coefficients are frozen at the cut."""
        whole = (self.first >= begin) & (self.last < end)
        if whole.any():
            return self.slots(slice(begin, end), whole)
        run = np.searchsorted(self.first, [begin], side="right") - 1
        cut_front, cut_back = begin > self.first[run], end <= self.last[run]
        part = replace(
            self.slots(slice(begin, end), run),
            first=np.array([0]),
            last=np.array([end - begin - 1]),
            first_ratio=np.where(cut_front, np.nan, self.first_ratio[run]),
            last_ratio=np.where(cut_back, np.nan, self.last_ratio[run]),
        )
        if cut_front[0]:
            part.frozen[:2] = True
        if cut_back[0]:
            part.frozen[-CRAWLING:] = True
            part.near[-1] = part.far[-1] = part.slope[-1] = 0.0
            part.bend[:, -2:] = 0.0
            for row in part.rows:
                if row.bend is not None or row.at == 1:
                    row.free(slice(-2, None))
                elif row.at == 0:
                    row.free(slice(-1, None))
        return part

    @cached_property
    def idle(self) -> Floats:
        """One in slots without node."""
        return np.where(self.slope > 0.0, 0.0, 1.0)

    def forms(self, c: Floats) -> tuple[Floats, Floats, Floats]:
        """Values z and z′ at the nodes and z″/2 in the cells; zero in slots without."""
        after = ahead(c)
        z = self.near * c + self.far * after
        slope = self.slope * (after - c)
        bend = self.bend[0] * c + self.bend[1] * after + self.bend[2] * ahead(after)
        return z, slope, bend

    def seen_by_rows(self, c: Floats, idle: float) -> tuple[list[Floats], list[Floats], Floats]:
        """Arrays z and z′ as rows see them, by `Row.at`, and z″/2; `idle` is the z of slots without node."""
        z, slope, bend = self.forms(c)
        z = z + idle * self.idle
        return [z, ahead(z), c, ahead(c)], [slope, ahead(slope)], bend

    def slacks(self, c: Floats) -> tuple[Floats, list[Floats]]:
        """(rows, n) distances to the limits, and z by `Row.at`."""
        z, slope, bend = self.seen_by_rows(c, 1.0)
        root = [1.0 / np.sqrt(values) for values in z]
        slack = np.empty((len(self.rows), len(c)))
        for row, into in zip(self.rows, slack, strict=True):
            np.subtract(root[row.at] if row.right is None else row.right, left_side(row, z, slope, bend), out=into)
        return slack, z

    def start(self) -> Floats:
        """Coefficients of profiles that keep every limit with room to spare: slow only near what slows them down."""
        c = np.ones(len(self))
        self.follow(c)
        z, slope, bend = self.seen_by_rows(c, 1.0)
        use = np.zeros(len(self))
        for row in self.rows:
            left = np.maximum(left_side(row, z, slope, bend), 0.0)
            # left sides grow with z, the right side of jerk limits falls with its root
            used = np.cbrt(left * np.sqrt(z[row.at])) ** 2 if row.right is None else left / row.right
            np.maximum(use, used, out=use)
        run = np.repeat(np.arange(len(self.first)), self.last - self.first + 1)
        profile: Floats = c * (START / np.maximum.reduceat(use, self.first))[run]  # constant, but for the ends
        height = np.log(START / np.maximum(use, 1e-300))
        left_over = np.ones(len(self.first), np.bool_)
        for number in range(LOWERINGS):
            way = RATE * 0.5 ** (number // FLATTER) * np.arange(len(self))
            height = np.minimum.accumulate(height - way) + way
            height = np.minimum.accumulate((height + way)[::-1])[::-1] - way
            trial = np.exp(height)
            self.follow(trial)
            within = (self.slacks(trial)[0] > 0.0).all(axis=0)
            found = left_over & np.minimum.reduceat(within, self.first)
            profile = np.where(found[run], trial, profile)
            left_over &= ~found
            if not left_over.any():
                break
            height = np.where(within, height, height - LOWER)
        return profile

    def follow(self, c: Floats) -> None:
        """Set the end coefficients of the runs from their neighbours."""
        at_rest = ~np.isnan(self.first_ratio)
        c[self.first[at_rest]] = self.first_ratio[at_rest] * c[self.first[at_rest] + 1]
        at_rest = ~np.isnan(self.last_ratio)
        c[self.last[at_rest]] = self.last_ratio[at_rest] * c[self.last[at_rest] - 1]


def problem_of(grid: Grid) -> Batch:
    """The optimisation problem of all runs of a grid, by amounts.

    The cells of a run are its slots: the first and the last, next to the stops, are driven with constant jerk.
    """
    n, use = len(grid.start), grid.rows
    first, last = grid.first, grid.last
    inner = grid.width.copy()
    inner[first] = 0.0
    inner[last] = 0.0
    following = np.append(inner[1:], 0.0)
    both = inner + following
    node = np.ones(n, np.bool_)
    node[last] = False
    safe = np.where(node, both, 1.0)
    near, far = np.where(node, following / safe, 0.0), np.where(node, inner / safe, 0.0)
    slope = np.where(node, 2.0 / safe, 0.0)

    cell = node.copy()
    cell[last - 1] = False
    width = np.where(cell, np.append(grid.width[1:], 1.0), 1.0)
    slope_after = np.append(slope[1:], 0.0)
    bend = np.where(cell, np.stack((slope, -slope - slope_after, slope_after)) / (2.0 * width), 0.0)

    at_node = np.maximum(use[:2], np.concatenate((use[:2, 1:], use[:2, -1:]), axis=1))
    in_cell = np.where(cell, np.concatenate((use[2:, 1:], use[2:, -1:]), axis=1), 0.0)
    in_cell[0] = np.where(cell, in_cell[0], use[2])

    node_cap = np.where(node, np.minimum(grid.cap, np.append(grid.cap[1:], np.inf)), FREE)
    for end, at in ((first, first), (last, last - 1)):
        e = grid.width[end]
        with_unit_speed = use[2, end] * (2.0 / 9.0) / e**2 + use[3, end] * (4.0 / 3.0) / e + use[4, end]
        with np.errstate(divide="ignore"):  # where nothing is asked for, nothing is limited
            node_cap[at] = np.minimum(node_cap[at], np.cbrt(with_unit_speed) ** -2)
    cell_cap = grid.cap.copy()
    cell_cap[first] = FREE
    cell_cap[last] = FREE

    weight = inner / 3.0
    weight[:-1] += inner[1:] / 3.0
    weight[1:] += inner[:-1] / 3.0
    weight[first] += 3.0 * grid.width[first]
    weight[last] += 3.0 * grid.width[last]
    return Batch(
        near=near,
        far=far,
        slope=slope,
        bend=bend,
        weight=weight,
        first=first,
        last=last,
        first_ratio=1.0 / (1.0 + 2.0 * grid.width[first + 1] / (3.0 * grid.width[first])),
        last_ratio=1.0 / (1.0 + 2.0 * grid.width[last - 1] / (3.0 * grid.width[last])),
        frozen=np.zeros(n, np.bool_),
        rows=_rows(node_cap, cell_cap, at_node[0], np.where(node, at_node[1], 0.0), in_cell),
    )


def _rows(node_cap: Floats, cell_cap: Floats, slope: Floats, level: Floats, jerk: Floats) -> tuple[Row, ...]:
    """Limits of amounts: of z at nodes and in cells, of accelerations at nodes, of jerks (3, n) in cells."""
    one = np.ones(len(slope))
    rows = [Row(0, one, None, None, node_cap), Row(2, one, None, None, cell_cap)]
    power = level if level.any() else None
    rows += [Row(0, power, sign * slope, None, one) for sign in (1.0, -1.0)]
    bend, cross, cube = jerk
    several = bool(cube.any() or cross.any())
    slopes = (cross, -cross) if several else (None,)
    power = cube if several else None
    rows += [Row(at, power, steep, sign * bend, None) for at in (0, 1) for steep in slopes for sign in (1.0, -1.0)]
    # where z″ < 0 the largest z in the cell may lie inside
    return (*rows, Row(3, power, None, -bend, None))


def left_side(row: Row, z: list[Floats], slope: list[Floats], bend: Floats) -> Floats:
    """Left side of a limit."""
    terms = []
    if row.level is not None:
        terms.append(row.level * z[row.at])
    if row.slope is not None:
        terms.append(row.slope * slope[row.at])
    if row.bend is not None:
        terms.append(row.bend * bend)
    left: Floats = sum(terms[1:], start=terms[0])
    return left


def weight_of_z(row: Row, bites: list[Floats]) -> Floats:
    """Derivative of left minus right side by z."""
    if row.right is not None:
        return np.zeros_like(bites[0]) if row.level is None else row.level
    return bites[row.at] if row.level is None else row.level + bites[row.at]


def ahead(values: Floats) -> Floats:
    """``values[k + 1]`` at slot k; the last slot, which is inert, sees itself."""
    shifted = np.empty_like(values)
    shifted[:-1] = values[1:]
    shifted[-1] = values[-1]
    return shifted


def behind(values: Floats) -> Floats:
    """``values[k - 1]`` at slot k, zero at the first."""
    shifted = np.empty_like(values)
    shifted[0] = 0.0
    shifted[1:] = values[:-1]
    return shifted
