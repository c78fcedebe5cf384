"""Rapids in which rotary axes swing a tilted tool: unwinding, and the other solution of the axes.

Both ends of such a move hold the tool where it should be, but between them it stands elsewhere: a table that turns back
by 300 degrees leads a tool that leans by 30 degrees all the way round. The tool goes up first, and turns there.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.kinematics import Machine, tool_axis
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.vectors import dot

#: degrees by which the way of the tool axis may be longer than the shortest one
LONGEST_DETOUR: Final = 30.0

#: places between both ends that are looked at
_PLACES: Final = np.linspace(0.0, 1.0, 10)[1:-1]


def swinging(machine: Machine, before: Floats, after: Floats) -> Bools:
    """Moves in which the tool axis leaves the shortest way by more than `LONGEST_DETOUR`.

    Parameters
    ----------
    machine : Machine
    before, after : (m, 2) float64, degrees
        Rotary words, in the order of the machine's axes, which run evenly from the ones to the others.

    Returns
    -------
    (m,) bool
    """
    ends = [tool_axis(machine, angles) for angles in (before, after)]
    shortest = _angle(*ends)
    longest = np.zeros(len(before))
    for place in _PLACES.tolist():
        between = tool_axis(machine, before + place * (after - before))
        longest = np.maximum(longest, _angle(ends[0], between) + _angle(between, ends[1]))
    return longest - shortest > LONGEST_DETOUR


def rows_that_swing(machine: Machine, angles: Floats, rapid: Bools) -> Ints:
    """Rows, but the first, that are rapid and reached with a swing from the row before: (r, 2) degrees -> (k,)."""
    turn = np.abs(np.diff(angles, axis=0)).max(axis=1) > LONGEST_DETOUR / 2
    rows = np.flatnonzero(rapid[1:] & turn) + 1
    return rows[swinging(machine, angles[rows - 1], angles[rows])] if len(rows) else rows


def _angle(a: Floats, b: Floats) -> Floats:
    """Degrees between unit vectors, row by row."""
    return np.degrees(np.arccos(np.clip(dot(a, b), -1.0, 1.0)))
