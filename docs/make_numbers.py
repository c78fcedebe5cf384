"""Writes the table of numbers in README.md: what one sample gains at three tolerances.

python docs/make_numbers.py

Times are planned for the path as the CL file has it and for the written text, with the feeds of the file: under limits
of the tip alone (the defaults of ``cornersmooth time``), and under those of a machine's axes besides.
"""

from __future__ import annotations

import io
import re
from pathlib import Path

import cornersmooth
from cornersmooth import Limits, Settings
from cornersmooth.feedrate import plan_text
from cornersmooth.kinematics import Machine
from cornersmooth.nc_reader import NcProgram, read_nc

ROOT = Path(__file__).resolve().parent.parent
PART = ROOT / "samples" / "impeller.cls"
TOLERANCES = (0.01, 0.04, 0.16)
MACHINE = "table-ac"
HEAD = """\
| ε mm | blocks written | most at the tip, mm | at the axis point, mm | planned time | on `table-ac` | its curves |
|---|---|---|---|---|---|---|
"""
PLACE = re.compile(r"(?<=<!-- numbers -->\n).*?(?=<!-- end of numbers -->)", re.DOTALL)


def seconds_before(machine: Machine | None) -> float:
    """Planned time of the path as the CL file has it."""
    return cornersmooth.direct(cornersmooth.read(PART), Limits(), "velocity_jump", machine=machine).total


def smoothed(tolerance: float) -> tuple[cornersmooth.Result, NcProgram]:
    """What is made with a tolerance, and the text as it is read back."""
    text = io.BytesIO()
    result = cornersmooth.postprocess(PART, text, Settings(tolerance=tolerance))
    return result, read_nc(text.getvalue(), tolerance=tolerance)


def seconds_after(tolerance: float, nc: NcProgram, machine: Machine | None) -> float:
    """Planned time of a text."""
    return plan_text(nc, Limits(), settings=Settings(tolerance=tolerance), machine=machine).total


def seconds_of_curves(tolerance: float) -> float:
    """Planned time of the curves that the lines of the text follow, with the machine."""
    program = cornersmooth.smooth(cornersmooth.read(PART), Settings(tolerance=tolerance))
    return cornersmooth.plan(program, Limits(), machine=cornersmooth.load_machine(MACHINE)).total


def table() -> str:
    """The table, in Markdown."""
    machines = (None, cornersmooth.load_machine(MACHINE))
    before = [seconds_before(machine) for machine in machines]
    poses = len(cornersmooth.read(PART))
    rows = [f"| as it was | {poses:,} | | | {before[0]:.1f} s | {before[1]:.1f} s | |\n"]
    for tolerance in TOLERANCES:
        result, nc = smoothed(tolerance)
        found = result.verification
        assert found is not None
        after = [seconds_after(tolerance, nc, machine) for machine in machines]
        times = (f"{new:.1f} s ({100 * (new / old - 1):+.0f} %)" for old, new in zip(before, after, strict=True))
        rows.append(
            f"| {tolerance:g} | {result.written.blocks:,} | {found.max_tip_deviation_mm:.4f} | "
            f"{found.max_axis_point_deviation_mm:.4f} | {' | '.join(times)} | {seconds_of_curves(tolerance):.1f} s |\n"
        )
    return HEAD + "".join(rows)


def main() -> None:
    """Bring the table up to date."""
    readme = ROOT / "README.md"
    readme.write_text(PLACE.sub(lambda found: table(), readme.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
