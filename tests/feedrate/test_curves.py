"""Arc length and curvature of halves of transitions."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.feedrate import Limits, curves
from cornersmooth.feedrate.intervals import path_limits
from cornersmooth.feedrate.path import build_path
from cornersmooth.feedrate.taylor import poses
from cornersmooth.geometry import nurbs
from cornersmooth.model import Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

SIDES = np.array([0, 1])


def corner(turn: float, leg_in: float, leg_out: float) -> np.ndarray:
    angle = np.radians(turn)
    points = nurbs.five_points(
        np.zeros((1, 3)),
        np.array([[leg_in, 0.0, 0.0]]),
        leg_out * np.array([[np.cos(angle), np.sin(angle), 0.0]]),
    )
    return np.repeat(points, 2, axis=0)


def halves(points: np.ndarray) -> np.ndarray:
    """Powers of both halves of one curve."""
    return curves.polynomial(points, half=SIDES)


CORNERS = [(turn, *legs) for turn in (1.0, 90.0, 165.0) for legs in ((1.0, 1.0), (0.3, 1.0), (0.002, 0.01))]


@pytest.mark.parametrize("given", CORNERS)
def test_halves_are_the_curve(given: tuple[float, float, float]) -> None:
    points = corner(*given)
    powers = halves(points)
    t = np.linspace(0.0, 1.0, 11)
    found = curves.evaluate(powers, np.tile(t, (2, 1)))
    for side in SIDES:
        expected = nurbs.evaluate(points[:1], 0.5 * (side + t))[0]
        assert found[side] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("given", CORNERS)
def test_arc_length_and_back(given: tuple[float, float, float]) -> None:
    points = corner(*given)
    powers = halves(points)
    lengths = curves.interval_lengths(powers, curves.interval_borders(SIDES)).sum(axis=1)
    dense = curves.evaluate(powers, np.tile(np.linspace(0.0, 1.0, 100_001), (2, 1)))
    chords = np.linalg.norm(np.diff(dense, axis=1), axis=2)
    assert lengths == pytest.approx(chords.sum(axis=1), rel=1e-6)
    which = np.repeat(SIDES, 9)
    share = np.tile(np.linspace(0.0, 1.0, 9), 2)
    t = curves.parameters_at(powers, SIDES, which, share * lengths[which])
    way = np.cumsum(chords, axis=1)
    for side, part, parameter in zip(which, share, t, strict=True):
        gone = np.interp(parameter, np.linspace(0.0, 1.0, 100_001), np.concatenate(([0.0], way[side])))
        assert gone == pytest.approx(part * lengths[side], rel=1e-5, abs=1e-8 * lengths[side])


@pytest.mark.parametrize("turn", [2.0, 45.0, 90.0, 150.0])
def test_curvature_bounds_the_speed(turn: float) -> None:
    """Everywhere at most, and in the tightest interval not much less, than the centripetal limit allows."""
    bend, limits = np.radians(turn), Limits(feed=1e6, centripetal=500.0)
    tip = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0 + 3.0 * np.cos(bend), 3.0 * np.sin(bend), 0.0]])
    smoothed = smooth(Program.from_poses(tip, [[0.0, 0.0, 1.0]] * 3), Settings(tolerance=0.05))
    path = build_path(smoothed.program, smoothed.corners, smoothed.settings, limits)
    found = path_limits(path, limits)
    x = np.linspace(0.0, found.edge[-1], 20_001)[1:-1]
    element = np.searchsorted(np.cumsum(path.length), x)
    kappa = poses(path, element, x - np.append(0.0, np.cumsum(path.length))[element])[2]
    used = kappa * found.cap[np.searchsorted(found.edge, x) - 1] / limits.centripetal_accel
    assert 0.98 < used.max() <= 1.0 + 1e-6


def test_length_beside_a_leg_of_length_zero() -> None:
    powers = halves(corner(60.0, 0.4, 0.0))
    assert curves.interval_lengths(powers, curves.interval_borders(SIDES)).sum() == pytest.approx(0.4, rel=1e-12)
