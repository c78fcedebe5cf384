"""Draws docs/corner.svg: one rounded corner, computed by the library.

python tools/make_corner.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cornersmooth import Program, Settings, smooth
from cornersmooth.geometry import nurbs

ROOT = Path(__file__).resolve().parent.parent
TOLERANCE, HEIGHT = 0.6, 4.0
SCALE = 92.0


def project(points: np.ndarray) -> np.ndarray:
    """Look at the corner from the front and a little from above: (..., 3) mm to (..., 2) pixels."""
    across = points[..., 0] - 0.35 * points[..., 1]
    up = 0.9 * points[..., 2] + 0.55 * points[..., 1]
    return np.stack((125.0 + SCALE * across, 560.0 - SCALE * up), axis=-1)


def path(points: np.ndarray, style: str) -> str:
    """Polyline through the points."""
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in project(points))
    return f'<polyline points="{corners}" fill="none" {style}/>'


def dots(points: np.ndarray, style: str, radius: float = 4.0) -> str:
    """Dot on each of the points."""
    return "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" {style}/>' for x, y in project(points))


def label(point: np.ndarray, text: str, dx: float, dy: float, style: str = "") -> str:
    """Text beside a point."""
    x, y = project(point)
    return f'<text x="{x + dx:.1f}" y="{y + dy:.1f}" {style}>{text}</text>'


def draw() -> str:
    """Return the picture as SVG text."""
    tips = np.array([[0.0, 0.0, 0.0], [3.4, 0.0, 0.0], [5.4, 2.9, 0.0]])
    axes = np.array([[-0.25, 0.0, 1.0], [0.05, 0.0, 1.0], [0.25, 0.2, 1.0]])
    program = Program.from_poses(tips, axes)
    smoothed = smooth(program, Settings(tolerance=TOLERANCE, axis_length=HEIGHT))
    curves = nurbs.control_points(program, smoothed.corners, slice(None), HEIGHT)
    u = np.linspace(0.0, 1.0, 81)
    tip_curve, top_curve = (nurbs.evaluate(points, u)[0] for points in curves)
    tops = program.tip + HEIGHT * program.axis
    grey, blue, red = 'stroke="#9aa3ad" stroke-width="2"', "#1463b8", "#c8402f"
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 700 620" font-family="sans-serif" font-size="17">',
        '<rect width="700" height="620" fill="#ffffff"/>',
    ]
    levers = np.stack((tip_curve, top_curve), axis=1)[::8]
    parts += [path(lever, 'stroke="#d9dee3" stroke-width="1.5"') for lever in levers]
    parts += [path(lever, f'{grey} stroke-dasharray="2 5"') for lever in np.stack((program.tip, tops), axis=1)]
    for line, curve, points, colour in (
        (program.tip, tip_curve, curves[0][0], blue),
        (tops, top_curve, curves[1][0], red),
    ):
        parts.append(path(line, grey))
        parts.append(dots(line, 'fill="#9aa3ad"', 5.0))
        parts.append(path(curve, f'stroke="{colour}" stroke-width="4"'))
        parts.append(dots(points, f'fill="#ffffff" stroke="{colour}" stroke-width="2"', 4.5))
        parts.append(path(np.array([line[1], curve[40]]), 'stroke="#333333" stroke-width="1.5"'))
    words = 'fill="#333333"'
    parts += [
        label(program.tip[0], "CL path of the tool tip", 2, 30, words),
        label(tops[0], "CL path of the axis point B = A + H·O", 14, 28, words),
        label(program.tip[1], "A", 8, 24, words),
        label(tops[1], "B", 12, 20, words),
        label((program.tip[1] + tip_curve[40]) / 2, "≤ ε", -42, -14, words),
        label((tops[1] + top_curve[40]) / 2, "≤ ε", -30, -18, words),
        label(tip_curve[80], "P(u)", 16, 6, f'fill="{blue}"'),
        label(top_curve[80], "Q(u)", 16, 6, f'fill="{red}"'),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    (ROOT / "docs" / "corner.svg").write_text(draw(), encoding="utf-8")
