"""Points on the smoothed path, for plots and for programs of one's own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import joined_rows
from cornersmooth.model import Floats, Ints, SmoothProgram
from cornersmooth.smoothing.sampling import dense_rows


@dataclass(frozen=True)
class PathPoints:
    """Points in path order, m rows; between them the tool moves straight within the chord tolerance."""

    tip: Floats  #: (m, 3), mm
    axis: Floats  #: (m, 3): Unit tool axis vectors
    pose: Ints  #: (m,): Pose of the program whose move the point belongs to
    kind: NDArray[np.uint8]  #: (m,): `Move`: how the point is reached

    def __len__(self) -> int:
        return len(self.tip)


def sample(smoothed: SmoothProgram, *, chord: float | None = None) -> PathPoints:
    """Points on the smoothed path, as near to one another as the chord tolerance asks for.

    Parameters
    ----------
    chord : float, mm, optional
        Largest distance between the curves and the lines through the points; that of the settings by default.

    Returns
    -------
    PathPoints
        m points in path order: tips (m, 3) in mm, unit axes (m, 3), and the pose (m,) each belongs to.

    Raises
    ------
    SettingsError
        CS202 for a chord tolerance out of bounds.
    """
    if chord is not None:
        smoothed = replace(smoothed, settings=smoothed.settings.but(chord_tolerance=chord))
    kind = smoothed.program.kind
    none = PathPoints(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int64), kind[:0])
    some = (PathPoints(rows.tip, rows.other, rows.move, kind[rows.move]) for rows in dense_rows(smoothed))
    return joined_rows((none, *some))
