"""The whole way from CL data to verified NC text: what the command does, as one call, and its first half.

Reading, smoothing, writing and verifying know nothing of one another; what one must know of the next (the digits that
will be written, how the text is to be read back) is put together here.
"""

from __future__ import annotations

import io
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cornersmooth import __version__, nc, smoothing
from cornersmooth.cl import read
from cornersmooth.errors import Finding, InputError, SettingsError, Verdict, VerdictError
from cornersmooth.frame import HEAD, NO_PARTS, Provenance
from cornersmooth.model import Move, Program, SmoothProgram
from cornersmooth.nc import Form, Frame, Written
from cornersmooth.nc.program_frame import blend_word
from cornersmooth.nc_reader import CONTROLS, NcProgram, read_nc
from cornersmooth.nc_reader.elements import Element
from cornersmooth.report import report
from cornersmooth.report.verdict import Judgement, Saving, judge, trusted_blocks
from cornersmooth.settings import AUTO, CURVES_METHOD, DEFAULT_METHOD, Settings
from cornersmooth.system.output import FAILED, Output, Target, check_output, open_output, path_of
from cornersmooth.system.processes import return_free_memory
from cornersmooth.verify import Trust, Verification, Verifier, useful_processes

if TYPE_CHECKING:
    from cornersmooth.feedrate import Limits
    from cornersmooth.kinematics import Machine

#: called with the stage, what is done of it, and all of it
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Result:
    """What `postprocess` made."""

    program: Program
    smoothed: SmoothProgram
    form: Form
    frame: Frame  #: What stands around the motion, with what the text says of how it was made
    written: Written
    verification: Verification | None  #: None where the text was not read back
    unverified: str  #: What of the text was not verified, and why; empty where all of it was
    findings: tuple[Finding, ...]  #: Everything that was noticed on the way
    #: Time of the stages ``read``, ``smooth``, ``write`` and ``verify``.
    seconds: Mapping[str, float] = field(default_factory=dict)
    path: str | None = None  #: File that holds the text; None where it went to a stream, or nowhere
    sha256: str = ""  #: of the written program

    @property
    def verdict(self) -> Verdict:
        """How the program turned out."""
        return self.judgement.verdict

    @property
    def judgement(self) -> Judgement:
        """The verdict and what it rests on."""
        return judge(self.verification, self.findings, self.unverified)

    def report(
        self, *, command: str = "", loosened: str = "", saving: Saving | None = None, limits: Machine | None = None
    ) -> dict[str, Any]:
        """Everything that the JSON report says; see `cornersmooth.report`.

        `command` is the command line that made it, `loosened` what settings made looser than the default, `saving` the
        planned times, `limits` the machine whose limits these keep, in place of that of the form.

        Returns
        -------
        dict
            Plain values; keys carry their unit (`report/report.schema.json`).
        """
        return report(self, command, loosened, saving, limits)


def smooth(
    program: Program,
    settings: Settings | None = None,
    *,
    form: Form | None = None,
    progress: Callable[[int, int], None] | None = None,
    processes: int = 1,
) -> SmoothProgram:
    """Round every corner of the program within the tolerance.

    Parameters
    ----------
    settings : Settings, optional
        Defaults: ε 0.01 mm, H 10 mm; the global method in curves, the proportional one in lines and without a form.
    form : Form, optional
        What the path will be written in, as `choose_form` gives it: the rounding of its digits is taken off ε. Without
        it ε holds for the path itself, as for plans and plots, and `write` refuses it.
    progress : callable, optional
        Called now and then with (corners done, corners in all).
    processes : int
        Processes that a method that takes long may work in; the result does not depend on it.

    Returns
    -------
    SmoothProgram
        Corners (k rows) with curves in mm, and runs where the method makes such.

    Raises
    ------
    SettingsError
        The form cannot hold what the settings ask for.
    """
    settings = Settings() if settings is None else settings
    if form is not None:
        settings = nc.fit_settings(settings, form, program.units)
    smoothed = smoothing.smooth(program, settings, progress=progress, processes=processes)
    return smoothed if form is None else nc.within_reach(smoothed, form)


