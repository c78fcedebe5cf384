"""Hole cycles: what a CYCLE statement means, which one is in force, which tools may have cycles of the control.

All distances count along the tool axis from the position that the CL file gives, the top of the hole:

* ``RAPTO`` (or ``CLEAR``) above it the feed begins; ``RTRCTO`` or ``RETURN`` above it the tool goes when it is done;
* ``FEDTO`` or ``DEPTH`` below it the hole ends. NX writes ``FEDTO`` negative (``FEDTO,-33.0043``), everyone else
  positive; a positive number in an NX file would lie in the air and is not understood.

HSM's ``CLEAR`` is an absolute height and is passed over for its ``RAPTO`` and ``RETURN``.

``CYCLE/ON`` goes on with the last cycle; words after it (``CYCLE/ON,FEDTO,-74.5``) take the place of its own.
``CYCLE/DRILL,ON,...`` is how ISO 4343 (10.8.7) begins one. ISO 4343:1978 has a fixed order, in which some numbers have
no word: ``CYCLE/DRILL, 12, MMPM, 85, 1`` says depth, unit, feed and clearance.

Not understood, and so never drilled by guess: threads, bores that orient or stop the spindle, countersinks by
diameter, other numbers without a word (CATIA's ``CYCLE/DRILL, 3.0, 5.0`` depends on the PP table). A plain ``TAP`` is
understood, but only a cycle of the control can do it.

Controls take no hole cycles and no cutter compensation under tool tip control. So a tool has cycles only where it stays
along Z from its change to the next, and where the rotary axes are known to stand at zero: then it runs without tool tip
control (`Form.upright`), and X Y Z mean the same. All its other motion is written without orientation. Everything else
stays plain moves. Where cycles are wanted, a tool with cutter compensation runs in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.kinematics import machine_position, tool_axis
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.statement_args import Orders, ends, milliseconds, tool_starts, words_of

_MOST_PECKS = 1000  #: more pecks in one hole are a misunderstanding
_KINDS = {"DRILL", "FACE", "SPOT", "CSINK", "REAM", "BORE", "DEEP", "DEEP2", "BRKCHP", "TAP"}
_PECKING = {"DEEP", "DEEP2", "BRKCHP"}
_AT_FEED = {"REAM", "BORE"}
_DEPTHS = ("FEDTO", "DEPTH")
_RETURNS = ("RTRCTO", "RETURN")
_STEPS = ("STEP", "INCR", "1STPECK", "SUBPECK")
_DISTANCES = {*_DEPTHS, *_RETURNS, *_STEPS, "RAPTO", "CLEAR"}
#: millimetres per unit of the feed, None for the unit of the file, and what it is per
_FEEDS = {
    "MMPM": (1.0, FeedMode.PER_MINUTE),
    "IPM": (25.4, FeedMode.PER_MINUTE),
    "PERMIN": (None, FeedMode.PER_MINUTE),
    "MMPR": (1.0, FeedMode.PER_REVOLUTION),
    "IPR": (25.4, FeedMode.PER_REVOLUTION),
    "PERREV": (None, FeedMode.PER_REVOLUTION),
}
#: kinds of a cycle, and its words with their numbers
Given = tuple[set[str], dict[str, tuple[float, ...]]]


@dataclass(frozen=True)
class Cycle:
    """What a CYCLE statement asks for; lengths in mm along the tool axis."""

    depth: float  #: below the position
    clearance: float | None  #: above the position: where feeding begins; None for the height of travel
    retract: float = 0.0  #: above the position: least height when the hole is done
    feed: float = math.nan  #: mm/min or mm/rev; NaN for the feed in force
    feed_mode: FeedMode = FeedMode.PER_MINUTE
    dwell: int = 0  #: milliseconds at the depth
    steps: tuple[float, ...] = ()  #: depths of the pecks, the last one repeated; none for a single feed
    full_retract: bool = True  #: whether a peck comes out of the hole
    feed_out: bool = False
    pecking: bool = False  #: whether pecks are wanted; without any steps the hole is drilled in one feed
    tap: bool = False  #: whether a thread is cut: the spindle turns with the feed


def read_cycle(given: Given | None, program: Program, speed: float | None) -> Cycle | None:
    """Read the words of a cycle, as `_pairs` gives them; None where any of them is not understood.

    A dwell may count in revolutions of the spindle at a speed, rev/min.
    """
    if given is None:
        return None
    kinds, values = given
    scale = program.mm_per_unit
    depths = [values[word][0] for word in _DEPTHS if word in values]
    if not kinds or len(depths) != 1:
        return None
    depth = -depths[0] if program.source.dialect == "nx" else values.get("DEPTH", (abs(depths[0]),))[0]
    returns = [values[word][0] for word in _RETURNS if word in values]
    hsm = program.source.dialect == "hsm"
    clearances = [values["RAPTO"][0]] if "RAPTO" in values else []
    clearances += returns if hsm else values.get("CLEAR", ())[:1] or returns
    if depth < 0.0 or any(height < 0.0 for height in (*clearances, *returns)):
        return None
    steps = tuple(scale * step for word in _STEPS for step in values.get(word, ()))
    if any(step <= 0.0 for step in steps) or (steps and depth * scale / min(steps) > _MOST_PECKS):
        return None
    if steps and not _PECKING & kinds:  # whether pecks come out of the hole nobody says
        return None
    dwell = milliseconds(values["DWELL"][0], "REV" in values, speed) if "DWELL" in values else 0
    if dwell is None or ("TAP" in kinds and (len(kinds) > 1 or steps or dwell or not depth > 0.0)):
        return None
    unit = next((word for word in _FEEDS if word in values), "")
    per_unit, mode = _FEEDS.get(unit, (None, FeedMode.PER_MINUTE))
    return Cycle(
        depth=depth * scale,
        clearance=clearances[0] * scale if clearances else None,
        retract=max(returns, default=0.0) * scale,
        feed=values[unit][0] * (per_unit or scale) if unit else math.nan,
        feed_mode=mode,
        dwell=dwell,
        steps=steps,
        full_retract="BRKCHP" not in kinds,
        feed_out=bool(_AT_FEED & kinds),
        pecking=bool(_PECKING & kinds),
        tap="TAP" in kinds,
    )


def _pairs(args: Sequence[float | str]) -> Given | None:
    """Words that say what kind of cycle it is, and words with their numbers; None for anything else."""
    kinds: set[str] = set()
    values: dict[str, tuple[float, ...]] = {}
    word = ""
    for value in args:
        if isinstance(value, float):
            many = word == "STEP" and word in values
            if not math.isfinite(value) or not word or (word in values and not many):
                return None
            values[word] = (*values.get(word, ()), value)
        elif value == "AUTO" and word in _RETURNS and word not in values:
            word = ""  # the control's own height: that of the CL file is the height of travel
        elif value == "REV" and word == "DWELL":
            values[value] = ()
        elif value in _KINDS:
            kinds.add(value)
            word = ""
        elif value in _DISTANCES or value in _FEEDS or value == "DWELL":
            if value in values or (word and word not in values):
                return None
            word = value
        elif value:
            return None
    if (word and word not in values) or len(_FEEDS.keys() & values.keys()) > 1:
        return None
    return kinds, values


@dataclass(frozen=True)
class Drilling:
    """What the CL file says of holes from some statement on."""

    cycle: Cycle | None = None  #: None where no cycle is in force, or it is not understood
    line: int = 0  #: of the last CYCLE statement, 0 for none
    clockwise: bool = False  #: whether the spindle has been started clockwise, as for a tap


@dataclass(frozen=True)
class Drillings:
    """What holds for the holes of a program."""

    first: tuple[int, ...]  #: pose from which on each holds, ascending
    each: tuple[Drilling, ...]

    def of(self, poses: Ints) -> Ints:
        """(k,) place in `each` of what holds at poses."""
        return np.searchsorted(self.first, poses, side="right") - 1


def plan_drilling(program: Program, orders: Orders, findings: Findings) -> Drillings:
    """Go through the statements about cycles, and about the spindle, whose turns a dwell may count."""
    given: Given | None = None
    drills, now, speed = False, Drilling(), None
    first, each = [0], [now]
    for statement in program.statements:
        if statement.word == "SPINDL":
            order = orders[id(statement)] or ("", None)
            speed, now = order[1] or speed, replace(now, clockwise=order[0] in ("CLW", "ON"))
        elif statement.word == "CYCLE" and ends(statement):
            drills = False
        elif statement.word == "CYCLE":
            now = replace(now, line=statement.line)
            if words_of(statement) != ["INIT"]:  # by which SolidWorks announces one
                given, drills = _pairs(statement.args), True
        else:
            continue
        now = replace(now, cycle=read_cycle(given, program, speed) if drills else None)
        if statement.word == "CYCLE" and now.cycle is not None and now.cycle.pecking and not now.cycle.steps:
            findings.note("CS321", statement.line)
        first.append(statement.pose)
        each.append(now)
    return Drillings(tuple(first), tuple(each))


_SIDES: Final = (["LEFT"], ["RIGHT"])  #: sides of the path on which cutter compensation keeps the tool
_ALONG_Z, _SAME_PLACE = 1e-9, 1e-9  #: by how much a tool axis along Z may be off, and a position at angles of zero, mm


def upright_poses(program: Program, form: Form, drillings: Drillings, *, drills: bool) -> Bools:
    """(n,) whether a pose belongs to a tool that runs without tool tip control, for cycles or cutter compensation.

    In curves all tools do that can: without words of the tool axis arcs are circles, and curves those of every control.
    Where the tool axis is a second point, all tools have it or none: a control keeps U V W from tool to tool, and no
    word says where they are before the first.

    `drills` says whether holes are to be written as cycles; taps are in any case.
    """
    chosen = np.zeros(len(program), np.bool_)
    holes = program.kind == Move.HOLE
    sides = [one for one in program.statements if one.word == "CUTCOM" and words_of(one)[:1] in _SIDES]
    compensated = [one.pose for one in sides if drills]
    if not (form.curves or compensated or holes.any()) or not _can_stand_upright(form):
        return chosen
    tilted = np.abs(program.axis - (0.0, 0.0, 1.0)).max(axis=1) > _ALONG_Z
    tilted &= program.kind != Move.FROM
    starts = tool_starts(program)
    if form.orientation == "point" and tilted.any():
        return chosen
    if not form.rotary and tilted.any():  # without a machine no words bring the rotary axes back
        tilted[int(np.argmax(tilted)) :] = True
    for first, stop in zip(starts, [*starts[1:], len(program)], strict=True):
        here = slice(first, stop)
        if not tilted[here].any():
            offset = any(first <= pose < stop for pose in compensated)
            chosen[here] = form.curves or offset or has_cycles(program, form, here, drillings, drills=drills)
    return chosen


def has_cycles(program: Program, form: Form, part: slice, drillings: Drillings, *, drills: bool) -> bool:
    """Whether any hole of a part of the poses can be a cycle of the control; `drills` as in `upright_poses`."""
    poses = part.start + np.flatnonzero(program.kind[part] == Move.HOLE)
    number, first = np.unique(drillings.of(poses), return_index=True)
    return any(
        one.cycle is not None
        and (one.clockwise if one.cycle.tap else drills)
        and kind_of(one.cycle, form, program, poses[k : k + 1])
        for one, k in ((drillings.each[place], k) for place, k in zip(number, first, strict=True))
    )


def _can_stand_upright(form: Form) -> bool:
    """Whether the form has such blocks, and X Y Z are the tip while the rotary axes stand at zero."""
    if form.upright is None or not form.table.program.retract:
        return False
    if form.machine is None or not form.rotary:
        return True
    zero = np.zeros((1, 2))
    if (form.machine.limits[:, 0] > 0.0).any() or (form.machine.limits[:, 1] < 0.0).any():
        return False
    place = np.array([[11.0, -7.0, 5.0]])
    upright = np.abs(tool_axis(form.machine, zero) - (0.0, 0.0, 1.0)).max() <= _ALONG_Z
    return bool(upright and np.abs(machine_position(form.machine, place, zero) - place).max() <= _SAME_PLACE)


def hole_feeds(cycle: Cycle, program: Program, poses: Ints) -> tuple[Floats, Ints]:
    """(h,) feed of every hole, mm/min or mm/rev, NaN where there is none, and (h,) its `FeedMode`."""
    if np.isnan(cycle.feed):
        return program.feed[poses], program.feed_mode[poses].astype(np.int64)
    return np.full(len(poses), cycle.feed), np.full(len(poses), int(cycle.feed_mode))


def kind_of(cycle: Cycle, form: Form, program: Program, poses: Ints) -> str:
    """Name of the cycle of the control that does the same, as in `Cycles`; empty for none."""
    cycles, (feed, modes) = form.table.cycles, hole_feeds(cycle, program, poses)
    stepped = bool(cycle.steps)
    if cycle.clearance is None or np.isnan(feed).any() or (modes != modes[0]).any() or not cycle.depth > 0.0:
        return ""  # a depth of nothing is drilled by no TNC
    if stepped and (len(set(cycle.steps)) > 1 or cycle.dwell or cycle.feed_out):
        return ""
    if cycles.per_minute and not cycle.tap and (modes[0] != FeedMode.PER_MINUTE or program.units != "mm"):
        return ""
    if cycle.tap:
        name = "tap"
    elif stepped:
        name = "peck" if cycle.full_retract else "chip"
    elif cycle.feed_out:
        name = "ream_dwell" if cycle.dwell else "ream"
    else:
        name = "dwell" if cycle.dwell else "drill"
    return name if getattr(cycles, name) else ""
