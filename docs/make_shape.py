"""Draws docs/shape.svg: one corner with the paper's shape and with the automatic one, and their curvature.

python docs/make_shape.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cornersmooth import Program, Settings, smooth
from cornersmooth.smoothing import nurbs

HERE = Path(__file__).resolve().parent
TURN, TOLERANCE = 90.0, 0.04
COLOURS = {"paper": "#1463b8", "auto": "#c8402f"}
GREY = 'stroke="#9aa3ad" stroke-width="2"'
WORDS = 'fill="#333333"'

#: places of the two drawings: origin and pixels per mm; origin, pixels per mm of way and per 1/mm of curvature
PLAN = np.array([250.0, 70.0]), 1150.0
CHART = np.array([690.0, 330.0]), 1250.0, 15.0


def polyline(points: np.ndarray, style: str) -> str:
    """Polyline through points in pixels."""
    return f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" fill="none" {style}/>'


def text(x: float, y: float, words: str, style: str = WORDS) -> str:
    """Words at a place in pixels."""
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{words}</text>'


def corner(shape: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of the curve (m, 2) mm, way from the middle (m,) mm and curvature (m,) 1/mm."""
    half = np.radians(TURN) / 2.0
    tips = 5.0 * np.array([[-np.cos(half), -np.sin(half), 0.0], [0.0, 0.0, 0.0], [np.cos(half), -np.sin(half), 0.0]])
    program = Program.from_poses(tips, np.tile([0.0, 0.0, 1.0], (3, 1)))
    smoothed = smooth(program, Settings(tolerance=TOLERANCE, shape=shape))  # type: ignore[arg-type]
    curve, _ = nurbs.control_points(program, smoothed.corners, slice(None), 10.0)
    u = np.linspace(0.0, 1.0, 401)
    point, first, second = (value[0] for value in nurbs.derivatives(curve, smoothed.corners.weights, u))
    curvature = np.linalg.norm(np.cross(first, second), axis=1) / np.linalg.norm(first, axis=1) ** 3
    way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(point, axis=0), axis=1))))
    return point[:, :2], way - way[200], curvature


def draw() -> str:
    """Return the picture as SVG text."""
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 380" font-family="sans-serif" font-size="16">',
        '<rect width="960" height="380" fill="#ffffff"/>',
    ]
    origin, scale = PLAN
    slope = np.tan(np.radians(TURN) / 2.0)
    legs = np.array([[-0.19, -0.19 * slope], [0.0, 0.0], [0.19, -0.19 * slope]])
    parts.append(polyline(origin + scale * legs * [1.0, -1.0], GREY))
    base, across, up = CHART
    parts.append(polyline(base + np.array([[-200.0, 0.0], [200.0, 0.0]]), GREY))
    for kappa in (5, 10, 15):
        parts.append(polyline(base + np.array([[-200.0, -up * kappa], [200.0, -up * kappa]]), 'stroke="#d9dee3"'))
        parts.append(text(base[0] - 230.0, base[1] - up * kappa + 5.0, str(kappa)))
    for shape, colour in COLOURS.items():
        points, way, curvature = corner(shape)
        style = f'stroke="{colour}" stroke-width="3"'
        parts.append(polyline(origin + scale * points * [1.0, -1.0], style))
        parts.append(polyline(base + np.stack((across * way, -up * curvature), axis=1), style))
    middle = origin + np.array([0.0, scale * TOLERANCE])
    parts += [
        polyline(np.array([origin, middle]), 'stroke="#333333" stroke-width="1.5"'),
        text(origin[0] + 8.0, origin[1] + 26.0, "ε"),
        text(30.0, 356.0, f"a corner of {TURN:.0f}°, both curves at ε = {TOLERANCE} mm"),
        text(base[0] - 200.0, 356.0, "curvature, 1/mm, over the way along the curve"),
        text(base[0] + 80.0, base[1] - 292.0, "--shape paper", f'fill="{COLOURS["paper"]}"'),
        text(base[0] + 80.0, base[1] - 270.0, "--shape auto", f'fill="{COLOURS["auto"]}"'),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    (HERE / "shape.svg").write_text(draw(), encoding="utf-8")
