"""Rows of curves through whole runs in rotary words: sections with the angles as further axes, lines for the rest.

All angles are those that lines would have (`rotary_rows`), chosen with the whole program in view. Sections of runs
whose angles a spline follows within the tolerance take the place of their lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import ranges, spread, starts
from cornersmooth.kinematics import Machine, check_travel
from cornersmooth.model import Bools, Floats, Ints, Runs, SmoothProgram
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.rewinds import from_zero
from cornersmooth.nc.rotary_curve_rows import warn_of_curves
from cornersmooth.nc.rotary_rows import CHUNK, LARGEST_TURN, InsertedPoints, whole_rows
from cornersmooth.rotary import fill, insertions, rapid_moves, rotary_angles, still_poses
from cornersmooth.rotary.run_angles import Guide, RunAngles, lever_at, run_angles
from cornersmooth.slices import some_runs
from cornersmooth.smoothing.runs.rows import STEPS_PER_UNIT, SectionRows, line_places, polylines_of, section_rows
from cornersmooth.smoothing.sampling import Rows, dense_rows
from cornersmooth.vectors import norm, unit

#: share of what rotary axes may take of ε that a curve may use: the rest is for the digits of its control points
_SHARE = 0.95


@dataclass(frozen=True)
class _Path:
    """Rows of lines, n of them, and what rotary axes have there.

    Parameters
    ----------
    tip, axis : (n, 3) float64
        mm, and unit vectors.
    angles : (n, 2) float64, degrees
    move : (n,) int64
    free : (n,) bool
        Nothing is looked at on the way into the row: a rapid, or a section.
    section : (n,) int64
        Section that ends in the row, -1 for a line.
    """

    tip: Floats
    axis: Floats
    angles: Floats
    move: Ints
    free: Bools
    section: Ints


@dataclass(frozen=True)
class _Sections:
    """Sections of runs with angles: k of them, in path order.

    Parameters
    ----------
    rows : SectionRows
        With points (m, 5): tip, mm, and both angles, degrees.
    first : (k + 1,) int64
        Where the rows of each section begin.
    run : (k,) int64
    begin, end : (k,) float64, steps
    good : (k,) bool
        Within the tolerance, and within the limits of the axes.
    """

    rows: SectionRows
    first: Ints
    run: Ints
    begin: Floats
    end: Floats
    good: Bools


def rotary_run_rows(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows with the angles of the form's machine in `Rows.other`, in the order of its axes, and `Rows.spline`.

    Parameters
    ----------
    smoothed : SmoothProgram
        With runs.
    form : Form
        Of curves in rotary words.
    findings : Findings
        Takes what the kinematics notice.

    Raises
    ------
    InputError
        The machine cannot follow the path.
    """
    program, settings, machine, runs = smoothed.program, smoothed.settings, form.machine, smoothed.runs
    assert runs is not None
    if machine is None:
        raise SettingsError("CS215", f"{form.control} form {form.name} needs a machine", "name it with --machine")
    tip, axis, move = whole_rows(dense_rows(smoothed))
    tolerance, file = form.rotary_tolerance(settings.tolerance, settings.axis_scale), program.source.name
    rapid = rapid_moves(program.kind)[move]
    found = rotary_angles(
        machine,
        tip,
        axis,
        tolerance=tolerance,
        rapid=rapid,
        line=program.line[move],
        file=file,
        still=still_poses(program.kind)[move],
        still_tolerance=form.angle_rounding,
    )
    for finding in found.findings:
        findings.add(finding.code, finding.severity, finding.line, finding.text, finding.count)
    angles = found.angles + from_zero(form, program, axis, found.angles, move, rapid)
    check_travel(machine, tip, angles, program.line[move], file)
    path = _Path(tip, axis, angles, move, rapid, np.full(len(move), -1))
    runs, rows = _followed(smoothed, runs, path)
    sections = None
    if len(runs):
        guide = Guide(rows.run, rows.s, path.angles[rows.row], found.branch[rows.row].astype(np.int64))
        fitted = run_angles(runs, machine, guide, tolerance=_SHARE * tolerance, cone=tolerance / 2)
        sections = _sections(fitted, smoothed, machine, _SHARE * tolerance)
        path = _with_sections(path, fitted.runs, rows, sections)
        lost = np.flatnonzero(~sections.good)
        if len(lost):
            text = "stretch of a run written in lines: on curves the rotary axes would leave the tolerance"
            pose = sections.rows.move[sections.first[1:][lost] - 1]
            findings.add("CS378", "note", int(program.line[pose[0]]), text, len(lost))
        if sections.good.any():
            warn_of_curves(form, findings)
    yield from _rows(smoothed, form, path, sections, tolerance, findings)


