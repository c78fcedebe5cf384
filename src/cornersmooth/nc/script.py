"""One pass over statements and rows: what comes in which order, and holes among the rows.

A statement changes what the control remembers; a stretch of rows asks for it. Holes are written as cycles of the
control, as plain moves, or only gone over.

Plain moves run under tool tip control with any tool axis, where canned cycles are refused: rapid over the hole, rapid
to the clearance, feed to the depth, out again. The tool travels between holes at the greatest of the cycle's heights
and of the height from which the first hole was approached: up, across at the higher of two such levels, down. ``DEEP``
retracts to the clearance after every ``STEP``, ``INCR`` or ``1STPECK``/``SUBPECK``, ``BRKCHP`` by `PECK_GAP` only.
``REAM`` and ``BORE`` come out at feed.

Python runs per run of holes; per hole where the control has a cycle for it, or its words are not understood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate, chain, pairwise, repeat, takewhile

import numpy as np

from cornersmooth.arrays import dot, some_rows
from cornersmooth.geometry.arcs import FIRST_PLANE
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Numbers, Program, Statement
from cornersmooth.nc.blocks import feed_digits, feed_ticks
from cornersmooth.nc.control import Blocks
from cornersmooth.nc.coordinates import BlockRows, Coordinates
from cornersmooth.nc.hole_cycles import Cycle, Drillings, hole_feeds, kind_of
from cornersmooth.nc.messages import refused
from cornersmooth.nc.motion import NOWHERE, Motion
from cornersmooth.nc.planes import Planes
from cornersmooth.nc.program_frame import Stream
from cornersmooth.nc.rotary_words import machine_of
from cornersmooth.nc.statement_args import tool_starts
from cornersmooth.nc.statement_writer import StatementWriter
from cornersmooth.smoothing.runs.rows import Rows
from cornersmooth.text import format_number

PECK_GAP = 0.5  #: mm left above the last depth before feeding goes on, and moved up to break a chip
LEAST_PECK = 0.01  #: mm: the last peck takes what would be left; a tool only rubs there
#: cosine of the angle from hole to hole beyond which the tool turns between them
_TURNED = float(np.cos(np.radians(1.0)))
_SAME_AXIS = 1e-9  #: axes whose directions differ by less, in the cosine, are the same for the height of travel


@dataclass
class Script:
    """Writes rows and statements in order."""

    statements: StatementWriter
    motion: Motion
    planes: Planes
    drillings: Drillings  #: what the holes are drilled with
    skip: bool  #: whether holes that cannot be written are left out with a warning
    native: bool  #: whether holes are cycles of the control, where they can be
    _coordinates: dict[tuple[bool, int | None], Coordinates] = field(default_factory=dict)  #: besides `Motion.tilting`
    _tilted: int = -1  #: tilted plane of the tool at hand
    _next: int = 0
    _in_order: tuple[Statement, ...] = field(init=False)
    _part: Numbers = field(
        init=False
    )  #: (n,) poses with the same are holes or not, in one plane, without a FROM between

    def __post_init__(self) -> None:
        program, plane = self.motion.program, self.planes.of
        # PAINT is for the screen of the CAM system alone
        self._in_order = tuple(one for one in program.statements if one.word != "PAINT")
        begins, hole = program.kind == Move.FROM, program.kind == Move.HOLE
        begins[1:] |= (hole[1:] != hole[:-1]) | (plane[1:] != plane[:-1])
        self._part = np.cumsum(begins, dtype=np.int32)

    def hand_on(self, stream: Stream) -> None:
        """Write to a stream what was written since it was handed on last."""
        stream.write(b"".join(self.motion.text))
        self.motion.text = []

    def run(self, rows: Rows) -> None:
        """Write a block of rows, and the statements before and between them."""
        moves, start, order = rows.move, 0, self._in_order
        while len(moves) and self._next < len(order) and order[self._next].pose <= moves[-1]:
            statement = order[self._next]
            self._next += 1
            stop = int(np.searchsorted(moves, statement.pose))
            self._between(rows, start, stop)
            start = max(start, stop)
            self._statement(statement)
        self._between(rows, start, len(moves))

    def finish(self) -> None:
        """Write the statements after the last row, and the blocks that end the program."""
        motion, modals = self.motion, self.motion.modals
        for statement in self._in_order[self._next :]:
            self._statement(statement)
        if motion.repeated:
            motion.findings.note("CS312", 0, motion.repeated)
        last = modals.set(compensation=())
        rotary = {} if motion.last is None else motion.rotary_blocks(motion.last, unwind=False)
        motion.say([*last, *modals.end(rotary)])

    def _statement(self, statement: Statement) -> None:
        blocks, changed = self.statements.blocks(statement), self.statements.changed
        if changed:  # a tool change leaves the machine elsewhere
            self.motion.change_tool(statement.pose)
            self.statements.changed = False
        if changed or self.motion.modals.halted:
            self.motion.modals.now["feed"] = -1
        self.motion.say(blocks)

    def _between(self, rows: Rows, start: int, stop: int) -> None:
        """Write rows between statements, holes apart from the others."""
        if start >= stop:
            return
        edges = start + 1 + np.flatnonzero(np.diff(self._part[rows.move[start:stop]]))
        for first, last in pairwise([start, *edges.tolist(), stop]):
            pose, some = int(rows.move[first]), some_rows(rows, slice(first, last))
            self._take_coordinates(pose)
            if self.motion.program.kind[pose] == Move.HOLE:
                self._drill(some)
            else:
                self.motion.lines(some)

    def _take_coordinates(self, pose: int) -> None:
        """Take the coordinates of a pose; between tilted planes, and beside them, the tool goes up."""
        plane, modals = int(self.planes.of[pose]), self.motion.modals
        tilted = -1 if plane >= 0 and self.planes.planes[plane].upright else plane
        if modals.begun and tilted == self._tilted:
            return
        at = self._coordinates_of(plane)
        beside, self._tilted = self._tilted != tilted, tilted
        if modals.begun or (beside and not modals["high"]):
            self.motion.go_home()
        self.motion.take(at)

    def _coordinates_of(self, plane: int) -> Coordinates:
        """Coordinates of a pose: of its plane, or of the tool at hand where its length counts."""
        tilting, tool = self.motion.tilting, self.motion.modals.tool
        form, key = tilting.form, (plane >= 0, plane if plane >= 0 else tool)
        if plane < 0 and not (form.machine and form.machine.tool_lengths and form.orientation == "machine"):
            return tilting
        if key not in self._coordinates:
            if plane >= 0:
                own = self.planes.planes[plane]
                along = replace(form, orientation="fixed", mode=form.in_plane(upright=own.upright))
                at = replace(tilting, form=along, stretch=along.stretch(1.0), plane=own)
            else:
                at = replace(tilting, form=replace(form, machine=machine_of(form).with_tool(tool)))
            self._coordinates[key] = at
        return self._coordinates[key]

    @cached_property
    def _heights(self) -> tuple[Ints, Floats, Floats, Floats]:
        """Holes (h,), and heights over them, mm: of travel, to which the tool comes, and from which it goes."""
        program = self.motion.program
        poses = np.flatnonzero(program.kind == Move.HOLE)
        moves = np.where(program.kind == Move.HOLE, -1, np.arange(len(program)))
        cycles = [one.cycle for one in self.drillings.each]
        least = np.array([0.0 if one is None else max(one.retract, one.clearance or 0.0) for one in cycles])
        travel = travel_height(program, poses, np.maximum.accumulate(moves)[poses])
        travel = np.maximum(travel, least[self.drillings.of(poses)])
        homes = [one.pose for one in program.statements if one.word == "GOHOME"]
        # without a retract nothing says that the tool is elsewhere
        elsewhere = [*tool_starts(program), *homes] if self.motion.modals.can_rewind else []
        return poses, travel, *crossings(program, poses, travel, elsewhere)

    def _drill(self, rows: Rows) -> None:
        """Write holes of one cycle, of the control or as plain moves; those left out are only approached."""
        motion, poses = self.motion, rows.move
        program, motion.return_to = motion.program, NOWHERE
        said = self.drillings.each[self.drillings.of(poses)[0]]
        all_holes, *heights = self._heights
        number = np.searchsorted(all_holes, poses)
        travel, enter, leave = (some[number] for some in heights)
        cycle, (kind, why) = said.cycle, self._cycle_of_control(said.cycle, poses)
        if cycle is None or (cycle.tap and not kind):
            if not self.skip:
                raise refused("CS342", program, said.line or int(program.line[poses[0]]), why=why)
            motion.findings.note_each("CS315", program.line[poses], why=why)
            cycle = None
        clearance = np.full(len(poses), cycle.clearance) if cycle and cycle.clearance is not None else travel
        if cycle is not None and kind:
            self._cycles(cycle, kind, poses, (enter, travel, clearance, leave))
            return
        hole, tip, rapid, dwell = hole_moves(cycle, program, poses, (enter, clearance, leave))
        plain = BlockRows.straight(program, motion.ticks_at(rows, tip, hole), poses[hole])
        plain = replace(plain, rapid=rapid, dwell=dwell)
        if cycle is None:
            for k, place in enumerate((program.tip[poses] / program.mm_per_unit).tolist()):
                words = [word + format_number(x, motion.at.decimals[0]) for word, x in zip("XYZ", place, strict=True)]
                motion.say(self.statements.warning_comment(f"NOT DRILLED: HOLE AT {' '.join(words)}"))
                motion.emit_above(motion.moving(some_rows(plain, hole == k)))
            return
        motion.findings.note_each("CS316", program.line[poses])
        # where the tool turns right above holes, what lies on its way there the CL file does not say
        come = program.axis[np.concatenate(([max(int(poses[0]) - 1, 0)], poses[:-1]))]
        turned, low = dot(program.axis[poses], come) < _TURNED, travel <= clearance
        turned[0] &= poses[0] > 0 and not motion.modals.comes_first
        motion.findings.note_each("CS384", program.line[poses[turned & (low | np.append(False, low[:-1]))]])
        feed, mode = hole_feeds(cycle, program, poses[hole])
        plain = motion.moving(replace(plain, feed=feed, mode=mode))
        per_turn = bool((plain.mode[~plain.rapid][-1:] == FeedMode.PER_REVOLUTION).all())
        waits = plain.dwell is not None and plain.dwell.any()
        motion.emit_above(plain, self.statements.dwell(cycle.dwell, said.line, per_turn=per_turn) if waits else ())

    def _cycle_of_control(self, cycle: Cycle | None, poses: Ints) -> tuple[str, str]:
        """Cycle of the control that drills holes, as `kind_of` names it; empty for none, and then why no tap can be."""
        motion = self.motion
        if cycle is None:
            return "", "its words are not understood; numbers without words need --cycle-order"
        kind = kind_of(cycle, motion.at.form, motion.program, poses)
        if not kind:
            return "", "a tap, and the control has no such cycle for it"
        clockwise = {self.statements.words.clockwise} & {*" ".join(motion.modals.turning).split()}
        if cycle.tap and not (clockwise and motion.modals.speed):
            return "", "a tap takes a spindle that turns clockwise at a known speed"
        if motion.at.plane is None:
            form = motion.at.form
            where = "the tool does not stay along Z between its changes, or nothing says that the rotary axes do"
            if form.upright is None:
                where = f"-f {form.name} has no cycles of the control"
            elif form.orientation == "point":
                where = "a tool of the program tilts, so all have axis points; lines (-f g1) need none"
            return "", f"a tap, and {where}"
        return kind if self.native or cycle.tap else "", ""

    def _cycles(self, cycle: Cycle, kind: str, poses: Ints, above: Sequence[Floats]) -> None:
        """Write holes as cycles of the control, each from its height of travel.

        Heights (h,) above the holes, mm: to which the tool comes, of travel, where feeding begins, and from which it
        goes: the first and the last count where the height of travel is another one.
        """
        motion, program, at = self.motion, self.motion.program, self.motion.at
        enter, travel, clearance, leave = above
        motion.findings.note_each("CS347", program.line[poses])
        if kind == "tap":
            motion.findings.note_each("CS348", program.line[poses])
        motion.note_cut(int(poses[0]), turning=bool(motion.modals.turning))
        motion.say(motion.modals.set(plane=FIRST_PLANE))  # a cycle drills across the plane
        table, digits, speed = at.form.table.cycles, at.form.table.digits, motion.modals.speed or 0.0
        (feeds, modes), frame = hole_feeds(cycle, program, poses), np.eye(3) if at.plane is None else at.plane.frame
        texts: Blocks = getattr(table, kind)
        once = next((k for k, block in enumerate(texts) if "{x}" in block), 0)  # so many are written where they change
        come, over, go = (
            at.ticks(program.tip[poses] + height[:, None] * frame[:, 2], program.axis[poses])
            for height in (enter, travel, leave)
        )
        words = [feed_digits(ticks, at) for ticks in feed_ticks(feeds, modes, program, at).tolist()]
        turns = np.where((modes == FeedMode.PER_REVOLUTION) | (speed == 0.0), 1.0, speed)
        begins = np.diff(over[:, 2], prepend=over[0, 2] - 1) != 0
        ends = np.append(begins[1:], True)
        written: Blocks = ()
        for k, pose in enumerate(poses.tolist()):
            if begins[k]:
                self._rapid(pose, come[k], over[k])
                motion.say([*motion.modals.go_on(), *motion.modals.set(feed_mode=int(modes[0]))])
                written = ()
            pitch = format_number(feeds[k] / program.mm_per_unit / turns[k], max(at.decimals[0], digits.most))
            values = {"feed": words[k], "pitch": pitch}
            values |= {"speed": format_number(speed, digits.speed, trim=True).rstrip(".")}
            values |= _numbers(cycle, at, program, program.tip[pose] @ frame, (travel[k], clearance[k]))
            blocks = tuple(block.format(**values) for block in texts)
            motion.say(blocks[once:] if written and written == blocks[:once] else blocks)
            written = blocks[:once] or blocks
            motion.stand(over[k])
            if ends[k]:
                motion.say(table.off)
                self._rapid(pose, go[k])
        motion.modals.now["feed"] = -1

    def _rapid(self, pose: int, *ticks: Ints) -> None:
        rows = BlockRows.straight(self.motion.program, np.stack(ticks), np.full(len(ticks), pose), rapid=True)
        self.motion.emit(self.motion.moving(rows))


def _numbers(
    cycle: Cycle, at: Coordinates, program: Program, top: Floats, above: tuple[float, float]
) -> dict[str, str]:
    """Numbers of a hole with its top, (3,) mm, travel and clearance above it; distances are of written heights."""
    unit, decimals, plus = program.mm_per_unit, at.decimals[0], at.motion.signs

    def rounded(value: float) -> float:
        return float(format_number(value, decimals))

    (x, y, z), (travel, clearance) = (top / unit).tolist(), above
    places = {"x": x, "y": y, "top": rounded(z), "bottom": rounded(z - cycle.depth / unit)}
    places |= {"travel": rounded(z + travel / unit), "clearance": rounded(z + clearance / unit)}
    places |= {"setup": places["clearance"] - places["top"], "above": places["travel"] - places["top"]}
    return {name: format_number(value, decimals, plus=plus) for name, value in places.items()} | {
        "depth": format_number(places["top"] - places["bottom"], decimals),
        "step": format_number(cycle.steps[0] / unit if cycle.steps else 0.0, decimals),
        "milliseconds": str(cycle.dwell),
        "seconds": format_number(cycle.dwell / 1000.0, 3, trim=True),
    }


def hole_moves(
    cycle: Cycle | None, program: Program, poses: Ints, above: tuple[Floats, Floats, Floats]
) -> tuple[Ints, Floats, Bools, Bools]:
    """Plain moves for holes, or over them without a cycle: hole of each, its end (m, 3) mm, rapids, dwells after it.

    Heights (h,) above the holes, mm: to which the tool comes, where feeding begins, and from which it goes.
    """
    enter, clearance, leave = above
    moves = [(enter, True, False)]  # heights, whether in rapid, whether the tool waits there
    if cycle is not None:
        moves.append((clearance, True, False))
        pecks = accumulate(chain(cycle.steps, repeat(cycle.steps[-1]))) if cycle.steps else ()
        depths = (*takewhile(lambda depth: depth < cycle.depth - LEAST_PECK, pecks), cycle.depth)
        for before, depth in pairwise((0.0, *depths)):
            if before > 0.0:
                moves += [(clearance, True, False)] * cycle.full_retract
                moves.append((np.minimum(clearance, PECK_GAP - before), True, False))
            moves.append((np.full(len(poses), -depth), False, depth == cycle.depth and cycle.dwell > 0))
        moves += [(clearance, False, False)] * cycle.feed_out
    moves.append((leave, True, False))
    height = np.stack([height for height, _, _ in moves], axis=1)
    tip = program.tip[poses][:, None, :] + height[..., None] * program.axis[poses][:, None, :]
    rapid, waits = (np.tile([move[k] for move in moves], len(poses)) for k in (1, 2))
    return np.repeat(np.arange(len(poses)), len(moves)), tip.reshape(-1, 3), rapid, waits


def crossings(program: Program, poses: Ints, travel: Floats, starts: Sequence[int]) -> tuple[Floats, Floats]:
    """(h,) mm: heights over holes at which the tool comes to each and goes from it, between two at the higher travel.

    So it is between holes with one axis, one after the other, unless the tool comes from elsewhere: at poses `starts`.
    """
    tip, axis, enter, leave = program.tip[poses], program.axis[poses], travel.copy(), travel.copy()
    down = dot(tip[:-1] - tip[1:], axis[1:])  # to the next, along the tool
    same = (dot(axis[:-1], axis[1:]) > 1.0 - _SAME_AXIS) & (np.diff(poses) == 1)
    same &= ~np.isin(poses[1:], starts)
    enter[1:] = np.where(same, np.maximum(travel[1:], travel[:-1] + down), travel[1:])
    leave[:-1] = np.where(same, enter[1:] - down, travel[:-1])
    return enter, leave


def travel_height(program: Program, poses: Ints, approach: Ints) -> Floats:
    """(h,) mm: height over each hole, along its axis, of the pose from which its run of holes is approached.

    A hole with another axis has the height over the first one of its run, so that the tool turns as far from the part.
    Zero where there is no such pose, or where it has another axis than that or lies lower.
    """
    known = np.maximum(approach, 0)
    same = dot(program.axis[poses], program.axis[known]) > 1.0 - _SAME_AXIS
    over = np.where(same, poses, np.minimum(known + 1, len(program) - 1))
    axis = program.axis[over]
    usable = (approach >= 0) & (dot(axis, program.axis[known]) > 1.0 - _SAME_AXIS)
    height = dot(program.tip[known] - program.tip[over], axis)
    return np.where(usable, np.maximum(height, 0.0), 0.0)
