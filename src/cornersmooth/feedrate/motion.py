"""Tip and tool axis on a path with their derivatives by the path coordinate."""

from __future__ import annotations

from math import comb

import numpy as np

from cornersmooth.feedrate import arcs, taylor
from cornersmooth.feedrate.cubics import cubics, curved
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.model import Floats, Ints

_NO_SPEED = np.finfo(np.float64).tiny


def derivatives(path: Path, element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
    """First three derivatives (2, m, 3) of tip and tool axis by the path coordinate.

    Per mm, mm², mm³; per rad where the tip stands still; infinite where it comes to a stand.

    Parameters
    ----------
    path : Path
    element : (m,) int64
    share : (m,) float64
        Where on each element: the part of its length for lines and arcs, the parameter t of its half for curves. Curves
        of the paper's method are taken at v = u.
    """
    tip, axis, speed = taylor_along(path, element, share)
    one, two, three = known_by_way(np.concatenate((tip, axis), axis=-1), speed)
    return tuple(np.stack((order[:, :3], order[:, 3:])) for order in (one, two, three))  # type: ignore[return-value]


def known_by_way(series: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
    """First three derivatives by the way, infinite where the tip comes to a stand (see `taylor.by_way`)."""
    with np.errstate(over="ignore", invalid="ignore"):
        one, two, three = taylor.by_way(series, speed)
    one, two, three = (np.where(np.isfinite(order), order, np.inf) for order in (one, two, three))
    return one, two, three


def taylor_along(path: Path, element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
    """Taylor series of tip and unit tool axis, (4, m, 3) each, and of the speed of the coordinate, (3, m).

    By where it is on each element, which is `share` as in `derivatives`.
    """
    count = len(element)
    tip, lever, speed = np.zeros((taylor.ORDERS, count, 3)), np.zeros((taylor.ORDERS, count, 3)), np.zeros((3, count))
    curve = curved(path)[element]
    rows = np.flatnonzero(curve)
    if len(rows):
        tip[:, rows], lever[:, rows], speed[:, rows] = _curves(path, element[rows], share[rows])
    rows = np.flatnonzero(~curve)
    if len(rows):
        tip[:, rows], lever[:, rows], speed[:, rows] = _lines(path, element[rows], share[rows])
    return tip, taylor.normalised(lever), speed


def _curves(path: Path, element: Ints, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Taylor series in t of tip and lever on halves of transitions, and of the speed of the coordinate."""
    found = cubics(path, element)
    powers = found.tip.shape[1]
    shifts = np.stack([t**k for k in range(powers)])
    curves = []
    for curve in (found.tip, found.axis_point):
        around = np.zeros((taylor.ORDERS, len(t), 4))
        for k in range(taylor.ORDERS):
            for power in range(k, powers):
                around[k] += comb(power, k) * shifts[power - k][:, None] * curve[:, power]
        curves.append(taylor.divide(around[..., :3], around[..., 3:]))
    tip, axis_point = curves
    lever = axis_point - tip
    tip[0] += found.origin
    gone = taylor.derivative(tip)
    squared = taylor.dot(gone, gone)
    turning = path.turning[element]
    moving = squared[0] > 0.0
    squared[0] = np.where(moving, squared[0], 1.0)
    speed = taylor.root(squared)
    speed[:, ~moving] = 0.0
    speed[0, ~moving] = _NO_SPEED
    speed[:, turning] = 0.0
    speed[0, turning] = path.length[element[turning]]
    return tip, lever, speed


def _lines(path: Path, element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
    """Taylor series, in the share of the length, of tip and lever on lines and arcs, and of the coordinate's speed."""
    program = path.program
    start, end = path.start[element], path.move[element]
    span, axis_span = path.span[element], path.axis_span[element]
    step = program.tip[end] - program.tip[start]
    turn = path.settings.axis_length * (program.axis[end] - program.axis[start])
    part, axis_part = (np.diff(limits, axis=1) for limits in (span, axis_span))
    fraction, axis_fraction = span[:, :1] + share[:, None] * part, axis_span[:, :1] + share[:, None] * axis_part
    tip = np.zeros((taylor.ORDERS, len(element), 3))
    lever = tip.copy()
    tip[0] = program.tip[start] + fraction * step
    tip[1] = part * step
    lever[0] = (
        path.settings.axis_length * program.axis[start] + axis_fraction * turn + (axis_fraction - fraction) * step
    )
    lever[1] = axis_part * turn + (axis_part - part) * step
    bow = np.flatnonzero(path.kind[element] == Kind.ARC)
    if len(bow):
        tip[:, bow] = arcs.series(program, end[bow], share[bow])
    speed = np.zeros((3, len(element)))
    speed[0] = path.length[element]
    return tip, lever, speed
