"""Positions farther back along the tool, as numbers of rows: where the tool comes from and goes to in rapid."""

from __future__ import annotations

import numpy as np

from cornersmooth.kinematics import machine_position, tool_axis
from cornersmooth.model import Floats, Ints, Units
from cornersmooth.nc.form import Form


def lifted(form: Form, units: Units, mm_per_unit: float, ticks: Ints, distance: float) -> Ints:
    """Row of a position that is farther from the part along the tool axis.

    Parameters
    ----------
    units : Units
        Of the text.
    ticks : (c,) int64
        A row, in steps of its last digits.
    distance : float, mm

    Returns
    -------
    (c,) int64
        The other words are the same; a point on the axis moves as the tip does, digit by digit.
    """
    decimals = np.array(form.decimals(units))
    values = ticks / 10.0**decimals
    step = (distance / mm_per_unit) * _direction(form, values)
    shift = np.round(step * 10.0 ** decimals[:3]).astype(np.int64)
    result = ticks.copy()
    result[:3] += shift
    if form.orientation == "point":
        result[3:] += shift
    return result


def _direction(form: Form, values: Floats) -> Floats:
    """(3,) way of X Y Z for a step of one along the tool axis."""
    up = np.array([0.0, 0.0, 1.0])
    if form.orientation == "vector":
        up = values[3:]
    elif form.orientation == "point":
        up = values[3:] - values[:3]
    elif form.rotary and form.machine is not None:
        order = [3 + form.other_words.index(name) for name in form.machine.names]
        angles = np.array([[*values[order], 0.0][:2]])
        up = tool_axis(form.machine, angles)[0]
        if form.orientation == "machine":
            ends = [machine_position(form.machine, tip[None], angles)[0] for tip in (up, np.zeros(3))]
            up = ends[0] - ends[1]
    direction: Floats = up / np.linalg.norm(up)
    return direction
