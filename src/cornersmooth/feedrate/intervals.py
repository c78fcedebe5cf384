"""Limits over short intervals of a path: feed and curvature, the whole jerk of the tip, turning, axes of a machine.

A quantity q(s) on the path moves with q₁·√z, q₂·z + q₁·z′/2 and √z·(q₃·z + 3/2·q₂·z′ + q₁·z″/2) (`interior_point`).
Limits of speed are bounds of z over whole intervals, those of acceleration and jerk hold at places (`speed_problem`).
Elements are divided until derivatives run all but straight over each interval: closely at the pole of a machine, and
where the tip all but stands while the axis turns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.feedrate import taylor
from cornersmooth.feedrate.curves import INTERVALS, groups, interval_borders, interval_lengths, taylor_series
from cornersmooth.feedrate.machine_axes import MachineAxes
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.feedrate.taylor import curvature, taylor_along
from cornersmooth.geometry.arcs import arc_series
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.settings import Limits


@dataclass(frozen=True)
class Resolution:
    """How fine intervals and cells are, and how near to the fastest profile a plan comes."""

    part: float = 0.07  #: length of a cell at a change of the speed limit, over v·√(v/J)
    growth: float = 0.12  #: growth of the cells per length
    end: float = 0.7  #: length of the cell next to a stop, over the way covered while the jerk is constant there
    fewest: int = 40  #: cells in a run at least
    #: intervals of a curve to begin with, and of a line or arc
    curve: int = 4
    line: int = 2
    #: an interval is halved where the middle of a derivative misses the mean of its ends by more than this part of a
    #: limit, and where the part of a limit of speed that is used at one speed varies so much
    even: float = 0.02
    varied: float = 0.05
    #: rounds of holding more quantities; after the last what is still beyond a limit is slowed down, but in no round
    rounds: int = 6
    gap: float = 2e-4  #: remaining duality gap over the time at which a profile is taken, and that of the first one
    rough: float = 0.05


PLAIN = Resolution()
#: where more is limited than the way itself
FINER = Resolution(part=0.03, growth=0.1)
# coarse cells, and one round
ROUGHLY = Resolution(0.2, 0.8, fewest=10, curve=2, line=1, even=0.1, varied=0.25, rounds=0, gap=5e-3, rough=0.2)


#: the cone at the pole in which derivatives are cut off here, over the cone of the machine: smaller, to be safe
WITHIN = 0.5
#: a radius of curvature below this is a cusp and is passed with the speed for this radius, mm
SMALLEST_RADIUS = 1e-6
#: intervals looked at together
_TOGETHER = 8192
#: an interval is halved where the curvature, which limits the speed there, varies so much, down to intervals of those
#: of curves alone
_BENT = 0.2
#: most halvings, and most intervals of one element that are halved: where more are uneven halving does not help, as
#: where the tip all but stands and its digits are lost (bounds of v² hold over whole intervals, however long they are)
_DEEPEST, _MOST = 14, 128


@dataclass(frozen=True)
class Quantities:
    """What has limits besides the way itself: the axes of a machine."""

    path: Path
    machine_axes: MachineAxes | None
    bounds: Floats  #: (3, d): limits of speed, acceleration and jerk; inf for none
    counts: Bools  #: (d, m): whether each is limited on each element

    @classmethod
    def of(cls, path: Path, machine_axes: MachineAxes | None) -> Quantities:
        """All that is limited.

        Nothing is on halves of transitions between a motion of the tip and a turn on the spot: by the way of the tip
        derivatives have no bound there.
        """
        if machine_axes is None:
            return cls(path, None, np.zeros((3, 0)), np.zeros((0, len(path)), np.bool_))
        machine_axes = replace(machine_axes, cone=WITHIN * machine_axes.cone)
        steady = ~path.of_curves(path.curves.resting)
        return cls(path, machine_axes, machine_axes.limits, np.tile(steady, (machine_axes.limits.shape[1], 1)))

    def __len__(self) -> int:
        return len(self.counts)

    def at(self, element: Ints, share: Floats) -> tuple[Floats, Floats]:
        """First three derivatives (3, d, ...) by the path coordinate, and Taylor series (4, ..., 3) of the tip.

        Places are as in `taylor_along`. Where the tip comes to a stand there are no derivatives: they are zero.
        """
        which, where = element.ravel(), share.ravel()
        if self.machine_axes is None:
            tip, found = taylor_along(self.path, which, where)[0], np.zeros((3, 0, len(which)))
        else:
            positions, speed, tip = self.machine_axes.series(which, where)
            found = np.stack(taylor.by_way(positions, speed)).transpose(0, 2, 1)
        found = np.where(self.counts[:, which] & np.isfinite(found), found, 0.0)
        return found.reshape(3, len(self), *element.shape), tip.reshape(4, *element.shape, 3)


@dataclass(frozen=True)
class Intervals:
    """Limits over intervals of the path coordinate x, which runs on over all elements."""

    #: (k + 1,): interval i lies between ``edge[i]`` and ``edge[i + 1]``; a junction has an interval without width
    edge: Floats
    cap: Floats  #: (k,): bound of v² in interval i
    agile: Floats  #: (k,): jerk along the path that quantities let it have at most where it is even; inf for no limit
    element: Ints  #: (k,)
    #: (k,): ends, as `share` in `taylor_along`, and the share of the length before the middle of these
    low: Floats
    high: Floats
    middle: Floats
    run: Ints  #: (r + 1,): intervals ``run[i]`` to ``run[i + 1]`` lie between two stops
    #: (r,): limits along the path of each run
    accel: Floats
    jerk: Floats
    quantities: Quantities

    @property
    def aligned(self) -> bool:
        """Whether derivatives may jump at borders, so that no cell may lie across one."""
        return len(self.quantities) > 0

    @property
    def level(self) -> Bools:
        """(r,) bool: runs with one bound of v² and no limit of acceleration and jerk but that along the path."""
        begin = self.run[:-1]
        if not len(begin) or self.aligned:
            return np.zeros(len(begin), np.bool_)
        return np.minimum.reduceat(self.cap, begin) == np.maximum.reduceat(self.cap, begin)

    def derivatives(self, start: Floats, width: Floats, parts: Floats) -> Floats:
        """Derivatives (3, d, p, q) at `parts` (q,) of cells (p,), none of which lies across a border."""
        if not self.aligned:
            return np.zeros((3, 0, len(start), len(parts)))
        interval = np.clip(np.searchsorted(self.edge, start + 0.5 * width, side="right") - 1, 0, len(self.cap) - 1)
        begin, whole = self.edge[interval], np.maximum(np.diff(self.edge)[interval], np.finfo(np.float64).tiny)
        way = np.clip((start[:, None] + parts * width[:, None] - begin[:, None]) / whole[:, None], 0.0, 1.0)
        # by the way the parameter is the parabola that passes the middle where it is
        middle = self.middle[interval, None]
        share = np.clip(way + (0.5 - middle) / (middle * (1.0 - middle)) * way * (1.0 - way), 0.0, 1.0)
        low, high = self.low[interval, None], self.high[interval, None]
        element = np.repeat(self.element[interval, None], len(parts), axis=1)
        return self.quantities.at(element, low + share * (high - low))[0]


def path_limits(
    path: Path, limits: Limits, machine_axes: MachineAxes | None = None, resolution: Resolution = FINER
) -> Intervals:
    """Limits of speed, and what else is limited."""
    quantities = Quantities.of(path, machine_axes)
    divisible = _curved(path, limits.centripetal_accel) | quantities.counts.any(axis=0)
    joined = np.flatnonzero(np.isfinite(path.junction_speed[:-1]) & (path.junction_speed[:-1] > 0.0))
    whole = np.flatnonzero(~divisible)
    fastest = path.speed**2
    arc = np.flatnonzero((path.kind == Kind.ARC) & ~path.turning)
    rows = np.searchsorted(path.program.arcs.pose, path.move[arc])
    kappa = curvature(arc_series(path.program, rows, 0.0))
    fastest[arc] = np.minimum(fastest[arc], limits.centripetal_accel / kappa)
    parts = _divided(quantities, divisible, fastest, limits.centripetal_accel, resolution)
    for element, high, width, cap, agile in (
        (whole, 1.0, path.length[whole], fastest[whole], np.inf),
        (joined, 0.0, 0.0, path.junction_speed[joined] ** 2, 0.0),  # the junction before each element
    ):
        parts.append(np.stack(np.broadcast_arrays(element, 0.0, high, width, 0.5, cap, agile)))
    found = np.concatenate(parts, axis=1)
    number, low, high, width, middle, cap, agile = found[:, np.lexsort((found[2], found[1], found[0]))]
    element = number.astype(np.int64)
    # the length of an element was measured on other intervals
    width = width * path.length[element] / np.bincount(element, width, len(path))[element]
    before = np.cumsum(width) - width
    first = np.searchsorted(element, np.arange(len(path)))
    edge = np.append(before - before[first][element] + path.edge[:-1][element], path.edge[-1])  # exact at elements
    stops = np.flatnonzero(path.junction_speed == 0.0) if len(path) else np.zeros(1, np.int64)
    kinds = np.array(((limits.accel, limits.jerk), limits.rapid_limits[1:], limits.angular_limits[1:]))
    accel, jerk = kinds[np.where(path.turning[stops[:-1]], 2, path.rapid[stops[:-1]])].T
    run = np.append(first, len(element))[stops]
    return Intervals(np.maximum.accumulate(edge), cap, agile, element, low, high, middle, run, accel, jerk, quantities)


def _divided(
    quantities: Quantities, divisible: Bools, fastest: Floats, centripetal: float, resolution: Resolution
) -> list[Floats]:
    """Intervals of the elements that may be divided: element, low, high, width, middle, cap, agile (7, p) of each."""
    path, start = quantities.path, []
    for bent in (False, True):
        element = np.flatnonzero(divisible & (path.bent == bent))
        borders = np.tile(np.linspace(0.0, 1.0, (resolution.curve if bent else resolution.line) + 1), (len(element), 1))
        if bent and not len(quantities):
            borders = interval_borders(path.curves.half[path.row[element]])
        start.append((np.repeat(element, borders.shape[1] - 1), borders[:, :-1].ravel(), borders[:, 1:].ravel()))
    element, low, high = (np.concatenate(part) for part in zip(*start, strict=True))
    done = []
    for depth in range(_DEEPEST + 1):
        closer = []
        may = (np.bincount(element, minlength=len(path))[element] <= _MOST) & (depth < _DEEPEST)
        for at in range(0, len(element), _TOGETHER):
            some = slice(at, at + _TOGETHER)
            own = element[some], low[some], high[some]
            *found, uneven = _look(quantities, *own, fastest[own[0]], centripetal, resolution)
            again = uneven & may[some]
            done.append(np.stack((*own, *found))[:, ~again])
            closer.append([part[again] for part in own])
        if not closer:
            break
        element, low, high = (np.repeat(np.concatenate(part), 2) for part in zip(*closer, strict=True))
        low[1::2] = high[::2] = 0.5 * (low[::2] + high[::2])
    return done


def _look(
    quantities: Quantities,
    element: Ints,
    low: Floats,
    high: Floats,
    fastest: Floats,
    centripetal: float,
    resolution: Resolution,
) -> tuple[Floats, Floats, Floats, Floats, Bools]:
    """Width, share before the middle, bound of v², `agile` of intervals (p,); whether a derivative bends in them."""
    path, bounds = quantities.path, quantities.bounds[:, :, None]
    shares = np.stack((low, 0.5 * (low + high), high), axis=1)
    lengths = np.diff(shares, axis=1) * path.length[element][:, None]
    bent = path.bent[element]
    if bent.any():
        lengths[bent] = interval_lengths(path.curves.tip[path.row[element[bent]]], shares[bent])
    width = lengths.sum(axis=1)
    middle = np.divide(lengths[:, 0], width, out=np.full(len(width), 0.5), where=width > 0.0)
    derivatives, tip = quantities.at(np.repeat(element[:, None], 3, axis=1), shares)
    kappa = curvature(tip.reshape(4, -1, 3)).reshape(shares.shape)
    most = _largest(kappa)
    most[_turns_back(tip[1]).any(axis=1)] = np.inf  # a cusp
    cap = np.where(bent, centripetal / np.clip(most, 1e-300, 1.0 / SMALLEST_RADIUS), np.inf)
    bends = (np.ptp(kappa, axis=1) > _BENT * most) & (cap < fastest) & (high - low > 1.0 / INTERVALS)
    cap = np.minimum(cap, fastest)
    if not len(quantities):
        return width, middle, cap, np.full(len(width), np.inf), np.zeros(len(width), np.bool_)
    amounts, power = _largest(derivatives), 2.0 / np.arange(1, 4)[:, None, None]
    with np.errstate(divide="ignore"):
        steady = ((bounds / amounts) ** power).min(axis=1)  # of v², by each order alone
        agile = (bounds[2] / amounts[0]).min(axis=0)
    kept = steady.min(axis=0)
    uneven = bends & (cap < kept)
    kept = np.minimum(cap, kept)  # no profile is faster than that for long
    uneven |= (np.ptp(np.abs(derivatives[0]), axis=-1) * np.sqrt(kept) > resolution.varied * bounds[0]).any(axis=0)
    off = np.abs(derivatives[..., 1] - derivatives[..., 0] * (1.0 - middle) - derivatives[..., 2] * middle)
    uneven |= (off * kept ** (1.0 / power) > resolution.even * bounds).any(axis=(0, 1))
    return width, middle, np.minimum(cap, steady[0]), agile, uneven


def _curved(path: Path, most: float) -> Bools:
    """(m,) bool: curves whose curvature may ask for less than the feed, by a look at few places."""
    found = np.zeros(len(path), np.bool_)
    for element in groups(np.flatnonzero(path.bent)):
        row = path.row[element]
        borders = interval_borders(path.curves.half[row])
        powers = np.repeat(path.curves.tip[row], borders.shape[1], axis=0)
        tip = taylor_series(powers, borders.ravel(), 3)
        bend = curvature(tip).reshape(borders.shape).max(axis=1)
        back = _turns_back(tip[1].reshape(*borders.shape, 3)).any(axis=1)
        found[element] = (2.0 * bend * path.speed[element] ** 2 > most) | back
    return found


def _turns_back(tangents: Floats) -> Bools:
    """(g, q - 1) bool: whether (g, q, 3) tangents turn by more than a right angle from one to the next."""
    return (tangents[:, 1:] * tangents[:, :-1]).sum(axis=-1) < 0.0


def _largest(values: Floats) -> Floats:
    """Largest amounts (...) over intervals, from samples (..., 3) at their ends and middles.

    A smooth function leaves the range of two samples by at most an eighth of its second difference there.
    """
    return np.abs(values).max(axis=-1) + np.abs(np.diff(values, n=2, axis=-1))[..., 0] / 8.0
