"""``cornersmooth machines``: which machines' rotary words can be written."""

from __future__ import annotations

from dataclasses import asdict

import click

from cornersmooth.cli.command import new_command
from cornersmooth.cli.show import say_json, say_line
from cornersmooth.cli.values import Given


@new_command("machines", "[MACHINE]", "table as_json pose", cls=click.Command)
def command(given: Given) -> int:
    """List the machines that come with the program, or check and describe one.

    A machine has up to two rotary axes, each in a table or a head, with direction, point and limits. A TOML file
    describes your own. It may be like one of these and hold only what is different.

    \b
    Examples:
      cornersmooth machines
      cornersmooth machines xyzac-trt
      cornersmooth machines table-ac --table > mine.toml
      cornersmooth machines mine.toml
      cornersmooth machines mine.toml --pose A30,C45
      cornersmooth machines mine.toml --json
    """
    from cornersmooth.kinematics import load_machine, machine_names, machine_table

    name, table, pose = given.name, given.table, given.pose
    if (table or pose) and name is None:
        raise click.UsageError(f"{'--table' if table else '--pose'} needs the name of a machine")
    if table + bool(pose) + (given.as_json and table) > 1:
        raise click.UsageError(f"--table and {'--pose' if pose else '--json'} exclude each other")
    if table:
        click.echo(machine_table(str(name)), nl=False)
    elif name and pose is not None:
        from cornersmooth.kinematics.posed import Posed, parse_pose

        machine = load_machine(name)
        posed = Posed.of(machine, parse_pose(machine, pose))
        if given.as_json:
            say_json(posed.as_dict())
        else:
            click.echo(posed.describe())
    elif given.as_json:
        machines = [asdict(load_machine(one)) for one in ([name] if name else machine_names())]
        say_json({"schema": "cornersmooth-machines/1", "machines": machines})
    elif name:
        for line in load_machine(name).describe().splitlines():
            say_line(line, indent=4)
    else:
        for machine in map(load_machine, machine_names()):
            say_line(f"{machine.name}: {machine.description}")
    return 0
