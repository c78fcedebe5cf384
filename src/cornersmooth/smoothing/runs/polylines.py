"""The original motion of runs as polylines in six dimensions, by their length s."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.runs.ranges import starts


@dataclass(frozen=True)
class Polylines:
    """Poses of r runs, one behind the other.

    Parameters
    ----------
    point : (n, 6) float64, mm
        Tip and axis point.
    count : (r,) int64
        Poses of each run, at least 2.
    s : (n,) float64, mm
        Length from the start of the run, by m(D) = √((|D_A|² + |D_B|²)/2): pure rotations count (design 3.2).
    """

    point: Floats
    count: Ints
    s: Floats

    @classmethod
    def through(cls, point: Floats, count: Ints) -> Polylines:
        """Measure the runs; neighbouring poses of a run are distinct."""
        first = starts(count)[:-1]
        step = np.zeros(len(point))
        step[1:] = np.sqrt((np.diff(point, axis=0) ** 2).sum(axis=1) / 2.0)
        step[first] = 0.0
        along = np.cumsum(step)
        if len(count):  # lengths are summed anew in every run, so that none has the rounding of those before it
            along -= np.repeat(along[first], count)
        return cls(point, count, along)

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
