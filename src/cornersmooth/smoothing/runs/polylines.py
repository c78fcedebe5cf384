"""The original motion of runs as polylines in six dimensions, by their length s, and where curves are compared with it.

Between neighbouring knots and poses the difference of curve and original motion is a cubic.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import search, spread, starts
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Floats, Ints

#: steps of the shortest segment: knots lie between its ends
_LEAST = 4

#: samples of a piece whose share of its span is above each of these; a cubic within bounds at quarters is nearly so
#: between them, and short pieces lie close together
_SHARES = (0.1, 0.4)

#: places of one, two or three samples in a piece: with the end, where Chebyshev polynomials have their extremes
_PLACES = np.array(((0.0, np.nan, np.nan), (0.0, 0.5, np.nan), (0.0, 0.25, 0.75)))


@dataclass(frozen=True)
class Polylines:
    """Poses of r runs, one after the other."""

    point: Floats  #: (n, 6) mm: tip and axis point
    count: Ints  #: (r,): poses of each run, at least 2
    s: Floats  #: (n,): length from the start of the run in steps of `step`, whole numbers, by m(D) (docs/method.md)
    #: mm: Small beside ε. Poses and knots lie at whole steps, so that knots can be written with few digits.
    step: float

    @classmethod
    def through(cls, point: Floats, count: Ints, step: float) -> Polylines:
        """Measure the runs; neighbouring poses of a run are distinct."""
        first = starts(count)[:-1]
        length = np.zeros(len(point))
        length[1:] = np.sqrt((np.diff(point, axis=0) ** 2).sum(axis=1) / 2.0) / step
        length[first] = 0.0
        along = np.cumsum(length)
        along -= np.repeat(along[first], count)
        # rounded, and at least `_LEAST` steps for every segment; runs lie above one another: the maximum begins anew
        place, ends = _LEAST * np.arange(len(point)), np.round(along[first + count - 1]) + _LEAST * count
        floors = np.concatenate(([0.0], np.cumsum(ends[:-1] + 1.0)))
        whole = np.maximum.accumulate(np.round(along) - place + np.repeat(floors, count)) + place
        whole -= np.repeat(whole[first], count)
        return cls(point, count, whole.astype(np.float64), step)

    @property
    def first(self) -> Ints:
        """(r + 1,) int64: where each run begins."""
        return starts(self.count)

    def segment_at(self, run: Ints, s: Floats) -> Ints:
        """Index of the pose before each place; the last segment at the end of a run."""
        before, first = search(self.s, self.count, run, s, side="right") - 1, self.first
        return np.clip(before, first[run], first[run + 1] - 2)

    def poses_around(self, run: Ints, low: Floats, high: Floats) -> tuple[Ints, Ints]:
        """Pose at or before the start of each stretch, and pose at or after its end."""
        before, after = self.segment_at(run, low), self.segment_at(run, high)
        return before, after + (high > self.s[after])

    def on(self, segment: Ints, s: Floats) -> Floats:
        """Points (..., 6) at lengths (...) on segments, which are named by the pose before each."""
        start, low = self.point[segment], self.s[segment]
        share = (s - low) / (self.s[segment + 1] - low)
        return start + share[..., None] * (self.point[segment + 1] - start)


@dataclass(frozen=True)
class Pieces:
    """Stretches between neighbouring knots and poses, in order of the runs.

    The place s of their ends is in steps.
    """

    span: Ints
    segment: Ints  # pose that the segment of the original motion starts from
    low: Floats
    high: Floats

    @classmethod
    def of(cls, splines: Splines, lines: Polylines) -> Pieces:
        """Cut the runs at all knots and poses; knots at poses have the very same s."""
        knots = len(splines.knot)
        run = np.concatenate(
            (
                np.repeat(np.arange(len(splines.count)), splines.count),
                np.repeat(np.arange(len(lines.count)), lines.count),
            )
        )
        place = np.concatenate((splines.knot, lines.s))
        order = np.lexsort((place, run))
        place, run, is_pose = place[order], run[order], (order >= knots)
        # index of the last knot, and of the last pose, up to each place
        knot = np.cumsum(~is_pose) - 1
        pose = np.cumsum(is_pose) - 1
        # at equal places the last of them knows both
        real = np.flatnonzero((place[1:] > place[:-1]) & (run[1:] == run[:-1]))
        span = knot[real] - run[real]  # every run has one span less than knots
        return cls(span, pose[real], place[real], place[real + 1])


@dataclass(frozen=True)
class Samples:
    """Places (m,) where the deviation is looked at: the start of every piece and places evenly after it."""

    piece: Ints
    span: Ints
    s: Floats  # steps
    basis: Floats  # (m, 4)
    target: Floats  # points of the original motion, (m, 6), mm

    @classmethod
    def of(cls, splines: Splines, lines: Polylines, pieces: Pieces) -> Samples:
        """Samples in order; the starts of runs, which are kept anyway, are among them."""
        width = pieces.high - pieces.low
        kind = np.searchsorted(_SHARES, width / splines.width[pieces.span])
        piece, place = spread(kind + 1)
        span, segment = pieces.span[piece], pieces.segment[piece]
        s = pieces.low[piece] + width[piece] * _PLACES[kind[piece], place]
        target = lines.on(segment, s)
        return cls(piece, span, s, splines.basis(span, s), target)
