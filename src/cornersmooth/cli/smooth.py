"""``cornersmooth smooth``: CL files in, NC text and reports out."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn

import click

from cornersmooth.cli.batch import Batch
from cornersmooth.cli.files import STANDARD, check_inputs, check_path, read_lines
from cornersmooth.cli.inputs import Input, check_together, find_inputs, named_input
from cornersmooth.cli.job import Job, Outcome, run_job
from cornersmooth.cli.options import motion, nc_text, outputs, reading, smoothing, surface
from cornersmooth.cli.options.parameters import PATH
from cornersmooth.cli.shop import ShopCommand, command_line, loosened
from cornersmooth.cli.show import (
    more,
    print_line,
    print_message,
    progress_bar,
    say_json,
    show_findings,
    show_summary,
    show_verdict,
    warn,
)
from cornersmooth.cli.shutdown import Shutdown
from cornersmooth.cli.summary import batch_report, check_summary, end_lines, interrupted_line, line_of, write_summary
from cornersmooth.errors import printable
from cornersmooth.output import make_folder
from cornersmooth.verdict import Verdict

if TYPE_CHECKING:
    from cornersmooth.nc import Form, Frame

#: files named in a warning
_NAMED = 3


@click.command(
    "smooth",
    cls=ShopCommand,
    epilog="Exit codes: 0 done; 1 the program FAILED, or is not PASSED under --strict; 2 wrong usage or configuration; "
    "3 input cannot be read or is not valid; 4 output cannot be written. With several inputs: that of the worst.",
)
@click.argument("inputs", type=PATH, nargs=-1, required=True, metavar="IN...")
@smoothing.tolerance
@outputs.output
@nc_text.form
@smoothing.axis_length
@smoothing.axis_tolerance
@outputs.directory
@outputs.glob
@outputs.skip_existing
@outputs.summary
@outputs.jobs
@outputs.scheduler
@outputs.reports
@outputs.as_json
@surface.tool
@nc_text.writing_options
@smoothing.method
@smoothing.curve_options
@smoothing.line_options
@reading.feed
@motion.planned_feed_options
@motion.limits
@motion.planned_time
@reading.reading_options
@reading.tool_options
@nc_text.no_verify
@nc_text.strict
@outputs.force
@outputs.quiet
@outputs.verbose
@click.pass_obj
def command(ending: Shutdown, /, inputs: tuple[str, ...], **given: Any) -> int:
    """Round the corners of the CL files IN and write NC programs.

    IN is an APT/CL file (NX, CATIA, Creo, ...) or a table of points (x y z i j k, or two points); - is standard input.
    The written path stays within the tolerance of the CL path, at the tool tip and at the axis point.

    \b
    Examples:
      cornersmooth smooth part.cls -e 0.04 -o part.nc
      cornersmooth smooth part.cls -e 0.04 -o part.nc --report part.html
      cornersmooth smooth part.cls -e 0.04 -f g6.2 -o part.nc --report part.csv
      cornersmooth smooth part.cls --control siemens -f bspline -o part.mpf
      cornersmooth smooth part.cls --method global -f g6.2 -o part.nc
      cornersmooth smooth part.cls --control linuxcnc --machine xyzac-trt -o p.ngc
      cornersmooth smooth part.ncl -e 0.0005in -H 25 -o part.nc
      cornersmooth smooth *.cls -e 0.04 -d out/ -j 2
      cornersmooth smooth cl/ -e 0.04 -d nc/ -j --summary made.csv
      cat part.cls | cornersmooth smooth - -e 0.04 > part.nc
    """
    jobs = _make_jobs(inputs, given)
    quiet, verbose = given["quiet"], given["verbose"]
    if len(jobs) == 1 and not given["directory"]:
        check_inputs(jobs[0].source)
        with progress_bar(quiet or (jobs[0].target == STANDARD and _to_terminal())) as progress:  # a bar eats lines
            outcome = run_job(jobs[0], progress)
        if outcome.held_back and not quiet:
            print_line(f"... {more(outcome.held_back, 'line')}; -o FILE writes them, -o - shows them all")
        told = outcome.contents and not quiet and not given["as_json"]
        if told:
            show_verdict(outcome.contents, outcome.saving)
        _tell(outcome, quiet, verbose, alone=True)
        if outcome.contents and given["as_json"]:
            say_json(outcome.contents)
        if told:
            show_summary(outcome.contents, outcome.seconds, verbose)
        return outcome.exit_code
    worst = 0
    with progress_bar(quiet, rate=True) as progress:
        batch = Batch(jobs, given["jobs"], progress, scheduler=given["scheduler"] or "")

        def keep() -> None:
            if given["summary"]:
                write_summary(given["summary"], batch.rows())

        def lines() -> Iterator[str]:
            if not quiet:
                yield from map(printable, end_lines(batch.rows()))

        ending.keep = keep
        ending.say = lambda: "\n".join((*lines(), interrupted_line(batch.rows())))
        for outcome in batch.run(ending):
            told = outcome.status != "error" and not quiet and (progress is None or verbose > 0)
            if told:
                print_line(line_of(outcome))
            _tell(outcome, quiet, verbose, told)
            worst = max(worst, outcome.exit_code)
    ending.keep = None
    keep()
    if given["as_json"]:
        say_json(batch_report(batch.rows()))
    else:
        for line in lines():
            print_line(line)
    return worst


def _tell(outcome: Outcome, quiet: bool, verbose: int, told: bool = False, *, alone: bool = False) -> None:
    """Print what went wrong and what was noticed; where no line has told the verdict, any but a plain PASSED."""
    if outcome.message:
        print_message(outcome.message)
    elif (
        not told
        and (quiet or outcome.job.batch)
        and (outcome.verdict not in ("", Verdict.PASSED) or (outcome.contents and outcome.job.loosened))
    ):
        print_line(f"{outcome.job.source}: {outcome.verdict_text}")
    if outcome.contents and not quiet:
        findings = outcome.contents["findings"]
        if alone:  # the verdict has told what is to be checked
            findings = [finding for finding in findings if not finding["to_check"]]
        show_findings(outcome.job.source, findings, verbose)


def _make_jobs(inputs: tuple[str, ...], given: dict[str, Any]) -> list[Job]:
    """One job for every input, all of them checked for names that clash."""
    from cornersmooth.nc import fit_settings
    from cornersmooth.settings import TIMED_POSES

    folder, output = given["directory"], given["output"]
    _check_usage(inputs, given)
    files = find_inputs(inputs, given["glob"]) if folder else [named_input(path) for path in inputs]
    _check_side_outputs(files, given)
    settings, form, frame = smoothing.settings_of(given), _form(given), _frame(given)
    fit_settings(settings, form, "mm")  # refuses wrong ones before any file is touched
    jobs = []
    for found in files:
        target = os.path.join(folder, found.stem + form.table.layout.suffix) if folder else output or STANDARD
        jobs.append(
            Job(
                source=found.path,
                target=target,
                reports=tuple(path.replace("{stem}", found.stem) for path in given["reports"]),
                reading=reading.reading_of(given),
                settings=settings,
                form=form,
                frame=replace(frame, stem="" if found.path == STANDARD else os.path.basename(found.stem)),
                feed=given["feed"],
                plan_feeds=motion.planned_limits_of(given),
                force=given["force"],
                verify=not given["no_verify"],
                strict=given["strict"],
                alone=len(files) == 1,
                batch=bool(folder),
                skip_existing=given["skip_existing"],
                tool=given["tool"],
                beginning=not folder and not output and _to_terminal(),
                plan=sys.maxsize if given["time"] else TIMED_POSES,
                timed=given["time"] or not (given["quiet"] or folder),
                axes=nc_text.machine_of(given, "limits"),
                loosened=loosened(settings.tolerance),
                command=command_line(),
            )
        )
    _check_targets(jobs)
    _check_against_inputs(jobs)
    if not given["quiet"]:
        _tell_same_programs(jobs)
    if folder:
        make_folder(folder)
    return jobs


def _check_usage(inputs: tuple[str, ...], given: dict[str, Any]) -> None:
    """Refuse options that do not go together, or not with so many inputs."""
    folder = given["directory"]
    check_together(inputs, given)
    if given["as_json"] and not folder and given["output"] in (None, STANDARD):
        raise click.UsageError("--json needs -o FILE or -d FOLDER: standard output is for the JSON object")
    if given["summary"] and not folder:
        raise click.UsageError("--summary is for batches, which need -d FOLDER; --report tells of a single file")
    if given["scheduler"] and (not folder or given["jobs"] != 1):
        raise click.UsageError("--scheduler is for batches, which need -d FOLDER and take no -j")
    if given["feed"] is not None and not 0.0 < given["feed"] < 1e6:
        raise click.UsageError("--feed must be a positive number of mm/min")


def _check_side_outputs(files: list[Input], given: dict[str, Any]) -> None:
    """Refuse a summary or reports that cannot be written for these files."""
    if given["summary"]:
        check_summary(given["summary"])
        check_path(given["summary"], [found.path for found in files], force=True)
    if len(files) > 1 and any("{stem}" not in path for path in given["reports"]):
        raise click.UsageError("with several inputs a report needs {stem} in its name, as in 'out/{stem}.json'")


def _form(given: dict[str, Any]) -> Form:
    """Form of the control."""
    from cornersmooth.nc import choose_form

    machine = nc_text.machine_of(given)
    return choose_form(
        nc_text.control_of(given),
        given["form"],
        machine=machine,
        tcp=not given["no_tcp"],
        extras=given["extras"],
        digits=given["digits"],
        rewind=given["rewind"] or 0.0,
        planes=given["planes"] == "tilted",
    )


def _frame(given: dict[str, Any]) -> Frame:
    """What stands around the motion, with the texts of header and footer."""
    from cornersmooth.nc import Frame

    return Frame(
        given["program_name"],
        given["block_numbers"],
        header=read_lines(given["header"]) if given["header"] else (),
        footer=read_lines(given["footer"]) if given["footer"] else (),
        comments=not given["no_comments"],
        skip_cycles=given["skip_cycles"],
        cycles=given["cycles"],
        modal=given["modal"],
        line_ends=given["line_ends"],
        approach=given["approach"] or 0.0,
        retract=given["retract"] or 0.0,
        work_offset="" if given["work_offset"] == "none" else given["work_offset"],
    )


def _check_targets(jobs: list[Job]) -> None:
    """Refuse two outputs of one name."""
    by_target: dict[str, Job] = {}
    for job in jobs:
        for path in (job.target, *job.reports):
            if path == STANDARD:
                continue
            if path in by_target:
                _refuse_clash(by_target[path], job, path)
            by_target[path] = job


def _tell_same_programs(jobs: list[Job]) -> None:
    """Say which programs a control would take for the same one."""
    sources: dict[str, list[str]] = {}
    for job in jobs:
        if (name := job.frame.kept_as(job.form)) is not None:
            sources.setdefault(name, []).append(job.source)
    for name, same in sources.items():
        if len(same) > 1:
            others = f" and {more(len(same) - _NAMED, 'file')}" if len(same) > _NAMED else ""
            warn(
                f"{', '.join(same[:_NAMED])}{others}: all become program {name}, and a control keeps one of "
                "them; let the names of the files end in different numbers, or give each its --program-name"
            )


def _refuse_clash(one: Job, other: Job, path: str) -> NoReturn:
    if one is other:
        raise click.UsageError(f"{path} is the name of two outputs; give each its own")
    if os.path.realpath(one.source) == os.path.realpath(other.source):
        raise click.UsageError(f"{one.source} is named twice; name it once")
    raise click.UsageError(
        f"{one.source} and {other.source} would both be written to {path}; rename one, or give each a -d of its own"
    )


def _check_against_inputs(jobs: list[Job]) -> None:
    """No output of one job may be the input of another."""
    sources = {name for job in jobs for name in _names(job.source)}
    for job in jobs:
        for path in (job.target, *job.reports):
            if path != STANDARD and not sources.isdisjoint(_names(path)):
                check_path(path, [other.source for other in jobs], force=True)


def _names(path: str) -> list[object]:
    """What tells a file from others: its place, and where it exists, its number."""
    if path == STANDARD:
        return []
    try:
        found = os.stat(path)
    except OSError:
        return [os.path.realpath(path)]
    return [os.path.realpath(path), (found.st_dev, found.st_ino)]


def _to_terminal() -> bool:
    return sys.stdout is not None and sys.stdout.isatty()
