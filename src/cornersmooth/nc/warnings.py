"""Warnings of a program: before it is written, of arcs, feeds and functions; while it is, of what moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cornersmooth.arrays.vectors import dot
from cornersmooth.methods import CURVES_METHOD, DEFAULT_METHOD
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program, SmoothProgram
from cornersmooth.nc.circles import Circles
from cornersmooth.nc.coordinates import BlockRows
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.rotary_words import UPRIGHT
from cornersmooth.rotary import rapid_moves
from cornersmooth.settings import FLIP_ANGLE

#: cosine of the angle from hole to hole beyond which the tool turns between them
_TURNED: Final = float(np.cos(np.radians(1.0)))


def add_warnings(form: Form, smoothed: SmoothProgram, circles: Circles, upright: Bools, findings: Findings) -> None:
    """Note what a user of the form should know of the program; `upright` (n,) are tools without words of the axis."""
    program, style = smoothed.program, form.table.lines
    lines = program.line[program.arcs.pose]
    findings.note_each("CS313", lines[(circles.blocks > 0) & ~circles.curved])
    findings.note_each("CS313b", lines[circles.curved])
    findings.note_each("CS314", lines[circles.blocks == 0])
    rapid = rapid_moves(program.kind)
    if not form.rotary:  # rotary words say which way to turn; feed moves that turn so far are refused before
        poses, _ = program.axis_steps(rapid, FLIP_ANGLE)
        findings.note_each("CS326", program.line[poses], angle=FLIP_ANGLE)
    largest = form.mode.motion.largest_feed
    beyond = ~rapid & (program.feed_mode == FeedMode.PER_MINUTE) & (program.feed > (largest or np.inf))
    findings.note_each("CS388", program.line[beyond], largest=largest)
    if form.orientation == "machine":
        findings.note_each("CS323", program.line[~rapid & (program.feed_mode == FeedMode.PER_REVOLUTION)])
    if "{kinematics_on}" in form.mode.within_on and form.machine is not None and form.machine.tip_control is None:
        findings.note("CS393", 0)
    if style.lag and smoothed.settings.lines == "long" and smoothed.settings.method == CURVES_METHOD:
        findings.note("CS394", 0, control=form.control, method=CURVES_METHOD, default=DEFAULT_METHOD)
    if form.curve == "g6.2" and form.orientation == "point" and not (upright | (program.kind == Move.FROM)).all():
        findings.note("CS395", 0)
    rounded = bool(smoothed.corners.smoothed.any()) or smoothed.runs is not None
    if rounded and not form.curves and smoothed.settings.lines == "dense" and not form.extras:
        for name, extra in form.table.extras.items():
            if not extra.forms or form.name in extra.forms:
                findings.note("CS396", 0, name=name)
                break
    for extra in form.extras:
        if extra.warning:
            findings.note("CS339", 0, name=extra.name, warning=extra.warning)


@dataclass
class MotionWarnings:
    """Says each of them once, or once for each tool."""

    program: Program
    findings: Findings
    _noted: set[str] = field(default_factory=set)  #: codes of what is noted once
    _tilted: bool = False
    _looked_until: int = 0

    def another_tool(self) -> None:
        """Begin anew with what is noted for each tool."""
        self._noted.discard("CS335b")

    def _once(self, code: str, pose: int, **values: object) -> None:
        if code not in self._noted:
            self._noted.add(code)
            self.findings.note(code, int(self.program.line[pose]), 1, **values)

    def of_first(self, pose: int, form: Form, *, rapid: bool) -> None:
        """Say that the control turns the tool on its own before its first position, or feeds to it."""
        line = int(self.program.line[pose])
        if form.orientation in ("vector", "point") and self.program.axis[pose][2] < UPRIGHT:
            self.findings.note("CS337", line)
        if not rapid:
            where = "down from the height of the retract" if form.table.program.retract else "from where the machine is"
            self.findings.note("CS333", line, where=where)

    def of_holes(self, poses: Ints, before: int, travel: Floats, clearance: Floats) -> None:
        """Say that the tool turns on its way to holes right above them: what lies there, the CL file does not say.

        It comes from a pose, -1 for none. Heights (h,) over the holes, mm: to which it comes, and from which it feeds.
        """
        axis = self.program.axis[poses]
        come = self.program.axis[np.concatenate(([max(before, 0)], poses[:-1]))]
        turned = dot(axis, come) < _TURNED
        turned[0] &= before >= 0
        low = travel <= clearance
        turned &= low | np.concatenate(([False], low[:-1]))
        self.findings.note_each("CS384", self.program.line[poses[turned]])

    def of_tip_control(self, pose: int, form: Form) -> None:
        """Say that a tilted tool has left the rotary axes anywhere, and no words bring them back.

        An upright tool may stand at any angle of the table, too, once a tool has been tilted.
        """
        if form.rotary or "{rotary_zero}" not in form.table.program.begin:
            return
        since = slice(self._looked_until, pose)
        moved = self.program.kind[since] != Move.FROM
        self._tilted |= bool((moved & (self.program.axis[since, 2] < UPRIGHT)).any())
        self._looked_until = pose
        if self._tilted:
            self.findings.note("CS358", int(self.program.line[pose]))

    def of_tool(self, pose: int, tool: int | None) -> None:
        """Say that a tool moves that was not loaded, or that is none."""
        if not tool:
            self._once("CS334" if tool is None else "CS382", pose)

    def of_cut(self, pose: int, *, turning: bool) -> None:
        """Say that a tool cuts while the spindle stands."""
        if not turning:
            self._once("CS335b", pose)

    def of_turns(self, rows: BlockRows, form: Form, angles_of: Callable[[Ints], Floats]) -> None:
        """Say that an endless axis gets words that some machines of the control refuse; angles are those of ticks."""
        if "CS346" in self._noted or form.mode.motion.endless_words or form.machine is None:
            return
        axes = form.machine.axes[: len(form.machine.names)]
        endless = np.array([axis.limits is None and not axis.modulo for axis in axes])
        angles = angles_of(rows.ticks)[:, : len(axes)]
        beyond = np.flatnonzero(((angles[:, endless] < 0.0) | (angles[:, endless] >= 360.0)).any(axis=1))
        if len(beyond):
            names = " and ".join(form.machine.names[axis] for axis in np.flatnonzero(endless).tolist())
            self._once("CS346", int(rows.move[beyond[0]]), names=names)
