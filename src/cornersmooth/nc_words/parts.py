"""Digests of the parts of a program: what is not of the motion, and no statement of the CL file asks for.

A *part* is what comes before the first cut, between a retract and the next cut, behind the last retract, or within
cuts. Its digest is over the words that change what the control remembers, in order, with where the tool moves between
them. Comments, block numbers, blanks, and words that set what holds anyway do not count; nor do feeds, planes, cutter
compensation, tools, speeds, dwells and stops, which are compared with the CL file.

`smooth` puts the digests of the program that it has verified into its head.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from cornersmooth.control.state import CUTS, State
from cornersmooth.control.table import FRAME, Row
from cornersmooth.control.words import Line, Table, Word
from cornersmooth.frame import PARTS, PARTS_WORD

#: hexadecimal digits of a part
_DIGITS: Final = 6

#: groups that follow the CL file, and words that do
_GROUPS: Final = frozenset(("motion", "feed", "plane", "path", "compensation"))
_WORDS: Final = frozenset(("T", "S"))
_SWITCHED: Final = frozenset(("spindle", "coolant"))

#: words that begin and end a program, or only show something
_FRAME: Final = re.compile("O$|%|MSG|BLK FORM|(BEGIN|END) PGM")

#: a word with a number; codes are in one spelling
_NUMBER: Final = re.compile(r"([A-FH-LN-Z]+)([-+.\d]+)")
_ZEROS: Final = re.compile(r"(?<![\w.])0+(?=\d)|(?<=[A-Z=+-])0+(?=\d)")

#: letters of places, and of axes that turn
_PLACES: Final = frozenset("XYZABCIJKUVW")
_ROTARY: Final = "ABC"

#: blocks of an approach whose letters count, at most
_APPROACH: Final = 8


@dataclass
class _Part:
    """One part: the lines from which and to which it goes, and its words so far."""

    first: int = 1
    last: int = 1
    words: list[str] = field(default_factory=list)

    @property
    def digest(self) -> str:
        """Digest of the words, never that of none."""
        digest = hashlib.sha256("\n".join(self.words).encode()).hexdigest()[:_DIGITS]
        return digest if digest.strip("0") else "0" * (_DIGITS - 1) + "1"


class Parts:
    """Follows one program; lines are its blocks in order."""

    def __init__(self) -> None:
        self._parts: list[_Part] = []
        self._part = _Part()
        self._cuts = False  # whether the part is within cuts
        self._above = True  # Z has not moved since a retract
        self._still = True  # nothing has moved since the last word that counts
        self._switched: list[str] = []  # words of spindle and coolant since the last motion: their order is free
        self._wanted = ""  # digests of the head

    # what the program says

    def comment(self, text: str) -> None:
        """Take the digests of the head."""
        if match := PARTS_WORD.search(text):
            self._wanted = self._wanted or match[1].lower()

    def table(self, table: Table, machine: State) -> None:
        """Take a run of motion blocks; the machine is before it."""
        for row in range(min(len(table), _APPROACH) if self._above else 1):
            self._moves(int(table.line[row]), set(table.row(row)))
        cuts = table.column("G") > 0.0
        if cuts.any() or (machine.groups["motion"] in CUTS and not (table.column("G") == 0.0).any()):
            self._cut(int(table.line[cuts.argmax()]))

    def line(self, line: Line, machine: State, after: State) -> None:
        """Take any other line; the machine is before it, and `after` it."""
        rows = machine.rows(line.words)
        does = {effect for _, _, row in rows for effect in row.does}
        beside = frozenset[str]().union(*(row.beside for _, _, row in rows))
        if line.tape or "dwell" in does or any(_FRAME.match(name) for _, name, _ in rows):
            return
        beside |= _PLACES
        rows = [(word, name, row) for word, name, row in rows if name not in beside and not _compared(name, row)]
        if "machine" in does and self._cuts:
            self._close(line.number, cuts=False)
        if any(("motion", None) in row.sets and row.group in ("", "cycles") for _, _, row in rows):
            self._cut(line.number)  # a hole cycle, or a curve: measured
            return
        before, now = machine.groups, after.groups
        for word, _, row in rows:
            changed = any(
                _value(before[group]) != _value(now[group]) or group.startswith(FRAME) for group, _ in row.sets
            )
            own = [_spelt(other) for other in line.words if other.name in row.beside]
            text = " ".join(("/" * line.skipped + _spelt(word), *own))
            if changed and not row.does and {group for group, _ in row.sets} <= _SWITCHED:
                self._switched.append(text)
            elif changed or row.does:
                self._take(line.number, text, stays="tool" not in row.does and "machine" not in does)
        moved = {word.name for word in line.words} & _PLACES
        if "machine" in does:
            self._take(line.number, " ".join(sorted(map(_spelt, line.words))))
            self._above = True
        elif moved:
            self._moves(line.number, moved)
            if now["motion"] in CUTS:
                self._cut(line.number)
        turned = " ".join(
            f"{name}{machine.place[name] + 0.0:g}" for name in _ROTARY if not math.isnan(machine.place[name])
        )
        if turned and (before["tip"] != now["tip"] or does & {"anything", "tool"}):
            self._take(line.number, turned)

    def _take(self, line: int, word: str, *, stays: bool = False) -> None:
        """Take a word; `stays`: the machine does not move by it."""
        if not stays:
            self._flush(line)
        self._part.words.append(re.sub(r"\s+", " ", word))
        self._part.last, self._still = line, True

    def _flush(self, line: int) -> None:
        """Take the words of spindle and coolant that have come since the last motion."""
        words, self._switched = sorted(self._switched), []
        for word in words:
            self._take(line, word, stays=True)

    def _moves(self, line: int, names: set[str]) -> None:
        """Take a motion: on the way down from a retract with its letters, elsewhere the first behind a word alone."""
        if not (self._still or self._above):
            return
        self._flush(line)
        if self._above:
            self._take(line, "".join(sorted(_PLACES & names)))
            self._above = "Z" not in names
        elif self._still and self._part.words:
            self._take(line, ".")
        self._still = False

    def _cut(self, line: int) -> None:
        self._above = False
        if not self._cuts:
            self._close(line, cuts=True)

    def _close(self, line: int, *, cuts: bool) -> None:
        """End the part: the next begins at a line."""
        self._flush(line)
        if self._part.words:
            self._part.last = line
            self._parts.append(self._part)
        self._part, self._cuts = _Part(line, line), cuts

    # what comes of it

    @property
    def _whole(self) -> list[_Part]:
        """All parts; what is beyond the number that a head has is the last of them."""
        self._flush(self._part.last)
        parts = [*self._parts, self._part] if self._part.words else [*self._parts]
        rest = parts[PARTS - 1 :]
        if len(rest) > 1:
            words = [word for part in rest for word in (*part.words, "|")]
            parts[PARTS - 1 :] = [_Part(rest[0].first, rest[-1].last, words)]
        return parts

    @property
    def digests(self) -> str:
        """Digests for the head."""
        return ".".join(part.digest for part in self._whole)

    def changed(self) -> str:
        """The lines whose parts are not what the head has; empty for none."""
        parts, wanted = self._whole, [digest for digest in self._wanted.split(".") if digest.strip("0")]
        found = [part.digest for part in parts]
        if not wanted or found == wanted:
            return ""
        first = _alike(found, wanted)
        behind = len(found) - _alike(found[first:][::-1], wanted[first:][::-1])
        if len(found) < len(wanted):  # some are gone, between two that are not changed
            low = parts[first - 1].last if first else 1
            high = parts[behind].first if behind < len(parts) else parts[-1].last if parts else low
        else:
            low, high = parts[first].first, parts[behind - 1].last
        return f"lines {low} to {high}, which were changed since the program was written"


def _spelt(word: Word) -> str:
    """A word, its numbers without plus signs and zeros that say nothing."""
    match = None if word.fixed else _NUMBER.fullmatch(word.spelling)
    return f"{match[1]}{word.value + 0.0:.10g}{'.' * ('.' in match[2])}" if match else _ZEROS.sub("", word.spelling)


def _alike(digests: Sequence[str], others: Sequence[str]) -> int:
    """How many digests are those of others before the first that is not."""
    same = [one == other for one, other in zip(digests, others, strict=False)]
    return [*same, False].index(False)


def _compared(name: str, row: Row) -> bool:
    """Whether a word is compared with what the CL file has."""
    if name in _WORDS or name.startswith("TOOL DEF") or row.does & {"dwell", "stop"}:
        return True
    return bool(row.sets) and {group for group, _ in row.sets} <= _GROUPS and not row.does


def _value(value: str | None) -> str | None:
    """Value of a group; a spindle that is oriented does not turn."""
    return "OFF" if value == "ORIENT" else value
