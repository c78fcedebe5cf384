"""Ways back from a retract: over the first position, with the axis that the tool has there, and only then down."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator
from functools import cache

import pytest

from cornersmooth.cl import read
from cornersmooth.model import Program
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import Case
from nc.promise import written
from oracle.share import THOROUGH

CASES = (
    Case("fanuc", "g1"),
    Case("fanuc", "g1", "table-ac"),
    Case("fanuc", "g1", "table-ac", tcp=False),
    Case("mitsubishi", "g1", "head-ac"),
    Case("haas", "g1", "table-bc"),
    Case("siemens", "g1"),
    Case("siemens", "g1", "head-table-bc"),
    Case("heidenhain", "g1"),
    Case("heidenhain", "g1", "table-bc"),
    Case("linuxcnc", "g1", "xyzac-trt"),
)

#: two tools, and a way home with the second
CL = b"""LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
RAPID
GOTO/0,0,2
FEDRAT/MMPM,300
GOTO/0,0,-3
RAPID
GOTO/0,0,50
LOAD/TOOL,5,ADJUST,5
SPINDL/RPM,2000,CLW
RAPID
GOTO/60,10,50,0,0,1
GOTO/60,10,-3
RAPID
GOTO/60,10,50
GOHOME
RAPID
GOTO/5,5,50,0,0,1
GOTO/5,5,40
RAPID
GOTO/5,5,50
FINI
"""

TILTED = b"""LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,3000,CLW
RAPID
GOTO/1,2,70,0.258819,0,0.9659258
FEDRAT/MMPM,300
GOTO/1,2,9
RAPID
GOTO/1,2,70
FINI
"""

#: words of an axis, and of the tool axis: vectors of each control, rotary axes
_AXIS = r"(?<![A-Z]){}([-+]?)[\d.]+ ?"
_TOOL_AXIS = r"(?:[IJK]|[ABC]3=|T[XYZ]|(?<![A-Z])[ABC])[-+]?\d[\d.]* ?"


@cache
def program(cl: bytes) -> Program:
    """The CL program."""
    return read(cl, name="part.cls")


@cache
def lines_of(cl: bytes, case: Case) -> tuple[str, ...]:
    """What is written for it."""
    return tuple(written(program(cl), case.choose(), Settings(tolerance=0.02))[0].splitlines())


def wrong(cl: bytes, case: Case, lines: Iterable[str], *, head: str = "MADE") -> set[str]:
    """Codes of what is found in a text whose head says who wrote it, if need be another."""
    text = "\n".join([*(re.sub("CORNERSMOOTH", head, line) for line in lines), ""]).encode()
    how = {"control": case.control, "machine": case.choose().machine, "tcp": case.tcp}
    return {problem.code for problem in verify(program(cl), text, tolerance=0.02, **how).problems}


def has(line: str, axis: str) -> bool:
    """Whether a block has a word of an axis."""
    return re.search(_AXIS.format(axis), line) is not None


def without(line: str, *axes: str) -> str:
    """A block without words of some axes."""
    for axis in axes:
        line = re.sub(_AXIS.format(axis), "", line)
    return line


def set_to(line: str, axis: str, value: str) -> str:
    """A block with another word of an axis."""
    return re.sub(_AXIS.format(axis), lambda word: f"{axis}{'+' if word[1] and value[0] != '-' else ''}{value} ", line)


def at_feed(line: str) -> str:
    """A block of a rapid as a feed move."""
    return line.replace("FMAX", "F300") if "FMAX" in line else f"{line.replace('G0', 'G1')} F300."


def over(lines: tuple[str, ...]) -> list[int]:
    """Blocks that lead over a first position."""
    rapid = [("G0" in line or "FMAX" in line) and has(line, "X") for line in lines]
    return [k for k in range(len(lines) - 1) if rapid[k] and not has(lines[k], "Z") and has(lines[k + 1], "Z")]


def mutants(lines: tuple[str, ...]) -> Iterator[tuple[str, list[str]]]:
    """Wrong ways back at each first position of an upright tool: nine kinds for each."""
    for k in over(lines):
        before, aside, down, behind = list(lines[:k]), lines[k], lines[k + 1], list(lines[k + 2 :])
        alone = re.sub(_TOOL_AXIS, "", without(down, "X", "Y"))
        yield f"down first: {k}", [*before, alone, aside, *behind]
        yield f"down first, and again: {k}", [*before, alone, aside, down, *behind]
        yield f"elsewhere: {k}", [*before, set_to(set_to(aside, "X", "500."), "Y", "900."), aside, down, *behind]
        yield f"X lost: {k}", [*before, without(aside, "X"), down, *behind]
        yield f"Y lost: {k}", [*before, without(aside, "Y"), down, *behind]
        rapid = next(j for j, line in enumerate(behind) if ("G0" in line or "FMAX" in line) and has(line, "X"))
        fed = [*behind[:rapid], at_feed(behind[rapid]), *behind[rapid + 1 :]]
        yield f"the next rapid at feed: {k}", [*before, aside, down, *fed]
        yield f"too deep: {k}", [*before, aside, set_to(down, "Z", "-5."), down, *behind]
        turned = re.sub(r"(K|C3=|TZ\+?)1\.", r"\1-1.", aside).replace("+-", "-")
        turned = re.sub(r"(?<![A-Z])([AB][-+]?)0\.0", r"\g<1>40.0", turned)
        assert turned != aside
        yield f"turned over: {k}", [*before, turned, aside, down, *behind]
        yield f"turned over in its place: {k}", [*before, without(turned, "X", "Y"), aside, down, *behind]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_wrong_way_back_is_found(case: Case) -> None:
    lines = lines_of(CL, case)
    assert wrong(CL, case, lines) == set()
    assert len(over(lines)) == 3
    # three places: each kind of mutant at one of them, in turn
    chosen = [
        mutant for k, mutant in enumerate(mutants(lines)) if THOROUGH or (k % 9 + k // 9 + CASES.index(case)) % 3 == 0
    ]
    passed = [name for name, changed in chosen if not wrong(CL, case, changed)]
    assert passed == []


@pytest.mark.parametrize("case", [case for case in CASES if case.tcp], ids=str)
def test_a_tilted_tool_comes_in_one_block(case: Case) -> None:
    lines = list(lines_of(TILTED, case))
    assert wrong(TILTED, case, lines) == set()
    down = next(k for k, line in enumerate(lines) if has(line, "X") and has(line, "Z"))
    for lost in "XY":
        assert wrong(TILTED, case, [*lines[:down], without(lines[down], "X", "Y"), *lines[down:]])
        assert wrong(TILTED, case, [*lines[:down], without(lines[down], lost), *lines[down + 1 :]])


@pytest.mark.parametrize("case", [case for case in CASES if case.machine], ids=str)
def test_a_rotary_axis_that_turns_where_the_tool_has_come_down_is_found(case: Case) -> None:
    lines = list(lines_of(CL, case))
    first = over(tuple(lines))[0]
    turn = next(line for line in lines if re.search(r"[AB]\+?0", line) and not has(line, "X"))
    bare = [re.sub(_TOOL_AXIS, "", line) if k <= first + 1 else line for k, line in enumerate(lines)]
    bare = [line for k, line in enumerate(bare) if line == lines[k] or k in (first, first + 1)]
    down = next(k for k, line in enumerate(bare) if has(line, "X") and has(line, "Z"))
    assert wrong(CL, case, [*bare[: down + 1], turn, *bare[down + 1 :]])


def test_a_program_that_begins_without_a_retract_comes_down_over_its_place() -> None:
    case = Case("generic", "g1")
    lines = list(lines_of(CL, case))
    assert wrong(CL, case, lines) == set()
    first = next(k for k, line in enumerate(lines) if has(line, "X"))
    assert wrong(CL, case, [*lines[:first], without(lines[first], "X", "Y"), *lines[first:]])
    assert wrong(CL, case, [*lines[:first], without(lines[first], "X"), *lines[first:]])


@pytest.mark.parametrize("case", [case for case in CASES if case.tcp], ids=str)
def test_a_rapid_elsewhere_behind_the_last_retract_is_found(case: Case) -> None:
    lines = list(lines_of(CL, case))
    aside = set_to(re.sub(_TOOL_AXIS, "", lines[over(tuple(lines))[0]]), "X", "500.")
    last = max(k for k, line in enumerate(lines) if re.search(r"G28|G53|SUPA|M91", line))
    last += lines[last].startswith("G91")
    assert wrong(CL, case, [*lines[: last + 1], aside, *lines[last + 1 :]])


#: how our head begins, and the code of a block that is not on the list of what a control takes in its place
_OURS, _NOT_LISTED = "CORNERSMOOTH", "CS571"


@cache
def with_head(cl: bytes, case: Case) -> tuple[str, ...]:
    """What is written for it, with a head that says how it was made."""
    stream = io.BytesIO()
    postprocess(program(cl), stream, Settings(tolerance=0.02), form=case.choose(), verify=False)
    return tuple(stream.getvalue().decode().splitlines())


@pytest.mark.parametrize("case", [case for case in CASES if case.tcp], ids=str)
def test_a_program_with_our_head_has_no_other_way_around_a_retract(case: Case) -> None:
    lines = list(with_head(CL, case))
    assert wrong(CL, case, lines, head=_OURS) == set()
    first = over(tuple(lines))[0]
    aside, down = lines[first], lines[first + 1]
    retract = next(k for k, line in enumerate(lines) if re.search(r"G28|G53|SUPA|M91", line))
    assert retract < first
    ways = {
        "in one block": [*lines[:first], *lines[first + 1 :]],
        "down with rotary words": [*lines[:first], without(down, "X", "Y"), aside, *lines[first + 1 :]],
        "without a retract": [*lines[:retract], *lines[retract + 1 :]],
    }
    if case.machine:
        turn = next(line for line in lines if re.search(r"[AB]\+?0", line) and not has(line, "X"))
        ways["turned under tip control"] = [*lines[:first], turn, *lines[first:]]
    else:
        del ways["down with rotary words"]
    for name, changed in ways.items():
        assert _NOT_LISTED in wrong(CL, case, changed, head=_OURS), name


@pytest.mark.parametrize("case", [case for case in CASES if case.tcp], ids=str)
def test_a_tilted_tool_of_a_program_with_our_head_comes_in_one_block(case: Case) -> None:
    lines = list(with_head(TILTED, case))
    assert wrong(TILTED, case, lines, head=_OURS) == set()
    down = next(k for k, line in enumerate(lines) if has(line, "X") and has(line, "Z"))
    aside = [*lines[:down], without(lines[down], "Z"), *lines[down:]]
    assert _NOT_LISTED in wrong(TILTED, case, aside, head=_OURS)


@pytest.mark.parametrize(
    ("retract", "back"),
    [
        ("G91 G28 Z0.\nG49\nG90\n", "G0 X10. Y0.\nG43 Z-3. H1\n"),
        ("G91 G28 Z0.\nG49\nG90\n", "G0 X10. Y0.\nG43 Z2. H1\nZ-3.\n"),
        ("G91 G28 Z0.\nG49\nG90\n", "G0 X10. Y0.\nG43 Z2. H1\nG1 Z-3. F300.\n"),
    ],
)
def test_a_cut_that_a_retract_leaves_alone_is_no_program_of_the_file(retract: str, back: str) -> None:
    """A program of another post: the retract has its whole way back, and the CL file has none of it."""
    cl = b"LOAD/TOOL,1\nSPINDL/RPM,3000,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nRAPID\nGOTO/0,0,2\nFEDRAT/MMPM,300\n"
    cl += b"GOTO/0,0,-3\nGOTO/10,0,-3\nGOTO/20,0,-3\nRAPID\nGOTO/20,0,50\nFINI\n"
    head = "%\nO1\nG21 G17 G40 G49 G80 G90 G94\nG91 G28 Z0.\nG90\nT1 M6\nG54\nS3000 M3\nG0 X0. Y0.\nG43 Z50. H1\nZ2.\n"
    cut, end = "G1 Z-3. F300.\nX10.\n{}G1 X20.\nG0 Z50.\n", "M5\nG91 G28 Z0.\nG49\nM30\n%\n"
    right, wrong = (head + cut.format(more) + end for more in ("", retract + back))
    assert verify(read(cl), right.encode(), tolerance=0.01).passed
    assert not verify(read(cl), wrong.encode(), tolerance=0.01).passed
