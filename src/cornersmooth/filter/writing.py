"""Smooths runs and writes them as blocks of the program, many runs at once."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.control.source import CHUNK
from cornersmooth.errors import CornersmoothError
from cornersmooth.filter.motion import Job, motion_of_runs, program_of
from cornersmooth.filter.runs import Reading, Run
from cornersmooth.kinematics import Machine, solutions, tool_axis
from cornersmooth.model import Floats
from cornersmooth.nc import Frame, write
from cornersmooth.nc.form import Form
from cornersmooth.pipeline import smooth
from cornersmooth.settings import Settings

_INVERSE, _MINUTE = b"G93", b"G94"
_ROUNDING: Final = re.compile(rb"G6[014]\b")
_FEED: Final = re.compile(rb"F([\d.]+)$")


def smoothed(job: Job, reading: Reading, runs: Sequence[Run]) -> tuple[dict[int, bytes], dict[int, str]]:
    """Blocks for runs, and why others are left, by the first line of each."""
    if reading.absent:
        return {}, {run.first: f"{reading.absent[0]} is never given" for run in runs}
    made: dict[int, bytes] = {}
    why: dict[int, str] = {}
    groups: dict[tuple[object, ...], list[Run]] = {}
    # what can be written together: near each other, so that memory is bounded, with the same units and turn
    for run, turn in zip(runs, _turns(job.form.machine, runs), strict=True):
        key = (int(reading.start[run.first]) // CHUNK, run.state.unit, bool(run.state.rounding), turn)
        groups.setdefault(key, []).append(run)
    for group in groups.values():
        _attempt(job, reading, group, made, why)
    return made, why


def _turns(machine: Machine | None, runs: Sequence[Run]) -> list[tuple[float, ...]]:
    """Solution and turns of the rotary axes in each run, where a machine has two of them."""
    if machine is None or len(machine.names) != 2 or not runs:
        return [()] * len(runs)
    angles = np.array([run.start[3:] for run in runs])
    off = np.abs((solutions(machine, tool_axis(machine, angles)).angles - angles[:, None] + 180.0) % 360.0 - 180.0)
    turns = np.round([sum(_ends(run)) / 720.0 for run in runs])
    return [tuple(row) for row in np.column_stack((np.argmin(off.max(axis=2), axis=1), turns)).tolist()]


def _ends(run: Run) -> tuple[Floats, Floats]:
    """Least and largest words of the tool axis in a run."""
    places = run.places[:, 3:]
    return places.min(axis=0), places.max(axis=0)


def _attempt(job: Job, reading: Reading, runs: Sequence[Run], made: dict[int, bytes], why: dict[int, str]) -> None:
    """Smooth runs together; those that this is not good for on their own."""
    try:
        found = _write(job, reading, runs)
    except CornersmoothError as error:
        if len(runs) == 1:
            why[runs[0].first] = re.sub(r"[-\d.]*\d", "#", error.what)
            return
        middle = len(runs) // 2
        for half in (runs[:middle], runs[middle:]):
            _attempt(job, reading, half, made, why)
        return
    for run, blocks in zip(runs, found, strict=True):
        if blocks is not None:
            made[run.first] = job.spelling.text(reading.lines(run.first, run.stop), blocks)
        elif len(runs) == 1:
            why[run.first] = "the rotary axes would come out in another turn or solution"
        else:
            _attempt(job, reading, [run], made, why)


def _write(job: Job, reading: Reading, runs: Sequence[Run]) -> list[list[bytes] | None]:
    """Blocks of each run; None where the rotary axes would begin or end elsewhere."""
    program = program_of(motion_of_runs(job, reading, runs), marks=True)
    form = job.spelling.form(job.form, rounding=bool(runs[0].state.rounding))
    if job.form.machine is not None:
        form = replace(form, machine=_within(job.form.machine, runs, job.settings))
    path = smooth(program, job.settings, form=form, processes=job.processes)
    stream = io.BytesIO()
    write(path, stream, form=form, frame=Frame(modal=job.spelling.modal))
    return list(_split(job, form, stream.getvalue(), runs))


def _within(machine: Machine, runs: Sequence[Run], settings: Settings) -> Machine:
    """Machine whose rotary axes go no further than in some runs: so turn and solution are those of the program."""
    # by ε the axis may leave that of the program, and by as much its own angles near the pole
    slack = 2 * math.degrees(settings.tolerance / settings.axis_scale)
    ends = [_ends(run) for run in runs]
    low, high = np.min([low for low, _ in ends], axis=0) - slack, np.max([high for _, high in ends], axis=0) + slack
    limits = dict(zip(machine.names, zip(low.tolist(), high.tolist(), strict=True), strict=True))
    axes = tuple(
        replace(axis, limits=limits[axis.name], modulo=False) if axis.name in limits else axis for axis in machine.axes
    )
    return replace(machine, axes=axes, preferred=None)


def _split(job: Job, form: Form, text: bytes, runs: Sequence[Run]) -> Iterator[list[bytes] | None]:
    """Cut a text with a comment before each run into blocks that say on their own what holds; None as in `_write`."""
    look, (before, behind) = form.mode, form.table.layout.comment
    rapid, rapid_end, line_word = (word.encode() for word in (look.rapid, look.rapid_end, look.line))
    mode, rounding, feed = _MINUTE, b"", b""
    angles = dict.fromkeys(form.machine.names if form.machine is not None and form.rotary else (), math.nan)
    digit = 10.0**-form.table.digits.angle

    def is_rapid(line: bytes) -> bool:
        others = line_word != rapid and line.startswith(line_word)
        return line.startswith(rapid) and line.endswith(rapid_end) and not others

    def same(angles: Mapping[str, float], place: Floats, run: Run) -> bool:  # but for their last digit
        wanted = dict(zip(run.state.axes, place.tolist(), strict=False))
        return all(abs(value - wanted[name]) <= digit for name, value in angles.items())

    for run, part in zip(runs, text.split(f"{before}RUN{behind}\n".encode())[1:], strict=True):
        lines = part.splitlines()
        cut = next((k for k, line in enumerate(lines) if not (_is_mode(line) or is_rapid(line))), len(lines))
        kept = [*filter(_is_mode, lines[:cut]), *lines[cut:]]
        begin = _turned(angles, [line for line in lines[:cut] if not _is_mode(line)])
        angles = _turned(begin, kept)
        first_block = next((k for k, line in enumerate(kept) if not _is_mode(line)), 0)
        own = _INVERSE if run.state.groups["feed"] == "inverse" else _MINUTE
        head = [] if run.state.groups["distance"] == "absolute" else [b"G90"]
        if mode != own and not {_INVERSE, _MINUTE} & {*kept[:first_block]}:
            head.append(mode)
        if rounding and run.state.rounding and not any(map(_ROUNDING.match, kept[:first_block])):
            head.append(rounding)
        feed_before = feed if mode == _MINUTE else b""
        for line in kept:
            if b"F" in line and (match := _FEED.search(line)):
                feed = match[0]
            elif line in (_INVERSE, _MINUTE):
                mode = line
            elif _ROUNDING.match(line):
                rounding = line
        stays = same(begin, run.start, run) and same(angles, run.place[-1], run)
        if not stays or not kept:
            yield None
            continue
        if feed_before and b"F" not in kept[first_block]:
            kept[first_block] += (b" " if look.spaces else b"") + feed_before
        tail = [own] if mode != own else []
        if mode == _INVERSE and own == _MINUTE:
            tail.append(f"{look.feed}{run.feeds[-1]:.10g}".encode())
        if rounding and run.state.rounding:
            tail.append(run.state.rounding.encode())
        yield [*head, *kept, *tail, *([] if run.state.groups["distance"] == "absolute" else [b"G91"])]


def _is_mode(line: bytes) -> bool:
    return line in (_INVERSE, _MINUTE) or _ROUNDING.match(line) is not None


def _turned(angles: Mapping[str, float], lines: Sequence[bytes]) -> dict[str, float]:
    """Angles after some blocks: their last rotary words."""
    found, left = dict(angles), set(angles)
    for line in reversed(lines):
        for name in sorted(left):
            if match := re.search(rb"(?<![A-Z])%b=?([-+]?[\d.]+)" % name.encode(), line):
                found[name] = float(match[1])
                left.discard(name)
        if not left:
            break
    return found
