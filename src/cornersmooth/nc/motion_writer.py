"""The motion of a program in blocks: rows and statements in order, and where the tool is between them.

Python runs per statement and per stretch of rows, never per row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from cornersmooth.kinematics.poses import continued
from cornersmooth.kinematics.position import nose_position
from cornersmooth.model import Bools, Floats, Ints, Move, Program, Statement
from cornersmooth.nc.block_writer import BlockWriter
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.curve_blocks import Run
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.first_block import UPRIGHT, check_first_block
from cornersmooth.nc.holes import HoleWriter
from cornersmooth.nc.operation import Operation
from cornersmooth.nc.planes import Planes
from cornersmooth.nc.rewinds import refuse_compensated, retracts_before
from cornersmooth.nc.statement_args import with_starts
from cornersmooth.nc.statement_writer import StatementWriter
from cornersmooth.nc.warnings import MotionWarnings
from cornersmooth.slices import some_rows
from cornersmooth.smoothing.sampling import Rows

#: a pose that no program has
_NOWHERE = 1 << 62


@dataclass
class MotionWriter:
    """Writes rows and statements in order."""

    program: Program
    tilting: BlockWriter  #: for tools under tool tip control
    upright: Bools  #: (n,) `cycle_blocks.upright_poses`
    planes: Planes
    statements: StatementWriter
    operation: Operation
    findings: Findings
    #: approach, retract: mm; along the tool, after a retract and before one
    approach: float = 0.0
    retract: float = 0.0
    native: bool = False  #: whether holes are cycles of the control, where they can be
    position: Ints | None = None  #: where the tool is, in ticks; None where it may be elsewhere
    last: Ints | None = None  #: what was written last, before a tool change too
    last_writer: BlockWriter | None = None  #: and by which
    writer: BlockWriter = field(init=False)  #: that of the pose at hand
    warnings: MotionWarnings = field(init=False)
    _writers: dict[tuple[str, int | None], BlockWriter] = field(default_factory=dict)  #: besides `tilting`
    _blocks: int = 0  #: those that are not the writers'
    _plane: int = -1  #: tilted plane of the tool at hand
    _repeated: int = 0
    _return_to: int = _NOWHERE  #: first pose after a tool change, until it is reached
    _next_statement: int = 0
    _begun: int = -1  #: last move after a hole or a FROM that has been begun
    _in_order: tuple[Statement, ...] = field(init=False)
    _holes: HoleWriter = field(init=False)

    def __post_init__(self) -> None:
        self.writer = self.tilting
        self.warnings = MotionWarnings(self.program, self.findings)
        self.operation.withdraw = self._withdraw
        self._in_order = with_starts(self.program)
        self._holes = HoleWriter(self, self.native)

    def write(self, rows: Rows, ticks: Ints) -> Iterator[bytes]:
        """Text of a block of rows, with their numbers in ticks, and of the statements before and between them."""
        moves, start = rows.move, 0
        for statement in self._statements_until(int(moves[-1])) if len(moves) else []:
            if self.statements.only_counted(statement):  # thousands of them must not cut the rows to pieces
                continue
            stop = int(np.searchsorted(moves, statement.pose))
            if stop > start:
                yield from self._between(rows, ticks, start, stop)
                start = stop
            yield from self._write_statement(statement)
        yield from self._between(rows, ticks, start, len(moves))

    def finish(self) -> Iterator[bytes]:
        """Text of the statements after the last row, and the blocks that end the program."""
        for statement in self._in_order[self._next_statement :]:
            yield from self._write_statement(statement)
        if self._repeated:
            text = "move of zero length in the written digits left out"
            self.findings.add("CS312", "note", 0, text, self._repeated)
        last = [*self.statements.end_compensation(), *self.writer.end()]
        rotary = () if self.last is None else (self.rotary_blocks(self.last, unwind=False),)
        yield from self.text([*last, *self.operation.end(*rotary)])

    @property
    def written(self) -> int:
        """Blocks written so far."""
        return self._blocks + self.tilting.blocks + sum(writer.blocks for writer in self._writers.values())

    @property
    def takes_cycles(self) -> bool:
        """Whether the tool runs as the cycles of the control want it: along Z, or along Z' of a plane."""
        return self.writer is self._writers.get(("upright", 0)) or self.writer.plane is not None

    def text(self, blocks: Sequence[str]) -> Iterator[bytes]:
        """Text of blocks that are no rows."""
        self._blocks += len(blocks)
        if blocks:
            yield ("\n".join(blocks) + "\n").encode("ascii")

    # ------------------------------------------------------------------------------------------------ order

    def _statements_until(self, pose: int) -> Sequence[Statement]:
        begin, said = self._next_statement, self._in_order
        while self._next_statement < len(said) and said[self._next_statement].pose <= pose:
            self._next_statement += 1
        return said[begin : self._next_statement]

    def _write_statement(self, statement: Statement) -> Iterator[bytes]:
        text = self.statements.blocks(statement)
        if self.statements.changed:  # a tool change leaves the machine elsewhere
            self.position, self._return_to, self.statements.changed = None, statement.pose, False
            self.warnings.another_tool()
            self.writer.forget_feed()
        if self.operation.halted:
            self.writer.forget_feed()
        yield from self.text(text)

    def _between(self, rows: Rows, ticks: Ints, start: int, stop: int) -> Iterator[bytes]:
        """Rows between statements, holes apart from the others."""
        if start >= stop:
            return
        poses = rows.move[start:stop]
        hole, plane = self.program.kind[poses] == Move.HOLE, self.planes.of[poses]
        edges = np.flatnonzero((hole[1:] != hole[:-1]) | (plane[1:] != plane[:-1]))
        for first, last in pairwise([0, *(1 + edges).tolist(), stop - start]):
            part = slice(start + first, start + last)
            yield from self._take_writer(int(poses[first]))
            if hole[first]:
                self._return_to = _NOWHERE
                yield from self._holes.write(some_rows(rows, part))
            else:
                yield from self._lines(some_rows(rows, part), ticks[part])

    def _take_writer(self, pose: int) -> Iterator[bytes]:
        """Take the writer of a pose; between tilted planes, and beside them, the tool goes up."""
        plane = int(self.planes.of[pose])
        if self.operation.begun and plane == self._plane:
            return
        writer = self._writer_of(pose, plane)
        beside, self._plane = self._plane != plane, plane
        if self.operation.begun or (beside and not self.operation.retracted):
            yield from self.text(self.operation.go_home())
        if writer is self.writer:
            return
        writer.take_over(self.writer)
        self.writer, self.operation.mode, self.position = writer, writer.form.mode, None
        self.operation.plane = writer.plane.words if writer.plane is not None else {}

    def _writer_of(self, pose: int, plane: int) -> BlockWriter:
        """Writer of a pose: of its tilted plane, of tools along Z, or of the tool at hand where its length counts."""
        form, tool = self.tilting.form, self.statements.tool
        lengths = form.machine is not None and form.machine.tool_lengths and form.orientation == "machine"
        if plane >= 0:
            key: tuple[str, int | None] = ("plane", plane)
        elif self.upright[pose]:
            key = ("upright", 0)
        elif lengths:
            key = ("tool", tool)
        else:
            return self.tilting
        if key in self._writers:
            return self._writers[key]
        if key[0] == "tool" and form.machine is not None:
            writer = replace(self.tilting, form=replace(form, machine=form.machine.with_tool(tool)), blocks=0)
        else:
            mode = form.plane if plane >= 0 else form.upright
            assert mode is not None
            along = replace(form, orientation="fixed", mode=mode)
            own = self.planes.planes[plane] if plane >= 0 else None
            writer = replace(self.tilting, form=along, stretch=along.stretch(1.0), blend="", plane=own, blocks=0)
        self._writers[key] = writer
        return writer

    # ------------------------------------------------------------------------------------------------ rows

    def _lines(self, rows: Rows, ticks: Ints) -> Iterator[bytes]:
        move, arc, program, writer = rows.move, rows.arc, self.program, self.writer
        if writer is not self.tilting:
            ticks = writer.ticks(rows.tip, rows.other)
        yield from self._go_back(int(move[0]), rows.other[:1])
        elsewhere = self._begins_elsewhere(int(move[0]))
        if arc is not None and arc[0] >= 0:  # after a tool change, a hole or a FROM the tool is not at its start
            yield from self._go_to(writer.ticks(program.tip[move[:1] - 1], rows.other[:1]), move[:1])
        elif elsewhere and program.kind[move[0] - 1 : move[0] + 1].tolist() == [Move.FROM, Move.ARC]:  # in lines
            start_of_arc = self.ticks_at(rows, program.tip[move[:1] - 1], np.zeros(1, np.int64))
            yield from self._go_to(start_of_arc, move[:1])
        self._join(ticks, rows.joined)
        feed, mode = program.feed[move], program.feed_mode[move].astype(np.int64)
        if rows.rate is not None and writer.plane is None:
            timed = ~np.isnan(rows.rate)
            feed, mode = np.where(timed, rows.rate, feed), np.where(timed, INVERSE_TIME, mode)
        run = Run(
            ticks=ticks,
            move=move,
            rapid=program.kind[move] == Move.RAPID,
            feed=feed,
            mode=mode,
            curve=rows.curve,
            arc=arc,
            bezier=writer.bezier(rows.tip, rows.other, rows.curve, rows.spline),
            spline=rows.spline,
            blend=rows.blend,
            left=rows.left,
        )
        before = len(run)
        run = self.moving(run.with_programmed_feed(program) if elsewhere else run)
        self._repeated += before - len(run)
        yield from self.emit_above(run)

    def _begins_elsewhere(self, move: int) -> bool:
        """Whether rows of a move are the first after a hole or a stated position: the tool is not at its start."""
        if move in (0, self._begun) or self.program.kind[move - 1] not in (Move.FROM, Move.HOLE):
            return False
        self._begun = move
        return True

    def _go_back(self, move: int, near: Floats) -> Iterator[bytes]:
        """Go to the pose after a tool change even if it repeats the last one before, and so is no row."""
        kind = self.program.kind
        begin, self._return_to = self._return_to, _NOWHERE
        passed = begin + np.flatnonzero(kind[begin:move] != Move.FROM)
        if self.last is None or not len(passed) or kind[begin - 1] == Move.HOLE:  # which none repeats
            return
        yield from self.emit(Run.straight(self.program, self._again(self.last, passed[:1], near), np.array([move])))

    def _again(self, last: Ints, pose: Ints, near: Floats) -> Ints:
        """Ticks (1, c) of what was written last, a pose (1,), by the writer at hand.

        `near` is the orientation of the first row to come.
        """
        form = self.writer.form
        if self.last_writer is self.writer:
            return last[None]
        other = self.program.axis[pose]
        if form.rotary and form.machine is not None:
            if len(last) == self.writer.columns:
                other = self.writer.angles(last[None])
            elif self.last_writer is None or self.last_writer.plane is None:
                other = np.zeros((1, 2))  # the tool before stays along Z, so that pose does
            else:
                other = continued(form.machine, other, near, np.array([-1]), 0.0)[0]
        return self.writer.ticks(self.program.tip[pose], other)

    def _join(self, ticks: Ints, joined: Bools) -> None:
        """Give first control points that follow without a line the digits of the row before."""
        places = np.flatnonzero(joined)
        if not len(places):
            return
        if places[0] == 0:
            if self.position is not None:
                ticks[0] = self.position
            places = places[1:]
        ticks[places] = ticks[places - 1]

    def ticks_at(self, rows: Rows, tips: Floats, own: Ints) -> Ints:
        """Ticks of tips reached with the orientation of rows, which `own` names for each of them."""
        other = rows.other[own]
        if self.writer.form.orientation == "point":
            other = other + (tips - rows.tip[own])
        return self.writer.ticks(tips, other)

    def rotary_blocks(self, ticks: Ints, *, unwind: bool = True) -> dict[str, tuple[str, ...]]:
        """Blocks of the rotary axes, with where a row has them; a tool that stays along Z has them at zero."""
        if self.writer.plane is not None and self.writer.plane.angles is not None:
            ticks = self.tilting.ticks(np.zeros((1, 3)), self.writer.plane.angles[None])[0]
        return self.tilting.rotary_blocks(ticks, unwind=unwind)

    def _go_to(self, ticks: Ints, move: Ints) -> Iterator[bytes]:
        """Go to a place at the feed of a move, if the tool is elsewhere."""
        yield from self.emit(self.moving(Run.straight(self.program, ticks, move)))

    def moving(self, run: Run) -> Run:
        """Leave out the rows that do not move the tool in the written digits."""
        ticks = run.ticks
        new = np.ones(len(ticks), np.bool_)
        new[1:] = (ticks[1:] != ticks[:-1]).any(axis=1)
        if self.position is not None:
            new[0] = bool((ticks[0] != self.position).any())
        kept = new | (run.curve > 0)
        return run if kept.all() else some_rows(run, kept)

    def emit_above(self, run: Run, dwell: int = 0) -> Iterator[bytes]:
        """Write a run; where rotary axes swing the tool in a rapid, or turn back in a cut, the tool goes up before."""
        first = 0
        for row, in_cut in self._turns(run):
            if row > first:
                yield from self.emit(some_rows(run, slice(first, row)), dwell)
            if in_cut:
                yield from self._leave_cut(some_rows(run, slice(row, row + 1)))
            else:
                yield from self.text(self.operation.go_home())
            first = row + in_cut
        yield from self.emit(some_rows(run, slice(first, None)) if first else run, dwell)

    def emit(self, run: Run, dwell: int = 0, above: float = 0.0) -> Iterator[bytes]:
        """Write a run; after a retract the tool comes down along its axis from so many mm above."""
        if not len(run):
            return
        first, pose, writer, operation = run.ticks[0], int(run.move[0]), self.writer, self.operation
        if operation.comes_first and not above:
            self.warnings.of_first(pose, writer.form, rapid=bool(run.rapid[0]))
        if not operation.begun:
            if writer is self.tilting:
                self.warnings.of_tip_control(pose, writer.form)
            yield from self.text(operation.begin(self.rotary_blocks(first)))
        yield from self.text(operation.go_on())
        if operation.retracted:
            operation.retracted = False
            height = above or self.approach * bool(run.rapid[0])
            self._look_at_first(writer.lifted(first, height), pose)
            yield from self.text(self._approaches(first, height))
            run = run if above else run.with_programmed_feed(self.program)
        self.warnings.of_tool(pose, self.statements.tool)
        if not run.rapid.all():
            self.warnings.of_cut(int(run.move[np.argmin(run.rapid)]), turning=bool(operation.on["spindle"]))
        if writer.form.rotary:
            self.warnings.of_turns(run, writer.form, writer.angles)
        self.position = self.last = run.ticks[-1]
        self.last_writer, operation.halted = writer, False
        yield writer.text(run, dwell, operation.take_with_z())

    # ------------------------------------------------------------------------------------------------ retracts

    def _turns(self, run: Run) -> list[tuple[int, bool]]:
        """Rows before which the tool goes up so that rotary axes turn there, and whether that is within a cut."""
        turns = [] if run.left is None else [(row, True) for row in np.flatnonzero(run.left).tolist()]
        if self.writer.form.rotary and run.rapid.any():
            before = run.ticks[:1] if self.position is None else self.position[None]
            angles, lines = self.writer.angles(np.concatenate((before, run.ticks))), self.program.line[run.move]
            possible = self.operation.can_rewind()
            rows = retracts_before(self.writer.form, angles, run.rapid, lines, self.findings, possible)
            turns += [(row, False) for row in rows.tolist()]
        return sorted(turns)

    def _leave_cut(self, back: Run) -> Iterator[bytes]:
        """Leave a cut along the tool, and come back to the row where it goes on, with other rotary words, at feed."""
        assert self.position is not None
        if self.statements.compensated:
            refuse_compensated(self.program, int(back.move[0]))
        away = self.writer.form.rewind
        yield from self.text([self.writer.rapid(self.writer.lifted(self.position, away))])
        yield from self.text(self.operation.go_home(along=False))
        yield from self.emit(back, above=away)

    def _approaches(self, first: Ints, above: float) -> list[str]:
        """Blocks that bring the tool over its first position, and to where it comes down along its axis."""
        writer, down = self.writer, bool(above) and self.operation.can_rewind()
        start = writer.lifted(first, above) if down else first
        # a tilted tool under tool tip control, or in a tilted plane, goes there in one block (`first_block`), and so do
        # words of a second point, which would turn the tool elsewhere without Z
        at_once = writer.form.orientation == "point" or writer.tool_axis(start)[2] < UPRIGHT
        over = [] if at_once else [writer.rapid(start, chosen=np.arange(len(start)) != 2)]
        return [*over, writer.rapid(start, self.operation.take_with_z())] if down else over

    def _look_at_first(self, end: Ints, move: int) -> None:
        """Look at the block that leads a tilted tool to its first position from the height of the retract."""
        writer, form, axis = self.writer, self.writer.form, self.writer.tool_axis(end)
        if form.orientation not in ("angles", "fixed") or axis[2] >= UPRIGHT or not self.operation.can_rewind():
            return
        machine = None if form.machine is None else form.machine.with_tool(self.statements.tool)
        angles = writer.angles(end[None])[0] if form.rotary else None
        if writer.plane is not None:
            angles = writer.plane.angles
        where = self.program.source.name, int(self.program.line[move])
        check_first_block(form, machine, writer.tip(end), axis, angles, self._nose(), where, self.findings)

    def _nose(self) -> Floats | None:
        """(2,) mm, where the retract has left X and Y of the spindle nose; None where that is not known."""
        writer, machine = self.last_writer, self.writer.form.machine
        if machine is None:
            return None
        change = dict(machine.tool_change)
        if self.position is None and {"X", "Y"} <= change.keys():
            return np.array((change["X"], change["Y"]))
        if writer is None or self.last is None or not writer.form.rotary or {"X", "Y"} & change.keys():
            return None
        return nose_position(machine, writer.tip(self.last)[None], writer.angles(self.last[None]))[0, :2]

    def _withdraw(self) -> list[str]:
        """Blocks that bring the tool back along its axis, before a retract."""
        if not self.retract or self.position is None or not self.operation.can_rewind():
            return []
        self.position = self.writer.lifted(self.position, self.retract)
        return [*self.operation.go_on(), self.writer.rapid(self.position)]
