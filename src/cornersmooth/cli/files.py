"""The standard streams: ``-`` as the name of an input or output."""

from __future__ import annotations

import sys
from pathlib import Path

from cornersmooth import output
from cornersmooth.errors import InputError, OutputError

STANDARD = "-"


def read_input(path: str) -> tuple[bytes, str]:
    """Contents and display name of an input; ``-`` is standard input.

    Raises
    ------
    InputError
        CS100: the file cannot be read.
    """
    if path == STANDARD:
        if sys.stdin is None:
            raise InputError("CS100", "standard input is closed", "name a file", file="<stdin>")
        return sys.stdin.buffer.read(), "<stdin>"
    try:
        return Path(path).read_bytes(), path
    except OSError as failure:
        what = f"cannot read it: {output.reason(failure)}"
        raise InputError("CS100", what, "check the path", file=path) from failure


def target_of(path: str) -> output.Target:
    """Where a text goes: the path, or standard output for ``-``.

    Raises
    ------
    OutputError
        CS406: standard output is closed.
    """
    if path != STANDARD:
        return path
    if sys.stdout is None:
        raise OutputError("CS406", "standard output is closed", "use -o", file="<stdout>")
    return sys.stdout.buffer


def check_path(path: str, inputs: list[str], *, force: bool | None, ours: bytes = b"") -> bool:
    """Refuse an output that would destroy something, as `check_output`; standard streams are known by ``-``."""
    if path == STANDARD:
        return True
    sources = [0 if source == STANDARD else source for source in inputs]
    return output.check_output(path, sources, force=force, ours=ours)
