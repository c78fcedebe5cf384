"""Rows in rotary words of a machine: angles for tool vectors, points where angles need them, inverse time.

Solution and turn of the rotary axes are chosen with a look ahead over the whole path, so all of its rows are held at
once here.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import FilledPath, fill, insertions, inverse_time, rapid_moves, rotary_angles
from cornersmooth.model import FeedMode, Floats, Ints, Program
from cornersmooth.nc.control import TIP_SHARE, Form
from cornersmooth.nc.notes import Notes
from cornersmooth.settings import Settings
from cornersmooth.smoothing.neighbours import norm
from cornersmooth.smoothing.sampling import Rows

#: rows handed on at a time
_BLOCK = 65536

#: deg/min that no rotary axis exceeds where we time its blocks ourselves
_FASTEST_TURN = 36_000.0

#: turns below this many degrees are none
_NO_TURN = 1e-9


def rotary_rows(rows: Iterator[Rows], program: Program, settings: Settings, form: Form, notes: Notes) -> Iterator[Rows]:
    """Rows of lines with the words of the form's machine in `Rows.other`, in the order of its axes.

    Parameters
    ----------
    rows : iterator of Rows
        From `dense_rows`, with tool vectors.
    notes : Notes
        Takes what the kinematics notice.

    Raises
    ------
    InputError
        The machine cannot follow the path.
    """
    machine = form.machine
    if machine is None:
        raise SettingsError("CS215", f"{form.control} form {form.name} needs a machine", "name it with --machine")
    blocks = [(block.tip, block.other, block.move) for block in rows]
    if not blocks:
        return
    tip, axis, move = (np.concatenate(column) for column in zip(*blocks, strict=True))
    rapid, line, file = rapid_moves(program.kind)[move], program.line[move], program.source.name
    tolerance = form.rotary_tolerance(settings.tolerance, settings.axis_length)
    path = rotary_angles(machine, tip, axis, tolerance=tolerance, rapid=rapid, line=line, file=file)
    for finding in path.findings:
        notes.add(finding.code, finding.severity, finding.line, finding.text, finding.count)
    more = insertions(
        machine,
        tip,
        axis,
        path.angles,
        tolerance=tolerance,
        rapid=rapid,
        tip_tolerance=TIP_SHARE * settings.tolerance if form.orientation == "machine" else None,
        max_step=settings.axis_step,
        line=line,
        file=file,
    )
    if len(more.unsolved):
        text = "the tool axis jumps further than rotary axes can follow within the tolerance; see what it does there"
        notes.add("CS366", "warning", int(line[more.unsolved[0] + 1]), text, len(more.unsolved))
    if len(more):
        text = f"point inserted so that {' and '.join(machine.names)} keep the tool within the tolerance"
        notes.add("CS367", "note", int(line[more.segment[0] + 1]), text, len(more))
    filled = fill(tip, axis, path.angles, more)
    rate = _rates(filled, move, program, settings, form)
    move = move[filled.pose]
    for begin in range(0, len(move), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        count = len(move[part])
        yield Rows(
            tip=filled.tip[part],
            other=filled.angles[part],
            move=move[part],
            curve=np.zeros(count, np.int8),
            joined=np.zeros(count, np.bool_),
            rate=None if rate is None else rate[part],
        )


def _rates(path: FilledPath, move: Ints, program: Program, settings: Settings, form: Form) -> Floats | None:
    """(m,) moves per minute where blocks are timed by us, NaN elsewhere; None where none is.

    Without tool tip control that is every cut in which a rotary axis turns; for controls that ask for it every block in
    which only rotary axes turn. Where the tip stands still, the axis point runs with the feed.
    """
    if not (form.orientation == "machine" or form.mode.timed_turns):
        return None
    own = move[path.pose]
    step = np.diff(path.tip, axis=0, prepend=path.tip[:1])
    swing = step + settings.axis_length * np.diff(path.axis, axis=0, prepend=path.axis[:1])
    length = norm(step)
    still = length < form.rounding(program.units)
    turn = np.abs(np.diff(path.angles, axis=0, prepend=path.angles[:1])).max(axis=1)
    cut = ~rapid_moves(program.kind)[own] & (program.feed_mode[own] == FeedMode.PER_MINUTE)
    turning = cut & (turn > _NO_TURN)
    if form.orientation == "machine":  # a whole cut is timed in one way
        first = np.flatnonzero(np.diff(cut, prepend=False) & cut)
        if len(first):
            run = np.cumsum(np.diff(cut, prepend=False) & cut) - 1
            any_turn = np.zeros(len(first), np.bool_)
            np.logical_or.at(any_turn, run[turning], True)
            timed = cut & any_turn[np.maximum(run, 0)]
        else:
            timed = cut
    else:
        timed = turning & still
    if not timed.any():
        return None
    rate = np.full(len(own), np.nan)
    way = np.where(still, norm(swing), length)
    rate[timed] = inverse_time(way[timed], program.feed[own[timed]], turn[timed], _FASTEST_TURN)
    rate[~np.isfinite(rate)] = np.nan
    return rate
