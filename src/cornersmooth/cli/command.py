"""Commands made of their names: arguments, and options of `Options`, which is what the command gets.

Their helps have the options under headings, those of every day first; shop settings give them defaults.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cached_property
from importlib import import_module
from types import NoneType
from typing import Any, Final, Literal, get_args, get_origin

import click

from cornersmooth.cli import shop
from cornersmooth.cli.declared import FLAGS, HEADINGS, Declared
from cornersmooth.cli.options import Options
from cornersmooth.cli.parameters import ControlName, MachineName, Path

#: epilogs of commands that read no input, of those that do, and of those that write programs, too
EXIT_CODES: Final = "Exit codes: 0 done; 2 wrong usage or configuration; 4 output cannot be written."
EXIT_CODES_OF_READERS: Final = EXIT_CODES.replace("; 4", "; 3 input cannot be read or is not valid; 4")
EXIT_CODES_OF_WRITERS: Final = EXIT_CODES_OF_READERS.replace(
    "0 done;", "0 done; 1 the program FAILED, or is not PASSED under --strict;"
)
#: fields of all options; the type of each says what it may be
_FIELDS: Final = {item.name: item for item in fields(Declared)}

#: options of a command whose short help has all of them
_SHORT: Final = 16
#: key of a context whose help has all of them
_ALL: Final = f"{__name__}.all"

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
}


class Command(click.Command):
    """A command whose help has its options under headings: those of every day, or all of them.

    Arguments and options are made when they are asked for: a run needs those of one command.
    """

    def __init__(self, name: str, make: Callable[[], list[click.Parameter]], **given: Any) -> None:
        super().__init__(name, **given)
        self._make = make
        del self.params

    @cached_property
    def params(self) -> list[click.Parameter]:  # type: ignore[override]
        """Arguments and options."""
        return self._make()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the shop settings that go with the input, then the options."""
        try:
            return shop.parse_args(self, ctx, args, super().parse_args)
        except click.NoSuchOption as wrong:
            for param in self.params:
                if isinstance(param, _Setting) and wrong.option_name in param.opts:
                    key = shop.key(str(param.name))
                    ctx.fail(f"{wrong.option_name} is no option; write {key} into cornersmooth.toml (docs/settings.md)")
            raise

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of each heading."""
        parts: dict[str, list[tuple[str, str]]] = {heading: [] for heading in HEADINGS}
        few = _HELP_ALL in self.params and not ctx.meta.get(_ALL)
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (record := param.get_help_record(ctx)) is not None:
                heading = getattr(param, "heading", "Everyday" if few else "Output")
                parts[heading].append((record[0].ljust(_NAMES), record[1]))
        for heading, rows in parts.items():
            if rows and not (few and heading != "Everyday"):
                write_part(formatter, heading, rows)


def _show_all(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    """Print the help with all options, and leave."""
    if value and not ctx.resilient_parsing:
        ctx.meta[_ALL] = True
        click.echo(ctx.get_help())
        ctx.exit()


#: of commands with more options than a short help has
_HELP_ALL: Final = click.Option(
    ["--help-all"], is_flag=True, is_eager=True, expose_value=False, help="Show all options.", callback=_show_all
)


class _Option(click.Option):
    """An option with a heading."""

    def __init__(self, *args: Any, heading: str, **given: Any) -> None:
        super().__init__(*args, **given)
        self.heading = heading

    def value_is_missing(self, value: Any) -> bool:
        """Never: the shop settings may have it, which are read behind the command line."""
        return False


class _Setting(_Option):
    """What no command line has: only ``cornersmooth.toml`` and the environment give it."""

    def get_help_record(self, ctx: click.Context) -> None:
        """Nothing: docs/settings.md has it."""

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        """Nothing: it is not spelled."""


def write_part(formatter: click.HelpFormatter, heading: str, rows: list[tuple[str, str]]) -> None:
    """Write names and their helps below a heading."""
    with formatter.section(heading):
        formatter.write_dl(rows, col_max=_NAMES)


def new_command(
    name: str,
    arguments: str,
    options: str,
    help: str,
    *,
    settings: str = "",
    epilog: str = "",
    module: str = "",
    **changes: str | Mapping[str, Any],
) -> click.Command:
    """Make a command, whose work is `run_NAME` in a module of the name or another.

    Arguments are as the usage line has them, and options fields of `Options` in the order of the help; settings are
    fields that no command line has, that of large files with all commands that read CL files. Changes are the helps of
    some options in this command, or all that is different of them there.
    """
    reads_cl = "dialect" in options.split()
    settings += " no_size_limit" * reads_cl
    epilog = epilog or (EXIT_CODES_OF_READERS if reads_cl else EXIT_CODES)

    def params() -> list[click.Parameter]:
        made: list[click.Parameter] = []
        for metavar in arguments.split():
            field, more = _ARGUMENTS[metavar]
            made.append(click.Argument([field], **{"metavar": metavar, **more}))
        for kind, names in ((_Option, options), (_Setting, settings)):
            for field in dict.fromkeys(names.split()):
                change = changes.get(field, {})
                made.append(_option(kind, field, {"help": change} if isinstance(change, str) else change))
        return made + [_HELP_ALL] * (sum(isinstance(param, _Option) for param in made) > _SHORT)

    def called(**given: Any) -> int:
        run = getattr(import_module(f"cornersmooth.cli.{module or name}"), f"run_{name}")
        if (ending := click.get_current_context().obj) is not None:  # of a process of its own
            ending.loaded()
        return int(run(Options(**{key: value for key, value in given.items() if value is not None})))

    return Command(name, params, callback=called, help=help, epilog=epilog)


def _option(kind: type[_Option], name: str, changes: Mapping[str, Any]) -> click.Option:
    """Option of a field: its type says what it may be."""
    item = _FIELDS[name]
    given = dict(item.metadata) | dict(changes)
    for word in given.pop("spelled").split():
        if not word.startswith("-"):
            given["metavar"] = word
    hint: Any = item.type
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
    return kind([*FLAGS[name], name], **given)
