"""The report of one smoothed program: a dictionary, and its JSON and CSV forms."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from cornersmooth.arrays import dot, norm
from cornersmooth.errors import Finding, InputError
from cornersmooth.geometry.arcs import arc_radii
from cornersmooth.kinematics import Machine
from cornersmooth.model import Floats, Ints, Move, Program, SmoothProgram, Status, rapid_moves
from cornersmooth.report.tables import Columns, corner_table, counts_of, csv_text, or_empty, worst_corners
from cornersmooth.report.verdict import Judgement, Saving, sharp_corners
from cornersmooth.smoothing.construction import construction_of

if TYPE_CHECKING:
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Form
    from cornersmooth.pipeline import Result


__all__ = ["SCHEMA", "corners_csv", "findings_table", "nc_file", "report", "report_json"]


def report(
    result: Result, command: str, loosened: str, saving: Saving | None, limits: Machine | None
) -> dict[str, Any]:
    """Everything that the JSON report of ``smooth`` says; see `cornersmooth.pipeline.Result.report`."""
    smoothed, form, found, findings = result.smoothed, result.form, result.verification, result.findings
    program, corners, dense = smoothed.program, smoothed.corners, not form.curve
    done, runs = corners.rounded, smoothed.runs
    tip_error, axis_error, worst = worst_corners(smoothed, dense=dense)
    sharp, listed = sharp_corners(smoothed)
    axis_error = max(axis_error, _largest(runs.axis_bound) if runs is not None else 0.0)
    summary: dict[str, Any] = {
        "method": smoothed.settings.method,
        "corners": len(corners),
        "corners_in_runs": int((corners.status == Status.IN_RUN).sum()),
        "instead": [{"count": one.count, "text": one.text} for one in findings if one.instead],
        "smoothed": int(done.sum()),
        **counts_of(corners),
        "sharp": sharp,
        "max_tip_error_mm": max(tip_error, _largest(runs.tip_bound) if runs is not None else 0.0),
        "max_axis_error_mm": axis_error if smoothed.settings.axis_tolerance is None else None,
        "max_orientation_error_deg": float(np.degrees(_largest(corners.orientation_error))),
        "length_mm": _feed_length(smoothed),
        "blocks_in": int(np.count_nonzero(program.kind != Move.FROM)),
        "blocks_out": result.written.blocks,
    }
    if runs is not None:
        summary["runs"] = len(runs)
        summary["run_poses"] = len(runs.pose)
        summary["control_points"] = len(runs.control)
        summary["control_points_per_pose"] = len(runs.control) / max(len(runs.pose), 1)
    summary |= construction_of(smoothed.settings.method).report_summary(corners)
    contents = record(
        "smooth",
        result.judgement,
        source=cl_file(program),
        program=nc_file(result.path, result.sha256, form),
        settings=smoothed.settings.as_dict(),
        findings=findings,
        command=command,
        loosened=loosened,
        times=planned_times(saving, limits or form.machine),
    )
    contents |= {"summary": summary, "worst": _records(smoothed, worst, dense=dense), "sharp": listed}
    if marks := rotary_marks(program, form.machine if form.rotary else None):
        contents["rotary_marks"] = marks
    if found is not None:
        contents["verification"] = found.to_dict()
    return contents


def corners_csv(smoothed: SmoothProgram, *, dense: bool = True) -> Iterator[str]:
    """The table of corners as CSV text, a block of rows at a time; `dense` as for `report`."""
    count = len(smoothed.corners)

    def columns(part: slice) -> Columns:
        table = corner_table(smoothed, np.arange(*part.indices(count)), dense=dense)
        table["axis_error_mm"] = or_empty("%.10g", table["axis_error_mm"])
        return {name: ("%.10g" if one.dtype.kind == "f" else "%s", one) for name, one in table.items()}

    return csv_text(count, columns)


def _records(smoothed: SmoothProgram, rows: Ints, *, dense: bool) -> list[dict[str, Any]]:
    table = {name: column.tolist() for name, column in corner_table(smoothed, rows, dense=dense).items()}
    known = ((None if value != value else value for value in values) for values in zip(*table.values(), strict=True))
    return [dict(zip(table, values, strict=True)) for values in known]


def _largest(values: Floats) -> float:
    return float(np.nanmax(values, initial=0.0))


def _feed_length(smoothed: SmoothProgram) -> float:
    """Length of the linear and circular feed moves of the tip in the CL data, mm."""
    program = smoothed.program
    step = norm(np.diff(program.tip, axis=0))
    kind, from_kind = program.kind[1:], program.kind[:-1]
    straight = float(step[(kind == Move.LINEAR) & (from_kind != Move.FROM)].sum())
    arcs = program.arcs
    rise = dot(program.tip[arcs.pose] - program.tip[arcs.pose - 1], arcs.normal)
    return straight + float(np.hypot(arc_radii(program) * arcs.sweep, rise).sum())


#: places that are listed for each axis
_LISTED: Final = 3

#: degrees: how far the axis may be off near the pole, so that the first angle turns ahead of time
_TOLERANCE: Final = 0.05

#: deg/s2: less is no acceleration, but digits
_LEAST: Final = 1e-3


def rotary_marks(program: Program, machine: Machine | None) -> list[dict[str, Any]]:
    """Places of the CL path where each rotary axis accelerates most, at the programmed feeds.

    The speed of an axis on a linear feed move is its turn over the time of the move; at the pose between two such moves
    it changes within half of both times. Moves without a feed per minute, or of no length, count for nothing. Empty
    where the machine cannot follow the path.
    """
    if machine is None or not machine.names or len(program) < 3:
        return []
    from cornersmooth.rotary import rotary_angles

    rapid = rapid_moves(program.kind)
    try:
        angles = rotary_angles(machine, program.tip, program.axis, tolerance=_TOLERANCE, rapid=rapid).angles
    except InputError:
        return []
    length, feed = norm(np.diff(program.tip, axis=0)), program.feed_at(np.arange(1, len(program)))
    cuts = (program.kind[1:] == Move.LINEAR) & (program.kind[:-1] != Move.FROM) & (length > 0.0) & (feed > 0.0)
    time = np.where(cuts, 60.0 * length / np.where(cuts, feed, 1.0), np.inf)  # s
    speed = np.diff(angles, axis=0) / time[:, None]
    both = cuts[:-1] & cuts[1:]
    change = np.abs(np.diff(speed, axis=0)) / np.where(both, 0.5 * (time[:-1] + time[1:]), np.inf)[:, None]
    found = []
    for axis, name in enumerate(machine.names):
        most = np.argsort(-change[:, axis], kind="stable")[:_LISTED]
        places = [
            {"line": int(program.line[k + 1]), "deg_per_s2": float(change[k, axis])}
            for k in most.tolist()
            if change[k, axis] > _LEAST
        ]
        found += [{"axis": name, "places": places}] if places else []
    return found


def marks_text(axis: dict[str, Any]) -> str:
    """One axis in words: ``C accelerates most at line 387 (41,000 deg/s2), line 12 (900 deg/s2)``."""
    places = (f"line {place['line']} ({place['deg_per_s2']:,.3g} deg/s2)" for place in axis["places"])
    return f"{axis['axis']} accelerates most at {', '.join(places)}"


SCHEMA = "cornersmooth-report/2"

Kind = Literal["smooth", "verify", "filter"]


def nc_file(name: str | None, sha256: str, form: Form) -> dict[str, Any]:
    """Give the NC program of a form that a report is about, by the name of the caller; None for a stream."""
    return {
        "name": name,
        "sha256": sha256,
        "control": form.control,
        "form": form.name,
        "machine": form.machine.name if form.machine is not None and form.rotary else None,
        "tcp": form.orientation != "machine",
    }


def record(
    kind: Kind,
    judgement: Judgement,
    *,
    source: Mapping[str, Any],
    program: Mapping[str, Any],
    settings: Mapping[str, Any],
    findings: Iterable[Finding] = (),
    command: str = "",
    loosened: str = "",
    times: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Begin a report of a command on its input, as `cl_file` gives it, and its program, as `nc_file` does.

    Names of settings end with their unit. `loosened` says what settings made looser than the default, `times` is as
    `planned_times` gives them.
    """
    from cornersmooth import __version__

    text = "; ".join(filter(None, (judgement.text, loosened)))
    return {
        "schema": SCHEMA,
        "kind": kind,
        "verdict": str(judgement.verdict),
        "verdict_text": text,
        "to_check": judgement.to_check,
        "left_out": judgement.left_out,
        "not_verified": judgement.unverified,
        "made_by": {"name": "cornersmooth", "version": __version__, "command": command or None},
        "input": dict(source),
        "program": dict(program),
        "settings": dict(settings),
        "times": None if times is None else dict(times),
        "findings": findings_table(findings),
    }


