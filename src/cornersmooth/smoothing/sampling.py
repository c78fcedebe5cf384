"""The smoothed motion as rows: dense lines (tip and axis vector) or lines and curves (control points).

Design 3.5. How many lines a transition takes follows from its geometry; u = ½ is always a point, so the lines keep the
deviation of the curve. With all weights 1 the first half of the curve is, in s = 2u, the straight leg plus s³ times the
deviation, so the chord error of a step Δs is proportional to s·Δs²; the nodes s = (j/n)^(2/3) make it the same in every
step and n = sqrt(bend/(18·chord)), 15 % more for the first step, where s³ is not yet parabolic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Arcs, Bools, Floats, Ints, Move, Program, SmoothProgram, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing import nurbs
from cornersmooth.smoothing.neighbours import find_neighbours, norm
from cornersmooth.smoothing.synchronise import angle_between, matching_parameters

#: bend (mm) that one line per half may bridge, over the chord tolerance
_BEND_PER_CHORD = 15.6

#: most lines in one half of a transition and in one straight remainder
_MOST_LINES = 400


@dataclass(frozen=True)
class Rows:
    """A stretch of the smoothed motion, r rows in path order.

    Parameters
    ----------
    tip : (r, 3) float64, mm
        End of a line, or a control point of the tip curve.
    other : (r, 3) float64
        Unit axis vector in dense rows; axis point (mm) or control point of the axis-point curve in curve rows.
    move : (r,) int64
        Pose whose move the row belongs to: after the middle of a transition it is the next pose. Never decreasing.
        Feed, kind and the place of statements follow from it.
    curve : (r,) int8
        0 for the end of a line; 1 to 5 for a control point of a transition.
    joined : (r,) bool
        First control points that are the end of the row before, with no line between.
    weights : (r, 2) float64 or None
        w1 and w2 of the transition the row belongs to, in curve rows.
    """

    tip: Floats
    other: Floats
    move: Ints
    curve: np.ndarray[tuple[int], np.dtype[np.int8]]
    joined: Bools
    weights: Floats | None = None


@dataclass(frozen=True)
class _Plan:
    """What every pose contributes, whole-program arrays over n poses (see `Rows`)."""

    row: Ints  # row of `Corners`, -1 where the pose is no smoothed corner
    skip: Bools  # contributes nothing: repeats another pose, or is stated only
    start: Ints  # pose the straight line into pose i starts from, -1 for none
    following: Ints
    entry: Floats  # fraction of the incoming segment where the straight remainder starts
    exit: Floats  # and where it ends
    axis_entry: Floats
    axis_exit: Floats
    line: Bools  # the straight remainder has a length
    pieces: Ints  # lines it is written in


def dense_rows(smoothed: SmoothProgram, poses: int = 16384) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines with tool vectors, in blocks of about `poses` poses.

    Yields
    ------
    Rows
        `other` holds unit vectors; every `curve` is 0.
    """
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    plan = _plan(smoothed, dense=True)
    halves = _lines_per_half(smoothed)
    corner_poses = corners.pose[corners.smoothed]
    per_corner = 2 * np.abs(halves[corners.smoothed])
    counts = np.where(plan.skip, 0, plan.pieces)
    counts[corner_poses] = np.where(plan.line[corner_poses], plan.pieces[corner_poses], 0) + per_corner
    arcs = {int(pose): index for index, pose in enumerate(program.arcs.pose)}
    arc_points = {pose: _arc_points(program, arc, settings.chord) for pose, arc in arcs.items()}
    for pose, points in arc_points.items():
        counts[pose] = len(points)

    for begin in range(0, len(program), poses):
        end = min(begin + poses, len(program))
        offset = np.concatenate(([0], np.cumsum(counts[begin:end])))
        total = int(offset[-1])
        tip, axis = np.zeros((total, 3)), np.zeros((total, 3))
        move = np.repeat(np.arange(begin, end), counts[begin:end])
        block = np.arange(begin, end)
        row = plan.row[begin:end]

        plain = (row < 0) & ~plan.skip[begin:end]
        if arc_points:
            plain &= program.kind[begin:end] != Move.ARC
        last = block[plain]
        place = offset[1:][plain] - 1
        tip[place], axis[place] = program.tip[last], program.axis[last]

        smooth_here = block[row >= 0]
        ahead = offset[:-1][row >= 0] + np.where(plan.line[smooth_here], plan.pieces[smooth_here], 0)
        with_line = plan.line[smooth_here]
        _fill_straight(
            smoothed, plan, smooth_here[with_line], (ahead - 1)[with_line], np.ones(1), tip, axis
        )  # first points
        divided = block[(plan.pieces[begin:end] > 1) & ~plan.skip[begin:end] & plan.line[begin:end]]
        _fill_divided(smoothed, plan, divided, offset[divided - begin], tip, axis)
        _fill_transitions(smoothed, plan, smooth_here, ahead, halves, tip, axis, move)
        for pose, points in arc_points.items():
            if begin <= pose < end:
                where = slice(offset[pose - begin], offset[pose - begin + 1])
                tip[where] = points
                axis[where] = program.axis[pose]
        yield Rows(tip, axis, move, np.zeros(total, np.int8), np.zeros(total, np.bool_))


