"""Speed profiles of whole programs, solved window by window.

The time is linear in the length of the program and the working memory is bounded. A window ends with a crawl that can
be kept up over all that follows, so there always is a way on; of its profile that part is planned again that lies
nearer to its end than the distance needed to brake, at most an eighth: there the end makes a difference.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cornersmooth.feedrate.grid import Grid
from cornersmooth.feedrate.interior_point import COLD, GAP, MAX_STEPS, solve
from cornersmooth.feedrate.scurve import stopping_distance
from cornersmooth.feedrate.speed_problem import CRAWLING, Batch
from cornersmooth.model import Floats, Ints

#: limits solved together, cells times rows: the arrays of one window stay in the processor's cache
WINDOW = 50_000


def solve_runs(
    batch: Batch,
    grid: Grid,
    c: Floats,
    progress: Callable[[int, int], None] | None = None,
    *,
    gap: float = GAP,
    most: int = MAX_STEPS,
    begin_with: float = COLD,
) -> None:
    """Set coefficients (n,) to those of the fastest profiles; short runs together, long ones window by window.

    Parameters
    ----------
    c : (n,) float64
        Coefficients to begin with.
    progress : callable, optional
        Called with (cells done, cells in all).
    gap : float
        Remaining duality gap over the time at which a profile is taken.
    most : int
        Newton steps after which it is taken in any case.
    begin_with : float
        Duality gap over the time to begin with.
    """

    def solve_window(first: Ints, last: Ints) -> None:
        cells, part = batch.stretches(first, last)
        c[cells] = solve(part, c[cells], gap, most, begin_with)
        if progress is not None:
            progress(int(last[-1]) + 1, len(c))

    size, run = WINDOW // batch.ends[-1], 0
    while run < len(batch.first):
        at = batch.first[run : run + 1]
        following = max(int(np.searchsorted(batch.last, at[0] + size)), run + 1)
        end = batch.last[following - 1 : following]
        if end[0] - at[0] < size:
            solve_window(batch.first[run:following], batch.last[run:following])
        else:
            brake = braking_distance(batch, grid, int(at[0]), int(end[0]))
            while True:
                stop = np.minimum(at + size - 1, end)
                solve_window(at, stop)
                if stop == end:
                    break
                keep = np.searchsorted(grid.start, grid.start[stop + 1 - CRAWLING] - brake)
                at = np.minimum(np.maximum(keep, at + size * 7 // 8), stop - CRAWLING - 1)
        run = following


def braking_distance(batch: Batch, grid: Grid, begin: int, end: int) -> float:
    """Distance in which the fastest motion in some cells can stop under the strictest limits there."""
    speed = np.sqrt(grid.cap[begin + 1 : end].max())
    slope, bend = batch.steepest[:, begin : end + 1].max(axis=1)
    return 1.1 * float(stopping_distance(speed, 0.5 / slope, 1.0 / bend))
