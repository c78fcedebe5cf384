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
from itertools import chain, pairwise

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import SettingsError
from cornersmooth.geometry import nurbs
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import batches, ranges, search, spread, starts
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
from cornersmooth.slices import joined_rows, some_rows, some_runs
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.runs.rows import STEPS_PER_UNIT, clamped, moves_at, section_ends
from cornersmooth.smoothing.sampling import Rows, dense_rows, nodes
from cornersmooth.smoothing.segments import Segments, lines_of, segments_of
from cornersmooth.vectors import norm, unit

#: share of what rotary axes may take of ε that a curve may use: the rest is for the digits of its control points
_SHARE = 0.95

#: share of that which even angles may take on the segments beside a corner
_EVEN_SHARE = 0.9

#: steps of the parameter of a corner, and those that three decimals hold as the parameter 1 / 8
_STEPS = float(1 << 15)

#: the first rotary axis may turn fast where the pole is nearer than so many times the axis step, and so many degrees
_NEAR_POLE, _NEAR_POLE_DEGREES = 5.0, 1.0

#: poses of curves that are worked on at a time
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

    def some(self, begin: int, end: int) -> _Places:
        """Those on some of the curves, which are counted from 0 on."""
        own = slice(*np.searchsorted(self.curve, (begin, end)).tolist())
        return _Places(self.curve[own] - begin, self.row[own], self.s[own])


@dataclass(frozen=True)
class _Part:
    """Some rows of the way with sections of curves in the place of others: m of them."""

    way: RotaryWay
    section: Ints  #: (m,) the section that ends in each row, -1 for none
    sections: _Sections
    lost: Ints  #: poses of curves that are lines
    end: int  #: the last row, in the whole way


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
    way = _way(smoothed, form, findings)
    if np.isnan(way.place).all():
        yield from (lines for lines, _ in rotary_rows(way, smoothed, form, findings))
        return
    begin, curved = 0, False
    # a joint has its angles when the curves after it have theirs
    for part, _ in pairwise(chain(_Work.of(smoothed, form, way).parts(), (None,))):
        assert part is not None
        part.way.angles[-1] = way.angles[part.end]
        if len(part.lost):
            text = "curve written in lines: on it the rotary axes would leave the tolerance or their limits"
            findings.add("CS378", "note", int(program.line[part.lost.min()]), text, len(part.lost))
        if not curved and part.sections.good.any():
            text = f"{form.curve.upper()} with rotary axes under tool tip control is the machine builder's to allow"
            findings.add("CS370", "warning", 0, f"{text}; ask before running it")
            curved = True
        for lines, source in rotary_rows(part.way, smoothed, form, findings, continued=begin > 0):
            yield _with_curves(lines, np.where(source < 0, -1, part.section[source]), part.sections)
        begin = part.end


def _way(smoothed: SmoothProgram, form: Form, findings: Findings) -> RotaryWay:
    """The way with two lines for each corner, and all of its lines where these do not show where the axes go."""
    corners, machine = smoothed.corners, machine_of(form)
    halves, more = corners.smoothed.astype(np.int64), corners.smoothed & _near_pole(smoothed, machine)
    lined = more
    while True:
        halves[more] = lines_of(smoothed, np.flatnonzero(more))
        notes = Findings()
        way = rotary_way(dense_rows(smoothed, halves=halves), smoothed, form, notes)
        moves = way.move[way.left & (way.place < 1.0)]  # a cut is left within a curve
        more = corners.smoothed & ~lined & (np.isin(corners.pose, moves) | np.isin(corners.after, moves))
        if not more.any():
            break
        lined = lined | more
    findings.add_all(notes.all())
    ToolTravel(smoothed.program, machine).check(way.tip, way.angles, way.move)
    return way


