"""LinuxCNC's interpreter, started once: a copy of it reads each program."""

from __future__ import annotations

import atexit
import subprocess
from functools import cache
from pathlib import Path

#: Debian's own Python has its modules
_PYTHON = Path("/usr/bin/python3")
_CANON = Path(__file__).parents[1] / "nc" / "linuxcnc_canon.py"


class RefusedError(AssertionError):
    """The interpreter does not take a program."""


@cache
def _interpreter() -> subprocess.Popen[str]:
    process = subprocess.Popen([_PYTHON, _CANON], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(_end, process)
    return process


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


def rows_of(text: bytes, folder: Path) -> list[list[str]]:
    """Rows of a program as `linuxcnc_canon` prints them, in words; RefusedError where the interpreter refuses it."""
    program, process = folder / "program.ngc", _interpreter()
    assert process.stdin is not None
    assert process.stdout is not None
    program.write_bytes(text)
    print(program, file=process.stdin, flush=True)
    if (code := process.stdout.readline()) != "0\n":
        raise RefusedError(code + program.with_suffix(".ngc.errors").read_text())
    return [line.split() for line in program.with_suffix(".ngc.rows").read_text().splitlines()]
