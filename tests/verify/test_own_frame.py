"""What a text of our own promises around the motion: each of its blocks that is lost or changed is found."""

import io
import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from cornersmooth import Verdict, Verification, read, verify
from cornersmooth.errors import InputError, command_text
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, choose_form, load_control
from cornersmooth.pipeline import postprocess
from cornersmooth.report.verdict import judge
from cornersmooth.settings import Settings
from oracle.files import SAMPLES
from oracle.share import covering_share, how_many, share_of_kinds

MACHINES = {
    "fanuc": "table-ac",
    "mitsubishi": "table-ac",
    "haas": "table-bc",
    "siemens": "table-ac",
    "heidenhain": "table-ac",
    "linuxcnc": "xyzac-trt",
    "generic": "table-ac",
}

#: angles of a block
_TURN = re.compile(r"[AB]\S+ C\S+")

TILTED = b"""LOAD/TOOL,6
SPINDL/RPM,6000,CLW
COOLNT/FLOOD
RAPID
GOTO/0.0000,0.0000,80.0000,0.2588190,0.2588190,0.9305700
GOTO/9.0000,0.0000,70.0000
"""

#: controls with a retract
_HIGH = MACHINES.keys() - {"generic"}

#: what is said of a part that is not as it was written
CHANGED = "changed since the program was written"

#: a block, what becomes of it, and what is said
_MUTANTS: dict[str, tuple[str, Callable[[str], str] | None, str]] = {
    "spindle on at a tool change": (r"M5", None, CHANGED),
    "coolant on at a tool change": (r"M9", None, CHANGED),
    "another work offset": (
        r"G54|CYCL DEF 247.*",
        lambda block: block.replace("G54", "G55").replace("+1", "+2"),
        f"{CHANGED}|holds for the whole program",
    ),
    "axes not turned": (
        r"(G0|L) [AB]\S+ C\S+( FMAX)?",
        None,
        f"{CHANGED}|without the rotary axes at zero",
    ),
    "not over the place": (r"(G0|L) X\S+ Y\S+ [AB]\S+ C\S+( FMAX)?", None, CHANGED),
    "transformation of the program before": (r"TRAFOOF", None, f"{CHANGED}|TRAORI"),
    "tilted plane of the program before": (r"PLANE RESET STAY", None, CHANGED),
    "length on at a tool change": (r"G49", None, f"{CHANGED}|G43|G234"),
}

_FOUND_IN = {
    "transformation of the program before": {"siemens"},
    "tilted plane of the program before": {"heidenhain"},
    "another work offset": _HIGH,
    "axes not turned": _HIGH,
    "not over the place": _HIGH,
    "length on at a tool change": {"fanuc", "mitsubishi", "haas", "linuxcnc"},
}


def _how(control: str) -> dict[str, object]:
    return {"control": control, "machine": load_machine(MACHINES[control]), "tolerance": 0.01, "axis_length": 10.0}


@cache
def _program():
    """The sample, whose last tool stands upright, with one more that does not: its axes must go back at the end."""
    data = (SAMPLES / "two_tools.cls").read_bytes().replace(b"END-OF-PATH\nFINI", TILTED + b"END-OF-PATH\nFINI")
    assert TILTED in data
    return read(data, name="two_tools.cls")


@cache
def _text(control: str, offset: str | None = None) -> str:
    settings = Settings(tolerance=0.01, axis_length=10.0, lines="long")
    form = choose_form(load_control(control), None, machine=load_machine(MACHINES[control]))
    stream = io.BytesIO()
    postprocess(_program(), stream, settings, form=form, frame=Frame(work_offset=offset))
    return stream.getvalue().decode("ascii")


def _said(found: Verification) -> list[str]:
    """What is wrong, and what was changed."""
    changed = [text for text in found.unverified.split("; ") if CHANGED in text]
    return [*(problem.text for problem in found.problems), *changed]


def _problems(control: str, lines: list[str]) -> list[str]:
    return _said(verify(_program(), ("\n".join(lines) + "\n").encode(), **_how(control)))


