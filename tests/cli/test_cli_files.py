"""What the command line does to files: refusals, full disks, interruptions, many inputs."""

from __future__ import annotations

import gzip
import json
import os
import re
import resource
import signal
import stat
import subprocess
from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest

from oracle.chains import cl_text, random_chains
from oracle.command import (
    BAD_INPUT,
    BAD_OUTPUT,
    CLOSED_PIPE,
    DONE,
    OLD,
    PATIENCE,
    SMALL,
    USAGE,
    command,
    environment,
    lock,
    message,
    only,
    quiet,
    run,
    run_process,
    run_script,
    started,
    wait_for,
)
from oracle.messages import one_line
from oracle.nc_text import parse
from oracle.share import covering_share

# ---------------------------------------------------------------- 4: output


def test_standard_output_without_buffers_takes_all_of_the_program_or_none_is_done(medium: Path) -> None:
    """As in containers: what the pipe did not take at once was lost, with exit code 0."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    ran = subprocess.run(
        command("smooth", medium, "-o", "-"),
        stdout=writing,
        stderr=subprocess.PIPE,
        env=environment(PYTHONUNBUFFERED="1"),
        timeout=PATIENCE,
        check=False,
    )
    os.close(writing)
    os.close(reading)
    assert (ran.returncode, b"error[CS404]: cannot write it" in ran.stderr) == (BAD_OUTPUT, True)


def test_existing_out_is_refused_without_force(small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    out.write_text("mine")
    result = run("smooth", small, "-o", out)
    assert result.returncode == BAD_OUTPUT
    assert "--force" in message(result.stderr)
    assert out.read_text() == "mine"
    assert run("smooth", small, "-o", out, "--force").returncode == DONE
    parse(out.read_bytes(), "g1")
    assert only(tmp_path, "small.cls", "out.nc")


@pytest.mark.parametrize("how", ["same", "relative", "symlink", "hardlink", "symlink folder"])
def test_out_is_never_in(small: Path, tmp_path: Path, how: str) -> None:
    out: Path | str = tmp_path / "other.cls"
    if how == "same":
        out = small
    elif how == "relative":
        (tmp_path / "x").mkdir()
        out = "x/../small.cls"
    elif how == "symlink":
        (tmp_path / "other.cls").symlink_to(small)
    elif how == "hardlink":
        os.link(small, tmp_path / "other.cls")
    else:
        (tmp_path / "again").symlink_to(tmp_path, target_is_directory=True)
        out = tmp_path / "again" / "small.cls"
    before = sorted(os.listdir(tmp_path))
    for extra in ([], ["--force"]):
        result = run("smooth", small, "-o", out, *extra, cwd=tmp_path)
        assert result.returncode in (USAGE, BAD_OUTPUT)
        assert quiet(result.stderr)
        assert small.read_bytes() == SMALL
        assert sorted(os.listdir(tmp_path)) == before


def test_out_is_never_the_file_behind_standard_input(small: Path) -> None:
    with small.open("rb") as stream:
        result = run_process("smooth", "-", "-o", small, "--force", stdin=stream)
    assert small.read_bytes() == SMALL
    assert result.returncode in (USAGE, BAD_OUTPUT)


def test_names_that_are_no_text(small: Path, tmp_path: Path) -> None:
    odd = os.fsencode(tmp_path) + b"/b\xff.cls"
    os.rename(small, odd)
    result = run("smooth", os.fsdecode(odd), "-o", tmp_path / "o.nc", "--report", tmp_path / "r.json")
    assert result.returncode == DONE
    json.loads((tmp_path / "r.json").read_bytes())


@pytest.mark.parametrize("closed", [1, 2])
def test_closed_streams(small: Path, tmp_path: Path, closed: int) -> None:
    """Without standard error the work is done in silence; without standard output there is nowhere to write to."""
    options = ["-o", str(tmp_path / "o.nc")] if closed == 2 else []
    result = run_script("smooth", small, *options, prepare=lambda: os.close(closed))
    assert result.returncode == (BAD_OUTPUT if closed == 1 else DONE)
    assert quiet(result.stderr)


def test_report_is_neither_in_nor_out(small: Path, tmp_path: Path) -> None:
    twin = tmp_path / "path.csv"
    twin.write_bytes(b"x,y,z,i,j,k\n0,0,0,0,0,1\n10,0,0,0,0,1\n10,10,0,0,0,1\n")
    before = twin.read_bytes()
    result = run("smooth", twin, "-o", tmp_path / "o.nc", "--report", twin, "--force")
    assert result.returncode in (USAGE, BAD_OUTPUT)
    assert twin.read_bytes() == before
    result = run("smooth", twin, "-o", tmp_path / "o.csv", "--report", tmp_path / "o.csv")
    assert result.returncode in (USAGE, BAD_OUTPUT)


def test_folder_that_is_not_there_and_folder_as_out(small: Path, tmp_path: Path) -> None:
    for out in (tmp_path / "none" / "o.nc", tmp_path):
        result = run("smooth", small, "-o", out, "--force")
        assert result.returncode == BAD_OUTPUT
        assert quiet(result.stderr)
        assert re.search(r"error: [^;]+; .+", message(result.stderr))
    assert only(tmp_path, "small.cls")


def test_a_link_as_out_is_written_through(small: Path, tmp_path: Path) -> None:
    """A link to the program store stays a link."""
    (tmp_path / "store").mkdir()
    target = tmp_path / "store" / "real.nc"
    target.write_text("old")
    link = tmp_path / "link.nc"
    link.symlink_to(target)
    assert run("smooth", small, "-o", link, "--force").returncode == DONE
    assert link.is_symlink()
    parse(target.read_bytes(), "g1")


def test_a_device_is_not_replaced_by_a_file(small: Path, tmp_path: Path) -> None:
    """What holds for /dev/null must hold for any file that is not a regular one."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    result = run("smooth", small, "-o", pipe, "--force")
    got = b""
    while part := os.read(reader, 65536):
        got += part
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    if result.returncode == DONE:
        parse(got, "g1")
    else:
        assert result.returncode == BAD_OUTPUT
        assert quiet(result.stderr)


