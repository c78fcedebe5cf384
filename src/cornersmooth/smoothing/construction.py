"""Where the path is rounded (docs/method.md), and what a method of smoothing has to be able to do.

Corners are worked on in batches of whole arrays; `cornersmooth.settings` lists the methods.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import norm, ranges, starts, unit
from cornersmooth.model import Bools, Corners, FeedMode, Floats, Ints, Move, Program, SmoothProgram, Status
from cornersmooth.settings import AUTO, DEFAULT_METHOD, METHODS, Settings

if TYPE_CHECKING:
    from cornersmooth.smoothing.segments import Segments

#: called with what is done, and with what there is in all: corners, or poses of runs
Progress = Callable[[int, int], None]

#: corners worked on at once: their intermediate arrays fit the processor's cache
BATCH = 16384

#: batches worked on side by side
THREADS = 2

#: degrees below which the path goes straight on: numbers are rounded in CL files
STRAIGHT_ON = 1.0

#: part of the tolerance within which poses may be one corner, and how much farther away all other poses must be
_SHARE: Final = 0.5
_APART: Final = 4.0

#: steps of the digits within which poses are one corner wherever the others are: a transition between two such corners
#: is shorter than the digits show
_STEPS: Final = 8.0

#: what `Corners.extra` may have: largest curvature of the curve of a run beside each of its corners, 1/mm
RUN_CURVATURE = "run_curvature"


class Legs(NamedTuple):
    """The two segments at g corners, (g, 3) each."""

    tip_in: Floats  # D⁻ of the tip, mm
    tip_out: Floats  # D⁺ of the tip, mm
    turn_in: Floats  # H times the change of the axis vector, mm: ``tip + turn`` is the axis-point segment
    turn_out: Floats
    axis: Floats  # unit axis at the corner
    shift: Floats  # (g,) by how much the segments are off the motion of the CL file, mm (`one_corner_each`)

    def spare(self, settings: Settings) -> Floats:
        """(g,) what is left of the tolerances here, as other corners were moved by more, mm."""
        return settings.curve_share * (settings.pose_shift - self.shift)


def legs_at(program: Program, axis_length: float, pose: Ints, before: Ints, after: Ints) -> Legs:
    """Segments at the corners `pose` with their neighbours `before` and `after`, (g,) each: equations (1) and (2)."""
    moved = program.moved
    corner, tip_before, tip_after = (program.tip.take(at, axis=0) for at in (pose, before, after))
    direction, axis_before, axis_after = (program.axis.take(at, axis=0) for at in (pose, before, after))
    return Legs(
        corner - tip_before,
        tip_after - corner,
        axis_length * (direction - axis_before),
        axis_length * (axis_after - direction),
        direction,
        np.zeros(len(pose)) if moved is None else np.maximum(moved[pose], np.maximum(moved[before], moved[after])),
    )


def legs_of(smoothed: SmoothProgram, rows: Ints) -> Legs:
    """Segments at some corners (g,)."""
    corners = smoothed.corners
    where = (column[rows] for column in (corners.pose, corners.before, corners.after))
    return legs_at(smoothed.program, smoothed.settings.axis_length, *where)


def half_cosine(legs: Legs, axis_length: float) -> Floats:
    """(g,) cosine of half the larger of both axis changes, from their chords ``|turn| = 2 H sin(θ/2)``."""
    sine = np.maximum(norm(legs.turn_in), norm(legs.turn_out)) / (2.0 * axis_length)
    return np.sqrt(np.maximum(0.0, 1.0 - sine * sine))


def refuse_turns(status: NDArray[np.uint8], cosine: Floats, half_cosines: Floats, settings: Settings) -> None:
    """Mark the corners at which the path turns back (by its cosine in six dimensions), or the axis turns too far."""
    status[cosine < np.cos(np.radians(settings.reversal_angle))] = Status.REVERSAL
    status[half_cosines < np.cos(np.radians(settings.max_axis_step / 2.0)) - 1e-12] = Status.AXIS_STEP


def divide(numerator: Floats | float, denominator: Floats) -> Floats:
    """Quotient; infinity where the denominator is zero."""
    return np.divide(numerator, denominator, out=np.full_like(denominator, np.inf), where=denominator > 0.0)


@dataclass
class Placed:
    """Transitions of g corners; the names are those of `Corners`."""

    status: NDArray[np.uint8]
    limited_by: NDArray[np.uint8]
    trim_in: Floats
    trim_out: Floats
    axis_trim_in: Floats
    axis_trim_out: Floats
    tip_error: Floats
    axis_error: Floats
    orientation_error: Floats
    extra: dict[str, Floats] = field(default_factory=dict)


#: what a method measures of every transition
_MEASURES = tuple(name for name in Placed.__dataclass_fields__ if name not in ("status", "limited_by", "extra"))


class Construction(ABC):
    """A method: where it puts transitions, and where the tool is on them and between them."""

    #: names of what `Corners.extra` holds
    extra: ClassVar[tuple[str, ...]] = ()

    def smooth(
        self, program: Program, settings: Settings, progress: Progress | None = None, processes: int = 1
    ) -> SmoothProgram:
        """Smooth a whole program, corner by corner; parameters are those of `cornersmooth.smooth`."""
        corners = place_corners(program, settings, self, progress)
        return SmoothProgram(program=program, corners=corners, settings=settings, findings=program.findings)

    @abstractmethod
    def place(self, legs: Legs, settings: Settings) -> Placed:
        """Transitions of g corners."""

    @abstractmethod
    def points(self, smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
        """Tips (mm) and vectors along the tool, (g, 1 + m, 3) each, on the transitions of rows (g,) of corners.

        They are those at u = 0 and at the parameters u (m,), ascending.
        """

    @abstractmethod
    def divide(self, smoothed: SmoothProgram, segments: Segments, pose: Ints, number: int) -> tuple[Floats, Floats]:
        """Divide what transitions leave of the segments into poses (g,) into `number` lines of equal change of axis.

        Gives where the tip is on its segment (g, number - 1), and unit axes (g, number - 1, 3).
        """

    def axes(self, program: Program, corners: Corners, settings: Settings, rows: Ints, u: Floats) -> Floats | None:
        """Unit axis vectors (m, 3) on transitions `rows` (m,) at parameters u (m,); None where v = u gives them."""
        return None

    def report_columns(self, corners: Corners, rows: Ints) -> Mapping[str, Floats]:
        """Columns of the table of corners that only this method has, for some rows; names carry their unit."""
        return {}

    def report_summary(self, corners: Corners) -> Mapping[str, float]:
        """Entries of the report's summary that only this method has; names carry their unit."""
        return {}

    def summary_text(self, summary: Mapping[str, Any]) -> str:
        """One line on the screen about what `report_summary` gave; empty for none."""
        return ""


