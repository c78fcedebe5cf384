"""Runs whose curves the rotary axes of a machine cannot follow.

Where poses are at the limit of a rotary axis, the curve of a run may go beyond it within the tolerance. A transition of
a single corner does not: its axes are between those of the poses.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.geometry.ragged import starts
from cornersmooth.kinematics import solutions
from cornersmooth.model import Bools, SmoothProgram
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_words import rotary_way
from cornersmooth.smoothing.sampling import dense_rows

#: what a curve may turn the axis, over ε at H: tip and axis point may be off to opposite sides
_SWING = 2.0


def within_reach(smoothed: SmoothProgram, form: Form) -> SmoothProgram:
    """Round runs at the limits of the rotary axes corner by corner, if the machine cannot follow their curves."""
    if smoothed.runs is None or form.machine is None or not form.rotary or form.rewind:
        return smoothed
    near = _near_limits(smoothed, form)
    if not near.any():
        return smoothed
    try:
        rotary_way(dense_rows(smoothed), smoothed, form, Findings())
    except InputError:
        from cornersmooth.smoothing.global_runs import corner_by_corner  # which takes long to load

        return corner_by_corner(smoothed, near)
    return smoothed


def _near_limits(smoothed: SmoothProgram, form: Form) -> Bools:
    """(r,) bool: runs with a pose so near to the limit of an axis that the curve may go beyond it.

    All runs on a machine with one rotary axis, whose limits are those of the directions, too.
    """
    runs, machine, settings = smoothed.runs, form.machine, smoothed.settings
    assert runs is not None
    assert machine is not None
    if len(machine.names) < 2:
        return np.ones(len(runs), np.bool_)
    found = solutions(machine, smoothed.program.axis[runs.pose])
    swing = np.degrees(_SWING * settings.tolerance / settings.axis_scale)
    room = np.full(found.angles.shape, swing)
    with np.errstate(divide="ignore"):  # at the pole the first axis turns as far as it likes
        room[..., 0] /= np.abs(np.sin(np.radians(np.minimum(found.pole_distance, 90.0))))[:, None]
    near = np.zeros(len(runs.pose), np.bool_)
    for k, limit in zip(*np.nonzero(np.isfinite(machine.limits)), strict=True):
        off = found.angles[..., k] - machine.limits[k, limit]
        near |= (np.abs(off - 360.0 * np.round(off / 360.0)) <= room[..., k]).any(axis=1)
    return np.maximum.reduceat(near, starts(runs.count)[:-1])
