"""Readers of cutter location data: APT / CL files of all dialects, and tables of points."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from typing import Final

from cornersmooth.cl.arcs import RULES, ArcRule
from cornersmooth.cl.cycles import order_of
from cornersmooth.cl.dialects import NAMES as DIALECTS
from cornersmooth.cl.dialects import apt_of_simulation_cld, is_simulation_cld, refuse_foreign
from cornersmooth.cl.grammar import joined
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.source import clean, load
from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import Machine
from cornersmooth.model import MM_PER_UNIT, Program, Units
from cornersmooth.statements.asked import Asking, turns

__all__ = ["DIALECTS", "FORMATS", "read"]

FORMATS: Final = ("apt", "points")

#: how much of a file decides on its format
HEAD: Final = 1 << 16

#: the end of an input that is cut short, or of one that ends in a number by chance
_ENDS_IN_A_NUMBER: Final = re.compile(rb"[0-9.][ \t\0]*+\Z")

#: a statement that only a CL file has
_CL_STATEMENT: Final = re.compile(
    rb"^[ \t]*((GOTO|FROM|CIRCLE|FEDRAT|LOADTL|SPINDL|UNITS?|MULTAX|TLDATA|PAINT|MSYS|TOOL PATH|CUTTER|MACHIN)[ \t]*/"
    rb"|PARTNO|PPRINT|REMARK|RAPID|\$\$)",
    re.MULTILINE | re.IGNORECASE,
)


def read(
    source: str | os.PathLike[str] | bytes,
    *,
    name: str | None = None,
    format: str | None = None,
    dialect: str | None = None,
    units: Units | None = None,
    arc_rule: ArcRule | None = None,
    lenient: bool = False,
    tool_number: int | None = None,
    spindle: tuple[float, str] | None = None,
    operation: str | None = None,
    size_limit: bool = True,
    scale: float = 1.0,
    flip_axis: bool = False,
    between_passes: float | None = None,
    cycle_order: str | None = None,
    machine: Machine | None = None,
    processes: int = 1,
) -> Program:
    """Read a tool path.

    Parameters
    ----------
    source : path or bytes
        A file, plain or gzip, or its contents.
    name : str or None
        Name for messages; None for the path as given.
    format : {"apt", "points"} or None
        None recognises it by the contents.
    dialect : str or None
        One of `DIALECTS`; None recognises it.
    units : {"mm", "inch"} or None
        Overrides what the file says.
    arc_rule : {"left", "right", "tangent"} or None
        Sense of rotation of CIRCLE about its normal; None for what the dialect means.
    lenient : bool
        Go on where that is safe, and say so in the findings.
    tool_number : int or None
        Of the tool, for inputs that load none.
    spindle : (float, str) or None
        Revolutions per minute, and ``CLW`` or ``CCLW``, for inputs that start no spindle.
    operation : str or None
        Name or number of the operation to read alone, as `cl.operations` finds them; None for the whole file.
    scale : float
        Of all lengths of a table of points, 1000 for metres.
    flip_axis : bool
        Turn the tool axes of a table round.
    between_passes : float, mm, optional
        How far the tool goes back along its axis between the passes of a table; None feeds straight on.
    cycle_order : str, optional
        Words of `cl.cycles.ORDER` for the numbers without a word of CYCLE, separated by commas.
    machine : Machine, optional
        Whose rotary angles a table has in place of tool axes; the positions are those of the tip on the part.
    size_limit : bool
        Refuse inputs of more than 2 GB, and gzip files that grow 200-fold.
    processes : int
        Processes to read a long CL file with, where the system can fork; the result does not depend on it.

    Returns
    -------
    Program
        Lengths in mm; `Program.findings` says what was assumed.

    Raises
    ------
    InputError
        ``FILE:LINE: error: what; what to do``.
    SettingsError
        CS230 for a format, dialect, unit, rule or word that does not exist, and for a rule of tables and another file;
        CS248 for a tool or a speed that the input has.
    """
    for what, value, choices in (
        ("format", format, FORMATS),
        ("dialect", dialect, DIALECTS),
        ("units", units, tuple(MM_PER_UNIT)),
        ("arc rule", arc_rule, RULES),
    ):
        if value is not None and value not in choices:
            raise SettingsError("CS230", f"unknown {what} {value!r}", f"use one of {', '.join(choices)}")
    tables_only = scale != 1.0 or flip_axis or between_passes is not None
    data, name, digest = load(source, name, size_limit=size_limit)
    if format is None:
        refuse_foreign(data, name)
        from cornersmooth.cl.points import begins_with_names, looks_like_points

        head = data[:HEAD]
        table = begins_with_names(head) or (not _CL_STATEMENT.search(head) and looks_like_points(head))
        format = "points" if table else "apt"
    if format == "points":
        from cornersmooth.cl.points import TableRules, read_points

        rules = TableRules(scale, flip_axis, machine, between_passes)
        program = read_points(data, name=name, units=units, lenient=lenient, rules=rules)
    else:
        from cornersmooth.cl.apt import read_apt

        if tables_only:
            what = "scale, flipped axes and passes are of tables of points, and this is a CL file"
            raise SettingsError("CS230", what, "leave them out", file=name)
        text = clean(data, name)
        if dialect is None and is_simulation_cld(text):
            text, dialect = apt_of_simulation_cld(text, name), "plain"
        program = read_apt(
            text,
            name=name,
            dialect=dialect,
            units=units,
            arc_rule=arc_rule,
            lenient=lenient,
            cycle_order=order_of(cycle_order),
            processes=processes,
        )
    program = replace(program, source=replace(program.source, name=os.path.basename(name), sha256=digest))
    last, behind = int(program.line[-1]), program.statements[-1:]
    if _ENDS_IN_A_NUMBER.search(data, max(0, len(data) - HEAD)) and not any(one.line >= last for one in behind):
        program = replace(program, findings=(*program.findings, finding("CS275", last)))
    if operation is not None or tool_number is not None or spindle is not None:
        from cornersmooth.cl.operations import one_operation, with_tool

        program = program if operation is None else one_operation(program, operation)
        program = with_tool(program, tool_number, spindle)
    _refuse(program, name, lenient)
    return program


def _refuse(program: Program, name: str, lenient: bool) -> None:
    """Refuse what must not be missing from a program in silence: a spindle that is not understood, and turning."""
    unknown = Asking.of(program).not_understood
    turning = next((statement for statement in unknown if turns(statement)), None)
    if turning is not None and not lenient:
        raise error("CS179", name, turning.line, text=turning.text)
    for statement in unknown:
        if statement.word == "SPINDL" and turning is None:
            want = "give revolutions per minute with RPM and CLW or CCLW"
            if {"SFM", "SMM"} & set(statement.args):
                want += "; a cutting speed needs CUTTER with the diameter before it, and is not written for a lathe"
            raise error("CS115", name, statement.line, word="SPINDL", text=joined(statement.args), want=want)
