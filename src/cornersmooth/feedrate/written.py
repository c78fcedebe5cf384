"""The motion of an NC text as a program to plan: what runs is the text, with its digits, lines and feeds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import scurve
from cornersmooth.feedrate.limits import Limits
from cornersmooth.feedrate.path import Path, build_path
from cornersmooth.feedrate.planner import Progress, plan_path
from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.kinematics import Machine
from cornersmooth.model import Arcs, FeedMode, Floats, Move, Program, Source, Statement
from cornersmooth.nc_reader.elements import Element, Event, NcProgram
from cornersmooth.settings import Settings
from cornersmooth.vectors import unit

#: what a motion block does, as a move
_MOVES = {Element.RAPID: Move.RAPID, Element.LINE: Move.LINEAR, Element.ARC: Move.ARC, Element.CURVE: Move.LINEAR}

#: letters of words at which the motion stops; G only where it dwells
_STOPPING = ("M", "T")
_DWELL = 4.0


@dataclass(frozen=True)
class BlockLimits:
    """What a control makes of blocks, however fast the machine.

    Parameters
    ----------
    block_time : float, s
        Shortest time for one block; 0 for none.
    look_ahead : int or None
        Blocks that the control knows besides the one that it runs: within them it must be able to stop. None for all.
    """

    block_time: float = 0.0
    look_ahead: int | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.block_time < np.inf:
            raise SettingsError("CS260", f"block_time is {self.block_time:g}", "give 0 or more")
        if self.look_ahead is not None and self.look_ahead < 1:
            raise SettingsError("CS260", f"look_ahead is {self.look_ahead}", "give 1 or more")


def written_program(nc: NcProgram, name: str) -> Program:
    """The text as a program: a pose at the end of every motion block, statements where the motion stops.

    Parameters
    ----------
    nc : NcProgram
        As `cornersmooth.nc_reader.read_nc` gives it.
    name : str
        File name for messages.
    """
    if len(nc.curves):
        raise SettingsError(
            "CS264", "the text has curves, and only lines and arcs of a text can be planned", "give a text of lines"
        )
    move = np.array([_MOVES[Element(kind)] for kind in sorted(Element)], np.uint8)[nc.kind]
    arcs = nc.arcs
    proper = arcs.element > 0
    feed = np.where(nc.kind == Element.RAPID, np.nan, nc.feed)
    return Program(
        tip=nc.tip,
        axis=unit(nc.second if nc.second_is == "vector" else nc.second - nc.tip),
        kind=move,
        feed=feed,
        line=nc.line,
        feed_mode=np.where(nc.per_revolution, FeedMode.PER_REVOLUTION, FeedMode.PER_MINUTE).astype(np.uint8),
        keep=np.zeros(len(nc), np.uint8),
        arcs=Arcs(arcs.element[proper], arcs.centre[proper], arcs.normal[proper], arcs.sweep[proper]),
        statements=tuple(
            Statement(event.element, event.line, event.letter, (event.value,), event.text)
            for event in nc.events
            if _stops(event)
        ),
        units=nc.units,
        source=Source(name, "nc"),
    )


def _stops(event: Event) -> bool:
    return event.letter in _STOPPING or (event.letter == "G" and event.value == _DWELL)


def within_blocks(path: Path, limits: Limits, blocks: BlockLimits) -> Path:
    """The path with the speeds that the control's blocks allow; every move of the path is a block.

    A block is passed in `block_time` at the soonest. At the end of each the control must be able to stop within those
    that it knows, with zero acceleration at both ends: over a length d that is the peak speed of the fastest motion
    from rest to rest over 2·d.
    """
    if not len(path) or (blocks.block_time == 0.0 and blocks.look_ahead is None):
        return path
    first = np.flatnonzero(np.concatenate(([True], path.move[1:] != path.move[:-1])))
    block = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(path))))
    length = np.add.reduceat(path.length, first)
    speed = path.speed.copy()
    if blocks.block_time > 0.0:
        speed = np.minimum(speed, length[block] / blocks.block_time)
    if blocks.look_ahead is not None:
        speed = np.minimum(speed, _stoppable(length, blocks.look_ahead, limits)[block])
    return replace(path, speed=speed)


def _stoppable(length: Floats, look_ahead: int, limits: Limits) -> Floats:
    """(b,) speeds from which the motion can stop within `look_ahead` blocks behind each; inf where no more follow."""
    gone = np.concatenate(([0.0], np.cumsum(length)))
    behind = np.arange(1, len(length) + 1)
    known = gone[np.minimum(behind + look_ahead, len(length))] - gone[behind]
    limitless, accel, jerk = (np.full(len(length), value) for value in (np.inf, limits.accel, limits.jerk))
    speed = scurve.peak_speed(2.0 * np.maximum(known, np.finfo(np.float64).tiny), limitless, accel, jerk)
    return np.where(behind + look_ahead >= len(length), np.inf, speed)


def plan_text(
    nc: NcProgram,
    limits: Limits | None = None,
    *,
    name: str = "<memory>",
    blocks: BlockLimits | None = None,
    settings: Settings | None = None,
    machine: Machine | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan an NC text as its control would run it.

    Corners of lines are passed with a change of velocity of at most ``accel · period``, with a machine of no axis by
    more than its own acceleration allows in one period.

    Parameters
    ----------
    nc : NcProgram
        As `cornersmooth.nc_reader.read_nc` gives it.
    limits : Limits, optional
    name : str
        File name for messages.
    blocks : BlockLimits, optional
    settings : Settings, optional
        Says at what distance the axis point is, and which repeated poses are one.
    machine : Machine, optional
        Keep the limits of its five axes.
    progress : callable, optional
        Called with (work done, work in all).

    Raises
    ------
    SettingsError
        CS264: the text has curves; a feed move has no feed in mm/min and `Limits.feed` is not given; the machine has no
        dynamics.
    InputError
        The machine does not reach a tool axis.
    """
    limits = Limits() if limits is None else limits
    settings = Settings() if settings is None else settings
    path = build_path(written_program(nc, name), None, settings, limits)
    path = within_blocks(path, limits, BlockLimits() if blocks is None else blocks)
    return plan_path(path, limits, machine=machine, progress=progress)
