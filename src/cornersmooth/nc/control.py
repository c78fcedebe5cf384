"""Words, digits and blocks of a control: what its table says, record by record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

from cornersmooth.errors import SettingsError
from cornersmooth.model import FeedMode, Units
from cornersmooth.nc.program_table import Blocks, ProgramTable
from cornersmooth.settings import BOUNDS, Lines
from cornersmooth.tables import Bound, Pattern

#: what stands beside the tip in a motion block: the tool vector, a second point on the tool axis, the words of two
#: rotary axes with the tip (tool tip control) or with the linear axes of the machine, or nothing
Orientation = Literal["vector", "point", "angles", "machine", "fixed"]

#: what lines may end with
LINE_ENDS: Mapping[str, bytes] = {"lf": b"\n", "crlf": b"\r\n"}

#: how curves are written; empty for lines
CurveStyle = Literal["", "g6.2", "bspline", "poly", "spl"]

#: feed modes of the words: those of `model.FeedMode`, and inverse time
INVERSE_TIME = 2

_FEED_MODES = {
    "per_minute": int(FeedMode.PER_MINUTE),
    "per_revolution": int(FeedMode.PER_REVOLUTION),
    "inverse_time": INVERSE_TIME,
}

Decimals = Annotated[int, Bound(high=9)]
Share = Annotated[float, Bound(math.ulp(0.0), 1.0, "give a part of 1")]


@dataclass(frozen=True)
class Words:
    """Blocks by which a control is told what is not motion; an empty field is not translated.

    Parameters
    ----------
    tool_change, tool_select : tuple of str
        With ``{tool}``; the latter only brings the tool near. The former may have ``{speed}``, the first of the tool.
    spindle_speed : tuple of str
        With ``{speed}`` and ``{direction}``, one of the next two.
    speed_without_tip_control : bool
        Whether tool tip control must be off where a speed is given.
    coolant : mapping
        Blocks by CL word; other words are not translated.
    coolant_off : mapping
        Blocks that switch off, by CL word, what ``coolant.OFF`` leaves on.
    dwell : tuple of str
        With ``{milliseconds}`` or ``{seconds}``.
    dwell_turns : str
        What makes a dwell count revolutions of the spindle under feed per revolution; empty for nothing.
    compensation_left, compensation_right : tuple of str
        Cutter compensation, with ``{register}``.
    compensation_entry : bool
        Whether the first move under it must go some way in the plane, more than what the register holds.
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
    speed_without_tip_control: bool = False
    spindle_off: Blocks = ()
    spindle_orient: Blocks = ()
    coolant: Mapping[str, Blocks] = field(default_factory=dict)
    coolant_off: Mapping[str, Blocks] = field(default_factory=dict)
    dwell: Blocks = ()
    dwell_turns: str = ""
    stop: Blocks = ()
    optional_stop: Blocks = ()
    compensation_left: Blocks = ()
    compensation_right: Blocks = ()
    compensation_off: Blocks = ()
    compensation_entry: bool = False
    plane: Annotated[Mapping[int, str], {"xy": 17, "zx": 18, "yz": 19}] = field(default_factory=dict)
    feed_mode: Annotated[Mapping[int, str], _FEED_MODES] = field(default_factory=dict)


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
    arc_directions : tuple of str
        What says after the radius of a circular block that it goes clockwise, and counterclockwise. Such blocks have X
        and Y alone: arcs in the plane XY at one height. Empty where the code says it, in blocks of X, Y and Z.
    feed_point : bool
        Whether a whole feed is written with a point.
    signs : bool
        Whether numbers that are not negative have a plus.
    spaces, leading_zeros, trailing_zeros : bool
        Whether words stand apart; ``0.5`` rather than ``.5``; ``2.5000`` rather than ``2.5``.
    feed_needed : bool
        Whether a program without a feed before its first feed move, or with one per revolution and no spindle speed, is
        refused by the control before it runs.
    endless_words : bool
        Whether words of endless rotary axes beyond 0 to 360 degrees are taken on every machine.
    shortest : tuple of str
        What stands before and after the number of a modulo axis that goes the shorter way; none where the control has
        no words for that.
    inch_feed : int
        What one inch per minute is written as: 10 where F counts tenths.
    modal : tuple of str
        What may be left out where it repeats, as the control keeps it: ``code`` (G0, G1), ``tip`` (each of X Y Z) and
        ``axis`` (the tool vector as a whole, each rotary word).
    fastest : float, 1/min
        Largest F of inverse time (G93) that the control takes; 0 for none. Such an F has three decimals.
    largest_feed : float, mm/min
        Largest F per minute that the control takes; 0 where its manual names none.
    with_z : str
        Block, the last of those that switch the length of the tool on, whose words stand in the first block that moves
        Z instead, after the approach: alone it may move the axis. Empty where it never does.
    """

    rapid: str = "G0"
    line: str = "G1"
    clockwise: str = "G2"
    counterclockwise: str = "G3"
    rapid_end: str = ""
    coordinates: tuple[str, ...] = ("X", "Y", "Z")
    radius: str = "R"
    arc_directions: tuple[str, ...] = ()
    feed: str = "F"
    feed_point: bool = True
    signs: bool = False
    spaces: bool = True
    leading_zeros: bool = True
    trailing_zeros: bool = True
    feed_needed: bool = False
    endless_words: bool = True
    shortest: tuple[str, ...] = ()
    inch_feed: int = 1
    modal: tuple[str, ...] = ()
    fastest: float = 9999.999
    largest_feed: float = 0.0
    with_z: str = ""


@dataclass(frozen=True)
class Digits:
    """Digits after the point; `mm` and `inch` for lengths, `feed`, `speed` and `coefficient` at most.

    Parameters
    ----------
    most : int
        Digits of a length in mm that the control takes.
    lever : int, mm
        Distance from the tip at which a second point is written at least. Curves are the same whatever it is, as only
        the direction counts; the farther the point, the less its rounded digits turn the tool.
    vector_length : int
        Length of written tool vectors. Only their direction counts; where the control rounds their words as it rounds
        lengths, a longer one keeps more of it.
    """

    mm: Decimals = 4
    inch: Decimals = 5
    vector: Decimals = 7
    angle: Decimals = 5
    feed: Decimals = 4
    weight: Decimals = 3
    coefficient: Decimals = 7
    speed: Decimals = 0
    most: Decimals = 6
    vector_length: Annotated[int, Bound(1)] = 1
    lever: int = 100


@dataclass(frozen=True)
class Mode:
    """One way in which a form can say the orientation.

    Parameters
    ----------
    words : tuple of str
        Addresses of vector or point; rotary addresses come from the machine.
    on, off : tuple of str
        Blocks before the motion and after it; with ``{offset}``, the length register.
    within_on, within_off : tuple of str
        Blocks that stand within these: the latter before the retract.
    begin : tuple of str or None
        In place of `ProgramTable.begin`.
    circles : bool
        Whether arcs may be written as circular blocks, without the words of the orientation.
    timed_turns : bool
        Whether blocks in which only rotary axes turn are written with inverse time: F would be degrees per minute.
    tool_end : tuple of str or None
        In place of `ProgramTable.tool_end`.
    rotations : str
        Of a tilted plane: the axes of its three rotations, each that of the frame which those before it have made, as
        in ``zxz``; their degrees stand for ``{first}``, ``{second}`` and ``{third}`` in `on`. Empty where the rotary
        axes are turned by words (``{rotary_start}``), and the part with them.
    reset : tuple of str
        Of a tilted plane: blocks at the start of the program that end one which another program has left.
    """

    words: tuple[str, ...] = ()
    on: Blocks = ()
    off: Blocks = ()
    motion: Motion = Motion()
    circles: bool = False
    timed_turns: bool = False
    within_on: Blocks = ()
    within_off: Blocks = ()
    begin: Blocks | None = None
    tool_end: Blocks | None = None
    rotations: str = ""
    reset: Blocks = ()


@dataclass(frozen=True)
class TextStyle:
    """How lines look.

    Parameters
    ----------
    units : mapping
        What ``{units}`` stands for.
    comment : (str, str)
        What stands before and after a comment.
    comment_orders : tuple of str
        First words by which a comment would be an order to the control; they get a mark before them.
    block_number : str
        With ``{number}``; empty where blocks have none unless asked for.
    unnumbered : str
        Regular expression of what begins a line without number besides ``%``; empty for none.
    number_start, number_step, number_last : int
        After the last the first follows again; 0 for no last.
    longest_block : int
        Characters that a line may have; 0 for any number.
    continuation : str
        What a line ends with whose block goes on in the next; empty where blocks cannot.
    line_ends : {"lf", "crlf"}
        What the lines of its files end with, where the user says nothing.
    suffix : str
        What the names of its files end in.
    """

    units: Mapping[Units, str] = field(default_factory=lambda: {"mm": "", "inch": ""})
    comment: Annotated[tuple[str, str], "give what stands before and behind"] = ("(", ")")
    comment_orders: Blocks = ()
    block_number: str = ""
    unnumbered: Pattern = ""
    number_start: int = 10
    number_step: int = 10
    number_last: int = 0
    longest_block: int = 0
    continuation: str = ""
    line_ends: Literal["lf", "crlf"] = "lf"
    suffix: str = ".nc"


@dataclass(frozen=True)
class FormTable:
    """A form of a control with all its modes.

    `upright` is how a tool runs that stays along Z from its change to the next, where its holes are cycles of the
    control: without tool tip control, under which controls take no such cycles. `plane` is how a tool with one tilted
    axis runs in a tilted plane of the control. None where that cannot be.
    """

    name: str
    modes: Mapping[Orientation, Mode]
    curve: CurveStyle = ""
    description: str = ""
    upright: Mode | None = None
    plane: Mode | None = None


@dataclass(frozen=True)
class Cycles:
    """Hole cycles of the control, for a tool along Z; what is empty is written as plain moves.

    Blocks have, in braces: ``x`` and ``y``; the heights ``travel`` (from hole to hole), ``top``, ``clearance`` (where
    feeding begins) and ``bottom``; above the top ``setup`` (of the clearance) and ``above`` (of the travel), below it
    ``depth``; ``step`` of a peck; ``feed``; ``milliseconds`` and ``seconds`` of a dwell; of a tap ``pitch`` and
    ``speed``. They are written for each hole, but those before the first with ``{x}`` only where they change.

    Parameters
    ----------
    drill, dwell : tuple of str
        In one feed, without and with a dwell at the bottom.
    peck, chip : tuple of str
        In steps, out of the hole after each, or up a little to break the chip.
    ream, ream_dwell : tuple of str
        Out of the hole at feed.
    tap : tuple of str
        A right-hand thread.
    off : tuple of str
        Ends the cycle.
    per_minute : bool
        Whether their feeds are per minute in millimetres only.
    """

    drill: Blocks = ()
    dwell: Blocks = ()
    peck: Blocks = ()
    chip: Blocks = ()
    ream: Blocks = ()
    ream_dwell: Blocks = ()
    tap: Blocks = ()
    off: Blocks = ()
    per_minute: bool = False


@dataclass(frozen=True)
class Extra:
    """Blocks that are written when they are asked for by name: a function of the control that not every one has.

    Parameters
    ----------
    on, off : tuple of str
        Blocks around the motion, with ``{blend}``, a tenth of ε, and ``{turn}``, the degrees that are worth as much at
        the axis point.
    outside : bool
        Whether they stand before tool tip control is switched on and after its end, or within.
    forms : tuple of str
        Forms that they go with; empty for all.
    warning : str
        Shown to the user who asks for it; empty for none.
    """

    name: str = ""
    description: str = ""
    warning: str = ""
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
    lag : float
        By how many times ε the axis point may lag behind the tip where the control rounds corners of lines by itself,
        as `cornersmooth.smoothing.long_lines.lags` estimates it; 0 where it does no such thing.
    rounding : str
        Block that says with ``{blend}`` how far the control may round the corners of lines from the next line on, where
        it may stand between any two lines; empty for none. Then every corner gets what
        `cornersmooth.smoothing.blending.largest_blends` finds, up to ε.
    executed_share : float
        Part of ε that is left to what the control executes at those corners, by that estimate.
    planner : str
        Law by which the control plans lines, where it is not that of `cornersmooth.feedrate`: "linuxcnc-2.9".
    block_time : float, s
        `Settings.block_time`. By default that of Haas, whose makers state it.
    """

    lines: Lines = "dense"
    curve_share: Share = 0.5
    line_share: Share = 1.0
    blend_share: Share = 0.1
    lag: Annotated[float, Bound(0.0, 100.0, "give a number up to 100")] = 0.0
    rounding: str = ""
    executed_share: Share = 0.85
    planner: Literal["", "linuxcnc-2.9"] = ""
    block_time: Annotated[float, Bound(0.0, BOUNDS["block_time"][1], "give seconds, up to 1")] = 0.001


