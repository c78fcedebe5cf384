"""Figures and picture of docs/global.md: planned times of real paths, as curves and as written text.

python tools/make_global.py FOLDER              tables for the files of FOLDER that are there, and samples/impeller.cls
python tools/make_global.py --picture CLFILE    docs/global.svg: curvature and jerk of the axes along the path
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import cornersmooth
from cornersmooth import Program, Settings
from cornersmooth.feedrate import Limits, TimeLaw, direct, plan, plan_text
from cornersmooth.kinematics import Machine, load_machine
from cornersmooth.kinematics.machine import machine_table, parse_machine
from cornersmooth.nc import choose_form
from cornersmooth.nc_reader import read_nc

ROOT = Path(__file__).resolve().parent.parent
PATHS = {
    "HECC zigzag": "hecc_point_zigzag.csv",
    "samples/impeller.cls": str(ROOT / "samples" / "impeller.cls"),
    "HUST blade": "hust_5x_impeller_yelun.cls",
    "HECC flank": "hecc_flank_nx.cls",
    "fan": "hust_5x_toolpath_fan.txt",
    "shenmuxin (A to ±180°)": "shenmuxin_5x_path.csv",
    "NX contour (A to ±180°)": "nx_clsf_varcontour5x_ust_a.cls",
}
TEXTS = {
    "proportional, fanuc g6.2": ("proportional", "fanuc", "g6.2"),
    "global, fanuc g6.2": ("global", "fanuc", "g6.2"),
    "global, siemens bspline": ("global", "siemens", "bspline"),
}
METHODS = ("direct_exact_stop", "direct_velocity_jump", "zhang2016", "proportional", "global")
FEED = 1800.0
COLOURS = {"proportional": "#c8402f", "global": "#1463b8"}
#: part of the path that is drawn, as shares of its time, and pixels of a chart
PART, WIDE, HIGH = (0.235, 0.3), 820.0, 150.0
#: points of a line, about
MOST = 600


def say(line: str) -> None:
    """Write a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def far_reaching() -> Machine:
    """`table-ac`, but A goes all the way round."""
    return parse_machine(machine_table("table-ac").replace("limits = [-120, 120]", "limits = [-180, 180]"))


def programs(folder: Path) -> Iterator[tuple[str, Program, Machine]]:
    """Paths that are there, each with a machine that reaches it."""
    for name, file in PATHS.items():
        if (folder / file).exists():
            machine = far_reaching() if "180" in name else load_machine("table-ac")
            yield name, cornersmooth.read(folder / file), machine


def change(value: float, base: float) -> str:
    """Change in percent."""
    return f"{100.0 * (value / base - 1.0):+.1f} %".replace("-", "−")


def curves(folder: Path, tolerance: float) -> None:
    """Table of the planned curves."""
    say(f"\n| ε {tolerance:g} mm | exact stop | velocity jump | zhang2016 | proportional | global | of proportional |")
    say("|---|---|---|---|---|---|---|")
    for name, program, machine in programs(folder):
        settings, limits = Settings(tolerance=tolerance), Limits(feed=FEED)
        laws = {
            "direct_exact_stop": direct(program, limits, "exact_stop", settings=settings, machine=machine),
            "direct_velocity_jump": direct(program, limits, "velocity_jump", settings=settings, machine=machine),
        }
        for method in METHODS[2:]:
            laws[method] = plan(cornersmooth.smooth(program, settings.but(method=method)), limits, machine=machine)
        seconds = {method: law.total for method, law in laws.items()}
        told = " | ".join(f"{seconds[method]:.2f}" for method in METHODS)
        say(f"| {name}, {len(program)} poses | {told} | {change(seconds['global'], seconds['proportional'])} |")


