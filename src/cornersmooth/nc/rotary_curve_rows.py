"""Rows of curves in rotary words: the angles as further axes of the curves of corners and runs, lines for the rest.

All angles are those that lines would have (`rotary_rows`), chosen with the whole program in view. Curves, and sections
of long ones, whose angles a spline follows within the tolerance take the place of their lines.

A segment whose angles may run evenly from pose to pose within the tolerance does so: a corner between two of them is
rounded in its angles exactly as it is in its tip. On all others the joints have the angles of the ruled motion, and the
curve goes on with the rate of the straight line beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.geometry import nurbs
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import ranges, search, spread, starts
from cornersmooth.kinematics import Machine
from cornersmooth.kinematics.poses import continued
from cornersmooth.methods import DEFAULT_METHOD, METHODS
from cornersmooth.model import Bools, Floats, Ints, Move, SmoothProgram
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_rows import largest_turn, rotary_rows
from cornersmooth.nc.rotary_words import RotaryWay, machine_of, rotary_way
from cornersmooth.nc.tools import ToolTravel
from cornersmooth.rotary.branch_choice import LIMIT_SLACK
from cornersmooth.rotary.curve_angles import CurveAngles, Curves, Guide, curve_angles
from cornersmooth.rotary.subdivision import insertions, runs_evenly
from cornersmooth.settings import WEIGHT_DECIMALS, Settings
from cornersmooth.slices import some_rows, some_runs
from cornersmooth.smoothing.runs.rows import STEPS_PER_UNIT, clamped, moves_at, section_ends
from cornersmooth.smoothing.sampling import Rows, dense_rows
from cornersmooth.smoothing.segments import segments_of
from cornersmooth.vectors import norm, unit

#: share of what rotary axes may take of ε that a curve may use: the rest is for the digits of its control points
_SHARE = 0.95

#: share of that which even angles may take on the segments beside a corner
_EVEN_SHARE = 0.9

#: steps of the parameter of a corner, and those that three decimals hold as the parameter 1 / 8
_STEPS = float(1 << 15)


@dataclass(frozen=True)
class _Sections:
    """Sections of curves with angles: k of them, in the order of the curves; m rows."""

    number: Ints  #: (m,) of each control point in its section, from 1 on
    points: Floats  #: (m, 5): tip, mm, and both angles, degrees
    spline: Floats  #: (m, 3) as in `Rows`
    first: Ints  #: (k + 1,) where the rows of each section begin
    move: Ints  #: (k,)
    curve: Ints  #: (k,)
    #: begin, end: (k,), steps
    begin: Floats
    end: Floats
    good: Bools  #: (k,) within the tolerance, and within the limits of the axes


@dataclass(frozen=True)
class _Places:
    """Rows of the way on curves, from the one that each starts at, and where they are: (m,) each."""

    curve: Ints
    row: Ints
    s: Floats


def rotary_curve_rows(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows with the angles of the form's machine in `Rows.other`, in the order of its axes, and `Rows.spline`.

    Raises InputError where the machine cannot follow the path, SettingsError for a method with more than one parameter.
    """
    program, settings, machine = smoothed.program, smoothed.settings, machine_of(form)
    if not METHODS[settings.method].one_parameter:
        raise SettingsError(
            "CS254",
            f"method {settings.method} has no curves in rotary axes",
            f"use the method {DEFAULT_METHOD}, or write lines",
        )
    way = rotary_way(dense_rows(smoothed, divide=False), smoothed, form, findings)
    ToolTravel(program, machine).check(way.tip, way.angles, way.move)
    section, sections = np.full(len(way.move), -1), None
    curves, poses = _curves(smoothed, form)
    if len(poses):
        places = _places(way, curves, poses)
        way, curves = _joined(smoothed, form, way, curves, places)
        kept = _followed(smoothed, way, curves, places)
        places = some_rows(places, kept[places.curve])
        places = replace(places, curve=np.cumsum(kept)[places.curve] - 1)
        guide = Guide(places.curve, places.s, way.angles[places.row], way.branch[places.row].astype(np.int64))
        cone = form.rotary_tolerance(settings.tolerance, settings.axis_scale) / 2
        fitted = curve_angles(curves.some(kept), machine, guide, cone=cone)
        sections = _sections(fitted, kept, smoothed, machine)
        way, section = _with_sections(way, fitted.curves, places, sections)
        lost = np.concatenate((poses[~kept], sections.move[~sections.good]))
        if len(lost):
            text = "curve written in lines: on it the rotary axes would leave the tolerance or their limits"
            findings.add("CS378", "note", int(program.line[lost.min()]), text, len(lost))
        if sections.good.any():
            text = f"{form.curve.upper()} with rotary axes under tool tip control is the machine builder's to allow"
            findings.add("CS370", "warning", 0, f"{text}; ask before running it")
    for lines, source in rotary_rows(way, smoothed, form, findings):
        yield _with_curves(lines, np.where(source < 0, -1, section[source]), sections)


