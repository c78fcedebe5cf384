"""How a text is to be understood: its control and machine, the tolerance, the digits that it is printed with."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Set
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Final

from cornersmooth.control.state import is_off
from cornersmooth.control.table import CONTROLS, Table, table_of, word_table
from cornersmooth.control.words import Lexer, Line, Word, refused, tools_first
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.nc_reader.acts import Acts, Beside, Move, Running
from cornersmooth.nc_reader.rotary import Rotary

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: effects of words that are read: those of groups whatever their known value, or the effect as a whole
_READ: Final = frozenset("plane units feed tip tool_length orientation coordinates way compensation".split())
_SILENT: Final = frozenset("nothing distance=absolute offset=. path=. smoothing=. smoothing=off cycles=off".split())


class Dialect:
    """A control's way to say things; nothing in it changes while a text is read.

    Parameters
    ----------
    control : str
        One of `CONTROLS`.
    rotary : str
        Addresses of the rotary axes; empty without a machine.
    """

    lexer: Lexer
    #: decimals of F are worth so much
    feed_step = 1e-4
    #: inches per minute that F counts in, in a text in inches
    inch_feed = 1.0
    #: whether texts can send the tool up, so that rotary axes turn there: the neutral form has no words for the machine
    retracts: bool = True
    #: whether a modulo axis goes the shorter way by `BY_WORD`; else by a word that is in force, or by a parameter
    by_word: bool = False
    #: what must be in force for curves; empty for nothing
    curves_need: str = ""
    #: whether tip control is switched by blocks that the machine's file names
    switches: bool = False
    #: when words for spindle and coolant act in a block that moves: "before" the motion, or "around" it: what stops
    #: them behind it; empty where the machine decides
    order: str = ""
    #: names of words whose events stand beside the motion, and of those that say nothing here
    beside: Set[str] = frozenset("MTS")
    others: Container[str] = "DN%"
    quiet: Set[str] = frozenset()  #: words that are no events

    def __init__(self, control: str, rotary: str = "") -> None:
        table = word_table(control)
        for key, value in table["grammar"].items():
            setattr(self, key, value)
        self.switches, self.rotary, self.control = table.get("switches", False), rotary, control
        self.table = table_of(control)
        self.means = self.table.means

    @property
    def asks_tip(self) -> bool:
        """Whether words of the tool axis need tip control that words of the control switch on."""
        return self.retracts and not self.switches

    def after_motion(self, letter: str, value: float) -> bool:
        """Whether a word acts after the motion of its block: M words that stop, end, and most that switch off."""
        kind, stated = self.means.get(f"M{value:g}", ("", "")) if letter == "M" else ("", "")
        return kind in ("stop", "end") or (is_off(stated) and self.order != "before")

    def acts(self, line: Line, state: Running) -> Acts:
        """Give out what a line that is no motion block does; each act is carried out before the next is wanted.

        Raises
        ------
        InputError
            CS503 for words that make it impossible to tell where the tool is.
        """
        alone = self.alone(line, state)
        if alone is not None:
            yield from alone
            return
        motion: dict[str, float] = {}
        for word in tools_first(line.words):
            if self.moves(word):
                motion[word.name] = word.value
            elif word.name in self.beside and self._is_event(word, state):
                yield self.event(word)
            elif word.name not in self.others and word.spelling not in self.quiet:
                yield from self._mode(word, line, state)
        yield from self.motion(motion, line, state)

    def alone(self, line: Line, state: Running) -> Acts | None:
        """What a line does whose words mean something together, as those of cycles do; None for all others."""
        raise NotImplementedError

    def moves(self, word: Word) -> bool:
        """Whether a word is one of the motion."""
        raise NotImplementedError

    @staticmethod
    def event(word: Word) -> Beside:
        """What a word says beside the motion."""
        return Beside(word.name, word.value, word.text)

    def motion(self, given: dict[str, float], line: Line, state: Running) -> Acts:
        """What the words of the motion of a line do."""
        yield Move(given)

    def _mode(self, word: Word, line: Line, state: Running) -> Acts:
        """Look at a word that changes what holds from block to block: the machine has taken it."""
        group, _, value = (effect := self._effect(word, state)).partition("=")
        if effect == "feed=inverse" and state.rotary is None:
            what = "inverse time feed (G93) without rotary words"
            raise InputError("CS503", what, "name the machine with --machine", line=line.number)
        if effect not in _SILENT and (group not in _READ or value == "?"):
            if word.name not in "GM":
                raise self.not_understood(line, word.name, word.text)
            hint = "only absolute milling with tool vectors, axis points or rotary words is read"
            raise refused(line, f"{word.spelling} is not understood", hint)
        if group in ("tool_length", "compensation"):
            yield Beside("G", word.value, word.spelling)

    @staticmethod
    def _is_event(word: Word, state: Running) -> bool:
        """Whether a word says something of the machine: not an M word that verification accepts as it is."""
        row = state.machine.table.row(word.spelling)
        return word.name != "M" or row.compared or not (row.listed or "machine" in row.does)

    @staticmethod
    def _effect(word: Word, state: Running) -> str:
        """What a word does in the first place; what is beside it in its row follows from that."""
        name = word.spelling if word.name in "GM" else word.name
        return next(iter(state.machine.table.row(name).effects), "unknown")

    def machine_axes(self, line: Line, beside: Set[tuple[str, float]]) -> str:
        """Axes that a block sends to positions of the machine; refuses words beside them but for some."""
        axes = ("X", "Y", "Z", *self.rotary)
        for name, value, text, *_ in line.words:
            if name not in (*axes, "N") and (name, value) not in beside:
                raise refused(line, f"{text} beside a position of the machine", "give it a block of its own")
        return "".join(word.name for word in line.words if word.name in axes)

    @staticmethod
    def not_understood(line: Line, name: str, text: str) -> InputError:
        """Error for a word that is not understood."""
        if name in "ABC":
            return refused(line, f"{text}: rotary words", "name the machine they are for, with --machine")
        return refused(line, f"{text} is not understood here", "see that the control is the one the text is for")

    def steps(self, lines: Iterable[bytes]) -> Steps:
        """What the last printed digit of tip and second triple is worth in some lines."""
        tip, second = [0], list[int]()
        for line in lines:
            try:
                words = self.lexer.line(line, 0, None).words
            except InputError:  # who reads it complains
                continue
            names = {word.name for word in words}
            # K alone is a knot; centres of arcs and angles of planes are no vectors
            vector = {word.value for word in words if word.name == "G"}.isdisjoint(_NO_VECTOR)
            others = self.rotary or ("UVW" + "IJ" * vector + "K" * (vector and "J" in names))
            for word in words:
                if len(parts := line[word.start : word.stop].split(b".")) > 1 and word.name in {*"XYZ", *others}:
                    (second if word.name in others else tip).append(len(parts[1]))
        return Steps(10.0 ** -max(tip), 10.0 ** -max(second) if second else 0.0)


_NO_VECTOR: Final = (2.0, 3.0, 68.2)


#: classes of the modules of these names, each of which is loaded when a program in its words is read
_SPELLINGS: Final = {"iso": "Iso", "siemens": "Siemens", "heidenhain": "Heidenhain"}


@cache
def dialect_of(control: str, rotary: str = "") -> Dialect:
    """Dialect of a control.

    Parameters
    ----------
    rotary : str
        Addresses of the rotary axes of a machine; empty for texts without rotary words.

    Raises
    ------
    SettingsError
        CS204 for an unknown control.
    """
    if control not in CONTROLS:
        raise SettingsError("CS204", f"unknown control {control!r}", f"use one of {', '.join(CONTROLS)}")
    spelling = word_table(control).get("spelling", "iso")
    module = import_module(f"{__name__}.{spelling}")
    found: Dialect = getattr(module, _SPELLINGS[spelling])(control, rotary)
    return found


#: share of the tolerance that the rounding of one number, half a step of its last digit, accounts for at most: a
#: control reads ``I0.`` as 0 exactly, however few digits a program shows
DIGITS_SHARE: Final = 0.5


@dataclass(frozen=True)
class Steps:
    """What the last printed digit is worth."""

    tip: float = 1.0  #: in units of the text
    second: float = 0.0  #: of the second triple; 0 without any

    def finer(self, other: Steps) -> Steps:
        """Give the finer of two of the same text."""
        seconds = [second for second in (self.second, other.second) if second]
        return Steps(min(self.tip, other.tip), min(seconds, default=0.0))


@dataclass(frozen=True)
class ReadingOptions:
    """How a text is to be understood."""

    control: str
    dialect: Dialect
    table: Table  #: of words, with those that switch tip control of the machine's kinematics
    machine: Machine | None
    tcp: bool
    #: mm: as in `read_nc`
    tolerance: float
    axis_length: float

    @classmethod
    def of(
        cls, control: str, machine: Machine | None, *, tcp: bool, tolerance: float, axis_length: float
    ) -> ReadingOptions:
        """Choose it; errors as in `read_nc`."""
        dialect = dialect_of(control, "".join(machine.names) if machine is not None else "")
        if machine is None and not tcp:
            raise SettingsError("CS215", "machine positions need a machine", "name it with --machine")
        turns = machine is not None and len(machine.names) > 0
        switch = machine.tip_control if machine is not None and turns and dialect.switches else None
        table = dialect.table.switched(switch or ())
        return cls(control, dialect, table, machine if turns else None, tcp, tolerance, axis_length)

    @property
    def widest(self) -> tuple[float, float]:
        """Largest steps of tip (mm) and of a vector of length 1 that are accounted for."""
        widest = 2.0 * DIGITS_SHARE * self.tolerance
        return widest, widest / self.axis_length

    def rotary(self, steps: Steps) -> Rotary | None:
        """What resolves rotary words; None without a machine."""
        if self.machine is None:
            return None
        tip, turn = self.widest
        angle = min(steps.second or 1.0, math.degrees(turn))
        return Rotary(self.machine, self.tcp, self.tolerance, self.axis_length, min(steps.tip, tip), angle)
