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
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import SettingsError
from cornersmooth.geometry import nurbs
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import ranges, search, spread, starts
from cornersmooth.kinematics import Machine
from cornersmooth.kinematics.poses import angle_between, continued, pole_distance
from cornersmooth.methods import DEFAULT_METHOD, METHODS
from cornersmooth.model import Bools, Corners, Floats, Ints, Move, Runs, SmoothProgram
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
from cornersmooth.smoothing.segments import Segments, lines_per_half, segments_of
from cornersmooth.vectors import norm, unit

#: share of what rotary axes may take of ε that a curve may use: the rest is for the digits of its control points
_SHARE = 0.95

#: share of that which even angles may take on the segments beside a corner
_EVEN_SHARE = 0.9

#: steps of the parameter of a corner, and those that three decimals hold as the parameter 1 / 8
_STEPS = float(1 << 15)

#: the first rotary axis may turn fast where the pole is nearer than so many times the axis step, and so many degrees
_NEAR_POLE, _NEAR_POLE_DEGREES = 5.0, 1.0

#: corners that are worked on at a time
_TOGETHER = 1 << 13


@dataclass(frozen=True)
class _Sections:
    """Sections of curves with angles: k of them, in the order of the curves; m rows."""

    number: NDArray[np.int8]  #: (m,) of each control point in its section, from 1 on
    points: Floats  #: (m, 5): tip, mm, and both angles, degrees
    spline: Floats  #: (m, 3) as in `Rows`
    count: Ints  #: (k,) rows
    move: Ints  #: (k,)
    curve: Ints  #: (k,)
    #: begin, end: (k,), steps
    begin: Floats
    end: Floats
    axis: Floats  #: (k, 2, 3) tool axes there, where no row of the way may be
    good: Bools  #: (k,) within the tolerance, and within the limits of the axes

    @cached_property
    def first(self) -> Ints:
        """(k + 1,) where the rows of each section begin."""
        return starts(self.count)


@dataclass(frozen=True)
class _Places:
    """Rows of the way on curves, from the one that each starts at, and where they are: (m,) each."""

    curve: Ints
    row: Ints
    s: Floats

    @property
    def ends(self) -> tuple[Ints, Ints]:
        """Rows where each curve begins and ends: (r,) each."""
        first = np.flatnonzero(self.s == 0.0)
        return self.row[first], self.row[np.append(first[1:], len(self.row)) - 1]


