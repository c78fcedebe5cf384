"""Writes the table of numbers in README.md: what one sample gains in each program of a control.

python docs/make_numbers.py

The rows are those of ``cornersmooth compare samples/impeller.cls --control fanuc --limits table-ac`` with tool vectors.
"""

from __future__ import annotations

import re
from pathlib import Path

import cornersmooth
from cornersmooth import Settings
from cornersmooth.comparing import Row, Table, candidates, compare_programs
from cornersmooth.nc import load_control

ROOT = Path(__file__).resolve().parent.parent
PART = ROOT / "samples" / "impeller.cls"
CONTROL, MACHINE = "fanuc", "table-ac"
HEAD = """\
| form | method | lines | blocks | kB | most at the tip, mm | at the axis point, mm | planned time |
|---|---|---|---|---|---|---|---|
"""
PLACE = re.compile(r"(?<=<!-- numbers -->\n).*?(?=<!-- end of numbers -->)", re.DOTALL)


def compared(*forms: str) -> Table:
    """The rows in tool vectors, of all forms or of some."""
    tried = candidates(load_control(CONTROL), Settings(), None)
    tried = [one for one in tried if not forms or one.form.name in forms]
    return compare_programs(cornersmooth.read(PART), tried, cornersmooth.load_machine(MACHINE))


def line_of(row: Row, before: float) -> str:
    """One row, in Markdown."""
    assert row.usable
    assert row.seconds is not None
    saved = f"{row.seconds:.1f} s ({100 * (row.seconds / before - 1):+.0f} %)"
    size = f"{row.blocks:,} | {row.bytes / 1000:.0f}"
    return f"| {row.form} | {row.method} | {row.lines} | {size} | {row.tip:.4f} | {row.axis_point:.4f} | {saved} |\n"


def table() -> str:
    """The table, in Markdown."""
    found = compared()
    poses = len(cornersmooth.read(PART))
    first = f"| unsmoothed | | | {poses:,} poses | | | | {found.unsmoothed:.1f} s |\n"
    return HEAD + first + "".join(line_of(row, found.unsmoothed) for row in found.rows)


def main() -> None:
    """Bring the table up to date."""
    readme = ROOT / "README.md"
    readme.write_text(PLACE.sub(lambda found: table(), readme.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
