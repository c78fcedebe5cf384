"""Knots of a run, as few as ε asks for: a spline is fitted by least squares and refined where it is too far off."""

from __future__ import annotations

import numpy as np

from cornersmooth.arrays import ranges, some_rows, spread
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.runs.banded import Gather, Windows, applied, near_spans, solve_scalar
from cornersmooth.smoothing.runs.polylines import Pieces, Polylines, Samples

#: share of the tolerances that the fit may use. Less in spans that hold poses: the knots of neighbouring passes differ,
#: and must not show.
CLOSE, CLOSE_TO_POSES = 0.7, 0.3

#: poses between the first knots
STRIDE = 16

#: control points beside a new knot that are fitted anew
REACH = 10

#: rounds of refining, and the shortest span that is split, steps
ROUNDS, SHORTEST = 30, 8

#: reach of a sharp corner over ε and its turn: with 6 a transition of its own would be ε off (docs/method.md, c = 1/6)
_CORNER = 6.5

#: place of a second knot beside a sharp corner, over the first: without it the curve could not swing out
WINGS = 2.2

#: weight of the third derivative, which settles what samples leave open
_RIDGE = 1e-6


def fit(lines: Polylines, tolerances: tuple[float, float]) -> tuple[Splines, Floats]:
    """Fit splines with control points (c, 6), mm, to runs of 3 poses or more.

    Position, tangent and curvature zero are kept at their ends. Spans are refined until `CLOSE` of the tolerances of
    tip and axis point (mm) is kept, or they are too short.
    """
    splines = first_knots(lines)
    control = lines_to_control(lines, splines)
    active = np.ones(len(splines.span_run), np.bool_)
    off = np.zeros(len(active))
    corner = _corner_reach(lines, tolerances)
    for _ in range(ROUNDS):
        windows = Windows.where(splines, active)
        pieces = Pieces.of(splines, lines)
        rows = np.flatnonzero(active[pieces.span])
        samples = Samples.of(splines, lines, some_rows(pieces, rows))
        control = _least_squares(splines, windows, samples, control)
        off[active] = _largest(splines, samples, control, tolerances)[active]
        close = np.where(holding_poses(splines, lines), CLOSE_TO_POSES, CLOSE)
        bad = active & (off > close) & (splines.width > SHORTEST)
        if not bad.any():
            break
        splines, control, active, off = _refine(lines, splines, control, off, np.flatnonzero(bad), corner)
    return splines, control


def holding_poses(splines: Splines, lines: Polylines) -> Bools:
    """(spans,) bool: poses lie inside the span."""
    before, after = lines.poses_around(splines.span_run, *splines.ends)
    return np.asarray(after - before > 1)