def _left_to_axes(settings: Settings, form: Form, taken: Floats) -> Floats:
    """What ε leaves to rotary axes where so much of it, mm, is taken at the axis point: degrees."""
    left = settings.tolerance - math.sqrt(3.0) / 2.0 * settings.tip_resolution - taken
    return _SHARE * np.degrees(left / settings.axis_scale) - form.angle_rounding


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
    """The way, and its curves: those of all corners, then those of all runs."""

    smoothed: SmoothProgram
    form: Form
    way: RotaryWay  #: angles and axes at joints, and tolerances change in place
    corner: Ints  #: rows of `Corners` that are smoothed
    #: pose, length, order: (r,); of each curve its first, and its longest parameter, steps; the curves in path order
    pose: Ints
    length: Floats
    order: Ints
    row: Ints  #: rows of the way on curves, but for those where they start
    first: Ints  #: (r + 1,) which of these are those of each curve, in path order
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
        corners, corner = smoothed.corners, np.flatnonzero(smoothed.corners.smoothed)
        poses, lengths = corners.pose[corner], np.full(len(corner), _STEPS)
        if runs is not None:
            poses = np.concatenate((poses, runs.pose[starts(runs.count)[:-1]]))
            lengths = np.concatenate((lengths, runs.knot[starts(runs.knot_count)[1:] - 1]))
        row = np.flatnonzero(~np.isnan(way.place) & ~way.left)
        first = np.append(np.flatnonzero(np.diff(way.place[row], prepend=2.0) <= 0.0), len(row))
        assert len(first) == len(poses) + 1
        least = form.rotary_tolerance(settings.tolerance, settings.axis_scale)
        straight = float(_left_to_axes(settings, form, np.zeros(1))[0])
        tolerance = np.where(np.isnan(way.place) & (program.kind[way.move] == Move.LINEAR), straight, way.tolerance)
        # the last row of the move to a corner is in the middle of its curve
        angles, branch, last = np.full((n, 2), np.nan), np.full(n, -1), np.zeros(n, np.int64)
        angles[way.move], branch[way.move], last[way.move] = way.angles, way.branch, np.arange(len(way.move))
        allowed = np.full(n, straight)
        for begin in range(0, len(corner), _TOGETHER):
            own = corner[begin : begin + _TOGETHER]
            pose = corners.pose[own]
            angles[pose], _ = continued(machine_of(form), program.axis[pose], angles[pose], branch[pose], least / 2)
            taken = np.maximum(_left_to_axes(settings, form, corners.axis_error[own]), least)
            for beside in (pose, corners.after[own]):
                np.minimum.at(allowed, beside, taken)
        return cls(
            smoothed,
            form,
            replace(way, tolerance=tolerance),
            corner,
            poses,
            lengths,
            np.argsort(poses),
            row,
            first,
            segments_of(smoothed, dense=False),
            least,
            angles,
            last,
            np.concatenate(([0], np.cumsum(way.free))),
            allowed,
        )

    def parts(self) -> Iterator[_Part]:
        """All rows, from that which the part before ends with, and sections of some curves."""
        size, runs, begin = np.ones(len(self.pose), np.int64), self.smoothed.runs, 0
        if runs is not None:
            size[len(self.corner) :] = runs.count
        for one, other in pairwise(batches(size[self.order], _TOGETHER).tolist()):
            whole = other == len(self.order)
            end = len(self.way.move) - 1 if whole else int(self.row[self.first[other] - 1])
            yield self._part(one, other, begin, end)
            begin = end

    def _part(self, one: int, other: int, begin: int, end: int) -> _Part:
        """Curves from one on, in path order, to before another, and the rows of the way that are with them."""
        own = np.sort(self.order[one:other])
        rows, poses, count = self._places(own, one), self.pose[own], int(np.searchsorted(own, len(self.corner)))
        made, kept = [], np.zeros(len(own), np.bool_)
        if count:
            corners, some = some_rows(self.smoothed.corners, self.corner[own[:count]]), rows.some(0, count)
            fitted, kept[:count] = self._fitted(self._corners(corners, some), some)
            made.append(self._whole(fitted, poses[:count][kept[:count]], np.flatnonzero(kept)))
        if count < len(own):
            assert self.smoothed.runs is not None
            chosen = np.isin(np.arange(len(self.smoothed.runs)), own[count:] - len(self.corner))
            runs, some = some_runs(self.smoothed.runs, chosen), rows.some(count, len(own))
            fitted, kept[count:] = self._fitted(self._runs(runs, some), some)
            made.append(self._cut(fitted, some_runs(runs, kept[count:]), count + np.flatnonzero(kept[count:])))
        sections = joined_rows(made)
        lost = np.concatenate((poses[~kept], sections.move[~sections.good]))
        kept[sections.curve[~sections.good]] = False
        lines, before = self._lines(self.corner[own[:count]], np.flatnonzero(~kept[:count]), rows)
        way, section = self._with_sections(rows, sections, lines, before, begin, end)
        return _Part(way, section, sections, lost, end)

    def _places(self, curves: Ints, one: int) -> _Places:
        """Rows of some curves, those from one on in path order."""
        path = one + np.argsort(np.argsort(self.pose[curves]))
        curve, place = spread(np.diff(self.first)[path] + 1)
        at = self.row[self.first[path[curve]] + np.maximum(place - 1, 0)] - (place == 0)
        s = np.where(place > 0, self.way.place[at] * self.length[curves[curve]], 0.0)
        whole = np.rint(s)  # as poses and knots are
        return _Places(curve, at, np.where(np.abs(s - whole) < 1e-6, whole, s))

    def _fitted(self, curves: Curves, rows: _Places) -> tuple[CurveAngles, Bools]:
        """Angles of the curves that begin where a row ends and in which no solution may change, and which these are."""
        begin, end = rows.ends
        settings, way = self.smoothed.settings, self.way
        control = curves.points[curves.splines.control_first[:-1]]
        off = norm(way.tip[begin] - control[:, :3]) + norm(unit(way.axis[begin]) - unit(control[:, 3:6]))
        near = off <= max(settings.shortest_line, settings.duplicate_distance)
        kept = (begin >= 0) & near & (self.turns[end + 1] == self.turns[begin + 1])
        way.tolerance[rows.row[rows.s > 0.0]] = curves.tolerance[rows.curve[rows.s > 0.0]]
        return curve_angles(curves.some(kept), self._machine, self._guide(rows).some(kept), cone=self.least / 2), kept

    @property
    def _machine(self) -> Machine:
        return machine_of(self.form)

    def _guide(self, rows: _Places) -> Guide:
        at = np.maximum(rows.row, 0)  # there is no row where the program begins with a curve
        return Guide(rows.curve, rows.s, self.way.angles[at], self.way.branch[at].astype(np.int64))

    def _lines(self, corner: Ints, lost: Ints, rows: _Places) -> tuple[RotaryWay, Ints]:
        """Rows of the curves that are lost, where the way has two lines for each, and the rows that they come after."""
        smoothed, first = self.smoothed, np.flatnonzero(rows.s == 0.0)
        lost = lost[np.bincount(rows.curve)[lost] == 3]
        numbers, u = lines_of(smoothed, corner[lost]), np.zeros(0)
        curve, s = np.zeros(0, np.int64), np.zeros(0)
        tip, axis = np.zeros((2, 0, 3))
        for number in np.unique(numbers).tolist():
            which, u = lost[numbers == number], nodes(number)
            u = u[(u != 0.5) & (u != 1.0)]
            points, levers = construction_of(smoothed.settings.method).points(smoothed, corner[which], u)
            curve, s = np.append(curve, np.repeat(which, len(u))), np.append(s, np.tile(u * _STEPS, len(which)))
            tip, axis = np.vstack((tip, points[:, 1:].reshape(-1, 3))), np.vstack((axis, levers[:, 1:].reshape(-1, 3)))
        order = np.lexsort((s, curve))
        curve, s, axis, later = curve[order], s[order], unit(axis[order]), s[order] > _STEPS / 2.0
        angles, branch = continued(self._machine, axis, *self._guide(rows).between(curve, s), self.least / 2)
        corners, place = some_rows(smoothed.corners, corner[curve]), first[curve] + later
        none = np.zeros(len(s), np.bool_)
        return RotaryWay(
            tip=tip[order],
            axis=axis,
            move=np.where(later, corners.after, corners.pose),
            angles=angles,
            branch=branch.astype(np.int8),
            free=none,
            left=none,
            place=s / _STEPS,
            tolerance=self.way.tolerance[rows.row[place + 1]],
        ), rows.row[place]

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
            self._machine,
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
        program, machine = self.smoothed.program, self._machine
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
            self._machine,
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
        (owner, number, knot, points), splines, limits = rows, fitted.curves.splines, self._machine.limits
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

    def _with_sections(
        self, rows: _Places, sections: _Sections, lines: RotaryWay, before: Ints, first: int, last: int
    ) -> tuple[RotaryWay, Ints]:
        """Rows of the way, good sections in the place of those within, and the section that ends in each, -1 for none.

        Rows where other lines meet sections are added, and lines after the rows before them. The angles of the way
        change in place.
        """
        path, row = some_rows(self.way, slice(first, last + 1)), rows.row - first
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
        after = row[known[new] - 1]
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
            tolerance=path.tolerance[after + 1],
        )
        more, after = joined_rows((more, lines)), np.concatenate((after, before - first))
        at = np.append(0, np.cumsum(kept))[after + 1]
        columns = vars(path).items()
        found = RotaryWay(**{name: np.insert(column[kept], at, vars(more)[name], 0) for name, column in columns})
        ended = np.concatenate((np.where(ends[new], number[new], -1), np.full(len(before), -1)))
        whole = np.insert(section[kept], at, ended)
        return replace(found, free=found.free | (whole >= 0)), whole


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


def _with_curves(lines: Rows, section: Ints, sections: _Sections) -> Rows:
    """Rows of lines with the control points of sections in the place of the rows that end them."""
    curved = section >= 0
    if not curved.any():
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
