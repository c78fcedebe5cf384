"""Time and memory of `smooth` as two checkouts have it: ``compare.py BEFORE AFTER [--points N] [--runs K] [--case C]``.

Both smooth, write and verify the same file (`make_clsf.py`) in turns, with the Python that runs this. A table in
Markdown is printed, row by row: wall clock and processor time, the peak of memory of all processes together (PSS,
Linux), lines of NC text, and processor time for a million lines: what writes more lines has more to do. On a machine
with other work only the processor time counts, beside that of the other.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bench import AXIS_LENGTH, CASES, HERE, POINTS, TOLERANCE, Run, count_lines, run, typical

#: a case that shows one choice of another
MORE = {"linuxcnc xyzac-trt, dense": (*CASES["linuxcnc xyzac-trt"], "--lines", "dense")}
#: what release 0.1.0 did not know
NEW = frozenset(MORE)
#: the command of a checkout, whatever is installed
COMMAND = "import sys; sys.path.insert(0, sys.argv.pop(1)); from cornersmooth.cli import main; main()"
COLUMNS = ("wall s", "CPU s", "MB", "lines", "CPU s / 10⁶ lines")


@dataclass(frozen=True)
class Measured:
    """What one checkout took for one case."""

    run: Run
    lines: int

    def cells(self) -> list[str]:
        """Cells of a row of the table."""
        per_million = self.run.processor / max(self.lines, 1) * 1e6
        return [
            f"{self.run.wall:.1f}",
            f"{self.run.processor:.1f}",
            f"{self.run.memory:.0f}",
            f"{self.lines:,}",
            f"{per_million:.1f}",
        ]


def measure(source: Path, path: Path, out: Path, options: Sequence[str]) -> tuple[Run, int]:
    """One run of a checkout."""
    words = ["-e", f"{TOLERANCE}", "-H", f"{AXIS_LENGTH}", *options, "--force", "-q", "-o", str(out)]
    return run([sys.executable, "-c", COMMAND, source / "src", "smooth", path, *words]), count_lines(out)


def compared(checkouts: Sequence[Path], path: Path, out: Path, name: str, runs: int) -> list[Measured | None]:
    """What each checkout took, in turns; None where it does not know the case."""
    asked = [source for k, source in enumerate(checkouts) if k or name not in NEW]
    taken: dict[Path, list[tuple[Run, int]]] = {source: [] for source in asked}
    for _ in range(runs):
        for source in asked:
            taken[source].append(measure(source, path, out, (CASES | MORE)[name]))
    return [
        Measured(typical([one for one, _ in taken[source]]), taken[source][-1][1]) if source in taken else None
        for source in checkouts
    ]


def main() -> None:
    """Make the file, time everything, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path, help="folder of a checkout, such as git worktree add makes")
    parser.add_argument("after", type=Path, nargs="?", default=HERE.parent, help="another (default: this one)")
    parser.add_argument("--points", type=int, default=POINTS, help="points of the file (default %(default)s)")
    parser.add_argument("--runs", type=int, default=1, help="runs of each, of which medians are shown")
    parser.add_argument("--case", action="append", choices=[*CASES, *MORE], help="only these")
    given = parser.parse_args()
    checkouts = [given.before.resolve(), given.after.resolve()]
    for source in checkouts:
        if not (source / "src" / "cornersmooth").is_dir():
            sys.exit(f"{source} is no checkout of cornersmooth")
    with tempfile.TemporaryDirectory(prefix="compare-") as name:
        folder = Path(name)
        path = folder / "bench.cls"
        # in a process of its own: what this one has in memory would count as a peak of those it starts
        subprocess.run([sys.executable, HERE / "make_clsf.py", path, str(given.points)], check=True)
        print("| | " + " | ".join(f"{when}: {column}" for when in ("before", "after") for column in COLUMNS) + " |")
        print("|---" * (1 + 2 * len(COLUMNS)) + "|", flush=True)
        for case in given.case or [*CASES, *MORE]:
            found = compared(checkouts, path, folder / "text.nc", case, given.runs)
            cells = [cell for one in found for cell in (one.cells() if one else [""] * len(COLUMNS))]
            print(f"| {case} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
