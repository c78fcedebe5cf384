"""Runs of motion blocks to path elements, as the control executes them: modal words, curves, arcs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.ncprogram import Element, Problem
from cornersmooth.verify.words import Table

#: FANUC: order of a curve whose first block has no P (B-63324EN/03 4.17)
DEFAULT_ORDER = 4

_CURVE_CODE = 6.2
_TIP, _VECTOR, _POINT = "XYZ", "IJK", "UVW"
_PLANE_NORMAL = {17: (0.0, 0.0, 1.0), 18: (0.0, 1.0, 0.0), 19: (1.0, 0.0, 0.0)}
_FULL_TURN = 2 * np.pi


@dataclass(frozen=True)
class Modal:
    """What holds from one block to the next.

    Parameters
    ----------
    code : float
        G word of group 01; NaN before the first.
    tip, second : tuple of 3 floats
        In units of the text; NaN where not known yet.
    feed : float
    per_revolution, inch : bool
    plane : int
        17, 18 or 19.
    vectors : bool
        G43.5: I J K are the tool vector.
    points : bool
        U V W have been met: they are the axis point.
    """

    code: float = float("nan")
    tip: tuple[float, ...] = (float("nan"),) * 3
    second: tuple[float, ...] = (float("nan"),) * 3
    feed: float = float("nan")
    per_revolution: bool = False
    inch: bool = False
    plane: int = 17
    vectors: bool = False
    points: bool = False

    def but(self, **changes: Any) -> Modal:
        """Return a copy with some values changed."""
        return replace(self, **changes)


@dataclass
class Piece:
    """Path elements of one run, in units of the text; the fields are those of `NcProgram` and its tables."""

    kind: NDArray[np.uint8]
    tip: Floats
    second: Floats
    line: Ints
    feed: Floats
    per_revolution: NDArray[np.bool_]
    curve_element: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    curve_order: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    curve_points: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    control: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    weight: Floats = field(default_factory=lambda: np.zeros(0))
    knot: Floats = field(default_factory=lambda: np.zeros(0))
    arc_element: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    arc_centre: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    arc_normal: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    arc_sweep: Floats = field(default_factory=lambda: np.zeros(0))
    problems: list[Problem] = field(default_factory=list)


def execute(table: Table, modal: Modal) -> tuple[Piece, Modal]:
    """Run the blocks of a table.

    Parameters
    ----------
    table : Table
        Of r blocks, ending where no curve is open.
    modal : Modal
        Before the first block.

    Returns
    -------
    Piece
    Modal
        After the last block.
    """
    points = modal.points or any(letter in table.columns for letter in _POINT)
    code = _held(table.column("G"), modal.code)
    curve = code == _CURVE_CODE
    letters = _POINT if points else _VECTOR
    tip, placed = _held_columns(table, _TIP, modal.tip)
    second, turned = _second(table, letters, modal, ~curve & ~_is_arc(code))
    placed |= turned

    problems: list[Problem] = []
    starts = curve & (table.column("G") == _CURVE_CODE)
    element_rows = placed & ~curve
    if curve.any():
        element_rows |= starts
        curves, end_row = _read_curves(table, tip, second, placed, curve, starts, problems)
    rows = np.flatnonzero(element_rows)
    ends = rows.copy()
    if curve.any():
        ends[starts[rows]] = end_row
    feed = _held(table.column("F"), modal.feed)
    is_arc = _is_arc(code)[rows]
    kind = np.select(
        [starts[rows], is_arc, code[rows] == 0], [Element.CURVE, Element.ARC, Element.RAPID], Element.LINE
    ).astype(np.uint8)
    piece = Piece(
        kind=kind,
        tip=tip[ends],
        second=second[ends],
        line=table.line[rows],
        feed=np.where(kind == Element.RAPID, np.nan, feed[rows]),
        per_revolution=np.full(len(rows), modal.per_revolution),
        problems=problems,
    )
    unknown = np.flatnonzero(np.isnan(code[rows]))
    if len(unknown):
        problems.append(Problem("CS502", 0, int(piece.line[unknown[0]]), "a motion before the first G0 or G1"))
    if curve.any():
        piece.curve_element = np.flatnonzero(kind == Element.CURVE)
        piece.curve_order, piece.curve_points = curves["order"], curves["points"]
        piece.control = curves["point"]
        piece.weight, piece.knot = curves["weight"], curves["knot"]
        _check_starts(piece, modal)
    if is_arc.any():
        _add_arcs(piece, table, rows, code, modal)
    after = modal.but(
        code=float(code[-1]),
        tip=tuple(tip[-1].tolist()),
        second=tuple(second[-1].tolist()),
        feed=float(feed[-1]),
        points=points,
    )
    return piece, after


def _is_arc(code: Floats) -> NDArray[np.bool_]:
    arc: NDArray[np.bool_] = (code == 2) | (code == 3)
    return arc


def _held(column: Floats, before: float) -> Floats:
    """Fill what is missing with the last value given."""
    missing = np.isnan(column)
    if not missing.any():
        return column
    if missing.all():
        return np.full(len(column), before)
    last = np.maximum.accumulate(np.where(missing, -1, np.arange(len(column))))
    return np.where(last < 0, before, column[last])


def _held_columns(table: Table, letters: str, before: tuple[float, ...]) -> tuple[Floats, NDArray[np.bool_]]:
    """(r, 3) words held from block to block, and (r,) whether a block has any of them."""
    values = np.empty((len(table), 3))
    given = np.zeros(len(table), np.bool_)
    for k, letter in enumerate(letters):
        column = table.columns.get(letter)
        if column is None:
            values[:, k] = before[k]
        else:
            given |= ~np.isnan(column)
            values[:, k] = _held(column, before[k])
    return values, given


def _second(table: Table, letters: str, modal: Modal, straight: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
    """Tool vector or axis point after every block.

    In a vector some of whose words are missing they are zero; without any the last vector holds (FANUC G43.5).
    """
    if letters == _POINT:
        return _held_columns(table, letters, modal.second)
    before = modal.second if not np.isnan(modal.second[0]) else (0.0, 0.0, 1.0)
    columns = np.stack([table.column(letter) for letter in letters], axis=1)
    columns[~straight] = np.nan  # K is a knot in a curve; I J K are no vector on an arc
    given: NDArray[np.bool_] = ~np.logical_and.reduce(np.isnan(columns), axis=1)
    columns[given] = np.nan_to_num(columns[given], nan=0.0)
    if not given.all():
        for k in range(3):
            columns[:, k] = _held(columns[:, k], before[k])
    return columns, given


def _read_curves(
    table: Table,
    tip: Floats,
    second: Floats,
    placed: NDArray[np.bool_],
    curve: NDArray[np.bool_],
    starts: NDArray[np.bool_],
    problems: list[Problem],
) -> tuple[dict[str, Any], Ints]:
    """Control points and knots of all curves, and the row of each curve's last control point."""
    rows = np.flatnonzero(curve)
    start = np.flatnonzero(starts[rows])
    if len(start) == 0 or start[0] != 0:
        problems.append(Problem("CS511", 0, int(table.line[rows[0]]), "curve blocks without a G6.2 before them"))
        first = start[0] if len(start) else len(rows)
        rows, start = rows[first:], start - first
    size = np.diff(np.append(start, len(rows)))
    is_point = placed[rows]
    points = np.add.reduceat(is_point, start, dtype=np.int64) if len(start) else np.zeros(0, np.int64)
    given = table.column("P")[rows[start]]
    order = np.where(np.isnan(given), DEFAULT_ORDER, given).astype(np.int64)
    knot = table.column("K")[rows]
    weight = table.column("R")[rows][is_point]
    weight = np.where(np.isnan(weight), 1.0, weight)

    def complain(mask: NDArray[np.bool_], code: str, text: str) -> None:
        problems.extend(Problem(code, 0, int(table.line[rows[k]]), text) for k in np.flatnonzero(mask).tolist())

    def complain_curve(mask: NDArray[np.bool_], code: str, text: str) -> None:
        wrong = np.zeros(len(rows), np.bool_)
        wrong[start[mask]] = True
        complain(wrong, code, text)

    gap = np.append(False, (np.diff(table.line[rows]) != 1) & ~starts[rows][1:])
    complain(gap, "CS510", "something else stands between the blocks of a curve")
    complain(np.isnan(knot), "CS512", "a curve block without its knot K")
    knot = np.nan_to_num(knot)
    single = size - points
    complain_curve(single < order, "CS513", "fewer blocks with only a knot than the order of the curve asks for")
    complain_curve(single > order, "CS513", "more blocks with only a knot than the order of the curve asks for")
    complain_curve((points < order) | (order < 2), "CS514", "fewer control points than the order of the curve")
    late = is_point[1:] & ~is_point[:-1]
    late &= ~starts[rows][1:]
    complain(np.append(False, late), "CS515", "a control point after the blocks with only a knot")
    falls = np.append(False, (np.diff(knot) < 0) & ~starts[rows][1:])
    complain(falls, "CS516", "a knot below the one before it")
    complain_curve(_unclamped(knot, start, size, order), "CS517", "first or last knots that are not all equal")
    point_rows = rows[is_point]
    wrong = np.flatnonzero((weight <= 0) | ~np.isfinite(weight))
    text = "a weight R that is not positive"
    problems.extend(Problem("CS518", 0, int(table.line[row]), text) for row in point_rows[wrong].tolist())
    last = np.cumsum(points) - 1
    return (
        {
            "order": order,
            "points": points,
            "point": np.hstack((tip[point_rows], second[point_rows])),
            "weight": weight,
            "knot": _exactly(knot, start, size, points + order),
        },
        point_rows[last],
    )


