"""Transitions of single corners: the promise, and the lines that stand for curves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from cornersmooth.geometry import nurbs
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.smoothing.sampling import dense_rows
from cornersmooth.smoothing.segments import PAPER_ERROR, lines_per_half
from smoothing.paths import grid_program, random_program, simultaneous_deviation


@pytest.mark.parametrize("wobble", [0.1, 1.5])
def test_transitions_keep_the_tolerance(wobble):
    smoothed = smooth(random_program(23, 600, wobble=wobble), Settings(tolerance=0.1, axis_length=50.0))
    rows = np.flatnonzero(smoothed.corners.smoothed)
    tip, top = simultaneous_deviation(smoothed, rows, np.linspace(0, 1, 401))
    assert tip.max() <= 0.1 + 1e-12
    assert top.max() <= 0.1 + 1e-10


@hypothesis_settings(deadline=None)
@given(grid_program(), st.sampled_from([0.01, 0.3, 3.0]))
def test_coarse_grids_keep_the_tolerance(program, tolerance):
    """Reversals, collinear and repeated poses, pure rotations: all of them occur on a coarse grid."""
    with np.errstate(all="raise", under="ignore"):
        smoothed = smooth(program, Settings(tolerance=tolerance))
    rows = np.flatnonzero(smoothed.corners.smoothed)
    if len(rows):
        tip, top = simultaneous_deviation(smoothed, rows, np.linspace(0, 1, 101))
        assert tip.max() <= tolerance * (1 + 1e-9)
        assert top.max() <= tolerance * (1 + 1e-9)


def test_the_error_of_lines_has_its_bound():
    for number in (1, 2, 3, 5, 7, 12, 40, 100):
        for exponent, allowed in ((2 / 3, 1.0), (1.0, 2.25)):
            ends = (np.arange(number + 1) / number) ** exponent
            s = ends[:-1, None] + np.diff(ends)[:, None] * np.linspace(0, 1, 50)
            coefficients = nurbs.leg_coefficients(s / 2)
            beta = coefficients[..., 2]
            sigma = -coefficients[..., 1] - beta
            slope = (beta[:, -1:] - beta[:, :1]) / (sigma[:, -1:] - sigma[:, :1])
            error = np.abs(beta[:, :1] + slope * (sigma - sigma[:, :1]) - beta).max()
            assert error <= PAPER_ERROR * allowed / number**2 * (1 + 1e-9)


def test_lines_keep_the_chord_tolerance_and_pass_the_middle():
    """Distance of the curves, at dense parameters, from the lines that were made of them."""
    settings = Settings(tolerance=0.2, chord_tolerance=0.001)
    smoothed = smooth(random_program(31, 300, wobble=0.05), settings)
    rows = np.flatnonzero(smoothed.corners.smoothed)
    tips = np.concatenate([block.tip for block in dense_rows(smoothed)])
    curves, _ = nurbs.control_points(smoothed.program, smoothed.corners, rows, settings.axis_length)
    points = nurbs.evaluate(curves, np.linspace(0.0, 1.0, 201))
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
