"""Rows of as few lines as ε allows: what `cornersmooth.smoothing.long_lines` leaves of the dense ones."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cornersmooth.arrays.vectors import unit
from cornersmooth.kinematics import tip_position, tool_axis
from cornersmooth.kinematics.machine import LINEAR
from cornersmooth.methods import METHODS
from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.nc.form import Form
from cornersmooth.settings import Settings
from cornersmooth.smoothing.blending import largest_blends
from cornersmooth.smoothing.long_lines import LineLimits, Vertices, fewest_lines, segments_of_rows, vertices
from cornersmooth.smoothing.outside_lines import faster_lines
from cornersmooth.smoothing.sampling import ArcBlocks, Rows, all_dense_rows

LONG_CHUNK = 1 << 17  #: rows handed on at a time: many long lines are tested at once
_COARSE = 1.0  #: chord tolerance that leaves transitions with as few lines as their change of axis allows, mm
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


def has_law(form: Form) -> bool:
    """Whether it is known when the control, which rounds corners of lines by itself, reaches the end of each."""
    machine, style = form.machine, form.table.lines
    known = set() if machine is None else {axis.name for axis in machine.dynamics}
    return (
        machine is not None and bool(style.rounding and style.planner) and known.issuperset((*LINEAR, *machine.names))
    )


def rounded_lines(
    rows: Vertices, usual: Bools, feed: Floats, limits: LineLimits, settings: Settings, form: Form, *, placed: bool
) -> tuple[Vertices, Ints, Floats | None]:
    """Rows, those (k,) at which lines end, and how far the control may round corners there.

    That is in mm, None where one value holds for all; at rows (r,) that are `usual` it is that of the settings. Rows
    that are `placed` are moved off the path where lines are faster so, with `feed` (r,) in mm/s, inf for none.
    """
    style = form.table.lines

    def blends(rows: Vertices, kept: Ints) -> Floats:
        found = largest_blends(rows, kept, limits, settings.tolerance, style.executed_share * settings.tolerance)
        return np.where(usual[kept], limits.blend, found)

    def ends_reached(rows: Vertices, kept: Ints) -> Floats:
        from cornersmooth.feedrate.linuxcnc import Lines, axis_limits, line_times  # with all of feedrate

        assert form.machine is not None
        place = np.zeros((len(kept), 6))
        place[:, [*range(3), *map("XYZABC".index, form.machine.names)]] = np.hstack((rows.tip, rows.words))[kept]
        moves = np.flatnonzero((np.diff(place, axis=0) != 0.0).any(axis=1))
        lines = Lines(place[moves], place[moves + 1], feed[kept[moves + 1]], blends(rows, kept)[moves + 1])
        time = np.zeros(len(kept))
        time[moves + 1] = line_times(lines, axis_limits(form.machine))[1]
        return np.maximum.accumulate(time)

    if placed:
        rows, kept = faster_lines(rows, limits, ends_reached)
    else:
        kept = fewest_lines(rows, limits)
    return rows, kept, blends(rows, kept) if style.rounding else None


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
