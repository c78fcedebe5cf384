"""The report as a page: path, corners, surface and charts in one file that opens in any browser, without network.

There are pages of a run of `postprocess`, and of a text that was verified, with its surface or the runs of a filter.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from cornersmooth import __version__
from cornersmooth.errors import Finding, Verdict
from cornersmooth.geometry.tool import Tool
from cornersmooth.kinematics import Machine, with_dynamics
from cornersmooth.model import Program
from cornersmooth.nc import write
from cornersmooth.nc_reader import NcProgram
from cornersmooth.page.scene import Story, Subject, page
from cornersmooth.pipeline import Result, read_back
from cornersmooth.report.tables import passes_text
from cornersmooth.report.verdict import (
    LIMITS_TOLD,
    Judgement,
    Saving,
    judge,
    sharp_line,
    time_text,
    trusted_blocks,
)
from cornersmooth.settings import Limits, Settings
from cornersmooth.verify import Verification

if TYPE_CHECKING:
    from cornersmooth.surface import SurfaceMap


def smoothed_page(
    result: Result,
    *,
    source: bytes = b"",
    axes: Machine | None = None,
    saving: Saving | None = None,
    tool: Tool | None = None,
) -> str:
    """Page of a file that was smoothed, written and verified, with the times that its verdict tells.

    Speeds are planned within the limits of `axes`, or of the machine of the form. `tool` replaces that of the file.
    """
    form, settings = result.form, result.smoothed.settings
    contents = result.report(saving=saving, limits=axes)
    text = "; ".join((contents["verdict_text"], sharp_line(contents)))
    if saving is not None:
        text += "; " + time_text(saving, contents["times"]["limits"])
    subject = Subject(
        program=result.program,
        nc=read_written(result),
        settings=settings,
        verification=result.verification,
        smoothed=result.smoothed,
        dense=not form.curve,
        machine=form.machine if axes is None else axes,
        planner=form.table.lines.planner,
        tool=tool,
    )
    return _told(
        subject,
        _name(result.path) or result.program.source.name,
        text,
        result.verdict,
        (form.table.name, form.name, form.machine),
        findings=result.findings,
        facts=[("method", settings.method), ("reversals", f"sharp above {settings.reversal_angle:g}°")],
        source=source,
        limited_by=() if saving is None else [name for name, _ in saving.limits[:LIMITS_TOLD]],
    )


def read_written(result: Result) -> NcProgram:
    """Read the text of a run of `postprocess`; what went to a stream or a pipe is made once more."""
    text: bytes | str
    if result.path is None or not os.path.isfile(result.path):
        stream = io.BytesIO()
        write(result.smoothed, stream, form=result.form, frame=result.frame)
        text = stream.getvalue()
    else:
        text = result.path
    return read_back(text, result.form, result.smoothed.settings)


def verified_page(
    program: Program,
    nc: NcProgram,
    found: Verification,
    *,
    name: str = "",
    control: str = "",
    form: str = "",
    source: bytes = b"",
    machine: Machine | None = None,
    planner: str = "",
    tool: Tool | None = None,
    surface: SurfaceMap | None = None,
    judgement: Judgement | None = None,
    origin: str = "CL file",
    runs: Sequence[tuple[int, int, int, int]] | None = None,
    left: Sequence[Mapping[str, Any]] = (),
    saving: Saving | None = None,
) -> str:
    """Page of a program that somebody wrote, measured against its CL file; with a map of the surface if there is one.

    `name`, `control` and `form` are those of the program, as far as they are known. What was filtered has a `judgement`
    of its own, an old program as its `origin`, its `runs` (first and last line in the old program and in the new one),
    the cuts that are `left` as they were (count, line, reason), and the time that it saves.
    """
    settings = Settings(tolerance=found.tolerance, axis_tolerance=found.axis_tolerance)
    settings = settings if found.axis_tolerance is not None else settings.but(axis_length=found.axis_length)
    subject = Subject(
        program=program,
        nc=nc,
        settings=settings,
        verification=found,
        machine=machine,
        planner=planner,
        tool=tool if surface is None else surface.tool,
        surface=surface,
        runs=runs,
    )
    findings = (*program.findings, *trusted_blocks(found))
    judgement = judge(found, findings) if judgement is None else judgement
    facts, text = _measured_facts(found, origin.split()[0]), judgement.text
    if saving is not None:
        text += "; " + time_text(saving, None if machine is None else machine.name)
    if surface is not None:
        text += "; " + _surface_text(surface)
        facts += [("tool", surface.tool.describe()), ("cutting edge", f"{surface.edge:g} mm")]
    title = _name(name) or program.source.name
    written = control, form, machine
    return _told(subject, title, text, judgement.verdict, written, findings, facts, source, origin, left=left)


#: problems and findings that a page lists
_MOST_PROBLEMS = 100


def _surface_text(surface: SurfaceMap) -> str:
    """What is cut too much and what is left, in words."""
    shown = surface.as_dict()
    over, under = shown["overcut"]["max_mm"], shown["undercut"]["max_mm"]
    within = shown["within_tolerance_percent"]
    share = "" if within is None else f"; {within:.4g} % of {shown['points']:,} points within {surface.tolerance:g} mm"
    rows = "" if surface.passes is None else f"; passes: {passes_text(surface.passes)}"
    return f"the surface is overcut by up to {over:.4f} mm and undercut by up to {under:.4f} mm{share}{rows}"


def _name(path: str | None) -> str:
    return os.path.basename(path or "")


def _told(
    subject: Subject,
    title: str,
    text: str,
    badge: Verdict,
    written: tuple[str, str, Machine | None],
    findings: Iterable[Finding],
    facts: Iterable[tuple[str, str]],
    source: bytes,
    origin: str = "CL file",
    *,
    limited_by: Sequence[str] = (),
    left: Sequence[Mapping[str, Any]] = (),
) -> str:
    """Page of a subject, for a control, form and machine; what is not known is left out of what is always in sight."""
    settings, own, given = subject.settings, subject.settings.axis_tolerance, subject.program.source
    control, form, machine = written
    head = [
        (origin, given.name),
        ("control", control),
        ("form", form),
        ("machine", machine.name if machine else ""),
        ("tolerance", f"{settings.tolerance:g} mm"),
        ("axis length", f"{settings.axis_length:g} mm") if own is None else ("axis tolerance", f"{own:g}°"),
    ]
    head = [(label, value) for label, value in head if value]
    inputs = [(origin, f"{given.name}: {given.dialect}, {len(subject.program):,} poses, {subject.program.units}")]
    inputs += [(f"SHA-256 of the {origin}", hashlib.sha256(source).hexdigest())] if source else []
    every, findings = [*inputs, *facts, *_limit_facts(subject.machine)], tuple(findings)
    problems = _problems(subject.verification, findings)
    notes, whose = _notes(findings), origin.split()[0]
    return page(subject, Story(title, text, badge, head, problems, every, notes, whose, limited_by, left))


def _problems(found: Verification | None, findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Problems in the order of the program, then warnings: those to check first."""
    rows = [] if found is None else [("error", one.nc_line, one.cl_line, one.text, one.code) for one in found.problems]
    shown = sorted((one for one in findings if one.severity != "note"), key=lambda one: not one.to_check)
    rows += [(one.severity, 0, one.line, _text(one), one.code) for one in shown]
    count = len(shown) + (0 if found is None else found.problem_count)
    if count > _MOST_PROBLEMS:
        rows[_MOST_PROBLEMS:] = [("note", 0, 0, f"{count - _MOST_PROBLEMS:,} more; a JSON report lists them", "")]
    keys = ("severity", "nc_line", "cl_line", "text", "code")
    return [dict(zip(keys, row, strict=True)) for row in rows]


