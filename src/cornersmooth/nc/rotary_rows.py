"""Rows in rotary words of a machine: angles for tool vectors, points where angles need them, inverse time.

Solution and turn of the rotary axes are chosen with a look ahead over the whole path, so all of its rows are held at
once here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Machine, inverse_time, machine_position, solutions
from cornersmooth.kinematics.travel import check_travel
from cornersmooth.memory import return_free_memory
from cornersmooth.methods import METHODS
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program, SmoothProgram
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import TIP_SHARE, Form
from cornersmooth.nc.long_rows import LONG_CHUNK, corner_blends, line_limits
from cornersmooth.nc.rewinds import from_zero
from cornersmooth.nc.tool_machines import machines_of_rows, tools_of_poses
from cornersmooth.rotary import (
    FilledPath,
    Insertions,
    fill,
    insertions,
    rapid_moves,
    rewound_angles,
    rotary_angles,
    still_poses,
)
from cornersmooth.rotary.axis_findings import reach_error
from cornersmooth.settings import Settings
from cornersmooth.smoothing.long_lines import LineLimits, Vertices, fewest_lines, segments_of_rows, vertices
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.vectors import norm

#: dense rows handed on at a time
CHUNK = 1 << 15

#: deg/min that no rotary axis exceeds where we time its blocks ourselves
_FASTEST_TURN = 36_000.0

#: degrees that a rotary axis turns in one block of a cut at most: far from the half turn where some controls go the
#: other way round
LARGEST_TURN = 60.0

#: shortest times of a block that short ones are merged to
_SHORTEST_TIMES = 1.5

#: part of the tolerance, and turn of an axis in degrees, that such a block may have
_MERGED_SHARE, _MERGED_TURN = 0.8, 5.0

#: decimals of F of inverse time: FANUC takes 0.001 to 9999.999
INVERSE_TIME_DECIMALS = 3

#: turns below this many degrees are none
_NO_TURN = 1e-9


@dataclass
class InsertedPoints:
    """Points that lines of rotary words needed so far, and CL lines where no points help."""

    count: int = 0
    first_line: int = 0
    unsolved: list[int] = field(default_factory=list)

    def add(self, more: Insertions, line: Ints) -> None:
        """Count those of a chunk of rows with these CL lines (n,)."""
        if len(more) and not self.count:
            self.first_line = int(line[more.segment[0] + 1])
        self.count += len(more)
        self.unsolved += line[more.unsolved + 1].tolist()

    def warn(self, findings: Findings) -> None:
        """Name where no points help."""
        if self.unsolved:
            text = (
                "the tool axis jumps further than rotary axes can follow within the tolerance; see what it does there"
            )
            findings.add("CS369", "warning", self.unsolved[0], text, len(self.unsolved))

    def tell(self, machine: Machine, findings: Findings) -> None:
        """Say how many there are."""
        if self.count:
            text = f"point inserted so that {' and '.join(machine.names)} keep the tool within the tolerance"
            findings.add("CS367", "note", self.first_line, text, self.count)


def rotary_rows(
    rows: Iterator[Rows],
    smoothed: SmoothProgram,
    form: Form,
    findings: Findings,
    *,
    long: bool = False,
    in_planes: Bools | None = None,
) -> Iterator[Rows]:
    """Rows of lines with the words of the form's machine in `Rows.other`, in the order of its axes.

    Parameters
    ----------
    rows : iterator of Rows
        From `dense_rows`, with tool vectors.
    smoothed : SmoothProgram
    form : Form
    findings : Findings
        Takes what the kinematics notice.
    long : bool
        Whether only those rows are left that ε asks for (`cornersmooth.smoothing.long_lines`).
    in_planes : (n,) bool, optional
        Poses in tilted planes, whose rotary axes the control turns, and whose travel is not looked at here.

    Raises
    ------
    InputError
        The machine cannot follow the path.
    """
    program, settings, machine = smoothed.program, smoothed.settings, form.machine
    if machine is None:
        raise SettingsError("CS215", f"{form.control} form {form.name} needs a machine", "name it with --machine")
    poses = whole_rows(rows)
    if not len(poses[2]):
        return
    tools = tools_of_poses(program) if machine.tool_lengths else None
    own_machine, machine = machine, machine.with_longest_tool()
    tolerance = form.rotary_tolerance(settings.tolerance, settings.axis_scale)
    way = _way(poses, program, machine, form, tolerance, findings)
    del poses  # all that is still held as long as rows are written counts
    return_free_memory()
    tip, axis, move, angles, rapid, left = way.tip, way.axis, way.move, way.angles, way.rapid, way.left
    file = program.source.name
    largest_turn = min(settings.axis_step or LARGEST_TURN, LARGEST_TURN)
    limits = line_limits(settings, form, largest_turn)
    timed = _timed_cuts(angles, move, program) if form.orientation == "machine" else None
    inserted, times = InsertedPoints(), _BlockTimes(smoothed, form, machine, limits)
    size = LONG_CHUNK if long else CHUNK
    for begin in range(0, max(len(move) - 1, 1), size):
        here = slice(begin, begin + size + 1)  # the last row of a chunk is the start of the next
        line = program.line[move[here]]
        more = insertions(
            machine,
            tip[here],
            axis[here],
            angles[here],
            tolerance=tolerance,
            rapid=rapid[here],
            tip_tolerance=TIP_SHARE * settings.tolerance if form.orientation == "machine" else None,
            max_step=largest_turn,
            line=line,
            file=file,
        )
        inserted.add(more, line)
        filled = fill(tip[here], axis[here], angles[here], more)
        held = left[here] | np.append(left[here][1:], False)  # both rows of a place where a cut is left
        start, at_pose = segments_of_rows(move, here.start, here.stop)
        blend = None
        if long:
            row = filled.pose
            exact = at_pose[row] & ~filled.inserted
            found = vertices(smoothed, filled.tip, filled.axis, filled.angles, move[here][row], start[row], exact)
            found = replace(found, fixed=found.fixed | (held[row] & ~filled.inserted))
            kept = fewest_lines(found, limits)
            filled = filled.only(kept)
            blend = corner_blends(found, kept, rapid[here][filled.pose], limits, settings, form)
        own = slice(1 if begin else 0, None)
        of_timed = None if timed is None else timed[here]
        filled, rate = times.of(filled, (move[here], start, at_pose, held), left[here], of_timed, own)
        seen = np.arange(len(filled.pose))[own]
        if in_planes is not None:
            seen = seen[~in_planes[move[here][filled.pose[seen]]]]
        for chosen, one in machines_of_rows(own_machine, tools, move[here][filled.pose[seen]]):
            rows_of_tool = seen[chosen]
            at = filled.pose[rows_of_tool]
            check_travel(one, filled.tip[rows_of_tool], filled.angles[rows_of_tool], line[at], file)
        count = len(filled.pose[own])
        yield Rows(
            tip=filled.tip[own],
            other=filled.angles[own],
            move=move[here][filled.pose[own]],
            curve=np.zeros(count, np.int8),
            joined=np.zeros(count, np.bool_),
            rate=None if rate is None else rate[own],
            blend=None if blend is None else blend[own],
            left=(left[here][filled.pose] & ~filled.inserted)[own] if left.any() else None,
        )
    inserted.warn(findings)
    times.tell(findings)
    inserted.tell(machine, findings)


@dataclass(frozen=True)
class _Way:
    """Rows with their angles, n of them: more than were given where cuts are left.

    Parameters
    ----------
    tip, axis : (n, 3) float64
    move : (n,) int64
    angles : (n, 2) float64, degrees
    rapid, left : (n,) bool
        Whether the way to the row cuts nothing; whether the tool comes back there into a cut that it has left.
    """

    tip: Floats
    axis: Floats
    move: Ints
    angles: Floats
    rapid: Bools
    left: Bools


def _way(
    poses: tuple[Floats, Floats, Ints],
    program: Program,
    machine: Machine,
    form: Form,
    tolerance: float,
    findings: Findings,
) -> _Way:
    """Choose the angles of all rows, given as tip, axis and move."""
    tip, axis, move = poses
    rapid, file = rapid_moves(program.kind)[move], program.source.name
    check_reach(machine, program, axis, move, tolerance)
    how: dict[str, Any] = {"tolerance": tolerance, "rapid": rapid, "line": program.line[move], "file": file}
    how |= {"still": still_poses(program.kind)[move], "still_tolerance": form.angle_rounding}
    left = np.zeros(len(move), np.bool_)
    if form.rewind:
        path, source, left = rewound_angles(machine, tip, axis, **how)
        if left.any():
            tip, axis, move = tip[source], axis[source], move[source]
            rapid = rapid[source] | left
            _tell_rewinds(machine, path.angles, left, program.line[move], findings)
    else:
        path = rotary_angles(machine, tip, axis, **how)
    for finding in path.findings:
        findings.add(finding.code, finding.severity, finding.line, finding.text, finding.count)
    angles = path.angles + from_zero(form, program, axis, path.angles, move, rapid)
    return _Way(tip, axis, move, angles, rapid, left)


@dataclass
class _BlockTimes:
    """Moves per minute of blocks that we time, within what the control can say; counts what became of short ones."""

    smoothed: SmoothProgram
    form: Form
    machine: Machine
    limits: LineLimits
    merged: int = 0
    slowed: int = 0
    first_slowed: int = 0

    def of(
        self, filled: FilledPath, rows: tuple[Ints, Ints, Bools, Bools], left: Bools, timed: Bools | None, own: slice
    ) -> tuple[FilledPath, Floats | None]:
        """The path without rows that are too short, and their rates; `rows` as in `_merged`, `own` count."""
        program, settings, fastest = self.smoothed.program, self.smoothed.settings, self.form.mode.motion.fastest
        move = rows[0]
        rate = _rates(filled, move, left, timed, program, settings, self.form)
        if rate is None:
            return filled, None
        if fastest:
            if self.form.orientation == "machine" and (rate > fastest).any():
                before = len(filled.pose)
                filled = _merged(self.smoothed, self.machine, filled, rows, rate, self.limits, fastest)
                self.merged += before - len(filled.pose)
                rate = _rates(filled, move, left, timed, program, settings, self.form)
            assert rate is not None
            beyond = np.flatnonzero(rate[own] > fastest)
            if len(beyond) and not self.slowed:
                self.first_slowed = int(program.line[move[filled.pose[own][beyond[0]]]])
            self.slowed += len(beyond)
            rate = np.minimum(rate, fastest)
        return filled, np.round(rate, INVERSE_TIME_DECIMALS)

    def tell(self, findings: Findings) -> None:
        """Say what became of short blocks."""
        if self.slowed:
            fastest = self.form.mode.motion.fastest
            text = f"block slowed down: it is shorter than F{fastest:.10g} of inverse time (G93) can say"
            findings.add("CS371", "warning", self.first_slowed, text, self.slowed)
        if self.merged:
            text = "block merged with its neighbour: shorter than inverse time (G93) can say"
            findings.add("CS372", "note", 0, text, self.merged)


def _merged(
    smoothed: SmoothProgram,
    machine: Machine,
    filled: FilledPath,
    rows: tuple[Ints, Ints, Bools, Bools],
    rate: Floats,
    limits: LineLimits,
    fastest: float,
) -> FilledPath:
    """The path without rows between blocks that are too short to be timed, as far as ε allows.

    Parameters
    ----------
    rows : (n,) int64, (n,) int64, (n,) bool, (n,) bool
        Move of each row of the unfilled path, the pose that its segment starts from, whether it is at a pose, and
        whether it stays in any case.
    rate : (m,) float64, 1/min
    """
    own, inserted = filled.pose, filled.inserted
    move, start, at_pose = rows[0][own], rows[1][own], rows[2][own] & ~inserted
    found = vertices(smoothed, filled.tip, filled.axis, filled.angles, move, start, at_pose)
    fixed = found.fixed | (rows[3][own] & ~inserted)
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
        fixed |= _beside_far_corners(found, at_pose, limits)
    return filled.only(fewest_lines(replace(found, fixed=fixed | ends | ~between, position=position), limits))


def _beside_far_corners(rows: Vertices, at_pose: Bools, limits: LineLimits) -> Bools:
    """(m,) bool: rows of the two moves at poses that the motion is far from at their own parameter.

    Where tip and axis point run by parameters of their own, another row may be the one that is near the pose.
    """
    axis_point = rows.tip + limits.axis_length * limits.axis_of(rows.words)
    off_tip, off_axis_point = norm(rows.tip - rows.original_tip), norm(axis_point - rows.original_axis_point)
    far = at_pose & ((off_tip > limits.tip) | (off_axis_point > limits.axis_point))
    move = np.concatenate(([0], np.cumsum(at_pose)[:-1]))
    beside: Bools = np.isin(move, move[far]) | np.isin(move, move[far] + 1)
    return beside


def check_reach(machine: Machine, program: Program, axis: Floats, move: Ints, tolerance: float) -> None:
    """Refuse the first pose that an axis is missing for, or a method that turns the tool to where one is."""
    if len(machine.names) > 1:
        return
    file = program.source.name
    beyond = np.where(program.kind == Move.FROM, 0.0, solutions(machine, program.axis).beyond)
    poses = np.flatnonzero(beyond > tolerance)
    if len(poses):
        pose = int(poses[0])
        raise reach_error(machine, program.axis[pose], float(beyond[pose]), int(program.line[pose]), file)
    rows = np.flatnonzero(solutions(machine, axis).beyond > tolerance)
    if len(rows):
        what = (
            f"the method turns the tool out of what {machine.names[0]} of {machine.name} reaches, within the tolerance"
        )
        hint = "use --method proportional, which does not"
        raise InputError("CS361", what, hint, file=file, line=int(program.line[move[rows[0]]]))


def _tell_rewinds(machine: Machine, angles: Floats, left: Bools, line: Ints, findings: Findings) -> None:
    """Say where cuts are left, for each axis that turns there."""
    rows = np.flatnonzero(left)
    turn = np.abs(angles[rows] - angles[rows - 1])
    column = int(np.argmax(turn[0]))
    text = (
        f"the cut is left along the tool and gone on with where {machine.names[column]} has turned by "
        f"{turn[0, column]:.4g} deg above the retract: expect a mark on the part"
    )
    findings.add("CS376", "warning", int(line[rows[0]]), text, len(rows))


def whole_rows(rows: Iterator[Rows]) -> tuple[Floats, Floats, Ints]:
    """Tip, axis and move of all rows; what they were gathered in is given back part by part."""
    tips: deque[Floats] = deque()
    axes: deque[Floats] = deque()
    moves: deque[Ints] = deque()
    for chunk in rows:
        tips.append(chunk.tip)
        axes.append(chunk.other)
        moves.append(chunk.move)
    total = sum(map(len, moves))
    tip, axis, move = np.empty((total, 3)), np.empty((total, 3)), np.empty(total, np.int64)
    for whole, parts in ((tip, tips), (axis, axes), (move, moves)):
        begin = 0
        while parts:
            part = parts.popleft()
            whole[begin : begin + len(part)] = part
            begin += len(part)
        return_free_memory()
    return tip, axis, move


def _cuts(move: Ints, program: Program) -> Bools:
    """(n,) rows of cuts with a feed per minute."""
    cuts: Bools = ~rapid_moves(program.kind)[move] & (program.feed_mode[move] == FeedMode.PER_MINUTE)
    return cuts


def _timed_cuts(angles: Floats, move: Ints, program: Program) -> Bools:
    """(n,) rows of cuts in which a rotary axis turns: a whole cut is timed in one way."""
    cut = _cuts(move, program)
    begins = cut & ~np.concatenate(([False], cut[:-1]))
    run = np.cumsum(begins) - 1
    turning = np.zeros(max(int(begins.sum()), 1), np.bool_)
    turns = cut & (np.abs(np.diff(angles, axis=0, prepend=angles[:1])).max(axis=1) > _NO_TURN)
    turning[run[turns]] = True
    timed: Bools = cut & turning[np.maximum(run, 0)]
    return timed


def _rates(
    path: FilledPath, move: Ints, left: Bools, timed: Bools | None, program: Program, settings: Settings, form: Form
) -> Floats | None:
    """(m,) moves per minute where blocks are timed by us, NaN elsewhere; None where none is.

    `timed` says which rows without inserted ones; else it is every block in which only rotary axes turn, for controls
    that want it. Where the tip stands still, the axis point runs with the feed: so it does where the tip stays within ε
    and the axis point does not. `left` says of rows without inserted
    ones where the tool comes back into a cut that it has left.
    """
    if timed is None and not form.mode.timed_turns:
        return None
    own = move[path.pose]
    step = np.diff(path.tip, axis=0, prepend=path.tip[:1])
    swing = step + settings.axis_scale * np.diff(path.axis, axis=0, prepend=path.axis[:1])
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
    back = left[path.pose] & ~path.inserted
    if back.any():
        rate[back] = program.feed[own[back]] / form.rewind if timed is not None else np.nan
        rate[back & ~chosen] = np.nan
    return rate
