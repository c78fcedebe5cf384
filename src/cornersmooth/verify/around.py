"""What of some rows can be reached, worked out exactly; bent motions are divided more finely there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.chain import Path
from cornersmooth.verify.free_space import FreeSpace, Reached, holds, lowest

#: bend of steps where what can be reached is worked out exactly, in radii: it is taken off the radius; and the most
#: parts of a step there
FINE: Final = 1e-4
_MOST_PARTS: Final = 64

#: gives points (k, 3h) of the own motion at vertex numbers (k,) with fractions of the steps behind them
Inner = Callable[[Floats], Floats]


@dataclass
class Around:
    """Some rows against a part of the path, both perhaps divided more finely, and what of them is reached."""

    space: FreeSpace
    at: Ints  #: (k,): where the rows are among those of the space
    places: Floats  #: (m + 1,): of the vertices of the space on the whole path
    start: float  #: the place of the first row
    reached: list[Reached] = field(default_factory=list)  #: row by row of the space, from that place on

    @classmethod
    def of(
        cls,
        rows: tuple[Floats, Floats, Floats],
        path: Path,
        radius: float,
        start: float,
        top: int,
        inner: Inner | None,
        *,
        fine: bool,
    ) -> Around:
        """Rows against the path from the place of the first up to a vertex.

        They are vertices (k, 3h), the bends (k - 1,) of their steps, and their numbers (k,) for `Inner`. Their bends
        are taken off the radius; `fine`: bent steps and segments are divided before, but no steps that are looked back
        on: of these nothing is known but their ends.
        """
        own, bend, number = rows
        base = min(int(start), top - 1)
        theirs = _parts(path.bend[base:top], radius if fine else np.inf)
        ours = _parts(np.where(number[:-1] < 0.0, 0.0, bend), radius if fine and inner is not None else np.inf)
        places = _divided(np.arange(base, top + 1, dtype=np.float64), theirs)
        at = np.append(0, np.cumsum(ours))
        points = np.empty((own.shape[1], at[-1] + 1))
        points[:, at] = own.T
        between = np.setdiff1d(np.arange(at[-1] + 1), at, assume_unique=True)
        if inner is not None and len(between):
            points[:, between] = inner(_divided(number, ours)[between]).T
        beside = path.at(places) if fine else path.points[base : top + 1]
        bends = np.repeat(bend / ours**2, ours), np.repeat(path.bend[base:top] / theirs**2, theirs)
        return cls(FreeSpace(points, beside.T, radius, *bends), at, places, start)

    @property
    def row_reached(self) -> int:
        """The first row after the last of which something is reached; the last row if that is."""
        count = len(self.reached) - (not self.reached[-1])
        return min(int(np.searchsorted(self.at, count)), len(self.at) - 1)

    @property
    def bent(self) -> bool:
        """Whether either motion is bent where something was reached."""
        last = max(max(row, default=0) for row in self.reached) + 2
        largest = max(self.space.path_bend[:last].max(), self.space.own_bend[: len(self.reached)].max(initial=0.0))
        return bool(largest > FINE * self.space.radius)

    def inward(self, place: float) -> float:
        """A place of the whole path, counted here."""
        k = min(max(int(np.searchsorted(self.places, place, side="right")) - 1, 0), len(self.places) - 2)
        start, end = self.places[k : k + 2].tolist()
        return float(k + min((place - start) / (end - start), 1.0))

    def outward(self, place: float) -> float:
        """A place counted here, on the whole path; before a vertex that is not passed."""
        k = min(int(place), len(self.places) - 2)
        start, end = self.places[k : k + 2].tolist()
        there = start + (place - k) * (end - start)
        return float(min(there, np.nextafter(end, start)) if place < k + 1 else there)

    def goal(self, known: Floats, last: int, stop: int | None) -> float | None:
        """Go along the rows to one after the `last` that the chain does not prove, or to the end; None if that fails.

        Of the rows places (k,) by the chain are `known`, else NaN. The last row has to end at vertex `stop` of the
        path, anywhere if that is None, at a known place if it is -1.
        """
        final, end = len(self.places) - 2, len(self.at) - 1
        self.reached = [self.space.along(0, self.inward(self.start))]
        if not self.reached[0]:
            return None
        at = 1
        for row, here in self.space.sweep(0, self.reached[0]):
            self.reached.append(here)
            if not here:
                return None
            if row < self.at[at]:
                continue
            goes_on = last < at < end and self.places[0] <= known[at] <= self.places[-1]
            if goes_on and holds(here, self.inward(float(known[at])), final):
                return float(known[at])
            at = min(at + 1, end)
        if stop == -1:
            return None
        if stop is None:
            return self.outward(lowest(self.reached[-1]))
        return float(stop) if stop == self.places[-1] and holds(self.reached[-1], final + 1.0, final) else None

    def farthest(self) -> float:
        """Last place that was reached."""
        row = next((reached for reached in reversed(self.reached) if reached), None)
        if row is None:
            return self.start
        highest = max(row)
        return self.outward(highest + row[highest][1])


def _parts(bend: Floats, radius: float) -> Ints:
    """(k,) into how many parts steps are divided so that their bends are fine."""
    parts = np.ceil(np.sqrt(np.minimum(bend / (FINE * radius), _MOST_PARTS**2)))
    return np.maximum(parts, 1).astype(np.int64)


def _divided(values: Floats, parts: Ints) -> Floats:
    """Ascending values (n + 1,) with as many equal parts between neighbours (n,) as asked for."""
    step = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(step)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[step]
    return np.append(values[step] + share * np.diff(values)[step], values[-1])
