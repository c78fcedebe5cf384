"""Verification of a program against a program: all outside of runs byte for byte, and runs by what a control does."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.arrays import norm, unit
from cornersmooth.control.source import CHUNK
from cornersmooth.control.state import VECTOR, State
from cornersmooth.control.table import UNKNOWN, Row
from cornersmooth.control.words import Word
from cornersmooth.errors import CornersmoothError, InputError
from cornersmooth.filter.motion import Job, Stretch, motion, motion_of_runs, program_of, says_motion
from cornersmooth.filter.runs import PLAIN_CUT, ProgramReader, Reading, Run
from cornersmooth.model import Program
from cornersmooth.nc_reader import NcProgram, Problem
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.rotary import LINE_SHARE
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification, verify

#: what a line, or a part of it that may have a line of its own, says: its words, in order
Meaning = tuple[tuple[str, str], ...]

#: comments that a control acts on (LinuxCNC: DEBUG, PROBEOPEN, LOG, PY, ABORT); MSG is shown
_ACTING: Final = re.compile(r"\s*((?!MSG)[A-Za-z]+\s*,|PROBE|LOG)", re.IGNORECASE)

#: effects that hang on the other words of a block
_TOGETHER: Final = frozenset(("place", "turn", "machine", "shift", "dwell", "anything", "unknown"))

#: words that may jump or call
_JUMPS: Final = re.compile(r"GOTO|REPEAT|(?<!TOOL )CALL|\bM0*9[6-9]|\bM198|\bG0*6[56]\b|\bG7[0-3]\b.*P")

#: what the words that end a program say
_END: Final = "end"

#: groups that blocks of a run may set
_OF_MOTION: Final = frozenset(("motion", "distance", "feed", "plane", "path"))

#: numbers that are the same, and parts of directions, in six digits
_SAME, _SAME_DIRECTION = 1e-9, 2e-6

#: of the tolerance, where a program has rotary words: they are read as lines, which may be off by a part of it before
#: and after; `verify` takes off that of the new program
_SHARE: Final = (1.0 - 2.0 * LINE_SHARE) / (1.0 - LINE_SHARE)

#: blocks that a control has read ahead, at least: so many have to come in time
_BUFFER: Final = 20

#: a block by which LinuxCNC rounds corners within a distance, which the verdict adds to ε
_BOUNDED: Final = re.compile(rb"(?i)\s*(?:N\d+\s*)?G64\s*P\s*\d*\.?\d+(?:\s*Q\s*\d*\.?\d+)?\s*")

#: the last block of a run in distances: the word that says distances again after it
_DISTANCES: Final = re.compile(rb"G91(?=[ \t]*\r?\n?\Z)")


@dataclass(frozen=True)
class Place:
    """Where a run of the old program is in the new one."""

    run: Run
    first: int  #: first, stop: lines of the new program, from 0; the latter excluded
    stop: int


@dataclass(frozen=True)
class Checked:
    """What was found."""

    wrong: tuple[Problem, ...]
    tip: float = 0.0  #: tip, axis_point: largest deviation, mm
    axis_point: float = 0.0  #: NaN where the tool axis has a tolerance of its own
    blocks: int = 0  #: new blocks, and those of them before which so many come too fast for the control
    short: int = 0


def places(old: Reading, new: Reading, reader: ProgramReader) -> tuple[list[Place], list[Problem]]:
    """Find the runs of a program in another one, between lines that must say the same; within them all is motion."""
    meanings = Meanings.of(reader, old)
    firsts, stops = [run.first for run in old.runs], [run.stop for run in old.runs]
    found: list[Place] = []
    at = 0
    for k, lines in enumerate(map(range, [0, *stops], [*firsts, len(old)])):
        begin, stop, wrong = _found(old, new, meanings, lines, at, last=k == len(firsts))
        if wrong is not None:
            return found, [wrong]
        if k and new.lines(at, begin) != old.lines(firsts[k - 1], stops[k - 1]):
            found.append(Place(old.runs[k - 1], at, begin))
            others = np.flatnonzero(new.why[at:begin] != PLAIN_CUT) + at
            texts = ((line, new.lines(line, line + 1)) for line in others.tolist())
            more = [line for line, text in texts if not (meanings.is_motion(text) or _BOUNDED.fullmatch(text))]
            if more:
                return found, [_changed(more[0], "within a run the program does more than to move")]
        at = stop
    return found, []


def _found(
    old: Reading, new: Reading, meanings: Meanings, lines: range, at: int, *, last: bool
) -> tuple[int, int, Problem | None]:
    """Where the new program says, from a line on, what lines of the old one say: at its begin, its end, or between."""
    text, first = old.lines(lines.start, lines.stop), lines.start == 0
    begin = len(new.data) - len(text) if last else 0 if first else new.data.find(text, int(new.start[at]))
    while not last and begin > 0 and new.data[begin - 1 : begin] != b"\n":
        begin = new.data.find(text, begin + 1)
    if begin >= new.start[at] and new.data.startswith(text, begin) and (text or first or last):
        line = int(np.searchsorted(new.start, begin))
        if new.start[line] == begin and (line == 0 or not first):
            return line, line + len(lines), None
    wanted = [(line, one) for line in lines for one in meanings.of_line(old.lines(line, line + 1))]
    # plain cuts are looked at only where the first line is one
    cut = bool(wanted) and old.why[wanted[0][0]] == PLAIN_CUT
    best = (0, at)
    for k in [0] if first else [k for k in range(at, len(new)) if wanted and (cut or new.why[k] != PLAIN_CUT)]:
        stop, count = k, 0
        while stop < len(new) and count < len(wanted):
            stated = meanings.of_line(new.lines(stop, stop + 1))
            if not (stated or first or count):
                break
            if stated != [one for _, one in wanted[count : count + len(stated)]]:
                again = count and len(stated) == 1 and stated[0] == wanted[count - 1][1]
                if not (again and meanings.holds_on(stated[0])):
                    break
                stated = []
            count, stop = count + len(stated), stop + 1
        more = (j for j in range(stop, len(new)) if last and meanings.of_line(new.lines(j, j + 1)))
        if count == len(wanted) and (left := next(more, None)) is None:
            return k, stop, None
        if count == len(wanted) and first:
            return 0, 0, _changed(left or 0, "there is more than in the old program")
        best = max(best, (count, stop))
    if first or 0 < best[0] < len(wanted):
        what = f"line {wanted[best[0]][0] + 1} of the old program, outside of runs, is another one"
        return 0, 0, _changed(best[1], what)
    return 0, 0, _changed(at, f"the lines after line {lines.start} of the old program are not there")


def _changed(line: int, text: str) -> Problem:
    return Problem("CS591", 0, line + 1, text)


def check(job: Job, old: Reading, new: Reading, where: Sequence[Place]) -> Checked:
    """Measure the runs that have changed, and compare what holds after each."""
    wrong: list[Problem] = []
    share = _SHARE if set("ABC") & set(job.reader.axes) else 1.0
    largest, counts = [0.0, 0.0], np.zeros(2, np.int64)
    for place in where:
        following = old.lines(place.run.stop, place.run.stop + 1)
        text = _left_otherwise(job, place.run, new.at[place.stop], following)
        if text:
            wrong.append(Problem("CS592", 0, place.stop, f"the program goes on otherwise after the run: {text}"))
    for own in shared(old, new, where):
        try:
            motions = pair(job, old, new, own)
            found = measure(*motions, job.settings, share=share, processes=job.processes)[2]
        except CornersmoothError as error:
            wrong.append(Problem(error.code, 0, own[0].first + 1, error.what))
            continue
        wrong += [
            replace(one, nc_line=abs(one.nc_line), text=one.text.replace("CL file", "old program"))
            for one in found.problems
        ]
        if found.unverified:
            text = f"the run was not verified: {found.unverified}"
            wrong += [Problem("CS593", 0, place.first + 1, text) for place in own]
        counts += _counts(job, motions[1])
        largest = np.maximum(largest, (found.tip.value, found.axis_point.value)).tolist()  # NaN stays
    blocks, short = counts.tolist()
    return Checked(tuple(sorted(wrong, key=lambda one: one.nc_line)), largest[0], largest[1], blocks, short)


def block_time(job: Job) -> float:
    """Time that the control takes for a block, s; 0 for none."""
    own = job.settings.block_time
    return job.form.table.lines.block_time if own is None else own


def _counts(job: Job, nc: NcProgram) -> tuple[int, int]:
    """Blocks of a motion that cut, and those of them behind which the control's buffer runs empty."""
    cut = np.flatnonzero((nc.line[1:] > 0) & (nc.kind[1:] != Element.RAPID)) + 1
    seconds = 60.0 * norm(nc.tip[cut] - nc.tip[cut - 1]) / nc.feed[cut]
    taken = np.bincount(np.unique(nc.line[cut], return_inverse=True)[1], seconds)
    ends = np.concatenate(([0.0], np.cumsum(taken)))
    return len(taken), int((ends[_BUFFER:] - ends[:-_BUFFER] < _BUFFER * block_time(job)).sum())


