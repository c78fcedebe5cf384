"""What a text of our own promises around the motion, beyond what every text must say.

Posts have many ways to begin, to change tools and to end, and most of them are right. A text that says in its head how
it was made goes the way of the control's table: what is missing there has been lost since.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Set
from typing import Final

import numpy as np

from cornersmooth.nc_reader.block_texts import shown, text_of
from cornersmooth.nc_reader.machine_positions import SAME, MachinePositions
from cornersmooth.nc_reader.rotary import tool_vectors
from cornersmooth.nc_reader.word_list import WordList, WordRule

#: state of the words that choose the zero of the part
WORK_OFFSET: Final = "work offset"

#: comments that say how a text was made, and the work offset and the machine in them
_MADE: Final = re.compile(r"CORNERSMOOTH \S+: \w+=", re.IGNORECASE)
_OFFSET: Final = re.compile(r"\bOFFSET=([\w.]+)", re.IGNORECASE)
_MACHINE: Final = re.compile(r"\bMACHINE=", re.IGNORECASE)

#: axes along which the tool is sent over its place
_PLACE: Final = frozenset("XY")

#: words beside which Z may not come down from a retract, and the rotary axes among them
_ASIDE: Final = frozenset("XYABC")
_ROTARY: Final = frozenset("ABC")

#: words of the linear axes, without which a block turns the rotary axes alone
_LINEAR: Final = frozenset("XYZ")

#: words of a second point on the axis, with which nothing can be said of a place high up
_POINT: Final = frozenset(("U", "V", "W", "XH", "YH", "ZH"))

#: state of the words that take the length of the tool into account
_LENGTH: Final = "tool length"

#: states of planes to which the control turns the rotary axes
_PLANES: Final = ("tilted plane", "swivelled plane")

#: state of the part as the rotary axes have turned it
_DYNAMIC: Final = "dynamic work offset"

#: angles of a plane, words of a tool vector, and the cosine of the angle from Z beyond which a tool is tilted
_DECIMAL: Final = re.compile(r"(?<![G\d])\d+\.\d*")
_VECTOR: Final = frozenset("IJK")
_UPRIGHT: Final = 1.0 - 1e-6

#: blocks that stop the program, and states that they end on most machines
_STOPS: Final = frozenset(("M0", "M1", "STOP"))
_ENDED: Final = frozenset(("spindle", "coolant", "coolant through the spindle"))


class OwnFrame:
    """Follows the blocks around the motion of one text.

    Nothing is asked for until a comment says how the text was made; what goes with a retract only where there is one.

    Parameters
    ----------
    trusted : set of str
        States, kinds of words and blocks that are the user's own.
    positions : MachinePositions
        Those of the machine's file, which may say where the program ends, and its rotary axes.
    """

    def __init__(self, listed: WordList, trusted: Set[str], positions: MachinePositions) -> None:
        self._list, self._trusted = listed, trusted
        self._positions = positions
        self._at_home, self._rotary = bool(positions.rules), positions.rotary
        self._ours = False
        self._offset = ""  # that the head names
        self._machine = False  # the head names one: its rotary axes have words
        self._halted: dict[str, str] = {}  # states that a stop has ended, and the stop
        self._swivelled = False  # the control has turned them since the last of these words
        self._retracts = any(rule.high and not shadowed(listed, rule) for rule in listed.words)
        self._state: dict[str, tuple[str, WordRule]] = {}
        self._said: set[int] = set()  # rules of words so far, by identity
        self._used: set[str] = set()  # states that something has been switched on in
        self._angles: dict[str, float] = {}
        self._turned: dict[str, float] | None = None  # angles at which tip control came on, until the tool moves
        self._zeroed: dict[str, float] | None = None  # the same where they must be zero
        self._lost: list[str] | None = None  # what was missing before the first retract; the head is read behind it
        self._high = self._moved = False
        self._above = False  # Z has not moved since a retract
        self._over = False  # the tool has been sent over its place since, without tip control

    def comment(self, text: str) -> None:
        """Take note of how the text was made, if a comment says so."""
        if not self._moved and _MADE.match(text):
            self._ours = True
            self._machine |= _MACHINE.search(text) is not None
            offset = _OFFSET.search(text)
            self._offset = offset[1] if offset and not self._offset else self._offset

    @property
    def _tip_control(self) -> bool:
        return self._positions.keeps_tip or any(rule.ends for _, rule in self._state.values())

    @property
    def _asked(self) -> bool:
        return self._ours and self._retracts

    def block(self, words: list[str], rules: list[WordRule | None], *, changes_tool: bool) -> Iterator[str]:
        """Take over what a block says; give what should have been said before it."""
        if len(rules) != len(words):
            words, rules = [text_of(words)], rules[:1]
        for word, rule in zip(words, rules, strict=True):
            if rule is None:
                continue
            self._said.add(id(rule))
            if word in _STOPS:
                self._halted = dict.fromkeys((state for state, said in self._state.items() if said[1].tidy), word)
            self._halted.pop(rule.state, None)
            if rule.state:
                beside = [
                    other
                    for other, theirs in zip(words, rules, strict=True)
                    if theirs and theirs.needs and theirs.needs.fullmatch(word) and not theirs.compared
                ]
                self._state[rule.state] = (" ".join([word, *beside]), rule)
                if not (rule.first or rule.off) and rule.state not in self._used:
                    self._used.add(rule.state)
                    yield from self._unsaid("used", word, rule.state) if self._asked else ()
            self._swivelled |= rule.turns
            held = self._state.get(rule.bars)
            if held and self._ours and (held[1].tidy or held[1].ends):
                yield f"{word} under {held[0]}"
            if rule.turned and self._high:  # elsewhere the axes stand where the last motion left them
                self._turned = dict(self._angles)
            if rule.zero:
                self._zeroed = dict(self._angles)
            if rule.off and rule.state == _LENGTH and self._moved and not self._above and self._asked:
                yield f"{word} before the retract: it may move the tool by its length"
            if rule.ends and self._over and self._asked:
                yield f"{word} after the motion to where the tool comes down"
            self._state.pop(rule.drops, None)
            if rule.retract:
                if self._lost is None:
                    self._lost = list(self._unsaid("first", word))
                self._high, self._above, self._over = True, True, False
        if changes_tool and self._ours:
            yield from (f"{text_of(words)} under {word}" for word in self._running())

    def _unsaid(self, when: str, word: str, state: str = "") -> Iterator[str]:
        """Words that have not been said before the first retract (``"first"``), or before others of a state."""
        for rule in self._list.words:
            wanted = rule.first == when and state in ("", rule.state)
            if wanted and id(rule) not in self._said and not shadowed(self._list, rule):
                yield f"{shown(rule.pattern)} must come before {word}"

    def _running(self) -> list[str]:
        """Words in force that are switched off behind the last motion of a tool."""
        held = [said for state, said in self._state.items() if not {state, said[0]} & self._trusted]
        return [word for word, rule in held if rule.tidy]

    def angles(self, angles: Mapping[str, float]) -> None:
        """Take note of where the rotary axes are, as far as that is said."""
        self._angles = dict(angles)
        self._swivelled &= not angles

    def turns(self, words: Collection[str]) -> Iterator[str]:
        """Look at the words of a block that may turn the rotary axes alone, where a retract has left the tool."""
        if self._asked and self._above and _ROTARY & set(words) and not _LINEAR & set(words):
            yield from (f"the rotary axes turn under {word}" for word, rule in self._state.values() if rule.ends)

    def moved(self, words: Mapping[str, float], *, drills: bool = False) -> Iterator[str]:
        """Look at the words of a motion, the first behind a retract or behind words that are no motion.

        A cycle of the control `drills`: its words are no place to which the tool goes at once.
        """
        yield from self._ended()
        if drills:
            return
        high, self._high = self._high, False
        turned, self._turned = self._turned, None
        zeroed, self._zeroed = self._zeroed, None
        comes_down = self._above and "Z" in words
        self._above &= not comes_down
        self._over = self._above and (self._over or (bool(words.keys() & _PLACE) and not self._tip_control))
        first, self._moved = not self._moved, True
        if not self._asked:
            return
        if high and not words.keys() & _POINT:
            tilted = self._tilted(words)
            if tilted and not words.keys() >= _LINEAR:
                yield "a tilted tool does not come from a retract in one block of X Y Z"
            if tilted is False and "Z" in words and words.keys() & _ASIDE:
                yield "the tool comes down from a retract before it is over its place"
        rotary = sorted(_ROTARY & words.keys()) if turned is not None else []
        off = [name for name in rotary if not abs((turned or {}).get(name, math.nan) - words[name]) <= SAME]
        if off:
            yield f"tool tip control comes on before {' and '.join(off)} stands where the next motion has it"
        unknown = [] if zeroed is None else [name for name in sorted(_ROTARY & words.keys()) if name not in zeroed]
        if unknown:
            yield f"tool tip control comes on before {' and '.join(unknown)} stands at zero"
        if comes_down:
            yield from self._not_in_force()
            yield from self._nowhere(words.keys())
        if first:
            yield from self._lost or ()
            yield from self._wrong_offset()

    def _tilted(self, words: Mapping[str, float]) -> bool | None:
        """Whether X and Y lie in another plane in the part than on the machine; None where that is not known."""
        plane = [said for state, (said, rule) in self._state.items() if state in _PLANES and not rule.off]
        if plane:
            return any(map(float, _DECIMAL.findall(plane[0])))
        if not self._tip_control and (_DYNAMIC not in self._state or self._state[_DYNAMIC][1].off):
            return False
        if words.keys() >= _VECTOR:
            axis = np.array([words[name] for name in "IJK"])
            return bool(axis[2] < _UPRIGHT * np.linalg.norm(axis))
        machine, angles = self._positions.machine, {**self._angles, **words}
        if machine is None or not set(machine.names) <= angles.keys():
            return None
        given = [angles.get(axis.name, 0.0) for axis in machine.axes]
        return bool(tool_vectors(machine, np.array([given]))[0, 2] < _UPRIGHT)

    def _ended(self) -> Iterator[str]:
        """What a stop has ended, and nothing has said again."""
        for state, stop in self._halted.items():
            if self._ours and state in _ENDED and state not in self._trusted:
                yield f"{stop} ends {self._state[state][0]}, and the tool moves on without it"
        self._halted = {}

    def _nowhere(self, words: Set[str]) -> Iterator[str]:
        """Rotary axes that stand where something before has left them, but where the control has turned them."""
        unknown = sorted(self._rotary - self._angles.keys() - words) if self._machine else []
        in_plane = any(state in self._state and not self._state[state][1].off for state in _PLANES)
        if unknown and not (self._swivelled and in_plane):
            yield f"the tool comes down from a retract before {' and '.join(unknown)} is sent to where it belongs"

    def _not_in_force(self) -> Iterator[str]:
        """What the tool may not come down without."""
        in_force = [word for word, rule in self._state.values() if not rule.off]
        for rule in self._list.words:
            held = self._state.get(rule.state)
            if rule.down is None or (held and not held[1].off) or shadowed(self._list, rule):
                continue
            if any(rule.down.fullmatch(word) for word in in_force):
                yield f"the tool comes down from a retract without {shown(rule.pattern)}"

    def _wrong_offset(self) -> Iterator[str]:
        """What is wrong with the work offset, one for the whole text."""
        if WORK_OFFSET not in self._state or WORK_OFFSET in self._trusted or self._offset == "none":
            return
        word, rule = self._state[WORK_OFFSET]
        match = rule.pattern.fullmatch(word)
        said = match[1] if match and match.re.groups else word
        wanted = self._offset or rule.preset
        if wanted and said.replace(" ", "_") != wanted:
            yield f"{word}, where the program was made for {wanted.replace('_', ' ')}"

    def end(self) -> Iterator[str]:
        """Look at what holds where the program ends."""
        if self._ours and self._moved:
            yield from (f"{word} still holds at the end" for word in self._running())
        if not self._asked or not self._moved:
            return
        away = self._positions.away(self._angles)
        if (away or (self._swivelled and self._machine)) and not self._at_home:
            yield f"{' and '.join(away) or 'the rotary axes'} not at zero at the end"


def shadowed(listed: WordList, rule: WordRule) -> bool:
    """Whether another rule for the same words stands before one."""
    return any(listed.shadows(other, rule) for other in listed.words)
