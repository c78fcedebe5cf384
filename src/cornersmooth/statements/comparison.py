"""Compares what the CL file asks for with what a text says: the same tokens, in order, between the right poses."""

from __future__ import annotations

import difflib
import math
from bisect import bisect_left
from collections.abc import Callable

from cornersmooth.nc_reader.elements import Problem
from cornersmooth.statements.tokens import Token

#: names and codes of kinds
_NAMES = {
    "tool": ("tool T{:g}", 551),
    "next tool": ("next tool T{:g}", 551),
    "offset": ("offset H{:g}", 559),
    "spindle": ("spindle M{:g}", 552),
    "speed": ("speed S{:g}", 552),
    "coolant": ("coolant M{:g}", 553),
    "compensation": ("cutter compensation G{:g}", 554),
    "register": ("compensation register D{:g}", 554),
    "stop": ("stop M{:g}", 555),
    "dwell": ("dwell of {:g} ms", 556),
    "tap": ("tap G{:g}", 566),
    "end": ("end of program M{:g}", 557),
    "auxiliary": ("M{:g}", 558),
}

#: kinds of which there may be others where the user says them in his own words, too
_LOOSE = frozenset(("tool", "next tool", "stop", "end"))

#: all kinds
KINDS = frozenset(_NAMES)

#: what holds before anything is said; repeating it changes nothing
_AT_START = {"spindle": 5.0, "coolant": 9.0, "compensation": 40.0, "offset": 1.0}

#: states that a tool change and the end of the program may end by themselves
_ENDED = {"spindle": 5.0, "coolant": 9.0, "compensation": 40.0}

#: states that a tool change stops, to go on behind it
_STOPPED = ("spindle", "coolant")

#: kinds of which only changes count
_STATES = ("tool", "offset", "spindle", "speed", "coolant", "compensation")


def way_between(here: float, there: float) -> float:
    """How far two places are apart along the path, mm."""
    return abs(there - here)


def compare(
    asked_for: list[Token],
    found: list[Token],
    room: float,
    unsaid: frozenset[str | tuple[str, float]] = frozenset(),
    apart: Callable[[float, float], float] = way_between,
    own: frozenset[str] = frozenset(),
) -> list[Problem]:
    """Compare the two, kind by kind.

    Parameters
    ----------
    asked_for, found : list of Token
    room : float, mm
        How far apart along the path the places of the same token may be.
    unsaid : frozenset
        Kinds, and pairs of kind and value, that the control has no words for.
    apart : callable
        How far, in mm, two places along the path are apart that differ by more than the room.
    own : frozenset of str
        Kinds that the user says in words of his own, which are no tokens; of most there must be no others.
    """
    problems: list[Problem] = []
    end = max((token.place for token in asked_for if token.kind == "end"), default=math.inf)
    # what shifts the path counts wherever it is said
    unsaid = unsaid - {token.kind for token in found if token.kind == "compensation" and token.value != 40.0}
    asked_for = [token for token in asked_for if not {token.kind, (token.kind, token.value)} & (unsaid | own)]
    found = [token for token in found if token.kind not in unsaid | (own & _LOOSE)]
    optional = [token for token in found if (token.kind, token.value) == ("stop", 1.0) and not token.habit]
    kept: list[Token] = []
    habits = [token for token in found if token.habit]
    for stop in asked_for:  # of stops that posts write on their own each may be one that is asked for
        if (stop.kind, stop.value) != ("stop", 1.0):
            continue
        near = next((k for k, one in enumerate(optional) if not _away(stop.place, one, room, apart)), None)
        if near is not None:
            del optional[near]  # each is one of those that are asked for
        else:
            kept += [one for one in habits if one not in kept and not _away(stop.place, one, room, apart)][:1]
    found = [token for token in found if not token.habit or token in kept]

    def tidies(token: Token, kind: str) -> bool:
        """Whether a token only ends what ends with the program anyway."""
        if token.kind != kind or token.value != _ENDED[kind]:
            return False
        return token.place >= end or not _away(end, token, room, apart)

    def ended(tokens: list[Token], kind: str) -> int:
        """How often a state is ended."""
        return sum(token.value == _ENDED[kind] for token in _effective(tokens, kind))

    changes = [token.line for token in found if token.kind == "tool"]
    for kind in _ENDED:
        mine = found
        if kind in _STOPPED:  # what a tool change stops says nothing of the end
            mine, theirs = (_effective(tokens, kind) for tokens in (found, asked_for))
            mine = _without_habits(mine, theirs, changes, room, apart)
        if ended(mine, kind) > ended(asked_for, kind) and not any(
            tidies(token, kind) for token in _effective(asked_for, kind)
        ):
            found = [token for token in found if not tidies(token, kind)]
    asked_for, found = _without_idle_offsets(asked_for, found)
    for kind, (name, code) in _NAMES.items():
        theirs, ours = _effective(asked_for, kind), _effective(found, kind)
        if kind in _STOPPED and _values(theirs) != _values(ours):
            ours = _effective(_without_habits(ours, theirs, changes, room, apart), kind)
        if kind in _STOPPED and _values(theirs) != _values(ours):
            theirs, ours = (_effective(_last_of_moments(tokens, kind), kind) for tokens in (asked_for, found))
        matcher = difflib.SequenceMatcher(None, _values(theirs), _values(ours), autojunk=False)
        for tag, i0, i1, j0, j1 in matcher.get_opcodes():
            both = min(i1 - i0, j1 - j0)
            for i, j in zip(range(i0, i0 + both), range(j0, j0 + both), strict=True):
                label = name.format(theirs[i].value)
                if tag != "equal":
                    text = f"{name.format(ours[j].value)} where the CL file asks for {label}"
                elif _away(theirs[i].place, ours[j], room, apart):
                    text = f"{label} is {ours[j].place - theirs[i].place:+.3f} mm of path away from its place"
                else:
                    continue
                problems.append(Problem(f"CS{code}", theirs[i].line, ours[j].line, text))
            for i in range(i0 + both, i1):
                near = ours[min(j1, len(ours) - 1)].line if ours else _last_line(found, theirs[i].place + room)
                problems.append(
                    Problem(f"CS{code}", theirs[i].line, near, f"{name.format(theirs[i].value)} is missing")
                )
            for j in range(j0 + both, j1):
                text = f"{name.format(ours[j].value)} is nothing that the CL file asks for"
                problems.append(Problem(f"CS{code}", 0, ours[j].line, text))
    return problems


