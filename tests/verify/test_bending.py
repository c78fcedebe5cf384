"""Bounds of second derivatives hold, and are not many times too large: second differences of many points tell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cornersmooth.nc_reader.elements import Curves
from cornersmooth.nc_reader.tool import groups
from cornersmooth.verify.bending import arc_bend, curve_bend, turn_bend

H, POINTS = 10.0, 401


def eighth(points: np.ndarray) -> np.ndarray:
    """An eighth of the largest second derivative of rows of points at equal fractions."""
    return np.linalg.norm(np.diff(points, 2, axis=1), axis=2).max(axis=1) * (points.shape[1] - 1) ** 2 / 8


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), second=st.sampled_from(["vector", "point"]), weighted=st.booleans())
def test_curves_bend_no_more(seed, second, weighted):
    rng = np.random.default_rng(seed)
    order = int(rng.integers(2, 6))
    count, points = 4, order + int(rng.integers(0, 3))
    knot = np.concatenate((np.zeros(order), np.sort(rng.random(points - order)), np.ones(order)))
    tip, vector = rng.normal(size=(count, points, 3)), rng.normal(size=(count, 1, 3)) + 0.0 * np.zeros((1, points, 1))
    vector = vector / np.linalg.norm(vector, axis=2, keepdims=True) + rng.normal(size=(count, points, 3)) * 0.2
    other = vector if second == "vector" else tip + H * vector
    weight = rng.uniform(0.5, 2.0, (count, points)) if weighted else np.ones((count, points))
    curves = Curves(
        np.arange(count),
        np.full(count, order),
        np.full(count, points),
        np.concatenate((tip, other), axis=2).reshape(-1, 6),
        weight.ravel(),
        np.tile(knot, count),
    )
    (group,) = groups(curves, np.arange(count))
    bend = curve_bend(group, second, H)
    for span in range(len(group.spans) - 1):
        at = group.at(np.linspace(group.spans[span], group.spans[span + 1], POINTS))
        way = at[..., 3:] - at[..., :3] if second == "point" else at[..., 3:]
        axis_point = at[..., :3] + H * way / np.linalg.norm(way, axis=2, keepdims=True)
        for motion in (at[..., :3], axis_point):
            assert (eighth(motion) <= bend[:, span] * (1 + 1e-6) + 1e-8).all()


@pytest.mark.parametrize("turn", [0.001, 0.1, 1.0, 2.5])
def test_turns_bend_no_more_and_nearly_as_much(turn):
    rng = np.random.default_rng(0)
    start = rng.normal(size=(50, 3))
    start /= np.linalg.norm(start, axis=1, keepdims=True)
    across = np.cross(start, rng.normal(size=(50, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    end = np.cos(turn) * start + np.sin(turn) * across
    at = start[:, None] + np.linspace(0, 1, POINTS)[:, None] * (end - start)[:, None]
    share = eighth(at / np.linalg.norm(at, axis=2, keepdims=True)) / turn_bend(start, end)
    assert (share <= 1 + 1e-6).all()
    assert (share > 0.4).all()
    assert (turn**2 / 8 <= turn_bend(start, end)).all()  # evenly along the great circle


def test_arcs():
    angle = np.linspace(0, 1.2, POINTS)
    points = 7.0 * np.stack((np.cos(angle), np.sin(angle), angle), axis=1)[None]
    assert arc_bend(np.array([7.0]), np.array([1.2])) == pytest.approx(eighth(points), rel=1e-4)


def test_half_turns_are_not_bounded():
    axis = np.array([[0.0, 0.0, 1.0]])
    assert np.isinf(turn_bend(axis, -axis)).all()
    assert (turn_bend(axis, axis) == 0).all()


def test_a_single_control_point_does_not_bend() -> None:
    """What is left of a curve that something has cut off behind its first block; reading refuses it already."""
    one = np.ones(1, np.int64)
    curve = Curves(one - 1, one, one, np.ones((1, 6)), np.ones(1), np.array([0.0, 1.0]))
    (group,) = groups(curve, one - 1)
    assert curve_bend(group, "vector", H).tolist() == [[0.0]]