def construction_of(method: str) -> Construction:
    """The construction of a method, by its name; that of lines for "auto", which paths have that are not smoothed."""
    name = DEFAULT_METHOD if method == AUTO else method
    return import_module(METHODS[name].module).CONSTRUCTION


def place_corners(
    program: Program, settings: Settings, construction: Construction, progress: Progress | None = None
) -> Corners:
    """Round every corner of the program that can be rounded."""
    around = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    pose = np.flatnonzero(around.inner)
    before, after = around.previous[pose], around.following[pose]
    status = _surroundings(program, settings, pose, after)
    status[around.duplicate[pose]] = Status.DUPLICATE

    k = len(pose)
    measures = {name: np.zeros(k) for name in _MEASURES}
    if METHODS[settings.method].one_parameter:  # the same fractions on both curves: one array
        measures |= {"axis_trim_in": measures["trim_in"], "axis_trim_out": measures["trim_out"]}
    extra = {name: np.full(k, np.nan) for name in construction.extra}
    found = Corners(pose, before, after, status, np.zeros(k, np.uint8), extra=extra, **measures)

    def settle(start: int) -> int:
        rows = start + np.flatnonzero(status[start : start + BATCH] == Status.SMOOTHED)
        if len(rows):
            legs = legs_at(program, settings.axis_length, pose[rows], before[rows], after[rows])
            part = construction.place(legs, settings)
            put(found, rows, part, legs.shift)
        return min(start + BATCH, k)

    def settle_all(run: Callable[[Callable[[int], int], range], Iterable[int]]) -> None:
        for done in run(settle, range(0, k, BATCH)):
            if progress is not None:
                progress(done, k)

    if k <= BATCH:
        settle_all(map)
    else:
        from concurrent.futures import ThreadPoolExecutor

        with ThreadPoolExecutor(THREADS) as pool:  # numpy leaves the interpreter free; batches share no rows
            settle_all(pool.map)
    return found


