"""Where text comes from and goes to: standard streams, refusals, writing that loses nothing.

A regular file is written beside its place and moved there when it is whole and on the disk; an error, Ctrl-C, a full
disk or a closed pipe leave the old file or none. (click's ``File(atomic=True)`` moves half-written files too.)
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, cast

from cornersmooth.errors import InputError, OutputError, SettingsError

STANDARD = "-"

#: ending of the file beside the output that holds a text which breaks its promise
REJECTED = ".rejected"


class ClosedPipe(Exception):  # noqa: N818 - no error of ours: whoever read the output has seen enough
    """Standard output was closed by its reader, as by ``| head``."""


def read_input(path: str) -> tuple[bytes, str]:
    """Contents and display name of an input; ``-`` is standard input.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    if path == STANDARD:
        if sys.stdin is None:
            raise InputError("CS100", "standard input is closed", "name a file", file="<stdin>")
        return sys.stdin.buffer.read(), "<stdin>"
    try:
        return Path(path).read_bytes(), path
    except OSError as failure:
        raise InputError("CS100", f"cannot read it: {_reason(failure)}", "check the path", file=path) from failure


def check_output(path: str, inputs: list[str], *, force: bool, ours: bytes | None = None) -> None:
    """Refuse an output that would destroy something.

    Parameters
    ----------
    path : str
    inputs : list of str
        Files that are read: an output is never one of them.
    ours : bytes, optional
        How a file begins that an earlier run of the same command made; such a file is replaced without `force`.

    Raises
    ------
    SettingsError
        The output is an input.
    OutputError
        It exists and may not be replaced, or cannot be written at all.
    """
    if path == STANDARD:
        return
    for source in inputs:
        if _is_standard_input(path) if source == STANDARD else _same(path, source):
            raise SettingsError("CS220", f"{path} is the input", "choose another name for the output")
    if os.path.isdir(path):
        raise OutputError("CS401", "is a folder", "name a file, or use -d for a folder", file=path)
    folder = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(folder):
        raise OutputError("CS402", f"there is no folder {folder}", "make it first", file=path)
    if os.path.isfile(path) and not force and not _begins_with(path, ours):
        raise OutputError("CS403", "exists already", "use --force to replace it", file=path)


@dataclass
class Output:
    """A file that is being written and has not taken its place yet.

    Parameters
    ----------
    stream : binary stream
    path : str
        Where the text is until then; empty where it goes straight to a stream or device.
    rejected : bool
        Set by the writer: the text must not take the place of the output.
    """

    stream: BinaryIO
    path: str = ""
    rejected: bool = False


@contextlib.contextmanager
def open_output(path: str, *, hold: bool = False) -> Iterator[Output]:
    """Open an output; a regular file appears under its name only when the block ends without an error.

    A rejected file is moved to ``PATH.rejected`` instead, and nothing of it reaches a stream or device.

    Parameters
    ----------
    path : str
    hold : bool
        Keep the text in a file until the block ends, also for streams and devices, so that it can be looked at first.

    Raises
    ------
    OutputError
        Anything the operating system refuses, a full disk included.
    ClosedPipe
        The reader of a pipe has gone.
    """
    standard = path == STANDARD
    if standard and sys.stdout is None:
        raise OutputError("CS406", "standard output is closed", "use -o", file="<stdout>")
    with _failing_as_output("<stdout>" if standard else path):
        if not standard and not (os.path.exists(path) and not stat.S_ISREG(os.stat(path).st_mode)):
            with _replacing(os.path.realpath(path)) as output:
                yield output
            return
        # a device or a pipe cannot be replaced, only written to
        with contextlib.nullcontext(sys.stdout.buffer) if standard else open(path, "wb") as device:
            if hold:
                with tempfile.NamedTemporaryFile(prefix="cornersmooth.") as file:
                    output = Output(cast(BinaryIO, file), file.name)
                    yield output
                    file.seek(0)
                    if not output.rejected:
                        shutil.copyfileobj(file, device, 1 << 20)
            else:
                yield Output(device)
            device.flush()


@contextlib.contextmanager
def _replacing(target: str) -> Iterator[Output]:
    folder, name = os.path.split(target)
    # named before it exists: a signal at any moment finds a name to remove
    temporary = os.path.join(folder, f".{name}.{secrets.token_hex(4)}.part")
    try:
        with open(temporary, "xb") as stream:
            output = Output(stream, temporary)
            yield output
            stream.flush()
            if os.path.exists(target):
                os.fchmod(stream.fileno(), stat.S_IMODE(os.stat(target).st_mode))
            os.fsync(stream.fileno())
        os.replace(temporary, target + REJECTED if output.rejected else target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


@contextlib.contextmanager
def _failing_as_output(path: str) -> Iterator[None]:
    try:
        yield
    except BrokenPipeError as closed:
        raise ClosedPipe from closed
    except OSError as failure:
        raise OutputError(
            "CS404", f"cannot write it: {_reason(failure)}", "the old file, if any, is untouched", file=path
        ) from failure


def _is_standard_input(path: str) -> bool:
    """Whether the path names the file that standard input is redirected from."""
    try:
        return os.path.samestat(os.fstat(0), os.stat(path))
    except OSError:
        return False


def _same(one: str, other: str) -> bool:
    try:
        return os.path.samefile(one, other)
    except OSError:
        return os.path.realpath(one) == os.path.realpath(other)


def _begins_with(path: str, ours: bytes | None) -> bool:
    if ours is None:
        return False
    with contextlib.suppress(OSError), open(path, "rb") as stream:
        return stream.read(len(ours)) == ours
    return False


def _reason(failure: OSError) -> str:
    return (failure.strerror or str(failure)).lower()
