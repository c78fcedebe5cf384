"""How far the linear axes of a machine go, and which positions lie beyond."""

from __future__ import annotations

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.kinematics.dynamics import LINEAR
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.position import machine_position
from cornersmooth.model import Floats, Ints

#: mm beyond the travel that are rounding
_ROUNDING = 1e-6


def nose_position(machine: Machine, tip: Floats, angles: Floats) -> Floats:
    """Where the linear axes stand, (n, 3) mm: the spindle nose with the heads at zero, as the points of the tables.

    Tips are (n, 3) mm in part coordinates, angles (n, 2) degrees. A control under tool tip control moves its axes there
    although the words are the tip.
    """
    return machine_position(machine, tip, angles) + machine.part_zero + machine.tool_length * machine.tool


def check_travel(machine: Machine, tip: Floats, angles: Floats, line: Ints, file: str | None = None) -> None:
    """Refuse positions that the linear axes cannot reach (CS374): tips (n, 3) mm in the part, angles (n, 2) degrees.

    Source lines (n,) are 0 for none.
    """
    if not machine.travel or not len(tip):
        return
    position = nose_position(machine, tip, angles)
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    for item in machine.travel:
        low[LINEAR.index(item.name)], high[LINEAR.index(item.name)] = item.low, item.high
    beyond = np.maximum(low - position, position - high)
    rows = np.flatnonzero((beyond > _ROUNDING).any(axis=1))
    if not len(rows):
        return
    row = int(rows[0])
    axis = int(np.argmax(beyond[row]))
    end = low[axis] if position[row, axis] < low[axis] else high[axis]
    farthest = beyond[rows].max()
    raise InputError(
        "CS374",
        f"{LINEAR[axis]} of {machine.name} would have to go to {position[row, axis]:.3f} mm, its travel ends at "
        f"{end:g} mm; {len(rows):,} positions lie up to {farthest:.3f} mm beyond",
        "move the part (part_zero in the machine file), or see that tool_length and travel are right",
        file=file,
        line=int(line[row]) or None,
    )
