"""What strangers leave: pipes and devices in a folder, files that grow without bound, and files of killed runs."""

from __future__ import annotations

import gzip
import os
import re
import socket
import sys
import time
from pathlib import Path

import pytest

from cornersmooth import read
from cornersmooth.cl import source
from cornersmooth.errors import InputError
from cornersmooth.system.output import _ABANDONED
from oracle.command import SMALL, run

unix = pytest.mark.skipif(sys.platform == "win32", reason="pipes in folders are of Unix")


@unix
def test_pipes_devices_and_sockets_of_a_folder_are_skipped_with_a_reason(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "part.cls").write_bytes(SMALL)
    os.mkfifo(folder / "pipe.cls")
    (folder / "zero.cls").symlink_to("/dev/zero")
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(folder / "socket.cls"))
        found = run("smooth", folder, "-d", tmp_path / "out")
    said = found.stderr.decode().splitlines()
    assert found.returncode == 0
    assert sorted(Path(line.split(":")[0]).name for line in said if ": skipped: " in line) == [
        "pipe.cls",
        "socket.cls",
        "zero.cls",
    ]
    assert [path.name for path in (tmp_path / "out").glob("[!.]*")] == ["part.nc"]


def test_an_input_beyond_the_limit_is_an_error_that_names_the_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "part.cls"
    path.write_bytes(SMALL)
    monkeypatch.setattr(source, "LARGEST", len(SMALL) - 1)
    monkeypatch.setattr(source.read_bounded, "__kwdefaults__", {"size_limit": True, "most": len(SMALL) - 1})
    for command in (["info", path], ["smooth", path, "-o", tmp_path / "o.nc"]):
        found = run(*command)
        assert found.returncode == 3
        assert b"CORNERSMOOTH_NO_SIZE_LIMIT=1" in found.stderr
        assert run(*command, "CORNERSMOOTH_NO_SIZE_LIMIT=1").returncode == 0


def test_a_gzip_file_that_grows_without_measure_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "_ALWAYS", 1 << 12)
    whole = SMALL.replace(b"FINI", b"$$ " + 2_000_000 * b"A" + b"\nFINI")
    with pytest.raises(InputError) as refused:
        read(gzip.compress(whole))
    assert refused.value.code == "CS199"
    assert len(read(gzip.compress(whole), size_limit=False)) == len(read(SMALL))
    assert len(read(gzip.compress(SMALL))) == len(read(SMALL))


@unix
def test_what_a_killed_run_has_left_goes_with_a_run_of_the_next_day(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_bytes(SMALL)
    left = tmp_path / ".o.nc.4711-01234567.part"
    others = (
        tmp_path / ".o.nc.4712-01234567.part",  # somebody may be at it
        tmp_path / ".other.nc.4711-01234567.part",
    )
    for path in (left, *others):
        path.touch()
    for path in (left, others[1]):
        os.utime(path, (time.time() - 2 * _ABANDONED,) * 2)
    assert run("smooth", tmp_path / "part.cls", "-o", tmp_path / "o.nc").returncode == 0
    assert not left.exists()
    assert all(path.exists() for path in others)


@pytest.mark.parametrize(
    "block", ["{program.__class__.__mro__}", "{program:>999999999}", "{program!r}", "{program[0]}", "{}", "{0}"]
)
def test_braces_are_filled_by_name_only(block: str, tmp_path: Path) -> None:
    table = tmp_path / "own.toml"
    table.write_text(f'like = "fanuc"\n[program]\nstart = ["O1", "({block})"]\n')
    (tmp_path / "part.cls").write_bytes(SMALL)
    found = run("smooth", tmp_path / "part.cls", "--control", table, "-o", tmp_path / "o.nc")
    assert found.returncode == 2
    assert b"unknown braces" in found.stderr
    (tmp_path / "head.txt").write_text(f"({block})\n")
    found = run("smooth", tmp_path / "part.cls", "--header", tmp_path / "head.txt", "-o", tmp_path / "o.nc")
    assert found.returncode == 2
    assert b"unknown braces" in found.stderr


@pytest.mark.parametrize(
    "pattern",
    [
        "(a+)+$",
        "(a|aa)" * 28 + "b",
        "a?" * 24 + "a" * 24,
        "(a|a)*b",
        "(?:a*)*",
        "a*a*a*a*a*b",
        "(",
        "x" * 201,
        "([)]){3}",
    ],
)
def test_patterns_of_tables_cannot_run_without_end(pattern: str, tmp_path: Path) -> None:
    table = tmp_path / "own.toml"
    table.write_text(f"like = 'fanuc'\n[program]\nname_pattern = '{pattern}'\n")
    (tmp_path / "part.cls").write_bytes(SMALL)
    found = run(
        "smooth", tmp_path / "part.cls", "--control", table, "-o", tmp_path / "o.nc", "--program-name", "a" * 40
    )
    assert found.returncode == 2
    assert b"name_pattern" in found.stderr


@pytest.mark.parametrize("where", ["table", "settings"])
def test_nesting_without_end_is_no_toml(where: str, tmp_path: Path) -> None:
    deep = "x = " + 100_000 * "[" + "\n"
    (tmp_path / "part.cls").write_bytes(SMALL)
    more = []
    if where == "table":
        (tmp_path / "own.toml").write_text(deep)
        more = ["--control", tmp_path / "own.toml"]
    else:
        (tmp_path / "cornersmooth.toml").write_text(deep)
    found = run("smooth", tmp_path / "part.cls", "-o", tmp_path / "o.nc", *more)
    assert found.returncode == 2
    assert b"nested too deeply" in found.stderr


@unix
@pytest.mark.parametrize("quiet", [(), ("-q",)])
@pytest.mark.parametrize("words", ["smooth part.cls -o o.nc", "smooth part.cls -d out", "verify part.cls o.nc"])
def test_settings_that_loosen_or_that_anybody_may_write_are_named(
    words: str, quiet: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "part.cls").write_bytes(SMALL)
    assert run("smooth", "part.cls", "-e", "5", "-o", "o.nc", cwd=tmp_path).returncode == 0
    settings = tmp_path / "cornersmooth.toml"
    settings.write_text("".join(f"[{name}]\ntolerance = 5\n" for name in ("smooth", "verify")))
    settings.chmod(0o644)
    command = (*words.split(), *(("--force",) if words.startswith("smooth") else ()), *quiet)

    def said(*more: str) -> str:
        found = run(*command, *more, cwd=tmp_path)
        assert found.returncode == 0
        return " ".join((found.stderr + found.stdout).decode().split())  # lines that were folded

    text = said()
    assert text.count("the tolerance 5 mm is larger than the default 0.01 mm: ") == 1
    verdict, where = re.split(r";? the tolerance 5 mm is larger", text, maxsplit=1)
    assert re.search(r"PASSED\W[^;]*within 5 mm everywhere$", verdict)
    assert "cornersmooth.toml" in where
    assert "anybody" not in text
    settings.chmod(0o666)
    assert "these settings are obeyed, and anybody may change them" in said()
    assert "larger than the default" not in said("-e", "5")


@unix
def test_tables_and_programs_without_end_are_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "part.cls").write_bytes(SMALL)
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    found = run("smooth", tmp_path / "part.cls", "--control", tmp_path / "zero.toml", "-o", tmp_path / "o.nc")
    assert found.returncode == 2
    assert b"longer than a table" in found.stderr
    monkeypatch.setattr("cornersmooth.control.source._LARGEST", 1 << 16)
    found = run("verify", tmp_path / "part.cls", "/dev/zero", "--control", "fanuc")
    assert found.returncode == 3
    assert b"more than 2 GB" in found.stderr
