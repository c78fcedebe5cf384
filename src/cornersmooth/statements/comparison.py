"""Compares what the CL file asks for with what a program says: the same tokens, in order, between the right poses.

Tokens of both are paired in their order, so that as few as possible are left over, are others or are elsewhere. Left
over without harm are those that change nothing, and those of the program that posts write on their own (`_habits`).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterator, Sequence, Set
from itertools import pairwise, takewhile, zip_longest

from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.word_tables import Means
from cornersmooth.statements.tokens import PAUSES, Token

#: codes and names of kinds
_NAMES = {
    "tool": ("CS551", "tool T{:g}"),
    "next tool": ("CS551", "next tool T{:g}"),
    "offset": ("CS559", "offset H{:g}"),
    "spindle": ("CS552", "spindle {}"),
    "speed": ("CS552", "speed S{:g}"),
    "coolant": ("CS553", "coolant {}"),
    "compensation": ("CS554", "cutter compensation {}"),
    "register": ("CS554", "compensation register D{:g}"),
    "stop": ("CS555", "stop {}"),
    "dwell": ("CS556", "dwell of {:g} ms"),
    "tap": ("CS566", "tap G{:g}"),
    "end": ("CS557", "end of program{}"),
    "auxiliary": ("CS558", "M{:g}"),
}

#: kinds of which there may be others where the user says them in his own words, too
_LOOSE = frozenset(("tool", "next tool", "stop", "end"))

#: all kinds
KINDS = frozenset(_NAMES)

#: states that a tool change and the end of the program may end by themselves
_ENDED = ("spindle", "coolant", "compensation")

#: what holds before anything is said; repeating it changes nothing
_AT_START: dict[str, float | str] = {**dict.fromkeys(_ENDED, "OFF"), "offset": 1.0}

#: kinds for which a control may have no words
_WORDED = (*_ENDED, "offset", "register")

#: values of what ends
_ENDINGS = ("OFF", "ORIENT")

#: states that a tool change stops, to go on behind it
_STOPPED = ("spindle", "coolant")

#: kind of what is no token of either file: a hole, at which states are compared
_HOLE = "hole"

#: kinds of which only changes count
_STATES = ("tool", "offset", "spindle", "speed", "coolant", "compensation")

#: more ways to pair tokens are not looked at: the rest is compared one by one
_MOST_WAYS = 100_000

#: how many tokens of both are paired, and what holds then
_Way = tuple[int, int, float | str | None]

#: tokens of the CL file and of the program that should be the same; None where one is missing
_Pair = tuple[Token | None, Token | None]


#: whether a token of the program is elsewhere than a place, mm of path, where the CL file asks for it
_Away = Callable[[float, Token], bool]


def compare(
    asked_for: list[Token],
    found: list[Token],
    room: float,
    means: Means,
    apart: Callable[[float, float], float],
    own: Set[str],
    holes: Sequence[tuple[int, int]] = (),
) -> list[Problem]:
    """Compare the two, kind by kind.

    Parameters
    ----------
    room : float, mm
        How far apart along the path the places of the same token may be.
    means : mapping
        What words of the control say, as of `means_of`: for what none says nothing is missing.
    apart : callable
        How far, in mm, two places along the path are apart that differ by more than the room.
    own : set of str
        Kinds that the user says in words of his own, which are no tokens; of most there must be no others.
    holes : sequence of (int, int)
        CL line of each hole, and the element of the program with which the tool leaves it.
    """

    def away(place: float, ours: Token) -> bool:
        nearest = min(max(place, ours.place), ours.place + ours.reach)
        if any(abs(place - here) <= room + ours.room for here in (nearest, *ours.others)):
            return False
        return apart(place, nearest) > 2 * room + ours.room  # a pose is a rounding off, and its place as far from it

    end = max((token.place for token in asked_for if token.kind == "end"), default=math.inf)
    counts = _counting(found, means)
    asked_for = [token for token in asked_for if counts(token) and token.kind not in own]
    found = [token for token in found if counts(token) and token.kind not in own & _LOOSE]
    changes = [token.line for token in found if token.kind == "tool"]
    problems: list[Problem] = []
    for kind, (code, name) in _NAMES.items():
        theirs, ours = ([token for token in tokens if token.kind == kind] for tokens in (asked_for, found))
        for wanted, token in _unlike(theirs, ours, _habits(ours, changes, end, away), away):
            if wanted is None:
                assert token is not None
                text = f"{name.format(token.value)} is nothing that the CL file asks for"
                problems.append(Problem(code, 0, token.line, text))
                continue
            label = name.format(wanted.value)
            if token is None:
                text = f"{label} is missing"
            elif wanted.value != token.value:
                text = f"{name.format(token.value)} where the CL file asks for {label}"
            else:
                text = f"{label} is {token.place - wanted.place:+.3f} mm of path away from its place"
            # what is missing has no line: named is that of the last word before it
            before = (other.line for other in reversed(found) if other.place <= wanted.place + room)
            problems.append(Problem(code, wanted.line, next(before, 0) if token is None else token.line, text))
    return [*problems, *_at_pauses(asked_for, found, away), *_in_holes(asked_for, found, holes)]


def _at_pauses(asked_for: list[Token], found: list[Token], away: _Away) -> Iterator[Problem]:
    """States that are others where the program waits than where the CL file does.

    Where it stops, spindle and coolant may be off although the CL file leaves them on: they go on before any motion.
    """
    pauses, done = list(_holding(found, dict.fromkeys(_STOPPED, "OFF"))), dict.fromkeys(PAUSES, 0)
    for wanted, theirs in _holding(asked_for, {}):
        kind = wanted.kind
        alike: list[tuple[int, Token, list[tuple[str, float | str, float | str]]]] = []
        for k in range(done[kind], len(pauses)):
            token, ours = pauses[k]
            if token.kind != kind or token.value != wanted.value:
                continue
            if not away(wanted.place, token):
                alike.append((k, token, _others(kind, theirs, ours)))
            elif alike:  # all that follow are farther on
                break
        if not alike:  # it is missing, which is said
            continue
        # a stop that posts write before a tool change may stand beside one of the CL file
        place, token, others = min(alike, key=lambda one: (len(one[2]) > 0, one[1].optional, one[0]))
        done[kind] = place + 1
        for state, here, value in others:
            code, name = _NAMES[state]
            pause = _NAMES[kind][1].format(token.value)
            text = f"{name.format(here)} holds at {pause}, where the CL file has {name.format(value)}"
            yield Problem(code, wanted.line, token.line, text)


def _in_holes(asked_for: list[Token], found: list[Token], holes: Sequence[tuple[int, int]]) -> Iterator[Problem]:
    """States that are others where the tool leaves a hole than the CL file has there: a hole has no path length."""
    cl_holes = [Token(_HOLE, k, 0.0, line) for k, (line, _) in enumerate(holes)]
    nc_holes = [Token(_HOLE, k, 0.0, 0, element=element) for k, (_, element) in enumerate(holes)]
    cl_states = _holding(sorted([*asked_for, *cl_holes], key=lambda token: token.line), {})
    nc_states = _holding(sorted([*found, *nc_holes], key=lambda token: token.element), dict.fromkeys(_STOPPED, "OFF"))
    of_nc = {token.value: held for token, held in nc_states if token.kind == _HOLE}
    for hole, held in cl_states:
        for state, here, value in _others(_HOLE, held, of_nc[hole.value]) if hole.kind == _HOLE else ():
            code, name = _NAMES[state]
            element = holes[int(hole.value)][1]
            lines = (token.line for token in reversed(found) if token.kind == state and token.element <= element)
            text = f"{name.format(here)} holds in a hole, where the CL file has {name.format(value)}"
            yield Problem(code, hole.line, next(lines, 0), text)


def _others(
    kind: str, theirs: dict[str, float | str], ours: dict[str, float | str]
) -> list[tuple[str, float | str, float | str]]:
    """States of the program that are not those of the CL file at a pause of a kind, and what they should be."""
    found = []
    for state, value in theirs.items():
        here = ours.get(state, value)
        off = kind == "stop" and state in _STOPPED and here == "OFF"
        off |= state == "speed" and "OFF" in (theirs.get("spindle", "OFF"), ours.get("spindle", "OFF"))
        if here != value and not off:
            found.append((state, here, value))
    return found


def _holding(tokens: list[Token], changed: dict[str, float | str]) -> Iterator[tuple[Token, dict[str, float | str]]]:
    """Pauses with the states that hold there; `changed`: those of spindle and coolant after a tool change, if known."""
    held: dict[str, float | str] = dict.fromkeys(_ENDED, "OFF")
    for token in tokens:
        if token.kind in (*PAUSES, _HOLE):
            yield token, held.copy()
        elif token.kind in (*_ENDED, "speed", "tool"):
            held[token.kind] = token.value
            if token.kind == "tool":
                held = {kind: value for kind, value in held.items() if kind not in _STOPPED} | changed


def _counting(found: list[Token], means: Means) -> Callable[[Token], bool]:
    """Whether a token is compared: the control has a word for it."""
    # what shifts the path counts wherever it is said
    shifted = {token.kind for token in found if token.kind == "compensation" and token.value != "OFF"}
    sayable = {*shifted, *means.values()}

    def counts(token: Token) -> bool:
        names = token.kind, (token.kind, ""), (token.kind, token.value)
        return token.kind not in _WORDED or not sayable.isdisjoint(names)

    return counts


def without_word(asked_for: list[Token], found: list[Token], means: Means, own: Set[str]) -> str:
    """Say what the CL file asks for and the control has no word for; empty for nothing.

    A tool has its own length without a word, and what is off needs none.
    """
    counts = _counting(found, means)
    lost, tool = [], -1.0
    for token in asked_for:
        tool = float(token.value) if token.kind == "tool" else tool
        if not counts(token) and token.kind not in own and token.value not in ("OFF", tool, _AT_START.get(token.kind)):
            lost.append(f"{_NAMES[token.kind][1].format(token.value)} in CL line {token.line}")
    return f"the control has no word for: {', '.join(dict.fromkeys(lost))}" if lost else ""


def _unlike(theirs: list[Token], ours: list[Token], habits: Set[int], away: _Away) -> Iterator[_Pair]:
    """Tokens of one kind that are wrong, in another place, missing or too much: as few as can be."""

    def alike(wanted: Token | None, token: Token | None) -> bool:
        return bool(wanted and token and wanted.value == token.value and not away(wanted.place, token))

    optional = _optional(theirs)
    kind = next((token.kind for token in (*theirs, *ours)), "")
    came: dict[_Way, tuple[_Way | None, _Pair | None]] = {}
    waiting: deque[tuple[_Way, _Way | None, _Pair | None]] = deque([((0, 0, _AT_START.get(kind)), None, None)])
    while waiting:
        way, before, wrong = waiting.popleft()
        if way in came:
            continue
        came[way] = before, wrong
        i, j, held = way
        wanted, token = (tokens[k] if k < len(tokens) else None for tokens, k in ((theirs, i), (ours, j)))
        if len(came) > _MOST_WAYS or (wanted is None and token is None):
            break
        if token is not None and (j in habits or token.value == held):
            waiting.appendleft(((i, j + 1, held), way, None))
        if wanted is not None:
            if i in optional or wanted.value == held:
                waiting.appendleft(((i + 1, j, held), way, None))
            after = wanted.value if kind in _STATES else None
            both = (i + 1, j + 1, after)
            if alike(wanted, token):
                waiting.appendleft((both, way, None))
            elif token is not None:
                waiting.append((both, way, (wanted, token)))
            waiting.append(((i + 1, j, after), way, (wanted, None)))
        if token is not None:
            waiting.append(((i, j + 1, held), way, (None, token)))
    found: list[_Pair] = []
    rest = [pair for pair in zip_longest(theirs[way[0] :], ours[way[1] :]) if not alike(*pair)]
    at: _Way | None = way
    while at is not None:
        at, wrong = came[at]
        found += [] if wrong is None else [wrong]
    yield from reversed(found)
    yield from rest


def _optional(tokens: list[Token]) -> set[int]:
    """Tokens that may be left over: also those that no motion, stop or dwell meets, of what a tool change stops."""
    stopped = [one.kind in _STOPPED and one.moment == after.moment for one, after in pairwise(tokens)]
    return {k for k, (token, idle) in enumerate(zip_longest(tokens, stopped)) if token.optional or idle}


def _habits(ours: list[Token], changes: list[int], end: float, away: _Away) -> set[int]:
    """Tokens of the program that posts write on their own.

    Those are what only ends what ends with the program anyway; and what ends a state which begins again before any
    motion, also where the program waits after a tool change: `changes` are the lines of those.
    """
    off = [token.kind in _ENDED and token.value == "OFF" for token in ours]
    found = {k for k in _optional(ours) if ours[k].optional or ours[k].value in _ENDINGS}
    last = len(ours) - len(list(takewhile(bool, reversed(off))))
    found |= {k for k in range(last, len(ours)) if ours[k].place >= end or not away(end, ours[k])}
    on: Token | None = None
    for k in range(len(ours) - 1, -1, -1):
        if ours[k].optional:
            continue
        if not off[k]:
            on = ours[k]
        elif on is not None and on.kind in _STOPPED:
            at = bisect_left(changes, ours[k].line)
            changed = ours[k].element == on.element and at < len(changes) and changes[at] < on.line
            if changed or on.moment == ours[k].moment:
                found.add(k)
    return found
