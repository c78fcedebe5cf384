"""Curves through several corners, cut at their knots.

Places on a curve are looked for from the straight lines between its knots. A long curve is cut into the parts between
two knots, and each part gets inner knots enough for that.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.splines import CurveTable

#: pieces that a part is divided into, and the turn of the tool up to which that will do, rad; in rotary words half as
#: many will do, since each becomes a curve of a higher degree
_PIECES = {1: np.inf}
_ROTARY_PIECES = _PIECES


def cut_long(curves: CurveTable, *, rotary: bool = False) -> tuple[CurveTable, Bools]:
    """Cut curves through several corners at their knots, so that what is measured is near one place of the path.

    Cubics with all weights 1, distinct inner knots and a parameter that does not run from 0 to 1 are cut; the curve of
    one corner has knots from 0 to 1. `rotary` says that the second triples are degrees. The part between two knots
    belongs to the block whose control point ends it.

    Returns
    -------
    CurveTable
        Parts have knots from 0 to 1 and inner ones, so that places on them are known well enough to begin
        with; each starts where the one before it ends.
    cut : (c,) bool
        Which of the curves are parts.
    """
    size = curves.points + curves.order
    first_knot, first_point = np.cumsum(size) - size, np.cumsum(curves.points) - curves.points
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
        bezier[outer, at] = curves.control[(first_point[own] + place)[outer] + at]  # digit for digit
    bezier[1:][place[1:] > 0, 0] = bezier[:-1][place[1:] > 0, 3]
    row, end = curves.row[owner], curves.end[owner]
    block = end - curves.points[owner] + 4 + k  # of the control point that ends each part
    end = np.where(mine, block, end)
    row = np.where(mine & (k > 0), block, row)
    parts = CurveTable.joined(list(_refined(row[mine], end[mine], bezier, rotary)))
    others = curves.only(np.flatnonzero(~long))
    joined = CurveTable.joined([parts, others])
    return joined, np.isin(joined.row, parts.row)


def _intervals_alone(curves: CurveTable, knot: Ints, point: Ints) -> Floats:
    """(r, 4, 6) Bézier points of the knot intervals behind knots `knot` + 3, from control points `point` on.

    By blossoms: f(b, c, d) is the control point with these inner knots, and f is affine in each argument.
    """
    a, b, c, d, e, f = (curves.knot[knot + shift][:, None] for shift in range(1, 7))
    p0, p1, p2, p3 = (curves.control[point + shift] for shift in range(4))
    second = p1 + (c - b) / (e - b) * (p2 - p1)  # f(c, c, d)
    third = p1 + (d - b) / (e - b) * (p2 - p1)  # f(c, d, d)
    before = p0 + (c - a) / (d - a) * (p1 - p0)  # f(b, c, c)
    behind = p2 + (d - c) / (f - c) * (p3 - p2)  # f(d, d, e)
    start = before + (c - b) / (d - b) * (second - before)
    end = third + (d - c) / (e - c) * (behind - third)
    return np.stack((start, second, third, end), axis=1)


def _refined(row: Ints, end: Ints, bezier: Floats, rotary: bool) -> Iterator[CurveTable]:
    """Cubics with Bézier points (r, 4, 6) as curves with inner knots, from 0 to 1."""
    if rotary:
        turn = np.radians(np.abs(np.diff(bezier[..., 3:], axis=1)).sum(axis=(1, 2)))
    else:
        lever = bezier[..., 3:] - bezier[..., :3]
        size = np.linalg.norm(lever, axis=2)
        unit = lever / np.where(size > 0, size, 1.0)[..., None]
        turn = np.linalg.norm(np.diff(unit, axis=1), axis=2).sum(axis=1)
    least = 0.0
    for number, most in (_ROTARY_PIECES if rotary else _PIECES).items():
        chosen = np.flatnonzero((turn >= least) & (turn < most))
        least = most
        if not len(chosen):
            continue
        knots = np.concatenate(([0.0] * 3, np.arange(number + 1) / number, [1.0] * 3))
        control = _blossoms(knots) @ bezier[chosen]
        count, points = control.shape[:2]
        yield CurveTable(
            row=row[chosen],
            end=end[chosen],
            order=np.full(count, 4, np.int64),
            points=np.full(count, points, np.int64),
            control=control.reshape(-1, 6),
            weight=np.ones(count * points),
            knot=np.tile(knots, count),
        )


def _blossoms(knots: Floats) -> Floats:
    """(k, 4) from the Bézier points of a cubic to its control points on knots from 0 to 1."""
    rows = []
    for j in range(len(knots) - 4):
        x, y, z = knots[j + 1 : j + 4]
        rows.append(
            (
                (1 - x) * (1 - y) * (1 - z),
                x * (1 - y) * (1 - z) + (1 - x) * y * (1 - z) + (1 - x) * (1 - y) * z,
                x * y * (1 - z) + x * (1 - y) * z + (1 - x) * y * z,
                x * y * z,
            )
        )
    return np.array(rows)