@pytest.mark.parametrize("words", [("smooth",), ("info",), ("controls",)])
def test_full_disk_on_standard_output(small: Path, words: tuple[str, ...]) -> None:
    """Whether the text is written at once or left to the end of the process."""
    with open("/dev/full", "wb") as full:
        result = run_process(*words, *([small] if words != ("controls",) else []), stdout=full)
    assert result.returncode == BAD_OUTPUT
    assert quiet(result.stderr)
    assert "no space left" in message(result.stderr)


def test_full_disk_on_standard_error(small: Path, tmp_path: Path) -> None:
    """Nothing can be said, but for the exit code."""
    with open("/dev/full", "wb") as full:
        assert run_process("polish", stderr=full).returncode == USAGE
        assert run_process("smooth", small, "-o", tmp_path / "o.nc", stderr=full).returncode == BAD_OUTPUT


@pytest.mark.parametrize("old", [None, b"old program\n"])
def test_full_disk_leaves_the_old_file_or_none(medium: Path, tmp_path: Path, old: bytes | None) -> None:
    out = tmp_path / "out.nc"
    if old is not None:
        out.write_bytes(old)

    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536))

    result = run_process("smooth", medium, "-o", out, "--force", prepare=small_files)
    assert result.returncode == BAD_OUTPUT
    assert quiet(result.stderr)
    assert "out.nc" in message(result.stderr)
    assert only(tmp_path, *(["out.nc"] if old is not None else []))
    if old is not None:
        assert out.read_bytes() == old


@pytest.mark.parametrize("more", [(), ("-o", "-"), ("--no-verify",)], ids=str)
def test_closed_pipe(medium: Path, more: tuple[str, ...]) -> None:
    with started("smooth", medium, *more) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.read(10)
        process.stdout.close()
        complaint = process.stderr.read()
        assert process.wait(PATIENCE) == CLOSED_PIPE
    assert quiet(complaint)
    assert b"BrokenPipe" not in complaint
    assert b"Exception ignored" not in complaint


#: commands, and the stream that they speak on
SPEAKING = [
    (("info", "FILE"), "stdout"),
    (("controls",), "stdout"),
    (("--help",), "stdout"),
    (("smooth", "FILE", "-o", "OUT"), "stderr"),
]


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
@pytest.mark.parametrize(("words", "says"), SPEAKING, ids=str)
def test_who_closes_the_pipe_is_told_no_verdict(
    small: Path, tmp_path: Path, words: tuple[str, ...], says: str, stream: str
) -> None:
    out = tmp_path / "o.nc"
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as closed:
        done = run_process(*({"FILE": small, "OUT": out}.get(word, word) for word in words), **{stream: closed})
    assert done.returncode == (CLOSED_PIPE if stream == says else DONE)
    assert "OUT" not in words or out.read_bytes().endswith(b"M30\n%\n")


@pytest.mark.parametrize(
    "words",
    [
        ("smooth", "NONE", "-o", "OUT"),
        ("time", "NONE", "--csv", "OUT"),
        ("verify", "NONE", "OUT", "--report", "OUT"),
        ("time", "FILE", "--text", "NONE", "--csv", "OUT"),
    ],
)
def test_a_missing_input_is_named_first(small: Path, tmp_path: Path, words: tuple[str, ...]) -> None:
    missing, out = tmp_path / "none.cls", tmp_path / "o.csv"
    out.write_bytes(OLD)
    done = run(*({"NONE": missing, "OUT": out, "FILE": small}.get(word, word) for word in words))
    assert done.returncode == BAD_INPUT
    assert message(done.stderr).startswith(f"{missing}: error: cannot read it: ")
    assert out.read_bytes() == OLD


