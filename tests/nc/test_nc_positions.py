"""Home and tool-change positions of the machine's file, in the words of each control; what is elsewhere is found."""

from __future__ import annotations

import io
import re

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import Machine, machine_table, parse_machine
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from oracle.share import share

HOME = {"X": -200.0, "Y": 150.5, "Z": -0.5, "A": 0.0, "C": 10.0}
CHANGE = {"X": 0.0, "Y": 180.0, "Z": -25.0}

CL = """UNITS/MM
LOADTL/2
SPINDL/8000,RPM,CLW
COOLNT/ON
RAPID
GOTO/0,0,60,0,0,1
FEDRAT/500,MMPM
GOTO/0,0,0,0,0,1
GOTO/20,0,0,0,0.3,0.9539392
GOTO/20,30,0,0,0.5,0.8660254
RAPID
GOTO/20,30,60,0,0.5,0.8660254
LOADTL/3
SPINDL/6000,RPM,CLW
RAPID
GOTO/0,0,60,0,0,1
FEDRAT/400,MMPM
GOTO/0,0,-1,0,0,1
GOTO/30,0,-1,0,0,1
RAPID
GOTO/30,0,60,0,0,1
FINI
"""

#: retract, before a tool, and at the end
WORDS = {
    "fanuc": ("G53 G0 Z-0.5", ["G53 G0 X0. Y180.", "G53 G0 Z-25."], "G53 G0 X-200. Y150.5 A0. C10."),
    "mitsubishi": ("G53 G0 Z-0.5", ["G53 G0 X0. Y180.", "G53 G0 Z-25."], "G53 G0 X-200. Y150.5 A0. C10."),
    "haas": ("G53 G0 Z-0.5", ["G53 G0 X0. Y180.", "G53 G0 Z-25."], "G53 G0 X-200. Y150.5 A0. C10."),
    "linuxcnc": ("G53 G0 Z-0.5", ["G53 G0 X0. Y180.", "G53 G0 Z-25."], "G53 G0 X-200. Y150.5 A0. C10."),
    "siemens": ("SUPA G0 Z-0.5 D0", ["SUPA G0 X0. Y180. D0", "SUPA G0 Z-25. D0"], "SUPA G0 X-200. Y150.5 A0. C10. D0"),
    "heidenhain": (
        "L Z-0.5 R0 FMAX M91",
        ["L X+0 Y+180 R0 FMAX M91", "L Z-25 R0 FMAX M91"],
        "L X-200 Y+150.5 A+0 C+10 R0 FMAX M91",
    ),
}


def machine_of(home=HOME, change=CHANGE, like="table-ac", **more) -> Machine:
    table = {"like": like, "home": home, "tool_change": change, **more}
    return parse_machine(machine_table_of(table))


def machine_table_of(table) -> str:
    lines = [
        f'like = "{table["like"]}"',
        *(f"{key} = {table[key]}" for key in table if key not in ("like", "home", "tool_change")),
    ]
    for key in ("home", "tool_change"):
        lines += [f"[{key}]", *(f"{axis} = {value}" for axis, value in table[key].items())]
    return "\n".join(lines)


def text_of(control: str, machine: Machine, cl: str = CL):
    form = choose_form(control, machine=machine)
    program = read(cl.encode())
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(tolerance=0.02), form, program.units)), stream, form=form)
    return program, stream.getvalue().decode().splitlines()


def codes(program, lines, control: str, machine: Machine) -> set[str]:
    data = ("\n".join(lines) + "\n").encode()
    found = verify(program, data, tolerance=0.02, control=control, machine=machine)
    return {problem.code for problem in found.problems}


def bare(lines) -> list[str]:
    return [re.sub(r"^\d+ (?=\D)", "", line) for line in lines]


@pytest.mark.parametrize("control", WORDS)
def test_the_axes_go_where_the_file_says(control: str) -> None:
    machine = machine_of()
    program, lines = text_of(control, machine)
    up, change, home = WORDS[control]
    plain = bare(lines)
    assert codes(program, lines, control, machine) == set()
    assert plain.count(up) == 3
    for number in (2, 3):
        at = next(k for k, line in enumerate(plain) if re.match(rf"T{number}\b|TOOL CALL {number} ", line))
        assert plain[at - 2 : at] == change
    ends = plain.index(home)
    assert up in plain[ends - 4 : ends]
    assert plain[ends + 1] in ("M30", "M2")
    # another control's file asks for nothing: the words are then not on the list
    assert codes(program, lines, control, parse_machine(machine_table("table-ac"))) & {"CS571", "CS503"}


