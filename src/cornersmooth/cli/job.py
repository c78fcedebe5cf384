"""One input of the command line: what to do with it, and what became of it, in this process or another."""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from cornersmooth import __version__
from cornersmooth.cl import read
from cornersmooth.cl.apt import refuse_program
from cornersmooth.cli.files import STILL, Input, check_path, read_input, suffix_of, target_of, write_reports
from cornersmooth.cli.options import POINTS, Options
from cornersmooth.cli.show import more
from cornersmooth.errors import (
    EXIT_INTERNAL,
    CornersmoothError,
    InputError,
    OutputError,
    Verdict,
    VerdictError,
    internal_error,
    message,
    printable,
)
from cornersmooth.kinematics import Machine, with_dynamics
from cornersmooth.model import Move
from cornersmooth.nc import Form, Frame
from cornersmooth.pipeline import Progress, Result, postprocess, timed
from cornersmooth.report import corners_csv
from cornersmooth.report.verdict import Saving
from cornersmooth.settings import TIMED_POSES, Settings
from cornersmooth.system.output import ClosedPipe, make_folder, read_mark, write_mark
from cornersmooth.system.processes import return_large_arrays, useful_processes

if TYPE_CHECKING:
    from cornersmooth.feedrate import Limits

#: how the reports of earlier runs begin; such files are replaced without --force
_OURS = {
    ".json": b'{\n "schema": "cornersmooth-report/',
    ".csv": b"corner,line,x,y,z,tip_angle_deg,",
    ".html": b"<!doctype html>\n<!-- cornersmooth page -->\n",
}

#: what becomes of a file: a verdict, nothing as before, or none of both
STATUSES = (*map(str, Verdict), "skipped", "error", "not done")

#: problems of a program that are printed
_PROBLEMS_SHOWN = 5


@dataclass(frozen=True)
class Job(Input):
    """What to do with one input; every field survives the way to another process."""

    given: Options
    settings: Settings
    form: Form
    frame: Frame
    alone: bool = False  #: whether no other job runs at the same time: verification may use all processors
    axes: Machine | None = None  #: whose limits, in place of those of the machine of the form
    #: Within which the feeds of the blocks are planned; None for the programmed ones.
    plan_feeds: Limits | None = None
    in_memory: bool = False  #: whether the program goes to the outcome, in place of the target
    #: name of a run that does a file again where a worker was lost, although that may have written it; empty for none
    run: str = ""
    loosened: str = ""  #: what settings made looser than the default; the line of the verdict says it
    command: str = ""  #: command line, for reports

    @property
    def batch(self) -> bool:
        """Whether it is one of a batch: folders are made, and an output of the same input and settings stays."""
        return bool(self.given.directory)