def curve_rows(smoothed: SmoothProgram, poses: int = 16384) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines and curve pairs, in blocks of about `poses` poses.

    Yields
    ------
    Rows
        `other` holds axis points; a transition is five rows.
    """
    program, settings = smoothed.program, smoothed.settings
    plan = _plan(smoothed, dense=False)
    counts = np.where(plan.skip, 0, np.where(plan.row >= 0, 5 + plan.line, 1))
    arc_points = {
        int(pose): _arc_points(program, index, settings.chord) for index, pose in enumerate(program.arcs.pose)
    }
    for pose, points in arc_points.items():
        counts[pose] = len(points)
    for begin in range(0, len(program), poses):
        end = min(begin + poses, len(program))
        offset = np.concatenate(([0], np.cumsum(counts[begin:end])))
        total = int(offset[-1])
        tip, other = np.zeros((total, 3)), np.zeros((total, 3))
        move = np.repeat(np.arange(begin, end), counts[begin:end])
        curve, joined = np.zeros(total, np.int8), np.zeros(total, np.bool_)
        weights = np.ones((total, 2))
        block = np.arange(begin, end)
        row = plan.row[begin:end]

        plain = (row < 0) & ~plan.skip[begin:end]
        if arc_points:
            plain &= program.kind[begin:end] != Move.ARC
        place = offset[1:][plain] - 1
        tip[place] = program.tip[block[plain]]
        other[place] = tip[place] + settings.axis_length * program.axis[block[plain]]

        smooth_here = block[row >= 0]
        if len(smooth_here):
            first = offset[1:][row >= 0] - 5
            tip_curve, axis_curve = nurbs.control_points(
                program, smoothed.corners, plan.row[smooth_here], settings.axis_length
            )
            places = first[:, None] + np.arange(5)
            tip[places], other[places] = tip_curve, axis_curve
            curve[places] = np.arange(1, 6)
            weights[places] = smoothed.corners.weights[plan.row[smooth_here]][:, None, :]
            joined[first] = ~plan.line[smooth_here]
            line = plan.line[smooth_here]
            tip[first[line] - 1], other[first[line] - 1] = tip_curve[line, 0], axis_curve[line, 0]
            move[places[:, 4]] = plan.following[smooth_here]
        for pose, points in arc_points.items():
            if begin <= pose < end:
                where = slice(offset[pose - begin], offset[pose - begin + 1])
                tip[where] = points
                other[where] = points + settings.axis_length * program.axis[pose]
        yield Rows(tip, other, move, curve, joined, weights)


def _plan(smoothed: SmoothProgram, *, dense: bool) -> _Plan:
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    n = len(program)
    around = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    row = np.full(n, -1, np.int64)
    round_rows = np.flatnonzero(corners.smoothed)
    row[corners.pose[round_rows]] = round_rows
    skip = program.kind == Move.FROM
    skip[corners.pose[corners.status == Status.DUPLICATE]] = True

    start = around.previous
    known = np.maximum(start, 0)
    trims = {}
    for name, source in (
        ("out", "trim_out"),
        ("axis_out", "axis_trim_out"),
        ("in", "trim_in"),
        ("axis_in", "axis_trim_in"),
    ):
        per_pose = np.zeros(n)
        per_pose[corners.pose] = getattr(corners, source)
        trims[name] = per_pose
    from_corner = start >= 0
    entry = np.where(from_corner, trims["out"][known], 0.0)
    axis_entry = np.where(from_corner, trims["axis_out"][known], 0.0)
    exit_, axis_exit = 1.0 - trims["in"], 1.0 - trims["axis_in"]

    # a remainder below the shortest line, and short beside the transition it leads to, is no line of its own
    step = norm(program.tip - program.tip[known])
    swing = norm(program.tip - program.tip[known] + settings.axis_length * (program.axis - program.axis[known]))
    tip_rest, axis_rest = step * (exit_ - entry), swing * (axis_exit - axis_entry)
    tip_leg, axis_leg = step * trims["in"], swing * trims["axis_in"]
    joins = (row >= 0) & (row[known] >= 0) & from_corner
    for rest, leg in ((tip_rest, tip_leg), (axis_rest, axis_leg)):
        joins &= (rest <= 1e-9) | ((rest < settings.shortest_line) & (rest < 0.1 * leg))
    pieces = np.ones(n, np.int64)
    plan = _Plan(row, skip, start, around.following, entry, exit_, axis_entry, axis_exit, ~joins, pieces)
    if dense:
        _divide_remainders(smoothed, plan)
    return plan


def _turn_limit(settings: Settings, half_turn: Floats) -> Floats:
    """Largest change of axis in one line inside a segment whose axis turns by twice `half_turn`, rad.

    Two things set it, each given half of `Settings.interpolation_tolerance` at distance H: controls turn vectors
    linearly or on the great circle, which differ by up to θ³/54; and the ruled motion turns fastest in the middle of
    its segment, so that equal shares of a line's parameter and of the original's differ by up to θ²·tan(half_turn)/4.
    """
    share = settings.interpolation_tolerance / 2.0 / settings.axis_length
    limit = np.full_like(half_turn, math.cbrt(54.0 * share))
    tangent = np.tan(np.minimum(half_turn, math.radians(60)))
    steep = tangent > 0.0
    limit[steep] = np.minimum(limit[steep], np.sqrt(4.0 * share / tangent[steep]))
    if settings.axis_step is not None:
        limit = np.minimum(limit, math.radians(settings.axis_step))
    return limit


def _divide_remainders(smoothed: SmoothProgram, plan: _Plan) -> None:
    """Set `plan.pieces`: lines per straight remainder, from the change of axis along it."""
    program, settings = smoothed.program, smoothed.settings
    linear = np.flatnonzero((plan.start >= 0) & ~plan.skip & plan.line)
    chord = norm(program.axis[linear] - program.axis[plan.start[linear]])
    share = settings.interpolation_tolerance / settings.axis_length
    turning = chord**3 / 54.0 + chord**2 / 4.0 * np.tan(np.minimum(chord, 2.0) / 2.0) > share
    if settings.axis_step is not None:
        turning |= 2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)) > math.radians(settings.axis_step)
    pose, chord = linear[turning], chord[turning]
    half = np.arcsin(np.minimum(chord / 2.0, 1.0))
    ruled = half <= math.radians(settings.max_axis_step) / 2.0 + 1e-12
    pose, half = pose[ruled], half[ruled]
    if not len(pose):
        return
    # angle of the ruled axis from the middle of its segment: tan φ is linear in the fraction
    low = np.arctan((2.0 * plan.axis_entry[pose] - 1.0) * np.tan(half))
    high = np.arctan((2.0 * plan.axis_exit[pose] - 1.0) * np.tan(half))
    turn = high - low
    as_one = turn**2 / 4.0 * np.abs(np.tan((low + high) / 2.0)) + turn**3 / 54.0
    pieces = np.ceil(turn / _turn_limit(settings, np.maximum(np.abs(low), np.abs(high))) - 1e-9)
    if settings.axis_step is None:
        pieces[as_one <= share] = 1
    plan.pieces[pose] = np.clip(pieces, 1, _MOST_LINES).astype(np.int64)


def _lines_per_half(smoothed: SmoothProgram) -> Ints:
    """(k,) lines per half of every transition: n for nodes (j/n)^(2/3), −n for nodes j/n; 0 where not smoothed."""
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    lines = np.zeros(len(corners), np.int64)
    rows = np.flatnonzero(corners.smoothed)
    for block in np.array_split(rows, max(1, len(rows) // 65536)):
        pose, before, after = corners.pose[block], corners.before[block], corners.after[block]
        tip_in, tip_out = program.tip[pose] - program.tip[before], program.tip[after] - program.tip[pose]
        turn_in = settings.axis_length * (program.axis[pose] - program.axis[before])
        turn_out = settings.axis_length * (program.axis[after] - program.axis[pose])
        bends = (
            tip_out * corners.trim_out[block][:, None] - tip_in * corners.trim_in[block][:, None],
            (tip_out + turn_out) * corners.axis_trim_out[block][:, None]
            - (tip_in + turn_in) * corners.axis_trim_in[block][:, None],
        )
        # the deviation of other shapes, in terms of the shape with all weights 1 and ratio 2/3
        shape = 6.0 * nurbs.deviation_factor(corners.weights[block], corners.ratio[block])
        bend = np.sqrt(np.maximum(_square(bends[0]), _square(bends[1]))) * np.maximum(shape, 1.0)
        by_chord = np.sqrt(bend / (_BEND_PER_CHORD * settings.chord))
        number = np.ceil(by_chord - 1e-9)

        sine = np.sqrt(np.maximum(_square(turn_in), _square(turn_out))) / (2.0 * settings.axis_length)
        half_turn = np.arcsin(np.minimum(sine, 1.0))
        reach = np.maximum(
            np.maximum(corners.axis_trim_in[block], corners.trim_in[block]),
            np.maximum(corners.axis_trim_out[block], corners.trim_out[block]),
        )
        by_turn = 2.0 * half_turn * reach / _turn_limit(settings, half_turn)
        graded = np.maximum(number, np.ceil(by_turn**1.5 - 1e-9))
        even = np.maximum(np.ceil(1.5 * by_chord), np.ceil(by_turn - 1e-9))
        chosen = np.where(even < graded, -np.maximum(even, 1.0), np.maximum(graded, 1.0))
        lines[block] = np.clip(chosen, -_MOST_LINES, _MOST_LINES).astype(np.int64)
    return lines


def _nodes(lines: int) -> Floats:
    """Parameters u of the points of a transition after its first: both halves, the middle, the end."""
    number = abs(lines)
    s = (np.arange(1, number + 1) / number) ** (2.0 / 3.0 if lines > 0 else 1.0)
    u = 0.5 * s
    return np.concatenate((u, 1.0 - u[-2::-1], [1.0]))


def _fill_transitions(
    smoothed: SmoothProgram,
    plan: _Plan,
    poses: Ints,
    place: Ints,
    halves: Ints,
    tip: Floats,
    axis: Floats,
    move: Ints,
) -> None:
    """Points of the transitions at `poses`, written from row `place` on; corners of equal count together."""
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    rows = plan.row[poses]
    number = halves[rows]
    for lines in np.unique(number):
        chosen = np.flatnonzero(number == lines)
        u = _nodes(int(lines))
        tip_curve, axis_curve = nurbs.control_points(program, corners, rows[chosen], settings.axis_length)
        weights = corners.weights[rows[chosen]]
        uniform = weights[0] if (weights == weights[0]).all() else weights
        points = nurbs.evaluate(tip_curve, uniform, u)
        if settings.method == "zhang2016":
            v, _ = matching_parameters(tip_curve, axis_curve, weights, u, settings.axis_length)
            tops = nurbs.evaluate(axis_curve, weights, v)
            tops[:, -1] = axis_curve[:, -1]  # the straight motion behind starts from its own axis: equation (26)
        else:
            tops = nurbs.evaluate(axis_curve, uniform, u)
        levers = tops - points
        where = place[chosen][:, None] + np.arange(len(u))
        tip[where] = points
        axis[where] = levers / norm(levers)[..., None]
        move[where[:, len(u) // 2 :]] = plan.following[poses[chosen]][:, None]


def _fill_straight(
    smoothed: SmoothProgram, plan: _Plan, poses: Ints, place: Ints, share: Floats, tip: Floats, axis: Floats
) -> None:
    """One point of the straight remainder into each pose, at the given share of it, written to row `place`."""
    if not len(poses):
        return
    program, settings = smoothed.program, smoothed.settings
    start = plan.start[poses]
    at = (plan.entry[poses] + share * (plan.exit[poses] - plan.entry[poses]))[:, None]
    tip[place] = program.tip[start] + at * (program.tip[poses] - program.tip[start])
    if settings.method == "zhang2016":
        axis[place] = _great_circle(
            _straight_axis(smoothed, plan, poses, plan.entry, plan.axis_entry),
            _straight_axis(smoothed, plan, poses, plan.exit, plan.axis_exit),
            share,
        )
    else:
        vector = program.axis[start] + at * (program.axis[poses] - program.axis[start])
        axis[place] = vector / norm(vector)[:, None]


def _straight_axis(smoothed: SmoothProgram, plan: _Plan, poses: Ints, at: Floats, axis_at: Floats) -> Floats:
    """Return the unit axis where the straight motion of the paper's method starts or ends: equation (28)."""
    program, height = smoothed.program, smoothed.settings.axis_length
    start = plan.start[poses]
    step = program.tip[poses] - program.tip[start]
    turn = height * (program.axis[poses] - program.axis[start])
    lever = height * program.axis[start] + axis_at[poses][:, None] * (step + turn) - at[poses][:, None] * step
    direction: Floats = lever / norm(lever)[:, None]
    return direction


