"""``cornersmooth controls`` and ``machines``: what programs can be written for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import click

from cornersmooth.cli.show import say, say_json
from cornersmooth.cli.values import Given
from cornersmooth.kinematics import load_machine, machine_names, machine_table
from cornersmooth.kinematics.posed import Posed, parse_pose
from cornersmooth.nc import Control, control_aliases, control_names, control_table, load_control

#: what the modes of a form are called for people
_MODES = {
    "vector": "tool vectors",
    "point": "a second point on the tool axis",
    "fixed": "tool parallel to Z",
    "angles": "rotary words (--machine)",
    "machine": "machine positions (--machine, --no-tcp)",
}


def run_controls(given: Given) -> int:
    """Do the work of the command; return its exit code."""
    if given.table:
        _check_table(given, "control")
        click.echo(control_table(str(given.name)), nl=False)
        return 0
    controls = [_values(load_control(one)) for one in ([given.name] if given.name else control_names())]
    lines = (line for control in controls for line in _lines(control))
    say(given, {"schema": "cornersmooth-controls/1", "controls": controls}, lines)
    return 0


def _check_table(given: Given, kind: str) -> None:
    """Refuse a table of nothing, and one beside other things."""
    if given.name is None:
        raise click.UsageError(f"--table needs the name of a {kind}")
    if given.as_json or given.pose:
        raise click.UsageError(f"--table and {'--pose' if given.pose else '--json'} exclude each other")


def _values(control: Control) -> dict[str, Any]:
    """What is told of a control."""
    aliases = [alias for alias, own in control_aliases().items() if own == control.name and not control.own]
    forms = [{**_named(form), "with": [_MODES[mode] for mode in form.modes]} for form in control.forms.values()]
    return {**_named(control), "aliases": aliases, "forms": forms, "functions": [*map(_named, control.extras.values())]}


def _named(item: Any) -> dict[str, Any]:
    return {"name": item.name, "description": item.description}


def _lines(control: dict[str, Any]) -> Iterator[str]:
    yield _told("", control)
    if control["aliases"]:
        yield f"  also called {', '.join(control['aliases'])}"
    for form in control["forms"]:
        yield _told("  -f ", form)
        yield f"     with {', '.join(form['with'])}"
    for extra in control["functions"]:
        yield _told("  --with ", extra)


def _told(before: str, item: dict[str, Any]) -> str:
    return f"{before}{item['name']}: {item['description']}" if item["description"] else f"{before}{item['name']}"


def run_machines(given: Given) -> int:
    """Do the work of the command; return its exit code."""
    name = given.name
    if given.table:
        _check_table(given, "machine")
        click.echo(machine_table(str(name)), nl=False)
    elif given.pose and name is None:
        raise click.UsageError("--pose needs the name of a machine")
    elif given.pose and name:
        machine = load_machine(name)
        posed = Posed.of(machine, parse_pose(machine, given.pose))
        if given.as_json:
            say_json(posed.as_dict())
        else:
            click.echo(posed.describe())
    else:
        found = [load_machine(one) for one in ([name] if name else machine_names())]
        lines = found[0].describe().splitlines() if name else [f"{one.name}: {one.description}" for one in found]
        say(given, {"schema": "cornersmooth-machines/1", "machines": [*map(asdict, found)]}, lines, indent=4)
    return 0
