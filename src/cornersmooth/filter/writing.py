"""Smooths runs and writes them as blocks of the program, many runs at once."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.errors import CornersmoothError
from cornersmooth.filter.motion import Stretch, in_places, motion, program_of
from cornersmooth.filter.runs import ProgramReader, Reading, Run
from cornersmooth.filter.spelling import Spelling, numbered, numbers_of
from cornersmooth.filter.state import INVERSE_TIME
from cornersmooth.kinematics import Machine, solutions, tool_axis
from cornersmooth.model import Floats
from cornersmooth.nc import Frame, write
from cornersmooth.nc.form import Form
from cornersmooth.nc_reader.block_tables import CHUNK
from cornersmooth.pipeline import smooth
from cornersmooth.settings import Settings

_ROUNDING: Final = re.compile(rb"G6[014]\b")
_INVERSE, _MINUTE = b"G93", b"G94"
_FEED: Final = re.compile(rb"F([\d.]+)$")


@dataclass(frozen=True)
class Job:
    """What runs are smoothed for."""

    reader: ProgramReader
    form: Form  #: of the new blocks
    own: Form  #: lines in the words that the program has
    spelling: Spelling
    settings: Settings
    processes: int = 1

    def stretch(self, reading: Reading, run: Run) -> Stretch:
        """Blocks of a run itself, in places."""
        text = reading.lines(run.first, run.stop)
        if not run.state.absolute:
            text = self._in_places(run, text)
        return Stretch(run, text, run.first + 1)

    def _in_places(self, run: Run, text: bytes) -> bytes:
        """Blocks that say distances, in places, with their own feeds."""
        feeds = [re.search(rb"F[ \t]*[\d.]+", line.upper()) for line in text.splitlines()]
        blocks = in_places(run, self.own, self.spelling).splitlines()
        pairs = zip(blocks, feeds, strict=True)
        return b"".join(block + b" " + (feed[0] if feed else b"") + b"\n" for block, feed in pairs)


def smoothed(job: Job, reading: Reading) -> tuple[dict[int, bytes], dict[int, str]]:
    """Blocks for runs, and why others are left, by the first line of each."""
    made: dict[int, bytes] = {}
    why: dict[int, str] = {}
    for group in _groups(job, reading):
        _attempt(job, reading, group, made, why)
    return made, why


def _groups(job: Job, reading: Reading) -> list[list[Run]]:
    """Runs that can be written together: near each other, so that memory is bounded, with the same units and turn."""
    found: dict[tuple[object, ...], list[Run]] = {}
    for run, turn in zip(reading.runs, _turns(job.form.machine, reading.runs), strict=True):
        key = (int(reading.start[run.first]) // CHUNK, run.state.unit, bool(run.state.rounding), turn)
        found.setdefault(key, []).append(run)
    return list(found.values())


def _turns(machine: Machine | None, runs: Sequence[Run]) -> list[tuple[float, ...]]:
    """Solution and turns of the rotary axes in each run, where a machine has two of them."""
    if machine is None or len(machine.names) != 2 or not runs:
        return [()] * len(runs)
    angles = np.array([run.start[3:] for run in runs])
    off = np.abs((solutions(machine, tool_axis(machine, angles)).angles - angles[:, None] + 180.0) % 360.0 - 180.0)
    turns = np.round([(run.low[3:] + run.high[3:]) / 720.0 for run in runs])
    return [tuple(row) for row in np.column_stack((np.argmin(off.max(axis=2), axis=1), turns)).tolist()]


def _attempt(job: Job, reading: Reading, runs: Sequence[Run], made: dict[int, bytes], why: dict[int, str]) -> None:
    """Smooth runs together; those that this is not good for on their own."""
    try:
        texts = _write(job, reading, runs)
    except CornersmoothError as error:
        if len(runs) == 1:
            why[runs[0].first] = re.sub(r"[-\d.]*\d", "#", error.what)
            return
        middle = len(runs) // 2
        for half in (runs[:middle], runs[middle:]):
            _attempt(job, reading, half, made, why)
        return
    for run, text in zip(runs, texts, strict=True):
        if text is not None:
            made[run.first] = blocks(job, reading, run, text)
        elif len(runs) == 1:
            why[run.first] = "the rotary axes would come out in another turn or solution"
        else:
            _attempt(job, reading, [run], made, why)


def _write(job: Job, reading: Reading, runs: Sequence[Run]) -> list[list[bytes] | None]:
    """Blocks of each run; None where the rotary axes would begin or end elsewhere."""
    nc = motion([job.stretch(reading, run) for run in runs], job.own, job.spelling, job.settings)
    program = program_of(nc, marks=True)
    form = job.spelling.form(job.form, rounding=bool(runs[0].state.rounding))
    if job.form.machine is not None:
        form = replace(form, machine=_within(job.form.machine, runs, job.settings))
    path = smooth(program, job.settings, form=form, processes=job.processes)
    stream = io.BytesIO()
    write(path, stream, form=form, frame=Frame(modal=job.spelling.modal))
    return _split(job, form, stream.getvalue(), runs)


def _within(machine: Machine, runs: Sequence[Run], settings: Settings) -> Machine:
    """Machine whose rotary axes go no further than in some runs: so turn and solution are those of the program."""
    # by ε the axis may leave that of the program, and by as much its own angles near the pole
    slack = 2 * math.degrees(settings.tolerance / settings.axis_scale)
    low = np.min([run.low[3:] for run in runs], axis=0) - slack
    high = np.max([run.high[3:] for run in runs], axis=0) + slack
    limits = dict(zip(machine.names, zip(low.tolist(), high.tolist(), strict=True), strict=True))
    axes = tuple(
        replace(axis, limits=limits[axis.name], modulo=False) if axis.name in limits else axis for axis in machine.axes
    )
    return replace(machine, axes=axes, preferred=None)


def _split(job: Job, form: Form, text: bytes, runs: Sequence[Run]) -> list[list[bytes] | None]:
    """Cut a text with a comment before each run into blocks that stand for themselves."""
    before, behind = form.table.layout.comment
    _, *whole = text.split(f"{before}RUN{behind}\n".encode())
    held = _Held(form)
    return [held.blocks(job, run, part.splitlines()) for run, part in zip(runs, whole, strict=True)]


class _Held:
    """What holds in a text of many runs, and has to be said in each of them on its own."""

    def __init__(self, form: Form) -> None:
        self._form, self._look = form, form.mode.motion
        self._mode, self._rounding, self._feed = _MINUTE, b"", b""
        names = form.machine.names if form.machine is not None and form.rotary else ()
        self._angles = dict.fromkeys(names, math.nan)

    def blocks(self, job: Job, run: Run, lines: Sequence[bytes]) -> list[bytes] | None:
        """Blocks of a run; None where the rotary axes begin or end elsewhere."""
        cut = next((k for k, line in enumerate(lines) if not (self._is_mode(line) or self._is_rapid(line))), len(lines))
        rapids = [line for line in lines[:cut] if not self._is_mode(line)]
        kept = [*(line for line in lines[:cut] if self._is_mode(line)), *lines[cut:]]
        mode, rounding, feed = self._mode, self._rounding, self._feed
        begin = self._turned(rapids)
        self._turned(kept)
        away = not self._form.curves and not (
            self._same(begin, run.start, run) and self._same(self._angles, run.place[-1], run)
        )
        said = next((k for k, line in enumerate(kept) if not self._is_mode(line)), 0)
        for line in kept:
            if b"F" in line and (match := _FEED.search(line)):
                self._feed = match[0]
            elif line in (_INVERSE, _MINUTE):
                self._mode = line
            elif line.startswith(b"G6") and _ROUNDING.match(line):
                self._rounding = line
        if away or not kept:
            return None
        own = _INVERSE if run.state.feed_mode == INVERSE_TIME else _MINUTE
        head = [] if run.state.absolute else [b"G90"]
        if mode != own and not any(line in (_INVERSE, _MINUTE) for line in kept[:said]):
            head.append(mode)
        if rounding and run.state.rounding and not any(map(_ROUNDING.match, kept[:said])):
            head.append(rounding)
        if b"F" not in kept[said] and feed and mode == _MINUTE and not self._form.curves:
            kept[said] += (b" " if self._look.spaces else b"") + feed
        tail = [] if not self._form.curves else [in_places(run, job.own, job.spelling).splitlines()[-1]]
        tail += [own] if self._mode != own else []
        if self._mode == _INVERSE and own == _MINUTE:
            tail.append(f"{self._look.feed}{run.feed:.10g}".encode())
        if self._rounding and run.state.rounding:
            tail.append(run.state.rounding.encode())
        return [*head, *kept, *tail, *([] if run.state.absolute else [b"G91"])]

    def _is_rapid(self, line: bytes) -> bool:
        rapid, end, cut = self._look.rapid.encode(), self._look.rapid_end.encode(), self._look.line.encode()
        return line.startswith(rapid) and line.endswith(end) and (cut == rapid or not line.startswith(cut))

    def _is_mode(self, line: bytes) -> bool:
        return line in (_INVERSE, _MINUTE) or _ROUNDING.match(line) is not None

    def _turned(self, lines: Sequence[bytes]) -> dict[str, float]:
        """Take the last rotary words of blocks."""
        left = set(self._angles)
        for line in reversed(lines):
            for name in sorted(left):
                if match := re.search(rb"(?<![A-Z])%b=?([-+]?[\d.]+)" % name.encode(), line):
                    self._angles[name] = float(match[1])
                    left.discard(name)
            if not left:
                break
        return dict(self._angles)

    def _same(self, angles: dict[str, float], place: Floats, run: Run) -> bool:
        """Whether angles are those of a place, but for their last digit."""
        digit = 10.0**-self._form.table.digits.angle
        wanted = dict(zip(run.state.axes, place.tolist(), strict=True))
        return all(abs(value - wanted[name]) <= digit for name, value in angles.items())


def blocks(job: Job, reading: Reading, run: Run, lines: Sequence[bytes]) -> bytes:
    """Text that takes the place of a run, with the numbers and line ends of the program."""
    spelling = job.spelling
    own = list(lines)
    if spelling.numbered:
        own = numbered(own, numbers_of(reading.lines(run.first, run.stop).splitlines()))
    text = b"".join(line + spelling.end for line in own)
    ended = reading.lines(run.first, run.stop).endswith(b"\n")
    return text if ended else text.removesuffix(spelling.end)