def _left_to_axes(settings: Settings, form: Form, taken: Floats) -> Floats:
    """What ε leaves to rotary axes where so much of it, mm, is taken at the axis point: degrees."""
    left = settings.tolerance - math.sqrt(3.0) / 2.0 * settings.tip_resolution - taken
    return _SHARE * np.degrees(left / settings.axis_scale) - form.angle_rounding


def _curves(smoothed: SmoothProgram, form: Form) -> tuple[Curves, Ints]:
    """Curves of all corners, then of all runs, and the pose of each corner, the first one of each run."""
    runs, corners, settings = smoothed.runs, smoothed.corners, smoothed.settings
    rows = np.flatnonzero(corners.smoothed)
    tip, axis_point = nurbs.control_points(smoothed.program, corners, rows, settings.axis_length)
    weight = nurbs.full_weights(corners.weights[rows])[:, :, None]
    knot, count = np.tile((0.0, _STEPS / 2, _STEPS), len(rows)), np.full(len(rows), 3)
    points = np.concatenate((tip * weight, (axis_point - tip) * weight, weight), axis=2).reshape(-1, 7)
    poses, least = corners.pose[rows], _SHARE * form.rotary_tolerance(settings.tolerance, settings.axis_scale)
    tolerance = np.maximum(_left_to_axes(settings, form, corners.axis_error[rows]), least)
    if runs is not None:
        own, lever = runs.control[:, :3], runs.control[:, 3:] - runs.control[:, :3]
        points = np.concatenate((points, np.hstack((own, lever, np.ones((len(own), 1))))))
        knot, count = np.concatenate((knot, runs.knot)), np.concatenate((count, runs.knot_count))
        poses = np.concatenate((poses, runs.pose[starts(runs.count)[:-1]]))
        tolerance = np.append(tolerance, np.full(len(runs), least))
    return Curves(Splines(knot, count), points, np.full((2, len(count), 3, 2), np.nan), tolerance), poses


def _places(way: RotaryWay, curves: Curves, poses: Ints) -> _Places:
    """Rows of all curves, which have one or more each, besides that where they start."""
    row = np.flatnonzero(~np.isnan(way.place) & ~way.left)
    begins = np.flatnonzero(np.diff(way.place[row], prepend=2.0) <= 0.0)
    counts = np.diff(begins, append=len(row))
    order = np.argsort(poses)
    number = np.empty_like(order)  # of each curve, in path order
    number[order] = np.arange(len(order))
    curve, place = spread(counts[number] + 1)
    at = row[begins[number[curve]] + np.maximum(place - 1, 0)] - (place == 0)
    last = curves.splines.knot[curves.splines.first[1:] - 1][curve]
    s = np.where(place > 0, way.place[at] * last, 0.0)
    whole = np.rint(s)  # as poses and knots are
    return _Places(curve, at, np.where(np.abs(s - whole) < 1e-6, whole, s))


def _followed(smoothed: SmoothProgram, way: RotaryWay, curves: Curves, places: _Places) -> Bools:
    """(r,) curves that begin where a row ends and in which no solution may change."""
    first = np.flatnonzero(places.s == 0.0)
    begin, end = places.row[first], places.row[np.append(first[1:], len(places.row)) - 1]
    turns = np.concatenate(([0], np.cumsum(way.free)))
    control = curves.points[curves.splines.control_first[:-1]]
    off = norm(way.tip[begin] - control[:, :3]) + norm(unit(way.axis[begin]) - unit(control[:, 3:6]))
    near = off <= max(smoothed.settings.shortest_line, smoothed.settings.duplicate_distance)
    return (begin >= 0) & near & (turns[end + 1] == turns[begin + 1])


