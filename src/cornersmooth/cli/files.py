"""The standard streams: ``-`` as the name of an input or output."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

import click

from cornersmooth.errors import CornersmoothError, InputError, OutputError
from cornersmooth.system import output

STANDARD = "-"


#: lines of a text that a terminal is shown without -o
_SHOWN = 20


class Beginning:
    """A stream that lets the first lines of a text through and counts the others, which it holds back."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream, self._left = stream, _SHOWN
        self.held_back = 0

    def write(self, data: bytes, /) -> int:
        """Let through what belongs to the first lines."""
        lines = data.splitlines(keepends=True)
        shown = lines[: self._left]
        self._stream.write(b"".join(shown))
        self._left -= sum(line.endswith(b"\n") for line in shown)
        self.held_back += sum(line.endswith(b"\n") for line in lines[len(shown) :])
        return len(data)

    def flush(self) -> None:
        """Hand everything to the terminal."""
        self._stream.flush()


def read_input(path: str, *, size_limit: bool = True) -> tuple[bytes, str]:
    """Contents and display name of an input; ``-`` is standard input (InputError CS100, and CS199: too large)."""
    from cornersmooth.cl.source import read_bounded

    if path == STANDARD:
        if sys.stdin is None:
            raise InputError("CS100", "standard input is closed", "name a file", file="<stdin>")
        return read_bounded(sys.stdin.buffer, "<stdin>", size_limit=size_limit), "<stdin>"
    with _reading(path), Path(path).open("rb") as file:
        return read_bounded(file, path, size_limit=size_limit), path


def check_inputs(*paths: str) -> None:
    """Refuse inputs that cannot be read, before any output is looked at (InputError CS100: as `read_input`)."""
    for path in paths:
        with _reading(path):
            if path != STANDARD and not stat.S_ISFIFO(os.stat(path).st_mode):  # a pipe is opened once
                open(path, "rb").close()


@contextlib.contextmanager
def _reading(path: str) -> Iterator[None]:
    try:
        yield
    except OSError as failure:
        what = f"cannot read it: {output.reason(failure)}"
        folder = isinstance(failure, IsADirectoryError)
        hint = "name a file; smooth takes folders with -d" if folder else "check the path"
        raise InputError("CS100", what, hint, file=path) from failure


def read_head(nc: bytes | str | os.PathLike[str]) -> bytes:
    """Beginning of an NC program; empty where it cannot be read twice."""
    from cornersmooth.provenance import HEAD

    if isinstance(nc, bytes):
        return nc[:HEAD]
    with contextlib.suppress(OSError):  # who reads it all says why
        if os.path.isfile(nc):
            with open(nc, "rb") as file:
                return file.read(HEAD)
    return b""


def read_lines(path: str) -> tuple[str, ...]:
    """Lines of a text of the user's own; a mark that some editors put before it is none of it."""
    return tuple(read_input(path)[0].decode("utf-8-sig", "replace").splitlines())


def target_of(path: str) -> output.Target:
    """Where a text goes: the path, or standard output for ``-`` (OutputError CS406: standard output is closed)."""
    if path != STANDARD:
        return path
    if sys.stdout is None:
        raise OutputError("CS406", "standard output is closed", "use -o", file="<stdout>")
    return sys.stdout.buffer


def check_path(path: str, inputs: list[str], *, force: bool | None, beginning: bytes = b"") -> bool:
    """Refuse an output that would destroy something, as `check_output`; standard streams are known by ``-``."""
    if path == STANDARD:
        return True
    sources = [0 if source == STANDARD else source for source in inputs]
    return output.check_output(path, sources, force=force, beginning=beginning)


def suffix_of(path: str) -> str:
    """Ending of a name, which says the form of a report."""
    return os.path.splitext(path)[1].lower()


def check_endings(option: str, paths: Iterable[str], endings: str) -> None:
    """Refuse names that have none of the endings, which say the form."""
    for path in paths:
        if suffix_of(path) not in re.findall(r"\.\w+", endings):
            raise click.UsageError(f"--{option} {path}: let the name end in {endings}")


def check_reports(reports: Iterable[str], endings: str, inputs: list[str], *, force: bool) -> None:
    """Refuse reports whose names have none of the endings, or that would destroy something."""
    check_endings("report", reports, endings)
    for path in reports:
        check_path(path, inputs, force=force)


def write_report(path: str, parts: Iterable[str | bytes], *, replace: bool = True) -> None:
    """Write the parts of a report; names in it need not be UTF-8."""
    with output.open_output(target_of(path), replace=replace) as made:
        for part in parts:
            made.stream.write(part if isinstance(part, bytes) else part.encode("utf-8", "backslashreplace"))


@contextlib.contextmanager
def told_of(name: str) -> Iterator[None]:
    """Name the file in errors that do not."""
    try:
        yield
    except CornersmoothError as error:
        error.file = error.file or name
        raise
