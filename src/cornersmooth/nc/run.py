"""A run of rows: what one call of the block writer writes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints


@dataclass(frozen=True)
class Run:
    """Rows that nothing interrupts, r of them: what each block says.

    Parameters
    ----------
    ticks : (r, c) int64
        Numbers in steps of their last digit.
    move : (r,) int64
        Pose, for messages.
    rapid : (r,) bool
    feed : (r,) float64
        mm/min, mm/rev or 1/min, NaN where there is none.
    mode : (r,) int64
        `FeedMode` or `INVERSE_TIME`.
    curve : (r,) int8
        As in `Rows`.
    weights : (r, 2) float64 or None
    arc : (r,) int64 or None
    dwell : (r,) bool or None
        Where the tool waits after the block.
    bezier : (r, 4, c) float64 or None
        Bézier points of the knot intervals of curves, in units of the text, for polynomials.
    spline : (r, 3) float64 or None
    blend : (r,) float64 or None, mm
        As in `Rows`.
    left : (r,) bool or None
        As in `Rows`.
    """

    ticks: Ints
    move: Ints
    rapid: Bools
    feed: Floats
    mode: Ints
    curve: NDArray[np.int8]
    weights: Floats | None = None
    arc: Ints | None = None
    dwell: Bools | None = None
    bezier: Floats | None = None
    spline: Floats | None = None
    blend: Floats | None = None
    left: Bools | None = None

    def __len__(self) -> int:
        return len(self.ticks)

    def part(self, first: int, stop: int) -> Run:
        """Return rows from `first` to `stop`, the latter excluded."""
        columns: dict[str, Any] = {
            name: None if column is None else column[first:stop] for name, column in vars(self).items()
        }
        return Run(**columns)

    def only(self, chosen: Bools) -> Run:
        """Return the chosen rows."""
        columns: dict[str, Any] = {
            name: None if column is None else column[chosen] for name, column in vars(self).items()
        }
        return Run(**columns)
