"""Limits over short intervals of a path: feed and curvature, the whole jerk of the tip, turning, axes of a machine.

A vector q(s) on the path moves with q₁·√z, q₂·z + q₁·z′/2 and √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2) (see `interior_point`).
The lengths of q₁, q₂, q₃ bound these from above whatever their directions, and over a short interval of the path their
largest values do. With several vectors the largest coefficient counts, term by term. The bounds may be higher than
needed, never lower: every limit is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.feedrate import arcs, rational_curves
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.machine_axes import MachineAxes
from cornersmooth.feedrate.motion import curvature, known_by_way, taylor_along
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
#: a radius of curvature below this is a cusp and is passed with the speed for this radius, mm
SMALLEST_RADIUS = 1e-6
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
    accel, jerk : (r,) float64
        Limits along the path of each run.
    """

    edge: Floats
    cap: Floats
    rows: Floats
    run: Ints
    accel: Floats
    jerk: Floats

    @property
    def level(self) -> Bools:
        """(r,) bool: runs with one bound of v² and no limit of acceleration and jerk but that along the path."""
        begin = self.run[:-1]
        if not len(begin):
            return np.zeros(0, np.bool_)
        least, most = np.minimum.reduceat(self.cap, begin), np.maximum.reduceat(self.cap, begin)
        largest, nothing = np.maximum.reduceat(self.rows, begin, axis=1), np.zeros(len(begin))
        own = np.stack((0.5 / self.accel, nothing, 1.0 / self.jerk, nothing, nothing))
        level: Bools = (least == most) & (largest <= own).all(axis=0)
        return level


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


class PathLimits(NamedTuple):
    """All limits of a path over the same intervals.

    Parameters
    ----------
    whole : Intervals
        All of them by their amounts.
    vectors : Intervals
        The same without accelerations and jerks of the axes of a machine.
    samples : AxisSamples or None
        What is known of these axes besides.
    """

    whole: Intervals
    vectors: Intervals
    samples: AxisSamples | None


def path_limits(path: Path, limits: Limits, machine_axes: MachineAxes | None = None) -> PathLimits:
    """Limits of speed, of tip and tool axis as vectors, and of the axes of a machine.

    Transitions between a motion of the tip and a turn on the spot are left out but for the tip: by the way of the tip
    the derivatives of everything else have no bound there. Pieces of runs and of NC programs on which the tip all but
    stands while the axis turns are looked at closely where it is slowest.
    """
    steady, moving = ~path.of_curves(path.curves.resting), ~path.turning
    slow = path.of_curves(path.curves.slow) & moving
    close, bounds = slow.copy(), np.stack(limits.vector_limits, axis=1)
    if machine_axes is not None:
        machine_axes = replace(machine_axes, cone=WITHIN * machine_axes.cone)
        bounds = np.concatenate((bounds, machine_axes.limits), axis=1)
        close |= machine_axes.near_pole() & steady
    columns = bounds.shape[1]
    counts = np.stack((moving, moving & steady, *[steady] * (columns - 2)), axis=1)
    curved = _curved(path, limits.centripetal_accel)
    asked = curved | counts[:, np.isfinite(bounds).any(axis=0)].any(axis=1)

    # one interval for the junction before each element, then its own
    divided = np.where(close, 2 * POLE_INTERVALS, np.where(path.bent, rational_curves.INTERVALS, INTERVALS))
    count = np.where(asked, divided, 1)
    joined = np.isfinite(path.junction_speed[:-1]) & (path.junction_speed[:-1] > 0.0)
    begin = np.concatenate(([0], np.cumsum(count + joined)))
    total, first = int(begin[-1]), begin[:-1] + joined
    fastest = path.speed**2
    arc = np.flatnonzero((path.kind == Kind.ARC) & moving)
    kappa = curvature(arcs.series(path.program, path.move[arc], 0.0))
    fastest[arc] = np.minimum(fastest[arc], limits.centripetal_accel / kappa)
    width, cap = (np.repeat(values, count + joined) for values in (path.length, fastest))
    rows = np.zeros((2, 5, total))  # of vectors, of the machine
    width[begin[:-1][joined]] = 0.0
    cap[begin[:-1][joined]] = path.junction_speed[:-1][joined] ** 2
    machine_cap = cap.copy()
    value = np.zeros((3, columns - 2, total, 3), np.float32)
    missed = np.zeros(value.shape[:-1], np.float32)
    middle, known = np.full(total, 0.5), np.ones(total, np.bool_)
    for bent, near in ((True, True), (True, False), (False, True), (False, False)):
        chosen = np.flatnonzero(asked & (path.bent == bent) & (close == near))
        size = _TOGETHER // 8 if near else _TOGETHER
        for at in range(0, len(chosen), size):
            element = chosen[at : at + size]
            graded = _graded(path, element, slow[element], machine_axes) if near else None
            fine, share, quarters = _divided(path, element, bent, graded)
            into = first[element][:, None] + np.arange(share.shape[1])
            width[into] = share * path.length[element][:, None]
            along = _sampled(path, element, fine, machine_axes)
            amounts = np.where(counts[element][:, None], _largest(along), 0.0)
            most, rows[0][:, into] = _judge(amounts[..., :2], bounds[:, :2])
            most = np.minimum(most, _judge(amounts[:1], bounds[:1])[0])
            if bent:
                most = np.minimum(most, limits.centripetal_accel / np.maximum(amounts[1, ..., 0], 1e-300))
                most = np.maximum(most, limits.centripetal_accel * SMALLEST_RADIUS)
            cap[into] = np.minimum(cap[into], most)
            if machine_axes is None:
                continue
            amounts, along = amounts[..., 2:], along[..., 2:]
            most, rows[1][:, into] = _judge(amounts, bounds[:, 2:])
            machine_cap[into] = np.minimum(cap[into], most)
            finite = np.isfinite(along).all(axis=(0, 3, 4))
            middle[into] = quarters[1]
            along = np.where((finite & steady[element][:, None])[..., None, None], along, 0.0)
            off = np.stack([_missed(values, quarters) for values in along])
            value[:, :, into] = along[..., ::2, :].transpose(0, 4, 1, 2, 3)
            missed[:, :, into] = off.transpose(0, 3, 1, 2)
            # where the tip all but stands, and derivatives change much, huge terms cancel
            even = (off <= _EVEN * np.abs(along).max(axis=3)).all(axis=(0, 3)) | ~slow[element][:, None]
            known[into] = (finite & even) | ~steady[element][:, None]

    stops = np.flatnonzero(path.junction_speed == 0.0) if len(path) else np.zeros(1, np.int64)
    kinds = np.array(((limits.accel, limits.jerk), limits.rapid_limits[1:], limits.angular_limits[1:]))
    accel, jerk = kinds[np.where(path.turning[stops[:-1]], 2, path.rapid[stops[:-1]])].T
    along_path = np.repeat((0.5 / accel, 1.0 / jerk), np.diff(begin[stops]), axis=1)
    rows[0][[0, 2]] = np.maximum(rows[0][[0, 2]], along_path)
    before = np.cumsum(width) - width
    ways = np.repeat((path.edge[:-1], before[begin[:-1]]), count + joined, axis=1)  # to each element
    edge = np.append(before - ways[1] + ways[0], path.edge[-1])  # exact where elements begin
    vectors = Intervals(np.maximum.accumulate(edge), cap, rows[0], begin[stops], accel, jerk)
    if machine_axes is None:
        return PathLimits(vectors, vectors, None)
    whole = replace(vectors, cap=np.minimum(cap, machine_cap), rows=rows.max(axis=0))
    return PathLimits(whole, vectors, AxisSamples(value, missed, middle, known, *machine_axes.limits[1:]))


