"""What became of the files of a batch, as lines and as a table for other programs: a row a file."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping
from typing import Any

from cornersmooth.cli.batch import STATUSES
from cornersmooth.cli.files import target_of
from cornersmooth.cli.job import Outcome
from cornersmooth.errors import SettingsError
from cornersmooth.output import open_output


def line_of(outcome: Outcome) -> str:
    """One line for a file that did not fail."""
    name, row = outcome.job.source, row_of(outcome)
    if outcome.status == "skipped":
        told = f"skipped  {name}: {outcome.skipped}"
    else:
        told = (
            f"{outcome.status:<8} {name}: {row['smoothed']} of {row['corners']} corners, "
            f"tip {row['max_tip_error_mm']:.4f} mm, {_second(outcome.contents)}, "
            f"{row['blocks']} blocks, {row['seconds']:.1f} s"
        )
    return told + (f", NOT VERIFIED: {outcome.unverified}" if outcome.unverified else "")


def _second(contents: Mapping[str, Any]) -> str:
    """What is told of the axis."""
    summary = contents["summary"]
    if contents["settings"]["axis_tolerance"] is not None:
        return f"tool axis {summary['max_orientation_error_deg']:.4f}°"
    return f"axis point {summary['max_axis_error_mm']:.4f} mm"


def counts_line(counts: Mapping[str, int], unverified: int) -> str:
    """How many files there were of each status."""
    total = sum(counts.values())
    parts = [f"{counts[status]} {status}" for status in STATUSES if counts.get(status)]
    parts += [f"{unverified} NOT VERIFIED"] if unverified else []
    return f"{total} file{'s' * (total != 1)}: {', '.join(parts)}"


def row_of(outcome: Outcome) -> dict[str, Any]:
    """Everything that is told of a file; None where there is nothing to tell."""
    contents = outcome.contents
    summary = contents.get("summary", {})
    seconds = summary.get("seconds")
    return {
        "source": outcome.job.source,
        "output": outcome.job.target,
        "status": outcome.status,
        "exit_code": outcome.exit_code,
        "reason": outcome.message or outcome.skipped,
        "not_verified": outcome.unverified,
        "poses": contents.get("input", {}).get("poses"),
        "corners": summary.get("corners"),
        "smoothed": summary.get("smoothed"),
        "max_tip_error_mm": summary.get("max_tip_error_mm"),
        "max_axis_error_mm": summary.get("max_axis_error_mm"),
        "blocks": summary.get("blocks_out"),
        "findings": len(contents["findings"]) if contents else None,
        "seconds": round(sum(seconds.values()), 6) if seconds else None,
    }


def check_summary(path: str) -> None:
    """Refuse a name that does not say the form.

    Raises
    ------
    SettingsError
        CS221
    """
    if os.path.splitext(path)[1].lower() not in (".json", ".csv"):
        raise SettingsError("CS221", f"cannot tell the form of the summary {path}", "let it end in .json or .csv")


def write_summary(path: str, rows: list[dict[str, Any]]) -> None:
    """Write a row for each file, as `row_of` gives them; as JSON, with the counts."""
    text = io.StringIO()
    if path.lower().endswith(".json"):
        counts = {status: sum(row["status"] == status for row in rows) for status in STATUSES}
        whole = {"schema": "cornersmooth-batch/1", "counts": counts, "files": rows}
        text.write(json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    else:
        table = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    with open_output(target_of(path)) as output:
        output.stream.write(text.getvalue().encode("utf-8", "backslashreplace"))
