"""Tool axis from rotary angles and both pairs of angles from an axis, for two rotary axes or fewer; linear positions.

The axis in part coordinates is k = R₁(q₁) R₂(q₂) k₀ with the rotary axes a₁, a₂ in the order from the part to the tool.
With u = R₂ k₀ = R₁⁻¹ k the unit vectors a₁, a₂, u form a spherical triangle whose sides are known: σ between a₁ and a₂,
ρ₁ between a₁ and u (as between a₁ and k), ρ₂ between a₂ and u (as between a₂ and k₀). This is Paden and Kahan's second
subproblem (Murray, Li, Sastry, "A Mathematical Introduction to Robotic Manipulation", 3.2); the half-angle formula of
the triangle solves it without the loss of digits near the pole that their square root has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cornersmooth.arrays import cross, dot, norm
from cornersmooth.errors import InputError
from cornersmooth.kinematics.machine import LINEAR, PARALLEL, Machine
from cornersmooth.model import Bools, Floats, Ints

#: A machine has a pole where k can lie along a₁; sides that differ by less (rad) meet there up to rounding.
POLE_MATCH = 1e-9
ROUNDING = 1e-7  #: Chords of unit vectors are known to this.
CHUNK = 1 << 13  #: Axes that are solved at a time: what is computed on the way stays in the processor's cache.


@dataclass(frozen=True)
class Solutions:
    """Both pairs of rotary angles for each of n axes."""

    angles: Floats  #: (n, 2, 2), degrees; ``angles[i, branch, axis]`` in (-180, 180]
    #: (n,), degrees; angle between the tool axis and the nearest direction in which the first rotary axis has no
    #: effect; infinite on a machine without such a direction. At the pole the first angle is free, and what is given is
    #: one choice.
    pole_distance: Floats
    #: (n,), degrees; by how much the axis lies outside of what the machine can reach, else 0; the angles are then the
    #: nearest
    beyond: Floats

    @property
    def singular(self) -> Bools:
        """(n,) bool: the axis is at the pole, to rounding."""
        return self.pole_distance <= np.degrees(POLE_MATCH)


def tool_axis(machine: Machine, angles: Floats) -> Floats:
    """Unit axes (n, 3) of the tool in part coordinates that rotary angles (n, 2), degrees, give."""
    first, second = machine.axes
    turned = rotate(second.unit, second.sign * radians(angles[:, 1]), machine.tool[None, :])
    return rotate(first.unit, first.sign * radians(angles[:, 0]), turned)


def solutions(machine: Machine, axis: Floats) -> Solutions:
    """Both pairs of rotary angles for unit tool axes (n, 3) in part coordinates, from the tip to the spindle.

    `tool_axis` of either solution gives the axis back to 1e-15, near the pole too.
    """
    if len(machine.names) < 2:
        return _with_one_axis(machine, axis)
    frame = _Frame(machine)
    n = len(axis)
    angles, distance, beyond = np.empty((n, 2, 2)), np.empty(n), np.empty(n)
    for begin in range(0, n, CHUNK):
        here = slice(begin, begin + CHUNK)
        rho1 = _solve(frame, axis[here], angles[here])
        distance[here] = frame.pole_distance(rho1)
        beyond[here] = frame.beyond(rho1)
    return Solutions(angles, distance, beyond)


def _with_one_axis(machine: Machine, axis: Floats) -> Solutions:
    """Angles that come nearest to tool axes with one rotary axis or none: both solutions are the same.

    The axis k₀ goes round a₁ on a cone; the nearest k on it has the azimuth of the wanted axis.
    """
    angles = np.zeros((len(axis), 2, 2))
    about, tool = machine.axes[0].unit, machine.tool
    across = tool - (tool @ about) * about
    if machine.names and np.linalg.norm(across) > PARALLEL:
        other = cross(about, across)
        azimuth = np.arctan2(axis @ other, axis @ across)  # both are as long as each other
        angles[:, :, 0] = wrap(machine.axes[0].sign * np.degrees(azimuth))[:, None]
    beyond = angle_between(tool_axis(machine, angles[:, 0]), axis)
    return Solutions(angles, np.full(len(axis), np.inf), beyond)


def _solve(frame: _Frame, axis: Floats, angles: Floats) -> Floats:
    """Put both pairs of angles (n, 2, 2) into `angles`; return ρ₁ (n,)."""
    x, y, z = (axis @ frame.first).T
    rho1: Floats = np.arctan2(np.hypot(x, y), z)
    sigma, rho2 = frame.sigma, frame.rho
    half = (sigma + rho1 + rho2) / 2
    rising = np.sqrt(np.maximum(np.sin(half - sigma) * np.sin(half - rho2), 0.0))
    falling = np.sqrt(np.maximum(np.sin(half) * np.sin(half - rho1), 0.0))
    phi_half = np.arctan2(rising, falling)  # half of the angle of the triangle at a₂
    sine, cosine = np.sin(phi_half), np.cos(phi_half)
    # Azimuth of u about a₁, in the frame where a₂ has azimuth 0; for σ = ρ₂ a common factor sin(φ/2) is taken out.
    if frame.pole_ahead:
        azimuth = np.arctan2(cosine, np.cos(sigma) * sine)
    else:
        azimuth = np.arctan2(
            2 * np.sin(rho2) * sine * cosine, np.sin(sigma - rho2) + 2 * np.sin(rho2) * np.cos(sigma) * sine**2
        )
    target = np.arctan2(y, x)
    for branch, side in enumerate((1.0, -1.0)):
        angles[:, branch, 0] = wrap(frame.signs[0] * np.degrees(target + side * azimuth))
        angles[:, branch, 1] = wrap(frame.signs[1] * np.degrees(side * 2 * phi_half - frame.zero))
    return rho1


def closest_second(machine: Machine, axis: Floats, first_angle: Floats) -> Floats:
    """Second angles (n,), degrees in (-180, 180], nearest to axes (n, 3) at given first angles (n,)."""
    frame = _Frame(machine)
    first, _ = machine.axes
    turned = rotate(first.unit, -first.sign * radians(first_angle), axis)
    x, y, _z = (turned @ frame.second).T
    return wrap(frame.signs[1] * np.degrees(np.arctan2(y, x) - frame.zero))


def continued(machine: Machine, axis: Floats, guess: Floats, branch: Ints, cone: float | Floats) -> tuple[Floats, Ints]:
    """Angles (n, 2) on a known branch, in the turn that lies nearest to a guess; degrees.

    The branch (n,) is as in `Solutions.angles`, -1 for the one nearer to the guess. Within the cone of the pole,
    degrees, the first angle is the guess, the second comes closest to the axis, and the branch is -1.
    """
    found = solutions(machine, axis)
    near = found.angles + 360 * np.round((guess[:, None, :] - found.angles) / 360)
    nearer = np.argmin(np.abs(near - guess[:, None, :]).sum(axis=2), axis=1)
    branch = np.where(branch < 0, nearer, branch)
    angles: Floats = near[np.arange(len(axis)), branch]
    free = found.pole_distance <= cone
    if free.any():
        second = closest_second(machine, axis[free], guess[free, 0])
        angles[free, 0] = guess[free, 0]
        angles[free, 1] = second + 360 * np.round((guess[free, 1] - second) / 360)
        branch = np.where(free, -1, branch)
    return angles, branch


def passes_pole(machine: Machine, start: Floats, end: Floats, cone: float) -> Bools:
    """Whether (n,) the shortest turn between axes (n, 3) comes within `cone` degrees of a pole on its way.

    Not where the nearest point is one of the ends.
    """
    passes = np.zeros(len(start), np.bool_)
    if len(machine.names) < 2:
        return passes
    step = end - start
    step = norm(step) + np.radians(cone) + ROUNDING
    for pole in _Frame(machine).poles(machine):
        # On a way that is shorter than the distance of its start nothing comes near: chords obey the triangle too.
        near = np.flatnonzero(2.0 - 2.0 * (start @ pole) <= step * step)
        if len(near):
            one, two = start[near], end[near]
            normal = cross(one, two)
            length = np.linalg.norm(normal, axis=1)
            ahead = dot(cross(one, pole[None, :]), normal) > 0
            behind = dot(cross(pole[None, :], two), normal) > 0
            close = np.abs(normal @ pole) <= np.sin(np.radians(cone)) * length
            passes[near] |= (length > 0) & ahead & behind & close
    return passes


def angle_between(one: Floats, other: Floats) -> Floats:
    """Angle between unit vectors, degrees, exact for small angles too: (n, 3), (n, 3) -> (n,)."""
    apart = np.linalg.norm(one - other, axis=-1)
    return np.degrees(2 * np.arcsin(np.minimum(apart / 2, 1.0)))


def pole_angle(machine: Machine, axis: Floats) -> Floats:
    """Second angle that the machine has at the pole nearest to each axis: (n, 3) -> (n,) degrees in (-180, 180]."""
    poles = np.array(_Frame(machine).poles(machine))
    angles = closest_second(machine, poles, np.zeros(len(poles)))
    return angles[np.argmax(axis @ poles.T, axis=1)]


def wrap(angles: Floats) -> Floats:
    """Angles in degrees brought to (-180, 180]."""
    wrapped = angles - 360 * np.round(angles / 360)
    return np.where(wrapped <= -180, wrapped + 360, wrapped)


def radians(angles: Floats) -> Floats:
    """Radians of angles in degrees, whole turns taken off first so that they cost no digits."""
    return np.radians(np.fmod(angles, 360.0))


def rotate(direction: Floats, angle: Floats, vectors: Floats) -> Floats:
    """Vectors turned about a unit direction by angles in radians (Rodrigues): (3,), (n,), (n or 1, 3) -> (n, 3)."""
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = direction
    across = np.array(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)))  # v @ across = direction × v, faster than np.cross
    along = (vectors @ direction)[:, None] * direction
    return along + (vectors - along) * cosine + (vectors @ across) * sine


class _Frame:
    """What the triangle needs of a machine: its constant sides, and a frame about each rotary axis."""

    def __init__(self, machine: Machine) -> None:
        one, two = (axis.unit for axis in machine.axes)
        self.first = _columns(one, two)  # columns: towards a₂, across, a₁
        self.second = _columns(two, one)  # columns: towards a₁, across, a₂
        self.sigma, self.rho = _angle(one, two), _angle(machine.tool, two)
        x, y, _ = machine.tool @ self.second
        self.zero = float(np.arctan2(y, x))  # azimuth of k₀ about a₂, rad
        self.signs = machine.axes[0].sign, machine.axes[1].sign

    @property
    def pole_ahead(self) -> bool:
        """The tool can point along a₁."""
        return abs(self.sigma - self.rho) < POLE_MATCH

    @property
    def pole_behind(self) -> bool:
        """The tool can point against a₁."""
        return abs(self.sigma + self.rho - np.pi) < POLE_MATCH

    def poles(self, machine: Machine) -> list[Floats]:
        """Directions of the tool axis in which the first rotary axis has no effect."""
        direction = machine.axes[0].unit
        return [direction] * self.pole_ahead + [-direction] * self.pole_behind

    def pole_distance(self, rho1: Floats) -> Floats:
        """Degrees to the nearest pole; infinite without one."""
        ahead, behind = np.where(self.pole_ahead, rho1, np.inf), np.where(self.pole_behind, np.pi - rho1, np.inf)
        return np.degrees(np.minimum(ahead, behind))

    def beyond(self, rho1: Floats) -> Floats:
        """Degrees outside of the reach of the machine."""
        nearest = abs(self.sigma - self.rho)
        farthest = np.pi - abs(np.pi - self.sigma - self.rho)
        return np.degrees(np.maximum(np.maximum(nearest - rho1, rho1 - farthest), 0.0))


def _columns(about: Floats, towards: Floats) -> Floats:
    """Right-handed frame as columns: the part of `towards` across `about`, the third direction, `about`."""
    third = cross(about, towards)
    third /= np.linalg.norm(third)
    return np.stack((cross(third, about), third, about), axis=1)


def _angle(one: Floats, other: Floats) -> float:
    return float(np.arctan2(np.linalg.norm(cross(one, other)), one @ other))


_ROUNDING = 1e-6  #: mm beyond the travel that are rounding


class Arithmetic(NamedTuple):
    """What places are made of: numbers here, Taylor series in `cornersmooth.feedrate.machine_axes`."""

    #: vectors turned about a unit direction (3,) by angles
    turn: Callable[[Floats, Floats, Floats], Floats]
    one: Floats  #: what stands for the number one


_NUMBERS = Arithmetic(lambda direction, angle, vectors: rotate(direction, radians(angle), vectors), np.ones(()))


def machine_position(machine: Machine, tip: Floats, angles: Floats, of: Arithmetic = _NUMBERS) -> Floats:
    """Words of the linear axes, (n, 3) mm, that bring the tool tip to points of the part at angles (n, 2), degrees.

    They count from the zero of the part, with the length of the tool compensated: with both rotary axes at zero they
    are the tip itself. LinuxCNC's trtfuncs.c computes the same joints (its offsets are the points here).
    """
    zero = of.one * machine.part_zero
    return _turned(machine, "table", angles, tip + zero, of, -1.0) - zero - _swing(machine, angles, of)


def tip_position(machine: Machine, position: Floats, angles: Floats, of: Arithmetic = _NUMBERS) -> Floats:
    """Tool tip in part coordinates for words of the linear and rotary axes: the inverse of `machine_position`."""
    zero = of.one * machine.part_zero
    return _turned(machine, "table", angles, position + zero + _swing(machine, angles, of), of) - zero


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


def _swing(machine: Machine, angles: Floats, of: Arithmetic) -> Floats:
    """Way of the tip when the heads turn and the linear axes stand: (n, 3) mm."""
    return _turned(machine, "head", angles, np.zeros((*angles.shape[:-1], 3)), of)


def _turned(
    machine: Machine, carrier: str, angles: Floats, points: Floats, of: Arithmetic, sign: float = 1.0
) -> Floats:
    """Points that the rotary axes of a carrier turn; with a sign of -1 they turn back, the other one first."""
    arm = machine.tool_length * machine.tool if carrier == "head" else np.zeros(3)
    for index in (1, 0) if sign > 0.0 else (0, 1):
        axis = machine.axes[index]
        if axis.carrier == carrier:
            centre = of.one * (arm + np.array(axis.point))
            points = centre + of.turn(axis.unit, sign * axis.sign * angles[..., index], points - centre)
    return points
