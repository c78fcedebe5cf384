"""Angles of paths whose cuts go beyond the limits of a rotary axis: a cut is left, and goes on in another turn."""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.kinematics.machine import Machine
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.rotary.angle_path import RotaryPath, rotary_angles
from cornersmooth.rotary.cut_parts import CutTooFarError

#: rounds of dividing cuts, after which limits are an error; a round divides all cuts that are too far by themselves
_ROUNDS: Final = 100


def rewound_angles(
    machine: Machine,
    tip: Floats,
    axis: Floats,
    *,
    tolerance: float,
    rapid: Bools,
    line: Ints,
    file: str | None,
    still: Bools | None = None,
    still_tolerance: float = 0.0,
) -> tuple[RotaryPath, Ints, Bools]:
    """Rotary angles of a path in which cuts are left, where nothing else keeps the limits.

    Parameters and errors are those of `rotary_angles`.

    Returns
    -------
    path : RotaryPath
        Of m rows: where a cut is left its pose is there twice, before and after the turn of the axes.
    source : (m,) int64
        Row of the path given.
    left : (m,) bool
        Second rows of such pairs.
    """
    source, left = np.arange(len(tip)), np.zeros(len(tip), np.bool_)
    for number in range(_ROUNDS + 1):
        try:
            path = rotary_angles(
                machine,
                tip[source],
                axis[source],
                tolerance=tolerance,
                rapid=rapid[source],
                left=left,
                still=None if still is None else still[source],
                still_tolerance=still_tolerance,
                divide=number < _ROUNDS,
                line=line[source],
                file=file,
            )
        except CutTooFarError as far:
            behind = far.poses + 1
            source, left = np.insert(source, behind, source[far.poses]), np.insert(left, behind, True)
            continue
        break
    return path, source, left
