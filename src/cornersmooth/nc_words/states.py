"""What must hold of the groups of a control where the tool moves, is changed or is retracted.

The machine (`control.state`) remembers the last word of each group; the row of a word (`control.table`) has when it
must have come, until when it may hold, and at which places of the program it may be: after a retract, on
the way down, under tool tip control.

Posts have many ways to begin, to change tools and to end, and most of them are right. What has changed in a program
whose head has how it was made, `parts` finds; around its retracts it must be right also without digests
(`StateRules._around_retracts`). Where tools are changed and the program ends, the machine's file may have positions.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from cornersmooth.control.state import LastWord, State
from cornersmooth.control.table import Row, Table, any_of, shown, title_of
from cornersmooth.errors import command_text
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.rotary import tool_vectors
from cornersmooth.nc_words.blocks import NOT_LISTED, Block
from cornersmooth.statements.tokens import ENDINGS

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: a retract with the same tool, which only GOHOME of the CL file wants
GONE_ON: Final = "a retract that another motion of the same tool follows"

#: code of states that the program never establishes
NOT_ESTABLISHED: Final = "CS572"

#: name of the blocks around the motion, among what is left to the user
FRAME: Final = "program frame"

#: printed digits by which angles may differ, degrees, and by which a position may be off
_SAME: Final = 1e-5
_ROOM: Final = 5e-4

#: groups of planes to which the control turns the rotary axes
_PLANES: Final = ("frame.rotation", "frame.plane", "frame.swivel")

#: comments on how a program was made, and the words in them
_MADE: Final = re.compile(r"CORNERSMOOTH (\S+): \w+=", re.IGNORECASE)
_MADE_WORDS: Final = re.compile(r"\b(\w+)=([\w.]*)")

#: words of axes
LINEAR: Final = frozenset("XYZ")
ROTARY: Final = frozenset("ABC")
_VECTOR: Final = frozenset("IJK")
_POINT: Final = frozenset(("U", "V", "W", "XH", "YH", "ZH"))

#: angles of a plane, and the cosine of the angle from Z beyond which a tool is tilted
_DECIMAL: Final = re.compile(r"(?<![G\d])\d+\.\d*")
_UPRIGHT: Final = 1.0 - 1e-6


class MachinePositions:
    """Follows the machine's axes through blocks that name positions of the machine.

    Parameters
    ----------
    machine : Machine or None
        Without positions, or without a machine, none are required.
    mm_per_unit : float
        Of the text.
    switches : bool
        `Dialect.switches`.
    tcp : bool
        Whether words are those of the tip.
    """

    def __init__(
        self, machine: Machine | None, mm_per_unit: float, *, switches: bool = False, tcp: bool = True
    ) -> None:
        positions = {} if machine is None else {"home": machine.home, "change": machine.tool_change}
        units = dict.fromkeys("XYZ", mm_per_unit)
        self._known = {
            name: {axis: value / units.get(axis, 1.0) for axis, value in known} for name, known in positions.items()
        }
        self._at: dict[str, float] = {}
        self._axes = () if machine is None else machine.axes
        #: with its rotary axes
        self.machine = machine if self._axes else None
        self._switch = (machine.tip_control or ()) if machine is not None and self._axes and switches else ()
        #: whether words are those of the tip without any that switches that on
        self.keeps_tip = bool(switches and tcp and not self._switch)

    def __bool__(self) -> bool:
        return any(self._known.values())

    def table(self, table: Table) -> Table:
        """Table of the control with the words that switch tip control of these kinematics, and with positions."""
        table = table.switched(self._switch)
        return replace(table, blocks=(*table.blocks, *table.positions)) if self else table

    def away(self, angles: Mapping[str, float]) -> list[str]:
        """Names of axes that are not at zero, or at a full turn of an axis that turns without end."""
        endless = {axis.name for axis in self._axes if axis.limits is None}
        turns = {name: math.remainder(angle, 360.0) if name in endless else angle for name, angle in angles.items()}
        return sorted(name for name, angle in turns.items() if abs(angle) > _SAME)

    def leave(self, names: Set[str]) -> None:
        """Take note of axes that move otherwise: words of the tip may move all of them."""
        gone = names & set("ABC") | (set(self._at) if names & set("XYZ") else set())
        self._at = {axis: value for axis, value in self._at.items() if axis not in gone}

    def missed(self, name: str) -> str:
        """Axes with the values of a position, "home" or "change", at which they are not."""
        wanted = self._known.get(name, {}).items()
        return " ".join(f"{axis}{value:g}" for axis, value in wanted if not self._is_at(axis, value))

    def _is_at(self, axis: str, value: float) -> bool:
        return abs(self._at.get(axis, math.nan) - value) <= _ROOM

    def go(self, given: Mapping[str, float], *, free_z: bool) -> Iterator[tuple[str, str]]:
        """Take note of a block of positions; yield those that the file does not have, and those that it has.

        `free_z`: the control's own table has the block as a retract, which holds where the file has no Z of home.
        """
        for axis in given.keys() & set("XYZABC"):
            self._at[axis] = given[axis]
            known = [position[axis] for position in self._known.values() if axis in position]
            free = free_z and axis == "Z" and "Z" not in self._known["home"]
            if known and not free and not any(self._is_at(axis, value) for value in known):
                yield f"{axis} goes to {given[axis]:g}", " or ".join(f"{axis}{value:g}" for value in known)


class StateRules:
    """Follows one program on a machine.

    Groups that are `left`, by their titles, are the user's own; `FRAME`: the blocks around the motion are.
    """

    def __init__(self, machine: State, positions: MachinePositions, left: Set[str]) -> None:
        self.machine = machine  #: between two blocks
        self._listed, self._positions, self._left = machine.table.listed, positions, left
        self.problems: list[Problem] = []
        #: what is taken on trust, line and text, and what of it may bear on the motion
        self.trusted: list[tuple[int, str]] = []
        self.unsure: list[tuple[int, str]] = []
        self.made: dict[str, str] = {}  #: words in the head of a program of our own
        self._retracts = any(row.high for row in self._listed)
        self._approach = {row.group for row in self._listed if row.off} | {"offset", "edge"}
        self._words: set[str] = set()  # so far; those that must come again before each of their kind, since then
        self._first: dict[str, str] | None = None  # groups at the first motion; empty for what may come later
        # what holds and did not at the first motion, and what is wrong with it
        self._others: dict[LastWord, tuple[str, str]] = {}
        self._cycles = False  # whether the program has any, so that some groups may differ from tool to tool
        self._retract = 0  # line of a retract that no approach has followed
        self._high = False  # the tool has not moved since a retract
        self.above = False  #: Z has not
        self._moved = 0  # line of the last motion
        self.attentive = True  #: whether the next motion must be looked at: there have been words since the last
        #: groups that words have ended since, with these: they must come again before the next motion
        self._ended: dict[str, str] = {}

    # complaints

    def wrong(self, code: str, line: int, *texts: str) -> None:
        """Complain of words or states."""
        self.problems += [Problem(code, 0, line, text) for text in texts]

    def unframed(self, code: str, line: int, *texts: str) -> None:
        """Complain of the blocks around the motion; where they are the user's own, they are taken on trust."""
        if FRAME in self._left:
            blocks = [(line, text.partition("; ")[0]) for text in texts]
            self.trusted += blocks
            self.unsure += blocks
        else:
            self.wrong(code, line, *texts)

    def _around_retracts(self, line: int, *texts: str, others: list[tuple[int, str]] | None = None) -> None:
        """Complain of what no program with our head does around a retract; of another post it is put to `others`."""
        if self.made:
            self.unframed(NOT_LISTED, line, *texts)
        elif others is not None:
            others += [(line, text) for text in texts]

    # what holds

    @property
    def _followed(self) -> dict[str, LastWord]:
        """The last word of each group that verification follows."""
        return {group: last for group, last in self.machine.last_words.items() if last.row.group == group}

    def is_left(self, group: str) -> bool:
        """Whether a group is the user's own."""
        return title_of(group) in self._left

    # words

    def comment(self, text: str) -> None:
        """Take note of how the program was made, if a comment has that."""
        if self._first is None and (match := _MADE.match(text)):
            self.made = {"VERSION": match[1]} | dict(_MADE_WORDS.findall(text.upper())) | self.made

    def take(self, block: Block, after: State) -> None:
        """Go on to the state after a block, and complain of what in it is not in its place."""
        self.attentive = True
        self._words |= set(block.words)
        self._cycles |= any(row.cycle for _, row in block.ruled)
        for word, row in block.ruled:
            self._place(block.line, word, row)
        self.machine = after
        for word, row in block.ruled:
            self._set(block.line, word, row)
        plane, side = after.last_words.get("plane"), after.last_words.get("compensation")
        kept = [] if side is None else [(side.text, side.row)]
        for word, row in dict.fromkeys([*block.ruled, *kept]) if plane is not None else ():
            if row.plane and plane is not None and plane.text != f"G{row.plane}":
                self.wrong(NOT_LISTED, block.line, f"{word} under {plane.text}, where G{row.plane} must be in force")

    def _place(self, line: int, word: str, row: Row) -> None:
        """Complain of a word that is not in its place, as things are before its block."""
        tips = [(group, last.text) for group, last in self._followed.items() if last.row.tip_on]
        if row.after is not None:
            before = {last for last in self._words if row.after.fullmatch(last)}
            self._words -= before
            if not before:
                self.wrong(NOT_LISTED, line, f"{word} without {shown(row.after)} before it")
        if row.zero and (not self.machine.angles or self._positions.away(self.machine.angles)):
            text = (
                f"{word} without the rotary axes at zero before it; turn them to zero: where a parameter says so "
                "(FANUC: WKP = 0), the part program turns with the angles at which they are then"
            )
            self.unframed(NOT_LISTED, line, text)
        if row.high and not self._high:
            self.unframed(NOT_LISTED, line, f"{word} without a retract before it")
        if row.retract:
            # of FANUC the length of the tool holds in the retract, with its tip control
            under = (f"{word} under {tip}" for group, tip in tips if group != "tool_length" and "Z" in word)
            self._around_retracts(line, *under, others=self.unsure)
            self._retract, self._high, self.above = line, True, True
        if row.changes_tool or row.outside:
            self._retract = 0
            wrong = self.unframed if row.changes_tool else self.wrong
            for _, tip in tips:
                wrong(NOT_LISTED, line, f"{word} under {tip}")
        spindle = self.machine.last_words.get("spindle")
        started = spindle is not None and dict(spindle.row.sets)["spindle"] not in ENDINGS
        if row.changes_tool and started and spindle is not None and spindle.line > self._moved:
            self.wrong(NOT_LISTED, line, f"{word} stops the spindle that was started before it")

    def _set(self, line: int, word: str, row: Row) -> None:
        """Take note of what a word begins and ends."""
        if row.drops in self.machine.last_words or row.drops == "edge":  # D0 is a word, and holds on until the next
            self._ended[row.drops] = word
        self._ended.pop(row.group, None)
        off = row.off and row.pattern.fullmatch(word) is not None
        if off and row.group == "tool_length" and self._first is not None and self._retracts and not self.above:
            text = f"{word} before the retract: it may move the tool by its length"
            self._around_retracts(line, text, others=self.unsure)
        if not row.off and row.group in self._approach:  # GOHOME: the same tool comes back as a new one does
            self._retract = 0

    # where axes turn, and where the tool moves

    def turn(self, line: int, words: Mapping[str, float]) -> None:
        """Look at rotary words: they may not turn the axes alone where a retract has left the tool."""
        if self.above and ROTARY & words.keys() and not LINEAR & words.keys():
            tips = (last.text for last in self._followed.values() if last.row.tip_on)
            self._around_retracts(line, *(f"the rotary axes turn under {tip}" for tip in tips), others=self.trusted)

    def motion(self, line: int, words: Mapping[str, float], *, drills: bool) -> None:
        """Look at what holds where the tool moves by the words of a block.

        `drills`: in a cycle of the control, so it does not go there at once.
        """
        if self._high and not drills:
            self._around_retracts(line, *self._comes_down(words), others=self.trusted)
        for group, word in self._ended.items():
            if not self.is_left(group):
                text = f"{title_of(group)}: it must come after {word}, which deselects it"
                self.unframed(NOT_ESTABLISHED, line, text)
        self.above &= "Z" not in words
        # the length of a tool may come as late as in the block that first moves Z
        holds, length = self._followed, self.machine.last_words.get("tool_length")
        late = self.above and self.machine.groups["motion"] == "rapid" and length is not None and length.off
        if self._first is None:
            self._begin(line)
            self._first = {group: "" if late and last is length else last.text for group, last in holds.items()}
        for group, last in holds.items():
            if not (late and last is length):
                self._compare(group, last, self._first)
        if self._retract and not late:
            self.wrong(NOT_LISTED, self._retract, GONE_ON)
            self._retract = 0
        self._moved, self._ended = line, {}
        self.attentive = self._high = False

    def _begin(self, line: int) -> None:
        """Look at what holds at the first motion."""
        self._retract = 0
        self.unframed(NOT_LISTED, line, *self._wrong_offset())
        if self._retracts and not self._high:
            self._around_retracts(line, "the first motion without a retract before it")
        for group in dict.fromkeys(row.group for row in self._listed if row.first):
            rows = [row for row in self._listed if row.first and row.group == group]
            if not self.is_left(group) and not any(any_of(row.pattern, self._words) for row in rows):
                usual = next((f"one such as {row.preset}" for row in rows if row.preset), "")
                wanted = usual or " or ".join(shown(row.pattern) for row in rows)
                text = f"{title_of(group)}: {wanted} must come before the first motion"
                self.unframed(NOT_ESTABLISHED, line, text)

    def _compare(self, group: str, last: LastWord, first: dict[str, str]) -> None:
        """Complain of a state that is not what it was at the first motion, where nobody else compares it."""
        first[group] = first.get(group, "nothing") or last.text
        if last.text == first[group]:
            return
        if group == "plane" and last.line > self._moved and self.machine.groups["motion"] != "arc":
            self.wrong(NOT_LISTED, last.line, f"{last.text} where no arc follows")
        if not last.row.follows:
            self._others.setdefault(last, (group, first[group]))

    def _comes_down(self, words: Mapping[str, float]) -> Iterator[str]:
        """What is wrong with the first motion after a retract, by the words of a block."""
        tilted = None if words.keys() & _POINT else self._tilted(words)
        if tilted and not words.keys() >= LINEAR:
            yield "a tilted tool does not come from a retract in one block of X Y Z"
        if tilted is False and "Z" in words and words.keys() & (set("XY") | ROTARY):
            yield "the tool comes down from a retract before it is over its place"

    def _tilted(self, words: Mapping[str, float]) -> bool | None:
        """Whether X and Y lie in another plane in the part than on the machine; None where that is not known."""
        on = {group: last for group, last in self._followed.items() if not last.off}
        for plane in _PLANES:
            if plane in on:
                return any(map(float, _DECIMAL.findall(on[plane].text)))
        if not (self._positions.keeps_tip or "frame.dynamic" in on or any(last.row.tip_on for last in on.values())):
            return False
        if words.keys() >= _VECTOR:
            axis = np.array([words[name] for name in "IJK"])
            return bool(axis[2] < _UPRIGHT * np.linalg.norm(axis))
        machine = self._positions.machine
        if machine is None or not set(machine.names) <= self.machine.angles.keys():
            return None
        given = [self.machine.angles.get(axis.name, 0.0) for axis in machine.axes]
        return bool(tool_vectors(machine, np.array([given]))[0, 2] < _UPRIGHT)

    def _wrong_offset(self) -> Iterator[str]:
        """What is wrong with the work offset, one for the whole program."""
        kept = self.machine.last_words.get("offset")
        wanted = self.made.get("OFFSET") or next((row.preset for row in self._listed if row.preset), "NONE")
        if kept is None or not self.made or self.is_left("offset") or wanted == "NONE":
            return
        offset = re.split(r"=\+?", kept.text)[-1]
        if offset.replace(" ", "_") != wanted:
            command = command_text(["cornersmooth", "smooth", "--work-offset", offset])
            yield (
                f"{kept.text}, where the program was made for {wanted.replace('_', ' ')}; to run it there, write it "
                f"with: {command}"
            )

    def end(self, line: int) -> None:
        """Look at what holds where the program ends; `line` is that of its end."""
        for last, (group, other) in self._others.items():
            if not (last.row.tool and self._cycles):
                text = f"{title_of(group)}: {last.text} where {other} holds for the whole program"
                self.wrong(NOT_LISTED, last.line, text)
        for group, last in self._followed.items():
            if not last.off and any(row.off for row in self._listed if row.group == group):
                text = f"{title_of(group)}: {last.text} of line {last.line} still holds at the end"
                self.unframed(NOT_ESTABLISHED, line, text)
        if not self._high and self._retracts:
            self.unframed(NOT_ESTABLISHED, line, "the tool is not retracted at the end")
