"""Tilted planes of the control (3+2): which poses are written in one, its frame, and the numbers of its words.

The frame is made of the angles as they are written, as the control will make it, and positions are computed in that
frame: so rounded angles do not move the tip, however far it is from the zero of the part. They only turn the tool, by
less than a step of their last digit.

In a plane the control chooses between two positions of the rotary axes. Lines, and curves within the corners of lines,
go no farther within the travel than the poses; arcs do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.arrays import norm
from cornersmooth.errors import InputError
from cornersmooth.geometry.arcs import poses_and_arcs
from cornersmooth.kinematics import Machine, machine_position, solutions, tool_axis
from cornersmooth.model import Floats, Ints, Keep, Move, Numbers, Program
from cornersmooth.nc.form import Form
from cornersmooth.nc.hole_cycles import Drillings, has_cycles, upright_poses
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.statement_args import check_tool_travel, tool_starts
from cornersmooth.settings import Settings
from cornersmooth.text import format_number

_SAME: Final = 1e-7  #: tool axes that differ by less are one, and all of a run are so near to its first
_FREE: Final = (Move.RAPID, Move.HOLE)  #: moves with which the tool may come to another axis: it goes up before
_IDLE: Final = (Move.RAPID, Move.FROM)  #: moves that cut nothing


#: turn on an arc from one place that is looked at to the next, rad: between them it goes 1e-5 of its radius farther
_ARC_STEP = 0.009


@dataclass(frozen=True)
class Plane:
    """A tilted plane."""

    #: (3, 3) columns: X', Y' and Z' of the plane in the part; Z' is the tool axis, the zero is that of the part
    frame: Floats
    #: numbers of the three rotations, as they are written: ``first``, ``second``, ``third``
    words: Mapping[str, str] = field(default_factory=dict)
    angles: Floats | None = None  #: (2,), degrees; rotary words, where these make the plane
    upright: bool = False  #: whether it is that of tools along Z without tool tip control: not tilted, axes at zero


@dataclass(frozen=True)
class Planes:
    """The planes of a program: those of tools along Z without tool tip control, and tilted ones."""

    of: Numbers  #: (n,) plane of each pose, -1 for none
    planes: tuple[Plane, ...] = ()

    def frames(self, poses: Ints) -> Floats:
        """(k, 3, 3) frames in which poses are written; the part's own outside of planes."""
        frames = np.array([*(plane.frame for plane in self.planes), np.eye(3)])
        return frames[self.of[poses]]


def plan_planes(
    program: Program, settings: Settings, form: Form, findings: Findings, drillings: Drillings, *, drills: bool
) -> Planes:
    """Choose the runs of poses that are written in planes.

    A run has one axis, cuts, and lies between rapids or changes of the tool: there it can go up and be turned. Where a
    new tool begins with a feed move that turns it, the turn is written, outside of any plane. Along Z none is needed
    but for holes that are cycles of the control, which tool tip control does not take: they stand in a plane that is
    not tilted. Tools of `upright_poses`, where `drills` is explained, have a plane of their own.
    """
    upright = upright_poses(program, form, drillings, drills=drills)
    of = np.where(upright, np.int32(0), np.int32(-1))
    zero = np.zeros(2) if form.rotary else None
    found = [Plane(np.eye(3), angles=zero, upright=True)] if upright.any() else []
    planes: dict[tuple[str, ...], int] = {}
    for first, stop in _runs(program) if form.plane is not None else []:
        along_z = bool(norm(program.axis[first] - _UNIT["z"]) <= _SAME)
        if upright[first] or (along_z and not has_cycles(program, form, slice(first, stop), drillings, drills=drills)):
            continue
        line = int(program.line[first])
        plane, why = _plane(program.axis[first], settings, form)
        if plane is None:
            findings.note("CS357", line, why=why)
            continue
        name = (*plane.words.values(), *map(str, [] if plane.angles is None else plane.angles.tolist()))
        number = planes.setdefault(name, len(found))
        if number == len(found):
            found.append(plane)
        of[first:stop] = number
        findings.note("CS356", line)
    return Planes(of, tuple(found))


def _runs(program: Program) -> list[tuple[int, int]]:
    """First poses, and those after the last, of runs that could be written in a plane."""
    kind, axis = program.kind, program.axis
    moving = np.flatnonzero(kind != Move.FROM)
    if not len(moving):
        return []
    turned = np.zeros(len(kind) + 1, np.bool_)
    turned[moving[1:]] = norm(np.diff(axis[moving], axis=0)) > _SAME
    starts = np.array([start for start in tool_starts(program) if start < len(kind)], np.int64)
    free = np.append(np.isin(kind, _FREE), True)
    turns_at_feed = np.zeros_like(free)
    turns_at_feed[starts] = turned[starts] & ~free[starts]
    free[[*starts, moving[0]]] = True
    turned[[*starts, moving[0], len(kind)]] = True
    # where the control offsets the path, it goes on doing so from one run to the next
    free &= ~np.append(program.keep == Keep.CUTTER_COMPENSATION, False)
    runs = []
    for first, stop in pairwise(np.flatnonzero(turned).tolist()):
        here = moving[(moving >= first) & (moving < stop)]
        if not (free[first] and not turns_at_feed[first] and free[stop] and (~np.isin(kind[here], _IDLE)).any()):
            continue
        if norm(axis[here] - axis[first]).max() <= _SAME:
            runs.append((first, stop))
    return runs


