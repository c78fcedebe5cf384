"""Text to verify: bytes, or a file that may still be growing."""

from __future__ import annotations

import mmap
import os
import stat
import time
from pathlib import Path
from typing import BinaryIO, Final

from cornersmooth.errors import InputError

#: seconds between two looks at a file that grows
_PAUSE: Final = 0.003

_GROWING, _WHOLE, _GIVEN_UP = 0, 1, 2


def unreadable(error: OSError, name: str | None) -> InputError:
    """Say why a text cannot be read."""
    return InputError("CS500", f"cannot read: {error.strerror}", "check name and rights", file=name)


def readable_twice(text: bytes | str | os.PathLike[str]) -> bytes | str | os.PathLike[str]:
    """Return the path of a file as it is, and all that comes out of a pipe or device."""
    if isinstance(text, bytes):
        return text
    try:
        mode = os.stat(text).st_mode
        return text if stat.S_ISREG(mode) or stat.S_ISDIR(mode) else Path(text).read_bytes()
    except OSError:  # who opens it says why
        return text


class GivenUp(Exception):  # noqa: N818 - no error: who waits for the text need not wait any more
    """Nobody wants the text any more."""


class Source:
    """A text whose parts can be fetched by several processes.

    Parameters
    ----------
    text : bytes or path

    Raises
    ------
    InputError
        CS500 where a file cannot be read.
    """

    def __init__(self, text: bytes | str | os.PathLike[str]) -> None:
        self._bytes = text if isinstance(text, bytes) else None
        self.name = None if isinstance(text, bytes) else str(text)
        self._files: dict[int, BinaryIO] = {}  # every process has its own place in the file
        self._owner = os.getpid()
        self._state = mmap.mmap(-1, 1)  # shared with forked processes
        if self.name is not None:
            self._file(self.name)

    def _file(self, name: str) -> BinaryIO:
        process = os.getpid()
        if process not in self._files:
            try:
                self._files[process] = open(name, "rb", buffering=0)  # noqa: SIM115 - see `close`
            except OSError as error:
                raise unreadable(error, name) from error
        return self._files[process]

    def finish(self) -> None:
        """Say that the text grows no more."""
        self._state[0] = _WHOLE

    def give_up(self) -> None:
        """Say that nobody need wait any more."""
        self._state[0] = _GIVEN_UP

    def close(self) -> None:
        """Close the file in this process."""
        file = self._files.pop(os.getpid(), None)
        if file is not None:
            file.close()

    def size(self, wanted: int) -> int:
        """Bytes there are: at least so many, unless the text is shorter.

        Raises
        ------
        GivenUp
        """
        while True:
            state = self._state[0]  # before the size: a text that has grown is whole afterwards
            if self._bytes is not None:
                return len(self._bytes)
            size = os.fstat(self._file(str(self.name)).fileno()).st_size
            if state == _GIVEN_UP or (os.getpid() != self._owner and os.getppid() != self._owner):
                raise GivenUp
            if size >= wanted or state == _WHOLE:
                return size
            time.sleep(_PAUSE)

    def read(self, start: int, stop: int) -> bytes:
        """Bytes from `start` to `stop`; fewer where the text ends before."""
        size = max(min(stop, self.size(stop)) - start, 0)
        if self._bytes is not None:
            return self._bytes[start : start + size]
        file = self._file(str(self.name))
        file.seek(start)
        parts: list[bytes] = []
        while size > 0:
            parts.append(file.read(size))
            if not parts[-1]:
                break
            size -= len(parts[-1])
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def part(self, start: int, stop: int) -> Part:
        """Return a part to read from its start on."""
        return Part(self, start, stop)


class Part:
    """Part of a source, as a file; of a line that goes on behind its end nothing is read.

    Parameters
    ----------
    source : Source
    start, stop : int
    """

    def __init__(self, source: Source, start: int, stop: int) -> None:
        self.source, self._place, self._stop = source, start, stop

    def read(self, size: int) -> bytes:
        """Next bytes, at most so many."""
        data = self.source.read(self._place, min(self._place + size, self._stop))
        self._place += len(data)
        return data[: data.rfind(b"\n") + 1] if self._place == self._stop else data
