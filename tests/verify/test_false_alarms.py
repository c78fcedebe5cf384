"""Small programs that were written rightly and once refused: what is like them and wrong is found.

`right/NAME.cls` has those that must pass alone.
"""

from __future__ import annotations

import io
from dataclasses import replace

import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification, verify
from nc.cases import Case
from nc.promise import written
from verify.random_programs import Trial
from verify.sweep import judged
from verify.test_right_programs import FOLDER, load


def trial(case: Case, tolerance: float, axis_length: float, cl: str) -> Trial:
    """A small program in mm with one tool, from its first rapid."""
    feed = "" if "FEDRAT" in cl else "FEDRAT/500,MMPM\n"
    settings = Settings(tolerance=tolerance, axis_length=axis_length)
    return Trial(0, case, settings, "mm", f"UNITS/MM\nLOADTL/1\n{feed}RAPID\n{cl}FINI\n")


def program_of(one: Trial) -> Program:
    """The CL program."""
    return read(one.cl.encode(), name="part.cls")


def text_of(one: Trial) -> str:
    """What is written for it."""
    return written(program_of(one), one.case.choose(endless=True), one.settings)[0]


def verified(one: Trial, text: str, *, slower: bool = False) -> Verification:
    """What is found in a text."""
    return verify(
        program_of(one),
        text.encode(),
        tolerance=one.settings.tolerance,
        axis_length=one.settings.axis_length,
        control=one.case.control,
        machine=one.case.choose(endless=True).machine,
        tcp=one.case.tcp,
        slower=slower,
        skip_cycles=True,
    )


@pytest.mark.parametrize("name", ["creeping", "axis_alone"])
def test_blocks_as_fast_as_f_can_say_are_right_in_a_plan_too(name: str) -> None:
    one = load(FOLDER / f"{name}.cls")
    assert verified(one, text_of(one), slower=True).problems == ()


def test_tip_that_turns_round_before_the_axis_point_is_not_going_back() -> None:
    """By the paper's method the tip goes back along its way while the axis point goes on."""
    cl = """UNITS/INCHES
LOADTL/12
RAPID
GOTO/-1.8756,1.9192,1.7889,0.0000000,0.3782657,0.9256971
FEDRAT/22.0079,IPM
GOTO/-1.8756,1.9093,1.7790,0.0000000,0.3782657,0.9256971
GOTO/-1.8658,1.8995,1.7790,0.0000000,0.3782657,0.9256971
GOTO/-1.8756,1.9093,1.7790,0.3782657,0.0000000,0.9256971
FINI
"""
    settings = Settings(tolerance=0.079611, axis_length=2.761, method="zhang2016", lines="dense")
    one = Trial(0, Case("linuxcnc", "g1", "head-ac"), settings, "inch", cl)
    assert judged(one, read(cl.encode(), name="part.cls")) == ("passed", "")


