"""Where text goes: refusals, and writing that loses nothing.

A regular file is written beside its place and moved there when it is whole and on the disk; an error, an interruption,
a full disk or a closed pipe leave the old file or none.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import BinaryIO, cast

from cornersmooth.errors import OutputError, SettingsError

#: a path, or a binary stream that is open already
Target = str | os.PathLike[str] | BinaryIO

#: ending of the file beside the output that holds a text which breaks its promise
REJECTED = ".rejected"


class ClosedPipe(Exception):  # noqa: N818 - no error of ours: whoever read the output has seen enough
    """The reader of the output has gone, as with ``| head``."""


def check_output(
    target: Target, inputs: Iterable[str | os.PathLike[str] | int] = (), *, force: bool = False, ours: bytes = b""
) -> None:
    """Refuse an output that would destroy something.

    Parameters
    ----------
    target : path or binary stream
        A stream is never refused.
    inputs : iterable of path or file descriptor
        What is read: an output is never one of them.
    force : bool
        Whether an existing file may be replaced.
    ours : bytes
        How a file begins that an earlier run made; such a file is replaced without `force`.

    Raises
    ------
    SettingsError
        CS220: the output is an input.
    OutputError
        CS401 to CS403: it exists and may not be replaced, or cannot be written at all.
    """
    path = path_of(target)
    if path is None:
        return
    if any(_same(source, path) for source in inputs):
        raise SettingsError("CS220", f"{path} is the input", "choose another name for the output")
    if os.path.isdir(path):
        raise OutputError("CS401", "is a folder", "name a file, or use -d for a folder", file=path)
    folder = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(folder):
        raise OutputError("CS402", f"there is no folder {folder}", "make it first", file=path)
    if os.path.isfile(path) and not force and not (ours and _begins_with(path, ours)):
        raise OutputError("CS403", "exists already", "use --force to replace it", file=path)


def path_of(target: Target) -> str | None:
    """Path of an output; None for a stream."""
    return os.fspath(target) if isinstance(target, (str, os.PathLike)) else None


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
def open_output(target: Target, *, hold: bool = False) -> Iterator[Output]:
    """Open an output; a regular file appears under its name only when the block ends without an error.

    A rejected file is moved to ``PATH.rejected`` instead, and nothing of it reaches a stream or device.

    Parameters
    ----------
    target : path or binary stream
    hold : bool
        Keep the text in a file until the block ends, also for streams and devices, so that it can be looked at first.

    Raises
    ------
    OutputError
        CS404: anything the operating system refuses, a full disk included.
    ClosedPipe
        The reader of a pipe has gone.
    """
    path = path_of(target)
    with _failing_as_output(path or str(getattr(target, "name", "<output>"))):
        if path is not None and not (os.path.exists(path) and not stat.S_ISREG(os.stat(path).st_mode)):
            with _replacing(os.path.realpath(path)) as output:
                yield output
            return
        # a stream, a device or a pipe cannot be replaced, only written to
        with contextlib.nullcontext(cast(BinaryIO, target)) if path is None else open(path, "wb") as device:
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


def make_folder(path: str) -> None:
    """Make the folder for outputs.

    Raises
    ------
    OutputError
        CS405: it cannot be made.
    """
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as failure:
        raise OutputError("CS405", f"cannot make the folder: {reason(failure)}", "choose another", file=path) from None


def reason(failure: OSError) -> str:
    """What the operating system says, as part of a sentence."""
    return (failure.strerror or str(failure)).lower()


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
            "CS404", f"cannot write it: {reason(failure)}", "the old file, if any, is untouched", file=path
        ) from failure


def _same(source: str | os.PathLike[str] | int, path: str) -> bool:
    try:
        return os.path.samestat(os.stat(source), os.stat(path))
    except OSError:
        return not isinstance(source, int) and os.path.realpath(source) == os.path.realpath(path)


def _begins_with(path: str, ours: bytes) -> bool:
    with contextlib.suppress(OSError), open(path, "rb") as stream:
        return stream.read(len(ours)) == ours
    return False
