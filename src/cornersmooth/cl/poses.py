"""Poses of a CL file and the states that hold for them, collected in file order; arrays are made of them at the end.

Plain lines come in whole runs, others one by one; both go into the same arrays. State (feed, kind of move, axis, cutter
compensation) is a short list of changes, spread over the poses by array operations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cornersmooth.arrays import norm
from cornersmooth.cl.bulk import FARTHEST
from cornersmooth.cl.dialects import Dialect
from cornersmooth.cl.messages import error, finding
from cornersmooth.errors import Finding
from cornersmooth.model import Floats, Ints, Keep, Move

Vector = tuple[float, float, float]

#: by how much axes of a system may miss length 1 and right angles: what four printed decimals leave
_SQUARE: Final = 1e-3


@dataclass(frozen=True, slots=True)
class System:
    """A coordinate system, seen from another one."""

    axes: Floats  #: (3, 3): its X, Y and Z axes as columns, orthonormal
    origin: Floats  #: (3,)

    def points(self, points: Floats) -> Floats:
        """Points (n, 3) of this system, in the other one."""
        return points @ self.axes.T + self.origin

    def vectors(self, vectors: Floats) -> Floats:
        """Vectors (n, 3) of this system, in the other one."""
        return vectors @ self.axes.T

    def seen_from(self, other: System) -> System:
        """Return this system as it is seen from another one, both seen from the same."""
        return System(other.axes.T @ self.axes, other.axes.T @ (self.origin - other.origin))

    def point(self, point: Vector) -> Vector:
        """One point of this system, in the other one."""
        return triple(self.points(np.array([point]))[0])

    def vector(self, vector: Vector) -> Vector:
        """One vector of this system, in the other one."""
        return triple(self.vectors(np.array([vector]))[0])


def triple(array: Floats) -> Vector:
    """Three numbers of an array."""
    x, y, z = array.tolist()
    return x, y, z


IDENTITY: Final = System(np.eye(3), np.zeros(3))


def system_of(values: list[float]) -> System | None:
    """Return the system of origin, X axis and Y axis, as NX writes MSYS; None where the axes are not orthonormal."""
    origin, x, y = np.array(values).reshape(3, 3)
    if max(abs(x @ x - 1), abs(y @ y - 1), abs(x @ y)) > _SQUARE:
        return None
    x = x / np.linalg.norm(x)
    z = np.cross(x, y)
    z = z / np.linalg.norm(z)
    return System(np.stack((x, np.cross(z, x), z), axis=1), origin)


#: largest ||v|−1| of an axis vector: three printed decimals leave 1e-3
UNIT_TOLERANCE: Final = 1e-2

UP: Final[Vector] = (0.0, 0.0, 1.0)

#: an axis that differs by less is the same one, printed again
AXIS_NOISE: Final = 1e-6

#: whether the axis is locked: no; by MULTAX/OFF alone; and stated after it
_FREE, _LOCKED, _STATED = 0.0, 1.0, 2.0

#: poses that the arrays have room for at first
_ROOM: Final = 1 << 12

_NONE: Final = (float("nan"),) * 3


@dataclass
class Changes:
    """A state that keeps its value until the next change: values and the poses they begin at."""

    value: list[float]
    at: list[int] = field(default_factory=lambda: [0])

    def set(self, pose: int, value: float) -> None:
        """Let the state be `value` from this pose on."""
        if value != self.value[-1]:
            self.append(pose, value)

    def append(self, pose: int, value: float) -> None:
        """Let the state be `value` from this pose on, also where it is already."""
        self.at.append(pose)
        self.value.append(value)

    @property
    def now(self) -> float:
        """The value at the end."""
        return self.value[-1]

    def spread(self, n: int) -> Floats:
        """(n,) float64: the value at every pose."""
        return np.repeat(np.array(self.value), np.diff(np.minimum([*self.at, n], n)))


@dataclass(kw_only=True)
class Poses:
    """Poses and state changes of one file; lengths and feeds as written."""

    file: str  #: for messages
    dialect: Dialect
    lenient: bool = False  #: go on where that is safe, with a finding
    n: int = 0
    feed: Changes = field(default_factory=lambda: Changes([float("nan")]))
    feed_mode: Changes = field(default_factory=lambda: Changes([0.0]))
    exact: Changes = field(default_factory=lambda: Changes([Keep.NO]))
    kind: Changes = field(default_factory=lambda: Changes([Move.LINEAR]))
    axis_locked: Changes = field(default_factory=lambda: Changes([_FREE]))
    axis_set: list[tuple[int, Vector]] = field(default_factory=lambda: [(0, UP)])
    systems: list[tuple[int, System]] = field(default_factory=list)  #: first pose, system seen from the first one
    _last_axis: Vector = UP
    _settled: int = 0  #: poses that `_last_axis` knows of
    _rows: Floats = field(default_factory=lambda: np.empty((_ROOM, 7)))

    @property
    def rows(self) -> Floats:
        """(n, 7) float64: tip, axis and line of every pose, as in `Part`."""
        return self._rows[: self.n]

    def expect(self, poses: int) -> None:
        """Have room for so many poses; room that is not used takes no memory."""
        self._rows = np.empty((max(poses, _ROOM), 7))

    def take(self, rows: Floats) -> None:
        """Append poses (m, 7)."""
        begin, self.n = self.n, self.n + len(rows)
        if self.n > len(self._rows):
            self._rows = np.concatenate((self._rows[:begin], np.empty((2 * self.n - begin, 7))))
        self._rows[begin : self.n] = rows

    def append(self, tip: Vector, axis: Vector | None, line: int) -> None:
        """Append one pose (InputError CS113)."""
        check_range(tip, self.file, line)
        self.take(np.array([(*tip, *(axis or _NONE), line)]))

    @property
    def last_axis(self) -> Vector:
        """Axis of the last pose; where it has none of its own, the one that was set before it, or +Z."""
        rows, self._settled = self.rows[self._settled :, 3:6], self.n
        if len(rows) and not self.axis_locked.now:
            if self.dialect.short_axis_up and np.isnan(rows[-1, 0]):
                self._last_axis = self.axis_set[-1][1]
            elif len(own := np.flatnonzero(~np.isnan(rows[:, 0]))):
                self._last_axis = triple(rows[own[-1]])
        return self._last_axis

    def _hold(self, axis: Vector) -> None:
        """Let poses without an axis of their own have this one from here on."""
        self.axis_set.append((self.n, axis))
        self._last_axis, self._settled = axis, self.n

    @property
    def system(self) -> System:
        """The coordinate system of what follows, seen from the first one."""
        return self.systems[-1][1] if self.systems else IDENTITY

    def enter_system(self, system: System) -> None:
        """Let positions and axes be in another coordinate system from here on; an axis that holds stays where it is."""
        if self.axis_set[-1][0] != self.n:
            self._hold(self.system.seen_from(system).vector(self.last_axis))
        self.systems.append((self.n, system))

    def last_tip(self) -> Vector:
        """Tip of the last pose, in the coordinate system of what follows."""
        tip = triple(self.rows[-1, :3])
        if not self.systems or self.systems[-1][0] < self.n:
            return tip
        before = next((system for pose, system in reversed(self.systems) if pose < self.n), IDENTITY)
        return before.seen_from(self.system).point(tip)

    def held_axis(self) -> Vector | None:
        """Axis to give to a pose that keeps the last one: None where that is what having none means."""
        return self.last_axis if self.dialect.short_axis_up else None

    def set_axis(self, axis: Vector) -> None:
        """Let poses without an axis of their own have this one from here on."""
        self._hold(axis)
        if self.axis_locked.now:
            self.axis_locked.set(self.n, _STATED)

    def lock_axis(self, locked: bool) -> None:
        """Ignore (or heed again) the axes that poses have of their own."""
        _ = self.last_axis  # as it is under the lock until now
        self.axis_locked.set(self.n, _LOCKED if locked else _FREE)

    def tips(self) -> Floats:
        """(n, 3) float64: all tips, in the first coordinate system."""
        return self._placed(self.rows[:, :3], System.points)

    def axes(self) -> tuple[Floats, list[Finding]]:
        """(n, 3) float64: the unit axis of every pose in the first system, and findings about them.

        Raises InputError CS111 for a zero vector, CS112 for one that is no unit vector, CS188 and CS197 for one that
        dialects read differently.
        """
        axis = self.rows[:, 3:6]
        given = np.flatnonzero(~np.isnan(axis[:, 0]))
        findings: list[Finding] = []
        unit = self._normalised(axis[given], given, findings)
        state = self.axis_locked.spread(self.n)
        dropped = state[given] != _FREE
        off_axes = given[dropped], unit[dropped]
        if dropped.any():
            findings.append(finding("CS137", int(self.rows[off_axes[0][0], 6]), int(dropped.sum())))
            unit, given = unit[~dropped], given[~dropped]
        axis = self._held(unit, given, self.dialect.short_axis_up)
        if self.dialect.autodesk:
            held = self._held(unit, given, short_axis_up=False)
            doubtful = (state == _FREE) & (np.abs(axis - held).max(axis=1, initial=0) > AXIS_NOISE)
            if doubtful.any():
                pose = int(doubtful.argmax())
                raise error("CS188b", self.file, int(self.rows[pose, 6]), axis=_words(held[pose]))
        if not self.dialect.multax_off_known:
            self._check_off(axis, state, *off_axes)
        return self._placed(axis, System.vectors), findings

    def _held(self, unit: Floats, given: Ints, short_axis_up: bool) -> Floats:
        """Axes of all poses, of which some are given."""
        if len(given) == self.n:
            return unit
        at = np.array([pose for pose, _ in self.axis_set])
        known = np.array([axis for _, axis in self.axis_set])
        if not short_axis_up:
            order = np.argsort(np.concatenate((at, given)), kind="stable")  # what was set before a pose comes first
            at, known = np.concatenate((at, given))[order], np.concatenate((known, unit))[order]
        axis = known[np.searchsorted(at, np.arange(self.n), side="right") - 1]
        axis[given] = unit
        return axis

    def _check_off(self, axis: Floats, state: Floats, own: Ints, unit: Floats) -> None:
        """Refuse axes after MULTAX/OFF that the standard and CATIA read differently, and those that neither reads."""
        off = state == _LOCKED
        doubtful = off & (np.abs(axis[:, :2]).max(axis=1, initial=0) > AXIS_NOISE)
        another = np.abs(axis[own] - unit).max(axis=1, initial=0) > AXIS_NOISE
        doubtful[own] = another & off[own]
        if not doubtful.any():
            return
        pose = int(doubtful.argmax())
        at = np.flatnonzero(own == pose)
        words = _words(unit[at[0]] if len(at) else axis[pose])
        raise error("CS197" if len(at) else "CS188", self.file, int(self.rows[pose, 6]), axis=words)

    def _placed(self, rows: Floats, place: Callable[[System, Floats], Floats]) -> Floats:
        """Rows of all poses, from their coordinate systems into the first one."""
        if not self.systems:
            return rows
        rows = rows.copy()
        ends = [*(pose for pose, _ in self.systems[1:]), self.n]
        for (begin, system), end in zip(self.systems, ends, strict=True):
            if system is not IDENTITY:
                rows[begin:end] = place(system, rows[begin:end])
        return rows

    def _normalised(self, vector: Floats, pose: Ints, findings: list[Finding]) -> Floats:
        with np.errstate(over="ignore", invalid="ignore"):
            length = norm(vector)
            wrong = ~(np.abs(length - 1) <= UNIT_TOLERANCE)
        if wrong.any():
            refused = wrong & ((length == 0) | ~np.isfinite(length)) if self.lenient else wrong
            first = int((refused if refused.any() else wrong).argmax())
            line, value = int(self.rows[pose[first], 6]), float(length[first])
            if refused.any():
                raise error("CS111" if value == 0 else "CS112", self.file, line, length=value)
            findings.append(finding("CS139", line, int(wrong.sum()), length=value))
        return vector / length[:, None]


def _words(axis: Floats) -> str:
    return ",".join(f"{part:g}" for part in axis)


def check_range(values: Iterable[float], file: str, line: int) -> None:
    """Refuse lengths that are not finite or beyond all machines (InputError CS113)."""
    for value in values:
        if not abs(value) <= FARTHEST:
            raise error("CS113", file, line, value=value, limit=FARTHEST)
