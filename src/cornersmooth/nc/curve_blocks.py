"""How rows become blocks: what each block says, and how curves are written, as splines or polynomials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import ranges
from cornersmooth.model import Bools, Floats, Ints, Program, Units
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.slices import some_rows
from cornersmooth.text import RowFormat, format_number, to_ticks

#: control points that a curve has more than knot intervals
_DEGREE = 3

#: blocks that are counted together, and how many of them must be splines
_WINDOW, _LEAST = 10, 6


@dataclass(frozen=True)
class Run:
    """Rows that nothing interrupts, r of them: what each block says."""

    ticks: Ints  #: (r, c) numbers in steps of their last digit
    move: Ints  #: (r,) pose, for messages
    rapid: Bools  #: (r,)
    feed: Floats  #: (r,) mm/min, mm/rev or 1/min, NaN where there is none
    mode: Ints  #: (r,) `FeedMode` or `INVERSE_TIME`
    curve: NDArray[np.int8]  #: (r,) as in `Rows`
    arc: Ints | None = None  #: (r,)
    dwell: Bools | None = None  #: (r,) where the tool waits after the block
    #: (r, 4, c) Bézier points of the knot intervals of curves, in units of the text, for polynomials
    bezier: Floats | None = None
    spline: Floats | None = None  #: (r, 3)
    blend: Floats | None = None  #: (r,), mm; as in `Rows`
    left: Bools | None = None  #: (r,) as in `Rows`

    @classmethod
    def straight(cls, program: Program, ticks: Ints, move: Ints, *, rapid: bool = False) -> Run:
        """Straight moves in rapid, or at the feeds of moves of the program."""
        count, mode = len(ticks), program.feed_mode[move].astype(np.int64)
        return cls(ticks, move, np.full(count, rapid), program.feed[move], mode, np.zeros(count, np.int8))

    def __len__(self) -> int:
        return len(self.ticks)

    def with_programmed_feed(self, program: Program) -> Run:
        """Give the first move the program's feed where it has a time, which counts the way from the pose before."""
        if self.mode[0] != INVERSE_TIME:
            return self
        feed, mode = self.feed.copy(), self.mode.copy()
        feed[0], mode[0] = program.feed[self.move[0]], program.feed_mode[self.move[0]]
        return replace(self, feed=feed, mode=mode)


class Curves:
    """How curves, or arcs, are written.

    `format` is None where control points have the words of lines; else rows on curves have words of their own and
    `numbers`.
    """

    format: RowFormat | SplFormat | None = None

    def rows(self, run: Run) -> Bools:
        """(r,) rows on curves."""
        return run.curve > 0

    def prepare(self, run: Run) -> Run:
        """Return the run with only the rows that become blocks, and remember what follows."""
        return run

    def add_prefixes(self, run: Run, table: list[bytes], chosen: Ints) -> int:
        """Give rows on curves an entry in the table of prefixes; return the blocks that rows make beside their own."""
        return 0

    def add_suffixes(self, run: Run, table: list[bytes], chosen: Ints) -> None:
        """Give rows on curves an entry in the table of suffixes."""

    def numbers(self, run: Run, curved: Bools) -> Ints:
        """Ticks of the rows on curves in `format`."""
        return run.ticks[curved]

    def finish(self) -> None:
        """Take note that no more rows follow."""


class KnotBlocks(Curves):
    """FANUC's G06.2: a knot before and a weight after every control point, the last four knots in blocks of their own.

    The first control point is the current position (B-63324EN/03 4.17).
    """

    def __init__(self, weight_decimals: int, blank: bytes = b" ") -> None:
        self._decimals, self._blank = weight_decimals, blank

    def add_prefixes(self, run: Run, table: list[bytes], chosen: Ints) -> int:
        """Knots."""
        assert run.spline is not None
        curved = run.curve > 0
        knots, which = _distinct(run.spline[curved, 0])
        words = [self._word(b"K", knot) + self._blank for knot in knots.tolist()]
        chosen[curved] = len(table) + which + np.where(run.curve[curved] == 1, len(words), 0)
        table += [*words, *(b"G6.2" + self._blank + b"P4" + self._blank + word for word in words)]
        return 4 * int(np.count_nonzero(run.spline[:, 2]))

    def add_suffixes(self, run: Run, table: list[bytes], chosen: Ints) -> None:
        """Weights, and the last knots."""
        for weight, last in _pairs(run, 1, table, chosen):
            end = self._blank + self._word(b"R", weight) + b"\n"
            table.append(end + 4 * (self._word(b"K", last) + b"\n") if last > 0.0 else end)

    def _word(self, letter: bytes, value: float) -> bytes:
        return letter + format_number(value, self._decimals, trim=True).encode()


