"""``cornersmooth time``, ``compare`` and ``setup``: how long programs take, which suits a part, and how to clamp it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, get_args

import click
import numpy as np

from cornersmooth.cl import read
from cornersmooth.cli import files
from cornersmooth.cli.options import Options, typed
from cornersmooth.cli.show import print_message, progress_bar, say, say_line
from cornersmooth.errors import command_text, message
from cornersmooth.feedrate import BlockLimits, direct, limiting, plan_text
from cornersmooth.feedrate.planner import Baseline
from cornersmooth.frame import read_provenance
from cornersmooth.kinematics import machine_names
from cornersmooth.model import Floats, Move, Program
from cornersmooth.nc import choose_form, fit_settings
from cornersmooth.nc_reader import read_nc
from cornersmooth.pipeline import read_back, stage_of
from cornersmooth.report.verdict import limits_of, limits_text, times_text
from cornersmooth.system.processes import useful_processes
from cornersmooth.times import (
    AS_WRITTEN,
    BASELINES,
    Comparison,
    Timing,
    faster_method,
    stops,
    without_holes,
    written_text,
)
from cornersmooth.times.comparing import Row, Table, candidates, compare_programs, law_of_lines
from cornersmooth.times.setup import Rating, Setups, find_setups

_TITLES = {
    "direct_exact_stop": "direct, exact stop",
    "direct_velocity_jump": "direct, velocity jump",
    "as_written": "as written",
}


def run_time(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    if given.text:
        files.check_pair(given)
    else:
        files.check_inputs(given.source)
    if given.csv:
        files.check_path(given.csv, [given.source, given.text], force=given.force)
    data, name, is_program = given.read()
    if is_program:
        if given.csv:
            raise click.UsageError("--csv: of an NC program only the times are told")
        from cornersmooth.cli.filter import time_of_program

        return time_of_program(data, name, given)
    control = given.load_control()
    if control.lines.planner:
        if given.csv:
            raise click.UsageError(f"--csv: {control.name} plans by a law of its own, which gives times only")
        return _by_own_law(data, name, given)
    compared = _compare(data, name, given)
    if given.csv:
        from cornersmooth.report.tables import timelaw_csv

        files.write_report(given.csv, timelaw_csv(compared.laws[given.law]))
    if given.csv != files.STANDARD:
        say(given, compared.as_dict(), _tables(compared))
    return 0


def _compare(data: bytes, name: str, given: Options) -> Comparison:
    machine, axes = given.load_machine(), given.load_limits()
    axes = machine if axes is None else axes
    limits, settings = given.path_limits(), given.settings()
    program = read(data, name=name, **given.reading())
    if given.text:  # before anything that takes long
        text, written = files.read_input(given.text)
        how = _as_text_was_made(given, text).reading_back()
        nc = read_nc(text, **how, name=written, tolerance=settings.tolerance, axis_length=settings.axis_scale)
    else:
        form, own = given.choose_form(), without_holes(program.with_feed(given.feed))
        if (named := given.load_limits()) is not None:  # as `smooth` does
            settings = faster_method(own, settings, form, named)
        fitted = fit_settings(settings, form, program.units)
        nc = read_back(written_text(own, fitted, form), form, fitted)
    if not given.quiet:
        _tell_feeds(program, given.feed)
    with progress_bar(given.quiet) as progress:
        laws = {
            name: direct(program, limits, kind, settings=settings, machine=axes, progress=stage_of(progress, name))
            for name, kind in zip(BASELINES, get_args(Baseline), strict=True)
        }
        blocks = BlockLimits(given.block_time or 0.0, given.look_ahead)
        laws[AS_WRITTEN] = plan_text(
            nc, limits, name=given.text or name, blocks=blocks, settings=settings, machine=axes
        )
    return Comparison(program, settings, limits, laws, axes)


def _by_own_law(data: bytes, name: str, given: Options) -> int:
    """Times of a control that plans lines by a law of its own."""
    program = without_holes(read(data, name=name, **given.reading()).with_feed(given.feed))
    form = given.choose_form()
    settings = fit_settings(given.settings(), form, program.units)
    timing = Timing.of(form, settings, axes=given.load_limits())
    if timing is None:
        raise click.UsageError("name the machine with --machine; its table has to have [dynamics]")
    if given.text:
        text, _ = files.read_input(given.text)
    else:
        text = written_text(program, settings, form)
    before, against = timing.unsmoothed(program)
    seconds = timing.written(text, program)[0]
    law = law_of_lines(timing)
    contents = {"seconds": {"unsmoothed": before, "as_written": seconds}, "unsmoothed": against, "law": law}
    lines = (f"{before:>12.3f} s  {against}", f"{seconds:>12.3f} s  as written", law)
    say(given, {"schema": "cornersmooth-time/1", **contents}, lines)
    return 0


def _as_text_was_made(given: Options, text: bytes) -> Options:
    """Options to read the text by: the machine of its head, else that of --machine."""
    made, machine = read_provenance(text), given.machine
    if made is not None and made.machine in ("", *machine_names()):
        machine = made.machine or None  # another name is that of a file of the user's own
    return replace(given, machine=machine, no_tcp=made is not None and not made.tcp)


def _tell_feeds(program: Program, feed: float | None) -> None:
    """Say that the CL file has no feed for some moves, and that of the command line is taken."""
    without = np.flatnonzero(np.isnan(program.feed) & (program.kind != Move.RAPID))
    if feed is None or not len(without):  # without any feed the planning itself refuses
        return
    what = f"feed move without a feed in the CL file, planned with --feed {feed:g} mm/min"
    place = f"{program.source.name}:{program.line[without[0]]}"
    print_message(message("warning", what, "CS311", place=place, count=len(without)))


def _tables(compared: Comparison) -> Iterator[str]:
    """Times and savings."""
    settings, saving = compared.settings, compared.saving_percent
    shown = times_text(compared.seconds, limiting(compared.laws["as_written"]))
    yield f"{shown}; {limits_of(None if compared.machine is None else compared.machine.name)}"
    own = settings.axis_tolerance
    second = f"axis point at {settings.axis_length:g} mm" if own is None else f"tool axis {own:g} deg"
    yield f"tolerance {settings.tolerance:g} mm, {second}"
    yield f"{'':<22}{'time s':>10}{'saves % of':>11}{'saves % of':>14}{'stops':>6}{'path mm':>9}"
    yield f"{'':<22}{'':>10}{'exact stop':>11}{'velocity jump':>14}"
    for name, law in compared.laws.items():
        saved = saving.get(name, {})
        parts = "".join(
            f"{saved[base]:>{width}.1f}" if base in saved else f"{'':>{width}}"
            for base, width in zip(BASELINES, (11, 14), strict=True)
        )
        shown = f"{stops(law):>6}{law.length:>9.1f}"
        yield f"{_TITLES[name]:<22}{law.total:>10.3f}{parts}{shown}"
    yield f"{'at constant feed':<22}{compared.constant_feed_seconds:>10.3f}"


#: options of this command that `smooth` has not, or that would write
_OWN = frozenset(("as_json", "verbose", "quiet", "machine", "limits", "source", "look_ahead"))


def run_compare(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from cornersmooth.cli.filter import axes_of, how_read, options_for
    from cornersmooth.filter.program import compare_filtered

    source = given.source
    files.check_inputs(source)
    data, name, is_program = given.read()
    named, given = given.machine, options_for(data, name, given) if is_program else given
    machine, limits = given.load_machine(), given.load_limits()
    axes = axes_of(given)
    control, settings = given.load_control(), given.settings()
    with files.naming(name), progress_bar(given.quiet or not given.as_json) as progress:
        if is_program:  # it has one kind of words, and lines
            tried = candidates(control, settings, machine)
            tried = [one for one in tried if one.form.machine == machine and not one.form.curves]
        else:
            program = read(data, name=name, **given.reading()).with_feed(given.feed)
            tried = candidates(control, settings, limits if machine is None else machine)
        columns = zip(_HEAD, *(_cells(Row.of(one)) for one in tried), strict=True)
        widths = [max(room, *map(len, column)) for room, column in zip(_ROOM, columns, strict=True)]

        def watch(table: Table) -> None:
            """Print each row as soon as it is there."""
            if progress is not None:
                progress("programs", len(table.rows), len(tried))
            if not given.as_json and not given.quiet:
                row = table.rows[-1] if table.rows else None
                for line in () if row else _head(table, given.verbose):
                    say_line(line)
                cells = zip(_cells(row) if row else _HEAD, widths, strict=True)
                wrong = "" if row is None or row.usable else f"  {row.verdict}"
                say_line("  ".join(f"{one:<{width}}" for one, width in cells).rstrip() + wrong)

        if is_program:
            table = compare_filtered(data, tried, axes, **how_read(given), watch=watch)
        else:
            blocks = BlockLimits(look_ahead=given.look_ahead)
            table = compare_programs(program, tried, axes, blocks, watch=watch)
    machine_named = named or given.limits
    made_by = ("filter", os.path.splitext(source)[1]) if is_program else ("smooth", control.layout.suffix)
    commands = [_command(given, row, machine_named, *made_by) for row in table.rows]
    contents = table.as_dict()
    for row, text in zip(contents["rows"], commands, strict=True):
        row["command"] = text
    say(given, contents, _end(table, commands))
    return 0


#: columns and the room of their numbers; that of the others follows from the rows
_HEAD = ("form", "words", "method", "lines", "blocks", "kB", "s", "saves", "tip mm", "axis mm")
_ROOM = (0, 0, 0, 0, 9, 6, 8, 5, 7, 7)


def _head(table: Table, verbose: int) -> Iterator[str]:
    """What holds for all rows."""
    if table.share < 1.0:
        yield f"from {100.0 * table.share:.2g} % of the poses: whole runs from the middle of the part"
    if verbose:
        yield f"law of lines: {table.law}"
    yield f"unsmoothed: {table.unsmoothed:.1f} s{', ' + table.against if table.against else ''}; saves in %"


def _end(table: Table, commands: list[str]) -> Iterator[str]:
    """The best rows and their commands."""
    if not table.gains:
        yield "leave it as it is: no program takes less time than the unsmoothed lines"
    both = {"best in lines": table.best_in_lines, "best of all": table.best}
    for name, number in both.items():
        if number is not None and not (name == "best in lines" and number == table.best):
            row = table.rows[number]
            yield f"{name}: {row.seconds:.1f} s"
            yield f"  {commands[number]}"
            if reached := limits_text(row.limits):
                yield f"  {reached.removeprefix('; ')}"


def _cells(row: Row) -> tuple[str, ...]:
    words = (row.form, row.words.removeprefix("rotary words of "), row.method, row.lines)
    if row.seconds is None or row.saved is None or row.tip is None:
        return (*words, *[""] * 6)
    share = 100.0 * row.saved / (row.seconds + row.saved) if row.seconds + row.saved else 0.0
    return (
        *words,
        f"{row.blocks:,}",
        f"{row.bytes / 1000.0:.0f}",
        f"{'~' * row.about}{row.seconds:.1f}",
        f"{round(share)}",
        f"{row.tip:.4f}",
        "" if row.axis_point is None else f"{row.axis_point:.4f}",
    )


def _command(given: Options, row: Row, machine: Any, command: str, suffix: str) -> str:
    """Options that were typed, and those of the row; a machine is called as the user has called it."""
    words: list[str] = []
    for option in click.get_current_context().command.params:
        name = str(option.name)
        if not isinstance(option, click.Option) or name in _OWN or not typed(name):
            continue
        spelled = option.opts[-1]
        value = getattr(given, name)
        for one in value if option.multiple else (value,):
            if option.is_flag:
                words.append(spelled)
            else:
                parts = one if isinstance(one, tuple) else (getattr(one, "name", one),)  # a control of one's own
                words += [spelled, ",".join(f"{part:.12g}" if isinstance(part, float) else str(part) for part in parts)]
    called = machine if isinstance(machine, str) else getattr(machine, "name", "")
    options = list(row.options)
    if "--machine" in options:
        options[options.index("--machine") + 1] = called
    stem = "part" if given.source == files.STANDARD else os.path.splitext(os.path.basename(given.source))[0]
    target = stem + (".smooth" if command == "filter" else "") + suffix
    return command_text(["cornersmooth", command, given.source, *words, *options, "-o", target])


#: savings of less are none, %
_WORTH = 0.1


def run_setup(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    machine = given.load_limits()
    control = given.load_control()
    wanted = control.forms.get(given.form or "")
    curves = wanted is not None and bool(wanted.curve)  # have no rotary words
    form = choose_form(control, given.form, machine=None if curves else machine)
    data, name = files.read_input(given.source, size_limit=not given.no_size_limit)
    with progress_bar(given.quiet) as progress:
        found = find_setups(
            read(data, name=name, **given.reading()).with_feed(given.feed),
            form,
            given.settings(),
            given.path_limits(),
            axes=machine,
            tilt=given.tilt,
            turns=not given.no_turn,
            plans=given.plans,
            processes=useful_processes(),
            progress=progress,
        )
    say(given, found.as_dict(), _setup_lines(found, "the machine" if machine is None else machine.name))
    return 0


def _setup_lines(found: Setups, machine: str) -> Iterator[str]:
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
        yield _setup_row(found, one) + ("    today" if one is today else "")
    yield "Degrees: the part is turned about Z, then tilted about X, then about Y, the axes of the machine, all about"
    yield f"{_point(found.pivot)} of the part, the middle of the cuts."
    if found.out_of_reach:
        yield f"{found.out_of_reach} setups are beyond the travel or the rotary limits of {machine}."
    yield "Fixture, reach of the tool and collisions are not looked at: they are yours."


def _setup_row(found: Setups, one: Rating) -> str:
    setup, zero = one.setup, found.zero(one.setup)
    angles = f"{setup.turn:>8g}{setup.tilt_x:>8g}{setup.tilt_y:>8g}"
    saves = "" if found.today.why else f"{round(found.saving(one), 1) + 0.0:.1f}"
    times = f"{'out of reach':>20}" if one.why else f"{one.seconds:>11.3f}{saves:>9}"
    return f"{angles}{times}    {_point(zero)}"


def _point(place: Floats) -> str:
    return "X{:.3f} Y{:.3f} Z{:.3f}".format(*(place.round(3) + 0.0))
