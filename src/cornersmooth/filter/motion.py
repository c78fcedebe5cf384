"""What a control does in runs: their bytes, after a head that says the state they begin in, read by `nc_reader`."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.control.table import PRESET
from cornersmooth.errors import InputError
from cornersmooth.filter.runs import ANY, TURNS, ProgramReader, Reading, Run
from cornersmooth.filter.spelling import Spelling
from cornersmooth.model import Floats, Move, Program, Statement
from cornersmooth.nc.form import Form
from cornersmooth.nc_reader import NcProgram
from cornersmooth.nc_reader.elements import Element
from cornersmooth.pipeline import read_back
from cornersmooth.settings import Settings

#: a block with G0 to G3 before anything that may be no word
_SAYS_MOTION: Final = re.compile(rb"(?i)[ \t]*(?:[NGXYZABCFSM][ \t]*[-+]?[\d.]+[ \t]*)*?G[ \t]*0?[0-3](?![\d.])")


@dataclass(frozen=True)
class Job:
    """What runs are smoothed for."""

    reader: ProgramReader
    form: Form  #: of the new blocks
    spelling: Spelling
    settings: Settings
    processes: int = 1


@dataclass(frozen=True)
class Stretch:
    """Blocks that stand for a run, in the program itself or in another."""

    run: Run  #: says the state before the blocks
    text: bytes  #: whole lines
    line: int  #: number of the first, from 1


def says_motion(line: bytes) -> bool:
    """Whether a line, which no operator may skip, says by itself how it moves."""
    return _SAYS_MOTION.match(line) is not None


def motion_of_runs(job: Job, reading: Reading, runs: Sequence[Run]) -> NcProgram:
    """Motion of runs of a program itself, as `motion` reads it."""
    stretches = []
    for run in runs:
        text = reading.lines(run.first, run.stop)
        others = job.reader.wanted == ANY and TURNS.search(text)
        if others or run.state.groups["distance"] == "incremental":  # in places, with their own feeds
            blocks = (_block(job, run, place, job.form, rapid=False) for place in run.place)
            pairs = zip(blocks, run.feeds.tolist(), strict=True)
            text = b"".join(b"%b F%.9f\n" % pair for pair in pairs)
        stretches.append(Stretch(run, text, run.first + 1))
    return motion(job, stretches, job.form)


def motion(job: Job, stretches: Sequence[Stretch], form: Form) -> NcProgram:
    """Read stretches as the control runs them: a rapid to the start of each, and what its blocks do.

    `line` is that of the program. InputError where the blocks are none that can be read.
    """
    head = _head(form, inch=stretches[0].run.state.unit != 1.0)
    parts, lines = [head], [np.zeros(head.count(b"\n"), np.int64)]
    modes = ["", *(stretch.run.state.groups["feed"] or "" for stretch in stretches)]
    for stretch, before in zip(stretches, modes, strict=False):
        start = _start(job, stretch.run, form, before)
        text = stretch.text if stretch.text.endswith(b"\n") else stretch.text + b"\n"
        parts += [start, text]
        first = np.full(start.count(b"\n"), -stretch.line, np.int64)
        lines += [first, stretch.line + np.arange(text.count(b"\n"))]
    nc, own = read_back(b"".join(parts), form, job.settings), np.concatenate(lines)
    nc.line[:] = own[nc.line - 1]
    problems = [replace(one, nc_line=int(own[one.nc_line - 1])) for one in nc.problems if own[one.nc_line - 1] > 0]
    return replace(nc, problems=tuple(problems), feed_in_plane=form.mode.feed_in_plane)


def program_of(nc: NcProgram, marks: bool = False) -> Program:
    """Tool path of stretches; a comment ``RUN`` before each where marks are wanted.

    CS503 where a block is no line, or where the stretches are not begun by rapids.
    """
    rapid = (nc.kind == Element.RAPID) | (nc.line < 0)
    lines = np.isin(nc.kind, (Element.RAPID, Element.LINE))
    if not rapid[:1].all() or not lines.all() or nc.second_is != "vector":
        raise InputError("CS503", "a block of a run is no line", "please report this with the program")
    starts = np.flatnonzero(np.diff(rapid, prepend=False) & rapid & marks).tolist()
    return Program.from_poses(
        nc.tip,
        nc.second,
        kind=np.where(rapid, Move.RAPID, Move.LINEAR).astype(np.uint8),
        feed=np.where(rapid, np.nan, nc.feed),
        line=np.abs(nc.line),
        statements=tuple(Statement(pose, 0, "PPRINT", ("RUN",), "RUN") for pose in starts),
        units=nc.units,
    )


def _head(form: Form, *, inch: bool) -> bytes:
    table = form.table
    units = table.layout.units["inch" if inch else "mm"]
    head = next((line for line in table.program.start if "{units}" in line), "{units}")
    lines = [head.replace("{units}", units).replace("{program}", "A")]
    lines += [block.replace("{offset}", "1") for block in form.mode.on]
    return "".join(f"{line}\n" for line in lines).encode()


def _start(job: Job, run: Run, form: Form, before: str) -> bytes:
    """Blocks that bring the machine to the start of a run and say what holds there; `before` is the feed mode."""
    state, words, mode = run.state, form.table.words.feed_mode, run.state.groups["feed"]
    lines = [_block(job, run, run.start, form, rapid=True)]
    if 2 in words and mode != before:
        lines.append(words[2 if mode == "inverse" else 0].encode())
    if state.groups.get("plane", PRESET) != PRESET and state.plane:  # that of arcs in its place
        lines.append(b"G%d" % state.plane)
    # one that is not known differs from all of the run: a first cut that leaves it out is found
    value = 2.0 * float(np.max(run.feeds)) if math.isnan(state.feed) else state.feed
    feed = b" F%.9f" % value if mode != "inverse" else b""
    if state.groups["motion"] == "line" or feed:  # a whole block, though nothing moves: it is read with those around it
        lines.append(_block(job, run, run.start, form, rapid=False) + feed)
    if state.groups["motion"] != "line":  # a first block that does not say that it cuts is a rapid
        lines.append(_block(job, run, run.start, form, rapid=True))
    return b"".join(line + b"\n" for line in lines)


def _block(job: Job, run: Run, place: Floats, form: Form, *, rapid: bool) -> bytes:
    look, axes, spelling = form.mode, job.reader.axes, job.spelling
    vector = axes[3:] == ("I", "J", "K")
    other = place[3:] / np.linalg.norm(place[3:]) if vector else place[3:]
    words = [*"XYZ", *(form.mode.words if vector else axes[3:])]
    digits = [max(spelling.tip, 1)] * 3 + [max(spelling.other, form.table.digits.vector if vector else 1)] * len(other)
    numbers = zip(words, [*place[:3].tolist(), *other.tolist()], digits, strict=True)
    text = " ".join(f"{word}{value:{'+' if look.signs else ''}.{places}f}" for word, value, places in numbers)
    return f"{look.rapid if rapid else look.line} {text}{look.rapid_end if rapid else ''}".encode()
