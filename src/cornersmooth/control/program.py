"""A whole program as a stream: runs of motion blocks, and other lines one by one, each with the state around it.

Lines that no lexer knows have variables, jumps, or paths of a kind that is not known.

`listing` is the stream as text: what the control does in each line, and what it remembers behind it: ``line  block
effects``. Effects are groups with their new values, places and the feed; ``?`` stands for what is not known from there
on. A motion has the place where it ends in full.
"""

from __future__ import annotations

import math
import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.control.line_patterns import LinePatterns, Lines
from cornersmooth.control.state import CUTS, Rows, State, execute_rows
from cornersmooth.control.table import FRAME, UNKNOWN
from cornersmooth.control.words import Lexer, Line, Word
from cornersmooth.errors import InputError
from cornersmooth.model import Ints

#: lines before the first block: they name the program
_TITLE: Final = re.compile(r"(?i)(%.*|PROC\s.*|[O:]\s*(\d+|<[^>]*>|[A-Z][^#\[(]*))")
_WEAK_FEED: Final = re.compile(rb"(?i)F[ \t]*\d+(?![\d.])")

#: what sends a control to other lines of the program; numbers of lines beside it, and a jump to a line that the
#: program works out
_JUMPS: Final = re.compile(rb"(?i)GOTO[BFCS]?|M[ \t]*0*(?:9[6-9]|198)(?!\d)|G[ \t]*0*6[56]|THEN|REPEATB?|CALL|UNTIL")
_TARGET: Final = re.compile(rb"(?i)(?:GOTO[BFCS]?|REPEATB?|LBL|(?<![A-Z])[HNPQ])\s*(\d{1,9})")
_COMPUTED: Final = re.compile(
    rb"(?i)GOTO[BFCS]?\s*[^\d\s]|M[ \t]*0*9[6-9][^\n]*[HPQ]\s*[#\[]|[HPQ]\s*[#\[][^\n]*M[ \t]*0*9[6-9]"
)


#: the end of a program, or a block with a G word; words of a language are no block
_BLOCK: Final = re.compile(rb"(?im)\bM(?:0?2|30)\b|^[ \t]*(?:N\d+[ \t]*)?G\d(?![^\n(;]*[A-Z]{2,} [A-Z]{2,})")


#: a value for a variable, which is no axis and no word of its own
_ASSIGNMENT: Final = re.compile(r"(#|Q[LRS]?\d+\s*=|(R\d*|[A-Z_]{2,}\w*)(\[[^]]*\])?\s*=(?!=)|DEF\s|FN ?[0-8] ?:)")
#: what a value is made of, and a word that stands beside it
_IN_VALUE: Final = re.compile(r"\[[^][]*\]|\([^()]*\)|\"[^\"]*\"|<[^>]*>|[RQ][LRS]?\d+|[A-Z_]{2,}\w*")
_WORD_BESIDE: Final = re.compile(r"[A-Z]\s*[-+.\d#\[=]")
#: a word whose number is worked out by the control
_WORKED_OUT: Final = re.compile(
    r"([A-Z]+\d*)\s*=?\s*[-+]?(?:#(?:<[^>]*>|\d+|\[[^]]*\])|\[[^]]*\]|Q[LRS]?\d+|"
    r"(?<==)\"[^\"]*\"|(?<==)(?:AC|IC|DC|ACP|ACN)\([^()]*\)|(?<==)[A-Z_$][^\s]*)"
)
#: a chamfer or a round corner at the end of a block: it changes neither groups nor the end of the next block
_CORNER: Final = re.compile(r",\s*[RC]\s*[\d.]+")
#: words that change no group, whatever their number
_NUMBERS: Final = frozenset("XYZABCFSQRP")
#: jumps, loops and labels, which are no words
_FLOW: Final = re.compile(r"(IF|ELSE|WHILE|DO|END|GOTO|FOR|LOOP|REPEAT|UNTIL|CASE|O\s*[\d<])|[A-Z_]\w*:")
_HEAD: Final = re.compile(r"/?\d?\s*(N?\d+\s+|N\d+)?\s*")
_KLARTEXT_PATH: Final = re.compile(r"LN? ")
_KLARTEXT_WORDS: Final = re.compile(r"\b(?:M\d+|R[0LR])\b")


@dataclass
class Text:
    """A text and its l lines."""

    data: bytes
    start: Ints  #: (l + 1,) first byte of each line, and the end

    @classmethod
    def of(cls, data: bytes) -> Text:
        """Find the lines of a text."""
        ends = np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n")) + 1
        return cls(data, np.concatenate(([0], ends, [] if data.endswith(b"\n") else [len(data)])).astype(np.int64))

    def __len__(self) -> int:
        return len(self.start) - 1

    def lines(self, first: int, stop: int) -> bytes:
        """Bytes of lines that follow one another, from 0; nothing beyond the end."""
        first, stop = min(first, len(self)), min(stop, len(self))
        return self.data[int(self.start[first]) : int(self.start[stop])]


