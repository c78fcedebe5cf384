"""Shop settings: defaults of a project and of a user, from ``cornersmooth.toml`` and the environment.

docs/settings.md describes the file. What counts is the option, then the environment (``CORNERSMOOTH_TOLERANCE``), the
project, the user, the default. [smooth] holds for all commands that have the option, [smooth.NAME] with the control of
that name; tables of other commands may have other values.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from cornersmooth.cli.declared import FLAGS
from cornersmooth.cli.show import warn
from cornersmooth.errors import SettingsError, command_text
from cornersmooth.system.output import reason

FILE = "cornersmooth.toml"
_PREFIX = "CORNERSMOOTH_"
#: tables with options; the first holds for all commands
_COMMAND_TABLES = ("smooth", "filter", "verify", "compare", "time", "setup", "info", "surface")
#: tables of controls and machines of one's own, and the options that name them
_OWN_TABLES = {"controls": ("control",), "machines": ("machine", "limits")}

#: options that belong to one run
ONE_RUN = frozenset(
    "output directory force reports csv summary as_json law no_verify operation help_all table pose".split()
)

#: commands with a verdict, whose line says what settings loosen
_WITH_VERDICT = frozenset(("smooth", "verify", "filter"))


@dataclass(frozen=True)
class ShopFile:
    """One file of shop settings."""

    path: str
    tables: dict[str, Any]

    def options(self, command: str, control: str) -> Iterator[tuple[str, str, Any]]:
        """Table, key and value of every option that holds for a command and a control; what counts more comes later."""
        for table in dict.fromkeys((_COMMAND_TABLES[0], command)):
            entries = self.tables.get(table, {})
            for key, value in entries.items():
                if not isinstance(value, dict):
                    yield table, key, value
            for key, value in entries.get(control, {}).items():
                yield f"{table}.{control}", key, value

    def own(self, kind: str, name: str) -> dict[str, Any] | None:
        """Table of a control or machine of one's own."""
        found = self.tables.get(kind, {}).get(name)
        return found if isinstance(found, dict) else None


@dataclass
class Shop:
    """What the files say, the one that counts most first, and where each value of a run is from."""

    files: tuple[ShopFile, ...] = ()
    origins: dict[str, str] = field(default_factory=dict)


#: keys of the command line and of the shop settings in a context
_TYPED, _SHOP = f"{__name__}.typed", f"{__name__}.shop"


def parse_args(
    command: click.Command, ctx: click.Context, args: list[str], parse: Callable[[click.Context, list[str]], list[str]]
) -> list[str]:
    """Read the options, then the shop settings that go with the input, which give what nobody has typed."""
    ctx.meta[_TYPED] = command_text(["cornersmooth", str(command.name), *args])
    if not settable(command) or ctx.resilient_parsing:  # a shell wants to complete what is not whole yet
        return parse(ctx, args)
    _check_environment(command)
    rest = parse(ctx, args)
    _set_defaults(command, ctx)
    for file in ctx.meta[_SHOP].files:
        _name_strangers(file.path)
    for param in command.params:
        if param.required and ctx.params[str(param.name)] is None:
            raise click.MissingParameter(ctx=ctx, param=param)
    if command.name not in _WITH_VERDICT and (loose := loosened(ctx.params.get("tolerance"))):
        warn(loose)
    return rest


def _set_defaults(command: click.Command, ctx: click.Context) -> None:
    """Put what the files have in the place of defaults (SettingsError CS240 to CS242)."""
    first = next((ctx.params.get(str(one.name)) for one in command.params if isinstance(one, click.Argument)), None)
    first = first[0] if isinstance(first, tuple) and first else first
    shop = Shop(find_files(first if isinstance(first, str) and first != "-" else "."))
    ctx.meta[_SHOP] = shop
    by_default = ctx.get_parameter_source("control") is click.core.ParameterSource.DEFAULT
    for name, value in _values(command, shop, None if by_default else ctx.params.get("control")).items():
        if ctx.get_parameter_source(name) is click.core.ParameterSource.DEFAULT:
            ctx.params[name] = value
            ctx.set_parameter_source(name, click.core.ParameterSource.DEFAULT_MAP)
    for kind, options in _OWN_TABLES.items():
        for name in options:
            if isinstance(ctx.params.get(name), str):
                ctx.params[name] = _own(shop, kind, ctx.params[name])


