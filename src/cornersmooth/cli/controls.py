"""``cornersmooth controls``: the controls with their forms and functions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from cornersmooth.cli.options import Options
from cornersmooth.cli.show import say

#: what the modes of a form are called for people
_MODES = {
    "vector": "tool vectors",
    "point": "a second point on the tool axis",
    "fixed": "tool parallel to Z",
    "angles": "rotary words (--machine)",
    "machine": "machine positions (--machine, --no-tcp)",
}


def run_controls(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from cornersmooth.nc import control_names, control_table, load_control

    if given.table:
        check_table(given, "control")
        click.echo(control_table(str(given.name)), nl=False)
        return 0
    controls = [_values(load_control(one)) for one in ([given.name] if given.name else control_names())]
    lines = (line for control in controls for line in _lines(control))
    say(given, {"schema": "cornersmooth-controls/1", "controls": controls}, lines)
    return 0


def check_table(given: Options, kind: str) -> None:
    """Refuse a table of nothing, and one beside other things."""
    if given.name is None:
        raise click.UsageError(f"--table needs the name of a {kind}")
    if given.as_json or given.pose:
        raise click.UsageError(f"--table and {'--pose' if given.pose else '--json'} exclude each other")


def _values(control: Any) -> dict[str, Any]:
    """What the list has of a control."""
    from cornersmooth.nc import control_aliases

    aliases = [alias for alias, own in control_aliases().items() if own == control.name and not control.own]
    forms = [{**_named(form), "with": [_MODES[mode] for mode in form.modes]} for form in control.forms.values()]
    return {**_named(control), "aliases": aliases, "forms": forms, "functions": [*map(_named, control.extras.values())]}


def _named(item: Any) -> dict[str, Any]:
    return {"name": item.name, "description": item.description}


def _lines(control: dict[str, Any]) -> Iterator[str]:
    yield _line("", control)
    if control["aliases"]:
        yield f"  also called {', '.join(control['aliases'])}"
    for form in control["forms"]:
        yield _line("  -f ", form)
        yield f"     with {', '.join(form['with'])}"
    for extra in control["functions"]:
        yield _line("  --with ", extra)


def _line(before: str, item: dict[str, Any]) -> str:
    return f"{before}{item['name']}: {item['description']}" if item["description"] else f"{before}{item['name']}"
