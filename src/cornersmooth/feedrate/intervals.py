"""Limits over short intervals of a path: feed and curvature, the whole jerk of the tip, turning, axes of a machine.

A vector q(s) on the path moves with q₁·√z, q₂·z + q₁·z′/2 and √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2) (see `interior_point`).
The lengths of q₁, q₂, q₃ bound these from above whatever their directions, and over a short interval of the path their
largest values do. With several vectors the largest coefficient counts, term by term. The bounds may be higher than
needed, never lower: every limit is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.feedrate import arcs, rational_curves
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.machine_axes import MachineAxes
from cornersmooth.feedrate.motion import curvature, known_by_way, taylor_along
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.vectors import norm

#: intervals of a line or arc to begin with
INTERVALS = 4
#: the cone at the pole in which derivatives are cut off here, over the cone of the machine: smaller, to be safe
WITHIN = 0.5
#: a radius of curvature below this is a cusp and is passed with the speed for this radius, mm
SMALLEST_RADIUS = 1e-6
#: places of every interval at which derivatives are sampled
_QUARTERS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
#: intervals sampled together
_TOGETHER = 8192
#: what parabolas miss at most, over what they miss at the quarters
_MISSED = 2.0
#: an interval is halved where parabolas miss so much of the largest derivative on its element, and of a limit
_EVEN, _FELT = 0.05, 1e-6
#: and where the part of a limit of speed that is used at one speed varies so much
_VARIED = 0.05
#: most halvings
_DEEPEST = 14


@dataclass(frozen=True)
class Intervals:
    """Limits over intervals of the path coordinate x, which runs on over all elements."""

    #: (k + 1,): interval i lies between ``edge[i]`` and ``edge[i + 1]``; a junction has an interval without width
    edge: Floats
    cap: Floats  #: (k,): bound of v² in interval i
    #: (5, k): of z′ and z in a limit of acceleration, and of z″/2, z′ and z in one of jerk, over the limit
    rows: Floats
    run: Ints  #: (r + 1,): intervals ``run[i]`` to ``run[i + 1]`` lie between two stops
    #: (r,): limits along the path of each run
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
    """Derivatives of the axes of a machine, signs and all, at start, middle and end of the same intervals."""

    value: Singles  #: first, second and third derivative of every axis
    missed: Singles  #: by how much the parabolas through these three miss what was seen between them
    middle: Floats  #: (k,): share of the length of an interval that is before its middle
    known: Bools  #: (k,): whether all derivatives are finite
    #: (d,): limits of the axes, inf for none
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
    the derivatives of everything else have no bound there. Elements are divided until parabolas show how derivatives
    go: closely at the pole of a machine, and where the tip all but stands while the axis turns.
    """
    steady, moving = ~path.of_curves(path.curves.resting), ~path.turning
    bounds = np.stack(limits.vector_limits, axis=1)
    if machine_axes is not None:
        machine_axes = replace(machine_axes, cone=WITHIN * machine_axes.cone)
        bounds = np.concatenate((bounds, machine_axes.limits), axis=1)
    counts = np.stack((moving, moving & steady, *[steady] * (bounds.shape[1] - 2)), axis=1)
    look = _Look(path, machine_axes, limits.centripetal_accel, bounds, counts)
    asked = _curved(path, limits.centripetal_accel) | counts[:, np.isfinite(bounds).any(axis=0)].any(axis=1)
    found = _divided(look, asked)
    seen = np.bincount(found["element"], minlength=len(path))

    # one interval for the junction before each element, then its own
    joined = np.isfinite(path.junction_speed[:-1]) & (path.junction_speed[:-1] > 0.0)
    count = joined + np.maximum(seen, 1)
    begin = np.concatenate(([0], np.cumsum(count)))
    into = np.arange(len(found["element"])) + (begin[:-1] + joined - np.cumsum(seen) + seen)[found["element"]]
    junctions = begin[:-1][joined]

    def placed(values: NDArray[Any], other: Floats | float = 0.0) -> NDArray[Any]:
        whole = np.empty((*values.shape[1:], begin[-1]), values.dtype)
        whole[...] = other
        whole[..., into] = np.moveaxis(values, 0, -1)
        return whole

    fastest = path.speed**2
    arc = np.flatnonzero((path.kind == Kind.ARC) & moving)
    kappa = curvature(arcs.series(path.program, path.move[arc], 0.0))
    fastest[arc] = np.minimum(fastest[arc], limits.centripetal_accel / kappa)
    cap = np.minimum(placed(found["cap"], np.inf), np.repeat(fastest, count))
    cap[junctions] = path.junction_speed[:-1][joined] ** 2
    rows, width = placed(found["rows"]), placed(found["width"], np.repeat(path.length, count))
    width[junctions] = 0.0

    stops = np.flatnonzero(path.junction_speed == 0.0) if len(path) else np.zeros(1, np.int64)
    kinds = np.array(((limits.accel, limits.jerk), limits.rapid_limits[1:], limits.angular_limits[1:]))
    accel, jerk = kinds[np.where(path.turning[stops[:-1]], 2, path.rapid[stops[:-1]])].T
    along_path = np.repeat((0.5 / accel, 1.0 / jerk), np.diff(begin[stops]), axis=1)
    rows[[0, 2]] = np.maximum(rows[[0, 2]], along_path)
    before = np.cumsum(width) - width
    ways = np.repeat((path.edge[:-1], before[begin[:-1]]), count, axis=1)  # to each element
    edge = np.append(before - ways[1] + ways[0], path.edge[-1])  # exact where elements begin
    vectors = Intervals(np.maximum.accumulate(edge), cap, rows, begin[stops], accel, jerk)
    if machine_axes is None:
        return PathLimits(vectors, vectors, None)
    whole = replace(
        vectors,
        cap=np.minimum(cap, placed(found["machine_cap"], np.inf)),
        rows=np.maximum(rows, placed(found["machine_rows"])),
    )
    samples = AxisSamples(
        np.moveaxis(placed(found["value"]), 2, -1),
        placed(found["missed"]),
        placed(found["middle"], 0.5),
        placed(found["known"], 1.0),
        *machine_axes.limits[1:],
    )
    return PathLimits(whole, vectors, samples)


