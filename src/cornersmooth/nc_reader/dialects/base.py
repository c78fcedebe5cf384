"""What a dialect is: how a control spells its words, and what those mean that are not motion."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn

from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.word_tables import means_of, word_table
from cornersmooth.nc_reader.words import Columns, Line

if TYPE_CHECKING:
    from cornersmooth.nc_reader.hole_cycles import HoleCycle
    from cornersmooth.nc_reader.reader import Reader


#: word around the number of a modulo axis that sends it the shorter way; a column of tables with the axis behind it
BY_WORD = "DC"


@dataclass
class Memory:
    """What words have said that no other state of the reader holds, from line to line."""

    incremental: bool = False  #: G91 is in force, in which no motion is read
    high_speed: bool = False  #: look ahead of the kind that some controls ask for with curves is on
    clamped: dict[str, bool] = field(default_factory=dict)  #: rotary axes with a clamp: held, or words let them turn
    keeps_tip: bool | None = None  #: whether the kinematics do, where the machine's file says what switches that
    shorter_way: bool = False  #: whether rotary axes go it
    speed: float = math.nan  #: of the spindle
    rigid: bool = False  #: M29 asks the spindle to turn with the feed
    height: float | None = None  #: at which a run of modal cycles began (G98), in units of the program
    cycle: HoleCycle | None = None  #: that a block defines for others to call
    centre: dict[str, float] = field(default_factory=dict)  #: of circles to come
    #: how the tool axis is interpolated, and in which coordinates
    orientation: str = ""
    axis_frame: str = ""


#: how the values of a table `[grammar]` are read, where not as they are
_READ: Mapping[str, Callable[[Any], Any]] = {
    "tip_control": lambda table: {float(code): name for code, name in table.items()},
    **dict.fromkeys(("controls", "unsure"), lambda table: {kind: tuple(names) for kind, names in table.items()}),
    "silent": lambda codes: frozenset(map(float, codes)),
}


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
    #: what must be in force for words of a kind: ``"vector"``, ``"point"``, ``"angles"``, ``"machine"``
    controls: Mapping[str, tuple[str, ...]] = {}
    #: what is not known to be in force for them: machine data or parameters decide
    unsure: Mapping[str, tuple[str, ...]] = {}
    #: whether texts can send the tool up, so that rotary axes turn there
    retracts: bool = True
    #: what sends a modulo axis the shorter way: `BY_WORD`, a word that is in force, or empty for a parameter
    shorter_way: str = ""
    #: what must be in force for curves; empty for nothing
    curves_need: str = ""
    #: whether tip control is switched by blocks that the machine's file names
    switches: bool = False
    #: G words of inches and of millimetres, and those that change nothing measured: of all its controls, of this one
    inches: frozenset[float] = frozenset()
    millimetres: frozenset[float] = frozenset()
    always_silent: frozenset[float] = frozenset()
    silent: frozenset[float] = frozenset()
    #: the first letter, or letters, of tip and second triple in the lexer, with their decimals
    digits: re.Pattern[bytes] = re.compile(rb"(?:([XYZ])|([IJUVW]))[-+]?\d*\.(\d*)")

    def __init__(self, control: str, rotary: str = "") -> None:
        table = word_table(control)
        for key, value in table["grammar"].items():
            setattr(self, key, _READ[key](value) if key in _READ else value)
        self.switches, self.means, self.rotary = table.get("switches", False), means_of(control), rotary
        if rotary:
            self.digits = re.compile(
                rb"(?<!K\d)(?:([XYZ])|(?<![A-Z0-9])([%b])(?:=DC\()?)[-+]?\d*\.(\d*)" % rotary.encode()
            )

    def after_motion(self, letter: str, value: float) -> bool:
        """Whether a word acts after the motion of its block: M words that stop, end or switch off."""
        kind, said = self.means.get(f"M{value:g}", ("", "")) if letter == "M" else ("", "")
        return kind in ("stop", "end") or said == "OFF"

    def row(self, line: Line) -> dict[str, float] | None:
        """Words of a motion block; None where the line is something else."""
        columns = self.lexer.motion(line)
        return None if columns is None else values(columns)

    def words(self, line: Line, state: Reader) -> None:
        """Interpret a line that is no motion block."""
        raise NotImplementedError

    def mode(self, code: float, line: Line, state: Reader) -> None:
        """Take a G word outside group 01 that changes what holds from block to block."""
        if code in (17.0, 18.0, 19.0):
            state.change(line, plane=int(code))
        elif code in self.inches | self.millimetres:
            state.change(line, inch=code in self.inches)
        elif code in (93.0, 94.0, 95.0):
            state.change(line, per_revolution=code == 95.0, inverse_time=code == 93.0)
        elif code in (40.0, 41.0, 42.0):
            state.event(line, "G", code, f"G{code:g}")
        elif code not in self.always_silent | self.silent:
            hint = "only absolute milling with tool vectors, axis points or rotary words is read"
            state.refuse(line, f"G{code:g} is not understood", hint)

    def machine_axes(self, line: Line, state: Reader, beside: Set[tuple[str, float]]) -> str:
        """Axes that a block sends to positions of the machine; refuses words beside them but for some."""
        axes = ("X", "Y", "Z", *self.rotary)
        for name, value, text, *_ in line.words:
            if name not in (*axes, "N") and (name, value) not in beside:
                state.refuse(line, f"{text} beside a position of the machine", "give it a block of its own")
        return "".join(word.name for word in line.words if word.name in axes)

    @staticmethod
    def refuse(line: Line, name: str, text: str, state: Reader) -> NoReturn:
        """Give up at a word that is not understood."""
        if name in "ABC":
            state.refuse(line, f"{text}: rotary words", "name the machine they are for, with --machine")
        state.refuse(line, f"{text} is not understood here", "see that the control is the one the text is for")

    def decimals(self, text: bytes) -> tuple[int, int | None]:
        """Decimals of the tip and of the second triple, from a sample of the text; None without any."""
        tip, second = 0, None
        shapes = set(text.upper().translate(_ONE_DIGIT).split(b"\n"))  # many lines differ in nothing but their digits
        for _, other, fraction in self.digits.findall(_COMMENT.sub(b"", b"\n".join(shapes))):
            if other:
                second = max(second or 0, len(fraction))
            else:
                tip = max(tip, len(fraction))
        for fraction in _VECTOR_K.findall(b"\n".join(shapes)) if b"IJ" in self.digits.pattern else ():
            second = max(second or 0, len(fraction))
        return tip, second


_COMMENT = re.compile(rb"\([^)\n]*\)|;[^\n]*")
#: K of a vector; alone it is a knot
_VECTOR_K = re.compile(rb"J[-+]?\d*\.?\d*[ ]*K[-+]?\d*\.(\d*)")
_ONE_DIGIT = bytes.maketrans(b"0123456789", b"0" * 10)


def values(columns: Columns) -> dict[str, float]:
    """Numbers of a single motion block."""
    return {name: word if isinstance(word, float) else word.value for name, word in columns.items()}