@dataclass(frozen=True)
class Act:
    """A line that is no plain motion block."""

    line: int  #: from 0
    text: bytes  #: with every part of the block that is on lines after it
    before: State
    after: State
    cuts: str  #: why it is left as it is, where it cuts; else empty


class Stream:
    """What a control does in a program, whatever it is.

    Parameters
    ----------
    lexer : Lexer
        Of the control; numbers of feeds may be without a point.
    state : State
        Where the program begins.
    """

    def __init__(self, text: Text, lexer: Lexer, state: State, *, weak_feed: bool = False) -> None:
        self.text, self._lexer, self._weak_feed = text, lexer, weak_feed
        self._first = first = _begin(text)
        written = text.lines(first, len(text)).removeprefix(BOM_UTF8 if first == 0 else b"")
        written += b"" if written.endswith(b"\n") else b"\n"
        #: lines from the first on, and which of them are plain motion blocks: these have no words of other kinds
        self._lines = lines = Lines.of(lexer.unfolded(written), LinePatterns(lexer))
        self._plain = lines.bulk().copy()
        if b"~" in written:
            self._plain[[k for k, line in enumerate(written.split(b"\n")) if b"~" in line]] = False
        #: lines that are no plain motion blocks, with their numbers from 0
        self.others = [(first + k, lines.line(k)) for k in np.flatnonzero(~self._plain).tolist()]
        self._targets = _targets(text, [line for _, line in self.others])
        self._plain[[number - first for number in self._targets if number >= first]] = False
        words = b"\n".join(line for _, line in self.others).decode("latin-1").upper()
        named = {group for group, pattern in state.table.frame_words.items() if pattern.search(words)}
        self._state = replace(
            state, unnamed=frozenset(group for group in state.groups if group.startswith(FRAME)) - named
        )

    def __iter__(self) -> Iterator[Rows | Act]:
        """Execute the program; each item has the state before it, and after it. Nothing changes them any more."""
        state, started, lines, plain, first = self._state, False, self._lines, self._plain, self._first
        columns = lines.columns(np.flatnonzero(plain)) if plain.any() else {}
        count = np.concatenate(([0], np.cumsum(plain)))
        for a, b in pairwise(np.flatnonzero(np.diff(plain, prepend=~plain[0], append=~plain[-1])).tolist()):
            if plain[a]:
                own = {key: one[count[a] : count[b]] for key, one in columns.items()}
                rows = execute_rows(state, first + a, own, weak_feed=self._weak(state, first + a, first + b))
                started, state = True, rows.after(b - a)
                yield rows
                continue
            for k in range(a, b):
                block = self._lexer.comment.sub("", lines.line(k).decode("latin-1")).strip()
                if block and (started or not _TITLE.fullmatch(block)):
                    started, before, state = True, state, state.copy()
                    if first + k in self._targets:  # who jumps here may come from anywhere
                        state.lose_all()
                    cuts = execute(state, lines.line(k), self._lexer)
                    yield Act(first + k, lines.line(k), before, state, cuts)

    def __len__(self) -> int:
        """Lines from the first on that is executed."""
        return len(self._plain)

    def _weak(self, state: State, first: int, stop: int) -> bool:
        """Whether feeds of some lines are written so that the control may count them in another unit."""
        inch = self._weak_feed and state.unit != 1.0
        return inch and _WEAK_FEED.search(self.text.lines(first, stop)) is not None


def _targets(text: Text, others: Sequence[bytes]) -> set[int]:
    """Lines to which the program may jump: those of all numbers beside jumps in some lines."""
    jumps = [line for line in others if _JUMPS.search(line)]
    if not jumps:
        return set()
    numbers = {int(word) for jump in jumps for word in _TARGET.findall(jump)}
    if _COMPUTED.search(b"\n".join(jumps)):
        pattern = re.compile(rb"(?im)^[ \t/]*N[ \t]*\d+")
    else:
        some = b"|".join(b"0*%d" % number for number in sorted(numbers)) or rb"(?!)"
        pattern = re.compile(rb"(?im)^[ \t/]*N[ \t]*(?:%b)(?!\d)" % some)
    at = [match.start() for match in pattern.finditer(text.data)]
    return set((np.searchsorted(text.start, np.array(at, np.int64), side="right") - 1).tolist())


def _begin(text: Text) -> int:
    """Line from which on the program is executed: that of the first ``%``, if a listing stands before it."""
    for match in re.finditer(rb"(?m)^[ \t]*%[ \t]*\r?$", text.data):
        before, behind = text.data[: match.start()], text.data[match.end() :]
        if behind.strip() and not _BLOCK.search(before):
            return int(np.searchsorted(text.start, match.start(), side="right")) - 1
        break
    return 0


