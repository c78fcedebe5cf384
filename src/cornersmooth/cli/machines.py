"""``cornersmooth machines``: which machines' rotary words can be written."""

from __future__ import annotations

import click

from cornersmooth.cli import completing
from cornersmooth.cli.options import outputs


@click.command(
    "machines",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit codes: 0 done; 2 wrong usage or configuration.",
)
@click.argument("name", required=False, metavar="[NAME|FILE]", shell_complete=completing.machines)
@outputs.table
def command(name: str | None, table: bool) -> int:
    """List the machines that come with the program, or check and describe one.

    A machine is two rotary axes, each in a table or a head, by direction, point and limits; a TOML file describes your
    own, or is like one of them and says only what is different.

    \b
    Examples:
      cornersmooth machines
      cornersmooth machines xyzac-trt
      cornersmooth machines table-ac --table > mine.toml
      cornersmooth machines mine.toml
    """
    from cornersmooth.kinematics import load_machine, machine_names, machine_table

    if table:
        if name is None:
            raise click.UsageError("--table needs the name of a machine")
        click.echo(machine_table(name), nl=False)
        return 0
    if name:
        click.echo(load_machine(name).describe())
        return 0
    for machine in map(load_machine, machine_names()):
        click.echo(f"{machine.name}: {machine.description}")
    return 0
