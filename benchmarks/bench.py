"""Time the whole ``cornersmooth smooth`` command beside a plain C program: ``bench.py [--points N] [--runs K]``.

Both read the same file of five-axis points and write the same kind of NC text; runs alternate, medians are shown.
The C program (`baseline.c`) leaves out all that is not reading, rounding corners and writing. With ``--controls`` the
text of several controls is timed beside that of fanuc g1 instead, all of them without verification.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

FORMS = ("g1", "g6.2")
#: control and form, with the machine where it needs one; the first is what the others are compared with
CONTROLS = {
    "fanuc g1": ("--control", "fanuc", "-f", "g1"),
    "siemens g1": ("--control", "siemens", "-f", "g1"),
    "siemens bspline": ("--control", "siemens", "-f", "bspline"),
    "linuxcnc xyzac-trt": ("--control", "linuxcnc", "--machine", "xyzac-trt"),
}
TOLERANCE, AXIS_LENGTH = 0.01, 10.0  # mm
POINTS = 1_000_000
HERE = Path(__file__).parent


@dataclass(frozen=True)
class Run:
    """What one process took."""

    wall: float
    user: float
    system: float
    memory: float  # MB at the peak

    @property
    def processor(self) -> float:
        """Seconds of processor time."""
        return self.user + self.system


def run(command: Sequence[str | Path]) -> Run:
    """Run a command to its end; SystemExit with its messages if it fails."""
    with tempfile.TemporaryFile() as messages:
        start = time.perf_counter()
        process = subprocess.Popen([str(word) for word in command], stdout=messages, stderr=messages)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            messages.seek(0)
            said = messages.read().decode(errors="replace")
            sys.exit(f"{Path(command[0]).name} ended with {process.returncode}:\n{said}")
    per_megabyte = 1 << 20 if sys.platform == "darwin" else 1 << 10  # ru_maxrss: bytes there, kilobytes elsewhere
    return Run(wall, usage.ru_utime, usage.ru_stime, usage.ru_maxrss / per_megabyte)


def typical(runs: Sequence[Run]) -> Run:
    """Medians of what several runs took."""
    return Run(*(median(getattr(one, name) for one in runs) for name in ("wall", "user", "system", "memory")))


def count_lines(path: Path) -> int:
    """Line ends in a file."""
    with path.open("rb") as file:
        return sum(piece.count(b"\n") for piece in iter(lambda: file.read(1 << 20), b""))


def find_command() -> Path:
    """Return the cornersmooth beside this Python, or else the one on the path."""
    found = shutil.which("cornersmooth", path=str(Path(sys.executable).parent)) or shutil.which("cornersmooth")
    return Path(found) if found else sys.exit("no cornersmooth command: install the package first")


def compile_baseline(folder: Path) -> Path:
    """Compile the C program."""
    compiler = shutil.which("cc") or shutil.which("gcc") or sys.exit("no C compiler: install gcc")
    program = folder / "baseline"
    subprocess.run([compiler, "-O2", "-o", program, HERE / "baseline.c", "-lm"], check=True)
    return program


def compare(form: str, path: Path, folder: Path, programs: dict[str, Path], runs: int) -> None:
    """Time one output form and print its table."""
    names = ("smooth", "smooth --no-verify", "verify", "baseline.c")
    written = {name: folder / f"{number}-{form}.nc" for number, name in enumerate(names)}
    written["verify"] = written["smooth"]
    report = folder / "report.json"
    options: list[str | Path] = [
        "-e",
        f"{TOLERANCE}",
        "-H",
        f"{AXIS_LENGTH}",
        "-f",
        form,
        "--report",
        report,
        "--force",
        "-q",
    ]
    smooth = [programs["cornersmooth"], "smooth", path, *options, "-o"]
    commands: dict[str, list[str | Path]] = {
        "smooth": [*smooth, written["smooth"]],
        "smooth --no-verify": [*smooth, written["smooth --no-verify"], "--no-verify"],
        "verify": [programs["cornersmooth"], "verify", path, written["verify"], "-e", f"{TOLERANCE}", "-q"],
        "baseline.c": [programs["baseline.c"], path, written["baseline.c"], f"{TOLERANCE}", f"{AXIS_LENGTH}"],
    }
    if form == "g6.2":
        commands["baseline.c"].append("--g6.2")
    taken: dict[str, list[Run]] = {name: [] for name in commands}
    seconds: dict[str, float] = {}
    for _ in range(runs):
        for name, command in commands.items():
            taken[name].append(run(command))
            if name == "smooth":
                seconds = json.loads(report.read_text())["summary"]["seconds"]

    print(f"\n{form}: {'':17}    wall s   user+sys s   peak MB        lines")
    summary = {name: typical(one) for name, one in taken.items()}
    for name, one in summary.items():
        lines = count_lines(written[name])
        print(f"  {name:20}  {one.wall:8.2f}   {one.processor:10.2f}   {one.memory:7.0f}   {lines:10,}")
    plain = summary["baseline.c"]
    for name in names[:2]:
        one = summary[name]
        print(f"  {name + ', ratio':27} {one.wall / plain.wall:2.2f}   {one.processor / plain.processor:10.2f}")
    writing = summary["smooth --no-verify"].wall
    added = (summary["smooth"].wall - writing) / writing
    print(
        f"  verification beside writing: {added:.2f} times as long; afterwards: {summary['verify'].wall / writing:.2f}"
    )
    print("  stages of the last run: " + ", ".join(f"{stage} {value:.2f} s" for stage, value in seconds.items()))


def compare_controls(path: Path, folder: Path, command: Path, runs: int) -> None:
    """Time the text of several controls in turn and print one table."""
    taken: dict[str, list[Run]] = {name: [] for name in CONTROLS}
    written = folder / "control.nc"
    size: dict[str, tuple[float, int]] = {}
    for _ in range(runs):
        for name, options in CONTROLS.items():
            numbers = ("-e", f"{TOLERANCE}", "-H", f"{AXIS_LENGTH}", "--no-verify", "--force", "-q", "-o", written)
            taken[name].append(run([command, "smooth", path, *options, *numbers]))
            size[name] = (written.stat().st_size / 1e6, count_lines(written))
    print(f"\n{'':22}    wall s   ratio   user+sys s   ratio   peak MB        lines       MB")
    summary = {name: typical(one) for name, one in taken.items()}
    first = summary[next(iter(CONTROLS))]
    for name, one in summary.items():
        megabytes, lines = size[name]
        print(
            f"  {name:20}  {one.wall:8.2f}   {one.wall / first.wall:5.2f}   {one.processor:10.2f}   "
            f"{one.processor / first.processor:5.2f}   {one.memory:7.0f}   {lines:10,}   {megabytes:6.1f}"
        )


def main() -> None:
    """Make the file, compile the C program, time both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=POINTS, help="points of the file (default %(default)s)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each program (default %(default)s)")
    parser.add_argument("--controls", action="store_true", help="time the text of several controls, no C program")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        folder = Path(name)
        path = folder / "bench.cls"
        # in a process of its own: what this one has in memory would count as a peak of those it starts
        subprocess.run([sys.executable, HERE / "make_clsf.py", path, str(given.points)], check=True)
        print(
            f"{given.points:,} points, {path.stat().st_size / 1e6:.1f} MB, tolerance {TOLERANCE} mm, {given.runs} runs"
        )
        if given.controls:
            compare_controls(path, folder, find_command(), given.runs)
            return
        programs = {"cornersmooth": find_command(), "baseline.c": compile_baseline(folder)}
        for form in FORMS:
            compare(form, path, folder, programs, given.runs)


if __name__ == "__main__":
    main()
