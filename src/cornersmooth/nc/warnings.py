"""What is said of a text before it is written: what the control does with arcs, feeds and functions."""

from __future__ import annotations

import numpy as np

from cornersmooth.methods import CURVES_METHOD, DEFAULT_METHOD
from cornersmooth.model import FeedMode, Program, SmoothProgram
from cornersmooth.nc.circles import Circles
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.rotary import rapid_moves
from cornersmooth.settings import FLIP_ANGLE
from cornersmooth.smoothing.axis_steps import axis_steps


def add_warnings(form: Form, smoothed: SmoothProgram, circles: Circles, findings: Findings) -> None:
    """Note what a user of the form should know of the program."""
    _arcs(circles, smoothed.program, findings)
    if not form.rotary:  # rotary words say which way to turn
        _flips(smoothed.program, findings)
    _large_feeds(form, smoothed.program, findings)
    if form.orientation == "machine":
        _feeds(smoothed.program, findings)
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
    for extra in form.extras:
        if extra.warning:
            findings.add("CS339", "warning", 0, f"{extra.name} was asked for: {extra.warning}")


def _arcs(circles: Circles, program: Program, findings: Findings) -> None:
    for chosen, code, text in (
        (circles.blocks > 0, "CS313", "arc written as circular blocks"),
        (circles.blocks == 0, "CS314", "arc written as lines"),
    ):
        rows = np.flatnonzero(chosen)
        if len(rows):
            findings.add(code, "note", int(program.line[program.arcs.pose[rows[0]]]), text, len(rows))


def _flips(program: Program, findings: Findings) -> None:
    """Rapids whose axis turns by nearly half a turn; feed moves that do so are refused before."""
    poses, _ = axis_steps(program, rapid_moves(program.kind), FLIP_ANGLE)
    if len(poses):
        text = (
            f"the tool axis turns by more than {FLIP_ANGLE:g} deg in a rapid, and which way a control turns is not "
            "defined; keep clear of the part there, or insert a pose in between"
        )
        findings.add("CS326", "warning", int(program.line[poses[0]]), text, len(poses))


def _large_feeds(form: Form, program: Program, findings: Findings) -> None:
    """Feeds per minute beyond what the control takes."""
    largest = form.mode.motion.largest_feed
    cuts = ~rapid_moves(program.kind) & (program.feed_mode == FeedMode.PER_MINUTE)
    rows = np.flatnonzero(cuts & (program.feed > largest))
    if largest and len(rows):
        text = f"feed beyond the F{largest:.10g} mm/min that the control takes: give a lower one"
        findings.add("CS388", "warning", int(program.line[rows[0]]), text, len(rows))


def _feeds(program: Program, findings: Findings) -> None:
    cuts = ~rapid_moves(program.kind) & (program.feed_mode == FeedMode.PER_REVOLUTION)
    rows = np.flatnonzero(cuts)
    if len(rows):
        text = "feed per revolution without tool tip control counts along the machine's axes; give feeds per minute"
        findings.add("CS323", "warning", int(program.line[rows[0]]), text, len(rows))
