"""``cornersmooth machines``: the machines, and where the tool is at some rotary angles."""

from __future__ import annotations

from dataclasses import asdict

import click

from cornersmooth.cli.controls import check_table
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import say, say_json


def run_machines(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from cornersmooth.kinematics import load_machine, machine_names, machine_table
    from cornersmooth.kinematics.posed import Posed, parse_pose

    name = given.name
    if given.table:
        check_table(given, "machine")
        click.echo(machine_table(str(name)), nl=False)
    elif given.pose and name is None:
        raise click.UsageError("--pose needs the name of a machine")
    elif given.pose and name:
        machine = load_machine(name)
        posed = Posed.of(machine, parse_pose(machine, given.pose))
        if given.as_json:
            say_json(posed.as_dict())
        else:
            click.echo(posed.describe())
    else:
        found = [load_machine(one) for one in ([name] if name else machine_names())]
        lines = found[0].describe().splitlines() if name else [f"{one.name}: {one.description}" for one in found]
        say(given, {"schema": "cornersmooth-machines/1", "machines": [*map(asdict, found)]}, lines, indent=4)
    return 0
