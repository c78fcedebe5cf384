"""Rows that are no lines: arcs, splines and polynomials as words of their blocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import ranges, some_rows
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc.circles import Circles
from cornersmooth.nc.coordinates import BlockRows, Coordinates
from cornersmooth.text import RowFormat, format_number, to_ticks

#: texts, and which of them each of some rows has
Part = tuple[list[bytes], Ints]

#: control points that a curve has more than knot intervals
_DEGREE = 3

#: combinations of texts that are made whether a row has them or not
_FEW = 256


@dataclass(frozen=True)
class Shape:
    """Words of k rows on curves or arcs."""

    rows: Bools  #: (r,) which rows these are
    code: Part  #: before the numbers, in place of the code of a line
    behind: tuple[Part, ...] = ()  #: after the numbers, before the feed
    after: Part | None = None  #: blocks that follow
    #: other numbers than those of lines: their format, and (k, c) ticks
    numbers: tuple[RowFormat | SplFormat, Ints] | None = None


def spelt(values: Floats | Ints, write: Callable[[float], str]) -> Part:
    """A text for each distinct value; mostly the first ones are all that there are."""
    numbers: NDArray[Any] = np.array(sorted({*values[:_FEW].tolist()}), values.dtype)
    if len(numbers) == 1 and (values == numbers).all():
        return [write(numbers[0].item()).encode()], np.zeros(len(values), np.int64)
    which = np.searchsorted(numbers, values)
    if len(values) > _FEW and (numbers.take(which, mode="clip") != values).any():
        numbers, which = np.unique(values, return_inverse=True)
    return [write(value).encode() for value in numbers.tolist()], which.reshape(-1)


def joined(*parts: Part) -> Part:
    """Texts that stand side by side, and which of them each row has; of many, those that some row has."""
    texts, ids = [b""], np.zeros(len(parts[0][1]), np.int64)
    for more, which in parts:
        if len(more) == 1:
            texts = [text + more[0] for text in texts]
        elif len(texts) == 1:
            texts, ids = [texts[0] + text for text in more], which
        else:
            count, ids = len(more), ids * len(more) + which
            used = np.arange(count * len(texts))
            if len(used) > _FEW:
                used = np.unique(ids)
                ids = np.searchsorted(used, ids)
            texts = [texts[k // count] + more[k % count] for k in used.tolist()]
    return texts, ids


def prepared(rows: BlockRows, at: Coordinates) -> BlockRows:
    """The rows that become blocks: one for each knot interval of polynomials, none for where a BSPLINE begins."""
    if at.form.curve == "bspline":
        if rows.spline is not None:
            rows = replace(rows, spline=_intervals(rows.spline, rows.curve))
        return some_rows(rows, rows.curve != 1)
    return _spans(rows, at.decimals) if at.form.curve in ("poly", "spl") else rows


def shapes_of(rows: BlockRows, at: Coordinates, circles: Circles, *, open_spline: bool) -> list[Shape]:
    """Words of rows on arcs and on curves, where there are any. `open_spline`: the block before is on a curve."""
    shapes = []
    if rows.arc is not None and (on_arc := rows.arc >= 0).any():
        shapes.append(_arcs(rows, on_arc, at, circles))
    if (curved := rows.curve > 0).any():
        if at.form.curve == "g6.2":
            shapes.append(_knots(rows, curved, at))
        elif at.form.curve == "bspline":
            shapes.append(_spline(rows, curved, at, open_spline))
        else:
            shapes.append(_polynomial(rows, curved, at))
    return shapes


def _arcs(rows: BlockRows, on_arc: Bools, at: Coordinates, circles: Circles) -> Shape:
    """Circular blocks: the end point and the radius, and which way round by the code, or by a word at the end."""
    assert rows.arc is not None
    motion, line, arc = at.motion, at.format, rows.arc[on_arc]
    turned = (~circles.clockwise[arc]).astype(np.int64)
    count = 2 if motion.arc_directions else 3  # coordinates in a block
    words = (*line.words[:count], f"{at.gap}{motion.radius}".encode())
    form = replace(line, words=words, decimals=line.decimals[:1] * len(words))
    codes = [f"{code}{at.gap}".encode() for code in (motion.clockwise, motion.counterclockwise)]
    turns = [f"{at.gap}{turn}".encode() for turn in motion.arc_directions]
    numbers = np.column_stack((rows.ticks[on_arc, :count], circles.radius[arc]))
    return Shape(on_arc, (codes, turned), ((turns, turned),) if turns else (), numbers=(form, numbers))


def _knots(rows: BlockRows, curved: Bools, at: Coordinates) -> Shape:
    """FANUC's G06.2: a knot before and a weight after every control point, the last four knots in blocks of their own.

    The first control point is the current position (B-63324EN/03 4.17).
    """
    assert rows.spline is not None
    decimals, spline = at.form.table.digits.weight, rows.spline[curved]
    begin = [b"", f"G6.2{at.gap}P4{at.gap}".encode()], (rows.curve[curved] == 1).astype(np.int64)
    knot = spelt(spline[:, 0], lambda value: f"K{format_number(value, decimals, trim=True)}{at.gap}")
    weight = spelt(spline[:, 1], lambda value: f"{at.gap}R{format_number(value, decimals, trim=True)}")
    last = spelt(spline[:, 2], lambda value: 4 * f"K{format_number(value, decimals, trim=True)}\n" if value else "")
    return Shape(curved, joined(begin, knot), (weight,), last)


def _spline(rows: BlockRows, curved: Bools, at: Coordinates, open_spline: bool) -> Shape:
    """Siemens' BSPLINE: the first control point is where the block before ended; knot intervals PL and weights PW.

    With the clamped knots u the block of control point j has PL = u[j+2] − u[j+1]: 0, 1/2, 1/2, 0 for five points.
    Curves that follow one another are one spline with triple knots between them, with the same intervals.
    """
    assert rows.spline is not None
    decimals, spline = at.form.table.digits.weight, rows.spline[curved]
    begins = (curved & ~np.concatenate(([open_spline], curved[:-1])))[curved].astype(np.int64)
    width, weight = (
        spelt(spline[:, k], lambda value, word=word: f" {word}={format_number(value, decimals, trim=True).rstrip('.')}")  # type: ignore[misc]
        for k, word in enumerate(("PL", "PW"))
    )
    return Shape(curved, ([b"", b"BSPLINE SD=3 "], begins), (width, weight))


def _polynomial(rows: BlockRows, curved: Bools, at: Coordinates) -> Shape:
    """One block for each knot interval.

    Siemens' POLY: ``PO[X]=(end, a2, a3)`` of a parameter from 0 to 1. The control takes a0 from where the block before
    ended and a1 = end − a0 − a2 − a3. Only for weights 1: the denominator of POLY acts on the geometry axes alone.

    Heidenhain's SPL (iTNC 530): end point, then ``K3X K2X K1X K3Y ...`` of a parameter that runs from 1 to 0.
    X(t) = K3·t³ + K2·t² + K1·t + X; the sum gives the start of the block again and may differ by a micrometre.
    """
    assert rows.bezier is not None
    start, first, second, end = np.moveaxis(rows.bezier[curved], 1, 0)
    none, digits = np.zeros(len(end), np.int64), at.form.table.digits.coefficient
    if at.form.curve == "poly":
        square, cube = 3.0 * (start - 2.0 * first + second), end - 3.0 * second + 3.0 * first - start
        names = [
            name
            for k, word in enumerate(at.words)
            for name in (f"{') ' if k else ''}PO[{word.rstrip('=')}]=(".encode(), b",", b",")
        ]
        form = RowFormat(tuple(names), (at.decimals[0], digits, digits) * len(at.words))
        numbers = to_ticks(np.stack((end, square, cube), axis=2).reshape(len(end), -1), form.decimals)
        return Shape(curved, ([b"POLY "], none), (([b") PL=1"], none),), numbers=(form, numbers))
    slope, square, cube = 3.0 * (second - end), 3.0 * (end - 2.0 * second + first), start - 3.0 * first
    factors = np.stack((cube + 3.0 * second - end, square, slope), axis=2).reshape(len(end), -1)
    numbers = np.concatenate((to_ticks(end, at.decimals), to_ticks(factors, digits)), axis=1)
    return Shape(curved, ([b"SPL "], none), numbers=(SplFormat(at.words, at.decimals, digits), numbers))


@dataclass(frozen=True)
class SplFormat:
    """Rows of SPL: coefficients of ten and more have an exponent, so rows are put together one by one."""

    letters: Sequence[str]
    decimals: Sequence[int]
    digits: int  #: of coefficients

    def each(
        self, ticks: Ints, prefix: Sequence[bytes], prefix_id: Ints, suffix: Sequence[bytes], suffix_id: Ints
    ) -> list[bytes]:
        """Text of each row."""
        words = [*self.letters, *(f"K{power}{letter}" for letter in self.letters for power in (3, 2, 1))]
        decimals, texts = (*self.decimals, *(self.digits,) * (3 * len(self.letters))), []
        for row, numbers in enumerate(ticks.tolist()):
            text = []
            for k, (word, number, places) in enumerate(zip(words, numbers, decimals, strict=True)):
                value = number / 10.0**places
                if k < len(self.letters) or abs(value) < 10.0:
                    text.append(word + format_number(value, places, plus=True))
                else:
                    mantissa, exponent = f"{value:+.8E}".split("E")
                    text.append(f"{word}{mantissa}E{exponent[0]}{int(exponent[1:]):03d}")
            texts.append(prefix[int(prefix_id[row])] + " ".join(text).encode() + suffix[int(suffix_id[row])])
        return texts


def _intervals(spline: Floats, curve: NDArray[np.int8]) -> Floats:
    """`BlockRows.spline` with the interval u[j+2] − u[j+1] in place of the knot u[j] of each control point j."""
    last = np.flatnonzero(spline[:, 2] > 0.0)
    final = np.zeros(len(spline))
    if len(last):  # the last knot of the curve that each row belongs to
        final = spline[last[np.minimum(np.searchsorted(last, np.arange(len(spline))), len(last) - 1)], 2]
    ahead = []
    for shift in (1, 2):
        none = np.zeros(min(shift, len(spline)), np.int8)
        following, number = np.append(spline[shift:, 0], none), np.append(curve[shift:], none)
        ahead.append(np.where(number == curve + shift, following, final))
    return np.column_stack((ahead[1] - ahead[0], spline[:, 1:]))


def _spans(rows: BlockRows, decimals: Sequence[int]) -> BlockRows:
    """Leave the rows that carry an interval; each begins and ends in printed digits, where the one before ended."""
    kept = some_rows(rows, (rows.curve == 0) | (rows.curve > _DEGREE))
    curved = np.flatnonzero(kept.curve > 0)
    if len(curved):
        assert kept.bezier is not None
        scale = 10.0 ** np.array(decimals)
        end = to_ticks(kept.bezier[curved, 3], decimals) / scale
        start = np.concatenate((end[:1], end[:-1]))
        start[kept.curve[curved] == _DEGREE + 1] = rows.ticks[rows.curve == 1] / scale
        for points, place in (((0, 1), start), ((3, 2), end)):
            shift = place - kept.bezier[curved, points[0]]
            for point in points:
                kept.bezier[curved, point] += shift
    return kept


def bezier_points(points: Floats, curve: NDArray[np.int8], spline: Floats) -> Floats:
    """Bézier points (r, 4, c) of the knot intervals of curves, in the last rows of each; zero elsewhere.

    A curve has p control points (r, c) for p − 3 knot intervals, and all weights 1; `spline` is as in `Rows`.
    """
    intervals = np.zeros((len(points), 4, points.shape[1]))
    first = np.flatnonzero(curve == 1)
    ends = np.append(np.flatnonzero((curve[1:] <= 1) & (curve[:-1] > 0)) + 1, len(curve) if curve[-1] > 0 else [])
    counts = (ends - first).astype(np.int64)
    rows = ranges(first, counts)
    # rows 1, 5, 6 and so on of a clamped curve have its distinct knots but for the last
    number, last = curve[rows], np.cumsum(counts) - 1
    chosen = (number == 1) | (number > _DEGREE + 1)
    knots = np.insert(spline[rows[chosen], 0], np.cumsum(chosen)[last], spline[rows[last], 2])
    own = Splines(knots, counts - 2)
    low = own.knot[own.span_knot]
    matrix = own.bernstein(np.arange(len(low)), low, low + own.width)
    taps = rows[own.span_control[:, None] + np.arange(4)]
    intervals[taps[:, -1]] = matrix @ points[taps]
    return intervals