@dataclass(frozen=True)
class _Legs:
    """The segments into each corner, then those out of it: m legs of m / 2 corners."""

    inward: Bools
    #: of, to: poses at both ends
    of: Ints
    to: Ints
    joint: Ints  #: row of the way
    line: Bools  #: whether a part of the segment is written as a line
    #: entry, leave: fractions of the segment between which straight motion is left
    entry: Floats
    leave: Floats

    @classmethod
    def of_corners(cls, smoothed: SmoothProgram, begin: Ints, end: Ints) -> _Legs:
        """Legs of all corners, whose curves lie between these rows."""
        corners, segments = some_rows(smoothed.corners, smoothed.corners.smoothed), segments_of(smoothed, dense=False)
        of, to = np.concatenate((corners.before, corners.pose)), np.concatenate((corners.pose, corners.after))
        inward, line, joint = np.arange(len(to)) < len(corners), segments.has_line[to], np.concatenate((begin, end))
        entry, leave = segments.entry[to], segments.exit[to]
        return cls(inward, of, to, joint, line, entry, leave)


def _joined(
    smoothed: SmoothProgram, form: Form, way: RotaryWay, curves: Curves, places: _Places
) -> tuple[RotaryWay, Curves]:
    """The way with the joints of even segments on their lines, and the curves with what they join."""
    program, settings, machine = smoothed.program, smoothed.settings, machine_of(form)
    corners = some_rows(smoothed.corners, smoothed.corners.smoothed)
    straight = float(_left_to_axes(settings, form, np.zeros(1))[0])
    tolerance = np.where(np.isnan(way.place) & (program.kind[way.move] == Move.LINEAR), straight, way.tolerance)
    tolerance[places.row[places.s > 0.0]] = curves.tolerance[places.curve[places.s > 0.0]]
    way = replace(way, angles=way.angles.copy(), axis=way.axis.copy(), tolerance=tolerance)
    first = np.flatnonzero(places.s == 0.0)
    begin, end = places.row[first], places.row[np.append(first[1:], len(places.row)) - 1]
    ends = np.full((2, len(first), 3, 2), np.nan)
    ends[:, :, 0] = way.angles[begin], way.angles[end]
    if not len(corners):
        return way, replace(curves, ends=ends)
    count = len(corners)
    legs = _Legs.of_corners(smoothed, begin[:count], end[:count])
    from_angles, to_angles, even = _pose_angles(smoothed, form, way, legs)
    allowed = np.full(len(program), straight)
    np.minimum.at(allowed, legs.to, np.tile(curves.tolerance[:count], 2))
    of, to = legs.of[even], legs.to[even]
    even[even] = runs_evenly(
        machine,
        program.axis[of],
        program.axis[to],
        from_angles[even],
        to_angles[even],
        _EVEN_SHARE * allowed[to],
    )
    # without a line both curves meet where the first one ends; even ones differ there by less than the shortest line
    fraction = np.where(legs.inward & (legs.line | even), legs.leave, legs.entry)
    share, turn = fraction[:, None], to_angles - from_angles
    angles = np.where(even[:, None], from_angles + share * turn, way.angles[legs.joint])
    way.angles[legs.joint] = angles
    # not of unit length: the ruled motion between these is that between the poses, at its own rate
    way.axis[legs.joint] = program.axis[legs.of] * (1.0 - share) + program.axis[legs.to] * share
    # rates by the fraction of the segment: that of even motion, of the line beside, of the parabola through the joint
    before, behind = (angles - from_angles) / share, (to_angles - angles) / (1.0 - share)
    rate, bent = before * (1.0 - share) + behind * share, 2.0 * (behind - before)
    rate[even], bent[even | legs.line] = turn[even], 0.0
    beside = np.flatnonzero(legs.line & ~even)
    rate[beside] = _line_rates(smoothed, machine, way, some_rows(legs, beside))
    # by the parameter of the curve, times its weight
    slope, bend, weight_slope, weight_bend = (
        np.tile(part, 2)[:, None] for part in nurbs.leg_derivatives(nurbs.full_weights(corners.weights), corners.ratio)
    )
    sign = np.where(legs.inward, 1.0, -1.0)[:, None]
    way_of_leg = np.concatenate((corners.trim_in, corners.trim_out))[:, None] * slope
    one = rate * way_of_leg
    two = sign * one * bend / slope + bent * way_of_leg**2
    jets = angles, sign * weight_slope * angles + one, weight_bend * angles + 2.0 * sign * weight_slope * one + two
    for order, jet in enumerate(jets):
        ends[:, :count, order] = jet.reshape(2, count, 2) / _STEPS**order
    return way, replace(curves, ends=ends)


