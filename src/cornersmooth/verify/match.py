"""A batch of elements with the places of its vertices on the CL path, and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.chain import Path, passed
from cornersmooth.verify.cl_motion import Original
from cornersmooth.verify.decision import Batch, Decision, decide
from cornersmooth.verify.passage import MOST_BREAKS
from cornersmooth.verify.task import Task


@dataclass(frozen=True, kw_only=True)
class Match(Batch, Decision):
    """A batch beside the CL motion, v vertices."""

    task: Task

    @classmethod
    def of(cls, task: Task, batch: Batch, most: int = MOST_BREAKS) -> Match:
        """Decide a batch."""
        return cls(task=task, **vars(batch), **vars(decide(task, batch, most)))

    @property
    def six(self) -> Floats:
        """(v, 6) vertices: tip and axis point."""
        return self.motion.six

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
        return self.on[1:] & self.on[:-1] & (self.section[1:] == self.section[:-1])

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
        """(v,) first segment of the CL path in the stretch a vertex belongs to."""
        return np.minimum(self.stretches["start"][np.maximum(self.section, 0), 0].astype(np.int64), self.high)

    @cached_property
    def lowest(self) -> Ints:
        """(v,) first segment that a vertex may be on: where a batch begins at a cut, that is only guessed."""
        return np.where(self.continued & (self.section == 0), 0, self.low)

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
        own, place = np.ascontiguousarray(self.six[on].T), self.place[on]
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
