"""Whether a batch of the written motion can be run beside the CL motion, and where each of its vertices is there.

Tips and axis points are run together. Where the task says `apart`, each is run on its own as well: then together they
have more room.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Elements
from cornersmooth.verify.chain import Sections
from cornersmooth.verify.motions import Motion, inner_points, written_motion
from cornersmooth.verify.nearest import COLUMNS, Metric
from cornersmooth.verify.passage import Break, Walk
from cornersmooth.verify.task import ARITHMETIC, Task


@dataclass(frozen=True, kw_only=True)
class Decision:
    """The polyline of a batch, v vertices, and where it is on the CL path."""

    motion: Motion  #: the polyline of the elements from the end of the first stretch's `first` on
    #: (v,): segment plus fraction of the CL path, ascending; NaN where a vertex is none of a stretch, or not reached
    place: Floats
    breaks: tuple[tuple[Metric, Break], ...]  #: where the motions part, and what does
    whole: bool  #: whether all was decided
    reached: float  #: the last place


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Elements that are decided at once, and then measured."""

    nc: Elements
    offset: int  #: number of the first of them in the whole text
    #: `first` and `last`: each stretch begins at the end of one element and ends with another, counted in this batch;
    #: `start` and `end`: places where it begins and ends on the CL path, the latter NaN where that is to be found;
    #: `stop`: its last segment plus one, with what is in the next batch
    stretches: NDArray[Any]
    #: whether the first stretch begins in the batch before: one more element stands in front of it
    continued: bool
    goes_on: bool  #: whether the last stretch goes on in the next batch
    words: Ints  #: elements of the whole text with words behind them, ascending
    decided: Decision | None = None

    @property
    def first(self) -> int:
        """Element at the end of which it begins."""
        return int(self.stretches["first"][0])


class Decider:
    """Decides batches: one after the other that go on from each other, or a single one."""

    def __init__(self, task: Task) -> None:
        self._task = task
        self._walks: list[tuple[Metric, Walk]] = [("both", Walk(task.path, task.radius))]
        if task.apart:
            alone: tuple[Metric, ...] = ("tip", "axis_point")
            self._walks += [(one, Walk(task.path.only(COLUMNS[one]), task.tolerance + ARITHMETIC)) for one in alone]

    def decide(self, batch: Batch) -> Decision:
        """Run the motions beside each other."""
        task, rows, lead = self._task, batch.stretches, int(batch.continued)
        part = batch.nc.part(lead, len(batch.nc))
        motion = written_motion(part, task)
        ends = motion.last[rows["first"] - lead], motion.last[rows["last"] - lead]
        open_end = bool(np.isnan(rows["end"][-1]))
        stop = np.where(np.isnan(rows["end"]), rows["stop"], rows["end"])
        sections = Sections(*ends, rows["start"], stop, open_end)
        place, breaks, whole = np.zeros(0), [], True
        for metric, walk in self._walks:
            columns = COLUMNS[metric]

            def inner(number: Floats, columns: slice = columns) -> Floats:
                return inner_points(part, motion, task, number)[:, columns]

            found = walk.take(motion.six[:, columns], motion.bend, sections, inner)
            place = found.place if metric == "both" else place
            breaks += [(metric, one) for one in found.breaks]
            whole &= found.whole
        reached = float(np.nanmax(place, initial=float(rows["start"][-1])))
        return Decision(motion=motion, place=place, breaks=tuple(breaks), whole=whole, reached=reached)
