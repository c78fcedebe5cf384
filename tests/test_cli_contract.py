"""The command line as shops and scripts rely on it: design section 5, one test for each promise in it."""

from __future__ import annotations

import json
import os
import pty
import re
import resource
import signal
import stat
import subprocess
from functools import partial
from pathlib import Path

import pytest

from oracle.chains import cl_text, random_chains
from oracle.command import PATIENCE, command, cpu_seconds, environment, run, start, wait_for
from oracle.nc_text import Line, parse

DONE, USAGE, BAD_INPUT, BAD_OUTPUT = 0, 2, 3, 4
ESCAPE = b"\x1b"
OLD = b"old program\n"
#: CPU seconds for --help
HELP_SECONDS = 0.15

SMALL = b"""PARTNO CONTRACT
UNITS/MM
LOADTL/1
SPINDL/12000,RPM,CLW
RAPID
GOTO/0,0,0,0,0,1
FEDRAT/500,MMPM
GOTO/10,0,0,0,0,1
GOTO/10,10,0,0,0.1,1
GOTO/20,10,0,0,0.1,1
FINI
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.cls"
    path.write_bytes(SMALL)
    return path


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some ten thousand corners: enough text to be interrupted while it is written."""
    path = tmp_path_factory.mktemp("large") / "large.cls"
    path.write_bytes(cl_text(random_chains(7, 2500, tame=True))[0])
    return path


def quiet(stderr: bytes) -> bool:
    """No trace of Python in what the user sees."""
    return b"Traceback" not in stderr and b"Error(" not in stderr and b'File "' not in stderr


def message(stderr: bytes) -> str:
    """The one error line."""
    lines = [line for line in stderr.decode().splitlines() if "error:" in line]
    assert len(lines) == 1, stderr.decode()
    return lines[0]


def only(folder: Path, *names: str) -> bool:
    """Whether the folder holds these names and nothing else."""
    return sorted(os.listdir(folder)) == sorted(names)


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
    implied, named = run("smooth", small), run("smooth", small, "-o", "-")
    assert implied.returncode == named.returncode == DONE
    assert implied.stdout == named.stdout == out.read_bytes()
    assert b"G1" not in implied.stderr
    parse(implied.stdout, "g1")


def test_standard_input_is_a_dash(small: Path) -> None:
    piped = run("smooth", "-", data=SMALL)
    assert piped.returncode == DONE
    motion = [block for block in parse(piped.stdout, "g1").blocks if isinstance(block, Line)]
    assert motion == [
        block for block in parse(run("smooth", small).stdout, "g1").blocks if isinstance(block, Line)
    ] or _same_motion(piped.stdout, run("smooth", small).stdout)


def _same_motion(one: bytes, other: bytes) -> bool:
    return [line for line in one.splitlines() if line[:1] == b"G"] == [
        line for line in other.splitlines() if line[:1] == b"G"
    ]


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
    result = run("smooth", small, "-f", form, "-e", "0.04")
    assert result.returncode == DONE
    parse(result.stdout, "g6.2" if form == "g6.2" else "g1")


def test_reports(small: Path, tmp_path: Path) -> None:
    result = run("smooth", small, "-o", "o.nc", "--report", "r.json", "--report", "r.csv", cwd=tmp_path)
    assert result.returncode == DONE
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["schema"] == "cornersmooth-report/1"
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


def test_no_colour_and_no_progress_bar_in_a_file(large: Path, tmp_path: Path) -> None:
    result = run("smooth", large, "-o", tmp_path / "o.nc", "-v")
    assert result.returncode == DONE
    assert ESCAPE not in result.stderr
    assert b"\r" not in result.stderr


