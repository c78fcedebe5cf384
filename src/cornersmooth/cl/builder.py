"""Collects poses and changes of state in file order and makes the arrays of a `Program` from them, all at once.

Poses of the fast path stay in the arrays they came in; poses read one by one are merged in at the end. State (feed,
kind of move, axis, cutter compensation) is a short list of changes, spread over the poses by array operations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from cornersmooth.cl.bulk import FARTHEST, Chunk
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.systems import IDENTITY, System, Vector
from cornersmooth.errors import Finding
from cornersmooth.model import Bools, Floats, Ints, Keep, Move
from cornersmooth.vectors import norm

T = TypeVar("T", np.float64, np.int64, np.bool_)

#: largest ||v|−1| of an axis vector: three printed decimals leave 1e-3
UNIT_TOLERANCE: Final = 1e-2

UP: Final[Vector] = (0.0, 0.0, 1.0)

#: an axis that differs by less is the same one, printed again
AXIS_NOISE: Final = 1e-6

#: whether the axis is locked: no; by MULTAX/OFF alone; and stated after it
_FREE, _LOCKED, _STATED = 0.0, 1.0, 2.0


@dataclass
class Changes:
    """A state that keeps its value until the next change: values and the poses they begin at."""

    at: list[int]
    value: list[float]

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
        at = np.array([*self.at, n])
        return np.repeat(np.array(self.value), np.diff(np.minimum(at, n)))


@dataclass
class Builder:
    """Poses and state changes of one file; lengths and feeds as written."""

    file: str  #: for messages
    short_axis_up: bool = False  #: whether a pose without an axis has +Z instead of the last one
    off_known: bool = True  #: whether MULTAX/OFF surely locks the axis where it is
    lenient: bool = False  #: normalise axis vectors of any length, with a finding
    n: int = 0
    feed: Changes = field(default_factory=lambda: Changes([0], [float("nan")]))
    feed_mode: Changes = field(default_factory=lambda: Changes([0], [0.0]))
    keep: Changes = field(default_factory=lambda: Changes([0], [float(Keep.NO)]))
    kind: Changes = field(default_factory=lambda: Changes([0], [float(Move.LINEAR)]))
    axis_locked: Changes = field(default_factory=lambda: Changes([0], [0.0]))
    special: dict[int, Move] = field(default_factory=dict)
    axis_set: list[tuple[int, Vector]] = field(default_factory=lambda: [(0, UP)])
    systems: list[tuple[int, System]] = field(default_factory=list)  #: first pose, system seen from the first one
    _chunks: list[Chunk] = field(default_factory=list)
    _single_at: list[int] = field(default_factory=list)
    _single_tip: list[Vector] = field(default_factory=list)
    _single_axis: list[Vector | None] = field(default_factory=list)
    _single_line: list[int] = field(default_factory=list)
    _rows_before: int = 0
    _last_single: bool = False
    _axis_now: Vector = UP
    _axis_row: int = 0

    def enter(self, chunk: Chunk) -> None:
        """Take the next chunk; its plain poses follow by `take`."""
        if self._chunks:
            self._remember(self.last_axis())
            self._rows_before += len(self._chunks[-1].tip)
        self._chunks.append(chunk)

    def take(self, count: int) -> None:
        """Append the next poses of the chunk."""
        self.n += count
        self._last_single = False

    def add(self, tip: Vector, axis: Vector | None, line: int) -> None:
        """Append one pose (InputError CS113)."""
        check_range(tip, self.file, line)
        self._single_at.append(self.n)
        self._single_tip.append(tip)
        self._single_axis.append(axis)
        self._single_line.append(line)
        self.n += 1
        self._last_single = True
        if not self.axis_locked.now and (axis is not None or self.short_axis_up):
            self._remember(axis or self.axis_set[-1][1])

    @property
    def system(self) -> System:
        """The coordinate system of what follows, seen from the first one."""
        return self.systems[-1][1] if self.systems else IDENTITY

    def enter_system(self, system: System) -> None:
        """Let positions and axes be in another coordinate system from here on; an axis that holds stays where it is."""
        if self.axis_set[-1][0] != self.n:
            axis = self.system.seen_from(system).vector(self.last_axis())
            self.axis_set.append((self.n, axis))
            self._remember(axis)
        self.systems.append((self.n, system))

    def last_tip(self) -> Vector:
        """Tip of the last pose, in the coordinate system of what follows."""
        tip = self._last_tip()
        if not self.systems or self.systems[-1][0] < self.n:
            return tip
        before = next((system for pose, system in reversed(self.systems) if pose < self.n), IDENTITY)
        return before.seen_from(self.system).point(tip)

    def _last_tip(self) -> Vector:
        if self._last_single:
            return self._single_tip[-1]
        row, chunk = self._row(), len(self._chunks) - 1
        while row < 0:  # nothing of the last chunk was taken yet
            chunk -= 1
            row += len(self._chunks[chunk].tip)
        x, y, z = self._chunks[chunk].tip[row].tolist()
        return x, y, z

    def last_axis(self) -> Vector:
        """Axis of the last pose; where it has none of its own, the one that was set before it, or +Z."""
        rows = self._row() + 1
        if self.axis_locked.now or not self._chunks or rows <= 0 or self._rows_before + rows <= self._axis_row:
            return self._axis_now
        own = self._chunks[-1].own_axis[:rows]
        if self.short_axis_up and not own[-1]:
            return self.axis_set[-1][1]
        if not own[max(self._axis_row - self._rows_before, 0) :].any():
            return self._axis_now
        x, y, z = self._chunks[-1].axis[np.count_nonzero(own) - 1].tolist()
        return x, y, z

    def held_axis(self) -> Vector | None:
        """Axis to give to a pose that keeps the last one: None where that is what having none means."""
        return self.last_axis() if self.short_axis_up else None

    def set_axis(self, axis: Vector) -> None:
        """Let poses without an axis of their own have this one from here on."""
        self.axis_set.append((self.n, axis))
        self._remember(axis)
        if self.axis_locked.now:
            self.axis_locked.set(self.n, _STATED)

    def lock_axis(self, locked: bool) -> None:
        """Ignore (or heed again) the axes that poses have of their own."""
        self._remember(self.last_axis())
        self.axis_locked.set(self.n, _LOCKED if locked else _FREE)

    def _remember(self, axis: Vector) -> None:
        self._axis_now = axis
        self._axis_row = self.n - len(self._single_at)

    def _row(self) -> int:
        """Row of the last plain pose in the last chunk."""
        return self.n - 1 - len(self._single_at) - self._rows_before

    def tips(self) -> Floats:
        """(n, 3) float64: all tips, in the first coordinate system."""
        tips = self._merge([chunk.tip for chunk in self._chunks], np.array(self._single_tip).reshape(-1, 3))
        return self._placed(tips, System.points)

    def lines(self) -> Ints:
        """(n,) int64: line of every pose."""
        return self._merge([chunk.line for chunk in self._chunks], np.array(self._single_line, np.int64))

    def axes(self) -> tuple[Floats, list[Finding]]:
        """(n, 3) float64: the unit axis of every pose in the first system, and findings about them.

        Raises
        ------
        InputError
            CS111 for a zero vector, CS112 for one that is no unit vector, CS188 and CS197 for one that dialects read
            differently.
        """
        single = [axis is not None for axis in self._single_axis]
        own = self._merge([chunk.own_axis for chunk in self._chunks], np.array(single, np.bool_))
        given = np.flatnonzero(own)
        single_axis = np.array([axis for axis in self._single_axis if axis is not None]).reshape(-1, 3)
        single_at = np.array(self._single_at, np.int64)[np.array(single, np.bool_)]
        bulk = [chunk.axis for chunk in self._chunks]
        vector = merge(bulk, single_axis, np.searchsorted(given, single_at), len(given))
        findings: list[Finding] = []
        unit = self._normalise(vector, given, findings)

        state = self.axis_locked.spread(self.n)
        dropped = state[given] != _FREE
        off_axes = given[dropped], unit[dropped]
        if dropped.any():
            findings.append(finding("CS137", int(self.lines()[given[dropped][0]]), int(dropped.sum())))
            unit, given = unit[~dropped], given[~dropped]
        axis = self._held(unit, given)
        if not self.off_known:
            self._check_off(axis, state, *off_axes)
        return self._placed(axis, System.vectors), findings

    def _held(self, unit: Floats, given: Ints) -> Floats:
        """Axes of all poses, of which some are given."""
        if len(given) == self.n:
            return unit
        at = np.array([pose for pose, _ in self.axis_set])
        known = np.array([axis for _, axis in self.axis_set])
        if not self.short_axis_up:
            order = np.argsort(np.concatenate((at, given)), kind="stable")  # what was set before a pose comes first
            at, known = np.concatenate((at, given))[order], np.concatenate((known, unit))[order]
        axis: Floats = known[np.searchsorted(at, np.arange(self.n), side="right") - 1]
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
        line = int(self.lines()[pose])
        at = np.flatnonzero(own == pose)
        words = ",".join(f"{part:g}" for part in (unit[at[0]] if len(at) else axis[pose]))
        raise error("CS197" if len(at) else "CS188", self.file, line, axis=words)

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

    def _normalise(self, vector: Floats, pose: Ints, findings: list[Finding]) -> Floats:
        with np.errstate(over="ignore", invalid="ignore"):
            length = norm(vector)
            wrong = ~(np.abs(length - 1) <= UNIT_TOLERANCE)
        if wrong.any():
            first = int(wrong.argmax())
            value = float(length[first])
            zero = (length == 0) | ~np.isfinite(length)
            if zero.any() or not self.lenient:
                first = int((zero if self.lenient else wrong).argmax())
                value = float(length[first])
                code = "CS111" if value == 0 else "CS112"
                raise error(code, self.file, int(self.lines()[pose[first]]), length=value)
            findings.append(finding("CS139", int(self.lines()[pose[first]]), int(wrong.sum()), length=value))
        unit: Floats = vector / length[:, None]
        return unit

    def kinds(self) -> NDArray[np.uint8]:
        """(n,) uint8: `Move` of every pose."""
        kind = self.kind.spread(self.n).astype(np.uint8)
        if self.special:
            kind[np.fromiter(self.special, np.int64)] = np.fromiter(self.special.values(), np.uint8)
        return kind

    def _merge(self, bulk: list[NDArray[T]], single: NDArray[T]) -> NDArray[T]:
        return merge(bulk, single, np.array(self._single_at, np.int64), self.n)


def check_range(values: Iterable[float], file: str, line: int) -> None:
    """Refuse lengths that are not finite or beyond all machines (InputError CS113)."""
    for value in values:
        if not abs(value) <= FARTHEST:
            raise error("CS113", file, line, value=value, limit=FARTHEST)


def merge(bulk: list[NDArray[T]], single: NDArray[T], at: Ints, n: int) -> NDArray[T]:
    """Put single rows at their places among the bulk rows."""
    whole = bulk[0] if len(bulk) == 1 else np.concatenate(bulk)
    whole = whole[: n - len(single)]  # reading may have stopped inside a chunk
    if not len(single):
        return whole
    if not len(whole):
        return single
    merged = np.zeros((n, *single.shape[1:]), single.dtype)
    alone: Bools = np.zeros(n, np.bool_)
    alone[at] = True
    merged[alone] = single
    merged[~alone] = whole
    return merged
