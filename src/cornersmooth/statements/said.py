"""What a program says beside the motion: its words as tokens."""

from __future__ import annotations

from collections.abc import Sequence

from cornersmooth.nc_reader.elements import Event
from cornersmooth.statements.tokens import PAUSES, SPEED_DECIMALS, TAP, Place, Token, of_m

#: letters whose words are tokens as they are, and G words
_PLAIN = {"H": "offset", "D": "register"}
_CODES = {TAP: "tap", 40.0: "compensation", 41.0: "compensation", 42.0: "compensation"}

#: words that take another tool, and that end the program or that
_CHANGE = ("M", 6.0)
_ENDS = (_CHANGE, ("M", 2.0), ("M", 30.0))


def said(events: Sequence[Event], places: Sequence[Place]) -> list[Token]:
    """What the words of the NC program do, each at its place."""
    tokens: list[Token] = []
    chosen: float | None = None
    moment = element = 0
    spoken = [(event, place) for event, place in zip(events, places, strict=True) if event.letter != "("]
    words = [(event.letter, event.value) for event, _ in spoken]
    elements = [event.element for event, _ in spoken]
    for k, (event, place) in enumerate(spoken):
        letter, value = words[k]
        moment, element = moment + (event.element != element), event.element
        meaning: tuple[str, float] | None = None
        if letter == "T":
            chosen = value
            if words[k + 1 : k + 2] != [_CHANGE]:
                meaning = "next tool", value
        elif words[k] == _CHANGE:
            meaning = None if chosen is None else ("tool", chosen)
        elif letter == "M":
            meaning = of_m(value)
        elif (letter, value) == ("G", 4.0):
            meaning = "dwell", round(float(event.text))
        elif letter == "G" and value in _CODES:
            meaning = _CODES[value], value
        elif letter == "S":
            meaning = "speed", round(value, SPEED_DECIMALS)
        elif letter in _PLAIN:
            meaning = _PLAIN[letter], value
        if meaning is None:
            continue
        optional = False
        if words[k] == ("M", 1.0):  # before another tool, and nothing moves between
            after = next((j for j in range(k + 1, len(words)) if words[j] != ("G", 40.0)), None)  # R0 of M91
            another = after is not None and words[after][0] == "T" and elements[after] == element
            optional = another and any(letter == "T" for letter, _ in words[:k])
        elif letter == "H":  # nothing moves before the next tool, or the end
            after = next((j for j in range(k + 1, len(words)) if words[j] in _ENDS), None)
            optional = after is not None and elements[after] == element
        at, room, reach, others = place
        tokens.append(Token(*meaning, at, event.line, room, moment, optional, others, reach, element))
        moment += meaning[0] in PAUSES and not optional
    return tokens
