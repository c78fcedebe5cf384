"""Holes of the motion: as cycles of the control, as plain moves, or only gone over.

Python runs per run of holes; per hole where the control has a cycle for it, or nobody understands it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cornersmooth.model import FeedMode, Floats, Ints
from cornersmooth.nc.cycle_blocks import Hole, first_of_hole, hole_blocks, hole_feeds, kind_of
from cornersmooth.nc.holes import Cycle, approaches, hole_moves, travel_height, travel_of
from cornersmooth.nc.run import Run
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.text import format_number

if TYPE_CHECKING:
    from cornersmooth.nc.motion_writer import MotionWriter


@dataclass
class HoleWriter:
    """Writes the holes of a program.

    Parameters
    ----------
    motion : MotionWriter
        What the moves over holes and into them are written by.
    native : bool
        Whether holes are cycles of the control, where they can be.
    """

    motion: MotionWriter
    native: bool = False

    @cached_property
    def _approach(self) -> Ints:
        return approaches(self.motion.program)

    def write(self, rows: Rows) -> Iterator[bytes]:
        """Holes of one cycle, of the control or as plain moves; those left out are only approached."""
        motion = self.motion
        cycle, program, poses = motion.statements.cycles.now, motion.program, rows.move
        approach = self._approach[poses]
        line = int(program.line[poses[0]])
        kind = self._cycle_of_control(cycle, poses)
        if cycle is None or (cycle.tap and not kind):
            why = "its words are not understood" if cycle is None else self._why_no_tap(cycle, poses)
            motion.statements.cycles.leave_out(why, line, len(poses))
            yield from self._over_holes(rows, travel_height(program, poses, approach))
            return
        if kind:
            yield from self._cycles(cycle, kind, poses, approach)
            return
        motion.findings.add("CS316", "note", line, "hole of a cycle written as plain moves", len(poses))
        before = -1 if motion.operation.comes_first else int(poses[0]) - 1
        motion.warnings.of_holes(poses, before, *travel_of(cycle, program, poses, approach))
        moves = hole_moves(cycle, program, poses, approach)
        move = poses[moves.hole]
        ticks = motion.ticks_at(rows, moves.tip, moves.hole)
        run = replace(Run.straight(program, ticks, move), rapid=moves.rapid, dwell=moves.dwell)
        if not np.isnan(cycle.feed):
            run = replace(run, feed=np.full(len(move), cycle.feed), mode=np.full(len(move), int(cycle.feed_mode)))
        yield from motion.emit_above(motion.moving(run), cycle.dwell)

    def _cycle_of_control(self, cycle: Cycle | None, poses: Ints) -> str:
        """Cycle of the control that drills holes, as `kind_of` names it; empty for none."""
        if cycle is None or not self.motion.takes_cycles or not (self.native or cycle.tap):
            return ""
        if cycle.tap and not self._can_thread():
            return ""
        return kind_of(cycle, self.motion.writer.form, self.motion.program, poses)

    def _why_no_tap(self, cycle: Cycle, poses: Ints) -> str:
        """Why the control's cycle cannot do a tap, in words; plain moves cannot turn the spindle with the feed."""
        if not kind_of(cycle, self.motion.writer.form, self.motion.program, poses):
            return "a tap, and the control has no such cycle for it"
        if not self._can_thread():
            return "a tap takes a spindle that turns clockwise at a known speed"
        return "a tap, and the tool does not stay along Z between its changes, or nothing says that the rotary axes do"

    def _can_thread(self) -> bool:
        """Whether the spindle turns as a thread needs it."""
        return bool(self.motion.statements.clockwise and self.motion.statements.speed and self.motion.operation.turning)

    def _cycles(self, cycle: Cycle, kind: str, poses: Ints, approach: Ints) -> Iterator[bytes]:
        """Holes as cycles of the control, each from the height at which the tool goes from hole to hole."""
        motion, program, writer = self.motion, self.motion.program, self.motion.writer
        line, unit = int(program.line[poses[0]]), program.mm_per_unit
        motion.findings.add("CS347", "note", line, "hole written as a cycle of the control", len(poses))
        if kind == "tap":
            text = "a tap is left to the control's cycle: see that it turns the spindle with the feed"
            motion.findings.add("CS348", "warning", line, text, len(poses))
        motion.warnings.of_cut(int(poses[0]), turning=motion.operation.turning)
        feeds, modes = hole_feeds(cycle, program, poses)
        travel, clearance = travel_of(cycle, program, poses, approach)
        speed, table = motion.statements.speed or 0.0, writer.form.table.cycles
        once = first_of_hole(getattr(table, kind))
        frame = np.eye(3) if writer.plane is None else writer.plane.frame
        said: tuple[str, ...] = ()
        for k, pose in enumerate(poses.tolist()):
            tip = program.tip[pose]
            over = writer.ticks((tip + travel[k] * frame[:, 2])[None], program.axis[[pose]])
            above = Run.straight(program, over, poses[[k]])
            level = above.ticks[0, 2]
            if not said or motion.position is None or motion.position[2] != level:
                yield from motion.text(table.off if said else ())
                said = ()
                yield from motion.emit(motion.moving(replace(above, rapid=np.ones(1, np.bool_))))
                yield from motion.text(motion.operation.go_on())
                yield from motion.text(writer.feed_mode(int(modes[0])))
            hole = Hole(
                tip @ frame / unit,
                travel[k] / unit,
                clearance[k] / unit,
                cycle.depth / unit,
                writer.feed_word(feeds[k], int(modes[k])),
            )
            pitch = float(feeds[k]) / unit / (1.0 if modes[k] == FeedMode.PER_REVOLUTION or not speed else speed)
            blocks = hole_blocks(hole, cycle, kind, writer.form, speed, pitch, unit)
            yield from motion.text(blocks[once:] if said == blocks[:once] and said else blocks)
            said = blocks[:once] or blocks
            motion.position = motion.last = above.ticks[0]
        yield from motion.text(table.off)
        writer.forget_feed()

    def _over_holes(self, rows: Rows, height: Floats) -> Iterator[bytes]:
        motion, program = self.motion, self.motion.program
        decimals = motion.writer.form.tip_decimals(program.units)
        poses = rows.move
        tips = program.tip[poses] + height[:, None] * program.axis[poses]
        ticks = motion.ticks_at(rows, tips, np.arange(len(poses)))
        for index, pose in enumerate(poses.tolist()):
            tip = (program.tip[pose] / program.mm_per_unit).tolist()
            place = " ".join(
                f"{letter}{format_number(value, decimals)}" for letter, value in zip("XYZ", tip, strict=True)
            )
            yield from motion.text(motion.statements.warning_comment(f"NOT DRILLED: HOLE AT {place}"))
            run = Run.straight(program, ticks[index : index + 1], poses[index : index + 1])
            run = replace(run, rapid=np.ones(1, np.bool_))
            yield from motion.emit_above(motion.moving(run))
