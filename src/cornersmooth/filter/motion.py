"""What a control does in runs: their bytes, after a head that says the state they begin in, read by `nc_reader`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.filter.runs import Run
from cornersmooth.filter.spelling import Spelling
from cornersmooth.filter.state import INVERSE_TIME
from cornersmooth.model import Floats, Move, Program, Statement
from cornersmooth.nc.form import Form
from cornersmooth.nc_reader import NcProgram, read_nc
from cornersmooth.nc_reader.elements import Element
from cornersmooth.pipeline import reading_back
from cornersmooth.settings import Settings


@dataclass(frozen=True)
class Stretch:
    """Blocks that stand for a run, in the program itself or in another."""

    run: Run  #: says the state before the blocks
    text: bytes  #: whole lines
    line: int  #: number of the first, from 1


def motion(stretches: Sequence[Stretch], form: Form, spelling: Spelling, settings: Settings) -> NcProgram:
    """Read stretches as the control runs them.

    Returns
    -------
    NcProgram
        A rapid to the start of each stretch, and what its blocks do; `line` is that of the program.

    Raises
    ------
    InputError
        The blocks are none that can be read.
    """
    inch = stretches[0].run.state.unit != 1.0
    parts, lines = [_head(form, inch=inch)], [np.zeros(1, np.int64)]
    lines[0] = np.zeros(parts[0].count(b"\n"), np.int64)
    modes = [0, *(stretch.run.state.feed_mode for stretch in stretches)]
    for stretch, before in zip(stretches, modes, strict=False):
        start = _start(stretch.run, form, spelling, before)
        text = stretch.text if stretch.text.endswith(b"\n") else stretch.text + b"\n"
        parts += [start, text]
        first = np.full(start.count(b"\n"), -stretch.line, np.int64)
        lines += [first, stretch.line + np.arange(text.count(b"\n"))]
    back = {name: value for name, value in reading_back(form).items() if name not in ("trusted", "accepted")}
    nc = read_nc(b"".join(parts), **back, tolerance=settings.tolerance, axis_length=settings.axis_scale)
    own = np.concatenate(lines)
    nc.line[:] = own[nc.line - 1]
    problems = [replace(one, nc_line=int(own[one.nc_line - 1])) for one in nc.problems if own[one.nc_line - 1] > 0]
    return replace(nc, problems=tuple(problems))


def program_of(nc: NcProgram, marks: bool = False) -> Program:
    """Tool path of stretches; a comment ``RUN`` before each where marks are wanted.

    Raises
    ------
    InputError
        CS503 where a block is no line, or where the stretches are not begun by rapids.
    """
    rapid = (nc.kind == Element.RAPID) | (nc.line < 0)
    if not rapid[:1].all() or not np.isin(nc.kind, (Element.RAPID, Element.LINE)).all():
        raise InputError("CS503", "a block of a run is no line", "please report this with the program")
    if nc.second_is != "vector":
        raise InputError("CS503", "a run in points of the tool axis", "please report this with the program")
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


def in_places(run: Run, form: Form, spelling: Spelling) -> bytes:
    """Blocks of a run that says distances (G91), in places and each with its feed of the run."""
    return b"".join(_block(place, run.state.axes, form, spelling, rapid=False) for place in run.place)


def _head(form: Form, *, inch: bool) -> bytes:
    table = form.table
    units = table.layout.units["inch" if inch else "mm"]
    head = next((line for line in table.program.start if "{units}" in line), "{units}")
    lines = [head.replace("{units}", units).replace("{program}", "A")]
    lines += [block.replace("{offset}", "1") for block in form.mode.on]
    return "".join(f"{line}\n" for line in lines).encode()


def _start(run: Run, form: Form, spelling: Spelling, before: int | None) -> bytes:
    """Blocks that bring the machine to the start of a run and say what holds there; `before` is the feed mode."""
    state, words = run.state, form.table.words.feed_mode
    lines = [_block(run.start, state.axes, form, spelling, rapid=True)]
    if 2 in words and state.feed_mode != before:
        lines.append(words[2 if state.feed_mode == INVERSE_TIME else 0].encode() + b"\n")
    feed = b" F%.5f" % state.feed if state.feed_mode != INVERSE_TIME and not math.isnan(state.feed) else b""
    if state.motion == 1.0 or feed:  # a whole block, though nothing moves: it is read with those around it
        lines.append(_block(run.start, state.axes, form, spelling, rapid=False).rstrip() + feed + b"\n")
    return b"".join(lines)


def _block(place: Floats, axes: Sequence[str], form: Form, spelling: Spelling, *, rapid: bool) -> bytes:
    """Block that goes to a place."""
    look, vector = form.mode.motion, axes[3:] == ("I", "J", "K")
    other = place[3:] / np.linalg.norm(place[3:]) if vector else place[3:]
    words = [*"XYZ", *(form.mode.words if vector else axes[3:])]
    digits = [max(spelling.tip, 1)] * 3 + [max(spelling.other, form.table.digits.vector if vector else 1)] * len(other)
    numbers = zip(words, [*place[:3].tolist(), *other.tolist()], digits, strict=True)
    text = " ".join(f"{word}{value:{'+' if look.signs else ''}.{places}f}" for word, value, places in numbers)
    return f"{look.rapid if rapid else look.line} {text}{look.rapid_end if rapid else ''}\n".encode()
