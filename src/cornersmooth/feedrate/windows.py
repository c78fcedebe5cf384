"""Speed profiles of whole programs, solved window by window.

The time is linear in the length of the program and the working memory is bounded. A window ends with a crawl that can
be kept up over all that follows, so there always is a way on; of its profile only the part is kept that lies further
from its end than the distance needed to brake, where the end makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cornersmooth.feedrate.grid import Grid
from cornersmooth.feedrate.interior_point import COLD, GAP, MAX_STEPS, WARM, solve
from cornersmooth.feedrate.scurve import stopping_distance
from cornersmooth.feedrate.speed_problem import CRAWLING, Batch
from cornersmooth.model import Floats

#: limits solved together, cells times rows: the arrays of one window stay in the processor's cache
WINDOW = 50_000


def solve_runs(
    batch: Batch,
    grid: Grid,
    progress: Callable[[int, int], None] | None = None,
    start: Floats | None = None,
    gap: float = GAP,
    most: int = MAX_STEPS,
) -> Floats:
    """Coefficients of the fastest profiles, (n,); short runs together, long ones window by window.

    Parameters
    ----------
    progress : callable, optional
        Called with (cells done, cells in all).
    start : (n,) float64, optional
        Coefficients to begin with that keep all limits with room to spare.
    gap : float
        Remaining duality gap over the time at which a profile is taken.
    most : int
        Newton steps after which it is taken in any case.
    """
    c, begin_with = (batch.start(), COLD) if start is None else (start.copy(), WARM)
    n = len(c)
    size = WINDOW // batch.ends[-1]
    run = 0
    while run < len(batch.first):
        begin = int(batch.first[run])
        end_run = int(np.searchsorted(batch.last, begin + size, side="left"))
        end_run = max(end_run, run + 1)
        end = int(batch.last[end_run - 1]) + 1
        if end - begin <= size:
            c[begin:end] = solve(batch.window(begin, end), c[begin:end], gap, most, begin_with)
        else:
            at, brake = begin, _braking_distance(batch, grid, begin, end)
            while True:
                stop = min(at + size, end)
                c[at:stop] = solve(batch.window(at, stop), c[at:stop], gap, most, begin_with)
                if stop == end:
                    break
                keep = int(np.searchsorted(grid.start, grid.start[stop - CRAWLING] - brake))
                at = min(max(keep, at + size // 2), stop - CRAWLING - 2)
                if progress is not None:
                    progress(at, n)
        run = end_run
        if progress is not None:
            progress(end, n)
    return c


def _braking_distance(batch: Batch, grid: Grid, begin: int, end: int) -> float:
    """Distance in which the fastest motion in some cells can stop under the strictest limits there."""
    speed = np.sqrt(grid.cap[begin + 1 : end - 1].max())
    slope, bend = batch.steepest[:, begin:end].max(axis=1)
    return 1.1 * float(stopping_distance(speed, 0.5 / slope, 1.0 / bend))
