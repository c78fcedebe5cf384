"""A program as a filter reads it: runs of plain cuts whose state is surely known, and why other cuts are left."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.filter.state import ANGLES, ANY, INVERSE_TIME, NONE, VECTOR, VOCABULARIES, State
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.block_tables import CHUNK
from cornersmooth.nc_reader.dialects import dialect_of
from cornersmooth.nc_reader.line_patterns import LinePatterns, Lines

#: degrees that a rotary word may change by in a cut: from half a turn on controls do not agree on the way
_HALF_TURN: Final = 180.0

#: cuts of a run, at least: one alone has no corner
_LEAST: Final = 2

#: what `Reading.why` says of lines that are no cuts, and of plain cuts
_NO_CUT, _CUT = 0, 1

#: lines before the first block: they name the program
_TITLE: Final = re.compile(r"(?i)(%.*|[O:]\s*(\d+|<[^>]*>|[A-Z][^#\[(]*))")
_WEAK_FEED: Final = re.compile(rb"(?i)F[ \t]*\d+(?![\d.])")
_MARK: Final = b"\xef\xbb\xbf"

#: words beside an end that shape the corner there: it belongs to the blocks on both sides
_CORNER_WORDS: Final = re.compile(rb"(?i),\s*[RC]\s*[\d.]|\b(?:RNDM?|CHF|CHR|FRCM?)\b")

#: what sends a control to other lines of the program; numbers of lines beside it, and a jump to a line that the
#: program works out
_JUMPS: Final = re.compile(
    rb"(?i)(?:GOTO[BFCS]?|M[ \t]*0*(?:9[6-9]|198)(?!\d)|G[ \t]*0*6[56]|THEN|REPEATB?|CALL|UNTIL)[^\n]*"
)
_TARGET: Final = re.compile(rb"(?i)(?:GOTO[BFCS]?|REPEATB?|LBL|(?<![A-Z])[NPQ])\s*(\d{1,9})")
_COMPUTED: Final = re.compile(rb"(?i)GOTO[BFCS]?\s*[^\d\s]|M[ \t]*0*9[6-9][^\n]*P\s*[#\[]")


@dataclass(frozen=True)
class Run:
    """Plain cuts that follow one another, with c words of the axes (`State.axes`)."""

    first: int  #: first, stop: lines, from 0; the latter excluded
    stop: int
    state: State  #: before the first
    #: (n, c) words at the end of each cut, in units of the program: all cuts where the program says distances (G91),
    #: else the last one only
    place: Floats
    low: Floats  #: low, high: (c,) least and largest of them, start included
    high: Floats
    feed: float  #: as written, of the last

    def __len__(self) -> int:
        return self.stop - self.first

    @property
    def start(self) -> Floats:
        """(c,) where the machine is before the run."""
        return np.array([self.state.place[letter] for letter in self.state.axes])


@dataclass(frozen=True)
class Left:
    """Cuts that stay as they are."""

    reason: str
    line: int  #: the first of them, from 1
    count: int


@dataclass
class Reading:
    """What was read."""

    data: bytes
    start: Ints  #: (l + 1,) first byte of each line, and the end
    state: State  #: at the end
    runs: list[Run] = field(default_factory=list)
    #: (l,) for each line 0 where it is no cut, 1 for a plain cut, else 2 plus the number of the reason in `reasons`
    why: NDArray[np.uint16] = field(init=False)
    reasons: list[str] = field(default_factory=list)
    at: dict[int, State] = field(default_factory=dict)  #: before the lines that were asked for

    def __post_init__(self) -> None:
        self.why = np.zeros(len(self.start) - 1, np.uint16)

    def lines(self, first: int, stop: int) -> bytes:
        """Bytes of lines that follow one another."""
        return self.data[int(self.start[first]) : int(self.start[stop])]

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
        self._first = State(VOCABULARIES[control], self.axes, unit=25.4 if inch else 1.0)
        if tip_from_start:
            self._first.tip = self.wanted

    def read(self, data: bytes, stops: Iterable[int] = ()) -> Reading:
        """Read a program, whatever it is; remember the state before some lines."""
        start = np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n")) + 1
        start = np.concatenate(([0], start, [] if data.endswith(b"\n") else [len(data)])).astype(np.int64)
        found, asked, started = Reading(data, start, self._first.copy()), sorted(set(stops)), False
        chunks = list(self._chunks(found))
        others = [(first + k, lines.line(k)) for first, lines, bulk in chunks for k in np.flatnonzero(~bulk).tolist()]
        targets = _targets(found, [line for _, line in others])
        corners = _near([number for number, line in others if _CORNER_WORDS.search(line)], len(found.why))
        for first, lines, bulk in chunks:
            bulk[[number - first for number in targets if first <= number < first + len(bulk)]] = False
            columns = lines.columns(np.flatnonzero(bulk)) if bulk.any() else {}
            before = np.concatenate(([0], np.cumsum(bulk)))
            for a, b in pairwise(np.flatnonzero(np.diff(bulk, prepend=~bulk[0], append=~bulk[-1])).tolist()):
                if bulk[a]:
                    started, own = True, slice(before[a], before[b])
                    self._take_rows(found, first + a, {key: one[own] for key, one in columns.items()}, corners, asked)
                    continue
                for k in range(a, b):
                    line, number = lines.line(k), first + k
                    block = self.lexer.comment.sub("", line.decode("latin-1")).strip()
                    if block and (started or not _TITLE.fullmatch(block)):
                        started = True
                        self._take_line(found, number, line, known=number not in targets)
                    found.at |= {stop: found.state.copy() for stop in _within(asked, number, number + 1)}
        return found

    def _chunks(self, found: Reading) -> Iterator[tuple[int, Lines, Bools]]:
        """Lines from a number on, and which of them are plain motion blocks: these have no words of other kinds."""
        patterns, first = LinePatterns(self.lexer), _begin(found)
        while first < len(found.why):
            stop = int(np.searchsorted(found.start, found.start[first] + CHUNK))
            stop = min(max(stop, first + 1), len(found.why))
            while stop < len(found.why) and found.lines(stop - 1, stop).rstrip().endswith(b"~"):
                stop += 1
            chunk = found.lines(first, stop).removeprefix(_MARK if first == 0 else b"")
            chunk = chunk if chunk.endswith(b"\n") else chunk + b"\n"
            lines = Lines.of(self.lexer.unfolded(chunk), patterns)
            bulk = lines.bulk().copy()
            if b"~" in chunk:
                bulk[[k for k in range(stop - first) if b"~" in found.lines(first + k, first + k + 1)]] = False
            yield first, lines, bulk
            first = stop

    def _take_line(self, found: Reading, number: int, text: bytes, *, known: bool) -> None:
        if not known:  # who jumps here may come from anywhere
            found.state.lose_all()
        why = found.state.take(text, self.lexer)
        if why:
            found.why[number] = found.number(found.state.why_not(self.wanted) or why)

    def _take_rows(
        self, found: Reading, first: int, columns: dict[str, Floats], corners: Bools, asked: list[int]
    ) -> None:
        """Take motion blocks; note the runs among them."""
        state, count = found.state, len(next(iter(columns.values())))
        blank, here = np.full(count, np.nan), slice(first, first + count)
        code, _ = _filled(columns.get("G", blank), state.motion)
        feed, _ = _filled(columns.get("F", blank), state.feed)
        if state.feed_mode == INVERSE_TIME:
            feed = columns.get("F", blank)
        elif self._weak_feed and state.unit != 1.0 and _WEAK_FEED.search(found.lines(first, first + count)):
            feed = blank
        arc = (code == 2.0) | (code == 3.0)
        odd = np.zeros(count, np.bool_)
        for name in columns.keys() - {"G", "F", *self.axes}:
            odd |= ~np.isnan(columns[name])
        lost = (odd & ~arc) | ~(arc | (code == 0.0) | (code == 1.0))
        if self.wanted == VECTOR:  # what missing words of a vector are is not known
            given = np.sum([~np.isnan(columns.get(letter, blank)) for letter in "IJK"], axis=0)
            lost |= ~arc & (given > 0) & (given < 3)
        place, said = np.empty((count + 1, len(self.axes))), np.zeros(count, np.bool_)
        for k, letter in enumerate(self.axes):
            words = columns.get(letter, blank)
            words = np.where(arc, np.nan, words) if letter in "IJK" else words
            said |= ~np.isnan(words)
            place[0, k] = state.place[letter]
            place[1:, k] = self._places(words, state, letter, lost)
        cut, known, moved = (code == 1.0) & said, np.isfinite(place), np.abs(np.diff(place, axis=0))
        plain = cut & ~lost & (known[1:] & known[:-1]).all(axis=1)
        why = np.where(cut, found.number("the place before or after it is not known"), _NO_CUT).astype(np.uint16)
        why[plain & ~np.isfinite(feed)] = found.number("its feed is not known")
        plain &= np.isfinite(feed) & (feed > 0.0)
        left = np.zeros(count, np.bool_)
        wide = (moved[:, 3:] >= _HALF_TURN).any(axis=1) & (self.wanted != VECTOR)
        for rows, reason in (
            (~(moved[:, :3] > 0.0).any(axis=1), "the tip stays where it is"),
            (wide, "a rotary axis turns by half a turn or more in it"),
            (corners[here], "the program rounds its corner by words of its own"),
        ):
            why[plain & rows] = found.number(reason)
            left |= rows
        plain &= ~left
        if (arc & (said | odd)).any():
            why[arc] = found.number("an arc")
        if reason := state.why_not(self.wanted):
            why[cut | arc] = found.number(reason)
            plain[:] = False

        def after(k: int) -> State:
            return state.after(place[k], code[k - 1], feed[k - 1]) if k else state.copy()

        edges = np.flatnonzero(np.diff(plain, prepend=False, append=False))
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if b - a < _LEAST:
                why[a:b] = found.number("a single cut between other blocks: it has no corner")
                continue
            why[a:b] = _CUT
            own, last = place[a : b + 1], float(feed[b - 1])
            kept = own[1:] if not state.absolute else own[-1:]
            found.runs.append(Run(first + a, first + b, after(a), kept.copy(), own.min(axis=0), own.max(axis=0), last))
        found.why[here] = why
        found.at |= {stop: after(stop - first) for stop in _within(asked, first, first + count)}
        found.state = after(count)

    def _places(self, words: Floats, state: State, letter: str, lost: Bools) -> Floats:
        """(n,) where an axis is after each block."""
        if state.absolute is None:
            lost = lost | ~np.isnan(words)
        if state.absolute is False and letter not in "IJK":
            known = np.where(np.logical_or.accumulate(lost), np.nan, 0.0)
            return state.place[letter] + np.cumsum(np.nan_to_num(words)) + known
        value, last = _filled(np.where(lost, np.nan, words), state.place[letter])
        gone = np.maximum.accumulate(np.where(lost, np.arange(len(words)), -1))
        return np.where((gone >= 0) & (gone >= last), np.nan, value)


def _within(ascending: list[int], after: int, last: int) -> list[int]:
    """Numbers above one bound and up to another."""
    return ascending[bisect_right(ascending, after) : bisect_right(ascending, last)]


def _filled(values: Floats, before: float) -> tuple[Floats, Ints]:
    """Give what was said last in each row, and in which row, -1 for before."""
    last = np.maximum.accumulate(np.where(np.isnan(values), -1, np.arange(len(values))))
    return np.where(last < 0, before, values[last]), last


def _near(lines: Sequence[int], count: int) -> Bools:
    """(count,) whether a line, or the one before or after it, is one of some."""
    near, at = np.zeros(count + 2, np.bool_), np.array(lines, np.int64)
    for step in (0, 1, 2):
        near[at + step] = True
    return near[1:-1]


def _targets(found: Reading, others: Sequence[bytes]) -> set[int]:
    """Lines to which the program may jump: those of all numbers that stand beside jumps in some lines."""
    jumps = [match[0] for match in map(_JUMPS.search, others) if match]
    if not jumps:
        return set()
    numbers = {int(word) for jump in jumps for word in _TARGET.findall(jump)}
    if _COMPUTED.search(b"\n".join(jumps)):
        pattern = re.compile(rb"(?im)^[ \t/]*N[ \t]*\d+")
    else:
        some = b"|".join(b"0*%d" % number for number in sorted(numbers)) or rb"(?!)"
        pattern = re.compile(rb"(?im)^[ \t/]*N[ \t]*(?:%b)(?!\d)" % some)
    at = [match.start() for match in pattern.finditer(found.data)]
    return set((np.searchsorted(found.start, np.array(at, np.int64), side="right") - 1).tolist())


def _begin(found: Reading) -> int:
    """Line from which on the program is executed: that of the first ``%``, if a listing stands before it."""
    for match in re.finditer(rb"(?m)^[ \t]*%[ \t]*\r?$", found.data):
        before, behind = found.data[: match.start()], found.data[match.end() :]
        if behind.strip() and not re.search(rb"(?i)\bM(?:0?2|30)\b|^[ \t]*(?:N\d+[ \t]*)?G\d", before, re.MULTILINE):
            return int(np.searchsorted(found.start, match.start(), side="right")) - 1
        break
    return 0