def _plane(axis: Floats, settings: Settings, form: Form) -> tuple[Plane | None, str]:
    """Plane with a tool axis as Z'; else why there is none."""
    assert form.plane is not None
    digits = form.table.digits.angle
    if form.plane.rotations:
        plus = form.plane.signs
        angle_words = [format_number(angle, digits, plus=plus) for angle in tilting_angles(form.plane.rotations, axis)]
        frame = rotations_frame(form.plane.rotations, [float(number) for number in angle_words])
        plane = Plane(frame, dict(zip(("first", "second", "third"), angle_words, strict=True)))
    else:
        assert form.machine is not None
        machine, (name, sign) = form.machine, form.machine.preferred or (form.machine.names[0], 0)
        found = [one for one in _angles(machine, axis) if norm(tool_axis(machine, one[None]) - axis)[0] <= _SAME]
        if not found:
            return None, "no angles of the rotary axes within their limits turn the part so"
        # as preferred, else as little as possible
        disliked = [bool(sign * one[machine.names.index(name)] < 0.0) for one in found]
        turned = [float(np.abs(one).sum()) for one in found]
        angles = np.round(found[min(range(len(found)), key=lambda k: (disliked[k], turned[k]))], digits)
        plane = Plane(turned_part(form.machine, angles), angles=angles)
    off = settings.axis_length * float(norm(plane.frame[None, :, 2] - axis)[0])
    if off > form.plane_reserve(settings.axis_point_allowed, settings.axis_length):
        return None, f"its angles of {digits} decimals would turn the tool by more than the tolerance leaves"
    if (norm(np.stack((plane.frame[:, 2], axis)) - _UNIT["z"]) < _SAME).tolist() == [True, False]:
        return None, "in the written angles the tool is not tilted"
    return plane, ""


def tilting_angles(rotations: str, axis: Floats) -> tuple[float, float, float]:
    """Angles in degrees of three rotations that bring Z to a unit vector (3,); the last is zero.

    `rotations`, as in ``"zxz"``, are their axes, each of the frame which those before it have made.
    """
    one, two = (_UNIT[name] for name in rotations[:2])
    across = np.cross(two, _UNIT["z"])  # where the second rotation leads Z
    if rotations[0] == "z":
        second = math.acos(min(max(float(axis[2]), -1.0), 1.0))
    else:
        second = math.asin(min(max(float(axis @ one) * float(across @ one), -1.0), 1.0))
    turned = math.cos(second) * _UNIT["z"] + math.sin(second) * across
    flat, wanted = (vector - (vector @ one) * one for vector in (turned, axis))
    first = math.atan2(float(one @ np.cross(flat, wanted)), float(flat @ wanted))
    return math.degrees(first), math.degrees(second), 0.0


def rotations_frame(rotations: str, degrees: list[float]) -> Floats:
    """(3, 3) frame, columns X' Y' Z', that three rotations make, each about an axis of the frame before it."""
    from scipy.spatial.transform import Rotation  # long to load

    frame: Floats = Rotation.from_euler(rotations.upper(), degrees, degrees=True).as_matrix()
    return frame


def turned_part(machine: Machine, angles: Floats) -> Floats:
    """(3, 3) directions X Y Z of the machine, as columns, in a part that tables have turned by (2,) degrees."""
    places = np.vstack((np.eye(3), np.zeros((1, 3))))
    moved = machine_position(machine, places, np.tile(angles, (4, 1)))
    return moved[:3] - moved[3]


def check_travel_of_words(planes: Planes, program: Program, form: Form, findings: Findings) -> None:
    """Refuse poses in tilted planes, and of machines without rotary axes, beyond the travel (CS374).

    In a plane whichever of its angles the control takes; CS379 warns where only some of them will do. Without a machine
    with travel nothing is known.
    """
    machine = form.machine
    if machine is None or not machine.travel or (form.rotary and not planes.planes):
        return
    pose, tip, _ = poses_and_arcs(program, _ARC_STEP)
    moving = program.kind[pose] != Move.FROM
    if not form.rotary:
        check_tool_travel(program, machine, tip[moving], np.zeros((int(moving.sum()), 2)), pose[moving])
        return
    for number, plane in enumerate(planes.planes):
        rows = np.flatnonzero((planes.of[pose] == number) & moving)
        fit, refused = list[Floats](), list[InputError]()
        for angles in [plane.angles] if plane.angles is not None else _angles(machine, plane.frame[:, 2]):
            try:
                check_tool_travel(program, machine, tip[rows], np.tile(angles, (len(rows), 1)), pose[rows])
                fit.append(angles)
            except InputError as error:
                refused.append(error)
        if refused and not fit:
            raise refused[0]
        if refused:
            angle_words = " ".join(f"{name}{angle:.3f}" for name, angle in zip(machine.names, fit[0], strict=True))
            findings.note("CS379", int(program.line[pose[rows[0]]]), angles=angle_words)


def _angles(machine: Machine, axis: Floats) -> list[Floats]:
    """Angles, (2,) degrees each, of which a control may take any: those of both solutions, within the limits."""
    low, high = machine.limits.T
    zero, turns = np.zeros(2), 360.0 * np.array([0.0, -1.0, 1.0])[:, None]
    if norm(tool_axis(machine, zero[None]) - axis)[0] <= _SAME and (low <= zero).all() and (zero <= high).all():
        return [zero]  # any angle of the axis along the tool would do: it stays
    found = []
    for angles in solutions(machine, axis[None]).angles[0]:
        within = (angles + turns >= low) & (angles + turns <= high)
        if within.any(axis=0).all():
            found.append(angles + turns[np.argmax(within, axis=0), 0])
    return found


_UNIT: Final = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}
