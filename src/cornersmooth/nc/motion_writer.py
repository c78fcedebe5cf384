"""Rows of the smoothed motion in order, with the statements in their places, holes drilled and positions remembered.

Python runs per statement, per run of holes and per block of rows, never per row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cornersmooth.kinematics.poses import continued
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program, Statement
from cornersmooth.nc.block_writer import BlockWriter
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.cycle_blocks import Hole, first_of_hole, hole_blocks, hole_feeds, kind_of
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.holes import Cycle, approaches, hole_moves, travel_height, travel_of
from cornersmooth.nc.motion_warnings import MotionWarnings
from cornersmooth.nc.operation import Operation
from cornersmooth.nc.rewinds import refuse_compensated, retracts_before
from cornersmooth.nc.run import Run
from cornersmooth.nc.statement_args import with_starts
from cornersmooth.nc.statement_writer import StatementWriter
from cornersmooth.nc.writers import Writers
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.text import format_number

#: a pose that no program has
_NOWHERE = 1 << 62


@dataclass
class MotionWriter:
    """Writes rows in order and remembers where the tool is.

    Parameters
    ----------
    program : Program
    writer : BlockWriter
    statements : StatementWriter
    operation : Operation
    findings : Findings
    writers : Writers
        Of all poses.
    native : bool
        Whether holes are cycles of the control, where they can be.
    """

    program: Program
    writers: Writers
    statements: StatementWriter
    operation: Operation
    findings: Findings
    approach: float = 0.0  #: mm along the tool, behind a retract
    retract: float = 0.0  #: mm along the tool, before a retract
    native: bool = False
    writer: BlockWriter = field(init=False)  #: that of the tool at hand
    blocks: int = 0  #: those that are not `writer`'s
    _repeated: int = 0
    _position: NDArray[np.int64] | None = None
    _last: NDArray[np.int64] | None = None  #: what was written last, a tool change or not
    _return_to: int = _NOWHERE  #: first pose behind a tool change, until it is reached
    _next_statement: int = 0
    _plane: int = -1  #: tilted plane of the tool at hand
    _arc_begun: int = -1  #: arc behind a FROM whose start has been gone to
    _ticks: Ints = field(init=False)  #: of the block that is written
    _said: tuple[Statement, ...] = field(init=False)
    _approach: Ints | None = field(init=False)
    _warnings: MotionWarnings = field(init=False)
    _last_writer: BlockWriter | None = None

    def __post_init__(self) -> None:
        self.writer = self.writers.tilting
        self._warnings = MotionWarnings(self.program, self.findings)
        self._said = with_starts(self.program)
        self.operation.withdraw = self._withdraw
        self._approach = approaches(self.program) if (self.program.kind == Move.HOLE).any() else None

    def write(self, rows: Rows, ticks: Ints) -> Iterator[bytes]:
        """Text of a block of rows, with their numbers in ticks, and of the statements before and between them."""
        self._ticks = ticks
        moves = rows.move
        waiting = self._statements_until(int(moves[-1])) if len(moves) else []
        start = 0
        for statement in waiting:
            if self.statements.only_counted(statement):  # thousands of them must not cut the rows to pieces
                continue
            stop = int(np.searchsorted(moves, statement.pose))
            if stop > start:
                yield from self._between(rows, start, stop)
                start = stop
            yield from self._say(statement)
        yield from self._between(rows, start, len(moves))

    def finish(self) -> Iterator[bytes]:
        """Text of the statements behind the last row."""
        for statement in self._said[self._next_statement :]:
            yield from self._say(statement)
        self._next_statement = len(self._said)
        if self._repeated:
            text = "move of zero length in the written digits left out"
            self.findings.add("CS312", "note", 0, text, self._repeated)

    def end(self) -> list[str]:
        """Blocks that cancel what is still on when the program ends."""
        last = [*self.statements.end_compensation(), *self.writer.end()]
        if self._last is None:
            return [*last, *self.operation.end()]
        return [*last, *self.operation.end(self._rotary_blocks(self._last))]

    def _statements_until(self, pose: int) -> Sequence[Statement]:
        begin = self._next_statement
        said = self._said
        while self._next_statement < len(said) and said[self._next_statement].pose <= pose:
            self._next_statement += 1
        return said[begin : self._next_statement]

    def _say(self, statement: Statement) -> Iterator[bytes]:
        text = self.statements.blocks(statement)
        if self.statements.changed:  # a tool change leaves the machine elsewhere
            self._position, self._return_to, self.statements.changed = None, statement.pose, False
            self._warnings.another_tool()
        yield from self._blocks(text)

    def _blocks(self, text: Sequence[str]) -> Iterator[bytes]:
        self.blocks += len(text)
        if text:
            yield ("\n".join(text) + "\n").encode("ascii")

    def _between(self, rows: Rows, start: int, stop: int) -> Iterator[bytes]:
        """Rows between statements, holes apart from the others."""
        if start >= stop:
            return
        poses = rows.move[start:stop]
        hole, plane = self.program.kind[poses] == Move.HOLE, self.writers.planes.of[poses]
        edges = np.flatnonzero((hole[1:] != hole[:-1]) | (plane[1:] != plane[:-1]))
        for first, last in pairwise([start, *(start + 1 + edges).tolist(), stop]):
            yield from self._stand(int(rows.move[first]))
            if hole[first - start] and self._approach is not None:
                yield from self._holes(rows, slice(first, last), self._approach)
            else:
                yield from self._lines(rows, first, last)

    def _stand(self, pose: int) -> Iterator[bytes]:
        """Take the writer of a pose; between tilted planes, and beside them, the tool goes up."""
        if self.operation.begun and self.writers.plane_of(pose) == self._plane:
            return
        writer = self.writers.of(pose, self.statements.tool)
        beside, self._plane = self._plane != self.writers.plane_of(pose), self.writers.plane_of(pose)
        if self.operation.begun or (beside and not self.operation.retracted):
            yield from self._blocks(self.operation.go_home())
        if writer is self.writer:
            return
        writer.take_over(self.writer)
        self.writer, self.operation.mode, self._position = writer, writer.form.mode, None
        self.operation.plane = writer.plane.words if writer.plane is not None else {}

    @property
    def written(self) -> int:
        """Blocks written so far."""
        return self.blocks + sum(writer.blocks for writer in self.writers.all())

    def _rotary_blocks(self, ticks: Ints) -> dict[str, tuple[str, ...]]:
        """Blocks of the rotary axes, with where a row has them; a tool that stays along Z has them at zero."""
        tilting = self.writers.tilting
        if self.writer.plane is not None and self.writer.plane.angles is not None:
            ticks = tilting.ticks(np.zeros((1, 3)), self.writer.plane.angles[None])[0]
        return tilting.rotary_blocks(ticks)

    def _lines(self, rows: Rows, start: int, stop: int) -> Iterator[bytes]:
        part = slice(start, stop)
        move, program = rows.move[part], self.program
        ticks = self._ticks[part]
        if self.writer is not self.writers.tilting:
            ticks = self.writer.ticks(rows.tip[part], rows.other[part])
        arc = rows.arc[part] if rows.arc is not None else None
        spline = rows.spline[part] if rows.spline is not None else None
        yield from self._go_back(int(move[0]), rows.other[part][:1])
        if arc is not None and arc[0] >= 0:  # after a tool change, a hole or a FROM the tool is not at its start
            yield from self._go_to(self.writer.ticks(program.tip[move[:1] - 1], rows.other[part][:1]), move[:1])
        elif self._begins_at_stated(int(move[0])):  # an arc in lines wants its start, too
            start_of_arc = self._shifted(rows, part, program.tip[move[:1] - 1], np.zeros(1, np.int64))
            yield from self._go_to(start_of_arc, move[:1])
        self._join(ticks, rows.joined[part])
        feed, mode = program.feed[move], program.feed_mode[move].astype(np.int64)
        if rows.rate is not None and self.writer.plane is None:
            rate = rows.rate[part]
            timed = ~np.isnan(rate)
            feed, mode = np.where(timed, rate, feed), np.where(timed, INVERSE_TIME, mode)
        run = Run(
            ticks=ticks,
            move=move,
            rapid=program.kind[move] == Move.RAPID,
            feed=feed,
            mode=mode,
            curve=rows.curve[part],
            weights=rows.weights[part] if rows.weights is not None else None,
            arc=arc,
            bezier=self.writer.bezier(rows.tip[part], rows.other[part], rows.curve[part], spline),
            spline=spline,
            blend=rows.blend[part] if rows.blend is not None else None,
            left=rows.left[part] if rows.left is not None else None,
        )
        before = len(run)
        run = self._moving(run)
        self._repeated += before - len(run)
        yield from self._emit_above(run)

    def _emit_above(self, run: Run, dwell: int = 0) -> Iterator[bytes]:
        """Write a run; where rotary axes swing the tool in a rapid, or turn back in a cut, the tool goes up before."""
        first = 0
        for row, in_cut in self._turns(run):
            if row > first:
                yield from self._emit(run.part(first, row), dwell)
            if in_cut:
                yield from self._leave_cut(run.part(row, row + 1))
            else:
                yield from self._blocks(self.operation.go_home())
            first = row + in_cut
        yield from self._emit(run.part(first, len(run)) if first else run, dwell)

    def _turns(self, run: Run) -> list[tuple[int, bool]]:
        """Rows before which the tool goes up so that rotary axes turn there, and whether that is within a cut."""
        cuts = np.zeros(0, np.int64) if run.left is None else np.flatnonzero(run.left)
        return sorted([(row, False) for row in self._rewinds(run).tolist()] + [(row, True) for row in cuts.tolist()])

    def _leave_cut(self, back: Run) -> Iterator[bytes]:
        """Leave a cut along the tool, and come back to the row where it goes on, with other rotary words, at feed."""
        assert self._position is not None
        if self.statements.compensated:
            refuse_compensated(self.program, int(back.move[0]))
        away = self.writer.form.rewind
        yield from self._blocks([self.writer.rapid(self.writer.lifted(self._position, away))])
        yield from self._blocks(self.operation.go_home(along=False))
        yield from self._emit(back, above=away)

    def _rewinds(self, run: Run) -> Ints:
        """Rows before which the tool goes up, so that rotary axes turn back there."""
        if not self.writer.form.rotary or not len(run) or not run.rapid.any():
            return np.zeros(0, np.int64)
        before = run.ticks[:1] if self._position is None else self._position[None]
        angles = self.writer.angles(np.concatenate((before, run.ticks)))
        lines = self.program.line[run.move]
        return retracts_before(self.writer.form, angles, run.rapid, lines, self.findings, self.operation.can_rewind())

    def _begins_at_stated(self, move: int) -> bool:
        """Whether a move is an arc from a stated position, met for the first time."""
        kind = self.program.kind
        if move in (0, self._arc_begun) or kind[move] != Move.ARC or kind[move - 1] != Move.FROM:
            return False
        self._arc_begun = move
        return True

    def _go_back(self, move: int, near: Floats) -> Iterator[bytes]:
        """Go to the pose behind a tool change even if it repeats the last one before, and so is no row."""
        begin, self._return_to = self._return_to, _NOWHERE
        passed = begin + np.flatnonzero(self.program.kind[begin:move] != Move.FROM)
        if self._last is None or not len(passed) or self.program.kind[begin - 1] == Move.HOLE:  # which none repeats
            return
        again = self._last[None]
        if self._last_writer is not self.writer:
            pose = passed[:1]
            other = self.program.axis[pose]
            if self.writer.form.rotary and self.writer.form.machine is not None:
                if again.shape[1] == self.writer.columns:
                    other = self.writer.angles(again)
                elif self._last_writer is None or self._last_writer.plane is None:
                    other = np.zeros((1, 2))  # the tool before stays along Z, so that pose does
                else:
                    other = continued(self.writer.form.machine, other, near, np.array([-1]), 0.0)[0]
            again = self.writer.ticks(self.program.tip[pose], other)
        yield from self._emit(Run.straight(self.program, again, np.array([move])))

    def _go_to(self, ticks: Ints, move: Ints) -> Iterator[bytes]:
        """Go to a place at the feed of a move, if the tool is elsewhere."""
        yield from self._emit(self._moving(Run.straight(self.program, ticks, move)))

    def _holes(self, rows: Rows, part: slice, approach: Ints) -> Iterator[bytes]:
        """Holes of one cycle, of the control or as plain moves; those not understood are only approached."""
        cycle, program, poses = self.statements.cycle, self.program, rows.move[part]
        self._return_to = _NOWHERE
        line = int(program.line[poses[0]])
        kind = self._cycle_of_control(cycle, poses)
        if cycle is not None and cycle.tap and not kind:
            if not self.statements.skip_taps:
                self.statements.refuse_tap(self._why_no_tap(cycle, poses))
            cycle = None
        if cycle is None:
            text = "hole of a cycle that is not understood; it is not drilled, the tool only goes over it"
            self.findings.add("CS315", "warning", line, text, len(poses))
            yield from self._over_holes(rows, part, travel_height(program, poses, approach[poses]))
            return
        if kind:
            yield from self._cycles(cycle, kind, poses, approach)
            return
        self.findings.add("CS316", "note", line, "hole of a cycle written as plain moves", len(poses))
        before = -1 if self.operation.comes_first else int(poses[0]) - 1
        self._warnings.of_holes(poses, before, *travel_of(cycle, program, poses, approach[poses]))
        moves = hole_moves(cycle, program, poses, approach[poses])
        move = poses[moves.hole]
        ticks = self._shifted(rows, part, moves.tip, moves.hole)
        run = replace(Run.straight(program, ticks, move), rapid=moves.rapid, dwell=moves.dwell)
        if not np.isnan(cycle.feed):
            run = replace(run, feed=np.full(len(move), cycle.feed), mode=np.full(len(move), int(cycle.feed_mode)))
        yield from self._emit_above(self._moving(run), cycle.dwell)

    def _cycle_of_control(self, cycle: Cycle | None, poses: Ints) -> str:
        """Cycle of the control that drills holes, as `kind_of` names it; empty for none."""
        if cycle is None or not self.writers.takes_cycles(self.writer) or not (self.native or cycle.tap):
            return ""
        return "" if cycle.tap and not self._can_thread() else kind_of(cycle, self.writer.form, self.program, poses)

    def _why_no_tap(self, cycle: Cycle, poses: Ints) -> str:
        """Why the control's cycle cannot do a tap, in words."""
        if not kind_of(cycle, self.writer.form, self.program, poses):
            return "the control has no such cycle for it"
        if not self._can_thread():
            return "it takes a spindle that turns clockwise at a known speed"
        return "the tool does not stay along Z between its changes, or nothing says that the rotary axes do"

    def _can_thread(self) -> bool:
        """Whether the spindle turns as a thread needs it."""
        return bool(self.statements.clockwise and self.statements.speed and self.operation.turning)

    def _cycles(self, cycle: Cycle, kind: str, poses: Ints, approach: Ints) -> Iterator[bytes]:
        """Holes as cycles of the control, each from the height at which the tool goes from hole to hole."""
        program, writer = self.program, self.writer
        line, unit = int(program.line[poses[0]]), program.mm_per_unit
        self.findings.add("CS347", "note", line, "hole written as a cycle of the control", len(poses))
        if kind == "tap":
            text = "a tap is left to the control's cycle: see that it turns the spindle with the feed"
            self.findings.add("CS348", "warning", line, text, len(poses))
        self._warnings.of_cut(int(poses[0]), turning=self.operation.turning)
        feeds, modes = hole_feeds(cycle, program, poses)
        travel, clearance = travel_of(cycle, program, poses, approach[poses])
        speed, table = self.statements.speed or 0.0, writer.form.table.cycles
        once = first_of_hole(getattr(table, kind))
        frame = np.eye(3) if writer.plane is None else writer.plane.frame
        said: tuple[str, ...] = ()
        for k, pose in enumerate(poses.tolist()):
            tip = program.tip[pose]
            over = writer.ticks((tip + travel[k] * frame[:, 2])[None], program.axis[[pose]])
            above = Run.straight(program, over, poses[[k]])
            level = above.ticks[0, 2]
            if not said or self._position is None or self._position[2] != level:
                yield from self._blocks(table.off if said else ())
                said = ()
                yield from self._emit(self._moving(replace(above, rapid=np.ones(1, np.bool_))))
                yield from self._blocks(self.operation.go_on())
                yield from self._blocks(writer.feed_mode(int(modes[0])))
            hole = Hole(
                tip @ frame / unit,
                travel[k] / unit,
                clearance[k] / unit,
                cycle.depth / unit,
                writer.feed_word(feeds[k], int(modes[k])),
            )
            pitch = float(feeds[k]) / unit / (1.0 if modes[k] == FeedMode.PER_REVOLUTION or not speed else speed)
            blocks = hole_blocks(hole, cycle, kind, writer.form, speed, pitch, unit)
            yield from self._blocks(blocks[once:] if said == blocks[:once] and said else blocks)
            said = blocks[:once] or blocks
            self._position = self._last = above.ticks[0]
        yield from self._blocks(table.off)
        writer.forget_feed()

    def _over_holes(self, rows: Rows, part: slice, height: Floats) -> Iterator[bytes]:
        program = self.program
        decimals = self.writer.form.tip_decimals(program.units)
        poses = rows.move[part]
        tips = program.tip[poses] + height[:, None] * program.axis[poses]
        ticks = self._shifted(rows, part, tips, np.arange(len(poses)))
        for index, pose in enumerate(poses.tolist()):
            tip = (program.tip[pose] / program.mm_per_unit).tolist()
            place = " ".join(
                f"{letter}{format_number(value, decimals)}" for letter, value in zip("XYZ", tip, strict=True)
            )
            yield from self._blocks(self.statements.warning_comment(f"NOT DRILLED: HOLE AT {place}"))
            run = Run.straight(program, ticks[index : index + 1], poses[index : index + 1])
            run = replace(run, rapid=np.ones(1, np.bool_))
            yield from self._emit_above(self._moving(run))

    def _shifted(self, rows: Rows, part: slice, tips: Floats, own: Ints) -> Ints:
        """Ticks of tips reached with the orientation of rows, which `own` names for each of them."""
        other = rows.other[part][own]
        if self.writer.form.orientation == "point":
            other = other + (tips - rows.tip[part][own])
        return self.writer.ticks(tips, other)

    def _join(self, ticks: Ints, joined: Bools) -> None:
        """Give first control points that follow without a line the digits of the row before."""
        places = np.flatnonzero(joined)
        if not len(places):
            return
        if places[0] == 0:
            if self._position is not None:
                ticks[0] = self._position
            places = places[1:]
        ticks[places] = ticks[places - 1]

    def _moving(self, run: Run) -> Run:
        """Leave out the rows that do not move the tool in the written digits."""
        ticks = run.ticks
        new = np.ones(len(ticks), np.bool_)
        new[1:] = (ticks[1:] != ticks[:-1]).any(axis=1)
        if self._position is not None:
            new[0] = bool((ticks[0] != self._position).any())
        kept = new | (run.curve > 0)
        return run if kept.all() else run.only(kept)

    def _emit(self, run: Run, dwell: int = 0, above: float = 0.0) -> Iterator[bytes]:
        """Write a run; behind a retract the tool comes down along its axis from so many mm above."""
        if not len(run):
            return
        first = run.ticks[0]
        if self.operation.comes_first and not above:
            self._warnings.of_first(int(run.move[0]), self.writer.form, rapid=bool(run.rapid[0]))
        if not self.operation.begun:
            if self.writer is self.writers.tilting:
                self._warnings.of_tip_control(int(run.move[0]), self.writer.form)
            yield from self._blocks(self.operation.begin(self._rotary_blocks(first)))
        yield from self._blocks(self.operation.go_on())
        if self.operation.retracted:
            self.operation.retracted = False
            yield from self._blocks(self._approaches(first, above or self.approach * bool(run.rapid[0])))
            run = run if above else run.first_as_said(self.program)
        self._warnings.of_tool(int(run.move[0]), self.statements.tool)
        if not run.rapid.all():
            self._warnings.of_cut(int(run.move[np.argmin(run.rapid)]), turning=bool(self.operation.spindle))
        if self.writer.form.rotary:
            self._warnings.of_turns(run, self.writer.form, self.writer.angles(run.ticks))
        self._position = self._last = run.ticks[-1]
        self._last_writer, self.operation.halted = self.writer, False
        yield self.writer.text(run, dwell, self.operation.take_with_z())

    def _approaches(self, first: Ints, above: float) -> list[str]:
        """Blocks that bring the tool over its first position, and to where it comes down along its axis."""
        if not (above and self.operation.can_rewind()):
            return self.writer.approach(first)
        start = self.writer.lifted(first, above)
        return [*self.writer.approach(start), self.writer.rapid(start, self.operation.take_with_z())]

    def _withdraw(self) -> list[str]:
        """Blocks that bring the tool back along its axis, before a retract."""
        if not self.retract or self._position is None or not self.operation.can_rewind():
            return []
        self._position = self.writer.lifted(self._position, self.retract)
        return [*self.operation.go_on(), self.writer.rapid(self._position)]
