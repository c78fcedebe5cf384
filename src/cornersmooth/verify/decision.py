"""Whether a batch of the written motion can be run beside the CL motion, and where each of its vertices is there.

Tips and axis points are run together. Where the task says `apart`, each is run on its own as well: then together they
have more room.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats
from cornersmooth.nc_reader.elements import Elements
from cornersmooth.verify.chain import Sections
from cornersmooth.verify.motions import Motion, inner_points, written_motion
from cornersmooth.verify.nearest import COLUMNS, Metric
from cornersmooth.verify.passage import Break, Passage
from cornersmooth.verify.task import Task


@dataclass(frozen=True, kw_only=True)
class Decision:
    """The polyline of a batch, v vertices, and where it is on the CL path."""

    motion: Motion  #: the polyline of the elements from the end of the first stretch's `first` on
    #: (v,): segment plus fraction of the CL path, ascending; NaN where a vertex is none of a stretch, or not reached
    place: Floats
    breaks: tuple[tuple[Metric, Break], ...]  #: where the motions part, and what does


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Elements that are decided at once, and then measured."""

    nc: Elements
    offset: int  #: number of the first of them in the whole text
    #: `first` and `last`: each stretch begins at the end of one element and ends with another, counted in this batch;
    #: `start` and `end`: places where it begins and ends on the CL path, of both, of tips and of axis points;
    #: `guessed`: whether any of these is; `stop`: its last segment plus one, with what is in the next batch
    stretches: NDArray[Any]
    #: whether the first stretch begins in the batch before: one more element stands in front of it
    continued: bool
    goes_on: bool  #: whether the last stretch goes on in the next batch

    @property
    def first(self) -> int:
        """Element at the end of which it begins."""
        return int(self.stretches["first"][0])


def decide(task: Task, batch: Batch, most: int) -> Decision:
    """Run the motions beside each other; nothing is looked at after `most` places where they part."""
    rows, lead = batch.stretches, int(batch.continued)
    part = batch.nc.part(lead, len(batch.nc))
    motion = written_motion(part, task)
    ends = motion.last[rows["first"] - lead], motion.last[rows["last"] - lead]
    place, breaks = np.zeros(0), []
    for k, (metric, (path, radius)) in enumerate(task.runs.items()):
        columns = COLUMNS[metric]
        sections = Sections(*ends, rows["start"][:, k], rows["end"][:, k], rows["guessed"])

        def inner(number: Floats, columns: slice = columns) -> Floats:
            return inner_points(part, motion, task, number)[:, columns]

        found = Passage(motion.six[:, columns], motion.bend, path, radius, sections, inner, most)
        place = place if k else found.place
        breaks += [(metric, one) for one in found.breaks]
    return Decision(motion=motion, place=place, breaks=tuple(breaks))