def texts(folder: Path, tolerance: float) -> None:
    """Table of the written texts, read back and planned, with the digits that are the default."""
    say(f"\n| ε {tolerance:g} mm, text | {' | '.join(TEXTS)} | of proportional |")
    say("|---|---|---|---|---|")
    for name, program, machine in programs(folder):
        cells, times = [], []
        for method, control, form in TEXTS.values():
            law, blocks = written(program, Settings(tolerance=tolerance, method=method), control, form, machine)
            times.append(law.total)
            cells.append(f"{law.total:.2f} s, {blocks / len(program):.2f} blocks a pose")
        say(f"| {name} | {' | '.join(cells)} | {change(min(times[1:]), times[0])} |")


def written(program: Program, settings: Settings, control: str, form: str, machine: Machine) -> tuple[TimeLaw, int]:
    """Plan of a text, and its number of blocks."""
    target = io.BytesIO()
    cornersmooth.postprocess(
        program, target, settings, form=choose_form(control, form, machine=None), feed=FEED, verify=False
    )
    nc = read_nc(target.getvalue(), control=control)
    return plan_text(nc, Limits(feed=FEED), settings=settings, machine=machine), target.getvalue().count(b"\n")


def picture(file: Path) -> str:
    """Curvature of the tip and jerk of the rotary axes over the way, both methods, as SVG text."""
    program, machine = cornersmooth.read(file), load_machine("table-ac")
    charts: dict[str, list[tuple[str, np.ndarray, np.ndarray]]] = {}
    for method in COLOURS:
        law = plan(cornersmooth.smooth(program, Settings(method=method)), Limits(feed=FEED), machine=machine)
        times = law.every_period()
        times = times[(times >= PART[0] * law.total) & (times <= PART[1] * law.total)]
        times = times[:: max(1, len(times) // MOST)]
        states = law.at(times)
        moving = states.v > 1e-3
        curvature = np.where(moving, states.centripetal / np.maximum(states.v, 1e-3) ** 2, 0.0)
        jerk = law.axes_at(times)[3]
        for name, values in (
            ("curvature of the tip, 1/mm", curvature),
            ("jerk of C, deg/s³", jerk[:, 3]),
            ("jerk of A, deg/s³", jerk[:, 4]),
        ):
            charts.setdefault(name, []).append((method, times - times[0], values))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDE + 100:g} {(HIGH + 50) * len(charts) + 40:g}" '
        'font-family="sans-serif" font-size="14">',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
    ]
    for row, (name, laws) in enumerate(charts.items()):
        top = 30.0 + row * (HIGH + 50.0)
        low = min(0.0, *(float(values.min()) for _, _, values in laws))
        high = max(float(values.max()) for _, _, values in laws)
        end = max(float(t[-1]) for _, t, _ in laws)
        parts.append(f'<text x="80" y="{top - 8:g}" fill="#333333">{name}: {low:.3g} to {high:.3g}</text>')
        parts.append(f'<rect x="80" y="{top:g}" width="{WIDE:g}" height="{HIGH:g}" fill="none" stroke="#9aa3ad"/>')
        for method, t, values in laws:
            x, y = 80.0 + WIDE * t / end, top + HIGH * (high - values) / (high - low)
            points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
            parts.append(f'<polyline points="{points}" fill="none" stroke="{COLOURS[method]}" stroke-width="1"/>')
    foot = (HIGH + 50.0) * len(charts) + 20.0
    for place, (method, colour) in enumerate(COLOURS.items()):
        parts.append(f'<text x="{80 + 120 * place}" y="{foot:g}" fill="{colour}">{method}</text>')
    parts.append(f'<text x="400" y="{foot:g}" fill="#333333">time, the same part of the path, {end:.2f} s wide</text>')
    return "\n".join([*parts, "</svg>\n"])


def main() -> None:
    """Do what the command line asks for."""
    if len(sys.argv) == 3 and sys.argv[1] == "--picture":
        (ROOT / "docs" / "global.svg").write_text(picture(Path(sys.argv[2])), encoding="utf-8")
    elif len(sys.argv) == 2:
        folder = Path(sys.argv[1])
        for tolerance in (0.01, 0.04):
            curves(folder, tolerance)
            texts(folder, tolerance)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
