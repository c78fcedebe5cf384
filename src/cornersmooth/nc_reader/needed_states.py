"""Rules of runs of motion blocks: what a control takes for something else in another state, or not at all.

Each rule gives problems of a run; those without a code are what was not looked at.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cornersmooth.control.state import State
from cornersmooth.control.words import BY_WORD, NURBS, Table
from cornersmooth.model import Bools, Floats
from cornersmooth.nc_reader.acts import Running
from cornersmooth.nc_reader.dialects import Dialect
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.nc_reader.execution import Modal
from cornersmooth.nc_reader.rotary import Rotary, tool_vectors

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

#: what words of each kind are, as `control.table` has tip control for them
_KINDS = {
    "vectors": "a tool vector",
    "points": "a second point on the tool axis",
    "angles": "tip and rotary words",
    "off": "words of the machine's axes",
}


@dataclass(frozen=True)
class Run:
    """A run of motion blocks as it is executed: n elements, and what holds before them."""

    table: Table
    elements: Elements  #: with rotary words as degrees
    before: Modal
    state: Running
    dialect: Dialect
    #: lines of the way down from a retract, in which rotary axes turn before the control knows the tip
    approach: frozenset[int] = frozenset()

    @property
    def rotary(self) -> Rotary:
        """Of a text with rotary words."""
        assert self.state.rotary is not None
        return self.state.rotary

    @property
    def machine(self) -> Machine:
        """Of a text with rotary words."""
        return self.rotary.machine

    @cached_property
    def angles(self) -> Floats:
        """(n + 1, 2) rotary words before the run and behind each element, NaN where not known."""
        return np.vstack((self.before.second, self.elements.second))[:, :2]

    @property
    def lines(self) -> Bools:
        """(n,) which elements are lines at feed."""
        return self.elements.kind == Element.LINE

    def first(self, code: str, wrong: Any, text: str) -> list[Problem]:
        """The first of the elements where something is wrong (n,), if there is one."""
        return Problem.at(code, wrong, self.elements.line, text, most=1)


def control_problems(run: Run) -> Iterator[Problem]:
    """Curves, and words of the axis, that the control would not take for what they are."""
    table, state, dialect = run.table, run.state, run.dialect
    if state.rotary is not None:
        kind, letters = ("angles" if state.rotary.tip_control else "off"), {*state.rotary.names}
    else:
        kind, letters = ("points", {*"UVW"}) if state.modal.points else ("vectors", {*"IJ"})
    if kind == "points":
        given = {name: ~np.isnan(table.column(name)) for name in "XYZUVW"}
        point = given["U"] & given["V"] & given["W"]
        lacks = np.logical_or.reduce(list(given.values())) & ~point
        text = "a second point without all its words: manuals do not say what holds for the others"
        yield from Problem.at("", lacks, table.line, text, most=1)
    if dialect.curves_need and state.machine.groups["smoothing"] != dialect.curves_need:
        text = f"a curve where {dialect.curves_need} must be in force"
        yield from Problem.at(CONTROL_WORDS, table.column("G") == NURBS, table.line, text, most=1)
    if dialect.asks_tip and not (holds := state.machine.tip_suits(kind)):
        line = table.line[table.rows_with(letters, run.before.code)]
        turned = [] if state.rotary is None else list(run.approach)
        if len(line := line[~np.isin(line, turned)]):
            here, need = state.tip_control or "no tool tip control", _words_for(kind, state.machine)
            text = f"{_KINDS[kind]} under {here}, where {need} must be in force"
            yield Problem("" if holds is None else CONTROL_WORDS, 0, int(line[0]), text)


def _words_for(kind: str, machine: State) -> str:
    """Words under which those of a kind are taken for what they are."""
    if kind == "off":
        return "no tool tip control"
    system = "machine" if kind == "angles" else "part"
    both = ("both",) * (kind == "angles" or "orientation" in machine.groups)
    groups = ("tip", kind, *both), ("coordinates", system), ("orientation", kind)
    words = [" or ".join(machine.table.words(*group)) for group in groups]
    return " ".join(filter(None, words)) if words[0] else "tool tip control for them"


def plane_problems(run: Run) -> Iterator[Problem]:
    """What is wrong with a run in a tilted plane."""
    plane, tip_control = run.state.plane, run.state.tip_control
    axis_words = run.state.rotary.names if run.state.rotary is not None else "IJKUVW"
    straight = ~np.isin(run.table.column("G"), (2.0, 3.0))
    if plane is None or not len(run.elements):
        return
    here, need = tip_control or "no length of the tool", plane.needs or "no tool tip control"
    line = int(run.elements.line[0])
    if not plane.turned:
        yield Problem("CS506", 0, line, "motion in a tilted plane before the tool is turned to it")
    if tip_control != plane.needs:
        text = f"motion in a tilted plane under {here}, where {need} must be in force"
        yield Problem("CS506", 0, line, text)
    if any((~np.isnan(run.table.column(name)) & straight).any() for name in axis_words):
        yield Problem("CS506", 0, line, "words of the tool axis in a tilted plane")
    if len(run.elements.curves):
        yield Problem("CS506", 0, line, "a curve in a tilted plane")


def clamp_problems(run: Run) -> Iterator[Problem]:
    """Which rotary axes turn although they are clamped, or no word says that they are not."""
    for column, axis in enumerate(run.machine.axes):
        if axis.clamp is not None and run.state.clamped[axis.name]:
            before, behind = run.angles[:-1, column], run.angles[1:, column]
            turned = (behind != before) & ~np.isnan(behind)
            yield from run.first("CS538", turned, f"{axis.name} turns without {axis.clamp[1]} before it")


def axis_problems(run: Run) -> Iterator[Problem]:
    """Rotary words beyond the limits of their axes, and words of modulo axes.

    Those are from 0 to 360 degrees, and go the shorter way by a word.
    """
    table, machine = run.table, run.state.machine
    way = machine.table.words("way", "shorter")

    def first(code: str, wrong: Bools, text: str) -> list[Problem]:
        return Problem.at(code, wrong, table.line, text, most=1)

    for axis in run.machine.axes:
        name, values = axis.name, table.column(axis.name)
        given, by_words = ~np.isnan(values), ~np.isnan(table.column(f"{BY_WORD} {axis.name}"))
        if axis.modulo:
            yield from first(
                "CS506", (values < 0.0) | (values >= 360.0), f"a word of {name} that is not from 0 to 360 degrees"
            )
        if run.dialect.by_word and axis.modulo:
            yield from first("CS506", given & ~by_words, f"{name} without {BY_WORD}(), which sends it the shorter way")
        elif run.dialect.by_word:
            yield from first("CS506", by_words, f"{name} with {BY_WORD}(), which is for modulo axes")
        elif way and axis.modulo and machine.groups["way"] != "shorter":
            yield from first("CS506", given, f"{name} without {way[0]} in force, which sends it the shorter way")
        half = run.rotary.angle_step / 2
        beyond = (values < axis.low - half) | (values > axis.high + half)
        for angle in values[beyond][:1].tolist():
            text = f"{name} goes to {angle:g} deg, its limits are {axis.low:g} and {axis.high:g}"
            yield from first("CS581", beyond, text)


def kinematics_problems(run: Run) -> Iterator[Problem]:
    """Whether X Y Z are those of the tip where nothing keeps it, or of the machine's axes where something does.

    With all rotary axes at zero that is the same.
    """
    state, dialect, machine, tip_control = run.state, run.dialect, run.machine, run.rotary.tip_control
    angles = run.angles[1:]
    if dialect.switches:
        on = None if "tip" not in state.machine.last_words else state.machine.groups["tip"] != "off"
        if machine.tip_control and on is not tip_control:
            here, other = machine.tip_control if tip_control else machine.tip_control[::-1]
            before = "before any word of tip control" if on is None else f"under {other}"
            text = f"{_KINDS['angles' if tip_control else 'off']} {before}, where {here} must be in force"
            yield from run.first(CONTROL_WORDS, (np.abs(angles) > _ZERO).any(axis=1), text)
    elif tip_control and machine.names and dialect.asks_tip and state.machine.groups["tip"] == "off":
        full = np.array([np.inf if axis.limits is not None else 360.0 for axis in machine.axes])
        off = np.abs(angles - run.rotary.zero) % full
        away = (np.minimum(off, full - off) > run.rotary.angle_step).any(axis=1)
        yield from run.first(CONTROL_WORDS, away, "no tool tip control where rotary axes are away from zero")


def turn_problems(run: Run) -> Iterator[Problem]:
    """Which rotary axes turn more than once round in one feed move."""
    for turn, axis in zip(np.abs(np.diff(run.angles, axis=0)).T, run.machine.axes, strict=True):
        far = run.lines & (turn > MOST_TURN)
        for degrees in turn[far][:1].tolist():
            yield from run.first("CS526", far, f"{axis.name} turns by {degrees:.0f} deg in one feed move")


def idle_turns(run: Run) -> Iterator[Problem]:
    """Where rotary axes turn by half a turn or more at feed while the tool axis stands along them.

    From there a quarter of a turn leads to any other axis, or half a turn where limits leave one way to reach it. More
    swings part or head around the tool, which the CL file does not ask for. How far each has turned so goes on from run
    to run.
    """
    step, axis = run.rotary.angle_step, tool_vectors(run.machine, run.angles)
    stands = run.lines & (np.abs(np.diff(axis, axis=0)).max(axis=1) <= 2.0 * math.radians(step))
    turn = np.where(stands[:, None], np.abs(np.diff(run.angles, axis=0)), 0.0)
    whole = np.cumsum(turn, axis=0) + run.state.idle
    found = whole - np.maximum.accumulate(np.where(stands[:, None], 0.0, whole), axis=0)
    run.state.idle = found[-1]
    for name, column in zip(run.machine.names, found.T, strict=False):
        yield from run.first("", column >= MOST_IDLE - step, f"{name} turns while the tool axis stands along it")


def late_turns(run: Run) -> Iterator[Problem]:
    """Motion where no word says how the rotary axes stand: behind a plane, or where it comes late.

    Before their first words they count as at zero; the first may not turn a tool that has come down.
    """
    unknown = np.isnan(run.angles[:, : len(run.machine.names)])
    if run.state.left_turned:
        text = "motion after a tilted plane, and no word says where the rotary axes are"
        yield from run.first(CONTROL_WORDS, unknown[1:].any(axis=1), text)
    down = ~np.isnan(np.vstack((run.before.tip, run.elements.tip))[:-1]).any(axis=1)
    text = "a rotary axis is sent to where it belongs after the tool has come down"
    yield from run.first("CS531", down & (unknown[:-1] & ~unknown[1:]).any(axis=1), text)


def swung_tools(run: Run) -> Iterator[Problem]:
    """Rapids that swing the tool, and arcs on which an axis turns."""
    line = run.elements.line
    if run.dialect.retracts:
        text = "rotary axes swing the tilted tool in a rapid that is not above a retract"
        yield from (Problem("CS537", 0, one, text) for one in line[run.rotary.swung(run.elements, run.before)].tolist())
    words, at = np.nan_to_num(run.angles), run.elements.arcs.element
    on_arc = at[(words[at + 1] != words[at]).any(axis=1)]
    yield from (Problem("", 0, one, "an arc on which an axis turns") for one in line[on_arc].tolist())


#: rules of runs with rotary words, by whether their words are those of the text, or taken the shorter way
AS_WRITTEN, UNWRAPPED = (axis_problems,), (turn_problems, idle_turns, late_turns, swung_tools)
