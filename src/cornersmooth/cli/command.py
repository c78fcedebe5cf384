"""Commands made of their names: arguments, and options of `Options`, which is what the command gets.

Their helps have the options under headings, those of every day first; shop settings give them defaults.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import fields
from importlib import import_module
from types import NoneType
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

import click

from cornersmooth.cli import shop
from cornersmooth.cli.options import FLAGS, HEADINGS, Options
from cornersmooth.cli.parameters import ControlName, MachineName, Path

#: epilogs of commands that read no input, of those that do, and of those that write programs, too
EXIT_CODES: Final = "Exit codes: 0 done; 2 wrong usage or configuration; 4 output cannot be written."
EXIT_CODES_OF_READERS: Final = EXIT_CODES.replace("; 4", "; 3 input cannot be read or is not valid; 4")
EXIT_CODES_OF_WRITERS: Final = EXIT_CODES_OF_READERS.replace(
    "0 done;", "0 done; 1 the program FAILED, or is not PASSED under --strict;"
)
#: what options may be
_TYPES: Final = get_type_hints(Options, include_extras=True)

#: room for the names of options
_NAMES: Final = 26

#: arguments as the usage line has them, and their fields
_ARGUMENTS: Final[dict[str, tuple[str, dict[str, Any]]]] = {
    "IN": ("source", {"type": get_args(Path)[1]}),
    "[IN]": ("source", {"type": get_args(Path)[1], "default": "."}),
    "IN...": ("inputs", {"type": get_args(Path)[1], "nargs": -1, "required": True}),
    "NC": ("text", {"type": get_args(Path)[1]}),
    "[CONTROL]": ("name", {"type": get_args(ControlName)[1], "required": False, "metavar": "[NAME|FILE]"}),
    "[MACHINE]": ("name", {"type": get_args(MachineName)[1], "required": False, "metavar": "[NAME|FILE]"}),
    "[CODE]": ("name", {"required": False}),
    "SHELL": ("name", {"type": click.Choice(["bash", "zsh", "fish"]), "metavar": None}),
}


class Command(click.Command):
    """A command whose help has its options under headings."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the shop settings that go with the input, then the options."""
        return shop.parse_args(self, ctx, args, super().parse_args)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of each heading."""
        parts: dict[str, list[tuple[str, str]]] = {heading: [] for heading in HEADINGS}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (record := param.get_help_record(ctx)) is not None:
                parts[getattr(param, "heading", "Output")].append((record[0].ljust(_NAMES), record[1]))
        for heading, rows in parts.items():
            if rows:
                write_part(formatter, heading, rows)


class _Option(click.Option):
    """An option with a heading."""

    def __init__(self, *args: Any, heading: str, **given: Any) -> None:
        super().__init__(*args, **given)
        self.heading = heading


def write_part(formatter: click.HelpFormatter, heading: str, rows: list[tuple[str, str]]) -> None:
    """Write names and their helps below a heading; a terminal shows both in colour."""
    with formatter.section(_styled(heading, bold=True)):
        formatter.write_dl([(_styled(name, fg="cyan"), text) for name, text in rows], col_max=_NAMES)


def _styled(text: str, **style: Any) -> str:
    coloured = sys.stdout is not None and sys.stdout.isatty() and "NO_COLOR" not in os.environ
    return click.style(text, **style) if coloured and os.environ.get("TERM") != "dumb" else text


def new_command(
    name: str,
    arguments: str,
    options: str,
    help: str,
    *,
    epilog: str = EXIT_CODES,
    module: str = "",
    **changes: str | Mapping[str, Any],
) -> click.Command:
    """Make a command, whose work is `run_NAME` in the module of its name, or in another.

    Arguments are as the usage line has them, and options fields of `Options` in the order of the help. Changes are the
    helps of some options in this command, or all that is different of them there.
    """
    params: list[click.Parameter] = []
    for metavar in arguments.split():
        field, more = _ARGUMENTS[metavar]
        params.append(click.Argument([field], **{"metavar": metavar, **more}))
    for field in dict.fromkeys(options.split()):
        change = changes.get(field, {})
        params.append(_option(field, {"help": change} if isinstance(change, str) else change))

    def called(**given: Any) -> int:
        run = getattr(import_module(f"cornersmooth.cli.{module or name}"), f"run_{name}")
        return int(run(Options(**{key: value for key, value in given.items() if value is not None})))

    return Command(name, params=params, callback=called, help=help, epilog=epilog)


def _option(name: str, changes: Mapping[str, Any]) -> click.Option:
    """Option of a field: its type says what it may be."""
    item = next(item for item in fields(Options) if item.name == name)
    given = dict(item.metadata) | dict(changes)
    for word in given.pop("spelled").split():
        if not word.startswith("-"):
            given["metavar"] = word
    hint: Any = _TYPES[name]
    if NoneType in get_args(hint):
        hint = get_args(hint)[0]
    if get_origin(hint) is tuple:
        given["multiple"], hint = True, get_args(hint)[0]
    if hint is bool:
        given["is_flag"] = True
    elif not given.get("count"):
        choice = get_origin(hint) is Literal
        given["type"] = click.Choice(get_args(hint)) if choice else next(iter(get_args(hint)[1:]), hint)
    if item.default not in (None, False, (), "") and not given.get("count"):
        given |= {"default": item.default, "show_default": "[default" not in given["help"]}
    if name not in shop.ONE_RUN:
        given["envvar"] = shop.variable(name)
    return _Option([*FLAGS[name], name], **given)
