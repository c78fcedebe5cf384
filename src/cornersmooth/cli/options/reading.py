"""Options about the CL file that is read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from cornersmooth.cli.options.parameters import all_of

feed = click.option("--feed", type=float, metavar="MM/MIN", help="Feed for moves that the CL file gives none for.")
input_format = click.option(
    "--input-format",
    "format",
    type=click.Choice(["apt", "points"]),
    help="Form of the input, instead of what it looks like.",
)
dialect = click.option(
    "--dialect",
    type=str,
    metavar="NAME",
    help="CL dialect, instead of what the text looks like: nx, catia, creo, solidworks, hsm, ncl, makino or plain.",
)
units = click.option(
    "--units", type=click.Choice(["mm", "inch"]), help="Units of the input, where it does not say or says it wrong."
)
arc_rule = click.option(
    "--arc-rule", type=click.Choice(["left", "right", "tangent"]), help="Sense of CIRCLE about its axis."
)
lenient = click.option("--lenient", is_flag=True, help="Go on after errors in the input where it is safe.")

_READING = {
    "format": input_format,
    "dialect": dialect,
    "units": units,
    "arc_rule": arc_rule,
    "lenient": lenient,
}


def reading_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that reads CL files."""
    return all_of(function, _READING.values())


def reading_of(given: dict[str, Any]) -> dict[str, Any]:
    """Keyword arguments of `cornersmooth.read` that were given."""
    return {name: given[name] for name in _READING}
