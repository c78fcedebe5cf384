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
has five diagonals: one step costs a fixed time per cell. Each is solved twice (Mehrotra): where a step without barrier
would lead says how far the barrier may fall, and what the products of changes would add. Linear limits in z: Verscheure
et al. 2009; tangent of the jerk limit: Erkorkmaz et al. 2017; primal-dual steps and Mehrotra's: Nocedal and Wright,
Numerical Optimization, ch. 19 and 14.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.feedrate.normal_equations import Equations
from cornersmooth.feedrate.speed_problem import Batch, weight_of_z
from cornersmooth.model import Floats

#: the remaining duality gap over the time, at which the profile is taken
GAP = 2e-4
#: change of the time in one step, over what may remain, below which the dual variables are taken to have arrived too
SETTLED = 5.0
#: duality gap over the time that multipliers begin with, and where a plan that keeps most of the limits is known
COLD, WARM = 5.0, 1.0
#: least part of the gap that a step aims at
LEAST_FALL = 1e-3
#: Newton steps after which the profile is taken as it is; it is feasible at every step
MAX_STEPS = 500
#: part of the way to the nearest limit that a step may take
TO_LIMIT = 0.95
#: part of a step below which the next one goes back to the middle, and by what the barrier rises there
SHORT, RAISED = 0.1, 2.0


def solve(batch: Batch, c: Floats, gap: float = GAP, most: int = MAX_STEPS, begin: float = COLD) -> Floats:
    """Fastest profile of every run.

    Parameters
    ----------
    c : (n,) float64
        Strictly feasible coefficients to start from.
    gap : float
        Remaining duality gap over the time at which a profile is taken.
    most : int
        Newton steps after which it is taken in any case.
    begin : float
        Duality gap over the time to begin with.

    Returns
    -------
    (n,) float64
        Strictly feasible coefficients; the time is within about `gap` of the smallest on this grid.
    """
    slack, z = batch.slacks(c)
    time = float((batch.weight / np.sqrt(c)).sum())
    dual = begin * time / slack.size / slack
    worst = 1.0
    for _ in range(most):
        bites = [0.5 * values**-1.5 for values in z]  # −d(z^(−1/2))/dz
        equations = Equations.of(batch, c, dual / slack, bites)
        change, toward = np.zeros_like(slack), np.zeros_like(dual)
        mean, aim = float((dual * slack).sum()) / slack.size, 0.0
        for trial in (True, False):
            pressure = (aim + change * toward) / slack
            step = equations.step(pressure)
            change = _change(batch, step, bites)
            relative = change / slack
            toward = pressure - dual + dual * relative
            dual_length = min(1.0, TO_LIMIT / max(float((-toward / dual).max()), TO_LIMIT))
            length = min(1.0, TO_LIMIT / max(float(relative.max()), float((-step / c).max()), TO_LIMIT))
            if trial:
                left = float(((dual + dual_length * toward) * (slack - length * change)).sum()) / slack.size
                aim = mean * max((left / mean) ** 3, LEAST_FALL)
                if worst < SHORT:
                    aim, change = mean * RAISED, np.zeros_like(slack)
        while True:
            new_c = c + length * step
            new_slack, new_z = batch.slacks(new_c)
            if (new_slack > (1.0 - TO_LIMIT) * 0.5 * slack).all():
                break
            length *= 0.7
        c, slack, z = new_c, new_slack, new_z
        dual += dual_length * toward
        remaining = float((dual * slack).sum())
        before, time = time, float((batch.weight / np.sqrt(c)).sum())
        # the gap says how far the time is from the smallest only once the duals balance the forces
        worst = min(length, dual_length)
        if worst > 0.5 and remaining < gap * time and abs(before - time) < SETTLED * gap * time:
            break
    return c


def _change(batch: Batch, step: Floats, bites: list[Floats]) -> Floats:
    """(rows, n) linear change of the limits' left minus right sides with a step of the coefficients."""
    z, slope, bend = batch.seen_by_rows(step, 0.0)
    change = np.empty((len(batch.rows), len(step)))
    for row, into in zip(batch.rows, change, strict=True):
        np.multiply(weight_of_z(row, bites), z[row.at], out=into)
        if row.slope is not None:
            into += row.slope * slope[row.at]
        if row.bend is not None:
            into += row.bend * bend
    return change
