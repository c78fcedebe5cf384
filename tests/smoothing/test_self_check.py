"""The paper's method measures itself: what strays stays sharp, what does not is as published."""

from __future__ import annotations

import numpy as np

from cornersmooth import Program, Settings, smooth
from cornersmooth.model import Status
from cornersmooth.smoothing.construction import Construction
from cornersmooth.smoothing.self_check import distances, passing, straying_remainders
from cornersmooth.smoothing.zhang2016 import CONSTRUCTION


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


def test_what_is_left_of_a_segment_strays() -> None:
    """The tip leaves the corner far ahead of the axis, which turns fastest in the middle of its segment."""
    tip = np.array([[-50.7695, 18.9255, -18.034], [-28.7223, 42.7584, -51.656], [-28.7985, 42.5602, -51.3588]])
    axis = np.array([[0.85034, 0.0523, 0.52363], [0.49832, -0.82776, 0.25784], [0.74856, 0.10228, 0.65513]])
    program = Program.from_poses(tip, axis, feed=1000.0)
    settings = Settings(tolerance=0.031, axis_tolerance=2.959, method="zhang2016")
    smoothed = Construction.smooth(CONSTRUCTION, program, settings)
    assert smoothed.corners.smoothed.all()
    assert straying_remainders(smoothed).tolist() == [0]
    straight = Construction.smooth(CONSTRUCTION, bend(0.0), settings)
    assert straight.corners.smoothed.all()
    assert not len(straying_remainders(straight))


def test_going_back_is_told_from_the_farthest_sample() -> None:
    """Many small steps back are as much as a large one."""
    program = bend(0.0)
    share = np.array([0.1, 0.5, 0.4, 0.3, 0.9])
    tip = program.tip[0] + share[:, None] * (program.tip[1] - program.tip[0])
    axis = np.tile([0.0, 0.0, 1.0], (len(share), 1))
    for own_axis, length in ((False, np.sqrt(2.0)), (True, 1.0)):
        *_, backwards = distances(program, 20.0, np.array([[0, 1]]), tip[None], axis[None], own_axis=own_axis)
        assert np.isclose(backwards[0], 0.2 * 10.0 * length)


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
    assert (found[2] >= found[1] - 1e-9).all()
    assert backwards[0] == 0.0
    *_, backwards = distances(program, 20.0, poses, tip[None, ::-1], axis[None, ::-1])
    assert backwards[0] > 4.0


def test_passing_is_the_least_distance_of_the_lines() -> None:
    path = np.array([[[0.0, 0, 0], [10, 0, 0], [10, 10, 0]]])
    assert np.allclose(passing(np.array([[4.0, 3.0, 0.0]]), path), 3.0)
    assert np.allclose(passing(np.array([[13.0, 14.0, 0.0]]), path), 5.0)
