"""Symmetric banded systems of whole programs: gathered from samples and spans by sparse products, solved by LAPACK."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dpbsv
from scipy.sparse import csc_array, csr_array

from cornersmooth.arrays import ranges, spread, starts
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints

#: control points that stay at each end: with them position, first and second derivative
HELD = 3


@dataclass(frozen=True)
class Windows:
    """Windows of neighbouring spans of one run each, one after the other; neighbours may share control points."""

    begin: Ints  # first span of each window
    count: Ints  # its number of spans
    span: Ints  # spans of the splines that belong to the windows
    control: Ints  # control points of the splines that belong to the windows, (c,)
    local: Ints  # index into `control` of the first control point of each span
    window: Ints  # window of each control point
    free: Bools  # false for the outer control points, which stay

    @cached_property
    def span_window(self) -> Ints:
        """(spans,) window of each span."""
        return spread(self.count)[0]

    @classmethod
    def of(cls, splines: Splines, begin: Ints, count: Ints) -> Windows:
        """Windows of `count` spans from the spans `begin` on."""
        span = ranges(begin, count)
        control = ranges(splines.span_control[begin], count + 3)
        local = ranges(starts(count + 3)[:-1], count)
        window, place = spread(count + 3)
        free = (place >= HELD) & (place < count[window] + 3 - HELD)
        return cls(begin, count, span, control, local, window, free)

    @classmethod
    def where(cls, splines: Splines, wanted: Bools) -> Windows:
        """Windows of the rows of neighbouring spans that are wanted (spans,), those without freedom left out."""
        run = splines.span_run
        inside = wanted[1:] & wanted[:-1] & (run[1:] == run[:-1])
        starts_here = wanted & ~np.concatenate(([False], inside))
        ends_here = wanted & ~np.concatenate((inside, [False]))
        begin, end = np.flatnonzero(starts_here), np.flatnonzero(ends_here)
        count = end - begin + 1
        able = count > HELD
        return cls.of(splines, begin[able], count[able])


def near_spans(splines: Splines, run: Ints, span: Ints, before: int, behind: int) -> Bools:
    """(spans,) those from so many before some spans of runs to before so many behind them, in the same runs."""
    step = np.zeros(len(splines.span_run) + 1, np.int64)
    np.add.at(step, np.maximum(span - before, splines.span_first[run]), 1)
    np.add.at(step, np.minimum(span + behind, splines.span_first[run + 1]), -1)
    return np.cumsum(step[:-1]) > 0


#: control points that a span, and so a sample, belongs to
TAPS = 4

#: what is added to the main diagonal, relative to it, where the factors do not exist without
_RIDGES = (0.0, 1e-12, 1e-9, 1e-6, 1e-3)

_PAIRS = [(a, a + o) for o in range(TAPS) for a in range(TAPS - o)]

#: places of the numbers of a block among its six, and which of the 24 numbers of a control point the 36 of its three
#: columns are: 12d + k is the element k below the diagonal in column d, in row e of the block o with 3o + e = d + k
_BLOCK = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_BELOW = np.array([6 * min((d + k) // 3, TAPS - 1) + _BLOCK[(d + k) % 3][d] for d in range(3) for k in range(3 * TAPS)])
_BEYOND = [3 * TAPS * d + k for d in range(3) for k in range(3 * TAPS - d, 3 * TAPS)]


def applied(first: Ints, tap: Floats, points: Floats) -> Floats:
    """(m, d) points (c, d), times coefficients (m, 4), summed over the four from each of `first` on."""
    return np.asarray(_rows(first, tap, len(points)) @ points)


def _rows(first: Ints, tap: Floats, size: int) -> csr_array:
    """Sparse matrix (m, size) with four neighbouring numbers in each row."""
    column = (first[:, None] + np.arange(TAPS)).astype(np.int32).reshape(-1)
    begin = np.arange(0, TAPS * len(first) + 1, TAPS, dtype=np.int32)
    return csr_array((tap.reshape(-1), column, begin), shape=(len(first), size))


class Gather:
    """Sums over rows (samples or spans), each with coefficients `tap` (m, 4) at four of `size` control points.

    `first` (m,) are the first of these four.
    """

    def __init__(self, first: Ints, tap: Floats, size: int) -> None:
        m = len(first)
        self.size = size
        self._apply = _rows(first, tap, size)
        self._sum = self._apply.T
        place = np.array([TAPS * a + b - a for a, b in _PAIRS])
        pair_row = (TAPS * first[:, None] + place).astype(np.int32)
        pair_value = np.stack([tap[:, a] * tap[:, b] for a, b in _PAIRS], axis=1)
        pair_begin = np.arange(0, len(_PAIRS) * m + 1, len(_PAIRS), dtype=np.int32)
        self._pairs = csc_array((pair_value.reshape(-1), pair_row.reshape(-1), pair_begin), shape=(TAPS * size, m))

    def apply(self, points: Floats) -> Floats:
        """(m, d) points (c, d), times the coefficients, summed over the four of each row."""
        return np.asarray(self._apply @ points)

    def sums(self, values: Floats) -> Floats:
        """(c, d) sums of values (m, d), times the coefficients, at the control points."""
        return np.asarray(self._sum @ values)

    def apply_rows(self, points: Floats) -> Floats:
        """(d, m) points (d, c), as `apply`; neighbouring numbers belong together, which is faster."""
        return np.stack([self._apply @ row for row in points])

    def sum_rows(self, values: Floats) -> Floats:
        """(d, c) sums of values (d, m), as `sums`."""
        return np.stack([self._sum @ row for row in values])

    def bands(self, weights: Floats) -> Floats:
        """(c, 4, d) diagonals of the sums of weights (m, d) times products of two coefficients.

        Column o of row j holds the products of control points j and j + o.
        """
        weights = weights[:, None] if weights.ndim == 1 else weights
        return np.asarray(self._pairs @ weights).reshape(self.size, TAPS, -1)


def couplings(free: Bools) -> Floats:
    """(c, 4) 1 where control points j and j + o are both free, else 0."""
    both = np.zeros((len(free), TAPS))
    both[:, 0] = free
    for offset in range(1, TAPS):
        both[: len(free) - offset, offset] = free[: len(free) - offset] & free[offset:]
    return both


def solve_scalar(bands: Floats, right: Floats, free: Bools) -> Floats:
    """Solve with diagonals (c, 4) for right sides (c, d); what is not free gets 0."""
    bands = bands * couplings(free)
    bands[~free, 0] = 1.0
    solution = _cholesky(lambda: bands.copy().T, np.where(free[:, None], right, 0.0))
    return np.ascontiguousarray(solution)


def keep_in_planes(bands: Floats, right: Floats, normal: Floats) -> None:
    """Change a system so that its solution does not go along the normals (c, 3), 0 where it is free; in place.

    With P = I − n·nᵀ the blocks K become P·K·P, and those of the main diagonal get n·nᵀ besides. Control points that
    are coupled have the same normal.
    """
    rows = np.flatnonzero(normal.any(axis=1))
    if not len(rows):
        return
    blocks, n = np.ascontiguousarray(bands[rows].T), normal[rows].T.copy()
    pushed = [sum(blocks[_BLOCK[d][e]] * n[e] for e in range(3)) for d in range(3)]  # K·n
    twice = sum(pushed[d] * n[d] for d in range(3))
    twice[0] += blocks[:3, 0].sum(axis=0) / 3.0  # as stiff as the others
    pushed = [pushed[d] - 0.5 * twice * n[d] for d in range(3)]
    for k, (d, e) in enumerate(_ENTRIES):
        blocks[k] -= n[d] * pushed[e] + pushed[d] * n[e]
    bands[rows] = blocks.T
    right[:, rows] -= (right[:, rows] * n).sum(axis=0) * n


def solve_blocks(bands: Floats, right: Floats, coupled: Floats) -> Floats:
    """Solve with 3 by 3 blocks for a right side (3, c); what is not free gets 0, by the `couplings` (c, 4).

    Bands (c, 4, 6) are symmetric blocks xx, yy, zz, xy, xz, yz; column o of row j couples control points j and j + o.
    """
    bands *= coupled[:, :, None]
    bands[:, 0, :3] += 1.0 - coupled[:, :1]
    kept = np.ascontiguousarray((right * coupled[:, 0]).T).reshape(-1, 1)
    return np.ascontiguousarray(_cholesky(lambda: _lower(bands), kept).reshape(-1, 3).T)


def _lower(bands: Floats) -> Floats:
    """(12, 3c) the diagonals of the whole matrix from the main one down, column by column as LAPACK wants them."""
    lower = bands.reshape(len(bands), -1).take(_BELOW, axis=1)
    lower[:, _BEYOND] = 0.0
    return lower.reshape(-1, 3 * TAPS).T


def _cholesky(lower: Callable[[], Floats], right: Floats) -> Floats:
    """Solve with diagonals (k, n) from the main one down, made anew for every try: LAPACK leaves its factors there.

    Where rounding leaves no positive pivot the main diagonal is stiffened.
    """
    for ridge in _RIDGES:
        matrix = lower()
        if ridge:
            matrix[0] *= 1.0 + ridge
        _, solution, info = dpbsv(matrix, right, lower=1, overwrite_ab=1)
        if info == 0 and np.isfinite(solution).all():
            return np.asarray(solution)
    return np.zeros_like(right)  # no step is a step that keeps all bounds
