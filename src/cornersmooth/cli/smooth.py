"""``cornersmooth smooth``: CL files in, NC programs and reports out."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from cornersmooth.cli import show
from cornersmooth.cli.files import STANDARD, check_endings, check_inputs, check_path, find_inputs, read_lines
from cornersmooth.cli.job import Job, Outcome, run_job
from cornersmooth.cli.options import Options
from cornersmooth.cli.shop import command_line, loosened
from cornersmooth.errors import Verdict, printable
from cornersmooth.nc import Frame, fit_settings
from cornersmooth.system.output import make_folder

if TYPE_CHECKING:
    from cornersmooth.cli import Shutdown

#: files named in a warning
_NAMED = 3

#: lines of a program that a terminal is shown without -o
_LINES_SHOWN = 20


def run_smooth(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    jobs = _make_jobs(given)
    if len(jobs) == 1 and not given.directory:
        return _alone(jobs[0])

    from cornersmooth.cli import batch

    ending: Shutdown = click.get_current_context().obj
    worst = 0
    with show.progress_bar(given.quiet, rate=True) as progress:
        rows = [batch.row_of(Outcome(job, unfinished=True)) for job in jobs]

        def keep() -> None:
            if given.summary:
                batch.write_summary(given.summary, rows)

        def lines() -> list[str]:
            return [] if given.quiet else [*map(printable, batch.end_lines(rows))]

        ending.keep = keep
        ending.say = lambda: "\n".join((*lines(), batch.interrupted_line(rows)))
        scheduler = given.scheduler if given.jobs == 1 else None
        for outcome in batch.run_batch(jobs, rows, ending, given.jobs, scheduler, progress):
            printed = outcome.status != "error" and not given.quiet and (progress is None or given.verbose > 0)
            if printed:
                show.print_line(batch.line_of(outcome))
            _print_notes(outcome, printed)
            worst = max(worst, outcome.exit_code)
    ending.keep = None
    keep()
    if given.as_json:
        show.say_json(batch.batch_report(rows))
    else:
        for line in lines():
            show.print_line(line)
    return worst


def _alone(job: Job) -> int:
    """Do the only job; return the exit code."""
    given = job.given
    check_inputs(job.source)
    with show.progress_bar(given.quiet or (job.target == STANDARD and _to_terminal())) as progress:  # a bar eats lines
        outcome = run_job(job, progress)
    if outcome.text:
        shown = outcome.text.splitlines(keepends=True)
        sys.stdout.buffer.write(b"".join(shown[:_LINES_SHOWN]))
        sys.stdout.buffer.flush()
        if len(shown) > _LINES_SHOWN and not given.quiet:
            show.print_line(
                f"... {show.more(len(shown) - _LINES_SHOWN, 'line')}; -o FILE writes them, -o - shows them all"
            )
    printed = outcome.contents and not given.quiet and not given.as_json
    if printed:
        show.show_verdict(outcome.contents, outcome.saving)
    _print_notes(outcome)
    contents = outcome.contents or (show.error_contents(outcome.error) if outcome.error else {})
    if contents and given.as_json:
        show.say_json(contents)
    if printed:
        show.show_summary(outcome.contents, outcome.seconds, given.verbose)
    return outcome.exit_code


def _print_notes(outcome: Outcome, printed: bool = False) -> None:
    """Print what went wrong and what was noticed; where no line has the verdict, any but a plain PASSED."""
    job, given = outcome.job, outcome.job.given
    if outcome.message:
        show.print_message(outcome.message)
    elif (
        not printed
        and (given.quiet or job.batch)
        and (outcome.verdict not in ("", Verdict.PASSED) or (outcome.contents and job.loosened))
    ):
        show.print_line(f"{job.source}: {outcome.verdict_text}")
    if outcome.contents and not given.quiet:
        findings = outcome.contents["findings"]
        if not job.batch:  # the verdict has what is to be checked
            findings = [finding for finding in findings if not finding["to_check"]]
        show.show_findings(job.source, findings, given.verbose)


def _make_jobs(given: Options) -> list[Job]:
    """One job for every input, all of them checked for names that clash."""
    folder = given.directory
    _check_usage(given)
    settings, form, frame = given.settings(), given.choose_form(), _frame(given)
    files = find_inputs(given, suffix=form.table.layout.suffix)
    if given.summary:
        check_path(given.summary, [found.source for found in files], force=True)
    fit_settings(settings, form, "mm")  # refuses wrong ones before any file is touched
    jobs = [
        Job(
            **vars(found),
            given=given,
            settings=settings,
            form=form,
            frame=replace(frame, stem="" if found.source == STANDARD else os.path.basename(found.stem)),
            plan_feeds=given.planned_limits(),
            alone=len(files) == 1,
            in_memory=not folder and not given.output and _to_terminal(),
            axes=given.load_limits(),
            loosened=loosened(settings.tolerance),
            command=command_line(),
        )
        for found in files
    ]
    if not given.quiet:
        _warn_of_same_programs(jobs)
    if folder:
        make_folder(folder)
    return jobs


def _check_usage(given: Options) -> None:
    """Refuse options that do not go together."""
    folder = given.directory
    check_endings("report", given.reports, ".json, .csv or .html")
    if given.as_json and not folder and given.output in (None, STANDARD):
        raise click.UsageError("--json needs -o FILE or -d FOLDER: standard output is for the JSON object")
    if given.summary and not folder:
        raise click.UsageError("--summary is for batches, which need -d FOLDER; --report tells of a single file")
    check_endings("summary", [given.summary] if given.summary else [], ".json or .csv")
    if given.feed is not None and not 0.0 < given.feed < 1e6:
        raise click.UsageError("--feed must be a positive number of mm/min")


def _frame(given: Options) -> Frame:
    """What stands around the motion, with the texts of header and footer."""
    return Frame(
        given.program_name,
        header=read_lines(given.header) if given.header else (),
        footer=read_lines(given.footer) if given.footer else (),
        comments=not given.no_comments,
        approach=given.approach or 0.0,
        retract=given.retract or 0.0,
        work_offset="" if given.work_offset == "none" else given.work_offset,
        **{name: getattr(given, name) for name in ("block_numbers", "skip_cycles", "cycles", "modal", "line_ends")},
    )


def _warn_of_same_programs(jobs: list[Job]) -> None:
    """Say which programs a control would take for the same one."""
    sources: dict[str, list[str]] = {}
    for job in jobs:
        if (name := job.frame.kept_as(job.form)) is not None:
            sources.setdefault(name, []).append(job.source)
    for name, same in sources.items():
        if len(same) > 1:
            others = f" and {show.more(len(same) - _NAMED, 'file')}" if len(same) > _NAMED else ""
            show.warn(
                f"{', '.join(same[:_NAMED])}{others}: all become program {name}, and a control keeps one of "
                "them; let the names of the files end in different numbers, or give each its --program-name"
            )


def _to_terminal() -> bool:
    return sys.stdout is not None and sys.stdout.isatty()