def _name_strangers(path: str) -> None:
    """Say of settings that somebody else may have written that they are obeyed."""
    if not hasattr(os, "getuid"):
        return
    found = os.stat(path)
    if found.st_uid not in (os.getuid(), 0):
        warn("these settings are obeyed, and belong to another user", path)
    elif found.st_mode & stat.S_IWOTH:
        warn("these settings are obeyed, and anybody may change them", path)


def command_line() -> str:
    """Command line of this run, as a shell reads it."""
    return str(click.get_current_context().meta[_TYPED])


def loosened(tolerance: float | None) -> str:
    """Say where a tolerance is from that is larger than the default, and was not typed; empty for any other."""
    ctx = click.get_current_context()
    if tolerance is None or (where := origin(ctx, "tolerance")) in ("command line", "default"):
        return ""
    from cornersmooth.settings import Settings

    least = Settings.tolerance
    if tolerance <= least:
        return ""
    return f"the tolerance {tolerance:g} mm is larger than the default {least:g} mm: {where}"


def origin(ctx: click.Context, name: str) -> str:
    """Where the value of an option is from, in words."""
    source = ctx.get_parameter_source(name)
    if source == click.core.ParameterSource.COMMANDLINE:
        return "command line"
    if source == click.core.ParameterSource.ENVIRONMENT:
        return variable(name)
    if source == click.core.ParameterSource.DEFAULT_MAP:
        return str(ctx.meta[_SHOP].origins[name])
    return "default"


def find_files(first: str) -> tuple[ShopFile, ...]:
    """Shop settings of the project that a file or folder belongs to, and of the user.

    Raises SettingsError CS240: a file cannot be read or is not TOML. CS241: an unknown table.
    """
    here = Path(os.path.abspath(first))
    folders = [here, *here.parents] if os.path.isdir(here) else list(here.parents)
    project = next((folder / FILE for folder in folders if os.path.isfile(folder / FILE)), None)
    user = _config_folder(os.name) / "cornersmooth" / FILE
    return tuple(_read(path) for path in (project, user) if path is not None and os.path.isfile(path))


def _config_folder(system: str) -> Path:
    """Folder of a user's settings on the system of that name, ``nt`` for Windows."""
    variable, usual = ("APPDATA", "~/AppData/Roaming") if system == "nt" else ("XDG_CONFIG_HOME", "~/.config")
    return Path(os.environ.get(variable) or os.path.expanduser(usual))


def _values(command: click.Command, shop: Shop, control: str | None) -> dict[str, Any]:
    """Values of options by name, as the files have them; None for the control that these name."""
    if not shop.files:
        return {}
    if control is None:
        named = (
            file.tables.get(table, {}).get("control") for file in shop.files for table in (str(command.name), "smooth")
        )
        control = next((name for name in named if isinstance(name, str)), "fanuc")
    if not any(file.own("controls", control) for file in shop.files):
        from cornersmooth.nc import find_control

        control = find_control(control) or control
    options = {key(str(option.name)): option for option in settable(command)}
    values: dict[str, Any] = {}
    for file in reversed(shop.files):
        for table, word, value in file.options(command.name or "", control):
            option = options.get(word.replace("_", "-"))
            if option is not None:
                name = str(option.name)
                values[name] = _checked(option, value, file.path, f"{table}.{word}")
                shop.origins[name] = f"{file.path} [{table}]"
            elif word.replace("_", "-") not in (known := sorted(key(name) for name in FLAGS if name not in ONE_RUN)):
                raise _unknown(file.path, f"{table}.{word}", word, known)
    return values


