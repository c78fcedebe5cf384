"""Corners of everyday use, each of which was met by a user."""

from __future__ import annotations

import json
import os
import re
import subprocess
from importlib.resources import files
from pathlib import Path

import pytest

from oracle.command import BAD_INPUT, DONE, SCRIPT, SMALL, USAGE, environment, run
from oracle.json_schema import faults
from oracle.messages import one_line


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.cls"
    path.write_bytes(SMALL)
    return path


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
def test_a_program_without_a_work_offset(part: Path, control: str) -> None:
    out = part.with_suffix(".nc")
    assert run("smooth", part, "--control", control, "--work-offset", "none", "-o", out).returncode == DONE
    found = run("verify", part, out)
    assert found.returncode == 1
    assert b"NOT VERIFIED: that no work offset is selected is the program's own word" in found.stdout
    assert b"--work-offset none" in found.stdout
    assert run("verify", part, out, "--work-offset", "none").stdout.startswith(b"PASSED")
    other = run("verify", part, out, "--work-offset", "G55")
    assert other.returncode == USAGE
    assert "write the program with 'smooth --work-offset'" in one_line(other.stderr)


def test_a_work_offset_that_is_missing_is_named_as_a_machinist_does(part: Path) -> None:
    out = part.with_suffix(".nc")
    run("smooth", part, "-o", out)
    out.write_bytes(out.read_bytes().replace(b"G54\n", b""))
    found = run("verify", part, out)
    assert "work offset: one such as G54 must come before the first motion" in one_line(found.stderr)


@pytest.mark.parametrize(("command", "other"), [("smooth", "filter"), ("filter", "smooth")])
def test_the_wrong_kind_of_input_is_named_before_the_output(part: Path, command: str, other: str) -> None:
    out, program = part.with_name("old.nc"), part.with_suffix(".nc")
    run("smooth", part, "-o", program)
    out.write_bytes(b"old")
    result = run(command, program if command == "smooth" else part, "-o", out)
    assert result.returncode == BAD_INPUT
    assert f"'cornersmooth {other}'" in one_line(result.stderr)
    assert out.read_bytes() == b"old"


def test_axis_of_linuxcnc_opens_a_cl_file(part: Path) -> None:
    """Run the command of docs/linuxcnc.md as AXIS does: by a shell, with the file behind it."""
    page = (Path(__file__).parents[2] / "docs" / "linuxcnc.md").read_text()
    command = next(line.split(" = ")[1] for line in page.splitlines() if line.strip().startswith("cls = "))
    around = environment(AXIS_PROGRESS_BAR="1", PATH=f"{SCRIPT.parent}{os.pathsep}{os.environ['PATH']}")

    def opened() -> subprocess.CompletedProcess[bytes]:
        return subprocess.run(["sh", "-c", f"{command} '{part}'"], env=around, capture_output=True, check=False)

    result = opened()
    assert result.returncode == DONE
    assert result.stdout == run("smooth", part, *command.split()[2:]).stdout
    assert b"FILTER_PROGRESS=100\n" in result.stderr
    part.write_bytes(SMALL.replace(b"GOTO/10,10", b"GOTO/10,nan"))
    result = opened()
    assert (result.returncode, result.stdout) == (BAD_INPUT, b"")
    assert b"part.cls:9: error" in result.stderr