def _curved(path: Path, most: float) -> Bools:
    """(m,) bool: curves whose curvature may ask for less than the feed, by a look at few places."""
    found = np.zeros(len(path), np.bool_)
    for element in rational_curves.groups(np.flatnonzero(path.bent)):
        borders = rational_curves.interval_borders(path.curves.half[path.row[element]])
        tip, _, _ = taylor_along(path, np.repeat(element, borders.shape[1]), borders.ravel(), 3)
        bend = curvature(tip).reshape(borders.shape).max(axis=1)
        back = _turns_back(tip[1].reshape(*borders.shape, 3)).any(axis=1)
        found[element] = (2.0 * bend * path.speed[element] ** 2 > most) | back
    return found


def _turns_back(tangents: Floats) -> Bools:
    """(g, q - 1) bool: whether (g, q, 3) tangents turn by more than a right angle from one to the next."""
    back: Bools = (tangents[:, 1:] * tangents[:, :-1]).sum(axis=-1) < 0.0
    return back


def _sampled(path: Path, element: Ints, fine: Floats, machine_axes: MachineAxes | None) -> Floats:
    """First three derivatives (3, g, p, 5, d) in intervals whose ends and quarters are at `fine` (g, 4·p + 1).

    Of the tip and the tool axis their lengths, then of the axes of a machine with their signs.
    """
    which, share = np.repeat(element, fine.shape[1]), fine.ravel()
    tip, axis, speed = taylor_along(path, which, share)
    of_machine = [] if machine_axes is None else [machine_axes.positions(which, share, tip, axis)]
    orders = np.stack(known_by_way(np.concatenate((tip, axis, *of_machine), axis=-1), speed))
    lengths = np.stack((norm(orders[..., :3]), norm(orders[..., 3:6])), axis=-1)
    values = np.concatenate((lengths, orders[..., 6:]), axis=-1).reshape(3, *fine.shape, -1)
    # a curve that turns back between two samples has a cusp
    back = _turns_back(tip[1].reshape(*fine.shape, 3)) & path.bent[element][:, None]
    values[1, :, 1:, 0][back] = 1.0 / SMALLEST_RADIUS
    return values[:, :, np.arange(0, fine.shape[1] - 1, 4)[:, None] + np.arange(5)]


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
