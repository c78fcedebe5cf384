"""Feeds where a curve begins, which the block before may not say; and what F takes of inverse time."""

from __future__ import annotations

import io
import re
from dataclasses import replace

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import CHOSEN, Case
from nc.promise import written

#: the curve of a whole run begins where the last rapid ends
CL = """UNITS/MM
LOADTL/1
RAPID
GOTO/1,0,0,0,0,1
FEDRAT/500,MMPM
GOTO/20,0,0
RAPID
GOTO/0,0,0
FEDRAT/800,MMPM
GOTO/-4,-2,0
GOTO/-8,5,0
FINI
"""

#: all forms with curves of whole runs
CURVES = [case for case in CHOSEN if case.form in ("g6.2", "bspline")]


@pytest.mark.parametrize("case", CURVES, ids=str)
def test_a_curve_says_the_feed_where_no_line_is_left_before_it(case: Case) -> None:
    form = case.choose()
    form = replace(form, table=form.table.with_digits("4"))
    program = read(CL.encode(), name="part.cls")
    settings = Settings(tolerance=0.003, method="global")
    text, _ = written(program, form, settings)
    blocks = text.replace(" ~\n", " ").splitlines()
    rapid = max(k for k, block in enumerate(blocks) if re.search("^G0 .*X|X.* FMAX$", block))
    behind = blocks[rapid + 1 :]
    curve = next(block for block in behind if "X" in block)
    assert any(word in curve for word in ("G6.2", "BSPLINE"))
    assert curve.rstrip(".").endswith(" F800")
    assert sum(" F8" in block for block in behind) == 1
    found = verify(program, text.encode(), tolerance=0.003, control=case.control, machine=form.machine, tcp=case.tcp)
    assert found.problems == ()


def dense(count: int = 60) -> Program:
    """Poses 0.05 mm apart at 3 m/min, a millisecond each."""
    u = np.arange(count) / 20.0
    tip = np.stack((u, np.sin(u), 0.2 * np.cos(2.0 * u)), axis=1)
    axis = np.stack((0.3 * np.sin(u), 0.2 * np.cos(1.3 * u), np.ones(count)), axis=1)
    return Program.from_poses(tip, axis / np.linalg.norm(axis, axis=1, keepdims=True), feed=3000.0)


@pytest.mark.parametrize(("control", "largest"), [("fanuc", 9999.999), ("haas", 9999.999), ("siemens", 999999.999)])
def test_inverse_time_keeps_to_what_f_takes(control: str, largest: float) -> None:
    form = choose_form(control, machine=load_machine("table-ac"), tcp=False)
    stream = io.BytesIO()
    result = postprocess(dense(), stream, Settings(tolerance=0.002), form=form, processes=1)
    assert result.verification is not None
    assert result.verification.passed
    words = re.findall(r" F(\d+\.\d*)$", stream.getvalue().decode(), re.MULTILINE)
    values = np.array(words, np.float64)
    assert max(len(word.partition(".")[2]) for word in words) <= 3
    assert values.min() >= 0.001
    assert values.max() == largest
    slowed = [finding.count for finding in result.findings if finding.code == "CS371"]
    assert slowed == [int((values == largest).sum())]
    assert any(finding.code == "CS372" for finding in result.findings)


def test_a_block_at_the_limit_may_be_slower_but_not_faster() -> None:
    machine = load_machine("table-ac")
    form = choose_form("fanuc", machine=machine, tcp=False)
    text, _ = written(dense(), form, Settings(tolerance=0.002))
    how = {"tolerance": 0.002, "machine": machine, "tcp": False}
    assert verify(dense(), text.encode(), **how).passed
    slow = dense()
    slow = replace(slow, feed=slow.feed / 1000.0)
    text, _ = written(slow, form, Settings(tolerance=0.002))
    assert "F9999.999" not in text
    first = re.search(r" F\d+\.\d*$", text[text.index("G93") :], re.MULTILINE)
    assert first is not None
    spoilt = text.replace(first[0], " F9999.999", 1)
    assert {problem.code for problem in verify(slow, spoilt.encode(), **how).problems} == {"CS541"}


DOWN = """UNITS/MM
LOADTL/1
SPINDL/2000,RPM,CLW
RAPID
GOTO/0,0,10,0,0.0995037,0.9950372
FEDRAT/400,MMPM
GOTO/5,0,0,0.2,0,0.9797959
GOTO/9,0,0,0,0.3,0.9539392
LOADTL/2
GOTO/0,9,10,0,0.0995037,0.9950372
GOTO/5,9,0,0.2,0,0.9797959
FINI
"""


