"""Planned times of paths as they are, as ideal curves and as written: the table of docs/feedrate.md.

    python tools/make_savings.py FOLDER

FOLDER holds the real CL files of the tests. All rows are planned by one law: the limits of `time` for the tip (feed
1800 mm/min where the file has none, 1000 mm/s², 5000 mm/s³, 2 ms), and those of the five axes of `table-ac`.
"""

from __future__ import annotations

import io
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from cornersmooth.cl import read
from cornersmooth.feedrate import direct, plan, plan_text
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc_reader import read_nc
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

SAMPLE = Path(__file__).parents[1] / "samples" / "impeller.cls"
FILES = ("hecc_point_zigzag.csv", "hust_5x_impeller_yelun.cls")
#: control, form, digits and other settings of the texts
TEXTS: tuple[tuple[str, str, str, dict[str, str]], ...] = (
    ("fanuc", "g1", "", {}),
    ("siemens", "bspline", "", {"method": "proportional"}),
    ("fanuc", "g6.2", "IS-D", {"method": "proportional"}),
    ("fanuc", "g6.2", "", {"method": "proportional"}),
    ("fanuc", "g6.2", "IS-B", {"method": "proportional"}),
    ("fanuc", "g6.2", "IS-B", {"method": "global"}),
    ("fanuc", "g1", "IS-B", {}),
)
MACHINE, TOLERANCE, FEED = "table-ac", 0.01, 1800.0


def programs(folder: Path) -> dict[str, Program]:
    """Paths by name, all with a feed."""
    found = {}
    for path in (SAMPLE, *(folder / name for name in FILES)):
        program = read(path.read_bytes(), name=path.name)
        found[path.name] = replace(program, feed=np.where(np.isnan(program.feed), FEED, program.feed))
    return found


def times(program: Program) -> dict[str, float]:
    """Seconds of every row of the table."""
    machine, settings = load_machine(MACHINE), Settings(tolerance=TOLERANCE)
    found = {
        "unsmoothed, stops": direct(program, machine=machine).total,
        "unsmoothed, jumps of velocity": direct(program, baseline="velocity_jump", machine=machine).total,
        "ideal curves, proportional": plan(smooth(program, settings), machine=machine).total,
    }
    for control, name, digits, others in TEXTS:
        settings = Settings(tolerance=TOLERANCE, **others)
        form = choose_form(control, name, digits=digits)
        stream = io.BytesIO()
        write(smooth(program, fit_settings(settings, form, program.units)), stream, form=form)
        law = plan_text(read_nc(stream.getvalue(), control=control), settings=settings, machine=machine)
        found[" ".join(filter(None, ("as written:", control, name, digits, *others.values())))] = law.total
    return found


def main(arguments: list[str]) -> int:
    """Print the table."""
    columns = {name: times(program) for name, program in programs(Path(arguments[0])).items()}
    sys.stdout.write("| | " + " | ".join(columns) + " |" + "\n")
    sys.stdout.write("|---" * (len(columns) + 1) + "|" + "\n")
    for row in next(iter(columns.values())):
        cells = (f"{column[row]:.2f}" for column in columns.values())
        sys.stdout.write(f"| {row} | " + " | ".join(cells) + " |" + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
