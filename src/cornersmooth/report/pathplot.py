"""The path, its corners and its deviation on paper.

Needs matplotlib, which only the extra ``cornersmooth[plot]`` installs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cornersmooth.model import Floats, Program, SmoothProgram
from cornersmooth.nc_reader import NcProgram
from cornersmooth.report.paths import original_path, written_path
from cornersmooth.report.picture import new_figure, saved
from cornersmooth.report.thinning import thinned
from cornersmooth.smoothing.sharp import other_corners, sharp_rows

#: points drawn of each path
_POINTS = 20_000


def draw_path(
    program: Program, nc: NcProgram, smoothed: SmoothProgram, title: str, form: str, *, tolerance: float
) -> bytes:
    """Picture of a smoothed program: the written path coloured by its deviation, and the deviation along it.

    Parameters
    ----------
    program : Program
    nc : NcProgram
        The written text, read back.
    smoothed : SmoothProgram
    title : str
    form : {"png", "svg", "pdf"}
    tolerance : float, mm
        Drawn as a line.

    Raises
    ------
    SettingsError
        CS262: matplotlib is not installed.
    """
    figure = new_figure(8.0, 9.0)
    height, own = smoothed.settings.axis_length, smoothed.settings.axis_tolerance
    original = original_path(program)
    written = written_path(program, nc, original, tolerance=tolerance, axis_length=height, axis_tolerance=own)
    off = np.fmax(written.tip_off, written.axis_off)
    keep = thinned(written.tip, off, off > tolerance, _POINTS)
    above, below = figure.subfigures(2, 1, height_ratios=(2.0, 1.0))
    view: Any = above.add_subplot(projection="3d")
    cutting = keep[~written.rapid[keep]]
    first = thinned(original.tip, np.zeros(len(original.tip)), original.breaks, _POINTS)
    feeding = np.where(original.rapid[first, None] | original.breaks[first, None], np.nan, original.tip[first])
    view.plot(*feeding.T, color="0.6", linewidth=0.6, label="original")
    points = view.scatter(
        *written.tip[cutting].T, c=off[cutting], s=1.5, cmap="viridis", vmin=0.0, vmax=tolerance, label="written"
    )
    sharp = np.append(
        smoothed.corners.pose[sharp_rows(smoothed)], other_corners(program, smoothed.settings.axis_length).pose
    )
    view.scatter(*program.tip[sharp].T, color="#d55e00", marker="D", s=18, label="sharp corners")
    view.set_aspect("equal")
    _box(view, written.tip[cutting])
    view.legend(loc="upper right", fontsize=8)
    view.set_title(_plain(title), fontsize=10)
    for name in ("x", "y", "z"):
        getattr(view, f"set_{name}label")(f"{name}, mm")
    above.colorbar(points, ax=view, shrink=0.6, label="deviation, mm")
    graph: Any = below.subplots()
    for label, values in (("axis point", written.axis_off), ("tip", written.tip_off)):
        graph.plot(written.way[keep], values[keep], linewidth=0.7, label=label)
    graph.axhline(tolerance, color="black", linestyle="--", linewidth=0.8)
    graph.set_xlabel("path, mm")
    graph.set_ylabel("deviation, mm")
    graph.legend(fontsize=8)
    graph.grid(visible=True, linewidth=0.3)
    return saved(figure, form)


def _box(view: Any, points: Floats) -> None:
    """Room about the cutting moves alone."""
    if len(points):
        low, high = points.min(axis=0), points.max(axis=0)
        half = 0.55 * max(float((high - low).max()), 1e-3)
        for name, middle in zip("xyz", (low + high) / 2.0, strict=True):
            getattr(view, f"set_{name}lim")(middle - half, middle + half)


def _plain(title: str) -> str:
    """A title without the marks of formulas, short."""
    return title.replace("$", "\\$")[:120]
