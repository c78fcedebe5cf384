"""The time of a long motion from plans of its parts, in bounded work.

What a plan does at a place depends on little around it: from a cut the motion comes up to speed within the distance
that it needs to brake. So a path is cut into parts, and each is planned with its surroundings. All parts are planned
roughly, and some of them as closely as a whole plan is, until the ratio of both is known (a ratio estimate: Cochran,
Sampling Techniques, ch. 6). Of very long paths one of so many neighbouring parts is planned at all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.feedrate.machine_axes import MachineAxes
from cornersmooth.feedrate.path import Path
from cornersmooth.feedrate.planner import Progress, plan_along
from cornersmooth.feedrate.reached import limiting
from cornersmooth.feedrate.resolution import FINER, ROUGHLY
from cornersmooth.feedrate.scurve import stopping_distance
from cornersmooth.model import Ints
from cornersmooth.settings import Limits
from cornersmooth.system.processes import map_in_processes

#: elements of a part, and around it at least and at most
PART, BESIDE, MOST_BESIDE = 512, 16, 256
#: parts that are planned at all at most, and standard error of the ratio with which no more are planned closely
MOST, ENOUGH = 1000, 1.5e-3
#: parts that are planned closely at a time, and at least and at most
_AT_ONCE, _LEAST, _MOST_CLOSELY = 4, 8, 32


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
    border = np.linspace(0, len(path), -(-len(path) // PART) + 1).astype(np.int64)
    edge, level = path.edge, np.concatenate(([0.0], np.cumsum(path.length / path.speed)))
    accel, jerk = np.array(limits.accel), np.array(limits.jerk)
    brake = 2.0 * float(stopping_distance(path.speed.max(keepdims=True), accel, jerk)[0])

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

    # one of so many neighbours, any of them: rows of a program come back at even distances
    every = -(-(len(border) - 1) // MOST)
    tried = np.arange(0, len(border) - 1, every)
    tried = np.minimum(tried + np.random.default_rng(0).integers(every, size=len(tried)), len(border) - 2)
    rough = np.zeros(len(tried))
    for row, (taken, _) in enumerate(map_in_processes(work, [(one, False) for one in tried.tolist()], processes)):
        rough[row] = taken
        if progress is not None:
            progress(row + 1, len(tried))
    at_feed = np.diff(level[border])[tried]
    # neighbours tell how parts that were passed over may differ
    passed = 1.0 - len(tried) / (len(border) - 1)
    slowness = float(rough.sum() / at_feed.sum())
    steps = np.diff(rough - slowness * at_feed)
    slowness_error = float(np.sqrt(passed * np.square(steps).sum() / 2.0) / rough.sum()) if passed else 0.0

    rows, closely, shares = _in_turn(len(tried)), np.zeros(0), dict[str, float]()
    ratio, ratio_error = 1.0, np.inf
    while len(closely) < min(_MOST_CLOSELY, len(rows)) and (len(closely) < _LEAST or ratio_error > ENOUGH):
        more = rows[len(closely) : len(closely) + _AT_ONCE]
        for taken, limited in map_in_processes(work, [(one, True) for one in tried[more].tolist()], processes):
            closely = np.append(closely, taken)
            for name, share in limited:
                shares[name] = shares.get(name, 0.0) + share * taken
        own, number = rough[rows[: len(closely)]], len(closely)
        ratio = float(closely.sum() / own.sum())
        spread = np.square(closely - ratio * own).sum() * number / max(number - 1, 1) * (1.0 - number / len(rows))
        ratio_error = float(np.sqrt(spread) / closely.sum())
    seconds, whole = ratio * slowness * float(level[-1]), float(closely.sum())
    most = sorted(((name, share / whole) for name, share in shares.items()), key=lambda pair: -pair[1])
    return PartsTime(seconds, seconds * float(np.hypot(ratio_error, slowness_error)), tuple(most))


def _in_turn(count: int) -> Ints:
    """Rows (count,) in an order whose beginnings are all spread evenly: by their bits in reverse."""
    bits = max(1, int(count - 1).bit_length())
    reverse = np.zeros(1 << bits, np.int64)
    for bit in range(bits):
        reverse |= ((np.arange(1 << bits) >> bit) & 1) << (bits - 1 - bit)
    return reverse[reverse < count]
