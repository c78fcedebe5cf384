"""The motion of a program as a row of elements: lines, halves of transitions, arcs and pure rotations.

The order is that of the motion. A move gives up to three elements: the second half of the transition that it leaves,
what is left of its segment, and the first half of the transition that it runs into; curves of runs and of NC programs
replace it. So an element belongs to one move, with one feed and one CL line. Every element is measured along its own
coordinate: the path length of the tip in mm, or the angle of the axis in rad where the tip stands still.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import angle_between, norm, unit
from cornersmooth.errors import SettingsError
from cornersmooth.feedrate.curves import STANDSTILL, WHOLE, Curves, end_tangents
from cornersmooth.geometry.arcs import arc_series
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Corners, FeedMode, Floats, Ints, Move, Program, Runs, Status
from cornersmooth.settings import Limits, Settings
from cornersmooth.smoothing.construction import find_neighbours

#: angles below this are no motion of the axis, rad
NO_TURN = 1e-9


class Kind(IntEnum):
    """Geometry of an element."""

    LINE = 0
    CURVE = 1
    ARC = 2


class Words(NamedTuple):
    """How rotary words move the tool: they run evenly in each block."""

    machine: Machine
    tip_control: bool  #: whether the tip runs evenly beside them, or the linear axes do


@dataclass(frozen=True)
class Path:
    """Elements of a motion, m rows in order."""

    program: Program
    corners: Corners | None  #: The transitions that some curves are halves of; None for the direct path.
    settings: Settings
    curves: Curves
    kind: NDArray[np.uint8]  #: (m,): `Kind`
    turning: Bools  #: (m,): the tip stands still; the coordinate is the angle of the axis, rad
    start: Ints  #: (m,): pose that the move starts from
    move: Ints  #: (m,): pose that the move ends in; with it go feed and CL line
    row: Ints  #: (m,): row of `curves`, else -1
    span: Floats  #: (m, 2): part of the move
    axis_span: Floats  #: (m, 2): the same for the axis-point segment of a line
    length: Floats  #: (m,)
    speed: Floats  #: (m,): feed, rapid speed or angular speed
    rapid: Bools  #: (m,)
    #: (m + 1,): largest speed at the start of element i, and at the end of the last: 0 for a stop, inf for none
    junction_speed: Floats
    words: Words | None = None  #: of the rotary words that lines are blocks of, or parts of blocks

    def __len__(self) -> int:
        return len(self.length)

    @property
    def edge(self) -> Floats:
        """(m + 1,) path coordinate of the elements' ends."""
        return np.concatenate(([0.0], np.cumsum(self.length)))

    @property
    def bent(self) -> Bools:
        """(m,) bool: curves on which the tip moves."""
        return (self.row >= 0) & ~self.turning

    def of_curves(self, values: Bools) -> Bools:
        """(m,) bool of what holds for curves (k,); False for other elements."""
        return np.append(values, False)[self.row]

    def part(self, begin: int, end: int) -> Path:
        """Elements `begin` to before `end` on their own."""
        names = ("kind", "turning", "start", "move", "row", "span", "axis_span", "length", "speed", "rapid")
        own = {name: getattr(self, name)[begin:end] for name in names}
        return replace(self, **own, junction_speed=self.junction_speed[begin : end + 1])


