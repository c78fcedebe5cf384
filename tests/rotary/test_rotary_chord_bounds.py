"""Bounds that proofs rest on, against second differences of the motions themselves."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.kinematics import Machine, load_machine, machine_names, tip_position, tool_axis
from cornersmooth.rotary.subdivision import axis_bend, ruled_bend, tip_bend
from kinematics.random_machines import random_machine

STEPS = 200

MACHINES = [load_machine(name) for name in machine_names()] + [random_machine(seed) for seed in range(6)]
IDS = [f"{machine.name}-{index}" for index, machine in enumerate(MACHINES)]


def bend_of(values: np.ndarray) -> np.ndarray:
    """Largest second derivative by differences over [0, 1]: (steps + 1, n, 3) -> (n,)."""
    return np.linalg.norm(np.diff(values, 2, axis=0), axis=2).max(axis=0) * STEPS**2


def moves(machine: Machine, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Words at both ends, from tiny turns to large ones, near the pole too."""
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=(400, 2)) * 10.0 ** rng.uniform(-2, 2, (400, 1))
    start = rng.uniform(-180, 180, (400, 2))
    start[::4, 1] = rng.normal(size=100) * 0.1
    return start, start + np.clip(turn, -170, 170)


@pytest.mark.parametrize("machine", MACHINES, ids=IDS)
def test_axis_and_tip_bend_no_more(machine: Machine):
    rng = np.random.default_rng(1)
    start, end = moves(machine, 2)
    share = np.linspace(0, 1, STEPS + 1)[:, None, None]
    words = start * (1 - share) + end * share
    axis = tool_axis(machine, words.reshape(-1, 2)).reshape(STEPS + 1, -1, 3)
    turn = np.radians(end - start)
    bound = axis_bend(machine, turn, axis[0], axis[-1], 0.0)
    ratio = bend_of(axis) / bound
    assert ratio.max() <= 1 + 1e-4
    assert ratio.max() > 0.9  # no wider than need be
    linear = rng.uniform(-200, 200, (2, len(turn), 3))
    linear[1] = linear[0] + (linear[1] - linear[0]) * rng.choice([0.0, 0.001, 0.1], (len(turn), 1))
    places = linear[0] * (1 - share) + linear[1] * share
    tip = tip_position(machine, places.reshape(-1, 3), words.reshape(-1, 2)).reshape(places.shape)
    ratio = bend_of(tip) / tip_bend(machine, linear[0], linear[1], turn)
    assert ratio.max() <= 1 + 1e-4
    assert ratio.max() > 0.25


def test_ruled_motion_bends_no_more():
    rng = np.random.default_rng(3)
    start = rng.normal(size=(2000, 3))
    end = start + rng.normal(size=(2000, 3)) * 10.0 ** rng.uniform(-4, 0.5, (2000, 1))
    share = np.linspace(0, 1, STEPS + 1)[:, None, None]
    along = start * (1 - share) + end * share
    ratio = bend_of(along / np.linalg.norm(along, axis=2, keepdims=True)) / ruled_bend(start, end)
    assert ratio.max() <= 1 + 1e-4
    assert ratio.max() > 0.9


def test_a_jump_has_no_bound():
    start = np.array([[0, 0, 1.0], [0, 0.6, 0.8], [0, 0, 1], [0, 0, 1]])
    end = np.array([[0, 0, -1.0], [0, -0.6, -0.8], [0, 0, 1], [0, 0, 2]])
    assert ruled_bend(start, end).tolist() == [np.inf, np.inf, 0.0, 0.0]
