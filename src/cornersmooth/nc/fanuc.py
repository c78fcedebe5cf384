"""FANUC: lines with tool vectors under tool centre point control, or the dual-curve form of G6.2.

Sources: Series 15i programming manual B-63324EN/03 4.17 (NURBS interpolation), G43.5 as in A-79348E (tool centre point
control type 2: I J K is the tool direction in the programming frame).
"""

from __future__ import annotations

from cornersmooth.model import Program, Units
from cornersmooth.nc.control import Form
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


def head(program: Program) -> list[str]:
    """Blocks before everything else."""
    return ["%", "O0001", f"{'G20' if program.units == 'inch' else 'G21'} G90 G94 G17 G40 G49 G80"]


def tail(statements: StatementWriter) -> list[str]:
    """Blocks behind everything else."""
    return [*statements.end_motion(), "M30", "%"]


def statement_writer(form: Form) -> StatementWriter:
    """Translation of statements for this control."""
    return StatementWriter(tool_words=("G49", "G43.5 H{tool}" if form.vectors else "G43 H{tool}"))
