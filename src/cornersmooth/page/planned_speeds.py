"""Planned speeds on a common scale: along the original path, and over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import norm
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.feedrate import Limits, TimeLaw, direct, plan_text
from cornersmooth.feedrate.written import written_motion
from cornersmooth.kinematics import Machine, endless, with_dynamics
from cornersmooth.model import Bools, Floats, Program, rapid_moves
from cornersmooth.nc_reader import NcProgram
from cornersmooth.report.paths import OriginalPath, WrittenPath
from cornersmooth.rotary import rotary_angles
from cornersmooth.settings import Settings

#: moves up to which a motion is planned: some 10 s of work
MOST_MOVES = 100_000

#: of a control with another law
NOT_PLANNED = "The control plans its speeds by a law of its own: none are drawn."

#: looks at a law in each step of a chart
_LOOKS = 6


@dataclass(frozen=True)
class Planned:
    """Time laws of one program, and where they are on the original path."""

    #: ``"direct"`` (the original path), ``"written"`` (the program); those that were planned
    laws: Mapping[str, TimeLaw]
    #: for each law path coordinates, ascending, and the way along the original path there, mm
    ways: Mapping[str, tuple[Floats, Floats]]
    seconds: Floats | None  #: (m,): when the tool passes the points of the written path
    left_out: tuple[str, ...]  #: what was not planned, and why, in sentences


def plan_all(
    program: Program,
    original: OriginalPath,
    written: WrittenPath,
    nc: NcProgram,
    *,
    machine: Machine | None,
    settings: Settings,
) -> Planned:
    """Plan what can be planned."""
    laws: dict[str, TimeLaw] = {}
    limits = Limits()
    ways: dict[str, tuple[Floats, Floats]] = {}
    left_out: list[str] = []
    seconds = None
    machine = with_dynamics(machine)
    try:
        for name, moves in (("direct", len(program)), ("written", len(nc))):
            if moves > MOST_MOVES:
                left_out.append(f"The {name} path has {moves:,} moves; its speed is planned up to {MOST_MOVES:,}.")
            elif name == "direct":
                machine = _that_follows(machine, program, settings)
                laws[name] = direct(program, limits, "velocity_jump", settings=settings, machine=machine)
            else:
                laws[name] = plan_text(nc, limits, settings=settings, machine=machine)
    except SettingsError as refused:
        left_out.append(f"No speed is planned: {refused.what}" + (f" (line {refused.line})." if refused.line else "."))
    for name, law in laws.items():
        if name == "written":
            at = _coordinates(law, nc, written, settings.axis_length)
            ways[name] = at, written.way
            seconds = law.times_at(at)
        else:
            ways[name] = _places(law, original.way)
    return Planned(laws, ways, seconds, tuple(left_out))


def _that_follows(machine: Machine | None, program: Program, settings: Settings) -> Machine | None:
    """Return the machine, without limits of its rotary axes where cuts go beyond them: texts may leave such cuts."""
    if machine is None:
        return None
    tolerance = np.degrees(settings.tolerance / settings.axis_length)
    try:
        rotary_angles(machine, program.tip, program.axis, tolerance=tolerance, rapid=rapid_moves(program.kind))
    except InputError as refused:
        if refused.code == "CS362":
            return endless(machine)
        raise
    return machine


def feed_seconds(written: WrittenPath, rapid: float) -> Floats:
    """When points are passed at programmed feed, without any acceleration; `rapid` is in mm/min."""
    feed = np.where(written.rapid | ~(written.feed > 0.0), rapid, written.feed)
    return np.cumsum(60.0 * _steps(written) / feed)


def _steps(written: WrittenPath) -> Floats:
    """(m,) mm: way of the tip to each point from the one before."""
    return norm(np.diff(written.tip, axis=0, prepend=written.tip[:1]))


def clock(planned: Planned, name: str, ways: Floats) -> Floats:
    """When a motion passes places (k,) of the original path, s."""
    law, (coordinate, way) = planned.laws[name], planned.ways[name]
    # the map may be vertical where the original is only turned: a little slope keeps it one to one
    return law.times_at(np.interp(ways, way + 1e-9 * np.arange(len(way)), coordinate))


def speeds_over(law: TimeLaw, times: Floats) -> Floats:
    """Speed, mm/min, at times (k,) s; NaN in rapids and after the end."""
    at, speed = law.kinematics(times)[:2]
    path = law.path
    if len(path):
        element = np.clip(np.searchsorted(law.edge, at, side="right") - 1, 0, len(path) - 1)
        speed = np.where(path.rapid[element], np.nan, np.where(path.turning[element], 0.0, speed))
    return np.where(times <= law.total, 60.0 * speed, np.nan)


def axis_loads(law: TimeLaw, times: Floats, feeding: Bools) -> dict[str, Floats]:
    """Speeds (k,) of a machine's axes in per cent of their limits, NaN in rapids; axes without one are left out."""
    if law.machine_axes is None:
        return {}
    limit = law.machine_axes.limits[0]
    speed = np.abs(law.axes_at(times)[1]).T
    return {
        law.machine_axes.names[index]: np.where(feeding, 100.0 * speed[index] / limit[index], np.nan)
        for index in np.flatnonzero(np.isfinite(limit)).tolist()
    }


def looks(steps: Floats) -> Floats:
    """Places where each step between (k + 1,) places is looked at: (`_LOOKS` k,)."""
    count = len(steps) - 1
    return np.interp(np.linspace(0.0, count, count * _LOOKS, endpoint=False), np.arange(count + 1), steps)


def ends_of_steps(values: Floats) -> Floats:
    """Lowest and highest value of each step in the order in which they come: (2 k,)."""
    looks = values.reshape(-1, _LOOKS)
    low, high = np.nan_to_num(looks, nan=np.inf), np.nan_to_num(looks, nan=-np.inf)
    early = (low.argmin(axis=1) < high.argmax(axis=1))[:, None]
    found = np.stack((low.min(axis=1), high.max(axis=1)), axis=1)
    found = np.where(early, found, found[:, ::-1]).ravel()
    return np.where(np.isfinite(found), found, np.nan)


def _places(law: TimeLaw, way: Floats) -> tuple[Floats, Floats]:
    """Path coordinates of the ends of moves, and the ways along the original there; `way` by pose."""
    path = law.path
    if not len(path):
        return np.zeros(1), np.zeros(1)
    last = np.flatnonzero(np.concatenate((path.move[1:] != path.move[:-1], [True])))
    coordinate = np.concatenate(([0.0], law.edge[last + 1]))
    return coordinate, np.maximum.accumulate(np.concatenate(([way[path.start[0]]], way[path.move[last]])))


def _coordinates(law: TimeLaw, nc: NcProgram, written: WrittenPath, axis_length: float) -> Floats:
    """Path coordinates (m,) of the points of the written path, ascending."""
    last = np.searchsorted(written_motion(nc, "", axis_length).element, np.arange(len(nc)), side="right") - 1
    reached = np.maximum.accumulate(law.edge[np.searchsorted(law.path.move, last, side="right")])
    # within an element in proportion to the way; to the share where the tip stands still
    element, gone = written.element, np.cumsum(_steps(written))
    ends = np.flatnonzero(np.append(element[1:] != element[:-1], True))
    own = np.searchsorted(element[ends], element)
    begin = np.concatenate(([0.0], gone[ends]))[own]
    length = gone[ends][own] - begin
    share = np.divide(gone - begin, length, out=written.share.copy(), where=length > 0.0)
    before = np.concatenate(([0.0], reached))[element]
    return np.maximum.accumulate(before + share * (reached[element] - before))
