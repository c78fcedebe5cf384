"""The five-point curve on more knots, to fit rotary angles with, and the curves as they are written on them.

Knots are inserted at even distances by Boehm's rule (W. Boehm, "Inserting new knots into B-spline curves", CAD 12,
1980) in homogeneous coordinates, so that the tip curve stays what it is to rounding. New knots are dyadic, and the new
weights are blossoms of the old ones at dyadic parameters: multiples of a power of two of the last decimal. A common
factor of all weights changes nothing, so a power of two makes them fit into the decimals that controls keep.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.geometry.nurbs import KNOTS
from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.rotary.remainders import tip_points
from cornersmooth.settings import WEIGHT_DECIMALS

#: Numbers of equal knot intervals of the curves, from the five-point curve on: n intervals have n + 3 control points.
SPANS = (2, 4, 8, 16, 32)
#: Knots with more intervals than this would need more than three decimals in [0, 1]: they run to a higher end.
SPANS_PER_UNIT = 8
DEGREE = 3
#: All shares of old control points in new ones are multiples of this and more.
BINARY_DIGIT = 2.0**-20


@dataclass(frozen=True)
class Refinement:
    """A knot vector with p control points and how the five-point curve is written on it.

    Parameters
    ----------
    spans : int
        Equal intervals of [0, 1].
    knots : (p + 4,) float64
        Clamped, from 0 to 1.
    from_five : (p, 5) float64
        Homogeneous control points are this matrix times the five homogeneous ones; rows sum to one.
    end : float
        Where written knots end: they are ``knots * end``, with three decimals at most.
    """

    spans: int
    knots: Floats
    from_five: Floats
    end: float

    @property
    def points(self) -> int:
        """Number of control points."""
        return self.spans + DEGREE

    def basis(self, u: Floats) -> Floats:
        """Polynomial basis at parameters in [0, 1]: (m,) -> (m, p), by the recursion of Cox and de Boor."""
        knots = self.knots
        values = np.zeros((len(u), len(knots) - 1))
        interval = np.clip((u * self.spans).astype(np.int64), 0, self.spans - 1)
        values[np.arange(len(u)), interval + DEGREE] = 1.0
        for degree in range(1, DEGREE + 1):
            width = knots[degree:] - knots[:-degree]
            inverse = np.divide(1.0, width, out=np.zeros_like(width), where=width > 0)
            left = (u[:, None] - knots[: -degree - 1]) * inverse[:-1]
            right = (knots[degree + 1 :] - u[:, None]) * inverse[1:]
            values = left * values[:, :-1] + right * values[:, 1:]
        return values

    def rational_basis(self, u: Floats, weights: Floats) -> Floats:
        """Rational basis for g curves at common parameters: (m,), (g, p) -> (g, m, p), or (1, m, p) if all agree."""
        if len(weights) and (weights == weights[0]).all():
            weights = weights[:1]
        weighted = self.basis(u) * weights[:, None, :]
        shares: Floats = weighted / weighted.sum(axis=2, keepdims=True)
        return shares

    def homogeneous(self, weights: Floats) -> Floats:
        """Weights of the refined curves: (g, 5) -> (g, p)."""
        refined: Floats = weights @ self.from_five.T
        return refined

    def control_points(self, points: Floats, weights: Floats) -> Floats:
        """Control points of the refined curves: (g, 5, d) with the weights (g, 5) -> (g, p, d)."""
        refined: Floats = (self.from_five @ (points * weights[:, :, None])) / self.homogeneous(weights)[:, :, None]
        return refined


@cache
def refinement(spans: int) -> Refinement:
    """Even knots with so many intervals, a power of two from 2 on."""
    knots = np.array(KNOTS)
    matrix = np.eye(len(KNOTS) - DEGREE - 1)
    for u in (j / spans for j in range(1, spans) if 2 * j != spans):
        knots, matrix = _insert(knots, matrix, u)
    matrix = np.round(matrix / BINARY_DIGIT) * BINARY_DIGIT
    return Refinement(spans, knots, matrix, float(max(1, spans // SPANS_PER_UNIT)))


def _insert(knots: Floats, matrix: Floats, u: float) -> tuple[Floats, Floats]:
    """Insert one knot that is not there yet: Boehm's rule for the rows of `matrix` as control points."""
    after = int(np.searchsorted(knots, u, side="right"))  # knots[after - 1] < u < knots[after]
    share = np.zeros(len(matrix) + 1)  # of the old control point of the same number; the one before has the rest
    share[: after - DEGREE] = 1.0
    affected = np.arange(after - DEGREE, after)
    share[affected] = (u - knots[affected]) / (knots[affected + DEGREE] - knots[affected])
    none = np.zeros((1, matrix.shape[1]))
    old, before = np.concatenate((matrix, none)), np.concatenate((none, matrix))
    return np.insert(knots, after, u), share[:, None] * old + (1.0 - share[:, None]) * before


