"""Words that another plane (G18, G19) turns into something else: hole cycles, compensation, the length of the tool."""

from __future__ import annotations

import io
import re
from functools import cache

import pytest

from cornersmooth.cl import read
from cornersmooth.model import Program
from cornersmooth.nc import Frame
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import Case

CASES = (
    Case("fanuc", "g1"),
    Case("fanuc", "g1", "table-ac"),
    Case("mitsubishi", "g1"),
    Case("haas", "g1", "table-ac"),
    Case("linuxcnc", "g1", "xyzac-trt"),
    Case("siemens", "g1"),
    Case("siemens", "g1", "table-bc"),
)

_BEGIN = "LOAD/TOOL,4,ADJUST,4\nSPINDL/RPM,3000,CLW\nRAPID\nGOTO/0,0,50,0,0,1\n"
CLS = {
    "cycle": "CYCLE/DRILL,DEEP,STEP,3,FEDTO,-15,RTRCTO,20,RAPTO,3,MMPM,120\nGOTO/10,10,0\nCYCLE/OFF\n",
    "compensation": "RAPID\nGOTO/0,0,-3\nFEDRAT/MMPM,300\nCUTCOM/LEFT\nGOTO/20,0,-3\nGOTO/20,20,-3\nCUTCOM/OFF\n",
}


@cache
def program(name: str) -> Program:
    """A CL program."""
    return read((_BEGIN + CLS[name] + "RAPID\nGOTO/20,20,50\nFINI\n").encode(), name="part.cls")


@cache
def lines_of(name: str, case: Case) -> tuple[str, ...]:
    """What is written for it with the words of the control."""
    stream, frame = io.BytesIO(), Frame(cycles="native")
    postprocess(program(name), stream, Settings(tolerance=0.02), form=case.choose(), frame=frame, verify=False)
    return tuple(stream.getvalue().decode().splitlines())


def texts(name: str, case: Case, lines: list[str]) -> str:
    """What is found in a text."""
    how = {"control": case.control, "machine": case.choose().machine}
    found = verify(program(name), ("\n".join(lines) + "\n").encode(), tolerance=0.02, **how)
    return " | ".join(problem.text for problem in found.problems)


@pytest.mark.parametrize("name", CLS)
@pytest.mark.parametrize("case", CASES, ids=str)
def test_they_are_taken_in_the_plane_xy_alone(case: Case, name: str) -> None:
    lines = list(lines_of(name, case))
    assert texts(name, case, lines) == ""
    taken = next(k for k, line in enumerate(lines) if re.search(r"\bG83|CYCLE83\(|\bG41", line))
    for plane in ("G18", "G19"):
        for other in ([line.replace("G17", plane) for line in lines], [*lines[:taken], plane, *lines[taken:]]):
            assert f"under {plane}, where G17 must be in force" in texts(name, case, other)
    if name == "compensation":  # the plane may not change while it is on, either
        found = texts(name, case, [*lines[: taken + 1], "G18", *lines[taken + 1 :]])
        assert "G41 under G18, where G17 must be in force" in found
