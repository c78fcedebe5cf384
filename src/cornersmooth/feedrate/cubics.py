"""Curved elements of a path as rational polynomials over t ∈ [0, 1].

Halves of transitions and pieces of the curves of runs are cubics; those of an NC text may be of a higher degree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cornersmooth.feedrate import bezier_halves
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints, Program, Runs
from cornersmooth.smoothing.runs.polylines import Pieces
from cornersmooth.smoothing.runs.rows import polylines_of
from cornersmooth.vectors import norm

if TYPE_CHECKING:
    from cornersmooth.feedrate.path import Path

#: what stands for the half where a cubic is a piece of a run
WHOLE = 2

#: part of its mean speed below which the tip of a piece is slow
_SLOW = 0.8

#: speed of the tip over that of the axis point below which the tip stands
_STANDING = 3e-4

#: pieces measured together
_GROUP = 4096


class Cubics(NamedTuple):
    """Curved elements, g rows.

    Parameters
    ----------
    tip, axis_point : (g, d + 1, 4) float64
        Powers of t of w·P and w, as in `bezier_halves.half_curves`, relative to `origin`.
    half : (g,) int64
        0 and 1 for the halves of a transition, `WHOLE` for a piece of a run or of a curve of a text.
    origin : (g, 3) float64, mm
    """

    tip: Floats
    axis_point: Floats
    half: Ints
    origin: Floats


@dataclass(frozen=True)
class RunPieces:
    """Curves of whole runs, or of a text, cut at all knots and poses, p pieces in path order.

    Parameters
    ----------
    tip, axis_point : (p, d + 1, 4) float64
    origin : (p, 3) float64, mm
        As for `Cubics`.
    move : (p,) int64
        Pose that the segment of each piece ends in.
    fraction : (p, 2) float64
        Part of the segment.
    length, angle : (p,) float64
        Of the tip, mm; that the axis turns, rad, where the tip stands still.
    inner : (n,) bool
        Poses of the program that a run leads through.
    """

    tip: Floats
    axis_point: Floats
    origin: Floats
    move: Ints
    fraction: Floats
    length: Floats
    angle: Floats
    inner: Bools

    @classmethod
    def of(cls, program: Program, runs: Runs, axis_length: float) -> RunPieces:
        """Cut the curves and measure the pieces."""
        lines = polylines_of(runs, program.tip, program.tip + axis_length * program.axis)
        splines = Splines(runs.knot, runs.knot_count)
        pieces = Pieces.of(splines, lines)
        origin = lines.point[pieces.segment, :3]
        hull = splines.bezier(runs.control, pieces.span, pieces.low, pieces.high)
        tip, axis_point = (
            bezier_halves.polynomial(hull[..., part] - origin[:, None]) for part in (slice(0, 3), slice(3, 6))
        )
        length, angle = measured(tip, axis_point)
        s0, s1 = lines.s[pieces.segment], lines.s[pieces.segment + 1]
        fraction = np.stack((pieces.low - s0, pieces.high - s0), axis=1) / (s1 - s0)[:, None]
        inner = np.zeros(len(program), np.bool_)
        inner[runs.pose] = True
        ends = np.cumsum(runs.count)
        inner[runs.pose[ends - 1]] = inner[runs.pose[ends - runs.count]] = False
        return cls(tip, axis_point, origin, runs.pose[pieces.segment + 1], fraction, length, angle, inner)


def measured(tip: Floats, axis_point: Floats) -> tuple[Floats, Floats]:
    """Lengths of the tip (p,) on whole pieces, mm, and angles that the axis turns (p,), rad, where the tip stands.

    Where the tip comes all but to a stand beside the turning axis, nothing can be said by its way: the piece is a turn
    on the spot, of length 0.
    """
    length, angle = np.zeros(len(tip)), np.zeros(len(tip))
    for at in range(0, len(tip), _GROUP):
        rows = np.arange(at, min(at + _GROUP, len(tip)))
        half = np.full(len(rows), WHOLE)
        length[rows] = bezier_halves.interval_lengths(tip[rows], bezier_halves.interval_borders(half)).sum(axis=1)
        _, slowest, _ = bezier_halves.slowest(tip[rows])
        ends = np.tile([0.0, 1.0], (len(rows), 1))
        lever = bezier_halves.evaluate(axis_point[rows], ends) - bezier_halves.evaluate(tip[rows], ends)
        length[rows[slowest.min(axis=1) < _STANDING * norm(lever[:, 1] - lever[:, 0])]] = 0.0
        still = rows[length[rows] <= bezier_halves.STANDSTILL]
        angle[still] = bezier_halves.turned_angle(tip[still], axis_point[still], half[: len(still)])
    return length, angle


def cubics(path: Path, element: Ints) -> Cubics:
    """The cubics of some curved elements of a path."""
    from cornersmooth.feedrate.path import Kind

    corners, runs = path.corners, path.run_pieces
    half = (path.span[element, 0] > 0.0).astype(np.int64)
    height, row = path.settings.axis_length, path.corner[element]
    whole = path.kind[element] == Kind.PIECE
    half[whole] = WHOLE
    if runs is not None and whole.all():
        return Cubics(runs.tip[row], runs.axis_point[row], half, runs.origin[row])
    if corners is None:
        raise ValueError("a direct path has no transitions")
    if runs is None:
        tip, axis_point = bezier_halves.corner_halves(path.program, corners, row, half, height)
        return Cubics(tip, axis_point, half, path.program.tip[corners.pose[row]])
    tip, axis_point, origin = np.zeros((len(row), 4, 4)), np.zeros((len(row), 4, 4)), np.zeros((len(row), 3))
    tip[whole], axis_point[whole], origin[whole] = (
        values[row[whole]] for values in (runs.tip, runs.axis_point, runs.origin)
    )
    own = row[~whole]
    tip[~whole], axis_point[~whole] = bezier_halves.corner_halves(path.program, corners, own, half[~whole], height)
    origin[~whole] = path.program.tip[corners.pose[own]]
    return Cubics(tip, axis_point, half, origin)


def curved(path: Path) -> Bools:
    """(m,) bool: elements that are cubics."""
    from cornersmooth.feedrate.path import Kind

    chosen: Bools = (path.kind == Kind.CURVE) | (path.kind == Kind.PIECE)
    return chosen


def stalling(path: Path) -> Bools:
    """(m,) bool: pieces of runs and of texts on which the tip gets much slower, by their parameter, than it is."""
    from cornersmooth.feedrate.path import Kind

    found = np.zeros(len(path), np.bool_)
    runs = path.run_pieces
    rows = np.flatnonzero((path.kind == Kind.PIECE) & ~path.turning)
    if runs is None:
        return found
    for at in range(0, len(rows), _GROUP):
        some = rows[at : at + _GROUP]
        _, least, _ = bezier_halves.slowest(runs.tip[path.corner[some]])
        found[some] = least.min(axis=1) < _SLOW * path.length[some]
    return found


def along_runs(path: Path, runs: Runs | None, feeds: Floats, angular: float) -> Path:
    """Put the pieces of runs in the places of the lines that they replace.

    Parameters
    ----------
    feeds : (n,) float64, mm/s
        Of the moves into all poses; read for the moves of runs only.
    angular : float, rad/s
        Speed of turns on the spot.
    """
    from cornersmooth.feedrate.path import NO_TURN, Kind

    if runs is None or not len(runs):
        return path
    pieces = RunPieces.of(path.program, runs, path.settings.axis_length)
    first = np.zeros(len(path.program) + 1, np.int64)
    count = np.bincount(pieces.move, minlength=len(path.program))
    first[1:] = np.cumsum(count)
    own = (count[path.move] > 0) & (path.kind == Kind.LINE)
    number = np.where(own, count[path.move], 1)
    element = np.repeat(np.arange(len(path)), number)
    place = np.arange(len(element)) - np.repeat(np.cumsum(number) - number, number)
    mine = own[element]
    piece = np.where(mine, first[path.move[element]] + place, -1)
    row = piece[mine]

    kind, corner, turning = path.kind[element], path.corner[element], path.turning[element]
    span, length, speed = path.span[element], path.length[element], path.speed[element]
    kind[mine], corner[mine], span[mine] = Kind.PIECE, row, pieces.fraction[row]
    turning[mine] = pieces.length[row] <= bezier_halves.STANDSTILL
    length[mine] = np.where(turning[mine], pieces.angle[row], pieces.length[row])
    speed[mine] = np.where(turning[mine], angular, feeds[path.move[element[mine]]])
    inside = mine & ((place > 0) | pieces.inner[path.start[element]])
    # from turn to turn on the spot the axis may change its rate: the machine says how fast that may be passed
    turns = turning & np.concatenate(([False], turning[:-1]))
    junction = np.where(inside, np.where(turns, angular, np.inf), path.junction_speed[element])

    keep = np.flatnonzero(~mine | ~turning | (length > NO_TURN))
    begin = np.concatenate(([0], keep[:-1] + 1))
    slowest = np.minimum.reduceat(junction[: keep[-1] + 1], begin)
    changes = turning[keep]
    slowest[1:][changes[1:] != changes[:-1]] = 0.0
    slowest[0] = 0.0
    return replace(
        path,
        kind=kind[keep],
        turning=changes,
        start=path.start[element][keep],
        move=path.move[element][keep],
        corner=corner[keep],
        span=span[keep],
        axis_span=np.where(mine[:, None], span, path.axis_span[element])[keep],
        length=length[keep],
        speed=speed[keep],
        rapid=path.rapid[element][keep],
        junction_speed=np.append(slowest, 0.0),
        run_pieces=pieces,
    )
