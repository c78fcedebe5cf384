"""Time ``cornersmooth verify`` on texts that are wrong in many places: ``bench_wrong.py [--points N] [--case NAME]``.

A text of each control and form is measured as it was written and with X moved in some of its blocks: one place in 29
poses by 0.05 and by 0.5 mm, and every third block by 0.5 mm. Times are those of the whole command on all processors.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from bench import AXIS_LENGTH, CASES, HERE, POINTS, TOLERANCE, find_command, run

X = re.compile(rb"(?<![A-Z])X[+-]?\d+\.\d*")
#: poses from wrong place to wrong place; 0 for every third block
WRONG = {"right": (0, 0.0), "0.05 mm, 1 in 29": (29, 0.05), "0.5 mm, 1 in 29": (29, 0.5), "0.5 mm, 1 in 3": (0, 0.5)}


def spoil(text: bytes, points: int, poses: int, by: float) -> tuple[bytes, int]:
    """The text with X moved in some blocks, and in how many."""
    lines = text.split(b"\n")
    moving = [k for k, line in enumerate(lines) if X.search(line)]
    step = max(round(len(moving) * poses / points), 1) if poses else 3
    wrong = moving[step // 2 :: step]
    for k in wrong:
        found = X.search(lines[k])
        assert found
        word = found[0]
        decimals = len(word) - 1 - word.index(b".")
        sign = "+" if word[1:2] == b"+" else ""
        moved = f"X{float(word[1:]) + by:{sign}.{decimals}f}".encode()
        lines[k] = lines[k][: found.start()] + moved + lines[k][found.end() :]
    return b"\n".join(lines), len(wrong)


def measure(name: str, path: Path, folder: Path, points: int) -> None:
    """Time one control and form, and print its lines."""
    command, text = find_command(), folder / "text.nc"
    measures = ["-e", f"{TOLERANCE}", "-H", f"{AXIS_LENGTH}"]
    run([command, "smooth", path, *CASES[name], *measures, "--no-verify", "--force", "-q", "-o", text])
    right, first = text.read_bytes(), None
    control = [word for word in CASES[name] if word not in ("-f", "g1", "g6.2", "bspline")]
    for kind, (poses, by) in WRONG.items():
        spoilt, count = spoil(right, points, poses, by) if by else (right, 0)
        text.write_bytes(spoilt)
        del spoilt
        taken = run([command, "verify", path, text, *measures, *control, "-q"], codes=(1 if by else 0,))
        first = first or taken
        ratios = f"{taken.wall / first.wall:8.2f} {taken.processor / first.processor:8.2f}"
        print(
            f"{name:20} {kind:18} {count:10,} {taken.wall:8.2f} {taken.processor:8.2f} {taken.memory:8.0f} {ratios}",
            flush=True,
        )


def main() -> None:
    """Make the file and time everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=POINTS, help="points of the file (default %(default)s)")
    parser.add_argument("--case", action="append", choices=sorted(CASES), help="only these")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        folder = Path(name)
        path = folder / "bench.cls"
        subprocess.run([sys.executable, HERE / "make_clsf.py", path, str(given.points)], check=True)
        print(f"{given.points:,} points; ratios are to the right text")
        print(f"{'':20} {'':18} {'places':>10} {'wall s':>8} {'CPU s':>8} {'peak MB':>8} {'ratio':>8} {'of CPU':>8}")
        for case in given.case or CASES:
            measure(case, path, folder, given.points)


if __name__ == "__main__":
    main()
