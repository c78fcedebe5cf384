"""What the written motion is measured against, and the lengths that decide what counts as near."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.model import Bools, Keep, Program
from cornersmooth.nc_reader.elements import Elements
from cornersmooth.verify.polyline import Original, Polyline, original_motion

#: last printed digits by which the next segment must be nearer to be taken
MARGIN_STEPS = 4.0


@dataclass(frozen=True)
class Task:
    """The CL motion and what is promised of it.

    Parameters
    ----------
    original : Original
    path : Polyline
        Its trail as points.
    exact : (m,) bool
        Whether the end of every move must be passed exactly: all but the inner poses of chains.
    tolerance, axis_length : float, mm
        ε and H.
    """

    original: Original
    path: Polyline
    exact: Bools
    tolerance: float
    axis_length: float

    @classmethod
    def of(cls, program: Program, tolerance: float, axis_length: float) -> Task:
        """Make it."""
        original = original_motion(program, tolerance, axis_length)
        path = Polyline.of(original.trail.six(axis_length))
        # tips are held once only
        original = replace(original, trail=replace(original.trail, tip=path.six[:, :3]))
        return cls(original, path, _exact_poses(original), tolerance, axis_length)

    def margin(self, nc: Elements) -> float:
        """Distance that printed digits may account for, mm."""
        axis_step = nc.second_step * (self.axis_length if nc.second_is == "vector" else 1.0)
        return MARGIN_STEPS * max(nc.tip_step, axis_step)


def _exact_poses(original: Original) -> Bools:
    program = original.program
    exact = np.ones(len(program), np.bool_)
    chains = program.chains
    if len(chains):
        steps = np.zeros(len(program) + 1, np.int64)
        np.add.at(steps, chains[:, 0] + 1, 1)
        np.add.at(steps, chains[:, 1], -1)
        exact = np.cumsum(steps[:-1]) == 0
    exact |= program.keep != Keep.NO
    chosen: Bools = exact[original.pose]
    return chosen
