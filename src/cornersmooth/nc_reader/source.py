"""Text to verify: bytes, or a file that may still be growing."""

from __future__ import annotations

import mmap
import os
import stat
import time
from pathlib import Path
from typing import BinaryIO, Final

from cornersmooth.errors import InputError

#: bytes that are taken of a pipe or device
_LARGEST: Final = 2 << 30

#: seconds between two looks at a file that grows
_PAUSE: Final = 0.003


def unreadable(error: OSError, name: str | None) -> InputError:
    """Say why a text cannot be read."""
    return InputError("CS500", f"cannot read: {error.strerror}", "check name and rights", file=name)


def readable_twice(text: bytes | str | os.PathLike[str]) -> bytes | str | os.PathLike[str]:
    """Return the path of a file as it is, and all that comes out of a pipe or device.

    Raises
    ------
    InputError
        CS500: more comes out than any program holds.
    """
    if isinstance(text, bytes):
        return text
    try:
        mode = os.stat(text).st_mode
        if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
            return text
        with Path(text).open("rb") as stream:
            data = stream.read(_LARGEST + 1)
    except OSError:  # who opens it says why
        return text
    if len(data) > _LARGEST:
        raise InputError("CS500", "a pipe or device gives more than 2 GB", "name a file", file=os.fspath(text))
    return data


class Source:
    """A text that is read from its beginning on, by one process: the one that made it or one forked from that.

    Parameters
    ----------
    text : bytes or path

    Raises
    ------
    InputError
        CS500 where a file cannot be read.
    """

    def __init__(self, text: bytes | str | os.PathLike[str]) -> None:
        self._text: bytes | BinaryIO
        if isinstance(text, bytes):
            self._text = text
        else:
            try:
                self._text = open(text, "rb", buffering=0)  # noqa: SIM115 - see `close`
            except OSError as error:
                raise unreadable(error, str(text)) from error
        self._place = 0
        self._owner = os.getpid()
        self._whole = mmap.mmap(-1, 1)  # shared with forked processes

    def finish(self) -> None:
        """Say that the text grows no more."""
        self._whole[0] = 1

    def close(self) -> None:
        """Close the file in this process."""
        if not isinstance(self._text, bytes):
            self._text.close()

    def begin(self) -> None:
        """Read from the beginning, again if need be."""
        self._place = 0

    def head(self, size: int) -> bytes:
        """First bytes, so many unless the text is shorter; `read` begins with them, too."""
        return self._part(0, size)

    def read(self, size: int) -> bytes:
        """Next bytes, so many unless the text ends."""
        data = self._part(self._place, size)
        self._place += len(data)
        return data

    def _part(self, start: int, size: int) -> bytes:
        if isinstance(self._text, bytes):
            return self._text[start : start + size]
        size = max(min(start + size, self._size(start + size)) - start, 0)
        self._text.seek(start)
        parts: list[bytes] = []
        while size > 0:
            parts.append(self._text.read(size))
            if not parts[-1]:
                break
            size -= len(parts[-1])
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _size(self, wanted: int) -> int:
        """Bytes there are: at least so many, unless the text is shorter; BrokenPipeError where its writer has gone."""
        file = self._text
        assert not isinstance(file, bytes)
        while True:
            whole = self._whole[0]  # before the size: a text that has grown is whole afterwards
            size = os.fstat(file.fileno()).st_size
            if size >= wanted or whole:
                return size
            if os.getpid() != self._owner and os.getppid() != self._owner:
                raise BrokenPipeError
            time.sleep(_PAUSE)