@pytest.mark.parametrize("control", ["fanuc", "siemens", "linuxcnc"])
def test_a_feed_down_from_the_retract_is_no_matter_of_time(control: str) -> None:
    program = read(DOWN.encode(), name="part.cls")
    machine = load_machine("xyzac-trt")
    form = choose_form(control, machine=machine, tcp=False)
    text, _ = written(program, form, Settings(tolerance=0.04))
    blocks = text.splitlines()
    change = next(k for k, block in enumerate(blocks) if re.fullmatch("T2 ?(M6)?", block))
    first = next(k for k in range(change, len(blocks)) if re.search(r"\bG1\b", blocks[k]))
    assert blocks[first].endswith(" F400.")
    assert blocks[first - 1] == "G94"
    assert blocks[first + 1] == "G93"
    # the time of the way from the pose before is nothing that this block may have
    wrong = [*blocks[: first - 1], "G93", blocks[first].replace("F400.", "F348."), *blocks[first + 2 :], ""]
    how = {"control": control, "machine": machine, "tcp": False, "tolerance": 0.04}
    assert "CS542" in {problem.code for problem in verify(program, "\n".join(wrong).encode(), **how).problems}


OUT_OF_A_HOLE = """UNITS/MM
LOADTL/1
SPINDL/1000,RPM,CLW
RAPID
GOTO/10,20,30,0.1325506,0.3175976,0.9389154
CYCLE/DRILL,FEDTO,5,MMPM,100,RAPTO,3,RTRCTO,25
GOTO/10,20,5,0.1325506,0.3175976,0.9389154
CYCLE/OFF
FEDRAT/500,MMPM
GOTO/10,20.2,5,0.1325506,0.3175976,0.9389154
GOTO/10,20.4,5,0.1325506,0.3175976,0.9389154
GOTO/30,40,5,0.2,0.3175976,0.9268
FINI
"""


@pytest.mark.parametrize("control", ["fanuc", "siemens", "linuxcnc"])
@pytest.mark.parametrize("tcp", [False, True])
def test_a_feed_out_of_a_hole_is_no_matter_of_time_and_is_compared(control: str, tcp: bool) -> None:
    """The tool comes from the height of the cycle, 25 mm above the pose that the move begins at."""
    program, machine = read(OUT_OF_A_HOLE.encode(), name="part.cls"), load_machine("table-ac")
    form = choose_form(control, machine=machine, tcp=tcp)
    blocks = written(program, form, Settings(tolerance=0.01))[0].splitlines()
    drilled = next(k for k, block in enumerate(blocks) if block.endswith(" F100."))
    first = next(k for k in range(drilled + 1, len(blocks)) if re.match(r"G1\b", blocks[k]))
    assert blocks[first].endswith(" F500.")
    assert "G93" not in blocks[:first]
    assert tcp == ("G93" not in blocks[first:])
    how = {"control": control, "machine": machine, "tcp": tcp, "tolerance": 0.01}
    assert verify(program, "\n".join(blocks).encode(), **how).passed
    words = blocks[first].removesuffix(" F500.")
    for wrong in ([f"{words} F5000.", "F500."], ["G93", f"{words} F2500.", *([] if not tcp else ["G94", "F500."])]):
        text = "\n".join([*blocks[:first], *wrong, *blocks[first + 1 :]]).encode()
        found = verify(program, text, **how).problems
        assert [problem.code for problem in found if problem.nc_line in (first + 1, first + 2)] == ["CS541"]


@pytest.mark.parametrize("wrong", [" F7000.", " F70.", ""])
def test_feed_to_the_first_pose_is_compared(wrong: str) -> None:
    cl = "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nFEDRAT/700,MMPM\nGOTO/5,5,9\nGOTO/5,5,0\nGOTO/25,5,0\nFINI\n"
    program = read(cl.encode(), name="part.cls")
    text, _ = written(program, choose_form("fanuc"), Settings(tolerance=0.01))
    assert verify(program, text.encode(), tolerance=0.01).problems == ()
    block = next(line for line in text.splitlines() if line.endswith(" F700."))
    assert " Z9." in block
    spoilt = text.replace(" F700.", wrong, 1).replace("\nG1 ", "\nF700.\nG1 ", 2).replace("F700.\n", "", 1)
    found = verify(program, spoilt.encode(), tolerance=0.01).problems
    line = spoilt.splitlines().index(block.removesuffix(" F700.") + wrong) + 1
    assert (("CS541" if wrong else "CS542"), line) in [(problem.code, problem.nc_line) for problem in found]
