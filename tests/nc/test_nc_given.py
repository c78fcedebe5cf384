"""What a user gives beside the CL file, tool, spindle and line ends; where F is said, and how large it may be."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from oracle.command import DONE, USAGE, run
from oracle.messages import one_line

CONTROLS = {
    "fanuc": (),
    "mitsubishi": (),
    "siemens": (),
    "heidenhain": (),
    "haas": ("--machine", "xyzac-trt"),
    "linuxcnc": ("--machine", "xyzac-trt"),
}

TABLE = "x,y,z,i,j,k\n0,0,10,0,0,1\n0,0,0,0,0,1\n10,0,0,0,0,1\n10,10,0,0,0,1\n"

#: two tools and two stops with the same feed in all parts
PARTS = """UNITS/MM
LOADTL/3
SPINDL/8000,CLW
RAPID
GOTO/0,0,50,0,0,1
FEDRAT/500,MMPM
GOTO/0,0,0
GOTO/10,0,0
STOP
GOTO/20,0,0
OPSTOP
GOTO/30,0,0
RAPID
GOTO/30,0,50
LOADTL/5
SPINDL/6000,CLW
RAPID
GOTO/0,20,50
GOTO/0,20,2
FEDRAT/500,MMPM
GOTO/0,20,0
GOTO/10,20,0
RAPID
GOTO/10,20,50
FINI
"""


@pytest.fixture
def cl(tmp_path: Path) -> Path:
    path = tmp_path / "part.cls"
    path.write_text(PARTS)
    return path


@pytest.mark.parametrize("control", CONTROLS)
def test_the_feed_is_said_by_the_first_cut_of_each_tool_and_after_each_stop(control: str, cl: Path) -> None:
    made = run("smooth", cl, "-o", "-", "--control", control, *CONTROLS[control], "-q")
    assert made.returncode == DONE, made.stderr
    waiting, said = "start", []
    for line in made.stdout.decode().splitlines():
        if re.search(r"\b(M6|TOOL CALL [35]|M0|STOP|M1)\b", line) and not line.startswith("("):
            waiting = line
        cuts = re.search(r"\b(G1|LN|L) .*[XYZ]", line) and "G0" not in line and "FMAX" not in line
        if cuts and waiting:
            said.append(waiting)
            assert re.search(r" F500\.?$", line), (waiting, line)
            waiting = ""
    assert len(said) == 4  # both tools, both stops


@pytest.mark.parametrize(
    ("control", "given", "words"),
    [
        ("fanuc", "8000,CCLW", ("T3 M6", "S8000 M4", "G43.5 H3")),
        ("siemens", "8000", ("T3", "M6", "S8000 M3", "D1")),
        ("heidenhain", "8000", ("TOOL CALL 3 Z", "TOOL CALL Z S8000", "M3")),
        ("linuxcnc", "8000", ("T3 M6", "S8000 M3", "G43 H3")),
    ],
)
def test_a_table_of_points_gets_tool_length_and_spindle(
    control: str, given: str, words: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "points.csv").write_text(TABLE)
    options = ("--tool-number", "3", "--spindle", given)
    machine = ("--control", control, *CONTROLS[control])
    made = run("smooth", "points.csv", *options, "--feed", "500", *machine, "-o", "p.nc", cwd=tmp_path)
    assert made.returncode == DONE, made.stderr
    assert b"spindle is not started" not in made.stderr
    text = (tmp_path / "p.nc").read_text()
    places = [re.search(rf"(?m)^(\d+ )?{re.escape(word)}( |$)", text) for word in words]
    assert all(places)
    assert [place.start() for place in places if place] == sorted(place.start() for place in places if place)
    assert run("verify", "points.csv", "p.nc", *options, *machine, cwd=tmp_path).returncode == DONE
    assert run("verify", "points.csv", "p.nc", *machine, cwd=tmp_path).returncode == 1  # nothing asks for tool 3


@pytest.mark.parametrize("option", [("--tool-number", "3"), ("--spindle", "100")])
def test_a_tool_that_the_input_has_is_given_by_no_option(option: tuple[str, str], cl: Path) -> None:
    made = run("smooth", cl, *option, "-o", cl.with_suffix(".nc"))
    assert made.returncode == USAGE
    assert f"leave out {option[0]}".encode() in made.stderr
    assert not cl.with_suffix(".nc").exists()


@pytest.mark.parametrize("line", ["T3 M6", "M6 T3", "N5 t3", "T#101 M6"])
@pytest.mark.parametrize(("control", "code"), [("fanuc", USAGE), ("linuxcnc", USAGE), ("siemens", DONE)])
def test_a_header_loads_no_tool_beside_the_length_of_another(
    line: str, control: str, code: int, tmp_path: Path
) -> None:
    (tmp_path / "points.csv").write_text(TABLE)
    (tmp_path / "head.txt").write_text(f"{line}\n")
    options = ("--header", "head.txt", "--control", control, *CONTROLS[control], "--no-verify", "--feed", "500")
    made = run("smooth", "points.csv", *options, "-o", "p.nc", cwd=tmp_path)
    assert made.returncode == code, made.stderr
    assert (b"give --tool-number" in made.stderr) == (code == USAGE)


def test_comments_of_a_header_load_nothing(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text(TABLE)
    (tmp_path / "head.txt").write_text("(T3 IS THE BALL)\nM31 (T4)\n")
    made = run(
        "smooth", "points.csv", "--header", "head.txt", "--feed", "500", "-o", "p.nc", "--no-verify", cwd=tmp_path
    )
    assert made.returncode == DONE, made.stderr


@pytest.mark.parametrize(
    ("control", "feed", "said"),
    [
        ("fanuc", "100001", b"F100000 mm/min"),
        ("fanuc", "100000", None),
        ("heidenhain", "123456", b"F99999.999 mm/min"),
        ("siemens", "123456", None),
        ("siemens", "1234567", b"F999999.999 mm/min"),
        ("linuxcnc", "1234567", None),
    ],
)
def test_a_feed_beyond_what_the_control_takes_is_a_warning(
    control: str, feed: str, said: bytes | None, cl: Path
) -> None:
    cl.write_text(PARTS.replace("FEDRAT/500", f"FEDRAT/{feed}"))
    made = run("smooth", cl, "-o", "-", "--control", control, *CONTROLS[control])
    assert made.returncode == DONE, made.stderr
    assert ("CHECK   CL line 7: feed beyond the" in one_line(made.stderr)) == (said is not None)
    assert said is None or said in made.stderr


@pytest.mark.parametrize("control", CONTROLS)
def test_lines_end_as_asked_for(control: str, cl: Path) -> None:
    options = ("smooth", cl, "-o", "-", "--control", control, *CONTROLS[control], "-q", "CORNERSMOOTH_BLOCK_NUMBERS=1")
    plain, windows = run(*options).stdout, run(*options, "CORNERSMOOTH_LINE_ENDS=crlf").stdout
    assert b"\r" not in plain
    assert windows == plain.replace(b"\n", b"\r\n")
    assert run(*options, "CORNERSMOOTH_LINE_ENDS=lf").stdout == plain


def test_planned_feeds_are_put_into_lines_of_any_end(cl: Path) -> None:
    options = ("smooth", cl, "-o", "-", "-q", "--feed-from-plan", "--accel", "500", "--jerk", "5000")
    plain = run(*options).stdout
    assert len(re.findall(rb" F\d", plain)) > 10
    assert run(*options, "CORNERSMOOTH_LINE_ENDS=crlf").stdout == plain.replace(b"\n", b"\r\n")


@pytest.mark.parametrize(
    ("control", "names", "said"),
    [
        ("fanuc", ("a.cls", "b.cls"), b"a.cls, b.cls: all become program O0001"),
        ("fanuc", ("a1.cls", "b1.cls", "c2.cls"), b"a1.cls, b1.cls: all become program O0001"),
        ("fanuc", ("a1.cls", "b2.cls"), None),
        ("heidenhain", ("a-b.cls", "a_b.cls", "c.cls"), b"a-b.cls, a_b.cls: all become program A_B"),
        ("siemens", ("a-b.cls", "a_b.cls"), None),  # the name of the file is that of the program
    ],
)
def test_programs_of_a_batch_with_the_same_number_are_named(
    control: str, names: tuple[str, ...], said: bytes | None, tmp_path: Path
) -> None:
    for name in names:
        (tmp_path / name).write_text(PARTS)
    made = run("smooth", *names, "-d", "out", "--control", control, cwd=tmp_path)
    assert made.returncode == DONE, made.stderr
    assert (b"all become program" in made.stderr) == (said is not None)
    assert said is None or said in made.stderr


def test_a_stop_in_place_of_an_end_says_the_feed_again(cl: Path) -> None:
    cl.write_text(PARTS.replace("STOP", "END", 1))
    lines = run("smooth", cl, "-o", "-", "-q").stdout.decode().splitlines()
    after = lines[lines.index("M0") :]
    assert next(line for line in after if line.startswith("G1")).endswith(" F500.")


def test_bad_speeds_are_refused(cl: Path) -> None:
    for given in ("fast", "0", "-3", "100,LEFT", "inf"):
        made = run("smooth", cl, "--spindle", given)
        assert made.returncode == USAGE
        assert b"give it as 8000 or 8000,CCLW" in made.stderr


STANDING = """UNITS/MM
LOADTL/3
SPINDL/8000,CLW
RAPID
GOTO/0,0,50,{first}
FEDRAT/1000,MMPM
GOTO/0,0,0,{first}
GOTO/10,0,0,{first}
GOTO/10,0,0,{second}
GOTO/20,0,0,{second}
RAPID
GOTO/20,0,50,{second}
FINI
"""


@pytest.mark.parametrize(
    "machine",
    [
        ("--control", "fanuc"),
        ("--control", "siemens"),
        ("--control", "heidenhain"),
        ("--control", "fanuc", "--machine", "table-ac"),
        ("--control", "haas", "--machine", "table-bc"),
        ("--control", "siemens", "--machine", "head-table-bc"),
        ("--control", "linuxcnc", "--machine", "xyzac-trt"),
        ("--control", "linuxcnc", "--machine", "xyzbc-trt"),
    ],
)
def test_a_turn_about_a_standing_tip_is_one_block_where_the_axes_run_evenly(
    machine: tuple[str, ...], tmp_path: Path
) -> None:
    directions = [f"0,{math.sin(math.radians(angle))},{math.cos(math.radians(angle))}" for angle in (10.0, 40.0)]
    cl = tmp_path / "part.cls"
    cl.write_text(STANDING.format(first=directions[0], second=directions[1]))
    made = run("smooth", cl, *machine, "-o", "-", "-e", "0.01")
    assert made.returncode == DONE, made.stderr
    there = re.compile(r"(?:\d+ )?(?:G1|LN?) X[+]?10\.0* Y[+]?0\.0* Z[+]?0\.0* ")
    rows = [line for line in made.stdout.decode().splitlines() if there.match(line)]
    assert len(rows) == 2, rows  # from the corner before to the corner after