def shared(old: Reading, new: Reading, where: Sequence[Place]) -> list[list[Place]]:
    """Share out places by the bytes that they have, so that memory is bounded, and by their units."""
    size = [
        new.start[place.stop] - new.start[place.first] + old.start[place.run.stop] - old.start[place.run.first]
        for place in where
    ]
    found: dict[tuple[int, float], list[Place]] = {}
    for end, place in zip(np.cumsum(size), where, strict=True):
        found.setdefault((int(end) // CHUNK, place.run.state.unit), []).append(place)
    return list(found.values())


def pair(job: Job, old: Reading, new: Reading, where: Sequence[Place]) -> tuple[NcProgram, NcProgram]:
    """Give the motion of runs with the same units, before and after."""
    return motion_of(job, old, old, where), motion_of(job, old, new, where)


def motion_of(job: Job, old: Reading, reading: Reading, where: Sequence[Place]) -> NcProgram:
    """Give the motion of runs with the same units, in their program or in another one."""
    if reading is old:
        return motion_of_runs(job, old, [place.run for place in where])
    texts = (_DISTANCES.sub(b"", reading.lines(place.first, place.stop)) for place in where)
    return motion(job, [Stretch(p.run, text, p.first + 1) for p, text in zip(where, texts, strict=True)], job.form)


def measure(
    before: NcProgram, after: NcProgram, settings: Settings, name: str = "", *, share: float = 1.0, processes: int = 1
) -> tuple[Program, NcProgram, Verification]:
    """Measure runs with the same units within a share of the tolerance.

    Gives the path they had, what they are now, and what verification finds.
    """
    program, own_axis = program_of(before), settings.axis_tolerance
    program = replace(program, source=replace(program.source, name=name, dialect="NC"))
    found = verify(
        program,
        after,
        tolerance=share * settings.tolerance,
        axis_length=settings.axis_length,
        axis_tolerance=None if own_axis is None else share * own_axis,
        words=False,
        processes=processes,
    )
    return program, after, found


def _left_otherwise(job: Job, run: Run, state: State, following: bytes) -> str:
    """Say what holds after the blocks of a run that does not after the run; empty where all is the same.

    The kind of motion may be another one where the line behind says its own, or every line does.
    """
    there, wanted = np.array(list(state.place.values())), np.array(list(run.end.values()))
    room = np.full(len(there), _SAME)
    if VECTOR.issubset(state.place):  # only the direction counts, in its printed digits
        there[3:], wanted[3:], room[3:] = unit(there[3:]), unit(wanted[3:]), _SAME_DIRECTION
    if not np.isclose(there, wanted, rtol=0.0, atol=room, equal_nan=True).all():
        return f"the run ends at {_told(state.place)}, not at {_told(run.end)}"
    wanted_groups = run.state.groups | {"motion": "line"}
    if says_motion(following) or "code" not in job.form.mode.modal:
        del wanted_groups["motion"]
    if state.plane == run.state.plane != 0:
        wanted_groups.pop("plane", None)
    if other := [name for name, value in wanted_groups.items() if state.groups[name] != value]:
        return f"{', '.join(other)} is another one after the run"
    if run.state.groups["feed"] == "minute" and not math.isclose(state.feed, run.feeds[-1], rel_tol=1e-9):
        return f"the feed after the run is {state.feed:g}, not {run.feeds[-1]:g}"
    return ""


def _acts_alone(row: Row) -> bool:
    """Whether a word does the same in a block of its own."""
    return row.listed and row.must is row.next is None and (row.changes_tool or _TOGETHER.isdisjoint(row.does))


def _told(place: Mapping[str, float]) -> str:
    return " ".join(f"{axis}{value:g}" for axis, value in place.items() if not math.isnan(value))


@dataclass
class Meanings:
    """Reads lines of a program by what they say, whatever their spelling.

    Block numbers, blanks, comments, leading zeros and the order of words in a block are no difference. Words that act
    alone may have blocks of their own. Numbers of blocks count where the program may jump to them.
    """

    reader: ProgramReader
    state: State
    numbers: bool  #: whether numbers of blocks count

    @classmethod
    def of(cls, reader: ProgramReader, program: Reading) -> Meanings:
        """Make it for a program and those that are compared with it."""
        stream = reader.stream(program)
        plain = (reader.lexer.comment.sub(" ", line.decode("latin-1").upper()) for _, line in stream.others)
        return cls(reader, reader.start, any(_JUMPS.search(line) for line in plain))

    def of_line(self, text: bytes) -> list[Meaning]:
        """What a line says, in parts that may have lines of their own; empty for nothing."""
        lexer = self.reader.lexer
        try:
            line = lexer.line(text, 0, None)
        except InputError:
            plain = lexer.comment.sub(" ", text.decode("latin-1").upper())
            plain = plain if self.numbers else re.sub(r"^\s*N\d+\s*", "", plain)
            return [(("line", " ".join(plain.split())),)] if plain.strip() else []
        words = sorted(map(self._of_word, line.words), key=lambda word: ("GTSM".find(word[0]), word))
        more = [("comment", one) for one in line.comments if _ACTING.match(one)]
        more += [("skipped", "")] * line.skipped + [("tape", "")] * line.tape
        more += [("N", f"{number.value:g}")] if (number := line.block_number) and self.numbers else []
        if not more and len(rows := self.state.rows(line.words)) == len(words):
            if all(name == "MSG" for _, name, _ in rows):  # it is shown
                return []
            if all(word.name in "GTSM" and _acts_alone(row) for word, _, row in rows):
                return [(word,) for word in words]
        return [(*words, *more)] if words or more else []

    def holds_on(self, meaning: Meaning) -> bool:
        """Whether a block that is one word may come twice: it sets a state, but for feed modes, which may end F."""
        name, value = meaning[0]
        row = self.state.table.row(f"{name}{float(value):g}") if name in ("G", "M") and value != _END else UNKNOWN
        return bool(row.sets) and not row.does and row.group != "feed"

    def _of_word(self, word: Word) -> tuple[str, str]:
        if len(word.name) > 1:
            return word.name, re.sub(r"\s+", "", word.text.upper())
        if self.state.table.means.get(word.spelling, ("",))[0] == _END:
            return word.name, _END
        return word.name, f"{word.value!r}{' without point' * self.reader.lexer.without_point(word)}"

    def is_motion(self, text: bytes) -> bool:
        """Whether a line has words of motion and feed alone."""
        try:
            line = self.reader.lexer.line(text, 0, None)
        except InputError:
            return not self.of_line(text)
        if line.skipped or line.tape or any(_ACTING.match(one) for one in line.comments):
            return False
        rows = self.state.rows(line.words)
        beside = frozenset[str]().union(*(row.beside for _, _, row in rows), *self.state.table.arguments.values())
        return all(
            (bool(row.sets) and not row.does and {group for group, _ in row.sets} <= _OF_MOTION) or name in beside
            for _, name, row in rows
        )
