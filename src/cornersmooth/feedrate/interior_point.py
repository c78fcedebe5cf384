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

The time Σ w/√c is convex. Primal-dual Newton steps follow the central path, for the logarithms of c: there the time
has a third of its curvature by c, and grows to what the limits allow in a third of the steps. In the normal equations
the jerk limit enters with its tangent at the current profile, which keeps the system positive definite, while the step
length is taken on the limit itself. So a profile that keeps a limit keeps it at every step; what begins beyond a limit
comes nearer to it with every step. The normal matrix has five diagonals: one step costs a fixed time per cell. Each is
solved twice (Mehrotra): where a step without barrier would lead says how far the barrier may fall, and what the
products of changes would add. Linear limits in z: Verscheure et al. 2009; tangent of the jerk limit: Erkorkmaz et al.
2017; primal-dual steps from beyond limits, and Mehrotra's: Nocedal and Wright, Numerical Optimization, ch. 19 and 14.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs

from cornersmooth.feedrate.speed_problem import Batch, ahead, around, behind
from cornersmooth.model import Floats

#: the remaining duality gap over the time, at which the profile is taken
GAP = 2e-4
#: change of the time in one step, over what may remain, below which the dual variables are taken to have arrived too
SETTLED = 5.0
#: duality gap over the time that multipliers begin with, and where a plan that keeps most of the limits is known
COLD, WARM = 5.0, 0.1
#: steps that together have to bring more than that
PATIENCE = 10
#: least part of the gap that a step aims at
LEAST_FALL = 1e-3
#: Newton steps after which the profile is taken as it is
MAX_STEPS = 500
#: room to a limit that the iteration begins with at least, over the width of what both sides leave
_ROOM = 0.01
#: part of the way to the nearest limit that a step may take
TO_LIMIT = 0.95
#: part of a step below which the next one goes back to the middle, and by what the barrier rises there
SHORT, RAISED = 0.1, 2.0

#: what is added to the main diagonal of the normal equations, relative to it, where they cannot be solved without
_RIDGES = (0.0, 1e-12, 1e-9, 1e-6, 1e-3)
#: stiffness of what ties coefficients, over that of the limits
_STIFF = 1e8


def solve(batch: Batch, c: Floats, gap: float = GAP, most: int = MAX_STEPS, begin: float = COLD) -> Floats:
    """Fastest profile of every run: coefficients (n,) whose time is within about `gap` of the smallest on this grid.

    It starts from coefficients c (n,), which may be beyond limits, with the duality gap `begin` over the time. Where
    they keep all limits with room to spare, what is found keeps them, too. After `most` Newton steps it is taken in
    any case.
    """
    room, z = batch.slacks(c)
    slack = np.maximum(room, _ROOM * (room[0] + room[1]))
    time = float((batch.weight / np.sqrt(c)).sum())
    dual = begin * time / slack.size / slack
    worst, fall, times = 1.0, time, [np.inf]
    for _ in range(most):
        bites = [0.5 * values**-1.5 for values in z]  # −d(z^(−1/2))/dz
        inverse, product = 1.0 / slack, dual * slack
        beyond = 1.0 - room * inverse
        lifted = dual * beyond
        factors = _factors(_normal_matrix(batch, c, dual * inverse, bites))
        used = _used(batch, _step(batch, c, factors, lifted, bites), inverse, beyond, bites)
        length, dual_length = (_length(float(most_used)) for most_used in (used.max(), 1.0 - used.min()))
        first_order = product * used
        forces = first_order * used
        whole, first, second = (float(part.sum()) for part in (product, first_order, forces))
        left = (1.0 - dual_length) * whole + (dual_length - length * (1.0 - dual_length)) * first
        left = (left - length * dual_length * second) / whole
        mean = whole / slack.size
        # while the time falls the forces are not in balance, and limits that are too near hold it up
        forces -= first_order
        forces += mean * max(left**2, LEAST_FALL, min(fall / whole, 1.0))
        if worst < SHORT:
            forces[:] = mean * RAISED
        step = _step(batch, c, factors, forces * inverse + lifted, bites)
        used = _used(batch, step, inverse, beyond, bites)
        toward = product * used
        toward += forces
        toward -= product
        dual_length = _length(-float((toward / product).min()))
        length = _length(max(float(used.max()), float((-step / c).max())))
        c = c + length * step
        room, z = batch.slacks(c)
        slack = np.maximum(room, slack * (1.0 - length * used))
        dual = (product + dual_length * toward) * inverse
        remaining = float((dual * slack).sum())
        before, time = time, float((batch.weight / np.sqrt(c)).sum())
        fall = abs(before - time)
        # the gap says how far the time is from the smallest only once the duals balance the forces
        worst = min(length, dual_length)
        if worst > 0.5 and remaining < gap * time and fall < SETTLED * gap * time:
            break
        # limits that cannot all be kept: the duals grow without end, and the profile stays
        if remaining * gap > time:
            break
        # tangents of jerk limits may turn from step to step without end
        times.append(time)
        if times[-PATIENCE:][0] - time < SETTLED * gap * time and remaining < PATIENCE * SETTLED * gap * time:
            break
    return c


