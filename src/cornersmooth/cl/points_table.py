"""Text of point files into a table of numbers: separators, decimal commas, comments, encodings, line numbers.

Two ways lead to the same table. The fast one converts a chunk of lines at once where every line holds plain numbers.
The careful one goes line by line, accepts what is unusual and names the line of what is wrong.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from zlib import crc32

import numpy as np

from cornersmooth.cl.grammar import NUMBER
from cornersmooth.cl.grammar import number as plain_number
from cornersmooth.cl.messages import error
from cornersmooth.cl.points_header import Columns, is_header
from cornersmooth.cl.source import UTF8_BOM, UTF16_BOMS
from cornersmooth.cl.source import clean as plain_lines
from cornersmooth.model import Floats, Ints
from cornersmooth.text import parse_numbers

_COMMENT = re.compile(rb"(?:#|%|//)[^\n]*")
_COMMENT_MARK = re.compile(r"\s*(?:#|%|//)+(.*)")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+(?:,\d+)?(?:[Ee][+-]?\d+)?", re.ASCII)
_SEPARATOR = re.compile(r"\s*,\s*|\s+")
#: a cell in quotes, and a number with a decimal comma in them
_QUOTED = re.compile(rb'"([^",;\n]*)"')
_QUOTED_COMMA = re.compile(rb'"([+-]?\d+),(\d+)"')
_FIRST_ROW = re.compile(rb"[^\n]*[^\s,;][^\n]*")

#: bytes converted at once; large enough for whole-array speed, small enough for the caches
_CHUNK = 1 << 18

#: lines that tell what a file is
_LEADING = 200

#: bytes between cells
_GAP = np.isin(np.arange(256), list(b" \t,\n"))


@dataclass(frozen=True)
class PointText:
    """A point file, cleaned: no comments, newlines only, commas or blanks between cells, decimal points."""

    body: bytes  #: the rows; starts where line `first_line` of the file starts
    first_line: int  #: from 1
    header: str | None
    header_line: int
    #: cells of the first row and its line, 0 where there is no row
    width: int
    row_line: int
    header_certain: bool  #: false for a header found in a comment, which must fit the rows to be believed


def clean(data: bytes, file: str) -> PointText:
    """Take a file apart into header and rows.

    Raises InputError CS150 for an empty file, CS160 where commas may be decimal or separating, CS161 for binary data.
    """
    data = plain_lines(data, file, empty="CS150", binary="CS161")
    if b'"' in data:
        data = _QUOTED.sub(rb"\1", _QUOTED_COMMA.sub(rb"\1.\2", data))
    header, header_line, certain, start = _head(data)
    body, first_line = data[start:], data.count(b"\n", 0, start) + 1
    if any(mark in body for mark in (b"#", b"%", b"//")):
        body = _COMMENT.sub(b"", body)
    body = _plain_commas(body, file, first_line)
    row = _FIRST_ROW.search(body)
    width = len(_cells(_decode(row[0]).rstrip(", \t"))) if row else 0
    row_line = first_line + body.count(b"\n", 0, row.start()) if row else 0
    return PointText(body, first_line, header, header_line, width, row_line, certain)


def numbers(text: PointText, columns: Columns, file: str) -> tuple[Floats, Ints]:
    """Read the rows of a cleaned file: (n, columns.width) float64, and the line of each.

    The columns say which of them must hold a number, and which may (the feed); whatever stands in the others becomes
    NaN where it is no number. Words of a column of orders become numbers, the same for the same word.
    Raises InputError CS151, CS152, CS153, CS164, CS166 with the first row that does not fit.
    """
    tables, lines = [], []
    first, start = text.first_line, 0
    while start < len(text.body):
        end = text.body.find(b"\n", start + _CHUNK) + 1 or len(text.body)
        chunk = text.body[start:end]
        table, row = _flags(_fast(chunk, columns.width), columns) or careful(chunk, columns, first, file)
        tables.append(table)
        lines.append(row + first)
        first, start = first + chunk.count(b"\n"), end
    if not tables:
        return np.zeros((0, columns.width)), np.zeros(0, np.int64)
    return np.concatenate(tables), np.concatenate(lines)


def careful(chunk: bytes, columns: Columns, first_line: int, file: str) -> tuple[Floats, Ints]:
    """Table of a chunk that starts at `first_line`, and the line of each row less that; one line at a time."""
    used = {*columns.wanted, *(() if columns.feed is None else (columns.feed,))}
    table: list[list[float]] = []
    offsets: list[int] = []
    for offset, line in enumerate(_decode(chunk).split("\n")):
        cells = _cells(line)
        while len(cells) > columns.width and not cells[-1]:
            cells.pop()
        if not any(cells):
            continue
        if len(cells) != columns.width:
            raise error("CS151", file, first_line + offset, got=len(cells), want=columns.width)
        row = [_number(cell) for cell in cells]
        if columns.rapid is not None:
            row[columns.rapid] = _rapid(cells[columns.rapid], columns, file, first_line + offset)
        for column in columns.orders:
            if math.isnan(row[column]):  # a word: the same number for the same word
                row[column] = -1.0 - crc32(cells[column].lower().encode())
        for column in used:
            if not math.isfinite(row[column]) and (cells[column] or column in columns.wanted):
                cell = cells[column]
                known = NUMBER.fullmatch(cell) or _NOT_FINITE.fullmatch(cell)
                raise error("CS153" if known else "CS152" if cell else "CS164", file, first_line + offset, cell=cell)
        table.append(row)
        offsets.append(offset)
    return np.array(table, np.float64).reshape(-1, columns.width), np.array(offsets, np.int64)


#: values of the column of rapids, whatever it says
RAPID, FED = 0.0, 1.0

_RAPID_WORDS = frozenset({"rapid", "g0", "g00", "rapids", "traverse", "fast", "true", "yes", "y", "r", "positioning"})
_FEED_WORDS = frozenset(
    """
    feed g1 g01 linear line cut cutting work false no n f l normal plunge ramp lead leadin leadout entry exit engage
    """.split()
)


def _flags(read: tuple[Floats, Ints] | None, columns: Columns) -> tuple[Floats, Ints] | None:
    """Rows with `RAPID` or `FED` in the column of rapids; None where its numbers do not say."""
    if read is None or columns.rapid is None:
        return read
    rapids = read[0][:, columns.rapid]
    if columns.rapid_as == "word" or not np.isin(rapids, (0.0, 1.0)).all():
        return None
    if columns.rapid_as == "flag":
        rapids[:] = 1.0 - rapids
    return read


def _rapid(cell: str, columns: Columns, file: str, line: int) -> float:
    """Whether a row is reached in rapid; an empty cell of flags is feed.

    Raises InputError CS166 for an unknown word, and for numbers in a column whose name does not tell what they mean.
    """
    word = re.sub(r"[^a-z0-9.]", "", cell.lower())
    number = _number(word)
    if math.isfinite(number) and columns.rapid_as != "word" and number in (0, 1):
        return number if columns.rapid_as == "code" else 1.0 - number
    if word in _RAPID_WORDS:
        return RAPID
    if word in _FEED_WORDS or (not word and columns.rapid_as == "flag"):
        return FED
    wanted = {"flag": "give 1 or 0", "code": "give G0 or G1", "word": "give rapid or feed in words"}
    raise error("CS166", file, line, cell=cell, column=columns.names[columns.rapid or 0], want=wanted[columns.rapid_as])


def is_row(line: str) -> bool:
    """Whether a line holds nothing but numbers, three at least."""
    cells = re.split(r"[\s,;]+", line.replace('"', "").strip(" \t,;"))
    return len(cells) >= 3 and all(NUMBER.fullmatch(cell) or _NOT_FINITE.fullmatch(cell) for cell in cells)


def leading_lines(data: bytes) -> Iterator[str]:
    """Yield the first lines that are neither blank nor comment, decoded."""
    head = data[: _LEADING * 400]
    if data.startswith(UTF16_BOMS):
        head = head.decode("utf-16", "replace").encode()
    for line in _decode(head.removeprefix(UTF8_BOM)).splitlines()[:_LEADING]:
        if line.strip() and not _COMMENT_MARK.match(line):
            yield line


def _decode(data: bytes) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _head(data: bytes) -> tuple[str | None, int, bool, int]:
    """Header, its line, whether it is certain, and where the rows start."""
    start, line, comment, comment_line = 0, 1, None, 0
    while start < len(data):
        end = data.index(b"\n", start)
        text = _decode(data[start:end])
        mark = _COMMENT_MARK.match(text)
        if mark:
            if is_header(mark[1]):
                comment, comment_line = mark[1], line
        elif text.strip():
            if any(NUMBER.fullmatch(cell) for cell in re.split(r"[\s,;]+", text)):
                break
            return text, line, True, end + 1
        start, line = end + 1, line + 1
    return comment, comment_line, False, start


def _plain_commas(body: bytes, file: str, first_line: int) -> bytes:
    """Rows with commas or blanks between the cells and decimal points in them."""
    separator = ";" if b";" in body else "\t" if b"\t" in body else None
    at = body.find(b",")
    if at >= 0:
        row = _decode(body[body.rfind(b"\n", 0, at) + 1 : body.index(b"\n", at)]).strip()
        cells = [cell.strip() for cell in row.split(separator)]
        cells = [cell for cell in cells if not cell[:1].isalpha()]
        if len(cells) >= 3 and all(_DECIMAL_COMMA.fullmatch(cell) for cell in cells if cell):
            if separator is None:
                raise error("CS160", file, first_line + body.count(b"\n", 0, at))
            return body.replace(b",", b".").replace(b";", b",")
    return body.replace(b";", b",")


def _cells(line: str) -> list[str]:
    return _SEPARATOR.split(line.strip())


def _number(cell: str) -> float:
    """Value of a cell, NaN where it is no number."""
    value = plain_number(cell)
    return math.nan if value is None else value


def _fast(chunk: bytes, width: int) -> tuple[Floats, Ints] | None:
    """Do what `careful` does where every line has `width` plain numbers, or nothing; None for any other chunk."""
    letters = chunk.translate(None, b" \t")
    if b",," in letters or b"\n," in letters or letters[:1] == b",":  # an empty cell
        return None
    gap = _GAP[np.frombuffer(chunk, np.uint8)]
    cell = np.flatnonzero(~gap & np.concatenate(([True], gap[:-1])))
    if not len(cell) or len(cell) % width:
        return None
    newline = np.flatnonzero(np.frombuffer(chunk, np.uint8) == ord("\n"))
    row = np.searchsorted(newline, cell[::width])
    if (row != np.searchsorted(newline, cell[width - 1 :: width])).any() or (np.diff(row) == 0).any():
        return None
    try:
        return parse_numbers(chunk).reshape(-1, width), row
    except ValueError:
        return None
