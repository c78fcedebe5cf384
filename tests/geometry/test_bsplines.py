"""B-splines of the kernel beside SciPy's, many at once in flat arrays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from cornersmooth.arrays import ranges, search, spread, starts
from cornersmooth.geometry.bsplines import Splines

SIZES = (2, 9, 3)


def many(seed: int) -> tuple[Splines, np.ndarray, list[BSpline]]:
    """Random splines, their control points, and the same ones for SciPy."""
    rng = np.random.default_rng(seed)
    knots = [np.concatenate(([0.0], np.cumsum(rng.uniform(0.1, 3.0, size - 1)))) for size in SIZES]
    control = [rng.normal(size=(size + 2, 2)) for size in SIZES]
    others = [BSpline(np.pad(k, 3, mode="edge"), c, 3) for k, c in zip(knots, control, strict=True)]
    return Splines(np.concatenate(knots), np.array(SIZES)), np.concatenate(control), others


def places(splines: Splines, count: int = 50) -> tuple[np.ndarray, np.ndarray]:
    """Parameters on each spline, both ends among them."""
    share = np.linspace(0.0, 1.0, count)
    ends = splines.knot[splines.first[1:] - 1]
    return np.repeat(np.arange(len(ends)), count), (ends[:, None] * share).ravel()


@pytest.mark.parametrize("seed", range(3))
def test_points_bezier_points_and_third_derivatives(seed: int) -> None:
    splines, control, others = many(seed)
    run, s = places(splines)
    span = splines.span_at(run, s)
    points = splines.points(control, span, s)
    third = np.einsum("mk,mkd->md", splines.third[span], control[splines.taps(span)])
    low = splines.knot[splines.span_knot[span]]
    hull = splines.bezier(control, span, low, low + splines.width[span])
    t = ((s - low) / splines.width[span])[:, None]
    by_hull = sum(weight * (1 - t) ** (3 - i) * t**i * hull[:, i] for i, weight in enumerate((1.0, 3.0, 3.0, 1.0)))
    for number, other in enumerate(others):
        own = run == number
        np.testing.assert_allclose(points[own], other(s[own]), atol=1e-12)
        np.testing.assert_allclose(by_hull[own], other(s[own]), atol=1e-12)
        inner = own & (s > 0) & (s < splines.knot[splines.first[number + 1] - 1])
        np.testing.assert_allclose(third[inner], other.derivative(3)(s[inner]), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("side", ["left", "right"])
def test_rows_are_searched_one_by_one(side) -> None:
    rows = [np.array([0.0]), np.array([0.0, 1.5, 1.5, 4.25]), np.array([0.0, 2.0])]
    counts = np.array([len(row) for row in rows])
    row, _ = spread(np.full(3, 5))
    place = np.tile([-3.0, 0.0, 1.5, 2.0, 9.0], 3)
    expected = [starts(counts)[r] + np.searchsorted(rows[r], p, side=side) for r, p in zip(row, place, strict=True)]
    np.testing.assert_array_equal(search(np.concatenate(rows), counts, row, place, side=side), expected)
    np.testing.assert_array_equal(ranges(np.array([5, 0]), np.array([2, 3])), [5, 6, 0, 1, 2])
