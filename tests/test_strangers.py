"""What strangers leave: pipes and devices in a folder, files that grow without bound, and files of killed runs."""

from __future__ import annotations

import gzip
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from cornersmooth import read
from cornersmooth.cl import source
from cornersmooth.errors import InputError
from cornersmooth.output import _machine
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
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["part.nc"]


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
        assert b"--no-size-limit" in found.stderr
        assert run(*command, "--no-size-limit").returncode == 0


def test_a_gzip_file_that_grows_without_measure_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "_ALWAYS", 1 << 12)
    whole = SMALL.replace(b"FINI", b"$$ " + 2_000_000 * b"A" + b"\nFINI")
    with pytest.raises(InputError) as refused:
        read(gzip.compress(whole))
    assert refused.value.code == "CS199"
    assert len(read(gzip.compress(whole), size_limit=False)) == len(read(SMALL))
    assert len(read(gzip.compress(SMALL))) == len(read(SMALL))


@unix
def test_what_a_killed_run_has_left_goes_with_the_next_run(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_bytes(SMALL)
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    left = tmp_path / f".o.nc.{int(gone.stdout)}-01234567-{_machine()}.part"
    others = (
        tmp_path / f".o.nc.{os.getpid()}-01234567-{_machine()}.part",  # of a process that is at work
        tmp_path / f".o.nc.{int(gone.stdout)}-01234567-0badcafe.part",  # of another computer
        tmp_path / f".other.nc.{int(gone.stdout)}-01234567-{_machine()}.part",
    )
    for path in (left, *others):
        path.touch()
    assert run("smooth", tmp_path / "part.cls", "-o", tmp_path / "o.nc").returncode == 0
    assert not left.exists()
    assert all(path.exists() for path in others)
