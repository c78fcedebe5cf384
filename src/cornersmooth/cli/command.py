"""Commands made of their names: arguments, and options of `Options`, which is what the command gets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from types import NoneType
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

import click

from cornersmooth.cli.headings import EXIT_CODES, HeadedOption
from cornersmooth.cli.options import FLAGS, Options
from cornersmooth.cli.parameters import ControlName, MachineName, Path
from cornersmooth.cli.shop import ShopCommand
from cornersmooth.cli.values import Given

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

Decorator = Callable[[Callable[[Given], int]], click.Command]


def new_command(
    name: str,
    arguments: str,
    options: str,
    *,
    epilog: str = EXIT_CODES,
    cls: type[click.Command] = ShopCommand,
    **changes: str | Mapping[str, Any],
) -> Decorator:
    """Make a command of a function of what was given.

    Parameters
    ----------
    name, arguments, options : str
        Arguments as the usage line has them, and fields of `Options` in the order of the help.
    **changes
        Helps of some options in this command, or all that is different of them there.
    """

    def decorate(function: Callable[[Given], int]) -> click.Command:
        params: list[click.Parameter] = []
        for metavar in arguments.split():
            field, more = _ARGUMENTS[metavar]
            params.append(click.Argument([field], **{"metavar": metavar, **more}))
        for field in options.split():
            change = changes.get(field, {})
            params.append(_option(field, {"help": change} if isinstance(change, str) else change))

        def called(**given: Any) -> int:
            return function(Given(**{key: value for key, value in given.items() if value is not None}))

        return cls(name, params=params, callback=called, help=function.__doc__, epilog=epilog)

    return decorate


@cache
def _types() -> dict[str, Any]:
    return get_type_hints(Options, include_extras=True)


def _option(name: str, changes: Mapping[str, Any]) -> click.Option:
    """Option of a field: its type says what it may be."""
    item = next(item for item in fields(Options) if item.name == name)
    given = dict(item.metadata) | dict(changes)
    for word in given.pop("spelled").split():
        if not word.startswith("-"):
            given["metavar"] = word
    hint: Any = _types()[name]
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
    return HeadedOption([*FLAGS[name], name], **given)
