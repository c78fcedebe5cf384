"""Options of smoothing: one for every field of `cornersmooth.settings.Settings`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli.headings import option
from cornersmooth.cli.options.parameters import LENGTH, Duration, Weights, all_of
from cornersmooth.methods import AUTO, METHODS

if TYPE_CHECKING:
    from cornersmooth.settings import Settings

tolerance = option(
    "Everyday",
    "-e",
    "--tolerance",
    type=LENGTH,
    default=0.01,
    show_default=True,
    help="Largest deviation of the written path.",
)
axis_length = option(
    "Everyday",
    "-H",
    "--axis-length",
    type=LENGTH,
    default=10.0,
    show_default=True,
    help="Distance from the tool tip to the second point that keeps the tolerance: the length of the cutting edge.",
)
axis_tolerance = option(
    "Curves",
    "--axis-tolerance",
    type=float,
    metavar="DEG",
    help="Largest deviation of the tool axis where the tip is within -e, in place of -e at the axis point (-H): for"
    " ball-end mills, whose centre is all that counts.",
)
method = option(
    "Everyday",
    "--method",
    type=click.Choice([AUTO, *METHODS]),
    default=AUTO,
    show_default=True,
    help="How the curves are made. With auto: global in curves (g6.2, bspline, poly, spl), proportional in lines. "
    + " ".join(f"With {item.name}: {item.summary}." for item in METHODS.values())
    + " Global takes less time on the machine and about a block a pose in curves; on LinuxCNC it takes more time.",
)
weights = option(
    "Curves",
    "--weights",
    type=Weights(),
    default=(1.0, 1.0),
    help="Weights w1,w2 of the curves, up to 3. [default: 1,1]",
)
reversal_angle = option(
    "Curves",
    "--reversal-angle",
    type=float,
    metavar="DEG",
    default=170.0,
    show_default=True,
    help="Corners that turn by more stay sharp.",
)
lines = option(
    "Lines",
    "--lines",
    type=click.Choice(["dense", "long"]),
    help="Lines close to the curves, or as few as -e allows. [default: what suits the control]",
)
chord_tolerance = option(
    "Lines",
    "--chord",
    "chord_tolerance",
    type=LENGTH,
    help="Largest distance between the written lines and the curve. [default: a tenth of -e, at most 0.0005]",
)
block_time = option(
    "Lines",
    "--block-time",
    type=Duration(),
    help="Shortest time in which the control takes a block, as in 1ms. At the programmed feed, no line along a curve "
    "takes less. [default: that of the control's table]",
)
axis_step = option(
    "Lines",
    "--axis-step",
    type=float,
    metavar="DEG",
    help="Largest change of the tool axis in one line beside a rounded corner.",
)


def curve_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that makes curves, besides their tolerance and method."""
    return all_of(function, (weights, reversal_angle))


def line_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that writes lines along the curves."""
    return all_of(function, (lines, chord_tolerance, block_time, axis_step))


def settings_of(given: dict[str, Any]) -> Settings:
    """How to smooth, as given; options that a command does not have keep their defaults."""
    from cornersmooth.settings import Settings

    check_one_of_axis(given)
    return Settings(**{item.name: given[item.name] for item in fields(Settings) if item.name in given})


def check_one_of_axis(given: dict[str, Any]) -> None:
    """Refuse a length and a tolerance of the axis in one command: the one takes the place of the other."""
    context, typed = click.get_current_context(silent=True), click.core.ParameterSource.COMMANDLINE
    if context is None or given.get("axis_tolerance") is None:
        return
    if context.get_parameter_source("axis_length") == context.get_parameter_source("axis_tolerance") == typed:
        raise click.UsageError("--axis-tolerance takes the place of -H/--axis-length: give one of them")
