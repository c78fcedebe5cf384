"""The time of long motions from plans of their parts, beside plans of the whole."""

from __future__ import annotations

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


@pytest.mark.parametrize("most", [1000, 9])
def test_parts_take_what_the_whole_takes(monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    path = rows(200)
    axes = follow(load_machine("table-ac"), path)
    whole = plan_along(path, LIMITS, axes).total
    for name, value in {"PART": 12, "MOST": most, "_LEAST": 4, "_MOST_CLOSELY": 8}.items():
        monkeypatch.setattr(parts, name, value)
    speeds = path.junction_speed.copy()
    found = parts.time_of_parts(path, LIMITS, axes)
    assert (path.junction_speed == speeds).all()  # cuts are made in copies
    assert found.seconds == pytest.approx(whole, rel=0.005 if most > 17 else 0.1)
    assert abs(found.seconds - whole) < 3.0 * found.error + 0.003 * whole
    assert found.error < (0.005 if most > 17 else 0.1) * whole
    assert found.limiting
    if most < 17:
        assert found == parts.time_of_parts(path, LIMITS, axes, processes=2)


def test_rows_in_turn_are_spread_from_the_first_on() -> None:
    for count in (1, 2, 5, 16, 37):
        turn = parts._in_turn(count)
        assert sorted(turn.tolist()) == list(range(count))
    assert parts._in_turn(16)[:4].tolist() == [0, 8, 4, 12]
