"""Rows of curves through whole runs in rotary words: sections with the angles as further axes, lines for the rest.

All angles are those that lines would have (`rotary_rows`), chosen with the whole program in view. Sections of runs
whose angles a spline follows within the tolerance take the place of their lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import ranges, spread, starts
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Floats, Ints, Runs, SmoothProgram
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_curve_rows import warn_of_curves
from cornersmooth.nc.rotary_rows import rotary_rows
from cornersmooth.nc.rotary_words import RotaryWay, machine_of, rotary_way
from cornersmooth.nc.tools import ToolTravel
from cornersmooth.rotary.run_angles import Guide, RunAngles, lever_at, run_angles
from cornersmooth.slices import some_rows, some_runs
from cornersmooth.smoothing.runs.rows import STEPS_PER_UNIT, SectionRows, line_places, polylines_of, section_rows
from cornersmooth.smoothing.sampling import Rows, dense_rows
from cornersmooth.vectors import norm, unit

#: share of what rotary axes may take of ε that a curve may use: the rest is for the digits of its control points
_SHARE = 0.95


@dataclass(frozen=True)
class _Sections:
    """Sections of runs with angles: k of them, in path order."""

    rows: SectionRows  #: with points (m, 5): tip, mm, and both angles, degrees
    first: Ints  #: (k + 1,) where the rows of each section begin
    run: Ints  #: (k,)
    #: begin, end: (k,), steps
    begin: Floats
    end: Floats
    good: Bools  #: (k,) within the tolerance, and within the limits of the axes


def rotary_run_rows(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows with the angles of the form's machine in `Rows.other`, in the order of its axes, and `Rows.spline`.

    Raises InputError where the machine cannot follow the path.
    """
    program, settings, machine, runs = smoothed.program, smoothed.settings, machine_of(form), smoothed.runs
    assert runs is not None
    way = rotary_way(dense_rows(smoothed), smoothed, form, findings)
    ToolTravel(program, machine).check(way.tip, way.angles, way.move)
    section, sections = np.full(len(way.move), -1), None
    runs, rows = _followed(smoothed, runs, way)
    if len(runs):
        tolerance = form.rotary_tolerance(settings.tolerance, settings.axis_scale)
        guide = Guide(rows.run, rows.s, way.angles[rows.row], way.branch[rows.row].astype(np.int64))
        fitted = run_angles(runs, machine, guide, tolerance=_SHARE * tolerance, cone=tolerance / 2)
        sections = _sections(fitted, smoothed, machine, _SHARE * tolerance)
        way, section = _with_sections(way, fitted.runs, rows, sections)
        lost = np.flatnonzero(~sections.good)
        if len(lost):
            text = "stretch of a run written in lines: on curves the rotary axes would leave the tolerance"
            pose = sections.rows.move[sections.first[1:][lost] - 1]
            findings.add("CS378", "note", int(program.line[pose[0]]), text, len(lost))
        if sections.good.any():
            warn_of_curves(form, findings)
    for lines, source in rotary_rows(way, smoothed, form, findings):
        yield _with_curves(lines, np.where(source < 0, -1, section[source]), sections)


@dataclass(frozen=True)
class _RunRows:
    """Rows of the path on runs, from the one that each starts at, and where they are on it: (m,) each."""

    run: Ints
    row: Ints
    s: Floats


def _followed(smoothed: SmoothProgram, runs: Runs, path: RotaryWay) -> tuple[Runs, _RunRows]:
    """The runs that begin where a row ends and in which no solution may change, with their rows."""
    program = smoothed.program
    lines = polylines_of(runs, program, smoothed.settings.axis_length)
    places = line_places(runs, lines, program, smoothed.settings)
    inside = np.zeros(len(program), np.bool_)
    inside[places.pose] = True
    row = np.flatnonzero(inside[path.move])
    splines = Splines(runs.knot, runs.knot_count)
    begins = np.searchsorted(splines.span_run[places.span], np.arange(len(runs) + 1))
    first_pose = runs.pose[starts(runs.count)[:-1]]
    before = row[begins[:-1]] - 1
    off = norm(path.tip[before] - program.tip[first_pose]) + norm(path.axis[before] - program.axis[first_pose])
    turns = np.concatenate(([0], np.cumsum(path.free[row])))[begins]
    kept = (before >= 0) & (off <= smoothed.settings.duplicate_distance) & (turns[1:] == turns[:-1])
    run, place = spread(np.diff(begins)[kept] + 1)
    at = np.maximum(begins[:-1][kept][run] + place - 1, 0)
    rows = _RunRows(run, np.where(place > 0, row[at], before[kept][run]), np.where(place > 0, places.s[at], 0.0))
    return some_runs(runs, kept), rows


