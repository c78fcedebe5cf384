"""Polynomials in a text as curves: Siemens' POLY and Heidenhain's SPL, cubics of a parameter, weights 1."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.ncprogram import Problem
from cornersmooth.verify.splines import CurveTable
from cornersmooth.verify.words import Table

#: mm or degrees by which an SPL may begin beside where the block before has ended (iTNC 530: 1 µm), and rounding
_GAP = 1.1e-3

_KNOTS = np.array([0.0] * 4 + [1.0] * 4)


def poly_curves(
    table: Table, six: Floats, before: Floats, poly: Bools, letters: str, problems: list[Problem]
) -> CurveTable:
    """Curves of POLY: ``PO[X]=(end, a2, a3)`` of a parameter p from 0 to PL.

    The control takes a0 from where the block before ended; a1 follows from the end.

    Parameters
    ----------
    table : Table
        Columns ``X2`` and ``X3`` hold the coefficients of ``X``; without them an axis runs straight.
    six : (r, 6) float64
        Positions after every block, in the order of `letters`.
    before : (6,) float64
        Position in front of the run.
    poly : (r,) bool
    letters : str
    problems : list of Problem
        Takes what breaks the rules.
    """
    rows = np.flatnonzero(poly)
    start, end = np.vstack((before, six))[rows], six[rows]
    length = table.column("PL")[rows]
    length = np.where(np.isnan(length), 1.0, length)
    text = "a parameter interval PL that is not positive"
    problems.extend(Problem("CS516", 0, int(table.line[row]), text) for row in rows[length <= 0].tolist())
    length = np.where(length > 0, length, 1.0)[:, None]
    square = _factors(table, rows, letters, "{}2") * length**2
    cube = _factors(table, rows, letters, "{}3") * length**3
    slope = end - start - square - cube
    return _bezier(rows, start, start + slope / 3, start + 2 * slope / 3 + square / 3, end)


def spl_curves(
    table: Table, six: Floats, before: Floats, spl: Bools, letters: str, problems: list[Problem]
) -> CurveTable:
    """Curves of SPL: X(t) = K3X·t³ + K2X·t² + K1X·t + X with t from 1 to 0.

    Parameters
    ----------
    As in `poly_curves`; the columns are ``K3X``, ``K2X`` and ``K1X``.
    """
    rows = np.flatnonzero(spl)
    end = six[rows]
    cube, square, slope = (_factors(table, rows, letters, f"K{power}{{}}") for power in (3, 2, 1))
    start = end + slope + square + cube
    off = np.abs(start - np.vstack((before, six))[rows]).max(axis=1)
    text = "a spline begins more than a micrometre beside where the block before has ended"
    problems.extend(Problem("CS519", 0, int(table.line[row]), text) for row in rows[off > _GAP].tolist())
    return _bezier(rows, start, end + 2 * slope / 3 + square / 3, end + slope / 3, end)


def _factors(table: Table, rows: Ints, letters: str, name: str) -> Floats:
    """(k, 6) coefficients of each axis, zero where there is none."""
    columns = [np.nan_to_num(table.column(name.format(letter))[rows]) for letter in letters]
    columns += [np.zeros(len(rows))] * (6 - len(columns))
    return np.stack(columns, axis=1)


def _bezier(rows: Ints, *points: Floats) -> CurveTable:
    count = len(rows)
    return CurveTable(
        row=rows,
        end=rows,
        order=np.full(count, 4, np.int64),
        points=np.full(count, 4, np.int64),
        control=np.stack(points, axis=1).reshape(-1, 6),
        weight=np.ones(4 * count),
        knot=np.tile(_KNOTS, count),
    )
