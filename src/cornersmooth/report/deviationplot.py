"""Deviation along the path and how it is distributed, as a picture like Figures 10, 11 and 16 of the paper.

Needs matplotlib, which only the extra ``cornersmooth[plot]`` installs.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.report.along import Distribution
from cornersmooth.report.picture import new_figure, saved

#: points drawn along the path: of more, the largest of each group is kept
_POINTS = 20_000

_CLASSES = 50


def draw_deviation(found: Distribution, tolerance: float, form: str) -> bytes:
    """Picture of a distribution: deviation over the path above, histogram below.

    Parameters
    ----------
    found : Distribution
    tolerance : float, mm
        Drawn as a line.
    form : {"png", "svg", "pdf"}

    Raises
    ------
    SettingsError
        CS262: matplotlib is not installed.
    """
    figure = new_figure(8.0, 6.0)
    path, classes = figure.subplots(2, 1)
    group = max(-(-len(found) // _POINTS), 1)
    starts = np.arange(0, len(found), group)
    for label, values in (("tip", found.tip), ("axis point", found.axis_point)):
        if len(starts):
            path.plot(found.way[starts], np.maximum.reduceat(values, starts), linewidth=0.8, label=label)
            classes.hist(values, bins=_CLASSES, histtype="step", label=label)
    path.axhline(tolerance, color="black", linewidth=0.8, linestyle="--")
    path.set_xlabel("path, mm")
    path.set_ylabel("deviation, mm")
    classes.set_xlabel("deviation, mm")
    classes.set_ylabel("poses")
    classes.set_yscale("log")
    path.legend()
    for graph in (path, classes):
        graph.grid(visible=True, linewidth=0.3)
    return saved(figure, form)
