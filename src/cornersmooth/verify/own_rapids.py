"""Rapids along the tool that posts add before and behind a retract: no part of the motion that the CL file asks for."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cornersmooth.model import Floats, Ints, Move
from cornersmooth.verify.task import Task

#: printed digits that ends may be off
_STEPS = 2.0


@dataclass(frozen=True)
class OwnRapids:
    """Knows the rapids of the CL file by both of their ends.

    Parameters
    ----------
    task : Task
    """

    task: Task
    tip: Floats = field(init=False)
    rapid: Ints = field(init=False)

    def __post_init__(self) -> None:
        program, pose = self.task.original.program, self.task.original.pose
        rapid = np.flatnonzero(program.kind[pose] == Move.RAPID)
        object.__setattr__(self, "tip", program.tip[pose])
        object.__setattr__(self, "rapid", rapid[rapid > 0])

    def added(self, start: Floats, end: Floats, step: float, near: Floats) -> bool:
        """Whether the CL file has no such rapid, but one of its poses at the end nearer to the part.

        Out of holes the tool comes without a pose at its bottom, and over them it goes without one above.

        Parameters
        ----------
        start, end : (3,) float64, mm
        step : float, mm
            Last printed digit.
        near : (3,) float64, mm
            That of both which is nearer to the part.
        """
        if not (np.abs(self.tip - near) <= _STEPS * step).all(axis=1).any():
            return False
        ways = ((self.tip[self.rapid - 1], start), (self.tip[self.rapid], end))
        same = np.all([(np.abs(tips - tip) <= _STEPS * step).all(axis=1) for tips, tip in ways], axis=0)
        return not same.any()
