"""Rounding the corners of a program: `smooth` is the whole of it. Moves that turn the axis too far are found here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cornersmooth.errors import Finding, InputError
from cornersmooth.model import Bools, Move, Program, SmoothProgram
from cornersmooth.settings import FLIP_ANGLE, Settings
from cornersmooth.smoothing.construction import beside_chords, construction_of, one_corner_each


def smooth(
    program: Program,
    settings: Settings | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    processes: int = 1,
) -> SmoothProgram:
    """Round every corner of the program within the tolerance; parameters as of `pipeline.smooth`.

    Corners that stay sharp have a status that says why. CS183: the axis turns by nearly half a turn in one feed move.
    """
    settings = (Settings() if settings is None else settings).with_method()
    refuse_flips(program)
    program, settings = beside_chords(*one_corner_each(program, settings))
    smoothed = construction_of(settings.method).smooth(program, settings, progress, processes)
    if settings.axis_tolerance is not None:
        turned = settings.axis_scale * 2.0 * np.sin(smoothed.corners.orientation_error / 2.0)
        smoothed = replace(smoothed, corners=replace(smoothed.corners, axis_error=turned))
    return replace(smoothed, findings=(*smoothed.findings, *axis_step_findings(program, settings)))


def refuse_flips(program: Program) -> None:
    """Refuse a feed move, line or arc, whose axis turns by more than `cornersmooth.settings.FLIP_ANGLE`: CS183."""
    pose, turn = program.axis_steps(_feed_moves(program), FLIP_ANGLE)
    if len(pose):
        raise InputError(
            "CS183",
            f"the tool axis turns by {turn[0]:.4g} deg in one move, and which way a control turns is not defined",
            "insert a pose in between",
            file=program.source.name,
            line=int(program.line[pose[0]]) or None,
        )


def axis_step_findings(program: Program, settings: Settings) -> tuple[Finding, ...]:
    """Feed moves whose axis turns by more than `Settings.max_axis_step`: no corner beside them is rounded."""
    pose, turn = program.axis_steps(_feed_moves(program), settings.max_axis_step)
    if not len(pose):
        return ()
    text = (
        f"the tool axis turns by more than {settings.max_axis_step:g} deg in one move, by {turn.max():.4g} deg at "
        "most, and corners beside it stay sharp; insert poses in between"
    )
    return (Finding("CS184", "warning", int(program.line[pose[0]]), text, len(pose)),)


def _feed_moves(program: Program) -> Bools:
    return (program.kind == Move.LINEAR) | (program.kind == Move.ARC)
