"""The paper's method measures itself: what strays stays sharp, what does not is as published."""

from __future__ import annotations

import numpy as np

from cornersmooth import Program, Settings, smooth
from cornersmooth.model import Status
from cornersmooth.smoothing.self_check import distances, passing


def bend(turn: float) -> Program:
    """A right angle of the tip in which the axis swings back and forth by `turn`."""
    tip = np.array([[0.0, 0, 0], [10, 0, 0], [10, 0.2, 0], [30, 0.2, 0]])
    axis = np.array([[0.0, 0, 1], [turn, 0, 1], [-turn, turn, 1], [0, 0, 1]])
    return Program.from_poses(tip, axis, feed=1000.0)


def test_what_strays_stays_sharp() -> None:
    settings = Settings(tolerance=0.01, axis_length=50.0, method="zhang2016")
    assert smooth(bend(0.0), settings).corners.smoothed.all()
    corners = smooth(bend(0.7), settings).corners
    sharp = corners.status == Status.STRAYS
    assert sharp.any()
    assert not corners.trim_in[sharp].any()
    assert not corners.tip_error[sharp].any()
    assert np.isnan(corners.extra["jump_in"][sharp]).all()


def test_distances_are_those_of_the_ruled_motion() -> None:
    program = bend(0.3)
    poses = np.array([[0, 1, 2]])
    share = np.array([0.1, 0.5, 0.9, 1.0])
    tip = program.tip[0] + share[:, None] * (program.tip[1] - program.tip[0])
    axis = program.axis[0] + share[:, None] * (program.axis[1] - program.axis[0])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    off = np.array([0.0, 0.0, 0.25])
    *found, backwards = distances(program, 20.0, poses, (tip + off)[None], axis[None])
    assert np.allclose(found[0], 0.25, atol=1e-9)
    assert (found[1] <= 0.25 + 1e-9).all()  # another point of its path may be nearer
    assert (np.maximum(found[2].tip, found[2].axis_point) >= found[1] - 1e-9).all()
    assert backwards[0] == 0.0
    *_, backwards = distances(program, 20.0, poses, tip[None, ::-1], axis[None, ::-1])
    assert backwards[0] > 4.0


def test_passing_is_the_least_distance_of_the_lines() -> None:
    path = np.array([[[0.0, 0, 0], [10, 0, 0], [10, 10, 0]]])
    assert np.allclose(passing(np.array([[4.0, 3.0, 0.0]]), path), 3.0)
    assert np.allclose(passing(np.array([[13.0, 14.0, 0.0]]), path), 5.0)
