"""Runs solved and proved: knots by fitting, control points by the interior-point method, bounds for every piece."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.smoothing.runs.fitting import deviations, fit
from cornersmooth.smoothing.runs.interior import smoothest
from cornersmooth.smoothing.runs.polylines import Polylines
from cornersmooth.smoothing.runs.proof import bounds
from cornersmooth.smoothing.runs.ranges import spread
from cornersmooth.smoothing.runs.samples import Pieces, Samples
from cornersmooth.smoothing.runs.splines import Splines
from cornersmooth.smoothing.runs.windows import Windows

#: spans of a window that are its own, and spans beside them that settle down to what the neighbour finds
CORE, BESIDE = 192, 24

#: spans solved at once
BATCH = 16384

#: spans on either side that the weight of a span looks at, its power of the mean square of C‴, and the least mean over
#: the largest of the run
NEIGHBOURS, POWER, LEAST_MEAN = 3, 5.0 / 6.0, 1e-12

#: step of the parameter over the tolerance
STEP = 0.01

#: share of the tolerance that the samples may use, and the least share that they are left
SHARE, LEAST_SHARE = 0.97, 0.55

#: share of the tolerance between the first curve and the bounds, so that there is a way to go
ROOM = 0.02

#: gaps of the rounds: a first look shows which pieces have to be given less, and how smooth the curve can be; so many
#: rounds are of all windows
FULL = 2
GAPS = (0.3, 0.05, 0.05, 0.05, 0.05, 0.1, 0.1)

#: parts of the way from the fit to the solution that are tried where pieces are not proved otherwise, and the number
#: of control points over which the rest of the way is gone
BLENDS = (0.9, 0.75, 0.5, 0.0)
FADE = 8


@dataclass(frozen=True)
class RunCurves:
    """Pairs of cubic B-splines for runs.

    Parameters
    ----------
    lines : Polylines
        The original motion of the runs.
    splines : Splines
    control : (c, 6) float64, mm
        Control points of tip and axis point.
    tip_bound, axis_bound : (r,) float64, mm
        Proven bounds of the deviation at common parameters, of the tip and of the axis point at constant H.
    kept : (r,) bool
        Whether the run keeps its tolerances; the others are not to be used.
    """

    lines: Polylines
    splines: Splines
    control: Floats
    tip_bound: Floats
    axis_bound: Floats
    kept: Bools


def solve_runs(
    lines: Polylines,
    tolerances: tuple[float, float],
    axis_length: float,
    progress: Callable[[int, int], None] | None = None,
) -> RunCurves:
    """Find the smoothest pair of splines for every run.

    Parameters
    ----------
    lines : Polylines
        Runs of 3 distinct poses or more.
    tolerances : (float, float), mm
        Of the tip and of the axis point at constant H.
    axis_length : float, mm
        H.
    progress : callable, optional
        Called with (spans done, spans in all).
    """
    rough = fit(lines, tolerances)
    splines = rough.splines
    pieces = Pieces.of(splines, lines)
    samples = Samples.of(splines, lines, pieces)
    limits = np.array(tolerances)
    start_off = np.sqrt(np.square(deviations(samples, splines, rough.control)).reshape(-1, 2, 3).sum(axis=2)) / limits
    # in the middle of a turn the chord's axis point is nearer than H, so its deviation counts for more
    lever = np.sqrt(np.square(samples.target[:, 3:] - samples.target[:, :3]).sum(axis=1)) / axis_length
    radius = np.maximum(SHARE * np.minimum([1.0], np.stack((np.ones_like(lever), lever), axis=1)), start_off + ROOM)
    control = rough.control.copy()
    windows = _cut(splines)
    todo = np.arange(len(windows.begin))
    proven = np.zeros((len(pieces.span), 2))
    unproven = np.ones(len(pieces.span), np.bool_)
    for number, gap in enumerate(GAPS):
        tried = control.copy() if number else None
        weight = even_weights(splines, control)
        radii = radius * limits
        _solve(splines, windows, todo, samples, rough.control, tried, control, radii, tolerances, weight, gap, progress)
        rows = np.flatnonzero(unproven)
        proven[rows] = bounds(splines, control, lines, _some(pieces, rows), axis_length, tolerances)
        over = proven / limits
        failed = (over > 1.0).any(axis=1)
        if number >= FULL - 1 and not failed.any():
            break
        radius = _tighten(samples, radius, over, start_off)
        todo = _touched(windows, pieces.span[failed]) if number >= FULL - 1 else todo
        unproven = np.zeros(len(splines.span_run), np.bool_)
        again = windows.begin[todo], windows.count[todo]
        for begin, count in zip(*again, strict=True):
            unproven[begin : begin + count] = True
        unproven = unproven[pieces.span]
    run = splines.span_run[pieces.span]
    for part in BLENDS:  # deviations are nearly linear in the control points, and the fit is well within ε
        failed = (proven > limits).any(axis=1)
        if not failed.any():
            break
        share = _fade(splines, pieces.span[failed], part)[:, None]
        control = rough.control + share * (control - rough.control)
        rows = np.flatnonzero((share[splines.span_control[pieces.span][:, None] + np.arange(4), 0] < 1.0).any(axis=1))
        proven[rows] = bounds(splines, control, lines, _some(pieces, rows), axis_length, tolerances)
    worst = np.zeros((len(lines.count), 2))
    np.maximum.at(worst, run, proven)
    tip, axis = worst[:, 0], worst[:, 1]
    return RunCurves(lines, splines, control, tip, axis, (tip <= limits[0]) & (axis <= limits[1]))


def even_weights(splines: Splines, control: Floats) -> Floats:
    """(spans,) weights of |C‴|² that give calm and sharp places their say.

    Where the jerk limits it, a machine passes with v ~ |C‴|^(-1/3), so its time is ∫|C‴|^(1/3): the weights are those
    of its quadratic model at the curve known so far, |C‴|^(-5/3), with the mean over neighbouring spans.
    """
    third = np.zeros((len(splines.span_run), control.shape[1]))
    for k in range(4):
        third += splines.third[:, k, None] * control[splines.span_control + k]
    run, width = splines.span_run, splines.width
    own = width * np.square(third).sum(axis=1)
    total, length = own.copy(), width.copy()
    for shift in range(1, NEIGHBOURS + 1):
        same = np.where(run[shift:] == run[:-shift], 1.0 - shift / (NEIGHBOURS + 1.0), 0.0)
        for sums, values in ((total, own), (length, width)):
            sums[shift:] += same * values[:-shift]
            sums[:-shift] += same * values[shift:]
    mean = total / length
    largest = np.zeros(len(splines.count))
    np.maximum.at(largest, run, mean)
    relative = mean / np.where(largest > 0.0, largest, 1.0)[run]
    weights: Floats = np.maximum(relative, LEAST_MEAN) ** (-POWER)
    return weights


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
    own: Bools = (place >= low) & (place < high) & windows.free
    return own


def _solve(
    splines: Splines,
    windows: Windows,
    todo: Ints,
    samples: Samples,
    start: Floats,
    tried: Floats | None,
    control: Floats,
    radius: Floats,
    tolerances: tuple[float, float],
    weight: Floats,
    gap: float,
    progress: Callable[[int, int], None] | None,
) -> None:
    """Set the control points of the windows to be done, some windows at once."""
    batch = np.cumsum(windows.count[todo]) // BATCH
    total = len(splines.span_run)
    for number in np.unique(batch):
        rows = todo[batch == number]
        some = Windows.of(splines, windows.begin[rows], windows.count[rows])
        moved = smoothest(splines, some, samples, start, radius, tolerances, weight, gap, tried)
        own = _own(splines, some)
        control[some.control[own]] = moved[own]
        if progress is not None:
            progress(int(some.span[-1]) + 1, total)


def _tighten(samples: Samples, radius: Floats, over: Floats, start_off: Floats) -> Floats:
    """Give the samples at the ends and in the middle of pieces that are too far off less to use."""
    factor = np.where(over > 1.0, 0.98 / np.maximum(over, 1.0), 1.0)
    least = np.maximum(LEAST_SHARE, start_off + ROOM)
    # the axis point at constant H hangs on both, so both are blamed for it
    share = np.minimum(factor, factor[:, 1:])[samples.piece]
    before = np.concatenate((share[:1], share[:-1]))  # the end of a piece is the first sample of the next
    share = np.where((samples.piece != np.roll(samples.piece, 1))[:, None], np.minimum(share, before), share)
    tighter: Floats = np.where(share < 1.0, np.minimum(radius, np.maximum(radius * share, least)), radius)
    return tighter


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


def _touched(windows: Windows, spans: Ints) -> Ints:
    """Windows that contain any of the spans."""
    hit = np.isin(windows.span, spans)
    return np.unique(np.repeat(np.arange(len(windows.count)), windows.count)[hit])


def _some(pieces: Pieces, rows: Ints) -> Pieces:
    return Pieces(pieces.span[rows], pieces.segment[rows], pieces.low[rows], pieces.high[rows])
