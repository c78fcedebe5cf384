"""Rows of lines and curves in rotary words: FANUC's G6.2 with the rotary axes as further axes of the curve."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cornersmooth.geometry.arcs import arc_lines, arc_points, divided
from cornersmooth.model import Floats, Ints, SmoothProgram
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.rewinds import from_zero
from cornersmooth.nc.rotary_words import machine_of, note_inserted
from cornersmooth.nc.tools import ToolTravel
from cornersmooth.rotary import rapid_moves
from cornersmooth.rotary.angle_curves import CurveGroup, RotaryCurves, angle_allowance, rotary_curves
from cornersmooth.rotary.corner_lines import CornerLines
from cornersmooth.rotary.subdivision import Insertions
from cornersmooth.slices import some_rows
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.smoothing.segments import Segments, segments_of

#: poses whose rows are handed on at a time
_CHUNK = 16384

#: share of what ε leaves that angles may take on straight motion: the rest is for what lies between places measured
_STRAIGHT_SHARE = 0.95


def rotary_curve_rows(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows with the angles of the form's machine in `Rows.other`, in the order of its axes, and `Rows.spline`.

    Raises InputError where the machine cannot follow the path, SettingsError for a method without curves in rotary
    axes.
    """
    program, settings, machine = smoothed.program, smoothed.settings, machine_of(form)
    step, resolution = form.rounding(program.units), form.angle_rounding
    left = (settings.tolerance - math.sqrt(3.0) / 2.0 * step) / settings.axis_scale
    found = rotary_curves(
        smoothed,
        machine,
        tolerance=_STRAIGHT_SHARE * math.degrees(left) - resolution,
        allowance=angle_allowance(smoothed, resolution),
        angle_resolution=resolution,
    )
    findings.add_all(found.findings)
    jumps = np.union1d(found.inserted.unsolved, smoothed.corners.pose[found.lines.unsolved])
    first = found.inserted.segment.min(initial=len(program) - 1)
    note_inserted(machine, len(found.inserted), int(program.line[first]), program.line[jumps], findings)
    if any(len(group) for group in found.groups):
        warn_of_curves(form, findings)
    angles, rapid = found.pose_angles, rapid_moves(program.kind)
    shift = from_zero(form, program, program.axis, angles, np.arange(len(program)), rapid)
    travel = ToolTravel(program, machine)
    for chunk in _rows(smoothed, found):
        chunk.other[:] += shift[chunk.move]
        travel.check(chunk.tip, chunk.other, chunk.move)
        yield chunk


def warn_of_curves(form: Form, findings: Findings) -> None:
    """Say that curves in rotary words are not every machine's."""
    curve = form.curve.upper()
    text = f"{curve} with rotary axes under tool tip control is the machine builder's to allow; ask before running it"
    findings.add("CS370", "warning", 0, text)


def _rows(smoothed: SmoothProgram, found: RotaryCurves) -> Iterator[Rows]:
    """Rows of some poses at a time: for each inserted points, the end of the straight motion, the curve."""
    arcs = arc_lines(smoothed.program, smoothed.settings) if len(smoothed.program.arcs) else np.zeros(0, np.int64)
    segments = segments_of(smoothed, dense=False)
    order = np.lexsort((found.inserted.fraction, found.inserted.segment))
    for begin in range(0, len(smoothed.program), _CHUNK):
        poses = slice(begin, min(begin + _CHUNK, len(smoothed.program)))
        parts = [
            _inserted(smoothed, found.inserted, segments, order, poses),
            _ends(smoothed, found, segments, poses),
            _arcs(smoothed, found.pose_angles, arcs, poses),
            *(part for group in found.groups for part in _curves(smoothed, group, segments, poses)),
            _corner_lines(smoothed, found.lines, segments, poses),
        ]
        place = np.concatenate([place for place, _ in parts])
        columns = {
            name: np.concatenate([vars(rows)[name] for _, rows in parts])
            for name in ("tip", "other", "move", "curve", "joined", "spline")
        }
        yield some_rows(Rows(**columns), np.lexsort((place, columns["move"])))


