"""``cornersmooth time``: how long the program takes, directly and smoothed."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli import options
from cornersmooth.cli.files import check_output, open_output, read_input
from cornersmooth.cli.show import progress_bar

if TYPE_CHECKING:
    from cornersmooth.feedrate import Comparison

_READING = ("dialect", "units", "arc_rule", "lenient")
_SETTINGS = (
    "tolerance",
    "axis_length",
    "shape",
    "allocation",
    "weights",
    "orientation_tolerance",
    "reversal_angle",
)
_LIMITS = (
    "feed",
    "accel",
    "jerk",
    "centripetal",
    "rapid",
    "rapid_accel",
    "rapid_jerk",
    "angular_feed",
    "angular_accel",
    "angular_jerk",
    "vector_jerk",
    "turn_speed",
    "turn_accel",
    "turn_jerk",
    "period",
)
LAWS = ("direct_exact_stop", "direct_velocity_jump", "zhang2016", "proportional")
_TITLES = {
    "direct_exact_stop": "direct, exact stop",
    "direct_velocity_jump": "direct, velocity jump",
    "zhang2016": "smoothed, zhang2016",
    "proportional": "smoothed, proportional",
}


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


@click.command(
    "time",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit codes: 0 done; 2 wrong usage or configuration; 3 input cannot be read or is not valid; "
    "4 output cannot be written.",
)
@click.argument("source", metavar="IN")
@options.tolerance
@options.axis_length
@click.option("--feed", type=float, metavar="MM/MIN", help="Feed of all feed moves instead of the programmed ones.")
@click.option(
    "--accel", type=float, default=1000.0, show_default=True, metavar="MM/S2", help="Acceleration along the path."
)
@click.option("--jerk", type=float, default=5000.0, show_default=True, metavar="MM/S3", help="Jerk along the path.")
@click.option(
    "--centripetal", type=float, metavar="MM/S2", help="Acceleration across the path. [default: that of --accel]"
)
@click.option(
    "--period",
    type=Duration(),
    default=0.002,
    metavar="TIME",
    help="Interpolation period, as in 2ms: at corners that stay sharp the velocity changes by at most accel times "
    "period. [default: 2ms]",
)
@click.option("--rapid", type=float, default=10000.0, show_default=True, metavar="MM/MIN", help="Speed of rapid moves.")
@click.option("--rapid-accel", type=float, metavar="MM/S2", help="Acceleration of rapids. [default: that of --accel]")
@click.option("--rapid-jerk", type=float, metavar="MM/S3", help="Jerk of rapids. [default: that of --jerk]")
@click.option(
    "--angular-feed",
    type=float,
    default=30.0,
    show_default=True,
    metavar="DEG/S",
    help="Speed of moves that only turn the tool axis.",
)
@click.option(
    "--angular-accel", type=float, default=150.0, show_default=True, metavar="DEG/S2", help="Their acceleration."
)
@click.option("--angular-jerk", type=float, default=3000.0, show_default=True, metavar="DEG/S3", help="Their jerk.")
@click.option(
    "--vector-jerk", type=float, metavar="MM/S3", help="Jerk of the tip in any direction. [default: no limit]"
)
@click.option(
    "--turn-speed", type=float, metavar="DEG/S", help="Turning of the tool axis in all moves. [default: no limit]"
)
@click.option("--turn-accel", type=float, metavar="DEG/S2", help="Its acceleration. [default: no limit]")
@click.option("--turn-jerk", type=float, metavar="DEG/S3", help="Its jerk. [default: no limit]")
@click.option(
    "--machine",
    type=str,
    metavar="NAME|FILE",
    help="Keep the limits of this machine's five axes, too: a name that 'cornersmooth machines' lists (its numbers are "
    "examples), or a TOML file with [dynamics.X] and so on.",
)
@options.shape
@options.allocation
@options.weights
@options.orientation_tolerance
@options.reversal_angle
@options.reading
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of tables.")
@click.option(
    "--law", type=click.Choice(LAWS), default="proportional", show_default=True, help="Motion that --csv writes."
)
@click.option("--csv", type=click.Path(), help="Write the motion, a row every period.")
@click.option("--plot", type=click.Path(), help="Draw speed and acceleration over time: .png, .svg or .pdf.")
@options.force
@options.quiet
def command(source: str, **given: Any) -> int:
    """Plan the motion of the CL file IN directly and smoothed, under the same limits, and compare the times.

    The direct path is driven twice: with a stop at the end of every move, and with jumps of velocity at corners as far
    as the acceleration allows in one period. The smoothed path is that of each method. Delays, tool changes and the
    strokes of hole cycles are not counted. Limits are those of the tip; where it stands still while the axis turns the
    angular ones count (zhang2016 has such places where its transitions use up a short tip segment).

    \b
    Examples:
      cornersmooth time part.cls -e 0.04
      cornersmooth time part.cls -e 0.04 --feed 1800 --accel 1000 --jerk 5000 --period 2ms --json
      cornersmooth time part.cls -e 0.04 --csv motion.csv --plot motion.svg
      cornersmooth time part.cls -e 0.04 --machine mill.toml --csv axes.csv
    """
    form = _picture_form(given["plot"])
    for path in (given["csv"], given["plot"]):
        if path:
            check_output(path, [source], force=given["force"])
    compared = _compare(source, given)
    if given["csv"]:
        from cornersmooth.report.timelaw import timelaw_csv

        with open_output(given["csv"]) as output:
            for text in timelaw_csv(compared.laws[given["law"]]):
                output.stream.write(text.encode("utf-8"))
    if given["plot"]:
        from cornersmooth.report.timeplot import draw

        picture = draw({_TITLES[name]: compared.laws[name] for name in LAWS[1:]}, form)
        with open_output(given["plot"]) as output:
            output.stream.write(picture)
    if given["as_json"]:
        from cornersmooth.report.timelaw import comparison_json

        click.echo(comparison_json(compared.as_dict()), nl=False)
    elif not given["quiet"]:
        for line in _tables(compared):
            click.echo(line)
    return 0


def _picture_form(path: str | None) -> str:
    suffix = os.path.splitext(path or "picture.png")[1].lower().lstrip(".")
    if suffix not in ("png", "svg", "pdf"):
        raise click.UsageError(f"--plot {path}: let the name end in .png, .svg or .pdf")
    return suffix


def _compare(source: str, given: dict[str, Any]) -> Comparison:
    from cornersmooth.cl import read
    from cornersmooth.feedrate import Limits, compare
    from cornersmooth.kinematics import load_machine
    from cornersmooth.settings import Settings

    machine = load_machine(given["machine"]) if given["machine"] else None
    limits = Limits(**{name: given[name] for name in _LIMITS})
    settings = Settings(**{name: given[name] for name in _SETTINGS})
    data, name = read_input(source)
    program = read(data, name=name, format=given["input_format"], **{key: given[key] for key in _READING})
    del data
    with progress_bar(given["quiet"]) as progress:
        return compare(program, settings, limits, machine=machine, progress=progress)


def _tables(compared: Comparison) -> Iterator[str]:
    """Times and savings, then what was reached, then the places that lose most."""
    from cornersmooth.feedrate.compare import peaks, slowest, stops, turning_seconds

    settings, saving = compared.settings, compared.saving_percent
    yield f"tolerance {settings.tolerance:g} mm, axis point at {settings.axis_length:g} mm"
    yield f"{'':<24}{'time s':>12}{'saved %':>20}{'stops':>10}{'turning s':>12}{'length mm':>14}"
    yield f"{'':<24}{'':>12}{'of stops':>10}{'of jumps':>10}"
    for name, law in compared.laws.items():
        saved = saving.get(name, {})
        parts = "".join(f"{saved[base]:>10.1f}" if base in saved else f"{'':>10}" for base in LAWS[:2])
        yield (
            f"{_TITLES[name]:<24}{law.total:>12.3f}{parts}{stops(law):>10}{turning_seconds(law):>12.3f}"
            f"{law.length:>14.3f}"
        )
    yield f"{'at constant feed':<24}{compared.constant_feed_seconds:>12.3f}"
    yield ""
    yield f"{'reached':<24}{'mm/s':>12}{'mm/s2':>12}{'across':>12}{'mm/s3':>14}"
    for name, law in compared.laws.items():
        top = peaks(law)
        yield (
            f"{_TITLES[name]:<24}{top.speed_mm_per_s:>12.3f}{top.accel_mm_per_s2:>12.1f}"
            f"{top.centripetal_mm_per_s2:>12.1f}{top.jerk_mm_per_s3:>14.1f}"
        )
    if compared.machine is not None:
        yield ""
        yield from _axis_table(compared)
    for name in ("direct_velocity_jump", settings.method):
        yield ""
        yield f"where the time goes ({_TITLES[name]})"
        yield f"{'line':>8}{'x':>12}{'y':>12}{'z':>12}{'time s':>10}{'lost s':>10}{'least mm/s':>12}"
        for place in slowest(compared.laws[name]):
            yield (
                f"{place.line:>8}{place.x:>12.3f}{place.y:>12.3f}{place.z:>12.3f}"
                f"{place.seconds:>10.3f}{place.lost_seconds:>10.3f}{place.slowest_mm_per_s:>12.2f}"
            )


def _axis_table(compared: Comparison) -> Iterator[str]:
    """What each axis of the machine reaches of its speed, acceleration and jerk."""
    from cornersmooth.feedrate import axis_peaks
    from cornersmooth.kinematics.dynamics import LINEAR

    machine = "" if compared.machine is None else compared.machine.name
    found = {name: axis_peaks(law) for name, law in compared.laws.items()}
    first = next(iter(found.values()))
    yield f"reached of the limits of {machine}, %: speed, acceleration, jerk"
    yield f"{'':<24}" + "".join(f"{peak.name:>17}" for peak in first)
    for name, axes in found.items():
        told = ("".join(f"{100.0 * used:>5.0f}" for used in peak.used) for peak in axes)
        yield f"{_TITLES[name]:<24}" + "".join(f"{text:>17}" for text in told)
    for order, per in enumerate(("s", "s2", "s3")):
        units = (f"{peak.limits[order]:g} {'mm' if peak.name in LINEAR else 'deg'}/{per}" for peak in first)
        yield f"{('limits' if not order else ''):<24}" + "".join(f"{text:>17}" for text in units)
