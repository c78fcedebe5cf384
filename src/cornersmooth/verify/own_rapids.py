"""Rapids along the tool that posts add before and behind a retract: no part of the motion that the CL file asks for."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.nc_reader.elements import Elements, Event, NcProgram
from cornersmooth.verify.task import Task

#: printed digits that ends may be off
_STEPS = 2.0


@dataclass(frozen=True)
class OwnRapids:
    """Knows where the CL file goes in rapid.

    Parameters
    ----------
    task : Task
    """

    task: Task
    tip: Floats = field(init=False)
    rapid: Ints = field(init=False)
    moving: Ints = field(init=False)

    def __post_init__(self) -> None:
        program, pose = self.task.original.program, self.task.original.pose
        rapid = np.flatnonzero(program.kind[pose] == Move.RAPID)
        object.__setattr__(self, "tip", program.tip[pose])
        object.__setattr__(self, "rapid", rapid)
        object.__setattr__(self, "moving", np.flatnonzero(program.kind[pose] != Move.HOLE))

    def added(self, start: Floats, end: Floats, step: float, near: Floats) -> bool:
        """Whether the CL file has a pose at the end of a rapid nearer to the part, and does not ask for the rapid.

        Out of holes the tool comes without a pose at its bottom, and over them it goes without one above.

        Parameters
        ----------
        start, end : (3,) float64, mm
        step : float, mm
            Last printed digit.
        near : (3,) float64, mm
            That of both which is nearer to the part.
        """
        leaves = np.array_equal(near, start)
        at_near, at_far = (_close(self.tip, tip, step) for tip in (near, end if leaves else start))
        at_far[np.setdiff1d(np.arange(len(at_far)), self.rapid)] = False
        asked = False
        for poses in (slice(None), self.moving):  # at holes that are left out nothing moves
            one, other = (at_near[poses], at_far[poses]) if leaves else (at_far[poses], at_near[poses])
            asked |= bool((one[:-1] & other[1:]).any())
        return bool(at_near.any()) and not asked

    def goes_to(self, tip: Floats, step: float) -> bool:
        """Whether the CL file goes to a tip in rapid, up to printed digits."""
        return bool(_close(self.tip[self.rapid], tip, step).any())

    def left_out(self, nc: NcProgram) -> tuple[Elements, list[Event]]:
        """Elements and events of a text that was read before, where rapids that posts add do not move the tool.

        Parameters
        ----------
        nc : NcProgram
        """
        elements = Elements(**{column.name: getattr(nc, column.name) for column in fields(Elements)})
        tip, second = nc.tip.copy(), nc.second.copy()
        withdrawn = set()
        for element, back in nc.along_tool:
            start, end = (element - 1, element) if back else (element, element + 1)
            near = start if back else end
            if self.added(tip[start], tip[end], nc.tip_step, tip[near]):
                tip[element], second[element] = tip[near], second[near]
                if back:  # words behind it belong where it comes from
                    withdrawn.add(element + 1)
        for left, above, *_ in nc.left_cuts:
            if not any(self.goes_to(nc.tip[element], nc.tip_step) for element in (left, above)):
                tip[[left, above]], second[[left, above]] = nc.tip[left - 1], nc.second[left - 1]
                withdrawn.discard(left + 1)
        events = [replace(event, element=event.element - (event.element in withdrawn)) for event in nc.events]
        return replace(elements, tip=tip, second=second), events


def _close(tips: Floats, tip: Floats, step: float) -> Bools:
    """(n,) which of some tips (n, 3) are another, up to printed digits."""
    close: Bools = np.logical_and.reduce(np.abs(tips - tip) <= _STEPS * step, axis=1)
    return close
