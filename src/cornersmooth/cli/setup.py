"""``cornersmooth setup``: how to clamp a part so that its program runs fastest."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli import completing
from cornersmooth.cli.files import read_input
from cornersmooth.cli.headings import flag, option
from cornersmooth.cli.options import motion, nc_text, outputs, reading, smoothing
from cornersmooth.cli.options.parameters import PATH
from cornersmooth.cli.shop import ShopCommand
from cornersmooth.cli.show import progress_bar, say_json, say_line

if TYPE_CHECKING:
    from cornersmooth.model import Floats
    from cornersmooth.setup import Rating, Setups

#: savings of less are none, %
_WORTH = 0.1

limits = option(
    "Everyday",
    "--limits",
    required=True,
    metavar="NAME|FILE",
    shell_complete=completing.machines,
    help="Machine that the program runs on: a name that 'cornersmooth machines' lists (its numbers are examples), or a "
    "TOML file with [dynamics.X] and so on.",
)
tilt = option(
    "Limits",
    "--tilt",
    type=click.FloatRange(0.0, 90.0),
    default=45.0,
    metavar="DEG",
    help="Largest tilt about X and about Y, either way; 0 for none.",
)
no_turn = flag(
    "Limits", "--no-turn", help="Do not turn the part about Z. A table that turns without end does that itself."
)
plans = option("Limits", "--plans", type=click.IntRange(min=1), default=6, help="Setups that are planned as written.")


@click.command(
    "setup",
    cls=ShopCommand,
    epilog="Exit codes: 0 done; 2 wrong usage or configuration; 3 input cannot be read or is not valid.",
)
@click.argument("source", type=PATH, metavar="IN")
@limits
@smoothing.tolerance
@smoothing.axis_length
@smoothing.axis_tolerance
@nc_text.control
@nc_text.form
@tilt
@no_turn
@plans
@motion.limit_options
@smoothing.method
@smoothing.line_options
@reading.reading_options
@outputs.as_json
@outputs.quiet
def command(source: str, **given: Any) -> int:
    """Find how to clamp the part of the CL file IN so that its program takes the least time.

    The part is turned about Z and tilted about X and Y of the machine. Many setups are estimated; the best are
    smoothed, written and planned under the limits of the machine's axes, and compared with today's. Fixture, reach of
    the tool and collisions are not looked at: they are yours.

    \b
    Examples:
      cornersmooth setup part.cls --limits mill.toml
      cornersmooth setup part.cls --limits mill.toml --control siemens -f bspline
      cornersmooth setup part.cls --limits table-ac --tilt 20 --json
    """
    from cornersmooth.cl import read
    from cornersmooth.nc import choose_form
    from cornersmooth.processes import useful_processes
    from cornersmooth.setup import find_setups

    machine = nc_text.machine_of(given, "limits")
    form = choose_form(nc_text.control_of(given), given["form"], machine=machine)
    data, name = read_input(source, size_limit=not given["no_size_limit"])
    with progress_bar(given["quiet"]) as progress:
        found = find_setups(
            read(data, name=name, **reading.reading_of(given)),
            form,
            smoothing.settings_of(given),
            motion.limits_of(given),
            tilt=given["tilt"],
            turns=not given["no_turn"],
            plans=given["plans"],
            processes=useful_processes(),
            progress=progress,
        )
    if given["as_json"]:
        say_json(found.as_dict())
    elif not given["quiet"]:
        for line in _lines(found, "the machine" if machine is None else machine.name):
            say_line(line)
    return 0


def _lines(found: Setups, machine: str) -> Iterator[str]:
    """Setups as a table, then what their numbers mean."""
    today = found.today
    if found.tried == 1:
        yield "no other setup was tried: the table turns the part about Z by itself, and --tilt allows no tilt"
    elif not found.best:
        yield f"no other setup is within reach of {machine}, of {found.tried} that were tried"
    elif today.why:
        yield f"fastest setup of {found.tried}: {found.best[0].seconds:.3f} s; today's is out of reach: {today.why}"
    else:
        best, times = max(found.saving(one) for one in found.best), f"{today.seconds:.3f} s"
        if best < _WORTH:
            yield f"no setup of {found.tried} is faster than today's: {times}"
        else:
            yield f"fastest setup of {found.tried}: saves {best:.1f} % of {times}"
    yield f"{'turn Z':>8}{'tilt X':>8}{'tilt Y':>8}{'time s':>11}{'saves %':>9}    zero of the part moves by X Y Z, mm"
    rows = sorted([today, *found.best], key=lambda one: one.rank)
    for one in rows:
        yield _row(found, one) + ("    today" if one is today else "")
    yield "Degrees: the part is turned about Z, then tilted about X, then about Y, the axes of the machine, all about"
    yield f"{_point(found.pivot)} of the part, the middle of the cuts."
    if found.out_of_reach:
        yield f"{found.out_of_reach} setups are beyond the travel or the rotary limits of {machine}."
    yield "Fixture, reach of the tool and collisions are not looked at: they are yours."


def _row(found: Setups, one: Rating) -> str:
    setup, zero = one.setup, found.zero(one.setup)
    angles = f"{setup.turn:>8g}{setup.tilt_x:>8g}{setup.tilt_y:>8g}"
    saves = "" if found.today.why else f"{round(found.saving(one), 1) + 0.0:.1f}"
    times = f"{'out of reach':>20}" if one.why else f"{one.seconds:>11.3f}{saves:>9}"
    return f"{angles}{times}    {_point(zero)}"


def _point(place: Floats) -> str:
    return "X{:.3f} Y{:.3f} Z{:.3f}".format(*(place.round(3) + 0.0))
