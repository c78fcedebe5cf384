"""The motion of an NC text as a program to plan: what runs is the text, with its digits, lines and feeds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cornersmooth.arrays import dot, norm, unit
from cornersmooth.errors import SettingsError
from cornersmooth.feedrate.curves import Curves, polynomial
from cornersmooth.feedrate.intervals import Resolution
from cornersmooth.feedrate.machine_axes import follow
from cornersmooth.feedrate.path import Path, Words, build_path
from cornersmooth.feedrate.planner import Progress, plan_along
from cornersmooth.feedrate.timelaw import TimeLaw, peak_speed
from cornersmooth.kinematics import Machine, endless
from cornersmooth.model import Arcs, Bools, FeedMode, Floats, Ints, Move, Program, Source, Statement
from cornersmooth.nc_reader.elements import Element, NcProgram
from cornersmooth.nc_reader.tool import groups
from cornersmooth.settings import Limits, Settings

#: what a motion block does, as a move
_MOVES = {Element.RAPID: Move.RAPID, Element.LINE: Move.LINEAR, Element.ARC: Move.ARC, Element.CURVE: Move.LINEAR}

#: parts of blocks add up to whole ones but for this
_PART_OF_A_BLOCK = 1e-6

#: steps of the digits by which a tip that stands may be off, and the part of the way of the axis point that this is
_DIGITS, _STANDING = 2.0, 0.02

#: minutes: no block takes less
_SHORTEST = 1e-9

#: letters of words at which the motion stops; G only where it dwells
_STOPPING = ("M", "T")
_DWELL = 4.0


@dataclass(frozen=True)
class BlockLimits:
    """What a control makes of blocks, however fast the machine."""

    block_time: float = 0.0  #: s: shortest time for one block; 0 for none
    #: Blocks that the control knows besides the one that it runs: within them it must be able to stop. None for all.
    look_ahead: int | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.block_time < np.inf:
            raise SettingsError("CS260", f"block_time is {self.block_time:g}", "give 0 or more")
        if self.look_ahead is not None and self.look_ahead < 1:
            raise SettingsError("CS260", f"look_ahead is {self.look_ahead}", "give 1 or more")


@dataclass(frozen=True)
class WrittenMotion:
    """A text as a program to plan."""

    #: a pose at the end of every element, and at every knot inside of a curve; statements where the motion stops
    program: Program
    curves: Curves | None  #: pieces of the curves between neighbouring knots, each a whole move
    #: (n,): blocks of the text that the move into each pose takes: a part of one where a block is several moves
    blocks: Floats
    element: Ints  #: (n,): element of the text that the move into each pose is, or is a part of
    #: (n,): the move goes on with what rotary words make of one block: the kinks between such moves are not the
    #: machine's
    within: Bools


def written_motion(nc: NcProgram, name: str, axis_length: float = 10.0) -> WrittenMotion:
    """Read the motion of a text; `name` is that of its file, for messages, and `axis_length` in mm."""
    of_curve, *numbers = _curve_pieces(nc, axis_length)
    count = 1 + np.bincount(of_curve, minlength=len(nc)) - (nc.kind == Element.CURVE)
    owner = np.repeat(np.arange(len(nc)), count)
    last = np.cumsum(count) - 1
    tip, lever = nc.tip[owner], (nc.second if nc.second_is == "vector" else nc.second - nc.tip)[owner]
    curves = None
    if len(of_curve):
        bent = np.flatnonzero(nc.kind[owner] == Element.CURVE)
        powers, axis_powers, origin, tip[bent], lever[bent] = numbers
        curves = Curves.pieces(powers, axis_powers, origin, bent)
    move = np.array([_MOVES[Element(kind)] for kind in sorted(Element)], np.uint8)[nc.kind]
    arcs = nc.arcs
    proper = arcs.element > 0
    feed, turning = np.where(nc.kind == Element.RAPID, np.nan, _known_feeds(nc)), nc.per_revolution
    if nc.feed_in_plane:  # an arc that rises is so much faster
        own = arcs.element[proper]
        way = nc.tip[own] - nc.tip[own - 1]
        flat = np.abs(arcs.sweep[proper]) * norm(np.cross(arcs.normal[proper], nc.tip[own] - arcs.centre[proper]))
        feed[own] *= np.hypot(flat, dot(way, arcs.normal[proper])) / flat
    if turning.any():  # with the speed of the spindle it is a feed per minute
        speed = np.full(len(nc), np.nan)
        for event in nc.events:
            if event.letter == "S":
                speed[event.element :] = event.value
        known = turning & (speed > 0.0)
        feed, turning = np.where(known, feed * speed, feed), turning & ~known
    first = np.append(last - count + 1, len(owner))
    same = np.concatenate(([False], (nc.line[owner[1:]] == nc.line[owner[:-1]]) & (nc.rotary is not None)))
    within = same & (nc.kind[owner] != Element.RAPID)
    if nc.rotary is not None:
        tip = _with_turns(tip, axis_length * unit(lever), within, nc.kind[owner] == Element.LINE, nc.tip_step)
    program = Program(
        tip=tip,
        axis=unit(lever),
        kind=move[owner],
        feed=feed[owner],
        line=nc.line[owner],
        feed_mode=np.where(turning, FeedMode.PER_REVOLUTION, FeedMode.PER_MINUTE).astype(np.uint8)[owner],
        keep=np.zeros(len(owner), np.uint8),
        arcs=Arcs(last[arcs.element[proper]], arcs.centre[proper], arcs.normal[proper], arcs.sweep[proper]),
        statements=tuple(
            Statement(int(first[event.element]), event.line, "STOP", (event.value,), event.text)
            for event in nc.events
            if event.letter in _STOPPING or (event.letter == "G" and event.value == _DWELL)
        ),
        units=nc.units,
        source=Source(name, "nc"),
    )
    return WrittenMotion(program, curves, (_blocks(nc) / count)[owner], owner, within)


def _with_turns(tip: Floats, lever: Floats, within: Bools, lines: Bools, step: float) -> Floats:
    """Tips (n, 3), mm, that stand in blocks of rotary words which leave them where they are but for the digits.

    Those would be a way of the tip, at the feed. `within`: rows (n,) that go on with the block of the row before;
    `lever`: axis points from the tips; `step`: what printed digits stand for.
    """
    first = np.flatnonzero(~within)
    last, before = np.append(first[1:], len(tip)) - 1, np.maximum(first - 1, 0)
    way, swing = (norm(ends[last] - ends[before]) for ends in (tip, lever))
    surely = way <= np.minimum(_DIGITS * step, _STANDING * swing)
    # the tip stands on in blocks that follow, up to twice as much: else its digits would let it stop and go
    may = lines[first] & (way <= 2.0 * np.minimum(_DIGITS * step, _STANDING * swing))
    may[:1] = False
    run = np.cumsum(~may)
    stands = may & np.isin(run, run[surely & may])
    moves = ~np.repeat(stands, last - first + 1)
    return tip[np.maximum.accumulate(np.where(moves, np.arange(len(tip)), 0))]


def _curve_pieces(nc: NcProgram, axis_length: float) -> tuple[Any, ...]:
    """Pieces of all curves between neighbouring knots: element, powers of tip and axis point, origin, end, lever there.

    The axis point is brought to `axis_length`, mm, from the tip where a piece begins: a second point may be written at
    any distance, only its direction from the tip counts.
    """
    curves = nc.curves
    if not len(curves):
        return (np.zeros(0, np.int64),)
    degree = int(curves.order.max()) - 1
    parts = []
    for group in groups(curves, np.arange(len(curves))):
        element = curves.element[group.index]
        for k in range(len(group.spans) - 1):
            points, weights = group.bezier(k)
            tip, lever = points[..., :3], points[..., 3:]
            if nc.second_is == "point":
                lever = lever - tip
            lever = lever * (axis_length / norm(lever[:, 0]))[:, None, None]
            local = tip - tip[:, :1]
            powers = np.zeros((2, len(element), degree + 1, 4))
            powers[:, :, : points.shape[1]] = [polynomial(curve, weights) for curve in (local, local + lever)]
            parts.append((element, np.full(len(element), k), *powers, tip[:, 0], tip[:, -1], lever[:, -1]))
    element, number, *others = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    order = np.lexsort((number, element))
    return (element[order], *(column[order] for column in others))


def _known_feeds(nc: NcProgram) -> Floats:
    """(m,) feeds; of blocks of the largest F of inverse time, whose way the digits do not show, the one before.

    What is read for them is only a feed that they are not below.
    """
    unsaid = nc.least_feed & (nc.feed <= nc.feed_room)
    known = np.flatnonzero(~unsaid & (nc.feed > 0.0))
    if not unsaid.any() or not len(known):
        return nc.feed
    before = np.maximum(np.searchsorted(known, np.arange(len(nc))) - 1, 0)
    return np.where(unsaid, nc.feed[known[before]], nc.feed)


def _blocks(nc: NcProgram) -> Floats:
    """(m,) blocks that each element is: a curve is all lines up to the next, lines from one block share it."""
    begins = np.flatnonzero(np.diff(nc.line, prepend=-1) != 0)
    sharing = np.diff(np.append(begins, len(nc)))
    found = np.repeat(1.0 / sharing, sharing)
    curve = nc.curves.element
    following = np.append(nc.line, nc.line[-1:] + 1)[curve + 1]
    known = np.where(curve + 1 < len(nc), following - nc.line[curve], nc.curves.points)
    found[curve] = np.maximum(known, 1)
    return found


def within_blocks(path: Path, limits: Limits, known: BlockLimits, blocks: Floats) -> Path:
    """The path with the speeds that the control's blocks allow; `blocks` (n,) as in `WrittenMotion`.

    A block is passed in `block_time` at the soonest. At the end of each move the control must be able to stop within
    the blocks that it knows, with zero acceleration at both ends: over a length d that is the peak speed of the fastest
    motion from rest to rest over 2·d.
    """
    if not len(path) or (known.block_time == 0.0 and known.look_ahead is None):
        return path
    first = np.flatnonzero(np.concatenate(([True], path.move[1:] != path.move[:-1])))
    move = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(path))))
    length, number = np.add.reduceat(path.length, first), blocks[path.move[first]]
    speed = path.speed.copy()
    if known.block_time > 0.0:
        speed = np.minimum(speed, (length / (number * known.block_time))[move])
    if known.look_ahead is not None:
        speed = np.minimum(speed, _stoppable(length, number, known.look_ahead, limits)[move])
    return replace(path, speed=speed)


def _stoppable(length: Floats, blocks: Floats, look_ahead: int, limits: Limits) -> Floats:
    """(b,) speeds from which the motion can stop within `look_ahead` blocks behind each; inf where no more follow."""
    gone = np.concatenate(([0.0], np.cumsum(length)))
    read = np.concatenate(([0.0], np.cumsum(blocks)))
    until = read[1:] + look_ahead
    ahead = np.interp(until, read, gone) - gone[1:]
    limitless, accel, jerk = (np.full(len(length), value) for value in (np.inf, limits.accel, limits.jerk))
    speed = peak_speed(2.0 * np.maximum(ahead, np.finfo(np.float64).tiny), limitless, accel, jerk)
    return np.where(until >= read[-1] - _PART_OF_A_BLOCK, np.inf, speed)


def block_feeds(law: TimeLaw) -> tuple[Ints, Floats, Floats]:
    """What a plan of a text makes of its blocks.

    Parameters
    ----------
    law : TimeLaw
        As `plan_text` gives it.

    Returns
    -------
    line : (b,) int64
        NC lines of the blocks that feed, ascending; of curves, their first.
    feed : (b,) float64, mm/min
        Mean speed of the tip; NaN where it stands still for a part of the block.
    minutes : (b,) float64
        What each block takes, more than nothing.
    """
    path = law.path
    feeding = np.flatnonzero(~path.rapid)
    if not len(feeding):
        return np.zeros(0, np.int64), np.zeros(0), np.zeros(0)
    minutes = np.diff(law.times_at(law.edge))[feeding] / 60.0
    line = path.program.line[path.move[feeding]]
    first = np.flatnonzero(np.concatenate(([True], line[1:] != line[:-1])))
    length = np.add.reduceat(np.where(path.turning[feeding], np.nan, path.length[feeding]), first)
    taken = np.maximum(np.add.reduceat(minutes, first), _SHORTEST)
    return line[first], length / taken, taken


def plan_text(
    nc: NcProgram,
    limits: Limits | None = None,
    *,
    name: str = "<memory>",
    blocks: BlockLimits | None = None,
    settings: Settings | None = None,
    machine: Machine | None = None,
    resolution: Resolution | None = None,
    progress: Progress | None = None,
) -> TimeLaw:
    """Plan an NC text as its control would run it.

    It raises what `cornersmooth.feedrate.plan` does.

    Corners of lines are passed with a change of velocity of at most ``accel · period``, with a machine of no axis by
    more than its own acceleration allows in one period. Curves are those of the written numbers, so that rounded digits
    bend them: where they join with a kink, what holds for corners holds; and no axis of a machine changes its
    acceleration there by more than its jerk allows in a period.

    Parameters
    ----------
    nc : NcProgram
        As `cornersmooth.nc_reader.read_nc` gives it.
    name : str
        File name for messages.
    settings : Settings, optional
        Says at what distance the axis point is, and which repeated poses are one.
    resolution : Resolution, optional
        How closely; `ROUGHLY` takes a third of the work, and its time is up to 6 % too long.
    progress : callable, optional
        Called with (work done, work in all).
    """
    limits = Limits() if limits is None else limits
    path = text_path(nc, limits, name=name, blocks=blocks, settings=settings)
    # limits of rotary axes are the text's affair: it may turn them back where the path does not show it
    axes = None if machine is None else follow(endless(machine), path)
    return plan_along(path, limits, axes, resolution, progress)


def text_path(
    nc: NcProgram,
    limits: Limits,
    *,
    name: str = "<memory>",
    blocks: BlockLimits | None = None,
    settings: Settings | None = None,
) -> Path:
    """Give the path of an NC text with what its control makes of blocks; parameters are those of `plan_text`."""
    settings = Settings() if settings is None else settings
    motion = written_motion(nc, name, settings.axis_length)
    path = build_path(motion.program, None, settings, limits, curves=motion.curves)
    inside = motion.within[path.move] & ~path.turning & ~np.concatenate(([True], path.turning[:-1]))
    words = None if nc.rotary is None else Words(nc.rotary, nc.tip_control)
    junction_speed = np.where(np.append(inside, False), np.inf, path.junction_speed)
    path = replace(path, junction_speed=junction_speed, words=words)
    return within_blocks(path, limits, BlockLimits() if blocks is None else blocks, motion.blocks)
