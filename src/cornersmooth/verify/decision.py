"""Where the written motion is on the CL path, and where the two part: the decision, batch by batch.

Both are run beside each other, tips and axis points together. Where the task says `apart`, each is run on its own as
well: then together they have more room.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Elements
from cornersmooth.verify.chain import Path, Sections
from cornersmooth.verify.motions import Motion, inner_points
from cornersmooth.verify.nearest import COLUMNS, Metric
from cornersmooth.verify.passage import Break, Walk
from cornersmooth.verify.task import ARITHMETIC, Task


class Decision:
    """Decides one batch after another."""

    def __init__(self, task: Task) -> None:
        self._task = task
        self._walks: list[tuple[Metric, Walk]] = [("both", Walk(task.path, task.radius))]
        if task.apart:
            alone: tuple[Metric, ...] = ("tip", "axis point")
            self._walks += [(one, Walk(_only(task.path, COLUMNS[one]), task.tolerance + ARITHMETIC)) for one in alone]
        #: place on the CL path of the last vertex
        self.reached = 0.0

    def take(
        self, nc: Elements, motion: Motion, rows: tuple[Ints, Ints], stretches: NDArray[Any], *, goes_on: bool
    ) -> tuple[Floats, tuple[tuple[Metric, Break], ...], bool]:
        """Go on with the motion of some elements, of which stretches begin and end at rows: place, breaks and whole.

        They are those of `Batch`, and so is `goes_on`.
        """
        start, stop = stretches["start"] + stretches["fraction"], stretches["stop"].astype(np.float64)
        place, breaks, whole = np.zeros(0), [], True
        for metric, walk in self._walks:
            columns = COLUMNS[metric]

            def inner(number: Floats, columns: slice = columns) -> Floats:
                return inner_points(nc, motion, self._task, number)[:, columns]

            passed = walk.take(motion.six[:, columns], motion.bend, Sections(*rows, start, stop, goes_on), inner)
            place = passed.place if metric == "both" else place
            breaks += [(metric, one) for one in passed.breaks]
            whole &= passed.whole
        self.reached = float(np.nanmax(place, initial=start[-1]))
        return place, tuple(breaks), whole


def _only(path: Path, columns: slice) -> Path:
    """Tips or axis points alone."""
    return Path.of(np.ascontiguousarray(path.points[:, columns]), path.bend, lambda place: path.at(place)[:, columns])
