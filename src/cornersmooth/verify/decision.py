"""Where the written motion is on the CL path, and where the two part: the decision, batch by batch.

Both are run beside each other, tips and axis points together. Where the task says `apart`, each is run on its own as
well: then together they have more room.
"""

from __future__ import annotations

from functools import partial
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
            self._walks += [
                (metric, Walk(_only(task.path, metric), task.tolerance + ARITHMETIC))
                for metric in ("tip", "axis point")
            ]
        #: place on the CL path of the last vertex
        self.reached = 0.0

    def take(
        self,
        nc: Elements,
        motion: Motion,
        rows: tuple[Ints, Ints],
        stretches: NDArray[Any],
        *,
        goes_on: bool,
    ) -> tuple[Floats, tuple[tuple[Metric, Break], ...], bool]:
        """Go on.

        Parameters
        ----------
        nc : Elements
            Those that the motion is of.
        rows : (k,) int64, (k,) int64
            The first and the last vertex of each stretch.
        stretches : (k,) STRETCH
            Where they are on the CL path.
        goes_on : bool
            Whether the last of them does so in the next batch.

        Returns
        -------
        place, breaks, whole
            As in `Batch`.
        """
        start, stop = stretches["start"] + stretches["fraction"], stretches["stop"].astype(np.float64)
        place, breaks, whole = np.zeros(0), [], True
        for metric, walk in self._walks:
            columns = COLUMNS[metric]
            sections = Sections(*rows, start, stop, goes_on)
            inner = partial(_inner, nc, motion, self._task, columns)
            passed = walk.take(motion.six[:, columns], motion.bend, sections, inner)
            place = passed.place if metric == "both" else place
            breaks += [(metric, one) for one in passed.breaks]
            whole &= passed.whole
        self.reached = float(np.nanmax(place, initial=start[-1]))
        return place, tuple(breaks), whole


def _only(path: Path, metric: Metric) -> Path:
    """Tips or axis points alone."""
    columns, exact = COLUMNS[metric], path.exact
    points = np.ascontiguousarray(path.points[:, columns])
    alone = None if exact is None else lambda place: exact(place)[:, columns]
    return Path.of(points, path.bend, alone)


def _inner(nc: Elements, motion: Motion, task: Task, columns: slice, number: Floats) -> Floats:
    return inner_points(nc, motion, task, number)[:, columns]
