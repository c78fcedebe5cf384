"""Time the whole ``cornersmooth smooth`` command, with verification and without: ``bench.py [--points N] [--runs K]``.

The text of several controls and forms is timed, beside a plain C program (`baseline.c`) that reads the same file of
five-axis points, rounds corners and writes the same kind of NC text, and nothing else. Runs alternate, medians are
shown. The peak of memory is that of all processes of a command together, each shared page counted once (PSS, Linux).
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

#: control and form, with the machine where it needs one; curves of FANUC corner by corner, as the C program makes them
CASES = {
    "fanuc g1": ("--control", "fanuc", "-f", "g1"),
    "fanuc g6.2": ("--control", "fanuc", "-f", "g6.2", "--method", "proportional"),
    "siemens bspline": ("--control", "siemens", "-f", "bspline"),
    "heidenhain g1": ("--control", "heidenhain", "-f", "g1"),
    "linuxcnc xyzac-trt": ("--control", "linuxcnc", "--machine", "xyzac-trt"),
}
#: those that the C program writes too, and how it is asked
BASELINE: dict[str, tuple[str, ...]] = {"fanuc g1": (), "fanuc g6.2": ("--g6.2",)}
TOLERANCE, AXIS_LENGTH = 0.01, 10.0  # mm
POINTS = 1_000_000
#: seconds between two looks at the memory
INTERVAL = 0.03
HERE = Path(__file__).parent


@dataclass(frozen=True)
class Run:
    """What one command took, with all its processes."""

    wall: float
    processor: float
    memory: float  # MB at the peak


def run(command: Sequence[str | Path], codes: tuple[int, ...] = (0,)) -> Run:
    """Run a command to its end; SystemExit with its messages if it ends with none of these codes."""
    with tempfile.TemporaryFile() as messages:
        start = time.perf_counter()
        process = subprocess.Popen([str(word) for word in command], stdout=messages, stderr=messages)
        ended = threading.Event()
        peaks = [0.0]

        def look() -> None:
            while not ended.wait(INTERVAL):
                peaks.append(memory_of(process.pid))

        looking = threading.Thread(target=look)
        looking.start()
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        ended.set()
        looking.join()
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in codes:
            messages.seek(0)
            said = messages.read().decode(errors="replace")
            sys.exit(f"{Path(command[0]).name} ended with {process.returncode}:\n{said}")
    per_megabyte = 1 << 20 if sys.platform == "darwin" else 1 << 10  # ru_maxrss: bytes there, kilobytes elsewhere
    memory = max(peaks) if sys.platform == "linux" else usage.ru_maxrss / per_megabyte
    return Run(wall, usage.ru_utime + usage.ru_stime, memory)


def memory_of(root: int) -> float:
    """MB that a process and all that it has started take together."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, IndexError, ValueError):  # it has just ended
                continue
    family, found = {root}, {root}
    while found:
        found = {process for process, parent in parents.items() if parent in found} - family
        family |= found
    total = 0
    for process in family:
        try:
            for line in Path(f"/proc/{process}/smaps_rollup").read_text().splitlines():
                if line.startswith("Pss:"):
                    total += int(line.split()[1])
        except (OSError, ValueError):
            continue
    return total / 1024


def typical(runs: Sequence[Run]) -> Run:
    """Medians of what several runs took; of the memory the largest."""
    return Run(median(one.wall for one in runs), median(one.processor for one in runs), max(one.memory for one in runs))


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


def measure(name: str, path: Path, folder: Path, programs: dict[str, Path], runs: int) -> None:
    """Time one control and form, and print its line."""
    written = folder / "text.nc"
    measures: list[str | Path] = ["-e", f"{TOLERANCE}", "-H", f"{AXIS_LENGTH}", "--force", "-q", "-o", written]
    smooth = [programs["cornersmooth"], "smooth", path, *CASES[name], *measures]
    commands: dict[str, list[str | Path]] = {"verified": smooth, "written": [*smooth, "--no-verify"]}
    if name in BASELINE and "baseline.c" in programs:
        plain = [programs["baseline.c"], path, folder / "plain.nc", f"{TOLERANCE}", f"{AXIS_LENGTH}"]
        commands["baseline.c"] = [*plain, *BASELINE[name]]
    taken: dict[str, list[Run]] = {command: [] for command in commands}
    for _ in range(runs):
        for command, words in commands.items():
            taken[command].append(run(words))
    summary = {command: typical(one) for command, one in taken.items()}
    whole, plain_text = summary["verified"], summary["written"]
    added = (whole.wall - plain_text.wall) / plain_text.wall
    print(
        f"{name:20} {whole.wall:8.2f} {whole.processor:8.2f} {whole.memory:8.0f}   {plain_text.wall:8.2f} "
        f"{plain_text.processor:8.2f} {plain_text.memory:8.0f}   {added:8.2f}   {count_lines(written):10,} "
        f"{written.stat().st_size / 1e6:8.1f}",
        flush=True,
    )
    if "baseline.c" in summary:
        plain_c = summary["baseline.c"]
        print(f"{'  baseline.c':20} {'':26}   {plain_c.wall:8.2f} {plain_c.processor:8.2f} {plain_c.memory:8.0f}")


def main() -> None:
    """Make the file, compile the C program, time everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=POINTS, help="points of the file (default %(default)s)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each program (default %(default)s)")
    parser.add_argument("--case", action="append", choices=sorted(CASES), help="only these; without the C program")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        folder = Path(name)
        path = folder / "bench.cls"
        # in a process of its own: what this one has in memory would count as a peak of those it starts
        subprocess.run([sys.executable, HERE / "make_clsf.py", path, str(given.points)], check=True)
        print(
            f"{given.points:,} points, {path.stat().st_size / 1e6:.1f} MB, tolerance {TOLERANCE} mm, {given.runs} runs"
        )
        programs = {"cornersmooth": find_command()}
        if not given.case:
            programs["baseline.c"] = compile_baseline(folder)
        print(f"{'':20} {'verified':>26}   {'written only':>26}   {'added':>8}")
        print(
            f"{'':20} {'wall s':>8} {'CPU s':>8} {'peak MB':>8}   {'wall s':>8} {'CPU s':>8} {'peak MB':>8}   ", end=""
        )
        print(f"{'in wall':>8}   {'lines':>10} {'MB':>8}")
        for case in given.case or CASES:
            measure(case, path, folder, programs, given.runs)
        if not given.case:
            subprocess.run([sys.executable, HERE / "bench_methods.py", path], check=True)


if __name__ == "__main__":
    main()
