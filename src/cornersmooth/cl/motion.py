"""Statements that move the tool: GOTO and its relatives, arcs, NURBS."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from cornersmooth.cl.arcs import LEAST_DECIMALS, read_arc
from cornersmooth.cl.builder import Vector, check_range
from cornersmooth.cl.grammar import Argument, Record
from cornersmooth.cl.machine import Machine
from cornersmooth.cl.nurbs import CURVE_DIGITS, Curve, lines_of
from cornersmooth.cl.surfaces import read_drive_arc, read_helix
from cornersmooth.model import Move


def _pose(machine: Machine, record: Record, args: tuple[Argument, ...], line: int) -> tuple[Vector, Vector | None]:
    values = machine.numbers(record, args, line)
    if len(values) not in (3, 6, 9):  # 7 to 9 are the surface normal of an expanded record
        raise machine.count(record, len(values), "x,y,z or x,y,z,i,j,k", line)
    return (values[0], values[1], values[2]), (values[3], values[4], values[5]) if len(values) > 3 else None


def _goto(machine: Machine, record: Record) -> None:
    poses = [(line, *_pose(machine, record, args, line)) for line, args in ((record.line, record.args), *record.points)]
    if machine.arc is not None:  # more points of one GOTO lie on the arc; the last one ends it
        machine.arcs.pass_through([tip for _, tip, _ in poses[:-1]])
        poses = poses[-1:]
    for line, tip, axis in poses:
        if record.cut_short:
            machine.note("CS129", line)
            axis = machine.builder.last_axis()
        machine.add(tip, axis, line)


def _from(machine: Machine, record: Record) -> None:
    tip, axis = _pose(machine, record, record.args, record.line)
    machine.builder.special[machine.builder.n] = Move.FROM
    machine.builder.add(tip, axis, record.line)


def _gohome(machine: Machine, record: Record) -> None:
    if not record.args:
        machine.note("CS149", record.line)
        machine.keep(record)
        return
    tip, axis = _pose(machine, record, record.args, record.line)
    machine.rapid = False
    machine.builder.special[machine.builder.n] = Move.RAPID
    machine.builder.add(tip, axis, record.line)


def _godlta(machine: Machine, record: Record) -> None:
    values = machine.numbers(record)
    if len(values) not in (1, 2, 3, 6):
        raise machine.count(record, len(values), "dx,dy,dz or the distance along the tool axis", record.line)
    if not machine.builder.n:
        raise machine.fail("CS114", record.line, word="GODLTA")
    if len(values) == 1:
        axis = machine.builder.last_axis()
        length = math.hypot(*axis) or 1.0  # a zero axis is refused when all axes are looked at
        step = [values[0] * part / length for part in axis]
    else:
        step = [*values, 0.0][:3]
    x, y, z = (a + b for a, b in zip(machine.builder.last_tip(), step, strict=True))
    own = (values[3], values[4], values[5]) if len(values) == 6 else machine.builder.held_axis()
    machine.add((x, y, z), own, record.line)


def _circle(machine: Machine, record: Record) -> None:
    if not machine.builder.n:
        raise machine.fail("CS122", record.line, word=record.word)
    values = [value for value in record.args if isinstance(value, float)]
    decimals = machine.dialect.decimals if machine.dialect.strips_zeros else 0
    machine.arc = read_arc(record, values, machine.file, machine.arc_rule, decimals)
    _at_feed(machine, record)


def _direction(machine: Machine, record: Record) -> None:
    vector = machine.vector(record)
    check_range(vector, machine.file, record.line)
    machine.direction = (record.word, vector)


def _drive(machine: Machine, record: Record) -> None:
    if not machine.builder.n:
        raise machine.fail("CS122", record.line, word=record.word)
    read = read_helix if record.word == "HELICAL" else read_drive_arc
    machine.arc, end = read(record, machine.builder.last_tip(), machine.direction, machine.file)
    machine.direction = None
    _at_feed(machine, record)
    machine.add(end, machine.builder.held_axis(), record.line)


def _nothing(machine: Machine, record: Record) -> None:
    """AUTOPS and PSIS name the plane of the arc after them, which follows from the arc itself."""


def _nurbs(machine: Machine, record: Record) -> None:
    if not machine.builder.n:
        raise machine.fail("CS122", record.line, word=record.word)
    if record.args:
        raise machine.fail("CS128", record.line, why="numbers behind NURBS are not understood")
    _at_feed(machine, record)
    machine.curve = Curve(record.line)


def _knot(machine: Machine, record: Record) -> None:
    if machine.curve is None or machine.curve.points:
        raise machine.fail("CS128", record.line, why="KNOT without NURBS before it")
    machine.curve.knots += machine.numbers(record)


def _control(machine: Machine, record: Record) -> None:
    if machine.curve is None:
        raise machine.fail("CS128", record.line, why="CNTRL without NURBS before it")
    values = machine.numbers(record)
    if len(values) != 3:
        raise machine.count(record, len(values), "x,y,z", record.line)
    check_range(values, machine.file, record.line)
    machine.curve.points.append((values[0], values[1], values[2]))
    machine.curve.lines.append(record.line)
    digits = (len(token.partition(".")[2].strip()) for token in record.text.partition("/")[2].split(","))
    machine.curve.decimals = max(machine.curve.decimals, *digits)


def finish_curve(machine: Machine) -> None:
    """Turn the NURBS record that just ended into lines, within `CURVE_DIGITS`.

    Raises
    ------
    InputError
        CS113, CS128
    """
    curve, machine.curve = machine.curve, None
    assert curve is not None
    why = curve.complaint
    points = None
    if why is None:
        tolerance = CURVE_DIGITS * 10.0 ** -max(curve.decimals, LEAST_DECIMALS)
        points = lines_of(curve, machine.builder.last_tip(), tolerance)
        why = "it would need too many lines" if points is None else None
    if points is None:
        raise machine.fail("CS128", curve.line, why=why)
    machine.note("CS145", curve.line, tolerance=tolerance)
    axis = machine.builder.held_axis()
    for (x, y, z), line in zip(points[0].tolist(), points[1].tolist(), strict=True):
        machine.add((x, y, z), axis, line)


def _at_feed(machine: Machine, record: Record) -> None:
    """Say that a rapid curve is read as a feed motion."""
    if machine.rapid:
        machine.note("CS140", record.line, text=record.word)
        machine.rapid = False


HANDLERS: Final[dict[str, Callable[[Machine, Record], None]]] = {
    "GOTO": _goto,
    "FROM": _from,
    "GOHOME": _gohome,
    "GODLTA": _godlta,
    "CIRCLE": _circle,
    "MOVARC": _circle,
    "HELICAL": _drive,
    "TLON,GOFWD": _drive,
    "INDIRV": _direction,
    "INDIRP": _direction,
    "AUTOPS": _nothing,
    "PSIS": _nothing,
    "NURBS": _nurbs,
    "KNOT": _knot,
    "CNTRL": _control,
}
