"""Taylor polynomials of one parameter, cut after the third order, and those of tip and tool axis along a path.

A series has its orders along the first axis: ``a[k]`` is the k-th derivative over k!. Products, quotients and roots
follow from comparing coefficients (Griewank and Walther, Evaluating Derivatives, ch. 13), so derivatives are exact.
"""

from __future__ import annotations

import numpy as np

from cornersmooth import arrays
from cornersmooth.arrays import norm
from cornersmooth.feedrate.curves import parameters_at, taylor_series
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.geometry.arcs import arc_series
from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.construction import construction_of

#: coefficients of a series: value and three derivatives
ORDERS = 4


def multiply(a: Floats, b: Floats) -> Floats:
    """Product of two series; shapes broadcast behind the first axis, and the shorter series counts."""
    orders = min(len(a), len(b))
    return np.stack([sum(a[i] * b[k - i] for i in range(k + 1)) for k in range(orders)])


def divide(a: Floats, b: Floats) -> Floats:
    """Quotient of two series."""
    found: list[Floats] = []
    for k in range(min(len(a), len(b))):
        rest = a[k] - sum(found[i] * b[k - i] for i in range(k))
        found.append(rest / b[0])
    return np.stack(found)


def root(a: Floats) -> Floats:
    """Square root of a series with a positive value."""
    found: list[Floats] = [np.sqrt(a[0])]
    for k in range(1, len(a)):
        rest = a[k] - sum(found[i] * found[k - i] for i in range(1, k))
        found.append(rest / (2.0 * found[0]))
    return np.stack(found)


def derivative(a: Floats) -> Floats:
    """Series of the derivative, one order shorter."""
    return np.stack([(k + 1) * a[k + 1] for k in range(len(a) - 1)])


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar product of two Taylor series of vectors along the last axis."""
    return multiply(a, b).sum(axis=-1)


def cross(a: Floats, b: Floats) -> Floats:
    """Vector product of two Taylor series of vectors along the last axis."""
    orders = min(len(a), len(b))
    return np.stack([sum(arrays.cross(a[i], b[k - i]) for i in range(k + 1)) for k in range(orders)])


def normalised(a: Floats) -> Floats:
    """Series of vectors over their lengths."""
    return divide(a, root(dot(a, a))[..., None])


def by_way(a: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
    """First three derivatives by the way s of a series (4, m, d) in u, whose ds/du is the series `speed` (3, m).

    Infinite where ds/du is zero.
    """
    found, series = [], a
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(3):
            series = divide(derivative(series), speed[: len(series) - 1, :, None])
            found.append(np.where(np.isfinite(series[0]), series[0], np.inf))
    return found[0], found[1], found[2]


_NO_SPEED = np.finfo(np.float64).tiny

#: turn over a way in which a curve is straight up to rounding, over that way
_STRAIGHT = 1e-12


def taylor_along(path: Path, element: Ints, share: Floats, orders: int = ORDERS) -> tuple[Floats, Floats, Floats]:
    """Taylor series of tip and unit tool axis, (orders, m, 3) each, and of the coordinate's speed, (orders - 1, m).

    At shares (m,) of elements (m,): the part of the length of lines and arcs, the parameter t of the half of curves.
    Curves of the paper's method are taken at v = u.
    """
    count = len(element)
    tip, lever = np.zeros((2, orders, count, 3))
    speed = np.zeros((orders - 1, count))
    row = path.row[element]
    curve, line = np.flatnonzero(row >= 0), np.flatnonzero(row < 0)
    speed[0] = path.length[element]
    if len(curve):
        own, t = row[curve], share[curve]
        around, axis_point = (
            taylor_series(powers[own], t, orders) for powers in (path.curves.tip, path.curves.axis_point)
        )
        lever[:, curve] = axis_point - around
        around[0] += path.curves.origin[own]
        tip[:, curve] = around
        moving = np.flatnonzero(~path.turning[element[curve]])
        speed[:, curve[moving]] = speed_of(around[:, moving])
    if len(line):
        tip[:, line], lever[:, line] = _lines(path, element[line], share[line], orders)
    return tip, normalised(lever), speed


def speed_of(tip: Floats) -> Floats:
    """Taylor series of the speed of a tip by its parameter; next to nothing where it stands."""
    gone = derivative(tip)
    squared = dot(gone, gone)
    moving = squared[0] > 0.0
    squared[0] = np.where(moving, squared[0], 1.0)
    speed = root(squared)
    speed[:, ~moving] = 0.0
    speed[0, ~moving] = _NO_SPEED
    return speed


def _lines(path: Path, element: Ints, share: Floats, orders: int) -> tuple[Floats, Floats]:
    """Taylor series, in the share of the length, of tip and lever on lines and arcs."""
    program, height = path.program, path.settings.axis_length
    start, end = path.start[element], path.move[element]
    span, axis_span = path.span[element], path.axis_span[element]
    step, turn = (values[end] - values[start] for values in (program.tip, height * program.axis))
    part, axis_part = (np.diff(limits, axis=1) for limits in (span, axis_span))
    fraction, axis_fraction = span[:, :1] + share[:, None] * part, axis_span[:, :1] + share[:, None] * axis_part
    tip, lever = np.zeros((2, orders, len(element), 3))
    tip[0] = program.tip[start] + fraction * step
    tip[1] = part * step
    lever[0] = height * program.axis[start] + axis_fraction * turn + (axis_fraction - fraction) * step
    lever[1] = axis_part * turn + (axis_part - part) * step
    bow = np.flatnonzero(path.kind[element] == Kind.ARC)
    if len(bow):
        tip[:, bow] = arc_series(program, np.searchsorted(program.arcs.pose, end[bow]), share[bow])[:orders]
    return tip, lever


def shares_at(path: Path, element: Ints, local: Floats) -> Floats:
    """Where (m,) a coordinate `local` from each element's start lies: share of the length, or parameter t on curves."""
    share: Floats = local / np.maximum(path.length[element], _NO_SPEED)
    rows = np.flatnonzero(path.bent[element])
    if len(rows):
        row, which = np.unique(path.row[element[rows]], return_inverse=True)
        share[rows] = parameters_at(path.curves.tip[row], path.curves.half[row], which, local[rows])
    return share


def poses(path: Path, element: Ints, local: Floats) -> tuple[Floats, Floats, Floats]:
    """Tip and axis (m, 3) and curvature of the tip path (m,) at a coordinate `local` (m,) from each element's start."""
    share = shares_at(path, element, local)
    tip, axis, _ = taylor_along(path, element, share, 3)
    kappa = curvature(tip)
    corner = np.append(path.curves.corner, -1)[path.row[element]]
    own = np.flatnonzero(corner >= 0)
    if len(own) and path.corners is not None:
        u = (path.curves.half[path.row[element[own]]] + share[own]) / 2.0
        method = construction_of(path.settings.method)
        found = method.axes(path.program, path.corners, path.settings, corner[own], u)
        axis[0, own] = axis[0, own] if found is None else found
    return tip[0], axis[0], kappa


def curvature(tip: Floats) -> Floats:
    """Curvature (m,), 1/mm, from three Taylor coefficients of the tip; 0 where it is straight up to rounding."""
    speed, bend, across = norm(tip[1]), 2.0 * norm(tip[2]), 2.0 * norm(arrays.cross(tip[1], tip[2]))
    straight = across <= _STRAIGHT * speed * bend
    return np.where(straight, 0.0, across / np.where(straight, 1.0, speed**3))
