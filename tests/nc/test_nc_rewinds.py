"""Rapids in which rotary axes swing a tilted tool: it goes up first, and turns there."""

from __future__ import annotations

import io
import re
from dataclasses import replace

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import Machine, load_machine
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc.rotary_words import LONGEST_DETOUR, rows_that_swing, swinging
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify

EPS = 0.01
WORD = re.compile(r"([A-Z])([-+]?[\d.]+)")


def ring(z: float, lean: float) -> list[str]:
    """Most of a turn about Z with a tool that leans outwards."""
    turn = np.radians(np.arange(0, 351, 25))
    sine, cosine = np.sin(np.radians(lean)), np.cos(np.radians(lean))
    return [
        f"GOTO/{60 * np.cos(a):.4f},{60 * np.sin(a):.4f},{z:g},"
        f"{sine * np.cos(a):.7f},{sine * np.sin(a):.7f},{cosine:.7f}"
        for a in turn.tolist()
    ]


def program_text(lean: float) -> bytes:
    """Two such turns: a table with less than two turns must turn back between them."""
    lines = ["UNITS/MM", "LOADTL/2", "SPINDL/8000,RPM,CLW", "COOLNT/ON", "RAPID", ring(20, lean)[0], "FEDRAT/500,MMPM"]
    for z in (0.0, -1.0):
        lines += [*ring(z, lean), "RAPID", ring(20, lean)[-1], "RAPID", ring(20, lean)[0], "FEDRAT/500,MMPM"]
    return ("\n".join([*lines, "FINI"]) + "\n").encode()


def short(name: str) -> Machine:
    """Machine whose first axis has less than two turns."""
    machine = load_machine(name)
    axes = tuple(replace(axis, limits=(-280.0, 280.0)) if axis.name == "C" else axis for axis in machine.axes)
    return replace(machine, axes=axes)


def text_of(control: str, machine: Machine, *, lean: float = 30.0, tcp: bool = True):
    chosen = choose_form(control, machine=machine, tcp=tcp)
    program = read(program_text(lean), name="ring.cls")
    stream = io.BytesIO()
    smoothed = smooth(program, fit_settings(Settings(tolerance=EPS), chosen, "mm"))
    written = write(smoothed, stream, form=chosen)
    return program, stream.getvalue().decode().splitlines(), {finding.code for finding in written.findings}


def problems(program, lines, control, machine, *, tcp: bool = True):
    data = ("\n".join(lines) + "\n").encode()
    return verify(program, data, tolerance=EPS, control=control, machine=machine, tcp=tcp).problems


UP = {
    "fanuc": ["G91 G28 Z0.", "G90", "G49"],
    "mitsubishi": ["G91 G28 Z0.", "G90", "G49"],
    "haas": ["G53 G0 Z0.", "G49"],
    "linuxcnc": ["M429", "G53 G0 Z0", "G49"],
    "siemens": ["TRAFOOF", "SUPA G0 Z0 D0"],
    "heidenhain": ["FUNCTION RESET TCPM", "L Z-1 R0 FMAX M91"],
}


@pytest.mark.parametrize(
    ("control", "name", "tcp"),
    [
        ("fanuc", "table-ac", True),
        ("fanuc", "head-table-bc", True),
        ("fanuc", "table-bc", False),
        ("mitsubishi", "head-ac", True),
        ("haas", "table-bc", True),
        ("linuxcnc", "xyzac-trt", True),
        ("siemens", "nutated-bc", True),
        ("heidenhain", "table-ac", True),
    ],
)
def test_the_tool_goes_up_before_an_axis_turns_back(control: str, name: str, tcp: bool) -> None:
    machine = short(name)
    program, lines, found = text_of(control, machine, tcp=tcp)
    assert "CS341" in found
    bare = [line.partition(" ")[2] for line in lines] if control == "heidenhain" else lines
    up = UP[control]
    starts = [k for k in range(len(bare)) if bare[k : k + len(up)] == up][:-1]
    assert starts
    for start in starts:
        behind = bare[start + len(up) :]
        down = next(k for k, line in enumerate(behind) if re.match(r"(G43 H\d+ )?(G0|L) X\S+ Y\S+ Z", line))
        assert not any(re.match(r"(G43 H\d+ )?G1|L .*[^X]$", line) and "FMAX" not in line for line in behind[:down])
        # under tip control a tool that leans comes down in one block; axes of the machine go over the place before
        over = [dict(WORD.findall(line)) for line in behind[:down] if re.match(r"(G0|L) X", line)]
        ends = dict(WORD.findall(behind[down]))
        assert len(over) == (not tcp)
        assert all({**place, "Z": ends["Z"]} | {k: ends[k] for k in "H" if k in ends} == ends for place in over)
        turns = [dict(WORD.findall(line)) for line in behind[:down] if re.match(r"(G0|L) [ABC]", line)]
        assert len(turns) == 1
        there = {axis: float(angle) == 0.0 for axis, angle in turns[0].items() if axis in "ABC"}
        if control in ("fanuc", "mitsubishi") and tcp:  # where tip control comes on the axes are at zero
            assert all(there.values())
        else:
            assert {axis: turns[0][axis] for axis in there} == {axis: ends[axis] for axis in there}
    assert problems(program, lines, control, machine, tcp=tcp) == ()
    first = starts[0]
    stop = next(k for k in range(first, len(bare)) if re.match(r"(G43 H\d+ )?(G0|L) X\S+ Y\S+ Z", bare[k]))
    wrong = problems(program, [*lines[:first], *lines[stop:]], control, machine, tcp=tcp)
    assert "CS537" in {problem.code for problem in wrong}


