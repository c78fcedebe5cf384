"""``cornersmooth setup``: how to clamp a part so that its program runs fastest."""

from __future__ import annotations

from collections.abc import Iterator

from cornersmooth.cl import read
from cornersmooth.cli.files import read_input
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import progress_bar, say
from cornersmooth.model import Floats
from cornersmooth.nc import choose_form
from cornersmooth.system.processes import useful_processes
from cornersmooth.times.setup import Rating, Setups, find_setups

#: savings of less are none, %
_WORTH = 0.1


def run_setup(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    machine = given.load_limits()
    form = choose_form(given.load_control(), given.form, machine=machine)
    data, name = read_input(given.source, size_limit=not given.no_size_limit)
    with progress_bar(given.quiet) as progress:
        found = find_setups(
            read(data, name=name, **given.reading()),
            form,
            given.settings(),
            given.path_limits(),
            tilt=given.tilt,
            turns=not given.no_turn,
            plans=given.plans,
            processes=useful_processes(),
            progress=progress,
        )
    say(given, found.as_dict(), _lines(found, "the machine" if machine is None else machine.name))
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
