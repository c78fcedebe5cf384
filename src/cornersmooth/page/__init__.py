"""The report as a page: path, corners, surface and charts in one file that opens in any browser, without network.

There are pages of a run of `postprocess`, and of a text that was verified, with its surface or the runs of a filter.
"""

from __future__ import annotations

import base64
import hashlib
import html
import io
import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cornersmooth import __version__
from cornersmooth.geometry.tool import Tool
from cornersmooth.kinematics import Machine, with_dynamics
from cornersmooth.model import Program
from cornersmooth.nc import write
from cornersmooth.nc_reader import NcProgram
from cornersmooth.page.scene import Pack, Subject, page_values
from cornersmooth.pipeline import Result, read_back
from cornersmooth.report import plain
from cornersmooth.report.verdict import LIMITS_TOLD, Saving, sharp_line, time_text
from cornersmooth.settings import Limits, Settings
from cornersmooth.verify import Verification

if TYPE_CHECKING:
    from cornersmooth.surface import SurfaceMap


def smoothed_page(
    result: Result,
    contents: Mapping[str, Any],
    *,
    axes: Machine | None = None,
    saving: Saving | None = None,
    tool: Tool | None = None,
) -> str:
    """Page of a file that was smoothed, written and verified: what its report says, with the times of its verdict.

    Speeds are planned within the limits of `axes`, or of the machine of the form. `tool` replaces that of the file.
    """
    form, settings = result.form, result.smoothed.settings
    text = "; ".join((contents["verdict_text"], sharp_line(contents)))
    if saving is not None:
        text += "; " + time_text(saving, contents["times"]["limits"])
    limits = () if saving is None else saving.limits[:LIMITS_TOLD]
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
        limited_by=[name for name, _ in limits],
    )
    facts = [("method", settings.method), ("reversals", f"sharp above {settings.reversal_angle:g}°")]
    return _page(subject, contents, text, form.machine, facts)


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
    contents: Mapping[str, Any],
    *,
    origin: str = "CL file",
    saving: Saving | None = None,
    **more: Any,
) -> str:
    """Page of a program that somebody wrote: what its report says, and other fields of `Subject`.

    What was filtered has an old program as its `origin`, and the time that it saves.
    """
    settings = Settings(tolerance=found.tolerance, axis_tolerance=found.axis_tolerance)
    settings = settings if found.axis_tolerance is not None else settings.but(axis_length=found.axis_length)
    subject = Subject(program, nc, settings, found, **more)
    machine, surface = subject.machine, subject.surface
    facts, text = _measured_facts(found, origin.split()[0]), contents["verdict_text"]
    if saving is not None:
        text += "; " + time_text(saving, None if machine is None else machine.name)
    if surface is not None:
        text += "; " + _surface_text(surface)
        facts += [("tool", surface.tool.describe()), ("cutting edge", f"{surface.edge:g} mm")]
    return _page(subject, contents, text, machine, facts, origin)


#: problems and findings that a page lists
_MOST_PROBLEMS = 100


def _surface_text(surface: SurfaceMap) -> str:
    """What is cut too much and what is left, in words."""
    shown = surface.as_dict()
    over, under = shown["overcut"]["max_mm"], shown["undercut"]["max_mm"]
    within = shown["within_tolerance_percent"]
    share = "" if within is None else f"; {within:.4g} % of {shown['points']:,} points within {surface.tolerance:g} mm"
    return f"the surface is overcut by up to {over:.4f} mm and undercut by up to {under:.4f} mm{share}"


def _page(
    subject: Subject,
    contents: Mapping[str, Any],
    text: str,
    machine: Machine | None,
    facts: Iterable[tuple[str, str]],
    origin: str = "CL file",
) -> str:
    """Page of a subject and its report; what is not known is left out of what is always in sight."""
    settings, program, source = subject.settings, subject.program, subject.program.source
    written, sha256 = contents["program"], contents["input"]["sha256"]
    head = [
        (origin, source.name),
        ("control", written.get("control")),
        ("form", written.get("form")),
        ("machine", machine and machine.name),
        ("tolerance", f"{settings.tolerance:g} mm"),
        ("axis length", f"{settings.axis_length:g} mm")
        if settings.axis_tolerance is None
        else ("axis tolerance", f"{settings.axis_tolerance:g}°"),
    ]
    inputs = [(origin, f"{source.name}: {source.dialect}, {len(program):,} poses, {program.units}")]
    inputs += [(f"SHA-256 of the {origin}", sha256)] if sha256 else []
    found, findings = subject.verification, contents["findings"]
    story = {
        "title": os.path.basename(written.get("name") or "") or source.name,
        "verdict": text,
        "badge": contents["verdict"],
        "origin": origin.split()[0],
        "head": [(label, value) for label, value in head if value],
        "problems": _problems(found, [one for one in findings if one["severity"] != "note"]),
        "facts": [*inputs, *facts, *_limit_facts(subject.machine, subject.planner)],
        "notes": [
            (f"CL line {one['line']}: " if one["line"] else "") + _text(one)
            for one in findings
            if one["severity"] == "note"
        ],
    }
    return document(*page_values(subject, story))


