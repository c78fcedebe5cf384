"""Statements that move the tool: GOTO and its relatives, arcs, NURBS."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from cornersmooth.cl.arcs import LEAST_DECIMALS, read_arc
from cornersmooth.cl.builder import Vector, check_range
from cornersmooth.cl.grammar import Argument, Record
from cornersmooth.cl.nurbs import CURVE_DIGITS, Curve, lines_of
from cornersmooth.cl.reader_state import ReaderState
from cornersmooth.cl.surfaces import read_drive_arc, read_helix
from cornersmooth.model import Move


def _pose(state: ReaderState, record: Record, args: tuple[Argument, ...], line: int) -> tuple[Vector, Vector | None]:
    values = state.numbers(record, args, line)
    if len(values) not in (3, 6, 9):  # 7 to 9 are the surface normal of an expanded record
        raise state.count(record, len(values), "x,y,z or x,y,z,i,j,k", line)
    return (values[0], values[1], values[2]), (values[3], values[4], values[5]) if len(values) > 3 else None


def _goto(state: ReaderState, record: Record) -> None:
    poses = [(line, *_pose(state, record, args, line)) for line, args in ((record.line, record.args), *record.points)]
    if state.arc is not None:  # more points of one GOTO lie on the arc; the last one ends it
        state.arcs.pass_through([tip for _, tip, _ in poses[:-1]])
        poses = poses[-1:]
    for line, tip, axis in poses:
        if record.cut_short:
            state.note("CS129", line)
            axis = state.builder.last_axis()
        state.add(tip, axis, line)


def _from(state: ReaderState, record: Record) -> None:
    tip, axis = _pose(state, record, record.args, record.line)
    state.builder.special[state.builder.n] = Move.FROM
    state.builder.add(tip, axis, record.line)


def _gohome(state: ReaderState, record: Record) -> None:
    if not record.args:
        state.note("CS149", record.line)
        state.keep(record)
        return
    tip, axis = _pose(state, record, record.args, record.line)
    state.rapid = False
    state.builder.special[state.builder.n] = Move.RAPID
    state.builder.add(tip, axis, record.line)


def _godlta(state: ReaderState, record: Record) -> None:
    values = state.numbers(record)
    if len(values) not in (1, 2, 3, 6):
        raise state.count(record, len(values), "dx,dy,dz or the distance along the tool axis", record.line)
    if not state.builder.n:
        raise state.fail("CS114", record.line, word="GODLTA")
    if len(values) == 1:
        axis = state.builder.last_axis()
        length = math.hypot(*axis) or 1.0  # a zero axis is refused when all axes are looked at
        step = [values[0] * part / length for part in axis]
    else:
        step = [*values, 0.0][:3]
    x, y, z = (a + b for a, b in zip(state.builder.last_tip(), step, strict=True))
    own = (values[3], values[4], values[5]) if len(values) == 6 else state.builder.held_axis()
    state.add((x, y, z), own, record.line)


def _check_curve(state: ReaderState, record: Record) -> None:
    """Refuse a curve from nowhere, and one among holes."""
    if not state.builder.n:
        raise state.fail("CS122", record.line, word=record.word)
    if state.hole:
        raise state.fail("CS181", record.line, word=record.word)


def _circle(state: ReaderState, record: Record) -> None:
    _check_curve(state, record)
    values = [value for value in record.args if isinstance(value, float)]
    decimals = state.dialect.decimals if state.dialect.strips_zeros else 0
    state.arc = read_arc(record, values, state.file, state.arc_rule, decimals)
    _at_feed(state, record)


def _direction(state: ReaderState, record: Record) -> None:
    vector = state.vector(record)
    check_range(vector, state.file, record.line)
    state.direction = (record.word, vector)


def _drive(state: ReaderState, record: Record) -> None:
    _check_curve(state, record)
    read = read_helix if record.word == "HELICAL" else read_drive_arc
    state.arc, end = read(record, state.builder.last_tip(), state.direction, state.file)
    state.direction = None
    _at_feed(state, record)
    state.add(end, state.builder.held_axis(), record.line)


def _nothing(state: ReaderState, record: Record) -> None:
    """AUTOPS and PSIS name the plane of the arc after them, which follows from the arc itself."""


def _nurbs(state: ReaderState, record: Record) -> None:
    _check_curve(state, record)
    if record.args:
        raise state.fail("CS128", record.line, why="numbers behind NURBS are not understood")
    _at_feed(state, record)
    state.curve = Curve(record.line)


def _knot(state: ReaderState, record: Record) -> None:
    if state.curve is None or state.curve.points:
        raise state.fail("CS128", record.line, why="KNOT without NURBS before it")
    state.curve.knots += state.numbers(record)


def _control(state: ReaderState, record: Record) -> None:
    if state.curve is None:
        raise state.fail("CS128", record.line, why="CNTRL without NURBS before it")
    values = state.numbers(record)
    if len(values) != 3:
        raise state.count(record, len(values), "x,y,z", record.line)
    check_range(values, state.file, record.line)
    state.curve.points.append((values[0], values[1], values[2]))
    state.curve.lines.append(record.line)
    digits = (len(token.partition(".")[2].strip()) for token in record.text.partition("/")[2].split(","))
    state.curve.decimals = max(state.curve.decimals, *digits)


def finish_curve(state: ReaderState) -> None:
    """Turn the NURBS record that just ended into lines, within `CURVE_DIGITS`.

    Raises
    ------
    InputError
        CS113, CS128
    """
    curve, state.curve = state.curve, None
    assert curve is not None
    why = curve.complaint
    points = None
    if why is None:
        tolerance = CURVE_DIGITS * 10.0 ** -max(curve.decimals, LEAST_DECIMALS)
        points = lines_of(curve, state.builder.last_tip(), tolerance)
        why = "it would need too many lines" if points is None else None
    if points is None:
        raise state.fail("CS128", curve.line, why=why)
    state.note("CS145", curve.line, tolerance=tolerance)
    axis = state.builder.held_axis()
    for (x, y, z), line in zip(points[0].tolist(), points[1].tolist(), strict=True):
        state.add((x, y, z), axis, line)


def _at_feed(state: ReaderState, record: Record) -> None:
    """Say that a rapid curve is read as a feed motion."""
    if state.rapid:
        state.note("CS140", record.line, text=record.word)
        state.rapid = False


HANDLERS: Final[dict[str, Callable[[ReaderState, Record], None]]] = {
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
