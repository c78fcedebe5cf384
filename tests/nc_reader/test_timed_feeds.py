"""Feeds that a block may have had where F is the inverse of its time (G93): from its way in the numbers of the text."""

from __future__ import annotations

import pytest

from cornersmooth.kinematics import load_machine
from cornersmooth.nc_reader import read_nc

BEFORE = "G90 G21 G17\nG93\nG1 X-9. Y0. Z0. A0. C0. F1.\nG1 X0.0000 Y0.0000 Z0.0000 A0.0000 C0.0000 F1.\n"


@pytest.mark.parametrize(
    ("tcp", "block", "right", "wrong"),
    [
        (True, "X3. F100.", [300.0], [3.0, 150.0, 297.0, 303.0]),
        (False, "X3. F100.", [300.0], [3.0, 150.0, 297.0, 303.0]),
        # 0.002 mm in digits of 0.0001 mm; without tip control those of the axes count, too, 300 mm from their points
        (True, "X0.002 F100000.", [185.0, 200.0, 215.0], [150.0, 250.0]),
        (False, "X0.002 F100000.", [90.0, 200.0, 310.0], [60.0, 400.0]),
        # the tip may have stayed within some tolerance up to ε, 0.01 mm: then the axis point has timed it
        (True, "X0.005 A0.5 F10000.", [50.0, 872.7], [100.0, 400.0, 1750.0]),
        (True, "X0.02 A0.5 F10000.", [200.0], [100.0, 400.0, 872.7]),
        # the axis point goes 10 mm · 2 sin 3°
        (True, "A6. F100.", [104.672], [52.0, 103.0, 106.0, 209.0]),
        # an axis turns by 40,000 deg/min: the block may have got more time for it than its feed asks for, never less
        (True, "Z1. C10. F4000.", [4000.0, 9000.0], [2000.0, 3900.0]),
        (False, "Z1. C10. F4000.", [4000.0, 9000.0], [2000.0, 3900.0]),
    ],
)
def test_feeds_that_a_block_may_have(tcp: bool, block: str, right: list[float], wrong: list[float]) -> None:
    text = f"{BEFORE}G1 {block}\n".encode()
    how = {"control": "linuxcnc", "machine": load_machine("head-ac"), "tolerance": 0.01, "axis_length": 10.0}
    nc = read_nc(text, tcp=tcp, **how)
    assert [feed for feed in right if not nc.carry(len(nc) - 1, feed, False)] == []
    assert [feed for feed in wrong if nc.carry(len(nc) - 1, feed, False)] == []
    # a plan gives blocks more time
    assert all(nc.at_most().carry(len(nc) - 1, 1.5 * max(right), False) for feed in right)
    assert not nc.carry(len(nc) - 1, right[0], True)