def _notes(findings: Iterable[Finding]) -> list[str]:
    notes = (one for one in findings if one.severity == "note")
    return [f"{f'CL line {one.line}: ' if one.line else ''}{_text(one)}" for one in notes]


def _text(finding: Finding) -> str:
    return finding.text + (f" ({finding.count:,} times)" if finding.count > 1 else "")


def _measured_facts(found: Verification, whose: str) -> list[tuple[str, str]]:
    point = found.axis_point
    return [
        ("tip, largest", f"{found.tip.value:.6g} mm at {whose} line {found.tip.cl_line}"),
        *[("axis point, largest", f"{point.value:.6g} mm at {whose} line {point.cl_line}")]
        * (not found.axis_tolerance),
        ("tool axis, largest", f"{found.orientation.value:.4g}° at {whose} line {found.orientation.cl_line}"),
        ("blocks", f"{found.blocks:,}"),
    ]


def _limit_facts(machine: Machine | None) -> list[tuple[str, str]]:
    limits, machine = Limits(), with_dynamics(machine)
    bundled = json.loads((files("cornersmooth.page") / "assets/vendor/versions.json").read_text(encoding="utf-8"))
    return [
        (
            "planned with",
            f"feed as programmed, {limits.accel:g} mm/s², {limits.jerk:g} mm/s³, period {1000.0 * limits.period:g} ms"
            + (f", axes of {machine.name}" if machine is not None else ""),
        ),
        ("made by", f"cornersmooth {__version__}, three.js {bundled['three']}, uPlot {bundled['uplot']}"),
    ]
