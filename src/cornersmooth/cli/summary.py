"""What became of the files of a batch, as lines and as a table for other programs: a row a file."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from cornersmooth.cli.files import suffix_of, write_report
from cornersmooth.cli.job import STATUSES, Outcome
from cornersmooth.report.record import report_json
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
    if contents["settings"]["axis_tolerance_deg"] is not None:
        return f"tool axis {summary['max_orientation_error_deg']:.4f}°"
    return f"axis point {summary['max_axis_error_mm']:.4f} mm"


def end_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Say at the end of a batch what is to be looked at: each failure, the warnings by code, the counts."""
    for row in rows:
        if row["exit_code"]:
            what = row["verdict_text"].partition(": ")[2] if row["verdict"] else row["reason"].splitlines()[0]
            name = "" if what.startswith(row["source"]) else f"{row['source']}: "
            yield f"{row['status']:<8}  {name}{what}"
    for code, found in warnings_of(rows).items():
        files = f"{found['files']} file{'s' * (found['files'] != 1)}"
        times = f", {found['count']} times" if found["count"] > found["files"] else ""
        yield f"warning   {code} in {files}{times}, as in {found['first']}: {found['text'].partition('; ')[0]}"
    yield counts_line(rows)


def interrupted_line(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say how far an interrupted batch came."""
    ready = sum(row["status"] not in ("error", "not done", Verdict.FAILED) for row in rows)
    return f"interrupted: {ready} of {len(rows)} done; run again to continue"


def warnings_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Count the warnings of all files by their codes, those in the most files first."""
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        for code, (count, text) in row["warnings"].items():
            own = found.setdefault(code, {"files": 0, "count": 0, "first": row["source"], "text": text})
            own["files"] += 1
            own["count"] += count
    return dict(sorted(found.items(), key=lambda item: (-item[1]["files"], item[0])))


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
        "warnings": _warnings(contents.get("findings", ())),
        "seconds": round(sum(outcome.seconds.values()), 6) if outcome.seconds else None,
    }


def _warnings(findings: Iterable[Mapping[str, Any]]) -> dict[str, tuple[int, str]]:
    """How often each warning was met, and the first text that it has."""
    found: dict[str, tuple[int, str]] = {}
    for finding in findings:
        if finding["severity"] == "warning":
            count, text = found.get(finding["code"], (0, finding["text"]))
            found[finding["code"]] = (count + finding["count"], text)
    return dict(sorted(found.items()))


def batch_report(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What became of a batch: counts, warnings by code, a row for each file."""
    return {
        "schema": "cornersmooth-batch/2",
        "counts": {status: sum(row["status"] == status for row in rows) for status in STATUSES},
        "warnings": warnings_of(rows),
        "files": [{**row, "warnings": _counts(row)} for row in rows],
    }


def write_summary(path: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a row for each file, as `row_of` gives them; as JSON, with the counts."""
    text = io.StringIO()
    if suffix_of(path) == ".json":
        text.write(report_json(batch_report(rows)))
    else:
        table = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
        table.writeheader()
        told = ("; ".join(f"{code} {count}" for code, count in _counts(row).items()) for row in rows)
        table.writerows({**row, "warnings": warnings} for row, warnings in zip(rows, told, strict=True))
    write_report(path, [text.getvalue()])


def _counts(row: Mapping[str, Any]) -> dict[str, int]:
    return {code: count for code, (count, _) in row["warnings"].items()}
