"""Runs of motion blocks to path elements, as the control executes them: modal words, curves, arcs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.control.state import State
from cornersmooth.control.words import NURBS, Table, filled
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Curves, Element, Elements, NcArcs, Problem
from cornersmooth.nc_reader.splines import Blocks, curves_of, cut_long
from cornersmooth.nc_reader.tool import circles

_TIP, _VECTOR, _POINT = "XYZ", "IJK", "UVW"

#: by how much the square of the length of a unit vector may be off in printed digits
_UNIT: Final = 1e-3

#: by how much lengths of vectors may be off the whole number that they are but for rounded digits
_WHOLE: Final = 2e-3


@dataclass(frozen=True)
class Modal:
    """Words of motion blocks that hold from one to the next."""

    code: float = float("nan")  #: G word of group 01; NaN before the first.
    #: In units of the text; NaN where not known yet.
    tip: tuple[float, ...] = (float("nan"),) * 3
    second: tuple[float, ...] = (float("nan"),) * 3
    feed: float = float("nan")
    points: bool = False  #: u V W have been met: they are the axis point
    rotary: str = ""  #: addresses of the rotary axes, nearest to the part first; empty for texts without any
    vector_length: float = math.inf  #: of the shortest tool vector so far


def execute(table: Table, modal: Modal, machine: State, problems: list[Problem]) -> tuple[Elements, Modal]:
    """Run the blocks of a table, which ends where no curve is open.

    Parameters
    ----------
    modal : Modal
        Before the first block.
    machine : State
        What holds in all of them.
    problems : list of Problem
        Takes what breaks the rules.

    Returns
    -------
    Elements
        In units of the text, without room. The second triple of a text with rotary words are their degrees.
    Modal
        After the last block.
    """
    points = modal.points or any(letter in table.columns for letter in _POINT)
    code, _ = filled(table.column("G"), modal.code)
    # tip and second triple side by side: curves take both at once
    six = np.empty((len(table), 6))
    tip, second = six[:, :3], six[:, 3:]
    placed = _kept(table, _TIP, modal.tip, tip)
    straight = (code <= 1) | np.isnan(code)
    is_arc = np.zeros(len(table), np.bool_) if straight.all() else (code == 2) | (code == 3)
    if is_arc.any():  # a full circle need not say where it ends
        placed |= is_arc & ~np.isnan([table.column(letter) for letter in "IJKR"]).all(axis=0)
    letters = modal.rotary or (_POINT if points else _VECTOR)
    vector_length = modal.vector_length
    if modal.rotary or points:
        known = modal.rotary or modal.points  # else there has been a vector, which is no point
        placed |= _kept(table, letters, modal.second if known else (np.nan,) * 3, second)
    else:
        given = _vectors(table, modal, straight, second, problems)
        vector_length = min(vector_length, _to_unit_length(second, given))
        placed |= given
    curves = Curves()
    element_rows = placed
    if not (straight | is_arc).all():
        before = np.array((*modal.tip, *modal.second))
        curves, cut = cut_long(curves_of(Blocks(table, six, before, placed, code, _TIP + letters, problems)))
        element_rows = placed & (straight | is_arc)
        element_rows[curves.element] = True
    rows = np.flatnonzero(element_rows)
    ends = rows
    if len(curves):
        ends = rows.copy()
        curved = np.searchsorted(rows, curves.element)
        ends[curved] = curves.end
    feed, _ = filled(table.column("F"), modal.feed)
    end = six if ends is rows and len(rows) == len(six) else six.take(ends, axis=0)
    if len(curves) and cut.any():  # between its knots a curve does not end in a control point
        end[curved[cut]] = curves.point[(curves.first_point + curves.points)[cut] - 1]
    rapid = code[rows] == 0
    kind = np.where(rapid, np.uint8(Element.RAPID), np.uint8(Element.LINE))
    if is_arc.any():
        kind[is_arc[rows]] = Element.ARC
    if len(curves):
        kind[curved] = Element.CURVE
        rapid = kind == Element.RAPID
    none = np.zeros(len(rows))
    run = Elements(
        kind=kind,
        tip=end[:, :3],
        second=end[:, 3:],
        line=table.line[rows],
        feed=np.where(rapid, np.nan, feed[rows]),
        per_revolution=np.full(len(rows), machine.groups["feed"] == "revolution"),
        other_feed=np.full(len(rows), np.nan),
        least_feed=np.zeros(len(rows), np.bool_),
        feed_room=none,
        second_room=none.copy(),
        tip_room=none.copy(),
        curves=replace(curves, element=curved) if len(curves) else curves,
    )
    after = replace(
        modal,
        code=float(code[-1]),
        tip=tuple(tip[-1].tolist()),
        second=tuple(second[-1].tolist()),
        feed=float(feed[-1]),
        points=points,
        vector_length=vector_length,
    )
    _check(run, replace(modal, points=points), table, rows, code, straight, problems)
    if machine.groups["feed"] == "inverse":  # every block of feed needs its F, and curves are refused (alarm PS1006)
        missing = np.isnan(table.column("F")[rows]) & (code[rows] > 0)
        problems += Problem.at("CS542", missing, run.line, "a block without F at inverse time feed (G93)", most=1)
        text = "a curve at inverse time feed (G93)"
        problems += Problem.at("CS511", code[rows] == NURBS, run.line, text, most=1)
    if is_arc.any():
        element = np.flatnonzero(run.kind == Element.ARC)
        own = rows[element]
        part = Table(table.line[own], {name: column[own] for name, column in table.columns.items()})
        start = np.vstack((modal.tip, run.tip))[element]
        circle = circles(part, start, run.tip[element], code[own] == 3, machine.plane, problems)
        run = replace(run, arcs=NcArcs(element, *circle))
    return run, after


def in_mm(run: Elements, machine: State, *, points: bool, inch_feed: float, feed_step: float) -> Elements:
    """Return a run in millimetres, with `feed_step` as the room of feeds; feeds of a text in inches are `inch_feed`."""
    factor, mode = machine.unit, machine.groups["feed"]
    unit = 1.0 if mode == "inverse" else factor * (inch_feed if factor != 1.0 and mode == "minute" else 1.0)
    if factor != 1.0:  # a factor of one leaves the numbers untouched
        run.curves.point[:, : 6 if points else 3] *= factor
        run = replace(
            run,
            tip=run.tip * factor,
            second=run.second * factor if points else run.second,
            feed=run.feed * unit,
            arcs=replace(run.arcs, centre=run.arcs.centre * factor),
        )
    run.feed_room[:] += feed_step / 2 * unit
    return run


def _kept(table: Table, letters: str, before: tuple[float, ...], values: Floats) -> Bools:
    """Put three words kept from block to block into `values`; say which blocks have any of them."""
    given = np.zeros(len(table), np.bool_)
    values[:, len(letters) :] = 0.0
    for k, letter in enumerate(letters):
        column = table.column(letter)
        given |= ~np.isnan(column)
        values[:, k], _ = filled(column, before[k])
    return given


def _vectors(table: Table, modal: Modal, straight: Bools, values: Floats, problems: list[Problem]) -> Bools:
    """Put the tool vector after every block into `values`; say which blocks have any of its words.

    In a vector some of whose words are missing they are zero; without any the last vector holds (FANUC G43.5,
    Siemens).
    """
    before = modal.second if not np.isnan(modal.second[0]) else (0.0, 0.0, 1.0)
    # K is a knot in a curve; I J K are no vector on an arc
    words = [np.where(straight, table.column(letter), np.nan) for letter in _VECTOR]
    given: Bools = np.logical_not(np.isnan(words).all(axis=0))
    for k, column in enumerate(words):
        values[:, k], _ = filled(np.where(given, np.nan_to_num(column), np.nan), before[k])
    bare = values[:, 2] == 0
    if bare.any():  # seldom: only then the others are looked at
        bare &= given & (values[:, 0] == 0) & (values[:, 1] == 0)
        problems += Problem.at("CS507", bare, table.line, "a tool vector without length")
    return given


def _to_unit_length(vectors: Floats, given: Bools) -> float:
    """Divide tool vectors by their length, of which controls take no notice; return that of the shortest given.

    Lengths are taken for the whole numbers that they are but for rounded digits, so that digits stay those of the text.
    """
    square = np.einsum("ij,ij->i", vectors, vectors)
    if not given.any():
        return math.inf
    if np.abs(square - 1.0).max() <= _UNIT:
        return 1.0
    length = np.sqrt(square)
    whole = np.rint(length)
    length = np.where((whole >= 1.0) & (np.abs(length - whole) <= _WHOLE), whole, length)
    length[length == 0.0] = 1.0  # a problem elsewhere
    vectors /= length[:, None]
    return float(length[given].min())


def _check(
    run: Elements, modal: Modal, table: Table, rows: Ints, code: Floats, straight: Bools, problems: list[Problem]
) -> None:
    """Note what breaks the rules of a run; `rows` are the blocks of its elements, `code` the G word of each block."""
    line, own = run.line, code[rows]
    problems += Problem.at("CS502", np.isnan(own), line, "a motion before the first G0 or G1", most=1)
    # words of curves have no meaning on lines: what was to begin the curve is missing
    names = ["R", "PL", "PW", *("K" if modal.points or modal.rotary else "")]
    given = [~np.isnan(table.columns[name]) for name in names if name in table.columns]
    text = "curve blocks without what begins a curve before them"
    problems += Problem.at("CS511", straight & np.any(given, axis=0), table.line, text, most=1) if given else []
    if modal.points:  # I J are no vector there, nor A3 B3; on arcs they are the centre
        vector = ~np.isnan([table.column(letter) for letter in "IJ"]).all(axis=0) & (code != 2) & (code != 3)
        text = "a tool vector beside points on the tool axis"
        problems += Problem.at("CS503", vector, table.line, text, most=1)
    if len(run.curves):  # first control points are where the tool is, digit for digit (FANUC alarm PS1009)
        exact = own[run.curves.element] == NURBS
        element = run.curves.element[exact]
        control = run.curves.point.take(run.curves.first_point[exact], axis=0)
        before = np.hstack((run.tip[element - 1], run.second[element - 1]))
        before[element == 0] = (*modal.tip, *modal.second)
        text = "first control point is not the current position"
        problems += Problem.at("CS519", (control != before).any(axis=1), line[element], text)
