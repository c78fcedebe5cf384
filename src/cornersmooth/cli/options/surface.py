"""Options about the tool and the metal it leaves."""

from __future__ import annotations

import click

from cornersmooth.cli.headings import option
from cornersmooth.cli.options.parameters import ToolShape

tool = option(
    "Reading",
    "--tool",
    type=ToolShape(),
    metavar="D[,R[,TAPER[,LENGTH]]]",
    help="Shape of the tool: diameter, corner radius, taper in degrees, length. [default: that of the file]",
)
stations = option(
    "Output",
    "--stations",
    type=click.IntRange(1, 1_000_000),
    metavar="N",
    default=2000,
    show_default=True,
    help="Places along the path.",
)
levels = option(
    "Output",
    "--levels",
    type=click.IntRange(1, 60),
    metavar="N",
    default=7,
    show_default=True,
    help="Points along the cutting edge.",
)
