"""Feed moves of the CL file in which the tool axis turns so far that nobody knows which way round it goes."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Move, Program
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.settings import FLIP_ANGLE

#: of a turn that is surely smaller than `FLIP_ANGLE`
_COSINE = -0.5


def half_turns(program: Program) -> list[Problem]:
    """Moves that no text can be measured against, with their CL lines: CS526.

    Between opposite axes there is no great circle, and near them it hangs on the last digits of both.
    """
    axis, kind = program.axis, program.kind
    fed = np.isin(kind[1:], (Move.LINEAR, Move.ARC)) & (kind[:-1] != Move.FROM)
    poses = 1 + np.flatnonzero(fed & (np.einsum("ij,ij->i", axis[1:], axis[:-1]) < _COSINE))
    here, before = axis[poses], axis[poses - 1]
    turn = 2.0 * np.arctan2(np.linalg.norm(here - before, axis=1), np.linalg.norm(here + before, axis=1))
    problems = []
    for pose, degrees in zip(poses.tolist(), np.degrees(turn).tolist(), strict=True):
        if degrees <= FLIP_ANGLE + 1e-9:
            continue
        text = f"the tool axis turns by {degrees:.4g} deg in one move, and which way a control turns is not defined"
        problems.append(Problem("CS526", int(program.line[pose]), 0, text))
    return problems
