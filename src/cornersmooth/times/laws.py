"""What smoothing is worth: the same program driven directly and smoothed, under the same limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from cornersmooth.feedrate import TimeLaw, direct, plan
from cornersmooth.kinematics import Machine
from cornersmooth.model import Program
from cornersmooth.settings import METHODS, Limits, Settings
from cornersmooth.smoothing import smooth

SCHEMA = "cornersmooth-time/1"

#: rows of `Comparison.laws`, in this order
BASELINES = ("direct_exact_stop", "direct_velocity_jump")

#: row of a text
AS_WRITTEN = "as_written"

Progress = Callable[[str, int, int], None]


class SlowMove(NamedTuple):
    """A move that takes longer than its length over its feed: its CL line, where it ends (mm), what it takes and loses.

    `slowest_mm_per_s` is the least speed at the ends of its parts.
    """

    line: int
    x: float
    y: float
    z: float
    seconds: float
    lost_seconds: float
    length_mm: float
    slowest_mm_per_s: float


@dataclass(frozen=True)
class Comparison:
    """Time laws of one program."""

    program: Program
    settings: Settings  #: of the smoothing; its `method` is replaced by each method in turn
    limits: Limits
    #: the two `BASELINES`, every method by its name, and `AS_WRITTEN` where there is a text
    laws: Mapping[str, TimeLaw]
    machine: Machine | None = None  #: whose axes keep their limits

    def with_text(self, law: TimeLaw) -> Comparison:
        """Return the same with the time law of an NC text (`cornersmooth.feedrate.plan_text`)."""
        return replace(self, laws={**self.laws, AS_WRITTEN: law})

    @property
    def seconds(self) -> dict[str, float]:
        """Total times, s."""
        return {name: law.total for name, law in self.laws.items()}

    @property
    def saving_percent(self) -> dict[str, dict[str, float]]:
        """Time saved by each method, and by the text, against each baseline, %."""
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

    def as_dict(self, slow_moves: int = 10) -> dict[str, Any]:
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
            "turning_seconds": {name: turning_seconds(law) for name, law in self.laws.items()},
            "slowest": {name: [move._asdict() for move in slowest(law, slow_moves)] for name, law in self.laws.items()},
        }
        if self.machine is not None:
            contents["machine"] = self.machine.name
        return contents


def compare(
    program: Program,
    settings: Settings | None = None,
    limits: Limits | None = None,
    *,
    methods: Sequence[str] = tuple(METHODS),
    machine: Machine | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Plan a program directly, with stops and with jumps of velocity, and the ideal curves of methods.

    It raises what `cornersmooth.feedrate.plan` does.

    Parameters
    ----------
    methods : sequence of str
        Whose curves are planned.
    progress : callable, optional
        Called with (name of the law, work done, work in all).

    Returns
    -------
    Comparison
        Laws by name, their seconds, and what is saved.

    Raises
    ------
    InputError, SettingsError
        As of `plan`.
    """
    settings = Settings() if settings is None else settings
    limits = Limits() if limits is None else limits

    def step(name: str) -> Callable[[int, int], None] | None:
        return None if progress is None else partial(progress, name)

    stopping, jumping = BASELINES
    laws = {
        stopping: direct(program, limits, "exact_stop", settings=settings, machine=machine),
        jumping: direct(program, limits, "velocity_jump", settings=settings, machine=machine, progress=step(jumping)),
    }
    for name in methods:
        chosen = settings.but(method=name, **METHODS[name].prescribed)
        laws[name] = plan(smooth(program, chosen), limits, machine=machine, progress=step(name))
    return Comparison(program, settings, limits, laws, machine)


def stops(law: TimeLaw) -> int:
    """How often the motion comes to rest between its start and its end."""
    return int((law.path.junction_speed[1:-1] == 0.0).sum())


def turning_seconds(law: TimeLaw) -> float:
    """Time in which the tip stands still while the axis turns, s.

    The paper's method has such moments where neighbouring transitions use up a tip segment but not its axis-point
    segment: what is left of the turn has to be made on the spot.
    """
    took = np.diff(law.times_at(law.edge))
    return float(took[law.path.turning].sum())


def slowest(law: TimeLaw, count: int = 10) -> list[SlowMove]:
    """Moves that lose most time against their programmed speed, the worst first."""
    path = law.path
    if not len(path):
        return []
    times = law.times_at(law.edge)
    speeds = law.kinematics(times)[1]
    took = np.diff(times)
    first = np.flatnonzero(np.concatenate(([True], path.move[1:] != path.move[:-1])))
    seconds = np.add.reduceat(took, first)
    lost = np.add.reduceat(took - path.length / path.speed, first)
    length = np.add.reduceat(np.where(path.turning, 0.0, path.length), first)
    least = np.minimum.reduceat(np.minimum(speeds[:-1], speeds[1:]), first)
    pose = path.move[first]
    columns = (path.program.line[pose], *path.program.tip[pose].T, seconds, lost, length, least)
    rows = np.argsort(-lost, kind="stable")[:count]
    return [SlowMove(*row) for row in zip(*(column[rows].tolist() for column in columns), strict=True)]