def execute(state: State, text: bytes, lexer: Lexer) -> str:
    """Execute a line that is no plain motion block; say why it is left as it is where it cuts, else nothing."""
    line = line_of(text, lexer)
    if line is None or (line.words and line.words[0].name == "DEF"):  # a variable of Siemens, with its name as a word
        plain, before = lexer.comment.sub(" ", text.upper().decode("latin-1")).strip(), state.copy()
        why = _execute_unread(state, _HEAD.sub("", plain, count=1), lexer)
        if plain.startswith("/"):  # the operator chooses
            state.or_not(before)
        return why
    cuts = state.execute(line)
    state.lose_place(word.name for word in line.words if lexer.without_point(word))  # in which unit is not known
    if not cuts:
        return ""
    return "the operator may skip the block" if line.skipped else "other words in the block"


def line_of(text: bytes, lexer: Lexer) -> Line | None:
    """Words of a line; None where the lexer does not know them."""
    try:
        return lexer.line(text, 0, None)
    except InputError:
        return None


def _execute_unread(state: State, plain: str, lexer: Lexer) -> str:
    """Execute a line that the lexer does not know; say why it cuts in a way that is not known, else nothing."""
    if _ASSIGNMENT.match(plain) and "FRAME" not in plain and not _word_beside(plain):
        state.lose_place()
        return ""
    lost, bare = {match[1] for match in _WORKED_OUT.finditer(plain)}, _CORNER.sub(" ", _WORKED_OUT.sub(" ", plain))
    line = line_of(bare.encode("latin-1"), lexer) if bare != plain else None
    if line is None and state.table.row(plain) is not UNKNOWN:
        line = Line(0, (Word("block", 0.0, plain),))
    elif line is None and _KLARTEXT_PATH.match(plain) and "RAPID" in state.table.named:
        for word in _KLARTEXT_WORDS.findall(plain):
            state.execute(lexer.line(f"L {word}".encode(), 0, None))
        state.lose_place()
        state.groups["motion"], state.feed = None, math.nan
        return "words that are not known"
    if line is None or {"G", "M"} & lost or (lost and line.words and line.words[0].name == "block"):
        state.lose_all(frames=not _FLOW.match(plain))
        return ""
    state.execute(line)
    state.lose_place(None if lost - _NUMBERS - {*state.axes} else lost)
    if "F" in lost:
        state.feed = math.nan
    return "words that the control works out" if state.groups["motion"] in CUTS else ""


def _word_beside(plain: str) -> bool:
    """Whether beside a value for a variable there are words of a block."""
    rest, count = plain.partition("=")[2], 1
    while count:
        rest, count = _IN_VALUE.subn("", rest)
    return _WORD_BESIDE.search(rest) is not None


#: columns of a block
_WIDE: Final = 40


def listing(stream: Stream) -> Iterator[str]:
    """Lines of text, one for each block of a program."""
    for item in stream:
        if isinstance(item, Act):
            yield _line(item.line, item.text, " ".join(_changes(item.before, item.after)) or "-")
            continue
        text = stream.text.lines(item.first, item.first + len(item)).splitlines()
        for k, block in enumerate(text):
            yield _line(item.first + k, block, " ".join(_motion(item, k)))


def _line(number: int, block: bytes, effects: str) -> str:
    shown = " ".join(block.decode("latin-1").split())
    return f"{number + 1:>6}  {shown[:_WIDE]:<{_WIDE}}  {effects}"


def _motion(rows: Rows, row: int) -> Iterator[str]:
    """What a motion block does: to where, and how fast."""
    state = rows.after(row + 1)
    yield state.groups["motion"] or "motion=?"
    yield from _places(state.place)
    if state.groups["motion"] != "rapid":
        yield _number("F", state.feed)


def _changes(before: State, after: State) -> Iterator[str]:
    """What a block has changed."""
    if {value for name, value in after.groups.items() if not name.startswith(FRAME)} == {None}:
        yield "all unknown" if after.frames is None else "all unknown but frames"
        return
    for name, value in after.groups.items():
        if value != before.groups[name]:
            yield f"{name}={'?' if value is None else value}"
    yield from _places({name: value for name, value in after.place.items() if _differ(value, before.place[name])})
    if _differ(after.feed, before.feed):
        yield _number("F", after.feed)


def _differ(one: float, other: float) -> bool:
    return one != other and not (math.isnan(one) and math.isnan(other))


def _places(place: Mapping[str, float]) -> Iterator[str]:
    return (_number(name, value) for name, value in place.items())


def _number(name: str, value: float) -> str:
    return f"{name}?" if math.isnan(value) else f"{name}{value:.10g}"
