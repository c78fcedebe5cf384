"""Curves of a run of blocks as control points, weights and knots.

FANUC's G06.2, Siemens' BSPLINE and POLY, HEIDENHAIN's SPL.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import ranges, spread, starts
from cornersmooth.control.words import BSPLINE, NURBS, POLY, SPL, Table
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Curves, Problem

#: FANUC: order of a curve whose first block has no P (B-63324EN/03 4.17)
DEFAULT_ORDER = 4

#: Siemens: order of BSPLINE SD=3, and the largest weight PW
SPLINE_ORDER, LARGEST_WEIGHT = 4, 3.0

#: mm or degrees by which an SPL may begin beside where the block before has ended (iTNC 530: 1 µm), and rounding
_GAP = 1.1e-3

#: of a cubic by its Bézier points
_KNOTS = np.array([0.0] * 4 + [1.0] * 4)


@dataclass(frozen=True)
class Blocks:
    """A run of r motion blocks."""

    table: Table
    six: Floats  #: (r, 6): tip and second triple after every block, in the order of `letters`
    before: Floats  #: (6,): in front of the run
    placed: Bools  #: (r,): blocks with words of position
    code: Floats  #: (r,): G word of group 01, or what stands for it
    letters: str
    problems: list[Problem]  #: takes what breaks the rules

    def complain(self, code: str, rows: Ints, wrong: Bools, text: str) -> None:
        """Note a problem for each of some blocks where something is wrong."""
        self.problems.extend(Problem.at(code, wrong, self.table.line[rows], text))

    def column(self, name: str, rows: Ints, default: float) -> Floats:
        """Words of some blocks, or what counts where there is none."""
        values = self.table.column(name)[rows]
        return np.where(np.isnan(values), default, values)

    def starts(self, rows: Ints) -> Floats:
        """(k, 6) where the blocks in front of some end."""
        return np.vstack((self.before, self.six))[rows]

    def factors(self, rows: Ints, name: str) -> Floats:
        """(k, 6) coefficients of each axis, zero where there is none."""
        columns = [self.column(name.format(letter), rows, 0.0) for letter in self.letters]
        return np.stack(columns + [np.zeros(len(rows))] * (6 - len(columns)), axis=1)


def curves_of(blocks: Blocks) -> Curves:
    """Curves of all kinds in a run of blocks."""
    found = [_knot_curves(blocks)] if (blocks.code == NURBS).any() else []
    for kind, read in ((BSPLINE, _interval_curves), (POLY, _poly_curves), (SPL, _spl_curves)):
        if (rows := np.flatnonzero(blocks.placed & (blocks.code == kind))).size:
            found.append(read(blocks, rows))
    return Curves.joined(found)


def _knot_curves(blocks: Blocks) -> Curves:
    """Curves of FANUC's G06.2 (B-63324EN/03 4.17): a knot K and a weight R in every block."""
    table, complain = blocks.table, blocks.complain
    rows = np.flatnonzero(blocks.code == NURBS)
    later = table.column("G")[rows] != NURBS
    begun = np.cumsum(~later) > 0
    complain("CS511", rows[:1], ~begun[:1], "curve blocks without a G6.2 before them")
    rows, later = rows[begun], later[begun]
    start = np.flatnonzero(~later)
    if not len(start):
        return Curves()
    head, size = rows[start], np.diff(start, append=len(rows))
    is_point = blocks.placed[rows]
    points = np.add.reduceat(is_point, start, dtype=np.int64)
    order = blocks.column("P", head, DEFAULT_ORDER).astype(np.int64)
    knot, single = blocks.column("K", rows, 0.0), size - points

    def beside(change: Bools) -> Bools:
        """Blocks that begin no curve, and differ so from the one before."""
        return np.append(False, change) & later

    complain("CS512", rows, np.isnan(table.column("K")[rows]), "a curve block without its knot K")
    fewer, more = single < order, single > order
    complain("CS513", head, fewer, "fewer blocks with only a knot than the order of the curve asks for")
    complain("CS513", head, more, "more blocks with only a knot than the order of the curve asks for")
    few = (points < order) | (order < 2)
    complain("CS514", head, few, "fewer control points than the order of the curve")
    after = beside(is_point[1:] & ~is_point[:-1])
    complain("CS515", rows, after, "a control point after the blocks with only a knot")
    late = np.zeros(len(rows), np.bool_)
    for letter in {*blocks.letters} & table.columns.keys() - {"K"}:
        column = table.columns[letter]
        late |= ~np.isnan(column[rows]) & np.repeat(np.isnan(column[head]), size)
    complain("CS511", rows, late, "an axis that the first block of the curve does not name")
    feed = ~np.isnan(table.column("F")[rows]) & later
    complain("CS511", rows, feed, "a feed inside a curve, which has one for all of it")
    falls = beside(np.diff(knot) < 0)
    complain("CS516", rows, falls, "a knot below the one before it")
    # the first `order` and the last `order` knots are equal, and no others so many
    end, inner = start + size - 1, np.clip(np.minimum(order, size), 1, None) - 1
    unclamped = (knot[start + inner] != knot[start]) | (knot[end - inner] != knot[end])
    complain("CS517", head, unclamped, "first or last knots that are not all equal")
    crowded = _crowded(knot, start, size, order) & np.repeat(single == order, size)
    complain("CS517", rows, crowded, "a knot that is repeated more often than the order of the curve")
    point_rows = rows[is_point]
    weight = blocks.column("R", point_rows, 1.0)
    wrong = (weight <= 0) | ~np.isfinite(weight)
    complain("CS518", point_rows, wrong, "a weight R that is not positive")
    weight[wrong] = 1.0  # it is a problem already; what follows wants curves that can be measured
    bad = (single != order) | few | unclamped | np.logical_or.reduceat(falls | crowded, start)
    order, knot = _measurable(knot, start, order, points, bad)
    point_end = point_rows[np.cumsum(points) - 1]
    return Curves(head, order, points, blocks.six.take(point_rows, axis=0), weight, knot, point_end)