def _values(tokens: list[Token]) -> list[float]:
    return [token.value for token in tokens]


def _last_line(tokens: list[Token], place: float) -> int:
    """Line of the last token as far as a place; 0 where there is none."""
    return next((token.line for token in reversed(tokens) if token.place <= place), 0)


def _without_habits(
    ours: list[Token], theirs: list[Token], changes: list[int], room: float, apart: Callable[[float, float], float]
) -> list[Token]:
    """Tokens without those that end a state which begins again before any motion, if the CL file does not ask for them.

    Posts stop spindle and coolant for a tool change on their own, also where the program waits behind it; `changes` are
    the lines of those.
    """
    unasked = [k for k, token in enumerate(ours) if token.value == _ENDED[token.kind]]
    begins_again = {k for k in unasked if k + 1 < len(ours) and _goes_on(ours[k], ours[k + 1], changes)}
    for other in theirs:
        near = [k for k in unasked if other.value == ours[k].value and not _away(other.place, ours[k], room, apart)]
        if near:
            unasked.remove(
                min(near, key=lambda k: (ours[k].reach > room, k in begins_again, abs(ours[k].place - other.place)))
            )
    return [token for k, token in enumerate(ours) if k not in begins_again or k not in unasked]


def _goes_on(off: Token, on: Token, changes: list[int]) -> bool:
    """Whether a state that is ended begins again before anything moves, dwells or stops, a tool change apart."""
    if on.moment == off.moment:
        return True
    at = bisect_left(changes, off.line)
    return on.element == off.element and at < len(changes) and changes[at] < on.line


def _without_idle_offsets(asked_for: list[Token], found: list[Token]) -> tuple[list[Token], list[Token]]:
    """Both without the offsets of tools with which nothing moves: those may be said or not."""
    theirs, ours = _effective(asked_for, "tool"), _effective(found, "tool")
    if _values(theirs) != _values(ours):
        return asked_for, found
    idle = {k for k, tool in enumerate(ours) if tool.idle}
    if not idle:
        return asked_for, found
    return _outside(asked_for, theirs, idle), _outside(found, ours, idle)


def _outside(tokens: list[Token], tools: list[Token], idle: set[int]) -> list[Token]:
    """Tokens without the offsets behind some of the tools."""
    kept: list[Token] = []
    at = -1
    for token in tokens:
        at += at + 1 < len(tools) and token is tools[at + 1]
        if token.kind != "offset" or at not in idle:
            kept.append(token)
    return kept


def _away(place: float, ours: Token, room: float, apart: Callable[[float, float], float]) -> bool:
    """Whether a token is elsewhere than asked for."""
    nearest = min(max(place, ours.place), ours.place + ours.reach)
    if any(abs(place - here) <= room + ours.room for here in (nearest, *ours.others)):
        return False
    # a pose is a rounding off, and its place as far from it as the room
    return apart(place, nearest) > 2 * room + ours.room


def _last_of_moments(tokens: list[Token], kind: str) -> list[Token]:
    """Tokens of one kind that the next motion, stop or dwell meets."""
    mine = [token for token in tokens if token.kind == kind]
    return [token for k, token in enumerate(mine) if k + 1 == len(mine) or mine[k + 1].moment != token.moment]


def _effective(tokens: list[Token], kind: str) -> list[Token]:
    """Tokens of one kind without those that change nothing."""
    mine = [token for token in tokens if token.kind == kind]
    if kind not in _STATES:
        return mine
    kept: list[Token] = []
    state = _AT_START.get(kind)
    for token in mine:
        if token.value != state:
            kept.append(token)
            state = token.value
    return kept
