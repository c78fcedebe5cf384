"""How long programs take: as written, of every form, in every setup; every time of an NC program comes from here."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cornersmooth import nc, smoothing
from cornersmooth.errors import CornersmoothError
from cornersmooth.feedrate import BlockLimits, TimeLaw, direct, limiting, plan_text
from cornersmooth.feedrate.intervals import ROUGHLY, Resolution
from cornersmooth.feedrate.linuxcnc import axis_limits, line_times, program_lines
from cornersmooth.feedrate.machine_axes import follow
from cornersmooth.feedrate.parts import time_of_parts
from cornersmooth.feedrate.path import build_path
from cornersmooth.feedrate.written import text_path
from cornersmooth.kinematics import Machine, endless, tool_axis, with_dynamics
from cornersmooth.model import Floats, Move, Program
from cornersmooth.nc import Form
from cornersmooth.pipeline import Progress, read_back, stage_of
from cornersmooth.report.verdict import Saving
from cornersmooth.settings import AUTO, BOUNDS, CURVES_METHOD, DEFAULT_METHOD, Limits, Settings
from cornersmooth.system.processes import useful_processes

#: name of the law of LinuxCNC's planner in the tables of controls
LINUXCNC = "linuxcnc-2.9"

#: poses up to which motions are planned whole
_WHOLE = 4_000

#: time over that of the usual method from which on another is taken: rough plans tell no less apart
_FASTER = 0.99

#: of the digits of a program, mm and radians: a pose of it is the same as one of the CL file
_SAME = 1e-3


@dataclass(frozen=True)
class Timing:
    """Under which limits programs of a form are planned."""

    form: Form
    settings: Settings  #: Those the program is smoothed with
    limits: Limits  #: Of the tip
    machine: Machine  #: Limits of the axes
    blocks: BlockLimits  #: What the control makes of blocks

    @classmethod
    def of(
        cls,
        form: Form,
        settings: Settings,
        limits: Limits | None = None,
        axes: Machine | None = None,
        blocks: BlockLimits | None = None,
    ) -> Timing | None:
        """Give the limits of the axes of `axes`, else of the machine of the form; None where no axis has any.

        None for LinuxCNC without tip control, too: its unsmoothed lines would not keep the tip, so nobody runs them.
        """
        machine = with_dynamics(form.machine if axes is None else axes)
        if machine is None or (_linuxcnc(form) and (form.machine is None or form.orientation == "machine")):
            return None
        machine = endless(machine) if form.rewind else machine
        return cls(form, settings, limits or Limits(), machine, blocks or BlockLimits())

    def written(
        self,
        text: bytes,
        program: Program,
        progress: Progress | None = None,
        resolution: Resolution | None = None,
    ) -> tuple[float, tuple[tuple[str, float], ...]]:
        """Time of a program from the first to the last pose it goes to, s, and the limits that are reached the longest.

        Its way from and to the retract is not counted: the CL file, which it was made of, does not have it.
        `resolution` is as of `plan_text`.
        """
        if _linuxcnc(self.form):
            return self._on_linuxcnc(text, program), ()
        read = read_back(text, self.form, self.settings)
        law = plan_text(
            read,
            self.limits,
            settings=self.settings,
            machine=self.machine,
            blocks=self.blocks,
            resolution=resolution,
            progress=stage_of(progress, "planning as written"),
        )
        moves = law.path.program
        begin, end = _from_to(program, moves.tip, moves.axis)
        reached = tuple(limiting(law))
        if begin < 0:
            return law.total, reached
        seconds = law.times_at(law.edge[np.searchsorted(law.path.move, [begin, end], side="right")])
        return float(seconds[1] - seconds[0]), reached

    def unsmoothed(self, program: Program, progress: Progress | None = None) -> tuple[float, str]:
        """Time of the lines of the CL file, s, and a remark on them.

        On LinuxCNC they are written as lines of rotary words under G64 with P = ε.
        """
        if not _linuxcnc(self.form):
            law = direct(
                program,
                self.limits,
                "velocity_jump",
                settings=self.settings,
                machine=self.machine,
                progress=stage_of(progress, "planning unsmoothed"),
            )
            return law.total, ""
        blend, loosest = self.settings.tolerance, BOUNDS["tolerance"][1]
        settings = replace(
            Settings(tolerance=loosest, axis_length=self.settings.axis_length, lines="dense"),
            blend_share=blend / loosest,  # no points between the poses, as a tolerance would ask for
        )
        kept = replace(program, keep=np.ones(len(program), np.uint8))
        text = written_text(kept, nc.fit_settings(settings, self.form, program.units), self.form)
        return self._on_linuxcnc(text, program), f"unsmoothed lines under G64 P{blend:g}, which holds the tip alone"

    def _on_linuxcnc(self, text: bytes, program: Program) -> float:
        """Time by the law of LinuxCNC's planner, s."""
        lines = program_lines(text, program.source.name)
        if not len(lines) or self.form.machine is None:
            return 0.0
        start, end = line_times(lines, axis_limits(self.machine, lines))
        place = np.vstack((lines.start[:1], lines.end))
        time = np.concatenate((start[:1], end))
        columns = ["XYZABC".index(axis.name) for axis in self.form.machine.axes]
        first, last = _from_to(program, place[:, :3], tool_axis(self.form.machine, place[:, columns]))
        return float(time[last] - time[first])