def _crowded(knot: Floats, start: Ints, size: Ints, order: Ints) -> Bools:
    """(q,) whether a knot is equal to the one `order` knots before it in its curve: that does not meet its points."""
    least = max(int(order.min()), 1)
    if not (knot[least:] == knot[:-least]).any():  # as nearly always
        return np.zeros(len(knot), np.bool_)
    before = np.arange(len(knot)) - np.repeat(order, size)
    own = (before >= np.repeat(start, size)) & (np.repeat(order, size) > 0)
    return own & (knot == knot[np.maximum(before, 0)])


def _measurable(knot: Floats, start: Ints, order: Ints, points: Ints, bad: Bools) -> tuple[Ints, Floats]:
    """Orders and knots, those of `bad` curves, which are problems already, replaced by such that can be measured."""
    if not bad.any():
        return order, knot
    fitting = np.where(bad, np.clip(order, 1, np.maximum(points, 1)), order)
    parts = []
    for k, (count, own) in enumerate(zip(points.tolist(), fitting.tolist(), strict=True)):
        inner = np.arange(1.0, max(count - own, 0) + 1)
        clamped = np.concatenate((np.zeros(own), inner, np.full(own, len(inner) + 1.0)))
        parts.append(clamped if bad[k] else knot[start[k] : start[k] + count + own])
    return fitting, np.concatenate(parts)


