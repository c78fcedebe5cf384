"""Deviation along the path and how it is distributed, as a picture like Figures 10, 11 and 16 of the paper.

Needs matplotlib, which only the extra ``cornersmooth[plot]`` installs.
"""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.extras import install_hint
from cornersmooth.report.along import Distribution

FORMATS = ("png", "svg", "pdf")

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
    try:
        import matplotlib as mpl
        from matplotlib.figure import Figure
    except ImportError as missing:
        raise SettingsError("CS262", "pictures need matplotlib", install_hint("plot")) from missing
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
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
    stream = BytesIO()
    # same input, same bytes: no date, and names of parts that do not change
    metadata: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(form, {})
    with mpl.rc_context({"svg.hashsalt": "cornersmooth"}):
        figure.savefig(stream, format=form, metadata=metadata)
    return stream.getvalue()
