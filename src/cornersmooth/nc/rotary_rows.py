"""Rows of lines as a form needs them: as few as ε allows, points for rotary words, inverse time where it counts so."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.arrays import norm, some_rows, spread, unit
from cornersmooth.kinematics import machine_position, tip_position, tool_axis
from cornersmooth.kinematics.machine import LINEAR
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program, SmoothProgram, rapid_moves
from cornersmooth.nc.control import INVERSE_TIME_DECIMALS
from cornersmooth.nc.form import TIP_SHARE, Form
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.rotary_words import RotaryWay, machine_of
from cornersmooth.nc.statement_args import check_tool_travel
from cornersmooth.rotary import FilledPath, filled_path
from cornersmooth.settings import METHODS, TIMED_POSES, Settings
from cornersmooth.smoothing.blending import largest_blends
from cornersmooth.smoothing.long_lines import LineLimits, Vertices, fewest_lines, segments_of_rows, vertices
from cornersmooth.smoothing.outside_lines import faster_lines
from cornersmooth.smoothing.runs.rows import Rows
from cornersmooth.smoothing.sampling import ArcBlocks, all_dense_rows
from cornersmooth.text import to_ticks

_CHUNK = 1 << 15  #: dense rows handed on at a time
_FASTEST_TURN = 36_000.0  #: deg/min that no rotary axis exceeds where we time its blocks ourselves
#: degrees that a rotary axis turns in one block of a cut at most: far from the half turn where some controls go the
#: other way round
LARGEST_TURN = 60.0
_SHORTEST_TIMES = 1.5  #: shortest times of a block that short ones are merged to
#: part of the tolerance, and turn of an axis in degrees, that such a block may have
_MERGED_SHARE, _MERGED_TURN = 0.8, 5.0
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
    max_step = min(settings.axis_step or LARGEST_TURN, LARGEST_TURN)
    limits = line_limits(settings, form, max_step)
    # lines are placed where it is known when the control reaches their ends; in long programs that takes too long
    known = form.table.lines.rounding and form.table.lines.planner and limits.tip_of is None
    limited = {axis.name for axis in machine.dynamics}.issuperset((*LINEAR, *machine.names))
    placed = bool(known) and limited and len(program) <= TIMED_POSES
    timed = _timed_cuts(way.angles, way.move, program) if form.orientation == "machine" else None
    size = LONG_CHUNK if long else _CHUNK
    for begin in range(0, max(len(way.move) - 1, 1), size):
        here = slice(begin, begin + size + 1)  # the last row of a chunk is the start of the next
        part = some_rows(way, here)
        move, path = part.move, (part.tip, part.axis, part.angles)
        line = program.line[move]
        filled, jumps = filled_path(
            machine,
            *path,
            tolerance=way.tolerance,
            rapid=part.free,
            tip_tolerance=TIP_SHARE * settings.tolerance if form.orientation == "machine" else None,
            max_step=max_step,
            line=line,
            file=program.source.name,
        )
        findings.note_each("CS369", line[jumps + 1])
        findings.note_each("CS367", line[filled.pose[filled.inserted]], names=" and ".join(machine.names))
        segments = segments_of_rows(way.move, here.start, here.stop)
        chunk = _Chunk(part, smoothed, form, limits, *segments, None if timed is None else timed[here])
        blend = None
        if long:
            if placed:
                cut = (program.kind[move] == Move.LINEAR) & ~part.free
                filled = _with_stations(filled, cut[filled.pose], limits)
            bent = program.kind[move] == Move.ARC  # how far rows may be rounded is measured on lines alone
            usual = (part.free | bent | np.append(bent[1:], False))[filled.pose]
            feed = np.where(part.free | ~_cuts(move, program), np.inf, program.feed[move] / 60.0)[filled.pose]
            found = chunk.vertices(filled)
            found, kept, blend = rounded_lines(found, usual, feed, limits, settings, form, placed=placed)
            filled = some_rows(replace(filled, tip=found.tip, angles=found.words), kept)
        own = slice(1 if begin else 0, None)
        filled, rate = chunk.in_time(filled, own, findings)
        pose, inserted = filled.pose[own], filled.inserted[own]
        tip, angles = filled.tip[own], filled.angles[own]
        seen = slice(None) if in_planes is None else ~in_planes[move[pose]]
        check_tool_travel(program, machine_of(form), tip[seen], angles[seen], move[pose[seen]])
        none = np.zeros(len(pose), np.int8), np.zeros(len(pose), np.bool_)
        rate, blend = (None if some is None else some[own] for some in (rate, blend))
        left = part.left[pose] & ~inserted if way.left.any() else None
        yield Rows(tip, angles, move[pose], *none, rate=rate, blend=blend, left=left)


def arc_angles(way: RotaryWay, program: Program, form: Form) -> tuple[Floats, Bools]:
    """Rotary words on the arcs of a program, as of `plan_circles`, from the rows of a way."""
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
    return angles, stand


@dataclass(frozen=True)
class _Chunk:
    """Rows of a way, n of them, and what they are written for."""

    way: RotaryWay
    smoothed: SmoothProgram
    form: Form
    limits: LineLimits
    start: Ints  #: (n,) the pose that the segment of each starts from
    at_pose: Bools  #: (n,) whether it is the last of its move
    timed: Bools | None  #: (n,) whether it is timed by us; None where only turns are that

    def vertices(self, filled: FilledPath) -> Vertices:
        """Where the original motion is at the rows of a path that was made of these."""
        row, own, left = filled.pose, ~filled.inserted, self.way.left
        held = left | np.append(left[1:], False)  # both rows of a place where a cut is left
        words, move = (filled.tip, filled.axis, filled.angles), self.way.move[row]
        found = vertices(self.smoothed, *words, move, self.start[row], self.at_pose[row] & own)
        return replace(found, fixed=found.fixed | (held[row] & own))

    def in_time(self, filled: FilledPath, own: slice, findings: Findings) -> tuple[FilledPath, Floats | None]:
        """The path without rows that are too short to be timed by us, and moves per minute; those of `own` count."""
        rate, fastest = self._rates(filled), self.form.mode.fastest or math.inf
        if rate is None:
            return filled, None
        # rows of two parameters are not compared with the motion at their own
        one_parameter = METHODS[self.smoothed.settings.method].one_parameter
        if self.form.orientation == "machine" and one_parameter and (rate > fastest).any():
            before, filled = len(filled.pose), self._merged(filled, rate, fastest)
            findings.note_each("CS372", np.zeros(before - len(filled.pose), np.int64))
            rate = self._rates(filled)
            assert rate is not None
        beyond = filled.pose[own][rate[own] > fastest]
        findings.note_each("CS371", self.smoothed.program.line[self.way.move[beyond]], fastest=fastest)
        rate = np.minimum(rate, fastest)
        return filled, np.round(rate, INVERSE_TIME_DECIMALS)

    def _merged(self, filled: FilledPath, rate: Floats, fastest: float) -> FilledPath:
        """The path without rows between blocks that are too short to be timed (m,), 1/min, as far as ε allows."""
        found, limits = self.vertices(filled), self.limits
        fixed = found.fixed
        quick = rate > fastest
        minutes = np.where(np.isfinite(rate), 1.0 / np.where(rate > 0.0, rate, 1.0), 0.0)
        # a row stays where it ends a part of the time that is long enough
        part = np.floor(np.cumsum(minutes) * fastest / _SHORTEST_TIMES)
        ends = np.append(part[1:] != part[:-1], True)
        between = quick | np.append(quick[1:], False)
        position = machine_position(machine_of(self.form).with_longest_tool(), filled.tip, filled.angles)
        # the way between two rows bends, too: what turns little bends little
        tip, axis_point = _MERGED_SHARE * limits.tip, _MERGED_SHARE * limits.axis_point
        limits = replace(limits, tip=tip, axis_point=axis_point, turn=min(limits.turn, _MERGED_TURN))
        kept = fewest_lines(replace(found, fixed=fixed | ends | ~between, position=position), limits)
        return some_rows(filled, kept)

    def _rates(self, path: FilledPath) -> Floats | None:
        """(m,) moves per minute where blocks are timed by us, NaN elsewhere; None where none is."""
        timed, form, program, settings = self.timed, self.form, self.smoothed.program, self.smoothed.settings
        if timed is None and not form.mode.timed_turns:
            return None
        own = self.way.move[path.pose]
        step = np.diff(path.tip, axis=0, prepend=path.tip[:1])
        axis = tool_axis(machine_of(form), path.angles)  # near the pole not that of the row
        swing = step + settings.axis_scale * np.diff(axis, axis=0, prepend=axis[:1])
        length = norm(step)
        digits = form.rounding(program.units)
        # where the tip stands, or stays within ε while the axis point does not, that point runs with the feed
        still = (length < digits) | ((length < settings.tolerance) & (norm(swing) > settings.tolerance))
        turn = np.abs(np.diff(path.angles, axis=0, prepend=path.angles[:1])).max(axis=1)
        chosen = _cuts(own, program) & still & (turn > _NO_TURN) if timed is None else timed[path.pose]
        if not chosen.any():
            return None
        way = np.maximum(np.where(still, norm(swing), length), digits)  # what is written at all moves by a digit
        rate = np.full(len(own), np.nan)
        rate[chosen] = 1.0 / np.maximum(way[chosen] / program.feed[own[chosen]], turn[chosen] / _FASTEST_TURN)
        back = self.way.left[path.pose] & ~path.inserted
        if back.any():
            rate[back] = program.feed[own[back]] / form.rewind if timed is not None else np.nan
            rate[back & ~chosen] = np.nan
        return rate


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


LONG_CHUNK = 1 << 17  #: rows handed on at a time: many long lines are tested at once
_COARSE = 1.0  #: chord tolerance that leaves transitions with as few lines as their change of axis allows, mm
#: longest change of a tool vector in one line: controls that turn it evenly in angle and those that turn it evenly in
#: its words are less than 1e-5 rad apart then (θ³/54)
_LARGEST_STEP = 0.08


def coarse_rows(smoothed: SmoothProgram, arcs: ArcBlocks | None = None) -> Rows:
    """Dense rows without those that only the chord tolerance asks for.

    Chords from the joints of a transition to its middle keep ε where one parameter drives both curves; else all stay.
    """
    settings = smoothed.settings
    if METHODS[settings.method].one_parameter:
        settings = settings.but(chord_tolerance=_COARSE)
    return all_dense_rows(replace(smoothed, settings=settings), arcs)


def line_limits(settings: Settings, form: Form, largest_turn: float = 0.0) -> LineLimits:
    """What lines with tool vectors, or with rotary words of a machine (at most `largest_turn` degrees), must keep."""
    machine = form.machine if form.rotary else None
    lag = form.table.lines.lag
    step = _LARGEST_STEP if machine is None else largest_turn
    if settings.axis_step is not None:
        step = min(step, math.radians(settings.axis_step) if machine is None else settings.axis_step)
    return LineLimits(
        *settings.line_tolerances,
        step,
        settings.axis_length,
        unit if machine is None else lambda words: tool_axis(machine, words),
        settings.blend_share * settings.tolerance,
        lag * settings.tolerance if lag else math.inf,
        (lambda position, words: tip_position(machine, position, words))
        if machine is not None and form.orientation == "machine"
        else None,
        rotary=machine is not None,
    )


def rounded_lines(
    rows: Vertices, usual: Bools, feed: Floats, limits: LineLimits, settings: Settings, form: Form, *, placed: bool
) -> tuple[Vertices, Ints, Floats | None]:
    """Rows, those (k,) at which lines end, and how far the control may round corners there.

    That is in mm, None where one value holds for all; at rows (r,) that are `usual` it is that of the settings. Rows
    that are `placed` are moved off the path where lines are faster so, with `feed` (r,) in mm/s, inf for none.
    """
    style = form.table.lines

    def blends(rows: Vertices, kept: Ints) -> Floats:
        found = largest_blends(rows, kept, limits, settings.tolerance, style.executed_share * settings.tolerance)
        return np.where(usual[kept], limits.blend, found)

    def ends_reached(rows: Vertices, kept: Ints) -> Floats:
        from cornersmooth.feedrate.linuxcnc import FUZZ, Lines, axis_limits, line_times  # with all of feedrate

        assert form.machine is not None
        place = np.zeros((len(kept), 6))
        place[:, [*range(3), *map("XYZABC".index, form.machine.names)]] = np.hstack((rows.tip, rows.words))[kept]
        moves = np.flatnonzero((np.abs(np.diff(place, axis=0)) >= FUZZ).any(axis=1))
        lines = Lines(place[moves], place[moves + 1], feed[kept[moves + 1]], blends(rows, kept)[moves + 1])
        time = np.zeros(len(kept))
        time[moves + 1] = line_times(lines, axis_limits(form.machine, lines))[1]
        return np.maximum.accumulate(time)

    if placed:
        rows, kept = faster_lines(rows, limits, ends_reached)
    else:
        kept = fewest_lines(rows, limits)
    return rows, kept, blends(rows, kept) if style.rounding else None


def long_rows(rows: Rows, smoothed: SmoothProgram, form: Form) -> Iterator[Rows]:
    """Rows with tool vectors at which long lines end; arcs stay as they are."""
    tip, axis, move = rows.tip, rows.other, rows.move
    if not len(move):
        return
    limits = line_limits(smoothed.settings, form)
    for begin in range(0, max(len(move) - 1, 1), LONG_CHUNK):
        here = slice(begin, begin + LONG_CHUNK + 1)  # the last row of a chunk is the start of the next
        start, at_pose = segments_of_rows(move, here.start, here.stop)
        part = vertices(smoothed, tip[here], axis[here], axis[here], move[here], start, at_pose)
        kept = begin + fewest_lines(part, limits)[1 if begin else 0 :]
        yield Rows(tip[kept], axis[kept], move[kept], np.zeros(len(kept), np.int8), np.zeros(len(kept), np.bool_))
