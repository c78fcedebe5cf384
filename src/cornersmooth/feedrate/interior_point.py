"""The fastest speed profile under speed, acceleration and jerk limits, by an interior-point method.

Over the path coordinate s the square of the speed, z(s) = v², is a quadratic spline: in every cell the acceleration
z′/2 is linear and z″ constant. An axis whose position is q(s) moves with

    speed          q₁·√z
    acceleration   q₂·z + q₁·z′/2
    jerk           √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2)              (q₁, q₂, q₃: derivatives of q)

so limits of speed and acceleration are linear in z, and a jerk limit is linear but for J·z^(−1/2) on its right side,
which is convex: its tangent lies below it. For the path itself q = s: z ≤ v², |z′|/2 ≤ A, |z″|/2 ≤ J·z^(−1/2).

z is written with Bézier coefficients c, one for the middle of each cell and one more at each end of a run: inside a
cell z never exceeds the largest of the two end values and c, so limits that hold for these hold everywhere.

At a standstill z ~ s^(4/3) has no such spline. There the first (last) cell of a run, of length e, is driven with
constant jerk from (to) rest: v = 3e/t and a = 6e/t² at its end give z′ = (4/3)·z/e and a jerk of (2/9)·z^(3/2)/e²,
again linear bounds.

The time Σ w/√c is convex. Primal-dual Newton steps follow the central path; in the normal equations the jerk limit
enters with its tangent at the current profile, which keeps the system positive definite, while the step length is taken
on the limit itself, so every profile on the way is feasible and the last one is used as it stands. The normal matrix
has five diagonals: one step costs a fixed time per cell. Linear limits in z: Verscheure et al. 2009; tangent of the
jerk limit: Erkorkmaz et al. 2017; primal-dual steps: Nocedal and Wright, Numerical Optimization, ch. 19.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from cornersmooth.lapack import dpbsv
from cornersmooth.model import Bools, Floats, Ints

#: the remaining duality gap over the time, at which the profile is taken
GAP = 2e-4
#: change of the time in one step, over what may remain, below which the dual variables are taken to have arrived too
SETTLED = 5.0
#: barrier to begin with, over that of a cold start, where a plan that keeps most of the limits is known
WARM = 0.05
#: Newton steps after which the profile is taken as it is; it is feasible at every step
MAX_STEPS = 500
#: what is added to the main diagonal of the normal equations, relative to it, where they cannot be solved without
_RIDGES = (0.0, 1e-12, 1e-9, 1e-6, 1e-3)
#: part of the way to the nearest limit that a step may take
TO_LIMIT = 0.95
#: the profile that the iteration starts from, over the largest constant one that keeps the limits
START = 0.5


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
        after = _ahead(c)
        z = self.near * c + self.far * after
        slope = self.slope * (after - c)
        bend = self.bend[0] * c + self.bend[1] * after + self.bend[2] * _ahead(after)
        return z, slope, bend

    def seen_by_rows(self, c: Floats, idle: float) -> tuple[list[Floats], list[Floats], Floats]:
        """Arrays z and z′ as rows see them, by `Row.at`, and z″/2; `idle` is the z of slots without node."""
        z, slope, bend = self.forms(c)
        z = z + idle * self.idle
        return [z, _ahead(z), c, _ahead(c)], [slope, _ahead(slope)], bend

    def slacks(self, c: Floats) -> tuple[Floats, list[Floats]]:
        """(rows, n) distances to the limits, and z by `Row.at`."""
        z, slope, bend = self.seen_by_rows(c, 1.0)
        root = [1.0 / np.sqrt(values) for values in z]
        slack = np.empty((len(self.rows), len(c)))
        for row, into in zip(self.rows, slack, strict=True):
            np.subtract(root[row.at] if row.right is None else row.right, _left(row, z, slope, bend), out=into)
        return slack, z

    def start(self) -> Floats:
        """Coefficients of constant profiles, one per run, that keep every limit with room to spare."""
        c = np.ones(len(self))
        self.follow(c)
        z, slope, bend = self.seen_by_rows(c, 1.0)
        use = np.zeros(len(self))
        for row in self.rows:
            left = np.maximum(_left(row, z, slope, bend), 0.0)
            # left sides grow with z, the right side of jerk limits falls with its root
            used = np.cbrt(left * np.sqrt(z[row.at])) ** 2 if row.right is None else left / row.right
            np.maximum(use, used, out=use)
        lowest = START / np.maximum.reduceat(use, self.first)
        started: Floats = c * np.repeat(lowest, self.last - self.first + 1)
        return started

    def follow(self, c: Floats) -> None:
        """Set the end coefficients of the runs from their neighbours."""
        at_rest = ~np.isnan(self.first_ratio)
        c[self.first[at_rest]] = self.first_ratio[at_rest] * c[self.first[at_rest] + 1]
        at_rest = ~np.isnan(self.last_ratio)
        c[self.last[at_rest]] = self.last_ratio[at_rest] * c[self.last[at_rest] - 1]


def solve(batch: Batch, c: Floats, gap: float = GAP, most: int = MAX_STEPS) -> Floats:
    """Fastest profile of every run.

    Parameters
    ----------
    batch : Batch
    c : (n,) float64
        Strictly feasible coefficients to start from.
    gap : float
        Remaining duality gap over the time at which a profile is taken.
    most : int
        Newton steps after which it is taken in any case.

    Returns
    -------
    (n,) float64
        Strictly feasible coefficients; the time is within about `gap` of the smallest on this grid.
    """
    slack, z = batch.slacks(c)
    time = float((batch.weight / np.sqrt(c)).sum())
    barrier = (WARM if batch.signed else 1.0) * time / slack.size
    dual = barrier / slack
    for _ in range(most):
        bites = [0.5 * values**-1.5 for values in z]  # −d(z^(−1/2))/dz
        step = _newton_step(batch, c, slack, dual, barrier, bites)
        relative = _change(batch, step, bites) / slack
        dual_step = barrier / slack - dual + dual * relative
        dual_length = min(1.0, TO_LIMIT / max(float((-dual_step / dual).max()), TO_LIMIT))
        length = min(1.0, TO_LIMIT / max(float(relative.max()), float((-step / c).max()), TO_LIMIT))
        while True:
            trial = c + length * step
            new_slack, new_z = batch.slacks(trial)
            if (new_slack > (1.0 - TO_LIMIT) * 0.5 * slack).all():
                break
            length *= 0.7
        c, slack, z = trial, new_slack, new_z
        dual += dual_length * dual_step
        remaining = float((dual * slack).sum())
        worst = min(length, dual_length)
        before, time = time, float((batch.weight / np.sqrt(c)).sum())
        # the gap says how far the time is from the smallest only once the duals balance the forces
        if worst > 0.5 and remaining < gap * time and abs(before - time) < SETTLED * gap * time:
            break
        # lower the barrier only as fast as the steps arrive; raise it where they are cut short
        shrink = 0.2 if worst > 0.9 else 0.5 if worst > 0.6 else 1.0 if worst > 0.2 else 2.0
        barrier = shrink * remaining / slack.size
    return c


def _left(row: Row, z: list[Floats], slope: list[Floats], bend: Floats) -> Floats:
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


def _weight_of_z(row: Row, bites: list[Floats]) -> Floats:
    """Derivative of left minus right side by z."""
    if row.right is not None:
        return np.zeros_like(bites[0]) if row.level is None else row.level
    return bites[row.at] if row.level is None else row.level + bites[row.at]


def _change(batch: Batch, step: Floats, bites: list[Floats]) -> Floats:
    """(rows, n) linear change of the limits' left minus right sides with a step of the coefficients."""
    z, slope, bend = batch.seen_by_rows(step, 0.0)
    change = np.empty((len(batch.rows), len(step)))
    for row, into in zip(batch.rows, change, strict=True):
        np.multiply(_weight_of_z(row, bites), z[row.at], out=into)
        if row.slope is not None:
            into += row.slope * slope[row.at]
        if row.bend is not None:
            into += row.bend * bend
    return change