#: the tip stands, so only the axis point tells how fast a block is
STANDING = trial(
    Case("fanuc", "g1", "head-ac", tcp=False),
    0.01,
    10.0,
    """GOTO/10.0,20.0,-30.0,0.0,0.5,0.8660254
FEDRAT/MMPM,40.0
GOTO/10.0,20.0,-30.0,0.3,0.4,0.8660254
GOTO/30.0,20.0,-30.0,0.3,0.4,0.8660254
""",
)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_time_of_a_standing_tip_is_still_compared(factor: float) -> None:
    assert verified(STANDING, text_of(STANDING)).problems == ()
    lines = text_of(STANDING).splitlines()
    timed = [k for k, line in enumerate(lines) if line.startswith("G1 ")]
    assert lines.index("G93") < timed[0]
    for k in timed[1 : len(timed) // 2 : 3]:
        words, rate = lines[k].split(" F")
        wrong = [*lines[:k], f"{words} F{factor * float(rate):.4f}", *lines[k + 1 :]]
        found = verified(STANDING, "\n".join(wrong)).problems
        assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", k + 1)]


#: the tip moves by less than a coarse tolerance, and by more than the one that the program is written with
HARDLY_MOVING = trial(
    Case("linuxcnc", "g1", "xyzac-trt"),
    0.0005,
    10.0,
    """GOTO/0.0,0.0,0.0,0.0,0.0,1.0
FEDRAT/MMPM,1000.0
GOTO/0.03,0.02,0.0,0.1045285,0.0,0.9945219
GOTO/0.06,0.04,0.0,0.0174524,0.0,0.9998477
GOTO/0.09,0.0,0.0,0.1045285,0.0,0.9945219
GOTO/0.12,0.02,0.0,0.2079117,0.0,0.9781476
""",
)


@pytest.mark.parametrize("tolerance", [0.0005, 0.002, 0.005, 0.01, 0.02, 0.04, 0.1])
def test_timed_blocks_may_be_of_any_tolerance_up_to_the_one_of_the_check(tolerance: float) -> None:
    one = replace(HARDLY_MOVING, settings=HARDLY_MOVING.settings.but(tolerance=tolerance))
    lines = text_of(HARDLY_MOVING).splitlines()
    assert verified(one, "\n".join(lines)).problems == ()
    timed = lines.index("G93") + 1
    words, rate = lines[timed].split(" F")
    for factor in (0.3, 3.0):
        wrong = [*lines[:timed], f"{words} F{factor * float(rate):.3f}", *lines[timed + 1 :]]
        found = verified(one, "\n".join(wrong)).problems
        assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", timed + 1)]


#: without tip control, all blocks timed, in moves with feeds of their own
TIMED = trial(
    Case("fanuc", "g1", "xyzbc-trt", tcp=False),
    0.005,
    10.0,
    """GOTO/0,0,0,0,0.1045285,0.9945219
FEDRAT/MMPM,400.0
GOTO/8,1,0,0.1045285,0,0.9945219
FEDRAT/MMPM,700.0
GOTO/15,5,1,0.1736482,0,0.9848078
""",
)


def test_feed_of_the_neighbour_is_found_where_blocks_are_timed() -> None:
    lines = text_of(TIMED).splitlines()
    assert verified(TIMED, text_of(TIMED)).problems == ()
    timed = [k for k in range(lines.index("G93") + 1, len(lines)) if " F" in lines[k]]
    for factor, some in ((7 / 4, timed[: len(timed) // 4]), (4 / 7, timed[-len(timed) // 4 :])):
        wrong = list(lines)
        for k in some:
            words, rate = lines[k].split(" F")
            wrong[k] = f"{words} F{factor * float(rate):.3f}"
        found = verified(TIMED, "\n".join(wrong)).problems
        assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", some[0] + 1)]
        for k in some[:: len(some) // 4]:
            found = verified(TIMED, "\n".join([*lines[:k], wrong[k], *lines[k + 1 :]])).problems
            assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", k + 1)]


DWELL_IN_REVOLUTIONS = load(FOLDER / "dwell_in_revolutions.cls")
TWO_CYCLES_IN_A_HOLE = load(FOLDER / "two_cycles_in_a_hole.cls")


def test_time_of_a_dwell_in_revolutions_is_compared() -> None:
    text = text_of(DWELL_IN_REVOLUTIONS)
    assert "G4 P200" in text
    found = verified(DWELL_IN_REVOLUTIONS, text.replace("G4 P200", "G4 P300")).problems
    assert [problem.code for problem in found] == ["CS556"]


def test_cycles_of_one_hole_are_told_apart() -> None:
    """The first is as deep as it should be, not the deepest; its dwell is its own."""
    lines = text_of(TWO_CYCLES_IN_A_HOLE).splitlines()
    first, second = (
        next(k for k, line in enumerate(lines) if f" Z{depth} " in line) for depth in ("-5.0000", "-20.0000")
    )
    for k, old, new, code in (
        (first, "-5.0000", "-6.0000", "CS562"),
        (second, "-20.0000", "-19.0000", "CS562"),
        (first, "F1700.", "F1600.", "CS541"),
    ):
        wrong = [*lines[:k], lines[k].replace(old, new), *lines[k + 1 :]]
        found = verified(TWO_CYCLES_IN_A_HOLE, "\n".join(wrong)).problems
        assert (code, k + 1) in [(problem.code, problem.nc_line) for problem in found]
    dwell = lines.index("G4 P500")
    found = verified(TWO_CYCLES_IN_A_HOLE, "\n".join(lines[:dwell] + lines[dwell + 1 :])).problems
    assert [problem.code for problem in found] == ["CS556"]
    moved = [*lines[:dwell], *lines[dwell + 1 : second + 1], lines[dwell], *lines[second + 1 :]]
    assert "CS556" in [problem.code for problem in verified(TWO_CYCLES_IN_A_HOLE, "\n".join(moved)).problems]


def test_holes_in_one_line_to_the_digits_of_the_cl_file() -> None:
    """Up along the tool, without a retract, to a hole that is in the line of the one before but for the last digit."""
    cl = (
        "UNITS/MM\nLOADTL/1\nSPINDL/2000,RPM,CLW\nCYCLE/DRILL,FEDTO,4.0,MMPM,100,RAPTO,3,RTRCTO,20\n"
        "GOTO/37.4690,21.4146,-13.0597,0.0506639,-0.0575490,0.9970563\nLOADTL/3\n"
        "GOTO/38.0770,20.7240,-1.0950,0.0506639,-0.0575490,0.9970563\nSPINDL/OFF\nFINI\n"
    )
    form, stream = choose_form("generic", machine=load_machine("head-table-bc")), io.BytesIO()
    postprocess(cl.encode(), stream, Settings(tolerance=0.00214, axis_length=20.0), form=form, verify=False)
    how = {"control": "generic", "machine": form.machine, "tolerance": 0.00214, "axis_length": 20.0}
    assert not verify(read(cl.encode()), stream.getvalue(), **how).problems
