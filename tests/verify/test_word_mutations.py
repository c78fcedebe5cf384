"""A sample of the mutants of words, and what else the check of words must do; `word_mutations` judges all of them."""

from __future__ import annotations

import importlib.util
import io
from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.nc import fit_settings, write
from cornersmooth.nc_reader.block_tables import read_lines
from cornersmooth.nc_reader.word_list import word_list
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from cornersmooth.verify.word_check import WordCheck
from nc.cases import CHOSEN, Case
from oracle.share import how_many

from .form_mutations import EPS, H, program_of
from .word_mutations import judged, named_in, options_of, text_of

DOCS = Path(__file__).resolve().parents[2] / "docs"
CONTROLS = ("fanuc", "mitsubishi", "haas", "linuxcnc", "generic", "siemens", "heidenhain")
#: mutants of each control
SAMPLE = how_many(4, 10)


@pytest.mark.parametrize("control", CONTROLS)
def test_a_sample_of_the_mutants_is_judged_rightly(control: str) -> None:
    score = judged([case for case in CHOSEN if case.control == control], 1, SAMPLE)
    assert score.wrong == []
    assert sum(score.judged.values()) == SAMPLE


def test_every_control_asks_for_a_head() -> None:
    for control in CONTROLS:
        heads = word_list(control).heads()
        assert set(heads) >= ({"units", "positions", "plane"} if control != "heidenhain" else set())


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


def test_the_tables_in_the_docs_are_those_of_the_lists() -> None:
    spec = importlib.util.spec_from_file_location("make_words", DOCS / "make_words.py")
    assert spec
    assert spec.loader
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    assert (DOCS / "verify.md").read_text(encoding="utf-8") == maker.page(), "run: python docs/make_words.py"
