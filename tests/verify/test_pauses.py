"""At each pause the states hold that the CL file has there, whatever the order of the words of each kind."""

from __future__ import annotations

import re
from functools import cache

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.model import Program
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification, verify
from nc.cases import Case
from nc.promise import written

CASES = (
    Case("fanuc", "g1"),
    Case("fanuc", "g6.2"),
    Case("mitsubishi", "g1", "head-ac"),
    Case("haas", "g1", "table-bc"),
    Case("siemens", "g1"),
    Case("heidenhain", "g1"),
    Case("linuxcnc", "g1", "xyzac-trt"),
    Case("generic", "g1"),
)

CL = b"""LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,3000,CLW
COOLNT/FLOOD
RAPID
GOTO/0,0,2,0,0,1
FEDRAT/MMPM,300
GOTO/20,0,2
SPINDL/OFF
COOLNT/OFF
STOP
SPINDL/RPM,2000,CLW
DELAY/3
GOTO/40,0,2
RAPID
GOTO/40,0,50
LOAD/TOOL,5,ADJUST,5
SPINDL/RPM,1000,CLW
DELAY/2
RAPID
GOTO/50,0,2
GOTO/60,0,2
STOP
GOTO/70,0,2
RAPID
GOTO/70,0,50
FINI
"""

#: what is moved behind what: an order that no line between the two may change
_STOP, _OFF = r"M0|STOP", r"M5|M9"
_DWELL = r"G4 .*|CYCL DEF 9\.1.*"
_TURN = r"(S\d+ )?M3"


@cache
def program() -> Program:
    """The CL program."""
    return read(CL, name="part.cls")


def found(case: Case, lines: list[str]) -> Verification:
    """What is found in a text."""
    how = {"control": case.control, "machine": case.choose().machine}
    return verify(program(), ("\n".join(lines) + "\n").encode(), tolerance=0.02, **how)


def codes(case: Case, lines: list[str]) -> set[str]:
    """Codes of what is found in a text."""
    return {problem.code for problem in found(case, lines).problems}


def swapped(lines: list[str], first: str, second: str) -> list[list[str]]:
    """Texts in each of which a block of one kind stands behind one of another that comes a few blocks after it."""
    bare = [re.sub(r"^\d+ ", "", line) for line in lines]
    found = []
    for k, line in enumerate(bare):
        behind = [j for j in range(k + 1, k + 4) if j < len(bare) and re.fullmatch(second, bare[j])]
        if re.fullmatch(first, line) and behind and not any("X" in one for one in bare[k : behind[0]]):
            found.append([*lines[:k], *lines[k + 1 : behind[0] + 1], lines[k], *lines[behind[0] + 1 :]])
    return found


@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_order_of_words_at_a_pause(case: Case) -> None:
    lines = written(program(), case.choose(), Settings(tolerance=0.02))[0].splitlines()
    assert codes(case, lines) == set()
    for first, second, least in ((_OFF, _STOP, 2), (_TURN, _DWELL, 2)):
        texts = swapped(lines, first, second)
        assert len(texts) >= least
        for changed in texts:
            assert codes(case, changed) & {"CS552", "CS553"}, changed


def test_what_goes_off_at_a_stop_alone_need_not_be_said() -> None:
    """At the second stop the CL file leaves the spindle on; the writer starts it again, as most machines stop it."""
    case = CASES[0]
    lines = written(program(), case.choose(), Settings(tolerance=0.02))[0].splitlines()
    stop = max(k for k, line in enumerate(lines) if line == "M0")
    assert lines[stop + 1] == "S1000 M3"
    assert codes(case, lines) == set()


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_stop_may_have_ended_is_not_known_to_go_on(case: Case) -> None:
    lines = written(program(), case.choose(), Settings(tolerance=0.02))[0].splitlines()
    stop = max(k for k, line in enumerate(lines) if re.fullmatch(rf"(\d+ )?({_STOP})", line))
    assert re.fullmatch(r"(\d+ |S1000 )?M3", lines[stop + 1])
    assert found(case, lines).verdict == Verdict.PASSED
    assert found(case, [*lines[: stop + 1], *lines[stop + 2 :]]).verdict == Verdict.NOT_VERIFIED


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_stops_the_spindle_beside_a_cut(case: Case) -> None:
    """The interpreter of LinuxCNC stops it before the cut, as Siemens does; TNC behind it; of others no manual says."""
    lines = written(program(), case.choose(), Settings(tolerance=0.02))[0].splitlines()
    off = next(k for k, line in enumerate(lines) if re.fullmatch(r"(\d+ )?M5", line))
    beside = found(case, [*lines[: off - 1], f"{lines[off - 1]} M5", *lines[off + 1 :]])
    wanted = {"linuxcnc": Verdict.FAILED, "siemens": Verdict.FAILED, "heidenhain": Verdict.PASSED}
    assert beside.verdict == wanted.get(case.control, Verdict.NOT_VERIFIED)


def test_a_stop_of_the_post_before_a_tool_change_is_none_of_the_cl_file() -> None:
    """Both stand at one place of the path."""
    part = read(CL.replace(b"LOAD/TOOL,5,ADJUST,5\n", b"LOAD/TOOL,5,ADJUST,5\nOPSTOP\n"), name="part.cls")
    text = written(part, CASES[0].choose(), Settings(tolerance=0.02))[0]
    assert text.count("M1\n") == 2
    assert verify(part, text.encode(), tolerance=0.02).problems == ()