def first_knots(lines: Polylines) -> Splines:
    """Both ends of every run, the inner ends of its first and last segment, and some poses between."""
    row, place = spread(lines.count)
    last = lines.count[row] - 1
    chosen = (place == 0) | (place == last) | (place == 1) | (place == last - 1)
    chosen |= (place % STRIDE == 1) & (place < last - STRIDE // 2)
    return Splines(lines.s[chosen], np.bincount(row[chosen]))


def lines_to_control(lines: Polylines, splines: Splines) -> Floats:
    """Control points on the runs at their Greville points, the outer three of each end on its first or last segment."""
    greville, run = splines.greville, splines.control_run
    control = lines.on(lines.segment_at(run, greville), greville)
    begin, end = splines.control_first[:-1], splines.control_first[1:]
    for outer, pose in (
        (begin[:, None] + np.arange(3), lines.first[:-1]),
        (end[:, None] - 1 - np.arange(3), lines.first[1:] - 2),
    ):
        control[outer] = lines.on(pose[:, None], greville[outer])
    return control


def deviations(samples: Samples, splines: Splines, control: Floats) -> Floats:
    """(m, 6) curve less original motion at the samples."""
    return applied(splines.span_control[samples.span], samples.basis, control) - samples.target


def over(off: Floats, tolerances: tuple[float, float]) -> Floats:
    """(m,) deviations (m, 6) of tip or axis point over their tolerances, the larger."""
    square = off * off
    tip = square[:, 0] + square[:, 1] + square[:, 2]
    axis = square[:, 3] + square[:, 4] + square[:, 5]
    return np.sqrt(np.maximum(tip / tolerances[0] ** 2, axis / tolerances[1] ** 2))


def _least_squares(splines: Splines, windows: Windows, samples: Samples, control: Floats) -> Floats:
    """Move the free control points of the windows so that the squares at the samples are least."""
    size = len(windows.control)
    if not size:
        return control
    local = np.full(len(splines.span_run), -1, np.int64)
    local[windows.span] = windows.local
    rows = np.flatnonzero(local[samples.span] >= 0)
    chosen = some_rows(samples, rows)
    near = Gather(local[chosen.span], chosen.basis, size)
    width = splines.width[windows.span]
    smooth = Gather(windows.local, splines.third[windows.span], size)
    bands = near.bands(np.ones(len(rows)))[..., 0] + smooth.bands(_RIDGE * width**6)[..., 0]
    off = deviations(chosen, splines, control)
    jerk = smooth.apply(control[windows.control])
    right = -near.sums(off) - smooth.sums((_RIDGE * width**6)[:, None] * jerk)
    moved = control.copy()
    step = solve_scalar(bands, right, windows.free)
    moved[windows.control[windows.free]] += step[windows.free]
    return moved


def _largest(splines: Splines, samples: Samples, control: Floats, tolerances: tuple[float, float]) -> Floats:
    """(spans,) largest deviation at the samples of each span over the tolerances; both ends count for both sides."""
    off = over(deviations(samples, splines, control), tolerances)
    largest = np.zeros(len(splines.span_run))
    first = np.flatnonzero(np.concatenate(([True], samples.span[1:] != samples.span[:-1])))
    largest[samples.span[first]] = np.maximum.reduceat(off, first)
    before = samples.span[first[1:]] - 1
    touching = (before == samples.span[first[:-1]]) & (splines.span_run[before] == splines.span_run[before + 1])
    here = before[touching]
    largest[here] = np.maximum(largest[here], off[first[1:][touching]])
    return largest


def _corner_reach(lines: Polylines, tolerances: tuple[float, float]) -> Floats:
    """(n,) distance of a knot from each pose whose corner is sharp, steps."""
    reach = np.full(len(lines.s), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = np.diff(lines.point, axis=0) / np.diff(lines.s)[:, None]
        turn = np.abs(over(unit[1:] - unit[:-1], tolerances))
        reach[1:-1] = _CORNER / turn
    reach[lines.first[:-1]] = np.inf
    reach[lines.first[1:] - 1] = np.inf
    return np.where(np.isnan(reach), np.inf, reach)


def _refine(
    lines: Polylines, splines: Splines, control: Floats, off: Floats, bad: Ints, corner: Floats
) -> tuple[Splines, Floats, Bools, Floats]:
    """Split the bad spans; return what is known of all others, and which spans have to be fitted anew."""
    run, (low, high) = splines.span_run[bad], splines.ends[:, bad]
    before, after = lines.poses_around(run, low, high)
    holds = after - before > 1
    # at the pose in the middle; inside one segment beside a sharp corner, else in the middle: not while the deviation
    # may be that of a neighbour that is split at a pose
    coarse = np.zeros(len(splines.span_run) + 2, np.bool_)
    coarse[bad[holds] + 1] = True
    width = high - low
    at_low = np.where(~holds & (lines.s[before] == low), corner[before], np.inf)
    at_high = np.where(~holds & (lines.s[after] == high), corner[after], np.inf)
    near_low, near_high = at_low < 0.35 * width, at_high < 0.35 * width
    middle = np.where(holds, lines.s[(before + after + 1) // 2], (low + high) // 2.0)
    waits = near_low | near_high | (~holds & (coarse[bad] | coarse[bad + 2]))
    places = [(middle, ~waits), (low + at_low, near_low), (high - at_high, near_high)]
    places += [(low + WINGS * at_low, near_low & (WINGS * at_low < 0.45 * width))]
    places += [(high - WINGS * at_high, near_high & (WINGS * at_high < 0.45 * width))]
    new_run, new_knot = [run[here] for _, here in places], [np.round(place[here]) for place, here in places]
    return _insert(lines, splines, control, off, np.concatenate(new_run), np.concatenate(new_knot))


def _insert(
    lines: Polylines, splines: Splines, control: Floats, off: Floats, run: Ints, knot: Floats
) -> tuple[Splines, Floats, Bools, Floats]:
    """Add knots; control points far from them stay, the others lie on the run until they are fitted."""
    all_run = np.concatenate((np.repeat(np.arange(len(splines.count)), splines.count), run))
    all_knot = np.concatenate((splines.knot, knot))
    order = np.lexsort((all_knot, all_run))
    new = order >= len(splines.knot)
    finer = Splines(all_knot[order], splines.count + np.bincount(run, minlength=len(splines.count)))
    owner = all_run[order][new]
    active = near_spans(finer, owner, np.flatnonzero(new) - owner, REACH, REACH)  # spans that start at the new knots
    # number of new knots up to each: old spans and control points by their distance from the start of the run
    added = np.cumsum(new)
    old_span = np.clip(np.arange(len(finer.span_run)) - added[finer.span_knot], 0, len(off) - 1)
    fresh = lines_to_control(lines, finer)
    knot_of = np.clip(ranges(finer.first[:-1] - 1, finer.count + 2), 0, len(new) - 1)
    knot_of = np.clip(knot_of, finer.first[finer.control_run], finer.first[finer.control_run + 1] - 1)
    old_control = np.arange(len(finer.control_run)) - added[knot_of]
    known = np.ones(len(finer.control_run), np.bool_)
    windows = Windows.where(finer, active)
    known[windows.control[windows.free]] = False
    outer = np.arange(3)  # which follow from the knots alone
    known[finer.control_first[:-1, None] + outer] = known[finer.control_first[1:, None] - 1 - outer] = False
    fresh[known] = control[np.clip(old_control[known], 0, len(control) - 1)]
    return finer, fresh, active, np.where(active, 0.0, off[old_span])
