"""Times of even ramps beside those that are planned closely."""

from __future__ import annotations

import numpy as np
import pytest

import cornersmooth as cs
from cornersmooth.feedrate import Limits, plan_text
from cornersmooth.feedrate.parts import ramp_times
from cornersmooth.feedrate.written import text_path
from cornersmooth.nc_reader import read_nc

AXES = cs.load_machine("table-bc")
HEAD = "G21 G90 G94 G17\nG234 H1\nG0 X0. Y0. Z0.\n"


def seconds(blocks: str) -> np.ndarray:
    nc = read_nc((HEAD + blocks).encode(), control="haas", machine=AXES)
    path = text_path(nc, Limits())
    return ramp_times(path, Limits(), AXES)[~path.rapid]


def closely(blocks: str) -> float:
    law = plan_text(read_nc((HEAD + blocks).encode(), control="haas", machine=AXES), machine=AXES)
    return float(np.diff(law.times_at(law.edge))[~law.path.rapid].sum())


@pytest.mark.parametrize("feed", [300, 3000, 12000])
def test_a_line_from_rest_to_rest(feed: int) -> None:
    block = f"G1 X400. F{feed}.\n"
    assert seconds(block).sum() == pytest.approx(closely(block), rel=2e-3)


def test_lines_that_go_straight_on_are_one() -> None:
    apart = seconds("G1 X30. F3000.\nX31.\nX80.\n")
    assert len(apart) == 3
    assert apart.sum() == pytest.approx(seconds("G1 X80. F3000.\n").sum(), rel=1e-9)


@pytest.mark.parametrize("feed", [300, 1000, 4000])
def test_a_corner_costs_what_it_costs(feed: int) -> None:
    way = "X40. Y0.\nX40. Y40.\nX80. Y70.\n"
    assert seconds(f"G1 F{feed}.\n{way}").sum() == pytest.approx(closely(f"G1 F{feed}.\n{way}"), rel=0.02)


def test_a_wave_in_short_lines() -> None:
    x = np.linspace(0, 60, 121)
    blocks = "G1 F1500.\n" + "".join(f"X{a:.3f} Y{3 * np.sin(a / 3):.3f}\n" for a in x[1:])
    assert seconds(blocks).sum() == pytest.approx(closely(blocks), rel=0.1)
