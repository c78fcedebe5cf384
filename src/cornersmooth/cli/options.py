"""Every option of the command line, once; commands pick what they need.

Lengths are millimetres; the suffixes ``mm`` and ``in`` are accepted.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.errors import SettingsError
from cornersmooth.methods import DEFAULT_METHOD, METHODS

if TYPE_CHECKING:
    from cornersmooth.feedrate import Limits
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Control
    from cornersmooth.settings import Settings

_LENGTH = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(mm|in|inch|\")?")


class Length(click.ParamType[float]):
    """A length in mm, or in inches with the suffix ``in``."""

    name = "mm"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Text to millimetres."""
        if isinstance(value, float):
            return value
        match = _LENGTH.fullmatch(str(value).strip())
        if not match:
            self.fail(f"{value!r} is not a length; write 0.04, 0.04mm or 0.0015in", param, ctx)
        number = float(match[1]) * (1.0 if match[2] in (None, "mm") else 25.4)
        if not (math.isfinite(number) and number > 0.0):
            self.fail(f"{value!r} is not a positive length", param, ctx)
        return number


class Duration(click.ParamType[float]):
    """A time in seconds, or with a suffix ``s``, ``ms``."""

    name = "time"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Text to seconds."""
        if isinstance(value, float):
            return value
        match = re.fullmatch(r"(\d+\.?\d*|\.\d+)\s*(s|ms)?", str(value).strip())
        if not match or not float(match[1]):
            self.fail(f"{value!r} is not a time; write 2ms or 0.002s", param, ctx)
        return float(match[1]) * (1e-3 if match[2] == "ms" else 1.0)


class Weights(click.ParamType[tuple[float, float]]):
    """Two positive numbers with a comma between."""

    name = "w1,w2"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        """Text to two numbers."""
        if isinstance(value, tuple):
            return value
        try:
            first, second = (float(part) for part in str(value).split(","))
        except ValueError:
            self.fail(f"{value!r} is not two numbers; write 1,0.7", param, ctx)
        return first, second


class Jobs(click.ParamType[int]):
    """A number of processes."""

    name = "n"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Text to a count; 0 stands for all cores."""
        try:
            number = int(value)
        except ValueError:
            self.fail(f"{value!r} is not a number of processes; put a bare -j behind the file names", param, ctx)
        if number < 0:
            self.fail("the number of processes cannot be negative", param, ctx)
        return number


