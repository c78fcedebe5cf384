"""Rows of blocks: what each block says, in the digits of the text."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints, Program
from cornersmooth.nc.control import INVERSE_TIME


@dataclass(frozen=True)
class BlockRows:
    """Rows that nothing interrupts, r of them."""

    ticks: Ints  #: (r, c) numbers in steps of their last digit
    move: Ints  #: (r,) pose, for messages
    rapid: Bools  #: (r,)
    feed: Floats  #: (r,) mm/min, mm/rev or 1/min, NaN where there is none
    mode: Ints  #: (r,) `FeedMode` or `INVERSE_TIME`
    curve: NDArray[np.int8]  #: (r,) as in `Rows`
    arc: Ints | None = None  #: (r,) as in `Rows`
    dwell: Bools | None = None  #: (r,) where the tool waits after the block
    #: (r, 4, c) Bézier points of the knot intervals of curves, in units of the text, for polynomials
    bezier: Floats | None = None
    spline: Floats | None = None  #: (r, 3) as in `Rows`
    blend: Floats | None = None  #: (r,), mm; as in `Rows`
    left: Bools | None = None  #: (r,) as in `Rows`

    @classmethod
    def straight(cls, program: Program, ticks: Ints, move: Ints, *, rapid: bool = False) -> BlockRows:
        """Straight moves in rapid, or at the feeds of moves of the program."""
        count, mode = len(ticks), program.feed_mode[move].astype(np.int64)
        return cls(ticks, move, np.full(count, rapid), program.feed[move], mode, np.zeros(count, np.int8))

    def __len__(self) -> int:
        return len(self.ticks)

    def with_programmed_feed(self, program: Program) -> BlockRows:
        """Give the first move the program's feed where it has a time, which counts the way from the pose before."""
        if self.mode[0] != INVERSE_TIME:
            return self
        feed, mode = self.feed.copy(), self.mode.copy()
        feed[0], mode[0] = program.feed[self.move[0]], program.feed_mode[self.move[0]]
        return replace(self, feed=feed, mode=mode)
