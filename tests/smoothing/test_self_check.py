"""The paper's method measures its own motion: transitions get smaller until it keeps the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth import Program, Settings, smooth
from cornersmooth.smoothing.construction import legs_at
from cornersmooth.smoothing.self_check import Motion, Original, bounded, most_taken, taken


def bend(turn: float) -> Program:
    """A right angle of the tip in which the axis swings back and forth by `turn`."""
    tip = np.array([[0.0, 0, 0], [10, 0, 0], [10, 0.2, 0], [30, 0.2, 0]])
    axis = np.array([[0.0, 0, 1], [turn, 0, 1], [-turn, turn, 1], [0, 0, 1]])
    return Program.from_poses(tip, axis, feed=1000.0)


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.7])
def test_corners_get_smaller_where_the_axis_swings(turn: float) -> None:
    settings = Settings(tolerance=0.01, axis_length=50.0, method="zhang2016")
    corners = smooth(bend(turn), settings).corners
    assert corners.smoothed.all()
    assert (corners.extra["size"] > 0.0).all()


def original() -> tuple[Original, Settings]:
    program, settings = bend(0.3), Settings(tolerance=0.01, axis_length=20.0, method="zhang2016")
    legs = legs_at(program, 20.0, np.array([1]), np.array([0]), np.array([2]))
    return Original.of(legs, settings), settings


PARTS = np.array([[-0.6, -0.2, 0.0, 0.3]])


def test_the_original_takes_nothing() -> None:
    path, settings = original()
    motion = Motion(*path.at(PARTS), PARTS, PARTS)
    assert taken(motion, path, settings) == pytest.approx(np.zeros((1, 4)), abs=1e-9)
    assert most_taken(motion, path, settings, 2, None) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("off", [(0.0, 0.004, 0.0), (0.003, 0.0, 0.01)])
def test_a_motion_beside_takes_its_distance(off: tuple[float, float, float]) -> None:
    path, settings = original()
    tip, lever = path.at(PARTS)
    share = taken(Motion(tip + off, lever, PARTS, PARTS), path, settings)
    assert share == pytest.approx(np.full((1, 4), np.linalg.norm(off) / 0.01))


def test_tip_and_axis_point_out_of_step_take_what_no_common_pose_has() -> None:
    """The tip is 0.02 of the segment ahead: the nearest common pose is between both, and both are off it by as much."""
    path, settings = original()
    ahead = PARTS[:, :2] + 0.02
    tip, _ = path.at(ahead)
    top = sum(path.at(PARTS[:, :2]))
    share = taken(Motion(tip, top - tip, ahead, PARTS[:, :2]), path, settings)
    poses = np.linspace(-1.0, 0.0, 20001)[None]
    tips, levers = path.at(poses)
    height = 20.0 * levers / np.linalg.norm(levers, axis=-1)[..., None]
    for k in range(2):
        lever = (top - tip)[0, k]
        second = tip[0, k] + 20.0 * lever / np.linalg.norm(lever)
        off = np.maximum(
            np.linalg.norm(tips[0] - tip[0, k], axis=1), np.linalg.norm(tips[0] + height[0] - second, axis=1)
        )
        assert off.min() / 0.01 / 1.8 <= share[0, k] * (1.0 + 1e-3)


def test_bounds_are_above_what_is_measured() -> None:
    random = np.random.default_rng(5)
    path, settings = original()
    for _ in range(50):
        tip, lever = path.at(PARTS)
        errors = random.uniform(0.0, 0.01, 2)
        tip_off, top_off = random.normal(size=(2, 1, 4, 3))
        tip_off *= errors[0] / np.linalg.norm(tip_off, axis=-1)[..., None]
        top_off *= errors[1] / np.linalg.norm(top_off, axis=-1)[..., None]
        motion = Motion(tip + tip_off, lever + top_off - tip_off, PARTS, PARTS)
        missing = np.abs(np.linalg.norm(motion.lever, axis=-1) - 20.0).max(axis=1)
        _, share = bounded((PARTS, PARTS), missing, path, errors[None], settings)
        assert taken(motion, path, settings).max() <= share[0] * (1.0 + 1e-9)
