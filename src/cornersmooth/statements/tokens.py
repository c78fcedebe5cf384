"""Tokens: what the CL file asks for beside the motion, and what the words of a program do, in one form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from cornersmooth.nc_reader.elements import Event
from cornersmooth.nc_reader.word_tables import Means

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
    value: float | str  #: a number; or the word of the CL file that says the same: ``"FLOOD"``, ``"OFF"``
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

#: what G words mean that the reader says for all controls
_CODES: dict[float, tuple[str, float | str]] = {
    TAP: ("tap", TAP),
    40.0: ("compensation", "OFF"),
    41.0: ("compensation", "LEFT"),
    42.0: ("compensation", "RIGHT"),
}

#: what posts write before another tool on their own
_BEFORE_TOOLS = (("stop", "OPSTOP"), ("spindle", "ORIENT"))

_ENDINGS = ("OFF", "ORIENT")

#: word that takes another tool
_CHANGE = ("M", 6.0)


def of_m(value: float, means: Means) -> tuple[str, float | str]:
    """Kind and value of what an M word other than M6 does on a control; `means` as of `means_of`."""
    return means.get(f"M{value:g}", ("auxiliary", value))


def said(events: Sequence[Event], places: Sequence[Place], means: Means) -> list[Token]:
    """What the words of the NC program do, each at its place; `means` as of `means_of`."""
    tokens: list[Token] = []
    chosen: float | None = None
    moment = element = 0
    words = [(event.letter, event.value) for event in events]
    elements = [event.element for event in events]
    changes = frozenset(words) & {_CHANGE}
    ends = [word == _CHANGE or (word[0] == "M" and of_m(word[1], means)[0] == "end") for word in words]
    # R0 of M91, and what ends with the tool
    idle = [word == ("G", 40.0) or (word[0] == "M" and of_m(word[1], means)[1] in _ENDINGS) for word in words]
    for k, (event, place) in enumerate(zip(events, places, strict=True)):
        letter, value = words[k]
        moment, element = moment + (event.element != element), event.element
        meaning: tuple[str, float | str] | None = None
        if letter == "T":
            chosen = value
            if words[k + 1 : k + 2] != [_CHANGE]:
                meaning = "next tool", value
        elif words[k] == _CHANGE:
            meaning = None if chosen is None else ("tool", chosen)
        elif letter == "M":
            meaning = of_m(value, means)
        elif (letter, value) == ("G", 4.0):
            meaning = "dwell", round(float(event.text))
        elif letter == "G" and value in _CODES:
            meaning = _CODES[value]
        elif letter == "S":
            meaning = "speed", round(value, SPEED_DECIMALS)
        elif letter in means:
            meaning = means[letter][0], value
        if meaning is None:
            continue
        # without M6 the control may take the tool with T alone
        optional = meaning[0] == "dwell" or (meaning[0] == "next tool" and _CHANGE in changes)
        if meaning in _BEFORE_TOOLS:  # and nothing moves between
            after = next((j for j in range(k + 1, len(words)) if not idle[j]), None)
            tool = after is not None and (words[after][0] == "T" or words[after] == _CHANGE)
            another = tool and elements[after or 0] == element
            optional = another and any(letter == "T" for letter, _ in words[:k])
        elif letter == "H":  # nothing moves before the next tool, or the end
            after = next((j for j in range(k + 1, len(words)) if ends[j]), None)
            optional = after is not None and elements[after] == element
        at, room, reach, others = place
        tokens.append(Token(*meaning, at, event.line, room, moment, optional, others, reach, element))
        moment += meaning[0] == "dwell" or (meaning[0] in PAUSES and not optional)
    return tokens
