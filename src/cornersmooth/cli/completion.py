"""``cornersmooth completion``: what makes a shell complete commands, options, controls, machines, forms and files."""

from __future__ import annotations

import click

from cornersmooth.cli.command import new_command
from cornersmooth.cli.values import Given


@new_command("completion", "SHELL", "", cls=click.Command)
def command(given: Given) -> int:
    """Print what makes SHELL complete commands, options, names of controls, machines and forms, and files.

    \b
    Examples:
      eval "$(cornersmooth completion bash)"    # in ~/.bashrc
      eval "$(cornersmooth completion zsh)"     # in ~/.zshrc, behind compinit
      cornersmooth completion fish | source     # in ~/.config/fish/config.fish
    """
    from click.shell_completion import BashComplete, FishComplete, ZshComplete

    from cornersmooth.cli.group import cli

    kinds = {"bash": BashComplete, "zsh": ZshComplete, "fish": FishComplete}
    source = kinds[str(given.name)](cli, {}, "cornersmooth", "_CORNERSMOOTH_COMPLETE").source()
    click.echo(source.rstrip())
    return 0
