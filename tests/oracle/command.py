"""Runs the installed command as users do: a process of its own, its streams, its exit code, its CPU time."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest

from oracle.chains import cl_text, random_chains

DONE, USAGE, BAD_INPUT, BAD_OUTPUT = 0, 2, 3, 4
OLD = b"old program\n"

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

SCRIPT = Path(sys.executable).parent / "cornersmooth"
#: seconds after which a run counts as hanging
PATIENCE = 120


def command(*args: str | Path) -> list[str]:
    """Argument vector of ``cornersmooth ARGS``."""
    assert SCRIPT.exists(), "install the package into the interpreter that runs the tests"
    return [str(SCRIPT), *map(str, args)]


def environment(**changes: str) -> dict[str, str]:
    """Environment of the tests without what changes looks, plus `changes`."""
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR", "COLUMNS")}
    return kept | changes


def run(
    *args: str | Path,
    data: bytes = b"",
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
    prepare: Callable[[], None] | None = None,
) -> subprocess.CompletedProcess[bytes]:
    """Run the command to its end."""
    return subprocess.run(
        command(*args),
        input=data,
        capture_output=True,
        cwd=cwd,
        env=dict(env) if env is not None else environment(),
        timeout=PATIENCE,
        preexec_fn=prepare,
        check=False,
    )


def start(*args: str | Path, cwd: Path | None = None) -> subprocess.Popen[bytes]:
    """Start the command with its output in pipes."""
    return subprocess.Popen(
        command(*args), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=cwd
    )


def cpu_seconds(args: Sequence[str]) -> float:
    """User and system time of one run, seconds."""
    process = subprocess.Popen(command(*args), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return usage.ru_utime + usage.ru_stime


def wait_for(condition: Callable[[], bool], seconds: float) -> bool:
    """Whether the condition came true in time; looked at every millisecond."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.001)
    return False


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


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A file with two corners in a folder of its own."""
    path = tmp_path / "small.cls"
    path.write_bytes(SMALL)
    return path


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some ten thousand corners: enough text to be interrupted while it is written."""
    path = tmp_path_factory.mktemp("large") / "large.cls"
    path.write_bytes(cl_text(random_chains(7, 2500, tame=True))[0])
    return path
