"""The corners of a program as a method of smoothing meets them, and what it makes of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Ints, Program, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.legs import Legs, legs_at

#: corners worked on at once: their intermediate arrays fit the processor's cache
BATCH = 16384


class ShapedCorners(NamedTuple):
    """Corners with the weights (g, 2) and the ratios (g,) of their curves."""

    legs: Legs
    weights: Floats
    ratio: Floats


@dataclass(frozen=True)
class CornerTable:
    """All corners of a program, looked at in batches.

    Parameters
    ----------
    program : Program
    settings : Settings
    pose, before, after : (k,) int64
        As in `Corners`.
    status : (k,) uint8
        `Status` as far as it is known without the geometry of the corner.
    """

    program: Program
    settings: Settings
    pose: Ints
    before: Ints
    after: Ints
    status: NDArray[np.uint8]

    def batches(self) -> Iterator[tuple[int, Ints]]:
        """Start of each batch and its rows that nothing forbids to smooth."""
        for start in range(0, len(self.pose), BATCH):
            yield start, start + np.flatnonzero(self.status[start : start + BATCH] == Status.SMOOTHED)

    def shaped(self, rows: Ints) -> ShapedCorners:
        """Segments at some corners, and the shape of their curves."""
        legs = legs_at(self.program, self.settings.axis_length, self.pose[rows], self.before[rows], self.after[rows])
        weights = np.broadcast_to(np.array(self.settings.weights), (len(rows), 2))
        return ShapedCorners(legs, weights, np.broadcast_to(np.float64(self.settings.ratio), (len(rows),)))


class Remainders(NamedTuple):
    """What transitions leave of g segments.

    Parameters
    ----------
    start, end : (g,) int64
        Poses at the ends of the segments.
    tip, axis : (g, 2) float64
        Fractions of the tip segment and of the axis-point segment at which the remainder starts and ends.
    """

    start: Ints
    end: Ints
    tip: Floats
    axis: Floats


@dataclass
class Placed:
    """Transitions of g corners; the names are those of `Corners`."""

    status: NDArray[np.uint8]
    limited_by: NDArray[np.uint8]
    trim_in: Floats
    trim_out: Floats
    axis_trim_in: Floats
    axis_trim_out: Floats
    tip_error: Floats
    axis_error: Floats
    orientation_error: Floats
    extra: dict[str, Floats] = field(default_factory=dict)