def _unclamped(knot: Floats, start: Ints, size: Ints, order: Ints) -> NDArray[np.bool_]:
    """(c,) whether the first `order` or the last `order` knots of a curve differ."""
    wrong = np.zeros(len(start), np.bool_)
    for k in range(1, int(order.max(initial=1))):
        used = k < np.minimum(order, size)
        wrong[used] |= knot[start[used] + k] != knot[start[used]]
        end = start[used] + size[used] - 1
        wrong[used] |= knot[end - k] != knot[end]
    return wrong


def _exactly(knot: Floats, start: Ints, size: Ints, wanted: Ints) -> Floats:
    """Knots cut or filled to the number each curve needs, so that a malformed curve can still be measured."""
    if (size == wanted).all():
        return knot
    index = np.arange(wanted.sum()) - np.repeat(np.cumsum(wanted) - wanted, wanted)
    filled: Floats = knot[np.repeat(start, wanted) + np.minimum(index, np.repeat(size, wanted) - 1)]
    return filled


def _check_starts(piece: Piece, modal: Modal) -> None:
    """First control points must be where the tool is, digit for digit (FANUC alarm PS1009)."""
    element = piece.curve_element
    first = np.cumsum(piece.curve_points) - piece.curve_points
    control = piece.control[first]
    for own, end, before in (
        (control[:, :3], piece.tip, modal.tip),
        (control[:, 3:], piece.second, modal.second),
    ):
        position = np.vstack((before, end))[element]
        wrong = (own != position).any(axis=1)
        for k in np.flatnonzero(wrong).tolist():
            text = "first control point is not the current position"
            piece.problems.append(Problem("CS519", 0, int(piece.line[element[k]]), text))


