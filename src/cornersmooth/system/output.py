"""Where text goes: refusals, and writing that loses nothing.

A regular file is written beside its place and moved there when it is whole and on the disk; an error, an interruption,
a full disk or a closed pipe leave the old file or none. What is moved is what was written: it is read once more and
compared by its hash, so that nobody's change in between goes unnoticed. It is closed before it is moved or removed:
Windows refuses both for a file that is open.
"""

from __future__ import annotations

import contextlib
import glob
import hashlib
import io
import json
import os
import stat
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import BinaryIO, Final, cast

from cornersmooth.errors import OutputError, SettingsError

#: a path, or a binary stream that is open already
Target = str | os.PathLike[str] | BinaryIO

#: ending of the file beside the output that holds a program which must not take its place
FAILED = ".failed"

#: hash of what is written: many processors have instructions of their own for it
_HASH: Final = "sha256"
#: bytes that are hashed at once
_AT_ONCE: Final = 1 << 20

#: folder beside the outputs with a file of marks for each
_MARKS = ".cornersmooth"

#: seconds after which a temporary file that nobody has written to is what a killed run has left
_ABANDONED: Final = 86_400.0

#: names of the files that are being written in this process, for whoever ends it from a signal handler; the number
#: under which each is open, -1 for not
_unfinished: dict[str, int] = {}


class ClosedPipe(Exception):  # noqa: N818 - no error: whoever read the output has seen enough
    """The reader of the output has gone, as with ``| head``."""


def check_output(
    target: Target,
    inputs: Iterable[str | os.PathLike[str] | int] = (),
    *,
    force: bool | None = False,
    beginning: bytes = b"",
) -> bool:
    """Refuse an output that would destroy something; say whether what stands at its place may be replaced.

    Parameters
    ----------
    inputs : iterable of path or file descriptor
        What is read: an output is never one of them.
    force : bool or None
        Whether an existing file may be replaced; None for not, but it may stay if it turns out to be the same.
    beginning : bytes
        How a file begins that an earlier run made; such a file is replaced without `force`.

    Raises SettingsError CS220: the output is an input. OutputError CS401 to CS403: it exists and may not be replaced,
    or cannot be written at all. A stream is never refused.
    """
    path = path_of(target)
    if path is None:
        return True
    if any(_same(source, path) for source in inputs):
        raise SettingsError("CS220", f"{path} is the input", "choose another name for the output")
    if os.path.isdir(path):
        raise OutputError("CS401", "is a folder", "name a file, or use -d for a folder", file=path)
    folder = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(folder):
        raise OutputError("CS402", f"there is no folder {folder}", "make it first", file=path)
    if force or force is None or not os.path.isfile(path):
        return bool(force)
    with contextlib.suppress(OSError), open(path, "rb") as stream:
        if beginning and stream.read(len(beginning)) == beginning:
            return True
    raise _taken(path)


def _taken(path: str) -> OutputError:
    return OutputError("CS403", "exists already", "use --force to replace it", file=path)


def path_of(target: Target) -> str | None:
    """Path of an output; None for a stream."""
    return os.fspath(target) if isinstance(target, (str, os.PathLike)) else None


