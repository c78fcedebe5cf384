"""What shapes and lengths of transitions gain: seconds, blocks and bytes as a table in Markdown.

python benchmarks/shapes.py [-e MM] [--feed MM/MIN] [--accel A] [--jerk J] FILE...

The last columns drive every transition at one speed, at which the jerk of the motion along the curve stays within the
limit as well: sqrt(κ′² + κ⁴)·v³ ≤ J, which the time laws of `cornersmooth time` do not limit.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import Any

import numpy as np

import cornersmooth
from cornersmooth.feedrate import Limits, direct, plan
from cornersmooth.model import SmoothProgram
from cornersmooth.nc import choose_form
from cornersmooth.smoothing import nurbs

CHOICES: dict[str, dict[str, Any]] = {
    "zhang2016": {"method": "zhang2016"},
    "paper": {},
    "auto": {"shape": "auto"},
    "fair": {"allocation": "fair"},
    "auto fair": {"shape": "auto", "allocation": "fair"},
    "1,0.65": {"weights": (1.0, 0.65)},
}
WRITTEN = ("paper", "auto", "auto fair")
SAMPLES = 64


def across(smoothed: SmoothProgram, limits: Limits, feed: float) -> float:
    """Seconds over all feed moves at one speed per transition, limited by feed, curvature and jerk across the path."""
    program, corners = smoothed.program, smoothed.corners
    rows = np.flatnonzero(corners.smoothed)
    u, step = (np.arange(SAMPLES) + 0.5) / SAMPLES, 1e-4
    points, _ = nurbs.control_points(program, corners, rows, smoothed.settings.axis_length)

    def curvature(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        _, first, second = nurbs.derivatives(points, corners.weights[rows], at)
        speed = np.maximum(np.linalg.norm(first, axis=-1), 1e-12)
        return np.linalg.norm(np.cross(first, second), axis=-1) / speed**3, speed

    kappa, speed = curvature(u)
    rate = np.abs(curvature(u + step)[0] - curvature(u - step)[0]) / (2 * step) / speed
    with np.errstate(divide="ignore"):
        jerk = (limits.jerk / np.sqrt(rate**2 + kappa**4)) ** (1 / 3)
        v = np.minimum(np.minimum(feed, jerk), np.sqrt(limits.centripetal_accel / kappa)).min(axis=1)
    length = 0.0
    for first, last in program.chains:
        length += float(np.linalg.norm(np.diff(program.tip[first : last + 1], axis=0), axis=1).sum())
    legs = [
        np.linalg.norm(program.tip[corners.pose[rows]] - program.tip[other[rows]], axis=1) * trim[rows]
        for other, trim in ((corners.before, corners.trim_in), (corners.after, corners.trim_out))
    ]
    return float((speed.mean(axis=1) / v).sum() + (length - legs[0].sum() - legs[1].sum()) / feed)


def size(program: cornersmooth.Program, form: str, tolerance: float, options: dict[str, Any]) -> str:
    """Blocks and bytes of the NC text."""
    settings = cornersmooth.fit_settings(
        cornersmooth.Settings(tolerance=tolerance, **options), choose_form("fanuc", form), program.units
    )
    stream = io.BytesIO()
    written = cornersmooth.write(cornersmooth.smooth(program, settings), stream, form=form)
    return f"{written.blocks} / {len(stream.getvalue()) / 1000:.0f} kB"


def main() -> None:
    """Print one row per file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("-e", type=float, default=0.01, dest="tolerance")
    parser.add_argument("--feed", type=float, default=6000.0)
    parser.add_argument("--accel", type=float, default=2000.0)
    parser.add_argument("--jerk", type=float, default=50000.0)
    given = parser.parse_args()
    limits = Limits(feed=given.feed, accel=given.accel, jerk=given.jerk)
    heads = ["file", "ε", "exact stop", "velocity jump", *CHOICES]
    heads += [f"{form} {name}" for form in ("g1", "g6.2") for name in WRITTEN]
    heads += [f"across: {name}" for name in ("paper", "auto", "fair", "auto fair", "1,0.65")]
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    for path in given.files:
        program = cornersmooth.read(path)
        cells = [path.name, f"{given.tolerance:g}"]
        cells += [f"{direct(program, limits, law).total:.3f}" for law in ("exact_stop", "velocity_jump")]
        made = {
            name: cornersmooth.smooth(program, cornersmooth.Settings(tolerance=given.tolerance, **options))
            for name, options in CHOICES.items()
        }
        seconds = {name: plan(smoothed, limits).total for name, smoothed in made.items()}
        cells += [f"{seconds[name]:.3f}{change(seconds[name], seconds['paper'])}" for name in CHOICES]
        cells += [size(program, form, given.tolerance, CHOICES[name]) for form in ("g1", "g6.2") for name in WRITTEN]
        bound = {name: across(smoothed, limits, given.feed / 60.0) for name, smoothed in made.items()}
        cells += [f"{bound[name]:.3f}{change(bound[name], bound['paper'])}" for name in CHOICES if name != "zhang2016"]
        print("| " + " | ".join(cells) + " |", flush=True)


def change(value: float, base: float) -> str:
    """Return the relative change where there is one."""
    return "" if value == base else f" ({100 * (value / base - 1):+.1f} %)"


if __name__ == "__main__":
    main()
