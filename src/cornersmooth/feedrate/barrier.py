"""The fastest speed profile under speed, acceleration and jerk limits, by an interior-point method.

Over the path coordinate s the square of the speed, z(s) = v², is a quadratic spline: in every cell the acceleration
z′/2 is linear and z″ constant. Then

    speed          z ≤ cap                         linear in z
    acceleration   |z′|/2 ≤ A                      linear
    jerk           |z″|/2 ≤ J·z^(−1/2)             the right side is convex: its tangent lies below it

z is written with Bézier coefficients c, one for the middle of each cell and one more at each end of a run: inside a
cell z never exceeds the largest of the two end values and c, so limits that hold for these hold everywhere.

At a standstill z ~ s^(4/3) has no such spline. There the first (last) cell of a run, of length e, is driven with
constant jerk from (to) rest: v = 3e/t and a = 6e/t² at its end give z′ = (4/3)·z/e and a jerk of (2/9)·z^(3/2)/e²,
again linear bounds.

The time Σ w/√c is convex. Primal-dual Newton steps follow the central path; in the normal equations the jerk limit
enters with its tangent at the current profile, which keeps the system positive definite, while the step length is taken
on the limit itself, so every profile on the way is feasible and the last one is used as it stands. The normal matrix
has five diagonals: one step costs a fixed time per cell. Linear limits in z: Verscheure et al. 2009; tangent of the
jerk limit: Erkorkmaz et al. 2017; predictor of the barrier: Nocedal and Wright, Numerical Optimization, ch. 19.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from cornersmooth.model import Bools, Floats, Ints

#: the remaining duality gap over the time, at which the profile is taken
GAP = 2e-4
#: Newton steps after which the profile is taken as it is; it is feasible at every step
MAX_STEPS = 200
#: part of the way to the nearest limit that a step may take
TO_LIMIT = 0.95
#: the profile that the iteration starts from, over the largest constant one that keeps the limits
START = 0.5


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
    accel, jerk : (n,) float64
    weight : (n,) float64
        The time is about Σ weight/√c.
    first, last : (r,) int64
        Slots of the first and last coefficient of each run.
    first_ratio, last_ratio : (r,) float64
        That coefficient over its neighbour where the run starts (ends) at rest; NaN where it does not.
    frozen : (n,) bool
        Coefficients that keep their value.
    """

    near: Floats
    far: Floats
    slope: Floats
    bend: Floats
    node_cap: Floats
    cell_cap: Floats
    accel: Floats
    jerk: Floats
    weight: Floats
    first: Ints
    last: Ints
    first_ratio: Floats
    last_ratio: Floats
    frozen: Bools

    def __len__(self) -> int:
        return len(self.near)

    def forms(self, c: Floats, idle: float) -> tuple[Floats, Floats, Floats]:
        """Values z and z′ at the nodes and z″/2 in the cells; `idle` is the z of slots without node."""
        after = _ahead(c)
        z = self.near * c + self.far * after + np.where(self.slope > 0.0, 0.0, idle)
        slope = self.slope * (after - c)
        bend = self.bend[0] * c + self.bend[1] * after + self.bend[2] * _ahead(after)
        return z, slope, bend

    def slacks(self, c: Floats) -> tuple[Floats, Floats]:
        """(9, n) distances to the limits, and z at the nodes."""
        z, slope, bend = self.forms(c, 1.0)
        rows = np.empty((9, len(c)))
        allowed = self.jerk / np.sqrt(z)
        allowed_next = _ahead(allowed)
        np.subtract(self.node_cap, z, out=rows[0])
        np.subtract(self.cell_cap, c, out=rows[1])
        np.subtract(2.0 * self.accel, slope, out=rows[2])
        np.add(2.0 * self.accel, slope, out=rows[3])
        np.subtract(allowed, bend, out=rows[4])
        np.subtract(allowed_next, bend, out=rows[5])
        np.add(allowed, bend, out=rows[6])
        np.add(allowed_next, bend, out=rows[7])
        np.add(self.jerk / np.sqrt(_ahead(c)), bend, out=rows[8])
        return rows, z

    def start(self) -> Floats:
        """Coefficients of constant profiles, one per run, that keep every limit with room to spare."""
        c = np.ones(len(self))
        self.follow(c)
        z, slope, bend = self.forms(c, 1.0)
        highest = np.maximum(np.maximum(z, _ahead(z)), 1.0)
        use = np.maximum(z / self.node_cap, c / self.cell_cap)
        use = np.maximum(use, np.abs(slope) / (2.0 * self.accel))
        use = np.maximum(use, np.cbrt(np.abs(bend) * np.sqrt(highest) / self.jerk) ** 2)
        lowest = START / np.maximum.reduceat(use, self.first)
        started: Floats = c * np.repeat(lowest, self.last - self.first + 1)
        return started

    def follow(self, c: Floats) -> None:
        """Set the end coefficients of the runs from their neighbours."""
        at_rest = ~np.isnan(self.first_ratio)
        c[self.first[at_rest]] = self.first_ratio[at_rest] * c[self.first[at_rest] + 1]
        at_rest = ~np.isnan(self.last_ratio)
        c[self.last[at_rest]] = self.last_ratio[at_rest] * c[self.last[at_rest] - 1]


