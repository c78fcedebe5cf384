"""Which tool moves to each pose, and the travel of the machine with its length: heads swing the tip by that."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.kinematics import Machine, check_travel
from cornersmooth.model import Floats, Ints, Program
from cornersmooth.nc.cycle_blocks import tool_loads


@dataclass(frozen=True)
class ToolTravel:
    """The travel of a machine for the tools of a program, each with its own length."""

    program: Program
    machine: Machine

    @cached_property
    def _tools(self) -> Ints:
        """(n,) number of the tool that moves to each pose, -1 before the first."""
        loads = tool_loads(self.program) if self.machine.tool_lengths else []
        begins = np.array([pose for pose, _ in loads], np.int64)
        numbers = np.array([-1, *(number for _, (number, _) in loads)], np.int64)
        found: Ints = numbers[np.searchsorted(begins, np.arange(len(self.program)), side="right")]
        return found

    def check(self, tip: Floats, angles: Floats, move: Ints) -> None:
        """Refuse rows that the linear axes cannot reach.

        Parameters
        ----------
        tip : (r, 3) float64, mm
        angles : (r, 2) float64, degrees
        move : (r,) int64
            Pose of each row.

        Raises
        ------
        InputError
            CS374, as `check_travel` raises it.
        """
        if not self.machine.travel:
            return
        tools, file = self._tools[move], self.program.source.name
        for number in np.unique(tools).tolist():
            rows = tools == number
            check_travel(self.machine.with_tool(number), tip[rows], angles[rows], self.program.line[move[rows]], file)
