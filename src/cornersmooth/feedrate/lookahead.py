"""Speed profiles of whole programs: a grid over every run between two stops, solved window by window.

The time is linear in the length of the program and the working memory is bounded. A window ends with a crawl that can
be kept up over all that follows, so there always is a way on; of its profile only the part is kept that lies further
from its end than the distance needed to brake, where the end makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cornersmooth.feedrate.grid import Grid
from cornersmooth.feedrate.interior_point import GAP, MAX_STEPS, solve
from cornersmooth.feedrate.scurve import stopping_distance
from cornersmooth.feedrate.speed_problem import Batch
from cornersmooth.model import Floats, Ints

#: cells solved together: the arrays of one window stay in the processor's cache
WINDOW = 8192
#: last coefficients of a window that stay at the crawl: its last two nodes then neither accelerate nor brake
CRAWLING = 3
#: a coefficient cap for slots without a cell
FREE = 1e30


def batch_of(grid: Grid, accel: Floats, jerk: Floats, coefficients: Floats | None = None) -> Batch:
    """The optimisation problem of all runs of a grid.

    The cells of a run are its slots: the first and the last, next to the stops, are driven with constant jerk.

    Parameters
    ----------
    accel, jerk : (n,) float64
        Limits per cell.
    coefficients : (5, n) float64, optional
        Coefficients per cell as in `axis_limits.LimitCoefficients.rows`, besides those of the path speed.
    """
    n = len(grid.start)
    first, last = grid.first, grid.last
    inner = grid.width.copy()
    inner[first] = 0.0
    inner[last] = 0.0
    following = np.append(inner[1:], 0.0)
    both = inner + following
    node = np.ones(n, np.bool_)
    node[last] = False
    safe = np.where(node, both, 1.0)
    near, far = np.where(node, following / safe, 0.0), np.where(node, inner / safe, 0.0)
    slope = np.where(node, 2.0 / safe, 0.0)

    cell = node.copy()
    cell[last - 1] = False
    width = np.where(cell, np.append(grid.width[1:], 1.0), 1.0)
    slope_after = np.append(slope[1:], 0.0)
    bend = np.where(cell, np.stack((slope, -slope - slope_after, slope_after)) / (2.0 * width), 0.0)

    use = np.zeros((5, n)) if coefficients is None else coefficients.copy()
    use[0] = np.maximum(use[0], 0.5 / accel)
    use[2] = np.maximum(use[2], 1.0 / jerk)
    at_node = np.maximum(use[:2], np.concatenate((use[:2, 1:], use[:2, -1:]), axis=1))
    in_cell = np.where(cell, np.concatenate((use[2:, 1:], use[2:, -1:]), axis=1), 0.0)
    in_cell[0] = np.where(cell, in_cell[0], 1.0 / jerk)

    node_cap = np.where(node, np.minimum(grid.cap, np.append(grid.cap[1:], np.inf)), FREE)
    for end, at in ((first, first), (last, last - 1)):
        e = grid.width[end]
        with_unit_speed = use[2, end] * (2.0 / 9.0) / e**2 + use[3, end] * (4.0 / 3.0) / e + use[4, end]
        with np.errstate(divide="ignore"):  # where nothing is asked for, nothing is limited
            node_cap[at] = np.minimum(node_cap[at], np.cbrt(with_unit_speed) ** -2)
    cell_cap = grid.cap.copy()
    cell_cap[first] = FREE
    cell_cap[last] = FREE

    weight = inner / 3.0
    weight[:-1] += inner[1:] / 3.0
    weight[1:] += inner[:-1] / 3.0
    weight[first] += 3.0 * grid.width[first]
    weight[last] += 3.0 * grid.width[last]
    return Batch(
        near=near,
        far=far,
        slope=slope,
        bend=bend,
        node_cap=node_cap,
        cell_cap=cell_cap,
        accel_level=np.where(node, at_node[1], 0.0),
        accel_slope=at_node[0],
        jerk_level=in_cell[2],
        jerk_slope=in_cell[1],
        jerk_bend=in_cell[0],
        weight=weight,
        first=first,
        last=last,
        first_ratio=1.0 / (1.0 + 2.0 * grid.width[first + 1] / (3.0 * grid.width[first])),
        last_ratio=1.0 / (1.0 + 2.0 * grid.width[last - 1] / (3.0 * grid.width[last])),
        frozen=np.zeros(n, np.bool_),
    )


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
    c = batch.start() if start is None else start.copy()
    n = len(c)
    run = 0
    while run < len(batch.first):
        begin = int(batch.first[run])
        end_run = int(np.searchsorted(batch.last, begin + WINDOW, side="left"))
        end_run = max(end_run, run + 1)
        end = int(batch.last[end_run - 1]) + 1
        if end - begin <= WINDOW:
            c[begin:end] = solve(_part(batch, begin, end), c[begin:end], gap, most)
        else:
            _solve_long(batch, grid, c, begin, end, gap, most, progress)
        run = end_run
        if progress is not None:
            progress(end, n)
    return c


def _solve_long(
    batch: Batch,
    grid: Grid,
    c: Floats,
    begin: int,
    end: int,
    gap: float,
    most: int,
    progress: Callable[[int, int], None] | None,
) -> None:
    speed = np.sqrt(batch.cell_cap[begin + 1 : end - 1].max())
    steepest, most_bent = batch.accel_slope[begin:end].max(), batch.jerk_bend[begin:end].max()
    for limit in batch.signed:
        if limit.bend is None:
            steepest = max(steepest, np.abs(limit.slope[begin:end]).max())
        else:
            most_bent = max(most_bent, np.abs(limit.bend[begin:end]).max())
    accel, jerk = 0.5 / steepest, 1.0 / most_bent
    brake = 1.1 * float(stopping_distance(speed, accel, jerk))
    at = begin
    while True:
        stop = min(at + WINDOW, end)
        c[at:stop] = solve(_part(batch, at, stop), c[at:stop], gap, most)
        if stop == end:
            return
        keep = int(np.searchsorted(grid.start, grid.start[stop - CRAWLING] - brake))
        at = min(max(keep, at + WINDOW // 2), stop - CRAWLING - 2)
        if progress is not None:
            progress(at, len(c))


def _part(batch: Batch, begin: int, end: int) -> Batch:
    """Slots `begin` to `end` on their own; where a run is cut its coefficients are frozen at the cut."""
    inside = (batch.first >= begin) & (batch.last < end)
    runs = np.flatnonzero(inside)
    cut_front = begin not in batch.first
    cut_back = end - 1 not in batch.last
    near, far, slope = (array[begin:end].copy() for array in (batch.near, batch.far, batch.slope))
    bend, node_cap = batch.bend[:, begin:end].copy(), batch.node_cap[begin:end].copy()
    levels = batch.accel_level[begin:end].copy(), batch.jerk_level[begin:end].copy(), batch.jerk_slope[begin:end].copy()
    frozen = np.zeros(end - begin, np.bool_)
    signed = [limit.part(slice(begin, end)) for limit in batch.signed]
    if cut_front:
        frozen[:2] = True
    if cut_back:
        frozen[-CRAWLING:] = True
        near[-1] = far[-1] = slope[-1] = 0.0
        bend[:, -2:] = 0.0
        node_cap[-1] = FREE
        levels[0][-1] = 0.0
        for level in levels[1:]:
            level[-2:] = 0.0
        for limit in signed:
            for part in limit[1:]:
                if part is not None:
                    part[-2:] = 0.0
    if len(runs):
        first, last = batch.first[runs] - begin, batch.last[runs] - begin
        first_ratio, last_ratio = batch.first_ratio[runs], batch.last_ratio[runs]
    else:
        run = int(np.searchsorted(batch.first, begin, side="right")) - 1
        first, last = np.array([0]), np.array([end - begin - 1])
        first_ratio = np.array([np.nan if cut_front else batch.first_ratio[run]])
        last_ratio = np.array([np.nan if cut_back else batch.last_ratio[run]])
    return replace(
        batch,
        near=near,
        far=far,
        slope=slope,
        bend=bend,
        node_cap=node_cap,
        cell_cap=batch.cell_cap[begin:end],
        accel_level=levels[0],
        accel_slope=batch.accel_slope[begin:end],
        jerk_level=levels[1],
        jerk_slope=levels[2],
        jerk_bend=batch.jerk_bend[begin:end],
        weight=batch.weight[begin:end],
        first=first,
        last=last,
        first_ratio=first_ratio,
        last_ratio=last_ratio,
        frozen=frozen,
        signed=tuple(signed),
    )


def run_of_cells(grid: Grid) -> Ints:
    """(n,) number of the run that each cell belongs to."""
    cells = np.diff(np.append(grid.first, len(grid.start)))
    return np.repeat(np.arange(len(grid.first)), cells)