#: rows, and where each of them is among those of its pose: up to 1 on the straight motion
_Part = tuple[Floats, Rows]


def _lines(pose: Ints, place: Floats, tip: Floats, angles: Floats) -> _Part:
    count = len(pose)
    return place, Rows(
        tip, angles, pose, np.zeros(count, np.int8), np.zeros(count, np.bool_), spline=np.zeros((count, 3))
    )


def _within(pose: Ints, poses: slice) -> slice:
    """Entries of a list of poses, ascending, that are among some."""
    low, high = np.searchsorted(pose, (poses.start, poses.stop)).tolist()
    return slice(low, high)


def _inserted(smoothed: SmoothProgram, more: Insertions, segments: Segments, order: Ints, poses: slice) -> _Part:
    """Points inserted into straight motion."""
    own = order[_within(more.segment[order], poses)]
    segment, fraction, tip = more.segment[own], more.fraction[own], smoothed.program.tip
    start = tip[segments.start[segment]]
    return _lines(segment, fraction, start + fraction[:, None] * (tip[segment] - start), more.angles[own])


def _ends(smoothed: SmoothProgram, found: RotaryCurves, segments: Segments, poses: slice) -> _Part:
    """Ends of straight motion that are no joints."""
    straight = segments.has_line & ~segments.skip & (segments.row < 0)
    straight[smoothed.program.arcs.pose] = False
    pose = poses.start + np.flatnonzero(straight[poses])
    return _lines(pose, np.ones(len(pose)), smoothed.program.tip[pose], found.pose_angles[pose])


def _arcs(smoothed: SmoothProgram, angles: Floats, lines: Ints, poses: slice) -> _Part:
    own = _within(smoothed.program.arcs.pose, poses)
    rows, share = divided(lines[own])
    rows += own.start
    pose = smoothed.program.arcs.pose[rows]
    start = np.where(np.isnan(angles[pose - 1]), angles[pose], angles[pose - 1])  # from a stated position
    tip, _ = arc_points(smoothed.program, rows, share)
    return _lines(pose, share, tip, start + share[:, None] * (angles[pose] - start))


def _curves(smoothed: SmoothProgram, group: CurveGroup, segments: Segments, poses: slice) -> tuple[_Part, _Part]:
    """Control points, and the ends of the lines before them: exactly where the curves begin."""
    own = _within(smoothed.corners.pose[group.row], poses)
    pose, tip, angles = smoothed.corners.pose[group.row[own]], group.tips(own), group.angles[own]
    line = segments.has_line[pose]
    number = np.arange(1, group.points + 1)
    joined = (number == 1) & ~line[:, None]
    spline = np.zeros((len(pose), group.points, 3))
    spline[:, :, 0], spline[:, :, 1] = group.knots[: group.points], group.weights[own]
    spline[:, -1, 2] = group.knots[-1]
    numbers = np.tile(number, len(pose))
    place = (1 + numbers).astype(np.float64)
    points = Rows(
        tip.reshape(-1, 3),
        angles.reshape(-1, 2),
        np.repeat(pose, group.points),
        numbers.astype(np.int8),
        joined.ravel(),
        spline=spline.reshape(-1, 3),
    )
    return (place, points), _lines(pose[line], np.ones(int(line.sum())), tip[line, 0], angles[line, 0])


def _corner_lines(smoothed: SmoothProgram, lines: CornerLines, segments: Segments, poses: slice) -> _Part:
    """Corners in lines; the first point of each ends the line before it."""
    pose = smoothed.corners.pose[lines.row]
    own = _within(pose, poses)
    pose = pose[own]
    number = np.arange(len(pose)) - np.searchsorted(pose, pose)
    kept = (number > 0) | segments.has_line[pose]
    place = (1 + number[kept]).astype(np.float64)
    return _lines(pose[kept], place, lines.tip[own][kept], lines.angles[own][kept])
