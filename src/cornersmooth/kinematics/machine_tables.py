"""Machines as TOML text: those that come with the program, and the user's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from cornersmooth.kinematics.machine import LINEAR, Dynamics, Machine, RotaryAxis, Travel
from cornersmooth.tables import Shelf, Table

Row = TypeVar("Row")
_SHELF = Shelf(
    "machine",
    __package__,
    "machines",
    keys=(
        *("name", "description", "preferred", "tool_direction", "tool_length", "tool_lengths", "part_zero", "travel"),
        *("home", "tool_change", "tip_control", "axis", "dynamics"),
    ),
    unknown="CS250",
    unreadable="CS251",
    unknown_key="CS252",
    wrong_value="CS253",
)


machine_names, machine_table = _SHELF.names, _SHELF.built_in


def load_machine(name_or_path: str | Path) -> Machine:
    """Machine of that name, or described by that TOML file.

    A text that ends in ``.toml`` or holds a path separator is a file; anything else is a name.

    Returns
    -------
    Machine
        Axes, travel and limits in mm, degrees and minutes or seconds as its fields name them.

    Raises
    ------
    SettingsError
        The name is unknown (with the closest known one), the file cannot be read, or it does not describe a machine.
    """
    text, file, name = _SHELF.choose(name_or_path)
    return parse_machine(text, file=file, name=name)


def parse_machine(text: str | Table, *, file: str = "<machine>", name: str = "machine") -> Machine:
    """Machine that a TOML text, or a table read from one, describes; its keys are in docs/machines.md.

    `file` is for messages, `name` for a text that has none. SettingsError: the text is not TOML, has an unknown key
    (with the closest known one), or does not describe a machine.
    """
    with _SHELF.in_file(file):
        table, _ = _SHELF.parse(text)
        entries = table.get("axis", [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise _SHELF.wrong("axis is not a list of tables", "write [[axis]] for each")
        if len(entries) > 2:
            raise _SHELF.wrong(f"{len(entries)} rotary axes are described", "write [[axis]] twice at most")
        if "axis" not in table:
            raise _SHELF.wrong("no rotary axis is described", "write [[axis]], or axis = [] for a machine without")
        axes = tuple(_axis(entry, f"axis {number}") for number, entry in enumerate(entries, start=1))
        names = [axis.name for axis in axes]
        position = _named((*LINEAR, *sorted(names)), lambda name, value, at: (name, _SHELF.number(value, at)))
        return _SHELF.record(
            Machine,
            {"name": name} | {key: value for key, value in table.items() if key != "axis"},
            "",
            given={"axes": axes},
            preferred=_preferred,
            dynamics=_named((*LINEAR, *names), _dynamics),
            travel=_named(LINEAR, _travel),
            tool_lengths=_tool_lengths,
            home=position,
            tool_change=position,
        )


def _axis(entry: Table, where: str) -> RotaryAxis:
    if entry.get("carrier") == "none":  # which stands for axes that are not there
        raise _SHELF.wrong(f"{where}.carrier is 'none'", "use table or head")
    return _SHELF.record(RotaryAxis, entry, where, carrier=_SHELF.text, positive=_SHELF.text)


def _tool_lengths(given: Any, where: str) -> tuple[tuple[int, float], ...]:
    if not isinstance(given, dict) or not all(name.isdecimal() for name in given):
        raise _SHELF.wrong(f"{where} is not a table by number of tool", f"write [{where}] and 3 = 120.5 below")
    return tuple((int(name), _SHELF.number(value, f"{where}.{name}")) for name, value in given.items())


def _named(names: Sequence[str], read: Callable[[str, Any, str], Row]) -> Callable[[Any, str], tuple[Row, ...]]:
    """Reader of a table by names of axes: a row of each that it has, in the order of the names."""

    def rows(given: Any, where: str) -> tuple[Row, ...]:
        _SHELF.check_keys(_SHELF.table(given, where), names, f"{where}.")
        return tuple(read(name, given[name], f"{where}.{name}") for name in names if name in given)

    return rows


def _travel(name: str, value: Any, where: str) -> Travel:
    return Travel(name, *_SHELF.numbers(value, where, count=2, hint=f"write {name} = [lowest, highest] in mm"))


def _dynamics(name: str, value: Any, where: str) -> Dynamics:
    return _SHELF.record(Dynamics, value, where, given={"name": name})


def _preferred(value: Any, where: str) -> tuple[str, float]:
    if not isinstance(value, str) or len(value) != 2 or value[1] not in "+-":
        raise _SHELF.wrong(f"{where} is {value!r}", 'write an axis and its sign, as in preferred = "A+"')
    return value[0], 1.0 if value[1] == "+" else -1.0
