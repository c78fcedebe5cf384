"""A form of a control in one of its modes: everything that the writers go by, and how it is chosen.

Combinations that a control cannot run are refused with what works instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from cornersmooth.arrays import norm
from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import Machine
from cornersmooth.model import MM_PER_UNIT, Move, Program, Units
from cornersmooth.nc.control import Blocks, Control, CurveStyle, Extra, FormTable, Mode, Orientation
from cornersmooth.nc.control_tables import load_control
from cornersmooth.nc.statement_args import tool_loads
from cornersmooth.settings import METHODS, Settings
from cornersmooth.tables import closest

ROTARY_SHARE = 0.1  #: share of ε, at the axis point, that rotary axes may take between and at the written words
TIP_SHARE = 0.1  #: share of ε that the tip may leave its line where the control knows nothing of the tip
#: share of ε that verification takes off for the lines that stand for blocks of rotary words, and for its proof
LINE_SHARE = 0.005
#: share of ε that it takes off for bends where tips and axis points are compared apart: 0.0001 for each of both motions
BEND_SHARE = 2e-4


@dataclass(frozen=True)
class Form:
    """A form of a control in one of its modes: everything the writers go by."""

    table: Control
    name: str  #: as on the command line
    curve: CurveStyle
    orientation: Orientation
    mode: Mode
    machine: Machine | None = None  #: for rotary words
    extras: tuple[Extra, ...] = ()  #: functions of the control that were chosen
    upright: Mode | None = None  #: `FormTable.upright`
    #: mm; how far a cut is left along the tool where a rotary axis would pass its limit; 0 where that is an error
    rewind: float = 0.0
    plane: Mode | None = None  #: `FormTable.plane` where tilted planes are wanted

    @property
    def control(self) -> str:
        """Name of the control."""
        return self.table.name

    def in_plane(self, *, upright: bool) -> Mode:
        """How tools run in a plane: those along Z, or in a tilted one."""
        mode = self.upright if upright else self.plane
        assert mode is not None
        return mode

    @property
    def begin(self) -> Blocks:
        """Steps before the first motion of each tool."""
        return self.table.program.begin if self.mode.begin is None else self.mode.begin

    @property
    def curves(self) -> bool:
        """Whether transitions are written as curves instead of lines."""
        return bool(self.curve)

    @property
    def long_lines(self) -> bool:
        """Whether the form can be written in long lines: the tip runs straight on them whatever the axis does."""
        return not self.curve and self.orientation in ("vector", "angles")

    @property
    def rotary(self) -> bool:
        """Whether the words after the tip are angles."""
        return self.orientation in ("angles", "machine")

    @property
    def other_words(self) -> tuple[str, ...]:
        """Addresses after those of the tip; rotary ones in the order of the alphabet."""
        return tuple(sorted(self.machine.names)) if self.machine is not None and self.rotary else self.mode.words

    def tip_decimals(self, units: Units) -> int:
        """Decimals of lengths."""
        return self.table.digits.mm if units == "mm" else self.table.digits.inch

    def decimals(self, units: Units) -> tuple[int, ...]:
        """Decimals of the numbers of a motion block."""
        tip, digits = self.tip_decimals(units), self.table.digits
        other = {"vector": digits.vector, "point": tip, "angles": digits.angle, "machine": digits.angle, "fixed": 0}
        return (tip,) * 3 + (other[self.orientation],) * len(self.other_words)

    def rounding(self, units: Units) -> float:
        """Step of the written coordinates, mm."""
        return float(MM_PER_UNIT[units] * 10.0 ** -self.tip_decimals(units))

    def tip_resolution(self, units: Units, settings: Settings) -> float:
        """What is to be taken off ε at the tip, as a step of its coordinates: half of it per axis, mm."""
        apart = settings.method in METHODS and not METHODS[settings.method].one_parameter
        otherwise = BEND_SHARE if apart else 0.0
        share = {"machine": TIP_SHARE + LINE_SHARE, "angles": LINE_SHARE}.get(self.orientation, otherwise)
        return self.rounding(units) + 2.0 / math.sqrt(3.0) * share * settings.tolerance

    def axis_point_resolution(self, units: Units, settings: Settings) -> float:
        """What the orientation is worth at the axis point, as a step in mm.

        A second point at the distance H′ moves b = tip + H·dir by at most H/H′ times its own rounding, besides that of
        the tip, which is in `tip_resolution` already. Rotary words have besides what `rotary_tolerance` leaves to them.
        """
        axis_length = settings.axis_length
        if self.orientation == "point":
            return self.rounding(units) / self.stretch(axis_length)
        if self.orientation == "fixed":
            return 2.0 / math.sqrt(3.0) * ROTARY_SHARE * settings.tolerance * (axis_length / settings.axis_scale)
        if self.rotary:
            between = self.rotary_tolerance(settings.tolerance, settings.axis_scale)
            reserve = axis_length * math.radians(between + self.angle_rounding)
            return 2.0 / math.sqrt(3.0) * reserve
        in_plane = 0.0 if self.plane is None else self.plane_reserve(settings.axis_point_allowed, axis_length)
        digits = self.table.digits
        return max(axis_length * float(10.0**-digits.vector / digits.vector_length), 2.0 / math.sqrt(3.0) * in_plane)

    def plane_reserve(self, tolerance: float, axis_length: float) -> float:
        """By how much the angles of a tilted plane may be off at the axis point, mm: a step of their last digit."""
        return min(axis_length * math.radians(self.angle_rounding), ROTARY_SHARE * tolerance)

    def stretch(self, axis_length: float) -> float:
        """By how many times farther from the tip than the axis point a second point is written."""
        return max(self.table.digits.lever / axis_length, 1.0)

    def rotary_tolerance(self, tolerance: float, axis_length: float) -> float:
        """Degrees by which rotary axes may leave the given axis, rounding of the words not counted.

        `axis_length` is the distance from the tip, mm, at which the axis may be off by the tolerance.
        """
        return math.degrees(ROTARY_SHARE * tolerance / axis_length)

    @property
    def angle_rounding(self) -> float:
        """Degrees by which the rounding of both rotary words may turn the axis."""
        return float(10.0**-self.table.digits.angle)


LEAST_REWIND: Final = 1.0  #: mm along the tool that a cut is left by, at least: less is not clear of it


def choose_form(
    control: str | Path | Control = "fanuc",
    form: str | None = None,
    *,
    machine: Machine | None = None,
    tcp: bool = True,
    extras: Iterable[str] = (),
    digits: str = "",
    rewind: float = 0.0,
    planes: bool = False,
) -> Form:
    """Return the form of a control by name; the control's default where `form` is None.

    Parameters
    ----------
    control : str, Path or Control
        A name, or a TOML file.
    machine : Machine, optional
        For rotary words instead of tool vectors.
    tcp : bool
        Whether the control keeps the tool tip itself; without, the words are positions of the machine's axes.
    extras : iterable of str
        Names of functions of the control to be switched on.
    digits : str
        As `Control.with_digits` takes it; empty for those of the control's table.
    rewind : float, mm
        How far a cut is left along the tool where a rotary axis would pass its limit; 0 where that is an error.
    planes : bool
        Whether a tool that keeps a tilted axis between rapids is to run in a tilted plane of the control.

    Returns
    -------
    Form
        Control, form, machine and functions together, as `smooth`, `write` and `verify` take it.

    Raises
    ------
    SettingsError
        Unknown control or form, or a combination that the control cannot run.
    """
    table = control if isinstance(control, Control) else load_control(control)
    if digits:
        table = table.with_digits(digits)
    name = next(iter(table.forms)) if form is None else form if form in table.forms else form.lower()
    if name not in table.forms:
        close = closest(name, tuple(table.forms))
        advice = f"did you mean {close}? " if close else ""
        hint = f"{advice}choose one of {', '.join(table.forms)}"
        raise SettingsError("CS211", f"{table.name} has no form {form!r}", hint)
    chosen = table.forms[name]
    if machine is None and not tcp and "machine" in chosen.modes:
        raise SettingsError("CS215", "machine positions need a machine", "name it with --machine")
    if machine is not None and len(machine.names) < 2 and planes:
        what = f"{machine.name} has no two rotary axes, which a tilted plane asks for"
        raise SettingsError("CS232", what, "leave out --planes")
    orientation, mode = _mode(table, chosen, machine, tcp)
    chosen_extras = tuple(_extra(table, name, extra) for extra in dict.fromkeys(extras))
    if machine is not None and machine.modulo and not mode.shortest:
        what = f"{table.name} has no words by which {' and '.join(machine.modulo)} goes the shorter way"
        raise SettingsError("CS215", what, "leave out modulo in the machine file")
    plane = _plane(table, chosen, machine) if planes else None
    found = Form(table, name, chosen.curve, orientation, mode, machine, chosen_extras, chosen.upright, rewind, plane)
    if rewind:
        _check_rewind(found)
    return found


def _instead(table: Control, fits: Callable[[FormTable], bool]) -> str:
    """Say which form to use: the first that fits; empty where none does."""
    return next((f"use -f {name}" for name, form in table.forms.items() if fits(form)), "")


def _mode(table: Control, form: FormTable, machine: Machine | None, tcp: bool) -> tuple[Orientation, Mode]:
    """What says the orientation, and how; refuses what the form has not (CS215)."""
    along_z = machine is not None and not machine.names

    def modes(one: FormTable) -> Mapping[Orientation, Mode]:  # blocks without words of the tool axis are those of G1
        return {"fixed": one.upright, **one.modes} if along_z and one.upright and not one.curve else one.modes

    wanted: tuple[Orientation, ...]
    if along_z:
        wanted, lack, instead = ("fixed",), "has no blocks without words of the tool axis", "leave out --machine"
    elif not tcp:
        wanted, lack, instead = ("machine",), "cannot run without tool tip control", "leave out --no-tcp"
    elif machine is not None:
        wanted, lack, instead = ("angles",), "has no rotary words", "leave out --machine"
    else:
        wanted, lack = ("vector", "point", "fixed"), "has no tool vectors, only rotary words"
        instead = "name your machine with --machine"
    found = next((orientation for orientation in wanted if orientation in modes(form)), None)
    if found is not None:
        return found, modes(form)[found]
    hint = _instead(table, lambda one: not modes(one).keys().isdisjoint(wanted))
    if not tcp and hint and machine is None:
        hint += " and name your machine with --machine"
    elif not tcp and form.curve and not hint:
        hint = f"{_instead(table, lambda one: not one.curve)} and {instead}"
    raise SettingsError("CS215", f"{table.name} form {form.name} {lack}", hint or instead)


def _check_rewind(form: Form) -> None:
    """Refuse to leave cuts where there is nothing above which rotary axes could turn."""
    if not form.rewind >= LEAST_REWIND:
        raise SettingsError("CS202", f"rewind is {form.rewind:g} mm", f"give {LEAST_REWIND:g} mm or more")
    if not form.rotary:
        what = f"{form.control} form {form.name} has no rotary axes here that could turn back"
        raise SettingsError("CS215", what, "leave out --rewind")
    if not form.table.program.retract:
        what = f"the table of {form.control} has no retract above which rotary axes could turn back"
        raise SettingsError("CS215", what, "leave out --rewind")


def _plane(table: Control, form: FormTable, machine: Machine | None) -> Mode:
    """Mode of the tilted planes of a form; refuses a control, form or machine without such."""
    if form.plane is None:
        other = _instead(table, lambda one: one.plane is not None)
        what = f"{table.name} form {form.name}" if other else table.name
        raise SettingsError("CS232", f"{what} has no tilted planes", other or "leave out --planes")
    if not form.plane.rotations and machine is not None and machine.swings_the_tool:
        text = f"{table.name} has tilted planes for machines whose tables turn the part only; {machine.name} has a head"
        raise SettingsError("CS232", text, "leave out --planes")
    return form.plane


def _extra(table: Control, form: str, name: str) -> Extra:
    if name not in table.extras:
        known = f"choose one of {', '.join(table.extras)}" if table.extras else "leave it out"
        raise SettingsError("CS218", f"{table.name} has no function {name!r}", known)
    extra = table.extras[name]
    if extra.forms and form not in extra.forms:
        raise SettingsError("CS218", f"{name} is not for {table.name} form {form}", f"use -f {extra.forms[0]}")
    return extra


def check_program(form: Form, program: Program, settings: Settings) -> None:
    """Refuse tools that are not along Z where there are no words for their axis, and unknown lengths (CS219)."""
    if form.orientation == "fixed":
        tilt = norm(program.axis - (0.0, 0.0, 1.0))
        tilt[program.kind == Move.FROM] = 0.0
        words = f"{form.control} form {form.name} has no words for its axis"
        hint = _instead(form.table, lambda one: "vector" in one.modes) or "name your machine with --machine"
        if form.machine is not None:
            words = f"{form.machine.name} has no rotary axis"
            hint = "turn the part for an operation of its own, or use a machine that reaches it"
        tilted = np.flatnonzero(settings.axis_scale * tilt > ROTARY_SHARE * settings.tolerance)
        if len(tilted):  # by more than a rounding error at the axis point
            what, line = f"the tool is not parallel to Z, and {words}", int(program.line[tilted[0]])
            raise SettingsError("CS219", what, hint, file=program.source.name, line=line)
    if form.orientation == "machine" and form.machine is not None and form.machine.swings_the_tool:
        loads, lengths = tool_loads(program), dict(form.machine.tool_lengths)
        known = lengths.keys() or {number for _, (number, _) in loads[:1]}  # one length is that of one tool
        for statement, (number, _) in loads:
            if number not in known:
                what = f"the length of tool {number} goes into every position, and {form.machine.name} does not have it"
                hint = "write [tool_lengths] into the machine file, or let the control keep the tool tip"
                raise SettingsError("CS219", what, hint, file=program.source.name, line=statement.line)
