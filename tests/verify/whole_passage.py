"""The decision of `cornersmooth.verify.passage` for two whole polylines."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.verify.chain import Path, Sections
from cornersmooth.verify.free_space import Inner
from cornersmooth.verify.passage import Passage


def whole_section(last: int, start: float, stop: float, *, guessed: bool = False) -> Sections:
    """All of the own motion, between two places."""
    return Sections(np.array([0]), np.array([last]), np.array([start]), np.array([float(stop)]), np.array([guessed]))


def passage(
    own: Floats,
    path: Floats,
    radius: float,
    *,
    own_bend: Floats | None = None,
    path_bend: Floats | None = None,
    inner: Inner | None = None,
) -> Passage:
    """Decide whether two polylines can be run beside each other within a radius, both forward only.

    Parameters
    ----------
    own, path : (n, 3h), (m + 1, 3h) float64, mm
        Vertices: tips alone (h = 1), or tips and axis points (h = 2). At least one vertex each.
    radius : float, mm
    own_bend, path_bend : (n - 1,), (m,) float64, mm, optional
        By how much the motions may leave each segment.
    inner
        As of `Passage`.
    """
    if len(path) == 1:
        path, path_bend = np.repeat(path, 2, axis=0), None
    if len(own) == 1:
        own, own_bend = np.repeat(own, 2, axis=0), None
    bend = np.zeros(len(own) - 1) if own_bend is None else own_bend
    section = whole_section(len(own) - 1, 0.0, len(path) - 1)
    return Passage(own, bend, Path.of(path, path_bend), radius, section, inner)
