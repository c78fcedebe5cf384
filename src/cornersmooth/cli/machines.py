"""``cornersmooth machines``: which machines' rotary words can be written."""

from __future__ import annotations

import click


@click.command(
    "machines",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit codes: 0 done; 2 wrong usage or configuration.",
)
@click.argument("name", required=False, metavar="[NAME|FILE]")
def command(name: str | None) -> int:
    """List the machines that come with the program, or check and describe one.

    A machine is two rotary axes, each in a table or a head, by direction, point and limits; a TOML file describes your
    own.

    \b
    Examples:
      cornersmooth machines
      cornersmooth machines xyzac-trt
      cornersmooth machines mine.toml
    """
    from cornersmooth.kinematics import load_machine, machine_names

    if name:
        click.echo(load_machine(name).describe())
        return 0
    for machine in map(load_machine, machine_names()):
        click.echo(f"{machine.name}: {machine.description}")
    return 0