@pytest.mark.parametrize(
    ("control", "mutant"),
    covering_share(
        ((control, name) for control in MACHINES for name in _MUTANTS if control in _FOUND_IN.get(name, {control})), 2
    ),
)
def test_a_block_of_the_frame_that_is_lost_or_changed_is_found(control: str, mutant: str) -> None:
    pattern, changed, said = _MUTANTS[mutant]
    lines = _text(control).splitlines()
    places = [k for k, line in enumerate(lines) if re.fullmatch(rf"(\d+ )?({pattern})", line)]
    assert places
    for k in share_of_kinds(places, lambda place: place == places[-1], len(places)):  # the first, and the last
        turn = _TURN.search(lines[k])
        before = [found[0] for found in map(_TURN.search, lines[:k]) if found]
        if mutant == "axes not turned" and turn and before[-1:] == [turn[0]]:
            continue  # they stand there
        block = [changed(lines[k])] if changed else []
        problems = _problems(control, [*lines[:k], *block, *lines[k + 1 :]])
        assert any(re.search(said, text) for text in problems), (lines[k], problems)


@pytest.mark.parametrize(
    ("control", "offset", "other"),
    covering_share(
        [
            ("fanuc", "G55", "G54"),
            ("fanuc", "G54.1 P48", "G54.1 P47"),
            ("mitsubishi", "G54.1 P3", "G54"),
            ("haas", "G154 P20", "G154 P2"),
            ("siemens", "G55", "G54"),
            ("siemens", "G599", "G505"),
            ("heidenhain", "2", "1"),
            ("linuxcnc", "G59.3", "G59.1"),
        ],
        8,
    ),
)
def test_a_text_with_another_work_offset_says_so(control: str, offset: str, other: str) -> None:
    text = _text(control, offset)
    assert f"OFFSET={offset.replace(' ', '_')}" in text
    lines = text.splitlines()
    assert not _problems(control, lines)
    block = f"CYCL DEF 247 DATUM SETTING Q339=+{offset}" if control == "heidenhain" else offset
    said = re.compile(rf"(\d+ )?{re.escape(block)}")
    back = [line.removesuffix(offset) + other if said.fullmatch(line) else line for line in lines]
    problems = _problems(control, back)
    command = command_text(["cornersmooth", "smooth", "--work-offset", other])
    assert any(
        problem.endswith(f"was made for {offset}; to run it there, write it with: {command}") for problem in problems
    )


def test_tip_control_at_other_angles_has_its_reason() -> None:
    lines = _text("fanuc").splitlines()
    zero = next(number for number, line in enumerate(lines) if line.startswith("G0 A0."))
    assert lines[zero + 1].startswith("G43.4")
    del lines[zero]
    found = verify(_program(), ("\n".join(lines) + "\n").encode(), **_how("fanuc"))
    what, hint = next(problem.text.split("; ") for problem in found.problems if "at zero" in problem.text)
    assert what == "G43.4 without the rotary axes at zero before it"
    assert "WKP = 0" in hint
    assert judge(found).text.startswith(f"FAILED: 1 problem, first in NC line {zero + 1}: {what}; not verified")


#: one tool, cut once: what is lost is said nowhere else
_ONE_TOOL = """UNITS/MM
LOADTL/1
SPINDL/3000,RPM,CLW
RAPID
GOTO/0,0,60,0.1,0.2,0.97468
FEDRAT/800,MMPM
GOTO/0,0,0,0.1,0.2,0.97468
GOTO/10,2,0,0.15,0.2,0.96825
GOTO/20,0,1,0.2,0.15,0.96825
RAPID
GOTO/20,0,60,0.2,0.15,0.96825
FINI
"""