def _problems(found: Verification | None, warnings: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Problems in the order of the program, then warnings: those to check first."""
    rows = [] if found is None else [("error", one.nc_line, one.cl_line, one.text, one.code) for one in found.problems]
    shown = sorted(warnings, key=lambda one: not one["to_check"])
    rows += [(one["severity"], 0, one["line"], _text(one), one["code"]) for one in shown]
    count = len(shown) + (0 if found is None else found.problem_count)
    if count > _MOST_PROBLEMS:
        rows[_MOST_PROBLEMS:] = [("note", 0, 0, f"{count - _MOST_PROBLEMS:,} more; a JSON report lists them", "")]
    keys = ("severity", "nc_line", "cl_line", "text", "code")
    return [dict(zip(keys, row, strict=True)) for row in rows]


def _text(finding: Mapping[str, Any]) -> str:
    return str(finding["text"]) + (f" ({finding['count']:,} times)" if finding["count"] > 1 else "")


def _measured_facts(found: Verification, whose: str) -> list[tuple[str, str]]:
    point = found.axis_point
    return [
        ("tip, largest", f"{found.tip.value:.6g} mm at {whose} line {found.tip.cl_line}"),
        *[("axis point, largest", f"{point.value:.6g} mm at {whose} line {point.cl_line}")]
        * (not found.axis_tolerance),
        ("tool axis, largest", f"{found.orientation.value:.4g}° at {whose} line {found.orientation.cl_line}"),
        ("blocks", f"{found.blocks:,}"),
    ]


def _limit_facts(machine: Machine | None, planner: str) -> list[tuple[str, str]]:
    limits, machine = Limits(), with_dynamics(machine)
    bundled = json.loads(_asset("vendor/versions.json"))
    tip = f"{limits.accel:g} mm/s² and {limits.jerk:g} mm/s³ along the path, period {1000.0 * limits.period:g} ms"
    law = f"the law of {planner}" if planner else tip
    axes = () if machine is None else (f"axes of {machine.name}", *(item.describe() for item in machine.dynamics))
    return [
        *[("planned with", "; ".join(("feed as programmed", law, *axes)))] * (not planner or bool(axes)),
        ("made by", f"cornersmooth {__version__}, three.js {bundled['three']}, uPlot {bundled['uplot']}"),
    ]


#: scripts in the order they are run
_LIBRARIES = ("vendor/three.js", "vendor/uplot.js")
_SCRIPTS = (
    "data.js",
    "colours.js",
    "geometry.js",
    "paths.js",
    "camera.js",
    "pace.js",
    "tool.js",
    "metal.js",
    "view.js",
    "charts.js",
    "places.js",
    "problems.js",
    "list.js",
    "corners.js",
    "runs.js",
    "drive.js",
    "wiring.js",
    "main.js",
)
_STYLES = ("vendor/uplot.css", "page.css")

#: places of the template that are filled in
_MARK = re.compile(r"\{\{(\w+)\}\}")

#: longest text of the user's that is shown
_LONGEST = 300


def document(meta: dict[str, Any], pack: Pack) -> str:
    """Put a page together; whatever stands in `meta` is shown as text and never as markup."""
    styles = "\n".join(_asset(name) for name in _STYLES)
    libraries = "\n".join(_asset(name) for name in _LIBRARIES)
    script = '(() => {\n"use strict";\n' + "\n".join(_asset(name) for name in _SCRIPTS) + "\n})();\n"
    policy = (
        f"default-src 'none'; img-src data:; style-src {_hash(styles)}; script-src {_hash(libraries)} {_hash(script)}; "
        "base-uri 'none'; form-action 'none'"
    )
    values = json.dumps({**plain(meta, _shown), "arrays": pack.table}, ensure_ascii=True, allow_nan=False)
    # within a script element only these could end it or begin a comment
    values = values.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    parts = {
        "policy": policy,
        "title": html.escape(_shown(meta["title"])),
        "styles": styles,
        "libraries": libraries,
        "script": script,
        "values": values,
        "arrays": pack.text(),
    }
    # in one pass: what is put in is not looked at again
    return _MARK.sub(lambda mark: parts[mark[1]], _asset("page.html"))


def _asset(name: str) -> str:
    return (Path(__file__).with_name("assets") / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}'"


def _shown(text: str) -> str:
    """A text without what is none, such as halves of pairs out of names that are not UTF-8, and not too long."""
    text = text.encode("utf-8", "replace").decode("utf-8")
    return text if len(text) <= _LONGEST else text[:_LONGEST] + " …"
