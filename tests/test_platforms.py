"""The command line where the system lacks what Linux has: a file that is open can be neither moved nor removed, and
there are no forks, owners and some signals. Windows and macOS are so; a real Windows Python runs
in .ci/windows.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from cornersmooth.cli import shop
from cornersmooth.errors import OutputError
from cornersmooth.system import output, processes
from oracle.command import BAD_OUTPUT, DONE, OLD, SMALL, run
from oracle.messages import one_line

HOLES = SMALL.replace(
    b"FINI", b"CYCLE/DRILL,FEDTO,5,FEDRAT,100\nGOTO/30,10,0,0.1,0,1\nGOTO/30,20,0,0.1,0,1\nCYCLE/OFF\nFINI"
)
#: what some systems have not
MISSING = "fork forkpty getuid mkfifo fchmod sched_getaffinity pread".split()
SIGNALS = "SIGHUP SIGPIPE SIGUSR1".split()


def is_open(path: object) -> bool:
    """Whether this process has the file open."""
    real, numbers = os.path.realpath(str(path)), Path("/proc/self/fd")
    return any(os.path.realpath(number) == real for number in numbers.iterdir())


def refusing(real: Callable[..., object]) -> Callable[..., object]:
    """As Windows answers where a file is open."""

    def answer(*paths: object, **how: object) -> object:
        if any(map(is_open, paths)):
            raise PermissionError(13, "Sharing violation", str(paths[0]))
        return real(*paths, **how)

    return answer


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take away what other systems have not."""
    for name in ("replace", "rename", "unlink", "remove", "link"):
        monkeypatch.setattr(os, name, refusing(getattr(os, name)))
    for name in MISSING:
        monkeypatch.delattr(os, name, raising=False)
    for name in SIGNALS:
        monkeypatch.delattr(signal, name)
    monkeypatch.setattr(processes, "_START", "spawn")


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.cls"
    path.write_bytes(SMALL)
    return path


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def expected() -> bytes:
    """Program of the part, made before anything is missing."""
    return run("smooth", "-", "-o", "-", "-q", data=SMALL).stdout.replace(b"CL=<stdin>", b"CL=part.cls")


@pytest.mark.usefixtures("expected", "elsewhere")
@pytest.mark.parametrize("old", [False, True])
@pytest.mark.parametrize("force", [False, True])
def test_an_output_takes_its_place(part: Path, expected: bytes, old: bool, force: bool) -> None:
    out = part.with_suffix(".nc")
    if old:
        out.write_bytes(OLD)
    result = run("smooth", part, "-o", out, *["--force"] * force)
    refused = old and not force
    assert result.returncode == (BAD_OUTPUT if refused else DONE), result.stderr.decode()
    assert out.read_bytes() == (OLD if refused else expected)
    assert files(part.parent) == {"part.cls", "part.nc"}


@pytest.mark.usefixtures("elsewhere")
def test_a_program_that_is_not_good_enough_is_kept_beside(part: Path) -> None:
    part.write_bytes(HOLES)
    out = part.with_suffix(".nc")
    out.write_bytes(OLD)
    result = run("smooth", part, "-o", out, "--force", "--strict", "--skip-cycles")
    assert result.returncode == 1, result.stderr.decode()
    assert out.read_bytes() == OLD
    assert files(part.parent) == {"part.cls", "part.nc", "part.nc.failed"}


@pytest.mark.usefixtures("elsewhere")
@pytest.mark.parametrize("ending", ["json", "csv", "html"])
def test_reports_are_replaced(part: Path, ending: str) -> None:
    report = part.with_suffix(f".{ending}")
    for _ in range(2):
        assert run("smooth", part, "-o", "-", "--report", report).returncode == DONE
    assert files(part.parent) == {"part.cls", report.name}


@pytest.mark.usefixtures("elsewhere")
def test_streams_give_the_same(part: Path, expected: bytes) -> None:
    result = run("smooth", "-", data=part.read_bytes())
    assert result.returncode == DONE
    assert result.stdout == expected.replace(b"CL=part.cls", b"CL=<stdin>")


