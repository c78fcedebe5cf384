"""Writes the figures, outputs and tables of README.md, and draws docs/speeds.svg.

python tools/make_numbers.py FOLDER

Rows are those that ``cornersmooth compare FILE --control fanuc --machine table-ac --feed 1800`` prints.
The folder holds the parts that are not among the samples; the picture shows the first poses of one of them.
"""

from __future__ import annotations

import contextlib
import io
import re
import sys
import tempfile
from pathlib import Path

import numpy as np

import cornersmooth
from cornersmooth import Program, Settings
from cornersmooth.arrays import some_poses
from cornersmooth.cli import run
from cornersmooth.feedrate import BlockLimits, Limits, direct, plan_text
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Floats
from cornersmooth.nc import choose_form, fit_settings, load_control
from cornersmooth.pipeline import read_back
from cornersmooth.times import written_text
from cornersmooth.times.comparing import Row, Table, candidates, compare_programs

ROOT = Path(__file__).resolve().parent.parent
SAMPLES = ROOT / "samples"
CONTROL, MACHINE, FEED = "fanuc", "table-ac", 1800.0
PARTS = {
    "impeller.cls": "flank of an impeller, `samples/impeller.cls`",
    "hecc_point_zigzag.csv": "NASA compressor blade (HECC), zigzag",
    "hecc_flank_nx.cls": "the same blade, flank",
    "hust_5x_impeller_yelun.cls": "impeller pass (HUST)",
}
PICTURE, FIRST = "hecc_point_zigzag.csv", 120
HEAD = """\
| part | poses | not smoothed | lines | blocks | lines in rotary words | blocks | curves (G6.2) | blocks |
|---|---|---|---|---|---|---|---|---|
"""
#: what is changed in the program of the sample, and how
WRONG = {
    "X of a pose by 0.5 mm": ("X22.3621", "X22.8621"),
    "another work offset": ("G54", "G55"),
    "the coolant lost": ("M8\n", ""),
    "the first feed of the cut": ("F800.", "F900."),
    "a rapid lost": ("G0 X26.8571 Y-3.2016 Z32.0383 I0.9992004 J0.0399813 K0.0000000\n", ""),
}
WRONG_HEAD = "| changed in `part.nc` | the first line of `verify` |\n|---|---|\n"


#: what README.md shows of the first program: lines of its output, of the CL file, blocks
OUTPUT, CL_LINES, BLOCKS = 5, slice(16, 20), slice(20, 23)

#: where README.md compares the method of the paper
PAPER = re.compile(r"The sample takes [\d.]+ s by it in curves, [\d.]+ s by ours")


def place(name: str) -> re.Pattern[str]:
    """Where a table of README.md is."""
    return re.compile(rf"(?<=<!-- {name} -->\n).*?(?=<!-- end of {name} -->)", re.DOTALL)


def compared(part: Path) -> tuple[int, Table]:
    """Poses of a part, and its programs as they are written by default: short lines corner by corner, global curves."""
    program = cornersmooth.read(part).with_feed(FEED)
    default = {("g1", "proportional", "fine"), ("g6.2", "global", "")}
    machine = load_machine(MACHINE)
    tried = candidates(load_control(CONTROL), Settings(), machine)
    tried = [one for one in tried if (one.form.name, one.settings.method, one.lines) in default]
    return len(program), compare_programs(program, sorted(tried, key=lambda one: one.form.name), machine)


def line_of(what: str, poses: int, found: Table) -> str:
    """One row, in Markdown."""
    rows = " | ".join(_cells(row, found.unsmoothed) for row in found.rows)
    return f"| {what} | {poses:,} | {found.unsmoothed:.1f} s | {rows} |\n"


def _cells(row: Row, before: float) -> str:
    assert row.usable
    assert row.seconds is not None
    return f"{row.seconds:.1f} s (\N{MINUS SIGN}{100 * (1 - row.seconds / before):.0f} %) | {row.blocks:,}"


def first_program() -> tuple[str, str, str]:
    """What the first command of README.md prints, and lines of the CL file and of the program; and the program."""
    source = (SAMPLES / "impeller.cls").read_text()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("part.cls").write_text(source)
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            assert run(["smooth", "part.cls", "-e", "0.01", "--limits", MACHINE, "-o", "part.nc"]) == 0
        text = Path("part.nc").read_text()
    shown = (said.getvalue().splitlines()[:OUTPUT], [*source.splitlines()[CL_LINES], "", *text.splitlines()[BLOCKS]])
    output, lines = ("```text\n" + "\n".join(one) + "\n...\n```\n" for one in shown)
    return output, lines, text


def times_of(part: Path, *options: str) -> tuple[float, float]:
    """Planned seconds of a part as `smooth` says them: smoothed, and as it is."""
    with tempfile.TemporaryDirectory() as folder:
        output = io.StringIO()
        with contextlib.redirect_stderr(output):
            run(["smooth", str(part), *options, "-o", str(Path(folder) / "part.nc")])
    times = re.search(r"time .*?([\d.]+) s instead of ([\d.]+) s", output.getvalue())
    assert times
    return float(times[1]), float(times[2])


