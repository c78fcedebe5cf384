"""Plans made faster where the terms of an axis' limit cancel: its acceleration q₂·z + q₁·z′/2 and its jerk.

The first plan keeps sums of amounts, which is on the safe side (`axis_limits`). Here limits are kept with their signs,
|q₃·z + 3/2·q₂·z′ + q₁·z″/2| ≤ J·z^(−1/2), at chosen places (an exchange method for semi-infinite programmes: Hettich
and Kortanek 1993): at both ends of each cell for the axes that come nearest to their limits in it, and wherever inside
a cell a plan was seen beyond a limit. Each round solves with these, measures all axes at all samples, and adds the
place of each cell that is farthest beyond; a few rounds do. What an axis uses between the places is left free of its
limit in the next round. A run that is still beyond in the end is slowed down as a whole, so every plan keeps every
limit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cornersmooth.feedrate.axis_limits import LimitCoefficients, parabola
from cornersmooth.feedrate.grid import Grid, cell_intervals
from cornersmooth.feedrate.interior_point import GAP
from cornersmooth.feedrate.lookahead import batch_of, run_of_cells, solve_runs
from cornersmooth.feedrate.speed_limits import SpeedLimits
from cornersmooth.feedrate.speed_problem import Batch, Signed
from cornersmooth.model import Bools, Floats, Ints

#: axes that have their limits with signs in each cell, and rounds
AXES, ROUNDS = 2, 9

#: rounds whose plans are so far from the last that what they leave free is forgotten again
_TRIALS = 2

#: slots on either side of a limit that rounds do not mend, in which sums of amounts are kept
_BESIDE = 4

#: how much slower than the plan before the next one begins, so that it keeps its limits with room to spare
_SLOWER = 0.97

#: remaining duality gap over the time of plans that only show where limits are met
ROUGH = 1e-2

#: Newton steps of one round: most take 15 to 35; where terms are huge and cancel, hundreds gain next to nothing
_STEPS = 50

#: share of the limits of acceleration and jerk that is used: the rest is for what lies between samples
_USED = 0.997

#: share of a limit that is left to what the next plan is more than the one before
_ROOM = 2e-3

#: most that is left unused of a limit
_MOST = 0.9

#: part of an interval or a cell that places on its border are inside
_HAIR = 1e-9

#: times that a profile is slowed down until it can be begun with
_MOST_TRIES = 200


#: at the start and at the end of cells, what accelerations ask of z and z′, and jerks of z, z′ and z″/2, over the
#: limits: (d, n) each
Asked = tuple[tuple[tuple[Floats, ...], tuple[Floats, ...]], tuple[tuple[Floats, ...], tuple[Floats, ...]]]


class Worst(NamedTuple):
    """A jerk inside of each cell, by z, z′ and z″/2 of the node at its start, over its limit at that node.

    axis (n,) int64, rows (3, n) float64.
    """

    axis: Ints
    rows: Floats

    def seen(self, z: Floats, slope: Floats, bend: Floats) -> Floats:
        """(n,) share of the limit that is used."""
        level, steep, bent = self.rows
        found: Floats = np.sqrt(np.maximum(z, 0.0)) * np.abs(level * z + steep * slope + bent * bend)
        return found


@dataclass(frozen=True)
class _Places:
    """Where axes are looked at: samples of the intervals, and ends and middles of all cells; p places by their slots.

    Parameters
    ----------
    slot : (p,) int64
        Whose cell the place lies in; ascending.
    way : (p,) float64
        From the start of that cell.
    value : (3, d, p) float64
        Derivatives of the axes.
    bump : (3, d, p) float64
        By how much they may be larger between this place and the next.
    accel, jerk : (d,) float64
        Limits.
    """

    slot: Ints
    way: Floats
    value: Floats
    bump: Floats
    accel: Floats
    jerk: Floats

    @classmethod
    def of(cls, grid: Grid, coefficients: LimitCoefficients) -> _Places:
        """All of them in the cells that lie between two others."""
        samples, edge = coefficients.samples, coefficients.speed_limits.edge
        assert samples is not None
        width = np.diff(edge)
        shares = np.stack((np.zeros(len(width)), samples.middle, np.ones(len(width))), axis=1)
        # a hair inside, so that each belongs to the cell on its own side
        inside = np.clip(shares, _HAIR, 1.0 - _HAIR)
        at = (edge[:-1, None] + inside * width[:, None]).ravel()
        cell = np.searchsorted(grid.start, at, side="right") - 1
        second = np.abs(samples.value[..., 0] - 2.0 * samples.value[..., 1] + samples.value[..., 2]) / 8.0
        bump = np.repeat(samples.missed[..., None], 3, axis=-1)
        bump[..., 1] += second
        taken = np.flatnonzero((cell >= 0) & np.repeat(width > 0.0, 3))
        cell, at = cell[taken], at[taken]
        within = at < grid.start[cell] + grid.width[cell]
        taken, cell, at = taken[within], cell[within], at[within]
        flat = samples.value.reshape(*samples.value.shape[:2], -1)[..., taken]
        flat_bump = bump.reshape(*bump.shape[:2], -1)[..., taken]
        # the ends and middles of the cells, by the parabola through the three samples
        own = np.repeat(np.arange(len(grid.start)), 3)
        part = np.tile((_HAIR, 0.5, 1.0 - _HAIR), len(grid.start))
        here = grid.start[own] + part * grid.width[own]
        interval = np.clip(np.searchsorted(edge, here, side="right") - 1, 0, len(width) - 1)
        # the last may end a last digit behind an interval without any length
        share = np.clip((here - edge[interval]) / np.maximum(width[interval], 1e-300), 0.0, 1.0)
        value = samples.value[:, :, interval].astype(np.float64)
        factors = parabola(share, samples.middle[interval])
        between: Floats = np.zeros(value.shape[:-1])
        for number, factor in enumerate(factors):
            between += factor * value[..., number]
        slot = np.concatenate((cell, own)) - 1
        way = np.concatenate((at - grid.start[cell], here - grid.start[own]))
        order = np.lexsort((way, slot))
        order = order[slot[order] >= 0]
        return cls(
            slot[order],
            way[order],
            np.concatenate((flat.astype(np.float64), between), axis=2)[..., order],
            np.concatenate((flat_bump, samples.missed[:, :, interval]), axis=2).astype(np.float64)[..., order],
            _USED * samples.accel,
            _USED * samples.jerk,
        )

    def uses(self, batch: Batch, c: Floats) -> tuple[list[Floats], Worst]:
        """(d, n) share of the limits that accelerations and jerks of every axis use in the cell of each slot.

        Second comes the place of each cell in which a jerk is largest.
        """
        z, slope, bend = batch.forms(c)
        s = self.slot
        steep = slope[s] + 2.0 * bend[s] * self.way
        here = np.maximum(z[s] + self.way * (slope[s] + bend[s] * self.way), 0.0)
        one, two, three = self.value
        first, second, third = self.bump
        accel = np.abs(two * here + one * (0.5 * steep)) + second * here + first * np.abs(0.5 * steep)
        jerk = np.abs(three * here + two * (1.5 * steep) + one * bend[s])
        jerk += third * here + second * np.abs(1.5 * steep) + first * np.abs(bend[s])
        begin = np.flatnonzero(np.diff(s, prepend=-1))
        found = []
        for values in (accel / self.accel[:, None], jerk * (np.sqrt(here) / self.jerk[:, None])):
            used = np.zeros((len(values), len(batch)))
            used[:, s[begin]] = np.maximum.reduceat(values, begin, axis=1)
            found.append(np.where(_inner_cells(batch), used, 0.0))
        return found, self._worst(values, begin, z, here, found[1])

    def _worst(self, jerks: Floats, begin: Ints, z: Floats, here: Floats, used: Floats) -> Worst:
        """Of each cell in which a jerk is beyond its limit the place where it is most so; nothing in the others."""
        most = jerks.max(axis=0)
        count = np.diff(np.append(begin, len(most)))
        hit = np.flatnonzero(most >= np.repeat(np.maximum.reduceat(most, begin), count))
        place = hit[np.searchsorted(hit, begin)]
        slot = self.slot[begin]
        wrong = used.max(axis=0)[slot] > 1.0
        place, slot = place[wrong], slot[wrong]
        axis = np.zeros(len(z), np.int64)
        axis[slot] = jerks[:, place].argmax(axis=0)
        rows = np.zeros((3, len(z)))
        if not len(slot):
            return Worst(axis, rows)
        scale = np.sqrt(here[place] / np.maximum(z[slot], 1e-300)) / self.jerk[axis[slot]]
        one, two, three = scale * self.value[:, axis[slot], place]
        x = self.way[place]
        rows[0, slot] = three
        rows[1, slot] = three * x + 1.5 * two
        rows[2, slot] = (three * x + 3.0 * two) * x + one
        return Worst(axis, rows)

    def rows(self, batch: Batch) -> Asked:
        """What is asked at the start and at the end of every cell."""
        begin = np.flatnonzero(np.diff(self.slot, prepend=-1))
        last = np.append(begin[1:], len(self.slot)) - 1
        where, inner = self.slot[begin], _inner_cells(batch)
        accel, jerk = 1.0 / self.accel[:, None], 1.0 / self.jerk[:, None]
        found = []
        for chosen in (begin, last):  # places of a cell are in order
            q = np.zeros((*self.value.shape[:2], len(batch)))
            q[..., where] = self.value[..., chosen]
            q = np.where(inner, q, 0.0)
            found.append(((accel * q[1], 0.5 * accel * q[0]), (jerk * q[2], 1.5 * jerk * q[1], jerk * q[0])))
        return found[0], found[1]


def _inner_cells(batch: Batch) -> Bools:
    """(n,) bool: slots with a cell between two others."""
    node = batch.slope > 0.0
    inner: Bools = node & np.append(node[1:], False)
    return inner


@dataclass(frozen=True)
class Given:
    """What the runs that are planned have to keep.

    Parameters
    ----------
    speed_limits : SpeedLimits
        Of the path.
    coefficients : LimitCoefficients or None
    runs : (r,) int64
        As for `make_grid`.
    accel, jerk : (r,) float64
        Of the path in each run.
    """

    speed_limits: SpeedLimits
    coefficients: LimitCoefficients | None
    runs: Ints
    accel: Floats
    jerk: Floats

    def problem(self, grid: Grid) -> Batch:
        """The problem that keeps sums of amounts."""
        of_cell = run_of_cells(grid)
        rows = None if self.coefficients is None else self._largest(self.coefficients, grid)
        return batch_of(grid, self.accel[of_cell], self.jerk[of_cell], rows)

    def problem_of_others(self, grid: Grid) -> Batch:
        """The problem without accelerations and jerks of the machine's axes."""
        of_cell, others = run_of_cells(grid), self._known.others
        assert others is not None
        free = replace(grid, cap=np.minimum(self._cap(self.speed_limits, grid), self._cap(others.speed_limits, grid)))
        return batch_of(free, self.accel[of_cell], self.jerk[of_cell], self._largest(others, grid))

    def unknown(self, grid: Grid) -> Bools:
        """(n,) bool: slots whose cell meets an interval in which derivatives are not finite."""
        samples, limits = self._known.samples, self._known.speed_limits
        assert samples is not None
        met = cell_intervals(limits, grid, self.runs)
        found = np.maximum.reduceat(np.append(~samples.known, False), met)[::2]
        return np.append(found[1:], False)

    @property
    def _known(self) -> LimitCoefficients:
        assert self.coefficients is not None
        return self.coefficients

    def _cap(self, limits: SpeedLimits, grid: Grid) -> Floats:
        least: Floats = np.minimum.reduceat(np.append(limits.cap, np.inf), cell_intervals(limits, grid, self.runs))[::2]
        return least

    def _largest(self, coefficients: LimitCoefficients, grid: Grid) -> Floats:
        rows = np.concatenate((coefficients.rows, np.zeros((5, 1))), axis=1)
        met = cell_intervals(coefficients.speed_limits, grid, self.runs)
        largest: Floats = np.maximum.reduceat(rows, met, axis=1)[:, ::2]
        return largest