def _reads(process: subprocess.Popen[bytes], data: bytes, out: Path) -> None:
    """It has taken in more than a pipe holds, and waits for the rest."""
    assert process.stdin is not None
    assert len(data) > 1 << 20
    process.stdin.write(data[: 1 << 20])


def _has_read(process: subprocess.Popen[bytes], data: bytes, out: Path) -> None:
    """It has everything and is alone with it."""
    assert process.stdin is not None
    process.stdin.write(data)
    process.stdin.close()
    process.stdin = None


def _begins_to_write(process: subprocess.Popen[bytes], data: bytes, out: Path) -> None:
    _has_read(process, data, out)
    wait_for(lambda: _part(out) is not None or process.poll() is not None)


def _writes(process: subprocess.Popen[bytes], data: bytes, out: Path) -> None:
    _has_read(process, data, out)
    wait_for(lambda: _size(out) > 0 or process.poll() is not None)


def _verifies(process: subprocess.Popen[bytes], data: bytes, out: Path) -> None:
    """The text is whole, and has not taken its place yet."""
    _has_read(process, data, out)
    wait_for(lambda: _ends(out) or process.poll() is not None)


def _part(out: Path) -> Path | None:
    """The file beside the output that is being written."""
    return next((path for path in out.parent.iterdir() if path != out), None)


def _size(out: Path) -> int:
    part = _part(out)
    try:
        return part.stat().st_size if part else 0
    except FileNotFoundError:
        return 0


def _ends(out: Path) -> bool:
    part = _part(out)
    try:
        return part is not None and part.read_bytes()[-2:] == b"%\n"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize(
    ("moment", "number"),
    covering_share(
        product([_reads, _has_read, _begins_to_write, _writes, _verifies], [signal.SIGINT, signal.SIGTERM]), 5
    ),
)
def test_interruption_leaves_the_old_file(
    large: Path,
    tmp_path: Path,
    number: signal.Signals,
    moment: Callable[[subprocess.Popen[bytes], bytes, Path], None],
) -> None:
    """What a run may be about when the signal comes; the last moments are short, and it may have ended by itself."""
    out, data = tmp_path / "out.nc", large.read_bytes()
    out.write_bytes(OLD)
    with started("smooth", "-", "-o", out, "--force") as process:
        moment(process, data, out)
        process.send_signal(number)
        _, complaint = process.communicate(timeout=PATIENCE)
    assert only(tmp_path, "out.nc")
    if process.returncode == DONE and moment is not _reads:
        parse(out.read_bytes(), "g1")
        return
    assert process.returncode in (128 + number, -number)
    assert quiet(complaint), complaint.decode()
    assert out.read_bytes() == OLD


# ---------------------------------------------------------------- many inputs


@pytest.fixture
def several(tmp_path: Path) -> list[Path]:
    folder = tmp_path / "in"
    folder.mkdir()
    paths = []
    for index in range(3):
        path = folder / f"part{index}.cls"
        path.write_bytes(cl_text(random_chains(index, 12, tame=True))[0])
        paths.append(path)
    return paths


def _contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob("[!.]*"))}


