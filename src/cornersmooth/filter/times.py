"""The time that runs take, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import compress

import numpy as np

from cornersmooth.arrays import norm
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.feedrate import Limits
from cornersmooth.feedrate.linuxcnc import axis_limits, line_times, program_lines
from cornersmooth.feedrate.parts import ramp_times
from cornersmooth.feedrate.written import text_path
from cornersmooth.filter.checking import Place, motion_of, shared
from cornersmooth.filter.motion import Job
from cornersmooth.filter.runs import NONE, Reading, Run
from cornersmooth.kinematics import Machine, check_dynamics
from cornersmooth.model import Floats
from cornersmooth.nc_reader import NcProgram
from cornersmooth.times import LINUXCNC


@dataclass
class Times:
    """Planned times of the runs of a program, and of what takes their place, under the limits of the axes of a machine.

    They are those of `ramp_times`, and on LinuxCNC by the law of its planner. No text is planned twice.

    Errors: a pose out of reach; CS264: a program for LinuxCNC has motion of a kind whose law is not known; CS263: the
    machine does not say how fast an axis may go that moves.
    """

    job: Job
    old: Reading
    axes: Machine
    known: dict[tuple[int, bytes], float] = field(default_factory=dict)  #: by the first line of a run, and its text
    ends: dict[bytes, Floats] = field(default_factory=dict)  #: of programs: when each line ends

    def of_runs(self, new: Reading, where: Sequence[Place]) -> Floats:
        """(p, 2) time of each place before and after, s."""
        before = [Place(place.run, place.run.first, place.run.stop) for place in where]
        return np.array([self._seconds(self.old, before), self._seconds(new, where)]).reshape(2, -1).T

    def of_change(self, new: Reading, where: Sequence[Place]) -> tuple[float, float]:
        """Time of what has changed, before and after, s; on LinuxCNC that of the whole program."""
        if by_own_law(self.job):
            return float(self._ends(self.old)[-1]), float(self._ends(new)[-1])
        before, after = self.of_runs(new, where).sum(axis=0).tolist()
        return before, after

    def as_it_is(self) -> float:
        """Time of all runs, s; on LinuxCNC that of the program. CS266: it has no runs."""
        if not self.old.runs and not by_own_law(self.job):
            raise no_runs()
        return self.of_change(self.old, [Place(run, run.first, run.stop) for run in self.old.runs])[0]

    def unknown(self) -> InputError | None:
        """Why the time of the program is not known (CS264, with the line); None where it is."""
        try:
            if by_own_law(self.job):
                self._ends(self.old)
        except InputError as error:
            return error
        return None

    def _seconds(self, reading: Reading, where: Sequence[Place]) -> list[float]:
        """Time of each place, s."""
        if by_own_law(self.job):
            ends = np.concatenate(([0.0], self._ends(reading)))
            return [float(ends[place.stop] - ends[place.first]) for place in where]
        keys = {place.run.first: (place.run.first, reading.lines(place.first, place.stop)) for place in where}
        new = [place for place in where if keys[place.run.first] not in self.known]
        for some in shared(self.old, reading, new):
            taken = self._planned(motion_of(self.job, self.old, reading, some), [place.first for place in some])
            self.known |= zip((keys[place.run.first] for place in some), taken.tolist(), strict=True)
        return [self.known[key] for key in keys.values()]

    def _planned(self, nc: NcProgram, firsts: Sequence[int]) -> Floats:
        """Time of the stretches of a motion that begin in some lines, without the rapids to them, s."""
        path = text_path(nc, Limits(), settings=self.job.settings)
        moved = np.ptp(path.program.tip, axis=0) > 0.0
        turns = np.ptp(path.program.axis, axis=0).any()  # the tip stays where it is, and the linear axes follow
        names = ("X", "Y", "Z", *self.axes.names) if turns else compress("XYZ", moved)
        check_dynamics(self.axes, names)
        taken = np.where(path.rapid, 0.0, ramp_times(path, Limits(), self.axes))
        which = np.searchsorted(firsts, np.abs(path.program.line[path.move]) - 1, side="right") - 1
        return np.bincount(which, taken, len(firsts)).astype(np.float64)

    def _ends(self, reading: Reading) -> Floats:
        """(l,) when each line of a program ends on LinuxCNC, s."""
        if reading.data not in self.ends:
            moves = program_lines(reading.data)
            ends = np.zeros(max(len(reading), 1))
            ends[moves.number - 1] = line_times(moves, axis_limits(self.axes, moves))[1]
            self.ends[reading.data] = np.maximum.accumulate(ends)
        return self.ends[reading.data]


def least_time(job: Job, run: Run) -> float:
    """Time that the feeds of a run ask for, s; zero where its places are no places of the tip."""
    if run.state.groups["feed"] == "inverse":
        return float((60.0 / run.feeds).sum())
    if job.reader.wanted == NONE and len(job.reader.axes) > len("XYZ"):
        return 0.0
    return float((60.0 * norm(np.diff(run.places[:, :3], axis=0)) / run.feeds).sum())


def no_runs() -> SettingsError:
    """Make the error of a program in which nothing can be smoothed."""
    hint = "'cornersmooth filter' says why for each, with its line"
    return SettingsError("CS266", "no cut of the program can be smoothed", hint)


def by_own_law(job: Job) -> bool:
    """Whether the control has a planner whose law is known: times are those of whole programs then."""
    return job.form.table.lines.planner == LINUXCNC
