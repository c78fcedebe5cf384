"""Warnings of a program: before it is written, of arcs, feeds and functions; while it is, of what moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cornersmooth.errors import Severity
from cornersmooth.methods import CURVES_METHOD, DEFAULT_METHOD
from cornersmooth.model import FeedMode, Floats, Ints, Move, Program, SmoothProgram
from cornersmooth.nc.circles import Circles
from cornersmooth.nc.curve_blocks import Run
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.first_block import UPRIGHT
from cornersmooth.nc.form import Form
from cornersmooth.rotary import rapid_moves
from cornersmooth.settings import FLIP_ANGLE
from cornersmooth.vectors import dot

#: cosine of the angle from hole to hole beyond which the tool turns between them
_TURNED: Final = float(np.cos(np.radians(1.0)))


def add_warnings(form: Form, smoothed: SmoothProgram, circles: Circles, findings: Findings) -> None:
    """Note what a user of the form should know of the program."""
    _arcs(circles, smoothed.program, findings)
    if not form.rotary:  # rotary words say which way to turn
        _flips(smoothed.program, findings)
    _feeds(form, smoothed.program, findings)
    if "{kinematics_on}" in form.mode.within_on and form.machine is not None and form.machine.tip_control is None:
        text = (
            "the machine file names no blocks that switch tip control on and off: the kinematics must keep the tip "
            'from the start; write tip_control = ["M428", "M429"], or [] if they do'
        )
        findings.add("CS393", "warning", 0, text)
    if form.table.lines.lag and smoothed.settings.lines == "long" and smoothed.settings.method == CURVES_METHOD:
        text = (
            f"{form.control} rounds the corners of lines by itself; lines of the method {CURVES_METHOD} took it 10 to "
            f"50 % longer, and once it left the tolerance there; use --method {DEFAULT_METHOD}"
        )
        findings.add("CS394", "warning", 0, text)
    if form.curve == "g6.2" and form.orientation == "point":
        text = (
            "axis points U V W in G6.2 need the option of dual NURBS interpolation (a second curve for the tool axis); "
            "see that the control has it, else it stops with an alarm, or use -f g1"
        )
        findings.add("CS395", "warning", 0, text)
    for extra in form.extras:
        if extra.warning:
            findings.add("CS339", "warning", 0, f"{extra.name} was asked for: {extra.warning}")


def _arcs(circles: Circles, program: Program, findings: Findings) -> None:
    for chosen, code, text in (
        (circles.blocks > 0, "CS313", "arc written as circular blocks"),
        (circles.blocks == 0, "CS314", "arc written as lines"),
    ):
        findings.add_each(code, "note", program.line[program.arcs.pose[chosen]], text)


def _flips(program: Program, findings: Findings) -> None:
    """Rapids whose axis turns by nearly half a turn; feed moves that do so are refused before."""
    poses, _ = program.axis_steps(rapid_moves(program.kind), FLIP_ANGLE)
    text = (
        f"the tool axis turns by more than {FLIP_ANGLE:g} deg in a rapid, and which way a control turns is not "
        "defined; keep clear of the part there, or insert a pose in between"
    )
    findings.add_each("CS326", "warning", program.line[poses], text)


def _feeds(form: Form, program: Program, findings: Findings) -> None:
    """Feeds per minute beyond what the control takes, and feeds per revolution of axes of the machine."""
    largest, cuts = form.mode.motion.largest_feed, ~rapid_moves(program.kind)
    beyond = cuts & (program.feed_mode == FeedMode.PER_MINUTE) & (program.feed > (largest or np.inf))
    text = f"feed beyond the F{largest:.10g} mm/min that the control takes; give a lower one"
    findings.add_each("CS388", "warning", program.line[beyond], text)
    if form.orientation == "machine":
        turned = cuts & (program.feed_mode == FeedMode.PER_REVOLUTION)
        text = "feed per revolution without tool tip control counts along the machine's axes; give feeds per minute"
        findings.add_each("CS323", "warning", program.line[turned], text)


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
        self._noted.discard("CS335")

    def _once(self, code: str, severity: Severity, pose: int, text: str) -> None:
        if code not in self._noted:
            self._noted.add(code)
            self.findings.add(code, severity, int(self.program.line[pose]), text)

    def of_first(self, pose: int, form: Form, *, rapid: bool) -> None:
        """Say that the control turns the tool on its own before its first position, or feeds to it."""
        line = int(self.program.line[pose])
        if form.orientation in ("vector", "point") and self.program.axis[pose][2] < UPRIGHT:
            text = "the first motion of a tool turns it to a tilted axis; see that it is free to, or name the machine"
            self.findings.add("CS337", "warning", line, text)
        if not rapid:
            where = "down from the height of the retract" if form.table.program.retract else "from where the machine is"
            text = f"the first motion of a tool is a feed move: it feeds {where}; put a RAPID before it"
            self.findings.add("CS333", "warning", line, text)

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
        text = "the tool turns on its way to a hole to where feeding begins; see that it is free to, or give RTRCTO"
        self.findings.add_each("CS384", "warning", self.program.line[poses[turned]], text)

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
            text = (
                "tool tip control after a tilted tool: the rotary axes are where it has left them. The part "
                "program may turn with them (WKP); name the machine, so that they go to zero before"
            )
            self.findings.add("CS358", "warning", int(self.program.line[pose]), text)

    def of_tool(self, pose: int, tool: int | None) -> None:
        """Say that a tool moves that was not loaded, or that is none."""
        if tool is None:
            text = (
                "the CL file loads no tool before it moves: the tool in the spindle is taken, with length register 1; "
                "see that it is the right one, or load it with LOADTL"
            )
            self._once("CS334", "warning", pose, text)
        if tool == 0:
            text = "tool 0 moves: controls take T0 for an empty spindle, and H0 for no length; give it a number"
            self._once("CS382", "warning", pose, text)

    def of_cut(self, pose: int, *, turning: bool) -> None:
        """Say that a tool cuts while the spindle stands."""
        if not turning:
            text = "the spindle is not started before the first cut of a tool; put SPINDL before it"
            self._once("CS335", "warning", pose, text)

    def of_turns(self, run: Run, form: Form, angles_of: Callable[[Ints], Floats]) -> None:
        """Say that an endless axis gets words that some machines of the control refuse; angles are those of ticks."""
        if "CS346" in self._noted or form.mode.motion.endless_words or form.machine is None:
            return
        axes = form.machine.axes[: len(form.machine.names)]
        endless = np.array([axis.limits is None and not axis.modulo for axis in axes])
        angles = angles_of(run.ticks)[:, : len(axes)]
        rows = np.flatnonzero(((angles[:, endless] < 0.0) | (angles[:, endless] >= 360.0)).any(axis=1))
        if len(rows):
            names = " and ".join(form.machine.names[axis] for axis in np.flatnonzero(endless).tolist())
            text = (
                f"words of {names} beyond 0 to 360 deg: a modulo axis takes them only where the builder allows it "
                "(MD30455 bit 0, else alarm 16830); where not, write modulo = true for the axis in a machine file"
            )
            self._once("CS346", "warning", int(run.move[rows[0]]), text)
