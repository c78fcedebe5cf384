"""A rotary axis that turns at feed while the tool axis stands along it swings part or head around the tool."""

from __future__ import annotations

import io
import re

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification, verify

CL = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
FEDRAT/MMPM,500
GOTO/0,0,0
GOTO/40,0,0
GOTO/40,30,0
GOTO/60,30,0
RAPID
GOTO/60,30,50
FINI
"""
PROGRAM = read(CL.encode(), name="part.cls")
CASES = [
    ("fanuc", "table-ac"),
    ("generic", "table-ac"),
    ("haas", "table-ac"),
    ("heidenhain", "table-bc"),
    ("linuxcnc", "xyzac-trt"),
    ("mitsubishi", "head-ac"),
    ("siemens", "table-ac"),
]


def lines_of(control: str, machine: str) -> list[str]:
    """The right program."""
    stream = io.BytesIO()
    form = choose_form(control, "g1", machine=load_machine(machine))
    postprocess(PROGRAM, stream, Settings(tolerance=0.02), form=form, verify=False)
    return stream.getvalue().decode().splitlines()


def found(control: str, machine: str, lines: list[str]) -> Verification:
    """What is found in a program."""
    text = ("\n".join(lines) + "\n").encode()
    return verify(PROGRAM, text, tolerance=0.02, control=control, machine=load_machine(machine))


def turned(line: str, angle: float) -> str:
    """A block with another angle of C."""
    return re.sub(r"C([-+]?)[\d.]+", lambda word: f"C{'+' if word[1] else ''}{angle:.4f}", line)


@pytest.mark.parametrize(("control", "machine"), CASES)
@pytest.mark.parametrize(("turns", "verdict"), [((60,), "PASSED"), ((180,), "NOT"), ((360,), "NOT"), ((90, 0), "NOT")])
def test_half_a_turn_in_a_cut(control: str, machine: str, turns: tuple[int, ...], verdict: str) -> None:
    lines = lines_of(control, machine)
    assert found(control, machine, lines).verdict == Verdict.PASSED
    block = next(k for k, line in enumerate(lines) if re.search(r"X\+?(39\.9|40\.0)\d* Y\+?(15|29|30)", line))
    end = next(k for k in range(len(lines) - 1, 0, -1) if re.search(r"X\+?60\.0+ .*C", lines[k]))
    angles = [*turns, *turns[-1:] * (end + 1 - block)]
    lines[block : end + 1] = map(turned, lines[block : end + 1], angles[: end + 1 - block])
    result = found(control, machine, lines)
    assert (result.verdict == Verdict.PASSED) == (verdict == "PASSED"), result.problems
    assert verdict == "PASSED" or "C turns while the tool axis stands" in result.unverified