def put(corners: Corners, rows: Ints, placed: Placed, shift: Floats) -> None:
    """Put transitions in rows of corners, in place; their errors count by what the poses were moved, mm."""
    moved = np.where(placed.status == Status.SMOOTHED, shift, 0.0)
    placed.tip_error, placed.axis_error = placed.tip_error + moved, placed.axis_error + moved
    for name in ("status", "limited_by", *_MEASURES):
        getattr(corners, name)[rows] = getattr(placed, name)
    for name, values in placed.extra.items():
        corners.extra[name][rows] = values


def _surroundings(program: Program, settings: Settings, pose: Ints, after: Ints) -> NDArray[np.uint8]:
    """Status of every corner as far as its surroundings decide it, geometry apart."""
    status = np.full(len(pose), Status.SMOOTHED, np.uint8)
    after = np.maximum(after, 0)
    status[program.feed_mode[pose] != program.feed_mode[after]] = Status.FEED_CHANGE
    if not settings.round_feed_changes:
        status[program.feed_changes(pose, after)] = Status.FEED_CHANGE
        status[program.feed_mode[pose] == FeedMode.PER_REVOLUTION] = Status.FEED_PER_REVOLUTION
    acts = np.cumsum(program.acted)
    status[acts[after] > acts[pose]] = Status.STATEMENT
    status[program.keep[pose] != 0] = Status.KEPT
    status[program.kind[pose - 1] == Move.HOLE] = Status.KEPT  # the tool comes from above the hole, not out of its pose
    status[after == 0] = Status.TOO_SHORT
    return status


@dataclass(frozen=True)
class Neighbours:
    """Distinct neighbours of each of n poses inside its chain."""

    previous: Ints  # the pose that the linear move into it starts from, -1 where it is not reached inside a chain
    following: Ints  # the next distinct pose of an inner pose of a chain, else -1
    inner: Bools  # inner poses of chains, repeated ones included: the corners
    duplicate: Bools  # repeats the pose before it in the same chain, but for a hole


def find_neighbours(program: Program, axis_length: float, near: float) -> Neighbours:
    """Distinct neighbours of all poses; poses as `near` (mm, tip and axis point) to each other are one.

    A run of poses that creep on by less than `near` each but by more in total is not merged.
    """
    n, own = len(program), np.arange(len(program))
    chains = program.chains
    length = chains[:, 1] - chains[:, 0]
    members = ranges(chains[:, 0] + 1, length)  # reached by a linear move inside a chain
    first, last = np.full((2, n), -1, np.int64)
    first[members], last[members] = np.repeat(chains[:, 0], length), np.repeat(chains[:, 1], length)
    inner = (first >= 0) & (own != last)

    duplicate = first >= 0
    duplicate[1:] &= distance(program, slice(1, None), slice(None, -1), axis_length) <= near
    duplicate[1:] &= program.kind[:-1] != Move.HOLE  # the tool has left the hole, and comes back to its pose
    representative = np.maximum.accumulate(np.where(duplicate, 0, own))
    repeats = np.flatnonzero(duplicate)
    away = repeats[distance(program, repeats, representative[repeats], axis_length) > near]
    duplicate[repeats[np.isin(representative[repeats], representative[away])]] = False  # those creep
    representative = np.maximum.accumulate(np.where(duplicate, 0, own))

    previous, following = np.full((2, n), -1, np.int64)
    previous[members] = np.maximum(representative[members - 1], first[members])
    distinct = np.minimum.accumulate(np.where(duplicate, n, own)[::-1])[::-1]
    following[inner] = distinct[np.flatnonzero(inner) + 1]
    following[following > last] = -1
    return Neighbours(previous, following, inner, duplicate)


def distance(program: Program, one: Ints | slice, other: Ints | slice, axis_length: float) -> Floats:
    """(k,) mm between some poses and others: the larger of tip and axis point."""
    step = program.tip[one] - program.tip[other]
    return np.maximum(norm(step), norm(step + axis_length * (program.axis[one] - program.axis[other])))