def _newton_step(batch: Batch, c: Floats, slack: Floats, dual: Floats, barrier: float, bites: list[Floats]) -> Floats:
    """Solve the normal equations of the barrier problem for the change of the coefficients."""
    n = len(c)
    # forces on, and stiffness of, z and z′ at the nodes and coefficients by `Row.at`, and z″/2
    on_z, on_slope, on_bend = np.zeros((4, n)), np.zeros((2, n)), np.zeros(n)
    zz, zs, ss, bb = np.zeros((4, n)), np.zeros((2, n)), np.zeros((2, n)), np.zeros(n)
    zb, sb = np.zeros((4, n)), np.zeros((2, n))
    stiffness, pressure = dual / slack, barrier / slack
    for row, w, force in zip(batch.rows, stiffness, pressure, strict=True):
        by_z = _weight_of_z(row, bites)
        wz = w * by_z
        on_z[row.at] += force * by_z
        zz[row.at] += wz * by_z
        if row.slope is not None:
            on_slope[row.at] += force * row.slope
            ss[row.at] += w * row.slope**2
            if row.level is not None or row.right is None:
                zs[row.at] += wz * row.slope
        if row.bend is not None:
            on_bend += force * row.bend
            bb += w * row.bend**2
            zb[row.at] += wz * row.bend
            if row.slope is not None:
                sb[row.at] += w * row.slope * row.bend

    near, far, s = batch.near, batch.far, batch.slope
    r0, r1, r2 = batch.bend
    node_z, node_s = on_z[0] + _behind(on_z[1]), s * (on_slope[0] + _behind(on_slope[1]))
    gradient = on_z[2] - 0.5 * batch.weight * c**-1.5 + near * node_z - node_s + r0 * on_bend
    gradient += _behind(far * node_z + node_s + r1 * on_bend + on_z[3]) + _behind(_behind(r2 * on_bend))

    w_z, w_zs, w_s = (at[0] + _behind(at[1]) for at in (zz, zs, ss))
    w_zs, w_s = s * w_zs, s * s * w_s
    # z″/2 times z and z′ at both nodes and times the middle coefficient, spread over the cell's three coefficients
    k0 = zb[0] * near - sb[0] * s
    k1 = zb[0] * far + sb[0] * s + zb[1] * _ahead(near) - sb[1] * _ahead(s) + zb[3]
    k2 = zb[1] * _ahead(far) + sb[1] * _ahead(s)
    bands = np.zeros((3, n))
    diagonal, beside, beyond = bands[2], bands[1], bands[0]
    diagonal += 0.75 * batch.weight * c**-2.5 + zz[2]
    diagonal += w_z * near**2 - 2.0 * w_zs * near + w_s + r0 * (bb * r0 + 2.0 * k0)
    diagonal += _behind(w_z * far**2 + 2.0 * w_zs * far + w_s + r1 * (bb * r1 + 2.0 * k1) + zz[3])
    diagonal += _behind(_behind(r2 * (bb * r2 + 2.0 * k2)))
    beside += _behind(w_z * near * far + w_zs * (near - far) - w_s + bb * r0 * r1 + r0 * k1 + r1 * k0)
    beside += _behind(_behind(bb * r1 * r2 + r1 * k2 + r2 * k1))
    beyond += _behind(_behind(bb * r0 * r2 + r0 * k2 + r2 * k0))
    _eliminate(batch, bands, gradient)
    step = _solved(bands, -gradient)
    batch.follow(step)
    return step


