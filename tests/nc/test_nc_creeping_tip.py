"""The feed of a move in which the tip hardly moves while the tool turns far: the axis point runs with the feed."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from oracle.command import run

CL = """UNITS/MM
LOADTL/3
SPINDL/8000,CLW
RAPID
GOTO/10,0,50,0,0,1
FEDRAT/1000,MMPM
GOTO/10,0,0,0,0,1
GOTO/20,0,0,0,0,1
GOTO/20.0002,0,0,0,0.5,0.8660254
GOTO/30,0,0,0,0.5,0.8660254
RAPID
GOTO/30,0,80,0,0.5,0.8660254
FINI
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    (tmp_path / "part.cls").write_text(CL)
    options = ("-e", "0.01", "-H", "10", "--control", "linuxcnc", "--machine", "xyzac-trt", "-q")
    assert run("smooth", tmp_path / "part.cls", *options, "-o", tmp_path / "part.ngc").returncode == 0
    return tmp_path / "part.ngc"


def test_the_axis_point_runs_with_the_feed(program: Path) -> None:
    inverse = program.read_text().split("G93\n")[1].split("G94")[0]
    blocks = re.findall(r"A([-\d.]+) .*?F([\d.]+)", inverse)
    angles, rates = zip(*((float(angle), float(rate)) for angle, rate in blocks), strict=True)
    begin = float(re.findall(r"A([-\d.]+)", program.read_text().split("G93\n")[0])[-1])
    speeds = [
        10.0 * math.radians(angle - before) * rate
        for before, angle, rate in zip((begin, *angles), angles, rates, strict=False)
    ]
    assert speeds == pytest.approx([1000.0] * len(speeds), rel=0.01)


def test_a_feed_of_neither_point_is_found(program: Path) -> None:
    wrong = program.with_suffix(".wrong")
    head, inverse = program.read_text().split("G93\n")
    wrong.write_text(
        head + "G93\n" + re.sub(r"F([\d.]+)", lambda found: f"F{float(found[1]) / 3:.3f}", inverse, count=3)
    )
    assert run("verify", program.with_name("part.cls"), wrong).returncode == 1
