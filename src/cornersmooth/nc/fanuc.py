"""FANUC: lines with tool vectors under tool centre point control, or the dual-curve form of G6.2.

Sources: Series 15i programming manual B-63324EN/03 4.17 (NURBS interpolation), G43.5 as in A-79348E (tool centre point
control type 2: I J K is the tool direction in the programming frame).
"""

from __future__ import annotations

from dataclasses import replace

from cornersmooth.model import FeedMode, Program, Units
from cornersmooth.nc.control import Form, Words
from cornersmooth.nc.statements import StatementWriter

DECIMALS: dict[Units, int] = {"mm": 4, "inch": 5}

G1 = Form(
    control="fanuc",
    name="g1",
    curves=False,
    coordinate_words=(b"X", b"Y", b"Z"),
    other_words=(b"I", b"J", b"K"),
    vectors=True,
    tip_decimals=DECIMALS,
    circles=True,
)
G62 = Form(
    control="fanuc",
    name="g6.2",
    curves=True,
    coordinate_words=(b"X", b"Y", b"Z"),
    other_words=(b"U", b"V", b"W"),
    vectors=False,
    tip_decimals=DECIMALS,
)


_WORDS = Words(
    tool_change=("T{tool} M6",),
    tool_select=("T{tool}",),
    tip_control_on=("G43.5 H{offset}",),
    tip_control_off=("G49",),
    spindle_speed=("S{speed} {direction}",),
    spindle_on={"clockwise": "M3", "counterclockwise": "M4"},
    spindle_off=("M5",),
    spindle_orient=("M19",),
    coolant={"ON": ("M8",), "FLOOD": ("M8",), "MIST": ("M7",), "OFF": ("M9",)},
    dwell=("G4 P{milliseconds}",),
    stop=("M0",),
    optional_stop=("M1",),
    compensation_left=("G41 D{register}",),
    compensation_right=("G42 D{register}",),
    compensation_off=("G40",),
    plane={17: "G17", 18: "G18", 19: "G19"},
    feed_mode={FeedMode.PER_MINUTE: "G94", FeedMode.PER_REVOLUTION: "G95"},
)


def words(form: Form) -> Words:
    """Words of this control in one of its forms."""
    return _WORDS if form.vectors else replace(_WORDS, tip_control_on=("G43 H{offset}",))


def head(program: Program) -> list[str]:
    """Blocks before everything else."""
    return ["%", "O0001", f"{'G20' if program.units == 'inch' else 'G21'} G90 G94 G17 G40 G49 G80"]


def tail(statements: StatementWriter) -> list[str]:
    """Blocks behind everything else."""
    return [*statements.end_motion(), "M30", "%"]