def reading_back(form: Form) -> dict[str, Any]:
    """Keyword arguments with which a text of the form is read; the control is empty where it is like none."""
    dialect = form.table.dialect
    return {
        "control": dialect if dialect in CONTROLS else "",
        "machine": form.machine,
        "tcp": form.orientation != "machine",
    }


def read_back(text: bytes | str, form: Form, settings: Settings, name: str | None = None) -> NcProgram:
    """Read a text of the form, or the file that holds it, as its control does; see `nc_reader.read_nc`."""
    how = reading_back(form)
    return read_nc(text, **how, name=name, tolerance=settings.tolerance, axis_length=settings.axis_scale)


def postprocess(
    source: Program | bytes | str | os.PathLike[str],
    target: Target,
    settings: Settings | None = None,
    *,
    form: Form | None = None,
    frame: Frame | None = None,
    plan_feeds: Limits | None = None,
    verify: bool = True,
    strict: bool = False,
    force: bool | None = False,
    continuity: bool = True,
    processes: int | None = None,
    progress: Progress | None = None,
) -> Result:
    """Read a CL file, smooth it, write NC text, read that back and measure it: what ``cornersmooth smooth`` does.

    A file takes its place when it is whole, on the disk and verified; until then the old file stays.

    Parameters
    ----------
    source : Program, path or bytes
        What `read` gives; it is read here where nothing else has to be known of it.
    target : path or binary stream
    settings : Settings, optional
        ε 0.01 mm, H 10 mm, the method that suits the form; fitted here to its digits.
    form : Form, optional
        What `choose_form` gives; fanuc g1 by default.
    frame : Frame, optional
        Program name, block numbers, texts before and behind.
    plan_feeds : Limits, optional
        Plan the text within these limits, and those of the axes of the form's machine, and give every block the feed
        that it reaches there. The whole text is kept in memory then.
    verify : bool
        Whether the text is read back and measured before it takes its place.
    strict : bool
        Whether any verdict but PASSED is an error.
    force : bool or None
        Whether an existing file may be replaced; None for not, but it may stay if it is the same.
    continuity : bool
        Whether verification looks for the shortest block and the largest change of direction, too; NaN where not.
    processes : int, optional
        Processes to smooth and to verify with; by default as many as are useful. The result does not depend on it.
    progress : callable, optional
        Called now and then with the stage, what is done and all there is to do; 0 for that where it is not known.

    Returns
    -------
    Result
        The program, its curves, what was written, and the verification.

    Raises
    ------
    VerdictError
        The verdict is FAILED, or with `strict` another than PASSED. The program goes to ``TARGET.failed``, nothing
        reaches a stream; `result` of the error says what was found.
    InputError, SettingsError, OutputError
        As `read`, `choose_form`, `write` and `open_output` say it.
    """
    form = nc.choose_form() if form is None else form
    settings = Settings() if settings is None else settings
    if plan_feeds is not None:
        settings = _for_planned_feeds(settings, form)
    processes = useful_processes() if processes is None else processes
    may_replace = check_output(target, [] if isinstance(source, (Program, bytes)) else [source], force=force)
    back = reading_back(form)
    unverified = "" if verify else "nothing was measured, as asked for"
    if verify and not back["control"]:
        unverified = "nothing was measured: the control is like none whose programs can be read"
    seconds: dict[str, float] = {}
    with timed(seconds, "read", progress):
        program = source if isinstance(source, Program) else read(source, processes=processes)
    settings = nc.fit_settings(settings, form, program.units)
    return_free_memory()  # before processes share what there is
    frame = (frame or Frame()).with_offset_of(program, form)
    provenance = replace(
        _provenance(program, settings, form),
        planned_feeds=plan_feeds is not None,
        work_offset=frame.named_offset(form.table),
        parts=not unverified,
    )
    frame = replace(frame, provenance=provenance.lines())
    with (
        open_output(target, hold=not unverified or strict, replace=may_replace) as output,
        ExitStack() as stack,
    ):
        verifier = None
        if not unverified:
            trust = Trust(
                trusted=(*nc.own_words(form.table), *_users_blocks(frame, form, program, settings)),
                accepted=form.table.trusted,
                weights=provenance.weights,
                slower=provenance.planned_feeds,
                skip_cycles=frame.skip_cycles,
            )
            verifier = Verifier(
                program,
                output.path,
                tolerance=settings.tolerance,
                axis_length=settings.axis_length,
                axis_tolerance=settings.axis_tolerance,
                trust=trust,
                continuity=continuity,
                processes=processes,
                **back,
            )
            stack.enter_context(verifier)  # it lays out the CL path meanwhile
        with timed(seconds, "smooth"):
            step = stage_of(progress, "smoothing")
            smoothed = smooth(program, settings, form=form, progress=step, processes=processes)
        with timed(seconds, "write"):
            step = stage_of(progress, "writing")
            if plan_feeds is None:
                written = nc.write(smoothed, output.stream, form=form, frame=frame, progress=step)
            else:
                whole = io.BytesIO()
                written = nc.write(smoothed, whole, form=form, frame=frame, progress=step)
                output.stream.write(_with_planned_feeds(whole.getvalue(), program, smoothed.settings, form, plan_feeds))
            output.stream.flush()
        return_free_memory()
        verification = None
        if verifier is not None:
            with timed(seconds, "verify", progress):
                verification, unverified = _verified(verifier, form, frame)
                if verification is not None:
                    _put_parts(output, verification.parts)
        findings = (*smoothed.findings, *_remarks(program, smoothed.settings), *written.findings)
        if unverified:
            findings += (Finding("CS509", "warning", 0, f"NOT VERIFIED: {unverified}"),)
        if verification is not None:
            findings += tuple(trusted_blocks(verification))
        path = path_of(target)
        result = Result(
            program,
            smoothed,
            form,
            frame,
            written,
            verification,
            unverified,
            findings,
            seconds,
            path,
        )
        output.failed = result.verdict is Verdict.FAILED or (strict and result.verdict is not Verdict.PASSED)
    result = replace(result, sha256=output.stream.digest)
    if output.failed:
        where = "nothing was written" if path is None else f"the program is in {path}{FAILED}"
        failure = VerdictError("CS508", f"the verdict is {result.verdict}; {where}", file=program.source.name)
        failure.result = replace(result, path=None if path is None else path + FAILED)
        raise failure
    return result


