"""Cycles, and the length of a tool, need the plane XY, though an arc before them was in another."""

from __future__ import annotations

import io

import pytest

from cornersmooth.cl import read
from cornersmooth.nc import Frame
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from nc.cases import Case

_ARC = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
FEDRAT/600,MMPM
GOTO/0,0,0
CIRCLE/10,0,0,0,1,0,10
GOTO/20,0,0
RAPID
GOTO/20,0,50
"""
_DRILL = "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,2\nGOTO/40,0,0\nCYCLE/OFF\nFINI\n"
_CHANGE = "LOADTL/4\nSPINDL/RPM,3000,CLW\nRAPID\nGOTO/40,0,50\n"


@pytest.mark.parametrize("between", ["", _CHANGE], ids=["one tool", "two tools"])
@pytest.mark.parametrize("control", ["fanuc", "mitsubishi", "siemens"])
def test_the_plane_is_xy_again_before_a_cycle_and_a_tool(control: str, between: str) -> None:
    program, stream = read((_ARC + between + _DRILL).encode(), name="part.cls"), io.BytesIO()
    made = postprocess(
        program, stream, Settings(tolerance=0.02), form=Case(control, "g1").choose(), frame=Frame(cycles="native")
    )
    assert made.verification is not None
    assert made.verification.passed, made.verification.problems
    lines = [line.split()[0] for line in stream.getvalue().decode().splitlines() if line]
    plane = "G17"
    for line in lines:
        plane = line if line in ("G17", "G18", "G19") else plane
        assert plane == "G17" or (line not in ("G98", "G43", "G43.5", "D1") and not line.startswith("CYCLE8"))
    if control == "siemens" and not between:  # D1 without TRAORI counts across the plane
        assert "G18" not in lines
