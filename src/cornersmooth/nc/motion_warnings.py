"""What is said of the motion while it is written: first motions, spindles that stand, words that may be refused."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints, Move, Program
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.first_block import UPRIGHT
from cornersmooth.nc.form import Form
from cornersmooth.nc.run import Run
from cornersmooth.vectors import dot

#: cosine of the angle from hole to hole beyond which the tool turns between them
_TURNED: Final = float(np.cos(np.radians(1.0)))


@dataclass
class MotionWarnings:
    """Says each of them once, or once for each tool.

    Parameters
    ----------
    program : Program
    findings : Findings
    """

    program: Program
    findings: Findings
    _said_tool: bool = False
    _said_zero: bool = False
    _said_spindle: bool = False
    _said_turns: bool = False
    _tilted: bool = False
    _looked_until: int = 0

    def another_tool(self) -> None:
        """Begin anew with what is said for each tool."""
        self._said_spindle = False

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

        Parameters
        ----------
        poses : (h,) int64
        before : int
            Pose that the tool comes from; -1 for none.
        travel, clearance : (h,) float64, mm
            Heights over the holes to which the tool comes, and from which it feeds.
        """
        axis = self.program.axis[poses]
        come = self.program.axis[np.concatenate(([max(before, 0)], poses[:-1]))]
        turned = dot(axis, come) < _TURNED
        turned[0] &= before >= 0
        low = travel <= clearance
        rows = np.flatnonzero(turned & (low | np.concatenate(([False], low[:-1]))))
        if len(rows):
            text = "the tool turns on its way to a hole to where feeding begins; see that it is free to, or give RTRCTO"
            self.findings.add("CS384", "warning", int(self.program.line[poses[rows[0]]]), text, len(rows))

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
        if tool is None and not self._said_tool:
            self._said_tool = True
            text = (
                "the CL file loads no tool before it moves: the tool in the spindle is taken, with length register 1; "
                "see that it is the right one, or load it with LOADTL"
            )
            self.findings.add("CS334", "warning", int(self.program.line[pose]), text)
        if tool == 0 and not self._said_zero:
            self._said_zero = True
            text = "tool 0 moves: controls take T0 for an empty spindle, and H0 for no length; give it a number"
            self.findings.add("CS382", "warning", int(self.program.line[pose]), text)

    def of_cut(self, pose: int, *, turning: bool) -> None:
        """Say that a tool cuts while the spindle stands."""
        if not turning and not self._said_spindle:
            self._said_spindle = True
            text = "the spindle is not started before the first cut of a tool; put SPINDL before it"
            self.findings.add("CS335", "warning", int(self.program.line[pose]), text)

    def of_turns(self, run: Run, form: Form, angles: Floats) -> None:
        """Say that an endless axis gets words that some machines of the control refuse; `angles` are those of `run`."""
        if self._said_turns or form.mode.motion.endless_words or form.machine is None:
            return
        axes = form.machine.axes[: len(form.machine.names)]
        endless = np.array([axis.limits is None and not axis.modulo for axis in axes])
        angles = angles[:, : len(axes)]
        rows = np.flatnonzero(((angles[:, endless] < 0.0) | (angles[:, endless] >= 360.0)).any(axis=1))
        if len(rows):
            self._said_turns = True
            names = " and ".join(form.machine.names[axis] for axis in np.flatnonzero(endless).tolist())
            text = (
                f"words of {names} beyond 0 to 360 deg: a modulo axis takes them only where the builder allows it "
                "(MD30455 bit 0, else alarm 16830); where not, write modulo = true for the axis in a machine file"
            )
            self.findings.add("CS346", "warning", int(self.program.line[run.move[rows[0]]]), text)
