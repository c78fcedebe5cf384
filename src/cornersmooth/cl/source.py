"""Contents of an input: a path or bytes, plain or gzip, to text with LF line ends."""

from __future__ import annotations

import gzip
import os
import zlib
from typing import Final

from cornersmooth.cl.messages import error

_GZIP: Final = b"\x1f\x8b"
_UTF8_BOM: Final = b"\xef\xbb\xbf"
_UTF16_BOMS: Final = (b"\xff\xfe", b"\xfe\xff")

#: DOS end of file, still written by old posts
_CTRL_Z: Final = b"\x1a"


def load(source: str | os.PathLike[str] | bytes, name: str | None) -> tuple[bytes, str]:
    """Return the contents and the name for messages.

    Parameters
    ----------
    source : path or bytes
    name : str or None
        None for the path itself, or ``"<memory>"``.

    Raises
    ------
    InputError
        CS100 where the file cannot be read, CS103 where it is no complete gzip file.
    """
    if isinstance(source, bytes):
        data, name = source, name or "<memory>"
    else:
        name = name or os.fspath(source)
        try:
            with open(source, "rb") as file:
                data = file.read()
        except OSError as why:
            raise error("CS100", name, None, why=why.strerror or why) from why
    if data.startswith(_GZIP):
        try:
            data = gzip.decompress(data)
        except (OSError, EOFError, zlib.error) as why:
            raise error("CS103", name, None, why=why) from why
    return data, name


def clean(data: bytes, name: str) -> bytes:
    """Return the text in UTF-8 or an eight-bit code, with LF after every line.

    Raises
    ------
    InputError
        CS101 for an empty file, CS102 for a binary one.
    """
    if data.startswith(_UTF16_BOMS):  # what PowerShell's > makes of a text file
        try:
            data = data.decode("utf-16").encode()
        except UnicodeDecodeError as why:
            raise error("CS102", name, None) from why
    data = data.removeprefix(_UTF8_BOM)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if data.endswith(_CTRL_Z):
        data = data.rstrip(_CTRL_Z)
    if not data or data.isspace():
        raise error("CS101", name, 1)
    if (at := data.find(b"\0")) >= 0:
        raise error("CS102", name, data.count(b"\n", 0, at) + 1)
    return data if data.endswith(b"\n") else data + b"\n"
