"""Speed and acceleration over time as pictures, like Figures 14 and 15 of the paper.

Needs matplotlib, which only the extra ``cornersmooth[plot]`` installs.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import Any

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.extras import install_hint
from cornersmooth.feedrate.timelaw import TimeLaw

FORMATS = ("png", "svg", "pdf")

#: points drawn per law: more cannot be told apart
_POINTS = 20_000


def draw(laws: Mapping[str, TimeLaw], form: str) -> bytes:
    """Picture of some laws: a column of two graphs for each, all to the same scales.

    Parameters
    ----------
    laws : mapping of str to TimeLaw
        Titles and laws.
    form : {"png", "svg", "pdf"}

    Raises
    ------
    SettingsError
        matplotlib is not installed.
    """
    try:
        import matplotlib as mpl
        from matplotlib.figure import Figure
    except ImportError as missing:
        raise SettingsError("CS262", "pictures need matplotlib", install_hint("plot")) from missing
    figure = Figure(figsize=(6.0 * len(laws), 6.0), layout="constrained")
    graphs: Any = figure.subplots(2, len(laws), sharex=True, sharey="row", squeeze=False)
    for column, (title, law) in enumerate(laws.items()):
        times = law.every_period()
        if len(times) > _POINTS:
            times = np.linspace(0.0, law.total, _POINTS)
        _, v, a, _ = law.kinematics(times)
        for row, (values, label) in enumerate(((60.0 * v, "speed, mm/min"), (a, "acceleration, mm/s²"))):
            graph = graphs[row, column]
            graph.plot(times, values, linewidth=0.8)
            graph.grid(visible=True, linewidth=0.3)
            if not column:
                graph.set_ylabel(label)
        graphs[0, column].set_title(f"{title}: {law.total:.3f} s")
        graphs[1, column].set_xlabel("time, s")
    stream = BytesIO()
    # same input, same bytes: no date, and names of parts that do not change
    with mpl.rc_context({"svg.hashsalt": "cornersmooth"}):
        figure.savefig(
            stream, format=form, dpi=120, metadata={"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(form)
        )
    return stream.getvalue()
