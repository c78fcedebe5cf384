"""Places where rotary axes accelerate most: against the same by hand, from angles that the path was made of."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.kinematics import load_machine, tool_axis
from cornersmooth.model import Move, Program
from cornersmooth.report import marks_text, rotary_marks

#: table-ac has its axes in the order C, A
MACHINE = load_machine("table-ac")


def path(a: np.ndarray, c: np.ndarray, feed: float = 600.0) -> Program:
    names = MACHINE.names
    angles = np.stack([{"A": a, "C": c}[name] for name in names], axis=1)
    tip = np.column_stack((np.arange(len(a)) * 2.0, np.zeros(len(a)), np.zeros(len(a))))
    kind = np.full(len(a), Move.LINEAR, np.uint8)
    kind[0] = Move.RAPID
    return Program.from_poses(tip, tool_axis(MACHINE, angles), kind=kind, feed=feed, line=np.arange(10, 10 + len(a)))


def test_the_place_and_the_size_are_those_of_the_angles() -> None:
    # 2 mm at 600 mm/min are 0.2 s: A turns 1 deg a move, from pose 5 on 3 deg; C stops at pose 7
    a = np.array([20.0, 21, 22, 23, 24, 25, 28, 31, 34, 37])
    c = np.array([0.0, 4, 8, 12, 16, 20, 24, 28, 28, 28])
    found = {one["axis"]: one["places"] for one in rotary_marks(path(a, c), MACHINE)}
    assert (found["A"][0]["line"], len(found["A"])) == (15, 1)
    assert found["A"][0]["deg_per_s2"] == pytest.approx((3 - 1) / 0.2 / 0.2)
    assert found["C"][0]["line"] == 17
    assert found["C"][0]["deg_per_s2"] == pytest.approx(4 / 0.2 / 0.2)
    assert marks_text({"axis": "C", "places": found["C"]}) == "C accelerates most at line 17 (100 deg/s2)"


def test_at_half_the_feed_it_is_a_quarter() -> None:
    a, c = np.array([20.0, 21, 22, 25, 28]), np.zeros(5)
    fast, slow = (rotary_marks(path(a, c, feed), MACHINE)[0]["places"][0]["deg_per_s2"] for feed in (600.0, 300.0))
    assert fast == pytest.approx(4 * slow)


def test_what_does_not_turn_and_what_has_no_feed_or_machine_has_no_places() -> None:
    a, c = np.array([20.0, 21, 22, 25, 28]), np.zeros(5)
    assert rotary_marks(path(np.full(5, 20.0), c), MACHINE) == []
    assert rotary_marks(path(a, c, np.nan), MACHINE) == []
    assert rotary_marks(path(a, c), None) == []
