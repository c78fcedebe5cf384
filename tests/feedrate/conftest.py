"""Random chains and oracles that share nothing with the planner."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cornersmooth.model import Program

#: corner counts, feeds (mm/min) and how much the direction wanders, taken in turn
COUNTS = (6, 12, 25, 9)
FEEDS = (1800.0, 6000.0, 20000.0)
WANDER = (0.2, 0.6, 1.5, 0.9, 3.0)


def random_chain(seed: int) -> Program:
    """A chain of linear feed moves with moderate to sharp corners and a wandering axis."""
    rng = np.random.default_rng(seed)
    n = COUNTS[seed % len(COUNTS)]
    direction = np.cumsum(rng.normal(size=(n, 3)) * WANDER[seed % len(WANDER)], axis=0) + 2.0 * rng.normal(size=3)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    tip = np.cumsum(direction * rng.uniform(0.2, 6.0, (n, 1)), axis=0)
    axis = np.array([0.0, 0.0, 1.0]) + np.cumsum(0.03 * rng.normal(size=(n, 3)), axis=0)
    return Program.from_poses(tip, axis, feed=FEEDS[seed % len(FEEDS)])


@pytest.fixture(scope="session")
def chain() -> Callable[[int], Program]:
    return random_chain