def build_path(
    program: Program,
    corners: Corners | None,
    settings: Settings,
    limits: Limits,
    *,
    runs: Runs | None = None,
    curves: Curves | None = None,
    stop_everywhere: bool = False,
) -> Path:
    """Elements of the direct path (`corners` None) or of the smoothed one; errors: a feed move has no usable feed.

    Corners that stay sharp are passed with a change of velocity of at most ``accel · period``, reversals with a stop;
    with `stop_everywhere` every move ends with a stop. The curves of `runs` replace the segments that they belong to.
    A direct path may have `curves`, each a whole move.
    """
    moves, start = _moves(program, settings)
    number = np.full(len(program), -1)
    number[moves] = np.arange(len(moves))
    trims, parts = np.zeros((4, len(moves))), [] if curves is None else [curves]
    if corners is not None:
        trims, halves = _transitions(program, corners, moves, start, settings.axis_length)
        parts.append(halves)
    if runs is not None and len(runs):
        parts.append(Curves.of_runs(program, runs, settings.axis_length))
    bent = Curves.joined(parts)
    whole = np.ones(len(moves), np.bool_)  # moves that no curve replaces
    whole[number[bent.move[bent.half == WHOLE]]] = False
    rest = np.flatnonzero(whole)
    length, angle, tangents = _rests(program, settings, moves, start, trims)

    # rests and curves in the order of the motion
    owner = np.concatenate((rest, number[bent.move]))
    place = np.concatenate((np.ones(len(rest), np.int64), np.array([2, 0, 1])[bent.half]))
    row = np.concatenate((np.full(len(rest), -1), np.arange(len(bent))))
    spans = np.stack((trims[:2], trims[2:]))[..., rest]
    spans[:, 1] = 1.0 - spans[:, 1]
    span, axis_span = (np.concatenate((own.T, bent.span)) for own in spans)
    length, angle = (np.concatenate((own[rest], of)) for own, of in zip((length, angle), bent.measured, strict=True))
    order = np.lexsort((place, owner))
    order = order[owner[order] >= 0]
    owner, row, length, angle = owner[order], row[order], length[order], angle[order]
    begins = np.diff(owner, prepend=-1) > 0
    turning = length <= STANDSTILL
    present = (length > STANDSTILL) | (angle > NO_TURN)

    piece = np.append(bent.half, -1)[row] == WHOLE
    of_curve = np.flatnonzero(piece)
    sides = np.diff(owner[of_curve], prepend=-1), np.diff(owner[of_curve], append=len(moves))
    for side, ends in enumerate(sides):
        chosen = of_curve[ends > 0]
        tangents[side, owner[chosen]] = end_tangents(bent.tip[row[chosen]], side)
    speeds = _junction_speeds(program, corners, moves, start, tangents, limits, stop_everywhere)
    inner = np.append(bent.inner, False)[row]
    junction = np.where(begins & ~inner, speeds[owner], np.inf)
    # from turn to turn on the spot the axis may change its rate: the machine says how fast that may be passed
    turns = turning & np.concatenate(([False], turning[:-1])) & inner & piece
    junction[turns] = limits.angular_limits[0]

    rapid = np.isin(program.kind[moves], (Move.RAPID, Move.HOLE))[owner]
    speed = np.where(rapid, limits.rapid_limits[0], 0.0)
    cutting = ~rapid & present & ~turning
    speed[cutting] = _feeds(program, moves[owner[cutting]], limits)
    speed[turning] = limits.angular_limits[0]

    keep = np.flatnonzero(present)
    # the junction before an element that is kept is the slowest of those since the element kept before it
    slowest = np.zeros(0)
    if len(keep):
        slowest = np.minimum.reduceat(junction[: keep[-1] + 1], np.concatenate(([0], keep[:-1] + 1)))
    changes = turning[keep]
    slowest[1:][changes[1:] != changes[:-1]] = 0.0
    slowest[:1] = 0.0
    owner, row = owner[keep], row[keep]
    kind = np.where(program.kind[moves] == Move.ARC, Kind.ARC, Kind.LINE)[owner]
    return Path(
        program=program,
        corners=corners,
        settings=settings,
        curves=bent,
        kind=np.where(row >= 0, Kind.CURVE, kind).astype(np.uint8),
        turning=changes,
        start=start[owner],
        move=moves[owner],
        row=row,
        span=span[order][keep],
        axis_span=axis_span[order][keep],
        length=np.where(turning, angle, length)[keep],
        speed=speed[keep],
        rapid=rapid[keep],
        junction_speed=np.concatenate((slowest, [0.0])),
    )


def _moves(program: Program, settings: Settings) -> tuple[Ints, Ints]:
    """Poses that are moved to, in order, and the poses they are reached from; repeated poses are one."""
    n = len(program)
    near = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    start = np.where(near.previous >= 0, near.previous, np.arange(n) - 1)
    moved = ~near.duplicate & (start >= 0) & (program.kind != Move.FROM)
    moved[1:] &= program.kind[:-1] != Move.FROM  # a FROM is stated, not passed
    still = moved & (program.kind != Move.ARC)
    still[still] = (program.tip[still] == program.tip[start[still]]).all(axis=1) & (
        program.axis[still] == program.axis[start[still]]
    ).all(axis=1)
    moves = np.flatnonzero(moved & ~still)
    return moves, start[moves]