class HashedStream:
    """A stream that remembers the hash of all that was written to it."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._hash = hashlib.new(_HASH)
        self._now = ""  # hash of what a file holds with the patch
        self._heads = [b""]  # how the file begins as it was written, and with the patch

    def write(self, data: bytes, /) -> int:
        """Write the bytes."""
        self._hash.update(data)
        return self._stream.write(data)

    def flush(self) -> None:
        """Hand everything to the operating system."""
        self._stream.flush()

    @property
    def digest(self) -> str:
        """Hash of what was written, in hexadecimal digits; with the patch once `check` has seen it."""
        return self._now or self._hash.hexdigest()

    def patch(self, path: str, place: int, data: bytes) -> None:
        """Write other bytes over some that are in the file already, once."""
        self._stream.flush()
        with open(path, "r+b") as file:
            head = file.read(place + len(data))
            file.seek(place)
            file.write(data)
        self._heads = [head, head[:place] + data]

    def check(self, path: str) -> None:
        """Compare what a file holds with what was written (OutputError CS407: somebody else has changed it)."""
        hashes = [hashlib.new(_HASH, head) for head in self._heads]
        with open(path, "rb") as file:
            same = file.read(len(self._heads[-1])) == self._heads[-1]
            while more := file.read(_AT_ONCE):
                for one in hashes:
                    one.update(more)
        if not same or hashes[0].digest() != self._hash.digest():
            raise OutputError("CS407", "the program was changed before it took its place", "try again", file=path)
        self._now = hashes[-1].hexdigest()


@dataclass
class Output:
    """A file that is being written and has not taken its place yet."""

    stream: HashedStream
    path: str = ""  #: where the text is until then; empty where it goes straight to a stream or device
    failed: bool = False  #: set by the writer: the text must not take the place of the output


@contextlib.contextmanager
def open_output(target: Target, *, hold: bool = False, replace: bool = True) -> Iterator[Output]:
    """Open an output; a regular file appears under its name only when the block ends without an error.

    A file that failed is moved to ``PATH.failed`` instead, and nothing of it reaches a stream or device.

    Parameters
    ----------
    hold : bool
        Keep the text in a file until the block ends, also for streams and devices, so that it can be looked at first.
    replace : bool
        Whether a file that stands at its place when the block ends may be replaced.

    Raises OutputError CS403: a file has appeared at its place that may not be replaced; CS404: anything the operating
    system refuses, a full disk included; CS407: somebody changed the text. ClosedPipe: the reader has gone.
    """
    path = path_of(target)
    try:
        if path is not None and not (os.path.exists(path) and not stat.S_ISREG(os.stat(path).st_mode)):
            with _moving(os.path.realpath(path), path, replace=replace) as output:
                yield output
            return
        # a stream, a device or a pipe cannot be replaced, only written to
        with _whole(cast(BinaryIO, target)) if path is None else open(path, "wb") as device:
            if hold:
                import shutil
                import tempfile

                with (
                    temporary_name(tempfile.gettempdir(), "cornersmooth") as temporary,
                    _opened(temporary, mode=0o600) as file,
                ):
                    output = Output(HashedStream(file), temporary)
                    yield output
                    output.stream.flush()
                    output.stream.check(temporary)
                    if not output.failed:
                        with open(temporary, "rb") as text:
                            shutil.copyfileobj(text, device, 1 << 20)
            else:
                yield Output(HashedStream(device))
            device.flush()
    except BrokenPipeError as closed:
        raise ClosedPipe from closed
    except OSError as failure:
        what = f"cannot write it: {reason(failure)}"
        name = path or str(getattr(target, "name", "<output>"))
        raise OutputError("CS404", what, "the old file, if any, is untouched", file=name) from failure


@contextlib.contextmanager
def _whole(stream: BinaryIO) -> Iterator[BinaryIO]:
    """A stream that takes all that is written: a raw one, as under PYTHONUNBUFFERED, may take a part of it."""
    if not isinstance(stream, io.RawIOBase):
        yield stream
        return
    whole = io.BufferedWriter(stream)
    try:
        yield whole
    finally:
        whole.detach()  # else it closes the stream when it is gone


def write_mark(path: str, digest: str, mark: Mapping[str, str]) -> None:
    """Keep a mark beside a file of that hash, for `read_mark`; without it the next run only makes the file again."""
    beside = _mark_of(path)
    with contextlib.suppress(OSError):
        os.makedirs(os.path.dirname(beside), exist_ok=True)
        with open(beside, "w", encoding="utf-8") as file:
            json.dump({"text": digest, **mark}, file)


def read_mark(path: str) -> dict[str, str] | None:
    """Mark of a file that is as it was when that was set; None where nothing is known, as after a change."""
    try:
        with open(_mark_of(path), encoding="utf-8") as beside, open(path, "rb") as file:
            mark: dict[str, str] = json.load(beside)
            same = mark.pop("text") == hashlib.file_digest(file, _HASH).hexdigest()
    except (OSError, ValueError, KeyError, AttributeError):
        return None
    return mark if same else None


def _mark_of(path: str) -> str:
    folder, name = os.path.split(os.path.realpath(path))
    return os.path.join(folder, _MARKS, f"{name}.json")


def remove_unfinished() -> None:
    """Remove what is being written in this process, which is about to end; for signal handlers."""
    for number in [*_unfinished.values()]:
        with contextlib.suppress(OSError):
            os.close(number)
    _remove([*_unfinished])


def remove_leftovers(path: str, process: int | None = None) -> None:
    """Remove what a process that was killed, or any of them, has left beside an output."""
    _remove(_left(*os.path.split(os.path.realpath(path)), "*" if process is None else f"{process}-*"))


def _left(folder: str, name: str, whose: str) -> list[str]:
    """Temporary files of an output."""
    return glob.glob(os.path.join(glob.escape(folder), glob.escape(f".{name}.") + whose + ".part"))


def _remove(paths: Iterable[str]) -> None:
    for path in paths:
        with contextlib.suppress(OSError):
            os.unlink(path)


def make_folder(path: str) -> None:
    """Make the folder for outputs (OutputError CS405: it cannot be made)."""
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as failure:
        raise OutputError("CS405", f"cannot make the folder: {reason(failure)}", "choose another", file=path) from None


def reason(failure: OSError) -> str:
    """What the operating system says, as part of a sentence."""
    return (failure.strerror or str(failure)).lower()


@contextlib.contextmanager
def _moving(target: str, name_in_errors: str, *, replace: bool) -> Iterator[Output]:
    """Write beside the target, and move there at the end."""
    with temporary_name(*os.path.split(target)) as temporary:
        with _opened(temporary) as file:
            output = Output(HashedStream(file), temporary)
            yield output
            output.stream.flush()
            os.fsync(file.fileno())
        output.stream.check(temporary)
        if os.name == "posix" and os.path.exists(target):
            os.chmod(temporary, stat.S_IMODE(os.stat(target).st_mode))
        if output.failed:
            os.replace(temporary, target + FAILED)
        elif replace:
            os.replace(temporary, target)
        elif not _moved_to_free_place(temporary, target):
            raise _taken(name_in_errors)


def _moved_to_free_place(temporary: str, target: str) -> bool:
    """Move a file to a name that nobody else has taken meanwhile; False where another text has it."""
    try:
        try:
            os.link(temporary, target)
            os.unlink(temporary)
        except FileExistsError:
            raise
        except OSError:  # a file system without links: take the name with an empty file first
            with open(target, "xb"):
                pass
            os.replace(temporary, target)
    except FileExistsError:
        import filecmp

        return filecmp.cmp(temporary, target, shallow=False)
    return True


@contextlib.contextmanager
def _opened(path: str, mode: int = 0o666) -> Iterator[BinaryIO]:
    """Yield a new file of a name that `temporary_name` has given."""
    with open(path, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
        _unfinished[path] = file.fileno()
        try:
            yield file
        finally:
            _unfinished[path] = -1


@contextlib.contextmanager
def temporary_name(folder: str, name: str) -> Iterator[str]:
    """Yield a name for a file that exists no longer than the block, whatever ends that."""
    for left in _left(folder, name, "*"):
        with contextlib.suppress(OSError):
            if os.stat(left).st_mtime < time.time() - _ABANDONED:
                os.unlink(left)
    path = os.path.join(folder, f".{name}.{os.getpid()}-{os.urandom(4).hex()}.part")
    _unfinished[path] = -1  # before it exists: a signal at any moment finds a name to remove
    try:
        yield path
    finally:
        _remove([path])
        _unfinished.pop(path, None)


def _same(source: str | os.PathLike[str] | int, path: str) -> bool:
    try:
        return os.path.samestat(os.stat(source), os.stat(path))
    except OSError:
        return not isinstance(source, int) and os.path.realpath(source) == os.path.realpath(path)