def cl_file(program: Program) -> dict[str, Any]:
    """The CL file that a program was read from."""
    source = program.source
    alone = {"operation": {"number": source.operation, "name": source.operation_name}} if source.operation else {}
    return {
        "name": source.name,
        "sha256": source.sha256 or None,
        "format": source.format,
        "dialect": source.dialect,
        **alone,
        "units": program.units,
        "poses": len(program),
        "feed_moves": int(np.isin(program.kind, (Move.LINEAR, Move.ARC)).sum()),
        "statements": len(program.statements),
        "chains": len(program.chains),
    }


def sha256_of(text: bytes | str | os.PathLike[str]) -> str:
    """SHA-256 of bytes, or of the file of that path, in hexadecimal digits."""
    if isinstance(text, bytes):
        return hashlib.sha256(text).hexdigest()
    with open(text, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def planned_times(saving: Saving | None, machine: Machine | None) -> dict[str, Any] | None:
    """Planned times, s, and the machine whose limits hold; None where nothing was planned."""
    if saving is None:
        return None
    return {
        "limits": None if machine is None else machine.name,
        "unsmoothed_s": saving.direct,
        "unsmoothed": saving.against or "lines of the CL file",
        "written_s": saving.written,
        "limited_by": [{"limit": name, "share_of_cutting_time": share} for name, share in saving.limits],
    }


def findings_table(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Findings as plain values."""
    return [{**asdict(finding), "to_check": finding.to_check} for finding in findings]


def report_json(contents: Mapping[str, Any]) -> str:
    """Contents as JSON with a final line end; numbers that JSON has no word for (NaN, infinity) become null."""
    return json.dumps(plain(contents), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: Any, shown: Callable[[str], str] = str) -> Any:
    """The same in what JSON has words for; texts as they are `shown`."""
    if isinstance(value, str):
        return shown(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item, shown) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item, shown) for item in value]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value
