"""What is surely known of a control between two blocks of a program, and what a block changes, or a run of them.

A block is executed in one order, whatever its words: groups that they set, then what they do, then its feed and where
it goes. None and NaN stand for what is not known. Motion blocks on neighbouring lines are executed by arrays.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Final

import numpy as np

from cornersmooth.control.table import FRAME, PRESET, Group, Means, Row, Table, group_of
from cornersmooth.control.words import Line, Word, filled
from cornersmooth.model import Bools, Floats

#: mm
_UNITS: Final = {"mm": 1.0, "inch": 25.4}

#: axes of the length of a tool by the plane that holds
_ALONG: Final = {PRESET: "Z", "G17": "Z", "G18": "YZ", "G19": "XZ"}

#: values of the group of motion by G words; all others are not known
_MOTIONS: Final = {0.0: "rapid", 1.0: "line", 2.0: "arc", 3.0: "arc"}

#: what stands for motions in a column; NaN stands for all others
_CODES: Final = {"rapid": 0.0, "line": 1.0, "arc": 2.0}

#: motions that cut
CUTS: Final = ("line", "arc")

#: letters of a tool vector, and of all axes that a machine may have
VECTOR: Final = frozenset("IJK")
_AXES: Final = "XYZABC"
_ROTARY: Final = frozenset("ABC")
_OF_MOTION: Final = frozenset((*_AXES, "F"))


@dataclass(frozen=True)
class LastWord:
    """The word that has set a group last, whatever became of it since."""

    row: Row
    text: str  #: the word, with those beside it that say more of it
    line: int  #: from 1; 0 where nobody counts

    @property
    def odd(self) -> bool:
        """Whether it is another word of its kind than verification accepts, as the second transformation."""
        return self.row.listed and self.row.pattern.fullmatch(self.text) is None

    @property
    def off(self) -> bool:
        """Whether it switches the group off."""
        return self.row.off and self.row.pattern.fullmatch(self.text) is not None


@dataclass
class State:
    """What holds between two blocks."""

    table: Table
    axes: tuple[str, ...]  #: letters of X Y Z and of the words of the tool axis, as the lexer names them
    groups: dict[str, str | None] = field(default_factory=dict)
    #: last word of each axis, in units of the program; where the machine is, if that is known
    place: dict[str, float] = field(default_factory=dict)
    feed: float = math.nan  #: as written
    last_words: dict[str, LastWord] = field(default_factory=dict)  #: by groups
    #: last words of rotary axes, wherever these are since, but where the control has turned them
    angles: dict[str, float] = field(default_factory=dict)
    #: frames that no word of the program names: what it calls leaves them off, for nothing would end them
    unnamed: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not self.groups:
            foreign = [letter for letter in _AXES if letter not in self.axes and "I" not in self.axes]
            names = (*self.table.groups, *(f"{FRAME}{letter}" for letter in foreign))
            self.groups = {name: (group_of(name) or Group()).start for name in names}
        self.place = self.place or dict.fromkeys(self.axes, math.nan)

    def copy(self) -> State:
        """Return the same state, to be changed on its own."""
        own = dict(self.groups), dict(self.place), self.feed, dict(self.last_words), dict(self.angles)
        return State(self.table, self.axes, *own, self.unnamed)

    @property
    def unit(self) -> float:
        """Millimetres per unit; NaN where it is not known."""
        return _UNITS.get(self.groups["units"] or "", math.nan)

    @property
    def plane(self) -> int:
        """Plane of arcs that holds, 0 where that is not known; a mill begins in G17."""
        plane = self.groups.get("plane", PRESET)
        return 17 if plane == PRESET else int((plane or "G0")[1:])

    @property
    def frames(self) -> tuple[str, ...] | None:
        """Words that turn, scale or mirror the places of the part; None where it is not known whether any does."""
        values = [value for group, value in self.groups.items() if group.startswith(FRAME)]
        on = tuple(value for value in values if value not in (None, "off"))
        return None if None in values and not on else on

    @property
    def rounding(self) -> str:
        """Words that say how exactly corners are passed; empty where there are none, or where that is not known."""
        path = self.groups.get("path")
        return "" if path in (None, PRESET) else path

    def tip_suits(self, kind: str) -> bool | None:
        """Whether tip control is on, or off, as words of a kind want it; None where machine data decide.

        Kinds are those of tip control, and "points" on the tool axis. Where it is on for all of them, other words say
        how the axis is interpolated, and in which coordinates.
        """
        groups, system, last = self.groups, "machine" if kind == "angles" else "part", self.last_words.get("tip")
        if last is not None and last.odd:
            return False
        if kind == "points" and "orientation" not in groups:  # FANUC: words of G6.2, under the length of the tool
            return True
        if kind == "off" or groups["tip"] != "both":
            return groups["tip"] == kind
        law, place = groups.get("orientation", PRESET), groups.get("coordinates", PRESET)
        if (law, place) == (kind, system) or (kind == "angles" and "orientation" not in groups):
            return True
        open_laws = {"vectors": (kind, "planes", PRESET), "angles": (kind, PRESET)}.get(kind, (kind,))
        return None if law in open_laws and place in (system, PRESET) else False

    def but(self, **groups: str | None) -> State:
        """Return the same state with some groups set otherwise."""
        return replace(self, groups=self.groups | groups)

    def lose_place(self, letters: Iterable[str] | None = None) -> None:
        """Take the places of some axes, or of all, as unknown."""
        self.place |= dict.fromkeys(set(self.axes if letters is None else letters) & self.place.keys(), math.nan)

    def lose_all(self, *, frames: bool = False) -> None:
        """Take all as unknown; frames that the program does not name only if it is so wanted."""
        self.lose_place()
        self.unnamed = frozenset() if frames else self.unnamed
        self.groups = {name: value if name in self.unnamed else None for name, value in self.groups.items()}
        self.feed = math.nan

    def or_not(self, other: State) -> None:
        """Take as unknown what another state, which may hold instead, has not the same."""
        self.lose_place(letter for letter, value in self.place.items() if value != other.place[letter])
        self.groups = {name: value if other.groups[name] == value else None for name, value in self.groups.items()}
        self.feed = self.feed if self.feed == other.feed else math.nan
        self.last_words = {group: last for group, last in self.last_words.items() if group in other.last_words}

    def pass_blocks(self, code: float | None, angles: Mapping[str, float]) -> None:
        """Go on behind motion blocks: the last G word of group 01 and the last rotary words in them, where given."""
        self.lose_place("XYZ")
        self.place |= angles
        self.angles |= angles
        if code is not None:
            self.groups["motion"] = _MOTIONS.get(code)

    def after(self, line: Line) -> State:
        """Return the state after a line of words."""
        after = self.copy()
        after.execute(line)
        return after

    def execute(self, line: Line) -> bool:
        """Execute a line of words; return whether it may cut."""
        before = self.copy() if line.skipped else self
        if line.tape:
            self.lose_all()
        cuts = self._words(line.words, line.number) if line.words else False
        if line.skipped:  # the operator chooses
            self.or_not(before)
        return cuts

    def rows(self, words: Sequence[Word]) -> list[tuple[Word, str, Row]]:
        """Words of a block that are none of the motion, with their names in the table, and what they do there."""
        given = {word.name: word.value for word in words}
        named = [(word, name) for word in words if (name := _name(word)) not in _OF_MOTION and name not in self.axes]
        alone = len(words) == 1
        return [(word, name, self.table.row(name, word.spelling, given, alone=alone)) for word, name in named]

    def _words(self, words: tuple[Word, ...], line: int) -> bool:
        given = {word.name: word.value for word in words}
        named = self.rows(words)
        beside = frozenset[str]().union(*(row.beside for _, _, row in named))
        named = [(word, name, row) for word, name, row in named if name not in beside]
        does = {effect for word, _, row in named for effect in self._set(word, row, words, line)}
        # what belongs to other words of the block, or to the motion that holds
        beside |= self.table.arguments.get(self.groups["motion"] or "", frozenset())
        does |= {effect for _, name, row in named if name not in beside for effect in row.does}
        if does & {"anything", "unknown"}:
            self.lose_all(frames="unknown" in does)
            return False
        if "dwell" in does:
            return False
        if "stop" in does:
            self.groups |= {name: None for name in ("spindle", "coolant") if self.groups[name] != "OFF"}
        if "F" not in beside and ("F" in given or "feed" in does):
            self.feed = given.get("F", math.nan)
        if "tool" in does and self.groups["tip"] != "off":
            self.groups["tip"] = None
        self.angles = {} if "turn" in does else self.angles
        self.angles |= {letter: given[letter] for letter in _ROTARY & given.keys()}
        axes = [letter for letter in self.axes if letter in given and letter not in beside]
        if "machine" in does:
            # tip control keeps the tip in the part, which turns with the tables: then all of its place may change
            self.lose_place(axes if axes and self.groups["tip"] == "off" else None)
        elif does & {"place", "tool"}:
            self.lose_place()
        else:
            self._go(given, axes, does)
        for letter in sorted(given.keys() - beside):
            if f"{FRAME}{letter}" in self.groups:
                self.groups[f"{FRAME}{letter}"] = f"axis {letter}, which the machine has not"
        return bool(axes) and self.groups["motion"] in CUTS and "machine" not in does

    def _set(self, word: Word, row: Row, words: Sequence[Word], line: int) -> set[str]:
        """Set the groups of a word; return what the change does beside."""
        does: set[str] = set()
        for group, value in row.sets:
            value = word.spelling if value == "." else value
            if group == "coolant" and (ends := ends_of(self.table.means)):
                stays = after_word(self.groups[group], value, ends)
                # another tool may have ended what only a word of its own ends
                value = stays if stays == value or (value or "").startswith(ENDS) else None
            changes, lettered = _change(group)
            if lettered and value is not None:
                own = (other.spelling for other in words if other.name in row.beside)
                value = " ".join((value, *own))
            # LinuxCNC takes the feed as zero behind any word of its kind, the same one included
            if self.groups.get(group) != value or value is None or group == "feed":
                does |= changes
            if group.startswith(FRAME):
                does.add("place")
            self.groups[group] = value
            if value is not None:
                more = (other.spelling for other in words if other.name in row.more)
                self.last_words[group] = LastWord(row, " ".join((word.spelling, *more)), line)
        return does

    def _go(self, given: Mapping[str, float], axes: Iterable[str], does: set[str]) -> None:
        """Take the places of a block."""
        if does & {"length", "shift", "axis"}:
            # by its settings a control takes Z, or the axis across the plane
            alone = _ALONG.get(self.groups.get("plane", PRESET) or "", "XYZ") if "length" not in does else "XYZ"
            self.lose_place(None if "shift" in does else alone)
        named, distance = set(axes), self.groups["distance"]
        for letter in named:
            added = self.place[letter] if distance == "incremental" and letter not in VECTOR else 0.0
            self.place[letter] = math.nan if distance is None else given[letter] + added
        if 0 < len(VECTOR & named) < len(VECTOR):  # what the others are then is not known
            self.lose_place(VECTOR)


#: before a value that a word of its own ends
ENDS: Final = "-"


def is_off(value: float | str) -> bool:
    """Whether a value of a group switches it off: any other, or one alone."""
    return value == "OFF" or str(value).startswith(ENDS)


def ends_of(means: Means) -> frozenset[str]:
    """Values of coolant that each end one other alone, as `Table.means` has them."""
    return frozenset(value for kind, value in means.values() if kind == "coolant" and value.startswith(ENDS))


def after_word(before: str | None, value: str | None, ends: Set[str]) -> str | None:
    """Return what holds in a group after a word for a value, where words for `ends` each end one value alone."""
    if value is not None and value.startswith(ENDS):
        return "OFF" if before in (PRESET, value.removeprefix(ENDS)) else before
    return before if before is not None and ENDS + before in ends else value


@cache
def _change(group: str) -> tuple[frozenset[str], bool]:
    """What a change of a group does beside, and whether its value has the letters that belong to its word."""
    kind = group_of(group) or Group()
    return frozenset(kind.changes.split()), kind.lettered


def _name(word: Word) -> str:
    """Name of a word in the table."""
    if word.name in ("G", "M"):
        return f"{word.name}{word.value:g}"
    if word.name in ("side", "block"):
        return word.text.upper()
    if len(word.name) > 1 and "(" in word.text and re.search(r"\(\s*\)", word.text):
        return f"{word.name}()"
    return word.name


@dataclass(frozen=True)
class Rows:
    """r motion blocks that follow one another, with c axes (`State.axes`)."""

    first: int  #: line of the first, from 0; they are on neighbouring lines
    before: State
    code: Floats  #: (r,) 0 rapid, 1 line, 2 and 3 arcs; others are motions that are not known
    place: Floats  #: (r + 1, c) words before the first and after each, NaN where not known
    feed: Floats  #: (r,) as written, NaN where not known
    moves: Bools  #: (r,) whether an axis is named
    odd: Bools  #: (r,) whether it has other words than places, as arcs have
    lost: Bools  #: (r,) whether it leads to a place that is not known
    columns: Mapping[str, Floats]  #: words as written, by letters; NaN where a block has none

    def __len__(self) -> int:
        return len(self.code)

    def after(self, count: int) -> State:
        """Return the state after so many blocks."""
        if count == 0:
            return self.before.copy()
        place = dict(zip(self.before.axes, self.place[count].tolist(), strict=True))
        groups = self.before.groups | {"motion": _MOTIONS.get(float(self.code[count - 1]))}
        return replace(self.before, groups=groups, place=place, feed=float(self.feed[count - 1]))


def execute_rows(state: State, first: int, columns: Mapping[str, Floats], *, weak_feed: bool = False) -> Rows:
    """Execute motion blocks; `columns` as `nc_reader` has them, NaN where a block has no such word.

    `weak_feed` says that the control may count feeds of these blocks in another unit.
    """
    count = len(next(iter(columns.values())))
    blank = np.full(count, np.nan)
    code, _ = filled(columns.get("G", blank), _CODES.get(state.groups["motion"] or "", np.nan))
    feed, _ = filled(columns.get("F", blank), state.feed)
    if state.groups["feed"] == "inverse":
        feed = columns.get("F", blank)
    elif weak_feed:
        feed = blank
    arc = (code == 2.0) | (code == 3.0)
    odd = np.zeros(count, np.bool_)
    for name in columns.keys() - {"G", "F", *state.axes}:
        odd |= ~np.isnan(columns[name])
    named = [~np.isnan(columns.get(letter, blank)) for letter in state.axes]
    lost = (odd & ~arc) | (~(arc | (code == 0.0) | (code == 1.0)) & np.any(named, axis=0))
    if {*state.axes} >= VECTOR:  # what missing words of a vector are is not known
        given = np.sum([~np.isnan(columns.get(letter, blank)) for letter in sorted(VECTOR)], axis=0)
        lost |= ~arc & (given > 0) & (given < len(VECTOR))
    place, moves = np.empty((count + 1, len(state.axes))), np.zeros(count, np.bool_)
    for k, letter in enumerate(state.axes):
        words = columns.get(letter, blank)
        words = np.where(arc, np.nan, words) if letter in VECTOR else words
        moves |= ~np.isnan(words)
        place[0, k] = state.place[letter]
        place[1:, k] = _places(words, state, letter, lost)
    return Rows(first, state, code, place, feed, moves, odd, lost, columns)


def _places(words: Floats, state: State, letter: str, lost: Bools) -> Floats:
    """(r,) where an axis is after each block."""
    distance = state.groups["distance"]
    if distance is None:
        lost = lost | ~np.isnan(words)
    if distance == "incremental" and letter not in VECTOR:
        known = np.where(np.logical_or.accumulate(lost), np.nan, 0.0)
        return state.place[letter] + np.cumsum(np.nan_to_num(words)) + known
    value, last = filled(np.where(lost, np.nan, words), state.place[letter])
    gone = np.maximum.accumulate(np.where(lost, np.arange(len(words)), -1))
    return np.where((gone >= 0) & (gone >= last), np.nan, value)
