"""Pages of what the commands make: of a run of `postprocess`, of a verified text, of planned times, of a surface."""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Mapping
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from cornersmooth.feedrate import Comparison, Limits
from cornersmooth.kinematics import Machine, with_dynamics
from cornersmooth.model import Move, Program
from cornersmooth.nc import Frame, choose_form, write
from cornersmooth.nc_reader import NcProgram, read_nc
from cornersmooth.page.document import document
from cornersmooth.page.scene import Story, Subject, scene
from cornersmooth.report.surface import passes_text
from cornersmooth.report.verdict import Saving, first_line, judge, saving_text, times_text, trusted_blocks
from cornersmooth.saving import planned_saving
from cornersmooth.settings import Settings
from cornersmooth.surface.tool import Tool
from cornersmooth.verdict import Verdict
from cornersmooth.verify import Verification, verify

if TYPE_CHECKING:
    from cornersmooth.pipeline import Result
    from cornersmooth.surface import SurfaceMap

#: how every page begins
BEGINNING = b"<!doctype html>\n<!-- cornersmooth page -->\n"


def page_and_saving(
    result: Result,
    *,
    source: bytes = b"",
    frame: Frame | None = None,
    limits: Limits | None = None,
    axes: Machine | None = None,
    timed: bool = True,
    tool: Tool | None = None,
) -> tuple[str, Saving | None]:
    """Page of a file that was smoothed, written and verified, and the times that its verdict tells.

    Parameters
    ----------
    result : Result
    source : bytes
        The CL file, for its hash.
    frame : Frame, optional
        As in `postprocess`: a text that went to a stream is written once more for the page.
    limits : Limits, optional
        Of the planned speeds.
    axes : Machine, optional
        Whose limits the speeds are planned under, in place of those of the machine of the form.
    timed : bool
        Whether a time is said.
    tool : Tool, optional
        Instead of that of the file.
    """
    smoothed, form, settings = result.smoothed, result.form, result.smoothed.settings
    nc = read_written(result, frame)
    limits, axes = limits or Limits(), form.machine if axes is None else axes
    subject = Subject(
        program=result.program,
        nc=nc,
        settings=settings,
        verification=result.verification,
        smoothed=smoothed,
        dense=not form.curve,
        limits=limits,
        machine=axes,
        planner=form.table.lines.planner,
        tool=tool,
    )
    contents = result.report()
    facts = [
        *_input_facts(result.program, source),
        ("control and form", f"{form.table.name}, {form.name}" + (f", {form.machine.name}" if form.machine else "")),
        *_settings_facts(settings),
        *_limit_facts(limits, axes),
    ]
    badge = result.verdict
    notes = [f"{finding.severity}, line {finding.line}: {finding.text}" for finding in result.findings[:_MOST_NOTES]]

    meta, pack = scene(subject, Story(result.program.source.name, "", badge, facts, notes))
    saving = None
    if timed and badge not in (Verdict.FAILED, Verdict.NOT_VERIFIED):
        saving = planned_saving(result.program, settings, form, limits, axes)
    meta["verdict"] = first_line(contents, saving)
    return document(meta, pack), saving


def read_written(result: Result, frame: Frame | None = None) -> NcProgram:
    """Read the text of a run of `postprocess`; what went to a stream or a pipe is made once more."""
    from cornersmooth.pipeline import read_back

    text: bytes | str
    if result.path is None or not os.path.isfile(result.path):
        stream = io.BytesIO()
        write(result.smoothed, stream, form=result.form, frame=frame)
        text = stream.getvalue()
    else:
        text = result.path
    return read_back(text, result.form, result.smoothed.settings)


def verified_page(
    program: Program,
    nc: NcProgram,
    found: Verification,
    *,
    source: bytes = b"",
    limits: Limits | None = None,
    machine: Machine | None = None,
    planner: str = "",
    tool: Tool | None = None,
    surface: SurfaceMap | None = None,
) -> str:
    """Page of a text that somebody wrote, measured against its CL file; with a map of the surface if there is one."""
    settings = Settings(tolerance=found.tolerance, **_second_of(found))
    limits = Limits() if limits is None else limits
    subject = Subject(
        program=program,
        nc=nc,
        settings=settings,
        verification=found,
        limits=limits,
        machine=machine,
        planner=planner,
        tool=tool if surface is None else surface.tool,
        surface=surface,
    )
    facts = [
        *_input_facts(program, source),
        ("tolerance ε", f"{found.tolerance:g} mm"),
        _second_fact(found.axis_length, found.axis_tolerance),
        *_measured_facts(found),
        *_limit_facts(limits, machine),
    ]
    judgement = judge(found, (*program.findings, *trusted_blocks(found)))
    text = judgement.text
    if surface is not None:
        text += "; " + surface_text(surface)
        facts[-1:-1] = [("tool", surface.tool.describe()), ("cutting edge", f"{surface.edge:g} mm")]
    notes = [f"CL line {item.cl_line}, NC line {item.nc_line}: {item.text}" for item in found.problems[:_MOST_NOTES]]

    def sentence(seconds: Mapping[str, float]) -> str:
        saving = _saving(seconds, program) if surface is None else None
        return text if saving is None else f"{text}; {saving_text(saving)}"

    return _page(subject, Story(program.source.name, "", judgement.verdict, facts, notes), sentence)


