"""Tool axis from angles and back."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.kinematics import (
    Machine,
    RotaryAxis,
    load_machine,
    machine_names,
    machine_position,
    solutions,
    tip_position,
    tool_axis,
)
from cornersmooth.kinematics.poses import closest_second, passes_pole, wrap
from kinematics.random_machines import random_machine
from oracle.share import how_many

RNG = np.random.default_rng(20160713)
MACHINES = [load_machine(name) for name in machine_names()] + [random_machine(seed) for seed in range(6)]
IDS = [f"{machine.name}-{index}" for index, machine in enumerate(MACHINES)]


@pytest.mark.parametrize("machine", MACHINES, ids=IDS)
def test_forward_of_inverse_is_the_pose(machine: Machine):
    count = how_many(20_000, 100_000)
    words = RNG.uniform(-180, 180, (count, 2))
    axis = tool_axis(machine, words)
    np.testing.assert_allclose(np.linalg.norm(axis, axis=1), 1, atol=1e-14)
    found = solutions(machine, axis)
    assert found.beyond.max() < 1e-12
    for branch in (0, 1):
        np.testing.assert_allclose(tool_axis(machine, found.angles[:, branch]), axis, atol=1e-12)
    # One of the two is what we started from; near the pole the angles themselves are ill conditioned.
    off = np.abs(wrap(found.angles - words[:, None, :])).max(axis=2).min(axis=1)
    assert np.median(off) < 1e-12
    assert off.max() < 1e-5
    tip = RNG.uniform(-300, 300, (count, 3))
    chosen = found.angles[:, 1] + 360 * RNG.integers(-3, 4, (count, 2))
    back = tip_position(machine, machine_position(machine, tip, chosen), chosen)
    np.testing.assert_allclose(back, tip, atol=1e-9)


@pytest.mark.parametrize("machine", MACHINES, ids=IDS)
def test_inverse_keeps_its_digits_near_the_poles(machine: Machine):
    for pole in (machine.axes[0].unit, -machine.axes[0].unit):
        axis = pole + RNG.normal(size=(5000, 3)) * 10.0 ** RNG.uniform(-18, -1, (5000, 1))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        found = solutions(machine, axis)
        reached = found.beyond == 0
        for branch in (0, 1):
            got = tool_axis(machine, found.angles[reached, branch])
            np.testing.assert_allclose(got, axis[reached], atol=1e-14)


def test_all_directions_are_reached_by_orthogonal_axes_only():
    axis = RNG.normal(size=(10_000, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    for name in ("xyzac-trt", "xyzbc-trt", "table-ac", "table-bc", "head-ac", "head-table-bc"):
        assert solutions(load_machine(name), axis).beyond.max() == 0
    found = solutions(load_machine("nutated-bc"), axis)
    down = np.degrees(np.arcsin(-axis[:, 2]))  # 45 deg of nutation reach the horizontal
    np.testing.assert_allclose(found.beyond, np.maximum(down, 0), atol=1e-9)
    nearest = tool_axis(load_machine("nutated-bc"), found.angles[:, 0])
    level = axis * [1, 1, 0] / np.linalg.norm(axis[:, :2], axis=1, keepdims=True)
    np.testing.assert_allclose(nearest[down > 0.1], level[down > 0.1], atol=1e-7)


def test_linuxcnc_trunnions():
    a, c = np.radians(words := RNG.uniform(-180, 180, (1000, 2))).T
    words = words[:, ::-1]  # C first: it is nearest to the part
    tilting = load_machine("xyzac-trt")
    want = np.stack((np.sin(c) * np.sin(a), np.cos(c) * np.sin(a), np.cos(a)), axis=1)
    np.testing.assert_allclose(tool_axis(tilting, words), want, atol=1e-14)
    swinging = load_machine("xyzbc-trt")
    want = np.stack((-np.cos(c) * np.sin(a), np.sin(c) * np.sin(a), np.cos(a)), axis=1)
    np.testing.assert_allclose(tool_axis(swinging, words), want, atol=1e-14)
    x, y, z = tip = RNG.uniform(-100, 100, (3, 1000))
    want = np.stack(
        (
            np.cos(c) * x - np.sin(c) * y,
            np.sin(c) * np.cos(a) * x + np.cos(c) * np.cos(a) * y - np.sin(a) * z,
            np.sin(c) * np.sin(a) * x + np.cos(c) * np.sin(a) * y + np.cos(a) * z,
        ),
        axis=1,
    )
    np.testing.assert_allclose(machine_position(tilting, tip.T, words), want, atol=1e-12)
    want = np.stack(
        (
            np.cos(c) * np.cos(a) * x - np.sin(c) * np.cos(a) * y + np.sin(a) * z,
            np.sin(c) * x + np.cos(c) * y,
            -np.cos(c) * np.sin(a) * x + np.sin(c) * np.sin(a) * y + np.cos(a) * z,
        ),
        axis=1,
    )
    np.testing.assert_allclose(machine_position(swinging, tip.T, words), want, atol=1e-12)


def test_joints_that_the_controller_itself_ran_to():
    joints = machine_position(load_machine("xyzac-trt"), np.array([[20.0, 20, -5]]), np.array([[60.0, 25]]))
    np.testing.assert_allclose(joints, [[-7.32051, 26.87388, 7.01461]], atol=5e-6)


def test_offsets_of_linuxcnc_are_the_points():
    """trtfuncs.c with y-offset 20 and z-offset 10: A runs through (0, 20, 10), C through the origin."""
    plain = load_machine("xyzac-trt")
    second = plain.axes[1]
    machine = Machine("trt", (plain.axes[0], RotaryAxis("A", second.direction, "table", (0, 20, 10), "table")))
    a, c = np.radians(25.0), np.radians(60.0)
    x, y, z, dy, dz = 20.0, 20.0, -5.0, 20.0, 10.0
    want = [
        np.cos(c) * x - np.sin(c) * y,
        np.sin(c) * np.cos(a) * x + np.cos(c) * np.cos(a) * y - np.sin(a) * z - np.cos(a) * dy + np.sin(a) * dz + dy,
        np.sin(c) * np.sin(a) * x + np.cos(c) * np.sin(a) * y + np.cos(a) * z - np.sin(a) * dy - np.cos(a) * dz + dz,
    ]
    np.testing.assert_allclose(machine_position(machine, np.array([[x, y, z]]), np.array([[60.0, 25]]))[0], want)


def test_iso_signs_turn_the_tool():
    """ISO 841: positive words turn the tool right-handed as seen from the part, wherever the axis sits."""
    for name in ("table-ac", "head-ac"):
        np.testing.assert_allclose(
            tool_axis(load_machine(name), np.array([[90.0, 30]])), [[0.5, 0, np.cos(np.pi / 6)]], atol=1e-15
        )
    for name in ("table-bc", "head-table-bc"):
        np.testing.assert_allclose(
            tool_axis(load_machine(name), np.array([[0.0, 30]])), [[0.5, 0, np.cos(np.pi / 6)]], atol=1e-15
        )


def test_head_swings_about_its_pivot():
    machine = load_machine("head-ac")  # pivot 200 mm above the nose, tool 100 mm: 300 mm from the tip
    words = np.array([[0.0, 90.0], [90.0, 90.0]])
    # A = 90 lays the tool along -Y: the spindle stands there, 300 mm from the tip.
    np.testing.assert_allclose(
        machine_position(machine, np.zeros((2, 3)), words), [[0, -300, -300], [300, 0, -300]], atol=1e-12
    )


def test_zero_words_are_the_part_itself():
    tip = RNG.normal(size=(10, 3)) * 50
    for machine in MACHINES:
        np.testing.assert_allclose(machine_position(machine, tip, np.zeros((10, 2))), tip, atol=1e-12)


def test_second_angle_that_comes_closest():
    machine = load_machine("nutated-bc")
    words = RNG.uniform(-179, 179, (1000, 2))
    axis = tool_axis(machine, words)
    np.testing.assert_allclose(closest_second(machine, axis, words[:, 0]), words[:, 1], atol=1e-9)
    fixed = RNG.uniform(-180, 180, 1000)
    best = closest_second(machine, axis, fixed)
    at_best = np.einsum("ij,ij->i", tool_axis(machine, np.stack((fixed, best), axis=1)), axis)
    for other in RNG.uniform(-180, 180, (20, 1000)):
        got = np.einsum("ij,ij->i", tool_axis(machine, np.stack((fixed, other), axis=1)), axis)
        assert (got <= at_best + 1e-12).all()


def test_passage_near_the_pole():
    machine = load_machine("table-ac")
    tilt = np.radians(5)

    def leaning(across: float, side: float) -> np.ndarray:
        vector = np.array([[side * np.sin(tilt), np.radians(across), np.cos(tilt)]])
        return vector / np.linalg.norm(vector)

    assert passes_pole(machine, leaning(0.0, 1), leaning(0.0, -1), 1e-9)[0]
    assert passes_pole(machine, leaning(0.09, 1), leaning(0.09, -1), 0.1)[0]
    assert not passes_pole(machine, leaning(0.11, 1), leaning(0.11, -1), 0.1)[0]
    assert not passes_pole(machine, leaning(0.0, 1), leaning(0.05, 1), 0.1)[0]


def test_singular_poses_are_flagged():
    axis = np.array([[0, 0, 1.0], [0, 0, -1], [1, 0, 0], [np.sin(1e-6), 0, np.cos(1e-6)]])
    found = solutions(load_machine("table-ac"), axis)
    assert found.singular.tolist() == [True, True, False, False]
    assert found.pole_distance == pytest.approx([0, 0, 90, np.degrees(1e-6)])
    assert solutions(load_machine("nutated-bc"), axis).singular.tolist() == [True, False, False, False]
