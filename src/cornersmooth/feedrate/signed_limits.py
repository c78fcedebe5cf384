"""Plans made faster where the terms of an axis' limit cancel: its acceleration q₂·z + q₁·z′/2 and its jerk.

The first plan keeps sums of amounts, which is on the safe side (`intervals`). Here limits are kept with their signs,
|q₃·z + 3/2·q₂·z′ + q₁·z″/2| ≤ J·z^(−1/2), at chosen places (an exchange method for semi-infinite programmes: Hettich
and Kortanek 1993): at both ends of each cell for the axes that come nearest to their limits in it, and wherever inside
a cell a plan was seen beyond a limit. Each round solves with these, measures all axes at all samples, and adds the
place of each cell that is farthest beyond; a few rounds do. What an axis uses between the places is left free of its
limit in the next round. A plan that is beyond a limit is slowed down run by run before it counts, so every plan that is
taken keeps every limit. Where derivatives are not known, and next to the stops, sums of amounts are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

from cornersmooth.feedrate.grid import Grid, cell_intervals
from cornersmooth.feedrate.interior_point import GAP
from cornersmooth.feedrate.intervals import PathLimits, parabola
from cornersmooth.feedrate.speed_problem import Batch, Row, both_signs, problem_of
from cornersmooth.feedrate.windows import solve_runs
from cornersmooth.model import Bools, Floats, Ints

#: axes that have their limits with signs in each cell, and rounds
AXES, ROUNDS = 2, 9

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


class _Signed(NamedTuple):
    """|level·z + slope·z′ + bend·z″/2| of d axes at node k (`at` 0) or k + 1, over the limits there, (d, n) each.

    Jerks, or accelerations where `bend` is None; of the axes `axis` (d, n) where these are not all in order.
    """

    at: int
    level: Floats
    slope: Floats
    bend: Floats | None
    axis: Ints | None = None

    def use(self, seen: tuple[list[Floats], list[Floats], Floats], most: Floats) -> None:
        """Raise shares of the limits (all axes, n) to those that are used here."""
        z, slope, bend = seen[0][self.at], seen[1][self.at], seen[2]
        used = self.level * z + self.slope * slope
        if self.bend is not None:
            used = np.sqrt(np.maximum(z, 0.0)) * (used + self.bend * bend)
        place = slice(None) if self.axis is None else (self.axis, np.arange(len(z)))
        most[place] = np.maximum(most[place], np.abs(used))

    def rows(self, axis: Ints, share: Floats) -> list[Row]:
        """Limits of one axis (n,) in each slot, times `share` (n,)."""
        slot = np.arange(len(axis))
        level, slope = (share * part[axis, slot] for part in (self.level, self.slope))
        if self.bend is None:
            return both_signs(self.at, level, slope, None, np.ones(len(slot)))
        return both_signs(self.at, level, slope, share * self.bend[axis, slot], None)


@dataclass(frozen=True)
class Places:
    """Where axes are looked at: samples of intervals, and ends and middles of all cells; p places by their slots."""

    slot: Ints  #: (p,): whose cell the place lies in; ascending
    way: Floats  #: (p,): from the start of that cell
    value: Floats  #: (3, d, p): derivatives of the axes
    bump: Floats  #: (3, d, p): by how much they may be larger between this place and the next
    #: (d,): limits
    accel: Floats
    jerk: Floats
    unknown: Bools  #: (n,): slots whose cell meets an interval in which derivatives are not finite

    @classmethod
    def of(cls, grid: Grid, runs: Ints, limits: PathLimits) -> Places:
        """All of them in the cells that lie between two others."""
        samples, edge = limits.samples, limits.vectors.edge
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
        met = cell_intervals(limits.vectors, grid, runs)
        order = np.lexsort((way, slot))
        order = order[slot[order] >= 0]
        return cls(
            slot[order],
            way[order],
            np.concatenate((flat.astype(np.float64), between), axis=2)[..., order],
            np.concatenate((flat_bump, samples.missed[:, :, interval]), axis=2).astype(np.float64)[..., order],
            _USED * samples.accel,
            _USED * samples.jerk,
            np.append(np.maximum.reduceat(np.append(~samples.known, False), met)[2::2], False),
        )

    def uses(self, batch: Batch, c: Floats) -> tuple[list[Floats], _Signed | None]:
        """(d, n) share of the limits that accelerations and jerks of every axis use in the cell of each slot.

        Second come the jerks that are most beyond their limits, one in each cell.
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
            found.append(np.where(self.signed(batch), used, 0.0))
        return found, self._worst(values, begin, z, here, found[1])

    def signed(self, batch: Batch) -> Bools:
        """(n,) bool: slots with a cell between two others in which derivatives are known."""
        node = batch.slope > 0.0
        known: Bools = node & np.append(node[1:], False) & ~self.unknown
        return known

    def _worst(self, jerks: Floats, begin: Ints, z: Floats, here: Floats, used: Floats) -> _Signed | None:
        """Of each cell in which a jerk is beyond its limit the place where it is most so; nothing in the others."""
        most = jerks.max(axis=0)
        count = np.diff(np.append(begin, len(most)))
        hit = np.flatnonzero(most >= np.repeat(np.maximum.reduceat(most, begin), count))
        place, slot = hit[np.searchsorted(hit, begin)], self.slot[begin]
        wrong = used.max(axis=0)[slot] > 1.0
        place, slot = place[wrong], slot[wrong]
        if not len(slot):
            return None
        axis = np.zeros((1, len(z)), np.int64)
        axis[0, slot] = own = jerks[:, place].argmax(axis=0)
        one, two, three = (
            np.sqrt(here[place] / np.maximum(z[slot], 1e-300)) / self.jerk[own] * self.value[:, own, place]
        )
        x, rows = self.way[place], np.zeros((3, 1, len(z)))
        rows[:, 0, slot] = three, three * x + 1.5 * two, (three * x + 3.0 * two) * x + one
        return _Signed(0, rows[0], rows[1], rows[2], axis)

    def at_ends(self, batch: Batch) -> tuple[list[_Signed], list[_Signed]]:
        """Accelerations, and jerks, at the start and at the end of every cell."""
        begin = np.flatnonzero(np.diff(self.slot, prepend=-1))
        last = np.append(begin[1:], len(self.slot)) - 1
        where, inner = self.slot[begin], self.signed(batch)
        accel, jerk = 1.0 / self.accel[:, None], 1.0 / self.jerk[:, None]
        accels, jerks = [], []
        for at, chosen in enumerate((begin, last)):  # places of a cell are in order
            q = np.zeros((*self.value.shape[:2], len(batch)))
            q[..., where] = self.value[..., chosen]
            one, two, three = np.where(inner, q, 0.0)
            accels.append(_Signed(at, accel * two, 0.5 * accel * one, None))
            jerks.append(_Signed(at, jerk * three, 1.5 * jerk * two, jerk * one))
        return accels, jerks


