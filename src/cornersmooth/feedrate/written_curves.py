"""Curves of an NC text, cut at their knots: each piece is a rational polynomial of the written numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.feedrate import bezier_halves
from cornersmooth.feedrate.cubics import RunPieces, measured
from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.curves import groups
from cornersmooth.nc_reader.elements import NcProgram
from cornersmooth.vectors import norm


@dataclass(frozen=True)
class WrittenCurves:
    """Pieces of all curves of a text between neighbouring knots, p in path order.

    Parameters
    ----------
    element : (p,) int64
        Element of the text.
    tip, axis_point : (p, d + 1, 4) float64
        As in `cornersmooth.feedrate.cubics.Cubics`.
    origin : (p, 3) float64, mm
    end_tip, end_lever : (p, 3) float64
        Tip at the end, mm, and the direction of the tool axis there, of any length.
    """

    element: Ints
    tip: Floats
    axis_point: Floats
    origin: Floats
    end_tip: Floats
    end_lever: Floats

    @classmethod
    def of(cls, nc: NcProgram, axis_length: float) -> WrittenCurves:
        """Cut the curves of a text; the axis point is brought to `axis_length`, mm, from the tip where a piece begins.

        A second point may be written at any distance: only its direction from the tip counts.
        """
        curves = nc.curves
        degree = int(curves.order.max(initial=4)) - 1
        parts = []
        for group in groups(curves, np.arange(len(curves))):
            element = curves.element[group.index]
            for k in range(len(group.spans) - 1):
                points, weights = group.bezier(k)
                tip, lever = points[..., :3], points[..., 3:]
                if nc.second_is == "point":
                    lever = lever - tip
                lever = lever * (axis_length / norm(lever[:, 0]))[:, None, None]
                origin = tip[:, 0]
                local = tip - origin[:, None]
                both = [bezier_halves.polynomial(curve, weights) for curve in (local, local + lever)]
                powers = np.zeros((2, len(element), degree + 1, 4))
                powers[:, :, : points.shape[1]] = both
                parts.append((element, np.full(len(element), k), *powers, origin, tip[:, -1], lever[:, -1]))
        element, number, *others = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        order = np.lexsort((number, element))
        return cls(element[order], *(column[order] for column in others))

    def pieces(self, move: Ints, poses: int) -> RunPieces:
        """Pieces of a path over a program of so many poses; `move` (p,) is the pose that each ends in."""
        length, angle = measured(self.tip, self.axis_point)
        whole = np.tile([0.0, 1.0], (len(move), 1))
        nothing = np.zeros(poses, np.bool_)
        return RunPieces(self.tip, self.axis_point, self.origin, move, whole, length, angle, nothing)