@pytest.mark.parametrize(
    ("control", "form", "machine", "tcp", "block", "left"),
    [
        ("siemens", None, None, True, "D1", ""),
        ("siemens", None, "table-ac", True, "D1", ""),
        ("siemens", None, "head-ac", False, "D1", ""),
        ("siemens", None, None, True, "ORIWKS ORIVECT", ""),
        ("siemens", None, None, True, "ORIWKS ORIVECT", "ORIWKS"),
        ("siemens", None, "table-ac", True, "ORIMKS ORIAXES", "ORIAXES"),
        ("heidenhain", None, "table-ac", True, "M126", ""),
        ("heidenhain", None, "head-ac", True, "M126", ""),
        ("fanuc", "g6.2", None, True, "G43 H1.*", ""),
        ("fanuc", None, "table-ac", True, "G0 A0.* C0.*", "G0 C0.0000"),
        ("mitsubishi", None, "table-ac", True, "G0 A0.* C0.*", "G0 A0.0000"),
        ("fanuc", None, None, True, "O0001", "O0000"),
        ("mitsubishi", None, None, True, "T1 M6", "T1 M6 M6"),
        ("fanuc", None, None, True, "G0 X0.0.* Y0.0.* I.*", "G-0 X0. Y0. I0.0999999 J0.1999999 K0.9746795"),
        ("linuxcnc", None, "xyzac-trt", True, "M5", "M+5"),
    ],
)
def test_what_the_only_tool_of_a_text_needs_is_found_where_it_is_lost(
    control: str, form: str | None, machine: str | None, tcp: bool, block: str, left: str
) -> None:
    """Tool edge, meaning and ways of rotary words, length of the tool, one of two axes that go to zero."""
    chosen = choose_form(control, form, machine=machine and load_machine(machine), tcp=tcp)
    stream = io.BytesIO()
    postprocess(_ONE_TOOL.encode(), stream, Settings(tolerance=0.05), form=chosen)
    how = {"control": control, "machine": chosen.machine, "tcp": tcp, "tolerance": 0.05}
    program, text = read(_ONE_TOOL.encode()), stream.getvalue()
    assert verify(program, text, **how).verdict is Verdict.PASSED
    lines = text.decode().splitlines()
    at = next(k for k, line in enumerate(lines) if re.fullmatch(rf"(\d+ )?{block}", line))
    lines[at : at + 1] = [left] if left else []
    assert verify(program, "\n".join(lines).encode(), **how).verdict in (Verdict.FAILED, Verdict.NOT_VERIFIED)


@pytest.mark.parametrize(
    ("control", "machine", "on"),
    [("fanuc", None, "G43.5 H1"), ("mitsubishi", None, "G43.5 H1"), ("haas", "table-ac", "G234 H1")],
)
def test_late_tip_control_and_an_end_in_incremental_words_are_found(control: str, machine: str | None, on: str) -> None:
    form, stream = choose_form(control, machine=machine and load_machine(machine)), io.BytesIO()
    postprocess(_ONE_TOOL.encode(), stream, Settings(tolerance=0.05), form=form)
    lines = stream.getvalue().decode().splitlines()
    at = lines.index(on)
    said = [f"{on.split()[0]} must be in force"]
    mutants = [([*lines[:at], lines[at + 1], on, *lines[at + 2 :]], said)]
    if "G91 G28 Z0." in lines:
        last = max(k for k, line in enumerate(lines) if line == "G90")
        mutants.append(([*lines[:last], *lines[last + 1 :]], [CHANGED]))
    for changed, said in mutants:
        text, how = "\n".join(changed).encode(), {"control": control, "machine": form.machine, "tolerance": 0.05}
        found = _said(verify(read(_ONE_TOOL.encode()), text, **how))
        assert all(any(end in problem for problem in found) for end in said), found


@pytest.mark.parametrize("control", sorted(_HIGH))
def test_a_first_retract_that_is_lost_is_found_without_a_tool_change(control: str) -> None:
    cl = _ONE_TOOL.replace("LOADTL/1\n", "").encode()
    form, stream = choose_form(control, machine=load_machine(MACHINES[control])), io.BytesIO()
    postprocess(cl, stream, Settings(tolerance=0.05), form=form)
    lines, how = stream.getvalue().decode().splitlines(), {"control": control, "machine": form.machine}
    up = next(k for k, line in enumerate(lines) if re.search("G28 Z|G53 G0 Z|SUPA|M91", line))
    for text, said in ((lines, False), ([*lines[:up], *lines[up + 1 :]], True)):
        found = _said(verify(read(cl), "\n".join(text).encode(), tolerance=0.05, **how))
        assert any(CHANGED in text for text in found) == said
        assert said or not found


