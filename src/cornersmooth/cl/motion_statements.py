"""Statements that move the tool: GOTO and its relatives, arcs, NURBS."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Final

from cornersmooth.cl.arcs import Arc, read_arc, read_drive_arc, read_helix
from cornersmooth.cl.grammar import NUMBER, Argument, Record, joined, number
from cornersmooth.cl.messages import error
from cornersmooth.cl.nurbs import Cubic, Curve
from cornersmooth.cl.poses import Vector, check_range
from cornersmooth.cl.reader_state import ReaderState
from cornersmooth.cl.state_statements import Handler
from cornersmooth.cl.words import GOTO_WORDS
from cornersmooth.model import MM_PER_UNIT, Ints, Move

#: X1,Y2,Z3 or X1,Y2,Z3,I0,J0,K1, separated by commas or blanks
_AFTER: Final = r"\s*{}\s*=?\s*(" + NUMBER.pattern.replace("(", "(?:").replace("(?:?:", "(?:") + ")"
_LETTERED: Final = re.compile(
    "".join(map(_AFTER.format, "XYZ")) + "(?:" + "".join(map(_AFTER.format, "IJK")) + r")?\s*", re.IGNORECASE
)

#: mm: how far lines may be from curves
CHORD: Final = 5e-4

#: what MOVNRB has beside ON and OFF: kinds of curves, knots, control points of tip and second point, and the points
_ROWS: Final = ("M3AXIS", "3AXIS", "M5AXIS", "5AXIS", 1.0, 2.0, 3.0, "NEXT")

#: sine of the angle at which a tool axis meets a plane at least
_PARALLEL: Final = 1e-6


def _pose(state: ReaderState, record: Record, args: tuple[Argument, ...], line: int) -> tuple[Vector, Vector | None]:
    values = state.numbers(record, _without_letters(args), line)
    if len(values) not in (3, 6, 9):  # 7 to 9 are the surface normal of an expanded record
        raise state.count(record, len(values), "x,y,z or x,y,z,i,j,k", line)
    return (values[0], values[1], values[2]), (values[3], values[4], values[5]) if len(values) > 3 else None


def _without_letters(args: tuple[Argument, ...]) -> tuple[Argument, ...]:
    """Numbers of X1,Y2,Z3[,I0,J0,K1] in this order; all other arguments as they are."""
    found = _LETTERED.fullmatch(" ".join(value if isinstance(value, str) else "?" for value in args))
    return args if found is None else tuple(number(token) or 0.0 for token in found.groups() if token is not None)


def _goto(state: ReaderState, record: Record) -> None:
    if record.points and state.arc is None:
        state.note("CS195", record.points[0][0])
    poses = [(line, *_pose(state, record, args, line)) for line, args in ((record.line, record.args), *record.points)]
    if state.arc is not None:  # more points of one GOTO lie on the arc; the last one ends it
        state.arc = replace(state.arc, passes=tuple(state.system.point(tip) for _, tip, _ in poses[:-1]))
        poses = poses[-1:]
    for line, tip, axis in poses:
        if record.cut_short:
            state.note("CS129", line)
            axis = state.last_axis
        state.add(tip, axis, line)


def _from(state: ReaderState, record: Record) -> None:
    tip, axis = _pose(state, record, record.args, record.line)
    state.add(tip, axis, record.line, Move.FROM)


def _gohome(state: ReaderState, record: Record) -> None:
    if not record.args:
        state.note("CS149", record.line)
        state.keep(record)
        return
    tip, axis = _pose(state, record, record.args, record.line)
    state.rapid = False
    state.add(tip, axis, record.line, Move.RAPID)


def _retract(state: ReaderState, record: Record) -> None:
    """RETRCT: along the tool axis until the tip rests on the clearance surface (ICAM, The RETRCT Command)."""
    if state.hole:
        raise state.fail("CS181", record)
    for refused, why, want in (
        (record.args, f"its option {joined(record.args)} is not understood", "write RETRCT alone"),
        (not state.n, "it is before the first position", "put a GOTO before it"),
        (state.clearance is None, "no clearance plane is known", "put CLEARP/XYPLAN,z before it"),
    ):
        if refused:
            raise state.fail("CS193", record, why=why, want=want)
    assert state.clearance is not None
    tip, axis = state.last_tip(), state.last_axis
    normal, point = state.clearance
    normal = normal or axis
    slope = sum(a * b for a, b in zip(normal, axis, strict=True))
    if not abs(slope) > _PARALLEL:
        raise state.fail("CS193", record, why="the tool axis never meets the clearance plane", want="write it as GOTO")
    way = sum(n * (p - t) for n, p, t in zip(normal, point, tip, strict=True)) / slope
    if way < 0:
        state.note("CS194", record.line)
        state.rapid = False
        return
    x, y, z = (t + way * a for t, a in zip(tip, axis, strict=True))
    state.add((x, y, z), state.held_axis(), record.line)


def _godlta(state: ReaderState, record: Record) -> None:
    values = state.numbers(record)
    if len(values) not in (1, 2, 3, 6):
        raise state.count(record, len(values), "dx,dy,dz or the distance along the tool axis")
    if not state.n:
        raise state.fail("CS114", record)
    if len(values) == 1:
        axis = state.last_axis
        length = math.hypot(*axis) or 1.0  # a zero axis is refused when all axes are looked at
        step = [values[0] * part / length for part in axis]
    else:
        step = [*values, 0.0][:3]
    x, y, z = (a + b for a, b in zip(state.last_tip(), step, strict=True))
    own = (values[3], values[4], values[5]) if len(values) == 6 else state.held_axis()
    state.add((x, y, z), own, record.line)


def _check_curve(state: ReaderState, record: Record) -> None:
    """Refuse a curve from nowhere, and one among holes."""
    if not state.n or state.hole:
        raise state.fail("CS181" if state.n else "CS122", record)


def _begin_arc(state: ReaderState, record: Record, arc: Arc) -> None:
    """Let an arc wait for its end, in the first coordinate system."""
    system = state.system
    state.arc = replace(arc, centre=system.point(arc.centre), normal=system.vector(arc.normal))
    _at_feed(state, record)


def _circle(state: ReaderState, record: Record) -> None:
    _check_curve(state, record)
    decimals = state.dialect.decimals if state.dialect.strips_zeros else 0
    _begin_arc(state, record, read_arc(record, state.file, state.arc_rule, decimals))


def _direction(state: ReaderState, record: Record) -> None:
    vector = state.vector(record)
    check_range(vector, state.file, record.line)
    state.direction = (record.word, vector)


def _drive(state: ReaderState, record: Record) -> None:
    _check_curve(state, record)
    read = read_helix if record.word == "HELICAL" else read_drive_arc
    arc, end = read(record, state.last_tip(), state.direction, state.file)
    _begin_arc(state, record, arc)
    state.direction = None
    state.add(end, state.held_axis(), record.line)


def _nurbs(state: ReaderState, record: Record) -> None:
    _check_curve(state, record)
    if record.args:
        raise state.fail("CS128", record, why="numbers behind NURBS are not understood")
    _at_feed(state, record)
    state.curve = Curve(record.line)


def _knot(state: ReaderState, record: Record) -> None:
    if state.curve is None or state.curve.points:
        raise state.fail("CS128", record, why="KNOT without NURBS before it")
    state.curve.knots += state.numbers(record)


def _control(state: ReaderState, record: Record) -> None:
    if state.curve is None:
        raise state.fail("CS128", record, why="CNTRL without NURBS before it")
    point = state.vector(record, "x,y,z")
    check_range(point, state.file, record.line)
    state.curve.points.append(point)
    state.curve.lines.append(record.line)


def finish_curve(state: ReaderState) -> None:
    """Add the NURBS record that just ended, with lines near it (InputError CS113, CS128)."""
    curve, state.curve = state.curve, None
    assert curve is not None
    why = curve.complaint
    found = curve.cubic(state.last_tip(), _chord(state)) if why is None else None
    if found is None:
        raise error("CS128", state.file, curve.line, why=why or "it would need too many lines")
    _add_curve(state, found, curve.line, curve.lines_at(found.u[1:]))


def _chord(state: ReaderState) -> float:
    """Return `CHORD` in the units of the file, as far as these are known."""
    stated = [units for _, units, _ in state.stated_units[-1:]]
    return CHORD / MM_PER_UNIT[state.wanted_units or (*stated, *state.feed_units, state.dialect.units)[0]]


def _add_curve(state: ReaderState, curve: Cubic, line: int, lines: Ints) -> None:
    """Add a curve that begins at a line of the file with its points (m,), of others."""
    state.note("CS145", line, tolerance=CHORD)
    check_range(curve.bezier.ravel().tolist(), state.file, int(lines[0]))
    state.curves.append(curve.placed(state.system, state.n - 1))
    held = state.held_axis()
    for (x, y, z), line in zip(curve.points[1:].tolist(), lines.tolist(), strict=True):
        state.add((x, y, z), held, line)


def _movnrb(state: ReaderState, record: Record) -> None:
    """MOVNRB of Creo: rows of curves, then the same motion as points, which are read ("CL Output for NURBS")."""
    if record.option == "ON" and state.points_from is None:
        _check_curve(state, record)
        _at_feed(state, record)
        state.note("CS192", record.line)
        state.points_from = record.line, state.n
    elif record.option == "OFF":
        if state.points_from is not None and state.points_from[1] == state.n:
            raise state.fail("CS128", record, why="MOVNRB has no points")
        state.points_from = None
    elif record.option not in _ROWS:
        raise state.fail("CS128", record, why=f"MOVNRB/{joined(record.args[:1])} is not understood here")


def _at_feed(state: ReaderState, record: Record) -> None:
    """Say that a rapid curve is read as a feed motion."""
    if state.rapid:
        state.note("CS140", record.line, text=record.word, how="made at feed")
        state.rapid = False


HANDLERS: Final[dict[str, Handler]] = {
    **dict.fromkeys(GOTO_WORDS, _goto),
    "RETRCT": _retract,
    "FROM": _from,
    "GOHOME": _gohome,
    "GODLTA": _godlta,
    **dict.fromkeys(("CIRCLE", "MOVARC"), _circle),
    **dict.fromkeys(("HELICAL", "TLON,GOFWD"), _drive),
    **dict.fromkeys(("INDIRV", "INDIRP"), _direction),
    # the plane of the arc after them, which follows from the arc itself
    **dict.fromkeys(("AUTOPS", "PSIS"), lambda state, record: None),
    "NURBS": _nurbs,
    "MOVNRB": _movnrb,
    "KNOT": _knot,
    "CNTRL": _control,
}
