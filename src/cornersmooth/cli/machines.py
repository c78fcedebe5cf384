"""``cornersmooth machines``: which machines' rotary words can be written."""

from __future__ import annotations

from dataclasses import asdict

import click

from cornersmooth.cli import completing
from cornersmooth.cli.headings import EXIT_CODES
from cornersmooth.cli.options import outputs
from cornersmooth.cli.show import say_json, say_line


@click.command("machines", epilog=EXIT_CODES)
@click.argument("name", required=False, metavar="[NAME|FILE]", shell_complete=completing.machines)
@outputs.table
@outputs.as_json
@click.option(
    "--pose",
    metavar="A..,C..",
    help="Say which way the tool points at these rotary angles, and where the linear axes stand: A30,C45, with the tip "
    "on the part A30,C45,X10,Y0,Z5, or bare angles in alphabetical order.",
)
def command(name: str | None, table: bool, as_json: bool, pose: str | None) -> int:
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

    if (table or pose) and name is None:
        raise click.UsageError(f"{'--table' if table else '--pose'} needs the name of a machine")
    if table + bool(pose) + (as_json and table) > 1:
        raise click.UsageError(f"--table and {'--pose' if pose else '--json'} exclude each other")
    if table:
        click.echo(machine_table(str(name)), nl=False)
    elif name and pose is not None:
        from cornersmooth.kinematics.posed import Posed, parse_pose

        machine = load_machine(name)
        posed = Posed.of(machine, parse_pose(machine, pose))
        if as_json:
            say_json(posed.as_dict())
        else:
            click.echo(posed.describe())
    elif as_json:
        machines = [asdict(load_machine(one)) for one in ([name] if name else machine_names())]
        say_json({"schema": "cornersmooth-machines/1", "machines": machines})
    elif name:
        for line in load_machine(name).describe().splitlines():
            say_line(line, indent=4)
    else:
        for machine in map(load_machine, machine_names()):
            say_line(f"{machine.name}: {machine.description}")
    return 0
