"""Options about the CL file that is read."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import click

from cornersmooth.cli.headings import option
from cornersmooth.cli.options.parameters import all_of

feed = option(
    "Everyday", "--feed", type=float, metavar="MM/MIN", help="Feed for moves that the CL file gives none for."
)
input_format = option(
    "Reading",
    "--input-format",
    "format",
    type=click.Choice(["apt", "points"]),
    help="Form of the input, instead of what it looks like.",
)
dialect = option(
    "Reading",
    "--dialect",
    type=str,
    metavar="NAME",
    help="CL dialect, instead of what the file looks like: nx, catia, creo, solidworks, hsm, ncl, makino or plain.",
)
units = option(
    "Reading",
    "--units",
    type=click.Choice(["mm", "inch"]),
    help="Units of the input, where it does not say or says it wrong.",
)
arc_rule = option(
    "Reading", "--arc-rule", type=click.Choice(["left", "right", "tangent"]), help="Sense of CIRCLE about its axis."
)


class SpindleType(click.ParamType[tuple[float, str]]):
    """A speed of the spindle, with the direction where it is not clockwise."""

    name = "RPM[,CCLW]"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, str]:
        """Return the speed and CLW or CCLW."""
        if isinstance(value, tuple):
            return value
        number, _, direction = str(value).partition(",")
        direction = direction.strip().upper() or "CLW"
        try:
            speed = float(number)
        except ValueError:
            speed = math.nan
        if not 0.0 < speed < math.inf or direction not in ("CLW", "CCLW"):
            self.fail(f"{value!r} is no speed; give it as 8000 or 8000,CCLW", param, ctx)
        return speed, direction


tool_number = option(
    "Reading",
    "--tool-number",
    type=click.IntRange(1, 99999999),
    metavar="N",
    help="Tool that is loaded first, with its length, for inputs that load none.",
)
spindle = option(
    "Reading",
    "--spindle",
    type=SpindleType(),
    metavar="RPM[,CCLW]",
    help="Speed of the spindle, clockwise or with CCLW counterclockwise, for inputs that start none.",
)
operation = option(
    "Reading",
    "--operation",
    type=str,
    metavar="N|NAME",
    help="Take one operation of the CL file alone, with the tool, spindle and coolant that hold there; "
    "'cornersmooth info' lists them.",
)
lenient = option("Reading", "--lenient", is_flag=True, help="Go on after errors in the input where it is safe.")

no_size_limit = option(
    "Reading", "--no-size-limit", is_flag=True, help="Read inputs of more than 2 GB, and gzip files that grow 200-fold."
)

tip_control = option(
    "Reading",
    "--tip-control",
    is_flag=True,
    help="Tool tip control is on where the NC program begins: a subprogram, or kinematics that are always on.",
)
units_of_program = option(
    "Reading", "--units", type=click.Choice(["mm", "inch"]), help="Units of a program that does not say them."
)

#: arguments of `cornersmooth.read` that options give
_ARGUMENTS = "format dialect units arc_rule operation lenient tool_number spindle".split()


def reading_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that reads CL files."""
    return all_of(function, (input_format, dialect, units, arc_rule, operation, lenient, no_size_limit))


def tool_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of the commands that know of a tool which the input does not name."""
    return all_of(function, (tool_number, spindle))


def check_kind(given: dict[str, Any], *, program: bool) -> None:
    """Refuse options for CL files where the input is an NC program, and the other way round."""
    context = click.get_current_context()
    for_files = {"feed", *_ARGUMENTS} - {"units"}
    for param in context.command.params:
        name = str(param.name)
        if context.get_parameter_source(name) != click.core.ParameterSource.COMMANDLINE or not given.get(name):
            continue
        if program and name in for_files:
            raise click.UsageError(f"{param.opts[-1]} is for CL files, and the input is an NC program; leave it out")
        if not program and name == "tip_control":
            raise click.UsageError("--tip-control is for NC programs, and the input is a CL file; leave it out")


def reading_of(given: dict[str, Any]) -> dict[str, Any]:
    """Keyword arguments of `cornersmooth.read` that were given."""
    return {name: given[name] for name in _ARGUMENTS if name in given} | {"size_limit": not given["no_size_limit"]}
