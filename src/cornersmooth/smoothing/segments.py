"""What every pose contributes to the written motion: straight remainders, transitions, and how many lines each takes.

The first half of a transition is, in s = 2u, the straight leg plus s³ times the deviation. So the
chord error of a step Δs is proportional to s·Δs², and nodes s = (j/n)^(2/3) make it the same in every step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import norm, square
from cornersmooth.model import Bools, Floats, Ints, Move, Numbers, SmoothProgram, Status
from cornersmooth.settings import FLIP_ANGLE, METHODS, STANDING, Settings
from cornersmooth.smoothing.construction import BATCH, legs_at

#: β-error of one line per half, ``max((s − s³)/6)``; for n lines it is at most 1/n²
#: of this on graded nodes, and 9/4 of that on even ones
PAPER_ERROR = 1.0 / (9.0 * np.sqrt(3.0))

#: bend (mm) that one line per half may bridge, over the chord tolerance
_BEND_PER_CHORD = 1.0 / PAPER_ERROR

#: largest product of a line's turn and the tangent of half the segment's, rad, where the axis turns by more than 90°
_STEEP = 0.25

#: straight remainder between two curves that is none, over the shorter one of their legs beside it
_SHORT = 0.5

#: Chord error below which lines are not divided for their feed, mm: half of a step of 0.0001 mm, the last digit of most
#: controls. Finer lines follow the digits.
FINEST_CHORD = 5e-5

#: Jumps in speed between two lines for which no line is divided, of the tip in mm/s and of the tool axis in deg/s: what
#: 1000 mm/s² and 150 deg/s² make in 2 ms, the limits of ``cornersmooth time``.
SMALL_JUMPS = (2.0, 0.3)

#: most lines in one half of a transition, in one straight remainder, and in one segment of a run
MOST_LINES = 20_000


@dataclass(frozen=True)
class Segments:
    """What every pose contributes, arrays over the n poses of the program."""

    row: Numbers  # row of `Corners`, -1 where the pose is no smoothed corner
    skip: Bools  # contributes nothing: repeats another pose, or is stated only
    start: Numbers  # pose the straight line into pose i starts from, -1 for none
    entry: Floats  # fraction of the incoming segment where the straight remainder starts
    exit: Floats  # and where it ends
    axis_entry: Floats
    axis_exit: Floats
    has_line: Bools  # the straight remainder has a length
    lines: Numbers  # lines it is written in


def lines_for_feed(
    settings: Settings, by_chord: Floats, length: Floats, feed: Floats, kinks: tuple[Floats, Floats]
) -> Floats:
    """(n,) lines that stretches of curves are written in, so that the axes jump little in speed where lines meet.

    `by_chord` is what the chord tolerance asks for; their chord error goes with the square of their number. `length` is
    the way of the tip, mm, `feed` is in mm/min, NaN for none: then the chord tolerance alone counts. `kinks` are the
    change of the direction of the tip, rad, and of the turning of the tool axis on its way, rad/mm, in the stretch.
    """
    if not settings.block_time or settings.lines == "long" or settings.chord <= FINEST_CHORD:
        return by_chord
    finest = by_chord * math.sqrt(settings.chord / FINEST_CHORD)
    speed = feed / 60.0
    jump = np.maximum(speed * kinks[0] / SMALL_JUMPS[0], np.degrees(speed * kinks[1]) / SMALL_JUMPS[1])
    most = np.minimum(length / (speed * settings.block_time), jump)
    return np.maximum(by_chord, np.minimum(finest, np.nan_to_num(most, nan=0.0, posinf=0.0)))


def segments_of(smoothed: SmoothProgram, *, dense: bool, curves: bool = False) -> Segments:
    """Lay out the smoothed motion; straight remainders are divided into several lines only for `dense` output.

    Between `curves` there are no short ones: two neighbours go on to the middle of what would be left.
    """
    program, corners = smoothed.program, smoothed.corners
    n = len(program)
    row = np.full(n, -1, np.int32)
    rounded = np.flatnonzero(corners.smoothed)
    row[corners.pose[rounded]] = rounded
    skip = program.kind == Move.FROM
    repeated = np.flatnonzero(corners.status == Status.DUPLICATE)
    skip[corners.pose[repeated]] = True

    start = np.full(n, -1, np.int32)
    start[corners.pose] = corners.before
    last = program.chains[:, 1]
    origin = np.arange(n) - 1  # of a pose behind repeated ones: the first of them
    origin[corners.pose[repeated] + 1] = corners.before[repeated]
    start[last] = origin[last]

    linear = start >= 0
    known = np.maximum(start, 0)
    entry, leave = _ends(n, corners.pose, corners.trim_in, corners.trim_out, linear, known)
    axis_entry, axis_leave = entry, leave
    if corners.axis_trim_in is not corners.trim_in:
        axis_entry, axis_leave = _ends(n, corners.pose, corners.axis_trim_in, corners.axis_trim_out, linear, known)
    has_line, lines = np.ones(n, np.bool_), np.ones(n, np.int32)
    segments = Segments(row, skip, start, entry, leave, axis_entry, axis_leave, has_line, lines)
    for begin in range(0, n, BATCH):
        poses = begin + np.flatnonzero(linear[begin : begin + BATCH] & ~skip[begin : begin + BATCH])
        _measure_remainders(smoothed, segments, poses, dense=dense, meet=curves and axis_entry is entry)
    return segments


def _ends(
    n: int, pose: Ints, trim_in: Floats, trim_out: Floats, linear: Bools, known: Numbers
) -> tuple[Floats, Floats]:
    """Fractions of the segments into all poses where their straight remainders start and end."""
    entry, leave = np.zeros(n), np.ones(n)
    entry[pose] = trim_out
    leave[pose] -= trim_in
    return np.where(linear, entry[known], 0.0), leave


def _measure_remainders(smoothed: SmoothProgram, segments: Segments, poses: Ints, *, dense: bool, meet: bool) -> None:
    """Set `has_line` and `lines` of the segments for some poses that are reached by linear moves.

    Transitions `meet` where they may go further along a straight: the point that their parameter belongs to moves along
    it, and the deviation there stays as it is.
    """
    program, settings = smoothed.program, smoothed.settings
    start = segments.start[poses]
    step, turn = (rows.take(poses, axis=0) - rows.take(start, axis=0) for rows in (program.tip, program.axis))
    # a remainder below the shortest line, and short beside the transition it leads to, is no line of its own
    joins = (segments.row[poses] >= 0) & (segments.row[start] >= 0)
    for length, entry, leave in (
        (norm(step), segments.entry, segments.exit),
        (norm(step + settings.axis_length * turn), segments.axis_entry, segments.axis_exit),
    ):
        rest, leg = length * (leave[poses] - entry[poses]), length * (1.0 - leave[poses])
        if meet:
            short = rest < _SHORT * np.minimum(leg, length * entry[poses])
        else:
            short = (rest < settings.shortest_line) & (rest < 0.1 * leg)
        joins &= (rest <= 1e-9) | short
    segments.has_line[poses[joins]] = False
    if meet:
        here = poses[joins]
        segments.entry[here] = segments.exit[here] = (segments.entry[here] + segments.exit[here]) / 2.0
    if dense:
        chord = norm(turn)
        # about a standing tip all ways of turning evenly are one motion: nothing says when the axis is where
        divided = ~joins & ((norm(step) > 0.0) | (settings.axis_step is not None))
        _divide(settings, segments, poses[divided], chord[divided])


def turn_limit(settings: Settings, half_turn: Floats, tolerance: float) -> Floats:
    """Largest change of axis in one line inside a segment whose axis turns by twice `half_turn`, rad.

    Two things set it, each given half of `tolerance` (mm) at `Settings.axis_scale`: controls turn vectors
    linearly or on the great circle, which differ by up to θ³/54; and the ruled motion turns fastest in the middle of
    its segment, so that equal shares of a line's parameter and of the original's differ by up to θ²·tan(half_turn)/4.
    """
    share = tolerance / 2.0 / settings.axis_scale
    limit = np.full_like(half_turn, math.cbrt(54.0 * share))
    tangent = np.tan(np.minimum(half_turn, math.radians(FLIP_ANGLE / 2.0)))
    steep = tangent > 0.0
    limit[steep] = np.minimum(limit[steep], np.sqrt(4.0 * share / tangent[steep]))
    # beyond a right angle the rate changes so fast that the second order tells it within small steps only
    limit[tangent > 1.0] = np.minimum(limit[tangent > 1.0], _STEEP / tangent[tangent > 1.0])
    if settings.axis_step is not None:
        limit = np.minimum(limit, math.radians(settings.axis_step))
    return limit


def _divide(settings: Settings, segments: Segments, poses: Ints, chord: Floats) -> None:
    """Set `lines`: lines per straight remainder, from the change of axis along it, given as its chord.

    Dense lines begin and end on the original motion there, where tip and axis are trimmed alike: all of ε is left to
    how the control turns the axis between.
    """
    exact = settings.lines != "long" and METHODS[settings.method].one_parameter
    allowed = min(settings.line_tolerances) if exact else settings.interpolation_tolerance
    share = allowed / settings.axis_scale
    turning = chord**3 / 54.0 + chord**2 / 4.0 * np.tan(np.minimum(chord, 2.0) / 2.0) > share
    if settings.axis_step is not None:
        turning |= 2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)) > math.radians(settings.axis_step)
    pose, half = poses[turning], np.arcsin(np.minimum(chord[turning] / 2.0, 1.0))
    if not len(pose):
        return
    # angle of the ruled axis from the middle of its segment: tan φ is linear in the fraction
    low = np.arctan((2.0 * segments.axis_entry[pose] - 1.0) * np.tan(half))
    high = np.arctan((2.0 * segments.axis_exit[pose] - 1.0) * np.tan(half))
    turn = high - low
    as_one = turn**2 / 4.0 * np.abs(np.tan((low + high) / 2.0)) + turn**3 / 54.0
    lines = np.ceil(turn / turn_limit(settings, np.maximum(np.abs(low), np.abs(high)), allowed) - 1e-9)
    if settings.axis_step is None:
        lines[as_one <= share] = 1
    segments.lines[pose] = np.clip(lines, 1, MOST_LINES)


def lines_per_half(smoothed: SmoothProgram) -> Numbers:
    """(k,) lines per half of every transition: n for nodes (j/n)^(2/3), −n for nodes j/n; 0 where not smoothed."""
    lines = np.zeros(len(smoothed.corners), np.int32)
    rows = np.flatnonzero(smoothed.corners.smoothed)
    for batch in np.array_split(rows, max(1, len(rows) // BATCH)):
        lines[batch] = lines_of(smoothed, batch)
    return lines


def lines_of(smoothed: SmoothProgram, rows: Ints) -> Ints:
    """(g,) lines per half of the transitions of some smoothed corners, as in `lines_per_half`."""
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    after = corners.after[rows]
    legs = legs_at(program, settings.axis_length, corners.pose[rows], corners.before[rows], after)
    tip_in, tip_out, turn_in, turn_out, *_ = legs
    bends = (
        tip_out * corners.trim_out[rows][:, None] - tip_in * corners.trim_in[rows][:, None],
        (tip_out + turn_out) * corners.axis_trim_out[rows][:, None]
        - (tip_in + turn_in) * corners.axis_trim_in[rows][:, None],
    )
    bend = np.sqrt(np.maximum(square(bends[0]), square(bends[1])))
    by_chord = np.sqrt(bend / (_BEND_PER_CHORD * settings.chord))
    way = np.minimum(norm(tip_in) * corners.trim_in[rows], norm(tip_out) * corners.trim_out[rows])
    # in each half the directions change by half of what they do at the corner
    halved = np.maximum(2.0 * way, STANDING)
    kinks = norm(bends[0]) / halved, norm(bends[1] - bends[0]) / (settings.axis_length * halved)
    by_chord = lines_for_feed(settings, by_chord, way, program.feed_at(after), kinks)
    number = np.ceil(by_chord - 1e-9)

    by_turn = np.zeros(len(rows))
    for turn, reach in (
        (turn_in, np.maximum(corners.axis_trim_in[rows], corners.trim_in[rows])),
        (turn_out, np.maximum(corners.axis_trim_out[rows], corners.trim_out[rows])),
    ):
        half = np.arcsin(np.minimum(np.sqrt(square(turn)) / (2.0 * settings.axis_length), 1.0))
        turned = 2.0 * half * reach + corners.orientation_error[rows]  # on this side of the middle
        by_turn = np.maximum(by_turn, turned / turn_limit(settings, half, settings.interpolation_tolerance))
    graded = np.maximum(number, np.ceil(by_turn**1.5 - 1e-9))
    even = np.maximum(np.ceil(1.5 * by_chord), np.ceil(by_turn - 1e-9))
    chosen = np.where(even < graded, -np.maximum(even, 1.0), np.maximum(graded, 1.0))
    return np.clip(chosen, -MOST_LINES, MOST_LINES).astype(np.int64)
