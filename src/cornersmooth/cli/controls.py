"""``cornersmooth controls``: which controls NC text can be written for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli.command import new_command
from cornersmooth.cli.show import say_json, say_line
from cornersmooth.cli.values import Given

if TYPE_CHECKING:
    from cornersmooth.nc import Control

#: what the modes of a form are called for people
_MODES = {
    "vector": "tool vectors",
    "point": "a second point on the tool axis",
    "fixed": "tool parallel to Z",
    "angles": "rotary words (--machine)",
    "machine": "machine positions (--machine, --no-tcp)",
}


@new_command("controls", "[CONTROL]", "table as_json", cls=click.Command)
def command(given: Given) -> int:
    """List the controls with their forms, or check and describe one.

    A TOML file of your own is like one of them and says only what is different; see docs/controls.md.

    \b
    Examples:
      cornersmooth controls
      cornersmooth controls siemens
      cornersmooth controls siemens --table > mine.toml
      cornersmooth controls mine.toml
    """
    from cornersmooth.nc import control_names, control_table, load_control

    name = given.name
    if given.table:
        if name is None:
            raise click.UsageError("--table needs the name of a control")
        if given.as_json:
            raise click.UsageError("--table and --json exclude each other")
        click.echo(control_table(name), nl=False)
        return 0
    controls = [_values(load_control(one)) for one in ([name] if name else control_names())]
    if given.as_json:
        say_json({"schema": "cornersmooth-controls/1", "controls": controls})
        return 0
    for control in controls:
        say_line(_told("", control))
        if control["aliases"]:
            say_line(f"  also called {', '.join(control['aliases'])}")
        for form in control["forms"]:
            say_line(_told("  -f ", form))
            say_line(f"     with {', '.join(form['with'])}")
        for extra in control["functions"]:
            say_line(_told("  --with ", extra))
    return 0


def _values(control: Control) -> dict[str, Any]:
    """What is told of a control."""
    from cornersmooth.nc import control_aliases

    aliases = [alias for alias, own in control_aliases().items() if own == control.name and not control.own]
    forms = [{**_named(form), "with": [_MODES[mode] for mode in form.modes]} for form in control.forms.values()]
    return {**_named(control), "aliases": aliases, "forms": forms, "functions": [*map(_named, control.extras.values())]}


def _named(item: Any) -> dict[str, Any]:
    return {"name": item.name, "description": item.description}


def _told(before: str, item: dict[str, Any]) -> str:
    return f"{before}{item['name']}: {item['description']}" if item["description"] else f"{before}{item['name']}"
