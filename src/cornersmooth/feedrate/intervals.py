"""Limits over short intervals of a path: feed and curvature, the whole jerk of the tip, turning, axes of a machine.

A vector q(s) on the path moves with q₁·√z, q₂·z + q₁·z′/2 and √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2) (see `interior_point`).
The lengths of q₁, q₂, q₃ bound these from above whatever their directions, and over a short interval of the path their
largest values do. With several vectors the largest coefficient counts, term by term. The bounds may be higher than
needed, never lower: every limit is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cornersmooth.feedrate import arcs, rational_curves
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.machine_axes import MachineAxes
from cornersmooth.feedrate.motion import curvature, derivatives
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.vectors import norm

#: intervals of a line or arc
INTERVALS = 4
#: intervals on either side of the point nearest to the pole of a machine, and the first of them over the way on which
#: the pole is felt
POLE_INTERVALS, FIRST_INTERVAL = 40, 0.05
#: the cone at the pole in which derivatives are cut off here, over the cone of the machine: smaller, to be safe
WITHIN = 0.5
#: places inside of every interval at which derivatives are sampled
_QUARTERS = np.array([0.25, 0.5, 0.75])
#: elements sampled together
_TOGETHER = 4096
#: most that parabolas may miss of derivatives where the tip all but stands
_EVEN = 0.05
#: what parabolas miss at most, over what they miss at the quarters
_MISSED = 2.0


@dataclass(frozen=True)
class Intervals:
    """Limits over intervals of the path coordinate x, which runs on over all elements.

    Parameters
    ----------
    edge : (k + 1,) float64, mm or rad
        Interval i lies between ``edge[i]`` and ``edge[i + 1]``; a junction has an interval without width.
    cap : (k,) float64
        Bound of v² in interval i.
    rows : (5, k) float64
        Of z′ and z in a limit of acceleration, and of z″/2, z′ and z in one of jerk, over the limit.
    run : (r + 1,) int64
        Intervals ``run[i]`` to ``run[i + 1]`` lie between two stops.
    """

    edge: Floats
    cap: Floats
    rows: Floats
    run: Ints

    def with_others(self, other: Intervals | None) -> Intervals:
        """Return the stricter limits of both, which have the same edges."""
        if other is None:
            return self
        return replace(self, cap=np.minimum(self.cap, other.cap), rows=np.maximum(self.rows, other.rows))

    @property
    def strictest(self) -> tuple[Floats, Floats, Floats]:
        """Lowest and highest bound of v² (r,), and largest rows (5, r), of each run."""
        begin = self.run[:-1]
        if not len(begin):
            return np.zeros(0), np.zeros(0), np.zeros((5, 0))
        least, most = np.minimum.reduceat(self.cap, begin), np.maximum.reduceat(self.cap, begin)
        return least, most, np.maximum.reduceat(self.rows, begin, axis=1)


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
class AxisLimits:
    """Limits beyond those of the path speed, all over the same intervals.

    Parameters
    ----------
    vectors : Intervals
        Of tip and tool axis, and speeds of the axes of a machine.
    machine : Intervals or None
        Accelerations and jerks of the axes of a machine, by their amounts.
    samples : AxisSamples or None
        What is known of these axes besides.
    """

    vectors: Intervals
    machine: Intervals | None
    samples: AxisSamples | None

    @property
    def all(self) -> Intervals:
        """All of them by their amounts."""
        return self.vectors.with_others(self.machine)


def path_limits(path: Path, limits: Limits) -> tuple[Intervals, Ints]:
    """Limits of the path speed, and elements (r + 1,) that begin at stops.

    The limit of κ·v² is applied over short intervals of each curve with the largest curvature in the interval.
    """
    m = len(path)
    cap = path.speed**2
    arc = np.flatnonzero((path.kind == Kind.ARC) & ~path.turning)
    if len(arc):
        bound = limits.centripetal_accel / curvature(arcs.series(path.program, path.move[arc], 0.0))
        cap[arc] = np.minimum(cap[arc], bound)
    bent = np.flatnonzero(path.bent)
    which, share, interval_cap = rational_curves.curvature_caps(
        path.curves.tip, path.curves.half, path.row[bent], path.speed[bent], limits.centripetal_accel
    )
    which = bent[which]

    # one slot for the junction before each element, then its intervals
    count = np.ones(m, np.int64)
    count[which] = rational_curves.INTERVALS
    joined = np.isfinite(path.junction_speed[:-1]) & (path.junction_speed[:-1] > 0.0)
    begin = np.concatenate(([0], np.cumsum(count + joined)))
    total = int(begin[-1])
    width, bounds = np.zeros(total), np.zeros(total)
    first = begin[:-1] + joined
    single = count == 1
    width[first[single]] = path.length[single]
    bounds[first[single]] = cap[single]
    inside = first[which][:, None] + np.arange(rational_curves.INTERVALS)
    width[inside] = share * (path.length[which] / share.sum(axis=1))[:, None]
    bounds[inside] = interval_cap
    bounds[begin[:-1][joined]] = path.junction_speed[:-1][joined] ** 2

    stops = np.flatnonzero(path.junction_speed == 0.0) if m else np.zeros(1, np.int64)
    kinds = np.array(((limits.accel, limits.jerk), limits.rapid_limits[1:], limits.angular_limits[1:]))
    lead = stops[:-1]
    accel, jerk = kinds[np.where(path.turning[lead], 2, path.rapid[lead])].T
    rows = np.zeros((5, total))
    size = np.diff(begin[stops])
    rows[0], rows[2] = np.repeat(0.5 / accel, size), np.repeat(1.0 / jerk, size)
    return Intervals(np.concatenate(([0.0], np.cumsum(width))), bounds, rows, begin[stops]), stops


@dataclass(frozen=True)
class _Quantities:
    """What is limited: the tip and the tool axis by their lengths, then the axes of a machine with their signs.

    Parameters
    ----------
    path : Path
    vectors : (c,) int64
        0 for the tip, 1 for the tool axis.
    machine_axes : MachineAxes or None
    bounds : (3, d) float64
        Limits of speed, acceleration and jerk.
    counts : (m, d) bool
        Whether they are limited on each element.
    """

    path: Path
    vectors: Ints
    machine_axes: MachineAxes | None
    bounds: Floats
    counts: Bools

    def sampled(self, element: Ints, fine: Floats) -> Floats:
        """First three derivatives (3, g, p, 5, d) in intervals whose ends and quarters are at `fine` (g, 4·p + 1)."""
        which, share = np.repeat(element, fine.shape[1]), fine.ravel()
        found = []
        if len(self.vectors):
            orders = np.stack([norm(order) for order in derivatives(self.path, which, share)])
            found.append(orders.transpose(0, 2, 1)[..., self.vectors])
        if self.machine_axes is not None:
            found.append(np.stack(self.machine_axes.orders(which, share)[1:]))
        values = np.concatenate(found, axis=-1).reshape(3, *fine.shape, -1)
        return values[:, :, np.arange(0, fine.shape[1] - 1, 4)[:, None] + np.arange(5)]


def axis_limits(path: Path, limits: Limits, run: Ints, machine_axes: MachineAxes | None = None) -> AxisLimits | None:
    """Limits that go beyond those of the path speed; None where there are none.

    Transitions between a motion of the tip and a turn on the spot are left out but for the jerk of the tip: by the way
    of the tip the derivatives of everything else have no bound there. Pieces of runs and of texts on which the tip all
    but stands while the axis turns are looked at closely where it is slowest.

    Parameters
    ----------
    run : (r + 1,) int64
        Elements that begin at stops.
    """
    bounds = np.stack(limits.vector_limits, axis=1)
    vectors = np.flatnonzero(np.isfinite(bounds).any(axis=0))
    if not len(path) or (machine_axes is None and not len(vectors)):
        return None
    steady = ~path.of_curves(path.curves.resting)
    counts = np.stack((~path.turning, ~path.turning & steady), axis=1)[:, vectors]
    bounds, slow = bounds[:, vectors], path.of_curves(path.curves.slow) & ~path.turning
    close, own = slow.copy(), len(vectors)
    if machine_axes is not None:
        machine_axes = replace(machine_axes, cone=WITHIN * machine_axes.cone)
        bounds = np.concatenate((bounds, machine_axes.limits), axis=1)
        counts = np.concatenate((counts, np.repeat(steady[:, None], bounds.shape[1] - own, axis=1)), axis=1)
        close |= machine_axes.near_pole() & steady
    quantities = _Quantities(path, vectors, machine_axes, bounds, counts)
    bent, asked = path.bent, counts.any(axis=1)
    count = np.where(
        asked, np.where(close, 2 * POLE_INTERVALS, np.where(bent, rational_curves.INTERVALS, INTERVALS)), 1
    )
    begin = np.concatenate(([0], np.cumsum(count)))
    total = int(begin[-1])
    width = np.repeat(path.length, count)
    cap, rows = np.full((2, total), np.inf), np.zeros((2, 5, total))  # of vectors; of the machine
    value = np.zeros((3, bounds.shape[1] - own, total, 3), np.float32)
    missed = np.zeros(value.shape[:-1], np.float32)
    middle, known = np.full(total, 0.5), np.ones(total, np.bool_)
    for curve, near in ((True, True), (True, False), (False, True), (False, False)):
        chosen = np.flatnonzero(asked & (bent == curve) & (close == near))
        size = _TOGETHER // 8 if near else _TOGETHER
        for at in range(0, len(chosen), size):
            element = chosen[at : at + size]
            graded = _graded(path, element, slow[element], machine_axes) if near else None
            fine, share, quarters = _divided(path, element, curve, graded)
            into = begin[element][:, None] + np.arange(share.shape[1])
            width[into] = share * path.length[element][:, None]
            along = quantities.sampled(element, fine)
            amounts = np.where(counts[element][:, None], _largest(along), 0.0)
            cap[0, into], rows[0][:, into] = _judge(amounts[..., :own], bounds[:, :own])
            if machine_axes is None:
                continue
            amounts, along = amounts[..., own:], along[..., own:]
            cap[1, into], rows[1][:, into] = _judge(amounts, bounds[:, own:])
            cap[0, into] = np.minimum(cap[0, into], _judge(amounts[:1], bounds[:1, own:])[0])
            finite = np.isfinite(along).all(axis=(0, 3, 4))
            middle[into] = quarters[1]
            along = np.where((finite & steady[element][:, None])[..., None, None], along, 0.0)
            off = np.stack([_missed(values, quarters) for values in along])
            value[:, :, into] = along[..., ::2, :].transpose(0, 4, 1, 2, 3)
            missed[:, :, into] = off.transpose(0, 3, 1, 2)
            # where the tip all but stands, and derivatives change much, huge terms cancel
            even = (off <= _EVEN * np.abs(along).max(axis=3)).all(axis=(0, 3)) | ~slow[element][:, None]
            known[into] = (finite & even) | ~steady[element][:, None]
    edge = np.concatenate(([0.0], np.cumsum(width)))
    both = [Intervals(edge, *limit, begin[run]) for limit in zip(cap, rows, strict=True)]
    if machine_axes is None:
        return AxisLimits(both[0], None, None)
    return AxisLimits(both[0], both[1], AxisSamples(value, missed, middle, known, *machine_axes.limits[1:]))


def _graded(path: Path, element: Ints, slow: Bools, machine_axes: MachineAxes | None) -> Floats:
    """Borders (g, p + 1) of intervals that are small where the axis is nearest to the pole, or the tip slowest."""
    borders = np.zeros((len(element), 2 * POLE_INTERVALS + 1))
    swift = np.flatnonzero(~slow)
    if len(swift) and machine_axes is not None:
        borders[swift] = _around(*machine_axes.closest(element[swift]), POLE_INTERVALS)
    if slow.any():
        places, _, felt = rational_curves.slowest(path.curves.tip[path.row[element[slow]]])
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


def _divided(path: Path, element: Ints, curve: bool, given: Floats | None) -> tuple[Floats, Floats, Floats]:
    """Ends and quarters (g, 4·p + 1) of intervals that divide elements, their shares (g, p) of the length.

    Third come the shares (3, g, p) of the length of an interval that are before the quarters of its parameter.
    """
    row = path.row[element]
    if given is not None:
        borders = given
    elif curve:
        borders = rational_curves.interval_borders(path.curves.half[row])
    else:
        borders = np.tile(np.linspace(0.0, 1.0, INTERVALS + 1), (len(element), 1))
    step = np.diff(borders, axis=1)
    fine = np.repeat(borders, 4, axis=1)[:, :-3]
    for number in (1, 2, 3):
        fine[:, number::4] = borders[:, :-1] + _QUARTERS[number - 1] * step
    if not curve:
        return fine, step, np.broadcast_to(_QUARTERS[:, None, None], (3, *step.shape))
    before = rational_curves.lengths_before(path.curves.tip[row], path.curves.half[row], fine)
    before = np.maximum.accumulate(before, axis=1)
    along = before[:, 1:].reshape(*step.shape, 4) - before[:, :-1:4, None]
    whole = along[..., 3]
    quarters = np.where(whole[..., None] > 0.0, along[..., :3] / np.maximum(whole, 1e-300)[..., None], _QUARTERS)
    return fine, whole / whole.sum(axis=1, keepdims=True), quarters.transpose(2, 0, 1)


def _judge(amounts: Floats, bounds: Floats) -> tuple[Floats, Floats]:
    """Bounds of v² (g, p) and rows (5, g, p) from the largest amounts (3, g, p, d) of derivatives, or (1, g, p, d)."""
    with np.errstate(divide="ignore"):
        power = 2.0 / np.arange(1, len(amounts) + 1)
        steady = [(bound / most) ** n for bound, most, n in zip(bounds, amounts, power, strict=True)]
    cap: Floats = np.min(steady, axis=(0, -1), initial=np.inf)
    if len(amounts) == 1:
        return cap, np.zeros((5, *cap.shape))
    (one, two, three), (_, accel, jerk) = amounts, bounds
    rows = np.stack((0.5 * one / accel, two / accel, one / jerk, 1.5 * two / jerk, three / jerk))
    return cap, rows.max(axis=-1, initial=0.0)


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


def _largest(along: Floats) -> Floats:
    """Largest amounts (3, g, p, d) of derivatives in every interval, from samples (3, g, p, 5, d).

    Not at an end where the tip comes to a stand and they are infinite. Between two samples a smooth function leaves
    their range by at most an eighth of its second difference.
    """
    known = np.isfinite(along)
    along = np.where(known, along, 0.0)
    between = np.where(known.all(axis=3), np.abs(np.diff(along, n=2, axis=3)).max(axis=3) / 8.0, 0.0)
    largest: Floats = np.abs(along).max(axis=3) + between
    return largest