class SplineBlocks(Curves):
    """Siemens' BSPLINE: the first control point is where the block before ended; knot intervals PL and weights PW.

    With the clamped knots u the block of control point j has PL = u[j+2] − u[j+1]: 0, 1/2, 1/2, 0 for five points.
    Curves that follow one another are one spline with triple knots between them, with the same intervals.

    SINUMERIK wants six splines of every ten blocks (programming manual 12/2019): ten feed blocks from the beginning of
    every spline on are counted; what comes after a rapid is no spline.
    """

    def __init__(self, weight_decimals: int, line: Ints, findings: Findings) -> None:
        self._decimals, self._line, self._findings = weight_decimals, line, findings
        self._open = False  # the last block was on a spline
        self._flags, self._moves = np.zeros(0, np.bool_), np.zeros(0, np.int64)  # of blocks that are not counted yet
        self._before = False  # whether the block before these is a spline

    def prepare(self, run: Run) -> Run:
        """Leave out the first control points; find the knot intervals of the others."""
        if run.spline is not None:
            run = replace(run, spline=_intervals(run.spline, run.curve))
        self._open &= bool((run.curve > 0).any())  # a run of lines alone gets no prefixes of ours
        run = some_rows(run, run.curve != 1)
        self._take(run)
        return run

    def add_prefixes(self, run: Run, table: list[bytes], chosen: Ints) -> int:
        """``BSPLINE`` where a spline begins."""
        curved = run.curve > 0
        begins = curved & ~np.concatenate(([self._open], curved[:-1]))
        chosen[curved] = len(table)
        chosen[begins] = len(table) + 1
        table += [b"", b"BSPLINE SD=3 "]
        self._open = bool(curved[-1])
        return 0

    def add_suffixes(self, run: Run, table: list[bytes], chosen: Ints) -> None:
        """Knot intervals and weights."""
        for interval, weight in _pairs(run, 0, table, chosen):
            table.append(f" PL={self._number(interval)} PW={self._number(weight)}\n".encode())

    def _number(self, value: float) -> str:
        return format_number(value, self._decimals, trim=True).rstrip(".")

    def _take(self, run: Run) -> None:
        """Count the blocks of a run, a block a row."""
        edges = np.flatnonzero(np.diff(run.rapid.astype(np.int8))) + 1
        for rows in np.split(np.arange(len(run)), edges):
            if run.rapid[rows[0]]:
                self.finish()
            else:
                self._flags = np.concatenate((self._flags, run.curve[rows] > 0))
                self._moves = np.concatenate((self._moves, run.move[rows]))
                self._count(len(self._flags) - _WINDOW)

    def finish(self) -> None:
        """Count what is left where no further feed block follows."""
        self._count(len(self._flags) - 1)
        self._before = False

    def _count(self, last: int) -> None:
        """Count the windows that begin up to a block, and forget these blocks."""
        if last < 0:
            return
        flags = self._flags
        starts = np.flatnonzero(flags & ~np.concatenate(([self._before], flags[:-1])))
        starts = starts[starts <= last]
        total = np.concatenate(([0], np.cumsum(flags)))
        stop = np.minimum(starts + _WINDOW, len(flags))
        few = starts[total[stop] - total[starts] < _LEAST]
        text = "fewer than six of ten blocks are BSPLINE, which SINUMERIK wants; -f poly (vectors) has no such rule"
        self._findings.add_each("CS325", "warning", self._line[self._moves[few]], text)
        self._before = bool(flags[last])
        self._flags, self._moves = flags[last + 1 :], self._moves[last + 1 :]


def _intervals(spline: Floats, curve: NDArray[np.int8]) -> Floats:
    """`Run.spline` with the interval u[j+2] − u[j+1] in place of the knot u[j] of each control point j."""
    last = np.flatnonzero(spline[:, 2] > 0.0)
    final = np.zeros(len(spline))
    if len(last):  # the last knot of the curve that each row belongs to
        final = spline[last[np.minimum(np.searchsorted(last, np.arange(len(spline))), len(last) - 1)], 2]
    ahead = []
    for shift in (1, 2):
        none = np.zeros(min(shift, len(spline)), np.int8)
        following = np.append(spline[shift:, 0], none)
        number = np.append(curve[shift:], none)
        ahead.append(np.where(number == curve + shift, following, final))
    found = spline.copy()
    found[:, 0] = ahead[1] - ahead[0]
    return found


