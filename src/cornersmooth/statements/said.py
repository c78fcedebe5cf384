"""What a text says beside the motion: its words as tokens."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from cornersmooth.nc_reader.elements import Event
from cornersmooth.statements.tokens import PAUSES, SPEED_DECIMALS, TAP, Token, of_m

#: letters whose words are tokens as they stand
_PLAIN = {"S": "speed", "H": "offset", "D": "register"}


def said(
    events: Sequence[Event],
    places: Sequence[float],
    rooms: Sequence[float],
    reaches: Sequence[float],
    others: Sequence[tuple[float, ...]],
) -> list[Token]:
    """What the words of the NC text do; the rest, in mm, is what `Token` has as place, room, reach and others."""
    tokens: list[Token] = []
    chosen: float | None = None
    moment = element = 0
    speaking = [event for event in events if event.letter != "("]
    rows = [row for row in zip(events, places, rooms, reaches, others, strict=True) if row[0].letter != "("]
    for k, (event, place, room, reach, elsewhere) in enumerate(rows):
        value, line, before = event.value, event.line, len(tokens)
        moment, element = moment + (event.element != element), event.element
        if event.letter == "T":
            chosen = value
            following = speaking[k + 1] if k + 1 < len(speaking) else None
            if following is None or (following.letter, following.value) != ("M", 6.0):
                tokens.append(Token("next tool", value, place, line))
        elif event.letter == "M" and value == 6:
            if chosen is not None:
                tokens.append(Token("tool", chosen, place, line))
        elif event.letter == "M" and value in (2, 30):
            tokens.append(Token("end", 30.0, place, line))
        elif event.letter == "M":
            tokens += of_m(value, place, line)
        elif event.letter == "G" and value == 4:
            tokens.append(Token("dwell", round(float(event.text)), place, line))
        elif event.letter == "G" and value == TAP:
            tokens.append(Token("tap", value, place, line))
        elif event.letter == "G" and value in (40, 41, 42):
            tokens.append(Token("compensation", value, place, line))
        elif event.letter in _PLAIN:
            number = round(value, SPEED_DECIMALS) if event.letter == "S" else value
            tokens.append(Token(_PLAIN[event.letter], number, place, line))
        habit = (event.letter, value) == ("M", 1.0) and _before_a_tool(speaking, k)
        idle = (event.letter, value) == ("M", 6.0) and _is_idle(speaking, k)
        place_of = partial(replace, room=room, reach=reach, others=elsewhere, moment=moment, element=event.element)
        tokens[before:] = [place_of(token, habit=habit, idle=idle) for token in tokens[before:]]
        moment += any(token.kind in PAUSES and not token.habit for token in tokens[before:])
    return tokens


def _before_a_tool(speaking: Sequence[Event], k: int) -> bool:
    """Whether the next word is that of a tool, with no motion between; and there has been one before."""
    event = speaking[k]
    behind = (other for other in speaking[k + 1 :] if (other.letter, other.value) != ("G", 40.0))  # R0 of M91
    following = next(behind, None)
    changes = following is not None and following.letter == "T" and following.element == event.element
    return changes and any(before.letter == "T" for before in speaking[:k])


def _is_idle(speaking: Sequence[Event], k: int) -> bool:
    """Whether the next tool, or the end of the program, comes before any motion."""
    here = speaking[k].element
    ends = (other for other in speaking[k + 1 :] if other.letter == "M" and other.value in (2.0, 6.0, 30.0))
    return next((other.element == here for other in ends), False)
