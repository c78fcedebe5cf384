"""A program as a filter reads it: runs of plain cuts whose state is surely known, and why other cuts are left."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.control.program import Stream, Text
from cornersmooth.control.rows import Rows
from cornersmooth.control.state import PRESET, State
from cornersmooth.control.table import table_of
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Floats
from cornersmooth.nc_reader.dialects import dialect_of
from cornersmooth.nc_reader.word_tables import CONTROLS

#: what a run asks of tool tip control: the words of its tool axis, none, or either of both
ANGLES, VECTOR, NONE, ANY = "angles", "vectors", "off", "any"

#: controls whose programs are read: the neutral form has no manual that says what words do
FILTERED: Final = tuple(control for control in CONTROLS if control != "generic")

#: how messages call the words of the tool axis
_TOLD: Final = {ANGLES: "rotary words", VECTOR: "tool vectors", "both": "rotary words and tool vectors"}

#: words of Siemens under which the tool axis runs as its words say, beside those that the control has by itself
_EVEN: Final = {VECTOR: ("ORIVECT", "ORIPLANE", "ORIWKS", PRESET), ANGLES: ("ORIAXES", "ORIMKS", PRESET)}

#: degrees that a rotary word may change by in a cut: from half a turn on controls do not agree on the way
_HALF_TURN: Final = 180.0

#: cuts of a run, at least: one alone has no corner
_LEAST: Final = 2

#: what `Reading.why` says of lines that are no cuts, and of plain cuts
_NO_CUT, _CUT = 0, 1

#: words beside an end that shape the corner there: it belongs to the blocks on both sides
_CORNER_WORDS: Final = re.compile(rb"(?i),\s*[RC]\s*[\d.]|\b(?:RNDM?|CHF|CHR|FRCM?)\b")


@dataclass(frozen=True)
class Run:
    """Plain cuts that follow one another, with c words of the axes (`State.axes`)."""

    first: int  #: first, stop: lines, from 0; the latter excluded
    stop: int
    state: State  #: before the first
    place: Floats  #: (n, c) words at the end of each cut, in units of the program
    feeds: Floats  #: (n,) as written

    def __len__(self) -> int:
        return self.stop - self.first

    @property
    def start(self) -> Floats:
        """(c,) where the machine is before the run."""
        return np.array([self.state.place[letter] for letter in self.state.axes])

    @property
    def places(self) -> Floats:
        """(n + 1, c) words at the start and at the end of each cut."""
        return np.concatenate((self.start[None], self.place))


@dataclass(frozen=True)
class Left:
    """Cuts that stay as they are."""

    reason: str
    line: int  #: the first of them, from 1
    count: int


@dataclass
class Reading(Text):
    """What was read."""

    runs: list[Run] = field(default_factory=list)
    #: (l,) for each line 0 where it is no cut, 1 for a plain cut, else 2 plus the number of the reason in `reasons`
    why: NDArray[np.uint16] = field(init=False)
    reasons: list[str] = field(default_factory=list)
    at: dict[int, State] = field(default_factory=dict)  #: before the lines that were asked for
    said: frozenset[str] = frozenset()  #: groups that the program has set (`State.said`)

    def __post_init__(self) -> None:
        self.why = np.zeros(len(self), np.uint16)

    def left(self) -> tuple[Left, ...]:
        """Why cuts are left, the most first."""
        found = Counter(self.why[self.why > _CUT].tolist())
        return tuple(Left(self.reasons[k - 2], int(np.argmax(self.why == k)) + 1, n) for k, n in found.most_common())

    @property
    def cuts(self) -> int:
        """Cuts, plain or not."""
        return int((self.why > _NO_CUT).sum())

    def number(self, reason: str) -> int:
        """Value of `why` for a reason."""
        if reason not in self.reasons:
            self.reasons.append(reason)
        return 2 + self.reasons.index(reason)


class ProgramReader:
    """Reads programs of one control and machine.

    `machine` is that of the rotary words; None for tool vectors. Without `tcp` X Y Z are the machine's own axes.
    `tip_from_start` says that tool tip control is on where the program begins, `inch` its units where it says none.
    """

    def __init__(
        self,
        control: str,
        machine: Machine | None,
        *,
        tcp: bool = True,
        tip_from_start: bool = False,
        inch: bool = False,
    ) -> None:
        names = ("I", "J", "K") if machine is None else machine.names
        self.axes = ("X", "Y", "Z", *names)
        self.wanted = NONE if not tcp else VECTOR if machine is None else ANGLES if names else ANY
        self.lexer = dialect_of(control, "" if machine is None else "".join(names)).lexer
        self._weak_feed = "F" in self.lexer.points  # in inches a feed without a point may count otherwise
        self.lexer.points = self.lexer.points - {"F"}
        self._first = State(table_of(control), self.axes)
        self._first.groups |= {"units": "inch"} if inch else {}
        self._first.groups |= {"tip": self.wanted} if tip_from_start else {}

    def stream(self, text: Text) -> Stream:
        """Read a program as a stream."""
        return Stream(text, self.lexer, self._first, weak_feed=self._weak_feed)

    def read(self, data: bytes, stops: Iterable[int] = ()) -> Reading:
        """Read a program, whatever it is; remember the state before some lines."""
        found = Reading(**vars(Text.of(data)))
        stream, asked, last = self.stream(found), sorted(set(stops), reverse=True), self._first
        corners = _near([number for number, line in stream.others if _CORNER_WORDS.search(line)], len(found))
        for item in stream:
            first, count = (item.first, len(item)) if isinstance(item, Rows) else (item.line, 1)
            if isinstance(item, Rows):
                self._take_rows(found, item, corners)
            elif item.cuts:
                found.why[first] = found.number(why_not(item.after, self.wanted) or item.cuts)
            while asked and asked[-1] < first + count:
                stop = asked.pop()
                found.at[stop] = item.after(stop - first) if isinstance(item, Rows) and stop > first else item.before
            last = item.after(count) if isinstance(item, Rows) else item.after
        found.at |= dict.fromkeys(asked, last)
        found.said = last.said
        return found

    def _take_rows(self, found: Reading, rows: Rows, corners: Bools) -> None:
        """Note the runs among motion blocks, and why others are left."""
        count, here = len(rows), slice(rows.first, rows.first + len(rows))
        arc = (rows.code == 2.0) | (rows.code == 3.0)
        cut, known, moved = (
            (rows.code == 1.0) & rows.moves,
            np.isfinite(rows.place),
            np.abs(np.diff(rows.place, axis=0)),
        )
        plain = cut & ~rows.lost & (known[1:] & known[:-1]).all(axis=1)
        why = np.where(cut, found.number("the place before or after it is not known"), _NO_CUT).astype(np.uint16)
        why[plain & ~np.isfinite(rows.feed)] = found.number("its feed is not known")
        plain &= np.isfinite(rows.feed) & (rows.feed > 0.0)
        left = np.zeros(count, np.bool_)
        wide = (moved[:, 3:] >= _HALF_TURN).any(axis=1) & (self.wanted != VECTOR)
        for some, reason in (
            (~(moved[:, :3] > 0.0).any(axis=1), "the tip stays where it is"),
            (wide, "a rotary axis turns by half a turn or more in it"),
            (corners[here], "the program rounds its corner by words of its own"),
        ):
            why[plain & some] = found.number(reason)
            left |= some
        plain &= ~left
        if (arc & (rows.moves | rows.odd)).any():
            why[arc] = found.number("an arc")
        if reason := why_not(rows.before, self.wanted):
            why[cut | arc] = found.number(reason)
            plain[:] = False
        edges = np.flatnonzero(np.diff(plain, prepend=False, append=False))
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if b - a < _LEAST:
                why[a:b] = found.number("a single cut between other blocks: it has no corner")
                continue
            why[a:b] = _CUT
            here, first = slice(a, b), rows.first
            found.runs.append(Run(first + a, first + b, rows.after(a), rows.place[a + 1 : b + 1], rows.feed[here]))
        found.why[rows.first : rows.first + count] = why


def why_not(state: State, wanted: str) -> str:
    """Say why cuts in a state are left as they are; empty where they need not be.

    `wanted` is the kind of tool tip control that must be on; `NONE` where it must be off, `ANY` for either.
    """
    groups, frames, tip = state.groups, state.frames, state.groups["tip"]
    if frames:
        return f"places of the part are turned, scaled or called by a macro ({', '.join(sorted(frames))})"
    if tip is None and wanted != ANY:
        return "it is not known whether tool tip control is on"
    if wanted == NONE and tip != NONE:
        return "tool tip control is on, and --no-tcp says that it is not"
    if wanted in (ANGLES, VECTOR) and tip not in (wanted, "both"):
        return (
            "tool tip control is off" + ": for rotary words name the machine" * (wanted == VECTOR)
            if tip == NONE
            else f"tool tip control is for {_TOLD[str(tip)]}, not for {_TOLD[wanted]}"
        )
    even = all(groups.get(group, PRESET) in _EVEN.get(wanted, ()) for group in ("orientation", "coordinates"))
    if not even and wanted in (ANGLES, VECTOR):
        return f"the control turns the tool by a law of its own between {_TOLD[wanted]}"
    if groups["compensation"] != "off":
        return "the radius of the cutter is taken account of, or that is not known"
    if None in (groups["distance"], groups["units"], groups["feed"]):
        return "units, distances (G90, G91) or the kind of feed are not known"
    if frames is None:
        return "it is not known whether places of the part are turned, scaled or called by a macro"
    return "feed per revolution (G95)" if groups["feed"] == "revolution" else ""


def _near(lines: Sequence[int], count: int) -> Bools:
    """(count,) whether a line, or the one before or after it, is one of some."""
    near, at = np.zeros(count + 2, np.bool_), np.array(lines, np.int64)
    for step in (0, 1, 2):
        near[at + step] = True
    return near[1:-1]