def _great_circle(one: Floats, other: Floats, share: Floats) -> Floats:
    """Rotate `one` towards `other` by the share of the angle between them: what equation (27) means."""
    angle = angle_between(one, other)[:, None]
    share = np.broadcast_to(share, (len(one),))[:, None]
    sine = np.sin(angle)
    flat = sine < 1e-12
    safe = np.where(flat, 1.0, sine)
    turned = (np.sin((1.0 - share) * angle) * one + np.sin(share * angle) * other) / safe
    turned = np.where(flat, (1.0 - share) * one + share * other, turned)
    direction: Floats = turned / norm(turned)[:, None]
    return direction


def _fill_divided(smoothed: SmoothProgram, plan: _Plan, poses: Ints, place: Ints, tip: Floats, axis: Floats) -> None:
    """Inner points of the straight remainders that are written as several lines, from row `place` on.

    The points divide the angle of the ruled motion equally.
    """
    program = smoothed.program
    for number in np.unique(plan.pieces[poses]):
        if number < 2:
            continue
        chosen = plan.pieces[poses] == number
        pose, first = poses[chosen], place[chosen]
        half = np.arcsin(np.minimum(norm(program.axis[pose] - program.axis[plan.start[pose]]) / 2.0, 1.0))
        slope = np.tan(half)
        entry, leave = plan.entry[pose], plan.exit[pose]
        low, high = np.arctan((2.0 * entry - 1.0) * slope), np.arctan((2.0 * leave - 1.0) * slope)
        for j in range(1, int(number)):
            fraction = (np.tan(low + (high - low) * j / number) / slope + 1.0) / 2.0
            share = (fraction - entry) / (leave - entry)
            _fill_straight(smoothed, plan, pose, first + j - 1, share, tip, axis)