def _length(most_used: float) -> float:
    """Part of a step that keeps `TO_LIMIT` of the way to what it meets first."""
    return min(1.0, TO_LIMIT / max(most_used, TO_LIMIT))


def _used(batch: Batch, step: Floats, inverse: Floats, beyond: Floats, bites: list[Floats]) -> Floats:
    """(2, R, n) parts of the way to each limit that a step of the coefficients takes, by tangents of the limits."""
    near, used = around(step), batch.of_limits()
    for rows, into, bite in zip(batch.rows, batch.by_rows(used), bites, strict=True):
        left, z = rows.values(near)
        z *= bite
        np.add(z, left, out=into[0])
        np.subtract(z, left, out=into[1])
    used *= inverse
    used += beyond
    return used


def _normal_matrix(batch: Batch, c: Floats, stiffness: Floats, bites: list[Floats]) -> Floats:
    """(3, n) diagonals of the normal equations, from the stiffness (2, R, n) of all limits."""
    found = np.zeros((3, 3, len(c)))
    found[1, 1] = 0.25 * batch.weight * c**-2.5  # by the logarithm of c; 0.75 by c
    for rows, both, bite in zip(batch.rows, batch.by_rows(stiffness), bites, strict=True):
        whole = both[0] + both[1]
        found += np.einsum("irn,jrn->ijn", whole * rows.left, rows.left)
        cross = bite * np.einsum("rn,irn->in", both[0] - both[1], rows.left)
        own = bite * bite * whole.sum(axis=0) * rows.right
        found += cross[:, None] * rows.right + rows.right[:, None] * (cross + own)
    bands = np.stack(
        (
            behind(found[0, 2]),
            found[0, 1] + behind(found[1, 2]),
            found[1, 1] + ahead(found[0, 0]) + behind(found[2, 2]),
        )
    )
    _tie(batch, bands)
    return bands


def _step(batch: Batch, c: Floats, factors: Floats | None, pressure: Floats | None, bites: list[Floats]) -> Floats:
    """Change of the coefficients (n,) under the forces (2, R, n) of the limits."""
    force = np.zeros((3, len(c)))
    force[1] = -0.5 * batch.weight * c**-1.5
    if pressure is not None:
        for rows, both, bite in zip(batch.rows, batch.by_rows(pressure), bites, strict=True):
            force += np.einsum("rn,irn->in", both[0] - both[1], rows.left)
            force += bite * both.sum(axis=(0, 1)) * rows.right
    gradient = force[1] + ahead(force[0]) + behind(force[2])
    step = np.zeros(len(c)) if factors is None else np.asarray(dpbtrs(factors, -gradient)[0], np.float64)
    if not np.isfinite(step).all():
        step = np.zeros(len(c))
    step[batch.frozen] = 0.0
    batch.follow(step)
    return step


def _factors(bands: Floats) -> Floats | None:
    """Factors of the matrix; where rounding leaves no positive pivot it is stiffened.

    A stiffened step is shorter or points a little aside: it costs rounds, never a limit.
    """
    for ridge in _RIDGES:
        matrix = np.array(bands, order="F")
        matrix[-1] *= 1.0 + ridge
        factors, info = dpbtrf(matrix, overwrite_ab=1)
        if info == 0 and np.isfinite(factors).all():
            return np.asarray(factors)
    return None


def _tie(batch: Batch, bands: Floats) -> None:
    """Tie coefficients next to a rest to their neighbours, and those that stay to their values, by stiff springs."""
    _, beside, diagonal = bands
    for end, ratio, inward in ((batch.first, batch.first_ratio, 1), (batch.last, batch.last_ratio, -1)):
        at, part = end[~np.isnan(ratio)], ratio[~np.isnan(ratio)]
        to = at + inward
        spring = _STIFF * (diagonal[at] + diagonal[to])
        diagonal[at] += spring
        diagonal[to] += part**2 * spring
        beside[np.maximum(at, to)] -= part * spring
    diagonal[batch.frozen] *= _STIFF
