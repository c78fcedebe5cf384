"""Cutter compensation that a CL file asks for: CUTCOM."""

from __future__ import annotations

import math
from typing import Final

from cornersmooth.model import Program, Statement
from cornersmooth.nc.control import Blocks
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings, refused
from cornersmooth.nc.modals import Modals
from cornersmooth.nc.statement_args import numbers_of, whole_number, words_of

_PLANES: Final = {"XYPLAN": 17, "ZXPLAN": 18, "YZPLAN": 19}  #: words for planes, with the G code of each


def begin_compensation(
    statement: Statement, form: Form, program: Program, modals: Modals, findings: Findings, *, diameter: float
) -> tuple[int, Blocks] | None:
    """Plane (17, 18 or 19) and blocks of CUTCOM/LEFT|RIGHT[,plane][,n]; None where it is not understood.

    `diameter` of the tool in mm, 0 where it is not known. Raises CS336 for a control that is given none, CS344 where
    the first move has no way in the plane.
    """
    names, numbers, words = words_of(statement), numbers_of(statement), form.table.words
    if not words.compensation_left and names[:1] in (["LEFT"], ["RIGHT"]):
        raise refused("CS336", program, statement.line, control=form.control)
    side = {"LEFT": words.compensation_left, "RIGHT": words.compensation_right}.get((names or [""])[0])
    register = whole_number(numbers or [float(modals.offset)])
    if not side or len(names) > 2 or not set(names[1:]) <= _PLANES.keys() or register is None:
        return None
    if words.compensation_entry:
        _check_entry(statement, program, findings, diameter)
    tip = modals.mode is not form.upright and form.orientation not in ("fixed", "machine")
    also = "it may be used with tool tip control (--cycles native does without, along Z), and that " if tip else ""
    findings.note("CS319", statement.line, also=also)
    plane = _PLANES[names[1]] if len(names) > 1 else 17
    return plane, tuple(block.format(register=register) for block in side)


def _check_entry(statement: Statement, program: Program, findings: Findings, diameter: float) -> None:
    """Refuse a first move that is too short for cutter compensation to begin on, where the control does."""
    pose, tip = statement.pose, program.tip
    if not 0 < pose < len(tip):
        return
    length = math.hypot(*(tip[pose] - tip[pose - 1])[:2])
    if not length > 0.0:
        raise refused("CS344", program, statement.line)
    if length <= diameter / 2.0:
        findings.note("CS345", statement.line, length=length)
