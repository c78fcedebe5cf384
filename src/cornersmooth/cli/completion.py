"""``cornersmooth completion``: what makes a shell complete words of the command line."""

from __future__ import annotations

import click

from cornersmooth.cli.options import Options
from cornersmooth.cli.powershell import ASKED, add_powershell


def run_completion(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from click.shell_completion import get_completion_class

    from cornersmooth.cli.group import cli

    add_powershell()
    kind = get_completion_class(str(given.name))
    assert kind is not None
    click.echo(kind(cli, {}, "cornersmooth", ASKED).source().rstrip())
    return 0