def _for_planned_feeds(settings: Settings, form: Form) -> Settings:
    """Settings whose curves can have the feeds of a plan: a curve of G6.2 has one F, in its first block."""
    if form.curve != "g6.2":
        return settings
    if settings.method == CURVES_METHOD:
        raise SettingsError(
            "CS274",
            "feeds of a plan change within curves of whole runs, and a curve of G6.2 has one feed",
            f"use --method {DEFAULT_METHOD}, or leave out --feed-from-plan",
        )
    return settings.but(method=DEFAULT_METHOD) if settings.method == AUTO else settings


def _with_planned_feeds(text: bytes, program: Program, settings: Settings, form: Form, limits: Limits) -> bytes:
    """The text with the feeds of its own plan."""
    from cornersmooth.feedrate import block_feeds, plan_text
    from cornersmooth.kinematics import with_dynamics
    from cornersmooth.nc.program_frame import with_planned_feeds

    written = read_back(text, form, settings, program.source.name)
    machine = with_dynamics(form.machine)
    law = plan_text(written, limits, name=program.source.name, settings=settings, machine=machine)
    line, feed, minutes = block_feeds(law)
    # the feed of a hole cycle, whose block has rapids, too, is its own: of a tap it is the pitch
    own = ~np.isin(line, written.line[written.kind == Element.RAPID])
    line, feed, minutes = line[own], feed[own], minutes[own]
    # of several elements of a block, which have one feed, the first
    element = np.searchsorted(written.line, line)
    return with_planned_feeds(text, form, program, line, feed, minutes, written.feed[element])


