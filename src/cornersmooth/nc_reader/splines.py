"""Curves of a run of blocks as control points, weights and knots.

FANUC's G06.2, Siemens' BSPLINE and POLY, HEIDENHAIN's SPL.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Curves, Problem
from cornersmooth.nc_reader.words import BSPLINE, NURBS, POLY, SPL, Table

#: FANUC: order of a curve whose first block has no P (B-63324EN/03 4.17)
DEFAULT_ORDER = 4

#: Siemens: order of BSPLINE SD=3, and the largest weight PW
SPLINE_ORDER, LARGEST_WEIGHT = 4, 3.0

#: mm or degrees by which an SPL may begin beside where the block before has ended (iTNC 530: 1 µm), and rounding
_GAP = 1.1e-3

#: of a cubic by its Bézier points
_KNOTS = np.array([0.0] * 4 + [1.0] * 4)


def curves_of(
    table: Table,
    six: Floats,
    placed: Bools,
    code: Floats,
    before: Floats,
    letters: str,
    problems: list[Problem],
) -> Curves:
    """Curves of all kinds in a run of r blocks.

    Parameters
    ----------
    six : (r, 6) float64
        Tip and second triple after every block, in the order of `letters`; `before`: in front of the run.
    placed, code : (r,)
        Blocks with words of position; G word of group 01, or what stands for it.
    problems : list of Problem
        Takes what breaks the rules.
    """
    found = []
    if (nurbs := code == NURBS).any():
        found.append(_knot_curves(table, six, placed, nurbs, letters, problems))
    if (spline := placed & (code == BSPLINE)).any():
        found.append(_interval_curves(table, six, spline, before, problems))
    for kind, read in ((POLY, _poly_curves), (SPL, _spl_curves)):
        if (polynomial := placed & (code == kind)).any():
            found.append(read(table, six, before, polynomial, letters, problems))
    return Curves.joined(found)


def _knot_curves(
    table: Table, six: Floats, placed: Bools, curve: Bools, letters: str, problems: list[Problem]
) -> Curves:
    """Curves of FANUC's G06.2 (B-63324EN/03 4.17): a knot K and a weight R in every block."""
    rows = np.flatnonzero(curve)
    later = table.column("G")[rows] != NURBS
    start = np.flatnonzero(~later)
    if len(start) == 0 or start[0] != 0:
        problems.append(Problem("CS511", 0, int(table.line[rows[0]]), "curve blocks without a G6.2 before them"))
        first = start[0] if len(start) else len(rows)
        rows, later, start = rows[first:], later[first:], start - first
    if not len(start):
        return Curves()
    line, head = table.line[rows], rows[start]
    size = np.diff(start, append=len(rows))
    is_point = placed[rows]
    points = np.add.reduceat(is_point, start, dtype=np.int64)
    given = table.column("P")[head]
    order = np.where(np.isnan(given), DEFAULT_ORDER, given).astype(np.int64)
    knot, weight = table.column("K")[rows], table.column("R")[rows][is_point]
    weight[np.isnan(weight)] = 1.0

    def complain(mask: Bools, code: str, text: str) -> None:
        problems.extend(Problem.at(code, mask, line if len(mask) == len(rows) else line[start], text))

    def beside(change: Bools) -> Bools:
        """Blocks that begin no curve, and differ so from the one before."""
        return np.append(False, change) & later

    complain(beside(np.diff(line) != 1), "CS510", "something else is between the blocks of a curve")
    missing = np.isnan(knot)
    complain(missing, "CS512", "a curve block without its knot K")
    knot[missing] = 0.0
    single = size - points
    complain(single < order, "CS513", "fewer blocks with only a knot than the order of the curve asks for")
    complain(single > order, "CS513", "more blocks with only a knot than the order of the curve asks for")
    complain((points < order) | (order < 2), "CS514", "fewer control points than the order of the curve")
    complain(beside(is_point[1:] & ~is_point[:-1]), "CS515", "a control point after the blocks with only a knot")
    late = np.zeros(len(rows), np.bool_)
    for letter in sorted({*letters} & table.columns.keys() - {"K"}):
        unnamed = np.isnan(table.columns[letter].take(head))
        if unnamed.any():
            late |= ~np.isnan(table.columns[letter][rows]) & np.repeat(unnamed, size)
    complain(late, "CS511", "an axis that the first block of the curve does not name")
    feed = ~np.isnan(table.column("F")[rows]) & later
    complain(feed, "CS511", "a feed inside a curve, which has one for all of it")
    falls = beside(np.diff(knot) < 0)
    complain(falls, "CS516", "a knot below the one before it")
    unclamped = _unclamped(knot, start, size, order)
    complain(unclamped, "CS517", "first or last knots that are not all equal")
    crowded = _crowded(knot, start, size, order) & np.repeat(single == order, size)
    complain(crowded, "CS517", "a knot that is repeated more often than the order of the curve")
    point_rows = rows[is_point]
    wrong = (weight <= 0) | ~np.isfinite(weight)
    problems += Problem.at("CS518", wrong, table.line[point_rows], "a weight R that is not positive")
    weight[wrong] = 1.0  # it is a problem already; what follows wants curves that can be measured
    bad = (single != order) | (points < order) | (order < 2) | unclamped
    bad |= np.logical_or.reduceat(falls | crowded, start)
    if bad.any():
        order, knot = _replaced(knot, start, order, points, bad)
    return Curves(
        element=head,
        end=point_rows[np.cumsum(points) - 1],
        order=order,
        points=points,
        point=six[point_rows],
        weight=weight,
        knot=knot,
    )


