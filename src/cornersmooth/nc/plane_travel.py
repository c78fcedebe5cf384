"""Travel of the linear axes where rotary axes stand: in tilted planes, and on machines without any.

In a plane the control chooses between two positions of the rotary axes. Lines, and curves within the corners of lines,
go no farther than the poses; arcs do.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.geometry.arcs import arc_points, divided
from cornersmooth.kinematics import Machine, solutions, tool_axis
from cornersmooth.model import Floats, Ints, Move, Program
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.planes import Plane, Planes
from cornersmooth.nc.tools import ToolTravel
from cornersmooth.vectors import norm

#: turn on an arc from one place that is looked at to the next, rad: between them it goes 1e-5 of its radius farther
_STEP = 0.009

#: by how much a tool axis may be off that of the rotary axes at zero
_SAME = 1e-7


def check_travel_in_planes(planes: Planes, program: Program, form: Form, findings: Findings) -> None:
    """Refuse poses in tilted planes beyond the travel (CS374), whichever of its angles the control takes.

    CS379 warns where only some of the angles will do. Without a machine with travel nothing is known.
    """
    machine = form.machine
    if machine is None or not machine.travel:
        return
    travel = ToolTravel(program, machine)
    for number, plane in enumerate(planes.planes):
        places = np.flatnonzero((planes.of == number) & (program.kind != Move.FROM))
        tip, poses = _on_the_way(program, places)
        fit, refused = [], None
        for angles in _angles(machine, plane):
            try:
                travel.check(tip, np.tile(angles, (len(tip), 1)), poses)
                fit.append(angles)
            except InputError as error:
                refused = refused or error
        if refused is not None and not fit:
            raise refused
        if refused is not None:
            said = " ".join(f"{name}{angle:.3f}" for name, angle in zip(machine.names, fit[0].tolist(), strict=True))
            text = f"a tilted plane stays within the travel with {said} only; see that the control takes these angles"
            findings.add("CS379", "warning", int(program.line[poses[0]]), text)


def check_travel_without_axes(machine: Machine, program: Program) -> None:
    """Refuse a program beyond the travel of a machine without rotary axes (CS374)."""
    tip, poses = _on_the_way(program, np.flatnonzero(program.kind != Move.FROM))
    ToolTravel(program, machine).check(tip, np.zeros((len(tip), 2)), poses)


def _on_the_way(program: Program, poses: Ints) -> tuple[Floats, Ints]:
    """Tips of poses and of places on the arcs that lead to them, (k, 3) mm, and the pose of each."""
    arcs = np.flatnonzero(np.isin(program.arcs.pose, poses))
    rows, share = divided(np.ceil(program.arcs.sweep[arcs] / _STEP).astype(np.int64))
    between, _ = arc_points(program, arcs[rows], share)
    return np.concatenate((program.tip[poses], between)), np.concatenate((poses, program.arcs.pose[arcs[rows]]))


def _angles(machine: Machine, plane: Plane) -> list[Floats]:
    """Angles, (2,) degrees each, of which the control may take any: within their limits."""
    if plane.angles is not None:
        return [plane.angles]
    axis, zero = plane.frame[None, :, 2], np.zeros((1, 2))
    low, high = machine.limits.T
    turns = 360.0 * np.array([0.0, -1.0, 1.0])[:, None]
    if norm(tool_axis(machine, zero) - axis)[0] <= _SAME:  # any angle of the axis along the tool would do: it stays
        return [zero[0]]
    found = []
    for angles in solutions(machine, axis).angles[0]:
        within = (angles + turns >= low) & (angles + turns <= high)
        if within.any(axis=0).all():
            found.append(angles + turns[np.argmax(within, axis=0), 0])
    return found
