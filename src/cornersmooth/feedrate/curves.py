"""The curved elements of a path, measured: halves of transitions, and pieces of the curves of runs and NC programs.

Halves of transitions (Boehm's knot insertion at u = ½ makes each a Bézier cubic) and pieces of runs are cubics; those
of an NC program may be of a higher degree. Coordinates are relative to an origin of each, so that short curves far from
that of the program keep their digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from cornersmooth.arrays.vectors import norm
from cornersmooth.feedrate.rational_curves import (
    STANDSTILL,
    WHOLE,
    evaluate,
    groups,
    interval_borders,
    interval_lengths,
    polynomial,
    slowest,
    turned_angle,
)
from cornersmooth.geometry import nurbs
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Corners, Floats, Ints, Program, Runs
from cornersmooth.smoothing.runs.polylines import Pieces
from cornersmooth.smoothing.runs.rows import polylines_of

#: speed of the tip over that of the axis point below which the tip stands
_STANDING = 3e-4


@dataclass(frozen=True)
class Curves:
    """Curved elements, k rows."""

    #: (k, d + 1, 4): powers of t of w·P and w, as in `polynomial`, relative to `origin`
    tip: Floats
    axis_point: Floats
    origin: Floats  #: (k, 3) mm
    #: (k,): 0 and 1 for the halves of a transition, `WHOLE` for a piece of a run or of a curve of an NC program
    half: Ints
    move: Ints  #: (k,): pose that the move of each ends in
    span: Floats  #: (k, 2): part of the move
    inner: Bools  #: (k,): it goes on where another element ends, with the same tangent and curvature
    corner: Ints  #: (k,): row of the corners for halves of transitions, else -1
    resting: Bools  #: (k,): halves of transitions between a motion of the tip and a turn on the spot
    #: (k,): of the tip, mm; that the axis turns, rad, where the tip stands still
    length: Floats
    angle: Floats

    def __len__(self) -> int:
        return len(self.half)

    @classmethod
    def measured(
        cls,
        tip: Floats,
        axis_point: Floats,
        origin: Floats,
        move: Ints,
        *,
        half: Ints | None = None,
        span: Floats | None = None,
        inner: Bools | None = None,
        corner: Ints | None = None,
        resting: Bools | None = None,
    ) -> Curves:
        """Measure curves; by default they are whole moves.

        Where the tip comes all but to a stand beside the turning axis, its way says nothing: the piece is a turn on the
        spot, of length 0.
        """
        count = len(tip)
        half = np.full(count, WHOLE) if half is None else half
        length, angle = np.zeros(count), np.zeros(count)
        for rows in groups(np.arange(count)):
            length[rows] = interval_lengths(tip[rows], interval_borders(half[rows])).sum(axis=1)
            whole = rows[half[rows] == WHOLE]
            if len(whole):
                least = slowest(tip[whole])
                ends = np.tile([0.0, 1.0], (len(whole), 1))
                lever = evaluate(axis_point[whole], ends) - evaluate(tip[whole], ends)
                length[whole[least < _STANDING * norm(lever[:, 1] - lever[:, 0])]] = 0.0
            still = rows[length[rows] <= STANDSTILL]
            angle[still] = turned_angle(tip[still], axis_point[still], half[still])
        nothing = np.zeros(count, np.bool_)
        return cls(
            tip,
            axis_point,
            origin,
            half,
            move,
            np.tile([0.0, 1.0], (count, 1)) if span is None else span,
            nothing if inner is None else inner,
            np.full(count, -1) if corner is None else corner,
            nothing if resting is None else resting,
            length,
            angle,
        )

    @classmethod
    def joined(cls, parts: Sequence[Curves]) -> Curves:
        """All rows of parts of one degree."""
        if not parts:
            nothing = np.zeros((0, 4, 4))
            return cls.measured(nothing, nothing, np.zeros((0, 3)), np.zeros(0, np.int64))
        if len(parts) == 1:
            return parts[0]
        return cls(*(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(cls)))

    @classmethod
    def of_corners(
        cls, program: Program, corners: Corners, rows: Ints, half: Ints, move: Ints, height: float
    ) -> Curves:
        """First (0) or second (1) halves of the transitions of some corners, at the ends of the moves into poses."""
        pose = corners.pose[rows]
        origin, weights = program.tip[pose], corners.weights[rows]
        powers = np.zeros((2, len(rows), 4, 4))
        for some in groups(np.arange(len(rows))):
            for into, points in zip(powers, nurbs.control_points(program, corners, rows[some], height), strict=True):
                into[some] = polynomial(points - origin[some, None], weights[some], half[some])
        one, trims = np.ones(len(rows)), (corners.axis_trim_in[rows], corners.axis_trim_out[rows])
        legs = (
            corners.trim_in[rows] * norm(program.tip[pose] - program.tip[corners.before[rows]]),
            corners.trim_out[rows] * norm(program.tip[corners.after[rows]] - program.tip[pose]),
        )
        return cls.measured(
            powers[0],
            powers[1],
            origin,
            move,
            half=half,
            span=np.where(half[:, None] == 0, np.stack((1.0 - trims[0], one), 1), np.stack((0.0 * one, trims[1]), 1)),
            inner=np.ones(len(rows), np.bool_),
            corner=rows,
            resting=np.minimum(legs[0], legs[1]) <= STANDSTILL,
        )

    @classmethod
    def of_runs(cls, program: Program, runs: Runs, height: float) -> Curves:
        """Curves of whole runs, cut at all knots and poses."""
        lines = polylines_of(runs, program, height)
        splines = Splines(runs.knot, runs.knot_count)
        pieces = Pieces.of(splines, lines)
        origin = lines.point[pieces.segment, :3]
        hull = splines.bezier(runs.control, pieces.span, pieces.low, pieces.high) - np.tile(origin, 2)[:, None]
        s0, s1 = lines.s[pieces.segment], lines.s[pieces.segment + 1]
        first = np.isin(pieces.segment, np.cumsum(runs.count) - runs.count) & (pieces.low == s0)
        return cls.measured(
            polynomial(hull[..., :3]),
            polynomial(hull[..., 3:]),
            origin,
            runs.pose[pieces.segment + 1],
            span=np.stack((pieces.low - s0, pieces.high - s0), axis=1) / (s1 - s0)[:, None],
            inner=~first,
        )
