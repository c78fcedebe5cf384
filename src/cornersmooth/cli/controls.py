"""``cornersmooth controls``: which controls NC text can be written for."""

from __future__ import annotations

import click

from cornersmooth.cli import completing
from cornersmooth.cli.options import outputs

#: what the modes of a form are called for people
_MODES = {
    "vector": "tool vectors",
    "point": "a second point on the tool axis",
    "fixed": "tool parallel to Z",
    "angles": "rotary words (--machine)",
    "machine": "machine positions (--machine, --no-tcp)",
}


@click.command(
    "controls",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit codes: 0 done; 2 wrong usage or configuration; 4 output cannot be written.",
)
@click.argument("name", required=False, metavar="[NAME|FILE]", shell_complete=completing.controls)
@outputs.table
def command(name: str | None, table: bool) -> int:
    """List the controls with their forms, or check and describe one.

    A TOML file of your own is like one of them and says only what is different; see docs/controls.md.

    \b
    Examples:
      cornersmooth controls
      cornersmooth controls siemens
      cornersmooth controls siemens --table > mine.toml
      cornersmooth controls mine.toml
    """
    from cornersmooth.nc import control_aliases, control_names, control_table, load_control

    if table:
        if name is None:
            raise click.UsageError("--table needs the name of a control")
        click.echo(control_table(name), nl=False)
        return 0
    names = [name] if name else list(control_names())
    aliases = control_aliases()
    for control in map(load_control, names):
        click.echo(f"{control.name}: {control.description}" if control.description else control.name)
        if others := [alias for alias, own in aliases.items() if own == control.name and not control.own]:
            click.echo(f"  also called {', '.join(others)}")
        for form in control.forms.values():
            click.echo(f"  -f {form.name}: {form.description}" if form.description else f"  -f {form.name}")
            click.echo(f"     with {', '.join(_MODES[mode] for mode in form.modes)}")
        for extra in control.extras.values():
            click.echo(f"  --with {extra.name}: {extra.description}" if extra.description else f"  --with {extra.name}")
    return 0