def _add_arcs(piece: Piece, table: Table, rows: Ints, code: Floats, modal: Modal) -> None:
    """Centres, normals and sweeps of the G2 and G3 blocks, in units of the text."""
    element = np.flatnonzero(piece.kind == Element.ARC)
    normal = np.array(_PLANE_NORMAL[modal.plane])
    before = np.vstack((modal.tip, piece.tip))[element]
    end = piece.tip[element]
    sense = np.where(code[rows[element]] == 3, 1.0, -1.0)
    chord = end - before
    chord -= (chord @ normal)[:, None] * normal
    length = np.linalg.norm(chord, axis=1)
    across = np.cross(normal, chord)
    radius = table.column("R")[rows[element]]
    by_radius = ~np.isnan(radius)
    half = np.divide(length, 2 * np.abs(radius), out=np.ones_like(length), where=by_radius & (radius != 0))
    for k in np.flatnonzero(by_radius & ((length == 0) | (half > 1 + _slack(radius, length)))).tolist():
        text = f"an arc of radius {radius[k]:g} does not reach its end"
        piece.problems.append(Problem("CS520", 0, int(piece.line[element[k]]), text))
    rise = np.sqrt(np.maximum(1 - half**2, 0)) * np.abs(np.nan_to_num(radius)) * np.sign(np.nan_to_num(radius))
    towards = np.divide(across, length[:, None], out=np.zeros_like(across), where=length[:, None] > 0)
    centre = before + chord / 2 + (sense * rise)[:, None] * towards
    offsets = np.stack([np.nan_to_num(table.column(letter)[rows[element]]) for letter in _VECTOR], axis=1)
    offsets -= (offsets @ normal)[:, None] * normal
    centre = np.where(by_radius[:, None], centre, before + offsets)
    normals = sense[:, None] * normal
    piece.arc_element, piece.arc_centre, piece.arc_normal = element, centre, normals
    piece.arc_sweep = _sweep(before - centre, end - centre, normals, by_radius)


def _slack(radius: Floats, length: Floats) -> Floats:
    """How much, relative to the radius, a half circle may be missed because of printed digits."""
    return np.maximum(1e-6, np.divide(1e-3, np.abs(radius), out=np.zeros_like(length), where=radius != 0))


def _sweep(start: Floats, end: Floats, normal: Floats, by_radius: NDArray[np.bool_]) -> Floats:
    """Angle from start to end, right-handed about the normals; a full turn for a centre form that comes back."""
    sine = np.einsum("ij,ij->i", np.cross(start, end), normal)
    flat = start - np.einsum("ij,ij->i", start, normal)[:, None] * normal
    cosine = np.einsum("ij,ij->i", flat, end)
    angle = np.arctan2(sine, cosine) % _FULL_TURN
    turned: Floats = np.where(~by_radius & (angle == 0), _FULL_TURN, angle)
    return turned
