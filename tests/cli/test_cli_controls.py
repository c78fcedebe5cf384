"""Controls and machines on the command line, through the installed command."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from oracle.command import run
from oracle.messages import one_line

CL = (
    b"UNITS/MM\nLOADTL/3\nRAPID\nGOTO/0,0,50,0,0.6,0.8\nFEDRAT/800,MMPM\nGOTO/0,0,0\nGOTO/20,0,0,0.6,0,0.8\n"
    b"GOTO/20,20,0\nFINI\n"
)


def lines_of(*options: str | Path, data: bytes = CL) -> list[str]:
    result = run("smooth", "-", "-e", "0.05", "-q", *options, data=data)
    assert result.returncode == 0, result.stderr.decode()
    return result.stdout.decode("ascii").splitlines()


def refusal(*options: str | Path, data: bytes = CL) -> tuple[int, str]:
    result = run("smooth", "-", "-e", "0.05", *options, data=data)
    assert result.stdout == b""
    return result.returncode, one_line(result.stderr).strip()


def test_controls_are_listed_with_their_forms() -> None:
    text = run("controls").stdout.decode()
    for word in ("fanuc:", "siemens:", "-f bspline:", "-f poly:", "heidenhain:", "linuxcnc:", "mitsubishi:", "haas:"):
        assert word in text
    assert "--with cycle832:" in text
    assert run("controls", "haas").stdout.decode().splitlines()[0].startswith("haas: ")
    failed = run("controls", "hass")
    assert failed.returncode == 2
    assert "did you mean haas?" in failed.stderr.decode()


def test_the_table_of_a_control_is_printed_to_start_from(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_bytes(run("controls", "siemens", "--table").stdout)
    mine.write_text(mine.read_text().replace('"{footer}", "M30"]', '"{footer}", "M17"]'))
    assert lines_of("--control", mine)[-1] == "M17"
    assert run("controls", mine).stdout.decode().startswith("siemens: ")
    assert run("controls", "--table").returncode == 2
    assert run("controls", "siemenz", "--table").returncode == 2


def test_own_tables_are_checked(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    for text, message in (
        ("like = 'fanuc'\n[words]\ncolant = {}\n", "unknown key words.colant; did you mean coolant?"),
        ("like = 'fanuc'\n[words]\ncoolant = 3\n", "words.coolant is 3; write a table [words.coolant]"),
        ("like = 'fanuc'\n[digits]\nmm = 'four'\n", "digits.mm is 'four'; give a whole number up to 9"),
    ):
        mine.write_text(text)
        for command in (("controls", mine), ("smooth", "-", "--control", mine)):
            result = run(*command, data=CL)
            assert result.returncode == 2
            assert one_line(result.stderr).strip() == f"{mine}: error: {message}"


def test_functions_of_the_control_are_asked_for_by_name() -> None:
    lines = lines_of("--control", "siemens", "--with", "cycle832")
    assert "CYCLE832(0.00500,_ORI_FINISH,0.02865)" in lines
    assert [line for line in lines_of("--with", "aicc") if line.startswith("G5.1")] == ["G5.1 Q1", "G5.1 Q0"]
    code, said = refusal("--control", "heidenhain", "--with", "cycle832")
    assert (code, said) == (2, "error: heidenhain has no function 'cycle832'; choose one of cycle32")


def test_comments_may_be_left_out() -> None:
    data = CL.replace(b"LOADTL/3", b"PPRINT SAID\nLOADTL/3")
    assert "(SAID)" in lines_of(data=data)
    assert [line for line in lines_of(data=data) if line.startswith("(CORNERSMOOTH ")]
    assert not [line for line in lines_of("CORNERSMOOTH_NO_COMMENTS=1", data=data) if "(" in line]


def test_machines_are_listed_and_described() -> None:
    text = run("machines").stdout.decode()
    for name in ("xyzac-trt", "xyzbc-trt", "table-ac", "table-bc", "head-table-bc", "head-ac", "nutated-bc"):
        assert f"{name}: " in text
    described = run("machines", "xyzac-trt").stdout.decode()
    assert "C in the table" in described
    assert "from -100 to 50 deg" in described
    assert run("machines", "table-xy").returncode == 2


def test_control_form_and_machine_are_chosen() -> None:
    assert "TRAORI" in lines_of("--control", "siemens")
    assert [line for line in lines_of("--control", "siemens", "-f", "bspline") if line.startswith("BSPLINE SD=3 ")]
    assert "G43.4 H3" in lines_of("--machine", "table-ac")
    assert "G93" in lines_of("--machine", "table-ac", "--no-tcp")
    assert "G234 H3" in lines_of("--control", "haas", "--machine", "table-bc")


def test_own_tables_are_taken_from_files(tmp_path: Path) -> None:
    control, machine = tmp_path / "mine.toml", tmp_path / "mill.toml"
    control.write_text('like = "siemens"\n[program]\nend = ["M17"]\n')
    machine.write_text(
        'name = "mill"\n[[axis]]\nname = "C"\ncarrier = "table"\ndirection = [0, 0, 1]\n'
        '[[axis]]\nname = "B"\ncarrier = "table"\ndirection = [0, 1, 0]\nlimits = [-10, 110]\n'
    )
    lines = lines_of("--control", control, "--machine", machine)
    assert lines[-1] == "M17"
    assert any(" B" in line and " C" in line for line in lines)


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (
            ("--control", "haas"),
            2,
            "haas form g1 has no tool vectors, only rotary words; name your machine with --mach",
        ),
        (("--no-tcp",), 2, "machine positions need a machine; name it with --machine"),
        (("--machine", "table-xy"), 2, "unknown machine 'table-xy'"),
        (("--control", "siemens", "-f", "g6.2"), 2, "siemens has no form 'g6.2'; choose one of g1, bspline, poly"),
        (("--control", "none.toml"), 2, "none.toml: error: control file cannot be read"),
        (("--control", "mitsubishi", "-f", "g6.2"), 2, "<stdin>:4: error: the tool is not parallel to Z"),
        (
            ("-f", "g6.2", "--machine", "table-ac"),
            2,
            "fanuc form g6.2 has no rotary words; use -f g1",
        ),
        (("--program-name", "PART7"), 2, "fanuc takes no program name 'PART7'; use one like O0001"),
        (("--program-name", "O0000"), 2, "fanuc takes no program name 'O0000'; use one like O0001"),
        (("-f", "g6.2", "--no-tcp"), 2, "fanuc form g6.2 cannot run without tool tip control"),
        (
            ("--control", "heidenhain", "--no-tcp"),
            2,
            "heidenhain form g1 cannot run without tool tip control; leave out",
        ),
        (("--header", "none.txt"), 3, "none.txt: error: cannot read it"),
    ],
)
def test_refusals_come_before_anything_is_written(options: tuple[str, ...], code: int, message: str) -> None:
    found, said = refusal(*options)
    assert found == code
    assert said.removeprefix("error: ").startswith(message)


def test_axis_out_of_reach_names_line_axis_and_limit() -> None:
    code, said = refusal("--control", "linuxcnc", "--machine", "xyzac-trt", data=CL.replace(b"0.6,0,0.8", b"0,0,-1"))
    assert code == 3
    assert said.startswith("<stdin>:7: error: A would have to go to ")
    assert "its limit is" in said


def test_frame_of_the_text(tmp_path: Path) -> None:
    header, footer = tmp_path / "head.txt", tmp_path / "foot.txt"
    header.write_text("({program} IN {units})\nG54\n")
    footer.write_text("G91 G28 Z0.\n")
    options = ("--header", header, "--footer", footer, "--program-name", "O0815", "CORNERSMOOTH_BLOCK_NUMBERS=1")
    lines = lines_of(*options)
    assert lines[1:5] == ["O0815", "N10 G21 G90 G94 G17 G40 G49 G80", "N20 G91 G28 Z0.", "N30 G90"]
    assert lines[5].startswith("N40 (CORNERSMOOTH ")
    assert lines[8:10] == ["N70 (O0815 IN G21)", "N80 G54"]
    assert [line.partition(" ")[2] for line in lines[-3:-1]] == ["G91 G28 Z0.", "M30"]


@pytest.mark.parametrize(
    "options",
    [
        ("--control", "siemens"),
        ("--control", "siemens", "-f", "bspline"),
        ("--control", "siemens", "-f", "poly"),
        ("--control", "heidenhain"),
        ("--control", "heidenhain", "--machine", "table-bc"),
        ("--control", "linuxcnc", "--machine", "xyzac-trt"),
        ("--control", "haas", "--machine", "table-ac"),
        ("--machine", "head-ac", "--no-tcp"),
        ("--control", "generic", "-f", "g6.2", "CORNERSMOOTH_BLOCK_NUMBERS=1"),
    ],
    ids=" ".join,
)
def test_every_text_is_read_back(options: tuple[str, ...], tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    lines_of(*options, "--report", report)
    contents = json.loads(report.read_text())
    assert contents["verification"]["passed"]
    assert "CS509" not in report.read_text()


def test_text_that_cannot_be_read_back_says_so(tmp_path: Path) -> None:
    def found(*options: object) -> str:
        lines_of(*options, "--report", tmp_path / "report.json")
        return json.loads((tmp_path / "report.json").read_text()).get("not_verified", "")

    (tmp_path / "foot.txt").write_text("G10 L2 P1\n")
    assert re.fullmatch(r"G10 L2 P1, NC line \d+", found("--footer", tmp_path / "foot.txt"))
    own = tmp_path / "mine.toml"
    own.write_text('like = "fanuc"\n[words]\ncoolant = { ON = ["M50"], OFF = ["M51"] }\n')
    # its M words may mean anything; the CL file has no coolant
    assert found("--control", own) == ""
    own.write_text('like = "fanuc"\n[program]\nend = ["G10 L2 P1", "%"]\n')
    named = r"G10 L2 P1, NC line \d+; the program must end with M2 or M30, %, once, NC line \d+"
    assert re.fullmatch(named, found("--control", own))
    assert found("--control", "fanuc") == ""
    assert found("--no-verify") == "nothing was measured, as asked for"
