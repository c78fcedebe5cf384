"""The time that runs take, before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cornersmooth.arrays.vectors import norm
from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import Limits, plan_text
from cornersmooth.feedrate.even_ramps import ramp_times
from cornersmooth.feedrate.linuxcnc import axis_limits, line_times, program_lines
from cornersmooth.feedrate.written import text_path
from cornersmooth.filter.checking import Place, pair, shared
from cornersmooth.filter.motion import Job, motion_of_runs
from cornersmooth.filter.runs import NONE, Reading, Run
from cornersmooth.kinematics import Machine
from cornersmooth.model import Floats
from cornersmooth.nc_reader import NcProgram
from cornersmooth.times.saving import LINUXCNC


def planned_times(
    job: Job, old: Reading, new: Reading, where: Sequence[Place], axes: Machine, *, closely: bool
) -> tuple[float, float]:
    """Time of what has changed, before and after, s, under the limits of the axes of a machine.

    It is planned `closely`, or in even ramps, with a hundredth of the work. On LinuxCNC it is that of the whole
    program, by the law of its planner. Errors: a pose out of reach; CS264: a program for LinuxCNC has motion of a kind
    whose law is not known; CS263: the machine does not say how fast its axes may go.
    """
    if by_own_law(job):
        return float(_on_linuxcnc(old, axes)[-1]), float(_on_linuxcnc(new, axes)[-1])
    before, after = run_times(job, old, new, where, axes, closely=closely).sum(axis=0).tolist()
    return before, after


def run_times(
    job: Job, old: Reading, new: Reading, where: Sequence[Place], axes: Machine, *, closely: bool = False
) -> Floats:
    """(p, 2) time of each place before and after, s: planned `closely`, or in even ramps; errors as `planned_times`."""
    if by_own_law(job):
        lines = [(place.run.first, place.run.stop) for place in where], [(place.first, place.stop) for place in where]
        ends = [np.concatenate(([0.0], _on_linuxcnc(reading, axes))) for reading in (old, new)]
        return np.column_stack([[end[b] - end[a] for a, b in own] for end, own in zip(ends, lines, strict=True)])
    found = {}
    for some in shared(old, new, where):
        for place, own in zip(some, _pair_times(job, old, new, some, axes, closely=closely), strict=True):
            found[place.run.first] = own
    return np.array([found[place.run.first] for place in where]).reshape(-1, 2)


def _pair_times(
    job: Job, old: Reading, new: Reading, where: Sequence[Place], axes: Machine, *, closely: bool
) -> Floats:
    """(p, 2) times of places: all at once where a rapid leads to each."""
    times = [_stretch_times(job, nc, axes, closely=closely) for nc in pair(job, old, new, where)]
    if all(len(own) == len(where) for own in times):
        return np.column_stack(times)
    each = (pair(job, old, new, [place]) for place in where)
    return np.array([[_stretch_times(job, nc, axes, closely=closely).sum() for nc in both] for both in each])


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
    groups = shared(reading, reading, [Place(run, run.first, run.stop) for run in reading.runs])
    parts = (motion_of_runs(job, reading, [place.run for place in own]) for own in groups)
    return float(sum(_stretch_times(job, nc, axes).sum() for nc in parts))


def no_runs() -> SettingsError:
    """Make the error of a program in which nothing can be smoothed."""
    hint = "'cornersmooth filter' says why for each, with its line"
    return SettingsError("CS266", "no cut of the program can be smoothed", hint)


def by_own_law(job: Job) -> bool:
    """Whether the control has a planner whose law is known: times are those of whole programs then."""
    return job.form.table.lines.planner == LINUXCNC


def _stretch_times(job: Job, nc: NcProgram, axes: Machine, *, closely: bool = True) -> Floats:
    """Time between rapids, s."""
    if closely:
        law = plan_text(nc, settings=job.settings, machine=axes)
        rapid, taken = law.path.rapid, np.diff(law.times_at(law.edge))
    else:
        path = text_path(nc, Limits(), settings=job.settings)
        rapid, taken = path.rapid, ramp_times(path, Limits(), axes)
    total: Floats = np.bincount(np.cumsum(rapid), np.where(rapid, 0.0, taken)).astype(np.float64)
    return total


def _on_linuxcnc(reading: Reading, axes: Machine) -> Floats:
    """(l,) when each line of a program ends, s."""
    moves = program_lines(reading.data.decode("utf-8", "replace"))
    ends = np.zeros(len(reading))
    ends[moves.number - 1] = line_times(moves, axis_limits(axes))[1]
    return np.maximum.accumulate(ends) if len(ends) else np.zeros(1)