@pytest.mark.parametrize("control", [*MACHINES])
def test_what_a_stop_ends_and_nothing_says_again_is_found(control: str) -> None:
    cl = _ONE_TOOL.replace("GOTO/20,0,1", "OPSTOP\nGOTO/20,0,1").replace("RPM,CLW", "RPM,CLW\nCOOLNT/ON")
    form, stream = choose_form(control, machine=load_machine(MACHINES[control])), io.BytesIO()
    postprocess(cl.encode(), stream, Settings(tolerance=0.05), form=form)
    lines = stream.getvalue().decode().splitlines()
    stop = next(k for k, line in enumerate(lines) if re.fullmatch(r"(\d+ )?M1", line))
    for words in (("M3",), ("M8",), ("M3", "M8")):
        again = [next(k for k in range(stop, len(lines)) if re.search(rf"\b{word}\b", lines[k])) for word in words]
        text = "\n".join(line for k, line in enumerate(lines) if k not in again).encode()
        found = verify(read(cl.encode()), text, control=control, machine=form.machine, tolerance=0.05)
        (said,) = [text for text in _said(found) if CHANGED in text]
        first, last = map(int, re.findall(r"\d+", said))
        assert first <= stop + 2 <= last


@pytest.mark.parametrize("control", sorted(_FOUND_IN["length on at a tool change"]))
def test_a_length_that_is_taken_off_before_the_retract_is_found(control: str) -> None:
    lines = _text(control).splitlines()
    off = lines.index("G49")
    up = max(k for k in range(off) if re.fullmatch(r"G91 G28 Z0\.|G53 G0 Z0\.?", lines[k]))
    changed = [*lines[:up], "G49", *lines[up:off], *lines[off + 1 :]]
    assert any(CHANGED in text for text in _problems(control, changed))


@pytest.mark.parametrize(
    ("control", "off", "up"),
    [("siemens", "TRAFOOF", "SUPA G0 Z0 D0"), ("heidenhain", r"\d+ FUNCTION RESET TCPM", r"\d+ L Z-1 R0 FMAX M91")],
)
def test_a_retract_under_tip_control_is_found(control: str, off: str, up: str) -> None:
    lines = _text(control).splitlines()
    places = [k for k in range(9, len(lines)) if re.fullmatch(off, lines[k]) and re.fullmatch(up, lines[k + 1])]
    assert len(places) > 1
    for k in places:
        problems = _problems(control, [*lines[:k], lines[k + 1], lines[k], *lines[k + 2 :]])
        (said,) = [text for text in problems if CHANGED in text]
        assert any(" under " in text for text in problems)
        first, last = map(int, re.findall(r"\d+", said))
        assert CHANGED in said
        assert first <= k + 1 <= last


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi", "siemens"])
def test_rotary_axes_that_turn_under_tip_control_behind_the_last_retract_are_found(control: str) -> None:
    lines = _text(control).splitlines()
    off = max(k for k, line in enumerate(lines) if re.fullmatch("G49|TRAFOOF", line))
    turn = next(k for k in range(off, len(lines)) if re.match(r"G0 [ABC]", lines[k]))
    changed = [*lines[:off], *lines[off + 1 : turn + 1], lines[off], *lines[turn + 1 :]]
    assert any(CHANGED in text for text in _problems(control, changed))


def test_another_name_at_the_end_than_at_the_beginning_is_found() -> None:
    lines = _text("heidenhain").splitlines()
    for name, other in (("CORNERSMOOTH", "2"), (" MM", " INCH")):
        changed = lines[-1].replace(name, other)
        assert changed != lines[-1]
        problems = _problems("heidenhain", [*lines[:-1], changed])
        assert [text.split(" ends ")[0] for text in problems] == [re.sub(r"^\d+ ", "", changed)]


@pytest.mark.parametrize("control", MACHINES)
def test_texts_that_do_not_say_how_they_were_made_have_their_own_habits(control: str) -> None:
    lines = [line for line in _text(control).splitlines() if "CORNERSMOOTH 0" not in line]
    kept = [line for line in lines if not re.fullmatch(r"(\d+ )?M[59]", line)]
    assert len(kept) < len(lines)
    assert not any("under M" in problem or "M3 still holds" in problem for problem in _problems(control, kept))


def test_a_second_shorter_way_and_a_second_offset_are_harmless() -> None:
    for control, block in (("heidenhain", "M126"), ("fanuc", "G54"), ("haas", "G54"), ("linuxcnc", "G54")):
        lines = _text(control).splitlines()
        second = [k for k, line in enumerate(lines) if re.fullmatch(rf"(\d+ )?{block}", line)][1]
        assert not _problems(control, [*lines[:second], *lines[second + 1 :]])


