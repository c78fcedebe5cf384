"""The time of long motions from plans of their parts, beside plans of the whole."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from cornersmooth.feedrate import Limits, parts
from cornersmooth.feedrate.machine_axes import follow
from cornersmooth.feedrate.path import Path, build_path
from cornersmooth.feedrate.planner import plan_along
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.settings import Settings

LIMITS = Limits()


def rows(poses: int) -> Path:
    """Rows there and back with ripples of other heights, under an axis that sways."""
    number = np.arange(poses)
    along = 20.0 * np.arcsin(np.sin(0.06 * number)) * 2.0 / np.pi
    ripple = 0.4 * np.sin(0.9 * number) * (1.0 + np.sin(0.021 * number))
    tip = np.stack((along, 0.02 * number, ripple), axis=1)
    axis = np.stack((0.3 * np.sin(0.11 * number), 0.3 * np.cos(0.07 * number), np.ones(poses)), axis=1)
    return build_path(Program.from_poses(tip, axis, feed=3000.0), None, Settings(), LIMITS)


@cache
def whole() -> float:
    """Seconds of a plan of all rows."""
    path = rows(120)
    return plan_along(path, LIMITS, follow(load_machine("table-ac"), path)).total


@pytest.mark.parametrize("enough", [1e-3, 0.04])
def test_parts_take_what_the_whole_takes(monkeypatch: pytest.MonkeyPatch, enough: float) -> None:
    """All parts planned roughly and half of them closely, or no more than a looser error asks for."""
    path = rows(120)
    axes = follow(load_machine("table-ac"), path)
    some = enough > 1e-3
    changed = {"PART": 12, "SHORTEST": 12, "ENOUGH": enough, "_ROUGHLY": (3, 9), "_CLOSELY": (2, 4), "_MOST_CLOSELY": 8}
    for name, value in changed.items():
        monkeypatch.setattr(parts, name, value)
    speeds, planned = path.junction_speed.copy(), []
    found = parts.time_of_parts(path, LIMITS, axes, progress=lambda done, total: planned.append((done, total)))
    assert (path.junction_speed == speeds).all()  # cuts are made in copies
    assert (planned[-1][0] < planned[-1][1]) == some
    assert found.seconds == pytest.approx(whole(), rel=0.1 if some else 0.005)
    assert abs(found.seconds - whole()) < 3.0 * found.error + 0.003 * whole()
    assert found.error < (0.1 if some else 0.005) * whole()
    assert found.limiting
    if some:
        assert found == parts.time_of_parts(path, LIMITS, axes, processes=2)


def test_a_ratio_has_the_error_of_what_is_not_known() -> None:
    """Of all parts there is none; of few it is near the scatter of ratios from many drawings."""
    random = np.random.default_rng(1)
    known = random.uniform(1.0, 3.0, 400)
    taken = known * random.normal(1.2, 0.1, 400)
    assert parts._ratio(taken, known, 400)[1] == 0.0
    ratios, errors = [], []
    for _ in range(300):
        some = random.permutation(400)[:20]
        ratio, error = parts._ratio(taken[some], known[some], 400)
        ratios.append(ratio)
        errors.append(error)
    assert np.mean(errors) == pytest.approx(np.std(ratios) / np.mean(ratios), rel=0.2)
