"""Options about time: what a machine can do, and the motion that is planned."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli import completing
from cornersmooth.cli.headings import flag, number, option
from cornersmooth.cli.options.parameters import PATH, Duration, all_of
from cornersmooth.methods import METHODS

if TYPE_CHECKING:
    from cornersmooth.feedrate import Limits

_LIMITS = {
    "feed": number("Limits", "--feed", unit="MM/MIN", help="Feed of all feed moves instead of the programmed ones."),
    "accel": number("Limits", "--accel", unit="MM/S2", default=1000.0, help="Acceleration along the path."),
    "jerk": number("Limits", "--jerk", unit="MM/S3", default=5000.0, help="Jerk along the path."),
    "centripetal": number(
        "Limits", "--centripetal", unit="MM/S2", help="Acceleration across the path. [default: that of --accel]"
    ),
    "period": option(
        "Limits",
        "--period",
        type=Duration(),
        default=0.002,
        metavar="TIME",
        help="Interpolation period, as in 2ms: at corners that stay sharp the velocity changes by at most accel times "
        "period. [default: 2ms]",
    ),
    "rapid": number("Limits", "--rapid", unit="MM/MIN", default=10000.0, help="Speed of rapid moves."),
    "rapid_accel": number(
        "Limits", "--rapid-accel", unit="MM/S2", help="Acceleration of rapids. [default: that of --accel]"
    ),
    "rapid_jerk": number("Limits", "--rapid-jerk", unit="MM/S3", help="Jerk of rapids. [default: that of --jerk]"),
    "angular_feed": number(
        "Limits", "--angular-feed", unit="DEG/S", default=30.0, help="Speed of moves that only turn the tool axis."
    ),
    "angular_accel": number("Limits", "--angular-accel", unit="DEG/S2", default=150.0, help="Their acceleration."),
    "angular_jerk": number("Limits", "--angular-jerk", unit="DEG/S3", default=3000.0, help="Their jerk."),
    "vector_jerk": number(
        "Limits", "--vector-jerk", unit="MM/S3", help="Jerk of the tip in any direction. [default: no limit]"
    ),
    "turn_speed": number(
        "Limits", "--turn-speed", unit="DEG/S", help="Turning of the tool axis in all moves. [default: no limit]"
    ),
    "turn_accel": number("Limits", "--turn-accel", unit="DEG/S2", help="Its acceleration. [default: no limit]"),
    "turn_jerk": number("Limits", "--turn-jerk", unit="DEG/S3", help="Its jerk. [default: no limit]"),
}


def limit_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options that say what a machine can do."""
    return all_of(function, _LIMITS.values())


def limits_of(given: dict[str, Any]) -> Limits:
    """What the machine can do, as given."""
    from cornersmooth.feedrate import Limits

    return Limits(**{name: given[name] for name in _LIMITS})


feed_from_plan = flag(
    "Limits",
    "--feed-from-plan",
    help="Give every block the feed that a plan of the program reaches there, within --accel, --jerk and the limits of "
    "--machine: for controls that do not look ahead.",
)
#: of a plan whose feeds are written
_PLANNED = ("accel", "jerk", "centripetal", "period")


def planned_feed_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of feeds from a plan."""
    return all_of(function, (feed_from_plan, *(_LIMITS[name] for name in _PLANNED)))


def planned_limits_of(given: dict[str, Any]) -> Limits | None:
    """Limits of the plan whose feeds are written; None where they are the programmed ones.

    Raises
    ------
    UsageError
        Limits without `--feed-from-plan`.
    """
    if given["feed_from_plan"]:
        from cornersmooth.feedrate import Limits

        return Limits(**{name: given[name] for name in _PLANNED})
    context = click.get_current_context()
    for name in _PLANNED:
        if context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(f"--{name} is for --feed-from-plan")
    return None


limits = option(
    "Limits",
    "--limits",
    metavar="NAME|FILE",
    shell_complete=completing.machines,
    help="Say the time under the limits of this machine's axes; the words of the program stay as they are. A name that "
    "'cornersmooth machines' lists, or a TOML file with [dynamics.X] and so on. [default: those of --machine]",
)
planned_time = flag("Limits", "--time", help="Say the time of programs of more than 20,000 poses, too.")
text = option(
    "Everyday",
    "--text",
    type=PATH,
    metavar="NC",
    help="Plan this NC program in place of the one that these options write: its lines, digits and feeds.",
)
text_machine = option(
    "Reading",
    "--text-machine",
    metavar="NAME|FILE",
    shell_complete=completing.machines,
    help="Machine whose rotary words --text has. [default: that of its head, else --machine]",
)
block_time = option(
    "Lines",
    "--block-time",
    type=Duration(),
    help="Shortest time that the control takes for one block, of lines to write and in the plan. [default: that of the "
    "control's table for lines, none in the plan]",
)
look_ahead = option(
    "Limits",
    "--look-ahead",
    type=click.IntRange(min=1),
    metavar="BLOCKS",
    help="Blocks within which the control must be able to stop. [default: all]",
)
law = option(
    "Output",
    "--law",
    type=click.Choice(["direct_exact_stop", "direct_velocity_jump", *METHODS, "as_written"]),
    default="as_written",
    metavar="LAW",
    help="Motion that --csv writes: as_written, direct_exact_stop, direct_velocity_jump, or the curves of a method "
    f"({', '.join(METHODS)}).",
)
rows_csv = option("Output", "--csv", type=PATH, help="Write the rows.")
motion_csv = option("Output", "--csv", type=PATH, help="Write the motion, a row every period.")
