"""The original motion of runs as polylines in six dimensions, by their length s."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.runs.ranges import starts

#: steps of the shortest segment: knots stand between its ends
_LEAST = 4


@dataclass(frozen=True)
class Polylines:
    """Poses of r runs, one behind the other.

    Parameters
    ----------
    point : (n, 6) float64, mm
        Tip and axis point.
    count : (r,) int64
        Poses of each run, at least 2.
    s : (n,) float64
        Length from the start of the run in steps of `step`, whole numbers, by m(D) = √((|D_A|² + |D_B|²)/2): pure
        rotations count (design 3.2).
    step : float, mm
        Poses and knots stand at whole steps, so that knots can be written with few digits. It is small beside ε, so
        the parameter is the length but for what nobody can see.
    """

    point: Floats
    count: Ints
    s: Floats
    step: float

    @classmethod
    def through(cls, point: Floats, count: Ints, step: float) -> Polylines:
        """Measure the runs; neighbouring poses of a run are distinct."""
        first = starts(count)[:-1]
        length = np.zeros(len(point))
        length[1:] = np.sqrt((np.diff(point, axis=0) ** 2).sum(axis=1) / 2.0) / step
        length[first] = 0.0
        along = np.cumsum(length)
        along -= np.repeat(along[first], count)
        # rounded, and at least `_LEAST` steps for every segment
        place = _LEAST * np.arange(len(point))
        whole = np.maximum.accumulate(np.round(along) - place + np.repeat(_floors(along, first, count), count)) + place
        whole -= np.repeat(whole[first], count)
        return cls(point, count, whole.astype(np.float64), step)

    @property
    def first(self) -> Ints:
        """(r + 1,) int64: where each run begins."""
        return starts(self.count)

    def segment_at(self, run: Ints, s: Floats) -> Ints:
        """Index of the pose before each place; the last segment at the end of a run."""
        base = self._base
        keys = self.s + np.repeat(base, self.count)
        before = np.searchsorted(keys, s + base[run], side="right") - 1
        first = self.first
        inside: Ints = np.clip(before, first[run], first[run + 1] - 2)
        return inside

    def poses_around(self, run: Ints, low: Floats, high: Floats) -> tuple[Ints, Ints]:
        """Pose at or before the start of each stretch, and pose at or after its end."""
        before, after = self.segment_at(run, low), self.segment_at(run, high)
        return before, after + (high > self.s[after])

    def at(self, run: Ints, s: Floats) -> Floats:
        """Points (m, 6) at lengths (m,) of the runs (m,)."""
        before = self.segment_at(run, s)
        share = (s - self.s[before]) / (self.s[before + 1] - self.s[before])
        points: Floats = self.point[before] + share[:, None] * (self.point[before + 1] - self.point[before])
        return points

    @property
    def _base(self) -> Floats:
        """What keeps the runs apart on one scale."""
        ends = self.s[self.first[1:] - 1]
        return np.concatenate(([0.0], np.cumsum(ends[:-1] + 1.0)))


def _floors(along: Floats, first: Ints, count: Ints) -> Floats:
    """What lifts every run above those before it, so that a running maximum begins anew in each."""
    ends = np.round(along[first + count - 1]) + _LEAST * count
    lifts: Floats = np.concatenate(([0.0], np.cumsum(ends[:-1] + 1.0)))
    return lifts