def _pairs(run: Run, column: int, table: list[bytes], chosen: Ints) -> list[tuple[float, float]]:
    """Pairs of values of two columns of `Run.spline`; rows on curves choose the entries that the table will have."""
    assert run.spline is not None
    curved = run.curve > 0
    (ones, one), (others, other) = (_distinct(run.spline[curved, place]) for place in (column, column + 1))
    chosen[curved] = len(table) + one * len(others) + other
    return list(product(ones.tolist(), others.tolist()))


def _distinct(values: Floats) -> tuple[Floats, Ints]:
    """Distinct values, few of many, and which of them each is: faster than the inverse of `np.unique`."""
    found = np.unique(values)
    return found, np.searchsorted(found, values)


class _Polynomials(Curves):
    """One block for each knot interval, in the last rows of a curve: words before and after its numbers."""

    begin, end = b"", b"\n"

    def __init__(self, form: Form, units: Units) -> None:
        self._line_decimals = form.decimals(units)

    def prepare(self, run: Run) -> Run:
        """Leave the rows that carry an interval; each begins and ends in printed digits, where the one before ended.

        Its tangents stay: their control points move with the ends.
        """
        kept = some_rows(run, (run.curve == 0) | (run.curve > _DEGREE))
        curved = np.flatnonzero(kept.curve > 0)
        if len(curved):
            assert kept.bezier is not None
            scale = 10.0 ** np.array(self._line_decimals)
            first = kept.curve[curved] == _DEGREE + 1
            end = to_ticks(kept.bezier[curved, 3], self._line_decimals) / scale
            start = np.concatenate((end[:1], end[:-1]))
            start[first] = run.ticks[run.curve == 1] / scale
            for points, place in (((0, 1), start), ((3, 2), end)):
                shift = place - kept.bezier[curved, points[0]]
                for point in points:
                    kept.bezier[curved, point] += shift
        return kept

    def add_prefixes(self, run: Run, table: list[bytes], chosen: Ints) -> int:
        """Words before the numbers."""
        chosen[run.curve > 0] = len(table)
        table.append(self.begin)
        return 0

    def add_suffixes(self, run: Run, table: list[bytes], chosen: Ints) -> None:
        """Words after the numbers."""
        chosen[run.curve > 0] = len(table)
        table.append(self.end)


class PolyBlocks(_Polynomials):
    """Siemens' POLY: ``PO[X]=(end, a2, a3)`` of a parameter from 0 to 1.

    The control takes a0 from where the block before ended and a1 = end − a0 − a2 − a3. Only for weights 1: the
    denominator of POLY acts on the geometry axes alone.
    """

    begin, end = b"POLY ", b") PL=1\n"

    def __init__(self, form: Form, units: Units) -> None:
        super().__init__(form, units)
        digits, tip = form.table.digits, form.tip_decimals(units)
        letters = [word.rstrip("=") for word in (*form.mode.motion.coordinates, *form.other_words)]
        words = []
        for index, letter in enumerate(letters):
            words += [f"{') ' if index else ''}PO[{letter}]=(".encode(), b",", b","]
        self._decimals = (tip, digits.coefficient, digits.coefficient) * len(letters)
        self.format = RowFormat(words=tuple(words), decimals=self._decimals)

    def numbers(self, run: Run, curved: Bools) -> Ints:
        """End point and coefficients of each interval, axis by axis."""
        assert run.bezier is not None
        start, first, second, end = np.moveaxis(run.bezier[curved], 1, 0)
        square, cube = 3.0 * (start - 2.0 * first + second), end - 3.0 * second + 3.0 * first - start
        numbers = np.stack((end, square, cube), axis=2).reshape(len(end), -1)
        return to_ticks(numbers, self._decimals)