def _solved(bands: Floats, right: Floats) -> Floats:
    """Solve the normal equations; where rounding leaves no positive pivot they are stiffened.

    A stiffened step is shorter or points a little aside: it costs rounds, never a limit.
    """
    for ridge in _RIDGES:
        matrix = np.array(bands, order="F")
        matrix[-1] *= 1.0 + ridge
        _, step, info = dpbsv(matrix, right, overwrite_ab=1)
        if info == 0 and np.isfinite(step).all():
            return np.asarray(step, np.float64)
    return np.zeros_like(right)


def _eliminate(batch: Batch, bands: Floats, gradient: Floats) -> None:
    """Take coefficients that follow others, or stay, out of the system; their rows become identities."""
    beyond, beside, diagonal = bands
    for end, ratio, inward in ((batch.first, batch.first_ratio, 1), (batch.last, batch.last_ratio, -1)):
        rest = ~np.isnan(ratio)
        at, part = end[rest], ratio[rest]
        to = at + inward
        pair = np.maximum(at, to)  # column of the entry that joins both
        diagonal[to] += part * (part * diagonal[at] + 2.0 * beside[pair])
        beside[np.maximum(to, to + inward)] += part * beyond[np.maximum(at, at + 2 * inward)]
        gradient[to] += part * gradient[at]
        _isolate(bands, gradient, at)
    _isolate(bands, gradient, np.flatnonzero(batch.frozen))


def _isolate(bands: Floats, gradient: Floats, rows: Ints) -> None:
    beyond, beside, diagonal = bands
    diagonal[rows] = 1.0
    gradient[rows] = 0.0
    beside[rows] = 0.0
    beyond[rows] = 0.0
    n = len(diagonal)
    beside[rows[rows + 1 < n] + 1] = 0.0
    beyond[rows[rows + 2 < n] + 2] = 0.0


def _ahead(values: Floats) -> Floats:
    """``values[k + 1]`` at slot k; the last slot, which is inert, sees itself."""
    shifted = np.empty_like(values)
    shifted[:-1] = values[1:]
    shifted[-1] = values[-1]
    return shifted


def _behind(values: Floats) -> Floats:
    """``values[k - 1]`` at slot k, zero at the first."""
    shifted = np.empty_like(values)
    shifted[0] = 0.0
    shifted[1:] = values[:-1]
    return shifted