def times_page(compared: Comparison, *, source: bytes = b"", tool: Tool | None = None) -> str:
    """Page of planned times; the written path is that of dense lines for FANUC."""
    from cornersmooth.pipeline import smooth

    program, form = compared.program, choose_form()
    smoothed = smooth(program, compared.settings, form=form)
    stream = io.BytesIO()
    write(smoothed, stream, form=form)
    settings = smoothed.settings
    tolerance, own = settings.tolerance, settings.axis_tolerance
    written = stream.getvalue()
    nc = read_nc(written, tolerance=tolerance, axis_length=settings.axis_scale)
    found = verify(program, written, tolerance=tolerance, axis_length=settings.axis_length, axis_tolerance=own)
    method = settings.method
    laws = {"direct": compared.laws["direct_velocity_jump"], "local": compared.laws[method]}
    subject = Subject(
        program=program,
        nc=nc,
        settings=settings,
        verification=found,
        smoothed=smoothed,
        laws=laws,
        limits=compared.limits,
        machine=compared.machine,
        tool=tool,
    )
    facts = [
        *_input_facts(program, source),
        *_settings_facts(settings),
        *((f"time, {name.replace('_', ' ')}", f"{law.total:.3f} s") for name, law in compared.laws.items()),
        *_limit_facts(compared.limits, compared.machine),
    ]
    methods = [name for name in compared.laws if not name.startswith("direct")]
    text = times_text(compared.seconds, methods)
    return _page(subject, Story(program.source.name, text, found.verdict, facts), lambda seconds: text)


#: findings or problems that are told as notes
_MOST_NOTES = 50


def surface_text(surface: SurfaceMap) -> str:
    """What is cut too much and what is left, in words."""
    told = surface.as_dict()
    over, under = told["overcut"]["max_mm"], told["undercut"]["max_mm"]
    within = told["within_tolerance_percent"]
    share = "" if within is None else f"; {within:.4g} % of {told['points']:,} points within {surface.tolerance:g} mm"
    rows = "" if surface.passes is None else f"; passes: {passes_text(surface.passes)}"
    return f"the surface is overcut by up to {over:.4f} mm and undercut by up to {under:.4f} mm{share}{rows}"


def _saving(seconds: Mapping[str, float], program: Program) -> Saving | None:
    """Both times, where they are of the same: the text drills its holes, which the CL file only names."""
    if not {"direct", "written"} <= set(seconds) or (program.kind == Move.HOLE).any():
        return None
    return Saving(seconds["direct"], seconds["written"])


def _page(subject: Subject, story: Story, sentence: Any) -> str:
    meta, pack = scene(subject, story)
    meta["verdict"] = sentence(meta["totals"])
    return document(meta, pack)


def _input_facts(program: Program, source: bytes) -> list[tuple[str, str]]:
    given = program.source
    facts = [("CL file", f"{given.name}: {given.dialect}, {len(program):,} poses, {program.units}")]
    return facts + ([("SHA-256 of the CL file", hashlib.sha256(source).hexdigest())] if source else [])


def _settings_facts(settings: Settings) -> list[tuple[str, str]]:
    return [
        ("tolerance ε", f"{settings.tolerance:g} mm"),
        _second_fact(settings.axis_length, settings.axis_tolerance),
        ("method", settings.method),
        ("reversals", f"sharp above {settings.reversal_angle:g}°"),
    ]


def _second_of(found: Verification) -> dict[str, Any]:
    """What the axis had to keep, as `Settings` take it."""
    own = found.axis_tolerance
    return {"axis_length": found.axis_length} if own is None else {"axis_tolerance": own}


def _second_fact(axis_length: float, axis_tolerance: float | None) -> tuple[str, str]:
    """What is kept besides the tip."""
    if axis_tolerance is None:
        return "axis length H", f"{axis_length:g} mm"
    return "axis tolerance", f"{axis_tolerance:g}°, drawn in mm so that it is ε"


def _measured_facts(found: Verification) -> list[tuple[str, str]]:
    return [
        ("tip, largest", f"{found.tip.value:.6g} mm at CL line {found.tip.cl_line}"),
        *(
            [("axis point, largest", f"{found.axis_point.value:.6g} mm at CL line {found.axis_point.cl_line}")]
            if found.axis_tolerance is None
            else []
        ),
        ("tool axis, largest", f"{found.orientation.value:.4g}° at CL line {found.orientation.cl_line}"),
        ("blocks", f"{found.blocks:,}"),
    ]


def _limit_facts(limits: Limits, machine: Machine | None) -> list[tuple[str, str]]:
    from cornersmooth import __version__

    machine = with_dynamics(machine)
    feed = "as programmed" if limits.feed is None else f"{limits.feed:g} mm/min"
    bundled = json.loads((files("cornersmooth.page") / "assets/vendor/versions.json").read_text(encoding="utf-8"))
    return [
        (
            "planned with",
            f"feed {feed}, {limits.accel:g} mm/s², {limits.jerk:g} mm/s³, period {1000.0 * limits.period:g} ms"
            + (f", axes of {machine.name}" if machine is not None else ""),
        ),
        ("made by", f"cornersmooth {__version__}, three.js {bundled['three']}, uPlot {bundled['uplot']}"),
    ]
