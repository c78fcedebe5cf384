"""How fast each part of a path may be driven: feed, curvature and junctions as one row of intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.feedrate import arcs, bezier_halves
from cornersmooth.feedrate.cubics import cubics, curved
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.path import Kind, Path
from cornersmooth.model import Floats, Ints


@dataclass(frozen=True)
class SpeedLimits:
    """Speed limits over the path coordinate x, which runs on over all elements.

    Parameters
    ----------
    edge : (k + 1,) float64, mm or rad
        Interval i lies between ``edge[i]`` and ``edge[i + 1]``; a junction has an interval without width.
    cap : (k,) float64
        Bound of v² in interval i.
    run : (r + 1,) int64
        Intervals ``run[i]`` to ``run[i + 1]`` lie between two stops.
    element : (r + 1,) int64
        Elements ``element[i]`` to ``element[i + 1]`` lie between the same stops.
    """

    edge: Floats
    cap: Floats
    run: Ints
    element: Ints


def find_speed_limits(path: Path, limits: Limits) -> SpeedLimits:
    """Intervals of constant speed limit of a whole path.

    The limit of κ·v² is applied over short intervals of each curve with the largest curvature in the interval.
    """
    m = len(path)
    cap = path.speed**2
    arc = np.flatnonzero((path.kind == Kind.ARC) & ~path.turning)
    if len(arc):
        bound = limits.centripetal_accel / arcs.curvature(path.program, path.move[arc])
        cap[arc] = np.minimum(cap[arc], bound)
    curve = np.flatnonzero(curved(path) & ~path.turning)
    which, share, interval_cap = (
        np.zeros(0, np.int64),
        np.zeros((0, bezier_halves.INTERVALS)),
        np.zeros((0, bezier_halves.INTERVALS)),
    )
    if len(curve):

        def tips(some: Ints) -> tuple[Floats, Ints]:
            found = cubics(path, curve[some])
            return found.tip, found.half

        which, share, interval_cap = bezier_halves.curvature_limits(tips, path.speed[curve], limits)
        which = curve[which]

    # one slot for the junction before each element, then its intervals
    count = np.ones(m, np.int64)
    count[which] = bezier_halves.INTERVALS
    joined = np.isfinite(path.junction_speed[:-1]) & (path.junction_speed[:-1] > 0.0)
    begin = np.concatenate(([0], np.cumsum(count + joined)))
    total = int(begin[-1])
    width, bounds = np.zeros(total), np.zeros(total)
    first = begin[:-1] + joined
    single = count == 1
    width[first[single]] = path.length[single]
    bounds[first[single]] = cap[single]
    inside = first[which][:, None] + np.arange(bezier_halves.INTERVALS)
    width[inside] = share * (path.length[which] / share.sum(axis=1))[:, None]
    bounds[inside] = interval_cap
    bounds[begin[:-1][joined]] = path.junction_speed[:-1][joined] ** 2

    stops = np.flatnonzero(path.junction_speed == 0.0)
    return SpeedLimits(
        edge=np.concatenate(([0.0], np.cumsum(width))),
        cap=bounds,
        run=begin[stops] if m else np.zeros(1, np.int64),
        element=stops,
    )
