"""``cornersmooth config``: every default that holds here, and where it comes from."""

from __future__ import annotations

import os
import re
from typing import Final

import click

from cornersmooth.cli import shop
from cornersmooth.cli.command import new_command
from cornersmooth.cli.show import say_json, say_line
from cornersmooth.cli.values import Given
from cornersmooth.errors import InputError

#: where a help says what holds without the option
_DEFAULT: Final = re.compile(r"\[default: ([^]]+)\]")


@new_command("config", "[IN]", "as_json", cls=click.Command)
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
    with smooth.make_context("smooth", [source]) as context:
        rows, told = [], []
        for option in shop.settable(smooth):
            value = context.params[str(option.name)]
            value = getattr(value, "name", value)  # a control or machine of one's own
            rows.append((shop.keys(option)[0], value, shop.origin(context, str(option.name))))
            instead = _DEFAULT.search(option.help or "")
            told.append(instead[1] if instead and value in (None, "", ()) else _told(value))
    if given.as_json:
        values = [dict(zip(("key", "value", "from"), row, strict=True)) for row in rows]
        say_json({"schema": "cornersmooth-config/1", "values": values})
        return 0
    lines = [(key, value, origin) for (key, _, origin), value in zip(rows, told, strict=True)]
    widths = [max(len(line[column]) for line in lines) for column in (0, 1)]
    for key, value, origin in lines:
        say_line(f"{key:<{widths[0]}}  {value:<{widths[1]}}  {origin}")
    return 0


def _told(value: object) -> str:
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
