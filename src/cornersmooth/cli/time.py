"""``cornersmooth time``: how long the program takes, directly and smoothed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import click
import numpy as np

from cornersmooth.cl import read
from cornersmooth.cli.files import check_inputs, check_path, read_head, write_report
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import print_message, progress_bar, say
from cornersmooth.errors import message
from cornersmooth.feedrate import BlockLimits, limiting, plan_text
from cornersmooth.frame import read_provenance
from cornersmooth.kinematics import machine_names
from cornersmooth.model import Move, Program
from cornersmooth.nc import fit_settings
from cornersmooth.nc_reader import read_nc
from cornersmooth.pipeline import read_back
from cornersmooth.report.verdict import limits_of, times_text
from cornersmooth.settings import METHODS
from cornersmooth.times import Comparison, Timing, compare, slowest, stops, turning_seconds, without_holes, written_text
from cornersmooth.times.comparing import law_of_lines

_TITLES = {
    "direct_exact_stop": "direct, exact stop",
    "direct_velocity_jump": "direct, velocity jump",
    **{name: f"curves, {name}" for name in METHODS},
    "as_written": "as written",
}
LAWS = tuple(_TITLES)


def run_time(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    inputs = [given.source, given.text] if given.text else [given.source]
    check_inputs(*inputs)
    if given.csv:
        check_path(given.csv, inputs, force=given.force)
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

        write_report(given.csv, timelaw_csv(compared.laws[given.law]))
    say(given, compared.as_dict(), _tables(compared, bool(given.verbose)))
    return 0


def _compare(data: bytes, name: str, given: Options) -> Comparison:
    machine, axes = given.load_machine(), given.load_limits()
    axes = machine if axes is None else axes
    limits, settings = given.path_limits(), given.settings()
    program = read(data, name=name, **given.reading())
    if given.text:  # before anything that takes long
        how = _as_text_was_made(given).reading_back()
        nc = read_nc(given.text, **how, tolerance=settings.tolerance, axis_length=settings.axis_scale)
    else:
        form = given.choose_form()
        fitted = fit_settings(settings, form, program.units)
        nc = read_back(written_text(without_holes(program.with_feed(given.feed)), fitted, form), form, fitted)
    if not given.quiet:
        _tell_feeds(program, given.feed)
    methods = tuple(METHODS) if given.verbose else tuple(name for name in METHODS if name == given.law)
    with progress_bar(given.quiet) as progress:
        compared = compare(program, settings, limits, methods=methods, machine=axes, progress=progress)
        blocks = BlockLimits(given.block_time or 0.0, given.look_ahead)
        law = plan_text(nc, limits, name=given.text or name, blocks=blocks, settings=settings, machine=axes)
        return compared.with_text(law)


def _by_own_law(data: bytes, name: str, given: Options) -> int:
    """Times of a control that plans lines by a law of its own."""
    program = without_holes(read(data, name=name, **given.reading()).with_feed(given.feed))
    form = given.choose_form()
    settings = fit_settings(given.settings(), form, program.units)
    timing = Timing.of(form, settings, axes=given.load_limits())
    if timing is None:
        raise click.UsageError("name the machine with --machine; its table has to have [dynamics]")
    if given.text:
        with open(given.text, "rb") as file:
            text = file.read()
    else:
        text = written_text(program, settings, form)
    before, against = timing.unsmoothed(program)
    seconds = timing.written(text, program)[0]
    law = law_of_lines(timing)
    contents = {"seconds": {"unsmoothed": before, "as_written": seconds}, "unsmoothed": against, "law": law}
    lines = (f"{before:>12.3f} s  {against}", f"{seconds:>12.3f} s  as written", law)
    say(given, {"schema": "cornersmooth-time/1", **contents}, lines)
    return 0


def _as_text_was_made(given: Options) -> Options:
    """Options to read the text by: the machine of its own option, else of its head, else the one planned for."""
    made = read_provenance(read_head(given.text))
    machine = given.text_machine or given.machine
    if made is not None and not given.text_machine and made.machine in ("", *machine_names()):
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


def _tables(compared: Comparison, verbose: bool) -> Iterator[str]:
    """Times and savings; with `verbose` what was reached, and the places that lose most."""
    settings, saving = compared.settings, compared.saving_percent
    shown = times_text(compared.seconds, limiting(compared.laws["as_written"]))
    yield f"{shown}; {limits_of(None if compared.machine is None else compared.machine.name)}"
    own = settings.axis_tolerance
    second = f"axis point at {settings.axis_length:g} mm" if own is None else f"tool axis {own:g} deg"
    yield f"tolerance {settings.tolerance:g} mm, {second}"
    yield f"{'':<22}{'time s':>10}{'saves % of':>11}{'saves % of':>14}{'stops':>6}{'turns s':>8}{'path mm':>9}"
    yield f"{'':<22}{'':>10}{'exact stop':>11}{'velocity jump':>14}"
    for name, law in compared.laws.items():
        saved = saving.get(name, {})
        parts = "".join(
            f"{saved[base]:>{width}.1f}" if base in saved else f"{'':>{width}}"
            for base, width in zip(LAWS[:2], (11, 14), strict=True)
        )
        shown = f"{stops(law):>6}{turning_seconds(law):>8.1f}{law.length:>9.1f}"
        yield f"{_TITLES[name]:<22}{law.total:>10.3f}{parts}{shown}"
    yield f"{'at constant feed':<22}{compared.constant_feed_seconds:>10.3f}"
    if not verbose:
        return
    for name in ("direct_velocity_jump", "as_written"):
        yield ""
        yield f"where the time goes ({_TITLES[name]})"
        yield f"{'line':>8}{'x':>12}{'y':>12}{'z':>12}{'time s':>10}{'lost s':>10}{'least mm/s':>12}"
        for place in slowest(compared.laws[name]):
            yield (
                f"{place.line:>8}{place.x:>12.3f}{place.y:>12.3f}{place.z:>12.3f}"
                f"{place.seconds:>10.3f}{place.lost_seconds:>10.3f}{place.slowest_mm_per_s:>12.2f}"
            )
