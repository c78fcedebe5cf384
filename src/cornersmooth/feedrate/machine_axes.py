"""The five axes of a machine along a path: their positions with exact derivatives, and their limits.

With rotary axes a₁ (nearest to the part) and a₂ the tool axis is k = R₁R₂k₀. At the rates ω₁ and ω₂ it moves with
k′ = ω₁·a₁×k + ω₂·b×k, where b = R₁a₂. The product with b gives ω₁ = k′·b / ((a₁×k)·b), what is left gives ω₂, and
b′ = ω₁·a₁×b: coefficient by coefficient these make the Taylor series of the angles on either solution and for any
two axes; sines, cosines and turns of them make those of the linear axes.

At the pole (a₁×k)·b vanishes. Within the cone in which a control may turn the first axis ahead of time
(`cornersmooth.rotary.angle_path`) it is taken as at the edge of the cone: rates stay finite and the plan slows down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.arrays import cross
from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import taylor
from cornersmooth.feedrate.curves import WHOLE
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.feedrate.taylor import taylor_along
from cornersmooth.kinematics import Machine
from cornersmooth.kinematics.machine import PARALLEL
from cornersmooth.kinematics.poses import Arithmetic, continued, machine_position, tip_position
from cornersmooth.model import Floats, Ints, rapid_moves
from cornersmooth.rotary import rotary_angles

#: rotary angles may lie beyond the reach by so many times the cone: as many as `rotary_angles` lets pass
_CONES = 2.0


@dataclass(frozen=True)
class MachineAxes:
    """The motion of a machine's axes along a path: X, Y, Z in mm, then the rotary axes in degrees."""

    machine: Machine
    path: Path
    angles: Floats  #: (n, 2) degrees: rotary angles at the poses of the program
    branch: Ints  #: (n,): solution that a move into a pose is on; -1 where it passes from one to the other
    cone: float  #: degrees
    even: bool = False  #: whether lines are blocks of words of this machine, in which these run evenly
    places: Floats | None = None  #: (n, 3) mm: words of the linear axes at the poses, where these run evenly, too

    @property
    def names(self) -> tuple[str, ...]:
        """Addresses of the five axes."""
        return ("X", "Y", "Z", *self.machine.names)

    @property
    def limits(self) -> Floats:
        """(3, 5) speed, acceleration and jerk per s, s² and s³; inf for none."""
        given = {item.name: item.per_second for item in self.machine.dynamics}
        return np.array([given.get(name, (math.inf,) * 3) for name in self.names]).T

    def orders(self, element: Ints, share: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Positions (m, 5) of the axes and their first three derivatives by the path coordinate.

        Places are as in `taylor_along`; where the tip comes to a stand derivatives are infinite.
        """
        position, speed, _ = self.series(element, share)
        return position[0], *taylor.by_way(position, speed)

    def series(self, element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
        """Taylor series of the axes (4, m, 5), of the speed of the coordinate (3, m), and of the tip (4, m, 3)."""
        path = self.path
        tip, axis, speed = taylor_along(path, element, share)
        start, end = path.start[element], path.move[element]
        span = path.span[element]
        part = span[:, :1] + share[:, None] * (span[:, 1:] - span[:, :1])  # as good as a guess of angles needs it
        # in a rapid rotary axes run evenly, back by whole turns too
        even = path.rapid[element] | (self.even & (path.kind[element] == Kind.LINE))
        turning = _evenly(np.radians(self.angles), start, end, part)
        led = np.flatnonzero(~even)
        guess = np.degrees(turning[0, led])
        value, _ = continued(self.machine, axis[0, led], guess, self.branch[end[led]], self.cone)
        turning[:, led] = self._angle_series(axis[:, led], np.radians(value))
        linear = machine_position(self.machine, tip, turning, _SERIES)
        if self.places is not None:
            own = np.flatnonzero(even)
            linear[:, own] = _evenly(self.places, start[own], end[own], part[own])
            own = own[~(path.rapid | path.turning)[element[own]]]  # the tip runs unevenly on these
            speed[:, own] = taylor.speed_of(tip_position(self.machine, linear[:, own], turning[:, own], _SERIES))
        rotary = np.degrees(turning[..., : len(self.machine.names)])
        return np.concatenate((linear, rotary), axis=-1), speed, tip

    def _angle_series(self, axis: Floats, value: Floats) -> Floats:
        """Taylor series (4, m, 2) of the rotary angles, rad."""
        if len(self.machine.names) < 2:
            return self._series_of_one(axis, value)
        first, second = self.machine.axes
        about = first.unit
        gone = taylor.derivative(axis)
        b = np.zeros_like(axis)
        b[0] = _turned(first.unit, _waves(first.sign * value[None, :, 0]), second.unit[None, None])[0]
        smallest = math.sin(math.radians(self.cone)) * float(np.linalg.norm(cross(about, second.unit)))
        lever = cross(about, axis)
        rate = np.zeros((taylor.ORDERS - 1, len(value)))
        for k in range(taylor.ORDERS - 1):
            size = taylor.dot(lever[: k + 1], b[: k + 1])
            inside = np.abs(size[0]) < smallest
            size[0] = np.where(inside, np.where(size[0] < 0.0, -smallest, smallest), size[0])
            size[1:, inside] = 0.0
            rate[k] = taylor.divide(taylor.dot(gone[: k + 1], b[: k + 1]), size)[k]
            b[k + 1] = taylor.multiply(rate[: k + 1, :, None], cross(about, b[: k + 1]))[k] / (k + 1)
        rest = gone - taylor.multiply(rate[..., None], lever[: len(rate)])
        across = taylor.cross(b, axis)[: len(rate)]
        other = taylor.divide(taylor.dot(rest, across), taylor.dot(across, across))
        found = np.zeros((taylor.ORDERS, len(value), 2))
        found[0] = value
        order = np.arange(1, taylor.ORDERS)[:, None]
        found[1:, :, 0] = first.sign * rate / order
        found[1:, :, 1] = second.sign * other / order
        return found

    def _series_of_one(self, axis: Floats, value: Floats) -> Floats:
        """Return the same with one rotary axis or none: ω = k′·(a×k) / |a×k|²."""
        found = np.zeros((taylor.ORDERS, len(value), 2))
        found[0] = value
        first = self.machine.axes[0]
        lever = cross(first.unit, axis)
        size = taylor.dot(lever[:-1], lever[:-1])
        if not self.machine.names or (size[0] <= PARALLEL**2).any():
            return found
        rate = taylor.divide(taylor.dot(taylor.derivative(axis), lever[:-1]), size)
        found[1:, :, 0] = first.sign * rate / np.arange(1, taylor.ORDERS)[:, None]
        return found

    def jump_speeds(self, accel_time: float) -> Floats:
        """Speeds (m + 1,) at which sharp corners ask no axis for more than its acceleration allows in this time.

        One at the start of every element and one at the end of the last; inf where nothing changes at once. Where
        curves of a text or of a run join, the jump of the acceleration is bounded as well, by the jerk.
        """
        path = self.path
        found = np.full(len(path) + 1, np.inf)
        sharp = np.flatnonzero(np.isfinite(path.junction_speed) & (path.junction_speed > 0.0))
        if len(sharp):
            sides = [self.orders(sharp + shift, np.full(len(sharp), share)) for shift, share in ((-1, 1.0), (0, 0.0))]
            _, accel, jerk = self.limits
            with np.errstate(invalid="ignore", divide="ignore"):
                allowed = accel * accel_time / np.abs(sides[1][1] - sides[0][1])
                steady = np.sqrt(jerk * accel_time / np.abs(sides[1][2] - sides[0][2]))
            piece = path.of_curves(path.curves.half == WHOLE)
            joint = piece[sharp] | piece[sharp - 1]
            allowed[joint] = np.fmin(allowed, steady)[joint]
            found[sharp] = np.where(np.isnan(allowed), np.inf, allowed).min(axis=1)
        return found


def follow(machine: Machine, path: Path) -> MachineAxes:
    """Rotary solutions along a path.

    InputError: the machine does not reach a tool axis, or not within the limits of its rotary axes. CS263: it has no
    dynamics.
    """
    if not machine.dynamics:
        raise SettingsError(
            "CS263",
            f"machine {machine.name} does not say how fast its axes may go",
            "add [dynamics.X] with velocity, acceleration and jerk to its file, and the same for the other axes",
        )
    program, settings = path.program, path.settings
    words = path.words if path.words is not None and path.words.machine.turns_like(machine) else None
    if words is not None:
        machine = replace(machine, tool_length=words.machine.tool_length)
    tolerance = math.degrees(settings.tolerance / settings.axis_scale)
    cone = tolerance / _CONES
    rapid = rapid_moves(program.kind)
    found = rotary_angles(
        machine,
        program.tip,
        program.axis,
        tolerance=tolerance,
        rapid=rapid,
        line=program.line,
        file=program.source.name,
    )
    _, own = continued(machine, program.axis, found.angles, np.full(len(program), -1), cone)
    places = None
    if words is not None and not words.tip_control:
        places = machine_position(machine, program.tip, found.angles)
    branch = np.full(len(program), -1, np.int64)
    start, end = path.start, path.move
    one, other = own[start], own[end]
    branch[end] = np.where(one == other, one, np.where(one < 0, other, np.where(other < 0, one, -1)))
    return MachineAxes(machine, path, found.angles, branch, cone, words is not None, places)


def _waves(angle: Floats) -> tuple[Floats, Floats]:
    """Taylor series of cosine and sine of a series: c′ = −s·q′, s′ = c·q′."""
    cosine, sine = np.zeros_like(angle), np.zeros_like(angle)
    cosine[0], sine[0] = np.cos(angle[0]), np.sin(angle[0])
    for k in range(len(angle) - 1):
        gone = taylor.derivative(angle)[: k + 1]
        cosine[k + 1] = -taylor.multiply(sine[: k + 1], gone)[k] / (k + 1)
        sine[k + 1] = taylor.multiply(cosine[: k + 1], gone)[k] / (k + 1)
    return cosine, sine


def _turned(direction: Floats, waves: tuple[Floats, Floats], vectors: Floats) -> Floats:
    """Taylor series of vectors turned about a unit direction (Rodrigues) by an angle given by its cosine and sine."""
    cosine, sine = waves
    along = (vectors @ direction)[..., None] * direction
    return along + (
        taylor.multiply(cosine[..., None], vectors - along)
        + taylor.multiply(sine[..., None], cross(direction, vectors))
    )


def _evenly(values: Floats, start: Ints, end: Ints, part: Floats) -> Floats:
    """Taylor series (4, m, d) of what runs evenly from rows to rows of values (n, d), at parts (m, 1) of the way."""
    found = np.zeros((taylor.ORDERS, len(start), values.shape[1]))
    found[1] = values[end] - values[start]
    found[0] = values[start] + part * found[1]
    return found


#: of positions of axes
_SERIES = Arithmetic(
    lambda direction, angle, vectors: _turned(direction, _waves(angle), vectors), np.eye(taylor.ORDERS, 1)[:, :, None]
)
