"""Limits of what moves along with the tip: its whole jerk, the turning of the tool axis, the axes of a machine.

A vector q(s) on the path moves with q₁·√z, q₂·z + q₁·z′/2 and √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2) (see `barrier`). The
lengths of q₁, q₂, q₃ bound these from above whatever their directions, and over a short piece of the path their largest
values do; with several vectors the largest demand counts term by term. That is on the safe side, and keeps every limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.feedrate import halves
from cornersmooth.feedrate.caps import Caps
from cornersmooth.feedrate.joints import Joints
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.motion import derivatives
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.neighbours import norm

#: pieces of a line or arc
PIECES = 4
#: pieces on either side of the nearest point to the pole of a machine, and the first of them over the way on which the
#: pole is felt
POLE_PIECES, FIRST_PIECE = 40, 0.05
#: the cone in which demands do without exact derivatives, over that of the machine: its edge lies outside for certain
WITHIN = 0.5
#: places inside every piece at which derivatives are looked at
_INNER = np.array([0.25, 0.5, 0.75])
#: elements looked at together
_BLOCK = 4096


@dataclass(frozen=True)
class AxisLimits:
    """Limits of an axis, or of several as one vector.

    Parameters
    ----------
    position : callable
        Position as a function of tip and tool axis: takes their jets, two (4, m, 3) arrays of Taylor coefficients as in
        `jets`, and returns the jet of the position, (4, m, d). With the operations of `jets` derivatives come by
        themselves; for X, Y and Z of a three-axis machine it is ``lambda tip, axis: tip[..., [0]]`` and so on.
    speed, accel, jerk : float
        Limits of its length, per s, s² and s³; inf for none.
    """

    position: Callable[[Floats, Floats], Floats]
    speed: float = math.inf
    accel: float = math.inf
    jerk: float = math.inf


def _tip(tip: Floats, axis: Floats) -> Floats:
    return tip


def _tool_axis(tip: Floats, axis: Floats) -> Floats:
    return axis


@dataclass(frozen=True)
class Demands:
    """Coefficients over intervals of the path coordinate, in the names of `barrier.Batch`.

    Parameters
    ----------
    caps : Caps
        The intervals and their bounds of v², which keep the speed limits and, at steady speed, all others.
    accel_slope, accel_level, jerk_bend, jerk_slope, jerk_level : (k,) float64
    """

    caps: Caps
    accel_slope: Floats
    accel_level: Floats
    jerk_bend: Floats
    jerk_slope: Floats
    jerk_level: Floats

    @property
    def rows(self) -> Floats:
        """(5, k) all coefficients."""
        return np.stack((self.accel_slope, self.accel_level, self.jerk_bend, self.jerk_slope, self.jerk_level))


#: first three derivatives (m, d) of d axes at places (m,) on elements (m,)
Orders = Callable[[Ints, Floats], tuple[Floats, Floats, Floats]]


def find_demands(
    path: Path, limits: Limits, caps: Caps, axes: Sequence[AxisLimits] = (), joints: Joints | None = None
) -> Demands | None:
    """Demands of the limits that go beyond those of the path speed; None where there are none.

    Transitions between a motion of the tip and a turn on the spot are left out but for the jerk of the tip: by the way
    of the tip the derivatives of everything else have no bound there.
    """
    if not len(path):
        return None
    steady = ~_stalling(path)
    vectors = [
        (AxisLimits(_tip, *limits.vector_limits[0]), ~path.turning),
        (AxisLimits(_tool_axis, *limits.vector_limits[1]), ~path.turning & steady),
        *((item, steady) for item in axes),
    ]
    given: list[tuple[Orders, Floats, Bools]] = [
        (_orders(path, item), np.array([[item.speed], [item.accel], [item.jerk]]), where) for item, where in vectors
    ]
    close = np.zeros(len(path), np.bool_)
    if joints is not None:
        joints = replace(joints, cone=WITHIN * joints.cone)
        given.append((_signed(joints), joints.limits, steady))
        close = joints.near_pole() & steady
    given = [(orders, bounds, where) for orders, bounds, where in given if np.isfinite(bounds).any()]
    if not given:
        return None
    curved = (path.kind == Kind.CURVE) & ~path.turning
    asked = np.logical_or.reduce([where for _, _, where in given])
    count = np.where(asked, np.where(close, 2 * POLE_PIECES, np.where(curved, halves.PIECES, PIECES)), 1)
    begin = np.concatenate(([0], np.cumsum(count)))
    total = int(begin[-1])
    width, cap = np.repeat(path.length, count), np.full(total, np.inf)
    rows = np.zeros((5, total))
    for curve in (True, False):
        for near in (True, False):
            chosen = np.flatnonzero(asked & (curved == curve) & (close == near))
            for at in range(0, len(chosen), _BLOCK // 8 if near else _BLOCK):
                element = chosen[at : at + (_BLOCK // 8 if near else _BLOCK)]
                graded = _around(*joints.closest(element)) if joints is not None and near else None
                borders, share = _borders(path, element, curve, graded)
                into = begin[element][:, None] + np.arange(borders.shape[1] - 1)
                width[into] = share * path.length[element][:, None]
                for orders, bounds, where in given:
                    counts = where[element][:, None]
                    if not counts.any():
                        continue
                    bound, row = _judge(element, borders, orders, bounds)
                    cap[into] = np.minimum(cap[into], np.where(counts, bound, np.inf))
                    rows[:, into] = np.maximum(rows[:, into], np.where(counts, row, 0.0))
    edge = np.concatenate(([0.0], np.cumsum(width)))
    return Demands(Caps(edge=edge, cap=cap, run=begin[caps.element], element=caps.element), *rows)


def _orders(path: Path, item: AxisLimits) -> Orders:
    def orders(element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
        one, two, three = derivatives(path, element, share, item.position)
        return one[:, None], two[:, None], three[:, None]

    return orders


def _signed(joints: Joints) -> Orders:
    def orders(element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
        return joints.orders(element, share)[1:]

    return orders


def _stalling(path: Path) -> Bools:
    """(m,) bool: halves of transitions between a motion of the tip and a turn on the spot."""
    stalling = np.zeros(len(path), np.bool_)
    corners = path.corners
    if corners is None:
        return stalling
    curves = np.flatnonzero((path.kind == Kind.CURVE) & ~path.turning)
    row = path.corner[curves]
    tip = path.program.tip
    legs = (
        (corners.trim_in[row], tip[corners.pose[row]] - tip[corners.before[row]]),
        (corners.trim_out[row], tip[corners.after[row]] - tip[corners.pose[row]]),
    )
    for trim, step in legs:
        stalling[curves] |= trim * norm(step) <= halves.STANDSTILL
    return stalling


def _around(closest: Floats, felt: Floats) -> Floats:
    """Borders (g, p + 1) of pieces that grow on either side of the place nearest to the pole."""
    smallest = FIRST_PIECE * felt[:, None]
    steps = np.linspace(0.0, 1.0, POLE_PIECES + 1)
    away = smallest * np.sinh(steps * np.arcsinh(1.0 / smallest))
    both = np.concatenate((closest[:, None] - away[:, :0:-1], closest[:, None] + away), axis=1)
    borders: Floats = np.clip(both, 0.0, 1.0)
    return borders


def _borders(path: Path, element: Ints, curve: bool, given: Floats | None) -> tuple[Floats, Floats]:
    """Parameters that divide elements, and the shares of their length between them."""
    if not curve:
        borders = np.tile(np.linspace(0.0, 1.0, PIECES + 1), (len(element), 1)) if given is None else given
        return borders, np.diff(borders, axis=1)
    half = (path.span[element, 0] > 0.0).astype(np.int64)
    corners = path.corners
    if corners is None:
        raise ValueError("a direct path has no curves")
    tip, _ = halves.corner_halves(path.program, corners, path.corner[element], half, path.settings.axis_length)
    borders = halves.pieces(half) if given is None else given
    lengths = halves.piece_lengths(tip, borders)
    return borders, lengths / lengths.sum(axis=1, keepdims=True)


def _judge(element: Ints, borders: Floats, orders: Orders, bounds: Floats) -> tuple[Floats, Floats]:
    """Bounds of v² (g, p) and coefficients (5, g, p) from samples at the ends and inside every piece."""
    step = np.diff(borders, axis=1)
    inner = borders[:, :-1, None] + step[..., None] * _INNER
    share = np.concatenate((borders, inner.reshape(len(borders), -1)), axis=1)
    found = orders(np.repeat(element, share.shape[1]), share.ravel())
    one, two, three = _largest(found, share.shape, step.shape[1])
    speed, accel, jerk = bounds
    with np.errstate(divide="ignore"):
        steady = np.minimum(np.minimum((speed / one) ** 2, accel / two), np.cbrt(jerk / three) ** 2)
    rows = np.stack((0.5 * one / accel, two / accel, one / jerk, 1.5 * two / jerk, three / jerk))
    return steady.min(axis=-1), rows.max(axis=-1)


def _largest(orders: tuple[Floats, Floats, Floats], shape: tuple[int, ...], pieces: int) -> list[Floats]:
    """Largest amounts (g, p, d) in every piece; not at an end where the tip comes to a stand and they are infinite.

    Between two samples a smooth function exceeds them by at most an eighth of its second difference.
    """
    largest = []
    for order in orders:
        values = order.reshape(*shape, -1)
        ends, inner = (
            values[:, : pieces + 1, None],
            values[:, pieces + 1 :].reshape(len(values), pieces, len(_INNER), -1),
        )
        along = np.concatenate((ends[:, :-1], inner, ends[:, 1:]), axis=2)
        known = np.isfinite(along).all(axis=2)
        along = np.where(np.isfinite(along), along, 0.0)
        between = np.abs(np.diff(along, n=2, axis=2)).max(axis=2) / 8.0
        largest.append(np.abs(along).max(axis=2) + np.where(known, between, 0.0))
    return largest
