"""How many more lines a curve of another shape takes than the curve with all weights 1 at the ratio 2/3.

With the names of `cornersmooth.geometry.nurbs`, the chord error of a line over part of a half is the error of β as a
function of σ under linear interpolation, times the length of b − a.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.model import Floats

#: exponent of the graded nodes s = (j/n)^(2/3)
GRADED = 2.0 / 3.0

#: β-error of one line per half with all weights 1 at the ratio 2/3, ``max((s − s³)/6)``; for n lines it is at most 1/n²
#: of this on graded nodes, and 9/4 of that on even ones
PAPER_ERROR = 1.0 / (9.0 * np.sqrt(3.0))

#: numbers of lines at which other shapes are measured, and samples in each line; n²·error settles as n grows
_NUMBERS, _SAMPLES = (1, 2, 3, 4, 8, 32, 400), 24

#: what may lie between two samples
_MARGIN = 1.01


def shape_factors(weights: Floats, ratio: Floats) -> tuple[Floats, Floats]:
    """Factors by which bend and turn of a transition count more for its shape.

    Parameters
    ----------
    weights : (g, 2) float64
    ratio : (g,) float64

    Returns
    -------
    bend, turn : (g,) float64
        The chord error of n lines is at most ``bend·PAPER_ERROR·|b − a|/n²``, 9/4 of it on even nodes; on even nodes σ
        changes by at most ``turn/n`` in a line.
    """
    # for w1 = 1, w2 ≤ 1 and the ratio 2/3 both are at most 6c, c the deviation factor (tests/smoothing/test_weights.py)
    factor = np.maximum(6.0 * nurbs.deviation_factor(weights, ratio), 1.0)
    bend, turn = factor, factor.copy()
    other = np.flatnonzero((weights[:, 0] != 1.0) | (weights[:, 1] > 1.0) | (np.abs(ratio - 2.0 / 3.0) > 1e-12))
    if len(other):
        shapes = np.column_stack((weights[other], ratio[other]))
        distinct, which = np.unique(shapes, axis=0, return_inverse=True)
        measured = np.array([_measure(shape[:2], float(shape[2])) for shape in distinct])
        bend[other], turn[other] = measured[which.reshape(-1)].T
    return bend, turn


def _measure(weights: Floats, ratio: float) -> tuple[float, float]:
    bend, turn = 0.0, 0.0
    for number in _NUMBERS:
        for exponent, allowed in ((GRADED, 1.0), (1.0, 2.25)):
            ends = (np.arange(number + 1) / number) ** exponent
            s = ends[:-1, None] + np.diff(ends)[:, None] * np.linspace(0.0, 1.0, _SAMPLES + 1)
            coefficients = nurbs.leg_coefficients(0.5 * s, weights, ratio)
            beta = coefficients[..., 2]
            sigma = -coefficients[..., 1] - beta
            slope = (beta[:, -1:] - beta[:, :1]) / (sigma[:, -1:] - sigma[:, :1])
            error = np.abs(beta[:, :1] + slope * (sigma - sigma[:, :1]) - beta).max()
            bend = max(bend, float(error) * number**2 / (PAPER_ERROR * allowed))
            if exponent == 1.0:
                turn = max(turn, float(np.abs(np.diff(sigma, axis=1)).max() * number * _SAMPLES))
    return _MARGIN * max(bend, 1e-3), _MARGIN * max(turn, 1.0)
