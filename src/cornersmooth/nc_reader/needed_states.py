"""Motion words that a control takes for something else in another state, or not at all: of the axis and of curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cornersmooth.nc_reader.dialects.base import BY_WORD, CLAMPED, HIGH_SPEED, KINEMATICS, SPLINE_AXES, Dialect
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.nc_reader.words import BSPLINE, NURBS, Table

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: code of words that want another state of the control
CONTROL_WORDS: Final = "CS506"

#: code of moves in which the tool axis turns too far
TURNS: Final = "CS526"

#: degrees that a rotary axis turns at most in one feed move: a mistake beyond
MOST_TURN: Final = 360.0

#: degrees at which a rotary axis counts as at zero
_ZERO: Final = 1e-9

#: what words of each kind are
_KINDS = {
    "vector": "a tool vector",
    "point": "a second point on the tool axis",
    "angles": "tip and rotary words",
    "machine": "words of the machine's axes",
}


def curve_problem(table: Table, dialect: Dialect, memory: Mapping[str, Any]) -> Problem | None:
    """Return what is wrong with the first curve of a run: some controls want look ahead of a certain kind with it."""
    needed = dialect.curves_need
    if not needed or memory.get(HIGH_SPEED) or not (curves := np.flatnonzero(table.column("G") == NURBS)).size:
        return None
    return Problem(CONTROL_WORDS, 0, int(table.line[curves[0]]), f"a curve where {needed} must be in force")


def spline_problem(table: Table, dialect: Dialect, memory: Mapping[str, Any], letters: Set[str]) -> Problem | None:
    """Return what is wrong with the first spline of a run: its rotary axes must have been said to be of splines."""
    missing = letters - memory.get(SPLINE_AXES, set())
    if not (dialect.names_spline_axes and missing):
        return None
    if not (splines := np.flatnonzero(table.column("G") == BSPLINE)).size:
        return None
    text = f"a spline of {' and '.join(sorted(missing))}, which no SPLINEPATH(1,X,Y,Z,...) names"
    return Problem(CONTROL_WORDS, 0, int(table.line[splines[0]]), text)


def modulo_problems(table: Table, machine: Machine, words: str, memory: Mapping[str, Any]) -> list[Problem]:
    """Return what is wrong with words of modulo axes in a run: from 0 to 360 degrees, and told to go the shorter way.

    Parameters
    ----------
    words : str
        `Dialect.shorter_way`.
    memory : mapping
        `State.memory`.
    """
    problems = []
    for axis in machine.axes:
        values = table.column(axis.name)
        given = ~np.isnan(values)
        beyond = given & ((values < 0.0) | (values >= 360.0)) if axis.modulo else np.zeros_like(given)
        found = [(beyond, f"a word of {axis.name} that is not from 0 to 360 degrees")]
        if words == BY_WORD:
            told = ~np.isnan(table.column(f"{BY_WORD} {axis.name}"))
            if axis.modulo:
                found.append((given & ~told, f"{axis.name} without {BY_WORD}(), which sends it the shorter way"))
            else:
                found.append((told, f"{axis.name} with {BY_WORD}(), which is for modulo axes"))
        elif words and axis.modulo and not memory.get(words):
            found.append((given, f"{axis.name} without {words} in force, which sends it the shorter way"))
        problems += [
            Problem(CONTROL_WORDS, 0, int(table.line[np.argmax(wrong)]), text) for wrong, text in found if wrong.any()
        ]
    return problems


def limit_problems(table: Table, run: Elements, machine: Machine, step: float) -> list[Problem]:
    """Return which rotary words of a run lie beyond the limits of their axes.

    Parameters
    ----------
    run : Elements
        What becomes of it; of curves, whose control points may lie farther out, the ends.
    step : float, degrees
        Last printed digit.
    """
    problems = []
    for column, axis in enumerate(machine.axes):
        if axis.limits is None:
            continue
        values, line = (run.second[:, column], run.line) if len(run.curves) else (table.column(axis.name), table.line)
        beyond = np.flatnonzero((values < axis.low - step / 2) | (values > axis.high + step / 2))
        if len(beyond):
            text = f"{axis.name} goes to {values[beyond[0]]:g} deg, its limits are {axis.low:g} and {axis.high:g}"
            problems.append(Problem("CS581", 0, int(line[beyond[0]]), text))
    return problems


def turn_problems(run: Elements, before: Sequence[float], machine: Machine) -> list[Problem]:
    """Return which rotary axes turn more than once round in one feed move, which nobody asks for.

    Parameters
    ----------
    run : Elements
        With its rotary words.
    before : sequence of float
        Those before it, NaN where they are not known.
    """
    problems = []
    curves = run.curves
    of_points = np.repeat(run.line[run.kind == Element.CURVE], curves.points)
    next_curve = np.cumsum(curves.points)[:-1] - 1
    for column, axis in enumerate(machine.axes):
        turn = np.abs(np.diff(run.second[:, column], prepend=before[column]))
        turn[run.kind != Element.LINE] = 0.0
        between = np.abs(np.diff(curves.point[:, 3 + column]))
        between[next_curve] = 0.0
        for amount, line in ((turn, run.line), (between, of_points[1:])):
            found = np.flatnonzero(amount > MOST_TURN)
            if len(found):
                text = f"{axis.name} turns by {amount[found[0]]:.0f} deg in one feed move"
                problems.append(Problem(TURNS, 0, int(line[found[0]]), text))
    return problems


def take_clamp(word: float, machine: Machine, memory: dict[str, Any]) -> bool:
    """Note an M word that clamps a rotary axis or lets it turn; return whether it is one."""
    for axis in machine.axes:
        for said, clamped in zip(axis.clamp or (), (True, False), strict=False):
            if float(said[1:]) == word:
                memory[CLAMPED] = {**memory.get(CLAMPED, {}), axis.name: clamped}
                return True
    return False


def clamp_problems(
    run: Elements, before: Sequence[float], machine: Machine, memory: Mapping[str, Any]
) -> list[Problem]:
    """Return which rotary axes turn in a run although they are clamped, or nobody has said that they are not."""
    problems = []
    for column, axis in enumerate(machine.axes):
        if axis.clamp is None or not memory.get(CLAMPED, {}).get(axis.name, True):
            continue
        angles = np.append(before[column], run.second[:, column])
        turned = np.flatnonzero((angles[1:] != angles[:-1]) & ~np.isnan(angles[1:]))
        if len(turned):
            text = f"{axis.name} turns without {axis.clamp[1]} before it"
            problems.append(Problem("CS538", 0, int(run.line[turned[0]]), text))
    return problems


def unclamped_problems(machine: Machine, memory: Mapping[str, Any]) -> list[Problem]:
    """Return which rotary axes are not clamped at the end of a text."""
    free = [axis for axis in machine.axes if axis.clamp and not memory.get(CLAMPED, {}).get(axis.name, True)]
    return [Problem("CS538", 0, 0, f"{axis.name} is not clamped at the end") for axis in free]


def kinematics_problem(
    run: Elements, machine: Machine, memory: Mapping[str, Any], *, tip_control: bool
) -> Problem | None:
    """Return what is wrong with a run where the machine's file says what switches tip control of its kinematics.

    Parameters
    ----------
    run : Elements
        With its rotary words.
    memory : mapping
        `State.memory`.
    tip_control : bool
        Whether the words are those of the tip; without it, of the machine's axes. With both rotary axes at zero that is
        the same.
    """
    on = memory.get(KINEMATICS)
    turned = np.abs(run.second[:, : len(machine.names)]) > _ZERO
    if not machine.tip_control or on is tip_control or not turned.any():
        return None
    row = int(np.argmax(turned.any(axis=1)))
    here, other = machine.tip_control if tip_control else machine.tip_control[::-1]
    what = _KINDS["angles" if tip_control else "machine"]
    before = "before any word of tip control" if on is None else f"under {other}"
    return Problem(CONTROL_WORDS, 0, int(run.line[row]), f"{what} {before}, where {here} must be in force")


class AxisWords:
    """Complains once for each state of words of the axis that it does not take for what they are."""

    def __init__(self, dialect: Dialect) -> None:
        self._wanted = dialect.controls
        self._complained: set[tuple[str, str]] = set()

    def problem(
        self, table: Table, kind: str, letters: Set[str], tip_control: str, code: float, approach: Set[int]
    ) -> Problem | None:
        """Return what is wrong with a run of motion blocks.

        Parameters
        ----------
        kind : str
            What its words of the axis are; a key of `Dialect.controls`.
        letters : set of str
            Addresses of such words.
        tip_control : str
            Tool tip control in force; empty for none.
        code : float
            G word of group 01 before the run.
        approach : set of int
            Lines on the way down from a retract: there rotary axes turn before the control is told of the tip.
        """
        wanted = self._wanted.get(kind)
        used = table.columns.keys() & letters
        if wanted is None or not used or tip_control in wanted or (kind, tip_control) in self._complained:
            return None
        rows = table.rows_with(used, code)
        if approach:
            rows = rows[[int(number) not in approach for number in table.line[rows]]]
        if not len(rows):
            return None
        self._complained.add((kind, tip_control))
        need = " or ".join(word or "no tool tip control" for word in wanted)
        text = f"{_KINDS[kind]} under {tip_control or 'no tool tip control'}, where {need} must be in force"
        return Problem(CONTROL_WORDS, 0, int(table.line[rows[0]]), text)
