"""Cutter compensation that a CL file asks for: CUTCOM."""

from __future__ import annotations

import math
from typing import Final

from cornersmooth.errors import InputError
from cornersmooth.model import Program, Statement
from cornersmooth.nc.control import Blocks
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.operation import Operation
from cornersmooth.nc.statement_args import numbers_of, whole_number, words_of

#: words for planes, with the G code of each
_PLANES: Final = {"XYPLAN": 17, "ZXPLAN": 18, "YZPLAN": 19}


def begin_compensation(
    statement: Statement, form: Form, program: Program, operation: Operation, findings: Findings, *, diameter: float
) -> tuple[int, Blocks] | None:
    """Plane (17, 18 or 19) and blocks of CUTCOM/LEFT|RIGHT[,plane][,n]; None where it is not understood.

    `diameter` of the tool in mm, 0 where it is not known. Raises CS336 for a control that is given none, CS344 where
    the first move has no way in the plane.
    """
    names, numbers, words = words_of(statement), numbers_of(statement), form.table.words
    if not words.compensation_left and names[:1] in (["LEFT"], ["RIGHT"]):
        raise InputError(
            "CS336",
            f"{form.control} is given no cutter compensation, and the path would be cut without it",
            "let the CAM system put the cutter's radius into the path",
            file=program.source.name,
            line=statement.line,
        )
    side = {"LEFT": words.compensation_left, "RIGHT": words.compensation_right}.get((names or [""])[0])
    register = whole_number(numbers or [float(operation.offset)])
    if not side or len(names) > 2 or not set(names[1:]) <= _PLANES.keys() or register is None:
        return None
    if words.compensation_entry:
        _check_entry(statement, program, findings, diameter)
    tip = operation.mode is not form.upright and form.orientation not in ("fixed", "machine")
    where = "it may be used with tool tip control (--cycles native does without, along Z), and that " if tip else ""
    findings.add(
        "CS319",
        "warning",
        statement.line,
        "cutter compensation is left to the control, which offsets the path in the plane and not along the tool; "
        f"see that {where}the register holds what the CAM system meant",
    )
    plane = _PLANES[names[1]] if len(names) > 1 else 17
    return plane, tuple(block.format(register=register) for block in side)


def _check_entry(statement: Statement, program: Program, findings: Findings, diameter: float) -> None:
    """Refuse a first move that is too short for cutter compensation to begin on, where the control does."""
    pose, tip = statement.pose, program.tip
    if not 0 < pose < len(tip):
        return
    length = math.hypot(*(tip[pose] - tip[pose - 1])[:2])
    if not length > 0.0:
        raise InputError(
            "CS344",
            "cutter compensation begins on a move without any way in the plane, which the control refuses",
            "let the CAM system lead in on a line, or put the cutter's radius into the path",
            file=program.source.name,
            line=statement.line,
        )
    if length <= diameter / 2.0:
        text = (
            f"cutter compensation begins on a move of {length:g} mm in the plane: the control refuses it where the "
            "register holds the whole radius of the tool"
        )
        findings.add("CS345", "warning", statement.line, text)
