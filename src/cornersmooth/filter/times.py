"""The time that runs take, before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cornersmooth.feedrate import plan_text
from cornersmooth.feedrate.linuxcnc import line_times
from cornersmooth.feedrate.linuxcnc_program import axis_limits, program_lines
from cornersmooth.filter.checking import Place, motions
from cornersmooth.filter.runs import Reading
from cornersmooth.filter.writing import Job
from cornersmooth.kinematics import Machine
from cornersmooth.saving import LINUXCNC


def planned_times(job: Job, old: Reading, new: Reading, where: Sequence[Place], axes: Machine) -> tuple[float, float]:
    """Time of what has changed, before and after, s, under the limits of the axes of a machine.

    On LinuxCNC it is that of the whole program, by the law of its planner.

    Raises
    ------
    InputError
        The machine does not reach a pose; CS264: a program for LinuxCNC has arcs.
    SettingsError
        CS263: the machine does not say how fast its axes may go.
    """
    if job.form.table.lines.planner == LINUXCNC:
        both = [program_lines(one.data.decode("utf-8", "replace")) for one in (old, new)]
        before, after = (float(line_times(lines, axis_limits(axes))[1][-1]) for lines in both)
        return before, after
    total = np.zeros(2)
    for pair in motions(job, old, new, where):
        for k, nc in enumerate(pair):
            law = plan_text(nc, settings=job.settings, machine=axes)
            total[k] += np.diff(law.times_at(law.edge))[~law.path.rapid].sum()
    return float(total[0]), float(total[1])