def faster(given: Given, grid: Grid, batch: Batch, best: Floats) -> Floats:
    """Faster profiles than those that keep sums of amounts.

    Parameters
    ----------
    given : Given
        With `coefficients` that have samples of a machine's axes.
    grid : Grid
    batch : Batch
        The problem with sums of amounts.
    best : (n,) float64
        Strictly feasible coefficients of it.

    Returns
    -------
    (n,) float64
        Coefficients that keep every limit; none of the runs is slower.
    """
    assert given.coefficients is not None
    places, bare = _Places.of(grid, given.coefficients), given.problem_of_others(grid)
    for at in (batch.first, batch.last - 1):  # next to the stops sums of amounts are kept
        for name in ("node_cap", "accel_level", "accel_slope"):
            getattr(bare, name)[at] = getattr(batch, name)[at]
    asked = places.rows(bare)
    run = np.repeat(np.arange(len(batch.first)), batch.last - batch.first + 1)
    summed, going = given.unknown(grid), np.ones(len(batch.first), np.bool_)
    slower, stuck = np.zeros(len(batch.first)), np.zeros(len(batch.first), np.bool_)
    inside: list[Worst] = []
    c, taken, highest = best.copy(), *([np.zeros_like(part[0]) for part in asked[0]] for _ in range(2))
    held = [np.zeros(part[0].shape, np.bool_) for part in asked[0]]
    for number in range(ROUNDS):
        uses, worst = places.uses(bare, c)
        if worst.rows.any():
            inside.append(worst)
        for own, high, asks, used, seen in zip(taken, highest, held, uses, _seen(bare, c, asked, inside), strict=True):
            now = np.maximum(used - seen, 0.0) / np.maximum(used, 1.0) + _ROOM
            own[:] = now if number < _TRIALS else np.maximum(own, now)
            if number:
                beyond = asks & (used > 1.0)
                own += np.where(beyond, used - 1.0 + _ROOM, 0.0)
                summed |= (beyond & (own > _MOST)).any(axis=0)  # signs do not help there
                # where nothing is gained, what is mended in one cell comes up again in the next
                summed |= _near((used > 1.0 + _ROOM).any(axis=0) & stuck[run])
            np.maximum(high, used, out=high)
            asks[:] = False
            np.put_along_axis(asks, np.argpartition(-high, AXES - 1, axis=0)[:AXES], True, axis=0)
        problem = replace(_summed(bare, batch, summed), signed=_signed(asked, held, taken, summed, inside))
        start, gap = _within(problem, best, run), GAP if number else ROUGH
        c[going[run]] = solve_runs(problem.of(going), grid.of(going), start=start[going[run]], gap=gap, most=_STEPS)
        # sums of amounts keep limits by themselves, with less room for what lies between samples than is measured here
        found = _slower([np.where(summed, 0.0, used) for used in places.uses(bare, c)[0]], batch)
        slower, stuck = found, stuck | (found <= slower + _ROOM)
        kept = c * slower[run]
        time, before = (np.bincount(run, batch.weight / np.sqrt(values)) for values in (kept, best))
        best = np.where((time < before)[run], kept, best)
        going &= slower <= 1.0 - _ROOM
        if not going.any():
            break
    return best


