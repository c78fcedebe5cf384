"""GOHOME asks for a retract in its place."""

from __future__ import annotations

import re
from functools import cache

import pytest

from cornersmooth.cl import read
from cornersmooth.model import Program
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import Case
from nc.promise import written

CASES = (
    Case("fanuc", "g1"),
    Case("fanuc", "g6.2"),
    Case("fanuc", "g1", "table-ac", tcp=False),
    Case("mitsubishi", "g1", "head-ac"),
    Case("haas", "g1", "table-bc"),
    Case("siemens", "g1"),
    Case("heidenhain", "g1"),
    Case("linuxcnc", "g1", "xyzac-trt"),
    Case("generic", "g1"),
)

CL = """LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
RAPID
GOTO/0,0,2
FEDRAT/MMPM,300
GOTO/20,0,2
RAPID
GOTO/20,0,50
GOHOME
RAPID
GOTO/40,0,50
RAPID
GOTO/40,0,2
GOTO/60,0,2
RAPID
GOTO/60,0,50
FINI
"""


@cache
def program(*, home: bool) -> Program:
    """The CL program, with GOHOME or without."""
    return read((CL if home else CL.replace("GOHOME\n", "")).encode(), name="part.cls")


def wrong(case: Case, lines: list[str], *, home: bool) -> list[str]:
    """What is found in a text whose head does not say who wrote it."""
    text = "\n".join([*(re.sub("CORNERSMOOTH", "MADE", line) for line in lines), ""]).encode()
    how = {"control": case.control, "machine": case.choose().machine, "tcp": case.tcp}
    return [problem.text for problem in verify(program(home=home), text, tolerance=0.02, **how).problems]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_way_home_is_compared(case: Case) -> None:
    texts = {
        home: written(program(home=home), case.choose(), Settings(tolerance=0.02))[0].splitlines()
        for home in (True, False)
    }
    for home, lines in texts.items():
        assert wrong(case, lines, home=home) == []
    missing = ["GOHOME of the CL file is missing: the tool does not go up to a retract"]
    assert wrong(case, texts[False], home=True) == ([] if case.control == "generic" else missing)


@pytest.mark.parametrize("case", [one for one in CASES if one.control != "generic"], ids=str)
def test_the_spindle_turns_on_the_way_home(case: Case) -> None:
    """The CL file stops it behind GOHOME, if at all; the tool is in the part until then."""
    lines = written(program(home=True), case.choose(), Settings(tolerance=0.02))[0].splitlines()
    home = next(k for k, line in enumerate(lines) if re.search(r"GOHOME", line))
    for word in ("M5", "M4"):
        put = f"99 {word}" if case.control == "heidenhain" else word
        assert any(text.startswith("spindle") for text in wrong(case, [*lines[:home], put, *lines[home:]], home=True))


def test_what_is_asked_for_behind_the_way_home_is_compared_behind_it() -> None:
    case = CASES[0]
    part = read(CL.replace("GOHOME\n", "GOHOME\nSPINDL/RPM,2000,CLW\n").encode(), name="part.cls")
    lines = written(part, case.choose(), Settings(tolerance=0.02))[0].splitlines()
    start = next(k for k, line in enumerate(lines) if "S2000" in line)
    home = max(k for k, line in enumerate(lines[:start]) if "G28" in line)
    early = [*lines[:home], lines[start], *lines[home:start], *lines[start + 1 :]]
    for text, right in ((lines, True), (early, False)):
        assert verify(part, ("\n".join(text) + "\n").encode(), tolerance=0.02).passed is right
