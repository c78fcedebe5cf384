"""What an NC text says, as arrays: the elements of its path, its curves and arcs, and the words between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from functools import cached_property
from itertools import repeat
from typing import TYPE_CHECKING, Any, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import ranges, some_rows
from cornersmooth.control.table import Means
from cornersmooth.errors import message
from cornersmooth.model import MM_PER_UNIT, Bools, Floats, Ints, Units

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: relative slack of arithmetic on feeds
_ARITHMETIC: Final = 1e-9

#: what the second triple of a motion block is: the tool vector, or a point on the tool axis
Second = Literal["vector", "point"]


#: letter of an event that is no word: axes go to positions of the machine
RETRACT: Final = "retract"


class Element(IntEnum):
    """What a motion block does (`NcProgram.kind`)."""

    RAPID = 0
    LINE = 1
    ARC = 2
    CURVE = 3


@dataclass(frozen=True)
class _Shapes:
    """What some elements are beside their ends, one row for each of them, ascending."""

    #: (k,): index of the path element each is; while a run is executed, of the block it begins with
    element: Ints = field(default_factory=lambda: np.zeros(0, np.int64))

    def __len__(self) -> int:
        return len(self.element)

    def only(self, chosen: Ints | slice) -> Self:
        """Some of them."""
        return some_rows(self, chosen)

    def part(self, first: int, stop: int) -> Self:
        """Those that are elements from `first` to `stop`, the latter excluded."""
        found = self.only(slice(*np.searchsorted(self.element, (first, stop)).tolist()))
        return replace(found, element=found.element - first)

    @classmethod
    def joined(cls, parts: Sequence[Self], start: Sequence[int] | None = None) -> Self:
        """Put several tables together, whose elements are counted from `start` on, in the order of their elements."""
        pairs = [(part, first) for part, first in zip(parts, start or repeat(0), strict=False) if len(part)]
        if not pairs:
            return cls()
        if len(pairs) == 1 and not pairs[0][1]:
            return pairs[0][0]
        own = {name: np.concatenate([getattr(part, name) for part, _ in pairs]) for name in _stored(pairs[0][0])}
        own["element"] = np.concatenate([part.element + first for part, first in pairs])
        whole = cls(**own)
        rises = (np.diff(whole.element) >= 0).all()
        return whole if rises else whole.only(np.argsort(whole.element, kind="stable"))


def _stored(rows: _Shapes | Elements) -> dict[str, NDArray[Any]]:
    """What has a row for each."""
    stored = {one.name: getattr(rows, one.name) for one in fields(rows)}
    return {name: values for name, values in stored.items() if isinstance(values, np.ndarray)}


@dataclass(frozen=True)
class Curves(_Shapes):
    """Control points and knots of the curves, c of them, one after another."""

    #: (c,): degree plus one, and how many control points there are
    order: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    points: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    #: (p, 6): control points of tip and of tool vector or axis point, mm (vectors: 1)
    point: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    weight: Floats = field(default_factory=lambda: np.zeros(0))  #: (p,)
    knot: Floats = field(default_factory=lambda: np.zeros(0))  #: (q,): ``points + order`` of each curve
    #: (c,): the block each curve ends with, while a run is executed
    end: Ints = field(default_factory=lambda: np.zeros(0, np.int64))

    @cached_property
    def first_point(self) -> Ints:
        """(c,) where the control points of each curve start."""
        return np.cumsum(self.points) - self.points

    @cached_property
    def first_knot(self) -> Ints:
        """(c,) where the knots of each curve start."""
        size = self.points + self.order
        return np.cumsum(size) - size

    def only(self, chosen: Ints | slice) -> Self:
        """Some of them."""
        place, at = _parts(self.points, chosen), _parts(self.points + self.order, chosen)
        rows = {"point": place, "weight": place, "knot": at}
        return replace(self, **{name: values[rows.get(name, chosen)] for name, values in _stored(self).items()})


def _parts(size: Ints, chosen: Ints | slice) -> Ints | slice:
    """Rows of some parts of a table, all of whose parts have these sizes, one after another."""
    if isinstance(chosen, slice):
        return slice(int(size[: chosen.start].sum()), int(size[: chosen.stop].sum()))
    return ranges((np.cumsum(size) - size)[chosen], size[chosen])


@dataclass(frozen=True)
class NcArcs(_Shapes):
    """The circular elements, k of them."""

    centre: Floats = field(default_factory=lambda: np.zeros((0, 3)))  #: (k, 3) mm: a point of the arc's axis
    #: (k, 3): unit vector; the rotation is right-handed about it
    normal: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    sweep: Floats = field(default_factory=lambda: np.zeros(0))  #: (k,) rad: always positive


@dataclass(frozen=True, slots=True)
class Event:
    """A word that neither moves the tool nor tells how."""

    element: int  #: index of the path element it stands before (the number of elements after the last one)
    line: int  #: NC line, from 1
    letter: str  #: ``"T"``, ``"S"``, ``"M"``, ``"G"``, ``"H"`` or ``"D"``; or `RETRACT`
    value: float  #: the number of the word; for ``G4`` the dwell in milliseconds is in `text`
    text: str = ""  #: the word as written


@dataclass(frozen=True, slots=True)
class Problem:
    """Something wrong in the NC text, or between it and the CL data."""

    code: str  #: ``"CS5xx"``
    #: where, from 1; 0 where no line applies
    cl_line: int
    nc_line: int
    text: str  #: one sentence in the user's words
    amount: float = float("nan")  #: how much, mm, where that says something; else NaN

    @classmethod
    def at(cls, code: str, wrong: Bools, line: Ints, text: str, most: int | None = None) -> list[Problem]:
        """One for each row where something is wrong, or for the first of them; `line` are the NC lines of the rows."""
        return [cls(code, 0, number, text) for number in line[np.flatnonzero(wrong)[:most]].tolist()]

    def message(self, place: str, beside: str = "") -> str:
        """Give it as it is printed, with another place in brackets."""
        return message("error", self.text, code=self.code, place=place, beside=beside)


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Path elements of a text or of a part of it, m of them."""

    kind: NDArray[np.uint8]  #: (m,): `Element`
    tip: Floats  #: (m, 3) mm: tip at the end of each element
    second: Floats  #: (m, 3): tool vector or axis point (mm) at the end of each element; always full
    line: Ints  #: (m,): NC line of each element (curves: of their first block)
    feed: Floats  #: (m,): mm/min or mm/rev; NaN for rapids and where none was given.
    per_revolution: NDArray[np.bool_]  #: (m,)
    #: (m,): the same of a block that inverse time counts, if the other of tip and axis point has timed it; else NaN
    other_feed: Floats
    #: (m,): whether the feed of the move may be higher: F is the largest that the control takes, or that of a plan
    least_feed: NDArray[np.bool_]
    #: (m,): mm/min or mm/rev by which the feed is not known: digits of F, and of times and ways where it is timed
    feed_room: Floats
    #: (m,): by how much, as `second`, directions that must be exact may be off beside the printed digits
    second_room: Floats
    #: (m,) mm: the same for each coordinate of tips: digits of a tilted plane are not along X, Y and Z
    tip_room: Floats
    curves: Curves = field(default_factory=Curves)
    arcs: NcArcs = field(default_factory=NcArcs)
    second_is: Second = "vector"
    #: value of the last printed digit of tip (mm) and of vector (1) or axis point (mm)
    tip_step: float = 0.0
    second_step: float = 0.0
    rotary: Machine | None = None  #: that rotary words are for; None for a text without any
    tip_control: bool = True  #: whether X Y Z beside rotary words are the tip, or the linear axes

    def __len__(self) -> int:
        return len(self.kind)

    def part(self, first: int, stop: int) -> Elements:
        """Elements from `first` to `stop`, the latter excluded, counted anew."""
        own = some_rows(self, slice(first, stop))
        return replace(own, curves=self.curves.part(first, stop), arcs=self.arcs.part(first, stop))

    def only(self, kept: Bools) -> Elements:
        """Those of the elements, among them all curves and arcs."""
        return self.divided(np.flatnonzero(kept), np.cumsum(kept) - 1)

    def divided(self, owner: Ints, last: Ints) -> Elements:
        """Every element as often as it is in `owner`, ascending; curves and arcs are the `last` of the others."""
        curves = replace(self.curves, element=last[self.curves.element])
        arcs = replace(self.arcs, element=last[self.arcs.element])
        return replace(some_rows(self, owner), curves=curves, arcs=arcs)

    def at_most(self) -> Self:
        """Return the same elements with feeds that a plan may have lowered: none per revolution, which cuts threads."""
        return replace(self, least_feed=~self.per_revolution)

    def carry(self, element: Ints | int, feed: Floats | float, per_revolution: Bools | bool) -> Bools:
        """Whether elements carry feeds in that unit, as far as the digits show."""
        own, other = self.feed[element], self.other_feed[element]
        room = self.feed_room[element] + _ARITHMETIC * np.maximum(np.abs(feed), 1.0)
        near = (np.abs(own - feed) <= room) | (np.abs(other - feed) <= room)
        near |= self.least_feed[element] & (own > 0.0) & (np.fmin(own, other) <= feed + room)
        found: Bools = near & (self.per_revolution[element] == per_revolution)
        return found

    @classmethod
    def joined(cls, parts: Sequence[Elements]) -> Elements:
        """Put parts of a text together, at least one; what holds for all elements is that of the last."""
        parts = [part for part in parts if len(part)] or parts[-1:]
        if len(parts) == 1:
            return parts[0]
        start = np.cumsum([0, *map(len, parts)]).tolist()
        own: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in parts]) for name in _stored(parts[0])
        }
        own["curves"] = Curves.joined([part.curves for part in parts], start)
        return replace(parts[-1], **own, arcs=NcArcs.joined([part.arcs for part in parts], start))


