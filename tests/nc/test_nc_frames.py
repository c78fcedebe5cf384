"""Heads and tails, block numbers, names, long blocks, number formats, functions that are asked for, comments."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from cornersmooth.errors import OutputError, SettingsError
from cornersmooth.kinematics import load_machine
from cornersmooth.model import MM_PER_UNIT, Units
from cornersmooth.nc import Frame, choose_form, control_names, load_control
from cornersmooth.nc.control_tables import parse_control
from cornersmooth.nc.program_frame import blend_word, name_of_file
from nc.cases import CHOSEN, RUNNABLE, Case
from nc.writing import lines_of
from oracle.messages import one_line

CL = (
    "UNITS/MM\nPPRINT FIRST\nLOADTL/3\nSPINDL/9000,RPM,CLW\nCOOLNT/ON\nRAPID\nGOTO/0,0,50,0,0,1\nFEDRAT/800,MMPM\n"
    "GOTO/0,0,0\nGOTO/20,0,0\nGOTO/20,20,0\nLOADTL/4\nSPINDL/9000,RPM,CLW\nRAPID\nGOTO/20,20,50\nFEDRAT/800,MMPM\n"
    "GOTO/0,20,0\nFINI\n"
)


def without_numbers(lines: list[str], control: str) -> list[str]:
    return [line.partition(" ")[2] for line in lines] if control == "heidenhain" else lines


# ------------------------------------------------------------------------------------------------ heads and tails


@pytest.mark.parametrize("case", [case for case in RUNNABLE if case.machine in ("", "table-ac")], ids=str)
def test_a_tool_is_changed_before_tip_control_is_on(case: Case) -> None:
    """On behind the tool and before the motion, off before the next tool and at the end."""
    form = case.choose()
    lines = without_numbers(lines_of(form, CL), case.control)
    change = {"siemens": "M6", "heidenhain": "TOOL CALL {} Z"}.get(case.control, "T{} M6")
    first, second = lines.index(change.format(3)), lines.index(change.format(4))
    if change == "M6":
        second = lines.index("M6", first + 1)
    assert first < second
    if form.mode.on:
        starts = {form.mode.on[0].format(offset=tool) for tool in (3, 4)}
        on = [number for number, line in enumerate(lines) if line in starts or line.partition(" G0 ")[0] in starts]
        off = [number for number, line in enumerate(lines) if line == form.mode.off[-1] and number > first]
        assert len(on) == len(off) == 2
        assert first < on[0] < off[0] < second < on[1] < off[1] < len(lines) - 1


SAFE = "G21 G90 G94 G17 G40 G49 G80"
UP = ["G91 G28 Z0.", "G90"]

#: first and last blocks: a known state, a retract; a retract, the length off behind it, the end
ENDS = {
    "fanuc": (["%", "O0001", SAFE, *UP], [*UP, "G49", "M5", "M30", "%"]),
    "generic": (["%", "O0001", "G21 G90 G94 G17 G40 G80"], ["M30", "%"]),
    "haas": (
        ["%", "O0001", SAFE, "G53 G0 Z0."],
        ["G53 G0 Z0.", "G49", "M5", "G0 A0.0000 C0.0000", "M30", "%"],
    ),
    "heidenhain": (
        [
            *("BEGIN PGM CORNERSMOOTH MM", "PLANE RESET STAY", "L Z-1 R0 FMAX M91"),
            "CYCL DEF 247 DATUM SETTING Q339=+1",
        ],
        ["M9", "FUNCTION RESET TCPM", "L Z-1 R0 FMAX M91", "M5", "M30", "END PGM CORNERSMOOTH MM"],
    ),
    "linuxcnc": (
        ["(CORNERSMOOTH)", SAFE, "G64 P0.01350 Q0", "G53 G0 Z0"],
        ["G53 G0 Z0", "G49", "M5", "G0 A0.000000 C0.000000", "M2"],
    ),
    "mitsubishi": (["%", "O0001", SAFE, *UP], [*UP, "G49", "M5", "M30", "%"]),
    "siemens": (
        ["; CORNERSMOOTH", "TRAFOOF", "G90 G94 G17 G40 G710", "SUPA G0 Z0 D0"],
        ["M9", "TRAFOOF", "SUPA G0 Z0 D0", "M5", "M30"],
    ),
}


@pytest.mark.parametrize("control", control_names())
def test_head_and_tail(control: str) -> None:
    case = next(case for case in RUNNABLE if case.control == control)
    lines = without_numbers(lines_of(case.choose(), CL), control)
    head, tail = ENDS[control]
    assert lines[: len(head)] == head
    assert lines[-len(tail) :] == tail


@pytest.mark.parametrize(
    ("statements", "left"),
    [
        ("FEDRAT/0.1,MMPR\nGOTO/9,0,0\n", ["G94", *UP, "G49"]),
        ("CUTCOM/LEFT,XYPLAN\nGOTO/9,0,0\n", ["G40", *UP, "G49"]),
        ("CUTCOM/LEFT\nFEDRAT/0.1,MMPR\nGOTO/9,0,0\n", ["G40", "G94", *UP, "G49"]),
        ("CUTCOM/LEFT\nGOTO/9,0,0\nCUTCOM/OFF\n", ["G40", *UP, "G49"]),
        ("", [*UP, "G49"]),
    ],
)
def test_what_is_on_at_the_end_is_cancelled(statements: str, left: list[str]) -> None:
    lines = lines_of(
        choose_form("fanuc"), "UNITS/MM\nLOADTL/1\nFEDRAT/500,MMPM\nGOTO/0,0,0\nGOTO/5,0,0\n" + statements + "FINI\n"
    )
    assert lines[-2 - len(left) : -2] == left


def test_a_machine_without_tip_control_ends_in_feed_per_minute() -> None:
    lines = lines_of(
        Case("siemens", "g1", "table-ac", tcp=False).choose(), CL.replace("/0,20,0\n", "/0,20,0,0,0.6,0.8\n")
    )
    assert "G93" in lines
    assert lines[-6:] == ["G94", "M9", "SUPA G0 Z0 D0", "M5", "G0 A0.000000 C0.000000", "M30"]


# ------------------------------------------------------------------------------------------------ names, numbers


@pytest.mark.parametrize(
    ("control", "good", "bad"),
    [
        ("fanuc", ["O4711", "O12345678", "<PART-7>"], ["PART7", "O", "O123456789", "O1)", "4711"]),
        ("mitsubishi", ["O4711"], ["PART7"]),
        ("haas", ["O04711"], ["PART 7"]),
        ("heidenhain", ["BLADE_7"], ["BLADE 7", "BLADE-7", ""]),
        ("siemens", ["BLADE 7", "a very long name " * 4], []),
        ("linuxcnc", ["blade 7 of 12"], ["blade (7)"]),
    ],
)
def test_names_of_programs_are_those_of_the_control(control: str, good: list[str], bad: list[str]) -> None:
    form = next(case for case in RUNNABLE if case.control == control).choose()
    for name in good:
        assert any(name in line for line in lines_of(form, CL, frame=Frame(name))[:3])
    for name in bad:
        with pytest.raises(SettingsError, match="takes no program name"):
            lines_of(form, CL, frame=Frame(name))


@pytest.mark.parametrize("control", control_names())
def test_block_numbers_start_again_behind_the_last(control: str) -> None:
    form = next(case for case in RUNNABLE if case.control == control).choose()
    layout = replace(form.table.layout, number_last=5 * form.table.layout.number_step)
    lines = lines_of(replace(form, table=replace(form.table, layout=layout)), CL, frame=Frame(block_numbers=True))
    numbers = [int(re.match(r"N?(\d+) ", line)[1]) for line in lines if line[0] not in "%O"]  # type: ignore[index]
    step, start = layout.number_step, layout.number_start
    cycle = list(range(start, layout.number_last + 1, step))
    assert numbers == (cycle * len(numbers))[: len(numbers)]
    assert choose_form("fanuc").table.layout.number_last == 99999


# ------------------------------------------------------------------------------------------------ long blocks


def test_a_spline_goes_on_in_the_next_line() -> None:
    control = parse_control('like = "heidenhain"\n[layout]\nlongest_block = 100\n')
    lines = lines_of(choose_form(control, "spl"), CL)
    parts = [line for line in lines if "SPL" in line]
    assert parts
    assert all(line.endswith(" ~") for line in parts)
    assert max(map(len, lines)) <= 100
    assert not any(line.endswith(" ~") for line in lines if "SPL" not in line)


def test_lines_too_long_for_a_control_are_refused() -> None:
    form = Case("linuxcnc", "g1", "xyzac-trt").choose()
    assert lines_of(form, CL, frame=Frame(header=("(" + 250 * "x" + ")",)))
    with pytest.raises(OutputError, match="a block of 253 characters is too long for the control, which takes 252"):
        lines_of(form, CL, frame=Frame(header=("(" + 251 * "x" + ")",)))


def test_long_comments_are_divided_for_every_control() -> None:
    for case in RUNNABLE:
        if case.machine in ("", "table-ac"):
            lines = lines_of(case.choose(), CL.replace("FIRST", 500 * "x"), frame=Frame(block_numbers=True))
            assert sum(line.count("x") for line in lines) == 500
            assert max(map(len, lines)) <= (case.choose().table.layout.longest_block or 255)


# ------------------------------------------------------------------------------------------------ number formats

COMPACT = "like = 'fanuc'\n[motion]\nspaces = false\nleading_zeros = false\ntrailing_zeros = false\n"


@pytest.mark.parametrize("form", ["g1", "g6.2"])
def test_words_may_stand_close_and_zeros_be_left_out(form: str) -> None:
    """The same numbers word by word."""
    plain = lines_of(choose_form("fanuc", form), CL)
    tight = lines_of(choose_form(parse_control(COMPACT), form), CL)
    assert len(plain) == len(tight)
    assert sum(map(len, tight)) < 0.75 * sum(map(len, plain))
    words = re.compile(r"([A-Z])([+-]?[\d.]+)")
    for one, other in zip(plain, tight, strict=True):
        if one.startswith(("G0 ", "G1 ", "G6.2", "K")):
            assert " " not in other
            assert not re.search(r"[XYZIJKUVW]-?0\.\d", re.sub(r"K0\.5", "", other))
            assert [(word, float(number)) for word, number in words.findall(one)] == [
                (word, float(number)) for word, number in words.findall(other)
            ]


# ------------------------------------------------------------------------------------------------ extras, comments


@pytest.mark.parametrize(
    ("control", "form", "name", "on", "off"),
    [
        ("fanuc", "g1", "aicc", ["G43.5 H3", "G5.1 Q1"], ["G5.1 Q0", "G91 G28 Z0."]),
        ("fanuc", "g6.2", "hpcc", ["G43 H3", "G5 P10000"], ["G5 P0", "G91 G28 Z0."]),
        (
            "siemens",
            "g1",
            "cycle832",
            ["CYCLE832(0.00500,_ORI_FINISH,0.02865)", "TRAORI"],
            ["CYCLE832(0,_OFF,1)", "SUPA G0 Z0 D0"],
        ),
    ],
)
def test_functions_are_switched_on_and_off(control: str, form: str, name: str, on: list[str], off: list[str]) -> None:
    lines = lines_of(choose_form(control, form, extras=(name, name)), CL)
    for pair in (on, off):
        places = [number for number, line in enumerate(lines) if line == pair[0]]
        assert places
        assert [lines[number + 1] for number in places] == [pair[1]] * len(places)
    own = [line for line in lines if line.startswith(("G5", "CYCLE832")) and line != "G54"]
    assert own == 2 * [next(line for line in pair if line in own) for pair in (on, off)]


@pytest.mark.parametrize(
    ("control", "form", "name", "message"),
    [
        ("siemens", "g1", "cycle800", "siemens has no function 'cycle800'; choose one of cycle832"),
        ("siemens", "bspline", "cycle832", "cycle832 is not for siemens form bspline; use -f g1"),
        ("heidenhain", "g1", "aicc", "heidenhain has no function 'aicc'; choose one of cycle32"),
        ("generic", "g1", "hpcc", "generic has no function 'hpcc'; leave it out"),
    ],
)
def test_unknown_functions_are_refused(control: str, form: str, name: str, message: str) -> None:
    with pytest.raises(SettingsError) as refused:
        choose_form(control, form, extras=(name,))
    assert one_line(refused.value) == f"error: {message}"


@pytest.mark.parametrize(
    ("control", "stem", "name"),
    [
        ("fanuc", "part-0712", "O0712"),
        ("fanuc", "blade", "O0001"),  # a number cannot be made of that
        ("fanuc", "part5x", "O0001"),  # five axes, not a number
        ("haas", "O31", "O0031"),
        ("mitsubishi", "9001", "O0001"),  # locked by most builders
        ("siemens", "blade 2.rough", "BLADE_2_ROUGH"),
        ("heidenhain", "a-very-long-name-of-a-part", "A_VERY_LONG_NAME_OF_A_PA"),
        ("linuxcnc", "(x)", "X"),
        ("heidenhain", "---", "CORNERSMOOTH"),
    ],
)
def test_the_name_of_the_program_is_that_of_the_file(control: str, stem: str, name: str) -> None:
    table = load_control(control).program
    assert (name_of_file(stem, table) or table.name) == name
    assert re.fullmatch(table.name_pattern or ".*", name)


def test_a_name_that_is_given_goes_before_that_of_the_file() -> None:
    form = choose_form("fanuc", "g1")
    assert lines_of(form, CL, frame=Frame(stem="part-12"))[1] == "O0012"
    assert lines_of(form, CL, frame=Frame("O5", stem="part-12"))[1] == "O5"


@pytest.mark.parametrize("control", [name for name in control_names() if name != "generic"])
def test_the_operator_may_look_before_the_next_tool(control: str) -> None:
    """An optional stop behind the retract, once, not before the first tool and not where the CL file stops anyway."""
    form = next(case for case in CHOSEN if case.control == control and case.tcp).choose()
    lines = without_numbers(lines_of(form, CL), control)
    (place,) = (number for number, line in enumerate(lines) if line == "M1")
    assert re.match(r"T4|TOOL CALL 4", lines[place + 1])
    assert any(line in form.table.program.retract for line in lines[place - 4 : place])
    for word, block in (("OPSTOP", "M1"), ("STOP", form.table.words.stop[0])):
        again = without_numbers(lines_of(form, CL.replace("LOADTL/4", f"{word}\nLOADTL/4")), control)
        assert [line for line in again if line in ("M1", block)] == [block]


@pytest.mark.parametrize(
    ("control", "name", "on", "off"),
    [
        ("haas", "g187", ["G187 P3 E0.00500"], ["G187"]),
        (
            "heidenhain",
            "cycle32",
            ["CYCL DEF 32.0 TOLERANCE", "CYCL DEF 32.1 T0.00500", "CYCL DEF 32.2 HSC-MODE:0 TA0.02865"],
            ["CYCL DEF 32.0 TOLERANCE", "CYCL DEF 32.1"],
        ),
    ],
)
def test_high_speed_modes_stand_around_each_tool(control: str, name: str, on: list[str], off: list[str]) -> None:
    machine = load_machine("table-bc") if control == "haas" else None
    lines = without_numbers(lines_of(choose_form(control, "g1", machine=machine, extras=(name,)), CL), control)
    own = [line for line in lines if line.startswith(("G187", "CYCL DEF 32"))]
    assert own == 2 * [*on, *off]


@pytest.mark.parametrize("control", control_names())
def test_comments_may_be_left_out(control: str) -> None:
    form = next(case for case in RUNNABLE if case.control == control).choose()
    mark = form.table.layout.comment[0]
    cl = CL.replace("GOTO/0,20,0", "CYCLE/TAP,4\nGOTO/0,20,0\nCYCLE/OFF\nABC/3")
    with_comments = without_numbers(lines_of(form, cl, frame=Frame(skip_cycles=True)), control)
    bare = without_numbers(lines_of(form, cl, frame=Frame(comments=False, skip_cycles=True)), control)
    head = form.table.program.start
    assert sum(line.startswith(mark) for line in with_comments) > 3
    own = sum("NOT DRILLED" in line for line in bare)  # which is ours and no words of the CL file
    assert own == 1
    assert sum(line.startswith(mark) for line in bare) == own + sum(line.startswith(mark) for line in head)
    assert [line for line in with_comments if not line.startswith(mark)] == [
        line for line in bare if not line.startswith(mark)
    ]


def test_comments_hold_what_controls_take() -> None:
    """No brackets, percent signs, ends of blocks or letters beyond ASCII; LinuxCNC's orders are no orders any more."""
    said = "Fräsen (links) 50% ø8 ~; Ende – fertig 漢"
    cl = CL.replace("PPRINT FIRST", f"PPRINT {said}")
    assert "(Frasen [links] 50/ o8 -, Ende ? fertig ?)" in lines_of(choose_form("fanuc"), cl)
    assert "; Frasen [links] 50/ o8 -, Ende ? fertig ?" in lines_of(choose_form("siemens"), cl)
    assert "5 ; Frasen [links] 50/ o8 -, Ende ? fertig ?" in lines_of(choose_form("heidenhain"), cl)
    trunnion = Case("linuxcnc", "g1", "xyzac-trt").choose()
    for order in ("MSG, stop", "logopen,/tmp/x", "DEBUG,#1", "py,import os", "Probeopen x"):
        lines = lines_of(trunnion, CL.replace("PPRINT FIRST", f"PPRINT {order}"))
        assert f"(- {order})" in lines
    assert "(FIRST)" in lines_of(trunnion, CL)


@pytest.mark.parametrize(
    ("tolerance", "units", "word"), [(0.05, "mm", "0.00500"), (1e-5, "mm", "0.00001"), (0.001, "inch", "0.00001")]
)
def test_blending_is_never_without_limit(tolerance: float, units: Units, word: str) -> None:
    """G64 P0 would let LinuxCNC cut corners as far as it likes."""
    assert blend_word(0.1 * tolerance / MM_PER_UNIT[units]) == word


def test_blending_is_the_share_of_the_tolerance_that_the_table_says() -> None:
    form = Case("linuxcnc", "g1", "xyzac-trt").choose()
    assert "G64 P0.01350 Q0" in lines_of(form, CL)  # 0.27 of it