def _linuxcnc(form: Form) -> bool:
    return form.table.lines.planner == LINUXCNC


def planned_saving(
    program: Program,
    settings: Settings,
    form: Form,
    limits: Limits | None = None,
    axes: Machine | None = None,
    progress: Progress | None = None,
) -> Saving | None:
    """Plan a program as it was and as it is written, under the limits of the axes of a machine.

    Holes are only gone over in both: what a cycle takes is in the program, and nowhere in the CL file. None where a
    time would be of something that nobody runs: without limits of the axes, without any feed, or out of reach.

    Parameters
    ----------
    settings : Settings
        Those the program is smoothed with.
    axes : Machine, optional
        Whose limits, in place of those of the machine of the form.
    progress : callable, optional
        Called with (stage, work done, work in all).
    """
    timing = Timing.of(form, settings, limits, axes)
    if timing is None:
        return None
    program = without_holes(program)
    if not np.isin(program.kind[1:], (Move.LINEAR, Move.ARC)).any():
        return None
    try:
        text = written_text(program, settings, form)
        if len(program) > _WHOLE and not _linuxcnc(form):
            return _in_parts(timing, text, program, progress)
        before, against = timing.unsmoothed(program, progress)
        written, limited = timing.written(text, program, progress)
        return Saving(before, written, limited, against)
    except CornersmoothError:
        return None


def faster_method(program: Program, settings: Settings, form: Form, axes: Machine) -> Settings:
    """Settings with a method in the place of "auto" where lines are written: that of the program that takes less time.

    Rough plans under the limits of `axes` are compared; the usual method stays where they cannot tell, where the
    program is long, and where the control has a law of its own.
    """
    own = without_holes(program)
    timing = Timing.of(form, settings, axes=axes)
    if settings.method != AUTO or form.curves or timing is None or len(program) > _WHOLE or form.table.lines.planner:
        return settings
    times = []
    for method in (DEFAULT_METHOD, CURVES_METHOD):
        try:
            some = nc.fit_settings(settings.but(method=method), form, program.units)
            text = written_text(own, some, form)
            times.append(replace(timing, settings=some).written(text, own, resolution=ROUGHLY)[0])
        except CornersmoothError:  # nobody runs it, or its time is not known
            return settings
    return settings.but(method=CURVES_METHOD) if times[1] < _FASTER * times[0] else settings


