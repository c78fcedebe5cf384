"""What options stand for: control, machine, form, frame, settings, limits, and how files are read."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli.command import typed
from cornersmooth.cli.files import read_input
from cornersmooth.cli.options import LIMITS, PLANNED, Options
from cornersmooth.errors import SettingsError

if TYPE_CHECKING:
    from cornersmooth.feedrate import Limits
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Control, Form
    from cornersmooth.settings import Settings

#: arguments of `cornersmooth.read` that options give
_ARGUMENTS = "format dialect units arc_rule operation lenient tool_number spindle".split()


def control_of(given: Options) -> Control:
    """Control of that name, of that file, or of the shop settings."""
    from cornersmooth.nc import load_control

    control: str | Control = given.control
    return load_control(control) if isinstance(control, str) else control


def machine_of(machine: Any) -> Machine | None:
    """Machine of that name, of that file, or of the shop settings; None where none is named."""
    from cornersmooth.kinematics import load_machine

    return load_machine(machine) if isinstance(machine, str) and machine else machine or None


def form_of(given: Options) -> Form:
    """Form of the control that the options ask for."""
    from cornersmooth.nc import choose_form

    return choose_form(
        control_of(given),
        given.form,
        machine=machine_of(given.machine),
        tcp=not given.no_tcp,
        extras=given.extras,
        digits=given.digits,
        rewind=given.rewind or 0.0,
        planes=given.planes == "tilted",
    )


def settings_of(given: Options) -> Settings:
    """How to smooth; options that a command does not have keep their defaults."""
    from cornersmooth.settings import Settings

    check_one_of_axis(given)
    return Settings(**{item.name: getattr(given, item.name) for item in fields(Settings) if hasattr(given, item.name)})


def check_one_of_axis(given: Options) -> None:
    """Refuse a length and a tolerance of the axis in one command: the one takes the place of the other."""
    if given.axis_tolerance is not None and typed("axis_length") and typed("axis_tolerance"):
        raise click.UsageError("--axis-tolerance takes the place of -H/--axis-length: give one of them")


def limits_of(given: Options) -> Limits:
    """What the machine can do."""
    from cornersmooth.feedrate import Limits

    return Limits(**{name: getattr(given, name) for name in LIMITS.split()})


def planned_limits_of(given: Options) -> Limits | None:
    """Limits of the plan whose feeds are written; None where they are the programmed ones.

    Raises
    ------
    UsageError
        Limits without `--feed-from-plan`.
    """
    if given.feed_from_plan:
        from cornersmooth.feedrate import Limits

        return Limits(**{name: getattr(given, name) for name in PLANNED.split()})
    for name in filter(typed, PLANNED.split()):
        raise click.UsageError(f"--{name} is for --feed-from-plan")
    return None


def reading_of(given: Options) -> dict[str, Any]:
    """Keyword arguments of `cornersmooth.read`."""
    return {name: getattr(given, name) for name in _ARGUMENTS} | {"size_limit": not given.no_size_limit}


def read_source(given: Options) -> tuple[bytes, str, bool]:
    """Contents and name of the input, and whether it is an NC program; options of the other kind are refused."""
    from cornersmooth.nc_reader.recognition import first_block
    from cornersmooth.provenance import HEAD

    data, name = read_input(given.source, size_limit=not given.no_size_limit)
    program = first_block(data[:HEAD]) is not None
    _check_kind(given, program)
    return data, name, program


def _check_kind(given: Options, program: bool) -> None:
    """Refuse options for CL files where the input is an NC program, and the other way round."""
    for_files = {"feed", *_ARGUMENTS} - {"units"}
    for param in click.get_current_context().command.params:
        name = str(param.name)
        if not typed(name) or not getattr(given, name):
            continue
        if program and name in for_files:
            raise click.UsageError(f"{param.opts[-1]} is for CL files, and the input is an NC program; leave it out")
        if not program and name == "tip_control":
            raise click.UsageError("--tip-control is for NC programs, and the input is a CL file; leave it out")


def reading_back_of(given: Options) -> dict[str, Any]:
    """Keyword arguments of `cornersmooth.nc_reader.read_nc` for a program that somebody wrote.

    Raises
    ------
    SettingsError
        CS204: it is not known how the control's programs are read; or the control or the machine is unknown.
    """
    from cornersmooth.nc_reader import CONTROLS

    control = control_of(given)
    if control.dialect not in CONTROLS:
        raise SettingsError(
            "CS204", f"{control.name} is like no control that can be read", 'say like = "fanuc" or another in it'
        )
    return {"control": control.dialect, "machine": machine_of(given.machine), "tcp": not given.no_tcp}
