"""Motion words that a control takes for something else in another state, or not at all: of the axis and of curves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set
from typing import TYPE_CHECKING, Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.acts import ModalState
from cornersmooth.nc_reader.dialects.base import Dialect
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.nc_reader.execution import Modal
from cornersmooth.nc_reader.rotary import tool_vectors
from cornersmooth.nc_reader.words import BY_WORD, NURBS, Table

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: code of words that want another state of the control
CONTROL_WORDS: Final = "CS506"

#: degrees that a rotary axis turns at most in one feed move: a mistake beyond
MOST_TURN: Final = 360.0

#: degrees that a rotary axis may turn at feed while the tool axis stands
MOST_IDLE: Final = 180.0

#: degrees at which a rotary axis counts as at zero
_ZERO: Final = 1e-9

#: what words of each kind are
_KINDS = {
    "vector": "a tool vector",
    "point": "a second point on the tool axis",
    "angles": "tip and rotary words",
    "machine": "words of the machine's axes",
}


def first_wrong(code: str, wrong: Bools, line: Ints, text: str) -> list[Problem]:
    """The first of some rows where something is wrong, if there is one; `line` are the NC lines of the rows."""
    return Problem.at(code, wrong, line, text, most=1)


def control_problems(
    table: Table, state: ModalState, dialect: Dialect, code: float, approach: Set[int], unlooked: list[tuple[int, str]]
) -> Iterator[Problem]:
    """What of a run of motion blocks the control would not take for what it is; `code` is the G word before the run.

    On the way down from a retract, in lines `approach`, rotary axes turn before the control knows the tip.
    `unlooked` takes what is not known.
    """
    if state.rotary is not None:
        kind, letters = ("angles" if state.rotary.tip_control else "machine"), set(state.rotary.names)
    else:
        kind, letters = ("point", set("UVW")) if state.modal.points else ("vector", set("IJ"))
    motion = table.column("G")
    if dialect.curves_need and not state.high_speed:
        text = f"a curve where {dialect.curves_need} must be in force"
        yield from first_wrong(CONTROL_WORDS, motion == NURBS, table.line, text)
    wanted = dialect.controls.get(kind)
    if wanted is not None and state.tip_control not in wanted:
        rows = table.rows_with(letters, code)
        line = table.line[rows]
        need = " or ".join(word or "no tool tip control" for word in wanted)
        text = f"{_KINDS[kind]} under {state.tip_control or 'no tool tip control'}, where {need} must be in force"
        turned = [] if state.rotary is None else list(approach)
        wrong = list(first_wrong(CONTROL_WORDS, ~np.isin(line, turned), line, text))
        if state.tip_control in dialect.unsure.get(kind, ()):
            unlooked += [(problem.nc_line, problem.text) for problem in wrong]
        else:
            yield from wrong


def away_problems(run: Elements, machine: Machine, step: float) -> Iterator[Problem]:
    """Where X Y Z are those of the tip, although nothing keeps it and rotary axes have been sent away from zero."""
    angles = run.second[:, : len(machine.names)]
    full = np.array([np.inf if axis.limits is not None else 360.0 for axis in machine.axes])
    zero = np.array([min(max(0.0, np.ceil(axis.low)), np.floor(axis.high)) for axis in machine.axes])  # or as near
    off = np.abs(angles - zero) % full
    away = (np.minimum(off, full - off) > step).any(axis=1)
    yield from first_wrong(CONTROL_WORDS, away, run.line, "no tool tip control where rotary axes are away from zero")


def axis_problems(table: Table, machine: Machine, way: str, state: ModalState, step: float) -> Iterator[Problem]:
    """What is wrong with the rotary words of a run: beyond the limits of their axes, or words of modulo axes.

    Those are from 0 to 360 degrees, and go the shorter way by a word. `step` is the last printed digit, degrees.
    """
    for axis in machine.axes:
        name, values = axis.name, table.column(axis.name)
        given, by_words = ~np.isnan(values), ~np.isnan(table.column(f"{BY_WORD} {axis.name}"))
        if axis.modulo:
            text = f"a word of {name} that is not from 0 to 360 degrees"
            yield from first_wrong(CONTROL_WORDS, (values < 0.0) | (values >= 360.0), table.line, text)
        if way == BY_WORD and axis.modulo:
            text = f"{name} without {BY_WORD}(), which sends it the shorter way"
            yield from first_wrong(CONTROL_WORDS, given & ~by_words, table.line, text)
        elif way == BY_WORD:
            text = f"{name} with {BY_WORD}(), which is for modulo axes"
            yield from first_wrong(CONTROL_WORDS, by_words, table.line, text)
        elif way and axis.modulo and not state.shorter_way:
            text = f"{name} without {way} in force, which sends it the shorter way"
            yield from first_wrong(CONTROL_WORDS, given, table.line, text)
        if axis.limits is not None:
            beyond = (values < axis.low - step / 2) | (values > axis.high + step / 2)
            for angle in values[beyond][:1].tolist():
                text = f"{name} goes to {angle:g} deg, its limits are {axis.low:g} and {axis.high:g}"
                yield from first_wrong("CS581", beyond, table.line, text)


def turn_problems(run: Elements, before: Sequence[float], machine: Machine) -> Iterator[Problem]:
    """Which rotary axes turn more than once round in one feed move; `before`: their words before the run, or NaN."""
    for column, axis in enumerate(machine.axes):
        turn = np.abs(np.diff(run.second[:, column], prepend=before[column]))
        turn[run.kind != Element.LINE] = 0.0
        for degrees in turn[turn > MOST_TURN][:1].tolist():
            text = f"{axis.name} turns by {degrees:.0f} deg in one feed move"
            yield from first_wrong("CS526", turn > MOST_TURN, run.line, text)


def late_turns(run: Elements, before: Modal, machine: Machine, *, left_turned: bool) -> Iterator[Problem]:
    """What is wrong with motion where no word says how the rotary axes stand: behind a plane, or where it comes late.

    Before their first words they count as at zero; the first may not turn a tool that has come down.
    """
    unknown = np.isnan(np.vstack((before.second, run.second))[:, : len(machine.names)])
    if left_turned:
        text = "motion after a tilted plane, and no word says where the rotary axes are"
        yield from first_wrong("CS506", unknown[1:].any(axis=1), run.line, text)
    down = ~np.isnan(np.vstack((before.tip, run.tip))[:-1]).any(axis=1)
    text = "a rotary axis is sent to where it belongs after the tool has come down"
    yield from first_wrong("CS531", down & (unknown[:-1] & ~unknown[1:]).any(axis=1), run.line, text)


def idle_turns(
    run: Elements, before: Sequence[float], machine: Machine, step: float, turned: Floats
) -> Iterator[tuple[int, str]]:
    """Where rotary axes turn by half a turn or more at feed while the tool axis stands along them; texts.

    From there a quarter of a turn leads to any other axis, or half a turn where limits leave one way to reach it. More
    swings part or head around the tool, which the CL file does not ask for. `step` is the last printed digit, degrees;
    `turned` (2,) how far each axis has turned so up to the run: it goes on.
    """
    angles = np.vstack((before, run.second))[:, : len(machine.axes)]
    axis = tool_vectors(machine, angles)
    turn = np.abs(np.diff(angles, axis=0))
    stands = (run.kind == Element.LINE) & (np.abs(np.diff(axis, axis=0)).max(axis=1) <= 2.0 * math.radians(step))
    whole = np.cumsum(np.where(stands[:, None], turn, 0.0), axis=0) + turned
    begun = np.maximum.accumulate(np.where(stands[:, None], 0.0, whole), axis=0)
    found = whole - begun
    turned[:] = found[-1]
    for column, name in enumerate(machine.names):
        far = np.flatnonzero(found[:, column] >= MOST_IDLE - step)
        yield from ((line, f"{name} turns while the tool axis stands along it") for line in run.line[far[:1]].tolist())


def take_clamp(word: float, machine: Machine, state: ModalState) -> bool:
    """Note an M word that clamps a rotary axis or lets it turn; return whether it is one."""
    for axis in machine.axes:
        for clamp_word, clamped in zip(axis.clamp or (), (True, False), strict=False):
            if float(clamp_word[1:]) == word:
                state.clamped[axis.name] = clamped
                return True
    return False


def clamp_problems(run: Elements, before: Sequence[float], machine: Machine, state: ModalState) -> Iterator[Problem]:
    """Which rotary axes turn in a run although they are clamped, or no word says that they are not."""
    for column, axis in enumerate(machine.axes):
        if axis.clamp is not None and state.clamped[axis.name]:
            angles = np.append(before[column], run.second[:, column])
            turned = (angles[1:] != angles[:-1]) & ~np.isnan(angles[1:])
            yield from first_wrong("CS538", turned, run.line, f"{axis.name} turns without {axis.clamp[1]} before it")


def kinematics_problems(run: Elements, machine: Machine, state: ModalState, *, tip_control: bool) -> Iterator[Problem]:
    """What is wrong with a run where the machine's file says what switches tip control of its kinematics.

    Without `tip_control` the words are those of the machine's axes; with both rotary axes at zero that is the same.
    """
    on = state.keeps_tip
    if machine.tip_control and on is not tip_control:
        here, other = machine.tip_control if tip_control else machine.tip_control[::-1]
        before = "before any word of tip control" if on is None else f"under {other}"
        text = f"{_KINDS['angles' if tip_control else 'machine']} {before}, where {here} must be in force"
        turned = np.any(np.abs(run.second[:, : len(machine.names)]) > _ZERO, axis=1)
        yield from first_wrong(CONTROL_WORDS, turned, run.line, text)