def _arc_points(program: Program, index: int, chord: float) -> Floats:
    """End points of the lines that stand for one arc or helix, within `chord` of it: (m, 3) mm."""
    arcs: Arcs = program.arcs
    pose = int(arcs.pose[index])
    start, end, normal = program.tip[pose - 1], program.tip[pose], arcs.normal[index]
    radius_vector = start - arcs.centre[index]
    radius_vector = radius_vector - (radius_vector @ normal) * normal
    radius = float(np.linalg.norm(radius_vector))
    sweep = float(arcs.sweep[index])
    step = 2.0 * math.acos(max(-1.0, 1.0 - min(chord / radius, 1.0))) if radius > 0.0 else math.pi
    number = max(1, math.ceil(sweep / min(step, math.pi / 2.0) - 1e-9))
    share = np.arange(1, number + 1) / number
    angle = sweep * share[:, None]
    side = np.cross(normal, radius_vector)
    turned = radius_vector * np.cos(angle) + side * np.sin(angle)
    # what rounding in the file leaves between the turned start and the end is spread over the arc, with the helix
    closing = (end - start) - (turned[-1] - radius_vector)
    points: Floats = start + (turned - radius_vector) + share[:, None] * closing
    points[-1] = end
    return points


def _square(vectors: Floats) -> Floats:
    square: Floats = np.einsum("...i,...i->...", vectors, vectors)
    return square
