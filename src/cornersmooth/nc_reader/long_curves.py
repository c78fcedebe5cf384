"""Curves through several corners, cut at their knots: each part belongs to one block, and is near one place."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Curves
from cornersmooth.nc_reader.splines import bezier_curves


def cut_long(curves: Curves) -> tuple[Curves, Bools]:
    """Cut curves through several corners at their knots, so that what is measured is near one place of the path.

    Cubics with all weights 1, distinct inner knots and a parameter that does not run from 0 to 1 are cut; the curve of
    one corner has knots from 0 to 1. The part between two knots belongs to the block whose control point ends it.

    Returns
    -------
    Curves
        Each part has knots from 0 to 1, and starts where the one before it ends.
    cut : (c,) bool
        Which of the curves are parts.
    """
    size, first_knot, first_point = curves.points + curves.order, curves.first_knot, curves.first_point
    plain = np.logical_and.reduceat(curves.weight == 1.0, first_point) & (curves.order == 4)
    rises = np.append(np.diff(curves.knot) > 0, False)
    within = np.arange(len(curves.knot)) - np.repeat(first_knot, size)
    wanted = (within >= 3) & (within < np.repeat(curves.points, size))
    long = plain & (curves.points > 4) & np.logical_and.reduceat(rises | ~wanted, first_knot)
    long &= curves.knot[first_knot + size - 1] != 1.0
    if not long.any():
        return curves, np.zeros(len(curves), np.bool_)
    number = np.where(long, curves.points - 3, 1)
    owner = np.repeat(np.arange(len(curves)), number)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(number) - number, number)
    mine = long[owner]
    own, place = owner[mine], k[mine]
    bezier = _intervals_alone(curves, first_knot[own] + place, first_point[own] + place)
    for outer, at in ((place == 0, 0), (place == curves.points[own] - 4, 3)):
        bezier[outer, at] = curves.point[(first_point[own] + place)[outer] + at]  # digit for digit
    bezier[1:][place[1:] > 0, 0] = bezier[:-1][place[1:] > 0, 3]
    row, end = curves.element[owner], curves.end[owner]
    block = end - curves.points[owner] + 4 + k  # of the control point that ends each part
    end = np.where(mine, block, end)
    row = np.where(mine & (k > 0), block, row)
    parts = bezier_curves(row[mine], end[mine], bezier)
    others = curves.only(np.flatnonzero(~long))
    joined = Curves.joined([parts, others])
    return joined, np.isin(joined.element, parts.element)


def _intervals_alone(curves: Curves, knot: Ints, point: Ints) -> Floats:
    """(r, 4, 6) Bézier points of the knot intervals behind knots `knot` + 3, from control points `point` on.

    By blossoms: f(b, c, d) is the control point with these inner knots, and f is affine in each argument.
    """
    a, b, c, d, e, f = (curves.knot[knot + shift][:, None] for shift in range(1, 7))
    p0, p1, p2, p3 = (curves.point[point + shift] for shift in range(4))
    second = p1 + (c - b) / (e - b) * (p2 - p1)  # f(c, c, d)
    third = p1 + (d - b) / (e - b) * (p2 - p1)  # f(c, d, d)
    before = p0 + (c - a) / (d - a) * (p1 - p0)  # f(b, c, c)
    behind = p2 + (d - c) / (f - c) * (p3 - p2)  # f(d, d, e)
    start = before + (c - b) / (d - b) * (second - before)
    end = third + (d - c) / (e - c) * (behind - third)
    return np.stack((start, second, third, end), axis=1)
