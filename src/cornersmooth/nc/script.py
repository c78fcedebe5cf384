"""One pass over statements and rows: what comes in which order.

A statement changes what the control remembers; a stretch of rows asks for it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from cornersmooth.arrays import some_rows
from cornersmooth.model import Move, Statement
from cornersmooth.nc.coordinates import Coordinates
from cornersmooth.nc.holes import Holes
from cornersmooth.nc.motion import Motion
from cornersmooth.nc.planes import Planes
from cornersmooth.nc.program_frame import Stream
from cornersmooth.nc.rotary_words import machine_of
from cornersmooth.nc.statement_args import with_starts
from cornersmooth.nc.statement_writer import StatementWriter
from cornersmooth.smoothing.sampling import Rows


@dataclass
class Script:
    """Writes rows and statements in order."""

    statements: StatementWriter
    motion: Motion
    holes: Holes
    planes: Planes
    _coordinates: dict[tuple[bool, int | None], Coordinates] = field(default_factory=dict)  #: besides `Motion.tilting`
    _tilted: int = -1  #: tilted plane of the tool at hand
    _next: int = 0
    _in_order: tuple[Statement, ...] = field(init=False)

    def __post_init__(self) -> None:
        self._in_order = with_starts(self.motion.program)

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
            if statement.word == "PAINT":  # thousands of them must not cut the rows to pieces
                self.statements.blocks(statement)
                continue
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
        poses = rows.move[start:stop]
        hole, plane = self.motion.program.kind[poses] == Move.HOLE, self.planes.of[poses]
        edges = np.flatnonzero((hole[1:] != hole[:-1]) | (plane[1:] != plane[:-1]))
        for first, last in pairwise([0, *(1 + edges).tolist(), stop - start]):
            part = slice(start + first, start + last)
            self._take_coordinates(int(poses[first]))
            if hole[first]:
                self.holes.write(some_rows(rows, part))
            else:
                self.motion.lines(some_rows(rows, part))

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
