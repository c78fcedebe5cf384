"""The report of one smoothed program: a dictionary, and its JSON and CSV forms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cornersmooth.arrays.vectors import dot, norm
from cornersmooth.errors import Finding, InputError
from cornersmooth.geometry.arcs import arc_radii
from cornersmooth.kinematics import Machine
from cornersmooth.model import Floats, Ints, Move, Program, SmoothProgram, Status, rapid_moves
from cornersmooth.report.corners import corner_table, counts_of, worst_corners
from cornersmooth.report.record import SCHEMA, NcFile, cl_file, findings_table, record, report_json
from cornersmooth.report.verdict import judge, sharp_corners
from cornersmooth.smoothing.construction import construction_of

if TYPE_CHECKING:
    from cornersmooth.report.tables import Columns
    from cornersmooth.verify import Verification

__all__ = ["SCHEMA", "NcFile", "corners_csv", "findings_table", "report", "report_json"]


def report(
    smoothed: SmoothProgram,
    *,
    dense: bool = True,
    blocks_out: int | None = None,
    findings: tuple[Finding, ...] = (),
    verification: Verification | None = None,
    unverified: str = "",
    nc_file: NcFile | None = None,
    command: str = "",
    loosened: str = "",
    times: Mapping[str, Any] | None = None,
    machine: Machine | None = None,
) -> dict[str, Any]:
    """Everything that the JSON report of ``smooth`` says; ``report.schema.json`` describes it.

    Parameters
    ----------
    dense : bool
        Whether transitions are written as lines, not as curves: where their legs are unequal, errors differ.
    blocks_out : int, optional
        NC blocks written.
    findings : tuple of Finding
        Those of the writer, besides those of the program.
    verification : Verification, optional
        What `cornersmooth.verify` measured in the written program.
    unverified : str
        What was not verified, and why; empty for nothing.
    command, loosened, times
        As `record` has them.
    machine : Machine, optional
        Whose rotary axes accelerate at places that are listed.

    Returns
    -------
    dict
        Plain values; numbers in mm, degrees and s as their keys name them.
    """
    all_findings = (*smoothed.findings, *findings)
    program, corners = smoothed.program, smoothed.corners
    done, runs = corners.rounded, smoothed.runs
    worst = worst_corners(smoothed, dense=dense)
    sharp, listed = sharp_corners(smoothed)
    own = smoothed.settings.axis_tolerance is not None  # bounds of runs hold at another distance from the tip then
    summary: dict[str, Any] = {
        "method": smoothed.settings.method,
        "corners": len(corners),
        "corners_in_runs": int((corners.status == Status.IN_RUN).sum()),
        "instead": [{"count": one.count, "text": one.text} for one in all_findings if one.instead],
        "smoothed": int(done.sum()),
        **counts_of(corners),
        "sharp": sharp,
        "max_tip_error_mm": max(worst.tip_error, _largest(runs.tip_bound) if runs is not None else 0.0),
        "max_axis_error_mm": max(worst.axis_error, _largest(runs.axis_bound) if runs is not None and not own else 0.0),
        "max_orientation_error_deg": float(np.degrees(_largest(corners.orientation_error))),
        "length_mm": _feed_length(smoothed),
        "blocks_in": int(np.count_nonzero(program.kind != Move.FROM)),
        "blocks_out": blocks_out,
    }
    if runs is not None:
        summary["runs"] = len(runs)
        summary["run_poses"] = len(runs.pose)
        summary["control_points"] = len(runs.control)
        summary["control_points_per_pose"] = len(runs.control) / max(len(runs.pose), 1)
    summary |= construction_of(smoothed.settings.method).report_summary(corners)
    contents = record(
        "smooth",
        judge(verification, all_findings, unverified),
        source=cl_file(program),
        program=nc_file,
        settings=smoothed.settings.as_dict(),
        findings=all_findings,
        command=command,
        loosened=loosened,
        times=times,
    )
    contents |= {"summary": summary, "worst": _records(smoothed, worst.rows, dense=dense), "sharp": listed}
    if marks := rotary_marks(program, machine):
        contents["rotary_marks"] = marks
    if verification is not None:
        contents["verification"] = verification.to_dict()
    return contents


def corners_csv(smoothed: SmoothProgram, *, dense: bool = True) -> Iterator[str]:
    """The table of corners as CSV text, a block of rows at a time; `dense` as for `report`."""
    from cornersmooth.report.tables import csv_text

    count = len(smoothed.corners)

    def columns(part: slice) -> Columns:
        table = corner_table(smoothed, np.arange(*part.indices(count)), dense=dense)
        return {name: ("%.10g" if one.dtype.kind == "f" else "%s", one) for name, one in table.items()}

    return csv_text(count, columns)


def _records(smoothed: SmoothProgram, rows: Ints, *, dense: bool) -> list[dict[str, Any]]:
    table = {name: column.tolist() for name, column in corner_table(smoothed, rows, dense=dense).items()}
    return [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]


def _largest(values: Floats) -> float:
    return float(np.nanmax(values, initial=0.0))


def _feed_length(smoothed: SmoothProgram) -> float:
    """Length of the linear and circular feed moves of the tip in the CL data, mm."""
    program = smoothed.program
    if len(program) < 2:
        return 0.0
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