class ToolShape(click.ParamType[Any]):
    """The shape of a tool: numbers with commas between."""

    name = "tool"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Text to a `Tool`."""
        from cornersmooth.surface.tool import parse_tool

        return parse_tool(value) if isinstance(value, str) else value


LENGTH = Length()

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

tolerance = click.option(
    "-e", "--tolerance", type=LENGTH, default=0.01, show_default=True, help="Largest deviation of the written path."
)
axis_length = click.option(
    "-H",
    "--axis-length",
    type=LENGTH,
    default=10.0,
    show_default=True,
    help="Distance from the tool tip to the second point that keeps the tolerance: the length of the cutting edge.",
)
method = click.option(
    "--method",
    type=click.Choice(list(METHODS)),
    default=DEFAULT_METHOD,
    show_default=True,
    help="How the curves are made. " + "; ".join(f"{item.name}: {item.summary}" for item in METHODS.values()) + ".",
)
shape = click.option(
    "--shape",
    type=click.Choice(["paper", "auto"]),
    default="paper",
    show_default=True,
    help="Weights of the curves: all 1 (or --weights), or chosen for every corner by its turn.",
)
allocation = click.option(
    "--allocation",
    type=click.Choice(["half", "fair"]),
    default="half",
    show_default=True,
    help="How far curves reach: half of each segment, or as much as their neighbours leave.",
)
weights = click.option(
    "--weights", type=Weights(), default=(1.0, 1.0), help="Weights w1,w2 of the curves, up to 3. [default: 1,1]"
)
orientation_tolerance = click.option(
    "--orientation-tolerance", type=float, metavar="DEG", help="Largest deviation of the tool axis besides -e and -H."
)
reversal_angle = click.option(
    "--reversal-angle",
    type=float,
    metavar="DEG",
    default=170.0,
    show_default=True,
    help="Corners that turn by more stay sharp.",
)
chord_tolerance = click.option(
    "--chord",
    "chord_tolerance",
    type=LENGTH,
    help="Distance between the written lines and the curve. [default: a tenth of -e]",
)
lines = click.option(
    "--lines",
    type=click.Choice(["dense", "long"]),
    help="Lines close to the curves, or as few as -e allows. [default: what suits the control]",
)
axis_step = click.option(
    "--axis-step",
    type=float,
    metavar="DEG",
    help="Largest change of the tool axis in one line beside a rounded corner.",
)
output = click.option(
    "-o", "--output", type=click.Path(), help="NC file, - for standard output. [default: - for a single input]"
)
directory = click.option(
    "-d",
    "--directory",
    type=click.Path(),
    help="Folder for the NC files of several inputs, made where missing; folders below an input stay folders.",
)
glob = click.option(
    "--glob",
    type=str,
    metavar="PATTERN",
    multiple=True,
    help="Files to take from folders, as in '*.cls'. May be repeated. [default: names of CL files]",
)
skip_existing = click.option(
    "--skip-existing", is_flag=True, help="Leave outputs that exist as they are, whatever they were made of."
)
summary = click.option("--summary", type=click.Path(), help="Write a row for each file of a batch: .json or .csv.")
jobs = click.option(
    "-j",
    "--jobs",
    type=Jobs(),
    default=1,
    is_flag=False,
    flag_value=0,
    help="Processes for several inputs; a bare -j takes all cores.",
)
form = click.option(
    "-f",
    "--form",
    type=str,
    metavar="g1|g6.2|...",
    help="Dense lines, or curves in the control's own form; 'cornersmooth controls' lists them. [default: g1]",
)
control = click.option(
    "--control",
    type=str,
    metavar="NAME|FILE",
    default="fanuc",
    show_default=True,
    help="Control the NC text is for: a name that 'cornersmooth controls' lists, or a TOML file.",
)
machine = click.option(
    "--machine",
    type=str,
    metavar="NAME|FILE",
    help="The text has rotary words of this machine instead of tool vectors: a name that 'cornersmooth machines' "
    "lists, or a TOML file.",
)
no_tcp = click.option(
    "--no-tcp", is_flag=True, help="Positions of the machine's axes, for controls that do not keep the tool tip."
)
header = click.option(
    "--header",
    type=click.Path(),
    metavar="FILE",
    help="Lines to write behind the head; {program} and {units} are filled in.",
)
trusted = click.option(
    "--trust",
    "trusted",
    type=click.Path(),
    multiple=True,
    metavar="FILE",
    help="Lines that belong in the text because you put them there, as --header and --footer of smooth. Repeatable.",
)
footer = click.option("--footer", type=click.Path(), metavar="FILE", help="Lines to write before the tail.")
program_name = click.option("--program-name", type=str, metavar="TEXT", help="Name or number of the NC program.")
work_offset = click.option(
    "--work-offset",
    type=str,
    metavar="WORD",
    help="Work offset, such as G55, or the number of a preset; 'none' leaves it out. Default: G54, or preset 1.",
)
block_numbers = click.option("--block-numbers", is_flag=True, help="Number the blocks.")
extras = click.option(
    "--with",
    "extras",
    type=str,
    metavar="NAME",
    multiple=True,
    help="Switch a function of the control on, such as cycle832; 'cornersmooth controls' lists them. May be repeated.",
)
no_comments = click.option("--no-comments", is_flag=True, help="Leave out what the CL file says in words.")
reports = click.option(
    "--report",
    "reports",
    type=click.Path(),
    multiple=True,
    help="Write a report; .json, .csv or .html (a page to look at) decides the form. May be repeated; {stem} stands "
    "for the input's name.",
)
no_verify = click.option(
    "--no-verify", is_flag=True, help="Do not read the written text back and measure it before it takes its place."
)
require_verify = click.option(
    "--require-verify", is_flag=True, help="Set a text aside that is not wholly verified, and end with 1."
)
force = click.option("--force", is_flag=True, help="Replace existing files.")
quiet = click.option("-q", "--quiet", is_flag=True, help="Only errors.")
verbose = click.option("-v", "--verbose", count=True, help="More: every finding, times of the stages.")
feed = click.option("--feed", type=float, metavar="MM/MIN", help="Feed for moves that the CL file gives none for.")
units = click.option(
    "--units", type=click.Choice(["mm", "inch"]), help="Units of the input, where it does not say or says it wrong."
)
dialect = click.option("--dialect", type=str, metavar="NAME", help="CL dialect, instead of what the text looks like.")
input_format = click.option(
    "--input-format",
    "format",
    type=click.Choice(["apt", "points"]),
    help="Form of the input, instead of what it looks like.",
)
arc_rule = click.option(
    "--arc-rule", type=click.Choice(["left", "right", "tangent"]), help="Sense of CIRCLE about its axis."
)
lenient = click.option("--lenient", is_flag=True, help="Go on after errors in the input where it is safe.")
found_reports = click.option(
    "--report",
    "reports",
    type=click.Path(),
    multiple=True,
    help="Write what was found: .json for the results, .csv for a row per pose, .html for a page to look at. May be "
    "repeated.",
)
page_reports = click.option(
    "--report", "reports", type=click.Path(), multiple=True, help="Write a page to look at: .html. May be repeated."
)
surface_reports = click.option(
    "--report",
    "reports",
    type=click.Path(),
    multiple=True,
    help="Write what was found: .json, .csv for a row per point, .html, or a map: .png, .svg, .pdf. May be repeated.",
)
tool = click.option(
    "--tool",
    type=ToolShape(),
    metavar="D[,R[,TAPER[,LENGTH]]]",
    help="Shape of the tool: diameter, corner radius, taper in degrees, length. [default: that of the file]",
)
stations = click.option(
    "--stations", type=click.IntRange(1, 1_000_000), default=2000, show_default=True, help="Places along the path."
)
levels = click.option(
    "--levels", type=click.IntRange(1, 60), default=7, show_default=True, help="Points along the cutting edge."
)
plot_path = click.option(
    "--plot", type=click.Path(), help="Draw the path, its corners and its deviation: .png, .svg or .pdf."
)
plot_deviation = click.option(
    "--plot",
    type=click.Path(),
    help="Draw the deviation along the path: .png, .svg or .pdf.",
)
plot_motion = click.option(
    "--plot",
    type=click.Path(),
    help="Draw speed and acceleration over time: .png, .svg or .pdf.",
)
as_json = click.option("--json", "as_json", is_flag=True, help="One JSON object instead of text to read.")
table = click.option(
    "--table", is_flag=True, help="Print the table of the name: what a TOML file of your own starts from."
)
law = click.option(
    "--law",
    type=click.Choice(["direct_exact_stop", "direct_velocity_jump", *METHODS, "as_written"]),
    default=DEFAULT_METHOD,
    show_default=True,
    help="Motion that --csv writes.",
)
motion_csv = click.option("--csv", type=click.Path(), help="Write the motion, a row every period.")
limits_machine = click.option(
    "--machine",
    type=str,
    metavar="NAME|FILE",
    help="Keep the limits of this machine's five axes, too: a name that 'cornersmooth machines' lists (its numbers are "
    "examples), or a TOML file with [dynamics.X] and so on.",
)

text = click.option(
    "--text",
    type=click.Path(),
    metavar="NC",
    help="Plan this NC text, too, as its control would run it: its lines, digits and feeds.",
)
text_machine = click.option(
    "--text-machine", type=str, metavar="NAME|FILE", help="Machine whose rotary words --text has, if it has such."
)
block_time = click.option(
    "--block-time", type=Duration(), default=0.0, help="Shortest time that the control takes for one block of --text."
)
look_ahead = click.option(
    "--look-ahead",
    type=click.IntRange(min=1),
    metavar="BLOCKS",
    help="Blocks within which the control must be able to stop; all of --text by default.",
)

_LIMITS = {
    "feed": click.option(
        "--feed", type=float, metavar="MM/MIN", help="Feed of all feed moves instead of the programmed ones."
    ),
    "accel": click.option(
        "--accel", type=float, default=1000.0, show_default=True, metavar="MM/S2", help="Acceleration along the path."
    ),
    "jerk": click.option(
        "--jerk", type=float, default=5000.0, show_default=True, metavar="MM/S3", help="Jerk along the path."
    ),
    "centripetal": click.option(
        "--centripetal", type=float, metavar="MM/S2", help="Acceleration across the path. [default: that of --accel]"
    ),
    "period": click.option(
        "--period",
        type=Duration(),
        default=0.002,
        metavar="TIME",
        help="Interpolation period, as in 2ms: at corners that stay sharp the velocity changes by at most accel times "
        "period. [default: 2ms]",
    ),
    "rapid": click.option(
        "--rapid", type=float, default=10000.0, show_default=True, metavar="MM/MIN", help="Speed of rapid moves."
    ),
    "rapid_accel": click.option(
        "--rapid-accel", type=float, metavar="MM/S2", help="Acceleration of rapids. [default: that of --accel]"
    ),
    "rapid_jerk": click.option(
        "--rapid-jerk", type=float, metavar="MM/S3", help="Jerk of rapids. [default: that of --jerk]"
    ),
    "angular_feed": click.option(
        "--angular-feed",
        type=float,
        default=30.0,
        show_default=True,
        metavar="DEG/S",
        help="Speed of moves that only turn the tool axis.",
    ),
    "angular_accel": click.option(
        "--angular-accel", type=float, default=150.0, show_default=True, metavar="DEG/S2", help="Their acceleration."
    ),
    "angular_jerk": click.option(
        "--angular-jerk", type=float, default=3000.0, show_default=True, metavar="DEG/S3", help="Their jerk."
    ),
    "vector_jerk": click.option(
        "--vector-jerk", type=float, metavar="MM/S3", help="Jerk of the tip in any direction. [default: no limit]"
    ),
    "turn_speed": click.option(
        "--turn-speed", type=float, metavar="DEG/S", help="Turning of the tool axis in all moves. [default: no limit]"
    ),
    "turn_accel": click.option(
        "--turn-accel", type=float, metavar="DEG/S2", help="Its acceleration. [default: no limit]"
    ),
    "turn_jerk": click.option("--turn-jerk", type=float, metavar="DEG/S3", help="Its jerk. [default: no limit]"),
}
_READING = {
    "format": input_format,
    "dialect": dialect,
    "units": units,
    "arc_rule": arc_rule,
    "lenient": lenient,
}
_SETTINGS = {
    "tolerance": tolerance,
    "axis_length": axis_length,
    "method": method,
    "shape": shape,
    "allocation": allocation,
    "weights": weights,
    "orientation_tolerance": orientation_tolerance,
    "reversal_angle": reversal_angle,
    "lines": lines,
    "chord_tolerance": chord_tolerance,
    "axis_step": axis_step,
}


def reading(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that reads CL files."""
    return _apply(function, _READING.values())


