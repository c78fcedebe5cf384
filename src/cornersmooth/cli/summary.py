"""What became of the files of a batch, as lines and as a table for other programs: a row a file."""

from __future__ import annotations

import csv
import io
import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from cornersmooth.cli.batch import STATUSES
from cornersmooth.cli.files import target_of
from cornersmooth.cli.job import Outcome
from cornersmooth.errors import SettingsError
from cornersmooth.output import open_output
from cornersmooth.verdict import Verdict


def line_of(outcome: Outcome) -> str:
    """One line for a file that has a verdict, or was skipped."""
    name, row = outcome.job.source, row_of(outcome)
    head, _, what = outcome.verdict_text.partition(": ")
    if outcome.status == "skipped":
        return f"skipped   {name}: {outcome.skipped}" + (f"; {outcome.verdict_text}" if what else "")
    return (
        f"{head:<8}  {name}: {what}; {row['smoothed']} of {row['corners']} corners, "
        f"tip {row['max_tip_error_mm']:.4f} mm, {_second(outcome.contents)}, "
        f"{row['blocks']} blocks, {row['seconds']:.1f} s"
    )


def _second(contents: Mapping[str, Any]) -> str:
    """What is told of the axis."""
    summary = contents["summary"]
    if contents["settings"]["axis_tolerance"] is not None:
        return f"tool axis {summary['max_orientation_error_deg']:.4f}°"
    return f"axis point {summary['max_axis_error_mm']:.4f} mm"


def counts_line(rows: Sequence[Mapping[str, Any]]) -> str:
    """How many files there were of each status, and what is to be looked at among them."""
    parts = []
    for status in STATUSES:
        same = [row for row in rows if row["status"] == status]
        checks = sum(bool(row["to_check"]) for row in same)
        within = [f"{checks} to check"] if checks else []
        if status == "skipped":  # what the run before said of them
            words = Counter(row["verdict"] for row in same)
            within = [f"{words[word]} {word}" for word in list(Verdict)[1:] if words[word]]
        name = "errors" if status == "error" and len(same) != 1 else status
        parts += [f"{len(same)} {name}" + (f" ({', '.join(within)})" if within else "")] if same else []
    return f"{len(rows)} file{'s' * (len(rows) != 1)}: {', '.join(parts)}"


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
        "verdict": outcome.verdict,
        "verdict_text": outcome.verdict_text,
        "to_check": contents.get("to_check"),
        "left_out": contents.get("left_out"),
        "not_verified": contents.get("not_verified"),
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
