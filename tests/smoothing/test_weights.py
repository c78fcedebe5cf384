"""Free weights: the promise, the order along the path, the lines that stand for curves."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from cornersmooth.geometry import nurbs
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.smoothing.sampling import dense_rows
from cornersmooth.smoothing.segments import PAPER_ERROR, lines_per_half, shape_factors
from oracle.share import covering_share
from smoothing.paths import grid_program, random_program, simultaneous_deviation

ANY_WEIGHTS = ((1.0, 1.0), (1.0, 0.3), (2.5, 0.3), (0.3, 2.5), (1.0, 3.0), (3.0, 0.001), (0.001, 3.0))


# ---------------------------------------------------------------- the promise


@pytest.mark.parametrize(("weights", "wobble"), covering_share(product(ANY_WEIGHTS, [0.1, 1.5]), 13))
def test_any_weights_keep_the_tolerance(weights, wobble):
    settings = Settings(tolerance=0.1, axis_length=50.0, weights=weights)
    smoothed = smooth(random_program(23, 600, wobble=wobble), settings)
    rows = np.flatnonzero(smoothed.corners.smoothed)
    tip, top = simultaneous_deviation(smoothed, rows, np.linspace(0, 1, 401))
    assert tip.max() <= 0.1 + 1e-12
    assert top.max() <= 0.1 + 1e-10


@hypothesis_settings(deadline=None)
@given(grid_program(), st.sampled_from([(1.0, 0.3), (2.5, 0.3)]), st.sampled_from([0.01, 0.3, 3.0]))
def test_coarse_grids_keep_the_tolerance(program, weights, tolerance):
    """Reversals, collinear and repeated poses, pure rotations: all of them occur on a coarse grid."""
    settings = Settings(tolerance=tolerance, weights=weights)
    with np.errstate(all="raise", under="ignore"):
        smoothed = smooth(program, settings)
    rows = np.flatnonzero(smoothed.corners.smoothed)
    if len(rows):
        tip, top = simultaneous_deviation(smoothed, rows, np.linspace(0, 1, 101))
        assert tip.max() <= tolerance * (1 + 1e-9)
        assert top.max() <= tolerance * (1 + 1e-9)


# ---------------------------------------------------------------- the order along the path


@hypothesis_settings(deadline=None)
@given(st.floats(0.001, 3.0), st.floats(0.001, 3.0))
def test_the_pose_of_the_original_motion_only_moves_forward(w1, w2):
    """σ falls from 1 to 0 on the first half, and the deviation β is a convex function of it: docs/method.md."""
    u = np.linspace(0.0, 0.5, 301)
    coefficients = nurbs.leg_coefficients(u, np.array([w1, w2]))
    beta = coefficients[:, 2]
    sigma = -coefficients[:, 1] - beta
    assert sigma[0] == pytest.approx(1.0)
    assert sigma[-1] == pytest.approx(0.0, abs=1e-15)
    assert (np.diff(sigma) < 0.0).all()
    largest = nurbs.deviation_factor(np.array([[w1, w2]]))[0]
    assert beta[-1] == pytest.approx(largest)
    assert (beta <= largest * (1.0 - sigma) + 1e-12).all()
    (x, y), (x_next, y_next) = np.diff((sigma, beta), axis=1)[:, :-1], np.diff((sigma, beta), axis=1)[:, 1:]
    assert (x * y_next - y * x_next <= 1e-12).all(), "it turns one way"


# ---------------------------------------------------------------- the lines that stand for the curve


@pytest.mark.parametrize("weights", [*((1.0, w2) for w2 in (0.9, 0.6, 0.3, 0.05)), *ANY_WEIGHTS])
def test_shape_factors_bound_the_error_of_lines(weights):
    bend, turn = shape_factors(weights)
    for number in (1, 2, 3, 5, 7, 12, 40, 100):
        for exponent, allowed in ((2 / 3, 1.0), (1.0, 2.25)):
            ends = (np.arange(number + 1) / number) ** exponent
            s = ends[:-1, None] + np.diff(ends)[:, None] * np.linspace(0, 1, 50)
            coefficients = nurbs.leg_coefficients(s / 2, np.array(weights))
            beta = coefficients[..., 2]
            sigma = -coefficients[..., 1] - beta
            slope = (beta[:, -1:] - beta[:, :1]) / (sigma[:, -1:] - sigma[:, :1])
            error = np.abs(beta[:, :1] + slope * (sigma - sigma[:, :1]) - beta).max()
            assert error <= bend * PAPER_ERROR * allowed / number**2
        assert np.abs(np.diff(sigma[:, [0, -1]], axis=1)).max() <= turn / number * (1 + 1e-9)


@pytest.mark.parametrize("weights", [(1.0, 0.65), (2.5, 0.3), (1.0, 3.0)])
def test_lines_keep_the_chord_tolerance_and_pass_the_middle(weights):
    """Distance of the curves, at dense parameters, from the lines that were made of them."""
    settings = Settings(tolerance=0.2, chord_tolerance=0.001, weights=weights)
    smoothed = smooth(random_program(31, 300, wobble=0.05), settings)
    corners = smoothed.corners
    rows = np.flatnonzero(corners.smoothed)
    tips = np.concatenate([block.tip for block in dense_rows(smoothed)])
    curves, _ = nurbs.control_points(smoothed.program, corners, rows, settings.axis_length)
    points = nurbs.evaluate(curves, corners.weights[rows], np.linspace(0.0, 1.0, 201))
    halves = np.abs(lines_per_half(smoothed)[rows])
    assert halves.max() > 5
    for curve, number in zip(points, halves, strict=True):
        middle = int(np.argmin(np.linalg.norm(tips - curve[100], axis=1)))
        assert np.linalg.norm(tips[middle] - curve[100]) <= 1e-9
        line = tips[middle - number : middle + number + 1]
        assert distance_to_polyline(curve, line) <= 0.001 * (1 + 1e-6)


def distance_to_polyline(points: np.ndarray, line: np.ndarray) -> float:
    start, step = line[:-1], np.diff(line, axis=0)
    share = np.einsum("pkd,kd->pk", points[:, None] - start, step) / np.einsum("kd,kd->k", step, step)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * step
    return float(np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1).max())
