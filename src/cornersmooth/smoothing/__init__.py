"""Rounding the corners of a program: `smooth` is the whole of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cornersmooth.model import Program, SmoothProgram
from cornersmooth.settings import Settings
from cornersmooth.smoothing.axis_steps import axis_step_findings, refuse_flips
from cornersmooth.smoothing.construction import construction_of

__all__ = ["smooth"]


def smooth(
    program: Program,
    settings: Settings | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    processes: int = 1,
) -> SmoothProgram:
    """Round every corner of the program within the tolerance.

    Parameters
    ----------
    settings : Settings, optional
        Defaults: ε 0.01 mm, H 10 mm; without a form the method "auto" is the proportional one.
    progress : callable, optional
        Called now and then with (corners done, corners in all).
    processes : int
        Processes that a method that takes long may work in; the result does not depend on it.

    Returns
    -------
    SmoothProgram
        Also where nothing can be rounded; every corner has a status that says why not.

    Raises
    ------
    InputError
        CS183: the tool axis turns by nearly half a turn in one feed move.
    """
    settings = (Settings() if settings is None else settings).with_method()
    refuse_flips(program)
    smoothed = construction_of(settings.method).smooth(program, settings, progress, processes)
    if settings.axis_tolerance is not None:
        turned = settings.axis_scale * 2.0 * np.sin(smoothed.corners.orientation_error / 2.0)
        smoothed = replace(smoothed, corners=replace(smoothed.corners, axis_error=turned))
    return replace(smoothed, findings=(*smoothed.findings, *axis_step_findings(program, settings)))
