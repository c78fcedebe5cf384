"""The time that runs take, before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import plan_text
from cornersmooth.feedrate.linuxcnc import axis_limits, line_times, program_lines
from cornersmooth.filter.checking import Place, pair, shared
from cornersmooth.filter.motion import Job, motion_of_runs
from cornersmooth.filter.runs import Reading
from cornersmooth.kinematics import Machine
from cornersmooth.nc_reader import NcProgram
from cornersmooth.times.saving import LINUXCNC


def planned_times(job: Job, old: Reading, new: Reading, where: Sequence[Place], axes: Machine) -> tuple[float, float]:
    """Time of what has changed, before and after, s, under the limits of the axes of a machine.

    On LinuxCNC it is that of the whole program, by the law of its planner. Errors: a pose out of reach; CS264: a
    program for LinuxCNC has arcs; CS263: the machine does not say how fast its axes may go.
    """
    if by_own_law(job):
        return _on_linuxcnc(old, axes), _on_linuxcnc(new, axes)
    pairs = (pair(job, old, new, some) for some in shared(old, new, where))
    before, after = np.sum([[_planned(job, nc, axes) for nc in both] for both in pairs], axis=0).tolist()
    return before, after


def time_as_it_is(job: Job, reading: Reading, axes: Machine) -> float:
    """Time of all runs of a program, s; on LinuxCNC and errors as `planned_times`, and CS266: it has no runs."""
    if by_own_law(job):
        return _on_linuxcnc(reading, axes)
    if not reading.runs:
        raise no_runs()
    groups = shared(reading, reading, [Place(run, run.first, run.stop) for run in reading.runs])
    parts = (motion_of_runs(job, reading, [place.run for place in own]) for own in groups)
    return sum(_planned(job, nc, axes) for nc in parts)


def no_runs() -> SettingsError:
    """Make the error of a program in which nothing can be smoothed."""
    hint = "'cornersmooth filter' says why for each, with its line"
    return SettingsError("CS266", "no cut of the program can be smoothed", hint)


def by_own_law(job: Job) -> bool:
    """Whether the control has a planner whose law is known: times are those of whole programs then."""
    return job.form.table.lines.planner == LINUXCNC


def _planned(job: Job, nc: NcProgram, axes: Machine) -> float:
    law = plan_text(nc, settings=job.settings, machine=axes)
    return float(np.diff(law.times_at(law.edge))[~law.path.rapid].sum())


def _on_linuxcnc(reading: Reading, axes: Machine) -> float:
    lines = program_lines(reading.data.decode("utf-8", "replace"))
    return float(line_times(lines, axis_limits(axes))[1][-1])
