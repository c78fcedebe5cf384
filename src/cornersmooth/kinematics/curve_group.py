"""Curves with rotary axes as they are written: the tip on as many knots as its angles need."""

from __future__ import annotations

from dataclasses import dataclass

from cornersmooth.kinematics.refinement import DEGREE, SPANS, refinement
from cornersmooth.kinematics.rotary_motion import tip_points
from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.smoothing import nurbs


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
