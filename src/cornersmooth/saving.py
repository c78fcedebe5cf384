"""What smoothing saves of the time: both programs planned as they are written."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np

from cornersmooth import nc, smoothing
from cornersmooth.errors import CornersmoothError
from cornersmooth.feedrate import Limits, direct, plan_text
from cornersmooth.feedrate.written import written_motion
from cornersmooth.kinematics import Machine, endless, with_dynamics
from cornersmooth.model import Ints, Move, Program
from cornersmooth.nc import Form
from cornersmooth.pipeline import read_back
from cornersmooth.report.verdict import Saving
from cornersmooth.settings import Settings

#: of the digits of a text, mm and radians: a pose of it is the same as one of the CL file
_SAME = 1e-3


def planned_saving(program: Program, settings: Settings, form: Form, limits: Limits) -> Saving | None:
    """Plan a program as it was and as it is written, under the limits of the axes of its machine.

    Holes are only gone over in both: what a cycle takes is in the text, and nowhere in the CL file.

    Parameters
    ----------
    program : Program
    settings : Settings
        Those the program is smoothed with.
    form : Form
    limits : Limits

    Returns
    -------
    Saving or None
        None where a time would be of something that nobody runs: without limits of the axes, without any feed, out of
        reach of the machine, and on LinuxCNC, whose planner has a law of its own (`feedrate.linuxcnc`).
    """
    machine = timed_machine(form)
    if machine is None:
        return None
    program = without_holes(program)
    if not np.isin(program.kind[1:], (Move.LINEAR, Move.ARC)).any():
        return None
    try:
        before = direct(program, limits, "velocity_jump", settings=settings, machine=machine).total
        return Saving(before, _written_time(program, settings, form, limits, machine))
    except CornersmoothError:
        return None


def timed_machine(form: Form) -> Machine | None:
    """Give the machine whose limits a time of a program would be under; None where a time would say nothing."""
    machine = with_dynamics(form.machine)
    if machine is None or form.table.lines.lag:  # a control that blends lines by itself plans them by itself
        return None
    return endless(machine) if form.rewind else machine


def without_holes(program: Program) -> Program:
    """Return the program with rapids to its holes, which nothing drills."""
    holes = program.kind == Move.HOLE
    if not holes.any():
        return program
    kept = tuple(statement for statement in program.statements if statement.word != "CYCLE")
    return replace(program, kind=np.where(holes, np.uint8(Move.RAPID), program.kind), statements=kept)


def _written_time(program: Program, settings: Settings, form: Form, limits: Limits, machine: Machine | None) -> float:
    """Time of the text from the first to the last pose it goes to: without its way there and back."""
    stream = io.BytesIO()
    nc.write(smoothing.smooth(program, settings), stream, form=form)
    text = read_back(stream.getvalue(), form, settings)
    law = plan_text(text, limits, settings=settings, machine=machine)
    moves = written_motion(text, program.source.name, settings.axis_length).program
    gone_to = np.flatnonzero(program.kind != Move.FROM)[[0, -1]]  # no text goes to a FROM
    begin, end = (_poses_at(moves, program, pose) for pose in gone_to.tolist())
    if not len(begin) or not len(end) or begin[0] >= end[-1]:  # approached in another way than from the pose
        return law.total
    from_second, to_second = law.times_at(law.edge[np.searchsorted(law.path.move, [begin[0], end[-1]], side="right")])
    return float(to_second - from_second)


def _poses_at(text: Program, program: Program, pose: int) -> Ints:
    """Poses of a text that are a pose of the program."""
    near = np.abs(text.tip - program.tip[pose]).max(axis=1) < _SAME
    return np.flatnonzero(near & (np.abs(text.axis - program.axis[pose]).max(axis=1) < _SAME))