@pytest.mark.parametrize("control", share(["fanuc", "siemens", "heidenhain"], 2))
def test_what_is_elsewhere_is_found(control: str) -> None:
    machine = machine_of()
    program, lines = text_of(control, machine)
    plain = bare(lines)
    up, change, home = WORDS[control]
    for block, others in ((up, None), (change[0], "Y"), (change[1], None), (home, "Y"), (home, "C")):
        at = len(plain) - 1 - plain[::-1].index(block)
        without = [*lines[:at], *lines[at + 1 :]]
        assert codes(program, without, control, machine) & {"CS583", "CS571", "CS572", "CS532", "CS533"}, block
        for old, new in (
            ((r"(?<=Z)-\d+", "-3"), (r"(?<=[XY])[-+]?1\d+", "7"))
            if others is None
            else ((rf"(?<={others})[-+]?\d+", "7"),)
        ):
            wrong = [*lines[:at], re.sub(old, new, lines[at]), *lines[at + 1 :]]
            if wrong != lines:
                assert "CS583" in codes(program, wrong, control, machine), wrong[at]


def test_the_end_that_is_spelt_as_a_path_is_at_home_too() -> None:
    machine = machine_of()
    program, lines = text_of("heidenhain", machine)
    path = [re.sub(r"^(\d+ )M30$", r"\1L M30", line) for line in lines]
    assert path != lines
    assert codes(program, path, "heidenhain", machine) == set()
    home = WORDS["heidenhain"][2]
    assert "CS583" in codes(program, [line for line in path if home not in line], "heidenhain", machine)


def test_inches() -> None:
    machine = machine_of({"X": -254.0, "Z": -12.7}, {"Y": 25.4})
    program, lines = text_of("fanuc", machine, CL.replace("UNITS/MM", "UNITS/INCHES").replace("MMPM", "IPM"))
    assert {"G53 G0 Z-0.5", "G53 G0 Y1.", "G53 G0 X-10."} <= set(lines)
    assert codes(program, lines, "fanuc", machine) == set()


def test_rotary_axes_stand_at_zero_where_home_says_nothing_of_them() -> None:
    machine = machine_of({"X": -10.0}, {})
    program, lines = text_of("fanuc", machine)
    assert lines[-4:] == ["G53 G0 X-10.", "G0 A0.0000 C0.0000", "M30", "%"]
    assert "G91 G28 Z0." in lines
    assert codes(program, lines, "fanuc", machine) == set()


def test_a_height_of_tool_changes_alone_leaves_the_retract_to_the_control() -> None:
    machine = machine_of({}, {"Z": -25.0})
    program, lines = text_of("haas", machine)
    assert [line for line in lines if "G53" in line] == [
        *("G53 G0 Z0.", "G53 G0 Z-25."),
        *("G53 G0 Z0.", "G53 G0 Z-25."),
        "G53 G0 Z0.",
    ]
    assert codes(program, lines, "haas", machine) == set()


def test_a_control_without_such_words_is_told_nothing() -> None:
    machine = machine_of()
    program, lines = text_of("generic", machine)
    assert not any("G53" in line for line in lines)
    assert codes(program, lines, "generic", machine) == set()


@pytest.mark.parametrize(
    ("home", "more", "says"),
    [
        ({"B": 0.0}, {}, "unknown key home.B; known keys are X, Y, Z, A, C"),
        ({"X": '"far"'}, {}, "home.X is 'far'; give a number"),
        ({"A": 300.0}, {}, "home: A is 300"),
        ({"X": 300.0}, {"travel": "{ X = [-200, 200] }"}, "home: X is 300"),
    ],
)
def test_positions_that_no_axis_goes_to(home, more, says: str) -> None:
    with pytest.raises(SettingsError) as error:
        machine_of(home, {}, **more)
    assert says in f"{error.value.what}; {error.value.hint}"
