"""Reference times under the limits of a machine's axes, by sequential linear programmes.

As `linear_programmes`, with the rows of every axis and their signs: for q(s) the speed q₁·√z, the acceleration
q₂·z + q₁·z′/2 and the jerk √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2). Nodes stand at all borders of elements, where derivatives
jump: there those of both sides count. The derivatives are those of `machine_axes`, which a test holds against the
kinematics; nothing else is the planner's.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from linear_programmes import NARROWEST, WIDEST, _crawl, _duration, after_step, node_caps
from scipy.optimize import linprog
from scipy.sparse import csr_array, diags_array, eye_array, hstack, vstack

from cornersmooth.feedrate.intervals import path_limits
from cornersmooth.feedrate.taylor import shares_at
from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.model import Floats
from cornersmooth.settings import Limits

#: how far beside a border of elements derivatives are taken, mm, and elements that have no length
BESIDE, NOTHING = 1e-7, 1e-9
#: rounds, steps that are tried where a whole one brings nothing, and the factor at which the rounds end
ROUNDS = 60


def reference_time(law: TimeLaw, limits: Limits, step: float) -> float:
    """Shortest time, s, of the path of a law that runs from rest to rest; nodes are `step` mm apart at most."""
    path, axes = law.path, law.machine_axes
    assert axes is not None
    edge = np.concatenate(([0.0], np.cumsum(path.length)))
    pieces = [
        np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))[:-1]
        for low, high in pairwise(edge)
        if high - low > NOTHING
    ]
    x = np.concatenate([*pieces, edge[-1:]])

    def orders(way: Floats) -> tuple[Floats, Floats, Floats]:
        element = np.clip(np.searchsorted(edge, way, side="right") - 1, 0, len(path) - 1)
        return axes.orders(element, shares_at(path, element, way - edge[element]))[1:]

    sides = [orders(x[1:-1] + away) for away in (BESIDE, -BESIDE)]
    speed, accel, jerk = axes.limits
    h, n = np.diff(x), len(x) - 2
    speed_limits = path_limits(path, limits)
    upper = node_caps(x, speed_limits.edge, speed_limits.cap)[1:-1].copy()
    for one, _, _ in sides:
        upper = np.minimum(upper, ((speed / np.maximum(np.abs(one), 1e-12)) ** 2).min(axis=1))
    for at, end, length in ((0, x[:1] + NOTHING, h[0]), (-1, x[-1:] - NOTHING, h[-1])):  # constant jerk from rest
        rate = np.maximum(np.abs(sides[0][0][at]), np.abs(orders(end)[0][0]))
        slowest = min(limits.jerk, float((jerk / np.maximum(rate, 1e-12)).min()))
        upper[at] = min(upper[at], (4.5 * slowest * length**2) ** (2.0 / 3.0))
    # unknowns are z and z′ at the inner nodes; z″ is constant in a step and may jump from one to the next
    eye, none = eye_array(n, format="csr"), csr_array((n, n))
    z_at, slope_at = hstack([eye, none], format="csr"), hstack([none, eye], format="csr")
    inner = h[1:-1]
    bend = diags_array(0.5 / inner) @ (slope_at[1:] - slope_at[:-1])
    joined = z_at[1:] - z_at[:-1] - diags_array(0.5 * inner) @ (slope_at[1:] + slope_at[:-1])
    rest = vstack([slope_at[[at]] - side * 4.0 / 3.0 / h[at] * z_at[[at]] for at, side in ((0, 1.0), (-1, -1.0))])
    equal = vstack([joined, rest])
    straight, curved = [slope_at / (2.0 * limits.accel)], [(bend / limits.jerk, slice(0, -1))]
    curved.append((bend / limits.jerk, slice(1, None)))
    for (one, two, three), nodes in zip(sides, (slice(0, -1), slice(1, None)), strict=True):
        for k in range(axes.limits.shape[1]):
            straight.append(_scaled(two[:, k] / accel[k], z_at) + _scaled(0.5 * one[:, k] / accel[k], slope_at))
            parts = [(values[nodes, k] / jerk[k]) for values in (one, 1.5 * two, three)]
            forms = (bend, slope_at[nodes], z_at[nodes])
            curved.append((sum(_scaled(part, form) for part, form in zip(parts, forms, strict=True)), nodes))
    z = 0.1 * _crawl(upper, h)
    time, reach = _duration(z, h), WIDEST
    for _ in range(ROUNDS):
        scale = diags_array(np.concatenate((z, np.full(n, 2.0 * limits.accel))))
        tangent = hstack([diags_array(np.full(n, 0.5)), none], format="csr")
        matrices, right = [], []
        for row, nodes in curved:
            own = diags_array(z[nodes] ** 0.5) @ row @ scale
            matrices += [own + tangent[nodes], -own + tangent[nodes]]
            right += [np.full(own.shape[0], 1.5)] * 2
        for row in straight:
            own = row @ scale
            matrices += [own, -own]
            right += [np.ones(own.shape[0])] * 2
        gain = 0.5 * (h[1:] + h[:-1]) * z**-0.5
        bounds = np.concatenate(
            (np.stack((np.full(n, 1.0 / reach), np.minimum(upper / z, reach)), axis=1), np.tile([-2.0, 2.0], (n, 1)))
        )
        problem: dict[str, Any] = {
            "c": np.concatenate((-gain / gain.mean(), np.zeros(n))),
            "A_ub": vstack(matrices, format="csr"),
            "b_ub": np.concatenate(right),
            "A_eq": equal @ scale,
            "b_eq": np.zeros(n + 1),
            "bounds": bounds,
        }
        # the interior-point method is the faster one; it may give up on a programme that the simplex method solves
        results = (linprog(**problem, method=method) for method in ("highs-ipm", "highs-ds"))
        found: Any = next((result.x for result in results if result.x is not None), None)
        if found is None:
            raise ArithmeticError("the linear programme has no solution")
        z, time, reach = after_step(z, found[:n] * z, h, time, reach)
        if reach < NARROWEST:
            break
    return time


def _scaled(factor: Floats, matrix: Any) -> Any:
    return diags_array(factor) @ matrix
