"""Modulo axes: the same angles from 0 to 360 degrees, with the control's words for the shorter way."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Machine, load_machine, parse_machine
from cornersmooth.nc import choose_form
from cornersmooth.verify import verify
from nc.writing import lines_of

EPS = 0.05


def spiral() -> str:
    """Two turns of a tilted tool, downwards, and a rapid with another tool."""
    angle = np.radians(30.0 * np.arange(26))
    tip = np.column_stack((20 * np.cos(angle), 20 * np.sin(angle), -0.1 * np.arange(26)))
    axis = np.column_stack((0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(26, np.sqrt(1 - 0.09))))
    poses = "".join(f"GOTO/{','.join(f'{value:.6f}' for value in (*p, *o))}\n" for p, o in zip(tip, axis, strict=True))
    start = "UNITS/MM\nLOADTL/1\nSPINDL/2000,RPM,CLW\nRAPID\nGOTO/20,0,30,0.3,0,0.9539392\nFEDRAT/MMPM,300\n"
    return f"{start}{poses}RAPID\nGOTO/0,0,60,0,0,1\nFINI\n"


def modulo(name: str = "table-ac") -> Machine:
    return parse_machine(f'like = "{name}"\n[[axis]]\nname = "C"\nmodulo = true\n')


@cache
def text_of(control: str, *, turning: bool = True, tcp: bool = True) -> list[str]:
    machine = modulo() if turning else load_machine("table-ac")
    return lines_of(choose_form(control, machine=machine, tcp=tcp), spiral())


def problems(control: str, lines: list[str], *, tcp: bool = True) -> list[str]:
    program, text = read(spiral().encode(), name="part.cls"), ("\n".join(lines) + "\n").encode()
    try:
        found = verify(program, text, tolerance=EPS, axis_length=10.0, control=control, machine=modulo(), tcp=tcp)
    except InputError as error:
        return [str(error)]
    return [f"{problem.code} {problem.text}" for problem in found.problems]


@pytest.mark.parametrize(
    ("control", "tcp"), [("siemens", True), ("siemens", False), ("heidenhain", True), ("fanuc", True), ("haas", False)]
)
def test_words_are_those_of_an_endless_axis_from_0_to_360_degrees(control: str, tcp: bool) -> None:
    word = re.compile(r" C(=DC\()?\+?(-?[\d.]+)\)?")
    endless, turning = (text_of(control, turning=which, tcp=tcp) for which in (False, True))
    assert len(endless) == len(turning) > 100
    beyond = 0
    for one, other in zip(endless, turning, strict=True):
        angles = [float(match[2]) if (match := word.search(line)) else np.nan for line in (one, other)]
        assert np.isnan(angles).all() or angles[1] == pytest.approx(angles[0] % 360.0, abs=1e-9)
        beyond += angles[0] >= 360.0
        assert word.sub("", one) == word.sub("", other)
        assert ("=DC(" in other) == (control == "siemens" and not np.isnan(angles[1]))
    assert beyond > 20
    assert problems(control, turning, tcp=tcp) == []


MUTANTS: dict[str, tuple[str, Callable[[str], str], str]] = {
    "no DC": ("siemens", lambda line: re.sub(r"=DC\(([\d.]+)\)", r"\1", line), "without DC()"),
    "another angle": ("siemens", lambda line: re.sub(r"DC\(\d", "DC(4", line), ""),
    "beyond a turn": ("siemens", lambda line: re.sub(r"DC\(\d+", "DC(361", line), "not from 0 to 360"),
    "DC of another axis": ("siemens", lambda line: re.sub(r"A([\d.]+)", r"A=DC(\1)", line), "which is for modulo axes"),
    "beyond a turn, fanuc": ("fanuc", lambda line: re.sub(r"C[\d]+\.", "C370.", line), "not from 0 to 360"),
    "below zero": ("fanuc", lambda line: re.sub(r"C[\d]+\.", "C-10.", line), "not from 0 to 360"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_wrong_words_are_found(name: str) -> None:
    control, change, expected = MUTANTS[name]
    lines = text_of(control)
    at = [k for k, line in enumerate(lines) if line.startswith("G1 ")][len(lines) // 2]
    changed = change(lines[at])
    assert changed != lines[at]
    found = problems(control, [*lines[:at], changed, *lines[at + 1 :]])
    assert any(expected in text for text in found)


def test_heidenhain_goes_the_shorter_way_under_m126_only() -> None:
    lines = [line for line in text_of("heidenhain") if not line.endswith(" M126")]
    assert any("C without M126 in force" in text for text in problems("heidenhain", lines))


@pytest.mark.parametrize(("control", "form"), [("linuxcnc", "g1"), ("generic", "g1"), ("fanuc", "g6.2")])
def test_what_has_no_shorter_way_is_refused(control: str, form: str) -> None:
    with pytest.raises(SettingsError) as refused:
        choose_form(control, form, machine=modulo())
    assert refused.value.code == "CS215"


def test_an_axis_with_limits_is_no_modulo_axis() -> None:
    with pytest.raises(SettingsError, match="a modulo axis with limits"):
        parse_machine('like = "table-ac"\n[[axis]]\nname = "A"\nmodulo = true\n')
    with pytest.raises(SettingsError, match="modulo is 1"):
        parse_machine('like = "table-ac"\n[[axis]]\nname = "C"\nmodulo = 1\n')
