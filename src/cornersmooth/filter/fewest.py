"""Runs in as few blocks as ε allows: lines, and arcs where the table of the control has them.

The cuts of a run are a polyline, and its vertices the ends of all new blocks. So no number is new but radii.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.arrays import square, unit
from cornersmooth.control.source import CHUNK
from cornersmooth.control.state import State
from cornersmooth.filter.motion import Job, says_motion
from cornersmooth.filter.runs import ANGLES, ANY, NONE, TURNS, VECTOR, Reading, Run
from cornersmooth.kinematics import tip_position, tool_axis
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc.circles import STEEPEST
from cornersmooth.nc.control import Mode
from cornersmooth.nc.rotary_rows import LARGEST_TURN, line_limits
from cornersmooth.smoothing.fewest_pieces import PieceLimits, Pieces, Polyline, fewest_pieces
from cornersmooth.smoothing.long_lines import Vertices, fewest_lines
from cornersmooth.text import RowFormat, interleave, to_ticks

#: part of ε that is used: the rest is for the proof, and for the rounding of radii
_USED: Final = 0.97

#: parts of a step of the last digit by which places may be off what is written, and digits at most
_EXACT: Final = 1e-3
_MOST: Final = 9

#: digits of radii after the point, at least, in mm and in inches: every control takes so many
_RADIUS_DIGITS: Final = (3, 4)

#: what a run in time per block is left for
TIMED: Final = "each cut says its own time (G93)"
NO_FEWER: Final = "already as few blocks as ε allows"


@dataclass(frozen=True)
class _Group:
    """Runs that are written together: with the same units, plane and kinds of pieces."""

    runs: list[Run]
    unit: float  #: mm per unit
    plane: int  #: that holds, 0 where it is not known
    mode: Mode | None  #: of the table, where the tool does not turn; None where it does
    planes: tuple[int, ...]  #: in which arcs may lie


def fewest(
    job: Job, reading: Reading, runs: Sequence[Run], *, arcs: bool = True
) -> tuple[dict[int, bytes], dict[int, str]]:
    """Texts of runs with fewer blocks, and why others are left, by the first line of each."""
    made: dict[int, bytes] = {}
    why: dict[int, str] = {}
    groups: dict[tuple[int, float, int, bool, tuple[int, ...]], list[Run]] = {}
    for run in runs:
        if run.state.groups["feed"] == "inverse":
            why[run.first] = TIMED
            continue
        stays = bool((run.place[:, 3:] == run.start[3:]).all())
        key = (
            int(reading.start[run.first]) // CHUNK,
            run.state.unit,
            run.state.plane,
            stays,
            _planes(job, run.state, reading),
        )
        groups.setdefault(key, []).append(run)
    for (_, unit_, plane, stays, planes), own in groups.items():
        mode = _mode(job) if stays else None
        texts = _texts(job, reading, _Group(own, unit_, plane, mode, planes if arcs else ()))
        for run, text in zip(own, texts, strict=True):
            if text is None:
                why[run.first] = NO_FEWER
            else:
                made[run.first] = text
    return made, why


def _mode(job: Job) -> Mode:
    """How blocks look where the tool stays along one direction."""
    form = job.form
    upright = form.table.forms[form.name].upright
    return upright if job.reader.wanted == NONE and upright is not None else form.mode


def _planes(job: Job, state: State, reading: Reading) -> tuple[int, ...]:
    """Planes in which arcs may lie: none under tip control of rotary axes, that which holds under a frame."""
    mode, plane, wanted = _mode(job), state.plane, job.reader.wanted
    tips = wanted == ANGLES or (wanted == ANY and state.groups["tip"] != "off" and TURNS.search(reading.data))
    if not mode.circles or not plane or tips:
        return ()
    if mode.arc_directions or mode.circles_in_xy:
        return (17,) if plane == 17 else ()
    return (17, 18, 19) if state.frames == () else (plane,)


def _texts(job: Job, reading: Reading, group: _Group) -> list[bytes | None]:
    """Text of each run of a group, None where no block is saved."""
    runs = group.runs
    place = np.concatenate([run.places for run in runs])
    feed = np.concatenate([np.append(run.state.feed, run.feeds) for run in runs])
    count = np.array([len(run) + 1 for run in runs])
    begin = np.cumsum(count) - count
    begins = np.zeros(len(place), np.bool_)
    begins[begin] = True
    fixed = begins.copy()
    fixed[np.cumsum(count) - 1] = True
    fixed[1:-1] |= (feed[2:] != feed[1:-1]) & ~begins[1:-1]
    decimals = _decimals(job, place)
    digits = max(decimals[0], _RADIUS_DIGITS[group.unit != 1.0])
    if group.mode is not None:
        flat = bool(group.mode.arc_directions)
        slope = STEEPEST if group.mode.feed_in_plane else math.inf
        step = group.unit * 10.0**-digits
        limits = PieceLimits(_USED * job.settings.tolerance, group.planes, flat, step, slope=slope)
        pieces = fewest_pieces(Polyline(group.unit * place[:, :3], fixed, begins), limits)
    else:
        pieces = _lines(job, group, place, fixed, begins)
    own = np.searchsorted(begin, pieces.end, side="right") - 1  # run of each piece
    saved = np.bincount(own, minlength=len(runs)) < [run.lines for run in runs]
    if not saved.any():
        return [None] * len(runs)
    keep = saved[own]
    pieces = Pieces(*(values[keep] for values in vars(pieces).values()))
    blocks = _blocks(job, group, pieces, place, feed, begins, decimals, digits, reading.absent)
    return _shared_out(job, reading, group, pieces, own[keep], saved, blocks)


def _decimals(job: Job, place: Floats) -> tuple[int, ...]:
    """Digits after the point that hold the places of the program."""
    found = []
    for column, least in enumerate([job.spelling.tip] * 3 + [job.spelling.other] * (place.shape[1] - 3)):
        values, digits = place[:, column], least
        while digits < _MOST and np.abs(np.rint(values * 10.0**digits) - values * 10.0**digits).max() > _EXACT:
            digits += 1
        found.append(digits)
    return (max(found[:3]),) * 3 + (max(found[3:], default=0),) * (len(found) - 3)


def _lines(job: Job, group: _Group, place: Floats, fixed: Bools, begins: Bools) -> Pieces:
    """Lines of a tool that turns: at a common parameter no farther than ε from the motion of the cuts."""
    form, settings = job.form, job.settings
    position, words, length = group.unit * place[:, :3], place[:, 3:], settings.axis_length
    machine = form.machine if form.rotary else None
    if machine is None:
        words = unit(words)
        axis, tip = words, position
    else:
        words = np.column_stack((words, np.zeros((len(words), 2 - words.shape[1]))))
        axis = tool_axis(machine, words)
        tip = tip_position(machine, position, words) if form.orientation == "machine" else position
    lever = length * axis
    way, turn = np.diff(tip, axis=0, prepend=tip[:1]), np.diff(lever, axis=0, prepend=lever[:1])
    changes = np.abs(np.diff(words, axis=0, prepend=words[:1])).max(axis=1)
    parameter = np.cumsum(np.sqrt((square(way) + square(way + turn)) / 2.0) + 1e-3 * changes)
    limits = line_limits(settings.but(lines="long"), form, LARGEST_TURN)
    share = 1.0 if machine is None else 0.99
    limits = replace(limits, tip=share * limits.tip, axis_point=share * limits.axis_point, lag=np.inf)
    rows = Vertices(tip, words, tip, tip + lever, parameter, fixed, position if form.orientation == "machine" else None)
    kept = fewest_lines(rows, limits)
    end = kept[1:][~begins[kept[1:]]]
    start = kept[:-1][~begins[kept[1:]]]
    none = np.zeros(len(end), np.int64)
    return Pieces(start, end, none, none.copy())


def _blocks(
    job: Job,
    group: _Group,
    pieces: Pieces,
    place: Floats,
    feed: Floats,
    begins: Bools,
    decimals: Sequence[int],
    digits: int,
    absent: Sequence[str],
) -> list[bytes]:
    """A block for each piece, without line ends."""
    spelling, mode = job.spelling, group.mode or job.form.mode
    look = job.spelling.motion(mode)
    gap = " " if look.spaces else ""
    first = begins[pieces.start]
    leaves = spelling.modal and bool(look.modal)
    arc = pieces.plane > 0
    names = [*look.coordinates, *(job.form.mode.words if job.reader.wanted == VECTOR else job.reader.axes[3:])]
    ticks = to_ticks(place, decimals)
    left_out = (ticks[pieces.end] == ticks[pieces.start]) & leaves
    if job.reader.wanted == VECTOR:
        left_out[:, 3:] = left_out[:, 3:].all(axis=1, keepdims=True)
    if "axis" not in look.modal:
        left_out[:, 3:] = False
    if "tip" not in look.modal:
        left_out[:, :3] = False
    left_out[left_out.all(axis=1)] = False
    left_out[:, [job.reader.axes.index(letter) for letter in absent]] = True
    # codes: those of lines, and of arcs both ways with the plane where it is another one
    code = np.where(arc, np.where(pieces.radius < 0, 1, 2), 0)
    plane = np.where(arc, pieces.plane, 0)
    holding = _held(plane, first, group.plane)
    says_plane = arc & (plane != holding)
    before = np.concatenate(([0], code[:-1]))
    begins_in_line = np.array([run.state.groups["motion"] == "line" for run in group.runs])
    begins_in_line = begins_in_line[np.cumsum(begins)[pieces.start] - 1]  # runs that stay have no pieces
    repeats = np.where(first, begins_in_line & (code == 0), code == before) & (
        "code" in look.modal and not spelling.codes
    )
    repeats &= ~arc  # R and its like are read beside the code alone
    words = [look.line, look.clockwise, look.counterclockwise]
    heads = [f"{stated}{word}{gap}" for stated in ("", f"G17{gap}", f"G18{gap}", f"G19{gap}") for word in words] + [""]
    head_id = np.where(repeats, len(heads) - 1, code + 3 * np.where(says_plane, plane - 16, 0))
    feeds = feed[pieces.end]
    previous = np.where(first, feed[pieces.start], np.concatenate(([np.nan], feeds[:-1])))
    distinct, which = np.unique(feeds, return_inverse=True)
    tails = ["", *(f"{gap}{look.feed}{spelling.feed_text(value)}" for value in distinct.tolist())]
    tail_id = np.where(feeds == previous, 0, which.reshape(-1) + 1)

    def rows(
        chosen: Bools, letters: Sequence[str], numbers: Ints, places: Sequence[int], out: Bools, ends: Sequence[str]
    ) -> list[bytes]:
        blank = gap if leaves or not spelling.codes else ""
        written = tuple(f"{blank if k == 0 else gap}{letter}".encode() for k, letter in enumerate(letters))
        style = RowFormat(
            written, tuple(places), plus=look.signs, trim=not look.trailing_zeros, leading_zero=look.leading_zeros
        )
        texts = [head.removesuffix(gap) if blank else head for head in heads]
        lines = [f"{turn}{tail}\n".encode() for turn in ends for tail in tails]
        ids = tail_id[chosen] + len(tails) * (code[chosen] == 2) * (len(ends) > 1)
        return style.each(numbers, [text.encode() for text in texts], head_id[chosen], lines, ids, out)

    straight = ~arc
    made = [rows(straight, names, ticks[pieces.end[straight]], decimals, left_out[straight], [""])]
    if arc.any():
        axes = 2 if look.arc_directions else 3
        out = np.zeros((int(arc.sum()), axes + 1), np.bool_)
        if axes == 3:
            third = np.array([2, 1, 0])[plane[arc] - 17]
            own = np.arange(len(out))
            same = (ticks[pieces.end[arc]] == ticks[pieces.start[arc]])[own, third]
            out[own, third] = same & (leaves | np.isin(third, ["XYZ".index(letter) for letter in absent]))
        numbers = np.column_stack((ticks[pieces.end[arc], :axes], np.abs(pieces.radius[arc])))
        turns = [f"{gap}{turn}" for turn in look.arc_directions] or [""]
        letters = [*names[:axes], look.radius]
        made.append(rows(arc, letters, numbers, [*decimals[:axes], digits], out, turns))
    return interleave(arc.astype(np.int64), made).splitlines()


def _held(plane: Ints, first: Bools, start: int) -> Ints:
    """Plane that holds before each piece: that of the last arc of its run, else that before the run."""
    index = np.arange(len(plane))
    last = np.maximum.accumulate(np.where(plane > 0, index, -1))
    before = np.concatenate(([-1], last[:-1]))
    begun = np.maximum.accumulate(np.where(first, index, 0))
    return np.where(before >= begun, plane[before], start)


def _shared_out(
    job: Job, reading: Reading, group: _Group, pieces: Pieces, own: Ints, saved: Bools, blocks: list[bytes]
) -> list[bytes | None]:
    """Texts of runs, with what is put back behind each."""
    look = group.mode or job.form.mode
    ends = np.cumsum(np.bincount(own, minlength=len(group.runs)))
    texts: list[bytes | None] = []
    for k, run in enumerate(group.runs):
        if not saved[k]:
            texts.append(None)
            continue
        some, planes = slice(ends[k - 1] if k else 0, ends[k]), pieces.plane
        lines, used = blocks[some], planes[some][planes[some] > 0]
        back = []
        if len(used) and used[-1] != group.plane:
            back.append(f"G{group.plane}")
        if planes[ends[k] - 1] and "code" in look.modal and not says_motion(reading.lines(run.stop, run.stop + 1)):
            back.append(look.line)
        incremental = run.state.groups["distance"] == "incremental"
        lines = [*([b"G90"] if incremental else []), *lines, *([" ".join(back).encode()] if back else [])]
        lines += [b"G91"] if incremental else []
        fewer = len(lines) < run.lines
        texts.append(job.spelling.text(reading.lines(run.first, run.stop), lines) if fewer else None)
    return texts
