"""``cornersmooth config``: the values that smooth would use for a file, and where each is from."""

from __future__ import annotations

import os
import re
from typing import Final

from cornersmooth.cli import shop
from cornersmooth.cli.commands import COMMANDS
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import say
from cornersmooth.errors import InputError

#: where a help says what holds without the option
_DEFAULT: Final = re.compile(r"\[default: ([^]]+)\]")


def run_config(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    smooth = COMMANDS["smooth"]
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
            lines.append((row[0], instead[1] if instead and value in (None, "", ()) else _shown(value), row[2]))
    widths = [max(len(line[column]) for line in lines) for column in (0, 1)]
    table = (f"{key:<{widths[0]}}  {value:<{widths[1]}}  {origin}" for key, value, origin in lines)
    say(given, {"schema": "cornersmooth-config/1", "values": values}, table)
    return 0


def _shown(value: object) -> str:
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