def test_tip_control_that_pauses_in_a_cut_needs_no_turn_before_it() -> None:
    """Heidenhain takes a new speed without FUNCTION TCPM only; the next motion is a cut in which the axes turn."""
    cl = (
        "LOADTL/1\nSPINDL/1000,RPM,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nFEDRAT/100,MMPM\nGOTO/0,0,0,0,0,1\n"
        "SPINDL/2000,RPM,CLW\nGOTO/20,0,0,0,0.1,0.99498744\nGOTO/40,0,0,0,0.1,0.99498744\nSPINDL/OFF\nFINI\n"
    )
    form = choose_form(load_control("heidenhain"), None, machine=load_machine("table-ac"))
    result = postprocess(cl.encode(), io.BytesIO(), Settings(tolerance=0.01, axis_length=10.0), form=form)
    assert result.verification is not None
    assert result.verification.passed


#: a hole along Z, one in a tilted plane, and one along Z again
_PLANES = (
    "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\n"
    + "".join(
        f"RAPID\nGOTO/0,0,60,{axis}\nCYCLE/DRILL,FEDTO,9,MMPM,200,RAPTO,3,RTRCTO,25\nGOTO/0,0,0,{axis}\nCYCLE/OFF\n"
        f"RAPID\nGOTO/0,0,60,{axis}\n"
        for axis in ("0,0,1", "0.6,0,0.8", "0,0,1")
    )
    + "SPINDL/OFF\nFINI\n"
)


@pytest.mark.parametrize(
    ("control", "block", "which", "said"),
    [
        ("fanuc", "G69", 0, CHANGED),
        ("haas", "G255", 0, CHANGED),
        ("siemens", "CYCLE800()", 0, CHANGED),
        ("siemens", "D1", 1, "cutting edge: it must come after SUPA"),
        ("heidenhain", "PLANE RESET STAY", 0, CHANGED),
        (
            "siemens",
            f'CYCLE800(0,"",0,57{",0" * 3}{",0.000000" * 3},0,0,0,-1)',
            1,
            "no word says where the rotary axes",
        ),
        ("heidenhain", "PLANE SPATIAL SPA+0.0000 SPB+0.0000 SPC+0.0000 TURN FMAX", 1, "no word says where"),
        ("fanuc", "G53.1", 2, "before the tool is turned to it"),
        ("fanuc", "G0 A0.0000 C0.0000", 0, CHANGED),
        ("mitsubishi", "G0 A0.0000 C0.0000", 0, CHANGED),
        ("siemens", "G0 A0.000000 C0.000000", 0, CHANGED),
        ("heidenhain", "L A+0.0000 C+0.0000 FMAX", 0, CHANGED),
        ("fanuc", "T1 M6", 0, "tool T1"),  # its holes belong to no tool then
        ("siemens", "M6", 0, "tool T1"),
    ],
)
def test_what_planes_need_around_them_is_found_where_it_is_lost(
    control: str, block: str, which: int, said: str
) -> None:
    form = choose_form(load_control(control), None, machine=load_machine(MACHINES[control]), planes=True)
    stream = io.BytesIO()
    postprocess(
        _PLANES.encode(), stream, Settings(tolerance=0.01, axis_length=10.0), form=form, frame=Frame(cycles="native")
    )
    lines = stream.getvalue().decode("ascii").splitlines()
    at = [k for k, line in enumerate(lines) if re.sub(r"^\d+ ", "", line) == block][which]
    text = "\n".join([*lines[:at], *lines[at + 1 :], ""]).encode()
    found = verify(read(_PLANES.encode(), name="planes.cls"), text, **_how(control))
    assert any(said in text.replace("\\", "") for text in _said(found)), found.problems


