"""What commands beside ``filter`` do with finished NC programs: say what they hold, and how long they take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli.files import read_input, told_of
from cornersmooth.cli.show import more, print_line, print_message, say
from cornersmooth.cli.values import Given

if TYPE_CHECKING:
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Form
    from cornersmooth.nc_reader import Problem

#: problems shown
_WRONG_SHOWN = 20


def filter_form_of(given: Given) -> Form:
    """Form of the control that blocks are read and written in.

    Raises SettingsError CS240: a control whose programs are not read as a filter.
    """
    from cornersmooth.errors import SettingsError
    from cornersmooth.filter.vocabulary import VOCABULARIES

    control = given.load_control()
    if control.dialect not in VOCABULARIES:
        known = ", ".join(sorted(VOCABULARIES))
        raise SettingsError("CS240", f"programs for {control.name} are not read as a filter", f"use one of {known}")
    return given.choose_form()


def how_read(given: Given) -> dict[str, Any]:
    """What is to be known of a program that it does not say."""
    return {"tip_from_start": given.tip_control, "inch": given.units == "inch"}


def axes_of(given: Given) -> Machine:
    """Machine under whose limits a program is planned."""
    from cornersmooth.comparing import limits_machine

    axes = limits_machine(given.load_limits(), given.load_machine())
    if axes is None:
        raise click.UsageError("programs are planned within limits of axes: name a machine with [dynamics]: --limits")
    return axes


def time_of_program(data: bytes, name: str, given: Given) -> int:
    """Say the time of a program as it is and smoothed, or beside another one; return the exit code of ``time``."""
    from cornersmooth.filter import filter_program, verify_programs
    from cornersmooth.filter.program import read_program
    from cornersmooth.filter.times import time_as_it_is
    from cornersmooth.verify import useful_processes

    form, settings, axes = filter_form_of(given), given.settings(), axes_of(given)
    how = {**how_read(given), "axes": axes, "processes": useful_processes()}
    with told_of(name):
        if given.text:
            found = verify_programs(data, read_input(given.text)[0], form, settings, **how)
        else:
            found = filter_program(data, form, settings, verify=False, **how)
        if found.seconds is None and not (found.checked and found.checked.wrong):  # nothing differs
            alone = time_as_it_is(*read_program(data, form, settings, **how_read(given)), axes)
            found = replace(found, seconds=(alone, alone))
    if found.checked is not None and found.checked.wrong:
        show_wrong(given.text, found.checked.wrong)
        return 1
    assert found.seconds is not None
    before, after = found.seconds
    whole = bool(form.table.lines.planner)
    contents = {
        "schema": "cornersmooth-time/1",
        "seconds": {"unsmoothed": before, "as_written": after},
        "unsmoothed": "the program as it is",
        "counted": "program" if whole else "smoothed runs",
        "cuts": found.cuts,
        "smoothed": found.smoothed,
    }
    share = f" ({100.0 * (after / before - 1.0):+.1f} %)" if before else ""
    what = "the whole program" if whole else "the runs that differ, without rapids"
    lines = (
        f"{before:>12.3f} s  {name} as it is",
        f"{after:>12.3f} s  {given.text or 'smoothed'}{share}",
        f"of {what}; {found.smoothed:,} of {found.cuts:,} cuts differ",
    )
    say(given, contents, lines)
    return 0


def describe_program(data: bytes, name: str) -> dict[str, Any]:
    """Say what an NC program holds, as far as words tell that need no machine."""
    from cornersmooth.filter.runs import ProgramReader
    from cornersmooth.filter.vocabulary import VOCABULARIES
    from cornersmooth.nc_reader.recognition import recognise_control
    from cornersmooth.provenance import HEAD

    control = recognise_control(data[:HEAD])
    reading = ProgramReader(control if control in VOCABULARIES else "fanuc", None).read(data)
    return {
        "schema": "cornersmooth-info/2",
        "name": name,
        "format": "nc",
        "looks_like": control or None,
        "lines": len(reading.why),
        "cuts": reading.cuts,
    }


def show_wrong(name: str, wrong: Sequence[Problem]) -> None:
    """Print the first problems of a program, and how many more there are."""
    for one in wrong[:_WRONG_SHOWN]:
        print_message(one.message(f"{name}:{one.nc_line}"))
    if len(wrong) > _WRONG_SHOWN:
        print_line(f"{name}: {more(len(wrong) - _WRONG_SHOWN, 'problem')}")
