"""``cornersmooth compare``: which form, method and line density suit a part, as written."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterator
from typing import Any

import click

from cornersmooth.cl import read
from cornersmooth.cli.files import check_inputs, check_path, told_of, write_report
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import progress_bar, say
from cornersmooth.errors import command_text
from cornersmooth.feedrate import BlockLimits
from cornersmooth.report.verdict import limits_text
from cornersmooth.times.comparing import Row, Table, candidates, compare_programs

#: options of this command that `smooth` has not, or that would write
_OWN = frozenset(("as_json", "csv", "verbose", "quiet", "force", "machine", "limits", "source", "look_ahead"))


def run_compare(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from cornersmooth.cli.filter import axes_of, how_read, options_for
    from cornersmooth.filter.program import compare_filtered

    source = given.source
    check_inputs(source)
    if given.csv:
        check_path(given.csv, [source], force=given.force)
    data, name, is_program = given.read()
    named, given = given.machine, options_for(data, name, given) if is_program else given
    machine, limits = given.load_machine(), given.load_limits()
    axes = axes_of(given)
    control, settings = given.load_control(), given.settings()
    with told_of(name), progress_bar(given.quiet) as progress:
        step = None if progress is None else lambda done, total: progress("programs", done, total)
        if is_program:  # it has one kind of words, and lines
            tried = candidates(control, settings, machine)
            tried = [one for one in tried if one.form.machine == machine and not one.form.curves]
            table = compare_filtered(data, tried, axes, **how_read(given), progress=step)
        else:
            program = read(data, name=name, **given.reading()).with_feed(given.feed)
            tried = candidates(control, settings, limits if machine is None else machine)
            blocks = BlockLimits(look_ahead=given.look_ahead)
            table = compare_programs(program, tried, axes, blocks, wider=bool(given.verbose), progress=step)
    machine_named = named or given.limits
    made_by = ("filter", os.path.splitext(source)[1]) if is_program else ("smooth", control.layout.suffix)
    commands = [_command(given, row, machine_named, *made_by) for row in table.rows]
    if given.csv:
        write_report(given.csv, [_csv(table, commands)])
    contents = table.as_dict()
    for row, text in zip(contents["rows"], commands, strict=True):
        row["command"] = text
    say(given, contents, _lines(table, commands, bool(given.verbose)))
    return 0


def _lines(table: Table, commands: list[str], verbose: bool) -> Iterator[str]:
    if table.share < 1.0:
        yield f"from {100.0 * table.share:.2g} % of the poses: whole runs from the middle of the part"
    if verbose:
        yield f"law of lines: {table.law}"
    yield f"unsmoothed: {table.unsmoothed:.1f} s{', ' + table.against if table.against else ''}; saves in %"
    widths = [max(len(str(cell)) for cell in column) for column in zip(*map(_cells, table.rows), strict=True)]
    head = ("form", "words", "method", "lines", "blocks", "kB", "s", "saves", "tip mm", "axis mm")
    widths = [max(width, len(title)) for width, title in zip(widths, head, strict=True)]
    yield "  " + "  ".join(f"{title:<{width}}" for title, width in zip(head, widths, strict=True)).rstrip()
    best = table.best
    for number, row in enumerate(table.rows):
        cells = "  ".join(f"{cell:<{width}}" for cell, width in zip(_cells(row), widths, strict=True))
        verdict = "" if row.usable else f"  {row.verdict}"
        yield f"{'* ' if number == best else '  '}{cells.rstrip()}{verdict}"
    if not table.gains:
        yield "leave it: no program takes less time than the unsmoothed lines"
    if best is not None:
        yield f"* {commands[best]}"
        if reached := limits_text(table.rows[best].limits):
            yield f"  {reached.removeprefix('; ')}"
    if table.wider is not None:
        gain = table.wider_gain
        yield (
            f"twice the tolerance would save {100.0 * gain:.0f} %" if gain else "twice the tolerance would gain nothing"
        )


def _words(row: Row) -> str:
    return row.words.removeprefix("rotary words of ")


def _cells(row: Row) -> tuple[str, ...]:
    if row.seconds is None or row.saved is None or row.tip is None:
        return (row.form, _words(row), row.method, row.lines, *[""] * 6)
    share = 100.0 * row.saved / (row.seconds + row.saved) if row.seconds + row.saved else 0.0
    return (
        row.form,
        _words(row),
        row.method,
        row.lines,
        f"{row.blocks:,}",
        f"{row.bytes / 1000.0:.0f}",
        f"{row.seconds:.1f}",
        f"{share:.0f}",
        f"{row.tip:.4f}",
        "" if row.axis_point is None else f"{row.axis_point:.4f}",
    )


def _command(given: Options, row: Row, machine: Any, command: str, suffix: str) -> str:
    """Options that were typed, and those of the row; a machine is called as the user has called it."""
    context, typed = click.get_current_context(), []
    for option in context.command.params:
        name = str(option.name)
        from_user = context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE
        if not isinstance(option, click.Option) or name in _OWN or not from_user:
            continue
        spelled = option.opts[-1]
        value = getattr(given, name)
        for one in value if option.multiple else (value,):
            if option.is_flag:
                typed.append(spelled)
            else:
                number = ",".join(f"{part:g}" for part in one) if isinstance(one, tuple) else one
                typed += [spelled, f"{number:g}" if isinstance(number, float) else str(number)]
    called = machine if isinstance(machine, str) else getattr(machine, "name", "")
    options = list(row.options)
    if "--machine" in options:
        options[options.index("--machine") + 1] = called
    target = os.path.splitext(os.path.basename(given.source))[0] + (".smooth" if command == "filter" else "") + suffix
    return command_text(["cornersmooth", command, given.source, *typed, *options, "-o", target])


def _csv(table: Table, commands: list[str]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        "form,words,method,lines,verdict,blocks,bytes,seconds,saved,tip_mm,axis_point_mm,best,command".split(",")
    )
    for number, (row, text) in enumerate(zip(table.rows, commands, strict=True)):
        numbers = (row.blocks, row.bytes, row.seconds, row.saved, row.tip, row.axis_point)
        writer.writerow([row.form, row.words, row.method, row.lines, row.verdict, *numbers, number == table.best, text])
    return stream.getvalue()
