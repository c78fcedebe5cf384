"""Where to clamp a part: which turn and tilt of it on the machine lets the program run fastest.

The same path asks other things of the axes where the part is clamped in another way. Two steps find a good one:

1. estimate: many setups, by the motion of the axes between the poses. With τ the time of each move at its feed, an axis
   that would go at ``q'`` and speed up by ``q''`` slows the path by ``hypot(1, max(|q'|/V, sqrt(|q''|/A)))``.
2. plan: the best of them are smoothed, written, read back and planned, as for the verdict of ``smooth``.

Wei, Lee: Adv. Mech. Eng. 12(12), 2020, doi 10.1177/1687814020975544, tell of such gains on a machine with two tables.
"""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from cornersmooth import nc
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.feedrate import Limits
from cornersmooth.feedrate.path import Path, build_path
from cornersmooth.kinematics import Machine, check_travel, nose_position
from cornersmooth.kinematics.machine import PARALLEL
from cornersmooth.model import Floats, Move, Program, rapid_moves
from cornersmooth.nc import Form
from cornersmooth.pipeline import smooth
from cornersmooth.rotary import rotary_angles
from cornersmooth.settings import Settings
from cornersmooth.system.processes import map_in_processes
from cornersmooth.times import Timing, without_holes

#: degrees between the setups that are estimated first, and around the best of them
COARSE, FINE = 15.0, 5.0
#: the best of the first setups, around which others are estimated
_STARTS: Final = 4
#: setups that differ by less are as good as the same, degrees
_APART: Final = 15.0
#: of a second that count
_DIGITS: Final = 2


@dataclass(frozen=True)
class Setup:
    """How the part is clamped: turned about Z, then tilted about X, then about Y, the axes of the machine."""

    #: degrees: Right-handed, as the part is seen to turn.
    turn: float = 0.0
    tilt_x: float = 0.0
    tilt_y: float = 0.0

    @property
    def matrix(self) -> Floats:
        """(3, 3) rotation from today's coordinates of the part to those of the machine."""
        return self.rotation.as_matrix()

    @property
    def rotation(self) -> Rotation:
        """The same."""
        return Rotation.from_euler("zxy", (self.turn, self.tilt_x, self.tilt_y), degrees=True)


@dataclass(frozen=True)
class Rating:
    """What a setup is worth."""

    setup: Setup
    estimate: float  #: s: Only to compare with others; infinite where the machine does not reach a pose
    seconds: float = math.nan  #: s: Of the program as it is written; NaN where it was not planned, or is out of reach
    why: str = ""  #: What is out of reach

    @property
    def rank(self) -> tuple[bool, float, float]:
        """Sorts setups: the fastest first, of those as fast the one with the least tilts; then those out of reach."""
        seconds = self.estimate if math.isnan(self.seconds) else self.seconds
        return bool(self.why), round(seconds, _DIGITS), abs(self.setup.tilt_x) + abs(self.setup.tilt_y)


@dataclass(frozen=True)
class Setups:
    """What was found."""

    pivot: Floats  #: (3,), mm: The point of the part that stays where it is: the middle of the cuts
    today: Rating  #: The part as it is
    best: tuple[Rating, ...]  #: Others that were planned, the fastest first; those out of reach are not among them
    #: Setups that were estimated, and those of them beyond the axes of the machine.
    tried: int
    out_of_reach: int

    def saving(self, rating: Rating) -> float:
        """Time saved against today's setup, %; NaN where one of them has none."""
        return 100.0 * (1.0 - rating.seconds / self.today.seconds) if self.today.seconds else 0.0

    def zero(self, setup: Setup) -> Floats:
        """(3,) where the zero of the part goes to, counted from where it is, mm."""
        return self.pivot - setup.matrix @ self.pivot

    def as_dict(self) -> dict[str, Any]:
        """Everything, plain; keys carry their unit."""
        return {
            "schema": "cornersmooth-setup/1",
            "pivot_mm": self.pivot.tolist(),
            "tried": self.tried,
            "out_of_reach": self.out_of_reach,
            "today": self._row(self.today),
            "best": [self._row(rating) for rating in self.best],
        }

    def _row(self, rating: Rating) -> dict[str, Any]:
        numbers = {"seconds": rating.seconds, "saving_percent": self.saving(rating)}
        return {
            "turn_deg": rating.setup.turn,
            "tilt_x_deg": rating.setup.tilt_x,
            "tilt_y_deg": rating.setup.tilt_y,
            **{key: value if math.isfinite(value) else None for key, value in numbers.items()},
            "matrix": rating.setup.matrix.tolist(),
            "zero_mm": self.zero(rating.setup).tolist(),
            "out_of_reach": rating.why or None,
        }


