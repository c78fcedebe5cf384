"""Positions of the linear axes where the control does not keep the tool tip itself, and feed as inverse time."""

from __future__ import annotations

import numpy as np

from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import radians, rotate
from cornersmooth.model import Floats


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