def _interval_curves(blocks: Blocks, rows: Ints) -> Curves:
    """Curves of Siemens' BSPLINE (programming manual 12/2019): control points with knot intervals PL and weights PW.

    The first control point is where the block before has ended. With the knots u the block of control point j has
    PL = u[j+2] − u[j+1]. Where three knots meet a spline passes its control point, and a new curve begins.
    """
    complain = blocks.complain
    opens = np.append(True, np.diff(rows) != 1)
    closes = np.append(opens[1:], True)
    interval, weight = blocks.table.column("PL")[rows], blocks.column("PW", rows, 1.0)
    complain("CS512", rows, np.isnan(interval), "a spline block without its knot interval PL")
    complain("CS516", rows, interval < 0, "a negative knot interval PL")
    interval = np.maximum(np.nan_to_num(interval), 0.0)
    beyond = (weight <= 0) | (weight > LARGEST_WEIGHT)
    complain("CS518", rows, beyond, "a weight PW that is not above 0 and up to 3")
    weight = np.where(weight <= 0, 1.0, weight)
    loose = (opens | closes) & (interval != 0)
    complain("CS517", rows, loose, "a spline whose first or last interval is not zero")
    # a curve begins with the control point in front of the block `first`
    passed = np.append(False, (interval[:-1] == 0) & (interval[1:] == 0)) & ~opens
    first = np.flatnonzero(opens | passed)
    count = np.diff(first, append=len(rows))
    points, order = count + 1, np.full(len(first), SPLINE_ORDER, np.int64)
    few = points < SPLINE_ORDER
    complain("CS514", rows[first], few, "fewer control points than the order of the curve")
    control = blocks.starts(ranges(rows[first], points))
    weights = np.append(1.0, weight)[ranges(first, points)]
    weights[starts(points)[:-1][opens[first]]] = 1.0  # the first control point of a spline is no block's own
    # four equal knots at each end; between them knots 3 to `count` + 1 follow from the intervals of the blocks
    size = points + SPLINE_ORDER
    start, used = starts(size)[:-1], np.repeat(count - 1, size)
    block = ranges(first - 3, size)
    within = block - np.repeat(first, size)
    risen = np.cumsum(np.where((within >= 0) & (within < used), interval.take(block, mode="clip"), 0.0))
    knot = risen - np.repeat(risen[start], size)
    bad = few | (interval[first] != 0) | (interval[first + count - 1] != 0)
    order, knot = _measurable(knot, start, order, points, bad)
    return Curves(rows[first], order, points, control, weights, knot, rows[first + count - 1])


def _poly_curves(blocks: Blocks, rows: Ints) -> Curves:
    """Curves of POLY: ``PO[X]=(end, a2, a3)`` of a parameter p from 0 to PL; a2 and a3 are in columns X2 and X3.

    The control takes a0 from where the block before ended; a1 follows from the end.
    """
    start, end, length = blocks.starts(rows), blocks.six[rows], blocks.column("PL", rows, 1.0)
    blocks.complain("CS516", rows, length <= 0, "a parameter interval PL that is not positive")
    length = np.where(length > 0, length, 1.0)[:, None]
    square, cube = blocks.factors(rows, "{}2") * length**2, blocks.factors(rows, "{}3") * length**3
    return _bezier_curves(rows, rows, _bezier(start, end - start - square - cube, square, end))


def _spl_curves(blocks: Blocks, rows: Ints) -> Curves:
    """Curves of SPL: X(t) = K3X·t³ + K2X·t² + K1X·t + X with t from 1 to 0."""
    end = blocks.six[rows]
    cube, square, slope = (blocks.factors(rows, f"K{power}{{}}") for power in (3, 2, 1))
    start = end + slope + square + cube
    off = np.abs(start - blocks.starts(rows)).max(axis=1) > _GAP
    text = "a spline begins more than a micrometre beside where the block before has ended"
    blocks.complain("CS519", rows, off, text)
    return _bezier_curves(rows, rows, _bezier(end, slope, square, start)[:, ::-1])


def _bezier(start: Floats, slope: Floats, square: Floats, end: Floats) -> Floats:
    """(k, 4, 6) Bézier points of cubics by their first coefficients."""
    return np.stack((start, start + slope / 3, start + 2 * slope / 3 + square / 3, end), axis=1)


def _bezier_curves(row: Ints, end: Ints, points: Floats) -> Curves:
    """Cubics by their Bézier points (c, 4, 6), from blocks `row` to `end`, of a parameter from 0 to 1."""
    count = len(row)
    four = np.full(count, 4, np.int64)
    return Curves(row, four, four, points.reshape(-1, 6), np.ones(4 * count), np.tile(_KNOTS, count), end)


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
    long = (curves.order == 4) & (curves.points > 4) & (curves.knot[first_knot + size - 1] != 1.0)
    if long.any():
        rises = np.append(np.diff(curves.knot) > 0, False)
        _, within = spread(size)
        wanted = (within >= 3) & (within < np.repeat(curves.points, size))
        long &= np.logical_and.reduceat(curves.weight == 1.0, first_point)
        long &= np.logical_and.reduceat(rises | ~wanted, first_knot)
    if not long.any():
        return curves, long
    number = np.where(long, curves.points - 3, 1)
    owner, k = spread(number)
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
    parts = _bezier_curves(row[mine], end[mine], bezier)
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