def test_axis_of_linuxcnc_opens_a_program(tmp_path: Path) -> None:
    """Run the line `ngc` of docs/linuxcnc.md as AXIS does: it loads what is printed, and nothing after an error."""
    page = (Path(__file__).parents[2] / "docs" / "linuxcnc.md").read_text()
    command = next(line.split(" = ")[1] for line in page.splitlines() if line.strip().startswith("ngc = "))
    limits = Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml"
    command = command.replace("/home/cnc/router.toml", str(limits))
    around = environment(AXIS_PROGRESS_BAR="1", PATH=f"{SCRIPT.parent}{os.pathsep}{os.environ['PATH']}")
    cuts = "".join(f"X{0.1 * k:.3f}\n" for k in range(1, 40))
    (tmp_path / "part.ngc").write_text(f"G21 G90 G94 G17\nG0 X0 Y0 Z5\nG1 Z-1 F900\n{cuts}G0 Z5\nM2\n")
    (tmp_path / "hello.ngc").write_text("hello\n")

    def opened(name: str) -> subprocess.CompletedProcess[bytes]:
        order = f"{command} '{tmp_path / name}'"
        return subprocess.run(["sh", "-c", order], env=around, capture_output=True, check=False)

    result = opened("part.ngc")
    assert result.returncode == DONE, result.stderr
    assert result.stdout.startswith(b"G21 G90 G94 G17\n")
    assert result.stdout.endswith(b"G0 Z5\nM2\n")
    assert len(result.stdout.splitlines()) < 12
    result = opened("hello.ngc")
    assert (result.returncode, result.stdout) == (BAD_INPUT, b"")


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("info", "missing.cls", "--json"), "CS100"),
        (("time", "part.cls", "--limits", "nobody", "--json"), "CS250"),
        (("info", "part.cls", "--json", "--tolerence", "1"), None),
        (("smooth", "bad.cls", "--json", "-o", "new.nc"), "CS110"),
        (("smooth", "part.cls", "--json", "-o", "bad.cls"), "CS403"),
        (("smooth", "part.cls", "--json", "-o", "part.cls"), "CS220"),
    ],
)
def test_an_error_is_an_object_too(part: Path, words: tuple[str, ...], code: str | None) -> None:
    part.with_name("bad.cls").write_text("GOTO/1,2\n")
    result = run(*words, cwd=part.parent)
    found = json.loads(result.stdout)
    schema = json.loads(files("cornersmooth.report").joinpath("error.schema.json").read_text())
    assert not [*faults(found, schema, schema)]
    assert (found["exit_code"], found["code"]) == (result.returncode, code)
    assert found["what"] in one_line(result.stderr)


@pytest.mark.parametrize(
    "words",
    [
        ("--axis-tolerance", "0"),
        ("--chord", "9"),
        ("--axis-length", "1e5"),
        ("--rewind", "1e-9", "--machine", "table-ac"),
        ("--accel", "0", "--feed-from-plan"),
    ],
)
def test_what_is_out_of_bounds_is_named_as_it_is_typed(part: Path, words: tuple[str, ...]) -> None:
    result = run("smooth", part, *words)
    assert result.returncode == USAGE
    assert f"{words[0]} is " in one_line(result.stderr) or f"'{words[0]}'" in one_line(result.stderr)


def test_limits_of_a_plan_name_its_option() -> None:
    said = " ".join(run("smooth", "--help-all").stdout.decode().split())
    for name in ("accel MM/S2", "jerk MM/S3", "period TIME"):
        assert f"--{name} With --feed-from-plan: " in said


def test_settings_of_a_shop_are_no_options(part: Path) -> None:
    """They are given by cornersmooth.toml and the environment alone."""
    refused = run("smooth", part, "--block-numbers", "-o", "-")
    assert refused.returncode == USAGE
    assert "--block-numbers is no option; write block-numbers into cornersmooth.toml" in one_line(refused.stderr)
    assert b"block-numbers" not in run("smooth", "--help-all").stdout
    (part.parent / "cornersmooth.toml").write_text("[smooth]\nblock-numbers = true\n")
    assert b"\nN" in run("smooth", part, "-o", "-", "-q").stdout
    assert "block-numbers" in run("config", part).stdout.decode()


def test_the_short_help_has_the_options_of_every_day() -> None:
    short, whole = (run("smooth", word).stdout.decode() for word in ("--help", "--help-all"))
    assert "--limits" in short
    assert "--method [" not in short
    assert "--help-all" in short
    assert "--method [" in whole
    assert len(re.findall(r"^  (?:-\w, )?--", whole, re.MULTILINE)) <= 55


def test_files_in_the_wrong_order_are_named(part: Path) -> None:
    out = part.with_suffix(".nc")
    assert run("smooth", part, "-o", out).returncode == DONE
    refused = run("verify", out, part)
    assert refused.returncode == USAGE
    assert f"write: cornersmooth verify {part} {out}" in one_line(refused.stderr)
