"""Rows of curves in rotary words: the angles as further axes of the curves of corners and runs, lines for the rest.

All angles are those that lines would have (`rotary_rows`), chosen with the whole program in view. Curves, and sections
of long ones, whose angles a spline follows within the tolerance take the place of their lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, pairwise

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import SettingsError
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import batches, ranges, search, spread, starts
from cornersmooth.kinematics import Machine
from cornersmooth.kinematics.poses import angle_between, continued, pole_distance
from cornersmooth.methods import DEFAULT_METHOD, METHODS
from cornersmooth.model import Bools, Floats, Ints, Numbers, Runs, SmoothProgram
from cornersmooth.nc.corner_joints import SHARE, STEPS, Joints
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_rows import rotary_rows
from cornersmooth.nc.rotary_words import RotaryWay, machine_of, rotary_way
from cornersmooth.nc.tools import ToolTravel
from cornersmooth.rotary.branch_choice import LIMIT_SLACK
from cornersmooth.rotary.curve_angles import CurveAngles, Curves, Guide, curve_angles, joined
from cornersmooth.settings import WEIGHT_DECIMALS
from cornersmooth.slices import joined_rows, some_rows, some_runs
from cornersmooth.smoothing.runs.rows import STEPS_PER_UNIT, clamped, moves_at, section_ends
from cornersmooth.smoothing.sampling import Rows, all_dense_rows, nodes
from cornersmooth.smoothing.segments import lines_of
from cornersmooth.vectors import norm, unit

#: the first rotary axis may turn fast where the pole is nearer than so many times the axis step, and so many degrees
_NEAR_POLE, _NEAR_POLE_DEGREES = 5.0, 1.0

#: control points of a corner, and those that are worked on at a time
_CONTROLS, _TOGETHER = 5, 20_480


@dataclass(frozen=True)
class _Sections:
    """Sections of curves with angles: k of them, in the order of the curves; m rows."""

    curves: Curves

    number: NDArray[np.int8]  #: (m,) of each control point in its section, from 1 on
    points: Floats  #: (m, 5): tip, mm, and both angles, degrees
    spline: Floats  #: (m, 3) as in `Rows`
    count: Ints  #: (k,) rows
    move: Ints  #: (k,)
    curve: Ints  #: (k,) of `curves`
    #: begin, end: (k,), steps
    begin: Floats
    end: Floats
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
        text = "curve written in lines: on it the rotary axes would leave the tolerance or their limits"
        findings.add_each("CS378", "note", program.line[np.sort(part.lost)], text)
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
    halves, more = corners.smoothed.astype(np.int32), corners.smoothed & _near_pole(smoothed, machine)
    lined = more
    while True:
        halves[more] = lines_of(smoothed, np.flatnonzero(more))
        notes = Findings()
        way = rotary_way(all_dense_rows(smoothed, halves=halves), smoothed, form, notes)
        moves = way.move[way.left & (way.place < 1.0)]  # a cut is left within a curve
        more = corners.smoothed & ~lined & (np.isin(corners.pose, moves) | np.isin(corners.after, moves))
        if not more.any():
            break
        lined = lined | more
    findings.add_all(notes.all())
    ToolTravel(smoothed.program, machine).check(way.tip, way.angles, way.move)
    return way


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
    way: RotaryWay
    joints: Joints
    longest: Floats  #: parameters of runs, steps
    corner: Numbers  #: rows of `Corners` that are smoothed
    #: pose, order: (r,); first of each curve, and the curves in path order
    pose: Numbers
    order: Numbers
    row: Numbers  #: rows of the way on curves, but for those where they start
    first: Numbers  #: (r + 1,) which of these are those of each curve, in path order

    @classmethod
    def of(cls, smoothed: SmoothProgram, form: Form, way: RotaryWay) -> _Work:
        """Work out what concerns all curves."""
        runs, corner = smoothed.runs, np.flatnonzero(smoothed.corners.smoothed)
        poses, longest = smoothed.corners.pose[corner], np.zeros(0)
        if runs is not None:
            poses = np.concatenate((poses, runs.pose[starts(runs.count)[:-1]]))
            longest = runs.knot[starts(runs.knot_count)[1:] - 1]
        row = np.flatnonzero(~np.isnan(way.place) & ~way.left)
        first = np.append(np.flatnonzero(np.diff(way.place[row], prepend=2.0) <= 0.0), len(row))
        assert len(first) == len(poses) + 1
        joints = Joints.of(smoothed, form, way, corner)
        return cls(
            smoothed,
            way,
            joints,
            longest,
            *(each.astype(np.int32) for each in (corner, poses, np.argsort(poses), row, first)),
        )

    def parts(self) -> Iterator[_Part]:
        """All rows, from that which the part before ends with, and sections of some curves."""
        begin = 0
        for one, other in pairwise(self._batches()):
            whole = other == len(self.order)
            end = len(self.way.move) - 1 if whole else int(self.row[self.first[other] - 1])
            yield self._part(one, other, begin, end)
            begin = end

    def _batches(self) -> list[int]:
        """Numbers of curves in path order at which parts begin, and their end."""
        size, runs = np.full(len(self.pose), _CONTROLS), self.smoothed.runs
        if runs is not None:
            size[len(self.corner) :] = runs.knot_count + 2
        return batches(size[self.order], _TOGETHER).tolist()

    def _part(self, one: int, other: int, begin: int, end: int) -> _Part:
        """Curves from one on, in path order, to before another, and the rows of the way that are with them."""
        own = np.sort(self.order[one:other]).astype(np.int64)
        rows, count = self._places(own, one), int(np.searchsorted(own, len(self.corner)))
        runs = self.smoothed.runs if count < len(own) else None
        joints = [row[:count] for row in rows.ends]
        pose, corner = self.pose[own].astype(np.int64), self.corner[own[:count]].astype(np.int64)
        corners = some_rows(self.smoothed.corners, corner)
        made = [self.joints.curves(corners, *joints)] if count else []
        if runs is not None:
            runs = some_runs(runs, np.isin(np.arange(len(runs)), own[count:] - len(self.corner)))
            made.append(self._runs(runs, rows))
        curves = joined(made)
        kept = self._suits(curves, rows)
        fitted = curve_angles(
            curves.some(kept), self._machine, self._guide(rows).some(kept), cone=self.joints.least / 2
        )
        whole = pose[:count][kept[:count]]
        sections = self._sections(fitted, whole, None if runs is None else some_runs(runs, kept[count:]))
        lost = np.concatenate((pose[~kept], sections.move[~sections.good]))
        number = np.flatnonzero(kept)  # of the curves that have sections
        kept[number[sections.curve[~sections.good]]] = False
        lines, before = self._lines(curves, corner, np.flatnonzero(~kept[:count]), rows)
        here, on_curve = slice(begin, end + 1), rows.s > 0.0
        tolerance = self.joints.tolerance(here)
        tolerance[rows.row[on_curve] - begin] = curves.tolerance[rows.curve[on_curve]]
        path = replace(some_rows(self.way, here), tolerance=tolerance)
        way, section = _with_sections(path, rows, number, sections, lines, before, begin)
        return _Part(way, section, sections, lost, end)

    def _places(self, curves: Ints, one: int) -> _Places:
        """Rows of some curves, those from one on in path order."""
        path = one + np.argsort(np.argsort(self.pose[curves]))
        curve, place = spread(self.first[path + 1] - self.first[path] + 1)
        at = self.row[self.first[path[curve]] + np.maximum(place - 1, 0)].astype(np.int64) - (place == 0)
        length = np.full(len(curves), STEPS)
        of_runs = curves >= len(self.corner)
        length[of_runs] = self.longest[curves[of_runs] - len(self.corner)]
        s = np.where(place > 0, self.way.place[at] * length[curve], 0.0)
        whole = np.rint(s)  # as poses and knots are
        return _Places(curve, at, np.where(np.abs(s - whole) < 1e-6, whole, s))

    def _suits(self, curves: Curves, rows: _Places) -> Bools:
        """(r,) curves that begin where a row ends, and in which no solution may change."""
        begin, end = rows.ends
        settings, way = self.smoothed.settings, self.way
        control = curves.points[curves.splines.control_first[:-1]]
        off = norm(way.tip[begin] - control[:, :3]) + norm(unit(way.axis[begin]) - unit(control[:, 3:6]))
        near = off <= max(settings.shortest_line, settings.duplicate_distance)
        suits: Bools = (begin >= 0) & near & (self.joints.turns(end) == self.joints.turns(begin))
        return suits

    @property
    def _machine(self) -> Machine:
        return machine_of(self.joints.form)

    def _guide(self, rows: _Places) -> Guide:
        at = np.maximum(rows.row, 0)  # there is no row where the program begins with a curve
        return Guide(rows.curve, rows.s, self.way.angles[at], self.way.branch[at].astype(np.int64))

    def _lines(self, curves: Curves, corner: Ints, lost: Ints, rows: _Places) -> tuple[RotaryWay, Ints]:
        """Rows of corners that are lost, where the way has two lines for each, and the rows that they come after."""
        lost = lost[np.bincount(rows.curve)[lost] == 3]
        inner = [nodes(lines)[:-1] for lines in lines_of(self.smoothed, corner[lost]).tolist()]
        curve, u = np.repeat(lost, [len(each) for each in inner]), np.concatenate([*inner, np.zeros(0)])
        curve, u = curve[u != 0.5], u[u != 0.5]
        s, later = u * STEPS, u > 0.5
        points = curves.splines.points(curves.points, curves.splines.span_at(curve, s), s)
        axis, corners = unit(points[:, 3:6]), some_rows(self.smoothed.corners, corner[curve])
        angles, branch = continued(self._machine, axis, *self._guide(rows).between(curve, s), self.joints.least / 2)
        place, none = np.flatnonzero(rows.s == 0.0)[curve] + later, np.zeros(len(s), np.bool_)
        return RotaryWay(
            tip=points[:, :3] / points[:, 6:],
            axis=axis,
            move=np.where(later, corners.after, corners.pose),
            angles=angles,
            branch=branch.astype(np.int8),
            free=none,
            left=none,
            place=u,
            tolerance=curves.tolerance[curve],
        ), rows.row[place]

    def _runs(self, runs: Runs, rows: _Places) -> Curves:
        """Curves of runs, which end exactly where their rows do."""
        own, lever = runs.control[:, :3], runs.control[:, 3:] - runs.control[:, :3]
        ends = np.full((2, len(runs), 3, 2), np.nan)
        ends[:, :, 0] = self.way.angles[np.stack(rows.ends)[:, -len(runs) :]]
        points = np.hstack((own, lever, np.ones((len(own), 1))))
        return Curves(Splines(runs.knot, runs.knot_count), points, ends, np.full(len(runs), SHARE * self.joints.least))

    def _sections(self, fitted: CurveAngles, corner: Ints, runs: Runs | None) -> _Sections:
        """Curves of corners at poses as a whole, and sections of the runs after them, as they are written."""
        splines, limits, count = fitted.curves.splines, self._machine.limits, len(corner)
        narrowest = np.minimum.reduceat(splines.width, splines.span_first[:-1]) if len(splines.count) else np.zeros(0)
        curve, begin, end, move = np.arange(count), np.zeros(count), np.full(count, STEPS), corner
        steps = np.minimum(STEPS, 8.0 * narrowest[:count])
        if runs is not None:
            own = Splines(splines.knot[splines.first[count] :], splines.count[count:])
            run, *ends = section_ends(runs, own, self.smoothed.program)
            curve, move = np.append(curve, count + run), np.append(move, moves_at(runs, run, ends[1]))
            begin, end = np.append(begin, ends[0]), np.append(end, ends[1])
            steps = np.append(steps, np.full(len(run), STEPS_PER_UNIT))
        if runs is None:
            owner, place = spread(splines.count + 2)
            number, knot, points = place + 1, splines.first_knots, fitted.control
        else:
            owner, number, knot, points = clamped(splines, fitted.control, curve, begin, end)
        counts = np.bincount(owner, minlength=len(curve))
        spline = np.zeros((len(owner), 3))
        spline[:, 0], spline[np.cumsum(counts) - 1, 2] = knot / steps[owner], (end - begin) / steps
        spline[:, 1] = _written_weights(points[:, 5], owner, len(curve))
        points = points[:, :5] / points[:, 5:]
        # spans that a section has a part of
        first = search(splines.knot, splines.count, curve, begin, side="right") - 1 - curve
        last = search(splines.knot, splines.count, curve, end) - 1 - curve
        beyond = np.concatenate(([0], np.cumsum(~(fitted.error <= fitted.curves.tolerance[splines.span_run]))))
        good = beyond[last + 1] == beyond[first]
        outside = np.maximum(limits[:, 0] - points[:, 3:], points[:, 3:] - limits[:, 1]).max(axis=1)
        good[owner[outside > LIMIT_SLACK]] = False
        return _Sections(fitted.curves, number.astype(np.int8), points, spline, counts, move, curve, begin, end, good)


def _with_sections(
    path: RotaryWay,
    rows: _Places,
    curve: Ints,
    sections: _Sections,
    lines: RotaryWay,
    before: Ints,
    first: int,
) -> tuple[RotaryWay, Ints]:
    """Rows of the way, good sections in the place of those within, and the section that ends in each, -1 for none.

    `first` is the first of the rows in the whole way. Rows where other lines meet sections are added, and lines after
    the rows before them. The angles of the way change in place.
    """
    row = rows.row - first
    counts = np.bincount(rows.curve)
    base = starts(np.floor(rows.s[starts(counts)[1:] - 1]).astype(np.int64) + 2)[:-1].astype(np.float64)
    keys = rows.s + base[rows.curve]
    chosen = np.flatnonzero(sections.good)
    shift = base[curve[sections.curve]]
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
    after, s = row[known[new] - 1], np.where(ends, sections.end[number], sections.begin[number + ~ends])[new]
    none = np.zeros(len(new), np.bool_)
    more = RotaryWay(
        tip=sections.points[point[new], :3],
        axis=unit(sections.curves.lever(sections.curve[number[new] + ~ends[new]], s)),
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
