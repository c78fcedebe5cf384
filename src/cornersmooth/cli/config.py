"""``cornersmooth config`` and ``completion``: every default that holds here; what makes a shell complete words."""

from __future__ import annotations

import os
import re
from typing import Final

import click

from cornersmooth.cli import shop
from cornersmooth.cli.command import new_command
from cornersmooth.cli.show import say
from cornersmooth.cli.values import Given
from cornersmooth.errors import InputError

#: where a help says what holds without the option
_DEFAULT: Final = re.compile(r"\[default: ([^]]+)\]")


@new_command("config", "[IN]", "as_json")
def command(given: Given) -> int:
    """Say which values 'cornersmooth smooth' would use for the file or folder IN, and where each comes from.

    Options come first, then the environment (CORNERSMOOTH_TOLERANCE), the file cornersmooth.toml in the folder of the
    input or above it, ~/.config/cornersmooth/cornersmooth.toml, and the defaults.

    \b
    Examples:
      cornersmooth config
      cornersmooth config jobs/part.cls
    """
    from cornersmooth.cli.smooth import command as smooth

    source = given.source
    if not os.path.exists(source):
        raise InputError("CS100", "cannot read it: no such file or directory", "check the path", file=source)
    values, lines = [], []
    with smooth.make_context("smooth", [source]) as context:
        for option in shop.settable(smooth):
            name = str(option.name)
            value = getattr(context.params[name], "name", context.params[name])  # a control or machine of one's own
            row = (shop.key(name), value, shop.origin(context, name))
            values.append(dict(zip(("key", "value", "from"), row, strict=True)))
            instead = _DEFAULT.search(option.help or "")
            lines.append((row[0], instead[1] if instead and value in (None, "", ()) else _told(value), row[2]))
    widths = [max(len(line[column]) for line in lines) for column in (0, 1)]
    table = (f"{key:<{widths[0]}}  {value:<{widths[1]}}  {origin}" for key, value, origin in lines)
    say(given, {"schema": "cornersmooth-config/1", "values": values}, table)
    return 0


def _told(value: object) -> str:
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


@new_command("completion", "SHELL", "")
def completion(given: Given) -> int:
    """Print what makes SHELL complete commands, options, names of controls, machines and forms, and files.

    \b
    Examples:
      eval "$(cornersmooth completion bash)"    # in ~/.bashrc
      eval "$(cornersmooth completion zsh)"     # in ~/.zshrc, behind compinit
      cornersmooth completion fish | source     # in ~/.config/fish/config.fish
    """
    from click.shell_completion import get_completion_class

    from cornersmooth.cli.group import cli

    kind = get_completion_class(str(given.name))
    assert kind is not None
    click.echo(kind(cli, {}, "cornersmooth", "_CORNERSMOOTH_COMPLETE").source().rstrip())
    return 0