def turns_part(machine: Machine) -> bool:
    """Whether a table turns the part about Z without end: a turn of the part on it changes next to nothing."""
    first = machine.axes[0]
    return first.carrier == "table" and first.limits is None and not np.hypot(*first.unit[:2]) > PARALLEL


def turned(program: Program, setup: Setup, pivot: Floats) -> Program:
    """Return the motion of a program with the part clamped in another way, in lines and arcs, without statements."""
    matrix, arcs = setup.matrix, program.arcs
    return replace(
        program,
        tip=(program.tip - pivot) @ matrix.T + pivot,
        axis=program.axis @ matrix.T,
        curves=None,
        arcs=replace(arcs, centre=(arcs.centre - pivot) @ matrix.T + pivot, normal=arcs.normal @ matrix.T),
        statements=(),
    )


def find_setups(
    program: Program,
    form: Form,
    settings: Settings | None = None,
    limits: Limits | None = None,
    *,
    axes: Machine | None = None,
    tilt: float = 45.0,
    turns: bool = True,
    plans: int = 6,
    processes: int = 1,
    progress: Callable[[str, int, int], None] | None = None,
) -> Setups:
    """Find how to clamp a part so that its program takes the least time.

    Fixture, reach of the tool and collisions are not looked at. Holes are only gone over.

    Parameters
    ----------
    form : Form
        What the program is written in, with the machine that it runs on.
    axes : Machine, optional
        The machine where the form names none, as curves do.
    tilt : float, degrees
        Tilts about X and Y are up to this, either way.
    turns : bool
        Whether the part may be turned about Z. Where the first rotary axis does that without end, it need not be.
    plans : int
        Setups that are planned, beside today's.
    progress : callable, optional
        Called with (what is done, setups planned, of how many).

    Raises InputError: the machine reaches the poses of no setup. SettingsError CS263: the machine does not say how fast
    its axes may go.
    """
    machine = form.machine if axes is None else axes
    if machine is None or not machine.dynamics:
        what = "the machine does not say how fast its axes may go"
        raise SettingsError("CS263", what, "name a machine whose file has [dynamics.X] and so on")
    settings = Settings() if settings is None else settings
    limits = Limits() if limits is None else limits
    program = without_holes(program)
    cuts = np.isin(program.kind, (Move.LINEAR, Move.ARC))
    tips = program.tip[cuts] if cuts.any() else program.tip
    pivot = (tips.min(axis=0) + tips.max(axis=0)) / 2.0
    path = build_path(program, None, settings, limits)

    def estimate(setup: Setup) -> Rating:
        try:
            return Rating(setup, _estimate(turned(program, setup, pivot), machine, path, settings))
        except InputError as error:
            return Rating(setup, math.inf, why=error.what)

    def plan(rating: Rating) -> Rating:
        try:
            seconds = _planned(turned(program, rating.setup, pivot), form, settings, limits, machine)
            return replace(rating, seconds=seconds, why="")
        except InputError as error:
            return replace(rating, why=error.what)

    turns = turns and not turns_part(machine)
    rated: dict[Setup, Rating] = {}
    for setups in _rounds(rated, tilt, turns):
        new = [setup for setup in dict.fromkeys(setups) if setup not in rated]
        rated |= {one.setup: one for one in map_in_processes(estimate, new, processes)}
    chosen = [rated[Setup()], *_chosen(rated.values(), plans, tilt)]
    planned = []
    for rating in map_in_processes(plan, chosen, min(processes, len(chosen))):
        planned.append(rating)
        if progress is not None:
            progress("planning", len(planned), len(chosen))
    best = sorted((one for one in planned[1:] if not one.why), key=lambda one: one.rank)
    rated |= {one.setup: one for one in planned}
    gone = sum(bool(one.why) for one in rated.values())
    if gone == len(rated):
        _planned(program, form, settings, limits, machine)  # which raises what is out of reach today
    return Setups(pivot, planned[0], tuple(best), len(rated), gone)


