"""Pecks: each word of a cycle is compared, written as moves or as a cycle of the control."""

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
    Case("mitsubishi", "g1", "head-ac"),
    Case("haas", "g1", "table-ac"),
    Case("linuxcnc", "g1", "xyzac-trt"),
    Case("siemens", "g1"),
    Case("heidenhain", "g1"),
)

_DEEP = "DRILL,DEEP,STEP,3,FEDTO,-15"
_CHIP = "DRILL,BRKCHP,STEP,3,FEDTO,-15"
_FIRST = "DEEP2,1STPECK,5,SUBPECK,2,FEDTO,-14"

#: by cycle: what becomes of words of controls' cycles
NATIVE = {
    _DEEP: (
        (r"G83(.*) Q3\.0*", r"G81\1"),
        (r"G83", "G73"),
        (r" Q3\.0*", " Q30."),
        (r" Q3\.0*", " Q4."),
        (r" Q3\.0*", " Q0.3"),
        (r" R2\.0*", " R12."),
        (r"Q202=\+3\.0*", "Q202=+30."),
        (r"Q202=\+3\.0*", "Q202=+3.5"),
        (r"Q200=\+2\.0*", "Q200=+12."),
        (r",3\.0*,0,0,0,1,1\)", ",30.,0,0,0,1,1)"),
        (r",3\.0*,0,0,0,1,1\)", ",3.,0,0,0,1,0)"),
        (r"CYCLE83(\((?:[^,]*,){3}[^,]*).*", r"CYCLE81\1)"),
    ),
    _CHIP: ((r"G73", "G83"), (r"G73(.*) Q3\.0*", r"G81\1"), (r",3\.0*,0,0,0,1,0\)", ",3.,0,0,0,1,1)")),
}


@cache
def program(cycle: str) -> Program:
    """Two holes of a cycle."""
    begin = "LOAD/TOOL,4,ADJUST,4\nSPINDL/RPM,3000,CLW\nRAPID\nGOTO/10,10,50,0,0,1\n"
    cycle = f"CYCLE/{cycle},RTRCTO,20,RAPTO,2,MMPM,120\nGOTO/10,10,0\nGOTO/20,10,0\nCYCLE/OFF\n"
    return read((begin + cycle + "RAPID\nGOTO/20,10,50\nFINI\n").encode(), name="part.cls")


@cache
def lines_of(cycle: str, case: Case, cycles: str) -> tuple[str, ...]:
    """What is written for it."""
    stream = io.BytesIO()
    frame = Frame(cycles=cycles)
    postprocess(program(cycle), stream, Settings(tolerance=0.02), form=case.choose(), frame=frame, verify=False)
    return tuple(stream.getvalue().decode().splitlines())


def codes(cycle: str, case: Case, lines: list[str]) -> set[str]:
    """What is found in a text."""
    how = {"control": case.control, "machine": case.choose().machine}
    found = verify(program(cycle), ("\n".join(lines) + "\n").encode(), tolerance=0.02, **how)
    return {problem.code for problem in found.problems}


def set_height(line: str, height: float) -> str:
    """A block with another Z."""
    return re.sub(r"(?<!T)Z([-+]?)[\d.]+", lambda word: f"Z{height:{'+' if '+' in line else ''}.4f}", line, count=1)


def height_of(line: str) -> float:
    """Z of a block."""
    return float(re.search(r"(?<!T)Z([-+]?[\d.]+)", line)[1])


@pytest.mark.parametrize("cycle", [_DEEP, _CHIP, _FIRST])
@pytest.mark.parametrize("case", [*CASES, Case("generic", "g1")], ids=str)
def test_pecks_that_are_moves(case: Case, cycle: str) -> None:
    lines = list(lines_of(cycle, case, "moves"))
    assert codes(cycle, case, lines) == set()
    fed = [
        k for k, line in enumerate(lines) if re.search(r"X.*(?<!T)Z", line) and re.search(r"G1 |L(N)? .*[^X]$", line)
    ]
    first, second = fed[:2]
    last = max(
        k for k in fed if height_of(lines[k]) == min(height_of(lines[k]) for k in fed) and k < fed[len(fed) // 2]
    )
    bottom, back = height_of(lines[first]), second - 1
    wrong = {
        "in one go": [*lines[:first], set_height(lines[first], height_of(lines[last])), *lines[last + 1 :]],
        "first peck too deep": [*lines[:first], set_height(lines[first], bottom - 0.5), *lines[first + 1 :]],
        "second peck too short": [*lines[:second], set_height(lines[second], bottom - 1.0), *lines[second + 1 :]],
        "two pecks at once": [*lines[: first + 1], *lines[first + 1 + (second - first) :]],
        "feeding begins high": [*lines[: first - 1], set_height(lines[first - 1], 12.0), *lines[first:]],
        "onto the bottom": [*lines[:back], set_height(lines[back], bottom), *lines[back + 1 :]],
        "nearly onto the bottom": [*lines[:back], set_height(lines[back], bottom + 0.05), *lines[back + 1 :]],
    }
    if "BRKCHP" in cycle:
        ups = {k - 1 for k in fed[1:4]}
        wrong["out of the hole"] = [
            other for k, line in enumerate(lines) for other in ([set_height(line, 2.0), line] if k in ups else [line])
        ]
    else:
        wrong["stays in the hole"] = [*lines[: first + 1], *lines[back:]]
    passed = [name for name, changed in wrong.items() if not codes(cycle, case, changed)]
    assert passed == []


@pytest.mark.parametrize("cycle", NATIVE)
@pytest.mark.parametrize("case", CASES, ids=str)
def test_pecks_of_the_control(case: Case, cycle: str) -> None:
    lines = list(lines_of(cycle, case, "native"))
    assert codes(cycle, case, lines) == set()
    tried = 0
    for pattern, other in NATIVE[cycle]:
        changed = [line if line[0] in "(;" else re.sub(pattern, other, line) for line in lines]
        tried += changed != lines
        assert changed == lines or codes(cycle, case, changed), (pattern, other)
    assert tried or (cycle == _CHIP and case.control == "heidenhain")


def test_a_cycle_without_steps_is_drilled_in_any() -> None:
    case, cycle = CASES[0], "DEEP,FEDTO,-15"
    lines = list(lines_of(cycle, case, "native"))
    assert codes(cycle, case, lines) == set()
    assert codes(cycle, case, [line.replace("G81", "G83").replace("R2.0000", "R2. Q4.") for line in lines]) == set()
