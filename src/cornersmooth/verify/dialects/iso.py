"""FANUC and what is like it: Haas, LinuxCNC, Mitsubishi, and the neutral form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cornersmooth.verify.dialects.base import AFTER_MOTION, HIGH_SPEED, Dialect, State
from cornersmooth.verify.lexer import Lexer
from cornersmooth.verify.words import MOTION_CODES, MOTION_LETTERS, PLACE_LETTERS, Line, Table

#: letters whose words are events
_EVENT_LETTERS = "TSMHD"

#: G words that change nothing measured here: cancellations, work offsets
_SILENT = frozenset((80.0, 90.0, *map(float, range(54, 60))))
_COMPENSATION = (40.0, 41.0, 42.0)


@dataclass(frozen=True)
class IsoWords:
    """What differs between these controls.

    Parameters
    ----------
    tip_control : mapping
        Name of what a G word switches on, which takes a length register H with it; ``""`` switches off.
    controls : mapping
        `Dialect.controls`.
    silent : frozenset
        Further G words that change nothing measured.
    dwell : float
        Milliseconds that ``G4 P`` counts in.
    others : str
        Letters that say nothing here.
    unsaid : frozenset
        `Dialect.unsaid`.
    curves_need : str
        `Dialect.curves_need`.
    """

    tip_control: Mapping[float, str]
    controls: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    silent: frozenset[float] = frozenset()
    dwell: float = 1.0
    others: str = "NOQ"
    unsaid: frozenset[str | tuple[str, float]] = frozenset()
    curves_need: str = ""


_FANUC = {43.0: "G43", 43.4: "G43.4", 43.5: "G43.5", 49.0: ""}
_FANUC_CONTROLS = {"vector": ("G43.5",), "angles": ("G43.4",), "machine": ("", "G43")}
_NO_THROUGH: frozenset[str | tuple[str, float]] = frozenset((("coolant", 88.0),))

#: look ahead and smoothing: G5 P10000, G5.1 Q1, G8 P1
_HIGH_SPEED = frozenset((5.0, 5.1, 8.0))

ISO_WORDS: Mapping[str, IsoWords] = {
    "fanuc": IsoWords(_FANUC, _FANUC_CONTROLS, silent=_HIGH_SPEED, unsaid=_NO_THROUGH),
    # high-speed high-accuracy control II, or III (P20000): program error P29 without it
    "mitsubishi": IsoWords(_FANUC, _FANUC_CONTROLS, silent=_HIGH_SPEED, unsaid=_NO_THROUGH, curves_need="G5 P10000"),
    "haas": IsoWords(
        {43.0: "G43", 234.0: "G234", 49.0: ""},
        {"angles": ("G234",), "machine": ("", "G43"), "vector": ("G234",)},
        dwell=1000.0,
    ),
    "linuxcnc": IsoWords(
        {43.0: "G43", 43.1: "G43.1", 49.0: ""},
        silent=frozenset((61.0, 61.1, 64.0)),
        dwell=1000.0,
        unsaid=_NO_THROUGH,
    ),
    "generic": IsoWords(_FANUC, unsaid=_NO_THROUGH | {"offset"}),
}


class Iso(Dialect):
    """Words of one letter and a number.

    Parameters
    ----------
    name : str
        Of the control, as in `ISO_WORDS`.
    rotary : str
        Addresses of the rotary axes; empty without a machine.
    """

    def __init__(self, name: str, rotary: str = "") -> None:
        self.iso = ISO_WORDS[name]
        letters, places = MOTION_LETTERS, set(PLACE_LETTERS)
        if rotary:  # I J stand on arcs only, and such lines are read one by one; K is a knot
            letters = "".join(letter for letter in letters if letter not in "IJUVW") + rotary
            places = (places - set("IJUVW")) | set(rotary)
        super().__init__(_IsoLexer(letters, places, rotary), rotary)
        self.controls, self.unsaid, self.curves_need = self.iso.controls, self.iso.unsaid, self.iso.curves_need
        self.letters = frozenset(letters) | ({"I", "J"} if rotary else set())

    def row(self, line: Line) -> dict[str, float] | None:
        """Words of a motion block; None where the line is something else."""
        row = {letter: value for letter, value, _ in line.words}
        letters = set(row)
        if len(row) != len(line.words) or not letters <= self.lexer.letters or not letters & self.lexer.places:
            return None
        if "G" in row and row["G"] not in MOTION_CODES:
            return None
        return None if _odd_vector(row, self.rotary) else row

    def words(self, line: Line, state: State) -> None:
        """Interpret a line that is no motion block."""
        motion: dict[str, float] = {}
        given = {letter: value for letter, value, _ in line.words}
        if given.get("G") == 5.0:
            state.memory[HIGH_SPEED] = given.get("P", 0.0) >= 10000.0
        for letter, value, text in line.words:
            if letter == "G":
                if value in MOTION_CODES:
                    motion["G"] = value
                elif value == 4.0:
                    self._dwell(given, line, state)
                    return
                else:
                    self._mode(value, line, state)
            elif letter in _EVENT_LETTERS:
                state.event(line, letter, value, text, late=letter == "M" and value in AFTER_MOTION)
            elif letter in self.letters and letter != "N":
                motion[letter] = value
            elif letter in "ABC":
                state.refuse(line, f"{text}: rotary words", "name the machine they are for, with --machine")
            elif letter not in self.iso.others:
                state.refuse(line, f"{text} is not understood", "see that the control is the one the text is for")
        if _odd_vector(motion, self.rotary):
            state.refuse(line, "I J K beside rotary words", "leave out --machine for a text with tool vectors")
        state.move(line, motion)

    def _dwell(self, given: Mapping[str, float], line: Line, state: State) -> None:
        """G4: P in milliseconds or seconds, X and U in seconds."""
        time = self.iso.dwell * given["P"] if "P" in given else 1000.0 * given.get("X", given.get("U", 0.0))
        state.event(line, "G", 4.0, f"{time:.10g}")

    def _mode(self, code: float, line: Line, state: State) -> None:
        """Take a G word outside group 01 that changes the state."""
        if code in (17.0, 18.0, 19.0):
            state.change(line, plane=int(code))
        elif code in (20.0, 21.0):
            state.change(line, inch=code == 20.0)
        elif code in (93.0, 94.0, 95.0):
            state.change(line, per_revolution=code == 95.0, inverse_time=code == 93.0)
        elif code in self.iso.tip_control:
            state.tip_control = self.iso.tip_control[code]
            state.event(line, "G", code, f"G{code:g}")
        elif code in _COMPENSATION:
            state.event(line, "G", code, f"G{code:g}")
        elif code not in _SILENT and code not in self.iso.silent:
            hint = "only absolute milling with tool vectors, axis points or rotary words is read"
            state.refuse(line, f"G{code:g} is not understood", hint)


class _IsoLexer(Lexer):
    """The same, where K is a knot and never a vector beside rotary words."""

    def __init__(self, letters: str, places: set[str], rotary: str) -> None:
        super().__init__(letters, places)
        self._rotary = rotary

    def line(self, text: bytes, number: int, name: str | None) -> Line:
        """Take one line apart; a program name in brackets says nothing."""
        plain = text.strip()
        if plain[:1] == b"<" and plain.find(b">") == len(plain) - 1:
            return Line(number, (("O", 0.0, plain.decode("latin-1")),), ())
        return super().line(text, number, name)

    def table(self, table: Table) -> Table | None:
        """Return the run; None where its lines must be read one by one."""
        if self._rotary and "K" in table.columns and "G" in table.columns:
            code, knot = table.columns["G"], table.columns["K"]
            if (~np.isnan(knot) & (code <= 1.0)).any():
                return None
        return super().table(table)


def _odd_vector(row: Mapping[str, float], rotary: str) -> bool:
    """Whether a block has words of a vector that rotary words have no use for."""
    code = row.get("G", -1.0)
    return bool(rotary) and bool({"I", "J", "K"} & row.keys()) and (code in (0.0, 1.0) or ("I" in row and code < 0))
