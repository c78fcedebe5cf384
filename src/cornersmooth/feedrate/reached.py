"""What a motion reaches of its limits: for how long while the tool cuts, and at most on each axis of a machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.kinematics.machine import LINEAR
from cornersmooth.model import Bools, Floats

#: part of a limit from which it counts as reached
_REACHED = 0.98

#: times looked at, spread evenly over the motion: for each element, at least and at most
_EACH, _FEWEST, _MOST = 64, 2_000, 20_000

#: times looked at together
_TOGETHER = 65_536

_ORDERS = ("speed", "acceleration", "jerk")


class Peaks(NamedTuple):
    """Largest values met at the multiples of the period."""

    speed_mm_per_s: float
    accel_mm_per_s2: float
    centripetal_mm_per_s2: float
    jerk_mm_per_s3: float
    angular_speed_deg_per_s: float
    angular_accel_deg_per_s2: float
    angular_jerk_deg_per_s3: float


class AxisPeaks(NamedTuple):
    """Speed, acceleration and jerk of one axis: largest values met, and limits (inf for none); in mm or degrees, and s.

    The largest ones are those at the multiples of the period.
    """

    name: str
    reached: tuple[float, float, float]
    limits: tuple[float, float, float]

    @property
    def used(self) -> tuple[float, float, float]:
        """What is reached over the limits."""
        v, a, j = (value / limit for value, limit in zip(self.reached, self.limits, strict=True))
        return v, a, j

    def as_dict(self) -> dict[str, float | None]:
        """Plain values with their units in the keys; None for no limit."""
        unit = "mm" if self.name in LINEAR else "deg"
        keys = [f"speed_{unit}_per_s", f"accel_{unit}_per_s2", f"jerk_{unit}_per_s3"]
        bounds = [limit if math.isfinite(limit) else None for limit in self.limits]
        return dict(zip(keys, self.reached, strict=True)) | {
            f"limit_{key}": bound for key, bound in zip(keys, bounds, strict=True)
        }


def peaks(law: TimeLaw) -> Peaks:
    """Largest speed, accelerations and jerk of a law at the multiples of the period."""

    def reached(times: Floats) -> Floats:
        states = law.at(times)
        rows = np.abs(np.stack((states.v, states.a, states.centripetal, states.j)))
        return np.stack([np.where(states.turning == turning, rows, 0.0).max(axis=1) for turning in (False, True)])

    tip, turn = _largest(law, reached, np.zeros((2, 4)))
    return Peaks(*tip.tolist(), *np.degrees(turn[[0, 1, 3]]).tolist())


def axis_peaks(law: TimeLaw) -> list[AxisPeaks]:
    """Peaks of the five axes of a law's machine; none where it was planned without one."""
    axes = law.machine_axes
    if axes is None:
        return []
    found = _largest(law, lambda times: np.abs(law.axes_at(times)[1:]).max(axis=1), np.zeros(axes.limits.shape))
    rows = zip(axes.names, found.T.tolist(), axes.limits.T.tolist(), strict=True)
    return [AxisPeaks(name, tuple(values), tuple(most)) for name, values, most in rows]


def _largest(law: TimeLaw, reached: Callable[[Floats], Floats], least: Floats) -> Floats:
    """What a law reaches at the multiples of the period, looked at in parts."""
    times = law.every_period()
    for begin in range(0, len(times), _TOGETHER):
        least = np.maximum(least, reached(times[begin : begin + _TOGETHER]))
    return least


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