def rotary_curve_rows(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows with the angles of the form's machine in `Rows.other`, in the order of its axes, and `Rows.spline`.

    Raises InputError where the machine cannot follow the path, SettingsError for a method with more than one parameter.
    """
    program, settings = smoothed.program, smoothed.settings
    if not METHODS[settings.method].one_parameter:
        raise SettingsError(
            "CS254",
            f"method {settings.method} has no curves in rotary axes",
            f"use the method {DEFAULT_METHOD}, or write lines",
        )
    way, section, sections, lost = _curved_way(smoothed, form, findings)
    if len(lost):
        text = "curve written in lines: on it the rotary axes would leave the tolerance or their limits"
        findings.add("CS378", "note", int(program.line[lost.min()]), text, len(lost))
    if sections is not None and sections.good.any():
        text = f"{form.curve.upper()} with rotary axes under tool tip control is the machine builder's to allow"
        findings.add("CS370", "warning", 0, f"{text}; ask before running it")
    for lines, source in rotary_rows(way, smoothed, form, findings):
        yield _with_curves(lines, np.where(source < 0, -1, section[source]), sections)


def _curved_way(
    smoothed: SmoothProgram, form: Form, findings: Findings
) -> tuple[RotaryWay, Ints, _Sections | None, Ints]:
    """The way, what `_with_sections` says of its rows, all sections, and poses of curves that are lines there.

    Of the lines of a corner those are made that it will have, or just two that show where the axes go.
    """
    corners, halves = smoothed.corners, lines_per_half(smoothed)
    lined = _near_pole(smoothed, machine_of(form))
    while True:
        notes = Findings()
        rows = dense_rows(smoothed, halves=np.where(lined, halves, np.sign(halves)))
        way = rotary_way(rows, smoothed, form, notes)
        ToolTravel(smoothed.program, machine_of(form)).check(way.tip, way.angles, way.move)
        if np.isnan(way.place).all():
            findings.add_all(notes.all())
            return way, np.full(len(way.move), -1), None, np.zeros(0, np.int64)
        work = _Work.of(smoothed, form, way)
        sections, lost = work.sections()
        lost = np.concatenate((lost, sections.move[~sections.good]))
        more = np.isin(corners.pose, lost) & corners.smoothed & ~lined
        if not more.any():
            findings.add_all(notes.all())
            return *_with_sections(work.way, work.places, sections), sections, lost
        lined |= more


def _left_to_axes(settings: Settings, form: Form, taken: Floats) -> Floats:
    """What ε leaves to rotary axes where so much of it, mm, is taken at the axis point: degrees."""
    left = settings.tolerance - math.sqrt(3.0) / 2.0 * settings.tip_resolution - taken
    return _SHARE * np.degrees(left / settings.axis_scale) - form.angle_rounding


def _places(way: RotaryWay, poses: Ints, lengths: Floats) -> _Places:
    """Rows of all curves, which have one or more each, besides that where they start."""
    row = np.flatnonzero(~np.isnan(way.place) & ~way.left)
    begins = np.flatnonzero(np.diff(way.place[row], prepend=2.0) <= 0.0)
    counts = np.diff(begins, append=len(row))
    assert len(begins) == len(poses)
    order = np.argsort(poses)
    number = np.empty_like(order)  # of each curve, in path order
    number[order] = np.arange(len(order))
    curve, place = spread(counts[number] + 1)
    at = row[begins[number[curve]] + np.maximum(place - 1, 0)] - (place == 0)
    s = np.where(place > 0, way.place[at] * lengths[curve], 0.0)
    whole = np.rint(s)  # as poses and knots are
    return _Places(curve, at, np.where(np.abs(s - whole) < 1e-6, whole, s))


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
    def of_corners(cls, corners: Corners, segments: Segments, begin: Ints, end: Ints) -> _Legs:
        """Legs of corners whose curves lie between these rows."""
        of, to = np.concatenate((corners.before, corners.pose)), np.concatenate((corners.pose, corners.after))
        inward, line, joint = np.arange(len(to)) < len(corners), segments.has_line[to], np.concatenate((begin, end))
        entry, leave = segments.entry[to], segments.exit[to]
        return cls(inward, of, to, joint, line, entry, leave)


def _near_pole(smoothed: SmoothProgram, machine: Machine) -> Bools:
    """(k,) corners on which the first rotary axis may turn fast."""
    axis, corners = smoothed.program.axis, smoothed.corners
    here = axis[corners.pose]
    step = np.maximum(angle_between(axis[corners.before], here), angle_between(here, axis[corners.after]))
    return pole_distance(machine, here) < _NEAR_POLE * step + _NEAR_POLE_DEGREES


@dataclass(frozen=True)
class _Work:
    """The way, and curves of all corners, then of all runs: r of them."""

    smoothed: SmoothProgram
    form: Form
    way: RotaryWay  #: angles and axes at joints, and tolerances change in place
    places: _Places
    corners: Corners  #: that are smoothed
    segments: Segments
    least: float  #: degrees that rotary axes may take of ε in any case
    #: angles, last: (n, 2), degrees, and (n,); at each pose, NaN where none is written, and the row of the way there
    angles: Floats
    last: Ints
    turns: Ints  #: (rows of the way + 1,) how often solution and turn may have changed before each
    allowed: Floats  #: (n,), degrees; on the straight motion to each pose and on curves beside it

    @classmethod
    def of(cls, smoothed: SmoothProgram, form: Form, way: RotaryWay) -> _Work:
        """Work out what concerns all curves."""
        program, settings, runs, n = smoothed.program, smoothed.settings, smoothed.runs, len(smoothed.program)
        corners = some_rows(smoothed.corners, smoothed.corners.smoothed)
        poses, lengths = corners.pose, np.full(len(corners), _STEPS)
        if runs is not None:
            poses = np.concatenate((poses, runs.pose[starts(runs.count)[:-1]]))
            lengths = np.concatenate((lengths, runs.knot[starts(runs.knot_count)[1:] - 1]))
        least = form.rotary_tolerance(settings.tolerance, settings.axis_scale)
        straight = float(_left_to_axes(settings, form, np.zeros(1))[0])
        tolerance = np.where(np.isnan(way.place) & (program.kind[way.move] == Move.LINEAR), straight, way.tolerance)
        way = replace(way, tolerance=tolerance)
        # the last row of the move to a corner is in the middle of its curve
        angles, branch, last = np.full((n, 2), np.nan), np.full(n, -1), np.zeros(n, np.int64)
        angles[way.move], branch[way.move], last[way.move] = way.angles, way.branch, np.arange(len(way.move))
        pose = corners.pose
        angles[pose], _ = continued(machine_of(form), program.axis[pose], angles[pose], branch[pose], least / 2)
        allowed, own = np.full(n, straight), np.maximum(_left_to_axes(settings, form, corners.axis_error), least)
        for beside in (pose, corners.after):
            np.minimum.at(allowed, beside, own)
        return cls(
            smoothed,
            form,
            way,
            _places(way, poses, lengths),
            corners,
            segments_of(smoothed, dense=False),
            least,
            angles,
            last,
            np.concatenate(([0], np.cumsum(way.free))),
            allowed,
        )

    def sections(self) -> tuple[_Sections, Ints]:
        """Sections of all curves, and poses of those that are to be lines."""
        parts, lost, count = [], [np.zeros(0, np.int64)], len(self.corners)
        for begin in range(0, count, _TOGETHER):
            corners = some_rows(self.corners, slice(begin, begin + _TOGETHER))
            rows = self._rows(begin, begin + len(corners))
            fitted, kept = self._fitted(self._corners(corners, rows), rows)
            parts.append(self._whole(fitted, corners.pose[kept], begin + np.flatnonzero(kept)))
            lost.append(corners.pose[~kept])
        if (runs := self.smoothed.runs) is not None:
            rows = self._rows(count, count + len(runs))
            fitted, kept = self._fitted(self._runs(runs, rows), rows)
            parts.append(self._cut(fitted, some_runs(runs, kept), count + np.flatnonzero(kept)))
            lost.append(runs.pose[starts(runs.count)[:-1]][~kept])
        columns = [vars(part) for part in parts]  # given back one after the other: they are as large as the program
        whole = {name: np.concatenate([part.pop(name) for part in columns]) for name in list(columns[0])}
        return _Sections(**whole), np.concatenate(lost)

    def _rows(self, begin: int, end: int) -> _Places:
        """Places on some curves, which are counted from 0 on."""
        own = slice(*np.searchsorted(self.places.curve, (begin, end)).tolist())
        rows = some_rows(self.places, own)
        return replace(rows, curve=rows.curve - begin)

    def _fitted(self, curves: Curves, rows: _Places) -> tuple[CurveAngles, Bools]:
        """Angles of the curves that begin where a row ends and in which no solution may change, and which these are."""
        begin, end = rows.ends
        settings, way = self.smoothed.settings, self.way
        control = curves.points[curves.splines.control_first[:-1]]
        off = norm(way.tip[begin] - control[:, :3]) + norm(unit(way.axis[begin]) - unit(control[:, 3:6]))
        near = off <= max(settings.shortest_line, settings.duplicate_distance)
        kept = (begin >= 0) & near & (self.turns[end + 1] == self.turns[begin + 1])
        way.tolerance[rows.row[rows.s > 0.0]] = curves.tolerance[rows.curve[rows.s > 0.0]]
        guide = Guide(rows.curve, rows.s, way.angles[rows.row], way.branch[rows.row].astype(np.int64)).some(kept)
        return curve_angles(curves.some(kept), machine_of(self.form), guide, cone=self.least / 2), kept

    def _runs(self, runs: Runs, rows: _Places) -> Curves:
        """Curves of runs, which end exactly where their rows do."""
        own, lever = runs.control[:, :3], runs.control[:, 3:] - runs.control[:, :3]
        ends = np.full((2, len(runs), 3, 2), np.nan)
        ends[:, :, 0] = self.way.angles[np.stack(rows.ends)]
        points = np.hstack((own, lever, np.ones((len(own), 1))))
        return Curves(Splines(runs.knot, runs.knot_count), points, ends, np.full(len(runs), _SHARE * self.least))

    def _corners(self, corners: Corners, rows: _Places) -> Curves:
        """Curves of some corners; joints of even segments are put on their lines."""
        program, settings, way, count = self.smoothed.program, self.smoothed.settings, self.way, len(corners)
        legs = _Legs.of_corners(corners, self.segments, *rows.ends)
        from_angles, to_angles, even = self._pose_angles(legs)
        of, to = legs.of[even], legs.to[even]
        even[even] = runs_evenly(
            machine_of(self.form),
            program.axis[of],
            program.axis[to],
            from_angles[even],
            to_angles[even],
            _EVEN_SHARE * self.allowed[to],
        )
        # without a line both curves meet where the first one ends; even ones differ by less than the shortest line
        share = np.where(legs.inward & (legs.line | even), legs.leave, legs.entry)[:, None]
        turn = to_angles - from_angles
        angles = np.where(even[:, None], from_angles + share * turn, way.angles[legs.joint])
        way.angles[legs.joint] = angles
        # not of unit length: the ruled motion between these is that between the poses, at its own rate
        way.axis[legs.joint] = program.axis[legs.of] * (1.0 - share) + program.axis[legs.to] * share
        # rates by the fraction of the segment: of even motion, of the line beside, of the parabola through the joint
        before, behind = (angles - from_angles) / share, (to_angles - angles) / (1.0 - share)
        rate, bent = before * (1.0 - share) + behind * share, 2.0 * (behind - before)
        rate[even], bent[even | legs.line] = turn[even], 0.0
        beside = np.flatnonzero(legs.line & ~even)
        rate[beside] = self._line_rates(some_rows(legs, beside))
        # by the parameter of the curve, times its weight
        weight = nurbs.full_weights(corners.weights)
        slope, bend, weight_slope, weight_bend = (
            np.tile(part, 2)[:, None] for part in nurbs.leg_derivatives(weight, corners.ratio)
        )
        sign = np.where(legs.inward, 1.0, -1.0)[:, None]
        gone = np.concatenate((corners.trim_in, corners.trim_out))[:, None] * slope
        one = rate * gone
        two = sign * one * bend / slope + bent * gone**2
        jets = angles, sign * weight_slope * angles + one, weight_bend * angles + 2.0 * sign * weight_slope * one + two
        ends = np.stack([jet.reshape(2, count, 2) / _STEPS**order for order, jet in enumerate(jets)], axis=2)
        tip, axis_point = nurbs.control_points(program, corners, slice(None), settings.axis_length)
        points = np.concatenate((tip, axis_point - tip, np.ones_like(tip[..., :1])), axis=2) * weight[:, :, None]
        splines = Splines(np.tile((0.0, _STEPS / 2, _STEPS), count), np.full(count, 3))
        tolerance = np.maximum(_left_to_axes(settings, self.form, corners.axis_error), _SHARE * self.least)
        return Curves(splines, points.reshape(-1, 7), ends, tolerance)

    def _pose_angles(self, legs: _Legs) -> tuple[Floats, Floats, Bools]:
        """Angles (m, 2) at both ends of legs, and whether one follows from the other in a cut."""
        program, machine = self.smoothed.program, machine_of(self.form)
        from_angles, stated = self.angles[legs.of], np.isnan(self.angles[legs.of, 0])  # no row leads to such a pose
        near, axis = self.way.angles[legs.joint[stated]], program.axis[legs.of[stated]]
        from_angles[stated], _ = continued(machine, axis, near, np.full(len(near), -1), self.least / 2)
        follows = self.turns[self.last[legs.to] + 1] == self.turns[self.last[legs.of] + 1]
        return from_angles, self.angles[legs.to], follows & ~stated

    def _line_rates(self, legs: _Legs) -> Floats:
        """(m, 2) degrees by the fraction of the segment: rates of lines beside joints, as they will be divided."""
        row = legs.joint - legs.inward
        if not len(row):
            return np.zeros((0, 2))
        first, last = int(row.min()), int(row.max())
        way, rapid = some_rows(self.way, slice(first, last + 2)), np.ones(last + 2 - first, np.bool_)
        rapid[row + 1 - first] = False
        more = insertions(
            machine_of(self.form),
            way.tip,
            way.axis,
            way.angles,
            tolerance=way.tolerance,
            rapid=rapid,
            max_step=largest_turn(self.smoothed.settings),
            line=self.smoothed.program.line[way.move],
            file=self.smoothed.program.source.name,
        )
        segment = more.segment + first
        nearest = np.where(
            legs.inward, np.searchsorted(segment, row, side="right") - 1, np.searchsorted(segment, row, side="left")
        )
        share, other = 1.0 - legs.inward, self.way.angles[row + ~legs.inward]
        found = np.isin(row, segment)
        share[found], other[found] = more.fraction[nearest[found]], more.angles[nearest[found]]
        place = legs.entry + share * (legs.leave - legs.entry)
        return (other - self.way.angles[legs.joint]) / (place - np.where(legs.inward, legs.leave, legs.entry))[:, None]

    def _whole(self, fitted: CurveAngles, pose: Ints, number: Ints) -> _Sections:
        """Whole curves of corners as sections; r curves at poses."""
        splines = fitted.curves.splines
        owner, place = spread(splines.count + 2)
        narrowest = np.minimum.reduceat(splines.width, splines.span_first[:-1]) if len(pose) else np.zeros(0)
        own, begin, axis = np.arange(len(pose)), np.zeros(len(pose)), np.zeros((len(pose), 2, 3))
        rows = owner, place + 1, splines.first_knots, fitted.control
        steps = np.minimum(_STEPS, 8.0 * narrowest)
        return self._written(fitted, rows, steps, pose, number, own, begin, begin + _STEPS, axis)

    def _cut(self, fitted: CurveAngles, runs: Runs, number: Ints) -> _Sections:
        """Sections of runs."""
        splines = fitted.curves.splines
        run, begin, end = section_ends(runs, splines, self.smoothed.program)
        rows, steps = clamped(splines, fitted.control, run, begin, end), np.full(len(run), STEPS_PER_UNIT)
        axis = np.stack([unit(fitted.curves.lever(run, s)) for s in (begin, end)], axis=1)
        return self._written(fitted, rows, steps, moves_at(runs, run, end), number[run], run, begin, end, axis)

    def _written(
        self,
        fitted: CurveAngles,
        rows: tuple[Ints, Ints, Floats, Floats],
        steps: Floats,
        move: Ints,
        curve: Ints,
        run: Ints,
        begin: Floats,
        end: Floats,
        axis: Floats,
    ) -> _Sections:
        """Sections as they are written, so many steps as the parameter 1; `rows` are as `clamped` gives them."""
        (owner, number, knot, points), splines, limits = rows, fitted.curves.splines, machine_of(self.form).limits
        counts = np.bincount(owner, minlength=len(curve))
        spline = np.zeros((len(owner), 3))
        spline[:, 0], spline[np.cumsum(counts) - 1, 2] = knot / steps[owner], (end - begin) / steps
        spline[:, 1] = _written_weights(points[:, 5], owner, len(curve))
        points = points[:, :5] / points[:, 5:]
        # spans that a section has a part of
        first = search(splines.knot, splines.count, run, begin, side="right") - 1 - run
        last = search(splines.knot, splines.count, run, end) - 1 - run
        beyond = np.concatenate(([0], np.cumsum(~(fitted.error <= fitted.curves.tolerance[splines.span_run]))))
        good = beyond[last + 1] == beyond[first]
        outside = np.maximum(limits[:, 0] - points[:, 3:], points[:, 3:] - limits[:, 1]).max(axis=1)
        good[owner[outside > LIMIT_SLACK]] = False
        return _Sections(number.astype(np.int8), points, spline, counts, move, curve, begin, end, axis, good)


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


def _with_sections(path: RotaryWay, rows: _Places, sections: _Sections) -> tuple[RotaryWay, Ints]:
    """The way with good sections in the place of the rows within them, and the section that ends in each row, else -1.

    Rows where other lines meet sections are added. The angles of the path given change in place.
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
    section = np.full(len(path.move), -1)
    at = row[known[meets]]
    path.angles[at] = sections.points[point[meets], 3:]
    section[at[ends[meets]]] = number[meets & ends]
    new = np.flatnonzero(~meets)
    before = row[known[new] - 1]
    none = np.zeros(len(new), np.bool_)
    more = RotaryWay(
        tip=sections.points[point[new], :3],
        axis=sections.axis[number[new] + ~ends[new], ends[new].astype(np.int64)],
        move=sections.move[number[new]],
        angles=sections.points[point[new], 3:],
        branch=np.zeros(len(new), np.int8),
        free=none,
        left=none,
        place=np.zeros(len(new)),
        tolerance=path.tolerance[before + 1],
    )
    at = np.cumsum(kept)[before]
    found = RotaryWay(**{name: np.insert(column[kept], at, vars(more)[name], 0) for name, column in vars(path).items()})
    whole = np.insert(section[kept], at, np.where(ends[new], number[new], -1))
    return replace(found, free=found.free | (whole >= 0)), whole


def _with_curves(lines: Rows, section: Ints, sections: _Sections | None) -> Rows:
    """Rows of lines with the control points of sections in the place of the rows that end them."""
    curved = section >= 0
    if sections is None or not curved.any():
        return lines
    counts = np.ones(len(section), np.int64)
    counts[curved] = sections.count[section[curved]]
    owner, _ = spread(counts)
    rows, spline = some_rows(lines, owner), np.zeros((len(owner), 3))
    at = np.flatnonzero(curved[owner])
    points = ranges(sections.first[section[curved]], counts[curved])
    rows.move[at] = np.repeat(sections.move[section[curved]], counts[curved])
    rows.tip[at], rows.other[at] = sections.points[points, :3], sections.points[points, 3:]
    rows.curve[at], rows.joined[at] = sections.number[points], sections.number[points] == 1
    spline[at] = sections.spline[points]
    return replace(rows, spline=spline)
