"""Rows of lines in rotary words: points where angles need them, inverse time where the control counts so."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.arrays import some_rows
from cornersmooth.arrays.vectors import norm
from cornersmooth.geometry.ragged import spread
from cornersmooth.kinematics import Machine, inverse_time, machine_position, tool_axis
from cornersmooth.methods import METHODS
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program, SmoothProgram
from cornersmooth.nc.circles import ArcAngles
from cornersmooth.nc.form import TIP_SHARE, Form
from cornersmooth.nc.long_rows import LONG_CHUNK, has_law, line_limits, rounded_lines
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.rotary_words import RotaryWay, machine_of
from cornersmooth.nc.statement_args import check_tool_travel
from cornersmooth.rotary import FilledPath, fill, insertions, rapid_moves
from cornersmooth.settings import TIMED_POSES, Settings
from cornersmooth.smoothing.long_lines import LineLimits, Vertices, fewest_lines, segments_of_rows, vertices
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.text import to_ticks

_CHUNK = 1 << 15  #: dense rows handed on at a time
_FASTEST_TURN = 36_000.0  #: deg/min that no rotary axis exceeds where we time its blocks ourselves
#: degrees that a rotary axis turns in one block of a cut at most: far from the half turn where some controls go the
#: other way round
LARGEST_TURN = 60.0
_SHORTEST_TIMES = 1.5  #: shortest times of a block that short ones are merged to
#: part of the tolerance, and turn of an axis in degrees, that such a block may have
_MERGED_SHARE, _MERGED_TURN = 0.8, 5.0
INVERSE_TIME_DECIMALS = 3  #: decimals of F of inverse time: FANUC takes 0.001 to 9999.999
#: parts of a long step at whose ends lines may end, and how long it is beside the longer one of its
#: neighbours, and beside what the axis turns at the axis point
_STATIONS, _LONG_STEP = 2, 0.1
_NO_TURN = 1e-9  #: turns below this many degrees are none


def rotary_rows(
    way: RotaryWay,
    smoothed: SmoothProgram,
    form: Form,
    findings: Findings,
    *,
    long: bool = False,
    in_planes: Bools | None = None,
) -> Iterator[Rows]:
    """Rows of lines with the words of the form's machine in `Rows.other`, and the row of the way that each is.

    Some thousand come at a time, with the points that lines need. Of `long` lines only those are left that ε asks for.
    Poses (n,) `in_planes`, whose rotary axes the control turns, are not compared with the travel. Raises InputError
    where the machine cannot follow the path.
    """
    if not len(way.move):
        return
    program, settings = smoothed.program, smoothed.settings
    machine = machine_of(form).with_longest_tool()
    max_step = largest_turn(settings)
    limits = line_limits(settings, form, max_step)
    # in long programs as many lines take too long to find
    placed = has_law(form) and limits.tip_of is None and len(program) <= TIMED_POSES
    timed = _timed_cuts(way.angles, way.move, program) if form.orientation == "machine" else None
    size = LONG_CHUNK if long else _CHUNK
    for begin in range(0, max(len(way.move) - 1, 1), size):
        here = slice(begin, begin + size + 1)  # the last row of a chunk is the start of the next
        move, left = way.move[here], way.left[here]
        line = program.line[move]
        more = insertions(
            machine,
            way.tip[here],
            way.axis[here],
            way.angles[here],
            tolerance=way.tolerance,
            rapid=way.free[here],
            tip_tolerance=TIP_SHARE * settings.tolerance if form.orientation == "machine" else None,
            max_step=max_step,
            line=line,
            file=program.source.name,
        )
        findings.note_each("CS369", line[more.unsolved + 1])
        findings.note_each("CS367", line[more.segment + 1], names=" and ".join(machine.names))
        filled = fill(way.tip[here], way.axis[here], way.angles[here], more)
        start, at_pose = segments_of_rows(way.move, here.start, here.stop)
        stays = left | np.append(left[1:], False)  # both rows of a place where a cut is left
        chunk = _Chunk(move, start, at_pose, stays, left, None if timed is None else timed[here])
        blend = None
        if long:
            if placed:
                cut = (program.kind[move] == Move.LINEAR) & ~way.free[here]
                filled = _with_stations(filled, cut[filled.pose], limits)
            usual = (way.free[here] | _beside_arcs(move, program))[filled.pose]
            feed = np.where(way.free[here] | ~_cuts(move, program), np.inf, program.feed[move] / 60.0)[filled.pose]
            found = chunk.vertices(filled, smoothed)
            found, kept, blend = rounded_lines(found, usual, feed, limits, settings, form, placed=placed)
            filled = some_rows(replace(filled, tip=found.tip, angles=found.words), kept)
        own = slice(1 if begin else 0, None)
        filled, rate = _timed(filled, chunk, own, smoothed, form, limits, findings)
        pose, inserted = filled.pose[own], filled.inserted[own]
        tip, angles = filled.tip[own], filled.angles[own]
        seen = slice(None) if in_planes is None else ~in_planes[move[pose]]
        check_tool_travel(program, machine_of(form), tip[seen], angles[seen], move[pose[seen]])
        yield Rows(
            tip=tip,
            other=angles,
            move=move[pose],
            curve=np.zeros(len(pose), np.int8),
            joined=np.zeros(len(pose), np.bool_),
            rate=None if rate is None else rate[own],
            blend=None if blend is None else blend[own],
            left=left[pose] & ~inserted if way.left.any() else None,
        )


def arc_angles(way: RotaryWay, program: Program, form: Form) -> ArcAngles:
    """Rotary words on the arcs of a program, from the rows of a way."""
    pose, count = program.arcs.pose, len(program.arcs)
    own = np.full(len(program), -1, np.int64)
    own[pose] = np.arange(count)
    rows = np.flatnonzero(own[way.move] >= 0)
    arc = own[way.move[rows]]
    turns = (np.diff(to_ticks(way.angles, (form.table.digits.angle,) * 2), axis=0, prepend=0) != 0).any(axis=1)
    if form.orientation == "machine":
        turns |= _timed_cuts(way.angles, way.move, program)
    stand, angles = np.ones(count, np.bool_), np.zeros((count, 2))
    stand[arc[turns[rows]]] = False
    angles[arc] = way.angles[rows]
    return ArcAngles(angles, stand)


def largest_turn(settings: Settings) -> float:
    """Degrees that a rotary axis may turn in one block of a cut."""
    return min(settings.axis_step or LARGEST_TURN, LARGEST_TURN)


@dataclass(frozen=True)
class _Chunk:
    """Rows of a way, n of them."""

    #: move, start: (n,); move of each, and the pose that its segment starts from
    move: Ints
    start: Ints
    #: at_pose, held, left: (n,); whether it is the last of its move, stays whatever ε allows, and comes back into a cut
    #: that was left
    at_pose: Bools
    held: Bools
    left: Bools
    timed: Bools | None  #: (n,) whether it is timed by us; None where only turns are that

    def vertices(self, filled: FilledPath, smoothed: SmoothProgram) -> Vertices:
        """Where the original motion is at the rows of a path that was made of these."""
        row, own = filled.pose, ~filled.inserted
        at_pose = self.at_pose[row] & own
        found = vertices(smoothed, filled.tip, filled.axis, filled.angles, self.move[row], self.start[row], at_pose)
        return replace(found, fixed=found.fixed | (self.held[row] & own))


def _with_stations(filled: FilledPath, cut: Bools, limits: LineLimits) -> FilledPath:
    """The path with places on the long steps of cuts, (m,) of its rows, at which lines may end, too."""
    length = np.pad(norm(np.diff(filled.tip, axis=0)), 1)
    number = np.ones(len(length) - 1, np.int64)
    turn = limits.axis_length * norm(np.diff(filled.axis, axis=0))
    long = length[1:-1] > _LONG_STEP * np.maximum(np.maximum(length[:-2], length[2:]), turn)
    number[1:][cut[1:] & long] = _STATIONS
    row, place = spread(number)
    part, added = ((place + 1.0) / number[row])[:, None], place + 1 < number[row]

    def between(values: Floats) -> Floats:
        before = values[np.maximum(row - 1, 0)]
        return np.where(added[:, None], before + part * (values[row] - before), values[row])

    angles = between(filled.angles)
    return FilledPath(
        filled.pose[row], added | filled.inserted[row], between(filled.tip), limits.axis_of(angles), angles
    )


def _timed(
    filled: FilledPath,
    chunk: _Chunk,
    own: slice,
    smoothed: SmoothProgram,
    form: Form,
    limits: LineLimits,
    findings: Findings,
) -> tuple[FilledPath, Floats | None]:
    """The path without rows that are too short to be timed by us, and moves per minute; those of `own` count."""
    program, settings, fastest = smoothed.program, smoothed.settings, form.mode.motion.fastest
    rate = _rates(filled, chunk, program, settings, form)
    if rate is None:
        return filled, None
    if fastest:
        if form.orientation == "machine" and (rate > fastest).any():
            before = len(filled.pose)
            filled = _merged(smoothed, machine_of(form).with_longest_tool(), filled, chunk, rate, limits, fastest)
            if len(filled.pose) < before:
                findings.note("CS372", 0, before - len(filled.pose))
            rate = _rates(filled, chunk, program, settings, form)
        assert rate is not None
        beyond = filled.pose[own][rate[own] > fastest]
        findings.note_each("CS371", program.line[chunk.move[beyond]], fastest=fastest)
        rate = np.minimum(rate, fastest)
    return filled, np.round(rate, INVERSE_TIME_DECIMALS)


def _merged(
    smoothed: SmoothProgram,
    machine: Machine,
    filled: FilledPath,
    chunk: _Chunk,
    rate: Floats,
    limits: LineLimits,
    fastest: float,
) -> FilledPath:
    """The path without rows between blocks that are too short to be timed, as far as ε allows.

    Parameters
    ----------
    rate : (m,) float64, 1/min
    """
    found = chunk.vertices(filled, smoothed)
    fixed = found.fixed
    quick = rate > fastest
    minutes = np.where(np.isfinite(rate), 1.0 / np.where(rate > 0.0, rate, 1.0), 0.0)
    # a row stays where it ends a part of the time that is long enough
    part = np.floor(np.cumsum(minutes) * fastest / _SHORTEST_TIMES)
    ends = np.append(part[1:] != part[:-1], True)
    between = quick | np.append(quick[1:], False)
    position = machine_position(machine, filled.tip, filled.angles)
    # the way between two rows bends, too: what turns little bends little
    limits = replace(
        limits,
        tip=_MERGED_SHARE * limits.tip,
        axis_point=_MERGED_SHARE * limits.axis_point,
        turn=min(limits.turn, _MERGED_TURN),
    )
    if not METHODS[smoothed.settings.method].one_parameter:
        fixed = fixed | _beside_far_corners(found, chunk.at_pose[filled.pose] & ~filled.inserted, limits)
    kept = fewest_lines(replace(found, fixed=fixed | ends | ~between, position=position), limits)
    return some_rows(filled, kept)


def _beside_far_corners(rows: Vertices, at_pose: Bools, limits: LineLimits) -> Bools:
    """(m,) bool: rows of the two moves at poses that the motion is far from at their own parameter.

    Where tip and axis point run by parameters of their own, another row may be the one that is near the pose.
    """
    axis_point = rows.tip + limits.axis_length * limits.axis_of(rows.words)
    off_tip, off_axis_point = norm(rows.tip - rows.original_tip), norm(axis_point - rows.original_axis_point)
    far = at_pose & ((off_tip > limits.tip) | (off_axis_point > limits.axis_point))
    move = np.concatenate(([0], np.cumsum(at_pose)[:-1]))
    return np.isin(move, move[far]) | np.isin(move, move[far] + 1)


def _beside_arcs(move: Ints, program: Program) -> Bools:
    """(n,) rows on arcs, and those after which one begins: how far they may be rounded is measured on lines alone."""
    bent: Bools = program.kind[move] == Move.ARC
    return bent | np.append(bent[1:], False)


def _cuts(move: Ints, program: Program) -> Bools:
    """(n,) rows of cuts with a feed per minute."""
    return ~rapid_moves(program.kind)[move] & (program.feed_mode[move] == FeedMode.PER_MINUTE)


def _timed_cuts(angles: Floats, move: Ints, program: Program) -> Bools:
    """(n,) rows of cuts in which a rotary axis turns: a whole cut is timed in one way."""
    cut = _cuts(move, program)
    begins = cut & ~np.concatenate(([False], cut[:-1]))
    run = np.cumsum(begins) - 1
    turning = np.zeros(max(int(begins.sum()), 1), np.bool_)
    turns = cut & (np.abs(np.diff(angles, axis=0, prepend=angles[:1])).max(axis=1) > _NO_TURN)
    turning[run[turns]] = True
    return cut & turning[np.maximum(run, 0)]


def _rates(path: FilledPath, chunk: _Chunk, program: Program, settings: Settings, form: Form) -> Floats | None:
    """(m,) moves per minute where blocks are timed by us, NaN elsewhere; None where none is.

    Where the tip stands still, the axis point runs with the feed: so it does where the tip stays within ε and the axis
    point does not.
    """
    timed = chunk.timed
    if timed is None and not form.mode.timed_turns:
        return None
    own = chunk.move[path.pose]
    step = np.diff(path.tip, axis=0, prepend=path.tip[:1])
    axis = tool_axis(machine_of(form), path.angles)  # near the pole not that of the row
    swing = step + settings.axis_scale * np.diff(axis, axis=0, prepend=axis[:1])
    length = norm(step)
    digits = form.rounding(program.units)
    still = (length < digits) | ((length < settings.tolerance) & (norm(swing) > settings.tolerance))
    turn = np.abs(np.diff(path.angles, axis=0, prepend=path.angles[:1])).max(axis=1)
    chosen = _cuts(own, program) & still & (turn > _NO_TURN) if timed is None else timed[path.pose]
    if not chosen.any():
        return None
    way = np.maximum(np.where(still, norm(swing), length), digits)  # what is written at all moves by a digit
    rate = np.full(len(own), np.nan)
    rate[chosen] = inverse_time(way[chosen], program.feed[own[chosen]], turn[chosen], _FASTEST_TURN)
    rate[~np.isfinite(rate)] = np.nan
    back = chunk.left[path.pose] & ~path.inserted
    if back.any():
        rate[back] = program.feed[own[back]] / form.rewind if timed is not None else np.nan
        rate[back & ~chosen] = np.nan
    return rate