@pytest.mark.parametrize("no_color", [True, False])
def test_colour_on_a_terminal_unless_no_color(small: Path, tmp_path: Path, no_color: bool) -> None:
    leader, follower = pty.openpty()
    extra = {"NO_COLOR": "1"} if no_color else {}
    process = subprocess.Popen(
        command("smooth", small, "-o", tmp_path / "o.nc"),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=follower,
        env=environment(TERM="xterm-256color", **extra),
    )
    os.close(follower)
    seen = b""
    while True:
        try:
            part = os.read(leader, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        seen += part
    os.close(leader)
    assert process.wait() == DONE
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


def test_help_is_quick() -> None:
    assert min(cpu_seconds(["--help"]) for _ in range(5)) <= HELP_SECONDS
    assert min(cpu_seconds(["smooth", "--help"]) for _ in range(5)) <= HELP_SECONDS


def test_version() -> None:
    result = run("--version")
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


def test_unknown_command_is_two() -> None:
    assert run("polish").returncode == USAGE


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
    piped = run("smooth", "-", data=data)
    assert piped.returncode == BAD_INPUT
    assert piped.stdout == b""
    assert re.match(r"<stdin>", message(piped.stderr))


def test_missing_file_and_folder_as_input(tmp_path: Path) -> None:
    for name in ("none.cls", "."):
        result = run("smooth", name, cwd=tmp_path)
        assert result.returncode == BAD_INPUT
        assert name in message(result.stderr)
        assert quiet(result.stderr)


# ---------------------------------------------------------------- 4: output


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


@pytest.mark.xfail(strict=True, reason="the file behind standard input is not compared")
def test_out_is_never_the_file_behind_standard_input(small: Path) -> None:
    with small.open("rb") as stream:
        result = subprocess.run(
            command("smooth", "-", "-o", small, "--force"), stdin=stream, capture_output=True, check=False
        )
    assert small.read_bytes() == SMALL
    assert result.returncode in (USAGE, BAD_OUTPUT)


@pytest.mark.xfail(strict=True, reason="the report cannot encode the name")
def test_names_that_are_no_text(small: Path, tmp_path: Path) -> None:
    odd = os.fsencode(tmp_path) + b"/b\xff.cls"
    os.rename(small, odd)
    result = run("smooth", os.fsdecode(odd), "-o", tmp_path / "o.nc", "--report", tmp_path / "r.json")
    assert result.returncode == DONE
    json.loads((tmp_path / "r.json").read_bytes())


@pytest.mark.xfail(strict=True, reason="leaves with 1 and Python's words, or writes nothing")
@pytest.mark.parametrize("closed", [1, 2])
def test_closed_streams(small: Path, tmp_path: Path, closed: int) -> None:
    """Without standard error the work is done in silence; without standard output there is nowhere to write to."""
    options = ["-o", str(tmp_path / "o.nc")] if closed == 2 else []
    result = run("smooth", small, *options, prepare=lambda: os.close(closed))
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


def test_full_disk_on_standard_output(small: Path) -> None:
    with open("/dev/full", "wb") as full:
        result = subprocess.run(command("smooth", small), stdout=full, stderr=subprocess.PIPE, check=False)
    assert result.returncode == BAD_OUTPUT
    assert quiet(result.stderr)
    message(result.stderr)


@pytest.mark.parametrize("old", [None, b"old program\n"])
def test_full_disk_leaves_the_old_file_or_none(large: Path, tmp_path: Path, old: bytes | None) -> None:
    out = tmp_path / "out.nc"
    if old is not None:
        out.write_bytes(old)

    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536))

    result = run("smooth", large, "-o", out, "--force", prepare=small_files)
    assert result.returncode == BAD_OUTPUT
    assert quiet(result.stderr)
    assert "out.nc" in message(result.stderr)
    assert only(tmp_path, *(["out.nc"] if old is not None else []))
    if old is not None:
        assert out.read_bytes() == old


def test_closed_pipe(large: Path) -> None:
    process = start("smooth", large)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.read(10)
    process.stdout.close()
    complaint = process.stderr.read()
    process.stderr.close()
    assert process.wait(PATIENCE) == BAD_OUTPUT
    assert quiet(complaint)
    assert b"BrokenPipe" not in complaint
    assert b"Exception ignored" not in complaint


def _ended(process: subprocess.Popen[bytes], beside: Path | None = None) -> bool:
    """Whether the process has ended, or has made a file beside the given one."""
    return process.poll() is not None or (beside is not None and not only(beside.parent, beside.name))


