"""The block that leads a tilted tool from the height of the retract to its first position.

Tool tip control is on, and X Y Z stand in one block. X Y alone would be a motion in the plane of the part, which tables
have tilted: the axes would go far aside, or down. A tool along Z goes over its position first: there both planes are
one.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine, check_travel, solutions
from cornersmooth.kinematics.position import nose_position
from cornersmooth.model import Floats
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.planes import turned_part

#: cosine of the angle from Z beyond which a tool is tilted
UPRIGHT: Final = 1.0 - 1e-6

#: places on the way that are looked at
_PLACES: Final = np.linspace(0.0, 1.0, 65)

#: Where X Y stand before, the program does not always say: as far aside as the tool is above, at most, is a fair guess.
_FLAT: Final = math.cos(math.radians(45.0))

#: mm by which the start may be below the position: digits
_BELOW: Final = 1e-3


def check_first_block(
    form: Form,
    machine: Machine | None,
    tip: Floats,
    axis: Floats,
    angles: Floats | None,
    place: Floats | None,
    where: tuple[str | None, int],
    findings: Findings,
) -> None:
    """Refuse the first block of a tool, or warn of it; `where` is file and line of its CL statement.

    It ends with the tip (3,), mm, and the tool axis (3,) in the part and the rotary words (2,), degrees, if there are
    any. `place` (2,) mm is where X and Y of the spindle nose stand before, if known; the machine has the length of the
    tool. CS374: it leaves the travel from wherever it starts. CS391: whether it stays within the travel depends on that
    place. CS392: it comes from below its end; tables and fixtures are below the part, and turned beside the tool.
    """
    before = angles
    if machine is not None and angles is not None and "{rotary_zero}" in form.begin:
        before = np.clip(0.0, *machine.limits.T)
    places = np.zeros((0, 3)) if machine is None or before is None else _starts(machine, tip, before, place)
    if machine is None or before is None or angles is None or not len(places):
        if _rise(machine, axis, before) < _FLAT:
            findings.note("CS392", where[1])
        return
    turned = before + _PLACES[:, None] * (angles - before)
    frame = turned_part(machine, before)
    zero = nose_position(machine, np.zeros((1, 3)), before[None])[0]
    tips = [frame @ (start - zero) for start in places]
    refused: list[InputError] = []
    for start in tips:
        way = start + _PLACES[:, None] * (tip - start)
        try:
            check_travel(machine, way, turned, np.full(len(way), where[1]), where[0])
        except InputError as error:
            refused.append(error)
    if len(refused) == len(tips):
        what = f"in the first block of a tool, from the height of the retract: {refused[0].what}"
        raise InputError(refused[0].code, what, refused[0].hint, file=where[0], line=where[1])
    if refused:
        findings.note("CS391", where[1])
    if any(start[2] < tip[2] - _BELOW for start in tips):
        findings.note("CS392", where[1])


def _starts(machine: Machine, tip: Floats, before: Floats, place: Floats | None) -> Floats:
    """Where the spindle nose may stand before, (k, 3) mm; none where the machine's file does not say enough."""
    travel = {item.name: (item.low, item.high) for item in machine.travel}
    nowhere = (math.nan, math.nan)
    top = dict(machine.home).get("Z", travel.get("Z", nowhere)[1])
    over = nose_position(machine, tip[None], before[None])[0, :2]
    ends = np.array([(x, y) for x in travel.get("X", nowhere) for y in travel.get("Y", nowhere)])
    places = np.vstack((ends, ends.mean(axis=0), over)) if place is None else place[None]
    starts = np.column_stack((places, np.full(len(places), top)))
    return starts[~np.isnan(starts).any(axis=1)]


def _rise(machine: Machine | None, axis: Floats, before: Floats | None) -> float:
    """How far the block comes down along Z of the part for each mm of Z of the machine, at the least."""
    if machine is None:
        return float(axis[2])  # tables may have turned the part
    angles = solutions(machine, axis[None]).angles[0] if before is None else before[None]
    return min(float(turned_part(machine, one)[2, 2]) for one in angles)