def _seen(batch: Batch, c: Floats, asked: Asked, inside: list[Worst]) -> list[Floats]:
    """(d, n) what accelerations and jerks use at the ends of each cell, over the limits."""
    z, slope, bend = batch.forms(c)
    found = []
    for ((level, steep), (cube, cross, bent)), here, rise in zip(
        asked, (z, _next(z)), (slope, _next(slope)), strict=True
    ):
        root = np.sqrt(np.maximum(here, 0.0))
        found.append((np.abs(level * here + steep * rise), root * np.abs(cube * here + cross * rise + bent * bend)))
    (accel, jerk), (other_accel, other_jerk) = found
    jerk = np.maximum(jerk, other_jerk)
    for worst in inside:
        place = worst.axis, np.arange(len(z))
        jerk[place] = np.maximum(jerk[place], worst.seen(z, slope, bend))
    return [np.maximum(accel, other_accel), jerk]


def _signed(
    asked: Asked, held: list[Bools], taken: list[Floats], summed: Bools, inside: list[Worst]
) -> tuple[Signed, ...]:
    """Limits of the axes that come nearest to theirs in each slot, but where sums of amounts are kept."""
    found = []
    slot = np.arange(len(summed))
    for kind, (chosen, own) in enumerate(zip(held, taken, strict=True)):
        for axis in np.nonzero(chosen.T)[1].reshape(-1, AXES).T:
            share = np.where(summed, 0.0, 1.0 / (1.0 - np.minimum(own[axis, slot], _MOST)))
            for at, parts in enumerate(asked):
                level, slope, *bend = (share * part[axis, slot] for part in parts[kind])
                found.append(Signed(at, level, slope, bend[0] if bend else None))
    for worst in inside:
        own = taken[1][worst.axis, np.arange(len(summed))]
        share = np.where(summed, 0.0, 1.0 / (1.0 - np.minimum(own, _MOST)))
        found.append(Signed(0, *(share * worst.rows)))
    return tuple(found)


