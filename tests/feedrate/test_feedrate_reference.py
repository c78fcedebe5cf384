"""The production planner against linear programmes on the same limits."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from linear_programmes import reference_time

from cornersmooth.feedrate import Limits, direct, plan
from cornersmooth.model import Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.share import share


@pytest.mark.parametrize("seed", share(range(1, 21), 7))
def test_smoothed_paths(chain: Callable[[int], Program], seed: int) -> None:
    limits = Limits()
    law = plan(smooth(chain(seed), Settings(tolerance=(0.005, 0.02, 0.1)[seed % 3])), limits)
    reference = reference_time(law.path, limits)
    assert 0.995 * reference <= law.total <= 1.02 * reference


@pytest.mark.parametrize("seed", share(range(1, 5), 2))
def test_direct_path_with_jumps(chain: Callable[[int], Program], seed: int) -> None:
    limits = Limits(period=0.004)
    law = direct(chain(seed), limits, "velocity_jump")
    reference = reference_time(law.path, limits)
    assert 0.995 * reference <= law.total <= 1.02 * reference
