"""Speed and acceleration over time as pictures, like Figures 14 and 15 of the paper.

Needs matplotlib, which only the extra ``cornersmooth[plot]`` installs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.report.picture import new_figure, saved

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
        CS262: matplotlib is not installed.
    """
    figure = new_figure(6.0 * len(laws), 6.0)
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
    return saved(figure, form)
