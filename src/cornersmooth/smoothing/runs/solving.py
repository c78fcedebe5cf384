"""Runs solved and proved: knots by fitting, control points by the interior-point method, bounds for every piece."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import batches, spread, starts
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.processes import map_in_processes
from cornersmooth.slices import some_rows
from cornersmooth.smoothing.runs.batches import Problem, solve_windows
from cornersmooth.smoothing.runs.fitting import fit
from cornersmooth.smoothing.runs.polylines import Pieces, Polylines
from cornersmooth.smoothing.runs.proof import bounds
from cornersmooth.smoothing.runs.rows import largest_curvature, points_at
from cornersmooth.smoothing.runs.windows import Windows
from cornersmooth.vectors import angle_between, norm

#: spans of a window that are its own, and spans beside them that settle down to what the neighbour finds
CORE, BESIDE = 192, 24

#: spans solved at once, whose arrays fit the processor's cache
BATCH = 3072

#: step of the parameter over the tolerance
STEP = 0.01

#: least share of what they may use that pieces are left whose bounds are too large
LEAST_SHARE = 0.5

#: gaps of the rounds of all windows, and of the rounds that mend what is not proved
GAPS, MENDING_GAPS = (0.5, 0.1), (0.1,)

#: how often pieces that are not proved are given less, and spans on either side that are solved anew with them
MENDINGS, MENDED = 5, 16

#: parts of the way from the fit to the solution that are tried where pieces are not proved otherwise, and the number
#: of control points over which the rest of the way is gone
BLENDS = (0.9, 0.75, 0.5, 0.0)
FADE = 8


@dataclass(frozen=True)
class RunCurves:
    """Pairs of cubic B-splines for r runs."""

    lines: Polylines
    splines: Splines
    control: Floats  # control points of tip and axis point, (c, 6), mm
    tip_bound: Floats  # proven bounds of the deviation at common parameters, mm
    axis_bound: Floats  # the same of the axis point at constant H
    kept: Bools  # whether the run keeps its tolerances; the others are not to be used


def solve_runs(
    lines: Polylines,
    tolerances: tuple[float, float],
    axis_length: float,
    progress: Callable[[int, int], None] | None = None,
    *,
    processes: int = 1,
) -> RunCurves:
    """Find the smoothest pair of splines for every run of 3 distinct poses or more.

    Tolerances are those of the tip and of the axis point at constant H, mm. `progress` is called with (poses done,
    poses in all). The result does not depend on the number of processes.
    """
    splines, rough = fit(lines, tolerances)
    pieces = Pieces.of(splines, lines)
    problem = Problem(lines, splines, pieces, rough, tolerances, axis_length)
    control, proven = rough.copy(), np.zeros((len(pieces.span), 2))
    tight = np.ones((len(pieces.span), 2))
    windows = _cut(splines)
    _solve(problem, windows, _own(splines, windows), control, tight, GAPS, progress, processes)
    changed = np.arange(len(pieces.span))
    limits = np.array(tolerances)
    for number in range(MENDINGS + 1):
        proven[changed] = bounds(splines, control, lines, some_rows(pieces, changed), axis_length, tolerances)
        failed = np.flatnonzero((proven > limits).any(axis=1))
        if not len(failed) or number == MENDINGS:
            break
        over = proven[failed] / limits
        factor = np.where(over > 1.0, 0.985 / np.maximum(over, 1.0), 1.0)
        if number:  # the axis point at constant H hangs on both
            factor[:, 0] = factor.min(axis=1)
        tight[failed] = np.maximum(tight[failed] * factor, LEAST_SHARE)
        windows = _around(splines, pieces.span[failed])
        _solve(problem, windows, windows.free, control, tight, MENDING_GAPS, None, 1)
        changed = _touched(splines, pieces, windows.control[windows.free])
    run = splines.span_run[pieces.span]
    for part in BLENDS:  # deviations are nearly linear in the control points, and the fit is well within ε
        failed = np.flatnonzero((proven > limits).any(axis=1))
        if not len(failed):
            break
        share = _fade(splines, pieces.span[failed], part)[:, None]
        control = rough + share * (control - rough)
        changed = _touched(splines, pieces, np.flatnonzero(share[:, 0] < 1.0))
        proven[changed] = bounds(splines, control, lines, some_rows(pieces, changed), axis_length, tolerances)
    worst = np.zeros((len(lines.count), 2))
    np.maximum.at(worst, run, proven)
    tip, axis = worst[:, 0], worst[:, 1]
    return RunCurves(lines, splines, control, tip, axis, (tip <= limits[0]) & (axis <= limits[1]))


def _cut(splines: Splines) -> Windows:
    """Windows of `CORE` spans and their surroundings; a short rest joins the window before it."""
    spans = splines.count - 1
    number = np.maximum(1, np.round(spans / CORE).astype(np.int64))
    run, place = spread(number)
    first = splines.span_first[run]
    begin = first + place * spans[run] // number[run]
    end = first + (place + 1) * spans[run] // number[run]
    begin = np.maximum(begin - BESIDE * (place > 0), first)
    end = np.minimum(end + BESIDE * (place < number[run] - 1), splines.span_first[run + 1])
    return Windows.of(splines, begin, end - begin)


def _own(splines: Splines, windows: Windows) -> Bools:
    """(c,) control points of the windows that are their own to set."""
    run = splines.span_run[windows.begin]
    at_start = windows.begin == splines.span_first[run]
    at_end = windows.begin + windows.count == splines.span_first[run + 1]
    _, place = spread(windows.count + 3)
    w = windows.window
    low = np.where(at_start, 0, BESIDE + 1)[w]
    high = (windows.count + 3 - np.where(at_end, 0, BESIDE + 2))[w]
    return (place >= low) & (place < high) & windows.free


def _around(splines: Splines, spans: Ints) -> Windows:
    """Windows of the spans and `MENDED` more on either side."""
    step = np.zeros(len(splines.span_run) + 1, np.int64)
    run = splines.span_run[spans]
    np.add.at(step, np.maximum(spans - MENDED, splines.span_first[run]), 1)
    np.add.at(step, np.minimum(spans + MENDED + 1, splines.span_first[run + 1]), -1)
    return Windows.where(splines, np.cumsum(step[:-1]) > 0)


def _solve(
    problem: Problem,
    windows: Windows,
    own: Bools,
    control: Floats,
    tight: Floats,
    gaps: tuple[float, ...],
    progress: Callable[[int, int], None] | None,
    processes: int,
) -> None:
    """Set the control points of the windows that are their `own` (rows of `windows.control`), some windows at once."""
    first = batches(windows.count, BATCH)
    at = starts(windows.count + 3)

    def settle(number: int) -> Floats:
        rows = np.arange(first[number], first[number + 1])
        own_windows = Windows.of(problem.splines, windows.begin[rows], windows.count[rows])
        moved = solve_windows(problem, own_windows, control, tight, gaps, near=gaps is MENDING_GAPS)
        return moved[own[at[rows[0]] : at[rows[-1] + 1]]]

    some = range(len(first) - 1)
    # `control` must not change before all are found: neighbours look at it
    found = []
    for number, mine in enumerate(map_in_processes(settle, some, min(processes, len(some)))):
        found.append(mine)
        if progress is not None:
            last = first[number + 1] - 1
            done, total = int(windows.begin[last] + windows.count[last]), len(problem.splines.span_run)
            progress(len(problem.lines.s) * done // total, len(problem.lines.s))
    if found:
        control[windows.control[own]] = np.concatenate(found)


def _fade(splines: Splines, spans: Ints, part: float) -> Floats:
    """(c,) `part` at the control points of the spans, rising to 1 over the `FADE` next ones."""
    distance = np.full(len(splines.control_run), FADE, np.int64)
    near = splines.span_control[np.unique(spans)]
    first = splines.control_first[splines.span_run[np.unique(spans)]]
    end = splines.control_first[splines.span_run[np.unique(spans)] + 1]
    for shift in range(1 - FADE, FADE + 4):
        at = near + shift
        inside = (at >= first) & (at < end)
        away = max(0, -shift, shift - 3)
        np.minimum.at(distance, at[inside], away)
    return part + (1.0 - part) * distance / FADE


def _touched(splines: Splines, pieces: Pieces, control: Ints) -> Ints:
    """Pieces that hang on any of the control points."""
    moved = np.zeros(len(splines.control_run), np.bool_)
    moved[control] = True
    return np.flatnonzero(moved[splines.taps(pieces.span)].any(axis=1))


def measured(curves: RunCurves) -> tuple[Floats, Floats, Floats, Floats]:
    """Curves at the n poses of their runs, (n,) each.

    Deviation of the tip and of the axis point at common parameters (mm), deviation of the axis (rad), and the largest
    curvature of the tip's curve in the halves of the segments beside the pose (1/mm).
    """
    lines, splines = curves.lines, curves.splines
    run, _ = spread(lines.count)
    tip, axis = points_at(curves.control, splines, splines.span_at(run, lines.s), lines.s)
    lever = lines.point[:, 3:] - lines.point[:, :3]
    size = norm(lever)[:, None]
    off = tip - lines.point[:, :3]
    top = off + size * axis - lever
    return norm(off), norm(top), angle_between(axis, lever / size), largest_curvature(lines, splines, curves.control)
