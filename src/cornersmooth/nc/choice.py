"""Which form, in which mode; combinations that a control cannot run are refused with what works instead."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Machine
from cornersmooth.model import Move, Program
from cornersmooth.nc.control import ROTARY_SHARE, Control, Form, FormTable, Orientation
from cornersmooth.nc.tables import load_control
from cornersmooth.settings import Settings
from cornersmooth.smoothing.neighbours import norm


def choose_form(
    control: str | Path | Control = "fanuc",
    form: str | None = None,
    *,
    machine: Machine | None = None,
    tcp: bool = True,
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

    Raises
    ------
    SettingsError
        Unknown control or form, or a combination that the control cannot run.
    """
    table = control if isinstance(control, Control) else load_control(control)
    name = next(iter(table.forms)) if form is None else form
    if name not in table.forms:
        raise SettingsError("CS211", f"{table.name} has no form {name!r}", f"choose one of {', '.join(table.forms)}")
    chosen = table.forms[name]
    if machine is None and not tcp:
        raise SettingsError("CS215", "machine positions need a machine", "name it with --machine")
    wanted: tuple[Orientation, ...] = ("vector", "point", "fixed")
    if machine is not None:
        wanted = ("angles",) if tcp else ("machine",)
    for orientation in wanted:
        if orientation in chosen.modes:
            return Form(table, name, chosen.curve, orientation, chosen.modes[orientation], machine)
    raise _refusal(table, chosen, wanted)


def check_program(form: Form, program: Program, settings: Settings) -> None:
    """Refuse a program that the form cannot hold.

    Raises
    ------
    InputError
        The tool is not parallel to Z and the form has no words for that.
    """
    if form.orientation != "fixed":
        return
    tilt = norm(program.axis - (0.0, 0.0, 1.0))
    tilt[program.kind == Move.FROM] = 0.0
    tilted = np.flatnonzero(settings.axis_length * tilt > ROTARY_SHARE * settings.tolerance)
    if len(tilted):
        raise InputError(
            "CS368",
            f"the tool is not parallel to Z, and {form.control} form {form.name} has no words for its axis",
            "use -f g1",
            file=program.source.name,
            line=int(program.line[tilted[0]]),
        )


def _refusal(table: Control, form: FormTable, wanted: tuple[Orientation, ...]) -> SettingsError:
    here = f"{table.name} form {form.name}"
    others = [name for name, other in table.forms.items() if any(mode in other.modes for mode in wanted)]
    instead = f"use -f {others[0]}" if others else ""
    if "machine" in wanted:
        what = f"{here} cannot run without tool tip control"
        if form.curve:
            what += ": its curves are refused at inverse time feed (G93)"
        return SettingsError("CS215", what, instead or "leave out --no-tcp")
    if "angles" in wanted:
        return SettingsError("CS215", f"{here} has no rotary words", instead or "leave out --machine")
    return SettingsError(
        "CS215", f"{here} has no tool vectors, only rotary words", instead or "name your machine with --machine"
    )
