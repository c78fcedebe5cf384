"""The fastest profiles under the limits of quantities, and which of these are kept where.

Rows of the problem hold the limits of some quantities at the ends and the middle of each cell: those that come nearest
to their limits there. All quantities are then measured, at the quarters of cells too. Where a plan is beyond a limit,
one more quantity is kept, limits of that cell are made stricter by as much, and the cells around it are planned again
(an exchange method for semi-infinite programmes: Hettich and Kortanek 1993). What is still beyond after the last round
is slowed down run by run, so that every plan keeps every limit. The first profile is that of a problem of the way
alone, under limits that let quantities nearly keep their own.

Long runs are solved window by window, so that the time is linear in the length of the program and the working memory is
bounded. A window ends with a crawl that can be kept up over all that follows, so there always is a way on; of its
profile that part is planned again that lies nearer to its end than the distance needed to brake, at most an eighth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cornersmooth.feedrate.interior_point import COLD, GAP, MAX_STEPS, WARM, solve
from cornersmooth.feedrate.intervals import Intervals, Resolution
from cornersmooth.feedrate.speed_problem import CRAWLING, PLACES, Batch, Grid, around, problem_of
from cornersmooth.feedrate.timelaw import stopping_distance
from cornersmooth.model import Floats, Ints

#: limits solved together, cells times rows: the arrays of one window stay in the processor's cache
WINDOW = 50_000
#: quantities that are kept in the first round
_HELD = 2
#: how much stricter than seen limits are made
_STRICTER = 1.003
#: share of the limits that plans keep at all places, and of it that rows keep: the rest is for what lies in between
_USED = 0.998
#: share of the limits that one term of a quantity's acceleration or jerk may use of the first profile
_EASE = 0.5
#: Newton steps of one round: most take 15 to 30; where terms are huge and cancel, hundreds gain next to nothing
_STEPS = 40
#: cells on either side of one that are planned again with it: they grow along the path, so many are a long way
_BESIDE = 50


def fastest(
    grid: Grid, limits: Intervals, resolution: Resolution, progress: Callable[[int, int], None] | None
) -> tuple[Batch, Floats]:
    """The problem of a grid, and coefficients (n,) of the fastest profiles that keep all limits.

    With no rounds they all but keep them.
    """
    derivatives = limits.derivatives(grid.start, grid.width, PLACES)
    bounds = np.repeat(_USED * limits.quantities.bounds[..., None], len(grid.start), axis=2)
    grid = _from_rest(grid, derivatives, bounds)
    if not limits.aligned:
        batch = problem_of(grid, derivatives, bounds)
        c = batch.start()
        solve_runs(batch, grid, c, progress)
        return batch, _within(c, batch.use(c), grid)
    way = problem_of(grid, derivatives[:, :0], bounds[:, :0])
    batch = problem_of(_eased(grid, derivatives, bounds), derivatives[:, :0], bounds[:, :0])
    c = batch.start()
    solve_runs(batch, grid, c, gap=resolution.rough, most=_STEPS)
    most, stricter, first, last = _used(batch, c, grid, derivatives, bounds), np.ones(len(c)), grid.first, grid.last
    for number in range(max(resolution.rounds, 1)):
        holding = np.argsort(-most, axis=0)[: _HELD + number]
        own = (
            np.take_along_axis(part, holding[index], axis=1)
            for part, index in ((derivatives, np.s_[None, ..., None]), (bounds, np.s_[None]))
        )
        batch = problem_of(grid, next(own), _USED * next(own)).tightened(stricter)
        cells, part = batch.stretches(first, last)
        of_cells = c[cells]
        solve_runs(part, grid.of(cells), of_cells, progress, gap=resolution.gap, most=_STEPS, begin_with=WARM)
        c[cells] = of_cells
        if not resolution.rounds:
            return batch, c
        used = _used(batch, c, grid, derivatives, bounds)
        share = np.maximum(used.max(axis=0), way.use(c))
        beyond = np.flatnonzero(share > 1.0)
        if not len(beyond):
            break
        most = np.maximum(most, used)
        of_held = np.take_along_axis(used, holding, axis=0).max(axis=0) / _USED
        kept = batch.use(c) <= _STRICTER  # what steps have not reached yet says nothing of what lies between places
        stricter = stricter * np.where(kept & (of_held > 1.0), _STRICTER * of_held, 1.0)
        first, last = _around(beyond, grid)
    return batch, _within(c, share, grid)


def _within(c: Floats, share: Floats, grid: Grid) -> Floats:
    """Coefficients of runs slower by as much as their cells use more than they may, (n,)."""
    return c / np.maximum(np.maximum.reduceat(share, grid.first), 1.0)[grid.run]


def _around(cells: Ints, grid: Grid) -> tuple[Ints, Ints]:
    """First and last cells of the stretches around some cells, `_BESIDE` on either side."""
    run = grid.run[cells]
    low, high = np.maximum(cells - _BESIDE, grid.first[run]), np.minimum(cells + _BESIDE, grid.last[run])
    apart = np.flatnonzero(low[1:] > high[:-1])
    return low[np.append(0, apart + 1)], high[np.append(apart, len(high) - 1)]


def _from_rest(grid: Grid, derivatives: Floats, bounds: Floats) -> Grid:
    """The grid with bounds of z where the cells next to stops end, under which constant jerk keeps all limits there.

    At the part τ of the time of a cell of length e, v = v₁·τ², a = 2·v₁²·τ/(3·e) and the jerk is 2·v₁³/(9·e²).
    """
    cap = grid.cap.copy()
    for cells, sign, tau in ((grid.first, 1.0, np.cbrt(PLACES)), (grid.last, -1.0, np.cbrt(1.0 - PLACES))):
        e = grid.width[cells]
        used = np.maximum(2.0 / 3.0 / e / grid.accel[cells], np.cbrt(2.0 / 9.0 / e**2 / grid.jerk[cells]) ** 2)
        one, two, three = derivatives[:, :, cells]
        _, accel, jerk = bounds[:, :, cells, None]
        e = e[:, None]
        shares = (
            np.abs(two * tau**4 + sign * one * (2.0 / 3.0) * tau / e) / accel,
            np.cbrt(np.abs(three * tau**6 + sign * two * 2.0 * tau**3 / e + one * (2.0 / 9.0) / e**2) / jerk) ** 2,
        )
        used = np.maximum(used, np.max(shares, axis=(0, 1, 3), initial=0.0))
        cap[cells] = np.minimum(cap[cells], 1.0 / used)
    return replace(grid, cap=cap)


def _eased(grid: Grid, derivatives: Floats, bounds: Floats) -> Grid:
    """The grid with limits along the way under which each term of a quantity uses `_EASE` of its limits at most."""
    one, two, three = np.abs(derivatives).max(axis=-1)
    _, accel, jerk = _EASE * bounds
    with np.errstate(divide="ignore"):
        return replace(
            grid,
            cap=np.min((grid.cap, (accel / two).min(axis=0), np.cbrt(jerk / three).min(axis=0) ** 2), axis=0),
            accel=np.minimum(grid.accel, (accel / one).min(axis=0)),
            jerk=np.minimum(grid.jerk, (jerk / one).min(axis=0)),
        )


def _used(batch: Batch, c: Floats, grid: Grid, derivatives: Floats, bounds: Floats) -> Floats:
    """(d, n) largest shares of limits of acceleration and jerk that quantities use in each cell.

    Between two of `PLACES` a smooth function leaves their range by at most an eighth of its second difference.
    """
    z, slope, bend = (part[:, None] for part in (batch.forms * around(c)).sum(axis=1))
    x = PLACES * grid.width[:, None]
    here, steep = np.maximum(z + x * (slope + x * bend), 0.0), slope + 2.0 * x * bend
    one, two, three = derivatives
    most = np.zeros(bounds.shape[1:])
    for values, bound in (
        (two * here + 0.5 * one * steep, bounds[1]),
        ((three * here + 1.5 * two * steep + one * bend) * np.sqrt(here), bounds[2]),
    ):
        between = np.abs(np.diff(values, n=2, axis=-1)).max(axis=-1) / 8.0
        np.maximum(most, (np.abs(values).max(axis=-1) + between) / bound, out=most)
    most[:, np.concatenate((grid.first, grid.last))] = 0.0  # see `_from_rest`
    return most


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

    `progress` is called with (cells done, cells in all); the rest is that of `solve`, where `begin_with` is `begin`.
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
            # distance in which the fastest motion of the run can stop under the strictest limits there
            slope, bend = batch.steepest[:, at[0] : end[0] + 1].max(axis=1)
            speed = np.sqrt(grid.cap[at[0] + 1 : end[0]].max())
            brake = 1.1 * float(stopping_distance(speed, 0.5 / slope, 1.0 / bend))
            while True:
                stop = np.minimum(at + size - 1, end)
                solve_window(at, stop)
                if stop == end:
                    break
                keep = np.searchsorted(grid.start, grid.start[stop + 1 - CRAWLING] - brake)
                at = np.minimum(np.maximum(keep, at + size * 7 // 8), stop - CRAWLING - 1)
        run = following