def _interrupt(process: subprocess.Popen[bytes], number: signal.Signals, out: Path) -> bool:
    """Send the signal; whether it came in time. The old file is there then, alone, and nothing was complained of."""
    process.send_signal(number)
    _, complaint = process.communicate(timeout=PATIENCE)
    assert only(out.parent, "out.nc")
    if process.returncode == DONE:
        parse(out.read_bytes(), "g1")
        return False
    assert process.returncode in (128 + number, -number)
    assert quiet(complaint), complaint.decode()
    assert out.read_bytes() == OLD
    return True


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_leaves_the_old_file(large: Path, tmp_path: Path, number: signal.Signals) -> None:
    """At several moments of the run; before that Python itself is starting."""
    out = tmp_path / "out.nc"
    interrupted = 0
    for moment in (0.3, 0.5, 0.7):
        out.write_bytes(OLD)
        process = start("smooth", large, "-o", out, "--force")
        wait_for(partial(_ended, process), moment)
        interrupted += _interrupt(process, number, out)
    assert interrupted >= 1


@pytest.mark.xfail(reason="a signal between the making of the temporary file and the try leaves it behind")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_as_the_temporary_file_appears(large: Path, tmp_path: Path, number: signal.Signals) -> None:
    out = tmp_path / "out.nc"
    for _ in range(6):
        out.write_bytes(OLD)
        process = start("smooth", large, "-o", out, "--force")
        wait_for(partial(_ended, process, beside=out), PATIENCE)
        _interrupt(process, number, out)


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
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_any_number_of_processes_gives_the_same_bytes(several: list[Path], tmp_path: Path) -> None:
    for name, jobs in (("one", ["-j", "1"]), ("two", ["-j", "2"]), ("all", ["-j"]), ("none", [])):
        (tmp_path / name).mkdir()
        result = run("smooth", *several, "-d", tmp_path / name, *jobs)
        assert result.returncode == DONE, result.stderr.decode()
        assert result.stdout == b""
    contents = _contents(tmp_path / "one")
    assert len(contents) == len(several)
    assert contents == _contents(tmp_path / "two") == _contents(tmp_path / "all") == _contents(tmp_path / "none")
    alone = run("smooth", several[0]).stdout
    assert alone in contents.values()


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_goes_on_after_a_file_that_failed(several: list[Path], tmp_path: Path, jobs: str) -> None:
    bad = several[0].parent / "bad.cls"
    bad.write_bytes(BAD_INPUTS["nan"][0])
    out = tmp_path / "out"
    out.mkdir()
    result = run("smooth", several[0], bad, *several[1:], "-d", out, "-j", jobs)
    assert result.returncode == BAD_INPUT
    assert quiet(result.stderr)
    assert "bad.cls:9" in message(result.stderr)
    assert len(_contents(out)) == len(several)
    assert all("bad" not in name for name in _contents(out))


def test_the_table_at_the_end_names_every_file(several: list[Path], tmp_path: Path) -> None:
    result = run("smooth", *several, "-d", tmp_path / "out")
    assert result.returncode == DONE
    for path in several:
        assert path.name.encode() in result.stderr


@pytest.mark.xfail(strict=True, reason="brackets in names are taken as markup")
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


def test_interruption_of_several_processes_leaves_whole_files(large: Path, tmp_path: Path) -> None:
    paths = [tmp_path / f"part{k}.cls" for k in range(4)]
    for path in paths:
        path.write_bytes(large.read_bytes())
    out = tmp_path / "out"
    out.mkdir()
    process = subprocess.Popen(
        command("smooth", *paths, "-d", out, "-j", "2"),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    wait_for(lambda: bool(list(out.glob("*.nc"))) or process.poll() is not None, PATIENCE)
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(PATIENCE) == 128 + signal.SIGINT
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
    result = run("smooth", several[0], twin, "-d", tmp_path / "out")
    assert result.returncode == USAGE
    assert not any((tmp_path / "out").iterdir())


def test_existing_outputs_in_the_folder_are_kept(several: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    assert run("smooth", *several, "-d", out).returncode == DONE
    first = next(iter(sorted(out.iterdir())))
    first.write_text("mine")
    result = run("smooth", *several, "-d", out)
    assert result.returncode == BAD_OUTPUT
    assert first.read_text() == "mine"
    assert run("smooth", *several, "-d", out, "--force").returncode == DONE
    assert first.read_text() != "mine"
