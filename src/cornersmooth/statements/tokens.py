"""Tokens: what the CL file asks for beside the motion, and what the words of a program do, in one form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cornersmooth.control.state import after_word, ends_of, is_off
from cornersmooth.control.table import Means
from cornersmooth.nc_reader.elements import RETRACT, Event

#: decimals of a spindle speed that count: FANUC's S takes whole numbers only
SPEED_DECIMALS = 0

#: value of a tap, whatever the control calls it
TAP = 84.0


@dataclass(frozen=True, slots=True)
class Token:
    """One change of state, or one action."""

    #: ``"tool"``, ``"spindle"``, ``"speed"``, ``"coolant"``, ``"compensation"``, ``"stop"``, ``"dwell"``, ``"tap"``,
    #: ``"home"``, ``"end"``
    kind: str
    value: float | str  #: a number; or the word of the CL file that says the same: ``"FLOOD"``, ``"OFF"``
    place: int  #: the move of the CL file, or the element of the program, that it is written before
    line: int  #: CL or NC line
    #: of an action: whether it may be missing in the other file, as an optional stop of the post before another tool
    optional: bool = False


#: what G words mean that the reader says for all controls
_CODES: dict[float, tuple[str, float | str]] = {
    TAP: ("tap", TAP),
    40.0: ("compensation", "OFF"),
    41.0: ("compensation", "LEFT"),
    42.0: ("compensation", "RIGHT"),
}

#: what posts write before another tool on their own
_BEFORE_TOOLS = (("stop", "OPSTOP"), ("spindle", "ORIENT"))

#: what a spindle does that does not turn
ENDINGS = ("OFF", "ORIENT")

#: word that takes another tool
_CHANGE = ("M", 6.0)


def of_m(value: float, means: Means) -> tuple[str, float | str]:
    """Kind and value of what an M word other than M6 does on a control; `means` as of `Table.means`."""
    return means.get(f"M{value:g}", ("auxiliary", value))


def _is_idle(word: tuple[str, float], means: Means) -> bool:
    """Whether a word is R0 of M91, or ends what ends with the tool."""
    value = of_m(word[1], means)[1] if word[0] == "M" else ""
    return word == ("G", 40.0) or word[0] == RETRACT or value in ENDINGS or is_off(value)


def said(events: Sequence[Event], means: Means) -> list[Token]:
    """What the words of the NC program do, each before its element; `means` as of `Table.means`."""
    tokens: list[Token] = []
    chosen: float | None = None
    ends, coolant = ends_of(means), "OFF"
    words = [(event.letter, event.value) for event in events]
    changes = _CHANGE in words
    idle = [_is_idle(word, means) for word in words]
    for k, (event, word) in enumerate(zip(events, words, strict=True)):
        letter, value = word
        meaning: tuple[str, float | str] | None = None
        if letter == "T":
            chosen = value
            if words[k + 1 : k + 2] != [_CHANGE]:
                meaning = "next tool", value
        elif word == _CHANGE:
            meaning = None if chosen is None else ("tool", chosen)
            coolant = "OFF"  # the change stops it
        elif letter == "M":
            meaning = of_m(value, means)
            if meaning[0] == "coolant":
                before, coolant = coolant, after_word(coolant, str(meaning[1]), ends) or ""
                if before not in ("OFF", coolant) and coolant != "OFF":  # M9 alone ends the one before (LinuxCNC)
                    coolant = f"{before} beside {coolant}"
                meaning = "coolant", coolant
        elif word == ("G", 4.0):
            meaning = "dwell", round(float(event.text))
        elif letter == "G" and value in _CODES:
            meaning = _CODES[value]
        elif letter == RETRACT:
            meaning = "home", ""
        elif letter == "S":
            meaning = "speed", round(value, SPEED_DECIMALS)
        elif letter in means:
            meaning = means[letter][0], value
        if meaning is None:
            continue
        # without M6 the control may take the tool with T alone
        optional = meaning[0] in ("dwell", "home") or (meaning[0] == "next tool" and changes)
        if meaning in _BEFORE_TOOLS:  # and nothing moves between
            after = next((j for j in range(k + 1, len(words)) if not idle[j]), None)
            tool = after is not None and (words[after][0] == "T" or words[after] == _CHANGE)
            another = tool and events[after or 0].element == event.element
            optional = another and any(letter == "T" for letter, _ in words[:k])
        tokens.append(Token(*meaning, event.element, event.line, optional))
    return tokens
