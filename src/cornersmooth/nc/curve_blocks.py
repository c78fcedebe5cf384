"""How transitions are written as splines: rows of control points become the blocks of each control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc.run import Run
from cornersmooth.slices import some_rows
from cornersmooth.text import format_number


class RowWriter(Protocol):
    """What writes rows that have words of their own: `RowFormat`, or the like of it."""

    def rows(
        self, ticks: Ints, prefix: Sequence[bytes], prefix_id: Ints, suffix: Sequence[bytes], suffix_id: Ints
    ) -> tuple[bytes, Ints]:
        """Text, and where each row starts in it."""
        ...


class Curves:
    """How curves are written: here as what there are none of.

    `format` is None where control points have the words of lines; else rows on curves have words of their own and
    `numbers`.
    """

    format: RowWriter | None = None

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
    """

    def __init__(self, weight_decimals: int) -> None:
        self._decimals = weight_decimals
        self._open = False  # the last block was on a spline

    def prepare(self, run: Run) -> Run:
        """Leave out the first control points; find the knot intervals of the others."""
        if run.spline is not None:
            run = replace(run, spline=_intervals(run.spline, run.curve))
        self._open &= bool((run.curve > 0).any())  # a run of lines alone gets no prefixes of ours
        return some_rows(run, run.curve != 1)

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
