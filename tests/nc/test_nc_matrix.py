"""Everything that can be asked for: control, form, machine, tip control, feed mode. It is written, and its reader takes
it, or it is refused with code 2 and a hint that works.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import SettingsError
from cornersmooth.nc import control_names, load_control
from cornersmooth.settings import Settings
from nc.cases import ALL, RUNNABLE, Case
from nc.grammars import reader
from nc.promise import written
from nc.reading import Reading
from oracle.share import covering_share, share

POSES = "RAPID\nGOTO/0,0,50{up}\n{feed}\nGOTO/0,0,0{up}\nGOTO/20,0,0{tilted}\nGOTO/20,15,1{other}\nGOTO/0,15,1{other}\n"
AXES = {"up": ",0,0.099503719,0.995037190", "tilted": ",0.098058068,0,0.995180702", "other": ",0,0.2,0.979795897"}
FEEDS = {"per minute": "FEDRAT/800,MMPM", "per revolution": "FEDRAT/0.1,MMPR"}


def cl(feed: str, *, upright: bool, units: str = "mm") -> bytes:
    """Four corners, in `feed`, with a tool that stays or turns."""
    axes = dict.fromkeys(AXES, ",0,0,1") if upright else AXES
    text = "UNITS/MM\nLOADTL/4\nSPINDL/9000,RPM,CLW\n" + POSES.format(feed=FEEDS[feed], **axes) + "FINI\n"
    if units == "inch":
        text = text.replace("UNITS/MM", "UNITS/INCHES").replace("MMPM", "IPM").replace("MMPR", "IPR")
    return text.encode()


def read_back(case: Case, feed: str, units: str = "mm") -> Reading:
    """Write a program for the case and read it strictly."""
    form = case.choose()
    program = read(cl(feed, upright=form.orientation == "fixed", units=units), name="part.cls")
    text, _ = written(program, form, Settings(tolerance=0.05, method="proportional"))
    return reader(case.control, case.form, case.machine, case.tcp, units).read(text, 10.0, 0.05)


def followed(case: Case, hint: str) -> Case:
    """What the hint says to ask for instead."""
    if match := re.search(r"use -f (\S+)", hint):
        case = replace(case, form=match[1])
    if "--machine" in hint:
        case = replace(case, machine="" if "leave out --machine" in hint else "table-ac")
    if "leave out --no-tcp" in hint:
        case = replace(case, tcp=True)
    return case


@pytest.mark.parametrize("case", covering_share(RUNNABLE, 8), ids=str)
def test_what_runs_is_text_of_the_control(case: Case) -> None:
    for feed, units in share(product(FEEDS, ("mm", "inch")), 2, RUNNABLE.index(case)):
        found = read_back(case, feed, units)
        # forms with a point on the axis come down to the first position along the tool
        down = case.choose().orientation == "point" and case.control != "generic"
        assert sum(piece.rapid for piece in found.pieces) == 1 + down
        assert len(found.pieces) > 4


@pytest.mark.parametrize("case", [case for case in ALL if case not in RUNNABLE], ids=str)
def test_what_cannot_run_is_refused_with_a_hint_that_runs(case: Case) -> None:
    with pytest.raises(SettingsError) as refusal:
        case.choose()
    assert refusal.value.exit_code == 2
    assert case.control in str(refusal.value) or "machine positions need a machine" in str(refusal.value)
    other = followed(case, refusal.value.hint)
    assert other != case, refusal.value
    assert other.runs, refusal.value


CURVES = [
    (control, name) for control in control_names() for name, form in load_control(control).forms.items() if form.curve
]


def test_the_matrix_holds_what_the_controls_cannot_run() -> None:
    """What the manuals refuse is refused here; what they have is not."""
    runs = {str(case) for case in RUNNABLE}
    assert not runs & {
        "haas-g1",  # no tool vectors
        "linuxcnc-g1",
        "fanuc-g6.2-table-ac-axes",  # PS1006: G6.2 under G93
        "siemens-bspline-table-ac-axes",
        *(f"{control}-{form}-table-ac" for control, form in CURVES),  # curves in rotary words
        "heidenhain-g1-table-ac-axes",  # no inverse time
        *(f"{case.control}-{case.form}-axes" for case in ALL),  # machine positions without a machine
    }
    assert set(load_control("linuxcnc").forms) == {"g1"}  # G5.2, G6.2 run in a plane only
    assert {
        "siemens-g1-table-ac-axes",
        "haas-g1-table-ac-axes",
        "linuxcnc-g1-xyzac-trt-axes",
    } <= runs


#: words by which a control is told feed per minute, per revolution and inverse time
MODES = {"heidenhain": ("M137", "M136", None)}


@pytest.mark.parametrize(
    "case", covering_share([case for case in RUNNABLE if case.machine in ("", "table-ac")], 8), ids=str
)
def test_feeds_mean_what_the_file_says(case: Case) -> None:
    """F of the first cut in the words of each control; Heidenhain counts tenths of an inch per minute."""
    minute, revolution, _ = MODES.get(case.control, ("G94", "G95", "G93"))
    for units, scale in (("mm", 1.0), ("inch", 10.0 if case.control == "heidenhain" else 1.0)):
        first = next(piece for piece in read_back(case, "per minute", units).pieces if not piece.rapid)
        if case.tcp:
            assert (first.mode, first.feed) == (minute, 800.0 * scale)
        first = next(piece for piece in read_back(case, "per revolution", units).pieces if not piece.rapid)
        assert (first.mode, first.feed) == (revolution, 0.1)


@pytest.mark.parametrize("case", covering_share([case for case in RUNNABLE if not case.tcp], 9), ids=str)
def test_inverse_time_gives_the_tip_its_feed(case: Case) -> None:
    """1/F minutes for every block: the tip runs with 800 mm/min along the part, whatever the axes do."""
    timed = [piece for piece in read_back(case, "per minute").pieces if not piece.rapid]
    assert {piece.mode for piece in timed} == {"G93"}
    for piece in timed:
        tip, _ = piece.at(np.linspace(0, 1, 200))
        length = np.linalg.norm(np.diff(tip, axis=0), axis=1).sum()
        assert piece.feed is not None
        if length > 0.5:  # the digits of the ends are a part in ten thousand of it
            assert length * piece.feed == pytest.approx(800.0, rel=2e-3)


TURN = (
    b"UNITS/MM\nLOADTL/4\nSPINDL/9000,RPM,CLW\nRAPID\nGOTO/0,0,0,0,0.6,0.8\nFEDRAT/100,MMPM\nGOTO/9,0,0\n"
    b"GOTO/9,0,0,0,0.7,0.714142843\nGOTO/18,0,0\nFINI\n"
)


@pytest.mark.parametrize(
    "case",
    covering_share(
        [case for case in RUNNABLE if case.choose().orientation != "fixed" and not case.machine.endswith("trt")], 4
    ),
    ids=str,
)
def test_a_tool_that_only_turns(case: Case) -> None:
    """Tip control takes F as it is; LinuxCNC would take it as degrees per minute and is told the time instead."""
    text, _ = written(read(TURN, name="part.cls"), case.choose(), Settings(tolerance=1e-3, reversal_angle=1.0))
    found = reader(case.control, case.form, case.machine, case.tcp).read(text, 10.0, 1e-3)
    turns = []
    for piece in found.pieces[1:]:
        tip, direction = piece.at(np.array([0.0, 1.0]))
        if (
            np.abs(tip[1] - tip[0]).max() < 2e-4 * (1 if case.tcp else 100)
            and np.abs(direction[1] - direction[0]).max() > 1e-5
        ):
            turns.append(piece)
    assert turns
    modes = {piece.mode for piece in turns}
    if case.control == "linuxcnc" or not case.tcp:
        assert modes == {"G93"}
        time = sum(1.0 / piece.feed for piece in turns if piece.feed)
        # the axis point, 10 mm away from the tip, runs with the feed: 7.6 degrees, slow enough for F of inverse time
        swing = 10.0 * np.arccos(0.6 * 0.7 + 0.8 * 0.714142843)
        assert time == pytest.approx(swing / 100.0, rel=0.02)
    else:
        assert modes == {found.pieces[1].mode}
        assert all(piece.feed is None for piece in turns)
