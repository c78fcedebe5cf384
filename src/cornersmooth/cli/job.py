"""One input from reading to report: what `smooth` does for each file, in this process or another."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from cornersmooth.cli.files import REJECTED, STANDARD, ClosedPipe, check_output, open_output, read_input
from cornersmooth.errors import CornersmoothError, Finding, InputError, OutputError, SettingsError

if TYPE_CHECKING:
    from cornersmooth.nc import Form, Frame

#: how the reports of earlier runs begin; such files are replaced without being asked
_OUR_JSON = b'{\n "schema": "cornersmooth-report/'
_OUR_CSV = b"corner,line,x,y,z,tip_angle_deg,"

#: exit code for a fault of the program itself
EXIT_INTERNAL = 70

#: problems of a rejected file that are printed
_PROBLEMS_SHOWN = 5

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Writing:
    """What is asked for the NC text.

    Parameters
    ----------
    control : str
        Name or TOML file.
    form : str or None
        None for the control's default.
    machine : str or None
        Name or TOML file.
    tcp : bool
        Whether the control keeps the tool tip.
    extras : tuple of str
        Functions of the control that are switched on.
    program : str or None
        Name of the NC program.
    header, footer : tuple of str
        Lines behind the head and before the tail.
    comments : bool
        Whether what the CL file says in words is written.
    """

    control: str = "fanuc"
    form: str | None = None
    machine: str | None = None
    tcp: bool = True
    extras: tuple[str, ...] = ()
    program: str | None = None
    block_numbers: bool = False
    header: tuple[str, ...] = ()
    footer: tuple[str, ...] = ()
    comments: bool = True

    def choose(self) -> Form:
        """Form of the control.

        Raises
        ------
        SettingsError
            Unknown names, or what the control cannot run.
        """
        from cornersmooth.kinematics import load_machine
        from cornersmooth.nc import choose_form

        machine = load_machine(self.machine) if self.machine else None
        return choose_form(self.control, self.form, machine=machine, tcp=self.tcp, extras=self.extras)

    def frame(self) -> Frame:
        """What stands around the motion."""
        from cornersmooth.nc import Frame

        return Frame(self.program, self.block_numbers, self.header, self.footer, self.comments)


@dataclass(frozen=True)
class Job:
    """What to do with one input; every field survives the way to another process.

    Parameters
    ----------
    source, target : str
        Input and NC file; ``-`` for the standard streams.
    reports : tuple of str
    reading : dict
        Keyword arguments of `cornersmooth.cl.read`.
    settings : dict
        Keyword arguments of `Settings`.
    writing : Writing
    feed : float or None, mm/min
        For moves without one.
    alone : bool
        Whether no other job runs at the same time: verification may use all processors.
    """

    source: str
    target: str
    reports: tuple[str, ...]
    reading: dict[str, Any]
    settings: dict[str, Any]
    writing: Writing
    feed: float | None
    force: bool
    verify: bool = True
    alone: bool = False


@dataclass
class Outcome:
    """What became of a job: the report, or the error."""

    job: Job
    exit_code: int = 0
    message: str = ""
    contents: dict[str, Any] = field(default_factory=dict)


def check(job: Job) -> None:
    """Refuse what would fail later or destroy something; nothing is read or written."""
    outputs = [job.target, *job.reports]
    check_output(job.target, [job.source], force=job.force)
    for path in job.reports:
        suffix = os.path.splitext(path)[1].lower()
        if suffix not in (".json", ".csv"):
            raise SettingsError("CS221", f"cannot tell the form of the report {path}", "let it end in .json or .csv")
        check_output(path, [job.source], force=job.force, ours=_OUR_JSON if suffix == ".json" else _OUR_CSV)
    real = [os.path.realpath(path) for path in outputs if path != "-"]
    if len(set(real)) < len(real):
        raise SettingsError("CS222", "two outputs have the same name", "give each its own")


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Read, smooth, write, report; errors of the input or output become part of the outcome.

    `ClosedPipe` and KeyboardInterrupt pass through.
    """
    outcome = Outcome(job)
    try:
        check(job)
        outcome.contents = _smooth_file(job, progress)
        if not outcome.contents.get("verification", {"passed": True})["passed"]:
            outcome.exit_code = 1
            outcome.message = _say_rejected(job, outcome.contents["verification"])
    except CornersmoothError as failure:
        outcome.exit_code = failure.exit_code
        outcome.message = str(failure)
    except MemoryError:
        outcome.exit_code = 3
        outcome.message = f"{job.source}: error: not enough memory for this file; cut it at a tool change"
    except Exception as failure:
        if isinstance(failure, ClosedPipe):
            raise
        outcome.exit_code = EXIT_INTERNAL
        outcome.message = internal_error(failure, job.source)
    return outcome