@dataclass(frozen=True)
class _Look:
    """What is limited: the tip and the tool axis by their lengths, then the axes of a machine with their signs."""

    path: Path
    machine_axes: MachineAxes | None
    centripetal: float
    bounds: Floats  #: (3, d): limits of speed, acceleration and jerk
    counts: Bools  #: (m, d): whether they are limited on each element

    @property
    def columns(self) -> np.dtype[np.void]:
        """What is known of an interval of an element; names as in `Intervals` and `AxisSamples`."""
        axes = self.bounds.shape[1] - 2
        numbers = [(name, np.float64) for name in ("low", "width", "cap", "machine_cap", "middle")]
        rows = [(name, np.float64, (5,)) for name in ("rows", "machine_rows")]
        samples = [("value", np.float32, (3, axes, 3)), ("missed", np.float32, (3, axes))]
        return np.dtype([("element", np.int64), ("known", np.bool_), *numbers, *rows, *samples])

    def at(self, element: Ints, low: Floats, high: Floats, largest: Floats) -> tuple[NDArray[np.void], Bools]:
        """Limits over intervals (p,), and whether parabolas miss too much of a derivative in them.

        Parameters
        ----------
        element : (p,) int64
        low, high : (p,) float64
            Ends, as `share` in `taylor_along`.
        largest : (3, m, d) float64
            Largest derivatives seen on each element; those of these intervals are added.
        """
        path, bounds = self.path, self.bounds
        fine = low[:, None] + (high - low)[:, None] * _QUARTERS
        lengths = np.diff(fine, axis=1) * path.length[element][:, None]
        bent = path.bent[element]
        if bent.any():
            powers = path.curves.tip[path.row[element[bent]]]
            lengths[bent] = rational_curves.interval_lengths(powers, fine[bent])
        width = lengths.sum(axis=1)
        parts = np.divide(lengths, width[:, None], out=np.full(lengths.shape, 0.25), where=width[:, None] > 0.0)
        quarters = np.cumsum(parts, axis=1)[:, :3].T
        along = self._sampled(element, fine)
        amounts = np.where(self.counts[element], _largest(along), 0.0)
        for order, amount in zip(largest, amounts, strict=True):
            np.maximum.at(order, element, amount)
        cap, rows = _judge(amounts[..., :2], bounds[:, :2])
        fastest = np.minimum(_judge(amounts[:1], bounds[:1])[0], path.speed[element] ** 2)
        cap = np.minimum(cap, fastest)
        bend = self.centripetal / np.maximum(amounts[1, :, 0], 1e-300)
        cap = np.where(bent, np.minimum(cap, np.maximum(bend, self.centripetal * SMALLEST_RADIUS)), cap)
        machine_cap, machine_rows = _judge(amounts[..., 2:], bounds[:, 2:])

        finite = np.isfinite(along).all(axis=(0, 2)) & self.counts[element]
        along = np.where(finite[:, None], along, 0.0)
        off = np.stack([_missed(values, quarters) for values in along])
        speed = np.sqrt(np.minimum(cap, machine_cap))[:, None]
        used = off * speed ** np.arange(1, 4)[:, None, None] / bounds[:, None]
        uneven = ((off > _EVEN * largest[:, element]) & (used > _FELT)).any(axis=(0, 2))
        # one limit of speed holds in the whole interval
        uneven |= (np.ptp(np.abs(along[0]), axis=1) * np.sqrt(fastest)[:, None] > _VARIED * bounds[0]).any(axis=1)
        found = np.zeros(len(element), self.columns)
        for name, values in (
            ("element", element),
            ("known", (finite | ~self.counts[element])[:, 2:].all(axis=1) & ~uneven),
            ("low", low),
            ("width", width),
            ("cap", cap),
            ("machine_cap", machine_cap),
            ("middle", quarters[1]),
            ("rows", rows.T),
            ("machine_rows", machine_rows.T),
            ("value", along[:, :, ::2, 2:].transpose(1, 0, 3, 2)),
            ("missed", off[..., 2:].transpose(1, 0, 2)),
        ):
            found[name] = values
        return found, uneven

    def _sampled(self, element: Ints, fine: Floats) -> Floats:
        """First three derivatives (3, p, 5, d) at the ends and quarters `fine` (p, 5) of intervals."""
        which, share = np.repeat(element, fine.shape[1]), fine.ravel()
        tip, axis, speed = taylor_along(self.path, which, share)
        more = [] if self.machine_axes is None else [self.machine_axes.positions(which, share, tip, axis)]
        orders = np.stack(known_by_way(np.concatenate((tip, axis, *more), axis=-1), speed))
        lengths = np.stack((norm(orders[..., :3]), norm(orders[..., 3:6])), axis=-1)
        values = np.concatenate((lengths, orders[..., 6:]), axis=-1).reshape(3, *fine.shape, -1)
        # a curve that turns back between two samples has a cusp
        back = _turns_back(tip[1].reshape(*fine.shape, 3)) & self.path.bent[element][:, None]
        values[1, :, 1:, 0][back] = 1.0 / SMALLEST_RADIUS
        return values