def weight_factors(weights: Floats) -> Floats:
    """Smallest powers of two that leave the weights of each curve no more decimals than controls keep.

    Parameters
    ----------
    weights : (g, p) float64
        Refined weights of curves whose own five have no more decimals than that.

    Returns
    -------
    (g,) float64
        1 where all weights are 1.
    """
    factors = np.ones(len(weights))
    scale = 10.0**WEIGHT_DECIMALS
    pending = np.arange(len(weights))
    # Dyadic parameters have at most log2(spans / 2) binary digits, three of them make a blossom, the knot ½ two more.
    for _ in range(3 * (SPANS[-1].bit_length() - 2) + 2):
        ticks = weights[pending] * (factors[pending] * scale)[:, None]
        inexact = (np.abs(ticks - np.round(ticks)) > 1e-6).any(axis=1)
        pending = pending[inexact]
        if not len(pending):
            break
        factors[pending] *= 2.0
    return factors


@dataclass(frozen=True)
class CurveGroup:
    """Curves that share a knot vector: g curves with p control points each.

    A writer prints for each of them, in FANUC's form (B-63324EN/03 4.17), p blocks with the knot, X Y Z, both rotary
    words and the weight of one control point each, ``K<knots[i]> X.. Y.. Z.. <angles> R<weights>``, G6.2 P4 in the
    first; then the last four knots in blocks of their own. The first control point is the current position digit for
    digit: the end of the straight remainder before it, or the last control point of the curve before.

    Parameters
    ----------
    smoothed : SmoothProgram
        What they are of.
    row : (g,) int64
        Rows of `Corners`, ascending.
    knots : (p + 4,) float64
        As they are to be written: from 0, with three decimals at most. The parameter u of the corner is the knot
        parameter over the last knot.
    weights : (g, p) float64
        As they are to be written: with three decimals at most. All of a curve may have a power of two as common factor.
    angles : (g, p, 2) float64, degrees
        Control points of the rotary angles in the order of `Machine.axes`.
    orientation_error : (g,) float64, degrees
        Largest angle between the axis that the angles give and the direction of Q(u) − P(u), as measured.
    ruled : (g,) bool
        Beside straight remainders that do not run evenly the angles join with the rates of the ruled motion, not with
        those of the line, which follows it by steps: a kink like those where points are inserted.
    """

    smoothed: SmoothProgram
    row: Ints
    knots: Floats
    weights: Floats
    angles: Floats
    orientation_error: Floats
    ruled: Bools

    def __len__(self) -> int:
        return len(self.row)

    @property
    def points(self) -> int:
        """Control points of each curve."""
        return len(self.knots) - 1 - DEGREE

    @property
    def tip(self) -> Floats:
        """(g, p, 3) control points of the tip: `tips` of all curves."""
        return self.tips(slice(None))

    def tips(self, chosen: slice) -> Floats:
        """Control points of the tip of some curves, in mm: the same curves as those of the five points, exactly."""
        rows = self.row[chosen]
        tip = tip_points(self.smoothed, rows)
        spans = self.points - DEGREE
        if spans == SPANS[0]:
            return tip
        return refinement(spans).control_points(tip, nurbs.full_weights(self.smoothed.corners.weights[rows]))
