"""Rows of lines and curves in rotary words: FANUC's G6.2 with the rotary axes as further axes of the curve."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics.rotary_curves import CurveGroup, RotaryCurves, angle_allowance, rotary_curves
from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.nc.control import Form
from cornersmooth.nc.notes import Notes
from cornersmooth.smoothing.arcs import arc_lines, arc_points, divided
from cornersmooth.smoothing.layout import Layout, lay_out
from cornersmooth.smoothing.sampling import Rows

#: poses whose rows are handed on at a time
_BLOCK = 16384

#: share of what ε leaves that angles may take on straight motion: the rest is for what lies between places measured
_STRAIGHT_SHARE = 0.95


def rotary_curve_rows(smoothed: SmoothProgram, form: Form, notes: Notes) -> Iterator[Rows]:
    """Rows with the angles of the form's machine in `Rows.other`, in the order of its axes, and `Rows.spline`.

    Raises
    ------
    InputError
        The machine cannot follow the path.
    SettingsError
        The method has no curves in rotary axes.
    """
    program, settings, machine = smoothed.program, smoothed.settings, form.machine
    if machine is None:
        raise SettingsError("CS215", f"{form.control} form {form.name} needs a machine", "name it with --machine")
    step, resolution = form.rounding(program.units), 10.0**-form.table.digits.angle
    left = (settings.tolerance - math.sqrt(3.0) / 2.0 * step) / settings.axis_length
    found = rotary_curves(
        smoothed,
        machine,
        tolerance=_STRAIGHT_SHARE * math.degrees(left) - resolution,
        allowance=angle_allowance(smoothed, resolution),
        file=program.source.name,
    )
    for finding in found.findings:
        notes.add(finding.code, finding.severity, finding.line, finding.text, finding.count)
    jumps = np.union1d(found.inserted.unsolved, smoothed.corners.pose[found.lines.unsolved])
    if len(jumps):
        text = "the tool axis jumps further than rotary axes can follow within the tolerance; see what it does there"
        notes.add("CS369", "warning", int(program.line[jumps[0]]), text, len(jumps))
    if len(found.inserted):
        text = f"point inserted so that {' and '.join(machine.names)} keep the tool within the tolerance"
        notes.add("CS367", "note", int(program.line[found.inserted.segment.min()]), text, len(found.inserted))
    if any(len(group) for group in found.groups):
        text = "G6.2 with rotary axes under tool tip control is the machine builder's to allow; ask before running it"
        notes.add("CS370", "warning", 0, text)
    yield from _Table(smoothed, found).blocks()


class _Table:
    """All rows, put together pose by pose: inserted points, the end of the straight motion, the curve."""

    def __init__(self, smoothed: SmoothProgram, found: RotaryCurves) -> None:
        program, corners = smoothed.program, smoothed.corners
        self.smoothed, self.found = smoothed, found
        self.layout: Layout = lay_out(smoothed, dense=False)
        n = len(program)
        self.inserted = np.bincount(found.inserted.segment, minlength=n)[:n]
        straight = np.where(self.layout.line & ~self.layout.skip, 1, 0)
        pieces = arc_lines(program, smoothed.settings) if len(program.arcs) else np.zeros(0, np.int64)
        straight[program.arcs.pose] = pieces
        curve = np.zeros(n, np.int64)
        curve[corners.pose] = found.points + np.maximum(np.bincount(found.lines.row, minlength=len(corners)) - 1, 0)
        counts = self.inserted + straight + curve
        self.first = np.concatenate(([0], np.cumsum(counts)))
        self.after = self.first[:-1] + self.inserted + straight  # where the curve of each pose begins
        total = int(self.first[-1])
        self.tip, self.angles = np.zeros((total, 3)), np.zeros((total, 2))
        self.move = np.repeat(np.arange(n), counts)
        self.curve, self.joined = np.zeros(total, np.int8), np.zeros(total, np.bool_)
        self.spline = np.zeros((total, 3))
        self._straight(straight > 0)
        self._arcs(pieces)
        for group in found.groups:
            self._curves(group)
        self._lines()

    def blocks(self) -> Iterator[Rows]:
        """Rows of some poses at a time."""
        n = len(self.smoothed.program)
        for begin in range(0, n, _BLOCK):
            rows = slice(self.first[begin], self.first[min(begin + _BLOCK, n)])
            yield Rows(
                self.tip[rows],
                self.angles[rows],
                self.move[rows],
                self.curve[rows],
                self.joined[rows],
                spline=self.spline[rows],
            )

    def _straight(self, there: Bools) -> None:
        """Inserted points and ends of straight motion; those before curves get their joint with the curve."""
        program, more = self.smoothed.program, self.found.inserted
        order = np.lexsort((more.fraction, more.segment))
        segment, fraction = more.segment[order], more.fraction[order]
        first = np.concatenate(([0], np.cumsum(self.inserted)))
        at = self.first[segment] + np.arange(len(segment)) - first[segment]
        start = program.tip[self.layout.start[segment]]
        self.tip[at] = start + fraction[:, None] * (program.tip[segment] - start)
        self.angles[at] = more.angles[order]
        pose = np.flatnonzero(there & (self.layout.row < 0))
        self.tip[self.after[pose] - 1] = program.tip[pose]
        self.angles[self.after[pose] - 1] = self.found.pose_angles[pose]

    def _arcs(self, pieces: Ints) -> None:
        program = self.smoothed.program
        if not len(pieces):
            return
        rows, share = divided(pieces)
        pose = program.arcs.pose[rows]
        at = np.flatnonzero(np.isin(self.move, program.arcs.pose))
        self.tip[at], _ = arc_points(program, rows, share)
        end = self.found.pose_angles[pose]
        start = self.found.pose_angles[pose - 1]
        start = np.where(np.isnan(start), end, start)  # from a stated position
        self.angles[at] = start + share[:, None] * (end - start)

    def _curves(self, group: CurveGroup) -> None:
        pose = self.smoothed.corners.pose[group.row]
        count = group.tip.shape[1]
        at = self.after[pose][:, None] + np.arange(count)
        self.tip[at], self.angles[at] = group.tip, group.angles
        self.curve[at] = np.arange(1, count + 1)
        self.spline[at, 0] = group.knots[:count]
        self.spline[at, 1] = group.weights
        self.spline[at[:, -1], 2] = group.knots[-1]
        self._join(pose, group.tip[:, 0], group.angles[:, 0])
        self.joined[at[:, 0]] = ~self.layout.line[pose]

    def _lines(self) -> None:
        lines = self.found.lines
        begins = np.diff(lines.row, prepend=-1) != 0
        first = np.flatnonzero(begins)
        pose = self.smoothed.corners.pose[lines.row[first]]
        self._join(pose, lines.tip[first], lines.angles[first])
        rest = np.flatnonzero(~begins)
        own = np.cumsum(begins)[rest] - 1
        at = self.after[pose][own] + rest - first[own] - 1
        self.tip[at], self.angles[at] = lines.tip[rest], lines.angles[rest]

    def _join(self, pose: Ints, tip: Floats, angles: Floats) -> None:
        """Let the straight motion before a curve end exactly where the curve begins."""
        line = self.layout.line[pose]
        at = self.after[pose[line]] - 1
        self.tip[at], self.angles[at] = tip[line], angles[line]
