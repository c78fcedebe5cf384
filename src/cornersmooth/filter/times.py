"""The time that runs take, before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cornersmooth.arrays.vectors import norm
from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import Limits
from cornersmooth.feedrate.even_ramps import ramp_times
from cornersmooth.feedrate.linuxcnc import axis_limits, line_times, program_lines
from cornersmooth.feedrate.written import text_path
from cornersmooth.filter.checking import Place, pair, shared
from cornersmooth.filter.motion import Job
from cornersmooth.filter.runs import NONE, Reading, Run
from cornersmooth.kinematics import Machine
from cornersmooth.model import Floats
from cornersmooth.nc_reader import NcProgram
from cornersmooth.times.saving import LINUXCNC


def planned_times(job: Job, old: Reading, new: Reading, where: Sequence[Place], axes: Machine) -> tuple[float, float]:
    """Time of what has changed, before and after, s, under the limits of the axes of a machine (`ramp_times`).

    On LinuxCNC it is that of the whole program, by the law of its planner. Errors: a pose out of reach; CS264: a
    program for LinuxCNC has motion of a kind whose law is not known; CS263: the machine does not say how fast its axes
    may go.
    """
    if by_own_law(job):
        return float(_on_linuxcnc(old, axes)[-1]), float(_on_linuxcnc(new, axes)[-1])
    before, after = run_times(job, old, new, where, axes).sum(axis=0).tolist()
    return before, after


def run_times(job: Job, old: Reading, new: Reading, where: Sequence[Place], axes: Machine) -> Floats:
    """(p, 2) time of each place before and after, s; errors as of `planned_times`."""
    if by_own_law(job):
        lines = [(place.run.first, place.run.stop) for place in where], [(place.first, place.stop) for place in where]
        ends = [np.concatenate(([0.0], _on_linuxcnc(reading, axes))) for reading in (old, new)]
        return np.column_stack([[end[b] - end[a] for a, b in own] for end, own in zip(ends, lines, strict=True)])
    found: dict[int, Floats] = {}
    for some in shared(old, new, where):
        firsts = [place.run.first for place in some], [place.first for place in some]
        times = [_times(job, nc, own, axes) for nc, own in zip(pair(job, old, new, some), firsts, strict=True)]
        found |= dict(zip(firsts[0], np.column_stack(times), strict=True))
    return np.array([found[place.run.first] for place in where]).reshape(-1, 2)


def _times(job: Job, nc: NcProgram, firsts: Sequence[int], axes: Machine) -> Floats:
    """Time of the stretches of a motion that begin in some lines, without the rapids to them, s."""
    path = text_path(nc, Limits(), settings=job.settings)
    taken = np.where(path.rapid, 0.0, ramp_times(path, Limits(), axes))
    which = np.searchsorted(firsts, np.abs(path.program.line[path.move]) - 1, side="right") - 1
    return np.bincount(which, taken, len(firsts)).astype(np.float64)


def least_time(job: Job, run: Run) -> float:
    """Time that the feeds of a run ask for, s; zero where its places are no places of the tip."""
    if run.state.groups["feed"] == "inverse":
        return float((60.0 / run.feeds).sum())
    if job.reader.wanted == NONE and len(job.reader.axes) > len("XYZ"):
        return 0.0
    return float((60.0 * norm(np.diff(run.places[:, :3], axis=0)) / run.feeds).sum())


def time_as_it_is(job: Job, reading: Reading, axes: Machine) -> float:
    """Time of all runs of a program, s; on LinuxCNC and errors as `planned_times`, and CS266: it has no runs."""
    if by_own_law(job):
        return float(_on_linuxcnc(reading, axes)[-1])
    if not reading.runs:
        raise no_runs()
    where = [Place(run, run.first, run.stop) for run in reading.runs]
    return planned_times(job, reading, reading, where, axes)[0]


def no_runs() -> SettingsError:
    """Make the error of a program in which nothing can be smoothed."""
    hint = "'cornersmooth filter' says why for each, with its line"
    return SettingsError("CS266", "no cut of the program can be smoothed", hint)


def by_own_law(job: Job) -> bool:
    """Whether the control has a planner whose law is known: times are those of whole programs then."""
    return job.form.table.lines.planner == LINUXCNC


def _on_linuxcnc(reading: Reading, axes: Machine) -> Floats:
    """(l,) when each line of a program ends, s."""
    moves = program_lines(reading.data.decode("utf-8", "replace"))
    ends = np.zeros(len(reading))
    ends[moves.number - 1] = line_times(moves, axis_limits(axes))[1]
    return np.maximum.accumulate(ends) if len(ends) else np.zeros(1)
