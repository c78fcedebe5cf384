"""Reference times of short paths by sequential linear programmes.

An independent check of `windows`: another discretisation and another solver. With z = v² at nodes, differences of z
give acceleration and jerk; speed and acceleration limits are linear. The jerk limit |z″|/2 ≤ J·z^(−1/2) is replaced by
the tangent of its right side at the profile before, which lies below the convex function, so every programme keeps the
true limit. `scipy.optimize.linprog` (HiGHS) maximises z with the weights −∂T/∂z; rounds are repeated until the time
settles. Limits count at the nodes only, so the reference is a little fast rather than slow.

Seconds for a few hundred nodes: for tests and comparisons, not for whole programs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, diags_array, vstack

from cornersmooth.feedrate import timelaw
from cornersmooth.feedrate.intervals import Intervals, Resolution, path_limits
from cornersmooth.feedrate.path import Path
from cornersmooth.feedrate.speed_problem import make_grid
from cornersmooth.model import Floats
from cornersmooth.settings import Limits

#: change of the time, relative, below which a round brought nothing
SETTLED = 2e-4
#: rounds after which the profile is taken as it is
MOST_ROUNDS = 60
#: largest factor by which v² may change in a round, and the factor at which the rounds end: the weights of the
#: programme hold for small changes
WIDEST, NARROWEST = 3.0, 1.1
#: parts of a round's change that are tried where all of it brings nothing
STEPS = (0.5, 0.25, 0.1)

#: v² of the profile that the rounds start from, over the lowest limit
CRAWL = 0.1

FINE = Resolution(part=0.04, growth=0.03, end=0.3, fewest=200)


def reference_time(path: Path, limits: Limits, resolution: Resolution = FINE) -> float:
    """Shortest time for a path, s.

    Parameters
    ----------
    path : Path
    limits : Limits
    resolution : Resolution
        How close the nodes are.
    """
    speed_limits, stops = path_limits(path, limits), np.flatnonzero(path.junction_speed == 0.0)
    total = 0.0
    for run, lead in enumerate(stops[:-1]):
        accel, jerk = limits.accel, limits.jerk
        if path.rapid[lead]:
            _, accel, jerk = limits.rapid_limits
        if path.turning[lead]:
            _, accel, jerk = limits.angular_limits
        begin, end = int(speed_limits.run[run]), int(speed_limits.run[run + 1])
        bound = speed_limits.cap[begin:end]
        if (bound == bound[0]).all():
            length = speed_limits.edge[end : end + 1] - speed_limits.edge[begin]
            speed = np.sqrt(bound[:1])
            total += float(timelaw.rest_to_rest(length, speed, np.array(accel), np.array(jerk))[0].sum())
        else:
            x = _nodes(speed_limits, run, resolution)
            total += fastest(x, node_caps(x, speed_limits.edge[begin : end + 1], bound), accel, jerk)[0]
    return total


def _nodes(speed_limits: Intervals, run: int, resolution: Resolution) -> Floats:
    grid = make_grid(speed_limits, np.array([run]), resolution)
    return np.append(grid.start, grid.start[-1] + grid.width[-1])


def node_caps(x: Floats, edge: Floats, bound: Floats) -> Floats:
    """Limits of v² at nodes x (n,); an interval without a node counts at the node nearest to it."""
    width = np.diff(edge)
    wide = np.flatnonzero(width > 0.0)
    at = np.clip(np.searchsorted(edge[1:][wide], x, side="left"), 0, len(wide) - 1)
    cap = bound[wide][at]
    middle = 0.5 * (edge[:-1] + edge[1:])
    after = np.clip(np.searchsorted(x, middle), 1, len(x) - 1)
    nearest = after - (middle - x[after - 1] < x[after] - middle)
    empty = np.searchsorted(x, edge[1:], side="right") == np.searchsorted(x, edge[:-1], side="left")
    empty |= width == 0.0
    np.minimum.at(cap, nearest[empty], bound[empty])
    return cap


def fastest(x: Floats, cap: Floats, accel: float, jerk: float) -> tuple[float, Floats]:
    """Shortest time from rest to rest, s, and v² at the nodes.

    Parameters
    ----------
    x : (n,) float64, mm
        Nodes, ascending; the first and the last are the stops.
    cap : (n,) float64
        Limit of v² at each node.

    Raises
    ------
    ArithmeticError
        A linear programme has no solution.
    """
    h = np.diff(x)
    n = len(x) - 2
    upper = cap[1:-1].copy()
    for at, step in ((0, h[0]), (-1, h[-1])):  # constant jerk from rest
        upper[at] = min(upper[at], (4.5 * jerk * step * step) ** (2.0 / 3.0))
    inner = h[1:-1]
    slope = _differences(1.0 / inner)
    # z′ in the middle of every step; next to a stop it is known at the inner end, (4/3)·z/h
    ends = csr_array(([4.0 / 3.0 / h[0], -4.0 / 3.0 / h[-1]], ([0, 1], [0, n - 1])), shape=(2, n))
    slopes = vstack([ends[[0]], slope, ends[[1]]], format="csr")
    places = np.concatenate((x[1:2], 0.5 * (x[1:-2] + x[2:-1]), x[-2:-1]))
    bend = _differences(0.5 / np.diff(places)) @ slopes
    z = _crawl(upper, h)
    time, reach = _duration(z, h), WIDEST
    for _ in range(MOST_ROUNDS):
        scale = diags_array(z)  # unknowns are relative to the profile before
        allowed = jerk * z**-0.5
        curved = diags_array(1.0 / allowed) @ bend @ scale
        tangent = diags_array(np.full(n, 0.5))
        steep = slopes @ scale / (2.0 * accel)
        matrix = vstack([steep, -steep, curved + tangent, -curved + tangent], format="csr")
        right = np.concatenate((np.ones(2 * (n + 1)), np.full(2 * n, 1.5)))
        gain = 0.5 * (h[1:] + h[:-1]) * z**-0.5
        bounds = np.stack((np.full(n, 1.0 / reach), np.minimum(upper / z, reach)), axis=1)
        result: Any = linprog(
            -gain / gain.mean(),
            A_ub=matrix,  # type: ignore[call-overload]  # sparse matrices are taken, and meant
            b_ub=right,
            bounds=bounds,
            method="highs",
        )
        if result.x is None:
            raise ArithmeticError(f"the linear programme has no solution: {result.message}")
        z, time, reach = after_step(z, result.x * z, h, time, reach)
        if reach < NARROWEST:
            break
    return time, np.concatenate(([0.0], z, [0.0]))


def after_step(z: Floats, found: Floats, h: Floats, time: float, reach: float) -> tuple[Floats, float, float]:
    """The better of a profile and those between it and the one found, its time, and how far the next step may go."""
    # both profiles keep the tangents, so everything between them does
    tried = [found] + [z + part * (found - z) for part in STEPS]
    times = [_duration(profile, h) for profile in tried]
    best = int(np.argmin(times))
    gained = time - times[best]
    if best > 0 or gained < SETTLED * time:
        reach = np.sqrt(reach)
    return (tried[best], times[best], reach) if gained > 0.0 else (z, time, reach)


def _duration(z: Floats, h: Floats) -> float:
    v = np.sqrt(z)
    return float(3.0 * h[0] / v[0] + (2.0 * h[1:-1] / (v[1:] + v[:-1])).sum() + 3.0 * h[-1] / v[-1])


def _crawl(upper: Floats, h: Floats) -> Floats:
    """A profile so slow that it keeps every limit: constant, with v² ~ s^(4/3) next to the stops."""
    from_stop = np.minimum(np.cumsum(h[:-1]) / h[0], np.cumsum(h[:0:-1])[::-1] / h[-1])
    rising: Floats = CRAWL * upper.min() * np.minimum(from_stop / from_stop.max(), 1.0) ** (4.0 / 3.0)
    return rising


def _differences(weight: Floats) -> Any:
    """Sparse matrix of the weighted differences of neighbours, (n, n + 1)."""
    n = len(weight)
    rows = np.arange(n)
    return csr_array(
        (np.concatenate((-weight, weight)), (np.tile(rows, 2), np.concatenate((rows, rows + 1)))), shape=(n, n + 1)
    )
