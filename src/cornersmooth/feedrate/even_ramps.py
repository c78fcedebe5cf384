"""When a motion is where, in closed form: between speeds the acceleration is even, that of an S-curve in the mean.

An S-curve from rest to v within acceleration a and jerk J takes v/a + a/J, or 2·√(v/J) where it does not reach a. So
its mean acceleration is known for the feed of each place. With it v² rises and falls by 2·a·s at most, and its largest
value at each border is a least sum forwards, and another one backwards. From rest to rest times are exact where the
feed is reached. Where speeds change by less than the feed, they are a little too short.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.feedrate.intervals import path_limits
from cornersmooth.feedrate.machine_axes import follow
from cornersmooth.feedrate.path import Path
from cornersmooth.feedrate.planner import passed
from cornersmooth.feedrate.resolution import ROUGHLY
from cornersmooth.kinematics import Machine, endless
from cornersmooth.model import Floats
from cornersmooth.settings import Limits


def ramp_times(path: Path, limits: Limits, machine: Machine) -> Floats:
    """(m,) time of each element of a path, s; errors as `cornersmooth.feedrate.plan`."""
    axes = follow(endless(machine), path)
    path = passed(path, limits, axes)
    found = path_limits(path, limits, axes, ROUGHLY)
    width = np.diff(found.edge)
    rate, bend, _ = found.derivatives(found.edge[:-1], width, np.array([0.5]))[..., 0]
    _, most, jerks = found.quantities.bounds[..., None]
    of_run = np.diff(found.run)
    with np.errstate(divide="ignore"):
        most_along = np.minimum(np.repeat(found.accel, of_run), (most / np.abs(rate)).min(axis=0))
        jerk = np.minimum(np.repeat(found.jerk, of_run), (jerks / np.abs(rate)).min(axis=0))
        cap = np.minimum(found.cap, (most / np.abs(bend)).min(axis=0))
    room = jerk * path.speed[found.element]
    reaches = room >= most_along**2
    along = np.where(reaches, most_along / (1.0 + most_along**2 / room), np.sqrt(room) / 2.0)
    at = np.minimum(np.append(cap, 0.0), np.append(0.0, cap))  # v² at borders
    at[found.run] = 0.0
    gain = np.append(0.0, np.cumsum(2.0 * along * width))
    at = np.minimum.accumulate(at - gain) + gain
    at = np.maximum(np.minimum.accumulate((at + gain)[::-1])[::-1] - gain, 0.0)
    begin, end = at[:-1], at[1:]
    peak = np.maximum(np.minimum(cap, along * width + (begin + end) / 2.0), np.maximum(begin, end))
    ramps = (2.0 * np.sqrt(peak) - np.sqrt(begin) - np.sqrt(end)) / along
    even = np.maximum(width - (2.0 * peak - begin - end) / (2.0 * along), 0.0) / np.sqrt(
        np.where(peak > 0.0, peak, 1.0)
    )
    return np.bincount(found.element, ramps + even, len(path)).astype(np.float64)
