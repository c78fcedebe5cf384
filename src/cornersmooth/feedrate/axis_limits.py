"""Limits of what moves along with the tip: its whole jerk, the turning of the tool axis, the axes of a machine.

A vector q(s) on the path moves with q₁·√z, q₂·z + q₁·z′/2 and √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2) (see `interior_point`).
The lengths of q₁, q₂, q₃ bound these from above whatever their directions, and over a short interval of the path their
largest values do. With several vectors the largest coefficient counts, term by term. The bounds may be higher than
needed, never lower: every limit is kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cornersmooth.feedrate import bezier_halves
from cornersmooth.feedrate.cubics import cubics, curved, stalling
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.machine_axes import MachineAxes
from cornersmooth.feedrate.motion import derivatives
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.feedrate.speed_limits import SpeedLimits
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.vectors import norm

#: intervals of a line or arc
INTERVALS = 4
#: intervals on either side of the point nearest to the pole of a machine, and the first of them over the way on which
#: the pole is felt
POLE_INTERVALS, FIRST_INTERVAL = 40, 0.05
#: the cone at the pole in which derivatives are cut off here, over the cone of the machine: smaller, to be safe
WITHIN = 0.5
#: points inside every interval at which derivatives are looked at
_INNER = np.array([0.25, 0.5, 0.75])
#: elements looked at together
_TOGETHER = 4096
#: most that parabolas may miss of derivatives where the tip all but stands
_EVEN = 0.05
#: what parabolas miss at most, over what they miss at the quarters
_MISSED = 2.0


@dataclass(frozen=True)
class AxisLimits:
    """Limits of an axis, or of several as one vector.

    Parameters
    ----------
    position : callable
        Position as a function of tip and tool axis: takes their Taylor series, two (4, m, 3) arrays as in
        `taylor`, and returns that of the position, (4, m, d). With the operations of `taylor` derivatives come by
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


Singles = NDArray[np.float32]


@dataclass(frozen=True)
class AxisSamples:
    """Derivatives of the axes of a machine, signs and all, at start, middle and end of the same intervals.

    Parameters
    ----------
    value : (3, d, k, 3) float32
        First, second and third derivative of every axis.
    missed : (3, d, k) float32
        By how much the parabolas through these three miss what was seen between them.
    middle : (k,) float64
        Share of the length of an interval that is before its middle.
    known : (k,) bool
        Whether all derivatives are finite.
    accel, jerk : (d,) float64
        Limits of the axes, inf for none.
    """

    value: Singles
    missed: Singles
    middle: Floats
    known: Bools
    accel: Floats
    jerk: Floats


@dataclass(frozen=True)
class LimitCoefficients:
    """Coefficients over intervals of the path coordinate, in the names of `speed_problem.Batch`.

    Parameters
    ----------
    speed_limits : SpeedLimits
        The intervals and their bounds of v², which keep the speed limits and, at steady speed, all others.
    accel_slope, accel_level, jerk_bend, jerk_slope, jerk_level : (k,) float64
    others : LimitCoefficients or None
        The same without the axes of the machine, which then have only their speed in it.
    samples : AxisSamples or None
        What is known of the axes of the machine besides.
    """

    speed_limits: SpeedLimits
    accel_slope: Floats
    accel_level: Floats
    jerk_bend: Floats
    jerk_slope: Floats
    jerk_level: Floats
    others: LimitCoefficients | None = None
    samples: AxisSamples | None = None

    @property
    def rows(self) -> Floats:
        """(5, k) all coefficients."""
        return np.stack((self.accel_slope, self.accel_level, self.jerk_bend, self.jerk_slope, self.jerk_level))


#: first three derivatives (m, d) of d axes at points (m,) on elements (m,)
Orders = Callable[[Ints, Floats], tuple[Floats, Floats, Floats]]


