"""Windows of neighbouring spans that are solved together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import ranges, spread, starts
from cornersmooth.model import Bools, Ints

#: control points that stay at each end: with them position, first and second derivative
HELD = 3


@dataclass(frozen=True)
class Windows:
    """Windows of neighbouring spans of one run each, one after the other; neighbours may share control points."""

    begin: Ints  # first span of each window
    count: Ints  # its number of spans
    span: Ints  # spans of the splines that belong to the windows
    control: Ints  # control points of the splines that belong to the windows, (c,)
    local: Ints  # index into `control` of the first control point of each span
    window: Ints  # window of each control point
    free: Bools  # false for the outer control points, which stay

    @cached_property
    def span_window(self) -> Ints:
        """(spans,) window of each span."""
        return spread(self.count)[0]

    @classmethod
    def of(cls, splines: Splines, begin: Ints, count: Ints) -> Windows:
        """Windows of `count` spans from the spans `begin` on."""
        span = ranges(begin, count)
        control = ranges(splines.span_control[begin], count + 3)
        local = ranges(starts(count + 3)[:-1], count)
        window, place = spread(count + 3)
        free = (place >= HELD) & (place < count[window] + 3 - HELD)
        return cls(begin, count, span, control, local, window, free)

    @classmethod
    def where(cls, splines: Splines, wanted: Bools) -> Windows:
        """Windows of the rows of neighbouring spans that are wanted (spans,), those without freedom left out."""
        run = splines.span_run
        inside = wanted[1:] & wanted[:-1] & (run[1:] == run[:-1])
        starts_here = wanted & ~np.concatenate(([False], inside))
        ends_here = wanted & ~np.concatenate((inside, [False]))
        begin, end = np.flatnonzero(starts_here), np.flatnonzero(ends_here)
        count = end - begin + 1
        able = count > HELD
        return cls.of(splines, begin[able], count[able])
