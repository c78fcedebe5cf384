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
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.smoothing.segments import Segments, segments_of

#: poses whose rows are handed on at a time
_CHUNK = 16384

#: share of what ε leaves that angles may take on straight motion: the rest is for what lies between places measured
_STRAIGHT_SHARE = 0.95


def rotary_curve_rows(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows with the angles of the form's machine in `Rows.other`, in the order of its axes, and `Rows.spline`.

    Raises
    ------
    InputError
        The machine cannot follow the path.
    SettingsError
        The method has no curves in rotary axes.
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
        file=program.source.name,
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
    for chunk in _Table(smoothed, found).chunks():
        chunk.other[:] += shift[chunk.move]
        travel.check(chunk.tip, chunk.other, chunk.move)
        yield chunk


def warn_of_curves(form: Form, findings: Findings) -> None:
    """Say that curves in rotary words are not every machine's."""
    curve = form.curve.upper()
    text = f"{curve} with rotary axes under tool tip control is the machine builder's to allow; ask before running it"
    findings.add("CS370", "warning", 0, text)


class _Table:
    """Where all rows stand, pose by pose: inserted points, the end of the straight motion, the curve."""

    def __init__(self, smoothed: SmoothProgram, found: RotaryCurves) -> None:
        program, corners = smoothed.program, smoothed.corners
        self.smoothed, self.found = smoothed, found
        self.segments: Segments = segments_of(smoothed, dense=False)
        n = len(program)
        more = found.inserted
        self.order = np.lexsort((more.fraction, more.segment))
        self.inserted = np.bincount(more.segment, minlength=n)[:n]
        self.straight = np.where(self.segments.has_line & ~self.segments.skip, 1, 0)
        self.arc_lines = arc_lines(program, smoothed.settings) if len(program.arcs) else np.zeros(0, np.int64)
        self.straight[program.arcs.pose] = self.arc_lines
        curve = np.zeros(n, np.int64)
        curve[corners.pose] = found.points + np.maximum(np.bincount(found.lines.row, minlength=len(corners)) - 1, 0)
        self.counts = self.inserted + self.straight + curve

    def chunks(self) -> Iterator[Rows]:
        """Rows of some poses at a time."""
        for begin in range(0, len(self.counts), _CHUNK):
            yield _Chunk(self, begin, min(begin + _CHUNK, len(self.counts))).rows


class _Chunk:
    """Rows of the poses from `begin` to before `end`."""

    def __init__(self, table: _Table, begin: int, end: int) -> None:
        self.table, self.begin, self.end = table, begin, end
        poses = slice(begin, end)
        counts = table.counts[poses]
        self.first = np.cumsum(counts) - counts  # of each pose
        self.after = self.first + table.inserted[poses] + table.straight[poses]  # where the curve of each pose begins
        total = int(counts.sum())
        self.rows = Rows(
            tip=np.zeros((total, 3)),
            other=np.zeros((total, 2)),
            move=np.repeat(np.arange(begin, end), counts),
            curve=np.zeros(total, np.int8),
            joined=np.zeros(total, np.bool_),
            spline=np.zeros((total, 3)),
        )
        self._inserted()
        self._straight()
        self._arcs()
        for group in table.found.groups:
            self._curves(group)
        self._lines()

    def _put(self, at: Ints, tip: Floats, angles: Floats) -> None:
        self.rows.tip[at], self.rows.other[at] = tip, angles

    def _within(self, poses: Ints) -> slice:
        """Entries of a list of poses, ascending, that are in this chunk."""
        low, high = np.searchsorted(poses, (self.begin, self.end)).tolist()
        return slice(low, high)

    def _inserted(self) -> None:
        """Points inserted into straight motion."""
        more, program = self.table.found.inserted, self.table.smoothed.program
        own = self.table.order[self._within(more.segment[self.table.order])]
        segment, fraction = more.segment[own], more.fraction[own]
        number = np.arange(len(own)) - np.searchsorted(segment, segment)
        start = program.tip[self.table.segments.start[segment]]
        tip = start + fraction[:, None] * (program.tip[segment] - start)
        self._put(self.first[segment - self.begin] + number, tip, more.angles[own])

    def _straight(self) -> None:
        """Ends of straight motion that are no joints."""
        poses = slice(self.begin, self.end)
        pose = self.begin + np.flatnonzero((self.table.straight[poses] > 0) & (self.table.segments.row[poses] < 0))
        at = self.after[pose - self.begin] - 1
        self._put(at, self.table.smoothed.program.tip[pose], self.table.found.pose_angles[pose])

    def _arcs(self) -> None:
        program, poses = self.table.smoothed.program, self.table.found.pose_angles
        chosen = self._within(program.arcs.pose)
        lines = self.table.arc_lines[chosen]
        if not len(lines):
            return
        rows, share = divided(lines)
        rows += chosen.start
        pose = program.arcs.pose[rows]
        at = np.flatnonzero(np.isin(self.rows.move, program.arcs.pose[chosen]))
        tip, _ = arc_points(program, rows, share)
        start = np.where(np.isnan(poses[pose - 1]), poses[pose], poses[pose - 1])  # from a stated position
        self._put(at, tip, start + share[:, None] * (poses[pose] - start))

    def _curves(self, group: CurveGroup) -> None:
        poses = self.table.smoothed.corners.pose[group.row]
        own = self._within(poses)
        pose, tip, angles = poses[own], group.tips(own), group.angles[own]
        count = group.points
        at = self.after[pose - self.begin][:, None] + np.arange(count)
        self._put(at, tip, angles)
        self.rows.curve[at] = np.arange(1, count + 1)
        spline = self.rows.spline
        assert spline is not None
        spline[at, 0] = group.knots[:count]
        spline[at, 1] = group.weights[own]
        spline[at[:, -1], 2] = group.knots[-1]
        self._join(pose, tip[:, 0], angles[:, 0])
        self.rows.joined[at[:, 0]] = ~self.table.segments.has_line[pose]

    def _lines(self) -> None:
        lines = self.table.found.lines
        own = self._within(self.table.smoothed.corners.pose[lines.row])
        row, tip, angles = lines.row[own], lines.tip[own], lines.angles[own]
        begins = np.diff(row, prepend=-1) != 0
        first = np.flatnonzero(begins)
        pose = self.table.smoothed.corners.pose[row[first]]
        self._join(pose, tip[first], angles[first])
        rest = np.flatnonzero(~begins)
        number = np.cumsum(begins)[rest] - 1
        at = self.after[pose[number] - self.begin] + rest - first[number] - 1
        self._put(at, tip[rest], angles[rest])

    def _join(self, pose: Ints, tip: Floats, angles: Floats) -> None:
        """Let the straight motion before a curve end exactly where the curve begins."""
        line = self.table.segments.has_line[pose]
        self._put(self.after[pose[line] - self.begin] - 1, tip[line], angles[line])