def _in_parts(timing: Timing, text: bytes, program: Program, progress: Progress | None) -> Saving:
    """What smoothing saves of a long program, from plans of parts of both motions."""
    limits, settings, machine, count = timing.limits, timing.settings, timing.machine, useful_processes()
    unsmoothed = build_path(program, None, settings, limits)
    written = text_path(read_back(text, timing.form, settings), limits, blocks=timing.blocks, settings=settings)
    begin, end = _from_to(program, written.program.tip, written.program.axis)  # from the first to the last pose
    ends = np.searchsorted(written.move, [begin, end], side="right").tolist()
    own = written if begin < 0 else written.part(*ends)
    before, after = (
        time_of_parts(part, limits, follow(axes, path), processes=count, progress=stage_of(progress, stage))
        for path, part, axes, stage in (
            (unsmoothed, unsmoothed, machine, "planning unsmoothed"),
            (written, own, endless(machine), "planning as written"),
        )
    )
    error = 100.0 * math.hypot(before.error / before.seconds, after.error / after.seconds)
    against = f"unsmoothed lines, both from plans of parts (within {2.0 * error:.1f} %)"
    return Saving(before.seconds, after.seconds, after.limiting, against)


def written_text(program: Program, settings: Settings, form: Form) -> bytes:
    """Write the smoothed program."""
    stream = io.BytesIO()
    nc.write(smoothing.smooth(program, settings), stream, form=form)
    return stream.getvalue()


def without_holes(program: Program) -> Program:
    """Return the program with rapids to its holes, which nothing drills."""
    holes = program.kind == Move.HOLE
    if not holes.any():
        return program
    kept = tuple(statement for statement in program.statements if statement.word != "CYCLE")
    return replace(program, kind=np.where(holes, np.uint8(Move.RAPID), program.kind), statements=kept)


def _from_to(program: Program, tip: Floats, axis: Floats) -> tuple[int, int]:
    """Rows of written poses that are the first and the last pose a program goes to; −1 where it goes another way."""
    gone_to = np.flatnonzero(program.kind != Move.FROM)[[0, -1]]  # no text goes to a FROM
    begin, end = (
        np.flatnonzero((np.abs(np.hstack((tip - program.tip[pose], axis - program.axis[pose]))) < _SAME).all(axis=1))
        for pose in gone_to.tolist()
    )
    if not len(begin) or not len(end) or begin[0] >= end[-1]:
        return -1, -1
    return int(begin[0]), int(end[-1])


SCHEMA = "cornersmooth-time/1"

#: rows of `Comparison.laws`, in this order
BASELINES = ("direct_exact_stop", "direct_velocity_jump")

#: row of a text
AS_WRITTEN = "as_written"


@dataclass(frozen=True)
class Comparison:
    """Time laws of one program."""

    program: Program
    settings: Settings  #: of the smoothing
    limits: Limits
    laws: Mapping[str, TimeLaw]  #: the two `BASELINES`, and others by their names, such as `AS_WRITTEN`
    machine: Machine | None = None  #: whose axes keep their limits

    @property
    def seconds(self) -> dict[str, float]:
        """Total times, s."""
        return {name: law.total for name, law in self.laws.items()}

    @property
    def saving_percent(self) -> dict[str, dict[str, float]]:
        """Time saved against each baseline by what is none, %."""
        seconds = self.seconds
        return {
            name: {base: 100.0 * (1.0 - seconds[name] / seconds[base]) for base in BASELINES if seconds[base]}
            for name in self.laws
            if name not in BASELINES
        }

    @property
    def constant_feed_seconds(self) -> float:
        """Length over programmed speed of the direct path: what no limit could undercut."""
        path = self.laws[BASELINES[0]].path
        return float((path.length / path.speed).sum())

    def as_dict(self) -> dict[str, Any]:
        """Everything, plain; keys carry their unit."""
        source = self.program.source
        contents: dict[str, Any] = {
            "schema": SCHEMA,
            "input": {"name": source.name, "format": source.format, "dialect": source.dialect},
            "settings": self.settings.as_dict(),
            "limits": self.limits.as_dict(),
            "seconds": self.seconds,
            "saving_percent": self.saving_percent,
            "constant_feed_seconds": self.constant_feed_seconds,
            "length_mm": {name: law.length for name, law in self.laws.items()},
            "stops": {name: stops(law) for name, law in self.laws.items()},
        }
        if self.machine is not None:
            contents["machine"] = self.machine.name
        return contents


def stops(law: TimeLaw) -> int:
    """How often the motion comes to rest between its start and its end."""
    return int((law.path.junction_speed[1:-1] == 0.0).sum())
