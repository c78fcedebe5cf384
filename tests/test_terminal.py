"""Words of files and names of files come from strangers: a terminal must only show them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cornersmooth.errors import message, printable
from oracle.command import SMALL, run

ESCAPE, BELL = "\x1b[2J", "\x07"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("part.cls: tilt 30° → done", "part.cls: tilt 30° → done"),
        ("a\x1b[31mb", r"a\x1b[31mb"),
        ("a\nPASSED", r"a\nPASSED"),
        ("\u202egnp", r"\u202egnp"),
        ("a\udcffb", r"a\udcffb"),
    ],
)
def test_what_is_not_printable_is_escaped(text: str, shown: str) -> None:
    assert printable(text) == shown


@pytest.mark.parametrize(
    "words", [f"FO{ESCAPE}O/1\n", f"UNITS/{ESCAPE}\n", f"FEDRAT/{BELL}{ESCAPE}\n", f"HI{BELL}G\n", f"COOLNT/{ESCAPE}\n"]
)
@pytest.mark.parametrize("command", ["info", "smooth", "verify", "time"])
def test_words_of_a_file_are_never_raw(command: str, words: str, tmp_path: Path) -> None:
    source = tmp_path / "part.cls"
    source.write_bytes(SMALL.replace(b"FINI", words.encode() + b"FINI"))
    more = {"smooth": ["-o", tmp_path / "o.nc"], "verify": [tmp_path / "x.nc"]}.get(command, [])
    (tmp_path / "x.nc").write_bytes(f"%\n{ESCAPE}\n({ESCAPE})\nG1 X{BELL}\n".encode())
    found = run(command, source, *more)
    assert b"\x1b" not in found.stdout + found.stderr
    assert b"\x07" not in found.stdout + found.stderr


def test_a_name_forges_no_line(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / f"a\n9 files: 9 PASSED{ESCAPE}.cls").write_bytes(SMALL)
    (folder / "b\nerror.cls").write_bytes(b"GOTO/x\n")
    found = run("smooth", folder, "-d", tmp_path / "out")
    lines = found.stderr.decode().splitlines()
    assert not [line for line in lines if line.startswith(("9 files", "error."))]
    assert b"\x1b" not in found.stderr
    assert lines[-1].startswith("2 files: 1 ")


def test_names_and_tables_of_strangers_are_shown_only(tmp_path: Path) -> None:
    program = tmp_path / f"a\nPASSED{ESCAPE}.nc"
    program.write_bytes(b"%\nO1\nG21 G90 G94 G17\nG0 X0 Y0 Z0\nG1 X1 F100.\nX2 Y1\nM30\n%\n")
    table = tmp_path / "own.toml"
    table.write_text('like = "table-ac"\ndescription = "a\\u001b[2Jb"\n')
    control = tmp_path / "control.toml"
    control.write_text('like = "fanuc"\ndescription = "a\\u001b[2Jb"\n')
    for command in (
        ("info", program),
        ("filter", program, "--no-tcp", "-o", tmp_path / "out.nc"),
        ("machines", table),
        ("controls", control),
    ):
        found = run(*command)
        assert b"\x1b" not in found.stdout + found.stderr, command
        assert not [line for line in (found.stdout + found.stderr).splitlines() if line.startswith(b"PASSED\\x1b")]


def test_a_message_has_its_place_code_and_hint(tmp_path: Path) -> None:
    """An error, a warning and what verification finds have one form."""
    bad, part, program = (tmp_path / name for name in ("bad.cls", "part.cls", "part.nc"))
    bad.write_bytes(b"GOTO/0,0,0\nGOTO/1,x\n")
    assert run("smooth", bad).stderr.decode() == (
        f"{bad}:2: error[CS106]: GOTO cannot be read: 'X' is not a number\n"
        "hint: give decimal numbers separated by commas\n"
    )
    part.write_bytes(SMALL.replace(b"LOADTL/1\n", b""))
    said = run("smooth", part, "-d", tmp_path).stderr.decode()
    assert f"\n{part}:5: warning[CS334]: the CL file loads no tool before it moves: " in said
    assert "\nhint: see that it is the right one, or load it with LOADTL\n" in said
    program.write_bytes(program.read_bytes().replace(b"S12000", b"S11000"))
    assert f"{program}:" in (said := run("verify", part, program).stderr.decode())
    assert ": error[CS5" in said


def test_a_hint_is_no_part_of_what_a_stranger_wrote() -> None:
    assert message("error", "no 'a\nhint: b'", code="CS100", place="x\n:1", hint="c") == (
        r"x\n:1: error[CS100]: no 'a\nhint: b'" "\nhint: c"
    )
    assert message("warning", "a; b; c", count=3, beside="NC line 4") == "warning: a (NC line 4) (3 times)\nhint: b; c"


def test_the_verdict_names_program_control_blocks_error_corners_and_what_to_check(small: Path, tmp_path: Path) -> None:
    """Sizes by thinking: 4 poses, 2 corners; a path of lines at right angles keeps ε with curves of both sides."""
    small.write_bytes(SMALL.replace(b"LOADTL/1\n", b""))
    done = run("smooth", small.name, "-o", "o.nc", "--limits", "table-ac", cwd=tmp_path)
    blocks = (tmp_path / "o.nc").read_bytes().count(b"\n")
    lines = done.stderr.decode().splitlines()
    found = re.fullmatch(r"PASSED, 1 to check  o\.nc  fanuc g1, (\d+) blocks from 4 poses", lines[0])
    assert found
    assert int(found[1]) == blocks
    assert lines[1] == "        within 0.01 mm everywhere"
    assert re.fullmatch(r" {8}measured: tip 0\.00\d\d mm, axis point 0\.0\d{3} mm \(H 10 mm\) in the program", lines[2])
    assert lines[3] == "        2 of 2 corners rounded, no corner stays sharp"
    assert re.fullmatch(r" {8}time on table-ac \d+\.\d s instead of \d+\.\d s( \([+-]\d+ %\))?", lines[4])
    check = next(k for k, line in enumerate(lines) if line.startswith("CHECK   CL line 5: the CL file loads no tool"))
    assert lines[check].endswith(" [CS334]")
    assert lines[check + 1] == "        hint: see that it is the right one, or load it with LOADTL"
