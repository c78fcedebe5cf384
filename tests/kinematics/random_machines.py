"""Machines that nobody has built: any directions, any points, any carriers."""

from __future__ import annotations

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import Machine, RotaryAxis


def random_machine(seed: int) -> Machine:
    rng = np.random.default_rng(seed)
    carriers = [("table", "table"), ("table", "head"), ("head", "head")][seed % 3]
    while True:
        try:
            first, second = (
                RotaryAxis(
                    name,
                    tuple(rng.normal(size=3)),
                    carrier,
                    point=tuple(rng.normal(size=3) * 100),
                    positive="table" if carrier == "table" and rng.random() < 0.5 else "tool",
                )
                for name, carrier in zip("CB", carriers, strict=True)
            )
            return Machine(
                "random",
                (first, second),
                tool_direction=tuple(rng.normal(size=3)),
                tool_length=80,
                part_zero=tuple(rng.normal(size=3) * 50),
            )
        except SettingsError:  # nearly parallel directions
            continue