def solve(batch: Batch, c: Floats) -> Floats:
    """Fastest profile of every run.

    Parameters
    ----------
    batch : Batch
    c : (n,) float64
        Strictly feasible coefficients to start from.

    Returns
    -------
    (n,) float64
        Strictly feasible coefficients; the time is within about `GAP` of the smallest on this grid.
    """
    slack, z = batch.slacks(c)
    rows = slack.size
    barrier = float((batch.weight / np.sqrt(c)).sum()) / rows
    dual = barrier / slack
    for _ in range(MAX_STEPS):
        bite = 0.5 * batch.jerk * z**-1.5  # −d(J·z^(−1/2))/dz
        bite_cell = 0.5 * batch.jerk * _ahead(c) ** -1.5
        step = _newton_step(batch, c, slack, dual, barrier, bite, bite_cell)
        push = _change(batch, step, bite, bite_cell)
        relative = push / slack
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
        gap = float((dual * slack).sum())
        worst = min(length, dual_length)
        if worst > 0.5 and gap < GAP * float((batch.weight / np.sqrt(c)).sum()):
            break
        # lower the barrier only as fast as the steps arrive; raise it where they are cut short
        shrink = 0.2 if worst > 0.9 else 0.5 if worst > 0.6 else 1.0 if worst > 0.2 else 2.0
        barrier = shrink * gap / rows
    return c


def _newton_step(
    batch: Batch, c: Floats, slack: Floats, dual: Floats, barrier: float, bite: Floats, bite_cell: Floats
) -> Floats:
    """Solve the normal equations of the barrier problem for the change of the coefficients."""
    n = len(c)
    w = dual / slack
    force = barrier / slack
    # forces on z at the nodes, z′, z″/2 and on the coefficients
    bite_next = _ahead(bite)
    on_z = force[0] + bite * (force[4] + force[6]) + _behind(bite_next * (force[5] + force[7]))
    on_slope = batch.slope * (force[2] - force[3])
    on_bend = force[4] + force[5] - force[6] - force[7] - force[8]
    gradient = force[1] - 0.5 * batch.weight * c**-1.5
    gradient += batch.near * on_z - on_slope + batch.bend[0] * on_bend
    gradient += _behind(batch.far * on_z + on_slope + batch.bend[1] * on_bend + bite_cell * force[8])
    gradient += _behind(_behind(batch.bend[2] * on_bend))

    r0, r1, r2 = batch.bend
    w_z = w[0] + bite**2 * (w[4] + w[6]) + _behind(bite_next**2 * (w[5] + w[7]))
    w_slope = (w[2] + w[3]) * batch.slope**2
    w_bend = w[4] + w[5] + w[6] + w[7] + w[8]
    cross, cross_next = bite * (w[4] - w[6]), bite_next * (w[5] - w[7])
    # z″/2 times z at both nodes and times the middle coefficient, spread over the cell's three coefficients
    k0 = cross * batch.near
    k1 = cross * batch.far + cross_next * _ahead(batch.near) - w[8] * bite_cell
    k2 = cross_next * _ahead(batch.far)
    bands = np.zeros((3, n))
    diagonal, beside, beyond = bands[2], bands[1], bands[0]
    diagonal += 0.75 * batch.weight * c**-2.5 + w[1]
    diagonal += w_z * batch.near**2 + w_slope + r0 * (w_bend * r0 + 2.0 * k0)
    diagonal += _behind(w_z * batch.far**2 + w_slope + r1 * (w_bend * r1 + 2.0 * k1) + w[8] * bite_cell**2)
    diagonal += _behind(_behind(r2 * (w_bend * r2 + 2.0 * k2)))
    beside += _behind(w_z * batch.near * batch.far - w_slope + w_bend * r0 * r1 + r0 * k1 + r1 * k0)
    beside += _behind(_behind(w_bend * r1 * r2 + r1 * k2 + r2 * k1))
    beyond += _behind(_behind(w_bend * r0 * r2 + r0 * k2 + r2 * k0))
    _eliminate(batch, bands, gradient)
    step = solveh_banded(bands, -gradient, overwrite_ab=True, overwrite_b=True, check_finite=False)
    batch.follow(step)
    return np.asarray(step, np.float64)


def _change(batch: Batch, step: Floats, bite: Floats, bite_cell: Floats) -> Floats:
    """(9, n) linear change of the limits' left sides with a step of the coefficients."""
    z, slope, bend = batch.forms(step, 0.0)
    used = bite * z
    used_next = _ahead(used)
    return np.stack(
        (
            z,
            step,
            slope,
            -slope,
            used + bend,
            used_next + bend,
            used - bend,
            used_next - bend,
            bite_cell * _ahead(step) - bend,
        )
    )


def _eliminate(batch: Batch, bands: Floats, gradient: Floats) -> None:
    """Take coefficients that follow others, or stay, out of the system; their rows become identities."""
    beyond, beside, diagonal = bands
    for end, ratio, inward in ((batch.first, batch.first_ratio, 1), (batch.last, batch.last_ratio, -1)):
        rest = ~np.isnan(ratio)
        at, ratio = end[rest], ratio[rest]
        to = at + inward
        pair = np.maximum(at, to)  # column of the entry that joins both
        diagonal[to] += ratio * (ratio * diagonal[at] + 2.0 * beside[pair])
        beside[np.maximum(to, to + inward)] += ratio * beyond[np.maximum(at, at + 2 * inward)]
        gradient[to] += ratio * gradient[at]
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
