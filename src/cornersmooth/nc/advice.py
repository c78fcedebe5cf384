"""What is said of a text before it is written: what the control does with arcs, feeds and single splines."""

from __future__ import annotations

import numpy as np

from cornersmooth.kinematics import rapid_moves
from cornersmooth.model import FeedMode, Program, SmoothProgram
from cornersmooth.nc.circles import Circles
from cornersmooth.nc.control import Form
from cornersmooth.nc.notes import Notes


def advise(form: Form, smoothed: SmoothProgram, circles: Circles, notes: Notes) -> None:
    """Note what a user of the form should know of the program."""
    _arcs(circles, smoothed.program, notes)
    if form.orientation == "machine":
        _feeds(smoothed.program, notes)
    if form.curve == "bspline":
        _single_splines(smoothed, notes)


def _arcs(circles: Circles, program: Program, notes: Notes) -> None:
    for chosen, code, text in (
        (circles.pieces > 0, "CS313", "arc written as G2 or G3"),
        (circles.pieces == 0, "CS314", "arc written as lines"),
    ):
        rows = np.flatnonzero(chosen)
        if len(rows):
            notes.add(code, "note", int(program.line[program.arcs.pose[rows[0]]]), text, len(rows))


def _feeds(program: Program, notes: Notes) -> None:
    cuts = ~rapid_moves(program.kind) & (program.feed_mode == FeedMode.PER_REVOLUTION)
    rows = np.flatnonzero(cuts)
    if len(rows):
        text = "feed per revolution without tool tip control counts along the machine's axes; give feeds per minute"
        notes.add("CS323", "warning", int(program.line[rows[0]]), text, len(rows))


def _single_splines(smoothed: SmoothProgram, notes: Notes) -> None:
    """Corners without a rounded one beside them: their four blocks are less than the six among ten that are wanted."""
    corners, program = smoothed.corners, smoothed.program
    rounded = np.zeros(len(program), np.bool_)
    rounded[corners.pose[corners.smoothed]] = True
    single = corners.smoothed & ~rounded[corners.before] & ~rounded[corners.after]
    rows = np.flatnonzero(single)
    if len(rows):
        text = "BSPLINE of a single corner: SINUMERIK wants six spline blocks among ten; -f poly has no such rule"
        notes.add("CS325", "warning", int(program.line[corners.pose[rows[0]]]), text, len(rows))
