"""Words that repeat, left out with ``modal``: the same motion in less text, and never a word that has changed."""

from __future__ import annotations

import io
import re
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.feedrate import Limits
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Form, Frame, choose_form, fit_settings, parse_control, write
from cornersmooth.nc_reader import NcProgram, read_nc
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.text import RowFormat
from nc.cases import Case
from nc.test_nc_linuxcnc import accepted, positions
from oracle.share import share

#: moves along one axis, turns of the tool alone, arcs, dwells, holes, two feeds, a statement between
CL = """UNITS/MM
LOADTL/1
SPINDL/2000,RPM,CLW
RAPID
GOTO/0,0,50,0,0,1
RAPID
GOTO/0,0,20
FEDRAT/MMPM,300
GOTO/0,0,0
GOTO/30,0,0
GOTO/30,0,0,0.28,0,0.96
GOTO/30,9,0,0.28,0,0.96
GOTO/30,9,0,0,0,1
FEDRAT/MMPM,500
GOTO/40,9,0
CIRCLE/40,19,0,0,0,1,10
GOTO/50,19,0
GOTO/50,30,0
COOLNT/ON
GOTO/50,40,0
DELAY/0.5
GOTO/50,50,0
RAPID
GOTO/50,50,50
CYCLE/DRILL,FEDTO,12,MMPM,150,RAPTO,3,DWELL,0.5
GOTO/50,55,0
GOTO/60,55,0
CYCLE/OFF
RAPID
GOTO/60,55,50
FINI
"""

CASES = [
    Case("fanuc", "g1"),
    Case("mitsubishi", "g1", "table-ac"),
    Case("fanuc", "g1", "table-ac", tcp=False),
    Case("siemens", "g1"),
    Case("siemens", "g1", "head-ac"),
    Case("heidenhain", "g1"),
    Case("heidenhain", "g1", "table-bc"),
    Case("haas", "g1", "table-bc"),
    Case("linuxcnc", "g1", "xyzac-trt"),
    Case("generic", "g1"),
    Case("fanuc", "g6.2"),
    Case("siemens", "bspline"),
]


def written(form: Form, *, modal: bool, cl: str = CL, cycles: str = "moves") -> str:
    program, stream = read(cl.encode(), name="part.cls"), io.BytesIO()
    smoothed = smooth(program, fit_settings(Settings(tolerance=0.05), form, program.units))
    found = write(smoothed, stream, form=form, frame=Frame(modal=modal, cycles=cycles))
    text = stream.getvalue().decode("ascii")
    lines = text.splitlines()
    assert found.blocks == sum(not line.endswith(" ~") for line in lines)
    return text


@cache
def both(case: Case) -> tuple[str, str]:
    """A text in full, and with what repeats left out."""
    return written(case.choose(), modal=False), written(case.choose(), modal=True)


def understood(case: Case, text: str) -> NcProgram:
    return read_nc(text.encode(), control=case.control, machine=case.choose().machine, tcp=case.tcp)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_motion_is_the_same(case: Case) -> None:
    full, modal = both(case)
    one, other = understood(case, full), understood(case, modal)
    for name in ("kind", "tip", "second", "line", "feed", "per_revolution"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.events == other.events
    assert one.problems == other.problems == ()
    if case in (Case("heidenhain", "g1"), Case("fanuc", "g6.2"), Case("siemens", "bspline")):
        assert modal == full
    else:
        assert len(modal) < 0.95 * len(full)


_MOVE = re.compile(r"(?:\d+ |G43 H\d+ )?((?:G[01]|L|)) ?((?:[XYZABCIJK]3?=?[-+]?[\d.]+ ?)+)(.*)")
_WORD = re.compile(r"([XYZABCIJK]3?=?)([-+]?[\d.]+)")


@pytest.mark.parametrize("case", CASES[:9], ids=str)
def test_only_what_repeats_is_left_out(case: Case) -> None:
    """A few lines of another reading: what each block says, with what the block before it has said."""
    full, modal = (text.splitlines() for text in both(case))
    assert len(full) == len(modal)
    held: dict[str, str] = {}
    code = ""
    for line, short in zip(full, modal, strict=True):
        if line == short:
            held, code = {}, ""
        if (match := _MOVE.fullmatch(line)) is None:
            continue
        left = _MOVE.fullmatch(short)
        assert left is not None
        code = left[1] or code
        held |= dict(_WORD.findall(short))
        assert code == match[1]
        assert held == dict(_WORD.findall(line)) | {
            name: held[name] for name in held.keys() - {w for w, _ in _WORD.findall(line)}
        }
        assert left[3] == match[3]
        assert not short.startswith(" ")
        assert "  " not in short
        if line == short:  # behind other blocks everything is said
            held = dict(_WORD.findall(line))
        vectors = [name for name, _ in _WORD.findall(short) if name[0] in "IJK" or "3=" in name]
        assert len(vectors) in (0, 3)


@pytest.mark.parametrize("case", share([CASES[0], CASES[3], CASES[6], CASES[8]], 2), ids=str)
def test_programs_with_cycles_planned_feeds_and_planes_are_verified(case: Case) -> None:
    machine = load_machine(case.machine) if case.machine else None
    planes = case.control != "linuxcnc"
    form = choose_form(case.control, case.form, machine=machine, planes=planes)
    tilted = CL.replace(
        "GOTO/60,55,50\nFINI", "GOTO/60,0,60,0.6,0,0.8\nGOTO/20,0,0\nGOTO/20,9,0\nRAPID\nGOTO/60,0,60\nFINI"
    )
    for limits in (None, Limits()):
        stream = io.BytesIO()
        frame = Frame(modal=True, cycles="native")
        result = postprocess(
            tilted.encode(), stream, Settings(tolerance=0.05), form=form, frame=frame, plan_feeds=limits, processes=1
        )
        assert result.unverified == ""
        assert result.verification is not None
        assert result.verification.problems == ()


def test_words_that_touch_are_left_out_as_well() -> None:
    table = parse_control('like = "fanuc"\nname = "tight"\n[motion]\nspaces = false\ntrailing_zeros = false\n')
    text = written(choose_form(table), modal=True)
    full = written(choose_form(table), modal=False)
    assert "\nX29." in text
    assert not re.search(r"^[XYZ]\S* ", text, re.MULTILINE)
    one, other = (read_nc(each.encode(), control="fanuc") for each in (full, text))
    np.testing.assert_array_equal(one.tip, other.tip)
    np.testing.assert_array_equal(one.second, other.second)


def test_rows_lose_words_and_the_blank_before_the_first() -> None:
    rows = RowFormat((b" X", b" Y"), (1, 1))
    ticks = np.tile(np.array([[10, -25], [10, -30]]), (9000, 1))  # more than are laid out at a time
    left_out = np.tile(np.array([[False, False], [True, False]]), (9000, 1))
    text = rows.rows(ticks, [b"G1", b""], np.tile([0, 1], 9000), [b"\n"], 0, left_out)
    assert text == b"G1 X1.0 Y-2.5\nY-3.0\n" * 9000


@pytest.mark.linuxcnc
@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC is not installed")
def test_linuxcnc_makes_the_same_moves_of_it(tmp_path: Path) -> None:
    full, modal = both(Case("linuxcnc", "g1", "xyzac-trt"))
    accepted(modal, tmp_path)
    one, other = positions(full, tmp_path), positions(modal, tmp_path)
    assert [kind for kind, _ in one] == [kind for kind, _ in other]
    np.testing.assert_array_equal(np.array([place for _, place in one]), np.array([place for _, place in other]))
