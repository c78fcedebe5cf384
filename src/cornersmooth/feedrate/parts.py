"""Times of long motions without a plan of the whole: from plans of parts in bounded work, or in closed form.

What a plan does at a place depends on little around it: from a cut the motion comes up to speed within the distance
that it needs to brake. So a path is cut into parts, and each is planned with its surroundings. Parts in random order
are planned roughly, until the ratio of their times to those at the feed is known, and some of them as closely as a
whole plan is, until the ratio of both is (ratio estimates: Cochran, Sampling Techniques, ch. 6).

In closed form acceleration between speeds is even, that of an S-curve in the mean. An S-curve from rest to v within
acceleration a and jerk J takes v/a + a/J, or 2·√(v/J) where it does not reach a. With that of each place v² rises and
falls by 2·a·s at most, and its largest value at each border is a least sum forwards, and another one backwards. From
rest to rest times are exact where the feed is reached. Where speeds change by less, they are a little too short.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.feedrate.intervals import FINER, ROUGHLY, path_limits
from cornersmooth.feedrate.machine_axes import MachineAxes, follow
from cornersmooth.feedrate.path import Path
from cornersmooth.feedrate.planner import Progress, passed, plan_along
from cornersmooth.feedrate.timelaw import limiting, stopping_distance
from cornersmooth.kinematics import Machine, endless
from cornersmooth.model import Floats
from cornersmooth.settings import Limits
from cornersmooth.system.processes import map_in_processes

#: elements of a part at least and at most, over those in the distance to brake; around it at least and at most
SHORTEST, PART, BESIDE, MOST_BESIDE = 128, 512, 16, 256
_TO_BRAKE = 4.0
#: standard error of a ratio with which no more parts are planned; as many at a time, and at least, roughly and closely
ENOUGH, _ROUGHLY, _CLOSELY = 1.5e-3, (16, 32), (4, 8)
#: parts that are planned closely at most
_MOST_CLOSELY = 32


@dataclass(frozen=True)
class PartsTime:
    """Time of a motion from plans of its parts."""

    seconds: float
    error: float  #: s: one standard error
    limiting: tuple[tuple[str, float], ...]  #: as `cornersmooth.feedrate.limiting` gives it, of parts planned closely


def time_of_parts(
    path: Path,
    limits: Limits,
    machine_axes: MachineAxes,
    *,
    processes: int = 1,
    progress: Progress | None = None,
) -> PartsTime:
    """Time of a motion from rest to rest, with the axes of a machine that follow the path.

    The result does not depend on the number of processes.
    """
    edge, accel, jerk = path.edge, np.array(limits.accel), np.array(limits.jerk)
    brake = 2.0 * float(stopping_distance(path.speed.max(keepdims=True), accel, jerk)[0])
    size = int(np.clip(_TO_BRAKE * brake * len(path) / max(edge[-1], brake), SHORTEST, PART))
    border = np.linspace(0, len(path), -(-len(path) // size) + 1).astype(np.int64)
    at_feed = np.add.reduceat(path.length / path.speed, border[:-1])

    def work(item: tuple[int, bool]) -> tuple[float, list[tuple[str, float]]]:
        number, closely = item
        begin, end = int(border[number]), int(border[number + 1])
        low, high = np.searchsorted(edge, (edge[begin] - brake, edge[end] + brake)).tolist()
        low = max(0, begin - min(max(begin - low, BESIDE), MOST_BESIDE))
        high = min(len(path), end + min(max(high - end, BESIDE), MOST_BESIDE))
        speeds = path.junction_speed[low : high + 1].copy()
        speeds[[0, -1]] = 0.0  # at rest where it is cut
        part = replace(path.part(low, high), junction_speed=speeds)
        law = plan_along(part, limits, machine_axes, FINER if closely else ROUGHLY)
        taken = float(np.diff(law.times_at(law.edge[[begin - low, end - low]]))[0])
        return taken, limiting(law) if closely else []

    order, rough, closely = np.random.default_rng(0).permutation(len(at_feed)), np.zeros(0), np.zeros(0)
    slowness = ratio = slowness_error = ratio_error = np.inf
    while len(rough) < len(order) and (len(rough) < _ROUGHLY[1] or slowness_error > ENOUGH):
        more = order[len(rough) : len(rough) + _ROUGHLY[0]]
        rough = np.append(rough, [one for one, _ in map_in_processes(work, [(k, False) for k in more], processes)])
        slowness, slowness_error = _ratio(rough, at_feed[order[: len(rough)]], len(order))
        if progress is not None:
            progress(len(rough), len(order))
    shares = dict[str, float]()
    most = min(_MOST_CLOSELY, len(rough))
    while len(closely) < most and (len(closely) < _CLOSELY[1] or ratio_error > ENOUGH):
        more = order[len(closely) : min(len(closely) + _CLOSELY[0], most)]
        for taken, limited in map_in_processes(work, [(k, True) for k in more], processes):
            closely = np.append(closely, taken)
            for name, share in limited:
                shares[name] = shares.get(name, 0.0) + share * taken
        ratio, ratio_error = _ratio(closely, rough[: len(closely)], len(rough))
    seconds, whole = ratio * slowness * float(at_feed.sum()), float(closely.sum())
    reached = sorted(((name, share / whole) for name, share in shares.items()), key=lambda pair: -pair[1])
    return PartsTime(seconds, seconds * float(np.hypot(ratio_error, slowness_error)), tuple(reached))


def _ratio(taken: Floats, known: Floats, count: int) -> tuple[float, float]:
    """Ratio of times of some parts to what is known of these, and its relative standard error; of `count` in all."""
    number, ratio = len(taken), float(taken.sum() / known.sum())
    spread = np.square(taken - ratio * known).sum() * number / max(number - 1, 1) * (1.0 - number / count)
    return ratio, float(np.sqrt(spread) / taken.sum())


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