def on_linuxcnc(part: Path) -> str:
    """What LinuxCNC's planner makes of a part, in a sentence: its time smoothed, and as it is."""
    after, before = times_of(part, "--control", "linuxcnc", "--machine", "xyzac-trt")
    change = f"{'loses' if after > before else 'gains'} {100.0 * abs(after / before - 1.0):.0f} %"
    return f"The sample {change} there, planned: {after:.1f} s, unsmoothed {before:.1f} s.\n"


def by_the_paper(part: Path) -> str:
    """Times of a part in curves, by the method of the paper and by the default one, in words."""
    curves = ("-e", "0.01", "--control", CONTROL, "-f", "g6.2", "--limits", MACHINE, "--method")
    paper, default = (times_of(part, *curves, method)[0] for method in ("zhang2016", "global"))
    return f"The sample takes {paper:.1f} s by it in curves, {default:.1f} s by ours"


def wrong_programs(text: str) -> str:
    """What verification finds in the program of the sample with one change each, in Markdown."""
    program = cornersmooth.read(SAMPLES / "impeller.cls")
    lines = ""
    for what, (old, new) in WRONG.items():
        assert old in text
        found = cornersmooth.verify(program, text.replace(old, new, 1).encode(), tolerance=0.01, axis_length=10)
        first = found.problems[0]
        cl_line = f" (CL line {first.cl_line})" if first.cl_line else ""
        lines += f"| {what} | `part.nc:{first.nc_line}`: {first.text.partition('; ')[0]}{cl_line} |\n"
    return lines


def speeds(program: Program) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Times, s, and speeds of the last rotary axis, deg/s: of the lines of the CL file, and of the written curves."""
    machine, limits = load_machine(MACHINE), Limits()
    form = choose_form(CONTROL, "g6.2")
    settings = fit_settings(Settings(method="global"), form, program.units)
    before = direct(program, limits, "velocity_jump", settings=settings, machine=machine)
    read = read_back(written_text(program, settings, form), form, settings)
    after = plan_text(read, limits, settings=settings, machine=machine, blocks=BlockLimits())
    times = [np.linspace(0.0, law.total, 1200) for law in (before, after)]
    found = [(t, law.axes_at(t)[1][:, 4]) for t, law in zip(times, (before, after), strict=True)]
    return found[0], found[1]


def draw(before: tuple[Floats, Floats], after: tuple[Floats, Floats], axis: str = "C") -> str:
    """Two charts over one another with the same scales, as SVG."""
    width, height, left, most = 760.0, 150.0, 56.0, float(before[0][-1])
    top = float(max(np.abs(before[1]).max(), np.abs(after[1]).max())) * 1.1
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 840 430" font-family="sans-serif" font-size="15">',
        '<rect width="840" height="430" fill="#ffffff"/>',
    ]
    charts = (("lines of the CL file", before, "#9a4a00"), ("written by cornersmooth, G6.2", after, "#1463b8"))
    for number, (name, (t, speed), colour) in enumerate(charts):
        base = 40.0 + number * (height + 40.0)
        x, y = left + width * t / most, base + height / 2 * (1.0 - speed / top)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        parts += [
            f'<text x="{left}" y="{base - 10}" fill="{colour}">{name}: {t[-1]:.1f} s</text>',
            f'<rect x="{left}" y="{base}" width="{width}" height="{height}" fill="none" stroke="#c8ced4"/>',
            f'<path d="M{left} {base + height / 2}h{width}" stroke="#c8ced4"/>',
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>',
            f'<text x="{left - 6}" y="{base + 12}" text-anchor="end" fill="#555555">{top:.0f}</text>',
            f'<text x="{left - 6}" y="{base + height}" text-anchor="end" fill="#555555">\N{MINUS SIGN}{top:.0f}</text>',
        ]
    parts += [
        f'<text x="{left}" y="416" fill="#555555">Speed of the axis {axis}, deg/s, over {most:.1f} s</text>',
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def main(folder: Path) -> None:
    """Bring the table and the picture up to date."""
    gains = ""
    for name, what in PARTS.items():
        gains += line_of(what, *compared(SAMPLES / name if (SAMPLES / name).exists() else folder / name))
    readme = ROOT / "README.md"
    text = readme.read_text(encoding="utf-8")
    output, lines, part = first_program()
    made = {"output": output, "lines": lines, "numbers": HEAD + gains, "wrong": WRONG_HEAD + wrong_programs(part)}
    made["linuxcnc"] = on_linuxcnc(SAMPLES / "impeller.cls")
    for name, what in made.items():
        text = place(name).sub(lambda found, what=what: what, text)
    text = PAPER.sub(by_the_paper(SAMPLES / "impeller.cls"), text)
    readme.write_text(text, encoding="utf-8")
    program = cornersmooth.read(folder / PICTURE).with_feed(FEED)
    (ROOT / "docs" / "speeds.svg").write_text(draw(*speeds(some_poses(program, 0, FIRST))), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
