"""Where curve and original motion are compared: between neighbouring knots and poses their difference is a cubic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.runs.polylines import Polylines
from cornersmooth.smoothing.runs.ranges import spread
from cornersmooth.smoothing.runs.splines import Splines


@dataclass(frozen=True)
class Pieces:
    """Stretches between neighbouring knots and poses, in order of the runs.

    Parameters
    ----------
    span : (p,) int64
        Span of the spline that the piece lies in.
    segment : (p,) int64
        Pose that the segment of the original motion starts from.
    low, high : (p,) float64, steps
        Lengths s at both ends.
    """

    span: Ints
    segment: Ints
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


#: samples of a piece whose share of its span is above each of these; a cubic within bounds at quarters is nearly so
#: between them, and short pieces lie close together
_SHARES = (0.1, 0.4)
_NUMBERS = (1, 2, 3)

#: places of the samples in a piece, for each number: with the end, where Chebyshev polynomials have their extremes
_PLACES = {1: (0.0,), 2: (0.0, 0.5), 3: (0.0, 0.25, 0.75)}


@dataclass(frozen=True)
class Samples:
    """Places (m,) where the deviation is looked at: the start of every piece and places evenly behind it.

    Parameters
    ----------
    piece, span : (m,) int64
    s : (m,) float64, steps
    basis : (m, 4) float64
    target : (m, 6) float64, mm
        Point of the original motion.
    """

    piece: Ints
    span: Ints
    s: Floats
    basis: Floats
    target: Floats

    @classmethod
    def of(cls, splines: Splines, lines: Polylines, pieces: Pieces) -> Samples:
        """Samples in order; the starts of runs, which are kept anyway, are among them."""
        width = pieces.high - pieces.low
        number = np.array(_NUMBERS)[np.searchsorted(_SHARES, width / splines.width[pieces.span])]
        piece, place = spread(number)
        span, segment = pieces.span[piece], pieces.segment[piece]
        shares = np.array([_PLACES[many] + (0.0,) * (max(_NUMBERS) - many) for many in _NUMBERS])
        s = pieces.low[piece] + width[piece] * shares[np.searchsorted(_NUMBERS, number[piece]), place]
        share = (s - lines.s[segment]) / (lines.s[segment + 1] - lines.s[segment])
        target = lines.point[segment] + share[:, None] * (lines.point[segment + 1] - lines.point[segment])
        return cls(piece, span, s, splines.basis(span, s), target)

    def only(self, rows: Ints) -> Samples:
        """Some of the samples."""
        return Samples(self.piece[rows], self.span[rows], self.s[rows], self.basis[rows], self.target[rows])
