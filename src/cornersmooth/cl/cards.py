"""What stands beside the statements on punched cards and in listings: numbers in columns 73 to 80, or in front.

They are cut where every line has them and they ascend; where only some lines have them they cannot be told from the
statement: an error.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.cl.messages import error

#: columns that statements may use; a card has 8 more
WIDTH: Final = 72
CARD: Final = 80

#: columns 73 to 80: a number, with a name before it (CATIA: ``PT     6``)
_FIELD: Final = re.compile(rb"[ \t]*([A-Za-z]{0,7})[ \t]*([0-9]+)[ \t]*")

#: a number in front of a statement, or of its continuation
_IN_FRONT: Final = re.compile(rb"[ \t]*([0-9]{1,9})(?:[ \t]*[:.)]?[ \t]*(?=[A-Za-z$])|[ \t]*[:.)]?[ \t]+(?=\S))")

#: lines that may hold anything anywhere
_FREE: Final = re.compile(rb"[ \t]*(\$\$|PARTNO|PPRINT|INSERT|REMARK|LETTER|TPRINT|DISPLY)", re.IGNORECASE)


def without_card_columns(data: bytes, file: str) -> tuple[bytes, str | None]:
    """Return a text without what stands beside its statements, and the code of the note about it.

    Parameters
    ----------
    data : bytes
        Lines that end with LF.

    Raises
    ------
    InputError
        CS189 where only some lines have numbers in columns 73 to 80.
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