@dataclass(frozen=True, kw_only=True)
class NcProgram(Elements):
    """An NC text as a control understands it: path elements and what stands between them."""

    events: tuple[Event, ...]  #: in the order of the text
    problems: tuple[Problem, ...]  #: what breaks the rules of the control
    units: Units
    blocks: int  #: those that are not empty, ``%`` and comments left out
    means: Means  #: what words of the control say beside the motion
    retracts: tuple[int, ...] = ()  #: elements before which an axis goes to a position of the machine, ascending
    unlooked: tuple[tuple[int, str], ...] = ()  #: NC lines, and what of the motion was not looked at there
    feed_in_plane: bool = False  #: whether F of an arc that rises counts in the plane of its circle alone
    coarse: int = 0  #: NC line from which on digits of X Y Z are too few for the tolerance; 0 for none

    @property
    def mm_per_unit(self) -> float:
        """Millimetres per unit of the text."""
        return MM_PER_UNIT[self.units]


class Ahead:
    """Elements of a text as they are read: those that have been read and are still wanted."""

    def __init__(self, chunks: Iterable[Elements]) -> None:
        self._chunks = iter(chunks)
        self._held: Elements | None = None
        #: number of the first element that is kept
        self.base = 0
        #: elements read so far
        self.count = 0

    @property
    def nc(self) -> Elements:
        """What is kept; at least one element must have been read."""
        assert self._held is not None
        return self._held

    def has(self, element: int) -> bool:
        """Whether there is such an element; reads on as far as need be."""
        if element >= self.count:
            # what is long already grows by a half, so that it is not copied too often
            wanted = max(element + 1, self.count + (self.count - self.base) // 2)
            parts = [] if self._held is None else [self._held]
            while self.count < wanted and (chunk := next(self._chunks, None)) is not None:
                self.count += len(chunk)
                parts.append(replace(chunk, tip=chunk.tip.copy(), second=chunk.second.copy()))  # see `put`
            self._held = Elements.joined(parts) if parts else None
        return element < self.count

    def part(self, first: int, stop: int) -> Elements:
        """Elements from `first` to `stop`, the latter excluded, counted anew."""
        return self.nc.part(first - self.base, stop - self.base)

    def put(self, element: int, other: int) -> None:
        """Put an element to where another ends."""
        for values in (self.nc.tip, self.nc.second):
            values[element - self.base] = values[other - self.base]

    def forget(self, element: int) -> None:
        """Drop all elements before one."""
        if element > self.base:
            self._held, self.base = self.part(element, self.count), element
