"""Mutants of the words that a shop's habits ask for: stops between tools, the control's own smoothing."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from functools import cache

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Form, choose_form, parse_control
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.writing import lines_of

CL = """UNITS/MM
LOADTL/1
SPINDL/2000,RPM,CLW
COOLNT/ON
RAPID
GOTO/0,0,30,0.28,0,0.96
FEDRAT/MMPM,300
GOTO/0,0,0
GOTO/9,1,0,0.28,0.1,0.95
GOTO/20,0,0
RAPID
GOTO/0,0,60,0.28,0,0.96
LOADTL/3
SPINDL/500,RPM,CLW
COOLNT/ON
RAPID
GOTO/20,5,30,0,0,1
GOTO/20,5,2
FEDRAT/MMPM,200
GOTO/40,5,2
RAPID
GOTO/20,5,30
FINI
"""
#: control, what `--with` asks for, machine
FORMS = {
    "fanuc": ("aicc", "table-ac"),
    "haas": ("g187", "table-bc"),
    "heidenhain": ("cycle32", ""),
    "siemens": ("cycle832", ""),
    "mitsubishi": ("", ""),
}


@cache
def text_of(control: str) -> list[str]:
    extra, machine = FORMS[control]
    form = choose_form(control, machine=load_machine(machine) if machine else None, extras=[extra] if extra else [])
    return lines_of(form, CL)


def problems(control: str, lines: list[str]) -> list[str]:
    machine = FORMS[control][1]
    text = ("\n".join(lines) + "\n").encode()
    try:
        found = verify(
            read(CL.encode(), name="part.cls"),
            text,
            tolerance=0.05,
            axis_length=10.0,
            control=control,
            machine=load_machine(machine) if machine else None,
        )
    except InputError as error:
        return [str(error)]
    return [f"{problem.code} {problem.text}" for problem in found.problems]


def bare(line: str) -> str:
    return re.sub(r"^\d+ ", "", line)


@pytest.mark.parametrize("control", FORMS)
def test_the_right_text_passes(control: str) -> None:
    assert problems(control, text_of(control)) == []


Change = Callable[[str], list[str]]


def sub(old: str, new: str) -> Change:
    """Another word in the line."""
    return lambda line: [re.sub(old, new, line)]


def gone(line: str) -> list[str]:
    """No line."""
    return []


#: control, the line (a regular expression) and which of those, and what becomes of it
MUTANTS = {
    "M0 between tools": ("mitsubishi", "M1", 0, sub("M1", "M0")),
    "M30 between tools": ("fanuc", "M1", 0, sub("M1", "M30")),
    "M1 twice between tools": ("fanuc", "M1", 0, lambda line: [line, "G4 P500", line]),
    "a stop in the cut": ("siemens", r"G1 .*", 3, lambda line: [line, "M1"]),
    "a stop in the cut, Klartext": ("heidenhain", r"LN .*", 6, lambda line: [line, "M1"]),
    "smoothing on twice as much": ("haas", r"G187 P3 .*", 0, sub(r"E\S+", "E0.05")),
    "smoothing of the second tool": ("haas", r"G187 P3 .*", 1, sub(r"E\S+", "E0.5")),
    "smoothing in another mode": ("haas", r"G187 P3 .*", 1, sub("P3", "P1")),
    "smoothing not off at the end": ("haas", "G187", 1, gone),
    "smoothing on alone": ("haas", r"G187 P3 .*", 1, gone),
    "P without G187": ("haas", r"G187 P3 .*", 0, sub("G187 ", "")),
    "cycle 32 wide": ("heidenhain", r"CYCL DEF 32\.1 T.*", 0, sub(r"T\S+$", "T0.2")),
    "cycle 32 of the second tool": ("heidenhain", r"CYCL DEF 32\.1 T.*", 1, sub(r"T\S+$", "T0.2")),
    "cycle 32 without its tolerance": ("heidenhain", r"CYCL DEF 32\.1 T.*", 0, gone),
    "cycle 32 without its beginning": ("heidenhain", r"CYCL DEF 32\.0 .*", 0, gone),
    "cycle 32 not off": ("heidenhain", r"CYCL DEF 32\.1", 1, gone),
    "cycle 32 of another number": ("heidenhain", r"CYCL DEF 32\.2 .*", 0, sub(r"32\.2", "33.2")),
    "cycle 832 wide": ("siemens", r"CYCLE832\(0\.\d+,.*", 0, sub(r"\(0\.\d+", "(0.3")),
    "cycle 832 not off": ("siemens", r"CYCLE832\(0,.*", 1, gone),
    "cycle 832 of the second tool off": ("siemens", r"CYCLE832\(0\.\d+,.*", 1, sub(r"\(.*", "(0,_OFF,1)")),
    "contour control not on": ("fanuc", r"G5\.1 Q1", 1, sub("Q1", "Q0")),
    "contour control without Q": ("fanuc", r"G5\.1 Q1", 0, sub(" Q1", "")),
    "retract left out": ("fanuc", r"G91 G28 Z0\.", 1, gone),
    "retract left out at the end": ("siemens", r"SUPA G0 Z0 D0", -1, gone),
    "another work offset": ("haas", "G54", 1, sub("G54", "G55")),
    "another preset": ("heidenhain", r"CYCL DEF 247 .*", 0, gone),
    "tip control at a turned table": ("fanuc", r"G0 A0\.0000 C0\.0000", 1, gone),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_found(name: str) -> None:
    control, pattern, which, change = MUTANTS[name]
    lines = text_of(control)
    at = [k for k, line in enumerate(lines) if re.fullmatch(pattern, bare(line))][which]
    changed = [*lines[:at], *change(lines[at]), *lines[at + 1 :]]
    assert changed != lines
    assert problems(control, changed) != []


BETWEEN = {
    "a stop in the cut": "STOP\nGOTO/40,0,0,0,0,1\n",
    "the way home": "RAPID\nGOTO/40,0,60\nGOHOME\n",
    "neither": "",
}


@pytest.mark.parametrize("what", BETWEEN)
def test_the_operator_may_stop_between_tools_whatever_the_first_has_done(what: str) -> None:
    cl = "UNITS/MM\nLOADTL/0\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nFEDRAT/MMPM,300\nGOTO/0,0,0\nGOTO/30,0,0\n"
    cl += f"{BETWEEN[what]}LOADTL/2\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,9,50\nFEDRAT/MMPM,300\nGOTO/0,9,0\nFINI\n"
    stream = io.BytesIO()
    result = postprocess(cl.encode(), stream, Settings(tolerance=0.01), form=choose_form("fanuc"), processes=1)
    lines = stream.getvalue().decode().splitlines()
    assert lines[lines.index("T2 M6") - 1] == "M1"
    assert lines.count("M1") == 1
    assert result.verification is not None
    assert result.verification.problems == ()
    assert [finding.code for finding in result.findings].count("CS382") == 1


def test_the_first_tool_that_is_loaded_asks_for_no_stop() -> None:
    """What has moved before is in the spindle, and nobody has named it."""
    cl = "UNITS/MM\nFEDRAT/100,MMPM\nRAPID\nGOTO/0,0,80,0,0,1\nGOTO/0,0,0\nGOTO/5,0,0\nLOADTL/3\n"
    cl += "SPINDL/1000,CLW\nGOTO/5,0,0\nGOTO/25,0,0\nFINI\n"
    stream = io.BytesIO()
    result = postprocess(cl.encode(), stream, Settings(tolerance=0.01), form=choose_form("fanuc"), processes=1)
    assert "M1" not in stream.getvalue().decode().splitlines()
    assert result.verification is not None
    assert result.verification.problems == ()


@pytest.mark.parametrize(
    ("control", "staged", "change"), [("fanuc", "T3", "T1 M6"), ("heidenhain", "TOOL DEF 3", "TOOL CALL 1 Z")]
)
def test_the_next_tool_is_brought_near_where_the_table_says_so(control: str, staged: str, change: str) -> None:
    def bare(form: Form, cl: str) -> list[str]:
        return [re.sub(r"^\d+ ", "", line) for line in lines_of(form, cl)]

    table = parse_control(f'like = "{control}"\n[words]\nstage_tool = true\n')
    lines = bare(choose_form(table), CL)
    assert lines[lines.index(change) + 1] == staged
    assert sum(line == staged for line in lines) == 1  # the last tool has none behind it
    assert staged not in bare(choose_form(control), CL)
    selects = CL.replace("COOLNT/ON\n", "COOLNT/ON\nSELECT/TOOL,3\n", 1)
    assert lines_of(choose_form(table), selects) == lines_of(choose_form(control), selects)
    result = postprocess(
        read(CL.encode(), name="part.cls"), io.BytesIO(), Settings(tolerance=0.05), form=choose_form(table)
    )
    assert result.verification is not None
    assert result.verification.problems == ()
