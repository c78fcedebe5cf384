"""Controls as tables: what comes with the program, what a user may write, what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, choose_form, control_names, load_control
from cornersmooth.nc.control_tables import parse_control
from nc.writing import lines_of
from oracle.messages import one_line

CL = (
    "UNITS/MM\nPPRINT FIRST\nLOADTL/3\nSPINDL/9000,RPM,CLW\nCOOLNT/ON\nRAPID\nGOTO/0,0,50\nFEDRAT/800,MMPM\n"
    "GOTO/0,0,0\nGOTO/20,0,0\nGOTO/20,20,0\nDELAY/0.5\nSTOP\nSPINDL/OFF\nFINI\n"
)


def test_all_controls_are_there() -> None:
    assert control_names() == ("fanuc", "generic", "haas", "heidenhain", "linuxcnc", "mitsubishi", "siemens")


@pytest.mark.parametrize("control", control_names())
def test_a_statement_is_said_in_the_words_of_the_control(control: str) -> None:
    machine = load_machine("table-bc") if control in ("haas", "linuxcnc") else None
    lines = lines_of(choose_form(control, machine=machine), CL)
    wanted = {
        "heidenhain": ["; FIRST", "TOOL CALL 3 Z", "TOOL CALL Z S9000", "M3", "M8", "CYCL DEF 9.1 DWELL 0.5", "STOP"],
        "siemens": ["; FIRST", "T3", "M6", "S9000 M3", "M8", "D1", "G54", "G4 F0.5", "M0"],
        "haas": ["(FIRST)", "T3 M6", "S9000 M3", "M8", "G4 P0.5", "M0"],
        "linuxcnc": ["(FIRST)", "T3 M6", "S9000 M3", "M8", "G4 P0.5", "M0"],
    }.get(control, ["(FIRST)", "T3 M6", "S9000 M3", "M8", "G4 P500", "M0"])
    if control == "heidenhain":
        lines = [line.partition(" ")[2] for line in lines]
    places = [lines.index(block) for block in wanted]
    assert places == sorted(places)


@pytest.mark.parametrize(
    ("control", "form", "machine", "tcp", "message"),
    [
        ("siemenz", None, "", True, "unknown control 'siemenz'; did you mean siemens? "),
        ("fanuc", "g5", "", True, "fanuc has no form 'g5'; choose one of g1, g6.2"),
        (
            "haas",
            None,
            "",
            True,
            "haas form g1 has no tool vectors, only rotary words; name your machine with --machine",
        ),
        ("siemens", "poly", "table-ac", True, "siemens form poly has no rotary words; use -f g1"),
        (
            "fanuc",
            "g6.2",
            "table-ac",
            False,
            "fanuc form g6.2 cannot run without tool tip control; use -f g1",
        ),
        (
            "heidenhain",
            None,
            "table-ac",
            False,
            "heidenhain form g1 cannot run without tool tip control; leave out --no",
        ),
        ("fanuc", None, "", False, "machine positions need a machine; name it with --machine"),
    ],
)
def test_what_cannot_run_is_refused_with_what_can(
    control: str, form: str | None, machine: str, tcp: bool, message: str
) -> None:
    with pytest.raises(SettingsError) as refused:
        choose_form(control, form, machine=load_machine(machine) if machine else None, tcp=tcp)
    assert one_line(refused.value).removeprefix("error: ").startswith(message)


def test_a_tilted_tool_is_refused_where_no_word_can_say_it() -> None:
    chosen = choose_form("mitsubishi", "g6.2")
    assert "G5 P10000" in lines_of(chosen, CL)
    tilted = CL.replace("GOTO/20,20,0", "GOTO/20,20,0,0,0.6,0.8")
    with pytest.raises(SettingsError, match=r"part.cls:11: error\[\w+\]: the tool is not parallel to Z"):
        lines_of(chosen, tilted)


OWN = """
like = "fanuc"
name = "mine"

[digits]
mm = 3
vector = 6

[program]
name = "O7777"
start = ["%", "{program} (MY MILL)", "{units} G90"]

[words]
coolant = { FLOOD = ["M108"], THRU = ["M88", "G4 P100"] }

