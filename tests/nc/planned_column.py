"""Writes the planned times into the table of docs/dev/linuxcnc.md, beside those that the whole controller took.

    python tests/nc/planned_column.py FOLDER

FOLDER holds the real CL files of the tests.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import choose_form
from cornersmooth.settings import Settings
from cornersmooth.times import Timing
from nc.controller_table import CLOSE, LOOSE, ours, paths, unsmoothed
from nc.linuxcnc_controller import MACHINE

DOCUMENT = Path(__file__).parents[2] / "docs" / "dev" / "linuxcnc.md"
#: of the linear axes of the controller that the table was made on (`linuxcnc_controller.STATED`)
ACCELERATION = 1000.0
#: of a row, with what stands outside
CELLS = 10
NAMES = {
    "samples/impeller.cls": "impeller.cls",
    "HECC zigzag": "hecc_point_zigzag.csv",
    "HUST": "hust_5x_impeller_yelun.cls",
}


def planned(program: Program, text: bytes) -> float:
    """Planned time of a program for LinuxCNC, s."""
    machine = load_machine(MACHINE)
    machine = replace(
        machine,
        dynamics=tuple(replace(axis, acceleration=ACCELERATION) if axis.linear else axis for axis in machine.dynamics),
    )
    timing = Timing.of(choose_form("linuxcnc", machine=machine), Settings())
    assert timing is not None
    return timing.written(text, program)[0]


def rows(folder: Path | None) -> Iterator[tuple[str, float, float]]:
    """Lines of the table that can be planned, what the controller took and what is planned, s."""
    programs, name, tolerance = paths(folder), "", 0.0
    for line in DOCUMENT.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) != CELLS or not cells[5].replace(".", "").isdigit():
            continue
        name = next((file for word, file in NAMES.items() if word in cells[1]), name)
        tolerance = float(cells[2] or tolerance)
        if name not in programs:
            continue
        label = cells[3]
        if lines := re.search(r"--lines (dense|long)", label):
            text = ours(programs[name], tolerance, lines[1])
        else:
            blend = float(label.rsplit("P", 1)[1])
            text = unsmoothed(programs[name], blend, (CLOSE if "with points" in label else LOOSE) * tolerance)
        yield line, float(cells[5]), planned(programs[name], text)


def main(arguments: list[str]) -> int:
    """Write the column."""
    document = DOCUMENT.read_text(encoding="utf-8")
    for line, _, seconds in rows(Path(arguments[0])):
        cells = line.split("|")
        cells[6] = f" {seconds:.2f} "
        new = "|".join(cells)
        document = document.replace(line, new, 1)
    DOCUMENT.write_text(document, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