def _replaced(knot: Floats, start: Ints, order: Ints, points: Ints, bad: Bools) -> tuple[Ints, Floats]:
    """Orders and knots with those of malformed curves replaced by such that can be measured."""
    fitting = np.where(bad, np.clip(order, 1, np.maximum(points, 1)), order)
    parts = []
    for k, (count, own) in enumerate(zip(points.tolist(), fitting.tolist(), strict=True)):
        inner = np.arange(1.0, max(count - own, 0) + 1)
        clamped = np.concatenate((np.zeros(own), inner, np.full(own, len(inner) + 1.0)))
        parts.append(clamped if bad[k] else knot[start[k] : start[k] + count + own])
    return fitting, np.concatenate(parts)


def _unclamped(knot: Floats, start: Ints, size: Ints, order: Ints) -> Bools:
    """(c,) whether the first `order` or the last `order` knots of a curve, which do not fall, differ."""
    end = start + size - 1
    inner = np.clip(np.minimum(order, size), 1, None) - 1
    return (knot[start + inner] != knot[start]) | (knot[end - inner] != knot[end])


def _crowded(knot: Floats, start: Ints, size: Ints, order: Ints) -> Bools:
    """(q,) whether a knot is equal to the one `order` knots before it in its curve: that does not meet its points."""
    least = max(int(order.min()), 1)
    if not (knot[least:] == knot[:-least]).any():  # as nearly always
        return np.zeros(len(knot), np.bool_)
    before = np.arange(len(knot)) - np.repeat(order, size)
    own = (before >= np.repeat(start, size)) & (np.repeat(order, size) > 0)
    return own & (knot == knot[np.maximum(before, 0)])


def _interval_curves(table: Table, six: Floats, spline: Bools, before: Floats, problems: list[Problem]) -> Curves:
    """Curves of Siemens' BSPLINE (programming manual 12/2019): control points with knot intervals PL and weights PW.

    The first control point is where the block before has ended. With the knots u the block of control point j has
    PL = u[j+2] − u[j+1]. Where three knots meet a spline passes its control point, and a new curve begins.
    """
    rows = np.flatnonzero(spline)
    opens = np.append(True, np.diff(rows) != 1)

    def complain(mask: Bools, code: str, text: str) -> None:
        problems.extend(Problem.at(code, mask, table.line[rows], text))

    interval, weight = table.column("PL")[rows], table.column("PW")[rows]
    complain(np.isnan(interval), "CS512", "a spline block without its knot interval PL")
    complain(interval < 0, "CS516", "a negative knot interval PL")
    interval = np.maximum(np.nan_to_num(interval), 0.0)
    weight = np.where(np.isnan(weight), 1.0, weight)
    complain((weight <= 0) | (weight > LARGEST_WEIGHT), "CS518", "a weight PW that is not above 0 and up to 3")
    weight = np.where(weight <= 0, 1.0, weight)
    closes = np.append(opens[1:], True)
    complain((opens | closes) & (interval != 0), "CS517", "a spline whose first or last interval is not zero")
    # a curve begins with the control point in front of the block `first`
    passed = np.append(False, (interval[:-1] == 0) & (interval[1:] == 0)) & ~opens
    first = np.flatnonzero(opens | passed)
    count = np.diff(np.append(first, len(rows)))
    points = count + 1
    short = np.zeros(len(rows), np.bool_)
    short[first[points < SPLINE_ORDER]] = True
    complain(short, "CS514", "fewer control points than the order of the curve")
    index = np.repeat(rows[first] - 1 - np.cumsum(points) + points, points) + np.arange(int(points.sum()))
    control = np.vstack((before, six))[index + 1]
    own = np.concatenate(([1.0], weight))
    weights = own[np.repeat(first - np.cumsum(points) + points, points) + np.arange(int(points.sum()))]
    # the first control point of a spline is no block's own
    weights[(np.cumsum(points) - points)[opens[first]]] = 1.0
    knot = _knots_of(interval, first, count)
    order = np.full(len(first), SPLINE_ORDER, np.int64)
    bad = (points < SPLINE_ORDER) | (interval[first] != 0) | (interval[first + count - 1] != 0)
    if bad.any():
        size = points + SPLINE_ORDER
        order, knot = _replaced(knot, np.cumsum(size) - size, order, points, bad)
    return Curves(
        element=rows[first],
        end=rows[first + count - 1],
        order=order,
        points=points,
        point=control,
        weight=weights,
        knot=knot,
    )