def test_any_number_of_processes_gives_the_same_bytes(several: list[Path], tmp_path: Path) -> None:
    for name, jobs in (("one", ["-j", "1"]), ("two", ["-j", "2"])):
        (tmp_path / name).mkdir()
        result = run_process("smooth", *several, "-d", tmp_path / name, *jobs)
        assert result.returncode == DONE, result.stderr.decode()
        assert result.stdout == b""
    assert run("smooth", *several, "-d", tmp_path / "none").returncode == DONE
    contents = _contents(tmp_path / "one")
    assert len(contents) == len(several)
    assert contents == _contents(tmp_path / "two") == _contents(tmp_path / "none")
    alone = run("smooth", several[0]).stdout
    assert alone in contents.values()


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_goes_on_after_a_file_that_failed(several: list[Path], tmp_path: Path, jobs: str) -> None:
    bad = several[0].parent / "bad.cls"
    bad.write_bytes(SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,nan,0,0,0.1,1"))
    out = tmp_path / "out"
    out.mkdir()
    result = (run if jobs == "1" else run_process)("smooth", several[0], bad, *several[1:], "-d", out, "-j", jobs)
    assert result.returncode == BAD_INPUT
    assert quiet(result.stderr)
    assert b"bad.cls:9: error[CS106]: " in result.stderr
    assert len(_contents(out)) == len(several)
    assert all("bad" not in name for name in _contents(out))


def test_the_table_at_the_end_names_every_file(several: list[Path], tmp_path: Path) -> None:
    result = run("smooth", *several, "-d", tmp_path / "out")
    assert result.returncode == DONE
    for path in several:
        assert path.name.encode() in result.stderr


@pytest.mark.parametrize("name", ["red]b.cls", "/bold].cls"])
def test_names_with_brackets_are_names(tmp_path: Path, name: str) -> None:
    """Where the name has a slash, the bracket opens in the name of a folder."""
    asked = [f"d[{name}", "d[/x.cls"]
    for one in asked:
        (tmp_path / one).parent.mkdir(exist_ok=True)
        (tmp_path / one).write_bytes(SMALL)
    result = run("smooth", *asked, "-d", "out", cwd=tmp_path)
    assert result.returncode == DONE
    assert quiet(result.stderr)
    for one in asked:
        assert one.encode() in result.stderr


def test_interruption_of_several_processes_leaves_whole_files(medium: Path, tmp_path: Path) -> None:
    paths = [tmp_path / f"part{k}.cls" for k in range(4)]
    for path in paths:
        path.write_bytes(medium.read_bytes())
    out = tmp_path / "out"
    out.mkdir()
    with started("smooth", *paths, "-d", out, "-j", "2", session=True) as process:
        wait_for(lambda: bool(list(out.glob("*.nc"))) or process.poll() is not None)
        os.killpg(process.pid, signal.SIGINT)
        process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGINT
    left = _contents(out)
    assert 1 <= len(left) < len(paths)
    for name, text in left.items():
        assert name.endswith(".nc")
        parse(text, "g1")


def test_many_inputs_need_a_folder(several: list[Path], tmp_path: Path) -> None:
    for extra in ([], ["-o", str(tmp_path / "o.nc")], ["-o", "-"]):
        result = run("smooth", *several, *extra)
        assert result.returncode == USAGE
        assert result.stdout == b""
    assert only(tmp_path, "in")


def test_two_inputs_never_share_an_output(several: list[Path], tmp_path: Path) -> None:
    twin = tmp_path / several[0].name
    twin.write_bytes(SMALL)
    (tmp_path / "out").mkdir()
    for args, said in (
        ([several[0], twin], f"{several[0]} and {twin} would both be written to "),
        ([several[0], several[0]], f"{several[0]} is named twice"),
        ([several[0], os.path.relpath(several[0])], f"{several[0]} is named twice"),
        ([several[0], "--report", "r.json", "--report", "r.json"], "r.json is the name of two outputs"),
    ):
        result = run("smooth", *args, "-d", tmp_path / "out")
        assert result.returncode == USAGE
        assert said in message(result.stderr)
        assert "--help" not in message(result.stderr)  # the line itself says what to do
        assert not any((tmp_path / "out").iterdir())


def test_a_compressed_input_gives_its_output_the_name_of_the_part(small: Path, tmp_path: Path) -> None:
    packed = tmp_path / "part.cls.gz"
    packed.write_bytes(gzip.compress(SMALL))
    assert run("smooth", packed, "-d", tmp_path / "out").returncode == DONE
    assert only(tmp_path / "out", "part.nc")


def test_what_may_not_be_read_is_bad_input(
    several: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a batch it is one file that failed, and a folder that cannot be looked into is not left out in silence."""
    closed = several[0].parent / "closed"
    closed.mkdir()
    lock(monkeypatch, several[0], closed)
    for args in (
        ["smooth", several[0]],
        ["info", several[0]],
        ["verify", several[0], several[1]],
        ["info", closed / "x"],
    ):
        result = run(*args)
        assert result.returncode == BAD_INPUT
        assert message(result.stderr) == f"{args[1]}: error: cannot read it: permission denied; check the path"
    result = run("smooth", several[0].parent, "-d", tmp_path / "out")
    assert result.returncode == BAD_INPUT
    assert f"{closed}: error: cannot read it: permission denied; check the path\n" in one_line(result.stderr)
    assert len(_contents(tmp_path / "out")) == len(several) - 1
    assert result.stderr.decode().splitlines()[-1] == (
        f"{len(several) + 1} files: {len(several) - 1} PASSED ({len(several) - 1} to check), 2 errors"
    )


def test_existing_outputs_in_the_folder_are_kept(several: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    assert run("smooth", *several, "-d", out).returncode == DONE
    first = next(iter(sorted(out.glob("[!.]*"))))
    first.write_text("mine")
    result = run("smooth", *several, "-d", out)
    assert result.returncode == BAD_OUTPUT
    assert first.read_text() == "mine"
    assert run("smooth", *several, "-d", out, "--force").returncode == DONE
    assert first.read_text() != "mine"
