"""Runs the first cuts of a finished program on LinuxCNC's whole controller, as they are and filtered.

    python tests/nc/controller_filter.py impeller.ngc --cuts 300

The deviation is that of the executed motion from the programmed one, in which the words of each block change evenly.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

import cornersmooth as cs
from nc.linuxcnc_controller import MACHINE, STATED, STEP, Floats, deviations, run_controller, tool

WORD = re.compile(r"([XYZAC])\s*([-+]?[\d.]+)")


def head(text: str, cuts: int) -> str:
    """The program up to its cut of a number, and its end."""
    lines = text.splitlines(keepends=True)
    rows = [number for number, line in enumerate(lines) if line.startswith("G1")]
    return "".join(lines[: rows[:cuts][-1] + 1]) + "M429\nM30\n"


def programmed(text: str, axis_length: float) -> list[Floats]:
    """Tip and axis point of every run of cuts, densely: (k, 6) each."""
    place, runs = np.full(5, np.nan), [list[Floats]()]
    for line in text.splitlines():
        rapid, words = line.startswith("G0"), dict(WORD.findall(line))
        if not words or not line.startswith(("G0", "G1")):
            continue
        end = np.array([float(words.get(letter, old)) for letter, old in zip("XYZAC", place, strict=True)])
        if rapid:
            runs.append([])
        else:
            count = 1 + int(np.linalg.norm(end - place) / STEP)
            share = np.linspace(0, 1, count + 1)[:, None]
            words_between = place * (1 - share) + end * share
            tip, axis = words_between[:, :3], tool(words_between)[1]
            runs[-1].append(np.concatenate((tip, tip + axis_length * axis), axis=1))
        place = end
    return [np.concatenate(run) for run in runs if run]


def main(arguments: list[str] | None = None) -> int:
    """Print time and deviation of both programs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--cuts", type=int, default=300)
    parser.add_argument("-e", "--tolerance", type=float, default=0.01, help="mm")
    parser.add_argument("--lines", default="long", choices=("dense", "long"))
    parser.add_argument("--add", default="", help="a block at the beginning of both, such as 'G64 P0.01'")
    given = parser.parse_args(arguments)
    settings = cs.Settings(tolerance=given.tolerance, lines=given.lines)
    old = head(f"{given.add}\n" * bool(given.add) + given.program.read_text(), given.cuts)
    form = cs.choose_form("linuxcnc", machine=cs.load_machine(MACHINE))
    found = cs.filter_program(old.encode(), form, settings, axes=form.machine)
    print(f"{found.verdict}: {found.smoothed} of {found.cuts} cuts smoothed, planned seconds {found.seconds}")
    wanted = programmed(old, settings.axis_length)
    for name, text in (("as it is", old.encode()), ("filtered", found.data)):
        word, joints, seconds = run_controller(text, 600.0, STATED)
        tip, axis = tool(joints)
        poses = np.concatenate((tip, tip + settings.axis_length * axis), axis=1)
        each = np.array([deviations(part, wanted) for part in np.array_split(poses, len(poses) // 100 + 1)])
        (tip_most, axis_most), middle = each.max(axis=0), np.median(each, axis=0)
        print(
            f"{name}: {word}, {text.count(b'G1')} lines, {seconds:.2f} s; "
            f"tip within {tip_most:.4f} mm, axis point within {axis_most:.4f} mm; "
            f"in half of all 100 ms {middle[0]:.4f} and {middle[1]:.4f} mm"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
