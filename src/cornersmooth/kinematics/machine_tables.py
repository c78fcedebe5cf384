"""Machines as TOML text: those that come with the program, and the user's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics.dynamics import LINEAR, Dynamics, Travel
from cornersmooth.kinematics.machine import Machine, RotaryAxis
from cornersmooth.tables import Shelf, Table

_SHELF = Shelf(
    "machine",
    __package__,
    "machines",
    keys=(
        "name",
        "description",
        "preferred",
        "tool_direction",
        "tool_length",
        "tool_lengths",
        "part_zero",
        "travel",
        "home",
        "tool_change",
        "tip_control",
        "axis",
        "dynamics",
    ),
    unknown="CS250",
    unreadable="CS251",
    unknown_key="CS252",
    wrong_value="CS253",
)
_AXIS_KEYS = ("name", "direction", "carrier", "point", "positive", "limits", "modulo", "clamp")
_DYNAMICS_KEYS = ("velocity", "acceleration", "jerk")


def machine_names() -> tuple[str, ...]:
    """Names of the machines that come with the program, sorted."""
    return _SHELF.names()


def load_machine(name_or_path: str | Path) -> Machine:
    """Machine of that name, or described by that TOML file.

    A text that ends in ``.toml`` or holds a path separator is a file; anything else is a name.

    Raises
    ------
    SettingsError
        The name is unknown (with the closest known one), the file cannot be read, or it does not describe a machine.
    """
    text, file, name = _SHELF.choose(name_or_path)
    return parse_machine(text, file=file, name=name)


def machine_table(name: str) -> str:
    """Text of the table of a machine that comes with the program, every key with a comment.

    Raises
    ------
    SettingsError
        The name is unknown.
    """
    return _SHELF.built_in(name)


def parse_machine(text: str | Table, *, file: str = "<machine>", name: str = "machine") -> Machine:
    """Machine that a TOML text, or a table read from one, describes.

    Parameters
    ----------
    text : str or dict
        Keys: ``like`` (a machine that comes with the program; then only what is different), ``name``, ``description``,
        ``preferred`` (``"A+"``), ``tip_control`` (two blocks, or none), ``tool_direction``, ``tool_length``,
        ``[tool_lengths]``, ``part_zero`` and up to two
        tables ``[[axis]]`` (``axis = []`` for none) with ``name``, ``direction``, ``carrier``, ``point``, ``positive``,
        ``limits``, ``modulo``, ``clamp``; ``[travel]`` with ``X``, ``Y`` and ``Z``, each ``[lowest, highest]``, any of
        which may be left out; ``[home]`` and ``[tool_change]`` with any axes; and for the planning of the time tables
        ``[dynamics.X]`` (Y, Z and the rotary axes alike) with ``velocity`` (mm/min or deg/min), ``acceleration`` and
        ``jerk`` (mm or deg per s² and s³), each of which may be left out.
    file : str
        For messages.
    name : str
        Where the text has none.

    Raises
    ------
    SettingsError
        The text is not TOML, has an unknown key (with the closest known one), or does not describe a machine.
    """
    try:
        table, _ = _SHELF.parse(text)
        entries = table.get("axis", [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise _SHELF.wrong("axis is not a list of tables", "write [[axis]] for each")
        if len(entries) > 2:
            raise _SHELF.wrong(f"{len(entries)} rotary axes are described", "write [[axis]] twice at most")
        if "axis" not in table:
            raise _SHELF.wrong("no rotary axis is described", "write [[axis]], or axis = [] for a machine without")
        axes = tuple(_axis(entry, number) for number, entry in enumerate(entries, start=1))
        return Machine(
            name=_text(table, "name", name),
            axes=axes,
            description=_text(table, "description", ""),
            preferred=_preferred(table),
            tool_direction=_vector(table, "tool_direction", (0.0, 0.0, 1.0)),
            tool_length=_number(table.get("tool_length", 0.0), "tool_length"),
            part_zero=_vector(table, "part_zero", (0.0, 0.0, 0.0)),
            dynamics=_dynamics(table, (*LINEAR, *(axis.name for axis in axes))),
            travel=_travel(table),
            tool_lengths=_tool_lengths(table),
            home=_position(table, "home", (*LINEAR, *sorted(axis.name for axis in axes))),
            tool_change=_position(table, "tool_change", (*LINEAR, *sorted(axis.name for axis in axes))),
            tip_control=_tip_control(table),
        )
    except SettingsError as error:
        raise SettingsError(error.code, error.what, error.hint, file=file) from error


def _axis(entry: dict[str, Any], number: int) -> RotaryAxis:
    where = f"axis {number}: "
    _SHELF.check_keys(entry, _AXIS_KEYS, f"axis {number}.")
    for key in ("name", "direction", "carrier"):
        if key not in entry:
            raise _SHELF.wrong(f"{where}{key} is missing", f"add {key} = ...")
    limits = entry.get("limits")
    if limits is not None:
        if not isinstance(limits, list) or len(limits) != 2:
            raise _SHELF.wrong(f"{where}limits is {limits!r}", "write limits = [lowest, highest] in degrees")
        limits = (_number(limits[0], f"{where}limits"), _number(limits[1], f"{where}limits"))
    modulo = entry.get("modulo", False)
    if not isinstance(modulo, bool):
        raise _SHELF.wrong(f"{where}modulo is {modulo!r}", "write true or false")
    clamp = entry.get("clamp")
    if clamp is not None and (not isinstance(clamp, list) or [type(word) for word in clamp] != [str, str]):
        raise _SHELF.wrong(f"{where}clamp is {clamp!r}", 'give two M words, as in ["M10", "M11"]')
    if entry["carrier"] == "none":  # which stands for axes that are not there
        raise _SHELF.wrong(f"{where}carrier is 'none'", "use table or head")
    return RotaryAxis(
        name=_text(entry, "name", ""),
        direction=_vector(entry, "direction", (0.0, 0.0, 0.0), where),
        carrier=entry["carrier"],
        point=_vector(entry, "point", (0.0, 0.0, 0.0), where),
        positive=entry.get("positive", "tool"),
        limits=limits,
        modulo=modulo,
        clamp=None if clamp is None else (clamp[0], clamp[1]),
    )


def _tool_lengths(table: dict[str, Any]) -> tuple[tuple[int, float], ...]:
    given = table.get("tool_lengths", {})
    if not isinstance(given, dict) or not all(name.isdecimal() for name in given):
        raise _SHELF.wrong("tool_lengths is not a table by number of tool", "write [tool_lengths] and 3 = 120.5 below")
    return tuple((int(name), _number(value, f"tool_lengths.{name}")) for name, value in given.items())


def _tip_control(table: dict[str, Any]) -> tuple[str, ...] | None:
    """Blocks that switch tip control on and off; None where the table says nothing of them."""
    given = table.get("tip_control")
    if given is None:
        return None
    if not isinstance(given, list) or not all(isinstance(block, str) for block in given):
        hint = 'give two blocks, as in ["M428", "M429"], or [] for none'
        raise _SHELF.wrong(f"tip_control is {given!r}", hint)
    return tuple(given)


def _position(table: dict[str, Any], key: str, names: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    """Position of any axes, in the order of their names."""
    given = table.get(key, {})
    if not isinstance(given, dict):
        raise _SHELF.wrong(f"{key} is not a table", f"write [{key}] and X = ... below, for the axes that go there")
    _SHELF.check_keys(given, names, f"{key}.")
    return tuple((name, _number(given[name], f"{key}.{name}")) for name in names if name in given)


def _travel(table: dict[str, Any]) -> tuple[Travel, ...]:
    given = table.get("travel", {})
    if not isinstance(given, dict):
        raise _SHELF.wrong("travel is not a table", "write [travel] and X = [lowest, highest] below")
    _SHELF.check_keys(given, LINEAR, "travel.")
    found = []
    for name in (name for name in LINEAR if name in given):
        ends = given[name]
        if not isinstance(ends, list) or len(ends) != 2:
            raise _SHELF.wrong(f"travel of {name} is {ends!r}", f"write {name} = [lowest, highest] in mm")
        found.append(Travel(name, *(_number(end, f"travel of {name}") for end in ends)))
    return tuple(found)


def _dynamics(table: dict[str, Any], names: tuple[str, ...]) -> tuple[Dynamics, ...]:
    """Limits of the axes in the order of their names."""
    given = table.get("dynamics", {})
    if not isinstance(given, dict) or not all(isinstance(entry, dict) for entry in given.values()):
        raise _SHELF.wrong("dynamics is not a table per axis", "write [dynamics.X] and its numbers below")
    _SHELF.check_keys(given, names, "dynamics.")
    found = []
    for name in (name for name in names if name in given):
        where = f"dynamics of {name}: "
        _SHELF.check_keys(given[name], _DYNAMICS_KEYS, f"dynamics.{name}.")
        found.append(Dynamics(name, **{key: _number(given[name][key], where + key) for key in given[name]}))
    return tuple(found)


def _text(table: dict[str, Any], key: str, default: str) -> str:
    value = table.get(key, default)
    if not isinstance(value, str):
        raise _SHELF.wrong(f"{key} is {value!r}", "write it as text in quotes")
    return value


def _number(value: object, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _SHELF.wrong(f"{key} is {value!r}", "give a number")
    return float(value)


def _vector(
    table: dict[str, Any], key: str, default: tuple[float, float, float], where: str = ""
) -> tuple[float, float, float]:
    value = table.get(key, default)
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise _SHELF.wrong(f"{where}{key} is {value!r}", "give three numbers in brackets")
    x, y, z = (_number(number, where + key) for number in value)
    return x, y, z


def _preferred(table: dict[str, Any]) -> tuple[str, float] | None:
    value = table.get("preferred")
    if value is None:
        return None
    if not isinstance(value, str) or len(value) != 2 or value[1] not in "+-":
        raise _SHELF.wrong(f"preferred is {value!r}", 'write an axis and its sign, as in preferred = "A+"')
    return value[0], 1.0 if value[1] == "+" else -1.0
