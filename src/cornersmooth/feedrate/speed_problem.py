"""Limits of speed profiles as rows of an optimisation problem, for many runs at once (see `interior_point`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from cornersmooth.model import Bools, Floats, Ints

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


class Signed(NamedTuple):
    """A limit whose terms may cancel: |level·z + slope·z′ + bend·z″/2| ≤ z^(−1/2), or ≤ 1 where `bend` is None.

    (n,) each; z and z′ are those of node k (`at` 0) or of node k + 1 (`at` 1).
    """

    at: int
    level: Floats
    slope: Floats
    bend: Floats | None

    def part(self, slots: slice | Bools) -> Signed:
        """A copy of some slots."""
        bend = None if self.bend is None else self.bend[slots].copy()
        return Signed(self.at, self.level[slots].copy(), self.slope[slots].copy(), bend)


#: arrays of `Batch` that have one value, or column, per slot
_PER_SLOT = (
    "near",
    "far",
    "slope",
    "bend",
    "node_cap",
    "cell_cap",
    "accel_level",
    "accel_slope",
    "jerk_level",
    "jerk_slope",
    "jerk_bend",
    "weight",
    "frozen",
)


@dataclass(frozen=True)
class Batch:
    """Independent runs solved together. A run of m cells has m + 2 slots, one per coefficient.

    Slot k of a run holds coefficient k, node k (between coefficients k and k+1; m + 1 of them) and cell k (coefficients
    k to k+2; m of them). Slots without node or cell hold inert rows.

    Parameters
    ----------
    near, far, slope : (n,) float64
        Node k: z = near·c[k] + far·c[k+1], z′ = slope·(c[k+1] − c[k]).
    bend : (3, n) float64
        Cell k: z″/2 = Σ bend[i]·c[k+i].
    node_cap, cell_cap : (n,) float64
        Bounds of z at node k and of coefficient k.
    accel_level, accel_slope : (n,) float64
        Node k: accel_level·z + accel_slope·|z′| ≤ 1.
    jerk_level, jerk_slope, jerk_bend : (n,) float64
        Cell k: jerk_level·z + jerk_slope·|z′| + jerk_bend·|z″/2| ≤ z^(−1/2).
    weight : (n,) float64
        The time is about Σ weight/√c.
    first, last : (r,) int64
        Slots of the first and last coefficient of each run.
    first_ratio, last_ratio : (r,) float64
        That coefficient over its neighbour where the run starts (ends) at rest; NaN where it does not.
    frozen : (n,) bool
        Coefficients that keep their value.
    signed : tuple of Signed
        More limits.
    """

    near: Floats
    far: Floats
    slope: Floats
    bend: Floats
    node_cap: Floats
    cell_cap: Floats
    accel_level: Floats
    accel_slope: Floats
    jerk_level: Floats
    jerk_slope: Floats
    jerk_bend: Floats
    weight: Floats
    first: Ints
    last: Ints
    first_ratio: Floats
    last_ratio: Floats
    frozen: Bools
    signed: tuple[Signed, ...] = ()

    def __len__(self) -> int:
        return len(self.near)

    def of(self, runs: Bools) -> Batch:
        """The problem of some runs, (r,) bool."""
        size = self.last - self.first + 1
        slots = np.repeat(runs, size)
        last = np.cumsum(size[runs]) - 1
        values = {name: getattr(self, name)[..., slots] for name in _PER_SLOT}
        return Batch(
            **values,
            first=last + 1 - size[runs],
            last=last,
            first_ratio=self.first_ratio[runs],
            last_ratio=self.last_ratio[runs],
            signed=tuple(limit.part(slots) for limit in self.signed),
        )

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """All limits."""
        one = np.ones(len(self))
        level = self.accel_level if self.accel_level.any() else None
        rows = [Row(0, one, None, None, self.node_cap), Row(2, one, None, None, self.cell_cap)]
        rows += [Row(0, level, sign * self.accel_slope, None, one) for sign in (1.0, -1.0)]
        bends = (self.jerk_bend, -self.jerk_bend)
        if self.jerk_level.any() or self.jerk_slope.any():
            slopes = (self.jerk_slope, -self.jerk_slope)
            rows += [Row(at, self.jerk_level, slope, bend, None) for at in (0, 1) for slope in slopes for bend in bends]
            rows.append(Row(3, self.jerk_level, None, bends[1], None))
        else:
            rows += [Row(at, None, None, bend, None) for at in (0, 1) for bend in bends]
            # where z″ < 0 the largest z in the cell may lie inside
            rows.append(Row(3, None, None, bends[1], None))
        for limit in self.signed:
            right = one if limit.bend is None else None
            for sign in (1.0, -1.0):
                bend = None if limit.bend is None else sign * limit.bend
                rows.append(Row(limit.at, sign * limit.level, sign * limit.slope, bend, right))
        return tuple(rows)

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
