"""What a dialect is: how a control spells its words, and what those mean that are not motion."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.words import Columns, Line

if TYPE_CHECKING:
    from cornersmooth.nc_reader.execution import Modal
    from cornersmooth.nc_reader.planes import TiltedPlane
    from cornersmooth.nc_reader.rotary import Rotary


#: M words that act after the motion of their block: stops, spindle off, coolant off, end
AFTER_MOTION = (0.0, 1.0, 2.0, 5.0, 9.0, 30.0)


#: name in `State.memory` of whether incremental words (G91) are in force, which are read in no motion
INCREMENTAL = "incremental"

#: name in `State.memory` of whether look ahead of the kind that some controls ask for with curves is on
HIGH_SPEED = "high speed"


#: name in `State.memory` of the set of axes that have been said to be those of splines
SPLINE_AXES = "spline axes"

#: name in `State.memory` of whether each rotary axis that has been spoken of is clamped
CLAMPED = "clamped"

#: name in `State.memory` of whether the kinematics keep the tip, where the machine's file says what switches that
KINEMATICS = "kinematics"

#: word around the number of a modulo axis that sends it the shorter way; a column of tables with the axis behind it
BY_WORD = "DC"


class State(Protocol):
    """What a dialect may ask of the reader, and tell it."""

    modal: Modal
    #: how rotary words move the tool; None without a machine
    rotary: Rotary | None
    #: what keeps the tip where it is told, in the words of the dialect; empty for nothing
    tip_control: str
    #: what else a dialect has to remember from line to line
    memory: dict[str, Any]

    def event(self, line: Line, letter: str, value: float, text: str = "", *, late: bool = False) -> None:
        """Say a word that stands beside the motion; a late one acts after the motion of its block."""

    def move(self, line: Line, row: dict[str, float], *, later: bool = False) -> None:
        """Execute a single motion block, at once or with those behind it."""

    def change(self, line: Line, **modes: Any) -> None:
        """Change what holds from block to block."""

    def wrong(self, code: str, line: Line, text: str) -> None:
        """Note what breaks the rules of the control."""

    def leave(self, axes: str) -> None:
        """Say that axes go to positions of the machine: where they are in the part is not known any more."""

    def tilt(self, line: Line, plane: TiltedPlane) -> None:
        """Switch a tilted plane on."""

    def turn_to_plane(self, line: Line) -> None:
        """Turn the rotary axes to the tilted plane that is on."""

    def level(self, line: Line) -> None:
        """Switch the tilted plane off, where one is on."""

    def refuse(self, line: Line, what: str, hint: str) -> None:
        """Give up: words that make it impossible to tell where the tool is."""


class Dialect:
    """A control's way to say things; nothing in it changes while a text is read.

    Parameters
    ----------
    rotary : str
        Addresses of the rotary axes; empty without a machine.
    """

    #: decimals of F are worth so much
    feed_step = 1e-4
    #: inches per minute that F counts in, in a text in inches
    inch_feed = 1.0
    #: kinds of tokens, or pairs of kind and value, that the control has no words for
    unsaid: frozenset[str | tuple[str, float]] = frozenset()
    #: what must be in force for words of a kind: ``"vector"``, ``"point"``, ``"angles"``, ``"machine"``
    controls: Mapping[str, tuple[str, ...]] = {}
    #: whether texts can send the tool up, so that rotary axes turn there
    retracts: bool = True
    #: what sends a modulo axis the shorter way: `BY_WORD`, a name in `State.memory`, or empty for a parameter
    shorter_way: str = ""
    #: what must be in force for curves; empty for nothing
    curves_need: str = ""
    #: whether SPLINEPATH says which axes are those of splines, the first three where it says nothing
    names_spline_axes: bool = False
    #: whether tip control is switched by blocks that the machine's file names
    switches: bool = False
    #: the first letter, or letters, of tip and second triple in the lexer, with their decimals
    digits: re.Pattern[bytes] = re.compile(rb"(?:([XYZ])|([IJUVW]))[-+]?\d*\.(\d*)")

    def __init__(self, lexer: Lexer, rotary: str = "") -> None:
        self.lexer, self.rotary = lexer, rotary
        if rotary:
            self.digits = re.compile(
                rb"(?<!K\d)(?:([XYZ])|(?<![A-Z0-9])([%b])(?:=DC\()?)[-+]?\d*\.(\d*)" % rotary.encode()
            )

    def row(self, line: Line) -> dict[str, float] | None:
        """Words of a motion block; None where the line is something else."""
        columns = self.lexer.motion(line)
        return None if columns is None else values(columns)

    def words(self, line: Line, state: State) -> None:
        """Interpret a line that is no motion block."""
        raise NotImplementedError

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