@pytest.mark.parametrize("control", ["fanuc", "mitsubishi", "siemens", "haas"])
def test_rotary_axes_that_are_sent_nowhere_without_tip_control_are_found(control: str) -> None:
    """With a tool along Z no motion names them: a block before the first sends them all."""
    machine, stream = load_machine("table-bc"), io.BytesIO()
    form = choose_form(load_control(control), None, machine=machine, tcp=False, planes=True)
    holes = "".join(
        f"LOADTL/{tool}\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,0,60,{axis}\nCYCLE/DRILL,FEDTO,9,MMPM,200,RAPTO,3\n"
        f"GOTO/0,0,0,{axis}\nCYCLE/OFF\n"
        for tool, axis in enumerate(("0,0,1", "0.6,0,0.8"), 1)
    )
    program = read(f"UNITS/MM\n{holes}SPINDL/OFF\nFINI\n".encode(), name="two.cls")
    postprocess(program, stream, Settings(tolerance=0.01), form=form, frame=Frame(cycles="native"))
    lines = stream.getvalue().decode("ascii").splitlines()
    first = next(k for k, line in enumerate(lines) if re.fullmatch(r"G0 B0\.0+ C0\.0+", line))
    for left in ([], ["G0 B0.0"], [lines[first]]):
        text = "\n".join([*lines[:first], *left, *lines[first + 1 :], ""]).encode()
        found = verify(program, text, control=control, machine=machine, tcp=False, tolerance=0.01)
        assert any(CHANGED in text for text in _said(found)) == (left != [lines[first]])
        assert not found.problems


@pytest.mark.parametrize("control", MACHINES)
def test_rotary_axes_sent_to_zero_right_before_a_cycle_of_the_control_are_seen(control: str) -> None:
    """Heidenhain's L A0 C0 is a motion block like those that follow it, and read with them."""
    machine, stream = load_machine(MACHINES[control]), io.BytesIO()
    cl = "UNITS/MM\nLOADTL/1\nRAPID\nGOTO/0,0,60\nCYCLE/DRILL,FEDTO,9,MMPM,200,RAPTO,3\nGOTO/0,0,0\nCYCLE/OFF\nFINI\n"
    form = choose_form(control, machine=machine)
    done = postprocess(cl.encode(), stream, Settings(tolerance=0.05), form=form, frame=Frame(cycles="native"))
    assert done.verification is not None
    assert done.verification.passed


def test_a_tool_without_direction_on_the_way_back_is_a_problem() -> None:
    """U V W at the tip itself: an axis of no length has no straight back."""
    form, program, stream = choose_form("fanuc", "g6.2"), read(_ONE_TOOL.encode()), io.BytesIO()
    postprocess(_ONE_TOOL.encode(), stream, Settings(tolerance=0.05), form=form)
    lines = stream.getvalue().decode().splitlines()
    for k, line in enumerate(lines):
        if line.startswith(("G43", "G0 X")):
            lines[k] = re.sub(r"X(\S+) Y(\S+) Z(\S+) U.*", r"X\1 Y\2 Z\3 U\1 V\2 W\3", line)
    assert not verify(program, "\n".join(lines).encode(), control="fanuc", tolerance=0.05).passed


def test_a_new_speed_under_tcpm_is_found() -> None:
    cl = (
        "LOADTL/1\nSPINDL/1000,RPM,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nFEDRAT/100,MMPM\nGOTO/0,0,0,0,0,1\n"
        "SPINDL/2000,RPM,CLW\nGOTO/20,0,0,0,0.1,0.99498744\nGOTO/40,0,0,0,0.1,0.99498744\nSPINDL/OFF\nFINI\n"
    )
    form = choose_form(load_control("heidenhain"), None, machine=load_machine("table-ac"))
    stream = io.BytesIO()
    postprocess(cl.encode(), stream, Settings(tolerance=0.01, axis_length=10.0), form=form)
    lines = stream.getvalue().decode("ascii").splitlines()
    at = next(k for k, line in enumerate(lines) if line.endswith("FUNCTION RESET TCPM"))
    assert lines[at + 1].endswith("TOOL CALL Z S2000")
    text = "\n".join([*lines[:at], *lines[at + 1 :], ""]).encode()
    found = verify(read(cl.encode(), name="speed.cls"), text, **_how("heidenhain"))
    assert any("TOOL CALL Z S2000 under FUNCTION TCPM" in problem.text for problem in found.problems)