def _divided(look: _Look, asked: Bools) -> NDArray[np.void]:
    """Intervals (`_Look.columns`) of the elements that are asked for, in order."""
    path, start = look.path, []
    for bent in (False, True):
        element = np.flatnonzero(asked & (path.bent == bent))
        borders = np.tile(np.linspace(0.0, 1.0, INTERVALS + 1), (len(element), 1))
        if bent:
            borders = rational_curves.interval_borders(path.curves.half[path.row[element]])
        start.append((np.repeat(element, borders.shape[1] - 1), borders[:, :-1].ravel(), borders[:, 1:].ravel()))
    element, low, high = (np.concatenate(part) for part in zip(*start, strict=True))
    done, largest = [], np.zeros((3, *look.counts.shape))
    for depth in range(_DEEPEST + 1):
        closer = []
        for at in range(0, len(element), _TOGETHER):
            some = slice(at, at + _TOGETHER)
            found, uneven = look.at(element[some], low[some], high[some], largest)
            again = uneven & (depth < _DEEPEST)
            done.append(found[~again])
            closer.append((element[some][again], low[some][again], high[some][again]))
        if not closer:
            break
        element, low, high = (np.repeat(np.concatenate(part), 2) for part in zip(*closer, strict=True))
        low[1::2] = high[::2] = 0.5 * (low[::2] + high[::2])
    found = np.concatenate(done) if done else np.zeros(0, look.columns)
    found = found[np.lexsort((found["low"], found["element"]))]
    # the length of an element was measured on other intervals
    measured = np.bincount(found["element"], found["width"], len(path))[found["element"]]
    found["width"] *= path.length[found["element"]] / measured
    return found


def _curved(path: Path, most: float) -> Bools:
    """(m,) bool: curves whose curvature may ask for less than the feed, by a look at few places."""
    found = np.zeros(len(path), np.bool_)
    for element in rational_curves.groups(np.flatnonzero(path.bent)):
        row = path.row[element]
        borders = rational_curves.interval_borders(path.curves.half[row])
        powers = np.repeat(path.curves.tip[row], borders.shape[1], axis=0)
        tip = rational_curves.taylor_series(powers, borders.ravel(), 3)
        bend = curvature(tip).reshape(borders.shape).max(axis=1)
        back = _turns_back(tip[1].reshape(*borders.shape, 3)).any(axis=1)
        found[element] = (2.0 * bend * path.speed[element] ** 2 > most) | back
    return found


def _turns_back(tangents: Floats) -> Bools:
    """(g, q - 1) bool: whether (g, q, 3) tangents turn by more than a right angle from one to the next."""
    back: Bools = (tangents[:, 1:] * tangents[:, :-1]).sum(axis=-1) < 0.0
    return back


def _judge(amounts: Floats, bounds: Floats) -> tuple[Floats, Floats]:
    """Bounds of v² (p,) and rows (5, p) from the largest amounts (3, p, d) of derivatives, or (1, p, d)."""
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
    """(p, d) by how much parabolas over the length miss the quarters of the parameter; values (p, 5, d)."""
    found = np.zeros((len(values), values.shape[-1]))
    for at in (1, 3):
        expected = np.zeros_like(found)
        for number, factor in enumerate(parabola(shares[at - 1], shares[1])):
            expected += factor[:, None] * values[:, 2 * number]
        np.maximum(found, np.abs(values[:, at] - expected), out=found)
    return _MISSED * found


def _largest(along: Floats) -> Floats:
    """Largest amounts (3, p, d) of derivatives in every interval, from samples (3, p, 5, d).

    Not at an end where the tip comes to a stand and they are infinite. Between two samples a smooth function leaves
    their range by at most an eighth of its second difference.
    """
    known = np.isfinite(along)
    along = np.where(known, along, 0.0)
    between = np.where(known.all(axis=2), np.abs(np.diff(along, n=2, axis=2)).max(axis=2) / 8.0, 0.0)
    largest: Floats = np.abs(along).max(axis=2) + between
    return largest
