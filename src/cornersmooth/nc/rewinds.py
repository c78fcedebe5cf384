"""Rapids in which rotary axes swing a tilted tool: unwinding, and the other solution of the axes.

Both ends of such a move hold the tool where it should be, but between them it stands elsewhere: a table that turns back
by 300 degrees leads a tool that leans by 30 degrees all the way round. The tool goes up first, and turns there.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.arrays.vectors import dot
from cornersmooth.kinematics import Machine, tool_axis
from cornersmooth.model import Bools, Floats, Ints, Program
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.tools import tool_starts

#: degrees by which the way of the tool axis may be longer than the shortest one
LONGEST_DETOUR: Final = 30.0

#: sine of an angle at which the tool counts as parallel to a rotary axis, and degrees by which that stands
_PARALLEL: Final = 1e-9

#: places between both ends that are looked at
_PLACES: Final = np.linspace(0.0, 1.0, 10)[1:-1]


def swinging(machine: Machine, before: Floats, after: Floats) -> Bools:
    """Moves (m,) in which the tool axis leaves the shortest way by more than `LONGEST_DETOUR`.

    Rotary words (m, 2), degrees in the order of the machine's axes, run evenly from those before to those after.
    """
    ends = [tool_axis(machine, angles) for angles in (before, after)]
    shortest = _angle(*ends)
    longest = np.zeros(len(before))
    for place in _PLACES.tolist():
        between = tool_axis(machine, before + place * (after - before))
        longest = np.maximum(longest, _angle(ends[0], between) + _angle(between, ends[1]))
    return longest - shortest > LONGEST_DETOUR


def rows_that_swing(machine: Machine, angles: Floats, rapid: Bools) -> Ints:
    """Rows, but the first, that are rapid and reached with a swing from the row before: (r, 2) degrees -> (k,)."""
    turn = np.abs(np.diff(angles, axis=0)).max(axis=1) > LONGEST_DETOUR / 2
    rows = np.flatnonzero(rapid[1:] & turn) + 1
    return rows[swinging(machine, angles[rows - 1], angles[rows])] if len(rows) else rows


def retracts_before(form: Form, angles: Floats, rapid: Bools, line: Ints, findings: Findings, possible: bool) -> Ints:
    """Rows of a run before which the tool goes up, so that rotary axes turn back there; says so.

    `angles` (r + 1, 2), degrees, are those before the run and of its rows; `possible` where the control has a retract.
    """
    assert form.machine is not None
    rows = rows_that_swing(form.machine, angles, np.concatenate(([False], rapid))) - 1
    if not possible:
        findings.note_each("CS340", line[rows])
        return rows[:0]
    findings.note_each("CS341", line[rows])
    return rows


def from_zero(form: Form, program: Program, axis: Floats, angles: Floats, move: Ints, rapid: Bools) -> None:
    """Take off angles what a tool before has left, in place; what is taken off is constant between retracts.

    After a retract the axes turn as they like. A tool that stays along the pole, where the first angle is free, has
    that at zero, not where another tool needs it. Where the rotary axes go to zero before a tool, its angles are
    without the whole turns of the tools before. Angles (r, 2) are in degrees, NaN where there is none.
    """
    machine = form.machine
    assert machine is not None
    if not form.table.program.retract:
        return
    endless = np.array([each.limits is None and not each.modulo for each in machine.axes])
    endless &= "{rotary_zero}" in form.begin
    homes = [one.pose for one in program.statements if one.word == "GOHOME" and not one.args]
    starts = np.unique([*tool_starts(program), *homes]).astype(np.int64)
    rows = np.searchsorted(move, starts)
    there = rows < len(move)
    starts, rows = starts[there], rows[there]
    # a pose that repeats the one before is no row
    rows = rows[(move[rows] == starts) & rapid[rows] & ~np.isnan(angles[rows]).any(axis=1)]
    for row, end in pairwise([*rows.tolist(), len(move)]):
        first = angles[row].copy()
        if len(machine.names) == 2 and _along_pole(machine, axis[row:end], angles[row:end, 0]):
            angles[row:end, 0] += np.clip(0.0, *machine.limits[0]) - first[0]
            endless = endless & (False, True)
        angles[row:end, endless] += -360.0 * np.round(first[endless] / 360.0)


def _along_pole(machine: Machine, axis: Floats, first: Floats) -> bool:
    """Whether the tool is parallel to the first rotary axis all the while, and that stands."""
    if np.nanmax(first) - np.nanmin(first) > _PARALLEL:
        return False
    across = axis - dot(axis, np.broadcast_to(machine.axes[0].unit, axis.shape))[:, None] * machine.axes[0].unit
    return bool(np.abs(across).max() <= _PARALLEL)


def _angle(a: Floats, b: Floats) -> Floats:
    """Degrees between unit vectors, row by row."""
    return np.degrees(np.arccos(np.clip(dot(a, b), -1.0, 1.0)))
