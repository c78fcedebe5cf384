"""A sample of the mutants of words, and what else the check of words must do; `word_mutations` judges all of them."""

from __future__ import annotations

import importlib.util
import io
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.control.source import read_lines
from cornersmooth.control.table import table_of
from cornersmooth.nc import Frame, fit_settings, write
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_words.check import WordCheck
from cornersmooth.nc_words.states import GONE_ON
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.cases import CHOSEN, Case
from oracle.share import how_many

from .form_mutations import EPS, H, program_of
from .word_mutations import judged, named_in, options_of, text_of

DOCS = Path(__file__).resolve().parents[2] / "docs"
CONTROLS = ("fanuc", "mitsubishi", "haas", "linuxcnc", "generic", "siemens", "heidenhain")
#: mutants of each control
SAMPLE = how_many(2, 10)


@pytest.mark.parametrize("control", CONTROLS)
def test_a_sample_of_the_mutants_is_judged_rightly(control: str) -> None:
    score = judged([case for case in CHOSEN if case.control == control], 1, SAMPLE)
    assert score.wrong == []
    assert sum(score.judged.values()) == SAMPLE


def test_every_control_asks_for_a_head() -> None:
    for control in CONTROLS:
        heads = {row.group for row in table_of(control).listed if row.first}
        assert heads >= ({"units", "distance", "plane"} if control != "heidenhain" else set())


def test_blocks_of_the_user_are_taken_on_trust_and_named() -> None:
    case = Case("fanuc", "g1")
    lines = text_of(case)
    place = next(k for k, line in enumerate(lines) if line.startswith("G43.5"))
    lines = [*lines[:place], "G187 P3", "M138", *lines[place:]]
    assert {text.split()[0] for _, text in named_in(case, lines)} == {"CS503"}  # G187 is no word that could be read
    data = ("\n".join(lines) + "\n").encode()
    found = verify(program_of(case), data, tolerance=EPS, axis_length=H, trusted=["G187  P3 (fast)", "M138", "(none)"])
    assert found.trusted == ((place + 1, "G187 P3"), (place + 2, "M138"))
    assert found.problems == ()
    lines[place] = "G8 P1"
    assert {line for line, _ in named_in(case, lines)} >= {place + 1, place + 2}


@pytest.mark.parametrize("control", CONTROLS)
def test_going_home_and_coming_back_is_no_mistake(control: str) -> None:
    text = b"LOADTL/2\nFEDRAT/MMPM,500.\nRAPID\nGOTO/0,0,9,0,0,1\nGOTO/0,0,0\nGOTO/10,0,0\nGOHOME\nGOTO/0,10,0\nFINI\n"
    case = next(case for case in CHOSEN if case.control == control and case.tcp)
    form, program = case.choose(), read(text, name="home.cls")
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(), form, "mm")), stream, form=form)
    check = WordCheck(control, options_of(case).dialect.lexer, 0.01)
    lines = list(check.watch(read_lines(stream.getvalue(), None, check.lexer)))
    assert len(lines) > 5
    assert check.problems == []


TWO_TOOLS = b"""LOADTL/2
SPINDL/RPM,3000,CLW
FEDRAT/MMPM,500.
RAPID
GOTO/0,0,9,0,0,1
GOTO/0,0,0
GOTO/10,0,0,0.6,0,0.8
RAPID
GOTO/10,0,30
LOADTL/3
SPINDL/RPM,4000,CLW
RAPID
GOTO/0,20,9,0,0,1
GOTO/0,20,0
GOTO/10,20,0
FINI
"""


def _problems(case: Case, lines: list[str]) -> list[Problem]:
    """What the check of words finds in a text."""
    check = WordCheck(case.control, options_of(case).dialect.lexer, 0.01)
    list(check.watch(read_lines(("\n".join(lines) + "\n").encode(), None, check.lexer)))
    return check.problems


def _said_of(control: str, machine: str, change: Callable[[list[str]], list[str]]) -> list[str]:
    """What the check of words says of the text of two tools, changed behind its first tool change."""
    case = next(case for case in CHOSEN if (case.control, case.form, case.machine) == (control, "g1", machine))
    form, program = case.choose(endless=True), read(TWO_TOOLS, name="two.cls")
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(), form, "mm")), stream, form=form)
    lines = stream.getvalue().decode().splitlines()
    changed = change(lines)
    assert changed != lines
    return [problem.text for problem in _problems(case, changed)]


