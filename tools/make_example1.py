"""Draws docs/dev/example1.svg and prints its table: the paper's Example 1, measured in the written NURBS text.

python tools/make_example1.py
"""

from __future__ import annotations

import io
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from cornersmooth import Settings, choose_form, read, smooth, verify, write
from cornersmooth.model import Floats
from cornersmooth.nc_reader import read_nc
from cornersmooth.report.paths import deviation_at
from cornersmooth.verify.task import Task

ROOT = Path(__file__).resolve().parent.parent
TOLERANCES = (0.078, 0.15)
WIDTH, HEIGHT, LEFT, TOP = 620.0, 190.0, 70.0, 40.0
LENGTH, MOST = 12.2, 0.16  # mm along the path, mm of deviation
BLUE, RED, GREY = "#1463b8", "#c8402f", "#9aa3ad"


@dataclass(frozen=True)
class Distribution:
    """Deviations along the path: of the tip and of the axis point in mm, of the tool axis in degrees."""

    way: Floats
    tip: Floats
    axis_point: Floats
    angle: Floats


def measure(tolerance: float) -> Distribution:
    """Deviation of the paper's method along its example."""
    path = ROOT / "samples" / "paper_table1.csv"
    program = read(path)
    form = choose_form("fanuc", "g6.2")
    smoothed = smooth(program, Settings(tolerance=tolerance, method="zhang2016"), form=form)
    text = io.BytesIO()
    write(smoothed, text, form=form)
    nc, task = read_nc(text.getvalue(), tolerance=tolerance), Task.of(program, tolerance, 10.0)
    along = deviation_at(task, nc, np.repeat(np.arange(len(nc)), 80), np.tile(np.arange(1, 81) / 80, len(nc)))
    six = np.hstack((program.tip, program.tip + 10.0 * program.axis))
    length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(six, axis=0), axis=1))))
    begin = length[np.maximum(along.pose - 1, 0)]
    poses = verify(program, text.getvalue(), tolerance=tolerance)  # where the largest deviations are
    way = np.concatenate((begin + along.share * (length[along.pose] - begin), length))
    tip, axis_point = np.append(along.tip, poses.pose_tip), np.append(along.axis_point, poses.pose_axis_point)
    order = np.argsort(way, kind="stable")
    order = order[np.isfinite(way + tip)[order]]
    return Distribution(way[order], tip[order], axis_point[order], np.append(along.angle, poses.pose_angle)[order])


def graph(found: Distribution, tolerance: float, top: float) -> list[str]:
    """One of the two graphs as SVG elements."""

    def place(way: float, deviation: float) -> tuple[float, float]:
        return LEFT + WIDTH * way / LENGTH, top + HEIGHT * (1.0 - deviation / MOST)

    parts = []
    for level in np.arange(0.0, MOST + 1e-9, 0.04):
        x, y = place(0.0, float(level))
        parts.append(f'<path d="M{x:.1f},{y:.1f} h{WIDTH:.0f}" stroke="#e3e7ea"/>')
        parts.append(f'<text x="{x - 8:.1f}" y="{y + 4:.1f}" text-anchor="end">{level:.2f}</text>')
    x, y = place(0.0, tolerance)
    parts.append(f'<path d="M{x:.1f},{y:.1f} h{WIDTH:.0f}" stroke="{GREY}" stroke-dasharray="6 4"/>')
    parts.append(f'<text x="{x + WIDTH - 4:.1f}" y="{y - 6:.1f}" text-anchor="end">ε = {tolerance:g} mm</text>')
    for values, colour in ((found.tip, BLUE), (found.axis_point, RED)):
        points = " ".join("{:.1f},{:.1f}".format(*place(*row)) for row in zip(found.way, values, strict=True))
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6"/>')
    return parts


def table(found: Distribution, tolerance: float) -> str:
    """Largest deviations in parts of the path, as rows of a table."""
    edges = np.arange(0.0, LENGTH + 1.0, 1.0)
    rows = []
    for low, high in pairwise(edges):
        part = (found.way >= low) & (found.way < high)
        if part.any():
            rows.append(f"| {tolerance:g} | {low:.0f}–{high:.0f} | {found.tip[part].max():.5f} |")
            rows[-1] += f" {found.axis_point[part].max():.5f} | {found.angle[part].max():.3f} |"
    return "\n".join(rows)


def main() -> None:
    """Draw and print."""
    total = TOP + 2 * (HEIGHT + 50)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 {total:.0f}" font-family="sans-serif" '
        'font-size="13" fill="#333">',
        f'<rect width="720" height="{total:.0f}" fill="#ffffff"/>',
        f'<text x="{LEFT}" y="22" fill="{BLUE}">tip</text>',
        f'<text x="{LEFT + 40}" y="22" fill="{RED}">axis point</text>',
        f'<text x="{LEFT + 130}" y="22">deviation, mm, over the length of the path, mm</text>',
    ]
    for k, tolerance in enumerate(TOLERANCES):
        found = measure(tolerance)
        top = TOP + k * (HEIGHT + 50)
        parts += graph(found, tolerance, top)
        for way in range(0, 13, 2):
            x = LEFT + WIDTH * way / LENGTH
            parts.append(f'<text x="{x:.1f}" y="{top + HEIGHT + 18:.1f}" text-anchor="middle">{way}</text>')
        sys.stdout.write(table(found, tolerance) + "\n")
    (ROOT / "docs" / "dev" / "example1.svg").write_text("\n".join([*parts, "</svg>"]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