def reading_of(given: dict[str, Any]) -> dict[str, Any]:
    """Keyword arguments of `cornersmooth.read` that were given."""
    return {name: given[name] for name in _READING}


def writing(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that writes NC text, besides its form."""
    return _apply(
        function,
        (control, machine, no_tcp, extras, program_name, work_offset, header, footer, block_numbers, no_comments),
    )


def limits(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options that say what a machine can do."""
    return _apply(function, _LIMITS.values())


def limits_of(given: dict[str, Any]) -> Limits:
    """What the machine can do, as given."""
    from cornersmooth.feedrate import Limits

    return Limits(**{name: given[name] for name in _LIMITS})


def settings_of(given: dict[str, Any]) -> Settings:
    """How to smooth, as given; options that a command does not have keep their defaults."""
    from cornersmooth.settings import Settings

    return Settings(**{name: given[name] for name in _SETTINGS if name in given})


def control_of(given: Mapping[str, Any]) -> Control:
    """Control of that name, of that file, or of the shop settings."""
    from cornersmooth.nc import load_control

    control: str | Control = given["control"]
    return load_control(control) if isinstance(control, str) else control


def machine_of(given: Mapping[str, Any]) -> Machine | None:
    """Machine of that name, of that file, or of the shop settings; None where none is named."""
    from cornersmooth.kinematics import load_machine

    machine: str | Machine | None = given["machine"]
    return load_machine(machine) if isinstance(machine, str) and machine else machine or None


def reading_back_of(given: Mapping[str, Any]) -> dict[str, Any]:
    """Keyword arguments of `cornersmooth.nc_reader.read_nc` for a text that somebody wrote.

    Raises
    ------
    SettingsError
        CS204: nobody knows how the control's text is read; or the control or the machine is unknown.
    """
    from cornersmooth.nc_reader import CONTROLS

    control = control_of(given)
    if control.dialect not in CONTROLS:
        raise SettingsError(
            "CS204", f"{control.name} is like no control that can be read", 'say like = "fanuc" or another in it'
        )
    return {"control": control.dialect, "machine": machine_of(given), "tcp": not given["no_tcp"]}


def picture_form(path: str | None) -> str:
    """Form of the picture that a name asks for: png, svg or pdf."""
    suffix = os.path.splitext(path or "picture.png")[1].lower().lstrip(".")
    if suffix not in ("png", "svg", "pdf"):
        raise click.UsageError(f"--plot {path}: let the name end in .png, .svg or .pdf")
    return suffix


def _apply(function: Callable[..., Any], options: Iterable[Decorator]) -> Callable[..., Any]:
    for option in reversed(list(options)):
        function = option(function)
    return function
