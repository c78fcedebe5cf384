"""Tokens: what the CL file asks for beside the motion, and what the words of a text do, in one form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

#: decimals of a spindle speed that count: FANUC's S takes whole numbers only
SPEED_DECIMALS = 0

#: value of a tap, whatever the control calls it
TAP = 84.0


@dataclass(frozen=True, slots=True)
class Token:
    """One change of state, or one action."""

    #: ``"tool"``, ``"spindle"``, ``"speed"``, ``"coolant"``, ``"compensation"``, ``"stop"``, ``"dwell"``, ``"tap"``,
    #: ``"end"``
    kind: str
    value: float
    place: float  #: mm: path length from the start of the original motion
    line: int  #: CL or NC line
    #: mm: how far the place is uncertain beyond what printed digits account for: rotary words near the pole
    room: float = 0.0
    #: tokens of one moment have no motion, stop or dwell between them: of a state only the last one counts
    moment: int = 0
    #: whether it may be missing: an optional stop right before another tool, the offset of a tool that never moves
    optional: bool = False
    others: tuple[float, ...] = ()  #: mm: other places that it may have, where the path goes to and fro
    #: mm: how much farther along it may be, too: what the CL file has there leaves nothing in the text
    reach: float = 0.0
    element: int = -1  #: element of the text that it stands before; -1 in the CL file


class Place(NamedTuple):
    """Where a word of the program is, as in `Token`."""

    at: float
    room: float = 0.0
    reach: float = 0.0
    others: tuple[float, ...] = ()


#: kinds during which a state matters although nothing moves
PAUSES = ("stop", "dwell")


def of_m(value: float) -> tuple[str, float]:
    """Kind and value of what an M word other than M6 does."""
    if value in (3, 4, 5, 19):
        return "spindle", value
    if value in (7, 8, 9, 88, 89):
        return "coolant", 9.0 if value == 89 else value
    if value in (2, 30):
        return "end", 30.0
    return ("stop" if value in (0, 1) else "auxiliary"), value
