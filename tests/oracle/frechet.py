"""Exact Fréchet distance of polylines: the smallest leash for two walkers who never step back.

Decision by the free-space diagram of Alt and Godau, Computing the Fréchet distance between two polygonal curves,
IJCGA 5 (1995): a leash of length d is enough when a monotone way leads through the cells in which both are within d.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Point = Sequence[float]
Interval = tuple[float, float]

#: rounding of the interval ends
HAIR = 1e-12


def _free(a: Point, b: Point, centre: Point, leash: float) -> Interval | None:
    """Part of the segment from a to b that is within the leash of the centre, as fractions."""
    d = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    f = (a[0] - centre[0], a[1] - centre[1], a[2] - centre[2])
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    ff = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] - leash * leash
    if dd == 0.0:
        return (0.0, 1.0) if ff <= 0 else None
    df = d[0] * f[0] + d[1] * f[1] + d[2] * f[2]
    root = df * df - dd * ff
    if root < 0:
        return None
    root = math.sqrt(root)
    low, high = max(0.0, (-df - root) / dd), min(1.0, (-df + root) / dd)
    return (low, high) if low <= high + HAIR else None


def leash_is_enough(first: Floats, second: Floats, leash: float) -> bool:
    """Whether the Fréchet distance of two polylines (m,3) and (n,3) is at most `leash`."""
    p, q = first.tolist(), second.tolist()
    leash += HAIR
    if math.dist(p[0], q[0]) > leash or math.dist(p[-1], q[-1]) > leash:
        return False
    p, q = (p * 2 if len(p) == 1 else p), (q * 2 if len(q) == 1 else q)
    reach: dict[int, Interval] = {}  # reachable part of segment j of q while the first walker stands at p[i]
    for j in range(len(q) - 1):
        free = _free(q[j], q[j + 1], p[0], leash)
        if free is None or free[0] > HAIR:
            break
        reach[j] = free
        if free[1] < 1 - HAIR:
            break
    at_start = True  # the second walker may still stand at q[0]
    for i in range(len(p) - 1):
        floor: Interval | None = None
        if at_start:
            floor = _free(p[i], p[i + 1], q[0], leash)
            if floor is None or floor[0] > HAIR:
                floor, at_start = None, False
            elif floor[1] < 1 - HAIR:
                at_start = False
        further: dict[int, Interval] = {}
        pending = sorted(reach)
        j = 0 if floor is not None else (pending[0] if pending else len(q))
        while j < len(q) - 1:
            left = reach.get(j)
            if left is None and floor is None:
                later = [k for k in pending if k > j]
                if not later:
                    break
                j = later[0]
                continue
            right = _free(q[j], q[j + 1], p[i + 1], leash)
            if right is not None:
                low = right[0] if floor is not None or left is None else max(right[0], left[0])
                if low <= right[1] + HAIR:
                    further[j] = (low, right[1])
            top = _free(p[i], p[i + 1], q[j + 1], leash)
            if top is not None and left is None and floor is not None:
                top = (max(top[0], floor[0]), top[1]) if floor[0] <= top[1] + HAIR else None
            floor = top
            j += 1
        if not further and not at_start:
            return False
        reach = further
    end = reach.get(len(q) - 2)
    return end is not None and end[1] >= 1 - HAIR


def frechet_distance(first: Floats, second: Floats, resolution: float = 1e-9) -> float:
    """Fréchet distance of two polylines (m,3) and (n,3), to `resolution`."""
    low = max(math.dist(first[0], second[0]), math.dist(first[-1], second[-1]))
    if leash_is_enough(first, second, low):
        return low
    high = max(low, resolution)
    while not leash_is_enough(first, second, high):
        low, high = high, 2 * high
    while high - low > resolution:
        middle = (low + high) / 2
        low, high = (low, middle) if leash_is_enough(first, second, middle) else (middle, high)
    return high
