"""Runs solved and proved: knots by fitting, control points by the interior-point method, bounds for every piece.

Bounds are of the deviation at common parameters over whole stretches, not at samples: between neighbouring knots and
poses the curve less the original motion is one cubic in each coordinate, and a cubic stays within the hull of its
Bernstein points. For the tip that is all. The axis point b = tip + H·axis is measured at constant H: with ΔA, ΔB the
deviations of both curves, δ = ΔB − ΔA, and O, l direction and length of the original lever,

    b′ − b = ΔA + (H/l′)·(δ − O(O·δ)) − (H/l′)·q·O        l′ = |l·O + δ|,   0 ≤ q ≤ |δ|²/(2(l + O·δ))

With O and H/l taken from the middle of the stretch this is a cubic again; what it leaves out is bounded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import angle_between, batches, norm, spread, starts
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.runs.banded import Windows, near_spans
from cornersmooth.smoothing.runs.batches import Problem, solve_windows
from cornersmooth.smoothing.runs.fitting import fit
from cornersmooth.smoothing.runs.polylines import Pieces, Polylines
from cornersmooth.smoothing.runs.rows import largest_curvature, points_at
from cornersmooth.system.processes import map_in_processes

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
MENDINGS, MENDED = 12, 16

#: parts that every stretch is looked at in, first and where that is not enough
PARTS, MORE_PARTS = 2, 12

#: places of the Bernstein points of a straight motion
_THIRDS = np.arange(4) / 3.0

#: stretches looked at together
_BLOCK = 32768


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
        proven[changed] = bounds(problem, control, changed)
        failed = np.flatnonzero((proven > limits).any(axis=1))
        if not len(failed) or number == MENDINGS:
            break
        over = proven[failed] / limits
        factor = np.where(over > 1.0, 0.985 / np.maximum(over, 1.0), 1.0)
        if number:  # the axis point at constant H hangs on both
            factor[:, 0] = factor.min(axis=1)
        tight[failed] = np.maximum(tight[failed] * factor, LEAST_SHARE)
        span = pieces.span[failed]
        windows = Windows.where(splines, near_spans(splines, splines.span_run[span], span, MENDED, MENDED + 1))
        _solve(problem, windows, windows.free, control, tight, MENDING_GAPS, None, 1)
        moved = np.zeros(len(splines.control_run), np.bool_)
        moved[windows.control[windows.free]] = True
        changed = np.flatnonzero(moved[splines.taps(pieces.span)].any(axis=1))
    run = splines.span_run[pieces.span]
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


def bounds(problem: Problem, control: Floats, rows: Ints) -> Floats:
    """(p, 2) mm: bounds of the deviation of tip and axis point on some pieces; those beyond the tolerances closely."""
    proven = np.zeros((len(rows), 2))
    for begin in range(0, len(rows), _BLOCK):
        some = np.arange(begin, min(begin + _BLOCK, len(rows)))
        proven[some] = _bound(problem, control, rows[some], PARTS)
        doubtful = some[(proven[some] > problem.tolerances).any(axis=1)]
        if len(doubtful):
            proven[doubtful] = np.minimum(proven[doubtful], _bound(problem, control, rows[doubtful], MORE_PARTS))
    return proven


def _bound(problem: Problem, control: Floats, rows: Ints, parts: int) -> Floats:
    lines, pieces, largest = problem.lines, problem.pieces, np.zeros((len(rows), 2))
    span, segment = pieces.span[rows], pieces.segment[rows]
    hull = problem.splines.bezier(control, span, pieces.low[rows], pieces.high[rows])
    low, high = pieces.low[rows, None], pieces.high[rows, None]
    original = lines.on(segment[:, None], low + (high - low) * _THIRDS)
    whole_off, whole_levers = hull - original, original[:, :, 3:] - original[:, :, :3]
    ends = np.arange(parts + 1) / parts
    whole = Splines(np.array([0.0, 1.0]), np.array([2]))
    for cut in whole.bernstein(np.zeros(parts, np.int64), ends[:-1], ends[1:]):
        off, levers = cut @ whole_off, cut @ whole_levers
        np.maximum(largest[:, 0], norm(off[:, :, :3]).max(axis=1), out=largest[:, 0])
        np.maximum(largest[:, 1], _axis_bound(off, levers, problem.axis_length), out=largest[:, 1])
    return largest


def _axis_bound(off: Floats, levers: Floats, axis_length: float) -> Floats:
    """(g,) bounds from Bernstein points (g, 4, 6) of the deviation and levers (g, 4, 3) on the stretch."""
    tip, swing = off[:, :, :3], off[:, :, 3:] - off[:, :, :3]
    middle = (levers[:, 0] + levers[:, 3]) / 2.0
    size = norm(middle)
    direction = middle / size[:, None]
    half_way = norm(levers[:, 3] - levers[:, 0]) / 2.0
    factor = axis_length / size
    across = swing - (swing @ direction[:, :, None]) * direction[:, None]
    first = norm(tip + factor[:, None, None] * across).max(axis=1)
    # every lever of the stretch is within half_way of the one in the middle
    largest = norm(swing).max(axis=1)
    shortest = np.maximum(size - half_way - largest, 1e-9 * axis_length)
    turned = np.minimum(half_way / size, 1.0)  # sine of the angle to the middle, at most
    steepest = axis_length / shortest
    rest = (steepest * turned + (steepest - axis_length / (size + half_way + largest))) * largest
    return first + rest + steepest * largest**2 / (2.0 * shortest)