[forms]
"g6.2" = false
"""


def test_a_table_of_the_users_says_only_what_is_different(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(OWN)
    chosen = choose_form(file)
    assert chosen.control == "mine"
    assert list(load_control(str(file)).forms) == ["g1"]
    lines = lines_of(chosen, CL.replace("COOLNT/ON", "COOLNT/FLOOD\nCOOLNT/THRU"))
    assert lines[:3] == ["%", "O7777 (MY MILL)", "G21 G90"]
    assert lines[-2:] == ["M30", "%"]
    assert "M108" in lines
    assert lines[lines.index("M88") + 1] == "G4 P100"
    assert "G0 X0.000 Y0.000 Z50.000 I0.000000 J0.000000 K1.000000" in lines


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("like = 'fanuk'", "own.toml: error: unknown control 'fanuk'; did you mean fanuc? "),
        ("like = 3", "own.toml: error: like is 3; name one of the built-in controls"),
        ("nmae = 'x'", "own.toml: error: unknown key nmae; did you mean name?"),
        ("like = 'fanuc'\n[words]\ncolant = {}", "own.toml: error: unknown key words.colant; did you mean coolant?"),
        ("like = 'fanuc'\n[digits]\nmm = 'x'", "own.toml: error: digits.mm is 'x'; give a whole number"),
        ("like = 'fanuc'\n[digits]\nmm = -1", "own.toml: error: digits.mm is -1; give a whole number"),
        ("like = 'fanuc'\n[words]\nstop = 'M0'", "own.toml: error: words.stop is 'M0'; give a list of strings"),
        (
            "like = 'fanuc'\n[words]\ntool_change = ['T{number}']",
            "own.toml: error: words.tool_change: 'T{number}' has unknown braces; use {tool}",
        ),
        ("like = 'fanuc'\n[program]\nend = ['ü']", "own.toml: error: program.end is 'ü'; give ASCII text"),
        ("like = 'fanuc'\n[forms.g1.vektor]\n", "own.toml: error: unknown key forms.g1.vektor; did you mean vector?"),
        ("like = 'fanuc'\n[forms.g1.vector]\nwords = ['I']", "own.toml: error: forms.g1.vector has 1 words; give 3"),
        ("like = 'fanuc'\n[forms.x]\ncurve = 'g5'", "own.toml: error: forms.x.curve is 'g5'; use one of g6.2, "),
        ("like = 'fanuc'\n[forms.x]\n", "own.toml: error: forms.x says no orientation; use one of vector, point"),
        ("name = 'x'", "own.toml: error: there are no forms; write a table [forms.g1]"),
        ("name = ", "own.toml: error: not TOML: "),
        (
            "like = 'fanuc'\n[words.plane]\nxz = 'G18'",
            "own.toml: error: unknown key words.plane.xz; known keys are xy, zx, yz",
        ),
    ],
)
def test_a_wrong_table_is_refused_by_name(text: str, message: str) -> None:
    with pytest.raises(SettingsError) as refused:
        parse_control(text, file="own.toml")
    assert one_line(refused.value).startswith(message)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"none\.toml: error\[\w+\]: control file cannot be read"):
        load_control(tmp_path / "none.toml")


def test_name_numbers_header_and_footer() -> None:
    frame = Frame("O4711", block_numbers=True, header=("({program} {units})",), footer=("G91 G28 Z0.", "G90"))
    lines = lines_of(choose_form("fanuc"), CL, frame=frame)
    assert lines[:3] == ["%", "O4711", "N10 G21 G90 G94 G17 G40 G49 G80"]
    assert lines[3:6] == ["N20 G91 G28 Z0.", "N30 G90", "N40 (O4711 G21)"]
    numbers = [int(line.split()[0][1:]) for line in lines[2:-1]]
    assert numbers == list(range(10, 10 * len(lines) - 20, 10))
    assert [line.partition(" ")[2] for line in lines[-5:-1]] == ["G49", "G91 G28 Z0.", "G90", "M30"]
    with pytest.raises(SettingsError, match=r"unknown braces\nhint: use \{program\}, \{units\}"):
        lines_of(choose_form("fanuc"), CL, frame=Frame(header=("{date}",)))
    with pytest.raises(SettingsError, match="characters that an NC program cannot hold"):
        lines_of(choose_form("fanuc"), CL, frame=Frame(footer=("Grüße",)))


def test_heidenhain_numbers_every_block() -> None:
    lines = lines_of(choose_form("heidenhain"), CL)
    assert [int(line.split()[0]) for line in lines] == list(range(len(lines)))
    assert lines[0] == "0 BEGIN PGM CORNERSMOOTH MM"
    assert lines[-1].endswith(" END PGM CORNERSMOOTH MM")


def test_inches_have_their_own_word_and_digits() -> None:
    lines = lines_of(choose_form("siemens"), CL.replace("UNITS/MM", "UNITS/INCHES").replace("MMPM", "IPM"))
    assert "G90 G94 G17 G40 G700" in lines
    assert "G0 X0.0000000 Y0.0000000 Z50.0000000 A3=0.0000000 B3=0.0000000 C3=1.0000000" in lines
