"""Rotary words of rows: the angles of the form's machine, chosen with a look ahead, and where they turn above the part.

Both ends of a rapid hold the tool where it should be, but between them it may stand elsewhere: a table that turns back
by 300 degrees leads a tool that leans by 30 degrees all the way round. The tool goes up first, and turns there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np

from cornersmooth.arrays import norm
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Machine, solutions, tool_axis
from cornersmooth.kinematics.poses import angle_between
from cornersmooth.model import Bools, Floats, Ints, Move, Program, SmoothProgram, rapid_moves, still_poses
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.statement_args import tool_starts
from cornersmooth.smoothing.runs.rows import Rows
from cornersmooth.smoothing.sampling import all_dense_rows
from cornersmooth.system.processes import return_free_memory


@dataclass(frozen=True)
class RotaryWay:
    """Rows with their angles, n of them: more than were given where cuts are left."""

    #: tip, axis: (n, 3), mm and unit vectors
    tip: Floats
    axis: Floats
    move: Ints  #: (n,)
    angles: Floats  #: (n, 2), degrees; in the order of the machine's axes
    #: free, left: (n,); whether nothing is looked at on the way to the row, as it cuts nothing; whether the tool comes
    #: back there into a cut that it has left
    free: Bools
    left: Bools
    tolerance: float  #: degrees by which the axis may be off on the way to a row


def rotary_way(rows: Rows, smoothed: SmoothProgram, form: Form, findings: Findings) -> RotaryWay:
    """Angles of rows with tool vectors.

    Raises InputError where the machine cannot follow the path.
    """
    from cornersmooth.rotary import reach_error, rewound_angles, rotary_angles

    program, settings, machine = smoothed.program, smoothed.settings, machine_of(form).with_longest_tool()
    tip, axis, move = rows.tip, rows.other, rows.move
    tolerance = form.rotary_tolerance(settings.tolerance, settings.axis_scale)
    rapid, file = rapid_moves(program.kind)[move], program.source.name
    if len(machine.names) < 2:  # a pose that an axis is missing for is named, not a place on the way to it
        beyond = np.where(program.kind == Move.FROM, 0.0, solutions(machine, program.axis).beyond)
        for pose in np.flatnonzero(beyond > tolerance)[:1].tolist():
            raise reach_error(machine, program.axis[pose], float(beyond[pose]), int(program.line[pose]), file)
    how: dict[str, Any] = {"tolerance": tolerance, "rapid": rapid, "line": program.line[move], "file": file}
    how |= {"still": still_poses(program.kind)[move], "still_tolerance": form.angle_rounding}
    left = np.zeros(len(move), np.bool_)
    if form.rewind:
        path, source, left = rewound_angles(machine, tip, axis, **how)
        if left.any():
            tip, axis, move = tip[source], axis[source], move[source]
            rapid = rapid[source] | left
            lines, back = program.line[move[left]], int(np.argmax(left))
            turn = np.abs(path.angles[back] - path.angles[back - 1])
            findings.note_each("CS376", lines, name=machine.names[int(np.argmax(turn))], turn=float(turn.max()))
    else:
        path = rotary_angles(machine, tip, axis, **how)
    findings.add_all(path.findings)
    from_zero(form, program, axis, path.angles, move, rapid)
    endless = [
        k for k, each in enumerate(machine.axes[: len(machine.names)]) if each.limits is None and not each.modulo
    ]
    if not form.mode.endless_words:
        words = np.round(path.angles[:, endless], form.table.digits.angle)
        beyond = program.line[move[((words < 0.0) | (words >= 360.0)).any(axis=1)]]
        findings.note_each("CS346", beyond[:1], names=" and ".join(machine.names[k] for k in endless))
    return_free_memory()  # rows are written while all of this is kept
    return RotaryWay(tip, axis, move, path.angles, rapid, left, tolerance)


def machine_of(form: Form) -> Machine:
    """Machine of a form with rotary words; CS215 where it has none."""
    if form.machine is None:
        raise SettingsError("CS215", f"{form.control} form {form.name} needs a machine", "name it with --machine")
    return form.machine


def within_reach(smoothed: SmoothProgram, form: Form) -> SmoothProgram:
    """Round runs corner by corner, if the machine of a form cannot follow their curves.

    Where poses are at the limit of a rotary axis, the curve of a run may go beyond it within the tolerance. That of a
    single corner does not: its axes are between those of the poses.
    """
    if smoothed.runs is None or not form.rotary or form.rewind:
        return smoothed
    try:
        rotary_way(all_dense_rows(smoothed), smoothed, form, Findings())
    except InputError:
        from cornersmooth.smoothing.global_runs import corner_by_corner  # which takes long to load

        return corner_by_corner(smoothed)
    return smoothed


LONGEST_DETOUR: Final = 30.0  #: degrees by which the way of the tool axis may be longer than the shortest one
#: sine of an angle at which the tool counts as parallel to a rotary axis, and degrees by which that stands
_PARALLEL: Final = 1e-9
_PLACES: Final = np.linspace(0.0, 1.0, 10)[1:-1]  #: places between both ends that are looked at
UPRIGHT: Final = 1.0 - 1e-6  #: cosine of the angle from Z beyond which a tool is tilted


def swinging(machine: Machine, before: Floats, after: Floats) -> Bools:
    """Moves (m,) in which the tool axis leaves the shortest way by more than `LONGEST_DETOUR`.

    Rotary words (m, 2), degrees in the order of the machine's axes, run evenly from those before to those after.
    """
    ends = [tool_axis(machine, angles) for angles in (before, after)]
    shortest = angle_between(*ends)
    longest = np.zeros(len(before))
    for place in _PLACES.tolist():
        between = tool_axis(machine, before + place * (after - before))
        longest = np.maximum(longest, angle_between(ends[0], between) + angle_between(between, ends[1]))
    return longest - shortest > LONGEST_DETOUR


def rows_that_swing(machine: Machine, angles: Floats, rapid: Bools) -> Ints:
    """Rows, but the first, that are rapid and reached with a swing from the row before: (r, 2) degrees -> (k,)."""
    turn = np.abs(np.diff(angles, axis=0)).max(axis=1) > LONGEST_DETOUR / 2
    rows = np.flatnonzero(rapid[1:] & turn) + 1
    return rows[swinging(machine, angles[rows - 1], angles[rows])] if len(rows) else rows


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
        first, along, whole = angles[row].copy(), machine.axes[0].unit, endless
        stands = np.nanmax(angles[row:end, 0]) - np.nanmin(angles[row:end, 0]) <= _PARALLEL
        if len(machine.names) == 2 and stands and norm(np.cross(axis[row:end], along)).max() <= _PARALLEL:
            angles[row:end, 0] += np.clip(0.0, *machine.limits[0]) - first[0]
            whole = endless & (False, True)
        angles[row:end, whole] += -360.0 * np.round(first[whole] / 360.0)
