"""Motion in rotary words as motion of the tool: a machine's axes, by rotations of our own (Rodrigues).

A block runs linearly in its words. Under tool tip control that is the tip and the angles, without it the linear axes
of the machine and the angles. Where the turn makes it matter a block becomes several lines, fine enough that nobody can
tell them from the motion. So what measures need not know of rotary axes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements
from cornersmooth.nc_reader.execution import Modal
from cornersmooth.nc_reader.tool import cross

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine, RotaryAxis

#: share of the tolerance by which a motion may leave the lines that stand for it, tip and axis point: programs leave
#: 0.005, of which the proof of verification takes 0.0001 for each of both motions; least length, mm
LINE_SHARE, LEAST = 4.8e-3, 1e-7

#: lines that one block becomes at most
MOST_LINES: Final = 4096

#: last digit of F where it is moves per minute
_F_STEP = 1e-3

#: largest F of G93 on controls: a block with it may be slower than it should be
_FASTEST = (9999.999, 999_999.999)

#: an axis that turns faster (deg/min) may make a block slower than its feed where the text times it (G93)
FAST_TURN = 30_000.0

#: degrees by which the way of the tool axis in a rapid may be longer than the shortest one: posts retract before
LONGEST_DETOUR = 40.0

#: near the pole, so many tolerances at the axis point, the first axis may turn ahead of time
_POLE = 3.0

#: share of the tolerance at the axis point by which poses may be out of the machine's reach (docs/machines.md)
_BEYOND = 0.1


def sagitta(tolerance: float) -> float:
    """How far a motion in rotary words may leave the lines that stand for it, mm, tip and axis point."""
    return max(LINE_SHARE * tolerance, LEAST)


@dataclass(frozen=True)
class Rotary:
    """How rotary words move the tool."""

    machine: Machine
    tip_control: bool  #: whether X Y Z are the tip, or the linear axes of the machine
    #: mm: ε and H
    tolerance: float
    axis_length: float
    #: last printed digits, mm and degrees
    tip_step: float
    angle_step: float

    @property
    def names(self) -> str:
        """Addresses, nearest to the part first."""
        return "".join(self.machine.names)

    @property
    def zero(self) -> Floats:
        """(2,) degrees at which the axes are at zero, or as near as their limits let them."""
        return np.array([min(max(0.0, np.ceil(axis.low)), np.floor(axis.high)) for axis in self.machine.axes])

    def carried(self, vectors: Floats, angles: Floats) -> Floats:
        """(n, 3) vectors of the machine in a part that tables have turned by (n, 2) degrees."""
        for axis, column in self._carrying("table"):
            vectors = _turned(axis, angles[:, column], vectors)
        return vectors

    def _carrying(self, carrier: str) -> list[tuple[RotaryAxis, int]]:
        """Axes that carry the table, or the head, and their columns; the nearest to the tool first."""
        return [(axis, column) for column, axis in reversed([*enumerate(self.machine.axes)]) if axis.carrier == carrier]

    def tips(self, position: Floats, angles: Floats) -> Floats:
        """(n, 3) tips in the part, mm, for words of the linear axes and degrees.

        Words count from the zero of the part, with the length of the tool compensated: with both axes at zero they
        are the tip itself. Heads swing the tip about their points, then the tables carry the part with them.
        """
        if self.tip_control:
            return position
        machine = self.machine
        nose = machine.tool_length * machine.tool
        swing = np.zeros_like(position)
        for axis, column in self._carrying("head"):
            pivot = nose + axis.point
            swing = pivot + _turned(axis, angles[:, column], swing - pivot)
        tip = position + swing + machine.part_zero
        for axis, column in self._carrying("table"):
            tip = axis.point + _turned(axis, angles[:, column], tip - axis.point)
        return tip - machine.part_zero

    def levers(self, position: Floats) -> Floats:
        """(n,) mm: sum of the distances at which the two axes may move the tip; zero under tip control."""
        total = np.zeros(len(position))
        if self.tip_control:
            return total
        for axis in self.machine.axes:
            if axis.carrier == "table":
                away = position + self.machine.part_zero - axis.point
                total += np.linalg.norm(away, axis=1) + self.machine.tool_length
            elif axis.carrier == "head":
                total += float(np.linalg.norm(self.machine.tool_length * self.machine.tool + axis.point))
        return total

    def pole_room(self, vector: Floats) -> Floats:
        """(n,) by how much the axis may be off though its pose must be exact: by the tolerance near the pole.

        There the first axis hardly moves the tool, and turns ahead of time. At the edge of what the machine reaches,
        and everywhere with one axis, the pose may be a little beyond.
        """
        allowed = self.tolerance / self.axis_length
        if len(self.machine.names) < 2:
            return np.full(len(vector), _BEYOND * allowed if self.machine.names else 0.0)
        about, second, tool = self.machine.axes[0].unit, self.machine.axes[1].unit, self.machine.tool
        # the second axis turns the tool, so that the cosine of its angle to the first one swings about a middle
        middle = float(about @ second) * float(second @ tool)
        swing = float(np.linalg.norm(cross(about, second)) * np.linalg.norm(cross(second, tool)))
        cosine, step = vector @ about, np.radians(self.angle_step)
        edge = (cosine <= middle - swing + step**2) | (cosine >= middle + swing - step**2)
        sine = np.linalg.norm(cross(vector, about), axis=1)
        return np.where(sine <= _POLE * allowed, allowed, np.where(edge, _BEYOND * allowed, 0.0))

    def steps(self, lever: float) -> tuple[float, float]:
        """Steps of tip and vector that printed digits stand for, `lever` being the longest."""
        turn = float(np.radians(self.angle_step))
        linear = self.tip_step if self.tip_control else np.sqrt(3) * self.tip_step
        return float(linear + lever * turn), 2 * turn

    def unwrapped(self, angles: Floats, before: tuple[float, ...]) -> Floats:
        """Return (n, 3) rotary words with those of modulo axes taken the shorter way, each from the one before."""
        found = angles
        for column, axis in enumerate(self.machine.axes):
            if axis.modulo and len(angles):
                start = before[column] if not np.isnan(before[column]) else angles[0, column]
                found = found.copy() if found is angles else found
                found[:, column] = np.unwrap(np.append(start, angles[:, column]), period=360.0)[1:]
        return found

    def resolve(self, run: Elements, before: Modal, *, inverse_time: bool) -> Elements:
        """Return a run in tips and tool vectors, all in mm, the second triple being degrees before.

        What is not known of the angles before the run is zero. With `inverse_time` feeds are moves per minute.
        """
        position = np.vstack((before.tip, run.tip))
        angles = np.nan_to_num(np.vstack((before.second, run.second))[:, :2])
        tip, vector = self.tips(position, angles), tool_vectors(self.machine, angles)
        curves, arcs = run.curves, run.arcs
        if len(curves):  # of a machine without rotary axes: in rotary words they are refused
            along = np.broadcast_to(self.machine.tool, (len(curves.point), 3))
            curves = replace(curves, point=np.column_stack((curves.point[:, :3], along)))
        if len(arcs):  # axes that carry the part turn its circles, too
            there = angles[arcs.element + 1]
            centre = self.tips(arcs.centre, there)
            normal = self.tips(arcs.centre + arcs.normal, there) - centre
            run = replace(run, arcs=replace(arcs, centre=centre, normal=normal))
        if inverse_time:
            run = self._timed(run, position, tip, vector, angles)
        count = self._counts(run, position, angles)
        if not len(count) or count.max() == 1:
            return replace(run, tip=tip[1:], second=vector[1:], curves=curves)
        last = np.cumsum(count) - 1
        owner = np.repeat(np.arange(len(count)), count)
        left = last[owner] - np.arange(len(owner))
        inner = np.flatnonzero(left)
        own = owner[inner]
        at = (1.0 - left[inner] / count[own])[:, None]
        fine_tip, fine_vector = tip[1:][owner], vector[1:][owner]
        words = [start[own] + at * (start[own + 1] - start[own]) for start in (position, angles)]
        fine_tip[inner], fine_vector[inner] = self.tips(*words), tool_vectors(self.machine, words[1])
        return replace(replace(run, curves=curves).divided(owner, last), tip=fine_tip, second=fine_vector)

    def swung(self, run: Elements, before: Modal) -> Ints:
        """Rapids in which the axes lead the tool a long way round, as when they turn back: (k,) elements.

        Parameters are those of `resolve`; what comes from where nobody knows is left out.
        """
        angles = np.vstack((before.second, run.second))[:, :2]
        known = ~np.isnan(np.vstack((before.tip, run.tip))[:-1]).any(axis=1) & ~np.isnan(angles[:-1]).any(axis=1)
        turn = np.abs(np.diff(angles, axis=0)).max(axis=1)
        rows = np.flatnonzero((run.kind == Element.RAPID) & known & (turn > LONGEST_DETOUR / 2))
        if not len(rows):
            return rows
        begin, end = (tool_vectors(self.machine, angles[rows + step]) for step in (0, 1))
        longest = np.zeros(len(rows))
        for share in np.linspace(0.0, 1.0, 16)[1:-1].tolist():
            between = tool_vectors(self.machine, angles[rows] + share * (angles[rows + 1] - angles[rows]))
            longest = np.maximum(longest, _apart(begin, between) + _apart(between, end))
        return rows[longest - _apart(begin, end) > LONGEST_DETOUR]

    def _counts(self, run: Elements, position: Floats, angles: Floats) -> Ints:
        """Number of lines that each element becomes.

        A motion leaves its chord by no more than an eighth of its largest second derivative. A tool vector on a chord
        is not longer than one, so that its direction is hardly farther off than its end.
        """
        count = np.ones(len(run.kind), np.int64)
        turned = np.flatnonzero(
            (run.kind == Element.LINE) & (angles[1:] != angles[:-1]).any(axis=1) & ~np.isnan(position[:-1]).any(axis=1)
        )
        turn = np.radians(np.abs(angles[turned + 1] - angles[turned]))
        tip, axis = self._second_derivatives(position[turned], position[turned + 1], angles[turned], turn)
        lines = np.ceil(np.sqrt((tip + self.axis_length * axis) / (8.0 * sagitta(self.tolerance))))
        count[turned] = np.clip(lines, 1, MOST_LINES)
        return count

    def _second_derivatives(self, start: Floats, end: Floats, angles: Floats, turn: Floats) -> tuple[Floats, Floats]:
        """(b,) bounds of the second derivatives of tip (mm) and tool vector by the share of a block.

        `start` and `end` are words of the linear axes, mm; `angles` degrees where it begins; `turn` the turns, rad.
        """
        machine, none = self.machine, np.zeros(len(start))
        moved = _Moved(np.broadcast_to(machine.tool, start.shape), none, none)
        for k in (1, 0):
            moved = moved.turned(machine.axes[k], angles[:, k], turn[:, k], np.zeros(3))
        axis_bend = moved.bend
        if self.tip_control:
            return none, axis_bend
        moved = _Moved(np.zeros_like(start), none, none)
        for axis, k in self._carrying("head"):
            moved = moved.turned(axis, angles[:, k], turn[:, k], machine.tool_length * machine.tool + axis.point)
        way = moved.way + np.linalg.norm(end - start, axis=1)
        moved = _Moved(moved.point + start + machine.part_zero, way, moved.bend)
        for axis, k in self._carrying("table"):
            moved = moved.turned(axis, angles[:, k], turn[:, k], np.array(axis.point))
        return moved.bend, axis_bend

    def _timed(self, run: Elements, position: Floats, tip: Floats, vector: Floats, angles: Floats) -> Elements:
        """Blocks whose F is moves per minute, with their feeds (mm/min), and how far these are uncertain.

        In the time of a block the tip runs its way with the feed. Where the tip may have stayed within ε the axis point
        may run its own way so: at some tolerance up to ε the tip stood still. Each number is off by half a digit.
        """
        rate, levers, turn_step = run.feed, self.levers(position), np.radians(self.angle_step)
        length = np.linalg.norm(np.diff(tip, axis=0), axis=1)
        swing = np.linalg.norm(np.diff(tip + self.axis_length * vector, axis=0), axis=1)
        turn = np.abs(np.diff(angles, axis=0)).max(axis=1)
        off = np.sqrt(3) * self.tip_step + np.maximum(levers[1:], levers[:-1]) * turn_step
        either = (length - off < self.tolerance) & (swing > length)
        swings = either & ((length < off) | (swing > self.tolerance))
        way, other = np.where(swings, (swing, length), (length, swing))
        off += np.where(either, 2 * self.axis_length * turn_step, 0.0)  # both axes turn the axis point
        return replace(
            run,
            feed=rate * way,
            other_feed=np.where(either, rate * other, np.nan),
            feed_room=rate * off + _F_STEP * np.where(either, swing, length),
            least_feed=np.isin(rate, _FASTEST) | (rate * turn > FAST_TURN),
        )


def tool_vectors(machine: Machine, angles: Floats) -> Floats:
    """(n, 3) unit tool vectors in the part, for (n, 2) degrees."""
    first, second = machine.axes
    tool = np.broadcast_to(machine.tool, (len(angles), 3))
    return _turned(first, angles[:, 0], _turned(second, angles[:, 1], tool))


@dataclass(frozen=True)
class _Moved:
    """Points that move, b of them: where they begin, and bounds of the way they go and of their second derivative."""

    point: Floats
    way: Floats
    bend: Floats

    def turned(self, axis: RotaryAxis, degrees: Floats, turn: Floats, centre: Floats) -> _Moved:
        """Turn them evenly about an axis, by `turn` (rad), from `degrees` on.

        With a turn of a and an arm r, (R r)' = R (a x r + r') and (R r)" = R (a x (a x r) + 2 a x r' + r").
        """
        arm = self.point - centre
        reach = np.linalg.norm(cross(axis.unit, arm), axis=1) + self.way
        return _Moved(
            centre + _turned(axis, degrees, arm),
            turn * reach + self.way,
            turn**2 * reach + 2.0 * turn * self.way + self.bend,
        )


def _apart(a: Floats, b: Floats) -> Floats:
    """Degrees between unit vectors, row by row."""
    return np.degrees(2.0 * np.arcsin(np.minimum(np.linalg.norm(a - b, axis=1) / 2.0, 1.0)))


def _turned(axis: RotaryAxis, degrees: Floats, vectors: Floats) -> Floats:
    """Vectors (n, 3) turned with an axis as seen from the part: Rodrigues' rotation."""
    direction = axis.unit
    sense = 1.0 if axis.positive == "tool" else -1.0
    angle = sense * np.radians(degrees)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = (vectors @ direction)[:, None] * direction
    return along + cosine * (vectors - along) + sine * cross(direction, vectors)