@pytest.mark.parametrize("control", ["fanuc", "haas", "linuxcnc"])
def test_a_length_that_is_switched_off_in_a_cut_is_found_in_texts_with_cycles(control: str) -> None:
    """Other words for the length may change from tool to tool there; none cuts with it off."""
    cl = (
        "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/10,10,50,0,0,1\nCYCLE/DRILL,FEDTO,8,MMPM,180,RAPTO,3\n"
        "GOTO/10,10,0\nCYCLE/OFF\nRAPID\nGOTO/10,10,50\nLOADTL/2\nSPINDL/3000,RPM,CLW\nRAPID\nGOTO/0,0,60,0.1,0.2,0.97468\n"
        "FEDRAT/800,MMPM\nGOTO/0,0,0,0.1,0.2,0.97468\nGOTO/10,2,0,0.15,0.2,0.96825\nGOTO/20,0,1,0.2,0.15,0.96825\nFINI\n"
    )
    machine = load_machine("table-ac")
    form, stream = choose_form(control, machine=machine, tcp=False), io.BytesIO()
    postprocess(cl.encode(), stream, Settings(tolerance=0.05), form=form, frame=Frame(cycles="native"))
    how = {"control": control, "machine": machine, "tcp": False, "tolerance": 0.05}
    program, lines = read(cl.encode()), stream.getvalue().decode().splitlines()
    assert verify(program, stream.getvalue(), **how).passed
    cuts = [k for k, line in enumerate(lines) if line.startswith("G1") and "A" in line]
    lines.insert(cuts[len(cuts) // 2], "G49")
    assert not verify(program, "\n".join(lines).encode(), **how).passed


@pytest.mark.parametrize("words", ["", " I0. J0.", " I5. J0."])
def test_a_circle_without_a_centre_that_fits_is_no_line(words: str) -> None:
    """G1 that has become G2: nothing about which to turn, or ends that are not as far from it."""
    cl = "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,0,50\nFEDRAT/300,MMPM\nGOTO/0,0,0\nGOTO/20,0,0\nFINI\n"
    form, stream = choose_form("fanuc", machine=load_machine("table-ac")), io.BytesIO()
    postprocess(cl.encode(), stream, Settings(tolerance=0.05), form=form)
    how = {"control": "fanuc", "machine": form.machine, "tolerance": 0.05}
    program, lines = read(cl.encode()), stream.getvalue().decode().splitlines()
    assert verify(program, stream.getvalue(), **how).passed
    at = next(k for k, line in enumerate(lines) if line.startswith("G1 X20."))
    lines[at] = lines[at].replace("G1", "G2") + words
    assert "CS520" in {problem.code for problem in verify(program, "\n".join(lines).encode(), **how).problems}


#: blocks that change nothing where they are said again, stops that nobody asked for, shares of ε that are compared
_HOLDS = r"M1|G54|M126|ORIMKS ORIAXES|G64 P\S+ Q0"


@pytest.mark.parametrize("control", MACHINES)
def test_each_block_around_the_cuts_that_is_lost_is_found(control: str) -> None:
    lines = _text(control).splitlines()
    plain = [re.sub(r"^\d+ ", "", line) for line in lines]
    places = [
        k
        for k, block in enumerate(plain)
        if not re.match(r"[(;%]|G[123] |LN? .*[XYZ].* F\d|LN? .*[XYZ][^F]*$|CR ", block)
        and not (re.fullmatch(_HOLDS, block) and (block in plain[:k] or not block.startswith("G5")))
    ]
    assert len(places) > 20
    rng = np.random.default_rng(len(places))
    for k in rng.permutation(places)[: how_many(6, len(places))].tolist():
        try:
            found = _problems(control, [*lines[:k], *lines[k + 1 :]])
        except InputError:
            continue
        assert found, lines[k]


def _without_digests(control: str, lines: list[str]) -> list[str]:
    """What is wrong with a text whose digests are gone, as those of version 0.2.0 have none."""
    assert any("PARTS=" in line for line in lines)
    found = verify(
        _program(), "\n".join([*(line for line in lines if "PARTS=" not in line), ""]).encode(), **_how(control)
    )
    return [problem.text for problem in found.problems]


@pytest.mark.parametrize("control", sorted(_HIGH))
def test_what_is_wrong_around_a_retract_needs_no_digests(control: str) -> None:
    lines = _text(control).splitlines()
    plain = [re.sub(r"^\d+ ", "", line) for line in lines]
    assert not _without_digests(control, lines)
    over = [k for k, block in enumerate(plain) if re.fullmatch(_MUTANTS["not over the place"][0], block)]
    assert over
    for k in over:  # start and tool change
        said = _without_digests(control, [*lines[:k], *lines[k + 1 :]])
        assert any("before it is over its place" in text or "in one block of X Y Z" in text for text in said), plain[k]
    up = [
        k
        for k, block in enumerate(plain)
        if re.fullmatch(r"G91 G28 Z0\.|G53 G0 Z0\.?|SUPA G0 Z0 D0|L Z-1 .*M91", block)
    ]
    first = next(k for k, block in enumerate(plain) if re.match(r"G0 X|L X", block))
    before = [k for k in up if k < first]
    gone = [line for k, line in enumerate(lines) if k not in before]
    assert any("without a retract before it" in text for text in _without_digests(control, gone))
    off = [
        k for k, block in enumerate(plain) if re.fullmatch("G49|TRAFOOF|FUNCTION RESET TCPM|M429", block) and k > first
    ]
    earlier = next((k for k in off if k + 1 in up), None)
    if earlier is not None:  # off before the retract on this control
        swapped = [*lines[:earlier], lines[earlier + 1], lines[earlier], *lines[earlier + 2 :]]
        assert any(" under " in text for text in _without_digests(control, swapped))
    if "G49" in plain:  # and behind it on this
        k, retract = off[-1], max(k for k in up if k < off[-1])
        swapped = [*lines[:retract], lines[k], *lines[retract:k], *lines[k + 1 :]]
        assert any(" before the retract" in text or " under " in text for text in _without_digests(control, swapped))
    turn = next((k for k in range(off[-1], len(lines)) if re.match(r"(G0|L) [ABC]", plain[k])), None)
    if turn is not None and control in ("fanuc", "haas", "mitsubishi", "siemens"):
        late = [*lines[: off[-1]], *lines[off[-1] + 1 : turn + 1], lines[off[-1]], *lines[turn + 1 :]]
        assert any("rotary axes turn under" in text or " under " in text for text in _without_digests(control, late))


@pytest.mark.parametrize("control", sorted(_HIGH))
def test_a_way_back_after_gohome_needs_no_digests(control: str) -> None:
    cl = _ONE_TOOL.replace("GOTO/20,0,60,0.2,0.15,0.96825", "GOHOME\nRAPID\nGOTO/5,5,60,0,0,1\nGOTO/5,5,30,0,0,1")
    form, stream = choose_form(control, machine=load_machine(MACHINES[control])), io.BytesIO()
    postprocess(cl.encode(), stream, Settings(tolerance=0.05), form=form)
    lines = [line for line in stream.getvalue().decode().splitlines() if "PARTS=" not in line]
    how = {"control": control, "machine": form.machine, "tolerance": 0.05}
    assert verify(read(cl.encode()), "\n".join(lines).encode(), **how).verdict is Verdict.PASSED
    over = [k for k, line in enumerate(lines) if re.fullmatch(r"(\d+ )?(G0|L) X\S+ Y\S+ [AB]\S+ C\S+( FMAX)?", line)]
    changed = [*lines[: over[-1]], *lines[over[-1] + 1 :]]
    found = verify(read(cl.encode()), "\n".join(changed).encode(), **how).problems
    assert any("before it is over its place" in problem.text for problem in found)


@pytest.mark.parametrize("control", MACHINES)
def test_comments_and_the_order_of_spindle_and_coolant_change_no_part(control: str) -> None:
    """A comment behind each cut, and M8 before M3: nothing is moved across a motion."""
    lines = _text(control).splitlines()
    mark = ";" if control in ("siemens", "heidenhain") else "("
    noted = [f"{line} {mark}note" + ")" * (mark == "(") if re.search("X.*Y.*Z", line) else line for line in lines]
    assert noted != lines
    assert not _problems(control, noted)
    plain = [re.sub(r"^\d+ ", "", line) for line in lines]
    k = next(k for k, block in enumerate(plain) if block == "M8")
    assert "M3" in plain[k - 1]
    assert not _problems(control, [*lines[: k - 1], lines[k], lines[k - 1], *lines[k + 1 :]])
