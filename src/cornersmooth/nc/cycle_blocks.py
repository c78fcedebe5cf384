"""Holes as cycles of the control: which tools may have them, and which cycle does what the CL file asks for.

Controls take no hole cycles and no cutter compensation under tool tip control. So a tool has cycles only where it stays
along Z from its change to the next, and where the rotary axes are known to stand at zero: then it runs without tool tip
control (`Form.upright`), and X Y Z mean the same. All its other motion is written without orientation. Everything else
stays plain moves. Where cycles are wanted, a tool with cutter compensation runs in the same way.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.kinematics import machine_position, tool_axis
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program
from cornersmooth.nc.form import Form
from cornersmooth.nc.hole_cycles import Cycle, in_force, read_cycle
from cornersmooth.nc.statement_args import words_of
from cornersmooth.nc.tools import tool_starts

#: sides of the path on which cutter compensation keeps the tool
_SIDES: Final = (["LEFT"], ["RIGHT"])

#: by how much a tool axis along Z may be off, and a position at angles of zero, mm
_ALONG_Z, _SAME_PLACE = 1e-9, 1e-9


def upright_poses(program: Program, form: Form, *, drills: bool) -> Bools:
    """(n,) whether a pose belongs to a tool that runs without tool tip control, for cycles or cutter compensation.

    In curves all tools do that can: without words of the tool axis arcs are circles, and curves those of every control.
    Where the tool axis is a second point, all tools have it or none: a control keeps U V W from tool to tool, and no
    word says where they are before the first.

    `drills` says whether holes are to be written as cycles; taps are in any case.
    """
    chosen = np.zeros(len(program), np.bool_)
    holes = program.kind == Move.HOLE
    sides = [one for one in program.statements if one.word == "CUTCOM" and words_of(one)[:1] in _SIDES]
    compensated = [one.pose for one in sides if drills]
    if not (form.curves or compensated or holes.any()) or not _can_stand_upright(form):
        return chosen
    tilted = np.abs(program.axis - (0.0, 0.0, 1.0)).max(axis=1) > _ALONG_Z
    tilted &= program.kind != Move.FROM
    starts = tool_starts(program)
    if form.orientation == "point" and tilted.any():
        return chosen
    if not form.rotary and tilted.any():  # without a machine no words bring the rotary axes back
        tilted[int(np.argmax(tilted)) :] = True
    for first, stop in zip(starts, [*starts[1:], len(program)], strict=True):
        here = slice(first, stop)
        if not tilted[here].any():
            offset = any(first <= pose < stop for pose in compensated)
            chosen[here] = form.curves or offset or has_cycles(program, form, here, drills=drills)
    return chosen


def has_cycles(program: Program, form: Form, part: slice, *, drills: bool) -> bool:
    """Whether any hole of a part of the poses can be a cycle of the control; `drills` as in `upright_poses`."""
    if not (program.kind[part] == Move.HOLE).any():
        return False
    cycles_in_force = _said_cycles(program)
    for k, (first, args, clockwise) in enumerate(cycles_in_force):
        until = cycles_in_force[k + 1][0] if k + 1 < len(cycles_in_force) else len(program)
        poses = np.arange(max(first, part.start), min(until, part.stop))
        poses = poses[program.kind[poses] == Move.HOLE]
        cycle = read_cycle(args, program, None) if len(poses) else None
        if cycle is not None and (clockwise if cycle.tap else drills) and kind_of(cycle, form, program, poses[:1]):
            return True
    return False


def _said_cycles(program: Program) -> list[tuple[int, tuple[float | str, ...], bool]]:
    """Pose and arguments in force of CYCLE statements, and whether the spindle turns clockwise, as a tap needs it."""
    cycles_in_force: list[tuple[int, tuple[float | str, ...], bool]] = []
    args: tuple[float | str, ...] = ()
    clockwise = False
    for statement in program.statements:
        if statement.word == "SPINDL":
            clockwise = not {"OFF", "NOMORE", "CCLW", "LOCK", "ORIENT"} & set(words_of(statement))
        elif statement.word == "CYCLE" and words_of(statement)[:1] not in (["OFF"], ["NOMORE"]):
            args = in_force(args, statement.args, program)
            cycles_in_force.append((statement.pose, args, clockwise))
    return cycles_in_force


def _can_stand_upright(form: Form) -> bool:
    """Whether the form has such blocks, and X Y Z are the tip while the rotary axes stand at zero."""
    if form.upright is None or not form.table.program.retract:
        return False
    if form.machine is None or not form.rotary:
        return True
    zero = np.zeros((1, 2))
    if (form.machine.limits[:, 0] > 0.0).any() or (form.machine.limits[:, 1] < 0.0).any():
        return False
    place = np.array([[11.0, -7.0, 5.0]])
    upright = np.abs(tool_axis(form.machine, zero) - (0.0, 0.0, 1.0)).max() <= _ALONG_Z
    return bool(upright and np.abs(machine_position(form.machine, place, zero) - place).max() <= _SAME_PLACE)


def hole_feeds(cycle: Cycle, program: Program, poses: Ints) -> tuple[Floats, Ints]:
    """(h,) feed of every hole, mm/min or mm/rev, NaN where there is none, and (h,) its `FeedMode`."""
    if np.isnan(cycle.feed):
        return program.feed[poses], program.feed_mode[poses].astype(np.int64)
    return np.full(len(poses), cycle.feed), np.full(len(poses), int(cycle.feed_mode))


def kind_of(cycle: Cycle, form: Form, program: Program, poses: Ints) -> str:
    """Name of the cycle of the control that does the same, as in `Cycles`; empty for none."""
    cycles, (feed, modes) = form.table.cycles, hole_feeds(cycle, program, poses)
    stepped = bool(cycle.steps)
    if cycle.clearance is None or np.isnan(feed).any() or (modes != modes[0]).any() or not cycle.depth > 0.0:
        return ""  # a depth of nothing is drilled by no TNC
    if stepped and (len(set(cycle.steps)) > 1 or cycle.dwell or cycle.feed_out):
        return ""
    if cycles.per_minute and not cycle.tap and (modes[0] != FeedMode.PER_MINUTE or program.units != "mm"):
        return ""
    if cycle.tap:
        name = "tap"
    elif stepped:
        name = "peck" if cycle.full_retract else "chip"
    elif cycle.feed_out:
        name = "ream_dwell" if cycle.dwell else "ream"
    else:
        name = "dwell" if cycle.dwell else "drill"
    return name if getattr(cycles, name) else ""