def faster(grid: Grid, free: Grid, places: Places, batch: Batch, best: Floats) -> Floats:
    """Faster profiles than those that keep sums of amounts.

    Parameters
    ----------
    grid : Grid
        With all limits as amounts.
    free : Grid
        The same cells without accelerations and jerks of the machine's axes.
    batch : Batch
        The problem of `grid`.
    best : (n,) float64
        Strictly feasible coefficients of it.

    Returns
    -------
    (n,) float64
        Coefficients that keep every limit; none of the runs is slower.
    """
    first, last = batch.first, batch.last
    stop = np.zeros(len(batch), np.bool_)
    stop[first] = stop[last] = True
    free = replace(free, cap=np.where(stop, grid.cap, free.cap), rows=np.where(stop, grid.rows, free.rows))
    bare, summed = problem_of(free), places.unknown.copy()
    ends = places.at_ends(bare)
    run = np.repeat(np.arange(len(first)), last - first + 1)
    going = np.ones(len(first), np.bool_)
    inside: list[_Signed] = []
    c, (uses, worst) = best.copy(), places.uses(bare, best)
    chosen = np.zeros((2, AXES, len(batch)), np.int64)  # axes that have their limits with signs, of either kind
    for number in range(ROUNDS):
        inside += [] if worst is None else [worst]
        shares = []
        for used, limits, axes in zip(uses, (ends[0], ends[1] + inside), chosen, strict=True):
            seen = _seen(bare, c, limits, used.shape)
            unseen = np.maximum(used - seen, 0.0) / np.maximum(used, 1.0)
            held, left = (np.take_along_axis(part, axes, axis=0) for part in (used, unseen))
            summed |= ((held > 1.0) & (held - 1.0 + left > _MOST)).any(axis=0)  # signs do not help there
            # an axis that is beyond its limit in a cell may be so in the next plan beside it
            near = maximum_filter1d(used, 2 ** (number + 1) + 1, axis=1)
            axes[:] = np.argpartition(-near, AXES - 1, axis=0)[:AXES]
            shares.append(1.0 / (1.0 - np.minimum(unseen + _ROOM, _MOST)))
        # the cell of a slot is the next one of the grid; sums use the same share of their limits
        sums = ~stop & np.append(False, summed[:-1])
        problem = problem_of(replace(free, rows=np.where(sums, grid.rows / _USED, free.rows)))
        signed = [
            row
            for axes, limits, share in zip(chosen, (ends[0], ends[1] + inside), shares, strict=True)
            for row in _rows(limits, axes, np.where(summed, 0.0, share))
        ]
        problem = replace(problem, rows=(*problem.rows, *signed))
        start, gap = _within(problem, best, run), GAP if number else ROUGH
        c[going[run]] = solve_runs(problem.of(going), free.of(going), start=start[going[run]], gap=gap, most=_STEPS)
        uses, worst = places.uses(bare, c)
        # sums of amounts keep limits by themselves, with less room for what lies between samples than is measured here
        slower = _slower([np.where(summed, 0.0, used) for used in uses], batch)
        kept = c * slower[run]
        time, before = (np.bincount(run, batch.weight / np.sqrt(values)) for values in (kept, best))
        best = np.where((time < before)[run], kept, best)
        going &= slower <= 1.0 - _ROOM
        if not going.any():
            break
    return best


def _rows(limits: Sequence[_Signed], axes: Ints, share: Floats) -> list[Row]:
    """Limits of some axes (a, n) at both ends of each cell, and of those within, times `share` (d, n)."""
    slot, found = np.arange(axes.shape[1]), []
    for axis in axes:
        for limit in limits[:2]:
            found += limit.rows(axis, share[axis, slot])
    for limit in limits[2:]:
        assert limit.axis is not None
        found += limit.rows(np.zeros_like(slot), share[limit.axis[0], slot])
    return found


def _seen(batch: Batch, c: Floats, limits: Sequence[_Signed], shape: tuple[int, ...]) -> Floats:
    """(d, n) largest share of the limits of each axis that is used where these count."""
    most, seen = np.zeros(shape), batch.seen_by_rows(c, 0.0)
    for limit in limits:
        limit.use(seen, most)
    return most


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
