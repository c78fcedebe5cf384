"""What smoothing saves of the time: planned for short programs, estimated from some stretches of long ones."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cornersmooth import nc, smoothing
from cornersmooth.errors import CornersmoothError
from cornersmooth.feedrate import Limits, direct, plan_text
from cornersmooth.feedrate.written import written_motion
from cornersmooth.kinematics import Machine, endless, with_dynamics
from cornersmooth.model import Floats, Ints, Move, Program
from cornersmooth.nc import Form
from cornersmooth.pipeline import read_back
from cornersmooth.report.verdict import Saving
from cornersmooth.settings import Settings
from cornersmooth.slices import some_poses

#: of the digits of a text, mm and radians: a pose of it is the same as one of the CL file
_SAME = 1e-3


def estimate_saving(
    program: Program, settings: Settings, form: Form, limits: Limits, *, poses: int, stretches: int
) -> Saving | None:
    """Plan evenly spaced stretches of a program, each smoothed and written by itself, and infer the whole from them.

    The time of all of the original is taken to be to its time at programmed feed as it is on the stretches. Each begins
    and ends at rest, which makes both times a little too long. Holes are only gone over in both: what a cycle takes is
    in the text, and nowhere in the CL file.

    Parameters
    ----------
    program : Program
    settings : Settings
        Those the program is smoothed with.
    form : Form
    limits : Limits
    poses : int
        Of all stretches together; a program of no more is planned as a whole.
    stretches : int

    Returns
    -------
    Saving or None
        None where nothing can be planned: without any feed, or out of reach of the machine; and where the control
        blends lines by a law that the planner does not have.
    """
    if form.table.lines.lag:
        return None
    machine = with_dynamics(form.machine)
    if machine is not None and form.rewind:
        machine = endless(machine)
    program = without_holes(program)
    feed = feed_times(program, limits)
    before = after = at_feed = 0.0
    planned = 0
    try:
        for first, last in _stretches(len(program), poses, stretches):
            part = _part(program, first, last)
            if np.isin(part.kind[1:], (Move.LINEAR, Move.ARC)).any():
                before += direct(part, limits, "velocity_jump", settings=settings, machine=machine).total
                after += _written_time(part, settings, form, limits, machine)
                at_feed += float(feed[first + 1 : last].sum())
            planned += last - first
    except CornersmoothError:
        return None
    if not at_feed > 0.0:
        return None
    scale = 1.0 if planned == len(program) else float(feed.sum()) / at_feed
    return Saving(scale * before, scale * after, planned / len(program))


def without_holes(program: Program) -> Program:
    """Return the program with rapids to its holes, which nothing drills."""
    holes = program.kind == Move.HOLE
    if not holes.any():
        return program
    kept = tuple(statement for statement in program.statements if statement.word != "CYCLE")
    return replace(program, kind=np.where(holes, np.uint8(Move.RAPID), program.kind), statements=kept)


def feed_times(program: Program, limits: Limits) -> Floats:
    """Time (n,) s of the move into each pose along its chord at programmed feed, or at rapid speed."""
    step = np.zeros(len(program))
    step[1:] = np.linalg.norm(np.diff(program.tip, axis=0), axis=1)
    feed = program.feed if limits.feed is None else np.full(len(program), limits.feed)
    slow = np.isin(program.kind, (Move.LINEAR, Move.ARC)) & (feed > 0.0) & (program.feed_mode == 0)
    found: Floats = 60.0 * step / np.where(slow, feed, limits.rapid)
    return found


def _stretches(count: int, poses: int, stretches: int) -> Iterator[tuple[int, int]]:
    """First pose of each stretch, and the one behind its last."""
    if count <= poses:
        yield 0, count
        return
    size = poses // stretches
    for first in np.linspace(0, count - size, stretches).astype(np.int64).tolist():
        yield first, first + size


def _part(program: Program, first: int, last: int) -> Program:
    """Poses from `first` up to `last`, and what is said between them."""
    part = some_poses(program, first, last, earlier=False)
    if not first:
        return part
    kind = part.kind.copy()
    kind[:1] = Move.RAPID  # whatever led there is no part of it
    return replace(part, kind=kind)


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