def _pose_angles(smoothed: SmoothProgram, form: Form, way: RotaryWay, legs: _Legs) -> tuple[Floats, Floats, Bools]:
    """Angles (m, 2) at both ends of legs, and whether one follows from the other in a cut."""
    program, machine, n = smoothed.program, machine_of(form), len(smoothed.program)
    cone = form.rotary_tolerance(smoothed.settings.tolerance, smoothed.settings.axis_scale) / 2
    # the last row of the move to a corner is in the middle of its curve
    known, branch, last = np.full((n, 2), np.nan), np.full(n, -1), np.zeros(n, np.int64)
    known[way.move], branch[way.move], last[way.move] = way.angles, way.branch, np.arange(len(way.move))
    pose = legs.to[legs.inward]
    known[pose], _ = continued(machine, program.axis[pose], known[pose], branch[pose], cone)
    turns = np.concatenate(([0], np.cumsum(way.free)))
    from_angles, stated = known[legs.of], np.isnan(known[legs.of, 0])  # no row leads to a stated position
    near = way.angles[legs.joint[stated]]
    from_angles[stated], _ = continued(machine, program.axis[legs.of[stated]], near, np.full(len(near), -1), cone)
    return from_angles, known[legs.to], (turns[last[legs.to] + 1] == turns[last[legs.of] + 1]) & ~stated


def _line_rates(smoothed: SmoothProgram, machine: Machine, way: RotaryWay, legs: _Legs) -> Floats:
    """(m, 2) degrees by the fraction of the segment: rates of the lines beside the joints, as they will be divided."""
    row = legs.joint - legs.inward
    rapid = np.ones(len(way.move), np.bool_)
    rapid[row + 1] = False
    more = insertions(
        machine,
        way.tip,
        way.axis,
        way.angles,
        tolerance=way.tolerance,
        rapid=rapid,
        max_step=largest_turn(smoothed.settings),
        line=smoothed.program.line[way.move],
        file=smoothed.program.source.name,
    )
    nearest = np.where(
        legs.inward,
        np.searchsorted(more.segment, row, side="right") - 1,
        np.searchsorted(more.segment, row, side="left"),
    )
    share, other = 1.0 - legs.inward, way.angles[row + ~legs.inward]
    found = np.isin(row, more.segment)
    share[found], other[found] = more.fraction[nearest[found]], more.angles[nearest[found]]
    place = legs.entry + share * (legs.leave - legs.entry)
    return (other - way.angles[legs.joint]) / (place - np.where(legs.inward, legs.leave, legs.entry))[:, None]


def _sections(fitted: CurveAngles, kept: Bools, smoothed: SmoothProgram, machine: Machine) -> _Sections:
    """Cut the curves into sections, and say which of them are good."""
    corners, splines = smoothed.corners, fitted.curves.splines
    pose = corners.pose[corners.smoothed]
    kept_corners = kept[: len(pose)]
    pose = pose[kept_corners]
    curve, begin, end = np.arange(len(pose)), np.zeros(len(pose)), np.full(len(pose), _STEPS)
    unit_steps = np.full(len(splines.count), STEPS_PER_UNIT)
    if len(pose):
        narrowest = np.minimum.reduceat(splines.width, splines.span_first[: len(pose)])
        unit_steps[: len(pose)] = np.minimum(_STEPS, 8.0 * narrowest)
    if smoothed.runs is not None:
        runs = some_runs(smoothed.runs, kept[len(kept_corners) :])
        own = Splines(splines.knot[splines.first[len(pose)] :], splines.count[len(pose) :])
        run, low, high = section_ends(runs, own, smoothed.program)
        pose = np.concatenate((pose, moves_at(runs, run, high)))
        curve, begin, end = (np.concatenate(pair) for pair in ((curve, run + len(curve)), (begin, low), (end, high)))
    control = np.hstack((fitted.curves.points[:, :3], fitted.angles, fitted.curves.points[:, 6:]))
    owner, number, knot, points = clamped(splines, control, curve, begin, end)
    first = starts(np.bincount(owner, minlength=len(curve)))
    unit_of = unit_steps[curve]
    spline = np.zeros((len(owner), 3))
    spline[:, 0], spline[first[1:] - 1, 2] = knot / unit_of[owner], (end - begin) / unit_of
    spline[:, 1] = _written_weights(points[:, 5], owner, len(curve))
    points = points[:, :5] / points[:, 5:]
    # spans that a section has a part of
    first_span = search(splines.knot, splines.count, curve, begin, side="right") - 1 - curve
    last_span = search(splines.knot, splines.count, curve, end) - 1 - curve
    beyond = np.concatenate(([0], np.cumsum(~(fitted.error <= fitted.curves.tolerance[splines.span_run]))))
    good = beyond[last_span + 1] == beyond[first_span]
    outside = np.maximum(machine.limits[:, 0] - points[:, 3:], points[:, 3:] - machine.limits[:, 1]).max(axis=1)
    good[owner[outside > LIMIT_SLACK]] = False
    return _Sections(number, points, spline, first, pose, curve, begin, end, good)