def one_corner_each(program: Program, settings: Settings) -> tuple[Program, Settings]:
    """Move poses that are almost doubled onto one place; the settings take the largest move off ε.

    Without it, the short segment between them limits the transitions at both, or leaves no room for any. Poses that
    must be passed exactly stay, and others move onto them. All stay where nothing is almost doubled.
    """
    settings = settings.but(pose_shift=0.0)  # that of a program which was smoothed before
    limit = _SHARE * settings.common_tolerance / settings.curve_share
    fine = min(limit, max(_STEPS * settings.tip_resolution, settings.duplicate_distance))
    size = _steps(program, settings.axis_length)
    short = size <= limit
    if not (short & (size > 0.0)).any():
        return program, settings
    gone = np.cumsum(np.where(short, size, 0.0))
    begin, end = (np.flatnonzero(short & ~np.roll(short, by)) for by in (1, -1))
    first, count = begin - 1, end - begin + 2
    total, around = gone[end] - gone[first], np.minimum(size[first], np.append(size, np.inf)[end + 1])
    cell = np.where((total <= limit) & (_APART * total <= around), np.inf, fine)

    # of every pose in these runs: the pose that its cells are counted from, and the pinned one behind it
    pose, run = ranges(first, count), np.repeat(np.arange(len(first)), count)
    pinned, place = _pinned(program)[pose], np.arange(len(pose))
    anchor = np.maximum.accumulate(np.where(pinned | (pose == first[run]), place, 0))
    ahead = np.minimum.accumulate(np.where(pinned, place, len(place))[::-1])[::-1]
    ahead = np.where((ahead < starts(count)[run + 1]), ahead, place)
    at, length = gone[pose], cell[run]
    number = np.floor((at - at[anchor]) / length + np.where(pinned[anchor], 0.5, 0.0))
    joins = pinned[ahead] & (at[ahead] - at <= length / 2.0)
    anchor, number = np.where(joins, ahead, anchor), np.where(joins, 0.0, number)
    new = np.append(True, (anchor[1:] != anchor[:-1]) | (number[1:] != number[:-1]))

    group, opens = np.cumsum(new) - 1, np.flatnonzero(new)
    closes = np.append(opens[1:], len(place)) - 1
    own = np.flatnonzero(pinned)
    opens_at, closes_at = opens.copy(), closes
    opens_at[group[own]] = closes_at[group[own]] = own
    one, other = pose[opens_at], pose[closes_at]
    tip, axis = (program.tip[one] + program.tip[other]) / 2.0, unit(program.axis[one] + program.axis[other])
    step, turn = tip[group] - program.tip[pose], settings.axis_length * (axis[group] - program.axis[pose])
    shift = np.maximum.reduceat(np.maximum(norm(step), norm(step + turn)), opens)
    several = np.bincount(group)[group] > 1
    here, into = pose[several], group[several]
    if not shift[into].any():
        return program, settings
    moved, tips, axes = np.zeros(len(program)), program.tip.copy(), program.axis.copy()
    tips[here], axes[here], moved[here] = tip[into], axis[into], shift[into]
    return replace(program, tip=tips, axis=axes, moved=moved), settings.but(pose_shift=float(moved.max()))


def beside_chords(program: Program, settings: Settings) -> tuple[Program, Settings]:
    """Take what the moves are off the curves of the file off ε, as `one_corner_each` does with what it moves."""
    curves = program.curves
    if curves is None:
        return program, settings
    tip, other = curves.bezier[..., :3], curves.bezier[..., 3:]
    points = np.stack((tip, tip + settings.axis_length * (other - tip)))
    off = 0.75 * norm(np.diff(points, 2, axis=2)).max(axis=(0, 2))  # see `verify.bending`
    moved = np.zeros(len(program)) if program.moved is None else program.moved.copy()
    for pose in (curves.pose - 1, curves.pose):
        np.maximum.at(moved, pose, off)
    return replace(program, moved=moved), settings.but(pose_shift=float(moved.max()))


def _steps(program: Program, axis_length: float) -> Floats:
    """(n,) mm: how far tip or axis point go in the move into each pose; infinite where it is in no chain."""
    chains = program.chains
    pose = ranges(chains[:, 0] + 1, chains[:, 1] - chains[:, 0])
    size = np.full(len(program), np.inf)
    size[pose] = distance(program, slice(1, None), slice(None, -1), axis_length)[pose - 1]
    return size


def _pinned(program: Program) -> Bools:
    """(n,) whether poses stay: ends of chains, what must be passed exactly, curves, and where the feed changes."""
    pinned = (program.keep != 0) | program.acted[1:]
    if program.curves is not None:
        pinned[program.curves.pose] = pinned[program.curves.pose - 1] = True
    pinned[program.chains.ravel()] = True
    pinned[:-1] |= program.feed_changes(np.arange(1, len(program)), np.arange(len(program) - 1))
    return pinned
