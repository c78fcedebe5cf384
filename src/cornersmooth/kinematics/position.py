"""Positions of the linear axes, those beyond their travel, and feed as inverse time."""

from __future__ import annotations

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.kinematics.machine import LINEAR, Machine
from cornersmooth.kinematics.poses import radians, rotate
from cornersmooth.model import Floats, Ints

_ROUNDING = 1e-6  #: mm beyond the travel that are rounding


def machine_position(machine: Machine, tip: Floats, angles: Floats) -> Floats:
    """Words of the linear axes, (n, 3) mm, that bring the tool tip to points of the part at angles (n, 2), degrees.

    They count from the zero of the part, with the length of the tool compensated: with both rotary axes at zero they
    are the tip itself. LinuxCNC's trtfuncs.c computes the same joints (its offsets are the points here).
    """
    turned = tip + machine.part_zero
    for index, axis in enumerate(machine.axes):
        if axis.carrier == "table":
            turned = _about(axis.unit, axis.point, -axis.sign * radians(angles[:, index]), turned)
    return turned - machine.part_zero - _swing(machine, angles)


def tip_position(machine: Machine, position: Floats, angles: Floats) -> Floats:
    """Tool tip in part coordinates for words of the linear and rotary axes: the inverse of `machine_position`."""
    turned: Floats = position + machine.part_zero + _swing(machine, angles)
    for index in (1, 0):
        axis = machine.axes[index]
        if axis.carrier == "table":
            turned = _about(axis.unit, axis.point, axis.sign * radians(angles[:, index]), turned)
    return turned - machine.part_zero


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


def inverse_time(length: Floats, feed: Floats, turn: Floats, rotary_feed: float) -> Floats:
    """Feed words of G93, (n,) 1/min: so that the tip runs its way, mm, with its feed, mm/min; infinite for no move.

    `turn` is the larger one of the two rotary axes, degrees, and `rotary_feed`, deg/min, what none of them exceeds: the
    only limit where the tip stands still.
    """
    minutes = np.maximum(length / feed, turn / rotary_feed)
    some = minutes > 0
    return np.where(some, 1 / np.where(some, minutes, 1.0), np.inf)


def _swing(machine: Machine, angles: Floats) -> Floats:
    """Way of the tip when the heads turn and the linear axes stand: (n, 3) mm."""
    tip = np.zeros((len(angles), 3))
    for index in (1, 0):
        axis = machine.axes[index]
        if axis.carrier == "head":
            point = machine.tool_length * machine.tool + np.array(axis.point)
            tip = _about(axis.unit, point, axis.sign * radians(angles[:, index]), tip)
    return tip


def _about(direction: Floats, point: Floats | tuple[float, float, float], angle: Floats, points: Floats) -> Floats:
    centre = np.asarray(point)
    return centre + rotate(direction, angle, points - centre)