@dataclass(frozen=True)
class _RunRows:
    """Rows of the path on runs, from the one that each starts at, and where they are on it: (m,) each."""

    run: Ints
    row: Ints
    s: Floats


def _followed(smoothed: SmoothProgram, runs: Runs, path: _Path) -> tuple[Runs, _RunRows]:
    """The runs that begin where a row ends and in which no solution may change, with their rows."""
    program = smoothed.program
    lines = polylines_of(runs, program.tip, program.tip + smoothed.settings.axis_length * program.axis)
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


def _with_sections(path: _Path, runs: Runs, rows: _RunRows, sections: _Sections) -> _Path:
    """The path with good sections in the place of the rows within them; rows where other lines meet them are added."""
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
    angles, section = path.angles.copy(), path.section.copy()
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
    return _Path(
        tip=joined(path.tip, sections.rows.points[point[new], :3]),
        axis=joined(path.axis, unit(lever)),
        angles=joined(angles, sections.rows.points[point[new], 3:]),
        move=np.concatenate((path.move[kept], sections.rows.move[sections.first[number[new] + 1] - 1]))[order],
        free=np.concatenate((path.free[kept], np.zeros(len(new), np.bool_)))[order] | (whole >= 0),
        section=whole,
    )


def _rows(
    smoothed: SmoothProgram,
    form: Form,
    path: _Path,
    sections: _Sections | None,
    tolerance: float,
    findings: Findings,
) -> Iterator[Rows]:
    """Rows of the path some thousand at a time, with the points that its lines need."""
    program, machine, settings = smoothed.program, form.machine, smoothed.settings
    assert machine is not None
    file, inserted = program.source.name, InsertedPoints()
    largest_turn = min(settings.axis_step or LARGEST_TURN, LARGEST_TURN)
    edges = [*range(0, max(len(path.move) - 1, 1), CHUNK), max(len(path.move) - 1, 1)]
    for begin, end in pairwise(edges):
        here = slice(begin, end + 1)  # the last row of a chunk is the start of the next
        line = program.line[path.move[here]]
        more = insertions(
            machine,
            path.tip[here],
            path.axis[here],
            path.angles[here],
            tolerance=tolerance,
            rapid=path.free[here],
            max_step=largest_turn,
            line=line,
            file=file,
        )
        inserted.add(more, line)
        filled = fill(path.tip[here], path.axis[here], path.angles[here], more)
        own = slice(1 if begin else 0, None)
        pose = filled.pose[own]
        section = np.where(filled.inserted[own], -1, path.section[here][pose])
        yield _with_curves(filled.tip[own], filled.angles[own], path.move[here][pose], section, sections)
    inserted.warn(findings)
    inserted.tell(machine, findings)


def _with_curves(tip: Floats, angles: Floats, move: Ints, section: Ints, sections: _Sections | None) -> Rows:
    """Rows with the control points of sections in the place of the rows that end them."""
    counts = np.ones(len(move), np.int64)
    curved = section >= 0
    if sections is not None:
        counts[curved] = np.diff(sections.first)[section[curved]]
    owner, _ = spread(counts)
    rows = Rows(
        tip=tip[owner],
        other=angles[owner],
        move=move[owner],
        curve=np.zeros(len(owner), np.int8),
        joined=np.zeros(len(owner), np.bool_),
        spline=np.tile((0.0, 1.0, 0.0), (len(owner), 1)),
    )
    if sections is None or not curved.any():
        return rows
    at = np.flatnonzero(curved[owner])
    points = ranges(sections.first[section[curved]], counts[curved])
    assert rows.spline is not None
    rows.tip[at], rows.other[at] = sections.rows.points[points, :3], sections.rows.points[points, 3:]
    rows.curve[at], rows.joined[at] = sections.rows.number[points], sections.rows.number[points] == 1
    rows.spline[at, 0], rows.spline[at, 2] = sections.rows.knot[points], sections.rows.last_knot[points]
    return rows
