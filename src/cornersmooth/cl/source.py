"""Contents of an input: a path or bytes, plain or gzip, to text with LF line ends."""

from __future__ import annotations

import gzip
import hashlib
import io
import os
import zlib
from typing import IO, Final

from cornersmooth.cl.messages import error

_GZIP: Final = b"\x1f\x8b"
UTF8_BOM: Final = b"\xef\xbb\xbf"
UTF16_BOMS: Final = (b"\xff\xfe", b"\xfe\xff")

#: bytes that are read of an input, and of a gzip file: text of CL files is a tenth of itself when it is packed
LARGEST: Final = 2 << 30
_LARGEST_RATIO: Final = 200
_ALWAYS: Final = 1 << 26

#: bytes that are read at once: Python sets memory aside for all that a call may read, which Windows takes from others
_PIECE: Final = 16 << 20

#: DOS end of file, still written by old posts
_CTRL_Z: Final = b"\x1a"


def load(
    source: str | os.PathLike[str] | bytes, name: str | None, *, size_limit: bool = True
) -> tuple[bytes, str, str]:
    """Return the contents, their name for messages and the SHA-256 of the file.

    Where no name is given it is the path itself, or ``"<memory>"``.

    Raises InputError CS100: the file cannot be read; CS103: it is no complete gzip file; CS199: with a limit of size it
    is larger than `LARGEST`, or a gzip file that grows 200-fold.
    """
    if isinstance(source, bytes):
        data, name = source, name or "<memory>"
    else:
        name = name or os.fspath(source)
        try:
            with open(source, "rb") as file:
                data = read_bounded(file, name, size_limit=size_limit)
        except OSError as why:
            raise error("CS100", name, None, why=why.strerror or why) from why
    digest = hashlib.sha256(data).hexdigest()
    if data.startswith(_GZIP):
        most = min(LARGEST, max(_LARGEST_RATIO * len(data), _ALWAYS))
        try:
            with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
                data = read_bounded(file, name, size_limit=size_limit, most=most)
        except (OSError, EOFError, zlib.error) as why:
            raise error("CS103", name, None, why=why) from why
    return data, name, digest


def read_bounded(file: IO[bytes] | gzip.GzipFile, name: str, *, size_limit: bool = True, most: int = LARGEST) -> bytes:
    """Read a file to its end, if it has one.

    Raises InputError CS199: it holds more than `most` bytes, and there is a limit of size.
    """
    pieces, size = [], 0
    while piece := file.read(min(_PIECE, most + 1 - size) if size_limit else _PIECE):
        pieces.append(piece)
        size += len(piece)
    if size_limit and size > most:
        raise error("CS199", name, None, limit=f"{most / 1e6:,.0f} MB")
    return pieces[0] if len(pieces) == 1 else b"".join(pieces)


def clean(data: bytes, name: str, *, empty: str = "CS101", binary: str = "CS102") -> bytes:
    """Return the text in UTF-8 or an eight-bit code, with LF after every line.

    Raises InputError: the codes `empty` and `binary`, for files that are.
    """
    if data.startswith(UTF16_BOMS):  # what PowerShell's > makes of a text file
        try:
            data = data.decode("utf-16").encode()
        except UnicodeDecodeError as why:
            raise error(binary, name, None) from why
    data = data.removeprefix(UTF8_BOM)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if data.endswith(_CTRL_Z):
        data = data.rstrip(_CTRL_Z)
    if not data or data.isspace():
        raise error(empty, name, 1)
    if (at := data.find(b"\0")) >= 0:
        raise error(binary, name, data.count(b"\n", 0, at) + 1)
    return data if data.endswith(b"\n") else data + b"\n"