def _written_weights(weight: Floats, owner: Ints, count: int) -> Floats:
    """Weights (m,) times the smallest power of two for each section that leaves no more decimals than controls keep."""
    factor, scale = np.ones(count), 10.0**WEIGHT_DECIMALS
    for _ in range(20):
        ticks = weight * factor[owner] * scale
        inexact = np.abs(ticks - np.rint(ticks)) > 1e-6
        if not inexact.any():
            break
        factor[np.unique(owner[inexact])] *= 2.0
    return np.round(weight * factor[owner], WEIGHT_DECIMALS)


def _with_sections(path: RotaryWay, curves: Curves, rows: _Places, sections: _Sections) -> tuple[RotaryWay, Ints]:
    """The way with good sections in the place of the rows within them, and the section that ends in each row, else -1.

    Rows where other lines meet sections are added.
    """
    row = rows.row
    counts = np.bincount(rows.curve)
    base = starts(np.floor(rows.s[starts(counts)[1:] - 1]).astype(np.int64) + 2)[:-1].astype(np.float64)
    keys = rows.s + base[rows.curve]
    chosen = np.flatnonzero(sections.good)
    shift = base[sections.curve]
    begin, end = (sections.begin + shift)[chosen], (sections.end + shift)[chosen]
    # rows strictly within
    of = np.searchsorted(begin, keys, side="left") - 1
    within = (of >= 0) & (keys < end[np.maximum(of, 0)]) if len(chosen) else np.zeros(len(keys), np.bool_)
    kept = np.ones(len(path.move), np.bool_)
    kept[row[within]] = False
    # where sections end and begin, and the number of the section, good or not, that ends there
    place = np.concatenate((end, begin))
    number = np.concatenate((chosen, chosen - 1))
    point = np.concatenate((sections.first[chosen + 1] - 1, sections.first[chosen]))
    place, once = np.unique(place, return_index=True)
    number, point, ends = number[once], point[once], once < len(chosen)
    known = np.searchsorted(keys, place)
    meets = keys[known] == place
    angles, section = path.angles.copy(), np.full(len(path.move), -1)
    at = row[known[meets]]
    angles[at] = sections.points[point[meets], 3:]
    section[at[ends[meets]]] = number[meets & ends]
    new = np.flatnonzero(~meets)
    before = row[known[new] - 1]
    owner = sections.curve[number[new]]
    position = np.concatenate((np.flatnonzero(kept).astype(np.float64), before + 0.5))
    order = np.lexsort((np.concatenate((np.zeros(int(kept.sum())), place[new])), position))
    none = np.zeros(len(new), np.bool_)
    more = RotaryWay(
        tip=sections.points[point[new], :3],
        axis=unit(curves.lever(owner, place[new] - base[owner])),
        move=sections.move[number[new]],
        angles=sections.points[point[new], 3:],
        branch=np.zeros(len(new), np.int8),
        free=none,
        left=none,
        place=np.zeros(len(new)),
        tolerance=path.tolerance[before + 1],
    )
    old = some_rows(replace(path, angles=angles), kept)
    found = RotaryWay(**{name: np.concatenate((vars(old)[name], vars(more)[name]))[order] for name in vars(more)})
    whole = np.concatenate((section[kept], np.where(ends[new], number[new], -1)))[order]
    return replace(found, free=found.free | (whole >= 0)), whole


def _with_curves(lines: Rows, section: Ints, sections: _Sections | None) -> Rows:
    """Rows of lines with the control points of sections in the place of the rows that end them."""
    curved = section >= 0
    if sections is None or not curved.any():
        return lines
    counts = np.ones(len(section), np.int64)
    counts[curved] = np.diff(sections.first)[section[curved]]
    owner, _ = spread(counts)
    rows, spline = some_rows(lines, owner), np.zeros((len(owner), 3))
    at = np.flatnonzero(curved[owner])
    points = ranges(sections.first[section[curved]], counts[curved])
    rows.move[at] = np.repeat(sections.move[section[curved]], counts[curved])
    rows.tip[at], rows.other[at] = sections.points[points, :3], sections.points[points, 3:]
    rows.curve[at], rows.joined[at] = sections.number[points], sections.number[points] == 1
    spline[at] = sections.spline[points]
    return replace(rows, spline=spline)