@dataclass(frozen=True)
class Control:
    """A control as its table describes it; the first form is the default.

    Parameters
    ----------
    like : str
        Control that comes with the program and that it is like; empty for none.
    systems : mapping of str to Digits
        Digits to choose from by name, such as increment systems.
    own : bool
        Whether the table is the user's own, whose words may mean anything.
    trusted : frozenset of str
        Machine functions of the shop that move nothing: verification accepts them where the table or the user writes
        them.
    """

    name: str
    forms: Mapping[str, FormTable]
    description: str = ""
    like: str = ""
    digits: Digits = Digits()
    program: ProgramTable = field(default_factory=ProgramTable)
    layout: TextStyle = TextStyle()
    words: Words = Words()
    extras: Mapping[str, Extra] = field(default_factory=dict)
    lines: LineStyle = LineStyle()
    cycles: Cycles = Cycles()
    systems: Mapping[str, Digits] = field(default_factory=dict)
    own: bool = False
    trusted: frozenset[str] = frozenset()

    @property
    def dialect(self) -> str:
        """Control that comes with the program and whose words the text has; empty for none."""
        return self.like if self.own else self.name

    def with_digits(self, choice: str) -> Control:
        """Return the control with other digits.

        Parameters
        ----------
        choice : str
            Name of one of `systems`, or the number of decimals of lengths in mm; those in inches have one more.

        Raises
        ------
        SettingsError
            CS228: neither, or more than the control takes.
        """
        known = {name.lower(): digits for name, digits in self.systems.items()}
        if choice.lower() in known:
            return replace(self, digits=known[choice.lower()])
        number = int(choice) if choice.isdecimal() and len(choice) < 3 else 0
        if not 1 <= number <= self.digits.most:
            names = ", ".join(self.systems)
            hint = f"use {f'{names}, or ' if names else ''}a number of decimals up to {self.digits.most}"
            raise SettingsError("CS228", f"{self.name} cannot be written with the digits {choice!r}", hint)
        return replace(self, digits=replace(self.digits, mm=number, inch=number + 1))
