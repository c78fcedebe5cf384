"""Where the rotary axes of a machine change their speed most: finish marks are there, not only at corners."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from cornersmooth.arrays.vectors import norm
from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine
from cornersmooth.model import Move, Program
from cornersmooth.rotary import rapid_moves, rotary_angles

#: places that are listed for each axis
_LISTED: Final = 3

#: degrees: how far the axis may be off near the pole, so that the first angle turns ahead of time
_TOLERANCE: Final = 0.05

#: deg/s2: less is no acceleration, but digits
_LEAST: Final = 1e-3


def rotary_marks(program: Program, machine: Machine | None) -> list[dict[str, Any]]:
    """Places of the CL path where each rotary axis accelerates most, at the programmed feeds.

    The speed of an axis on a linear feed move is its turn over the time of the move; at the pose between two such moves
    it changes within half of both times. Moves without a feed per minute, or of no length, count for nothing. Empty
    where the machine cannot follow the path.
    """
    if machine is None or not machine.names or len(program) < 3:
        return []
    rapid = rapid_moves(program.kind)
    try:
        angles = rotary_angles(machine, program.tip, program.axis, tolerance=_TOLERANCE, rapid=rapid).angles
    except InputError:
        return []
    length, feed = norm(np.diff(program.tip, axis=0)), program.feed_at(np.arange(1, len(program)))
    cuts = (program.kind[1:] == Move.LINEAR) & (program.kind[:-1] != Move.FROM) & (length > 0.0) & (feed > 0.0)
    time = np.where(cuts, 60.0 * length / np.where(cuts, feed, 1.0), np.inf)  # s
    speed = np.diff(angles, axis=0) / time[:, None]
    both = cuts[:-1] & cuts[1:]
    change = np.abs(np.diff(speed, axis=0)) / np.where(both, 0.5 * (time[:-1] + time[1:]), np.inf)[:, None]
    found = []
    for axis, name in enumerate(machine.names):
        most = np.argsort(-change[:, axis], kind="stable")[:_LISTED]
        places = [
            {"line": int(program.line[k + 1]), "deg_per_s2": float(change[k, axis])}
            for k in most.tolist()
            if change[k, axis] > _LEAST
        ]
        found += [{"axis": name, "places": places}] if places else []
    return found


def marks_text(axis: dict[str, Any]) -> str:
    """One axis in words: ``C accelerates most at line 387 (41,000 deg/s2), line 12 (900 deg/s2)``."""
    places = (f"line {place['line']} ({place['deg_per_s2']:,.3g} deg/s2)" for place in axis["places"])
    return f"{axis['axis']} accelerates most at {', '.join(places)}"
