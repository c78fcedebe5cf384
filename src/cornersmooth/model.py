"""The data that travels through the program: a tool path as arrays, and its statements as a side table.

Words: a *pose* is one tool tip with its axis; a *move* takes the tool from one pose to the next;
a *chain* is a run of linear feed moves; a *corner* is an inner pose of a chain; a *statement* is what the CL file says
between moves. Lengths are millimetres throughout; `Program.units` says what the file spoke
and what the NC text will speak.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import Bools as Bools
from cornersmooth.arrays import Floats as Floats
from cornersmooth.arrays import Ints as Ints
from cornersmooth.arrays import Numbers as Numbers
from cornersmooth.corners import Corners as Corners
from cornersmooth.corners import LimitedBy as LimitedBy
from cornersmooth.corners import Runs as Runs
from cornersmooth.corners import SmoothProgram as SmoothProgram
from cornersmooth.corners import Status as Status
from cornersmooth.corners import Trait as Trait
from cornersmooth.errors import Finding, InputError

Units = Literal["mm", "inch"]

#: millimetres per unit
MM_PER_UNIT: dict[Units, float] = {"mm": 1.0, "inch": 25.4}

#: angles nearer to a limit are at the limit, degrees
_ROUNDING = 1e-9


class Move(IntEnum):
    """How a pose is reached (`Program.kind`)."""

    FROM = 0  #: a start position that is stated, not moved to
    RAPID = 1
    LINEAR = 2  #: linear feed move: the only kind that forms chains
    ARC = 3  #: circular or helical feed move, described in `Program.arcs`
    HOLE = 4  #: position of a hole cycle; the cycle is a statement


class FeedMode(IntEnum):
    """Unit of `Program.feed`."""

    PER_MINUTE = 0  #: mm/min
    PER_REVOLUTION = 1  #: mm/rev


class Keep(IntEnum):
    """Why a pose must be passed exactly although it is a corner (`Program.keep`)."""

    NO = 0
    CUTTER_COMPENSATION = 1  #: the control offsets the path; rounding before the offset would be wrong
    CONTRADICTION = 2  #: the reader found contradicting information here


#: words that act where the tool stands: what the NC program has words for, and orders to the machine that a person puts
#: in where the comment is. The tool passes these poses exactly. All other words move nothing, so corners are rounded
#: there.
ACTING_WORDS = frozenset(
    """
    AUXFUN CHUCK CLAMP COOLNT CUTCOM CYCLE DELAY END GOHOME INSERT LOAD LOADTL OPSTOP SELECT SPINDL STOP TOOLNO TURRET
    UNLOAD
    """.split()
)


@dataclass(frozen=True, slots=True)
class Statement:
    """A CL statement that is not a motion; it keeps its place between moves."""

    pose: int  #: Index of the pose it stands before (``len(program)`` after the last one)
    line: int  #: Source line it starts on, from 1
    word: str  #: Major word in upper case (``"SPINDL"``, ``"TOOL PATH"``); ``"$$"`` for a comment
    #: Numbers as floats, minor words in upper case; empty arguments are ``""``. Text statements (PPRINT, PARTNO,
    #: comments, ...) have one string, untouched.
    args: tuple[float | str, ...] = ()
    text: str = ""  #: The statement as written, joined over continuation lines, without line ends

    @property
    def acts(self) -> bool:
        """Whether the tool must pass the place of the statement exactly (`ACTING_WORDS`)."""
        return self.word in ACTING_WORDS


@dataclass(frozen=True)
class Arcs:
    """Side table of the circular moves, k rows; the start of arc r is the pose before ``pose[r]``."""

    #: (k,): Index of the pose that the arc ends in, ascending.
    pose: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    centre: Floats = field(default_factory=lambda: np.zeros((0, 3)))  #: (k, 3), mm: Any point of the arc's axis
    #: (k, 3): Unit vector; the rotation is positive (right-handed) about it. Dialects with the opposite convention are
    #: turned round by the reader.
    normal: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    #: (k,), rad: Total rotation, > 0; more than 2π for several turns. A height difference between start and end along
    #: `normal` makes the arc a helix.
    sweep: Floats = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return len(self.pose)


@dataclass(frozen=True)
class Curves:
    """Side table of m linear moves that are near pieces of curves: cubics of the tip and of a point 1 mm up the axis.

    The pieces are the motion; the moves are chords of them.
    """

    pose: Ints  #: (m,): Index of the pose that each piece ends in, ascending
    bezier: Floats  #: (m, 4, 6), mm: Its control points

    def __len__(self) -> int:
        return len(self.pose)


@dataclass(frozen=True)
class Source:
    """Where a program came from: the `input` part of the report."""

    name: str = "<memory>"  #: File name without its folder, ``"<stdin>"`` for a stream
    format: str = "apt"  #: ``"apt"`` or ``"points"``
    #: ``"nx"``, ``"catia"``, ``"creo"``, ``"solidworks"``, ``"mfgsuite"``, ``"hsm"``, ``"ncl"``, ``"makino"``,
    #: ``"plain"``, ``"csv"``.
    dialect: str = "plain"
    operation: int = 0  #: Number of the operation that was taken alone; 0 for the whole file
    operation_name: str = ""  #: Empty where the file gives none
    sha256: str = ""  #: of the file, in hexadecimal digits; empty where there is none


@dataclass(frozen=True)
class Program:
    """A tool path of n poses and the statements between them.

    Notes
    -----
    FEDRAT and RAPID are no statements: they are `feed` and `kind`.
    """

    tip: Floats  #: (n, 3), mm: Tool tip points in part coordinates
    axis: Floats  #: (n, 3): Unit tool axis vectors from tip to spindle; always full, also where the file is modal
    kind: NDArray[np.uint8]  #: (n,): `Move`: how pose i is reached from pose i-1
    #: (n,): Programmed feed of the move into pose i in the unit of `feed_mode`; NaN where the file gives none.
    feed: Floats
    line: Ints  #: (n,): Source line of pose i, from 1
    feed_mode: NDArray[np.uint8]  #: (n,): `FeedMode` of each feed
    keep: NDArray[np.uint8]  #: (n,): `Keep`: reason why the pose is passed exactly, 0 for none
    arcs: Arcs = field(default_factory=Arcs)  #: Geometry of the poses with kind `Move.ARC`
    curves: Curves | None = None  #: Geometry of the linear moves that are near curves of the file; None for none
    statements: tuple[Statement, ...] = ()  #: Sorted by `Statement.pose`, then by source order
    units: Units = "mm"  #: Units of the file, and of the NC text made from it
    source: Source = field(default_factory=Source)
    findings: tuple[Finding, ...] = ()  #: What the reader noticed
    #: (n,), mm: By how much smoothing has moved poses that are almost doubled, at most; None where it has moved none.
    moved: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("tip", "axis", "kind", "feed", "line", "feed_mode", "keep"):
            shape = (len(self), 3) if name in ("tip", "axis") else (len(self),)
            if getattr(self, name).shape != shape:
                raise ValueError(f"Program.{name} has shape {getattr(self, name).shape}, not {shape}")

    def __len__(self) -> int:
        return len(self.tip)

    @classmethod
    def from_poses(
        cls,
        tip: Floats,
        axis: Floats,
        *,
        kind: NDArray[np.uint8] | None = None,
        feed: Floats | float = np.nan,
        line: Ints | None = None,
        **rest: Any,
    ) -> Program:
        """Program of linear feed moves through the given poses; what is not given gets its plain default.

        Parameters
        ----------
        tip : (n, 3) array_like, mm
        axis : (n, 3) array_like
            Any length but zero; normalised here.
        feed : (n,) array_like or float, mm/min
            Positive, NaN where there is none.
        kind : (n,) array_like of int, optional
            How each pose is reached: 2 by a cut (the default), 1 by a rapid; 0 is a start that is only stated, from
            which the motion does not begin; 3 is an arc of `Program.arcs`, 4 a hole of a cycle in `Program.statements`.
        line : (n,) array_like of int, optional
            Source line of each pose; 1 to n by default.
        rest
            Other fields of `Program`.

        Returns
        -------
        Program
            n poses in mm with unit axes.

        Raises
        ------
        InputError
            CS167: arrays of no poses, or that do not have a row of three numbers for each; a number that is not
            finite, an axis of length zero, a feed that is not positive, or a kind that there is not.
        """
        tip, axis = _rows_of_three("tip", tip), _rows_of_three("axis", axis)
        n, feed = len(tip), _numbers(feed)
        if len(axis) != n or feed.shape not in ((), (n,)):
            lengths = f"there are {n} tips, {len(axis)} axes and {feed.size} feeds"
            raise InputError("CS167", lengths, "give as many of each, or one feed for all")
        feed = np.broadcast_to(feed, (n,)).copy()
        _refuse(~np.isfinite(tip).all(axis=1), "tip", tip, "give finite numbers, in mm")
        largest = np.abs(axis).max(axis=1, initial=0.0)
        _refuse(~((largest > 0.0) & (largest < np.inf)), "axis", axis, "give a direction: finite numbers, not all zero")
        _refuse((feed <= 0.0) | np.isinf(feed), "feed", feed, "give a positive number, or NaN for none")
        axis = np.ldexp(axis, -np.frexp(largest)[1][:, None])  # squares neither overflow nor vanish
        return cls(
            tip=tip,
            axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
            kind=_whole("kind", np.full(n, Move.LINEAR) if kind is None else kind, n, list(Move)).astype(np.uint8),
            feed=feed,
            line=_whole("line", np.arange(1, n + 1) if line is None else line, n),
            feed_mode=rest.pop("feed_mode", np.zeros(n, np.uint8)),
            keep=rest.pop("keep", np.zeros(n, np.uint8)),
            **rest,
        )

    def with_feed(self, feed: float | None) -> Program:
        """Return the program with a feed (n,), mm/min, for moves that have none; as it is where none is given."""
        return self if feed is None else replace(self, feed=np.where(np.isnan(self.feed), feed, self.feed))

    def feed_at(self, pose: Ints) -> Floats:
        """Feeds (k,) of the moves into some poses, mm/min; NaN for none, and per revolution."""
        return np.where(self.feed_mode[pose] == FeedMode.PER_MINUTE, self.feed[pose], np.nan)

    def feed_changes(self, one: Ints, other: Ints) -> Bools:
        """(k,) whether the moves into some poses have another feed than those into others, or another unit of it."""
        feed, next_feed = self.feed[one], self.feed[other]
        same = (feed == next_feed) | (np.isnan(feed) & np.isnan(next_feed))
        return ~same | (self.feed_mode[one] != self.feed_mode[other])

    def axis_steps(self, moves: Bools, limit: float) -> tuple[Ints, Floats]:
        """Poses (k,), ascending, where `moves` (n,) end that turn the axis beyond a limit, and turns (k,); degrees."""
        axis, stated = self.axis, self.kind == Move.FROM
        far = moves[1:] & ~stated[1:] & ~stated[:-1]
        # a first look: the cosine is coarse
        far &= np.einsum("ij,ij->i", axis[1:], axis[:-1]) < np.cos(np.radians(limit)) + _ROUNDING
        pose = 1 + np.flatnonzero(far)
        here, there = axis[pose - 1], axis[pose]
        turn = np.degrees(2.0 * np.arctan2(np.linalg.norm(there - here, axis=1), np.linalg.norm(there + here, axis=1)))
        beyond = turn > limit + _ROUNDING
        return pose[beyond], turn[beyond]

    @property
    def mm_per_unit(self) -> float:
        """Millimetres per unit of the file and of its NC text."""
        return MM_PER_UNIT[self.units]

    @cached_property
    def acted(self) -> Bools:
        """(n+1,) bool: whether a statement that acts is between pose i-1 and pose i."""
        flags = np.zeros(len(self) + 1, np.bool_)
        flags[[statement.pose for statement in self.statements if statement.acts]] = True
        return flags

    @cached_property
    def chains(self) -> Ints:
        """(k, 2) int64: first and last pose of every chain, both included; the first is where the run starts from.

        A move belongs to a chain when it is a linear feed move with a pose to come from. A chain starts anew where the
        move before is of another kind.
        """
        n = len(self)
        linear = self.kind == Move.LINEAR
        linear[:1] = False  # nothing to come from
        if n > 1:
            linear[1:] &= self.kind[:-1] != Move.FROM  # a FROM is stated, not passed
        inner = np.zeros(n, np.bool_)  # pose i joins two moves of one chain
        if n > 2:
            inner[1:-1] = linear[1:-1] & linear[2:]
        first = np.flatnonzero(linear & ~np.concatenate(([False], inner[:-1]))) - 1
        last = np.flatnonzero(linear & ~inner)
        return np.stack((first, last), axis=1).astype(np.int64)


def _numbers(values: Any) -> Floats:
    """Array of what a user gives; empty where that is no array of numbers."""
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        return np.empty(0)


def _rows_of_three(what: str, values: Any) -> Floats:
    """Array (n, 3) of what a user gives."""
    array = _numbers(values)
    if array.size == 0 or array.shape[-1:] != (3,):
        raise InputError("CS167", f"{what} has the shape {array.shape}", "give one row of three numbers for each pose")
    return array.reshape(-1, 3)


def _whole(what: str, values: Any, n: int, choices: list[Move] | None = None) -> Ints:
    """Array (n,) of whole numbers, one of several where there are choices, of what a user gives."""
    array = _numbers(values)
    if array.shape != (n,):
        raise InputError("CS167", f"{what} has the shape {array.shape}", "give one whole number for each pose")
    names = [f"{one.value} for {one.name}" for one in choices or ()]
    wrong = ~np.isin(array, choices) if choices else ~(np.abs(array) < 2.0**53) | (array != np.floor(array))
    _refuse(wrong, what, array, f"give {', '.join(names) or 'a whole number'}")
    return array.astype(np.int64)


def _refuse(wrong: Bools | np.bool_, what: str, values: Floats, hint: str) -> None:
    """Say which pose is the first that is wrong (n,), and the value (n,) or (n, 3) that it has."""
    if wrong.any():
        pose = int(np.argmax(wrong))
        numbers = ", ".join(f"{value:g}" for value in np.atleast_1d(values[pose]))
        raise InputError("CS167", f"the {what} of pose {pose} is {numbers}", hint)


def rapid_moves(kind: NDArray[np.uint8]) -> Bools:
    """Poses of a program whose move does not cut, so that solution and turn may change in it: (n,) bool.

    Neither does the first move, nor an arc, from a start position that is stated and not moved to.
    """
    rapid: Bools = (kind != Move.LINEAR) & (kind != Move.ARC)
    first = np.cumsum(kind != Move.FROM) == 1
    rapid[1:] |= (kind[:-1] == Move.FROM) & (first[1:] | (kind[1:] == Move.ARC))
    rapid[:1] = True
    return rapid


def still_poses(kind: NDArray[np.uint8]) -> Bools:
    """Poses of a program through which nothing is cut: holes, and rapids with no cut after them; (n,) bool."""
    rapid = rapid_moves(kind)
    return rapid & np.append(rapid[1:], True) | (kind == Move.HOLE)
