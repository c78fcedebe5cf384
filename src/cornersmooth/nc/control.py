"""Words, digits and blocks of a control: what its table says, record by record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Literal, get_args

from cornersmooth.errors import SettingsError
from cornersmooth.model import FeedMode, Units
from cornersmooth.settings import BOUNDS, Lines
from cornersmooth.tables import Bound, Pattern

Blocks = tuple[str, ...]  #: lines of a program, with places in braces
#: what stands beside the tip in a motion block: the tool vector, a second point on the tool axis, the words of two
#: rotary axes with the tip (tool tip control) or with the linear axes of the machine, or nothing
Orientation = Literal["vector", "point", "angles", "machine", "fixed"]
LINE_ENDS: Mapping[str, bytes] = {"lf": b"\n", "crlf": b"\r\n"}  #: what lines may end with
CurveStyle = Literal["", "g6.2", "bspline", "poly", "spl"]  #: how curves are written; empty for lines
INVERSE_TIME = 2  #: feed modes of the words: those of `model.FeedMode`, and inverse time
INVERSE_TIME_DECIMALS = 3  #: decimals of F of inverse time: FANUC takes 0.001 to 9999.999
_FEED_MODES = {
    "per_minute": int(FeedMode.PER_MINUTE),
    "per_revolution": int(FeedMode.PER_REVOLUTION),
    "inverse_time": INVERSE_TIME,
}
Decimals = Annotated[int, Bound(high=9)]
Share = Annotated[float, Bound(math.ulp(0.0), 1.0, "give a part of 1")]


@dataclass(frozen=True)
class ProgramTable:
    """The blocks around the motion, in the order in which they are written.

    An item that is nothing but a name in braces is a step (`STEPS`); all others are blocks, with ``{program}``,
    ``{units}`` and ``{blend}``, a tenth of ε.
    """

    name: str = "O0001"  #: name or number of the program where neither the user nor the name of the CL file gives one
    #: the same from the name of the CL file, with ``{stem}``, its letters and digits in capitals with underscores
    #: between, or ``{number}``, the digits that it ends in, four at least; empty where `name` is for all files
    file_name: str = ""
    name_pattern: Pattern = ""  #: regular expression of the names that the control takes; empty for any
    work_offset: str = ""  #: what ``{work_offset}`` stands for where the user gives nothing
    work_offset_pattern: Pattern = ""  #: regular expression of what it may be
    work_offset_block: Blocks = ()  #: with ``{work_offset}``
    #: blocks that bring the tool to a height that clears everything; none where the control gets nothing
    retract: Blocks = ()
    #: block with ``{position}``, words of a position of the machine; empty where the control has no such
    position: str = ""
    start: Blocks = ("{header}",)  #: before everything else
    begin: Blocks = ("{tip_control_on}",)  #: before the first motion of each tool, and after a retract
    tool_end: Blocks = ("{tip_control_off}",)  #: after the last motion of each tool
    #: behind `tool_end`, before another tool than the first, where the CL file does not stop there anyway
    between_tools: Blocks = ()
    end: Blocks = ("{footer}",)  #: after everything else, `tool_end` included


#: steps that `ProgramTable` may name; what is off already, or not chosen, is no block
STEPS = {
    "retract": "the blocks of `retract`, where the tool is not there yet",
    "work_offset": "the block of the work offset",
    "rotary_zero": "both rotary axes to zero, with a machine only",
    "rotary_start": "both rotary axes to the angles of the first motion, with a machine only",
    "plane_reset": "a tilted plane that another program has left, off; where such planes are asked for",
    "tip_control_on": "functions that stand outside, tool tip control or the length of the tool, functions within",
    "functions_off": "functions within tool tip control off",
    "tip_control_off": "tool tip control or the length of the tool off, then functions that stand outside",
    "kinematics_on": "tip control of the kinematics on, by the block that the machine's table has for it",
    "kinematics_off": "the same off",
    "spindle_off": "the spindle, where it turns",
    "coolant_off": "the coolant, where it flows",
    "header": "the user's lines of --header",
    "footer": "the user's lines of --footer",
}


@dataclass(frozen=True)
class Words:
    """Blocks of what is not motion; an empty field is not translated."""

    #: tool_change, tool_select: with ``{tool}``; the latter only brings the tool near. The former may have ``{speed}``,
    #: the first of the tool.
    tool_change: Blocks = ()
    tool_select: Blocks = ()
    #: whether `tool_select` brings the tool of the next change near after each change, where the CL file says none
    stage_tool: bool = False
    spindle_speed: Blocks = ()  #: with ``{speed}`` and ``{direction}``, one of the next two
    clockwise: str = "M3"
    counterclockwise: str = "M4"
    speed_without_tip_control: bool = False  #: whether tool tip control must be off where a speed is given
    spindle_off: Blocks = ()
    spindle_orient: Blocks = ()
    coolant: Mapping[str, Blocks] = field(default_factory=dict)  #: blocks by CL word; other words are not translated
    #: blocks that switch off, by CL word, what ``coolant.OFF`` leaves on
    coolant_off: Mapping[str, Blocks] = field(default_factory=dict)
    dwell: Blocks = ()  #: with ``{milliseconds}`` or ``{seconds}``
    #: what makes a dwell count revolutions of the spindle under feed per revolution; empty for nothing
    dwell_turns: str = ""
    stop: Blocks = ()
    optional_stop: Blocks = ()
    #: compensation_left, compensation_right: cutter compensation, with ``{register}``
    compensation_left: Blocks = ()
    compensation_right: Blocks = ()
    compensation_off: Blocks = ()
    #: whether the first move under it must go some way in the plane
    compensation_entry: bool = False
    #: block for the planes 17 (XY), 18 (ZX) and 19 (YZ)
    plane: Annotated[Mapping[int, str], {"xy": 17, "zx": 18, "yz": 19}] = field(default_factory=dict)
    #: block for `FeedMode` and `INVERSE_TIME`
    feed_mode: Annotated[Mapping[int, str], _FEED_MODES] = field(default_factory=dict)


@dataclass(frozen=True)
class Motion:
    """How motion blocks look."""

    #: rapid, line, clockwise, counterclockwise: what blocks begin with
    rapid: str = "G0"
    line: str = "G1"
    clockwise: str = "G2"
    counterclockwise: str = "G3"
    rapid_end: str = ""  #: what rapids end with
    coordinates: tuple[str, ...] = ("X", "Y", "Z")  #: addresses of X, Y and Z
    #: radius, feed: addresses
    radius: str = "R"
    #: what says after the radius of a circular block that it goes clockwise, and counterclockwise. Such blocks have X
    #: and Y alone: arcs in the plane XY at one height. Empty where the code says it, in blocks of X, Y and Z.
    arc_directions: tuple[str, ...] = ()
    feed: str = "F"
    feed_point: bool = True  #: whether a whole feed is written with a point
    signs: bool = False  #: whether numbers that are not negative have a plus
    #: spaces, leading_zeros, trailing_zeros: whether words stand apart; ``0.5`` rather than ``.5``; ``2.5000`` rather
    #: than ``2.5``
    spaces: bool = True
    leading_zeros: bool = True
    trailing_zeros: bool = True
    #: whether a program without a feed before its first feed move, or with one per revolution and no spindle speed, is
    #: refused by the control before it runs
    feed_needed: bool = False
    #: whether words of endless rotary axes beyond 0 to 360 degrees are taken on every machine
    endless_words: bool = True
    #: what stands before and after the number of a modulo axis that goes the shorter way; none where the control has no
    #: words for that
    shortest: tuple[str, ...] = ()
    feed_in_plane: bool = False  #: whether F of a circular block that rises counts in the plane of the circle alone
    inch_feed: int = 1  #: what one inch per minute is written as: 10 where F counts tenths
    #: what may be left out where it repeats, as the control keeps it: ``code`` (G0, G1), ``tip`` (each of X Y Z) and
    #: ``axis`` (the tool vector as a whole, each rotary word)
    modal: tuple[str, ...] = ()
    #: 1/min; largest F of inverse time (G93) that the control takes; 0 for none. Such an F has three decimals.
    fastest: float = 9999.999
    largest_feed: float = 0.0  #: mm/min; largest F per minute that the control takes; 0 where its manual names none
    #: block, the last of those that switch the length of the tool on, whose words stand in the first block that moves Z
    #: instead, after the approach: alone it may move the axis. Empty where it never does.
    with_z: str = ""


@dataclass(frozen=True)
class Digits:
    """Digits after the point; `mm` and `inch` for lengths, `feed`, `speed` and `coefficient` at most."""

    mm: Decimals = 4
    inch: Decimals = 5
    vector: Decimals = 7
    angle: Decimals = 5
    feed: Decimals = 4
    weight: Decimals = 3
    coefficient: Decimals = 7
    speed: Decimals = 0
    most: Decimals = 6  #: digits of a length in mm that the control takes
    #: length of written tool vectors. Only their direction counts; where the control rounds their words as it rounds
    #: lengths, a longer one keeps more of it.
    vector_length: Annotated[int, Bound(1)] = 1
    #: mm; distance from the tip at which a second point is written at least. Curves are the same whatever it is, as
    #: only the direction counts; the farther the point, the less its rounded digits turn the tool.
    lever: int = 100


@dataclass(frozen=True)
class Mode(Motion):
    """One way in which a form can say the orientation, with the motion of the control where it says nothing else."""

    words: tuple[str, ...] = ()  #: addresses of vector or point; rotary addresses come from the machine
    #: on, off: blocks before the motion and after it; with ``{offset}``, the length register
    on: Blocks = ()
    off: Blocks = ()
    circles: bool = False  #: whether arcs may be written as circular blocks, without the words of the orientation
    circles_in_xy: bool = False  #: whether only those of G17 may: the length of the tool acts across the plane
    #: whether tables that would tilt their plane must stand at zero, where tip control began
    circles_at_zero: bool = False
    #: whether blocks in which only rotary axes turn are written with inverse time: F would be degrees per minute
    timed_turns: bool = False
    #: within_on, within_off: blocks that stand within these: the latter before the retract
    within_on: Blocks = ()
    within_off: Blocks = ()
    begin: Blocks | None = None  #: in place of `ProgramTable.begin`
    tool_end: Blocks | None = None  #: in place of `ProgramTable.tool_end`
    #: of a tilted plane: the axes of its three rotations, each that of the frame which those before it have made, as in
    #: ``zxz``; their degrees stand for ``{first}``, ``{second}`` and ``{third}`` in `on`. Empty where the rotary axes
    #: are turned by words (``{rotary_start}``), and the part with them.
    rotations: str = ""
    #: of a tilted plane: blocks at the start of the program that end one which another program has left
    reset: Blocks = ()


@dataclass(frozen=True)
class TextStyle:
    """How lines look."""

    units: Mapping[Units, str] = field(default_factory=lambda: {"mm": "", "inch": ""})  #: what ``{units}`` stands for
    #: what stands before and after a comment
    comment: Annotated[tuple[str, str], "give what stands before and behind"] = ("(", ")")
    #: first words by which a comment would be an order to the control; they get a mark before them
    comment_orders: Blocks = ()
    block_number: str = ""  #: with ``{number}``; empty where blocks have none unless wanted
    unnumbered: Pattern = ""  #: regular expression of what begins a line without number besides ``%``; empty for none
    #: number_start, number_step, number_last: after the last the first follows again; 0 for no last
    number_start: int = 10
    number_step: int = 10
    number_last: int = 0
    longest_block: int = 0  #: characters that a line may have; 0 for any number
    continuation: str = ""  #: what a line ends with whose block goes on in the next; empty where blocks cannot
    line_ends: Literal["lf", "crlf"] = "lf"  #: what the lines of its files end with, where the user says nothing
    suffix: str = ".nc"  #: what the names of its files end in


@dataclass(frozen=True)
class FormTable:
    """A form of a control with all its modes.

    `upright` is how a tool runs that stays along Z from its change to the next, where its holes are cycles of the
    control: without tool tip control, under which controls take no such cycles. `plane` is how a tool with one tilted
    axis runs in a tilted plane of the control. None where that cannot be.
    """

    name: str
    curve: CurveStyle = ""
    description: str = ""
    vector: Mode | None = None
    point: Mode | None = None
    angles: Mode | None = None
    machine: Mode | None = None
    fixed: Mode | None = None
    upright: Mode | None = None
    plane: Mode | None = None

    @cached_property
    def modes(self) -> Mapping[Orientation, Mode]:
        """The modes that say the orientation, by its name."""
        return {name: mode for name in get_args(Orientation) if (mode := getattr(self, name)) is not None}


@dataclass(frozen=True)
class Cycles:
    """Hole cycles of the control, for a tool along Z; what is empty is written as plain moves.

    Blocks have, in braces: ``x`` and ``y``; the heights ``travel`` (from hole to hole), ``top``, ``clearance`` (where
    feeding begins) and ``bottom``; above the top ``setup`` (of the clearance) and ``above`` (of the travel), below it
    ``depth``; ``step`` of a peck; ``feed``; ``milliseconds`` and ``seconds`` of a dwell; of a tap ``pitch`` and
    ``speed``. They are written for each hole, but those before the first with ``{x}`` only where they change.
    """

    #: drill, dwell: in one feed, without and with a dwell at the bottom
    drill: Blocks = ()
    dwell: Blocks = ()
    #: peck, chip: in steps, out of the hole after each, or up a little to break the chip
    peck: Blocks = ()
    chip: Blocks = ()
    #: ream, ream_dwell: out of the hole at feed
    ream: Blocks = ()
    ream_dwell: Blocks = ()
    tap: Blocks = ()  #: A right-hand thread
    off: Blocks = ()  #: ends the cycle
    per_minute: bool = False  #: whether their feeds are per minute in millimetres only


@dataclass(frozen=True)
class Extra:
    """Blocks that are written when they are chosen by name: a function of the control that not every one has."""

    name: str = ""
    description: str = ""
    warning: str = ""  #: shown to the user who asks for it; empty for none
    #: on, off: blocks around the motion, with ``{blend}``, a tenth of ε, and ``{turn}``, the degrees that are worth as
    #: much at the axis point
    on: Blocks = ()
    off: Blocks = ()
    outside: bool = False  #: whether they stand before tool tip control is switched on and after its end, or within
    forms: Blocks = ()  #: forms that they go with; empty for all


@dataclass(frozen=True)
class LineStyle:
    """What lines suit the control, and how it is to share ε between what is written and what it does by itself."""

    lines: Lines = "dense"
    #: curve_share, line_share, blend_share: those of `Settings` where lines are long
    curve_share: Share = 0.5
    line_share: Share = 1.0
    blend_share: Share = 0.1
    #: by how many times ε the axis point may lag behind the tip where the control rounds corners of lines by itself, as
    #: `cornersmooth.smoothing.long_lines.lags` estimates it; 0 where it does no such thing
    lag: Annotated[float, Bound(0.0, 100.0, "give a number up to 100")] = 0.0
    #: block that says with ``{blend}`` how far the control may round the corners of lines from the next line on, where
    #: it may stand between any two lines; empty for none. Then every corner gets what
    #: `cornersmooth.smoothing.blending.largest_blends` finds, up to ε.
    rounding: str = ""
    #: part of ε that is left to what the control executes at those corners, by that estimate
    executed_share: Share = 0.85
    #: law by which the control plans lines, where it is not that of `cornersmooth.feedrate`: "linuxcnc-2.9"
    planner: Literal["", "linuxcnc-2.9"] = ""
    #: s; `Settings.block_time`. By default that of Haas, whose makers state it.
    block_time: Annotated[float, Bound(0.0, BOUNDS["block_time"][1], "give seconds, up to 1")] = 0.001


@dataclass(frozen=True)
class Control:
    """A control as its table describes it; the first form is the default."""

    name: str
    forms: Mapping[str, FormTable]
    description: str = ""
    like: str = ""  #: control that comes with the program and that it is like; empty for none
    digits: Digits = Digits()
    program: ProgramTable = field(default_factory=ProgramTable)
    layout: TextStyle = TextStyle()
    words: Words = Words()
    extras: Mapping[str, Extra] = field(default_factory=dict)
    lines: LineStyle = LineStyle()
    cycles: Cycles = Cycles()
    #: digits to choose from by name, such as increment systems
    systems: Mapping[str, Digits] = field(default_factory=dict)
    own: bool = False  #: whether the table is the user's own, whose words may mean anything
    #: machine functions of the shop that move nothing: verification accepts them where the table or the user writes
    #: them
    trusted: frozenset[str] = frozenset()

    @property
    def dialect(self) -> str:
        """Control that comes with the program and whose words the text has; empty for none."""
        return self.like if self.own else self.name

    def with_digits(self, choice: str) -> Control:
        """Return the control with other digits: one of `systems` by name, or a number of decimals of lengths in mm.

        Those in inches have one more. CS228: neither, or more than the control takes.
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
