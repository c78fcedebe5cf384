"""The motion of a program as a row of elements: lines, halves of transitions, arcs and pure rotations.

The order is that of the motion. A move gives up to three elements: the second half of the transition that it leaves,
what is left of its segment, and the first half of the transition that it runs into; so an element belongs to one move,
with one feed and one CL line. Every element is measured along its own coordinate: the path length of the tip in mm, or
the angle of the axis in rad where the tip stands still.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import arcs, bezier_halves
from cornersmooth.feedrate.bezier_halves import STANDSTILL
from cornersmooth.feedrate.cubics import RunPieces, along_runs
from cornersmooth.feedrate.limits import Limits
from cornersmooth.model import Bools, Corners, FeedMode, Floats, Ints, Move, Program, Runs, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.neighbours import find_neighbours
from cornersmooth.vectors import angle_between, norm

#: angles below this are no motion of the axis, rad
NO_TURN = 1e-9

#: elements of a move: out of the corner behind, straight on, into the corner ahead
_SLOTS = 3


class Kind(IntEnum):
    """Geometry of an element."""

    LINE = 0
    CURVE = 1
    ARC = 2
    PIECE = 3  #: of the curve of a whole run, or of a text


@dataclass(frozen=True)
class Path:
    """Elements of a motion, m rows in order.

    Parameters
    ----------
    program : Program
    corners : Corners or None
        The transitions that the curves are halves of; None for the direct path.
    settings : Settings
    kind : (m,) uint8
        `Kind`.
    turning : (m,) bool
        The tip stands still; the coordinate is the angle of the axis, rad.
    start : (m,) int64
        Pose that the move starts from.
    move : (m,) int64
        Pose that the move ends in; with it go feed and CL line.
    corner : (m,) int64
        Row of `corners` for curves, of `run_pieces` for pieces of runs, else -1.
    span : (m, 2) float64
        Part of the segment (fractions of the move) or of the curve (parameter u).
    axis_span : (m, 2) float64
        The same for the axis-point segment of a line.
    length : (m,) float64, mm or rad
    speed : (m,) float64, mm/s or rad/s
        Feed, rapid speed or angular speed.
    rapid : (m,) bool
    junction_speed : (m + 1,) float64
        Largest speed at the start of element i, and at the end of the last: 0 for a stop, inf for none.
    run_pieces : RunPieces or None
        The curves of whole runs, or of a text.
    """

    program: Program
    corners: Corners | None
    settings: Settings
    kind: NDArray[np.uint8]
    turning: Bools
    start: Ints
    move: Ints
    corner: Ints
    span: Floats
    axis_span: Floats
    length: Floats
    speed: Floats
    rapid: Bools
    junction_speed: Floats
    run_pieces: RunPieces | None = None

    def __len__(self) -> int:
        return len(self.length)

    def part(self, begin: int, end: int) -> Path:
        """Elements `begin` to before `end` on their own."""
        own = slice(begin, end)
        return replace(
            self,
            kind=self.kind[own],
            turning=self.turning[own],
            start=self.start[own],
            move=self.move[own],
            corner=self.corner[own],
            span=self.span[own],
            axis_span=self.axis_span[own],
            length=self.length[own],
            speed=self.speed[own],
            rapid=self.rapid[own],
            junction_speed=self.junction_speed[begin : end + 1],
        )


def build_path(
    program: Program,
    corners: Corners | None,
    settings: Settings,
    limits: Limits,
    *,
    runs: Runs | None = None,
    pieces: RunPieces | None = None,
    stop_everywhere: bool = False,
) -> Path:
    """Elements of the direct path (`corners` None) or of the smoothed one.

    Corners that stay sharp are passed with a change of velocity of at most ``accel · period``, reversals with a stop;
    with `stop_everywhere` every move ends with a stop. The curves of `runs` replace the segments that they belong to.
    A direct path may have `pieces`, each a whole move.

    Raises
    ------
    SettingsError
        A feed move has no usable feed.
    """
    moves, start = _moves(program, settings)
    rests = _rests(program, corners, settings, moves, start, pieces)
    lengths, angles = _lengths(program, corners, settings, rests)
    m = len(lengths)
    present = (lengths > STANDSTILL) | (angles > NO_TURN)
    turning = lengths <= STANDSTILL
    corner = np.stack((rests.leaving, rests.piece, rests.reaching), axis=1)
    span, axis_span = _spans(rests.trims)

    rapid = (program.kind[moves] == Move.RAPID) | (program.kind[moves] == Move.HOLE)
    speed = np.repeat(np.where(rapid, limits.rapid_limits[0], 0.0), _SLOTS)
    cutting = np.repeat(~rapid, _SLOTS) & present & ~turning
    owners = np.repeat(moves, _SLOTS)
    speed[cutting] = _feeds(program, owners[cutting], limits)
    speed[turning] = limits.angular_limits[0]

    junction = np.full((len(moves), _SLOTS), np.inf)
    junction[:, 0] = _junction_speeds(program, corners, moves, start, rests, limits, stop_everywhere)
    junction_before = junction.reshape(m)

    keep = np.flatnonzero(present)
    # the junction before an element that is kept is the slowest of those since the element kept before it
    begin = np.concatenate(([0], keep[:-1] + 1)) if len(keep) else keep
    slowest = np.minimum.reduceat(junction_before[: keep[-1] + 1], begin) if len(keep) else np.zeros(0)
    changes = turning[keep]
    slowest[1:][changes[1:] != changes[:-1]] = 0.0
    slowest[:1] = 0.0
    path = Path(
        program=program,
        corners=corners,
        settings=settings,
        kind=_kinds(program, moves, rests)[keep],
        turning=changes,
        start=np.repeat(start, _SLOTS)[keep],
        move=owners[keep],
        corner=corner.reshape(m)[keep],
        span=span[keep],
        axis_span=axis_span[keep],
        length=np.where(turning, angles, lengths)[keep],
        speed=speed[keep],
        rapid=np.repeat(rapid, _SLOTS)[keep],
        junction_speed=np.concatenate((slowest, [0.0])),
        run_pieces=pieces,
    )
    if runs is None or not len(runs):
        return path
    feeds = np.zeros(len(program))
    inside = moves[np.isin(moves, np.delete(runs.pose, np.cumsum(runs.count) - runs.count))]
    feeds[inside] = _feeds(program, inside, limits)
    return along_runs(path, runs, feeds, limits.angular_limits[0])


def line_axes(
    program: Program, axis_length: float, start: Ints, end: Ints, fraction: Floats, axis_fraction: Floats
) -> Floats:
    """Axis (m, 3) on the ruled motion: from a point of the tip segment to a point of the axis-point segment.

    The fractions differ on lines between transitions of the paper's method, which trims the two segments differently.
    """
    axis, tip = program.axis, program.tip
    turned = (1.0 - axis_fraction)[:, None] * axis[start] + axis_fraction[:, None] * axis[end]
    ahead = (axis_fraction - fraction)[:, None] * (tip[end] - tip[start])
    lever = axis_length * turned + ahead
    unit: Floats = lever / norm(lever)[:, None]
    return unit


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


@dataclass(frozen=True)
class _Rests:
    """What is left of k moves between the transitions at their ends.

    Parameters
    ----------
    leaving, reaching : (k,) int64
        Rows of the corners at their ends that are smoothed, or -1.
    piece : (k,) int64
        Rows of the curves that stand for whole moves, or -1.
    trims : (4, k) float64
        Fractions of the move that the transitions take: of the tip out and in, of the axis point out and in.
    length : (k,) float64, mm
    angle : (k,) float64, rad
    tangents : (2, k, 3) float64
        At the start and at the end.
    """

    leaving: Ints
    reaching: Ints
    piece: Ints
    trims: Floats
    length: Floats
    angle: Floats
    tangents: Floats


def _rests(
    program: Program,
    corners: Corners | None,
    settings: Settings,
    moves: Ints,
    start: Ints,
    pieces: RunPieces | None,
) -> _Rests:
    """What transitions and pieces leave of the moves."""
    n = len(program)
    entry = np.full(n, -1, np.int64)  # smoothed corner at a pose
    trims = np.zeros((4, len(moves)))
    if corners is not None:
        rows = np.flatnonzero(corners.smoothed)
        entry[corners.pose[rows]] = rows
    leaving = np.where(program.kind[moves] == Move.LINEAR, entry[start], -1)
    reaching = np.where(program.kind[moves] == Move.LINEAR, entry[moves], -1)
    if corners is not None:
        out, into = leaving >= 0, reaching >= 0
        trims[0, out], trims[1, into] = corners.trim_out[leaving[out]], corners.trim_in[reaching[into]]
        trims[2, out], trims[3, into] = corners.axis_trim_out[leaving[out]], corners.axis_trim_in[reaching[into]]

    tip_step = program.tip[moves] - program.tip[start]
    chord = norm(tip_step)
    arc = program.kind[moves] == Move.ARC
    along = chord * np.maximum(1.0 - trims[0] - trims[1], 0.0)
    ends = (
        line_axes(program, settings.axis_length, start, moves, tip, axis)
        for tip, axis in ((trims[0], trims[2]), (1.0 - trims[1], 1.0 - trims[3]))
    )
    turned = np.where(trims[2] + trims[3] < 1.0, angle_between(*ends), 0.0)
    tangents = np.zeros((2, len(moves), 3))
    tangents[:] = tip_step / np.maximum(chord, STANDSTILL)[:, None]
    if arc.any():
        along[arc], tangents[0, arc], tangents[1, arc] = arcs.shape(program, moves[arc])
    piece = np.full(n, -1, np.int64)
    if pieces is not None:
        piece[pieces.move] = np.arange(len(pieces.move))
    piece = piece[moves]
    bent = piece >= 0
    if pieces is not None and bent.any():
        own = piece[bent]
        along[bent], turned[bent] = pieces.length[own], pieces.angle[own]
        tangents[:, bent] = bezier_halves.end_tangents(pieces.tip[own])
    return _Rests(leaving, reaching, piece, trims, along, turned, tangents)


def _lengths(program: Program, corners: Corners | None, settings: Settings, rests: _Rests) -> tuple[Floats, Floats]:
    """(m,) lengths of the tip, mm, and angles of the axis, rad, of all slots."""
    half_length, half_turn = np.zeros((2, 0)), np.zeros((2, 0))
    if corners is not None:
        half_length, half_turn = bezier_halves.half_lengths(program, corners, settings.axis_length)
    tip_length, axis_angle = np.zeros((2, len(rests.length), _SLOTS))
    tip_length[:, 1], axis_angle[:, 1] = rests.length, rests.angle
    for slot, at, half in ((0, rests.leaving, 1), (2, rests.reaching, 0)):
        has = at >= 0
        tip_length[has, slot] = half_length[half, at[has]]
        axis_angle[has, slot] = half_turn[half, at[has]]
    return tip_length.reshape(-1), axis_angle.reshape(-1)


def _spans(trims: Floats) -> tuple[Floats, Floats]:
    """(m, 2) parts of curves and segments of all slots: of the tip, and of the axis point."""
    span = np.zeros((trims.shape[1], _SLOTS, 2))
    span[:, 0] = (0.5, 1.0)
    span[:, 2] = (0.0, 0.5)
    axis_span = span.copy()
    span[:, 1] = np.stack((trims[0], 1.0 - trims[1]), axis=-1)
    axis_span[:, 1] = np.stack((trims[2], 1.0 - trims[3]), axis=-1)
    return span.reshape(-1, 2), axis_span.reshape(-1, 2)


def _kinds(program: Program, moves: Ints, rests: _Rests) -> NDArray[np.uint8]:
    """(m,) kinds of all slots."""
    kind = np.tile(np.array([Kind.CURVE, Kind.LINE, Kind.CURVE], np.uint8), len(moves))
    kind[1::_SLOTS][program.kind[moves] == Move.ARC] = Kind.ARC
    kind[1::_SLOTS][rests.piece >= 0] = Kind.PIECE
    return kind


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
    feeds: Floats = feed / 60.0
    return feeds


def _junction_speeds(
    program: Program,
    corners: Corners | None,
    moves: Ints,
    start: Ints,
    rests: _Rests,
    limits: Limits,
    stop_everywhere: bool,
) -> Floats:
    """Largest speed at the start of every move."""
    speeds = np.zeros(len(moves))
    if stop_everywhere or len(moves) < 2:
        return speeds
    feeding = (program.kind[moves] == Move.LINEAR) | (program.kind[moves] == Move.ARC)
    # a statement that acts may be anywhere between the end of the last move and the end of this one
    told = np.concatenate(([0], np.cumsum(program.acted)))
    quiet = told[moves[1:] + 1] == told[moves[:-1] + 1]
    joined = feeding[1:] & feeding[:-1] & quiet
    if corners is not None:
        reversal = np.zeros(len(program), np.bool_)
        reversal[corners.pose[corners.status == Status.REVERSAL]] = True
        joined &= ~reversal[start[1:]]
    turn = norm(rests.tangents[0, 1:] - rests.tangents[1, :-1])  # 2·sin(α/2)
    with np.errstate(divide="ignore"):
        jump = limits.accel * limits.period / turn
    speeds[1:] = np.where(joined, jump, 0.0)
    speeds[rests.leaving >= 0] = np.inf
    return speeds
