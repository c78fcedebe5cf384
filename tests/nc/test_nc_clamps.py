"""Clamps of rotary axes: let go before they turn, held while holes are cycles and at the end."""

from __future__ import annotations

import re

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import parse_machine
from cornersmooth.nc import Frame, choose_form
from cornersmooth.verify import verify
from nc.writing import lines_of
from oracle.share import share

MACHINE = parse_machine(
    'like = "table-bc"\n[[axis]]\nname = "B"\nclamp = ["M12", "M13"]\n[[axis]]\nname = "C"\nclamp = ["M10", "M11"]\n'
)
#: a tilted tool, a tap along Z, a tilted tool
CL = """UNITS/MM
LOADTL/1
SPINDL/2000,RPM,CLW
RAPID
GOTO/0,0,30,0.28,0,0.96
FEDRAT/MMPM,300
GOTO/0,0,0
GOTO/9,1,0,0.28,0.1,0.95
RAPID
GOTO/0,0,60,0.28,0,0.96
LOADTL/3
SPINDL/500,RPM,CLW
RAPID
GOTO/20,5,30,0,0,1
CYCLE/TAP,FEDTO,15,MMPM,500,RAPTO,5
GOTO/20,5,1
CYCLE/OFF
RAPID
GOTO/20,5,30
LOADTL/1
SPINDL/2000,RPM,CLW
RAPID
GOTO/0,0,30,0.28,0.1,0.95
GOTO/0,0,60
FINI
"""
CONTROLS = ("haas", "fanuc", "siemens", "heidenhain", "generic")


def cl_of(control: str) -> str:
    """Without the tap where the control is given no cycles."""
    tap = CL[CL.index("CYCLE/TAP") : CL.index("CYCLE/OFF")]
    return CL.replace(tap, "") if control == "generic" else CL


def text_of(control: str) -> list[str]:
    return lines_of(choose_form(control, machine=MACHINE), cl_of(control), frame=Frame(skip_cycles=False))


def problems(control: str, lines: list[str]) -> list[str]:
    text = ("\n".join(lines) + "\n").encode()
    program = read(cl_of(control).encode(), name="part.cls")
    found = verify(program, text, tolerance=0.05, axis_length=10.0, control=control, machine=MACHINE)
    return [f"{problem.code} {problem.text}" for problem in found.problems]


def without_numbers(lines: list[str]) -> list[str]:
    return [re.sub(r"^\d+ ", "", line) for line in lines]


@pytest.mark.parametrize("control", CONTROLS)
def test_axes_are_free_where_they_turn_and_held_in_cycles_and_at_the_end(control: str) -> None:
    lines = text_of(control)
    held, said = True, []
    for line in without_numbers(lines):
        if re.fullmatch(r"M1[0-3]", line):
            held = line in ("M10", "M12")
            said.append(line)
        elif re.search(r" B[-+]?[1-9]", line):
            assert not held, line
        elif re.search(r"G84 |CYCLE84|M99", line):
            assert held, line
    assert held
    cycle = ["M10", "M12", "M11", "M13"] if control != "generic" else []
    assert said == ["M11", "M13", *cycle, "M10", "M12"]
    assert problems(control, lines) == []


@pytest.mark.parametrize("control", share(CONTROLS[:4], 2))
def test_a_clamp_word_too_few_is_found(control: str) -> None:
    lines = text_of(control)
    places = [k for k, line in enumerate(without_numbers(lines)) if re.fullmatch(r"M1[0-3]", line)]
    assert len(places) == 8
    for k in places:
        assert any(text.startswith("CS538") for text in problems(control, [*lines[:k], *lines[k + 1 :]])), lines[k]


def test_what_is_no_pair_of_m_words_is_refused() -> None:
    for given in ('"M10"', '["M10"]', '["M10", "G1"]', '["M10", 11]'):
        with pytest.raises(SettingsError, match="clamp is"):
            parse_machine(f'like = "table-bc"\n[[axis]]\nname = "C"\nclamp = {given}\n')


def test_auxfun_of_a_clamp_is_left_to_the_file_of_the_machine() -> None:
    cl = CL.replace("FEDRAT/MMPM,300", "AUXFUN/11\nAUXFUN/71\nFEDRAT/MMPM,300").replace("FINI", "AUXFUN/10\nFINI")
    form, frame = choose_form("haas", machine=MACHINE), Frame(skip_cycles=False)
    lines, plain = lines_of(form, cl, frame=frame), lines_of(form, CL, frame=frame)
    assert {"(AUXFUN/11)", "M71", "(AUXFUN/10)"} <= set(lines)
    assert [lines.count(word) for word in ("M10", "M11")] == [plain.count(word) for word in ("M10", "M11")]
    how = {"tolerance": 0.05, "axis_length": 10.0, "control": "haas", "machine": MACHINE}
    program = read(cl.encode())
    assert verify(program, ("\n".join(lines) + "\n").encode(), **how).problems == ()
    without = [line for line in lines if line != "M71"]
    found = verify(program, ("\n".join(without) + "\n").encode(), **how)
    assert [problem.text for problem in found.problems] == ["M71 is missing"]
