"""The bound of second derivatives of motion in rotary words, against differences of many of its points."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.kinematics import load_machine
from cornersmooth.kinematics.machine import machine_names
from cornersmooth.nc_reader.rotary import Rotary, tool_vectors


@pytest.mark.parametrize("name", machine_names())
@pytest.mark.parametrize("tip_control", [True, False])
def test_no_block_bends_more_than_its_bound_and_most_come_near_it(name: str, tip_control: bool) -> None:
    random = np.random.default_rng(5)
    rotary = Rotary(load_machine(name), tip_control, 0.01, 10.0, 1e-4, 1e-4)
    count, steps = 400, np.linspace(0.0, 1.0, 101)
    start = 50.0 * random.normal(size=(count, 3))
    end = start + random.normal(size=(count, 3)) * random.choice([0.1, 1.0, 20.0], size=(count, 1))
    angles = random.uniform(-180.0, 180.0, (count, 2))
    turn = random.normal(size=(count, 2)) * random.choice([0.1, 5.0, 90.0], size=(count, 1))
    bounds = rotary._second_derivatives(start, end, angles, np.radians(np.abs(turn)))
    words = [(start + share * (end - start), angles + share * turn) for share in steps]
    motions = [rotary.tips(*at) for at in words], [tool_vectors(rotary.machine, at[1]) for at in words]
    for points, bound in zip(motions, bounds, strict=True):
        second = np.diff(np.stack(points), 2, axis=0) / steps[1] ** 2
        largest = np.linalg.norm(second, axis=2).max(axis=0)
        assert (largest <= bound * (1.0 + 1e-6) + 1e-6).all()
        if bound.any():
            assert np.median(largest / bound) > 0.4
