"""How many of the blocks are spline blocks: SINUMERIK wants six of every ten (programming manual 12/2019)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cornersmooth.model import Bools, Ints
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.run import Run

#: blocks that are counted together, and how many of them must be splines
_WINDOW, _LEAST = 10, 6


@dataclass
class SplineShare:
    """Looks at ten feed blocks from the beginning of every spline on; what comes after a rapid is no spline."""

    line: Ints  #: (n,) lines of the CL file, for messages
    findings: Findings
    _flags: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))
    _moves: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    _before: bool = False  # whether the block before these is a spline

    def take(self, run: Run) -> None:
        """Count the blocks of a run, a block a row."""
        edges = np.flatnonzero(np.diff(run.rapid.astype(np.int8))) + 1
        for rows in np.split(np.arange(len(run)), edges):
            if run.rapid[rows[0]]:
                self.end()
            else:
                self._flags = np.concatenate((self._flags, run.curve[rows] > 0))
                self._moves = np.concatenate((self._moves, run.move[rows]))
                self._count(len(self._flags) - _WINDOW)

    def end(self) -> None:
        """Count what is left where no further feed block follows."""
        self._count(len(self._flags) - 1)
        self._before = False

    def _count(self, last: int) -> None:
        """Count the windows that begin up to a block, and forget these blocks."""
        if last < 0:
            return
        flags = self._flags
        starts = np.flatnonzero(flags & ~np.concatenate(([self._before], flags[:-1])))
        starts = starts[starts <= last]
        total = np.concatenate(([0], np.cumsum(flags)))
        stop = np.minimum(starts + _WINDOW, len(flags))
        few = starts[total[stop] - total[starts] < _LEAST]
        if len(few):
            text = "fewer than six of ten blocks are BSPLINE, which SINUMERIK wants; -f poly (vectors) has no such rule"
            self.findings.add("CS325", "warning", int(self.line[self._moves[few[0]]]), text, len(few))
        self._before = bool(flags[last])
        self._flags, self._moves = flags[last + 1 :], self._moves[last + 1 :]