@pytest.mark.usefixtures("elsewhere")
def test_what_reads_and_compares_works(part: Path, expected: bytes) -> None:
    out = part.with_suffix(".nc")
    out.write_bytes(expected)
    assert run("verify", part, out, "--report", part.with_suffix(".json")).returncode == DONE
    assert run("info", part).returncode == DONE
    assert run("config", part).returncode == DONE
    assert run("time", part, "--limits", "table-ac", "--csv", part.with_suffix(".csv")).returncode == DONE
    assert run("filter", out, "-o", part.with_suffix(".new")).returncode == DONE


@pytest.mark.usefixtures("expected", "elsewhere")
@pytest.mark.parametrize("together", [(), ("-j", "2")])
def test_a_batch_is_made_once(part: Path, expected: bytes, together: tuple[str, ...]) -> None:
    out = part.parent / "out"
    (part.parent / "other.cls").write_bytes(SMALL)

    def last(*together: str) -> str:
        result = run("smooth", part, part.parent / "other.cls", "-d", out, *together)
        return one_line(result.stderr).splitlines()[-1]

    assert last(*together) == "2 files: 2 PASSED"
    assert (out / "part.nc").read_bytes() == expected
    assert last() == "2 files: 2 skipped"
    (out / "part.nc").write_bytes(OLD)
    assert last() == "2 files: 1 skipped, 1 error"
    assert (out / "part.nc").read_bytes() == OLD
    assert {name for name in files(out) if not name.startswith(".cornersmooth")} == {"part.nc", "other.nc"}


@pytest.mark.usefixtures("elsewhere")
def test_an_interruption_leaves_nothing(part: Path) -> None:
    out = part.with_suffix(".nc")
    out.write_bytes(OLD)

    def interrupted() -> None:
        with output.open_output(out) as made:
            made.stream.write(b"G0\n")
            assert len(files(part.parent)) == 3
            output.remove_unfinished()  # as the handler of a signal does, which then leaves
            assert files(part.parent) == {"part.cls", "part.nc"}

    with pytest.raises(OutputError):
        interrupted()
    assert out.read_bytes() == OLD


@pytest.mark.parametrize(("system", "variable"), [("nt", "APPDATA"), ("posix", "XDG_CONFIG_HOME")])
def test_settings_of_a_user_are_where_the_system_has_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, system: str, variable: str
) -> None:
    monkeypatch.setenv(variable, str(tmp_path))
    assert shop._config_folder(system) == tmp_path


def test_a_mark_that_is_lost_or_of_another_text_says_nothing(part: Path) -> None:
    out = part.with_suffix(".nc")
    with output.open_output(out) as made:
        made.stream.write(b"G0\n")
    assert output.read_mark(str(out)) is None
    output.write_mark(str(out), made.stream.digest, {"made_of": "x"})
    assert output.read_mark(str(out)) == {"made_of": "x"}
    out.write_bytes(b"G1\n")
    assert output.read_mark(str(out)) is None


@pytest.mark.parametrize("rest", [b"G1\n", b"G1 X1\n" * 200_000])
@pytest.mark.parametrize("place", [None, 0, 2, -1])
def test_a_patched_text_has_its_own_hash_and_no_other_change(tmp_path: Path, rest: bytes, place: int | None) -> None:
    out = tmp_path / "o.nc"
    refused = contextlib.nullcontext() if place is None else pytest.raises(OutputError, match="CS407")
    with refused, output.open_output(out) as made:
        made.stream.write(b"(--)\n" + rest)
        made.stream.patch(made.path, 1, b"ab")
        if place is not None:
            with open(made.path, "r+b") as file:
                file.seek(place, os.SEEK_END if place < 0 else os.SEEK_SET)
                file.write(b"#")
    if place is None:
        assert out.read_bytes() == b"(ab)\n" + rest
        assert made.stream.digest == hashlib.sha256(b"(ab)\n" + rest).hexdigest()
    else:
        assert not out.exists()
