"""Compares what the CL file asks for with what a program says, act by act.

Two rules. *States* must be those of the CL file wherever the tool moves, and where the program waits. *Actions* must be
the same between two motions: one is left over without harm where it is optional.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Final

from cornersmooth.control.state import is_off
from cornersmooth.control.table import Means
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.statements.tokens import ENDINGS, Token

#: codes and names of kinds: of states, and of actions
_STATES: Final = {
    "tool": ("CS551", "tool T{:g}"),
    "offset": ("CS559", "offset H{:g}"),
    "spindle": ("CS552", "spindle {}"),
    "speed": ("CS552", "speed S{:g}"),
    "coolant": ("CS553", "coolant {}"),
    "compensation": ("CS554", "cutter compensation {}"),
    "register": ("CS554", "compensation register D{:g}"),
}
_ACTIONS: Final = {
    "next tool": ("CS551", "next tool T{:g}"),
    "stop": ("CS555", "stop {}"),
    "dwell": ("CS556", "dwell of {:g} ms"),
    "tap": ("CS566", "tap G{:g}"),
    "end": ("CS557", "end of program{}"),
    "auxiliary": ("CS558", "M{:g}"),
    "home": ("CS532", "GOHOME{}"),
}
_NAMES: Final = _STATES | _ACTIONS

#: all kinds that a user may say in words of his own
KINDS: Final = frozenset(_NAMES) - {"home"}

#: kinds of which there may be others where the user says them in his own words, too
_LOOSE: Final = frozenset(("tool", "next tool", "stop", "end"))

#: states that a tool change stops, and on most machines a stop of the program
_STOPPED: Final = ("spindle", "coolant")

#: states that end with the program
_ENDED: Final = (*_STOPPED, "compensation")

#: what holds before anything is written
_AT_START: Final[dict[str, float | str]] = {**dict.fromkeys(_ENDED, "OFF"), "offset": 1.0}

#: kinds for which a control may have no words
_WORDED: Final = (*_ENDED, "offset", "register")

#: states that are compared where the program waits, and on the way home
_AT_PAUSES: Final = ("tool", "spindle", "speed", "coolant", "compensation")

#: what may be written in a hole
_IN_HOLES: Final = ("dwell", "tap")

#: what holds: the token that says it, by its kind
_Held = dict[str, Token]

#: kind and value of what is on, and the tool
Key = tuple[str, float | str | None, float | str | None]

#: an action, and what holds where it is done
_Done = tuple[Token, dict[str, float | str | None]]


@dataclass
class _Side:
    """One of both files: its tokens in order, and what holds up to where it has been read."""

    tokens: list[Token]
    #: whether a tool change stops spindle and coolant here; of the CL file it is not known what holds then at a pause
    stops: bool
    held: _Held = field(default_factory=lambda: {k: Token(k, value, -1, 0) for k, value in _AT_START.items()})
    unsure: set[str] = field(default_factory=set)
    changes: int = 0  #: how many tool changes have been read
    read: int = 0
    line: int = 0  #: of the last word that has been read
    #: spindle and coolant that are on with a tool since the last motion, and the words that do it
    running: dict[Key, Token] = field(default_factory=dict)
    halted: dict[str, Token] = field(default_factory=dict)  #: states that were on at a stop, and it

    def value(self, kind: str) -> float | str | None:
        """What holds of a state; None for nothing."""
        if kind == "register" and self.value("compensation") == "OFF":
            return None
        return self.held[kind].value if kind in self.held else None

    def up_to(self, place: int) -> list[_Done]:
        """Read on: actions up to a place, with what holds at each."""
        done = []
        while self.read < len(self.tokens) and self.tokens[self.read].place <= place:
            token = self.tokens[self.read]
            self.read, self.line = self.read + 1, token.line or self.line
            if token.kind in _ACTIONS:
                holds = {kind: self.value(kind) for kind in _AT_PAUSES if kind not in self.unsure}
                done.append((token, holds | ({"tool": self.changes} if token.kind == "home" else {})))
                if token.kind == "stop":
                    self.halted |= {kind: token for kind in _STOPPED if self.value(kind) not in ENDINGS}
                continue
            changes, self.held[token.kind] = token.value != self.value(token.kind), token
            self.changes += changes and token.kind == "tool"
            self.unsure.discard(token.kind)
            self.halted.pop(token.kind, None)
            if token.kind == "tool" and self.stops:
                self.halted.clear()
                self.held |= {kind: Token(kind, "OFF", token.place, 0) for kind in _STOPPED}
            elif token.kind == "tool":
                self.unsure.update(_STOPPED)
            for kind in _STOPPED:
                on = self.value(kind) not in ENDINGS and (changes or not self.stops)
                if on and token.kind in (kind, "tool"):
                    self.running[self.key(kind)] = self.held[kind]
        return done

    def key(self, kind: str) -> Key:
        """What holds of a state, and with which tool."""
        return kind, self.value(kind), self.value("tool")


class Comparison:
    """Goes through both files, from one motion that both have to the next.

    Parameters
    ----------
    asked_for, found : list of Token
        Of the CL file and of the program, each in order.
    means : mapping
        What words of the control say, as of `Table.means`: for what none says nothing is missing.
    own : set of str
        Kinds that the user says in words of his own, which are no tokens; of most there must be no others.
    """

    def __init__(self, asked_for: Iterable[Token], found: Sequence[Token], means: Means, own: Set[str]) -> None:
        counts = _counting(found, means)
        self._own = own
        self.cl = _Side([one for one in asked_for if counts(one) and one.kind not in own], stops=False)
        self.nc = _Side([one for one in found if counts(one) and one.kind not in own & _LOOSE], stops=True)
        self.problems: list[Problem] = []
        self.unlooked: list[tuple[int, str]] = []  #: NC lines, and what is not known there
        self._moved = False
        self._agreed: _Held = {}  # words that were as wanted when they were met last
        self._named: set[tuple[Token | None, Token | None]] = set()

    def meet(self, move: int, element: int, *, moves: bool = True) -> None:
        """Both are right before a motion, a move and an element; or at the end, where nothing `moves`."""
        requested, done = self.cl.up_to(move), self.nc.up_to(element)
        for kind in _ACTIONS:
            self._same(*([one for one in some if one[0].kind == kind] for some in (requested, done)))
        self._moved = True
        for key, token in self.nc.running.items():  # what is on for no motion is on in the CL file, too
            if key not in self.cl.running and not (moves and key == self.nc.key(token.kind)):
                self._say(None, token)
        self.nc.running.clear()
        self.cl.running.clear()
        for kind in _STATES:
            if kind == "speed" and not {self.cl.value("spindle"), self.nc.value("spindle")}.isdisjoint(ENDINGS):
                continue
            wanted, value = self.cl.value(kind), self.nc.value(kind)
            if kind == "offset" and self.cl.held[kind].line and not self.nc.held[kind].line:
                value = None  # the length of tool 1 needs its word, too
            if wanted == value and kind in self.nc.held:
                self._agreed[kind] = self.nc.held[kind]
            elif wanted != value and (moves or (kind in _ENDED and wanted == "OFF")):
                self._other(kind)
            if moves and wanted == value and (stop := self.nc.halted.pop(kind, None)):
                on, pause = (_NAMES[one][1].format(what) for one, what in ((kind, value), (stop.kind, stop.value)))
                self.unlooked.append((stop.line, f"{on} after the {pause}, at which most machines stop it"))

    def in_hole(self, line: int, tokens: Iterable[Token], dwell: float, *, tap: bool) -> None:
        """Within a hole, which CL `line` asks for, the program says its dwell and its tap, and changes nothing else."""
        cl_values = [Token("dwell", dwell, 0, line)] * (dwell > 0.0) + [Token("tap", 84.0, 0, line)] * tap
        nc_values = list(tokens)
        for kind in _IN_HOLES:
            both = (cl_values, nc_values)
            requested, done = (list[_Done]((one, {}) for one in some if one.kind == kind) for some in both)
            self._same(requested, done)
        for one in nc_values:
            if one.kind == "tap" and self.nc.value("spindle") == "CCLW":
                text = "a tap of the control turns clockwise, and the spindle turns counterclockwise"
                self.problems.append(Problem("CS566", line, one.line, text))
            if one.kind not in _IN_HOLES and (one.kind in _ACTIONS or one.value != self.nc.value(one.kind)):
                code, name = _NAMES[one.kind]
                self.problems.append(Problem(code, line, one.line, f"{name.format(one.value)} is said within a hole"))

    def _same(self, requested: list[_Done], done: list[_Done]) -> None:
        """Actions of one kind must be the same in their order, and at pauses the states."""
        missing, surplus, rest = list[Token](), list[Token](), done
        for wanted, cl_values in requested:
            others = {
                k: _others(wanted.kind, cl_values, values)
                for k, (one, values) in enumerate(rest)
                if one.value == wanted.value
            }
            if not others:
                missing.append(wanted)
                continue
            # a stop of the post before a tool change may be beside one of the CL file; the first way home counts
            best = min(others, key=lambda k: (wanted.kind != "home" and len(others[k]) > 0, rest[k][0].optional, k))
            surplus += [one for one, _ in rest[:best]]
            token, rest = rest[best][0], rest[best + 1 :]
            at_home = wanted.kind == "home" and not self._moved  # before the first motion the tool is at home
            for state, here, value in () if at_home else others[best]:
                (code, name), pause = _NAMES[state], _NAMES[token.kind][1].format(token.value)
                text = f"{name.format(here)} holds at {pause}, where the CL file has {name.format(value)}"
                self.problems.append(Problem(code, wanted.line, token.line, text))
        surplus = sorted([*surplus, *(one for one, _ in rest)], key=lambda one: one.optional)
        needed = [one for one in surplus if not one.optional]
        needed = surplus[: max(len(missing), len(needed))]  # what may be left over may be the wrong one
        for pair in zip_longest(missing, needed):
            self._say(*pair)

    def _other(self, kind: str) -> None:
        """A state is another where the tool moves."""
        wanted, token = self.cl.held.get(kind), self.nc.held.get(kind)
        if (wanted, token) in self._named:
            return
        self._named.add((wanted, token))
        stated = token if token is not None and token.line and token != self._agreed.get(kind) else None
        self._say(wanted if stated is None or (wanted is not None and wanted.line) else None, stated)

    def _say(self, wanted: Token | None, token: Token | None) -> None:
        """What is wrong with a token, or with none, that stands for one."""
        one = wanted or token
        assert one is not None
        code, name = _NAMES[one.kind]
        if one.kind == "home":
            text = "GOHOME of the CL file is missing: the tool does not go up to a retract"
        elif wanted is None:
            text = f"{name.format(one.value)} is nothing that the CL file asks for"
        elif token is None:
            text = f"{name.format(one.value)} is missing"
        else:
            text = f"{name.format(token.value)} where the CL file asks for {name.format(wanted.value)}"
        # what is missing has no line: named is that of the last word before it
        nc_line = token.line if token else 0 if one.kind == "home" else self.nc.line
        self.problems.append(Problem(code, wanted.line if wanted else 0, nc_line, text))


def _others(
    kind: str, cl_values: dict[str, float | str | None], nc_values: dict[str, float | str | None]
) -> list[tuple[str, float | str, float | str]]:
    """States of the program that are not those of the CL file at a pause of a kind, and what they should be.

    Where it stops, spindle and coolant may be off although the CL file leaves them on: they go on before any motion. On
    the way home the coolant may be off. A retract for another tool may be the way home of what follows the change.
    """
    if kind == "home" and cl_values["tool"] != nc_values["tool"]:
        return []
    found = []
    for state, value in cl_values.items():
        here = nc_values.get(state)
        off = kind == "stop" and state in _STOPPED and here == "OFF"
        off |= kind == "home" and state == "coolant" and here == "OFF"
        off |= state == "speed" and "OFF" in (cl_values.get("spindle", "OFF"), nc_values.get("spindle", "OFF"))
        if value is not None and here is not None and here != value and not off and kind in ("stop", "dwell", "home"):
            found.append((state, here, value))
    return found


def _counting(found: Sequence[Token], means: Means) -> Callable[[Token], bool]:
    """Whether a token is compared: the control has a word for it."""
    # what shifts the path counts wherever it is written
    shifted = {token.kind for token in found if token.kind == "compensation" and token.value != "OFF"}
    flowing = {("coolant", token.value) for token in found if token.kind == "coolant"}  # two beside each other, too
    ended = {(kind, "OFF") for kind, value in means.values() if is_off(value)}
    sayable = {*shifted, *flowing, *ended, *means.values()}

    def counts(token: Token) -> bool:
        names = token.kind, (token.kind, ""), (token.kind, token.value)
        return token.kind not in _WORDED or not sayable.isdisjoint(names)

    return counts


def without_word(asked_for: Iterable[Token], found: Sequence[Token], means: Means, own: Set[str]) -> str:
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


def changed_unseen(asked_for: Iterable[Token], leading: Mapping[int, int], beyond: Mapping[int, int]) -> str:
    """Say which states hold only where holes are left out, so that no motion of the program meets them.

    By places: the first move behind each that leads anywhere, and the first of these that is not left out.
    """
    lost, last = [], dict[str, Token]()
    for token in asked_for:
        before, lead = last.get(token.kind), leading.get(token.place, token.place)
        changes = before is not None and before.value != token.value and before.place in beyond
        if before is not None and changes and leading[before.place] < lead <= beyond[before.place]:
            lost.append(f"{_NAMES[token.kind][1].format(before.value)} of CL line {before.line}")
        if token.kind in _STATES:
            last[token.kind] = token
    return f"what holds only over holes that are left out: {', '.join(lost)}" if lost else ""
