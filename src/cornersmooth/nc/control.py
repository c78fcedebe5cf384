"""Words, digits and blocks of a control: what its table says, record by record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from cornersmooth.model import Units

Blocks = tuple[str, ...]

#: what stands beside the tip in a motion block: the tool vector, a second point on the tool axis, the words of two
#: rotary axes with the tip (tool tip control) or with the linear axes of the machine, or nothing
Orientation = Literal["vector", "point", "angles", "machine", "fixed"]

#: how curves are written; empty for lines
CurveStyle = Literal["", "g6.2", "bspline", "poly", "spl"]

#: feed modes of the words: those of `model.FeedMode`, and inverse time
INVERSE_TIME = 2


@dataclass(frozen=True)
class Words:
    """Blocks by which a control is told what is not motion; an empty field is not translated.

    Parameters
    ----------
    tool_change, tool_select : tuple of str
        With ``{tool}``; the latter only brings the tool near.
    spindle_speed : tuple of str
        With ``{speed}`` and ``{direction}``, one of the next two.
    clockwise, counterclockwise : str
    coolant : mapping
        Blocks by CL word; other words are not translated.
    dwell : tuple of str
        With ``{milliseconds}`` or ``{seconds}``.
    compensation_left, compensation_right : tuple of str
        Cutter compensation, with ``{register}``.
    plane : mapping
        Block for the planes 17 (XY), 18 (ZX) and 19 (YZ).
    feed_mode : mapping
        Block for `FeedMode` and `INVERSE_TIME`.
    """

    tool_change: Blocks = ()
    tool_select: Blocks = ()
    spindle_speed: Blocks = ()
    clockwise: str = "M3"
    counterclockwise: str = "M4"
    spindle_off: Blocks = ()
    spindle_orient: Blocks = ()
    coolant: Mapping[str, Blocks] = field(default_factory=dict)
    dwell: Blocks = ()
    stop: Blocks = ()
    optional_stop: Blocks = ()
    compensation_left: Blocks = ()
    compensation_right: Blocks = ()
    compensation_off: Blocks = ()
    plane: Mapping[int, str] = field(default_factory=dict)
    feed_mode: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Motion:
    """How motion blocks look.

    Parameters
    ----------
    rapid, line, clockwise, counterclockwise : str
        What blocks begin with.
    rapid_end : str
        What rapids end with.
    coordinates : tuple of str
        Addresses of X, Y and Z.
    radius, feed : str
        Addresses.
    feed_point : bool
        Whether a whole feed is written with a point.
    signs : bool
        Whether numbers that are not negative have a plus.
    spaces, leading_zeros, trailing_zeros : bool
        Whether words stand apart; ``0.5`` rather than ``.5``; ``2.5000`` rather than ``2.5``.
    inch_feed : int
        What one inch per minute is written as: 10 where F counts tenths.
    """

    rapid: str = "G0"
    line: str = "G1"
    clockwise: str = "G2"
    counterclockwise: str = "G3"
    rapid_end: str = ""
    coordinates: tuple[str, ...] = ("X", "Y", "Z")
    radius: str = "R"
    feed: str = "F"
    feed_point: bool = True
    signs: bool = False
    spaces: bool = True
    leading_zeros: bool = True
    trailing_zeros: bool = True
    inch_feed: int = 1


@dataclass(frozen=True)
class Digits:
    """Digits after the point; `mm` and `inch` for lengths, `feed`, `speed` and `coefficient` at most."""

    mm: int = 4
    inch: int = 5
    vector: int = 7
    angle: int = 5
    feed: int = 4
    weight: int = 3
    coefficient: int = 7
    speed: int = 0


@dataclass(frozen=True)
class Mode:
    """One way in which a form can say the orientation.

    Parameters
    ----------
    words : tuple of str
        Addresses of vector or point; rotary addresses come from the machine.
    on, off : tuple of str
        Blocks before the motion and behind it; with ``{offset}``, the length register.
    motion : Motion
    circles : bool
        Whether arcs may be written as circular blocks, without the words of the orientation.
    timed_turns : bool
        Whether blocks in which only rotary axes turn are written with inverse time: F would be degrees per minute.
    """

    words: tuple[str, ...]
    on: Blocks
    off: Blocks
    motion: Motion
    circles: bool
    timed_turns: bool


@dataclass(frozen=True)
class TextStyle:
    """The text around the motion.

    Parameters
    ----------
    program : str
        Name or number of the program.
    program_pattern : str
        Regular expression of the names that the control takes; empty for any.
    head, tail : tuple of str
        Blocks; with ``{program}``, ``{units}`` and, in the head, ``{blend}``, a tenth of ε.
    units : mapping
        What ``{units}`` stands for.
    comment : (str, str)
        What stands before and behind a comment.
    comment_orders : tuple of str
        First words by which a comment would be an order to the control; they get a mark before them.
    block_number : str
        With ``{number}``; empty where blocks have none unless asked for.
    number_start, number_step, number_last : int
        After the last the first follows again; 0 for no last.
    longest_block : int
        Characters that a line may have; 0 for any number.
    continuation : str
        What a line ends with whose block goes on in the next; empty where blocks cannot.
    suffix : str
        What the names of its files end in.
    """

    program: str = "O0001"
    program_pattern: str = ""
    head: Blocks = ()
    tail: Blocks = ()
    units: Mapping[Units, str] = field(default_factory=dict)
    comment: tuple[str, str] = ("(", ")")
    comment_orders: Blocks = ()
    block_number: str = ""
    number_start: int = 10
    number_step: int = 10
    number_last: int = 0
    longest_block: int = 0
    continuation: str = ""
    suffix: str = ".nc"


@dataclass(frozen=True)
class FormTable:
    """A form of a control with all its modes."""

    name: str
    description: str
    curve: CurveStyle
    modes: Mapping[Orientation, Mode]


@dataclass(frozen=True)
class Extra:
    """Blocks that are written when they are asked for by name: a function of the control that not every one has.

    Parameters
    ----------
    name, description : str
    on, off : tuple of str
        Blocks around the motion, with ``{blend}``, a tenth of ε, and ``{turn}``, the degrees that are worth as much at
        the axis point.
    outside : bool
        Whether they stand before tool tip control is switched on and behind its end, or within.
    forms : tuple of str
        Forms that they go with; empty for all.
    """

    name: str = ""
    description: str = ""
    on: Blocks = ()
    off: Blocks = ()
    outside: bool = False
    forms: Blocks = ()


@dataclass(frozen=True)
class LineStyle:
    """What lines suit the control, and how it is to share ε between what is written and what it does by itself.

    Parameters
    ----------
    lines : {"dense", "long"}
    curve_share, line_share, blend_share : float
        Those of `Settings` where lines are long.
    """

    lines: str = "dense"
    curve_share: float = 0.5
    line_share: float = 1.0
    blend_share: float = 0.1


@dataclass(frozen=True)
class Control:
    """A control as its table describes it; the first form is the default.

    Parameters
    ----------
    like : str
        Control that comes with the program and that it is like; empty for none.
    own : bool
        Whether the table is the user's own, whose words may mean what nobody else knows.
    """

    name: str
    description: str
    like: str
    digits: Digits
    layout: TextStyle
    words: Words
    forms: Mapping[str, FormTable]
    extras: Mapping[str, Extra] = field(default_factory=dict)
    lines: LineStyle = LineStyle()
    own: bool = False

    @property
    def dialect(self) -> str:
        """Control that comes with the program and whose words the text has; empty for none."""
        return self.like if self.own else self.name
