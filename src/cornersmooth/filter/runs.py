"""A program as a filter reads it: runs of plain cuts whose state is surely known, and why other cuts are left."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.control.program import Stream, Text, line_of
from cornersmooth.control.state import Rows, State
from cornersmooth.control.table import CONTROLS, FRAME, UNKNOWN, table_of
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Floats
from cornersmooth.nc_reader.dialects import dialect_of

#: what a run asks of tool tip control: the words of its tool axis, none, or either of both
ANGLES, VECTOR, NONE, ANY = "angles", "vectors", "off", "any"

#: controls whose programs are read: the neutral form has no manual that says what words do
FILTERED: Final = tuple(control for control in CONTROLS if control != "generic")

#: how messages call the words of the tool axis
_TOLD: Final = {ANGLES: "rotary words", VECTOR: "tool vectors", "both": "rotary words and tool vectors"}

#: degrees that a rotary word may change by in a cut: from half a turn on controls do not agree on the way
_HALF_TURN: Final = 180.0

#: cuts of a run, at least: one alone has no corner
_LEAST: Final = 2

#: frames that change lengths, or call a macro for each block
_NOT_RIGID: Final = ("scale", "macro", "polar", "cylinder")

#: what must be known in a run: the groups, and how messages call them
_NEEDED: Final = {
    "tip": "whether tool tip control is on",
    "compensation": "compensation of the cutter (G40)",
    "distance": "G90 or G91",
    "units": "units",
    "feed": "the kind of feed (G94)",
}

#: bytes of a line that messages show
_SHOWN: Final = 40

#: a word that may name a linear axis
_NAMED: Final = {axis: re.compile(rb"(?i)(?<![A-Z])%b" % axis.encode()) for axis in "XYZ"}

#: a word that may turn an axis that a program of three axes has not, and what a cut that has it is left for
TURNS: Final = re.compile(rb"(?i)(?<![A-Z,])[ABC][ \t]*=?[ \t]*[-+]?[\d.]")
_TURNS: Final = "an axis turns in it: name the machine"

#: a value for a variable, and a word that begins with O in LinuxCNC
_VARIABLE: Final = re.compile(rb"(?i)[ \t]*(N?\d+[ \t]+)?(#(\d+|<[^>]*>)[ \t]*=|[RQ][LRS]?\d+[ \t]*=|FN ?\d|O[ \t]*<)")

#: what `Reading.why` says of lines that are no cuts, and of plain cuts
NO_CUT, PLAIN_CUT = 0, 1

#: words beside an end that shape the corner there: it belongs to the blocks on both sides
_CORNER_WORDS: Final = re.compile(rb"(?i),\s*[RC]\s*[\d.]|\b(?:RNDM?|CHF|CHR|FRCM?)\b")

#: the word that shapes all corners from there on (Siemens), and its end
_ALL_CORNERS: Final = re.compile(rb"(?i)\bRNDM[ \t]*=[ \t]*([0.]+(?![\d.]))?")


@dataclass(frozen=True)
class Run:
    """Plain cuts that follow one another, with c words of the axes (`State.axes`)."""

    first: int  #: first, stop: lines, from 0; the latter excluded
    stop: int
    state: State  #: before the first; beside those c axes it may have others, which stand still
    #: (n, c) words at the end of each cut, in units of the program; lines between that say a feed alone are no cuts
    place: Floats
    feeds: Floats  #: (n,) as written

    def __len__(self) -> int:
        return len(self.place)

    @property
    def lines(self) -> int:
        """Lines, cuts and others."""
        return self.stop - self.first

    @property
    def start(self) -> Floats:
        """(c,) where the machine is before the run."""
        return np.array([self.state.place[letter] for letter in self.state.axes[: self.place.shape[1]]])

    @property
    def end(self) -> dict[str, float]:
        """Place of each axis after the run, those that stand still included."""
        return self.state.place | dict(zip(self.state.axes, self.place[-1].tolist(), strict=False))

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
    at: dict[int, State] = field(default_factory=dict)  #: before the lines that were chosen
    said: frozenset[str] = frozenset()  #: groups that the program has set
    absent: tuple[str, ...] = ()  #: linear axes that the program never names
    blocks: bool = False  #: whether any block moves or sets anything

    def __post_init__(self) -> None:
        self.why = np.zeros(len(self), np.uint16)

    def left(self) -> tuple[Left, ...]:
        """Why cuts are left, the most first."""
        found = Counter(self.why[self.why > PLAIN_CUT].tolist())
        return tuple(Left(self.reasons[k - 2], int(np.argmax(self.why == k)) + 1, n) for k, n in found.most_common())

    @property
    def cuts(self) -> int:
        """Cuts, plain or not."""
        return int((self.why > NO_CUT).sum())

    def leave(self, run: Run, reason: str) -> None:
        """Say why the cuts of a run stay."""
        own = self.why[run.first : run.stop]
        own[own > NO_CUT] = self.number(reason)

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
        turning = ("A", "B", "C") if self.wanted == ANY else names
        self.lexer = copy(dialect_of(control, "" if machine is None else "".join(turning)).lexer)
        self._weak_feed = "F" in self.lexer.points  # in inches a feed without a point may count otherwise
        self.lexer.points = self.lexer.points - {"F"}
        self.lexer.places = self.lexer.places | {"F"}  # a feed in a line of its own ends no run
        self._first = State(table_of(control), ("X", "Y", "Z", *turning))
        self._first.groups |= {"units": "inch"} if inch else {}
        self._first.groups |= {"tip": self.wanted} if tip_from_start else {}

    @property
    def start(self) -> State:
        """What holds where a program begins."""
        return self._first.copy()

    def stream(self, text: Text) -> Stream:
        """Read a program as a stream."""
        return Stream(text, self.lexer, self._first, weak_feed=self._weak_feed)

    def read(self, data: bytes, stops: Iterable[int] = ()) -> Reading:
        """Read a program, whatever it is; remember the state before some lines."""
        found = Reading(**vars(Text.of(data)))
        found.absent = tuple(letter for letter, named in _NAMED.items() if named.search(data) is None)
        still: dict[str, float] = dict.fromkeys(found.absent if self.wanted == ANY else (), 0.0)
        stream, stops_left, last, cause = self.stream(found), sorted(set(stops), reverse=True), self._first, ""
        corners = _corners(stream.others, len(found))
        for item in stream:
            first, count = (item.first, len(item)) if isinstance(item, Rows) else (item.line, 1)
            if isinstance(item, Rows):
                self._take_rows(found, _with_places(item, still) if still else item, corners, cause)
            else:
                if {*self._unknown(item.after)} - {*self._unknown(item.before)}:
                    cause = " ".join(item.text.decode("latin-1").split())[:_SHOWN]
                if item.cuts:
                    reason = _TURNS if self.wanted == ANY and TURNS.search(item.text) else item.cuts
                    found.why[first] = found.number(self.why_not(item.after, cause) or reason)
            while stops_left and stops_left[-1] < first + count:
                stop = stops_left.pop()
                found.at[stop] = item.after(stop - first) if isinstance(item, Rows) and stop > first else item.before
            last = item.after(count) if isinstance(item, Rows) else item.after
        found.at |= dict.fromkeys(stops_left, last)
        found.at = {line: replace(state, place=state.place | still) for line, state in found.at.items()}
        found.said = frozenset(last.last_words)
        found.blocks = bool(found.said) or found.cuts > 0 or self._acts(stream)
        return found

    def _acts(self, stream: Stream) -> bool:
        """Whether any block has words that are known, or sets a variable."""
        if len(stream.others) < len(stream):  # a motion block
            return True
        for _, text in stream.others:
            line = line_of(text, self.lexer)
            rows = [] if line is None else self._first.rows(line.words)
            known = line is not None and bool(line.words) and all(row is not UNKNOWN for _, _, row in rows)
            if known or _VARIABLE.match(text):
                return True
        return False

    def _take_rows(self, found: Reading, rows: Rows, corners: Bools, cause: str) -> None:
        """Note the runs among motion blocks, and why others are left."""
        count, here = len(rows), slice(rows.first, rows.first + len(rows))
        arc = (rows.code == 2.0) | (rows.code == 3.0)
        place, others = rows.place[:, : len(self.axes)], rows.place[:, len(self.axes) :]
        cut, known, moved = (rows.code == 1.0) & rows.moves, np.isfinite(place), np.abs(np.diff(place, axis=0))
        plain = cut & ~rows.lost & (known[1:] & known[:-1]).all(axis=1)
        never = ": {0} is never given; say it before, as in G0 {0}0." if found.absent else ""
        unknown = found.number("the place before or after it is not known" + never.format(*found.absent))
        why = np.where(cut, unknown, NO_CUT).astype(np.uint16)
        why[plain & ~np.isfinite(rows.feed)] = found.number("its feed is not known")
        plain &= np.isfinite(rows.feed) & (rows.feed > 0.0)
        left = np.zeros(count, np.bool_)
        wide = (moved[:, 3:] >= _HALF_TURN).any(axis=1) & (self.wanted != VECTOR)
        for some, reason in (
            (~(moved[:, :3] > 0.0).any(axis=1), "the tip stays where it is"),
            (wide, "a rotary axis turns by half a turn or more in it"),
            (self._turning(found, rows, others), _TURNS),
            (corners[here], "the program rounds its corner by words of its own"),
        ):
            why[plain & some] = found.number(reason)
            left |= some
        plain &= ~left
        if (arc & (rows.moves | rows.odd)).any():
            why[arc] = found.number("an arc")
        if reason := self.why_not(rows.before, cause):
            why[cut | arc] = found.number(reason)
            plain[:] = False
        quiet = (rows.code == 1.0) & ~rows.moves & ~rows.odd  # a feed alone, and the like
        edges = np.flatnonzero(np.diff(_bridged(plain, quiet), prepend=False, append=False))
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            own, first = a + np.flatnonzero(plain[a:b]), rows.first
            if len(own) < _LEAST:
                why[own] = found.number("a single cut between other blocks: it has no corner")
                continue
            why[own] = PLAIN_CUT
            found.runs.append(Run(first + a, first + b, rows.after(a), place[own + 1], rows.feed[own]))
        found.why[rows.first : rows.first + count] = why

    def _turning(self, found: Reading, rows: Rows, others: Floats) -> Bools:
        """(r,) whether an axis that is none of a run moves in a block."""
        still = (others[1:] == others[:-1]) | (np.isnan(others[1:]) & np.isnan(others[:-1]))
        if others.size and rows.before.groups["distance"] != "absolute":  # a distance from an unknown place is one, too
            still &= TURNS.search(found.lines(rows.first, rows.first + len(rows))) is None
        return ~still.all(axis=1)

    def _unknown(self, state: State) -> list[str]:
        """What must be known in a run and is not, as messages call it."""
        needed = (name for name in _NEEDED if not (name == "tip" and self.wanted == ANY))
        unknown = [_NEEDED[name] for name in needed if state.groups[name] is None]
        frames = state.frames if self.wanted != ANY else _not_rigid(state)
        return unknown + ["planes, rotations and scales"] * (frames is None)

    def why_not(self, state: State, cause: str = "") -> str:
        """Say why cuts in a state are left as they are; empty where they need not be.

        `cause` is the line since which something is not known.
        """
        groups, tip, wanted = state.groups, state.groups["tip"], self.wanted
        frames = state.frames if wanted != ANY else _not_rigid(state)
        if frames:
            return f"places of the part are turned, scaled or called by a macro ({', '.join(sorted(frames))})"
        if unknown := self._unknown(state):
            return f"not known, and not said again{f' since {cause!r}' if cause else ''}: {', '.join(unknown)}"
        if wanted == NONE and tip != NONE:
            return "tool tip control is on, and --no-tcp says that it is not"
        if wanted in (ANGLES, VECTOR) and tip not in (wanted, "both"):
            return (
                "tool tip control is off" + ": for rotary words name the machine" * (wanted == VECTOR)
                if tip == NONE
                else f"tool tip control is for {_TOLD[str(tip)]}, not for {_TOLD[wanted]}"
            )
        if wanted in (ANGLES, VECTOR) and state.tip_suits(wanted) is False:
            return f"the control turns the tool by a law of its own between {_TOLD[wanted]}"
        if groups["compensation"] != "OFF":
            return "the radius of the cutter is taken account of"
        return "feed per revolution (G95)" if groups["feed"] == "revolution" else ""


def _with_places(rows: Rows, still: dict[str, float]) -> Rows:
    """Motion blocks under which some axes stand still."""
    place = rows.place.copy()
    place[:, [rows.before.axes.index(letter) for letter in still]] = list(still.values())
    return replace(rows, before=replace(rows.before, place=rows.before.place | still), place=place)


def _bridged(plain: Bools, quiet: Bools) -> Bools:
    """Plain rows, and quiet ones between them."""
    index = np.arange(len(plain))
    other = ~(plain | quiet)
    last = np.maximum.accumulate(np.where(plain, index, -1))
    broken = np.maximum.accumulate(np.where(other, index, -1))
    following = np.minimum.accumulate(np.where(plain, index, len(plain))[::-1])[::-1]
    breaks = np.minimum.accumulate(np.where(other, index, len(plain))[::-1])[::-1]
    return plain | (quiet & (last > broken) & (following < breaks))


def _not_rigid(state: State) -> tuple[str, ...] | None:
    """Words under which lengths of the part are not those of the program, as in `State.frames`.

    All other frames turn, mirror and shift, and so do axes that the machine has not: a run keeps its shape under them.
    """
    values = [state.groups.get(f"{FRAME}{name}", "off") for name in _NOT_RIGID]
    on = tuple(value for value in values if value not in (None, "off"))
    return None if None in values and not on else on


def _corners(lines: Sequence[tuple[int, bytes]], count: int) -> Bools:
    """(count,) whether a line, or the one before or after it, shapes corners by words, and all under RNDM."""
    near, modal = np.zeros(count + 2, np.bool_), np.zeros(count, np.bool_)
    for number, line in lines:
        if _CORNER_WORDS.search(line):
            near[number : number + 3] = True
        if found := _ALL_CORNERS.search(line):
            modal[number:] = found[1] is None
    return near[1:-1] | modal
