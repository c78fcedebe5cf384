"""The curved elements of a path, measured: halves of transitions, and pieces of the curves of runs and NC programs.

Halves of transitions (Boehm's knot insertion at u = ½ makes each a Bézier cubic) and pieces of runs are cubics; those
of an NC program may be of a higher degree. Coordinates are relative to an origin of each, so that short curves far from
that of the program keep their digits.

All are rational polynomials over t ∈ [0, 1]. Written in powers of t they are evaluated by Horner's rule, every curve at
parameters of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import comb

import numpy as np

from cornersmooth.arrays import joined_rows, norm, unit
from cornersmooth.geometry import nurbs
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Corners, Floats, Ints, Program, Runs
from cornersmooth.smoothing.runs.polylines import Pieces
from cornersmooth.smoothing.runs.rows import polylines_of

#: tip lengths up to this are no motion of the tip, mm
STANDSTILL = 1e-7

#: what stands for the half where a curve is no half of a transition
WHOLE = 2

#: curves worked on at once: their intermediate arrays fit the processor's cache
TOGETHER = 512

#: Bernstein coefficients of the five basis functions on the first half: Bézier point j is Σ w_i·P_i·_TO_BEZIER[j, i]
_TO_BEZIER = np.array([[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0.25, 0.5, 0.25, 0]])
_HALVES = np.stack((_TO_BEZIER, _TO_BEZIER[::-1, ::-1]))

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS

#: intervals of a half over which lengths are summed and curvature is bounded; shorter towards u = ½, where the curve
#: turns most
INTERVALS = 12
_PROGRESS = 1.0 - np.linspace(1.0, 0.0, INTERVALS + 1) ** 1.7
_NEWTON_STEPS = 3
#: points among which the slowest of a curve is searched for, and rounds of closer search
_SEARCHED, _ROUNDS = 25, 3
#: parameter beside an end at which the tangent is taken where there is none at the end itself
_BESIDE = 1e-3


def polynomial(points: Floats, weights: Floats | None = None, half: Ints | None = None) -> Floats:
    """Powers of t (g, d + 1, 4) of w·P and w; ``[:, k]`` belongs to t^k, the last coordinate is w.

    From Bézier points (g, d + 1, 3) with weights (g, d + 1), all 1 by default; or from the five control points of
    transitions (g, 5, 3), whose first (0) or second (1) `half` (g,) counts: t runs with u on both.
    """
    w = np.ones(points.shape[:2]) if weights is None else weights
    weighted = np.concatenate((points * w[..., None], w[..., None]), axis=-1)
    convert = _to_powers(points.shape[1] - 1) if half is None else (_to_powers(3) @ _HALVES)[half]
    return convert @ weighted


@cache
def _to_powers(degree: int) -> Floats:
    """(d + 1, d + 1) coefficients of t^k in the Bernstein polynomials of a degree."""
    return np.array(
        [
            [(-1) ** (k + i) * comb(degree, k) * comb(k, i) if i <= k else 0 for i in range(degree + 1)]
            for k in range(degree + 1)
        ],
        np.float64,
    )


def evaluate(powers: Floats, t: Floats) -> Floats:
    """(g, m, 3) points at the parameters t (g, m)."""
    return np.moveaxis(_derivatives(powers, t, 0)[0], 0, -1)


def end_tangents(powers: Floats, side: int) -> Floats:
    """Unit tangents (g, 3) at the start (0) or end (1); where the curve comes to a stand there, a little inside."""
    places = (0.0, _BESIDE) if side == 0 else (1.0, 1.0 - _BESIDE)
    slopes = [np.moveaxis(_derivatives(powers, np.full((len(powers), 1), t), 1)[1], 0, -1)[:, 0] for t in places]
    own, inside = (norm(slope)[:, None] for slope in slopes)
    return unit(np.where(own > _BESIDE * inside, slopes[0], slopes[1]))


def _derivatives(powers: Floats, t: Floats, order: int) -> list[Floats]:
    """Point and derivatives by t up to `order`, (3, g, m) each: coordinates first, so that arrays run along t."""
    by_coordinate = powers.transpose(2, 1, 0)[..., None]  # (4, power, g, 1)
    factor = np.ones(powers.shape[1])
    found: list[Floats] = []
    weights: list[Floats] = []
    rational = bool(by_coordinate[3, 1:].any())
    if not rational:  # w is 1 throughout
        by_coordinate = by_coordinate[:3]
    for derivative in range(order + 1):
        if derivative:
            factor = factor[1:] * np.arange(1, len(factor))
            by_coordinate = by_coordinate[:, 1:]
        value = by_coordinate[:, -1] * factor[-1]
        for k in range(len(factor) - 2, -1, -1):
            value = value * t + by_coordinate[:, k] * factor[k]
        if not rational:
            found.append(np.broadcast_to(value, (3, *t.shape)))
            continue
        weights.append(value[3])
        rest = value[:3]
        for k in range(1, derivative + 1):  # Leibniz' rule for w·P
            rest = rest - comb(derivative, k) * weights[k] * found[derivative - k]
        found.append(rest / weights[0])
    return found


def taylor_series(powers: Floats, t: Floats, orders: int) -> Floats:
    """Taylor coefficients (orders, g, 3) at one parameter (g,) of each curve."""
    found = _derivatives(powers, t[:, None], orders - 1)
    factorial = np.cumprod(np.maximum(np.arange(orders), 1))
    return np.stack([order[..., 0].T / size for order, size in zip(found, factorial, strict=True)])


def _size(vectors: Floats) -> Floats:
    """Length of vectors whose coordinates come first."""
    return np.sqrt(vectors[0] ** 2 + vectors[1] ** 2 + vectors[2] ** 2)


def interval_borders(half: Ints) -> Floats:
    """(g, INTERVALS + 1) parameters t that divide the halves, dense towards u = ½."""
    borders: Floats = np.where(half[:, None] == 0, _PROGRESS, 1.0 - _PROGRESS[::-1])
    borders[half == WHOLE] = np.linspace(0.0, 1.0, INTERVALS + 1)
    return borders


def interval_lengths(powers: Floats, borders: Floats) -> Floats:
    """Arc lengths (g, p) between neighbouring parameters `borders` (g, p + 1), by Gauss-Legendre with 5 points."""
    step = np.diff(borders, axis=1)
    t = borders[:, :-1, None] + step[..., None] * _NODES
    speed = _size(_derivatives(powers, t.reshape(len(t), -1), 1)[1]).reshape(t.shape)
    return np.einsum("gpn,n->gp", speed, _WEIGHTS) * step


def slowest(powers: Floats) -> Floats:
    """Least speed (g,) of curves by their parameter, mm; sampled, and sampled again ever more closely."""
    rows, low, high = np.arange(len(powers)), np.zeros(len(powers)), np.ones(len(powers))
    for _ in range(_ROUNDS):
        t = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _SEARCHED)
        speed = np.broadcast_to(_size(_derivatives(powers, t, 1)[1]), t.shape)
        at = speed.argmin(axis=1)
        low, high = t[rows, np.maximum(at - 1, 0)], t[rows, np.minimum(at + 1, _SEARCHED - 1)]
    return speed[rows, at]


def parameters_at(powers: Floats, half: Ints, which: Ints, distance: Floats) -> Floats:
    """Parameters t (q,) at arc length `distance` (q,) from the start of the halves `which` (q,)."""
    borders = interval_borders(half)
    lengths = np.concatenate((np.zeros((len(powers), 1)), np.cumsum(interval_lengths(powers, borders), axis=1)), axis=1)
    interval = np.clip((lengths[which] <= distance[:, None]).sum(axis=1) - 1, 0, INTERVALS - 1)
    low, high = borders[which, interval], borders[which, interval + 1]
    missing = distance - lengths[which, interval]
    whole = np.maximum(lengths[which, interval + 1] - lengths[which, interval], np.finfo(np.float64).tiny)
    t = low + (high - low) * np.clip(missing / whole, 0.0, 1.0)
    curves = powers[which]
    for _ in range(_NEWTON_STEPS):
        gone = interval_lengths(curves, np.stack((low, t), axis=1))[:, 0]
        speed = _size(_derivatives(curves, t[:, None], 1)[1])[:, 0]
        t = np.clip(t + (missing - gone) / np.maximum(speed, np.finfo(np.float64).tiny), low, high)
    return t


def turned_angle(tip: Floats, axis_point: Floats, half: Ints) -> Floats:
    """Angle (g,) that the axis sweeps over each half, rad."""
    borders = interval_borders(half)
    lever = evaluate(axis_point, borders) - evaluate(tip, borders)
    axis = lever / norm(lever)[..., None]
    step = norm(np.diff(axis, axis=1))
    return (2.0 * np.arcsin(np.minimum(0.5 * step, 1.0))).sum(axis=1)


def groups(rows: Ints) -> list[Ints]:
    """Rows in groups that are worked on at once."""
    return [rows[at : at + TOGETHER] for at in range(0, len(rows), TOGETHER)]


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

    def __len__(self) -> int:
        return len(self.half)

    @cached_property
    def measured(self) -> tuple[Floats, Floats]:
        """(k,) lengths of the tip, mm, and angles that the axis turns where the tip stands still, rad.

        Where the tip comes all but to a stand beside the turning axis, its way says nothing: the piece is a turn on the
        spot, of length 0.
        """
        tip, axis_point, half = self.tip, self.axis_point, self.half
        length, angle = np.zeros((2, len(self)))
        for rows in groups(np.arange(len(self))):
            length[rows] = interval_lengths(tip[rows], interval_borders(half[rows])).sum(axis=1)
            whole = rows[half[rows] == WHOLE]
            if len(whole):
                least = slowest(tip[whole])
                ends = np.tile([0.0, 1.0], (len(whole), 1))
                lever = evaluate(axis_point[whole], ends) - evaluate(tip[whole], ends)
                length[whole[least < _STANDING * norm(lever[:, 1] - lever[:, 0])]] = 0.0
            still = rows[length[rows] <= STANDSTILL]
            angle[still] = turned_angle(tip[still], axis_point[still], half[still])
        return length, angle

    @classmethod
    def pieces(
        cls,
        tip: Floats,
        axis_point: Floats,
        origin: Floats,
        move: Ints,
        span: Floats | None = None,
        inner: Bools | None = None,
    ) -> Curves:
        """Pieces of runs, or of curves of NC programs, from powers of tip and axis point; whole moves by default."""
        count, nothing = len(move), np.zeros(len(move), np.bool_)
        span = np.tile([0.0, 1.0], (count, 1)) if span is None else span
        inner = nothing if inner is None else inner
        return cls(tip, axis_point, origin, np.full(count, WHOLE), move, span, inner, np.full(count, -1), nothing)

    @classmethod
    def joined(cls, parts: Sequence[Curves]) -> Curves:
        """All rows of parts of one degree."""
        if parts:
            return joined_rows(parts)
        nothing = np.zeros((0, 4, 4))
        return cls.pieces(nothing, nothing, np.zeros((0, 3)), np.zeros(0, np.int64))

    @classmethod
    def of_corners(
        cls, program: Program, corners: Corners, rows: Ints, half: Ints, move: Ints, height: float
    ) -> Curves:
        """First (0) or second (1) halves of the transitions of some corners, at the ends of the moves into poses."""
        pose = corners.pose[rows]
        origin = program.tip[pose]
        powers = np.zeros((2, len(rows), 4, 4))
        for some in groups(np.arange(len(rows))):
            for into, points in zip(powers, nurbs.control_points(program, corners, rows[some], height), strict=True):
                into[some] = polynomial(points - origin[some, None], half=half[some])
        one, trims = np.ones(len(rows)), (corners.axis_trim_in[rows], corners.axis_trim_out[rows])
        legs = (
            corners.trim_in[rows] * norm(program.tip[pose] - program.tip[corners.before[rows]]),
            corners.trim_out[rows] * norm(program.tip[corners.after[rows]] - program.tip[pose]),
        )
        span = np.where(half[:, None] == 0, np.stack((1.0 - trims[0], one), 1), np.stack((0.0 * one, trims[1]), 1))
        resting = np.minimum(legs[0], legs[1]) <= STANDSTILL
        return cls(powers[0], powers[1], origin, half, move, span, np.ones(len(rows), np.bool_), rows, resting)

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
        return cls.pieces(
            polynomial(hull[..., :3]),
            polynomial(hull[..., 3:]),
            origin,
            runs.pose[pieces.segment + 1],
            span=np.stack((pieces.low - s0, pieces.high - s0), axis=1) / (s1 - s0)[:, None],
            inner=~first,
        )
