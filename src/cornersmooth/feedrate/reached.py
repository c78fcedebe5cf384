"""What a motion reaches of its limits, and for how long while the tool cuts."""

from __future__ import annotations

import numpy as np

from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.model import Bools, Floats

#: part of a limit from which it counts as reached
_REACHED = 0.98

#: times looked at, spread evenly over the motion: for each element, at least and at most
_EACH, _FEWEST, _MOST = 64, 2_000, 20_000

_ORDERS = ("speed", "acceleration", "jerk")


def limiting(law: TimeLaw) -> list[tuple[str, float]]:
    """Limits that are reached while the tool cuts, and the part of the cutting time, the longest first.

    Several may be reached at once, so that the parts need not add up to 1. A limit counts from 98 % of it on.

    Returns
    -------
    list of (str, float)
        Such as ``("the programmed feed", 0.6)``, ``("acceleration of A", 0.2)``.
    """
    path = law.path
    if not len(path) or law.total <= 0.0:
        return []
    times = np.linspace(0.0, law.total, min(max(_EACH * len(path), _FEWEST), _MOST))
    states = law.at(times)
    way = law.kinematics(times)[0]
    element = np.clip(np.searchsorted(law.edge, way, side="right") - 1, 0, len(path) - 1)
    cutting = ~path.rapid[element] & ~states.turning
    if not cutting.any():
        return []
    limits = law.limits
    fastest = states.v >= _REACHED * path.speed[element]
    feed = path.program.feed_at(path.move) if limits.feed is None else np.full(len(path), limits.feed)
    slower = (60.0 * path.speed < _REACHED * feed)[element]  # what the control makes of its blocks
    reached: dict[str, Bools] = {
        "the programmed feed": fastest & ~slower,
        "block time or look-ahead": fastest & slower,
        "acceleration along the path": _at(states.a, limits.accel),
        "jerk along the path": _at(states.j, limits.jerk),
        "acceleration across the path": _at(states.centripetal, limits.centripetal_accel),
    }
    if law.machine_axes is not None:
        _, *orders = law.axes_at(times)
        for word, values, most in zip(_ORDERS, orders, law.machine_axes.limits, strict=True):
            for name, column, bound in zip(law.machine_axes.names, values.T, most, strict=True):
                reached[f"{word} of {name}"] = _at(column, float(bound))
    shares = ((name, float(rows[cutting].mean())) for name, rows in reached.items())
    return sorted((pair for pair in shares if pair[1] > 0.0), key=lambda pair: -pair[1])


def _at(values: Floats, limit: float) -> Bools:
    return np.abs(values) >= _REACHED * limit
