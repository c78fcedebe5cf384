"""Time the feedrate planning of programs of growing length: ``bench_feedrate.py [--corners N]...``.

Prints processor time per corner and peak memory for a winding five-axis path of short lines.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from cornersmooth import Limits, Program, Settings, TimeLaw, direct, plan, smooth

COUNTS = (1_000, 10_000, 100_000)
STEP, FEED, TOLERANCE = 0.6, 3000.0, 0.01  # mm, mm/min, mm


def winding_path(corners: int) -> Program:
    """Lines of 0.2 to 1 mm whose direction wanders by 9 degrees from one to the next, under a swaying axis."""
    rng = np.random.default_rng(1)
    number = np.arange(corners + 2)
    heading = np.cumsum(0.15 * rng.normal(size=len(number)))
    heading -= np.linspace(0.0, heading[-1], len(number))
    direction = np.stack((np.cos(heading), np.sin(heading), 0.1 * np.sin(0.01 * number)), axis=1)
    tip = np.cumsum(direction * STEP * rng.uniform(0.3, 1.7, (len(number), 1)), axis=0)
    axis = np.stack((0.3 * np.sin(0.02 * number), 0.2 * np.cos(0.013 * number), np.ones(len(number))), axis=1)
    return Program.from_poses(tip, axis, feed=FEED)


def timed(work: Callable[[], TimeLaw]) -> tuple[float, TimeLaw]:
    """Processor time of some work, s, and its result."""
    start = time.process_time()
    law = work()
    return time.process_time() - start, law


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--corners", type=int, action="append", help="number of corners; may be repeated")
    counts = parser.parse_args().corners or COUNTS
    print(f"{'corners':>9}{'motion':>24}{'seconds':>10}{'us/corner':>11}{'path s':>12}{'peak MB':>9}")
    limits = Limits()
    for count in counts:
        program = winding_path(count)
        smoothed = smooth(program, Settings(tolerance=TOLERANCE))
        for name, work in (
            ("direct, exact stop", partial(direct, program, limits)),
            ("direct, velocity jump", partial(direct, program, limits, "velocity_jump")),
            ("smoothed", partial(plan, smoothed, limits)),
        ):
            seconds, law = timed(work)
            per_megabyte = 1 << 20 if sys.platform == "darwin" else 1 << 10
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / per_megabyte
            print(f"{count:>9}{name:>24}{seconds:>10.2f}{seconds / count * 1e6:>11.1f}{law.total:>12.2f}{memory:>9.0f}")


if __name__ == "__main__":
    main()
