"""Smooths the samples with the command line and shows what came out: NC lines, numbers of the reports, time and gain.

python samples/show.py [FOLDER]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SAMPLES = Path(__file__).resolve().parent
ROOT = SAMPLES.parent
OUT = ROOT / "build" / "samples"

#: ``cornersmooth`` of the interpreter that runs this
COMMAND = (sys.executable, "-c", "from cornersmooth.cli import main; main()")

SHOWN_LINES = 6  #: of every NC file


@dataclass(frozen=True)
class Job:
    """One call of the command line."""

    sample: str
    output: str
    options: tuple[str, ...]
    shown: str  #: how the first line to show starts
    page: bool = False  #: whether a page of it is made


JOBS = (
    Job("paper_table1.csv", "paper_table1.nc", ("-e", "0.078", "-f", "g6.2", "--feed", "500"), "G6.2"),
    Job("impeller.cls", "impeller_nx.nc", ("-e", "0.01", "-H", "12", "--limits", "table-ac"), "G1 ", page=True),
    Job("impeller.aptsource", "impeller_catia.nc", ("-e", "0.01", "-H", "12"), "G1 "),
)

#: heading, key of the report's `summary` or `input`, form
COLUMNS = (
    ("poses", "poses", "d"),
    ("corners", "corners", "d"),
    ("smoothed", "smoothed", "d"),
    ("tip error mm", "max_tip_error_mm", ".5f"),
    ("axis error mm", "max_axis_error_mm", ".5f"),
    ("blocks in", "blocks_in", "d"),
    ("blocks out", "blocks_out", "d"),
)


def smooth(job: Job, folder: Path) -> dict[str, Any]:
    """Run one job; return its report."""
    output = Path(os.path.relpath(folder, ROOT)) / job.output
    report = output.with_suffix(".json")
    files = [Path("samples") / job.sample, "-o", output, "--report", report]
    if job.page:
        files += ["--report", output.with_suffix(".html")]
    arguments = [*map(str, files), *job.options, "--force"]
    print(f"$ cornersmooth smooth {' '.join(arguments)}", flush=True)
    subprocess.run([*COMMAND, "smooth", *arguments], cwd=ROOT, check=True)
    loaded: dict[str, Any] = json.loads((ROOT / report).read_text(encoding="utf-8"))
    return loaded


def excerpt(job: Job, folder: Path) -> str:
    """Lines of the NC file from its first cut on."""
    lines = (folder / job.output).read_text(encoding="ascii").splitlines()
    first = next((number for number, line in enumerate(lines) if line.startswith(job.shown)), 0)
    return "\n".join(f"    {line}" for line in lines[first : first + SHOWN_LINES])


def table(reports: list[dict[str, Any]]) -> str:
    """One row for every report."""
    cells = [["", *(heading for heading, _, _ in COLUMNS)]]
    for job, report in zip(JOBS, reports, strict=True):
        values = {**report["input"], **report["summary"]}
        cells.append([job.output, *(format(values[key], form) for _, key, form in COLUMNS)])
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join(
        "  ".join(
            [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        )
        for row in cells
    )


def main(folder: Path) -> int:
    """Smooth, show, and pass the exit code of the command line on where it fails."""
    folder.mkdir(parents=True, exist_ok=True)
    reports = []
    for job in JOBS:
        try:
            reports.append(smooth(job, folder))
        except subprocess.CalledProcessError as error:
            return error.returncode
        print(excerpt(job, folder), "    ...", sep="\n", end="\n\n")
    print(table(reports))
    print(f"\nNC files and reports are in {os.path.relpath(folder)}")
    print(*(gain(job, report, folder) for job, report in zip(JOBS, reports, strict=True) if job.page), sep="\n")
    return 0


def gain(job: Job, report: dict[str, Any], folder: Path) -> str:
    """Time of a sample on the example machine, what it gains, and where its page is."""
    times = report["times"]
    before, after = times["unsmoothed_s"], times["written_s"]
    page = (folder / job.output).with_suffix(".html")
    return (
        f"samples/{job.sample} takes {after:.1f} s on the example machine {times['limits']}, "
        f"unsmoothed {before:.1f} s ({100.0 * (after / before - 1.0):+.0f} %).\n"
        f"See it in a browser: {os.path.relpath(page)}"
    )


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else OUT))
