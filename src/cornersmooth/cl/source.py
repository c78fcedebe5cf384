"""Contents of an input: a path or bytes, plain or gzip, to text with LF line ends, without numbers of cards."""

from __future__ import annotations

import gzip
import hashlib
import io
import os
import re
import zlib
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, Protocol

import numpy as np

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

#: columns that statements may use; a card has 8 more
WIDTH: Final = 72
CARD: Final = 80

#: columns 73 to 80: a number, with a name before it (CATIA: ``PT     6``)
_FIELD: Final = re.compile(rb"[ \t]*([A-Za-z]{0,7})[ \t]*([0-9]+)[ \t]*")

#: a number in front of a statement, or of its continuation
_IN_FRONT: Final = re.compile(rb"[ \t]*([0-9]{1,9})(?:[ \t]*[:.)]?[ \t]*(?=[A-Za-z$])|[ \t]*[:.)]?[ \t]+(?=\S))")

#: lines that may hold anything anywhere
_FREE: Final = re.compile(rb"[ \t]*(\$\$|PARTNO|PPRINT|INSERT|REMARK|LETTER|TPRINT|DISPLY)", re.IGNORECASE)


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


class _Reader(Protocol):
    def read(self, size: int, /) -> bytes: ...


def read_bounded(file: _Reader, name: str, *, size_limit: bool = True, most: int = LARGEST) -> bytes:
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


def without_card_columns(data: bytes, file: str) -> tuple[bytes, str | None]:
    """Return a text without what stands beside its statements, and the code of the note about it.

    Punched cards and listings have numbers in columns 73 to 80, or in front. They are cut where every line has them and
    they ascend; where only some lines have them they cannot be distinguished from the statement (InputError CS189).
    """
    head = data[: data.find(b"\n") + 1]
    if _IN_FRONT.match(head) and (cut := _without_front(data.split(b"\n"))) is not None:
        return cut, "CS192"
    if _may_be_cards(data) and (cut := _without_field(data.split(b"\n"), file)) is not None:
        return cut, "CS191"
    return data, None


def _without_front(lines: list[bytes]) -> bytes | None:
    """Lines without the ascending numbers in front of all of them; None where they have none."""
    found = [_IN_FRONT.match(line) if line.strip() else None for line in lines]
    if any(match is None and line.strip() for match, line in zip(found, lines, strict=True)):
        return None
    if not _ascends([int(match[1]) for match in found if match]):
        return None
    return b"\n".join(line[match.end() :] if match else line for match, line in zip(found, lines, strict=True))


def _may_be_cards(data: bytes) -> bool:
    """Whether a line ends in columns 73 to 80, after a blank in column 72."""
    letters = np.frombuffer(data, np.uint8)
    end = np.flatnonzero(letters == ord("\n"))
    start = np.concatenate(([0], end[:-1] + 1))
    start = start[(end - start > WIDTH) & (end - start <= CARD)]
    return bool(np.isin(letters[start + WIDTH - 1], (ord(" "), ord("\t"))).any())


def _without_field(lines: list[bytes], file: str) -> bytes | None:
    """Lines without columns 73 to 80; None where they belong to the statements."""
    long = [i for i, line in enumerate(lines) if len(line.rstrip()) > WIDTH]
    field = {i: number for i in long if (number := _field(lines[i])) is not None}
    statements = [i for i in long if not _FREE.match(lines[i])]
    clear = [i for i in statements if i in field and b"$" not in lines[i]]
    if not clear:
        return None
    if not all(i in field for i in statements) or not _ascends([field[i] for i in statements]):
        raise error("CS189", file, clear[0] + 1)
    return b"\n".join(line[:WIDTH] if i in field else line for i, line in enumerate(lines))


def _field(line: bytes) -> int | None:
    """Return the number in columns 73 to 80 that cannot be part of the statement; 0 where a name is before it."""
    found = _FIELD.fullmatch(line[WIDTH:].rstrip())
    if found is None or len(line.rstrip()) > CARD:
        return None
    before = line[:WIDTH]
    apart = before[-1:].isspace() and not before.rstrip().endswith((b",", b"/", b"="))
    return (0 if found[1] else int(found[2])) if apart else None


def _ascends(numbers: Sequence[int]) -> bool:
    return all(a <= b for a, b in pairwise(numbers))
