"""Which places a written vertex may have: more than one where the path stands or turns back.

Feeds, words and exact poses ask for it: what holds at one of these places holds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.free_space import FreeSpace, Reached
from cornersmooth.verify.motions import Motion
from cornersmooth.verify.task import Task

#: vertices on either side of one from whose places it is worked out: more places could only be found with more
_AROUND: Final = 64


@dataclass
class Reachable:
    """Places of the vertices of a batch."""

    task: Task
    motion: Motion
    place: Floats  #: (v,): One place of each; NaN for none.
    section: Ints  #: (v,): the stretch of each
    _known: dict[int, Reached] = field(default_factory=dict)

    def places(self, vertex: int) -> Reached:
        """All places of a vertex from which the places of vertices far before and far behind it are reached."""
        if vertex not in self._known:
            self._known |= self._around(vertex)
        return self._known.get(vertex, {})

    def segments(self, vertex: int) -> Ints:
        """Segments of the CL path that a vertex may be on, ascending."""
        return np.array(sorted(self.places(vertex)), np.int64)

    def may_be_at(self, vertex: int, pose: Ints) -> Bools:
        """(k,) whether a vertex may be at vertices of the CL path."""
        places = self.places(vertex)
        none = np.inf, -np.inf
        return np.array(
            [
                places.get(k, none)[0] <= 0.0 <= places.get(k, none)[1]
                or places.get(k - 1, none)[0] <= 1.0 <= places.get(k - 1, none)[1]
                for k in pose.tolist()
            ],
            np.bool_,
        )

    def _around(self, vertex: int) -> dict[int, Reached]:
        """Places of the vertices around one: of those in the middle they are known well."""
        if np.isnan(self.place[vertex]):
            return {}
        rows = np.arange(max(vertex - _AROUND, 0), min(vertex + _AROUND + 1, len(self.place)))
        same = (self.section[rows] == self.section[vertex]) & np.isfinite(self.place[rows])
        gaps = np.flatnonzero(~same)
        before, behind = gaps[rows[gaps] < vertex], gaps[rows[gaps] > vertex]
        rows = rows[(before[-1] + 1 if len(before) else 0) : (behind[0] if len(behind) else len(rows))]
        first, last = int(rows[0]), int(rows[-1])
        path, start = self.task.path, float(self.place[first])
        bottom = int(start)
        top = min(max(int(np.ceil(self.place[last])), bottom + 1), path.segments)
        count = top - bottom
        space = FreeSpace(
            self.motion.six[first : last + 1].T,
            path.points[bottom : top + 1].T,
            self.task.radius + float(self.motion.bend[first:last].max(initial=0.0)),
            self.motion.bend[first:last],
            np.zeros(count),
        )
        forward = [space.along(0, start - bottom)]
        forward += [reached for _, reached in space.sweep(0, forward[0])]
        if len(forward) < len(rows) or not forward[-1]:
            return {vertex: {}}
        found = space.between(forward, float(self.place[last]) - bottom)
        quarter = max(_AROUND // 4, 1)
        return {
            first + k: {bottom + j: ends for j, ends in reached.items()}
            for k, reached in enumerate(found)
            if abs(first + k - vertex) <= quarter or first + k == vertex
        }