def _transitions(program: Program, corners: Corners, moves: Ints, start: Ints, height: float) -> tuple[Floats, Curves]:
    """Fractions (4, k) of the moves that transitions take, and their halves.

    Fractions are of the tip segment at its start and at its end, then those of the axis-point segment.
    """
    entry = np.full(len(program), -1)  # smoothed corner at a pose
    entry[corners.pose[corners.smoothed]] = np.flatnonzero(corners.smoothed)
    ends = np.where(program.kind[moves] == Move.LINEAR, entry[np.stack((start, moves))], -1)
    has = ends >= 0
    trims = np.zeros((2, *ends.shape))
    for into, both in zip(
        trims, ((corners.trim_out, corners.trim_in), (corners.axis_trim_out, corners.axis_trim_in)), strict=True
    ):
        for own, trim, at in zip(into, both, ends, strict=True):
            own[at >= 0] = trim[at[at >= 0]]
    side, number = np.nonzero(has)
    halves = Curves.of_corners(program, corners, ends[has], 1 - side, moves[number], height)
    return trims.reshape(4, -1), halves


def _rests(
    program: Program, settings: Settings, moves: Ints, start: Ints, trims: Floats
) -> tuple[Floats, Floats, Floats]:
    """What transitions leave of k moves: lengths, angles where the tip stands, tangents (2, k, 3) at the ends."""
    step = program.tip[moves] - program.tip[start]
    chord = norm(step)
    length = chord * np.maximum(1.0 - trims[0] - trims[1], 0.0)
    tangents = np.tile(step / np.maximum(chord, STANDSTILL)[:, None], (2, 1, 1))
    arc = np.flatnonzero(program.kind[moves] == Move.ARC)
    for side in range(2):
        along = arc_series(program, np.searchsorted(program.arcs.pose, moves[arc]), side)[1]
        length[arc], tangents[side, arc] = norm(along), unit(along)
    angle = np.zeros(len(moves))
    still = np.flatnonzero((length <= STANDSTILL) & (trims[2] + trims[3] < 1.0))
    own = trims[:, still]
    levers = [
        settings.axis_length
        * ((1.0 - axis)[:, None] * program.axis[start[still]] + axis[:, None] * program.axis[moves[still]])
        + (axis - tip)[:, None] * step[still]
        for tip, axis in ((own[0], own[2]), (1.0 - own[1], 1.0 - own[3]))
    ]
    angle[still] = angle_between(*levers)
    return length, angle, tangents


def _feeds(program: Program, moves: Ints, limits: Limits) -> Floats:
    """Feed of the moves into these poses, mm/s."""
    if limits.feed is not None:
        return np.full(len(moves), limits.feed / 60.0)
    feed = program.feed[moves]
    unusable = ~(feed > 0.0) | (program.feed_mode[moves] != FeedMode.PER_MINUTE)
    if unusable.any():
        first = moves[np.argmax(unusable)]
        per_revolution = program.feed_mode[first] == FeedMode.PER_REVOLUTION
        raise SettingsError(
            "CS261",
            "the feed is per revolution here" if per_revolution else "no feed is programmed for this move",
            "give a feed in mm/min for the whole program (--feed)",
            file=program.source.name,
            line=int(program.line[first]),
        )
    return feed / 60.0


def _junction_speeds(
    program: Program,
    corners: Corners | None,
    moves: Ints,
    start: Ints,
    tangents: Floats,
    limits: Limits,
    stop_everywhere: bool,
) -> Floats:
    """Largest speed at the start of every move."""
    speeds = np.zeros(len(moves))
    if stop_everywhere or len(moves) < 2:
        return speeds
    feeding = (program.kind[moves] == Move.LINEAR) | (program.kind[moves] == Move.ARC)
    # a statement that acts may be anywhere between the end of the last move and the end of this one
    acts = np.concatenate(([0], np.cumsum(program.acted)))
    quiet = acts[moves[1:] + 1] == acts[moves[:-1] + 1]
    joined = feeding[1:] & feeding[:-1] & quiet
    if corners is not None:
        reversal = np.zeros(len(program), np.bool_)
        reversal[corners.pose[corners.status == Status.REVERSAL]] = True
        joined &= ~reversal[start[1:]]
    turn = norm(tangents[0, 1:] - tangents[1, :-1])  # 2·sin(α/2)
    with np.errstate(divide="ignore"):
        jump = limits.accel * limits.period / turn
    speeds[1:] = np.where(joined, jump, 0.0)
    return speeds
