"""Compares what the CL file asks for with what a text says: the same tokens, in order, between the right poses."""

from __future__ import annotations

import difflib
import math
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import takewhile

from cornersmooth.nc_reader.elements import Problem
from cornersmooth.statements.tokens import Token

#: codes and names of kinds
_NAMES = {
    "tool": ("CS551", "tool T{:g}"),
    "next tool": ("CS551", "next tool T{:g}"),
    "offset": ("CS559", "offset H{:g}"),
    "spindle": ("CS552", "spindle M{:g}"),
    "speed": ("CS552", "speed S{:g}"),
    "coolant": ("CS553", "coolant M{:g}"),
    "compensation": ("CS554", "cutter compensation G{:g}"),
    "register": ("CS554", "compensation register D{:g}"),
    "stop": ("CS555", "stop M{:g}"),
    "dwell": ("CS556", "dwell of {:g} ms"),
    "tap": ("CS566", "tap G{:g}"),
    "end": ("CS557", "end of program M{:g}"),
    "auxiliary": ("CS558", "M{:g}"),
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


#: longer lists that differ are compared one by one
_LONGEST_SEARCH = 2000


def way_between(here: float, there: float) -> float:
    """How far two places are apart along the path, mm."""
    return abs(there - here)


@dataclass(frozen=True)
class _Nearness:
    """What is near along the path; `room` and `apart` are those of `compare`."""

    room: float
    apart: Callable[[float, float], float]

    def away(self, place: float, ours: Token) -> bool:
        """Whether a token of the text is elsewhere than asked for."""
        nearest = min(max(place, ours.place), ours.place + ours.reach)
        if any(abs(place - here) <= self.room + ours.room for here in (nearest, *ours.others)):
            return False
        # a pose is a rounding off, and its place as far from it as the room
        return self.apart(place, nearest) > 2 * self.room + ours.room

    def beyond(self, place: float, there: float, spare: float) -> bool:
        """Whether any token at least as far along as one place is away from the other: `apart` grows on its way.

        `spare` is what no token is uncertain by more, its reach included.
        """
        return abs(place - there) > self.room + spare and self.apart(place, there) > 2 * self.room + spare


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
    room : float, mm
        How far apart along the path the places of the same token may be.
    unsaid : frozenset
        Kinds, and pairs of kind and value, that the control has no words for.
    apart : callable
        How far, in mm, two places along the path are apart that differ by more than the room.
    own : frozenset of str
        Kinds that the user says in words of his own, which are no tokens; of most there must be no others.
    """
    end = max((token.place for token in asked_for if token.kind == "end"), default=math.inf)
    # what shifts the path counts wherever it is said
    unsaid = unsaid - {token.kind for token in found if token.kind == "compensation" and token.value != 40.0}
    asked_for = [token for token in asked_for if not {token.kind, (token.kind, token.value)} & (unsaid | own)]
    found = [token for token in found if token.kind not in unsaid | (own & _LOOSE)]
    near = _Nearness(room, apart)
    found = _without_idle_stops(asked_for, found, near)
    found = _without_tidying(asked_for, found, end, near)
    asked_for, found = _without_idle_offsets(asked_for, found)
    problems: list[Problem] = []
    for kind in _NAMES:
        theirs, ours = _effective(asked_for, kind), _effective(found, kind)
        if kind in _STOPPED and _values(theirs) != _values(ours):
            ours = _without_habits(ours, theirs, _tool_lines(found), near)
        if kind in _STOPPED and _values(theirs) != _values(ours):
            theirs, ours = (_effective(_last_of_moments(tokens, kind), kind) for tokens in (asked_for, found))
        problems += _differences(theirs, ours, found, near)
    return problems


def _differences(theirs: list[Token], ours: list[Token], found: list[Token], near: _Nearness) -> list[Problem]:
    """What of one kind is wrong, in another place, missing or too much; `found` are all tokens of the text."""
    problems = []

    def add(cl_line: int, nc_line: int, kind: str, text: str) -> None:
        problems.append(Problem(_NAMES[kind][0], cl_line, nc_line, text))

    head = _alike(theirs, ours, near)
    tail = _alike(theirs[head:][::-1], ours[head:][::-1], near)
    between = (_values(tokens[head : len(tokens) - tail]) for tokens in (theirs, ours))
    for tag, *where in _opcodes(*between):
        i0, i1, j0, j1 = (head + k for k in where)
        for wanted, token in zip(theirs[i0:i1], ours[j0:j1], strict=False):
            if tag != "equal":
                text = f"{_label(token)} where the CL file asks for {_label(wanted)}"
                add(wanted.line, token.line, wanted.kind, text)
            elif near.away(wanted.place, token):
                text = f"{_label(wanted)} is {token.place - wanted.place:+.3f} mm of path away from its place"
                add(wanted.line, token.line, wanted.kind, text)
        both = min(i1 - i0, j1 - j0)
        for wanted in theirs[i0 + both : i1]:
            line = ours[min(j1, len(ours) - 1)].line if ours else _last_line(found, wanted.place + near.room)
            add(wanted.line, line, wanted.kind, f"{_label(wanted)} is missing")
        for token in ours[j0 + both : j1]:
            add(0, token.line, token.kind, f"{_label(token)} is nothing that the CL file asks for")
    return problems


def _alike(theirs: list[Token], ours: list[Token], near: _Nearness) -> int:
    """How many tokens of both are the same, and where they should be, from the first on."""
    pairs = enumerate(zip(theirs, ours, strict=False))
    unlike = (k for k, (one, other) in pairs if one.value != other.value or near.away(one.place, other))
    return next(unlike, min(len(theirs), len(ours)))


def _opcodes(theirs: list[float], ours: list[float]) -> Iterator[tuple[str, int, int, int, int]]:
    """How values differ from others, as `difflib` says it; one by one where that would take long."""
    if max(len(theirs), len(ours)) <= _LONGEST_SEARCH:
        yield from difflib.SequenceMatcher(None, theirs, ours, autojunk=False).get_opcodes()
        return
    both = min(len(theirs), len(ours))
    for k in range(both):
        yield "equal" if theirs[k] == ours[k] else "replace", k, k + 1, k, k + 1
    yield "replace", both, len(theirs), both, len(ours)


def _label(token: Token) -> str:
    return _NAMES[token.kind][1].format(token.value)


def _without_idle_stops(asked_for: list[Token], found: list[Token], near: _Nearness) -> list[Token]:
    """Tokens of the text without the optional stops that posts write on their own, but for those that are asked for."""
    habits = [token for token in found if token.habit]
    others = [token for token in found if (token.kind, token.value) == ("stop", 1.0) and not token.habit]
    kept: list[Token] = []
    for stop in asked_for:
        if (stop.kind, stop.value) != ("stop", 1.0):
            continue
        other = next((k for k, one in enumerate(others) if not near.away(stop.place, one)), None)
        if other is not None:
            del others[other]  # each is one of those that are asked for
        else:
            kept += [one for one in habits if one not in kept and not near.away(stop.place, one)][:1]
    return [token for token in found if not token.habit or token in kept]


def _without_tidying(asked_for: list[Token], found: list[Token], end: float, near: _Nearness) -> list[Token]:
    """Tokens of the text without those that only end what ends with the program anyway, unless that is asked for."""
    lines = _tool_lines(found)

    def tidying(tokens: list[Token], kind: str) -> list[Token]:
        """Tokens that end a state for good, where everything ends."""
        mine = [token for token in tokens if token.kind == kind]
        last = list(takewhile(lambda token: token.value == _ENDED[kind], reversed(mine)))
        return [token for token in last if token.place >= end or not near.away(end, token)]

    for kind, off in _ENDED.items():
        theirs, ours = _effective(asked_for, kind), _effective(found, kind)
        if kind in _STOPPED:  # what a tool change stops says nothing of the end
            ours = _without_habits(ours, theirs, lines, near)
        more = sum(token.value == off for token in ours) > sum(token.value == off for token in theirs)
        more |= _values(ours)[-1:] == [off] and _values(theirs)[-1:] not in ([], [off])
        if more and not tidying(theirs, kind):
            last = tidying(found, kind)
            found = [token for token in found if not any(token is one for one in last)]
    return found


def _tool_lines(found: list[Token]) -> list[int]:
    return [token.line for token in found if token.kind == "tool"]


def _values(tokens: list[Token]) -> list[float]:
    return [token.value for token in tokens]


def _last_line(tokens: list[Token], place: float) -> int:
    """Line of the last token as far as a place; 0 where there is none."""
    return next((token.line for token in reversed(tokens) if token.place <= place), 0)


def _without_habits(ours: list[Token], theirs: list[Token], changes: list[int], near: _Nearness) -> list[Token]:
    """Tokens without those that end a state which begins again before any motion, if the CL file does not ask for them.

    Posts stop spindle and coolant for a tool change on their own, also where the program waits behind it; `changes` are
    the lines of those. What the CL file asks for is rather one whose place is certain, or, if that does not make both
    the same, one behind which the state does not begin again.
    """
    if not ours:
        return []
    ways = [
        _effective(_without_unasked(ours, theirs, changes, near, certain_first), ours[0].kind)
        for certain_first in (True, False)
    ]
    return next((kept for kept in ways if _values(kept) == _values(theirs)), ways[0])


def _without_unasked(
    ours: list[Token], theirs: list[Token], changes: list[int], near: _Nearness, certain_first: bool
) -> list[Token]:
    """Tokens without the habits, where those asked for are looked for in one of two orders."""
    unasked = {k for k, token in enumerate(ours) if token.value == _ENDED[token.kind]}
    begins_again = {k for k in unasked if k + 1 < len(ours) and _goes_on(ours[k], ours[k + 1], changes)}
    around = _Around.of(ours, sorted(unasked), near)
    for other in theirs:
        alike = [k for k in around.tokens(other.place) if k in unasked and other.value == ours[k].value]
        alike = sorted(k for k in alike if not near.away(other.place, ours[k]))
        ranks = []
        for k in alike:
            doubts = (ours[k].reach > near.room, k in begins_again)
            ranks.append((doubts if certain_first else doubts[::-1], abs(ours[k].place - other.place)))
        if alike:
            unasked.remove(alike[ranks.index(min(ranks))])
    return [token for k, token in enumerate(ours) if k not in begins_again or k not in unasked]


@dataclass(frozen=True)
class _Around:
    """Tokens by their places: those that may be near a place are found without looking at all."""

    tokens_anywhere: list[int]  #: those with other places, or of which it is not known how far along they are
    ordered: list[int]  #: all others, by place
    places: list[float]  #: mm: of these, ascending
    spare: float  #: mm: what none of these is uncertain by more
    near: _Nearness

    @classmethod
    def of(cls, ours: list[Token], chosen: list[int], near: _Nearness) -> _Around:
        anywhere = [k for k in chosen if ours[k].others or ours[k].reach > near.room]
        ordered = sorted(set(chosen).difference(anywhere), key=lambda k: ours[k].place)
        spare = max((ours[k].room + ours[k].reach for k in ordered), default=0.0)
        return cls(anywhere, ordered, [ours[k].place for k in ordered], spare, near)

    def tokens(self, place: float) -> Iterator[int]:
        """Tokens that may be near a place, and a few more."""
        yield from self.tokens_anywhere
        at = bisect_left(self.places, place)
        for way in (range(at, len(self.places)), range(at - 1, -1, -1)):
            for k in way:
                if self.near.beyond(place, self.places[k], self.spare):
                    break
                yield self.ordered[k]


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
