"""Runs of rows as text, and where the tool is: on its first positions, at retracts and behind them.

Python runs per run, never per row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cornersmooth.kinematics.poses import continued
from cornersmooth.kinematics.travel import nose_position
from cornersmooth.model import Floats, Ints, Program
from cornersmooth.nc.block_writer import BlockWriter
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.first_block import UPRIGHT, FirstBlock
from cornersmooth.nc.motion_warnings import MotionWarnings
from cornersmooth.nc.operation import Operation
from cornersmooth.nc.rewinds import refuse_compensated, retracts_before
from cornersmooth.nc.run import Run
from cornersmooth.nc.statement_writer import StatementWriter
from cornersmooth.nc.writers import Writers
from cornersmooth.smoothing.sampling import Rows


@dataclass
class RunWriter:
    """Writes runs in order and remembers where the tool is.

    Parameters
    ----------
    program : Program
    writers : Writers
        Of all poses.
    statements : StatementWriter
    operation : Operation
    findings : Findings
    approach, retract : float, mm
        Along the tool, behind a retract and before one.
    """

    program: Program
    writers: Writers
    statements: StatementWriter
    operation: Operation
    findings: Findings
    approach: float = 0.0
    retract: float = 0.0
    writer: BlockWriter = field(init=False)  #: that of the tool at hand
    position: NDArray[np.int64] | None = None  #: where the tool is, in ticks; None where it may be elsewhere
    last: NDArray[np.int64] | None = None  #: what was written last, a tool change or not
    last_writer: BlockWriter | None = None  #: and by which
    warnings: MotionWarnings = field(init=False)
    _blocks: int = 0  #: those that are not the writers'
    _plane: int = -1  #: tilted plane of the tool at hand

    def __post_init__(self) -> None:
        self.writer = self.writers.tilting
        self.warnings = MotionWarnings(self.program, self.findings)
        self.operation.withdraw = self._withdraw

    def stand(self, pose: int) -> Iterator[bytes]:
        """Take the writer of a pose; between tilted planes, and beside them, the tool goes up."""
        if self.operation.begun and self.writers.plane_of(pose) == self._plane:
            return
        writer = self.writers.of(pose, self.statements.tool)
        beside, self._plane = self._plane != self.writers.plane_of(pose), self.writers.plane_of(pose)
        if self.operation.begun or (beside and not self.operation.retracted):
            yield from self.text(self.operation.go_home())
        if writer is self.writer:
            return
        writer.take_over(self.writer)
        self.writer, self.operation.mode, self.position = writer, writer.form.mode, None
        self.operation.plane = writer.plane.words if writer.plane is not None else {}

    @property
    def written(self) -> int:
        """Blocks written so far."""
        return self._blocks + sum(writer.blocks for writer in self.writers.all())

    def text(self, blocks: Sequence[str]) -> Iterator[bytes]:
        """Text of blocks that are no motion of a run."""
        self._blocks += len(blocks)
        if blocks:
            yield ("\n".join(blocks) + "\n").encode("ascii")

    def ticks_at(self, rows: Rows, part: slice, tips: Floats, own: Ints) -> Ints:
        """Ticks of tips reached with the orientation of rows, which `own` names for each of them."""
        other = rows.other[part][own]
        if self.writer.form.orientation == "point":
            other = other + (tips - rows.tip[part][own])
        return self.writer.ticks(tips, other)

    def again(self, pose: Ints, near: Floats) -> Ints:
        """Ticks (1, c) of what was written last, by the writer at hand.

        Parameters
        ----------
        pose : (1,) int64
            Of the place that was written.
        near : (1, 2) or (1, 3) float64
            Orientation of the first row to come.
        """
        assert self.last is not None
        ticks, form = self.last[None], self.writer.form
        if self.last_writer is self.writer:
            return ticks
        other = self.program.axis[pose]
        if form.rotary and form.machine is not None:
            if ticks.shape[1] == self.writer.columns:
                other = self.writer.angles(ticks)
            elif self.last_writer is None or self.last_writer.plane is None:
                other = np.zeros((1, 2))  # the tool before stays along Z, so that pose does
            else:
                other = continued(form.machine, other, near, np.array([-1]), 0.0)[0]
        return self.writer.ticks(self.program.tip[pose], other)

    def rotary_blocks(self, ticks: Ints, *, unwind: bool = True) -> dict[str, tuple[str, ...]]:
        """Blocks of the rotary axes, with where a row has them; a tool that stays along Z has them at zero."""
        tilting = self.writers.tilting
        if self.writer.plane is not None and self.writer.plane.angles is not None:
            ticks = tilting.ticks(np.zeros((1, 3)), self.writer.plane.angles[None])[0]
        return tilting.rotary_blocks(ticks, unwind=unwind)

    def go_to(self, ticks: Ints, move: Ints) -> Iterator[bytes]:
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
        return run if kept.all() else run.only(kept)

    def emit_above(self, run: Run, dwell: int = 0) -> Iterator[bytes]:
        """Write a run; where rotary axes swing the tool in a rapid, or turn back in a cut, the tool goes up before."""
        first = 0
        for row, in_cut in self._turns(run):
            if row > first:
                yield from self.emit(run.part(first, row), dwell)
            if in_cut:
                yield from self._leave_cut(run.part(row, row + 1))
            else:
                yield from self.text(self.operation.go_home())
            first = row + in_cut
        yield from self.emit(run.part(first, len(run)) if first else run, dwell)

    def emit(self, run: Run, dwell: int = 0, above: float = 0.0) -> Iterator[bytes]:
        """Write a run; behind a retract the tool comes down along its axis from so many mm above."""
        if not len(run):
            return
        first = run.ticks[0]
        if self.operation.comes_first and not above:
            self.warnings.of_first(int(run.move[0]), self.writer.form, rapid=bool(run.rapid[0]))
        if not self.operation.begun:
            if self.writer is self.writers.tilting:
                self.warnings.of_tip_control(int(run.move[0]), self.writer.form)
            yield from self.text(self.operation.begin(self.rotary_blocks(first)))
        yield from self.text(self.operation.go_on())
        if self.operation.retracted:
            self.operation.retracted = False
            height = above or self.approach * bool(run.rapid[0])
            self._look_at_first(self.writer.lifted(first, height), int(run.move[0]))
            yield from self.text(self._approaches(first, height))
            run = run if above else run.first_as_said(self.program)
        self.warnings.of_tool(int(run.move[0]), self.statements.tool)
        if not run.rapid.all():
            self.warnings.of_cut(int(run.move[np.argmin(run.rapid)]), turning=bool(self.operation.spindle))
        if self.writer.form.rotary:
            self.warnings.of_turns(run, self.writer.form, self.writer.angles(run.ticks))
        self.position = self.last = run.ticks[-1]
        self.last_writer, self.operation.halted = self.writer, False
        yield self.writer.text(run, dwell, self.operation.take_with_z())

    def _turns(self, run: Run) -> list[tuple[int, bool]]:
        """Rows before which the tool goes up so that rotary axes turn there, and whether that is within a cut."""
        cuts = np.zeros(0, np.int64) if run.left is None else np.flatnonzero(run.left)
        return sorted([(row, False) for row in self._rewinds(run).tolist()] + [(row, True) for row in cuts.tolist()])

    def _rewinds(self, run: Run) -> Ints:
        """Rows before which the tool goes up, so that rotary axes turn back there."""
        if not self.writer.form.rotary or not len(run) or not run.rapid.any():
            return np.zeros(0, np.int64)
        before = run.ticks[:1] if self.position is None else self.position[None]
        angles = self.writer.angles(np.concatenate((before, run.ticks)))
        lines = self.program.line[run.move]
        return retracts_before(self.writer.form, angles, run.rapid, lines, self.findings, self.operation.can_rewind())

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
        if not (above and self.operation.can_rewind()):
            return self.writer.approach(first)
        start = self.writer.lifted(first, above)
        return [*self.writer.approach(start), self.writer.rapid(start, self.operation.take_with_z())]

    def _look_at_first(self, end: Ints, move: int) -> None:
        """Look at the block that leads a tilted tool to its first position from the height of the retract."""
        form, axis = self.writer.form, self.writer.tool_axis(end)
        if form.orientation not in ("angles", "fixed") or axis[2] >= UPRIGHT or not self.operation.can_rewind():
            return
        machine = None if form.machine is None else form.machine.with_tool(self.statements.tool)
        angles = self.writer.angles(end[None])[0] if form.rotary else None
        if self.writer.plane is not None:
            angles = self.writer.plane.angles
        line = int(self.program.line[move])
        block = FirstBlock(form, machine, self.writer.plane, self.writer.tip(end), axis, angles, line)
        block.check(self._nose(), self.findings, self.program.source.name)

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
