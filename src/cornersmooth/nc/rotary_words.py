"""Rotary words of rows: the angles of the form's machine, chosen with a look ahead over the whole path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cornersmooth.errors import InputError, SettingsError
from cornersmooth.geometry.ragged import starts
from cornersmooth.kinematics import Machine, solutions
from cornersmooth.model import Bools, Floats, Ints, Move, Program, SmoothProgram
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings, refused
from cornersmooth.nc.rewinds import from_zero
from cornersmooth.rotary import rapid_moves, rewound_angles, rotary_angles, still_poses
from cornersmooth.rotary.axis_findings import reach_error
from cornersmooth.smoothing.sampling import Rows, all_dense_rows
from cornersmooth.system.processes import return_free_memory

#: what a curve may turn the axis, over ε at H: tip and axis point may be off to opposite sides
_SWING = 2.0


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
    program, settings, machine = smoothed.program, smoothed.settings, machine_of(form).with_longest_tool()
    tip, axis, move = rows.tip, rows.other, rows.move
    tolerance = form.rotary_tolerance(settings.tolerance, settings.axis_scale)
    if not len(move):
        none = np.zeros(0, np.bool_)
        return RotaryWay(tip, axis, move, np.zeros((0, 2)), none, none, tolerance)
    rapid, file = rapid_moves(program.kind)[move], program.source.name
    _check_reach(machine, program, axis, move, tolerance)
    how: dict[str, Any] = {"tolerance": tolerance, "rapid": rapid, "line": program.line[move], "file": file}
    how |= {"still": still_poses(program.kind)[move], "still_tolerance": form.angle_rounding}
    left = np.zeros(len(move), np.bool_)
    if form.rewind:
        path, source, left = rewound_angles(machine, tip, axis, **how)
        if left.any():
            tip, axis, move = tip[source], axis[source], move[source]
            rapid = rapid[source] | left
            _note_rewinds(machine, path.angles, left, program.line[move], findings)
    else:
        path = rotary_angles(machine, tip, axis, **how)
    findings.add_all(path.findings)
    from_zero(form, program, axis, path.angles, move, rapid)
    return_free_memory()  # rows are written while all of this is kept
    return RotaryWay(tip, axis, move, path.angles, rapid, left, tolerance)


def machine_of(form: Form) -> Machine:
    """Machine of a form with rotary words; CS215 where it has none."""
    if form.machine is None:
        raise SettingsError("CS215", f"{form.control} form {form.name} needs a machine", "name it with --machine")
    return form.machine


def _check_reach(machine: Machine, program: Program, axis: Floats, move: Ints, tolerance: float) -> None:
    """Refuse the first pose that an axis is missing for, or a method that turns the tool to where one is."""
    if len(machine.names) > 1:
        return
    file = program.source.name
    beyond = np.where(program.kind == Move.FROM, 0.0, solutions(machine, program.axis).beyond)
    poses = np.flatnonzero(beyond > tolerance)
    if len(poses):
        pose = int(poses[0])
        raise reach_error(machine, program.axis[pose], float(beyond[pose]), int(program.line[pose]), file)
    rows = np.flatnonzero(solutions(machine, axis).beyond > tolerance)
    if len(rows):
        line = int(program.line[move[rows[0]]])
        raise refused("CS361", program, line, axis=machine.names[0], machine=machine.name)


def _note_rewinds(machine: Machine, angles: Floats, left: Bools, line: Ints, findings: Findings) -> None:
    rows = np.flatnonzero(left)
    turn = np.abs(angles[rows] - angles[rows - 1])
    column = int(np.argmax(turn[0]))
    findings.note_each("CS376", line[rows], name=machine.names[column], turn=float(turn[0, column]))


def within_reach(smoothed: SmoothProgram, form: Form) -> SmoothProgram:
    """Round runs at the limits of the rotary axes corner by corner, if the machine cannot follow their curves.

    Where poses are at the limit of a rotary axis, the curve of a run may go beyond it within the tolerance. That of a
    single corner does not: its axes are between those of the poses.
    """
    if smoothed.runs is None or form.machine is None or not form.rotary or form.rewind:
        return smoothed
    near = _near_limits(smoothed, form)
    if not near.any():
        return smoothed
    try:
        rotary_way(all_dense_rows(smoothed), smoothed, form, Findings())
    except InputError:
        from cornersmooth.smoothing.global_runs import corner_by_corner  # which takes long to load

        return corner_by_corner(smoothed, near)
    return smoothed


def _near_limits(smoothed: SmoothProgram, form: Form) -> Bools:
    """(r,) bool: runs with a pose so near to the limit of an axis that the curve may go beyond it.

    All runs on a machine with one rotary axis, whose limits are those of the directions, too.
    """
    runs, machine, settings = smoothed.runs, form.machine, smoothed.settings
    assert runs is not None
    assert machine is not None
    if len(machine.names) < 2:
        return np.ones(len(runs), np.bool_)
    found = solutions(machine, smoothed.program.axis[runs.pose])
    swing = np.degrees(_SWING * settings.tolerance / settings.axis_scale)
    room = np.full(found.angles.shape, swing)
    with np.errstate(divide="ignore"):  # at the pole the first axis turns as far as it likes
        room[..., 0] /= np.abs(np.sin(np.radians(np.minimum(found.pole_distance, 90.0))))[:, None]
    near = np.zeros(len(runs.pose), np.bool_)
    for k, limit in zip(*np.nonzero(np.isfinite(machine.limits)), strict=True):
        off = found.angles[..., k] - machine.limits[k, limit]
        near |= (np.abs(off - 360.0 * np.round(off / 360.0)) <= room[..., k]).any(axis=1)
    return np.maximum.reduceat(near, starts(runs.count)[:-1])