def settable(command: click.Command) -> list[click.Option]:
    """Options of a command that shop settings may set: not those that belong to one run."""
    return [param for param in command.params if isinstance(param, click.Option) and param.name not in ONE_RUN]


def key(name: str) -> str:
    """Name of an option in a file: its long one; underscores will do for the hyphens."""
    return FLAGS[name][-1].removeprefix("--")


def variable(name: str) -> str:
    """Name of an option in the environment."""
    return _PREFIX + key(name).replace("-", "_").upper()


def _checked(option: click.Option, value: Any, file: str, where: str) -> Any:
    """Value as the option takes it (SettingsError CS242)."""
    strings = isinstance(value, list) and all(isinstance(item, str) for item in value)
    if option.is_flag:
        fits, hint = isinstance(value, bool), "give true or false"
    elif option.multiple:
        fits, hint = strings, "give a list of strings"
    else:
        value = ",".join(map(str, value)) if isinstance(value, list) else value
        fits, hint = isinstance(value, (str, int, float)) and not isinstance(value, bool), "give a number or a string"
    if not fits:
        raise SettingsError("CS242", f"{where} is {value!r}", hint, file=file)
    if option.is_flag or option.multiple:
        return tuple(value) if option.multiple else value
    try:
        return option.type.convert(value if isinstance(value, float) else str(value), option, None)
    except click.BadParameter as wrong:
        raise SettingsError("CS242", f"{where}: {wrong.message}", "correct the file", file=file) from None


def _read(path: Path) -> ShopFile:
    import tomllib

    from cornersmooth.tables import read_toml

    try:
        tables = read_toml(path.read_text(encoding="utf-8-sig"))  # some editors put a mark before it
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as wrong:
        why = reason(wrong) if isinstance(wrong, OSError) else wrong
        raise SettingsError("CS240", f"cannot read it: {why}", "correct the file", file=str(path)) from wrong
    known = (*_COMMAND_TABLES, *_OWN_TABLES)
    for name, table in tables.items():
        if name not in known:
            raise _unknown(str(path), name, name, known)
        if not isinstance(table, dict):
            raise SettingsError("CS242", f"{name} is {table!r}", f"write a table [{name}]", file=str(path))
    return ShopFile(str(path), tables)


def _unknown(file: str, where: str, name: str, known: Iterable[str]) -> SettingsError:
    from cornersmooth.tables import closest

    close = closest(name, [*known])
    hint = f"did you mean {close}?" if close else f"known are {', '.join(known)}"
    return SettingsError("CS241", f"unknown key {where}", hint, file=file)


def _check_environment(command: click.Command) -> None:
    """Refuse names in the environment that are nearly those of an option."""
    known = {variable(str(option.name)) for option in settable(command)}
    strange = [name for name in os.environ if name.startswith(_PREFIX) and name not in known]
    if not strange:
        return
    from difflib import get_close_matches

    words = [variable(name).removeprefix(_PREFIX) for name in FLAGS if name not in ONE_RUN]
    for name in strange:
        close = get_close_matches(name.removeprefix(_PREFIX), words, n=1, cutoff=0.75)
        if close and close[0] != name.removeprefix(_PREFIX):
            raise SettingsError("CS241", f"unknown {name} in the environment", f"did you mean {_PREFIX}{close[0]}?")


def _own(shop: Shop, kind: str, name: str) -> Any:
    """Control or machine that the files describe; the name where they do not."""
    file = next((file for file in shop.files if file.own(kind, name) is not None), None)
    if file is None:
        return name
    from cornersmooth.kinematics import parse_machine
    from cornersmooth.nc import parse_control

    parse: Callable[..., Any] = parse_control if kind == "controls" else parse_machine
    return parse(file.own(kind, name), file=f"{file.path} [{kind}.{name}]", name=name)
