"""Elements of a text to batches that are decided each by itself; the parse says what is a stretch of both motions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from cornersmooth.nc_reader.elements import Ahead, Elements, Event, Problem
from cornersmooth.verify.acts import Acts
from cornersmooth.verify.holes import leads_nowhere
from cornersmooth.verify.match import Batch
from cornersmooth.verify.parse import Parse
from cornersmooth.verify.task import Task


class Batches:
    """Makes batches of the elements of a text, as they come, counted in all of it; `events`, `retracts` grow along."""

    def __init__(self, task: Task, events: Sequence[Event], retracts: Sequence[int]) -> None:
        self.task, self._events, self._retracts = task, events, retracts
        self.acts = Acts()
        self.elements = 0
        self.room = 0.0  #: mm: distance that the printed digits account for

    def of(self, chunks: Iterable[Elements]) -> Iterator[Batch]:
        """Give out all batches of a text."""
        original, acts = self.task.original, self.acts
        ahead = Ahead(self._standing(nc for nc in chunks if len(nc)))
        if ahead.has(0) and len(original.pose):
            parse = Parse(self.task, ahead, self._events, self._retracts, acts)
            self.room, stretches = parse.lines.room, parse.stretches
            for stop in parse.parts():
                yield from stretches.take(stop)
            stretches.end(len(original.pose) - 1, ahead.count - 1)
            stretches.leave()
            yield from stretches.ready
        elif ahead.count:
            text = "motion that the CL file does not have"
            acts.problems.append(Problem("CS534", 0, int(ahead.nc.line[0]), text))
            while ahead.has(ahead.count):
                ahead.forget(ahead.count - 1)
        elif len(original.pose):
            line = int(original.program.line[original.pose[0]])
            acts.problems.append(Problem("CS534", line, 0, "the program lacks motion of the CL file"))
        self.elements = ahead.count

    def _standing(self, chunks: Iterable[Elements]) -> Iterator[Elements]:
        """Give out elements, and take down which lead nowhere."""
        offset, ends = 0, [np.full((1, 3), np.inf)] * 2
        for nc in chunks:
            ways = [np.diff(one, axis=0, prepend=before) for one, before in zip((nc.tip, nc.second), ends, strict=True)]
            rows = np.flatnonzero(np.abs(ways[0][:, 0]) <= 2.0 * nc.tip_step)  # most do not, by X alone
            rows = rows[leads_nowhere(nc, rows, ways[0][rows], ways[1][rows])]
            self.acts.still.update((offset + rows).tolist())
            offset, ends = offset + len(nc), [nc.tip[-1:], nc.second[-1:]]
            yield nc