@dataclass
class Outcome:
    """What became of a job: the report, or the error."""

    job: Job
    exit_code: int = 0
    message: str = ""
    error: CornersmoothError | None = None  #: why there is no report
    contents: dict[str, Any] = field(default_factory=dict)
    #: why nothing had to be done
    skipped: str = ""
    #: the verdict in one line, of an earlier run where nothing had to be done; empty where there is none
    verdict_text: str = ""
    #: whether the run was interrupted before it came to an end
    unfinished: bool = False
    #: planned times
    saving: Saving | None = None
    #: time of each stage, s
    seconds: Mapping[str, float] = field(default_factory=dict)
    text: bytes = b""  #: the program, of a job in memory

    @property
    def verdict(self) -> str:
        """The word of it; empty where there is none."""
        return next((str(word) for word in Verdict if self.verdict_text.startswith(word)), "")

    @property
    def status(self) -> str:
        """What became of it: ``skipped``, a verdict, or ``error`` where it did not come to one, or ``not done``."""
        return "not done" if self.unfinished else "skipped" if self.skipped else self.verdict or "error"


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Read, smooth, write, report; errors of the input or output become part of the outcome.

    KeyboardInterrupt passes through, and `ClosedPipe` where it is not one of a batch.
    """
    return_large_arrays()
    outcome = Outcome(job)
    try:
        _smooth_file(job, outcome, progress)
    except CornersmoothError as failure:
        outcome.error = failure
    except MemoryError:
        outcome.error = InputError("", "not enough memory for this file", "cut it at a tool change", file=job.source)
    except ClosedPipe:
        if not job.batch:
            raise
        outcome.error = OutputError("", "the reader of an output has gone", "run it again", file=job.source)
    except Exception as failure:
        outcome.exit_code = EXIT_INTERNAL
        outcome.message = internal_error(failure, job.source)
    if outcome.error is not None:
        outcome.exit_code, outcome.message = outcome.error.exit_code, str(outcome.error)
    return outcome


def _made_of(job: Job, source: bytes) -> str:
    """Hash of all that the program of a job depends on, in hexadecimal digits: the same settings have the same."""
    given = job.given
    wanted = (given.no_verify, given.strict, given.feed, job.plan_feeds)
    digest = hashlib.sha256(source).hexdigest()
    parts = (__version__, digest, given.reading(), job.settings, job.form, job.frame, job.axes, *wanted)
    return hashlib.sha256(json.dumps(parts, default=_plain, sort_keys=True).encode()).hexdigest()


def _plain(value: object) -> object:
    """What JSON has words for, of a record, a mapping, a set or an array; it does not depend on any order or place."""
    if is_dataclass(value):
        return {item.name: getattr(value, item.name) for item in fields(value)}
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, (set, frozenset)):
        return sorted(map(str, value))
    return value.tolist() if hasattr(value, "tolist") else repr(value)


def _smooth_file(job: Job, outcome: Outcome, progress: Progress | None) -> None:
    """Make text and reports; the outcome gets what there is of them, and why there was nothing to do."""
    given = job.given
    source, name = read_input(job.source, size_limit=not given.no_size_limit)
    if given.dialect != POINTS:  # what is wrong with the input comes before what is wrong with the output
        refuse_program(source, name)
    force: bool | None = given.force
    made_of = ""
    if job.batch:
        made_of = _made_of(job, source)
        before = None if force else read_mark(job.target)
        if before is not None:
            force = before.get("made_of") == made_of
            again = job.run and before.get("run") == job.run
            if force and not again and all(map(os.path.exists, job.reports)):
                outcome.skipped, outcome.verdict_text = "nothing has changed", before.get("verdict", "")
                return
        force = force if force or before is not None else None  # a file of which nothing is known may be the same
        for path in job.outputs:
            make_folder(os.path.dirname(path) or ".")
    check_path(job.target, [job.source], force=force)
    replace = {
        path: check_path(path, [job.source], force=given.force, beginning=_OURS[suffix_of(path)])
        for path in job.reports
    }
    reading: dict[str, float] = {}
    with timed(reading, "read", progress):
        processes = useful_processes() if job.alone else 1
        program = read(source, name=name, processes=processes, **given.reading()).with_feed(given.feed)
    del source  # as large as all that is made of it
    settings = job.settings
    if job.axes is not None and job.plan_feeds is None:  # under limits those of the method whose lines are faster
        from cornersmooth.times import faster_method

        settings = faster_method(program, settings, form=job.form, axes=job.axes)
    text = io.BytesIO()
    try:
        result = postprocess(
            program,
            text if job.in_memory else target_of(job.target),
            settings,
            form=job.form,
            frame=job.frame,
            plan_feeds=job.plan_feeds,
            verify=not given.no_verify,
            strict=given.strict,
            force=force,
            continuity=bool(job.reports) or given.as_json,
            processes=processes,
            progress=progress,
        )
    except VerdictError as failure:
        result = failure.result
        outcome.exit_code = failure.exit_code
        outcome.message = _failed(name, result, failure)
    else:
        if made_of:
            mark = {"made_of": made_of, "run": job.run, "verdict": result.judgement.text}
            write_mark(job.target, result.sha256, mark)
    outcome.text = text.getvalue()
    outcome.seconds = {**result.seconds, **reading}
    outcome.verdict_text = "; ".join(filter(None, (result.judgement.text, job.loosened)))
    with_page = any(suffix_of(path) == ".html" for path in job.reports)
    timed_too = given.time or (len(program) <= TIMED_POSES and (with_page or not (given.quiet or job.batch)))
    machine = result.form.machine if job.axes is None else job.axes
    timed_too = timed_too and with_dynamics(machine) is not None
    if timed_too and result.verdict in (Verdict.PASSED, Verdict.INCOMPLETE):
        from cornersmooth.times import planned_saving

        settings = result.smoothed.settings
        outcome.saving = planned_saving(program, settings, result.form, axes=job.axes, progress=progress)

    def page() -> str:
        from cornersmooth.page import smoothed_page

        return smoothed_page(result, contents, axes=job.axes, saving=outcome.saving, tool=given.tool)

    contents = result.report(command=job.command, loosened=job.loosened, saving=outcome.saving, limits=job.axes)
    outcome.contents = contents
    table = partial(corners_csv, result.smoothed, dense=not result.form.curve)
    still = STILL * bool((program.kind == Move.FROM).all())
    write_reports(replace, contents, table=table, page=page, no_page=still)


def _failed(name: str, result: Result, failure: VerdictError) -> str:
    """What verification found, and where the text is now."""
    found = result.verification
    problems = found.problems[:_PROBLEMS_SHOWN] if found is not None else ()
    lines = [problem.message(f"{name}:{problem.cl_line}", f"NC line {problem.nc_line}") for problem in problems]
    if found is not None and (rest := found.problem_count - len(lines)) > 0:
        lines.append(printable(f"{name}: {more(rest, 'problem')}; a JSON report lists them"))
    lines.append(message("error", failure.what, code=failure.code, hint=failure.hint, place=name))
    return "\n".join(lines)
