"""The command line as shops and scripts rely on it: one test for each promise of docs/smooth.md."""

from __future__ import annotations

import json
import os
import re
import stat
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from cornersmooth.cl.dialects import NAMES
from oracle.command import (
    BAD_INPUT,
    BAD_OUTPUT,
    DONE,
    SMALL,
    USAGE,
    message,
    only,
    quiet,
    run,
    run_process,
    run_script,
    seen_on_a_terminal,
)
from oracle.messages import one_line
from oracle.nc_text import Line, parse

ESCAPE = b"\x1b"


# ---------------------------------------------------------------- success, streams


def test_done_is_zero_and_text_goes_to_out_alone(small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    result = run("smooth", small, "-e", "0.04", "-o", out)
    assert (result.returncode, result.stdout) == (DONE, b"")
    assert any(isinstance(block, Line) for block in parse(out.read_bytes(), "g1").blocks)
    assert only(tmp_path, "small.cls", "out.nc")
    assert stat.S_IMODE(out.stat().st_mode) == 0o666 & ~_umask()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_standard_output_is_the_default_and_a_dash(small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    run("smooth", small, "-o", out)
    implied, named = run_process("smooth", small), run("smooth", small, "-o", "-")
    assert implied.returncode == named.returncode == DONE
    assert implied.stdout == named.stdout == out.read_bytes()
    assert b"G1" not in implied.stderr
    parse(implied.stdout, "g1")


def test_standard_input_is_a_dash(small: Path) -> None:
    """What stands in the text of a file but its name."""
    piped, named = run_process("smooth", "-", data=SMALL), run("smooth", small)
    assert piped.returncode == named.returncode == DONE
    text = [block for block in piped.stdout.splitlines() if block[:1] != b"("]
    assert text == [block for block in named.stdout.splitlines() if block[:1] != b"("]
    lines = [block for block in parse(piped.stdout, "g1").blocks if isinstance(block, Line)]
    assert lines[0].end[:3] == (0, 0, 0)
    assert lines[-1].end[:3] == (20, 10, 0)


def test_same_input_same_bytes_wherever_it_stands(small: Path, tmp_path: Path) -> None:
    there = tmp_path / "deeper" / "folder"
    there.mkdir(parents=True)
    (there / "small.cls").write_bytes(SMALL)
    first = run("smooth", small).stdout
    assert first == run("smooth", "small.cls", cwd=there).stdout
    assert str(tmp_path).encode() not in first


def test_lengths_take_inches(small: Path) -> None:
    assert run("smooth", small, "-e", "0.001in").stdout == run("smooth", small, "-e", "0.0254").stdout
    assert run("smooth", small, "-e", "0.001in").stdout != run("smooth", small, "-e", "0.001").stdout
    assert run("smooth", small, "-H", "1in").stdout == run("smooth", small, "-H", "25.4").stdout


def test_output_speaks_the_units_of_the_input(small: Path) -> None:
    inch = SMALL.replace(b"UNITS/MM", b"UNITS/INCHES").replace(b"MMPM", b"IPM")
    written = parse(run("smooth", "-", data=inch).stdout, "g1")
    assert written.units == "inch"
    assert max(block.end[0] for block in written.blocks if isinstance(block, Line)) == pytest.approx(20 * 25.4)


@pytest.mark.parametrize("form", ["g1", "g6.2"])
def test_forms(small: Path, form: str) -> None:
    result = run("smooth", small, "-f", form, "-e", "0.04", "--method", "proportional")
    assert result.returncode == DONE
    parse(result.stdout, "g6.2" if form == "g6.2" else "g1")


def test_reports(small: Path, tmp_path: Path) -> None:
    result = run("smooth", small, "-o", "o.nc", "--report", "r.json", "--report", "r.csv", cwd=tmp_path)
    assert result.returncode == DONE
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["schema"] == "cornersmooth-report/2"
    assert report["summary"]["corners"] == report["summary"]["smoothed"] == 2
    head, *rows = (tmp_path / "r.csv").read_text().splitlines()
    assert head == (
        "corner,line,x,y,z,tip_angle_deg,axis_angle_deg,tip_length_in_mm,tip_length_out_mm,axis_length_in_mm,"
        "axis_length_out_mm,tip_error_mm,axis_error_mm,orientation_error_deg,curvature_max_per_mm,limited_by,status"
    )
    assert [row.split(",")[1] for row in rows] == ["8", "9"]


def test_reports_are_not_overwritten_and_broken_ones_leave_no_output(small: Path, tmp_path: Path) -> None:
    (tmp_path / "r.json").write_text("mine")
    result = run("smooth", small, "-o", tmp_path / "o.nc", "--report", tmp_path / "r.json")
    assert result.returncode == BAD_OUTPUT
    assert (tmp_path / "r.json").read_text() == "mine"
    assert only(tmp_path, "small.cls", "r.json")
    assert run("smooth", small, "-o", tmp_path / "o.nc", "--report", tmp_path / "r.json", "--force").returncode == DONE


def test_quiet_says_nothing_and_verbose_more(small: Path, tmp_path: Path) -> None:
    plain, silent, verbose = (
        run("smooth", small, "-o", tmp_path / f"{k}.nc", *extra) for k, extra in enumerate(([], ["-q"], ["-v"]))
    )
    assert silent.stderr == b""
    assert plain.stderr
    assert len(verbose.stderr.splitlines()) > len(plain.stderr.splitlines())


def test_quiet_still_says_errors(tmp_path: Path) -> None:
    result = run("smooth", tmp_path / "none.cls", "-q")
    assert result.returncode == BAD_INPUT
    assert "none.cls" in message(result.stderr)


# ---------------------------------------------------------------- looks


def test_no_colour_and_no_progress_bar_in_a_file(medium: Path, small: Path, tmp_path: Path) -> None:
    for part, more in ((medium, []), (small, ["-v"])):
        result = run("smooth", part, "-o", tmp_path / f"{part.stem}.nc", *more)
        assert result.returncode == DONE
        assert ESCAPE not in result.stderr
        assert b"\r" not in result.stderr


@pytest.mark.parametrize("no_color", [True, False])
def test_colour_on_a_terminal_unless_no_color(small: Path, tmp_path: Path, no_color: bool) -> None:
    extra = {"NO_COLOR": "1"} if no_color else {}
    seen = seen_on_a_terminal("smooth", small, "-o", tmp_path / "o.nc", out=False, TERM="xterm-256color", **extra)
    assert seen
    coloured = re.search(rb"\x1b\[[0-9;]*(?:3[1-7]|9[0-7]|38;5;\d+)m", seen) is not None
    assert coloured is not no_color


@pytest.mark.parametrize("args", [["--help"], ["-h"], ["smooth", "--help"], ["smooth", "-h"]])
def test_help_has_examples(args: list[str]) -> None:
    result = run(*args)
    assert result.returncode == DONE
    assert result.stderr == b""
    assert re.search(rb"(?i)examples?", result.stdout)
    assert re.search(rb"cornersmooth smooth \S+", result.stdout)


def test_help_names_all_dialects() -> None:
    said = " ".join(run("info", "--help").stdout.decode().split())
    listed = re.search(r"CL dialect, instead of what the file looks like: (.+?)\.", said)
    assert listed
    assert set(re.split(r", | or ", listed[1])) == set(NAMES)


def modules_of(args: Sequence[str]) -> set[str]:
    """What is imported by a run that ends well."""
    code = f"import sys; from cornersmooth.cli import run; code = run({args}); print(code, *sys.modules, sep='\\n')"
    env = {name: value for name, value in os.environ.items() if not name.startswith("CORNERSMOOTH_")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=env)
    said = done.stdout.splitlines()
    return set(said[said.index("0") :])


@pytest.mark.parametrize("args", [["--help"], ["smooth", "--help"], ["verify", "--help"], ["time", "--help"]])
def test_help_waits_for_nothing_it_does_not_need(args: list[str]) -> None:
    """What takes long to import is imported where it is used."""
    modules = modules_of(args)
    assert "cornersmooth.cli" in modules
    assert not {"numpy", "scipy", "rich", "matplotlib", "difflib", "multiprocessing", "asyncio"} & modules


def test_smoothing_alone_waits_for_nothing_it_does_not_call(small: Path, tmp_path: Path) -> None:
    """Without limits of axes there is no time to plan, and without a machine no rotary axis."""
    modules = modules_of(["smooth", str(small), "-o", str(tmp_path / "out.nc")])
    assert "cornersmooth.verify" in modules
    unused = {f"cornersmooth.{name}" for name in "feedrate times rotary filter page surface cli.batch".split()}
    assert not (unused | {"scipy", "rich", "concurrent.futures"}) & modules


def test_version() -> None:
    result = run_script("--version")
    assert result.returncode == DONE
    assert re.fullmatch(rb"cornersmooth,? (?:version )?\d+\.\d+\.\d+\S*\n", result.stdout)


# ---------------------------------------------------------------- 2: usage


@pytest.mark.parametrize(
    "args",
    [
        [],
        ["-e", "0"],
        ["-e", "-0.01"],
        ["-e", "nan"],
        ["-e", "inf"],
        ["-e", "1e-9"],
        ["-e", "abc"],
        ["-e", "0.01furlong"],
        ["-H", "0"],
        ["-H", "nan"],
        ["-f", "g7"],
        ["--method", "magic"],
        ["--control", "nobody"],
        ["--no-such-option"],
        ["--report", "r.txt"],
        ["-j", "x"],
        ["-o", "a.nc", "-d", "b"],
    ],
)
def test_wrong_usage_is_two(small: Path, tmp_path: Path, args: list[str]) -> None:
    result = run("smooth", *([small] if args else []), *args, cwd=tmp_path)
    assert result.returncode == USAGE
    assert result.stdout == b""
    assert quiet(result.stderr)
    assert result.stderr
    assert only(tmp_path, "small.cls")


def test_errors_of_usage_are_one_line(small: Path) -> None:
    for args in (
        ["smooth"],
        ["smooth", small, "--nope"],
        ["smooth", small, "-e", "abc"],
        ["verify", small],
        ["polish"],
    ):
        said = one_line(run(*args).stderr)
        assert re.fullmatch(r"error: .+; .+\n", said), said


def test_unknown_command_is_two() -> None:
    assert run_script("polish").returncode == USAGE


def test_an_option_that_looks_like_a_tolerance_below_the_digits(small: Path) -> None:
    """Rounding is taken off the tolerance: what cannot be kept is refused, with what can."""
    result = run("smooth", small, "-e", "0.00005")
    assert result.returncode == USAGE
    assert "5e-05" in message(result.stderr)


# ---------------------------------------------------------------- 3: input

BAD_INPUTS = {
    "empty": (b"", None),
    "blank": (b"\n  \n\r\n", None),
    "binary": (bytes(range(256)) * 40, None),
    "zeros": (b"\0" * 4096, None),
    "elf": (b"\x7fELF\x02\x01\x01" + bytes(64), None),
    "nan": (SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,nan,0,0,0.1,1"), 9),
    "infinity": (SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,inf,0,0,0.1,1"), 9),
    "overflow": (SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,1e999,0,0,0.1,1"), 9),
    "axis nan": (SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,10,0,0,NaN,1"), 9),
    "axis zero": (SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,10,0,0,0,0"), 9),
    "five numbers": (SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,10,0,0,0.1"), 9),
    "not a number": (SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,1O,0,0,0.1,1"), 9),
    "csv nan": (b"x,y,z,i,j,k\n0,0,0,0,0,1\n1,nan,0,0,0,1\n", 3),
    "csv short": (b"x,y,z,i,j,k\n0,0,0,0,0,1\n1,0,0,0,1\n", 3),
    "prose": (b"Dear reader,\nthis is not a tool path.\n", None),
}


@pytest.mark.parametrize("name", BAD_INPUTS)
def test_bad_input_is_three_with_file_and_line(tmp_path: Path, name: str) -> None:
    data, line = BAD_INPUTS[name]
    path = tmp_path / "bad.cls"
    path.write_bytes(data)
    result = run("smooth", "bad.cls", "-o", "o.nc", cwd=tmp_path)
    assert result.returncode == BAD_INPUT
    assert quiet(result.stderr)
    text = message(result.stderr)
    place = r"bad\.cls(:\d+){0,2}" if line is None else rf"bad\.cls:{line}(:\d+)?"
    assert re.match(rf"{place}: error: [^;]+; .+", text), text
    assert only(tmp_path, "bad.cls")
    piped = (run_process if name == "binary" else run)("smooth", "-", data=data)
    assert piped.returncode == BAD_INPUT
    assert piped.stdout == b""
    assert re.match(r"<stdin>", message(piped.stderr))


def test_missing_file_and_folder_as_input(tmp_path: Path) -> None:
    for name in ("none.cls", "."):
        result = run("smooth", name, cwd=tmp_path)
        assert result.returncode == BAD_INPUT
        assert name in message(result.stderr)
        assert quiet(result.stderr)
    assert "smooth takes folders with -d" in message(run("info", ".", cwd=tmp_path).stderr)


def test_the_object_on_the_screen_is_that_of_the_file(small: Path, tmp_path: Path) -> None:
    """Nothing is left out of it that a report in a file has."""
    args = ("smooth", str(small), "--force", "-o", str(tmp_path / "out.nc"))
    shown = json.loads(run(*args, "--json").stdout)
    run(*args, "-q", "--report", str(tmp_path / "out.json"))
    kept = json.loads((tmp_path / "out.json").read_text())
    assert shown["verification"] == kept["verification"]
    assert shown["verification"]["max_tangent_jump_deg"] is not None