def find_limit_coefficients(
    path: Path,
    limits: Limits,
    speed_limits: SpeedLimits,
    axes: Sequence[AxisLimits] = (),
    machine_axes: MachineAxes | None = None,
) -> LimitCoefficients | None:
    """Coefficients of the limits that go beyond those of the path speed; None where there are none.

    Transitions between a motion of the tip and a turn on the spot are left out but for the jerk of the tip: by the way
    of the tip the derivatives of everything else have no bound there. Pieces of runs and of texts on which the tip all
    but stands while the axis turns are looked at closely where it is slowest.
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
    slow = stalling(path)
    close = slow.copy()
    own_bounds = np.full((3, 0), np.inf) if machine_axes is None else machine_axes.limits
    if machine_axes is not None:
        machine_axes = replace(machine_axes, cone=WITHIN * machine_axes.cone)
        given.append((_signed(machine_axes), own_bounds, steady))
        close |= machine_axes.near_pole() & steady
    given = [(orders, bounds, where) for orders, bounds, where in given if np.isfinite(bounds).any()]
    if not given:
        return None
    bent = curved(path) & ~path.turning
    asked = np.logical_or.reduce([where for _, _, where in given])
    count = np.where(asked, np.where(close, 2 * POLE_INTERVALS, np.where(bent, bezier_halves.INTERVALS, INTERVALS)), 1)
    begin = np.concatenate(([0], np.cumsum(count)))
    total = int(begin[-1])
    width, cap = np.repeat(path.length, count), np.full(total, np.inf)
    rows = np.zeros((5, total))
    other_cap, other_rows = cap.copy(), rows.copy()
    value = np.zeros((3, own_bounds.shape[1], total, 3), np.float32)
    missed = np.zeros(value.shape[:-1], np.float32)
    middle, known = np.full(total, 0.5), np.ones(total, np.bool_)
    for curve in (True, False):
        for near in (True, False):
            chosen = np.flatnonzero(asked & (bent == curve) & (close == near))
            for at in range(0, len(chosen), _TOGETHER // 8 if near else _TOGETHER):
                element = chosen[at : at + (_TOGETHER // 8 if near else _TOGETHER)]
                graded = _graded(path, element, slow[element], machine_axes) if near else None
                borders, share = _borders(path, element, curve, graded)
                into = begin[element][:, None] + np.arange(borders.shape[1] - 1)
                width[into] = share * path.length[element][:, None]
                for orders, bounds, where in given:
                    counts = where[element][:, None]
                    if not counts.any():
                        continue
                    amounts, along = _largest(element, borders, orders)
                    bound, row = _judge(amounts, bounds)
                    cap[into] = np.minimum(cap[into], np.where(counts, bound, np.inf))
                    rows[:, into] = np.maximum(rows[:, into], np.where(counts, row, 0.0))
                    if machine_axes is not None and bounds is own_bounds:
                        with np.errstate(divide="ignore"):
                            speed = ((bounds[0] / amounts[0]) ** 2).min(axis=-1)
                        other_cap[into] = np.minimum(other_cap[into], np.where(counts, speed, np.inf))
                        finite = np.isfinite(along).all(axis=(0, 3, 4))
                        known[into] = finite | ~counts
                        shares = _quarters(path, element, borders, curve)
                        middle[into] = shares[1]
                        chosen_here = (counts & finite)[..., None, None]
                        for order, values in enumerate(np.where(chosen_here, along, 0.0)):
                            value[order][:, into] = values[:, :, ::2].transpose(3, 0, 1, 2)
                            off = _missed(values, shares)
                            missed[order][:, into] = off.transpose(2, 0, 1)
                            # where the tip all but stands, and derivatives change much, huge terms cancel
                            even = (off <= _EVEN * np.abs(values).max(axis=2)).all(axis=-1)
                            known[into] &= even | ~(slow[element][:, None] & counts)
                    else:
                        other_cap[into] = np.minimum(other_cap[into], np.where(counts, bound, np.inf))
                        other_rows[:, into] = np.maximum(other_rows[:, into], np.where(counts, row, 0.0))
    edge = np.concatenate(([0.0], np.cumsum(width)))
    run, element = begin[speed_limits.element], speed_limits.element
    others, samples = None, None
    if machine_axes is not None:
        others = LimitCoefficients(SpeedLimits(edge, other_cap, run, element), *other_rows)
        samples = AxisSamples(value, missed, middle, known, machine_axes.limits[1], machine_axes.limits[2])
    own = SpeedLimits(edge, cap, run, element)
    return LimitCoefficients(own, rows[0], rows[1], rows[2], rows[3], rows[4], others, samples)


def _orders(path: Path, item: AxisLimits) -> Orders:
    def orders(element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
        one, two, three = derivatives(path, element, share, item.position)
        return one[:, None], two[:, None], three[:, None]

    return orders


def _signed(machine_axes: MachineAxes) -> Orders:
    def orders(element: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
        return machine_axes.orders(element, share)[1:]

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
        stalling[curves] |= trim * norm(step) <= bezier_halves.STANDSTILL
    return stalling


def _graded(path: Path, element: Ints, slow: Bools, machine_axes: MachineAxes | None) -> Floats:
    """Borders (g, p + 1) of intervals that are small where the axis is nearest to the pole, or the tip slowest."""
    borders = np.zeros((len(element), 2 * POLE_INTERVALS + 1))
    swift = np.flatnonzero(~slow)
    if len(swift) and machine_axes is not None:
        borders[swift] = _around(*machine_axes.closest(element[swift]), POLE_INTERVALS)
    if slow.any():
        places, _, felt = bezier_halves.slowest(cubics(path, element[slow]).tip)
        both = [_around(places[:, k], felt[:, k], POLE_INTERVALS // 2) for k in range(2)]
        borders[slow] = np.sort(np.concatenate(both, axis=1), axis=1)[:, :-1]  # two of them are the end
    return borders


def _around(closest: Floats, felt: Floats, intervals: int) -> Floats:
    """Borders (g, p + 1) of so many intervals on either side of a point, which grow with the distance from it."""
    smallest = FIRST_INTERVAL * felt[:, None]
    steps = np.linspace(0.0, 1.0, intervals + 1)
    away = smallest * np.sinh(steps * np.arcsinh(1.0 / smallest))
    both = np.concatenate((closest[:, None] - away[:, :0:-1], closest[:, None] + away), axis=1)
    borders: Floats = np.clip(both, 0.0, 1.0)
    return borders


def _borders(path: Path, element: Ints, curve: bool, given: Floats | None) -> tuple[Floats, Floats]:
    """Parameters that divide elements, and the shares of their length between them."""
    if not curve:
        borders = np.tile(np.linspace(0.0, 1.0, INTERVALS + 1), (len(element), 1)) if given is None else given
        return borders, np.diff(borders, axis=1)
    found = cubics(path, element)
    borders = bezier_halves.interval_borders(found.half) if given is None else given
    before = np.maximum.accumulate(bezier_halves.lengths_before(found.tip, found.half, borders), axis=1)
    lengths = np.diff(before, axis=1)
    return borders, lengths / lengths.sum(axis=1, keepdims=True)


def _judge(amounts: Floats, bounds: Floats) -> tuple[Floats, Floats]:
    """Bounds of v² (g, p) and coefficients (5, g, p) from the largest amounts (3, g, p, d) of derivatives."""
    one, two, three = amounts
    speed, accel, jerk = bounds
    with np.errstate(divide="ignore"):
        steady = np.minimum(np.minimum((speed / one) ** 2, accel / two), np.cbrt(jerk / three) ** 2)
    rows = np.stack((0.5 * one / accel, two / accel, one / jerk, 1.5 * two / jerk, three / jerk))
    return steady.min(axis=-1), rows.max(axis=-1)


def _quarters(path: Path, element: Ints, borders: Floats, curve: bool) -> Floats:
    """(3, g, p) shares of the lengths of intervals that are before the quarters of their parameter."""
    parts = np.linspace(0.0, 1.0, 5)[1:-1]
    if not curve:
        return np.broadcast_to(parts[:, None, None], (3, len(borders), borders.shape[1] - 1))
    fine = np.repeat(borders, 4, axis=1)[:, :-3]
    for number, part in enumerate(parts):
        fine[:, number + 1 :: 4] = borders[:, :-1] + part * (borders[:, 1:] - borders[:, :-1])
    found = cubics(path, element)
    before = np.maximum.accumulate(bezier_halves.lengths_before(found.tip, found.half, fine), axis=1)
    along = before[:, 1:].reshape(len(borders), -1, 4) - before[:, :-1:4, None]
    whole = along[..., 3:]
    shares: Floats = np.where(whole > 0.0, along[..., :3] / np.maximum(whole, 1e-300), parts).transpose(2, 0, 1)
    return shares


def parabola(share: Floats, middle: Floats) -> tuple[Floats, Floats, Floats]:
    """Factors of the values at start, middle and end of intervals of which `middle` is before the middle one."""
    m = np.clip(middle, 0.05, 0.95)
    return (
        (share - m) * (share - 1.0) / m,
        share * (1.0 - share) / (m * (1.0 - m)),
        share * (share - m) / (1.0 - m),
    )


def _missed(values: Floats, shares: Floats) -> Floats:
    """(g, p, d) by how much parabolas over the length miss the quarters of the parameter; values (g, p, 5, d)."""
    found = np.zeros((*values.shape[:2], values.shape[-1]))
    for at in (1, 3):
        expected = np.zeros_like(found)
        for number, factor in enumerate(parabola(shares[at - 1], shares[1])):
            expected += factor[..., None] * values[:, :, 2 * number]
        np.maximum(found, np.abs(values[:, :, at] - expected), out=found)
    return _MISSED * found


def _largest(element: Ints, borders: Floats, orders: Orders) -> tuple[Floats, Floats]:
    """Largest amounts (3, g, p, d) of derivatives in every interval, from samples at its ends and inside.

    Second come the derivatives at start, quarters and end, (3, g, p, 5, d).

    Not at an end where the tip comes to a stand and they are infinite. Between two samples a smooth function leaves
    their range by at most an eighth of its second difference.
    """
    step = np.diff(borders, axis=1)
    inner = borders[:, :-1, None] + step[..., None] * _INNER
    share = np.concatenate((borders, inner.reshape(len(borders), -1)), axis=1)
    found = orders(np.repeat(element, share.shape[1]), share.ravel())
    largest, samples = [], []
    for order in found:
        values = order.reshape(*share.shape, -1)
        intervals = step.shape[1]
        ends, inside = (
            values[:, : intervals + 1, None],
            values[:, intervals + 1 :].reshape(len(values), intervals, len(_INNER), -1),
        )
        along = np.concatenate((ends[:, :-1], inside, ends[:, 1:]), axis=2)
        samples.append(along)
        known = np.isfinite(along).all(axis=2)
        along = np.where(np.isfinite(along), along, 0.0)
        between = np.where(known, np.abs(np.diff(along, n=2, axis=2)).max(axis=2) / 8.0, 0.0)
        largest.append(np.abs(along).max(axis=2) + between)
    return np.stack(largest), np.stack(samples)
