"""Poses that the program names: every printed number is the pose's, rounded."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Elements
from cornersmooth.nc_reader.tool import directions
from cornersmooth.verify.task import ARITHMETIC


def digit_errors(nc: Elements, element: Ints, tip: Floats, axis: Floats, axis_length: float) -> tuple[Bools, Floats]:
    """Compare ends of elements with poses they should name exactly.

    Parameters
    ----------
    element : (k,) int64
    tip, axis : (k, 3) float64
    axis_length : float, mm

    Returns
    -------
    exact : (k,) bool
        Every printed number is the pose's, rounded to the printed digits.
    amount : (k,) float64, mm
        The larger distance, of tips or of axis points.
    """
    off = nc.tip[element] - tip
    second = nc.second[element]
    near = np.abs(off) <= (nc.tip_step / 2 + nc.tip_room[element] + ARITHMETIC)[:, None]
    exact: Bools = np.logical_and.reduce(near, axis=1)
    if nc.second_is == "vector":
        side = second - axis
        room = (nc.second_step / 2 + nc.second_room[element] + ARITHMETIC)[:, None]
    else:  # only the direction of the axis point counts, and the tip's own rounding turns it too
        side = second - nc.tip[element]
        side -= np.linalg.norm(side, axis=1)[:, None] * axis
        room = np.sqrt(3) * (nc.second_step + nc.tip_step) / 2 + ARITHMETIC
    exact &= (np.abs(side) <= room).all(axis=1)
    turned = off + axis_length * (directions(nc, nc.tip[element], second) - axis)
    return exact, np.maximum(np.linalg.norm(off, axis=1), np.linalg.norm(turned, axis=1))