@pytest.mark.parametrize(
    ("control", "name", "how"),
    [
        ("fanuc", "g1", {"lines": "dense"}),
        ("mitsubishi", "g1", {"lines": "long"}),
        ("siemens", "g1", {}),
        ("fanuc", "g1", {"method": "global"}),
    ],
)
def test_turns_of_the_tools_before_are_left_where_the_axes_go_to_zero(
    control: str, name: str, how: dict[str, str]
) -> None:
    rings = [*ring(0, 30), "RAPID", ring(20, 30)[-1], "RAPID", ring(20, 30)[0]]
    tool = ["SPINDL/8000,RPM,CLW", "RAPID", ring(20, 30)[0], "FEDRAT/500,MMPM", *rings, *rings]
    upright = ["RAPID", "GOTO/0,0,20,0,0,1", "FEDRAT/500,MMPM", "GOTO/0,0,0", "GOTO/20,0,0"]
    cl = ["UNITS/MM", "LOADTL/2", *tool, "LOADTL/4", *upright, "LOADTL/3", *tool, "GOHOME", *tool, "FINI"]
    machine = load_machine("table-ac")
    form = choose_form(control, name, machine=machine)
    settings = fit_settings(Settings(tolerance=EPS, **how), form, "mm")
    program = read("\n".join(cl).encode(), name="rings.cls")
    stream = io.BytesIO()
    write(smooth(program, settings), stream, form=form)
    text = stream.getvalue().decode().splitlines()
    assert not problems(program, text, control, machine)
    high, first, most = True, [], 0.0
    for line in text:
        high |= re.search("G28|SUPA", line) is not None
        turn = re.search(r"^G[01] X.* C([-\d.]+)", line)
        if turn and high:
            first.append(float(turn[1]))
        high &= not turn
        most = max(most, abs(float(turn[1]))) if turn else most
    assert len(first) == 4
    if control == "siemens":  # its axes go where the next motion has them
        assert most > 1500
    else:
        assert all(abs(angle) <= 180.0 for angle in first)
        assert most < 1000


@pytest.mark.parametrize(
    ("control", "name", "machine", "how"),
    [
        ("fanuc", "g1", "table-ac", {}),
        ("haas", "g1", "table-bc", {"lines": "long"}),
        ("siemens", "g1", "head-ac", {}),
        ("fanuc", "g1", "nutated-bc", {"method": "global"}),
    ],
)
def test_a_tool_that_stays_upright_has_the_free_axis_at_zero(
    control: str, name: str, machine: str, how: dict[str, str]
) -> None:
    flat = ["RAPID", "GOTO/0,0,30,0,0,1", "FEDRAT/500,MMPM", "GOTO/0,0,0", "GOTO/20,0,0", "GOTO/20,20,0", "GOTO/0,30,0"]
    tilted = ["LOADTL/3", "RAPID", *ring(0, 30)[3:7], "GOHOME"]
    cl = ["UNITS/MM", "LOADTL/2", *flat, *tilted, *flat, "LOADTL/4", *flat, "FINI"]
    own = load_machine(machine)
    form = choose_form(control, name, machine=own)
    settings = fit_settings(Settings(tolerance=EPS, **how), form, "mm")
    program = read("\n".join(cl).encode(), name="flat.cls")
    stream = io.BytesIO()
    write(smooth(program, settings), stream, form=form)
    text = stream.getvalue().decode().splitlines()
    assert not problems(program, text, control, own)
    words = [re.search(r" C=?([-\d.]+)", line) for line in text if line[:1] in "GXB"]
    angles = [float(word[1]) for word in words if word]
    tilted = [k for k, angle in enumerate(angles) if angle]
    assert len(tilted) > 1
    assert tilted[0] > 4
    assert len(angles) - tilted[-1] > 9


def test_an_upright_tool_may_turn_where_it_is() -> None:
    machine = short("table-ac")
    program, lines, found = text_of("fanuc", machine, lean=0.0)
    assert not found & {"CS340", "CS341"}
    assert problems(program, lines, "fanuc", machine) == ()


def test_who_has_no_retract_is_warned() -> None:
    machine = short("table-ac")
    program, lines, found = text_of("generic", machine)
    assert "CS340" in found
    assert problems(program, lines, "generic", machine) == ()


def test_the_detour_of_a_table_is_that_of_its_cone() -> None:
    machine = load_machine("table-ac")
    lean = 30.0

    def apart(turn: float) -> float:
        return float(np.degrees(2 * np.arcsin(np.sin(np.radians(lean)) * np.sin(np.radians(turn / 2)))))

    for turn in (60.0, 120.0, 179.0, 250.0, 300.0, 350.0):
        detour = 2 * apart(turn / 2) - apart(turn)
        before, after = np.array([[10.0, lean]]), np.array([[10.0 - turn, lean]])
        assert swinging(machine, before, after)[0] == (detour > LONGEST_DETOUR)
    angles = np.array([[0.0, 30.0], [300.0, 30.0], [0.0, 30.0], [0.0, 0.0], [300.0, 0.0]])
    np.testing.assert_array_equal(rows_that_swing(machine, angles, np.ones(5, np.bool_)), [1, 2])
    np.testing.assert_array_equal(rows_that_swing(machine, angles, np.zeros(5, np.bool_)), [])


@pytest.mark.parametrize(("control", "limits", "said"), [("siemens", None, True), ("siemens", (0, 720), False)])
def test_words_that_a_modulo_axis_may_refuse_are_said(control: str, limits: tuple[float, float] | None, said: bool):
    machine = load_machine("table-ac")
    axes = tuple(replace(axis, limits=limits) if axis.name == "C" else axis for axis in machine.axes)
    _, _, found = text_of(control, replace(machine, axes=axes))
    assert ("CS346" in found) == said
    assert "CS346" not in text_of("fanuc", replace(machine, axes=axes))[2]