def _rounds(rated: dict[Setup, Rating], tilt: float, turns: bool) -> Iterable[list[Setup]]:
    """Setups to estimate: far apart, then around the best of what has been rated, twice."""
    step = min(COARSE, tilt) or COARSE
    steps = step * np.arange(-int(tilt / step), int(tilt / step) + 1)
    about_z = COARSE * np.arange(0, 24, 3) if turns else np.zeros(1)
    yield [Setup(*map(float, one)) for one in itertools.product(about_z, steps, steps)]
    near = np.array((-FINE, 0.0, FINE))
    for _ in range(2):
        yield [
            Setup(*map(float, ((c % 360.0), a, b)))
            for one in _chosen(rated.values(), _STARTS, tilt)
            for c in (one.setup.turn + near if turns else np.zeros(1))
            for a in one.setup.tilt_x + near
            for b in one.setup.tilt_y + near
            if max(abs(a), abs(b)) <= tilt
        ]


def _chosen(ratings: Iterable[Rating], count: int, tilt: float) -> list[Rating]:
    """Take the best that are within reach and apart from one another, and not today's."""
    found, apart = [Rating(Setup(), 0.0)], min(_APART, tilt) or _APART
    for one in sorted(ratings, key=lambda one: one.rank):
        if len(found) > count or math.isinf(one.estimate):
            break
        turns = ((one.setup.rotation * other.setup.rotation.inv()).magnitude() for other in found)
        if min(turns) >= math.radians(apart - 1e-6):
            found.append(one)
    return found[1:]


def _estimate(program: Program, machine: Machine, path: Path, settings: Settings) -> float:
    """Estimate the time of a program, s, by its poses; `path` is that of the program as it is.

    Raises InputError where a pose is beyond the axes of the machine.
    """
    angles = rotary_angles(
        machine,
        program.tip,
        program.axis,
        tolerance=math.degrees(settings.tolerance / settings.axis_scale),
        rapid=rapid_moves(program.kind),
        line=program.line,
    ).angles
    check_travel(machine, program.tip, angles, program.line)
    names = ("X", "Y", "Z", *machine.names)
    given = {item.name: item.per_second for item in machine.dynamics}
    speed, accel, _ = np.array([given.get(name, (math.inf,) * 3) for name in names]).T
    place = np.hstack((nose_position(machine, program.tip, angles), angles))[:, : len(names)]
    time = path.length / path.speed
    rate = (place[path.move] - place[path.start]) / time[:, None]
    bend = 2.0 * np.diff(rate, axis=0) / (time[1:] + time[:-1])[:, None]
    slow = (np.abs(rate) / speed).max(axis=1)
    inside = np.maximum(np.maximum(slow[1:], slow[:-1]), np.sqrt((np.abs(bend) / accel).max(axis=1)))
    ends = np.hypot(1.0, np.concatenate((slow[:1], inside, slow[-1:])))
    return float((time * (ends[1:] + ends[:-1])).sum() / 2.0)


def _planned(program: Program, form: Form, settings: Settings, limits: Limits, axes: Machine) -> float:
    """Time of a program as it is written, s."""
    stream = io.BytesIO()
    path = smooth(program, settings, form=form)
    nc.write(path, stream, form=form)
    timing = Timing.of(form, path.settings, limits, axes)
    return math.nan if timing is None else timing.written(stream.getvalue(), program)[0]