def _without(lines: list[str], start: str) -> list[str]:
    """All but the last block that begins so and has others like it before it."""
    own = [k for k, line in enumerate(lines) if re.sub(r"^\d+ ", "", line).startswith(start)]
    return [line for k, line in enumerate(lines) if k != own[-2]]


@pytest.mark.parametrize(
    ("control", "machine", "start", "wanted"),
    [
        ("fanuc", "", "G49", "M6 under G43.5"),
        ("mitsubishi", "", "G49", "M6 under G43.5"),
        ("haas", "table-bc", "G49", "M6 under G234"),
        ("siemens", "", "TRAFOOF", "M6 under TRAORI"),
        ("heidenhain", "", "FUNCTION RESET TCPM", "TOOL CALL 3 Z under FUNCTION TCPM"),
    ],
)
def test_tool_tip_control_ends_before_a_tool_change(control: str, machine: str, start: str, wanted: str) -> None:
    said = _said_of(control, machine, lambda lines: _without(lines, start))
    assert any(text.startswith(wanted) for text in said), said


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
def test_a_spindle_that_starts_before_the_tool_change_stands_still(control: str) -> None:
    def change(lines: list[str]) -> list[str]:
        start = [k for k, line in enumerate(lines) if line.endswith("M3")][-1]
        tool = [k for k, line in enumerate(lines) if re.search(r"T3\b|TOOL CALL 3", line)][-1]
        return [*lines[:tool], lines[start], *lines[tool:start], *lines[start + 1 :]]

    assert any("stops the spindle that was started before it" in text for text in _said_of(control, "", change))


def test_a_transformation_makes_the_work_offset_forgotten() -> None:
    def change(lines: list[str]) -> list[str]:
        on, own = lines.index("TRAORI"), lines.index("G54")
        return [*lines[:on], "G54", *lines[on:own], *lines[own + 1 :]]

    assert _said_of("siemens", "", change) == ["work offset: it must come after TRAORI, which deselects it"]


def test_no_work_offset_under_tool_tip_control() -> None:
    def change(lines: list[str]) -> list[str]:
        on = lines.index("G43.5 H2")
        return [*lines[: on + 3], "G54", *lines[on + 3 :]]

    assert _said_of("fanuc", "", change) == ["G54 under G43.5"]


def test_a_cycle_is_a_motion_of_the_tool() -> None:
    """Behind the last retract, which takes the length of the tool off, too."""
    cl = b"LOADTL/2\nSPINDL/RPM,900,CLW\nRAPID\nGOTO/0,0,30,0,0,1\nCYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,2\n"
    case = next(case for case in CHOSEN if case.control == "siemens" and not case.tcp)
    form, program = case.choose(endless=True), read(cl + b"GOTO/0,0,0\nGOTO/9,0,0\nCYCLE/OFF\nFINI\n", name="holes.cls")
    stream = io.BytesIO()
    frame = Frame(cycles="native")
    write(smooth(program, fit_settings(Settings(), form, "mm")), stream, form=form, frame=frame)
    lines = stream.getvalue().decode().splitlines()
    last = max(k for k, line in enumerate(lines) if line.startswith("CYCLE81"))
    up = next(k for k in range(last, len(lines)) if lines[k].startswith("SUPA"))
    for text, wanted in (
        (lines, []),
        ([*lines[:last], *lines[last + 1 : up + 1], lines[last], *lines[up + 1 :]], [GONE_ON]),
    ):
        assert [problem.text for problem in _problems(case, text) if problem.code == "CS571"] == wanted


def test_the_tables_in_the_docs_are_those_of_the_lists() -> None:
    spec = importlib.util.spec_from_file_location("make_words", DOCS.parent / "tools" / "make_words.py")
    assert spec
    assert spec.loader
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    assert (DOCS / "dev" / "words.md").read_text(encoding="utf-8") == maker.page(), "run: python tools/make_words.py"
