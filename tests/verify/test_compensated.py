"""Blocks under cutter compensation are the moves of the CL file, one to one."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings

from .small import found, right

CL = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
RAPID
GOTO/0,0,5
FEDRAT/MMPM,500
GOTO/0,0,0
CUTCOM/LEFT,XYPLAN
GOTO/10,0,0
GOTO/10,20,0
GOTO/30,20,0
CUTCOM/OFF
GOTO/30,20,1
GOTO/30,30,1
GOTO/50,30,1
RAPID
GOTO/50,30,50
FINI
"""
CONTROLS = ("fanuc", "generic", "haas", "linuxcnc", "mitsubishi", "siemens")


def divided(lines: Sequence[str], block: int, axis: str, value: float) -> list[str]:
    """The same with a block in two: the first to another value of an axis."""
    first = re.sub(rf"\b{axis}[-+]?[\d.]+", lambda old: f"{axis}{value:.{len(old[0].split('.')[1])}f}", lines[block])
    rest = re.sub(r" F[\d.]+", "", lines[block])
    return [*lines[:block], first, rest, *lines[block + 1 :]]


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize(
    ("word", "behind", "axis", "value"),
    [
        ("G41", 1, "X", 0.01),  # the block that begins compensation
        ("G41", 1, "X", 9.99),
        ("G41", 2, "Y", 5.0),  # one within
        ("G40", 2, "Y", 20.01),  # that which ends it: the first one in the plane
        ("G40", 2, "Y", 25.0),
    ],
)
def test_a_divided_block_is_not_verified(control: str, word: str, behind: int, axis: str, value: float) -> None:
    lines = right(CL, control)
    assert found(CL, lines, control).verdict == Verdict.PASSED
    block = [k for k, line in enumerate(lines) if word in line.split()][-1] + behind
    wrong = found(CL, divided(lines, block, axis, value), control)
    assert wrong.verdict == Verdict.NOT_VERIFIED
    assert f"NC line {block + 1}" in wrong.unverified


@pytest.mark.parametrize("control", CONTROLS)
def test_blocks_before_compensation_may_be_divided(control: str) -> None:
    lines = right(CL, control)
    block = next(k for k, line in enumerate(lines) if "G41" in line) - 1
    assert found(CL, divided(lines, block, "Z", 1.0), control).verdict == Verdict.PASSED
    block = next(k for k in range(len(lines) - 1, 0, -1) if re.match("G1 X50", lines[k]))
    assert found(CL, divided(lines, block, "X", 40.0), control).verdict == Verdict.PASSED


@pytest.mark.parametrize("control", CONTROLS)
def test_arcs_within_may_be_written_in_parts(control: str) -> None:
    arc = "GOTO/10,0,0\nCIRCLE/10,10,0,0,0,1,10\nGOTO/20,10,0\nCIRCLE/10,10,0,0,0,1,10\nGOTO/20,10,0\n"
    text = CL.replace("GOTO/10,0,0\n", arc)
    lines = right(text, control)
    assert found(text, lines, control).verdict == Verdict.PASSED
    block = next(k for k in range(len(lines) - 1, 0, -1) if "G40" in lines[k]) - 1
    wrong = found(text, divided(lines, block, "X", 25.0), control)
    assert wrong.verdict == Verdict.NOT_VERIFIED


def test_blocks_of_klartext() -> None:
    form, stream = choose_form("heidenhain", "g1"), io.BytesIO()
    plain = read(re.sub("CUTCOM.*\n", "", CL).encode(), name="part.cls")
    postprocess(plain, stream, Settings(tolerance=0.0001), form=form, verify=False)
    lines = stream.getvalue().decode().splitlines()
    first, last = (next(k for k, line in enumerate(lines) if re.search(end, line)) for end in ("X.10.* Y.0", "Y.30"))
    for block, side in ((first, "RL"), (last - 1, "R0")):
        lines[block] = re.sub(r"(TZ\S+)", rf"\1 {side}", lines[block])
    assert found(CL, lines, "heidenhain").verdict == Verdict.PASSED
    for block, axis, value in ((first, "X", 0.01), (last, "Y", 20.01)):
        number, rest = lines[block].split(" ", 1)
        new = re.sub(rf"\b{axis}[-+]?[\d.]+", f"{axis}{value:+.4f}", f"{number} {rest}")
        wrong = found(CL, [*lines[:block], new, *lines[block:]], "heidenhain")
        assert wrong.verdict == Verdict.NOT_VERIFIED, wrong.problems