def _knots_of(interval: Floats, first: Ints, count: Ints) -> Floats:
    """Knots of curves whose blocks carry intervals, `count` of them from `first` on: four equal ones at each end."""
    size = count + 1 + SPLINE_ORDER
    start = np.cumsum(size) - size
    steps = np.zeros(int(size.sum()))
    # knots 3 to count + 1 follow from the intervals of the blocks; those behind are equal
    used = np.maximum(count - 1, 0)
    block = np.arange(int(used.sum())) - np.repeat(np.cumsum(used) - used, used)
    steps[np.repeat(start, used) + 3 + block] = interval[np.repeat(first, used) + block]
    total = np.cumsum(steps)
    return total - np.repeat(total[start], size)


def _poly_curves(
    table: Table, six: Floats, before: Floats, poly: Bools, letters: str, problems: list[Problem]
) -> Curves:
    """Curves of POLY: ``PO[X]=(end, a2, a3)`` of a parameter p from 0 to PL; a2 and a3 are in columns X2 and X3.

    The control takes a0 from where the block before ended; a1 follows from the end.
    """
    rows = np.flatnonzero(poly)
    start, end = np.vstack((before, six))[rows], six[rows]
    length = table.column("PL")[rows]
    length = np.where(np.isnan(length), 1.0, length)
    text = "a parameter interval PL that is not positive"
    problems += Problem.at("CS516", length <= 0, table.line[rows], text)
    length = np.where(length > 0, length, 1.0)[:, None]
    square = _factors(table, rows, letters, "{}2") * length**2
    cube = _factors(table, rows, letters, "{}3") * length**3
    slope = end - start - square - cube
    return _bezier_curves(
        rows, rows, np.stack((start, start + slope / 3, start + 2 * slope / 3 + square / 3, end), axis=1)
    )


def _spl_curves(table: Table, six: Floats, before: Floats, spl: Bools, letters: str, problems: list[Problem]) -> Curves:
    """Curves of SPL: X(t) = K3X·t³ + K2X·t² + K1X·t + X with t from 1 to 0."""
    rows = np.flatnonzero(spl)
    end = six[rows]
    cube, square, slope = (_factors(table, rows, letters, f"K{power}{{}}") for power in (3, 2, 1))
    start = end + slope + square + cube
    off = np.abs(start - np.vstack((before, six))[rows]).max(axis=1)
    text = "a spline begins more than a micrometre beside where the block before has ended"
    problems += Problem.at("CS519", off > _GAP, table.line[rows], text)
    return _bezier_curves(rows, rows, np.stack((start, end + 2 * slope / 3 + square / 3, end + slope / 3, end), axis=1))


def _factors(table: Table, rows: Ints, letters: str, name: str) -> Floats:
    """(k, 6) coefficients of each axis, zero where there is none."""
    columns = [np.nan_to_num(table.column(name.format(letter))[rows]) for letter in letters]
    columns += [np.zeros(len(rows))] * (6 - len(columns))
    return np.stack(columns, axis=1)


def _bezier_curves(row: Ints, end: Ints, points: Floats) -> Curves:
    """Cubics by their Bézier points (c, 4, 6), from blocks `row` to `end`, of a parameter from 0 to 1."""
    count = len(row)
    return Curves(
        element=row,
        end=end,
        order=np.full(count, 4, np.int64),
        points=np.full(count, 4, np.int64),
        point=points.reshape(-1, 6),
        weight=np.ones(4 * count),
        knot=np.tile(_KNOTS, count),
    )


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
        within = np.arange(len(curves.knot)) - np.repeat(first_knot, size)
        wanted = (within >= 3) & (within < np.repeat(curves.points, size))
        long &= np.logical_and.reduceat(curves.weight == 1.0, first_point)
        long &= np.logical_and.reduceat(rises | ~wanted, first_knot)
    if not long.any():
        return curves, long
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