def _put_parts(output: Output, digests: str) -> None:
    """Write the digests of the parts of a program into its head, which has room for them."""
    with open(output.path, "rb") as text:
        at = text.read(HEAD).find(f"PARTS={NO_PARTS}".encode())
    if at >= 0:
        output.stream.patch(output.path, at, f"PARTS={digests}{NO_PARTS[len(digests) :]}".encode())


def _provenance(program: Program, settings: Settings, form: Form) -> Provenance:
    """What the text says of how it was made."""
    return Provenance(
        version=__version__,
        tolerance=settings.tolerance,
        axis_length=settings.axis_length,
        axis_tolerance=settings.axis_tolerance,
        method=settings.method,
        control=form.control,
        form=form.name,
        machine=form.machine.name if form.machine is not None and form.rotary else "",
        tcp=form.orientation != "machine",
        source=program.source.name,
        operation=program.source.operation,
        extras="-".join(extra.name for extra in form.extras),
        sha256=program.source.sha256,
    )


def _remarks(program: Program, settings: Settings) -> Iterator[Finding]:
    """What is strange about path and settings."""
    cuts = np.isin(program.kind, (Move.LINEAR, Move.ARC, Move.HOLE))
    cuts[:1] = False  # nothing to come from
    if not cuts.any():
        yield Finding("CS181", "warning", 0, "there is no feed move from one pose to another: nothing is cut")
        return
    ends = cuts | np.roll(cuts, -1)
    extent = float(np.linalg.norm([np.ptp(column[ends]) for column in program.tip.T]))
    if settings.tolerance > extent and np.ptp(program.axis[cuts], axis=0).max() == 0.0:
        yield Finding("CS182", "warning", 0, f"the tolerance {settings.tolerance:g} mm is larger than the whole path")


def _users_blocks(frame: Frame, form: Form, program: Program, settings: Settings) -> list[str]:
    """Blocks that the user wants before and behind the motion, as far as they are words: comments may be anything."""
    units = form.table.layout.units[program.units]
    blend = blend_word(settings.blend_share * settings.tolerance / program.mm_per_unit)
    texts = (*frame.header, *frame.footer, *(("work offset",) if frame.work_offset == "" else ()))
    return [text.replace("{units}", units).replace("{blend}", blend).replace("{program}", "") for text in texts]


def _verified(verifier: Verifier, form: Form, frame: Frame) -> tuple[Verification | None, str]:
    """What verification found, or why the text could not be read: the user's own words may be any."""
    try:
        found = verifier.result()
    except InputError as failure:
        own = form.table.own
        if not (own or frame.header or frame.footer):
            raise
        return None, f"{failure.what}, NC line {failure.line}"
    return found, found.unverified


def stage_of(progress: Progress | None, stage: str) -> Callable[[int, int], None] | None:
    """Give what to call of a stage with what is done and all."""
    return None if progress is None else lambda done, total: progress(stage, done, total)


#: stages of which nobody knows how far they are, as `Progress` names them
_UNMEASURED = {"read": "reading", "verify": "verifying"}


@contextmanager
def timed(seconds: dict[str, float], stage: str, progress: Progress | None = None) -> Iterator[None]:
    """Note the seconds of a stage; `progress` is called with its name where nobody knows how far it is."""
    if progress is not None:
        progress(_UNMEASURED[stage], 0, 0)
    begin = time.perf_counter()
    yield
    seconds[stage] = round(time.perf_counter() - begin, 6)
