"""A batch of elements: whether it can be run beside the CL motion, and where its vertices are there.

Tips and axis points are run together. Where the task says `apart`, each is run on its own as well: then together they
have more room.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Elements
from cornersmooth.verify.chain import Path, Sections, passed
from cornersmooth.verify.motions import COLUMNS, Metric, Motion
from cornersmooth.verify.passage import Break, Passage
from cornersmooth.verify.task import Original, Task


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


@dataclass(frozen=True, kw_only=True)
class Match(Batch):
    """A batch beside the CL motion, v vertices."""

    task: Task
    motion: Motion  #: the polyline of the elements from the end of the first stretch's `first` on
    #: (v,): segment plus fraction of the CL path, ascending; NaN where a vertex is none of a stretch, or not reached
    place: Floats
    breaks: tuple[tuple[Metric, Break], ...]  #: where the motions part, and what does

    @classmethod
    def of(cls, task: Task, batch: Batch) -> Self:
        """Run the motions beside each other."""
        rows, lead = batch.stretches, int(batch.continued)
        part = batch.nc.part(lead, len(batch.nc))
        motion = task.motion(part)
        ends = motion.last[rows["first"] - lead], motion.last[rows["last"] - lead]
        place, breaks = np.zeros(0), []
        for k, (metric, (path, radius)) in enumerate(task.runs.items()):
            columns = COLUMNS[metric]
            sections = Sections(*ends, rows["start"][:, k], rows["end"][:, k], rows["guessed"])

            def inner(number: Floats, columns: slice = columns) -> Floats:
                return motion.at(number)[:, columns]

            found = Passage(motion.six[:, columns], motion.bend, path, radius, sections, inner)
            place = place if k else found.place
            breaks += [(metric, one) for one in found.breaks]
        return cls(task=task, motion=motion, place=place, breaks=tuple(breaks), **vars(batch))

    @property
    def six(self) -> Floats:
        """(v, 6) vertices: tip and axis point."""
        return self.motion.six

    @cached_property
    def columns(self) -> Floats:
        """(6, v) the same, each number of all vertices side by side."""
        return np.ascontiguousarray(self.six.T)

    @property
    def original(self) -> Original:
        """The CL motion."""
        return self.task.original

    @property
    def path(self) -> Path:
        """The CL path."""
        return self.task.path

    @property
    def tolerance(self) -> float:
        """ε, mm."""
        return self.task.tolerance

    @cached_property
    def on(self) -> Bools:
        """(v,) whether a vertex has a place."""
        return np.isfinite(self.place)

    @cached_property
    def section(self) -> Ints:
        """(v,) number of the stretch of each vertex in this batch; -1 for none."""
        rows, ends = self.stretches, self.motion.last
        first, last = ends[rows["first"] - self.first], ends[rows["last"] - self.first]
        number = np.searchsorted(first, np.arange(len(self.six)), side="right") - 1
        inside = (number >= 0) & (np.arange(len(number)) <= last[np.maximum(number, 0)])
        return np.where(inside, number, -1)

    @cached_property
    def step(self) -> Bools:
        """(v - 1,) whether each step is run beside the CL path."""
        number, last = self.section[:-1], self.motion.last[self.stretches["last"] - self.first]
        # a vertex where one stretch ends and another begins is of the latter, and the step to it of the former
        inside: Bools = (number >= 0) & (np.arange(len(number)) < last[np.maximum(number, 0)])
        return self.on[1:] & self.on[:-1] & inside

    @cached_property
    def feeding(self) -> Bools:
        """(e - 1,) whether each element but the first is run beside the CL path from end to end."""
        gone = np.concatenate(([0], np.cumsum(self.step)))
        last = self.motion.last
        return gone[last[1:]] - gone[last[:-1]] == np.diff(last)

    @cached_property
    def runs(self) -> tuple[Ints, Ints]:
        """(v,) first and last vertex of what is run beside the CL path without a break around each vertex."""
        index = np.arange(len(self.six))
        begins, ends = np.append(True, ~self.step), np.append(~self.step, True)
        first = np.maximum.accumulate(np.where(begins, index, 0))
        last = np.minimum.accumulate(np.where(ends, index, len(index))[::-1])[::-1]
        return first, last

    @cached_property
    def owner(self) -> Ints:
        """(v,) element that leads to each vertex, counted in `nc`."""
        return self.motion.owner + self.first

    @cached_property
    def segment(self) -> Ints:
        """(v,) segment of the CL path; 0 where there is no place."""
        return np.minimum(np.nan_to_num(self.place).astype(np.int64), self.path.segments - 1)

    @cached_property
    def low(self) -> Ints:
        """(v,) first segment of the CL path that a vertex may be on: where a batch begins at a cut, any."""
        first = np.minimum(self.stretches["start"][np.maximum(self.section, 0), 0].astype(np.int64), self.high)
        return np.where(self.continued & (self.section == 0), 0, first)

    @cached_property
    def high(self) -> Ints:
        """(v,) last segment of the CL path in the stretch a vertex belongs to."""
        return self.stretches["stop"][np.maximum(self.section, 0)] - 1

    @cached_property
    def passing(self) -> tuple[Ints, Ints, Floats]:
        """Vertices (k,) of the path that are passed, in order, those where runs begin included.

        And the written vertices that the steps begin at on which they are, and fractions of these steps.
        """
        on = np.flatnonzero(self.on)
        if len(on) < 2:
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
        own, place = self.columns.take(on, axis=1), self.place[on]
        row, vertex, share = passed(own, own[:, 1:] - own[:, :-1], self.path.points, place)
        row = on[row]
        inside = self.step[row]
        begin = on[np.append(True, ~self.step[on[1:] - 1])]
        begin = begin[(self.place[begin] == self.segment[begin]) & (begin < len(self.six) - 1)]
        begin = begin[self.step[begin]]
        if not len(begin) and inside.all():
            return vertex, row, share
        vertex = np.concatenate((vertex[inside], self.segment[begin]))
        order = np.argsort(vertex, kind="stable")
        row, share = np.concatenate((row[inside], begin)), np.concatenate((share[inside], np.zeros(len(begin))))
        return vertex[order], row[order], share[order]

    def cl_lines(self, place: Floats) -> Ints:
        """(k,) lines of the CL file that lead to places."""
        original = self.original
        rows = np.minimum(np.ceil(np.nan_to_num(place)).astype(np.int64), len(original.trail) - 1)
        return original.program.line[original.pose[original.trail.owner[rows]]]

    def nc_lines(self, row: Ints) -> Ints:
        """(k,) lines of the text that lead to written vertices."""
        return self.nc.line[self.owner[row]]
