"""Rows of as few lines as ε allows: what `cornersmooth.smoothing.long_lines` leaves of the dense ones."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cornersmooth.arrays.vectors import unit
from cornersmooth.kinematics import tip_position, tool_axis
from cornersmooth.methods import METHODS
from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.nc.form import Form
from cornersmooth.settings import Settings
from cornersmooth.smoothing.blending import largest_blends
from cornersmooth.smoothing.long_lines import LineLimits, Vertices, fewest_lines, segments_of_rows, vertices
from cornersmooth.smoothing.sampling import ArcBlocks, Rows, all_dense_rows

#: rows handed on at a time: many long lines are tested at once
LONG_CHUNK = 1 << 17

#: chord tolerance that leaves transitions with as few lines as their change of axis allows, mm
_COARSE = 1.0

#: longest change of a tool vector in one line: controls that turn it evenly in angle and those that turn it evenly in
#: its words are less than 1e-5 rad apart then (θ³/54)
_LARGEST_STEP = 0.08


def coarse_rows(smoothed: SmoothProgram, arcs: ArcBlocks | None = None) -> Rows:
    """Dense rows without those that only the chord tolerance asks for.

    Chords from the joints of a transition to its middle keep ε where one parameter drives both curves; else all stay.
    """
    settings = smoothed.settings
    if METHODS[settings.method].one_parameter:
        settings = settings.but(chord_tolerance=_COARSE)
    return all_dense_rows(replace(smoothed, settings=settings), arcs)


def line_limits(settings: Settings, form: Form, largest_turn: float = 0.0) -> LineLimits:
    """What lines with tool vectors, or with rotary words of a machine (at most `largest_turn` degrees), must keep."""
    machine = form.machine if form.rotary else None
    lag = form.table.lines.lag
    step = _LARGEST_STEP if machine is None else largest_turn
    if settings.axis_step is not None:
        step = min(step, math.radians(settings.axis_step) if machine is None else settings.axis_step)
    return LineLimits(
        *settings.line_tolerances,
        step,
        settings.axis_length,
        unit if machine is None else lambda words: tool_axis(machine, words),
        settings.blend_share * settings.tolerance,
        lag * settings.tolerance if lag else math.inf,
        (lambda position, words: tip_position(machine, position, words))
        if machine is not None and form.orientation == "machine"
        else None,
        rotary=machine is not None,
    )


def corner_blends(
    rows: Vertices, kept: Ints, usual: Bools, limits: LineLimits, settings: Settings, form: Form
) -> Floats | None:
    """How far the control may round the corner at each kept row, mm: the usual blend at rapids and arcs.

    None where one holds for all.
    """
    style = form.table.lines
    if not style.rounding:
        return None
    found = largest_blends(rows, kept, limits, settings.tolerance, style.executed_share * settings.tolerance)
    return np.where(usual, limits.blend, found)


def long_rows(rows: Rows, smoothed: SmoothProgram, form: Form) -> Iterator[Rows]:
    """Rows with tool vectors at which long lines end; arcs stay as they are."""
    tip, axis, move = rows.tip, rows.other, rows.move
    if not len(move):
        return
    limits = line_limits(smoothed.settings, form)
    for begin in range(0, max(len(move) - 1, 1), LONG_CHUNK):
        here = slice(begin, begin + LONG_CHUNK + 1)  # the last row of a chunk is the start of the next
        start, at_pose = segments_of_rows(move, here.start, here.stop)
        part = vertices(smoothed, tip[here], axis[here], axis[here], move[here], start, at_pose)
        kept = begin + fewest_lines(part, limits)[1 if begin else 0 :]
        yield Rows(tip[kept], axis[kept], move[kept], np.zeros(len(kept), np.int8), np.zeros(len(kept), np.bool_))
