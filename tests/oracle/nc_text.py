"""Strict parser of the FANUC texts, forms `g1` (tool vectors under G43.5) and `g6.2` (NURBS with an axis point).

One regular expression per kind of block; anything else is an error that names the line. The modal state of the control
is followed as far as the rules need it. Rules of G06.2: FANUC 15i programming manual B-63324EN/03, chapter 4.17.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal

Form = Literal["g1", "g6.2"]
Six = tuple[float, float, float, float, float, float]

#: those of a corner and of a part of an arc, last ones in blocks of their own
KNOTS = ("0.", "0.", "0.", "0.", "0.5", "1.", "1.", "1.", "1.")
ARC_KNOTS = ("0.", "0.", "0.", "0.", "1.", "1.", "1.", "1.")
#: how far above the tip a point of the axis is put that a tool along Z does not name
POINT = 100.0
#: words after the tip: vector from tip to spindle, or axis point
SECOND = {"g1": "IJK", "g6.2": "UVW"}
TIP_DECIMALS = {"mm": 4, "inch": 5}
VECTOR_DECIMALS = 7
MM_PER_UNIT = {"mm": 1.0, "inch": 25.4}
#: R and K keep three decimals on an IS-B control
WEIGHT = r"(?:0\.(?!0*$)\d{1,3}|[1-9]\d*\.\d{0,3})"
FEED = r"(?: F((?:0|[1-9]\d*)\.\d{0,4}))?"


class BadTextError(AssertionError):
    """The NC text breaks a rule; the message starts with the line number."""


@dataclass(frozen=True)
class Line:
    """G0 or G1: tip and vector (or axis point) run from `start` to `end`; `start` is None for the first position."""

    line: int
    rapid: bool
    start: Six | None
    end: Six
    feed: float | None
    per_revolution: bool


@dataclass(frozen=True)
class Curve:
    """G6.2: five control points of tip and axis point with their weights, four where it is a part of an arc."""

    line: int
    points: tuple[Six, ...]
    weights: tuple[float, ...]
    feed: float | None
    per_revolution: bool


@dataclass(frozen=True)
class Arc:
    """G2 or G3 in R form with the tool vector held; `plane` is 17, 18 or 19."""

    line: int
    plane: int
    clockwise: bool
    start: Six
    end: Six
    radius: float
    feed: float | None
    per_revolution: bool


@dataclass(frozen=True)
class Code:
    """A block without motion: `text` as written, comments with their parentheses."""

    line: int
    text: str

    @property
    def comment(self) -> bool:
        return self.text.startswith("(")


Block = Line | Curve | Arc | Code


@dataclass(frozen=True)
class Written:
    """A parsed NC program; all lengths in mm whatever the text speaks."""

    form: Form
    units: str
    blocks: tuple[Block, ...]

    @property
    def codes(self) -> list[str]:
        """Texts of the blocks without motion, in order."""
        return [block.text for block in self.blocks if isinstance(block, Code)]


@dataclass
class _State:
    """What the control knows while it reads."""

    position: tuple[str, ...] | None = None
    values: Six | None = None  # the same as numbers
    feed: str | None = None
    started: bool = False  # programs are started here, after a tool change or a stop: the next cut says F
    gone_up: bool = False  # a retract: the next cut may say F again
    per_revolution: bool = False
    plane: int = 17
    tool_length: bool = False  # G43.5 in form g1, G43 in form g6.2
    compensation: bool = False  # G41, G42
    changed: bool = False  # a tool change leaves the machine elsewhere: the next move is one
    raised: bool = False  # Z is at its reference position
    incremental: bool = False  # G91, for the way there
    over: tuple[str, ...] | None = None  # words of the rapid over the next position, at that height
    ended: bool = False
    in_curve: bool = False  # the last motion block was a knot: only a group 01 code may follow
    blocks: list[Block] = field(default_factory=list)


def _fixed(decimals: int) -> str:
    return rf"-?(?:0|[1-9]\d*)\.\d{{{decimals}}}"


def _words(letters: str, decimals: int) -> str:
    return " ".join(f"{letter}({_fixed(decimals)})" for letter in letters)


CODE = re.compile(
    r"""\([^()]*\)            # comment
    |T\d+\ M6|T\d+            # tool change, tool on its own
    |S\d+(?:\.\d*[1-9])?\ M[34]|S\d+(?:\.\d*[1-9])?  # spindle
    |M(?:0|1|3|4|5|7|8|9|19)  # stops, spindle, coolant
    |G4\ P\d+                 # dwell, ms
    |G43(?:\.5)?\ H\d+|G49    # tool length along the tool vector or along Z, and off
    |G40|G4[12]\ D\d+         # cutter compensation
    |G1[789]|G9[45]           # plane, feed mode
    |G5[4-9]                  # work offset
    """,
    re.VERBOSE,
)


def parse(data: bytes, form: Form) -> Written:
    """Parse a whole NC text, or raise `BadTextError` at the first word out of place."""
    text = data.decode("ascii")
    if "\r" in text or not text.endswith("\n"):
        raise BadTextError("line ends must be LF, the last one included")
    lines = text[:-1].split("\n")
    small = text.lower()
    for fault in ("nan", "inf", "e+", "e-"):
        for number, line in enumerate(lines if fault in small else (), 1):
            if fault in line.lower() and not line.startswith("("):
                raise BadTextError(f"{number}: {fault!r} in {line!r}")
    if len(lines) < 5 or lines[0] != "%" or lines[-1] != "%" or not re.fullmatch(r"O\d{4}", lines[1]):
        raise BadTextError("1: a program is framed by % and starts with its O number")
    units, state = _head(lines), _State()
    grammar = _Grammar(form, units)
    index = 2
    while index < len(lines) - 1:
        index = grammar.block(lines, index, state)
    if not state.ended:
        raise BadTextError(f"{len(lines)}: no M30")
    return Written(form, units, tuple(state.blocks))


def _head(lines: list[str]) -> str:
    """Units of the safety block, which must stand before everything but comments."""
    for number, line in enumerate(lines[2:], 3):
        if line.startswith("("):
            continue
        match = re.fullmatch(r"(G20|G21) G90 G94 G17 G40 G49 G80", line)
        if match is None:
            raise BadTextError(f"{number}: expected the safety block, found {line!r}")
        return "mm" if match[1] == "G21" else "inch"
    raise BadTextError("no safety block")


class _Grammar:
    """The blocks of one form in one unit."""

    def __init__(self, form: Form, units: str) -> None:
        self.form: Form = form
        self.scale = MM_PER_UNIT[units]
        tip = TIP_DECIMALS[units]
        second = VECTOR_DECIMALS if form == "g1" else tip
        six = _words("XYZ", tip) + " " + _words(SECOND[form], second)
        self.line = re.compile(rf"G([01]) {six}{FEED}")
        self.above = re.compile(rf"G0 {_words('XY', tip)} {_words(SECOND[form], second)}")
        self.tip_decimals = tip
        self.aside = re.compile(rf"G0 {_words('XY', tip)}")
        self.arc = re.compile(rf"G([23]) {_words('XYZ', tip)} R({_fixed(tip)}){FEED}")
        self.first = re.compile(rf"G6\.2 P4 K0\. {six} R({WEIGHT}){FEED}")
        self.point = re.compile(rf"K(0\.|0\.5) {six} R({WEIGHT})")

    def block(self, lines: list[str], index: int, state: _State) -> int:
        """Read the block at `lines[index]` into `state`; return the index of the next one."""
        line, number = self.with_point(lines[index]), index + 1
        if state.ended:
            raise BadTextError(f"{number}: {line!r} after M30")
        if line.startswith("G6.2"):
            return self.curve(lines, index, state)
        if line == "G1" and state.in_curve:
            state.in_curve = False
            state.blocks.append(Code(number, line))
            return index + 1
        if match := re.fullmatch(r"(G43 H\d+) (G[01] .*)", line):
            if not state.raised:
                raise BadTextError(f"{number}: {match[1]} beside a move that comes from no retract")
            self.code(match[1], number, state)
            line = match[2]
        if state.incremental and line != "G90":
            raise BadTextError(f"{number}: {line!r} under G91")
        if line == "G91 G28 Z0.":
            if state.raised or state.in_curve:
                raise BadTextError(f"{number}: {line!r} again, or in a curve")
            state.raised = state.incremental = state.gone_up = True
            state.blocks.append(Code(number, line))
        elif line == "G90":
            if not state.incremental:
                raise BadTextError(f"{number}: G90 is modal already")
            state.incremental = False
            state.blocks.append(Code(number, line))
        elif match := self.above.fullmatch(line) or (self.form == "g6.2" and self.aside.fullmatch(line)):
            # G43 of a tool along Z stands beside the first Z
            if not state.raised or state.tool_length is (self.form == "g6.2") or state.over is not None:
                raise BadTextError(f"{number}: a rapid without Z that comes from no retract")
            state.over = match.groups()
            state.blocks.append(Code(number, line))
        elif match := self.line.fullmatch(line):
            if state.raised and self.form == "g1":
                aside, axis = match.groups()[1:3], match.groups()[4:7]
                upright = float(axis[2]) > (1.0 - 1e-6) * math.hypot(*map(float, axis))
                # a tilted tool comes in one block: the plane of X and Y is tilted, too
                if state.over != ((*aside, *axis) if upright else None):
                    raise BadTextError(f"{number}: from the retract the tool comes in another order: {state.over}")
            state.raised, state.over = False, None
            self.straight(match, number, state)
        elif match := self.arc.fullmatch(line):
            if state.raised:
                raise BadTextError(f"{number}: an arc from the height of the retract")
            self.circular(match, number, state)
        elif line == "M30":
            if state.tool_length or not state.raised:
                raise BadTextError(f"{number}: M30 while tool length is on, or without a retract")
            state.ended = True
            state.blocks.append(Code(number, line))
        elif re.fullmatch(r"G2[01] G90 G94 G17 G40 G49 G80", line) and state.position is None:
            state.blocks.append(Code(number, line))
        elif CODE.fullmatch(line):
            self.code(line, number, state)
        else:
            raise BadTextError(f"{number}: not a block of form {self.form}: {line!r}")
        return index + 1

    def code(self, line: str, number: int, state: _State) -> None:
        if state.in_curve and not line.startswith("("):
            raise BadTextError(f"{number}: {line!r} while G6.2 is modal; a G0 or G1 must end it first")
        if line.startswith("G43"):
            if line.startswith("G43.5") is not (self.form == "g1"):
                raise BadTextError(f"{number}: {line} in form {self.form}")
            if state.tool_length:
                raise BadTextError(f"{number}: {line} while tool length is on")
            state.tool_length = True
        elif line == "G49":
            if not state.raised:
                raise BadTextError(f"{number}: G49 may move by the length of the tool: retract before")
            state.tool_length = False
        elif line.startswith(("G40", "G41", "G42")):
            state.compensation = line != "G40"
        elif line in ("G94", "G95"):
            if state.per_revolution == (line == "G95"):
                raise BadTextError(f"{number}: {line} is modal already")
            state.per_revolution = line == "G95"
            state.feed = None
        elif line in ("G17", "G18", "G19"):
            if state.plane == int(line[1:]):
                raise BadTextError(f"{number}: {line} is modal already")
            state.plane = int(line[1:])
        elif line.startswith("T"):
            if state.tool_length:
                raise BadTextError(f"{number}: tool change while tool length is on")
            if " M6" in line and not state.raised:
                raise BadTextError(f"{number}: tool change without a retract")
            state.changed = True
        if line in ("M0", "M1") or " M6" in line:
            state.started = True
        state.blocks.append(Code(number, line))

    def straight(self, match: re.Match[str], number: int, state: _State) -> None:
        rapid, words, feed = match[1] == "0", match.groups()[1:7], match[8]
        self.moves(number, words, state)
        if rapid and feed is not None:
            raise BadTextError(f"{number}: F on a rapid")
        end = self.numbers(words, number)
        start = state.values
        value = None if rapid else self.feed(number, feed, state)
        state.position, state.values, state.in_curve = words, end, False
        state.blocks.append(Line(number, rapid, start, end, None if rapid else value, state.per_revolution))

    def circular(self, match: re.Match[str], number: int, state: _State) -> None:
        if state.position is None or state.values is None:
            raise BadTextError(f"{number}: arc without a position to start from")
        words = (*match.groups()[1:4], *state.position[3:])
        if self.form != "g1":
            if state.position[3:] != self.point_above(*state.position[:3]):
                raise BadTextError(f"{number}: arcs do not carry the axis point")
            words = (*match.groups()[1:4], *self.point_above(*match.groups()[1:4]))
        self.moves(number, words, state)
        start, end = state.values, self.numbers(words, number)
        value = self.feed(number, match[6], state)
        radius = float(match[5]) * self.scale
        if radius <= 0:
            raise BadTextError(f"{number}: radius {match[5]}; a sweep of 180 degrees or more is not allowed")
        state.position, state.values, state.in_curve = words, end, False
        state.blocks.append(Arc(number, state.plane, match[1] == "2", start, end, radius, value, state.per_revolution))

    def curve(self, lines: list[str], index: int, state: _State) -> int:
        """G6.2 with its four more points and four more knots; returns the index after them."""
        number = index + 1
        first = self.first.fullmatch(self.with_point(lines[index]))
        if first is None or self.form != "g6.2":
            raise BadTextError(f"{number}: not the first block of a curve: {lines[index]!r}")
        if first.groups()[0:6] != state.position:
            raise BadTextError(
                f"{number}: PS1009, first control point {first.groups()[0:6]} is not at {state.position}"
            )
        if state.per_revolution:
            raise BadTextError(f"{number}: PS1006, G6.2 in G95")
        if state.compensation or not state.tool_length:
            raise BadTextError(f"{number}: PS1006, G6.2 in G41 or G42, or tool length is off")
        value = self.feed(number, first[8], state)
        words, weights = [first.groups()[0:6]], [first[7]]
        knots = ARC_KNOTS if lines[index + 4] == "K1." else KNOTS
        count = len(knots) - 4
        for offset, knot in enumerate(knots[1:count], 1):
            match = self.point.fullmatch(self.with_point(lines[index + offset]))
            if match is None or match[1] != knot:
                raise BadTextError(f"{number + offset}: expected control point with K{knot}: {lines[index + offset]!r}")
            words.append(match.groups()[1:7])
            weights.append(match[8])
        for offset, knot in enumerate(knots[count:], count):
            if lines[index + offset] != f"K{knot}":
                raise BadTextError(f"{number + offset}: PS1004/PS1005, expected K{knot}: {lines[index + offset]!r}")
        if len(set(words)) == 1:
            raise BadTextError(f"{number}: curve without length")
        points = tuple(self.numbers(point, number) for point in words)
        state.position, state.values, state.in_curve = words[-1], points[-1], True
        state.blocks.append(Curve(number, points, tuple(map(float, weights)), value, state.per_revolution))
        return index + len(knots)

    def point_above(self, x: str, y: str, z: str) -> tuple[str, str, str]:
        """Words of a point above a tip."""
        return x, y, f"{float(z) + POINT:.{self.tip_decimals}f}"

    def with_point(self, line: str) -> str:
        """Straight block or control point of a tool along Z, with a point of its axis that it does not name."""
        match = re.search(r" X(\S+) Y(\S+) Z(\S+)", line)
        if self.form == "g1" or match is None or " U" in line or line.startswith(("(", "G2 ", "G3 ")):
            return line
        u, v, w = self.point_above(*match.groups())
        return f"{line[: match.end()]} U{u} V{v} W{w}{line[match.end() :]}"

    def moves(self, number: int, words: tuple[str, ...], state: _State) -> None:
        """Checks that every block with motion shares."""
        if not state.tool_length:
            raise BadTextError(f"{number}: motion without tool length")
        if words == state.position and not state.changed:
            raise BadTextError(f"{number}: zero-length move to {words}")
        state.changed = False

    def feed(self, number: int, word: str | None, state: _State) -> float | None:
        """Feed in mm per minute or revolution that holds for this block."""
        if word is not None:
            if word == state.feed and not (state.started or state.gone_up):
                raise BadTextError(f"{number}: F{word} is modal already")
            if word[-1] == "0" and "." in word[:-1]:
                raise BadTextError(f"{number}: trailing zero in F{word}")
            if float(word) <= 0:
                raise BadTextError(f"{number}: F{word} does not move")
            state.feed = word
        elif state.started and state.feed is not None:
            raise BadTextError(f"{number}: no F in the first cut after a tool change or a stop")
        state.started = state.gone_up = False
        return None if state.feed is None else float(state.feed) * self.scale

    def numbers(self, words: tuple[str, ...], number: int) -> Six:
        """Values in mm (tip, axis point) or plain (vector)."""
        for word in words:
            if word.startswith("-0") and not word.strip("-0."):
                raise BadTextError(f"{number}: negative zero {word}")
        second = self.scale if self.form == "g6.2" else 1.0
        x, y, z, i, j, k = (float(word) for word in words)
        return (x * self.scale, y * self.scale, z * self.scale, i * second, j * second, k * second)


def without_way_down(written: Written) -> Written:
    """The program without the rapids behind retracts that only begin the way down along the tool."""
    if written.form == "g1":
        return written
    blocks, raised = list(written.blocks), False
    for index, (one, other) in enumerate(pairwise(blocks)):
        if isinstance(one, Code):
            raised = raised or "G28" in one.text
        elif raised:
            raised = False
            if isinstance(one, Line) and isinstance(other, Line) and one.rapid and other.rapid and _above(one, other):
                blocks[index] = Code(one.line, "(way down)")
                blocks[index + 1] = replace(other, start=one.start)
    return replace(written, blocks=tuple(blocks))


def _above(one: Line, other: Line) -> bool:
    """Whether the tool comes straight down along itself, by 20 mm."""
    up = [second - tip for tip, second in zip(other.end[:3], other.end[3:], strict=True)]
    length = math.sqrt(sum(part * part for part in up))
    return all(
        abs(there - here - 20.0 * part / length) < 1e-3
        for there, here, part in zip(one.end[:3], other.end[:3], up, strict=True)
    )