def _sections(fitted: RunAngles, smoothed: SmoothProgram, machine: Machine, tolerance: float) -> _Sections:
    """Cut the runs into sections, and say which of them are good."""
    runs = fitted.runs
    five = np.hstack((runs.control[:, :3], fitted.angles))
    rows = section_rows(replace(runs, control=five), smoothed.program)
    first = np.append(np.flatnonzero(rows.number == 1), len(rows.number))
    width = np.round(rows.last_knot[first[1:] - 1] * STEPS_PER_UNIT)
    splines = Splines(runs.knot, runs.knot_count)
    length = splines.knot[splines.first[1:] - 1]
    reached, whole = np.cumsum(width), np.concatenate(([0.0], np.cumsum(length)))
    run = np.searchsorted(whole, reached - width / 2.0, side="right") - 1
    end = reached - whole[run]
    begin = end - width
    # spans that a section has a part of
    base = starts(length.astype(np.int64) + 2)[:-1].astype(np.float64)
    keys = splines.knot + np.repeat(base, splines.count)
    low = np.searchsorted(keys, begin + base[run], side="right") - 1 - run
    high = np.searchsorted(keys, end + base[run], side="left") - 1 - run
    beyond = np.concatenate(([0], np.cumsum(~(fitted.error <= tolerance))))
    good = beyond[high + 1] == beyond[low]
    words = rows.points[:, 3:]
    outside = ((words < machine.limits[:, 0]) | (words > machine.limits[:, 1])).any(axis=1)
    good &= ~np.logical_or.reduceat(outside, first[:-1])
    return _Sections(rows, first, run, begin, end, good)


def _with_sections(path: RotaryWay, runs: Runs, rows: _RunRows, sections: _Sections) -> tuple[RotaryWay, Ints]:
    """The way with good sections in the place of the rows within them, and the section that ends in each row, else -1.

    Rows where other lines meet sections are added.
    """
    row = rows.row
    counts = np.bincount(rows.run)
    base = starts(np.floor(rows.s[starts(counts)[1:] - 1]).astype(np.int64) + 2)[:-1].astype(np.float64)
    keys = rows.s + base[rows.run]
    chosen = np.flatnonzero(sections.good)
    shift = base[sections.run]
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
    angles[at] = sections.rows.points[point[meets], 3:]
    section[at[ends[meets]]] = number[meets & ends]
    new = np.flatnonzero(~meets)
    before = row[known[new] - 1]
    owner = sections.run[number[new]]
    lever = lever_at(Splines(runs.knot, runs.knot_count), runs.control, owner, place[new] - base[owner])
    position = np.concatenate((np.flatnonzero(kept).astype(np.float64), before + 0.5))
    order = np.lexsort((np.concatenate((np.zeros(int(kept.sum())), place[new])), position))

    def joined(own: Floats, more: Floats) -> Floats:
        result: Floats = np.concatenate((own[kept], more))[order]
        return result

    numbers = np.where(ends[new], number[new], -1)
    whole = np.concatenate((section[kept], numbers))[order]
    found = RotaryWay(
        tip=joined(path.tip, sections.rows.points[point[new], :3]),
        axis=joined(path.axis, unit(lever)),
        angles=joined(angles, sections.rows.points[point[new], 3:]),
        move=np.concatenate((path.move[kept], sections.rows.move[sections.first[number[new] + 1] - 1]))[order],
        branch=np.zeros(0, np.int8),
        free=np.concatenate((path.free[kept], np.zeros(len(new), np.bool_)))[order] | (whole >= 0),
        left=np.zeros(len(order), np.bool_),
    )
    return found, whole


def _with_curves(lines: Rows, section: Ints, sections: _Sections | None) -> Rows:
    """Rows of lines with the control points of sections in the place of the rows that end them."""
    curved = section >= 0
    if sections is None or not curved.any():
        return lines
    counts = np.ones(len(section), np.int64)
    counts[curved] = np.diff(sections.first)[section[curved]]
    owner, _ = spread(counts)
    rows, own, spline = some_rows(lines, owner), sections.rows, np.zeros((len(owner), 3))
    at = np.flatnonzero(curved[owner])
    points = ranges(sections.first[section[curved]], counts[curved])
    rows.tip[at], rows.other[at] = own.points[points, :3], own.points[points, 3:]
    rows.curve[at], rows.joined[at] = own.number[points], own.number[points] == 1
    spline[at, 0], spline[at, 1], spline[at, 2] = own.knot[points], 1.0, own.last_knot[points]
    return replace(rows, spline=spline)
