"""States of the control as the words of a program set them, and what must hold where the tool moves, changes or stops.

A word sets a state to a value; its rule (`rules`) says when it must have been said, until when it may hold, and at
which places of the program it may be: after a retract, on the way down, under tool tip control.

Posts have many ways to begin, to change tools and to end, and most of them are right. What has changed in a program
whose head says how it was made, `parts` finds; around its retracts it must be right also without digests
(`WordStates._around_retracts`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.rotary import tool_vectors
from cornersmooth.nc_words.blocks import NOT_LISTED, Ruled
from cornersmooth.nc_words.machine_positions import MachinePositions
from cornersmooth.nc_words.rules import WordList, WordRule, any_of, shown

#: a retract with the same tool, which only GOHOME of the CL file asks for
GONE_ON: Final = "a retract that another motion of the same tool follows"

#: code of states that the program never establishes
NOT_ESTABLISHED: Final = "CS572"

#: name of the blocks around the motion, among what is left to the user
FRAME: Final = "program frame"

#: states that are spoken of by name; planes are those to which the control turns the rotary axes
_OFFSET: Final = "work offset"
_LENGTH: Final = "tool length"
_PLANES: Final = frozenset(("tilted plane", "swivelled plane"))
_DYNAMIC: Final = "dynamic work offset"

#: comments that say how a program was made, and the words in them
_MADE: Final = re.compile(r"CORNERSMOOTH \S+: \w+=", re.IGNORECASE)
_MADE_WORDS: Final = re.compile(r"\b(\w+)=([\w.]*)")

#: words of axes
LINEAR: Final = frozenset("XYZ")
ROTARY: Final = frozenset("ABC")
_VECTOR: Final = frozenset("IJK")
_POINT: Final = frozenset(("U", "V", "W", "XH", "YH", "ZH"))

#: angles of a plane, and the cosine of the angle from Z beyond which a tool is tilted
_DECIMAL: Final = re.compile(r"(?<![G\d])\d+\.\d*")
_UPRIGHT: Final = 1.0 - 1e-6


@dataclass(frozen=True)
class _Held:
    """What has been said last of a state."""

    text: str  # the word, with those beside it that say more of it
    rule: WordRule
    line: int

    @property
    def off(self) -> bool:
        """Whether it switches the state off."""
        return self.rule.off and self.rule.pattern.fullmatch(self.text) is not None


class WordStates:
    """Follows the states of one program.

    States, blocks and kinds of words that are `left` are the user's own; `FRAME`: the blocks around the motion are.
    """

    def __init__(self, listed: WordList, positions: MachinePositions, left: Set[str]) -> None:
        self._list, self._positions, self._left = listed, positions, left
        self.problems: list[Problem] = []
        #: what is taken on trust, line and text, and what of it may bear on the motion
        self.trusted: list[tuple[int, str]] = []
        self.unsure: list[tuple[int, str]] = []
        self._retracts = any(rule.high for rule in listed.words)
        self._late = {rule.state for rule in listed.words if rule.late}
        self._approach = {rule.state for rule in listed.words if rule.off} | {_OFFSET, "cutting edge"}
        self._made: dict[str, str] = {}  # what the head of a program of our own says
        self._said: set[str] = set()  # words so far; those that must come again before each of their kind, since then
        self._held: dict[str, _Held] = {}
        self._first: dict[str, str] | None = None  # states at the first motion; "" for those that may come later
        self._others: dict[
            _Held, tuple[str, str]
        ] = {}  # what holds and did not at the first motion, and what is wrong with it
        self._cycles = False  # whether the program has any, so that some states may differ from tool to tool
        #: where the rotary axes have been sent, as far as that is said
        self.angles: dict[str, float] = {}
        self._retract = 0  # line of a retract that no approach has followed
        self._high = False  # the tool has not moved since a retract
        self.above = False  # Z has not
        self._moved = 0  # line of the last motion
        self._changed = True  # words have been said since
        #: states that words have ended since, with these: they must be said again before the next motion
        self._ended: dict[str, str] = {}

    # complaints

    def wrong(self, code: str, line: int, *texts: str) -> None:
        """Complain of words or states."""
        self.problems += [Problem(code, 0, line, text) for text in texts]

    def unframed(self, code: str, line: int, *texts: str) -> None:
        """Complain of the blocks around the motion; where they are the user's own, they are taken on trust."""
        if FRAME in self._left:
            self.trusted += [(line, text) for text in texts]
            self.unsure += [(line, text) for text in texts]
        else:
            self.wrong(code, line, *texts)

    def _around_retracts(self, line: int, *texts: str) -> None:
        """Complain of what a program of ours never does around a retract; other posts may."""
        self.unframed(NOT_LISTED, line, *(texts if self._made else ()))

    # what holds

    @property
    def _tip_control(self) -> list[str]:
        """Word of tool tip control that holds, if any."""
        return [held.text for held in self._held.values() if held.rule.ends]

    @property
    def work_offset(self) -> str:
        """The work offset that holds, as it is written; empty for none."""
        return self._held[_OFFSET].text if _OFFSET in self._held else ""

    @property
    def made(self) -> Mapping[str, str]:
        """What the head of a program of our own says."""
        return self._made

    def holds(self, state: str, text: str) -> bool:
        """Whether a state has been set so."""
        return state in self._held and self._held[state].text == text

    @property
    def unsure_offset(self) -> str:
        """Work offset that nothing was compared with; empty for none."""
        held = self._held.get(_OFFSET)
        known = self._made and self._made.get("OFFSET") != "NONE" and _OFFSET not in self._left
        return "" if held is None or known else held.text

    @property
    def attentive(self) -> bool:
        """Whether the next motion must be looked at."""
        return self._changed or self.above

    # words

    def comment(self, text: str) -> None:
        """Take note of how the program was made, if a comment says so."""
        if self._first is None and _MADE.match(text):
            self._made = dict(_MADE_WORDS.findall(text.upper())) | self._made

    def take(self, line: int, words: Sequence[str], ruled: Ruled) -> None:
        """Take over what a block says, and complain of what is not in its place."""
        self._changed = True
        self._said |= set(words)
        self._cycles |= any(rule.cycle for _, rule in ruled)
        for word, rule in ruled:
            self._place(line, word, rule)
        for word, rule in ruled:
            self._set(line, word, rule, ruled)
        self._check_plane(line, ruled)

    def _check_plane(self, line: int, ruled: Ruled) -> None:
        """Complain of words that are taken in another plane than theirs, and of that while the tool is compensated."""
        plane, side = self._held.get("plane"), self._held.get("cutter compensation")
        held = [] if side is None else [(side.text, side.rule)]
        for word, rule in dict.fromkeys([*ruled, *held]) if plane is not None else ():
            if rule.plane and plane is not None and plane.text != f"G{rule.plane}":
                self.wrong(NOT_LISTED, line, f"{word} under {plane.text}, where G{rule.plane} must be in force")

    def _place(self, line: int, word: str, rule: WordRule) -> None:
        """Complain of a word that is not in its place, as things are before its block."""
        if rule.after is not None:
            before = {said for said in self._said if rule.after.fullmatch(said)}
            if not before:
                self.wrong(NOT_LISTED, line, f"{word} without {shown(rule.after)} before it")
            self._said -= before
        if rule.zero and (not self.angles or self._positions.away(self.angles)):
            self.unframed(NOT_LISTED, line, f"{word} without the rotary axes at zero before it")
        if rule.high and not self._high:
            self.unframed(NOT_LISTED, line, f"{word} without a retract before it")
        if rule.turns:
            self.angles = {}
        if rule.retract:
            # of FANUC the length of the tool holds in the retract, with its tip control
            own = [held.text for held in self._held.values() if held.rule.ends and held.rule.state != _LENGTH]
            self._around_retracts(line, *(f"{word} under {tip}" for tip in own if "Z" in word))
            self._retract, self._high, self.above = line, True, True
        if rule.changes_tool or rule.outside:
            self._retract = 0
            tell = self.unframed if rule.changes_tool else self.wrong
            for tip in self._tip_control:
                tell(NOT_LISTED, line, f"{word} under {tip}")
        spindle = self._held.get("spindle")
        if rule.changes_tool and spindle is not None and spindle.rule.runs and spindle.line > self._moved:
            self.wrong(NOT_LISTED, line, f"{word} stops the spindle that was started before it")

    def _set(self, line: int, word: str, rule: WordRule, ruled: Ruled) -> None:
        """Take over the state that a word sets."""
        if rule.drops in self._held:
            self._ended[rule.drops] = word
        if rule.state:
            beside = [(other, its) for other, its in ruled if its.needs and its.needs.fullmatch(word)]
            more = [other for other, its in beside if not (its.compared or its.follows)]
            self._held[rule.state] = _Held(" ".join([word, *more]), rule, line)
            self._ended.pop(rule.state, None)
            if rule.off and rule.state == _LENGTH and self._first is not None and self._retracts and not self.above:
                self._around_retracts(line, f"{word} before the retract: it may move the tool by its length")
            if not rule.off and rule.state in self._approach:  # GOHOME: the same tool comes back as a new one does
                self._retract = 0

    def _unsaid(self) -> Iterator[tuple[str, str]]:
        """States, and words of which one must have come before the first motion."""
        rules = [rule for rule in self._list.words if rule.first]
        for state in dict.fromkeys(rule.state for rule in rules):
            wanted = [rule.pattern for rule in rules if rule.state == state]
            if not any(any_of(pattern, self._said) for pattern in wanted):
                usual = next((rule.preset for rule in rules if rule.state == state and rule.preset), "")
                yield state, f"one such as {usual}" if usual else " or ".join(map(shown, wanted))

    # where axes turn, and where the tool moves

    def turn(self, line: int, words: Mapping[str, float]) -> None:
        """Take over rotary words; they may not turn the axes alone where a retract has left the tool."""
        self.angles |= {name: words[name] for name in ROTARY & words.keys()}
        if self.above and ROTARY & words.keys() and not LINEAR & words.keys():
            self._around_retracts(line, *(f"the rotary axes turn under {word}" for word in self._tip_control))

    def motion(self, line: int, words: Mapping[str, float], code: float, *, drills: bool) -> None:
        """Look at what holds where the tool moves by the words of a block, and by the G word of group 01 in force.

        `drills`: in a cycle of the control, so it does not go there at once.
        """
        if self._high and not drills:
            self._around_retracts(line, *self._comes_down(words))
        for state, word in self._ended.items():
            if state not in self._left:
                self.unframed(NOT_ESTABLISHED, line, f"{state}: it must come after {word}, which deselects it")
        self.above &= "Z" not in words
        late = set()
        if self.above and code == 0.0 and "Z" not in words:
            late = {state for state in self._late & self._held.keys() if self._held[state].off}
        first = self._begin(line, late) if self._first is None else self._first
        self._compare(late, first, arc=code in (2.0, 3.0))
        if self._retract and not late:
            self.wrong(NOT_LISTED, self._retract, GONE_ON)
            self._retract = 0
        self._moved, self._ended = line, {}
        self._changed = self._high = False

    def _begin(self, line: int, late: Set[str]) -> dict[str, str]:
        """Look at what holds at the first motion, and return it."""
        self._retract = 0
        self.unframed(NOT_LISTED, line, *self._wrong_offset())
        if self._retracts and not self._high:
            self._around_retracts(line, "the first motion without a retract before it")
        self._first = {state: "" if state in late else held.text for state, held in self._held.items()}
        for state, wanted in self._unsaid():
            if state not in self._left:
                self.unframed(NOT_ESTABLISHED, line, f"{state}: {wanted} must come before the first motion")
        return self._first

    def _compare(self, late: Set[str], first: dict[str, str], *, arc: bool) -> None:
        """Complain of states that are not what they were at the first motion, where nobody else compares them."""
        for state, held in self._held.items():
            if state not in late and first.get(state) == "":
                first[state] = held.text
            if state in late or held.text == first.get(state):
                continue
            if held.rule.before and held.line > self._moved and not arc:
                self.wrong(NOT_LISTED, held.line, f"{held.text} where no arc follows")
            if not held.rule.follows:
                self._others.setdefault(held, (state, first.get(state, "nothing")))

    def _comes_down(self, words: Mapping[str, float]) -> Iterator[str]:
        """What is wrong with the first motion after a retract, by the words of a block."""
        tilted = None if words.keys() & _POINT else self._tilted(words)
        if tilted and not words.keys() >= LINEAR:
            yield "a tilted tool does not come from a retract in one block of X Y Z"
        if tilted is False and "Z" in words and words.keys() & (set("XY") | ROTARY):
            yield "the tool comes down from a retract before it is over its place"

    def _tilted(self, words: Mapping[str, float]) -> bool | None:
        """Whether X and Y lie in another plane in the part than on the machine; None where that is not known."""
        on = {held.rule.state: held.text for held in self._held.values() if not held.off}
        plane = [text for state, text in on.items() if state in _PLANES]
        if plane:
            return any(map(float, _DECIMAL.findall(plane[0])))
        if not (self._positions.keeps_tip or self._tip_control or _DYNAMIC in on):
            return False
        if words.keys() >= _VECTOR:
            axis = np.array([words[name] for name in "IJK"])
            return bool(axis[2] < _UPRIGHT * np.linalg.norm(axis))
        machine = self._positions.machine
        if machine is None or not set(machine.names) <= self.angles.keys():
            return None
        given = [self.angles.get(axis.name, 0.0) for axis in machine.axes]
        return bool(tool_vectors(machine, np.array([given]))[0, 2] < _UPRIGHT)

    def _wrong_offset(self) -> Iterator[str]:
        """What is wrong with the work offset, one for the whole program."""
        held = next((held for held in self._held.values() if held.rule.state == _OFFSET), None)
        wanted = self._made.get("OFFSET") or next((rule.preset for rule in self._list.words if rule.preset), "NONE")
        if held is None or not self._made or _OFFSET in self._left or wanted == "NONE":
            return
        if re.split(r"=\+?", held.text)[-1].replace(" ", "_") != wanted:
            yield f"{held.text}, where the program was made for {wanted.replace('_', ' ')}"

    def end(self, line: int) -> None:
        """Look at what holds where the program ends; `line` is that of its end."""
        for held, (state, other) in self._others.items():
            if not (held.rule.tool and self._cycles):
                text = f"{state}: {held.text} where {other} holds for the whole program"
                self.wrong(NOT_LISTED, held.line, text)
        for state, held in self._held.items():
            if not held.off and any(rule.off for rule in self._list.words if rule.state == state):
                text = f"{state}: {held.text} of line {held.line} still holds at the end"
                self.unframed(NOT_ESTABLISHED, line, text)
        if not self._high and self._retracts:
            self.unframed(NOT_ESTABLISHED, line, "the tool is not retracted at the end")