def _near(where: Bools) -> Bools:
    """Slots, and the `_BESIDE` next to them on either side."""
    total = np.concatenate(([0], np.cumsum(where)))
    at = np.arange(len(where))
    near: Bools = total[np.minimum(at + _BESIDE + 1, len(where))] > total[np.maximum(at - _BESIDE, 0)]
    return near


def _summed(bare: Batch, batch: Batch, where: Bools) -> Batch:
    """The problem with sums of amounts in some cells, which use the same share of their limits."""
    names = ("jerk_level", "jerk_slope", "jerk_bend")
    ends = where | np.concatenate(([False], where[:-1]))
    changed = {name: np.where(where, getattr(batch, name) / _USED, getattr(bare, name)) for name in names}
    for name in ("accel_level", "accel_slope"):
        changed[name] = np.where(ends, getattr(batch, name) / _USED, getattr(bare, name))
    return replace(bare, **changed)


def _slower(uses: list[Floats], batch: Batch) -> Floats:
    """(r,) factor of the squared speed of whole runs at which no axis is beyond its limits."""
    accel, jerk = uses
    most = np.maximum(accel.max(axis=0), np.cbrt(jerk.max(axis=0)) ** 2)
    slower: Floats = 1.0 / np.maximum(np.maximum.reduceat(most, batch.first), 1.0)
    return slower


def _within(batch: Batch, c: Floats, run: Ints) -> Floats:
    """Profiles that are slower than the given ones and keep all limits with room to spare."""
    slower = c * _SLOWER
    for _ in range(_MOST_TRIES):
        beyond = (batch.slacks(slower)[0] <= 0.0).any(axis=0)
        if not beyond.any():
            break
        hit = np.bincount(run, beyond) > 0
        slower = np.where(hit[run], _SLOWER * slower, slower)
    return slower


def _next(values: Floats) -> Floats:
    """Values (..., n) of the slot behind; the last sees itself."""
    return np.concatenate((values[..., 1:], values[..., -1:]), axis=-1)