def internal_error(failure: Exception, source: str = "") -> str:
    """Text for an error that is a fault of the program."""
    last = traceback.extract_tb(failure.__traceback__)[-1]
    place = f"{os.path.basename(last.filename)}:{last.lineno}"
    return (
        f"{source + ': ' if source else ''}error: internal error, {type(failure).__name__} at {place}: {failure}; "
        "please report it with the input file"
    )


def _smooth_file(job: Job, progress: Progress | None) -> dict[str, Any]:
    import numpy as np

    from cornersmooth.cl import read
    from cornersmooth.cli.readback import readback
    from cornersmooth.nc import fit_settings, write
    from cornersmooth.report import corners_csv, report, report_json
    from cornersmooth.settings import Settings
    from cornersmooth.smoothing import smooth

    seconds: dict[str, float] = {}

    def step(stage: str) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda done, total: progress(stage, done, total)

    form = job.writing.choose()
    how = readback(job.writing.control, form.machine if form.rotary else None, tcp=form.orientation != "machine")
    unread = "" if how.control else "its table is like no control whose text is known"
    unread = unread if job.verify else "not asked for"
    with _timed(seconds, "read"):
        data, name = read_input(job.source)
        program = read(data, name=name, **job.reading)
        del data
        if job.feed is not None:
            program = replace(program, feed=np.where(np.isnan(program.feed), job.feed, program.feed))
    settings = fit_settings(Settings(**job.settings), form, program.units)
    with _timed(seconds, "smooth"):
        smoothed = smooth(program, settings, progress=step("smoothing"))
    verification: dict[str, Any] | None = None
    with open_output(job.target, hold=not unread) as output, ExitStack() as stack:
        verifier = None
        if not unread:
            from cornersmooth.verify import Verifier
            from cornersmooth.verify.processes import useful_processes

            verifier = stack.enter_context(
                Verifier(
                    program,
                    output.path,
                    tolerance=settings.verified_tolerance,
                    axis_length=settings.axis_length,
                    words=not how.own,
                    processes=useful_processes() if job.alone else 1,
                    **how.reading,
                )
            )
        with _timed(seconds, "write"):
            written = write(smoothed, output.stream, form=form, frame=job.writing.frame(), progress=step("writing"))
            output.stream.flush()
        if verifier is not None:
            with _timed(seconds, "verify"):
                try:
                    verified = verifier.result()
                    verification = verified.to_dict()
                    output.rejected = not verified.passed
                except InputError as failure:
                    if not (job.writing.header or job.writing.footer or how.own):
                        raise
                    where = "a table of your own" if how.own else "header and footer"
                    unread = f"{failure.what} in line {failure.line}; {where} may hold any words"
    findings = written.findings
    if job.verify and unread:
        findings += (Finding("CS509", "note", 0, f"the text is not read back: {unread}"),)
    dense = not form.curve
    contents = report(
        smoothed,
        dense=dense,
        blocks_out=written.blocks,
        seconds=seconds,
        findings=findings,
        verification=verification,
    )
    for path in job.reports:
        with open_output(path) as output:
            texts = (
                iter([report_json(contents)]) if path.lower().endswith(".json") else corners_csv(smoothed, dense=dense)
            )
            for text in texts:
                output.stream.write(text.encode("utf-8", "backslashreplace"))  # names need not be UTF-8
    return contents


def _say_rejected(job: Job, verification: dict[str, Any]) -> str:
    """Say what verification found, and where the text is now."""
    source = "<stdin>" if job.source == STANDARD else job.source
    lines = [
        f"{source}:{problem['cl_line']}: error: {problem['text']} (NC line {problem['nc_line']})"
        for problem in verification["problems"][:_PROBLEMS_SHOWN]
    ]
    more = verification["problem_count"] - len(lines)
    if more > 0:
        lines.append(f"{source}: {more} more; a JSON report lists them")
    kept = "nothing was written" if job.target == STANDARD else f"the text is in {job.target}{REJECTED}"
    lines.append(f"{source}: error: the written text breaks its promise; {kept}")
    return "\n".join(lines)


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    begin = time.perf_counter()
    yield
    seconds[stage] = round(time.perf_counter() - begin, 6)


def make_folder(path: str) -> None:
    """Make the folder for the outputs.

    Raises
    ------
    OutputError
        It cannot be made.
    """
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as failure:
        raise OutputError(
            "CS405", f"cannot make the folder: {failure.strerror}", "choose another", file=path
        ) from failure