class SplBlocks(_Polynomials):
    """Heidenhain's SPL (iTNC 530): end point, then ``K3X K2X K1X K3Y ...`` of a parameter that runs from 1 to 0.

    X(t) = K3·t³ + K2·t² + K1·t + X; the sum gives the start of the block again and may differ by a micrometre.
    """

    begin = b"SPL "

    def __init__(self, form: Form, units: Units) -> None:
        super().__init__(form, units)
        letters = (*form.mode.motion.coordinates, *form.other_words)
        self._coefficient = form.table.digits.coefficient
        self.format = SplFormat(letters, self._line_decimals, self._coefficient)

    def numbers(self, run: Run, curved: Bools) -> Ints:
        """End point, then K3, K2 and K1 of each axis."""
        assert run.bezier is not None
        start, first, second, end = np.moveaxis(run.bezier[curved], 1, 0)
        slope, square = 3.0 * (second - end), 3.0 * (end - 2.0 * second + first)
        cube = start - 3.0 * first + 3.0 * second - end
        factors = np.stack((cube, square, slope), axis=2).reshape(len(end), -1)
        return np.concatenate((to_ticks(end, self._line_decimals), to_ticks(factors, self._coefficient)), axis=1)


class SplFormat:
    """Rows of SPL: coefficients of ten and more have an exponent, so rows are put together one by one."""

    def __init__(self, letters: Sequence[str], decimals: Sequence[int], coefficient: int) -> None:
        self._letters, self._decimals, self._digits = letters, decimals, coefficient

    def rows(
        self, ticks: Ints, prefix: Sequence[bytes], prefix_id: Ints, suffix: Sequence[bytes], suffix_id: Ints
    ) -> tuple[bytes, Ints]:
        """Text, and where each row starts in it."""
        axes = len(self._letters)
        texts = []
        for row, numbers in enumerate(ticks.tolist()):
            words = [
                letter + format_number(number / 10.0**decimals, decimals, plus=True)
                for letter, number, decimals in zip(self._letters, numbers[:axes], self._decimals, strict=True)
            ]
            words += [
                f"K{3 - place % 3}{self._letters[place // 3]}{self._coefficient(number)}"
                for place, number in enumerate(numbers[axes:])
            ]
            texts.append(prefix[int(prefix_id[row])] + " ".join(words).encode() + suffix[int(suffix_id[row])])
        offsets = np.concatenate(([0], np.cumsum([len(text) for text in texts]))).astype(np.int64)
        return b"".join(texts), offsets

    def _coefficient(self, ticks: int) -> str:
        value = ticks / 10.0**self._digits
        if abs(value) < 10.0:
            return format_number(value, self._digits, plus=True)
        mantissa, exponent = f"{value:+.8E}".split("E")
        return f"{mantissa}E{exponent[0]}{int(exponent[1:]):03d}"


def bezier_points(points: Floats, curve: NDArray[np.int8], spline: Floats) -> Floats:
    """Bézier points (r, 4, c) of the knot intervals of curves, in the last rows of each; zero elsewhere.

    A curve has p control points (r, c) for p − 3 knot intervals, and all weights 1; `spline` is as in `Rows`.
    """
    intervals = np.zeros((len(points), 4, points.shape[1]))
    first = np.flatnonzero(curve == 1)
    ends = np.append(np.flatnonzero((curve[1:] <= 1) & (curve[:-1] > 0)) + 1, len(curve) if curve[-1] > 0 else [])
    counts = (ends - first).astype(np.int64)
    rows = ranges(first, counts)
    own = _splines(curve[rows], spline[rows], counts)
    low = own.knot[own.span_knot]
    matrix = own.bernstein(np.arange(len(low)), low, low + own.width)
    taps = rows[own.span_control[:, None] + np.arange(4)]
    intervals[taps[:, -1]] = matrix @ points[taps]
    return intervals


def _splines(curve: NDArray[np.int8], spline: Floats, counts: Ints) -> Splines:
    """Knot vectors of clamped curves: rows 1, 5, 6 and so on of each have the distinct knots but for the last."""
    knot, last = spline[:, 0], np.cumsum(counts) - 1
    chosen = (curve == 1) | (curve > _DEGREE + 1)
    knots = np.insert(knot[chosen], np.cumsum(chosen)[last], spline[last, 2])
    return Splines(knots, counts - 2)


def curves_for(form: Form, program: Program, findings: Findings) -> Curves:
    """Way to write curves of a form."""
    decimals, units = form.table.digits.weight, program.units
    if form.curve == "g6.2":
        return KnotBlocks(decimals, b" " if form.mode.motion.spaces else b"")
    if form.curve == "bspline":
        return SplineBlocks(decimals, program.line, findings)
    if form.curve == "poly":
        return PolyBlocks(form, units)
    return SplBlocks(form, units)
