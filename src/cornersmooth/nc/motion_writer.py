"""Rows of the smoothed motion in order, with the statements in their places.

Python runs per statement and per block of rows, never per row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move, Statement
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.hole_writer import HoleWriter
from cornersmooth.nc.run import Run
from cornersmooth.nc.run_writer import RunWriter
from cornersmooth.nc.statement_args import with_starts
from cornersmooth.smoothing.sampling import Rows

#: a pose that no program has
_NOWHERE = 1 << 62


@dataclass
class MotionWriter:
    """Writes rows and statements in order.

    Parameters
    ----------
    runs : RunWriter
    native : bool
        Whether holes are cycles of the control, where they can be.
    """

    runs: RunWriter
    native: bool = False
    _repeated: int = 0
    _return_to: int = _NOWHERE  #: first pose behind a tool change, until it is reached
    _next_statement: int = 0
    _arc_begun: int = -1  #: arc behind a FROM whose start has been gone to
    _ticks: Ints = field(init=False)  #: of the block that is written
    _said: tuple[Statement, ...] = field(init=False)
    _holes: HoleWriter = field(init=False)

    def __post_init__(self) -> None:
        self._said = with_starts(self.runs.program)
        self._holes = HoleWriter(self.runs, self.native)

    def write(self, rows: Rows, ticks: Ints) -> Iterator[bytes]:
        """Text of a block of rows, with their numbers in ticks, and of the statements before and between them."""
        self._ticks = ticks
        moves = rows.move
        waiting = self._statements_until(int(moves[-1])) if len(moves) else []
        start = 0
        for statement in waiting:
            if self.runs.statements.only_counted(statement):  # thousands of them must not cut the rows to pieces
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
            self.runs.findings.add("CS312", "note", 0, text, self._repeated)

    def end(self) -> list[str]:
        """Blocks that cancel what is still on when the program ends."""
        last = [*self.runs.statements.end_compensation(), *self.runs.writer.end()]
        if self.runs.last is None:
            return [*last, *self.runs.operation.end()]
        return [*last, *self.runs.operation.end(self.runs.rotary_blocks(self.runs.last, unwind=False))]

    def _statements_until(self, pose: int) -> Sequence[Statement]:
        begin = self._next_statement
        said = self._said
        while self._next_statement < len(said) and said[self._next_statement].pose <= pose:
            self._next_statement += 1
        return said[begin : self._next_statement]

    def _say(self, statement: Statement) -> Iterator[bytes]:
        text = self.runs.statements.blocks(statement)
        if self.runs.statements.changed:  # a tool change leaves the machine elsewhere
            self.runs.position, self._return_to, self.runs.statements.changed = None, statement.pose, False
            self.runs.warnings.another_tool()
            self.runs.writer.forget_feed()
        if self.runs.operation.halted:
            self.runs.writer.forget_feed()
        yield from self.runs.text(text)

    def _between(self, rows: Rows, start: int, stop: int) -> Iterator[bytes]:
        """Rows between statements, holes apart from the others."""
        if start >= stop:
            return
        poses = rows.move[start:stop]
        hole, plane = self.runs.program.kind[poses] == Move.HOLE, self.runs.writers.planes.of[poses]
        edges = np.flatnonzero((hole[1:] != hole[:-1]) | (plane[1:] != plane[:-1]))
        for first, last in pairwise([start, *(start + 1 + edges).tolist(), stop]):
            yield from self.runs.stand(int(rows.move[first]))
            if hole[first - start]:
                self._return_to = _NOWHERE
                yield from self._holes.write(rows, slice(first, last))
            else:
                yield from self._lines(rows, first, last)

    def _lines(self, rows: Rows, start: int, stop: int) -> Iterator[bytes]:
        runs, part = self.runs, slice(start, stop)
        move, program = rows.move[part], runs.program
        ticks = self._ticks[part]
        if runs.writer is not runs.writers.tilting:
            ticks = runs.writer.ticks(rows.tip[part], rows.other[part])
        arc = rows.arc[part] if rows.arc is not None else None
        spline = rows.spline[part] if rows.spline is not None else None
        yield from self._go_back(int(move[0]), rows.other[part][:1])
        if arc is not None and arc[0] >= 0:  # after a tool change, a hole or a FROM the tool is not at its start
            yield from runs.go_to(runs.writer.ticks(program.tip[move[:1] - 1], rows.other[part][:1]), move[:1])
        elif self._begins_at_stated(int(move[0])):  # an arc in lines wants its start, too
            start_of_arc = runs.ticks_at(rows, part, program.tip[move[:1] - 1], np.zeros(1, np.int64))
            yield from runs.go_to(start_of_arc, move[:1])
        self._join(ticks, rows.joined[part])
        feed, mode = program.feed[move], program.feed_mode[move].astype(np.int64)
        if rows.rate is not None and runs.writer.plane is None:
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
            bezier=runs.writer.bezier(rows.tip[part], rows.other[part], rows.curve[part], spline),
            spline=spline,
            blend=rows.blend[part] if rows.blend is not None else None,
            left=rows.left[part] if rows.left is not None else None,
        )
        before = len(run)
        run = runs.moving(run)
        self._repeated += before - len(run)
        yield from runs.emit_above(run)

    def _begins_at_stated(self, move: int) -> bool:
        """Whether a move is an arc from a stated position, met for the first time."""
        kind = self.runs.program.kind
        if move in (0, self._arc_begun) or kind[move] != Move.ARC or kind[move - 1] != Move.FROM:
            return False
        self._arc_begun = move
        return True

    def _go_back(self, move: int, near: Floats) -> Iterator[bytes]:
        """Go to the pose behind a tool change even if it repeats the last one before, and so is no row."""
        runs, kind = self.runs, self.runs.program.kind
        begin, self._return_to = self._return_to, _NOWHERE
        passed = begin + np.flatnonzero(kind[begin:move] != Move.FROM)
        if runs.last is None or not len(passed) or kind[begin - 1] == Move.HOLE:  # which none repeats
            return
        again = runs.again(passed[:1], near)
        yield from runs.emit(Run.straight(runs.program, again, np.array([move])))

    def _join(self, ticks: Ints, joined: Bools) -> None:
        """Give first control points that follow without a line the digits of the row before."""
        places = np.flatnonzero(joined)
        if not len(places):
            return
        if places[0] == 0:
            if self.runs.position is not None:
                ticks[0] = self.runs.position
            places = places[1:]
        ticks[places] = ticks[places - 1]
