"""Holes of the motion: as cycles of the control, as plain moves, or only gone over.

Plain moves run under tool tip control with any tool axis, where canned cycles are refused: rapid over the hole, rapid
to the clearance, feed to the depth, out again. The tool travels between holes at the greatest of the cycle's heights
and of the height from which the first hole was approached. ``DEEP`` retracts to the clearance after every ``STEP``,
``INCR`` or ``1STPECK``/``SUBPECK``, ``BRKCHP`` by `PECK_GAP` only. ``REAM`` and ``BORE`` come out at feed.

Python runs per run of holes; per hole where the control has a cycle for it, or its words are not understood.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program
from cornersmooth.nc.control import Blocks
from cornersmooth.nc.curve_blocks import Run
from cornersmooth.nc.cycle_blocks import hole_feeds, kind_of
from cornersmooth.nc.hole_cycles import Cycle
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.text import format_number
from cornersmooth.vectors import dot

if TYPE_CHECKING:
    from cornersmooth.nc.motion_writer import MotionWriter

#: mm left above the last depth before feeding goes on, and moved up to break a chip
PECK_GAP = 0.5

#: mm: the last peck takes what would be left; a tool only rubs there
LEAST_PECK = 0.01

#: axes whose directions differ by less, in the cosine, are the same for the height of travel
_SAME_AXIS = 1e-9


@dataclass
class HoleWriter:
    """Writes the holes of a program."""

    motion: MotionWriter  #: what the moves over holes and into them are written by
    native: bool = False  #: whether holes are cycles of the control, where they can be

    @cached_property
    def _approach(self) -> Ints:
        """(n,) pose from which the run of holes is approached that each pose belongs to, -1 for none."""
        kind = self.motion.program.kind
        return np.maximum.accumulate(np.where(kind == Move.HOLE, -1, np.arange(len(kind))))

    def write(self, rows: Rows) -> Iterator[bytes]:
        """Holes of one cycle, of the control or as plain moves; those left out are only approached."""
        motion = self.motion
        cycle, program, poses = motion.statements.cycles.now, motion.program, rows.move
        heights = travel_height(program, poses, self._approach[poses])
        lines, line = program.line[poses], int(program.line[poses[0]])
        kind, why = self._cycle_of_control(cycle, poses)
        if cycle is None or (cycle.tap and not kind):
            motion.statements.cycles.leave_out(why, line, len(poses))
            yield from self._over_holes(rows, heights)
            return
        travel = np.maximum(heights, max(cycle.retract, cycle.clearance or 0.0))
        clearance = travel if cycle.clearance is None else np.full(len(poses), cycle.clearance)
        if kind:
            yield from self._cycles(cycle, kind, poses, travel, clearance)
            return
        motion.findings.add_each("CS316", "note", lines, "hole of a cycle written as plain moves")
        before = -1 if motion.operation.comes_first else int(poses[0]) - 1
        motion.warnings.of_holes(poses, before, travel, clearance)
        hole, tip, rapid, dwell = hole_moves(cycle, program, poses, travel, clearance)
        move = poses[hole]
        run = replace(Run.straight(program, motion.ticks_at(rows, tip, hole), move), rapid=rapid, dwell=dwell)
        if not np.isnan(cycle.feed):
            run = replace(run, feed=np.full(len(move), cycle.feed), mode=np.full(len(move), int(cycle.feed_mode)))
        yield from motion.emit_above(motion.moving(run), cycle.dwell)

    def _cycle_of_control(self, cycle: Cycle | None, poses: Ints) -> tuple[str, str]:
        """Cycle of the control that drills holes, as `kind_of` names it; empty for none, and then why no tap can be.

        Plain moves cannot turn the spindle with the feed.
        """
        motion = self.motion
        if cycle is None:
            return "", "its words are not understood"
        kind = kind_of(cycle, motion.writer.form, motion.program, poses)
        if not kind:
            return "", "a tap, and the control has no such cycle for it"
        if cycle.tap and not (motion.statements.clockwise and motion.statements.speed and motion.operation.turning):
            return "", "a tap takes a spindle that turns clockwise at a known speed"
        if not motion.takes_cycles:
            where = "the tool does not stay along Z between its changes, or nothing says that the rotary axes do"
            return "", f"a tap, and {where}"
        return kind if self.native or cycle.tap else "", ""

    def _cycles(self, cycle: Cycle, kind: str, poses: Ints, travel: Floats, clearance: Floats) -> Iterator[bytes]:
        """Holes as cycles of the control, each from the height at which the tool goes from hole to hole."""
        motion, program, writer = self.motion, self.motion.program, self.motion.writer
        motion.findings.add_each("CS347", "note", program.line[poses], "hole written as a cycle of the control")
        if kind == "tap":
            text = "a tap is left to the control's cycle: see that it turns the spindle with the feed"
            motion.findings.add_each("CS348", "warning", program.line[poses], text)
        motion.warnings.of_cut(int(poses[0]), turning=motion.operation.turning)
        feeds, modes = hole_feeds(cycle, program, poses)
        table = writer.form.table.cycles
        once = next(
            (k for k, block in enumerate(getattr(table, kind)) if "{x}" in block), 0
        )  # before those of each hole
        frame = np.eye(3) if writer.plane is None else writer.plane.frame
        said: tuple[str, ...] = ()
        for k, pose in enumerate(poses.tolist()):
            tip = program.tip[pose]
            over = writer.ticks((tip + travel[k] * frame[:, 2])[None], program.axis[[pose]])
            if not said or motion.position is None or motion.position[2] != over[0, 2]:
                yield from motion.text(table.off if said else ())
                said = ()
                yield from motion.emit(motion.moving(Run.straight(program, over, poses[[k]], rapid=True)))
                yield from motion.text(motion.operation.go_on())
                yield from motion.text(writer.feed_mode(int(modes[0])))
            blocks = self._blocks(cycle, kind, tip @ frame, travel[k], clearance[k], feeds[k], int(modes[k]))
            yield from motion.text(blocks[once:] if said == blocks[:once] and said else blocks)
            said = blocks[:once] or blocks
            motion.position = motion.last = over[0]
        yield from motion.text(table.off)
        writer.forget_feed()

    def _blocks(
        self, cycle: Cycle, kind: str, top: Floats, travel: float, clearance: float, feed: float, mode: int
    ) -> Blocks:
        """Blocks of one hole with its top, (3,) mm, and heights above it; distances are those of written heights."""
        writer, unit = self.motion.writer, self.motion.program.mm_per_unit
        table, speed = writer.form.table, self.motion.statements.speed or 0.0
        decimals, plus = writer.form.tip_decimals(self.motion.program.units), writer.form.mode.motion.signs

        def rounded(value: float) -> float:
            return float(format_number(value, decimals))

        x, y, z = (top / unit).tolist()
        places = {"x": x, "y": y, "top": rounded(z), "bottom": rounded(z - cycle.depth / unit)}
        places |= {"travel": rounded(z + travel / unit), "clearance": rounded(z + clearance / unit)}
        places |= {"setup": places["clearance"] - places["top"], "above": places["travel"] - places["top"]}
        pitch = feed / unit / (1.0 if mode == FeedMode.PER_REVOLUTION or not speed else speed)
        values = {name: format_number(value, decimals, plus=plus) for name, value in places.items()} | {
            "depth": format_number(places["top"] - places["bottom"], decimals),
            "step": format_number(cycle.steps[0] / unit if cycle.steps else 0.0, decimals),
            "feed": writer.feed_word(feed, mode),
            "milliseconds": cycle.dwell,
            "seconds": format_number(cycle.dwell / 1000.0, 3, trim=True),
            "pitch": format_number(pitch, max(decimals, table.digits.most)),
            "speed": format_number(speed, table.digits.speed, trim=True).rstrip("."),
        }
        return tuple(block.format(**values) for block in getattr(table.cycles, kind))

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
            run = Run.straight(program, ticks[index : index + 1], poses[index : index + 1], rapid=True)
            yield from motion.emit_above(motion.moving(run))


def hole_moves(
    cycle: Cycle, program: Program, poses: Ints, travel: Floats, clearance: Floats
) -> tuple[Ints, Floats, Bools, Bools]:
    """Plain moves for holes of one cycle, m of them: the hole of each, its end (m, 3) mm, rapids, dwells after it.

    Heights (h,) above the holes, mm: at which the tool goes from hole to hole, and where feeding begins.
    """
    heights, rapid, dwell = [travel, clearance], [True, True], [False, False]

    def go(height: Floats, *, fast: bool) -> None:
        heights.append(height)
        rapid.append(fast)
        dwell.append(False)

    done = 0.0
    for depth in _peck_depths(cycle):
        if done > 0.0:
            if cycle.full_retract:
                go(clearance, fast=True)
                go(np.minimum(clearance, PECK_GAP - done), fast=True)
            else:
                go(np.minimum(clearance, PECK_GAP - done), fast=True)
        go(np.full(len(poses), -depth), fast=False)
        done = depth
    dwell[-1] = cycle.dwell > 0
    if cycle.feed_out:
        go(clearance, fast=False)
    go(travel, fast=True)
    height = np.stack(heights, axis=1)
    tip = program.tip[poses][:, None, :] + height[..., None] * program.axis[poses][:, None, :]
    count = len(poses)
    hole = np.repeat(np.arange(count), len(rapid))
    return hole, tip.reshape(-1, 3), np.tile(rapid, count), np.tile(dwell, count)


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


def _peck_depths(cycle: Cycle) -> list[float]:
    """Depths to which the tool feeds, one after another."""
    depths = []
    depth, steps = 0.0, list(cycle.steps) if cycle.pecking else []
    while steps:
        depth += steps.pop(0) if len(steps) > 1 else steps[0]
        if depth >= cycle.depth - LEAST_PECK:
            break
        depths.append(depth)
    return [*depths, cycle.depth]
