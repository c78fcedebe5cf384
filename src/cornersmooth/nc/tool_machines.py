"""Which tool moves to each pose, and the machine with its length: heads swing the tip by that."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Ints, Program
from cornersmooth.nc.cycle_blocks import tool_loads


def tools_of_poses(program: Program) -> Ints:
    """(n,) number of the tool that moves to each pose, -1 before the first."""
    loads = tool_loads(program)
    begins = np.array([pose for pose, _ in loads], np.int64)
    numbers = np.array([-1, *(number for _, (number, _) in loads)], np.int64)
    found: Ints = numbers[np.searchsorted(begins, np.arange(len(program)), side="right")]
    return found


def machines_of_rows(machine: Machine, tools: Ints | None, move: Ints) -> Iterator[tuple[Bools | slice, Machine]]:
    """Rows with the machine that moves them.

    Parameters
    ----------
    machine : Machine
    tools : (n,) int64 or None
        As `tools_of_poses` gives them; None where all have one length.
    move : (r,) int64
        Pose of each row.
    """
    if tools is None:
        yield slice(None), machine
        return
    for number in np.unique(tools[move]).tolist():
        yield tools[move] == number, machine.with_tool(number)
