"""Bounds on how far motions leave their chords: what makes a check at some samples hold between them.

A vector function on [0, 1] with |f″| ≤ M leaves its chord on a stretch of length h by at most M·h²/8. So the difference
of two motions is between N + 1 even samples no larger than at them but for (M₁ + M₂)/(8 N²).
"""

from __future__ import annotations

import numpy as np

from cornersmooth.arrays.vectors import dot, norm
from cornersmooth.kinematics.machine import Machine
from cornersmooth.model import Floats


def axis_bend(machine: Machine, turn: Floats, start: Floats, end: Floats, slack: Floats) -> Floats:
    """Bound (n,) on the second derivative of the tool axis when both rotary axes turn evenly, by `turn` (n, 2) rad.

    Tool axes (n, 3) at both ends may be off by the slack, rad.
    """
    turn = np.abs(turn)
    away = np.minimum(np.maximum(_sine(machine, start), _sine(machine, end)) + slack + turn[:, 1] / 2, 1.0)
    bound: Floats = away * turn[:, 0] ** 2 + 2 * turn[:, 0] * turn[:, 1] + turn[:, 1] ** 2
    return bound


def ruled_bend(start: Floats, end: Floats) -> Floats:
    """Bound (n,) on the second derivative of the direction of points that run evenly from `start` to `end` (n, 3).

    Infinite where the point comes to the origin: the direction jumps there.
    """
    way = end - start
    square = dot(way, way)
    nearest = np.clip(-dot(start, way) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    shortest = np.linalg.norm(start + nearest[:, None] * way, axis=1)
    moving = shortest > np.sqrt(square) * JUMP
    shortest = np.where(moving, shortest, 1.0)
    # With the distance h of the line from the origin the direction turns at ω = h|way|/r², and |ω′| = 2ω|r′|/r.
    turning = np.linalg.norm(np.cross(start, way), axis=1) / shortest**2
    outwards = np.maximum(_along(start, way), _along(end, way))
    return np.where(moving, turning**2 + 2 * turning * outwards / shortest, np.where(square > 0, np.inf, 0.0))


def tip_bend(machine: Machine, start: Floats, end: Floats, turn: Floats) -> Floats:
    """Bound (n,) on the second derivative of the tip in the part when all five axes run evenly, mm.

    `start` and `end` (n, 3), mm, are words of the linear axes (`machine_position`); turns (n, 2) are in rad.
    """
    turn = np.abs(turn)
    size, speed, bend = np.zeros((3, len(turn)))  # of the way of the tip and its derivatives, as `position._swing` goes
    for index in (1, 0):
        axis = machine.axes[index]
        if axis.carrier == "head":
            lever = float(np.linalg.norm(machine.tool_length * machine.tool + np.array(axis.point)))
            size, speed, bend = _turned(size + lever, speed, bend, turn[:, index])
            size = size + lever
    before = np.zeros(3)  # the point that the size counts from
    speed = speed + np.linalg.norm(end - start, axis=1)
    swing, first = size, True
    for index in (1, 0):
        axis = machine.axes[index]
        if axis.carrier == "table":
            point = np.array(axis.point)
            if first:  # both ends of the straight way of the linear axes
                words = [np.linalg.norm(side + machine.part_zero - point, axis=1) for side in (start, end)]
                size, first = swing + np.maximum(*words), False
            else:
                size = size + float(np.linalg.norm(point - before))
            size, speed, bend = _turned(size, speed, bend, turn[:, index])
            before = point
    return bend


#: A way that comes nearer to the origin than this share of its length goes through it.
JUMP = 1e-12


def _turned(size: Floats, speed: Floats, bend: Floats, turn: Floats) -> tuple[Floats, Floats, Floats]:
    """Size and derivatives of R(q) p, with q′ = `turn`, from those of p."""
    return size, turn * size + speed, turn**2 * size + 2 * turn * speed + bend


def _sine(machine: Machine, axis: Floats) -> Floats:
    """Sine of the angle between the tool axis and the first rotary axis."""
    x, y, z = machine.axes[0].unit
    return norm(axis @ np.array(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))))


def _along(point: Floats, way: Floats) -> Floats:
    """Speed with which a point that runs along `way` leaves the origin."""
    length = np.linalg.norm(point, axis=1)
    return np.abs(dot(point, way)) / np.where(length > 0, length, 1.0)
