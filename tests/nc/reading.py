"""Strict readers of NC text and the motion that a control makes of it: what all controls have in common.

Nothing here comes from the writers: grammars are regular expressions of what the manuals allow and we write
(`nc.grammars`), kinematics are rotations by scipy (`nc.rotations`), splines are evaluated by de Boor's recursion from
the rules of the manuals (`nc.splines`).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from nc.rotations import tip_of, tool_direction
from oracle.motion import Path, angle_between, arc_points, axis_step, fastest_turn, unit
from oracle.nc_text import Arc

Floats = NDArray[np.float64]

#: digits of what is written as zero with a minus
NEGATIVE_ZERO = re.compile(r"-0*\.?0*")
#: how far above the tip a point of the axis is put that is not written
POINT = 100.0
#: how far a written vector may be from length 1: half a step of the seventh decimal in each component, and a hair
UNIT_LENGTH = 1e-7


class TextError(AssertionError):
    """The text breaks a rule of its control; the message starts with the line number."""


#: tip (m,3) and tool direction (m,3) at shares (m,) of straight blocks, from the words (m,k) at their ends
Straight = Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class Piece:
    """One block's motion: `at` gives tip (m,3) and tool direction (m,3) at shares (m,) of it."""

    line: int
    rapid: bool
    at: Callable[[Floats], tuple[Floats, Floats]]
    samples: int  #: 0 for a straight block: its reader knows
    feed: float | None = None  #: as written, in the units of the text; None where the block has none
    mode: str = ""  #: block that selected the feed mode in force
    ends: tuple[Floats, Floats] | None = None  #: words at the ends of a straight block


@dataclass
class Reading:
    """What a reader has understood so far."""

    reader: Reader
    pieces: list[Piece] = field(default_factory=list)
    codes: list[str] = field(default_factory=list)

    def runs(self, axis_length: float) -> list[Path]:
        """Feed motion between rapids, as the oracle wants it: the end of the rapid first."""
        straight = [index for index, piece in enumerate(self.pieces) if piece.ends is not None]
        count = np.array([piece.samples for piece in self.pieces])
        start, end = (np.array([self.pieces[index].ends[side] for index in straight]) for side in (0, 1))  # type: ignore[index]
        if straight:
            count[straight] = self.reader.samples(start, end)
        rapid = np.array([piece.rapid for piece in self.pieces], dtype=bool)
        rapid[:1] = True
        count[rapid] = 1
        first = np.cumsum(count) - count
        owner = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(owner)) - first[owner] + 1) / count[owner]
        tip, direction = np.empty((2, len(owner), 3))
        if straight:  # all of them at once: there are many
            row = np.full(len(count), -1)
            row[straight] = np.arange(len(straight))
            rows = row[owner]
            there = rows >= 0
            tip[there], direction[there] = self.reader.along(start[rows[there]], end[rows[there]], share[there])
        for index in np.flatnonzero([piece.ends is None for piece in self.pieces]):
            here = slice(first[index], first[index] + count[index])
            tip[here], direction[here] = self.pieces[index].at(share[here])
        whole = Path(tip, tip + axis_length * unit(direction), owner)
        bounds = [*first[rapid], len(owner)]
        return [whole.slice(low, high) for low, high in pairwise(bounds) if high - low > 1]


def great_circle(one: Floats, other: Floats, share: Floats) -> Floats:
    """Unit vectors (m,3) between two (m,3), evenly in the angle."""
    angle = angle_between(one, other)
    even = (angle >= 1e-9) & (angle <= np.pi - 1e-6)
    sine = np.where(even, np.sin(angle), 1.0)
    near = np.where(even, np.sin((1 - share) * angle) / sine, 1 - share)
    far = np.where(even, np.sin(share * angle) / sine, share)
    return unit(near[:, None] * unit(one) + far[:, None] * unit(other))


def straight(one: Floats, other: Floats, share: Floats) -> Floats:
    return one + share[:, None] * (other - one)


#: what follows a block that is not straight: the position after it, None where the block is none of its kind
Extra = Callable[["Reader", str, int, Floats | None, Reading], Floats | None]


@dataclass
class Reader:
    """Reads a text line by line; what differs between controls is given.

    Parameters
    ----------
    words : tuple of str
        Words in their order; the first three are X, Y and Z.
    codes : str
        Pattern of blocks without motion.
    turn : {"great circle", "point", "angles", "machine", "fixed"}
        How the tool turns in a straight block.
    number : str
        What every line starts with; empty for none.
    scale : float
        mm per unit of the text.
    on, off, tool : str
        Patterns of what switches tool tip control (or the length) on and off, and of tool changes.
    modes : tuple of str
        Blocks for feed per minute, per revolution and inverse time.
    home, back : str
        Patterns of the retract, and of the block that must follow it; empty where there is none.
    circles : str
        Address of the radius of circular blocks; empty where there are none. In Klartext they say the direction at
        their end, and stay at one height.
    longest : int
        Characters of a line.
    """

    words: tuple[str, ...]
    codes: str
    turn: str
    machine: str = ""
    rapid: str = "G0"
    feed: str = "G1"
    rapid_end: str = ""
    decimals: tuple[int, ...] = (4,) * 3
    signs: bool = False
    number: str = ""
    scale: float = 1.0
    on: str = ""
    off: str = ""
    tool: str = r"T\d+ M6"
    with_z: bool = False  #: what switches on stands in the first block that moves Z
    modes: tuple[str, ...] = ("G94", "G95", "G93")
    home: str = ""
    retracts_on: bool = False  #: the retract comes before tip control or the length is switched off
    back: str = ""
    circles: str = ""
    longest: int = 255
    extra: Extra | None = None

    def __post_init__(self) -> None:
        sign = "[+-]" if self.signs else "-?"
        number = [
            rf"{word}({sign}(?:0|[1-9]\d*)\.\d{{{d}}})" for word, d in zip(self.words, self.decimals, strict=True)
        ]
        feed = r"(?: F(?P<f>(?:0|[1-9]\d*)(?:\.\d*)?))?"
        self.straight = re.compile(
            rf"(?:(?P<rapid>{self.rapid} )|{self.feed} ){' '.join(number)}(?P<tail>{self.rapid_end}|{feed})"
        )
        other = " " + " ".join(number[3:]) if number[3:] else ""
        self.aside = re.compile(rf"{self.rapid} {number[0]} {number[1]}")
        self.above = re.compile(rf"{self.rapid} {number[0]} {number[1]}{other}{self.rapid_end}")
        self.turn_only = re.compile(rf"{self.rapid}{other}{self.rapid_end}") if self.machine else None
        radius = rf"{re.escape(self.circles)}(?P<radius>(?:0|[1-9]\d*)\.\d{{{self.decimals[0]}}})"
        arc = rf"G(?P<way>[23]) {' '.join(number[:3])} {radius}{feed}"
        if self.circles == "R+":
            arc = rf"CR {' '.join(number[:2])} {radius} DR(?P<way>[+-]){feed}"
        self.circle = re.compile(arc) if self.circles else None

    def read(self, text: str, axis_length: float, limit: float) -> Reading:
        """Read a whole text; TextError where it breaks a rule."""
        codes = re.compile(self.codes)
        reading, position = Reading(self), None
        self.step, self.axis_length = axis_step(axis_length, limit), axis_length
        self.limit, self.plane, self.mode, self.tip_control = limit, 17, self.modes[0], not self.on
        self.compensation, self.raised, self.over, self.wanted = False, False, None, ""
        for number, block in self.blocks(text):
            line = self.with_point(block) if self.turn == "point" and self.circles else block
            if self.with_z and (match := re.fullmatch(f"({self.on}) (.*)", line)):
                if self.tip_control or not self.raised or not self.straight.fullmatch(match[2]):
                    raise TextError(f"{number}: {match[1]} beside what does not come down from a retract")
                self.follow(number, match[1])
                reading.codes.append(match[1])
                line = match[2]
            if self.wanted and not re.fullmatch(self.wanted, line):
                raise TextError(f"{number}: expected {self.wanted}: {line!r}")
            if self.wanted:
                self.wanted = ""
                reading.codes.append(line)
            elif self.home and re.fullmatch(self.home, line):
                if self.raised or (self.on and self.tip_control and not self.retracts_on):
                    raise TextError(f"{number}: a retract again, or under tip control")
                self.raised, self.wanted = True, self.back
                reading.codes.append(line)
            elif self.turn_only and self.turn_only.fullmatch(line):
                if not self.raised:
                    raise TextError(f"{number}: rotary axes turn below the height of the retract")
                reading.codes.append(line)
            elif match := self.above.fullmatch(line) or (self.turn == "point" and self.aside.fullmatch(line)):
                again = self.over is not None or self.tilted(match.groups()[2:])
                if not self.raised or self.tip_control is self.with_z or again:
                    raise TextError(f"{number}: a rapid without Z that comes from no retract, or of a tilted tool")
                self.over = match.groups()
                reading.codes.append(line)
            elif match := self.straight.fullmatch(line):
                rapid = match["rapid"] is not None if self.rapid != self.feed else match["tail"] == self.rapid_end
                values = self.numbers(number, match.groups()[1 : 1 + len(self.words)])
                if position is not None and not rapid and (values == position).all() and match["f"] is None:
                    raise TextError(f"{number}: move of no length")
                self.check_motion(number, rapid, match["f"])
                words = match.groups()[1 : 1 + len(self.words)]
                at_once = self.turn == "point" or (self.over is None and self.tilted(words[3:]))
                if self.raised and not at_once and self.over != (*words[:2], *words[3:]):
                    raise TextError(f"{number}: from the retract the tool must come from above: {self.over}")
                self.raised, self.over = False, None
                feed = None if match["f"] is None else float(match["f"])
                start = position if position is not None else values
                reading.pieces.append(self.piece(number, rapid, start, values, feed))
                position = values
            elif self.circle and (match := self.circle.fullmatch(line)):
                if position is None:
                    raise TextError(f"{number}: arc from nowhere")
                self.check_motion(number, False, match["f"])
                end, flat = position.copy(), self.circles == "R+"
                place = match.groups()[0:2] if flat else match.groups()[1:4]
                end[: len(place)] = self.numbers(number, place)
                if self.turn == "point":
                    end[3:] += end[:3] - position[:3]
                reading.pieces.append(self.arc(number, match["way"] in "2-", position, end, float(match["radius"])))
                position = end
            elif self.extra and (after := self.extra(self, line, number, position, reading)) is not None:
                position = after
            elif codes.fullmatch(line):
                self.follow(number, line)
                reading.codes.append(line)
            else:
                raise TextError(f"{number}: not a block of this control: {line!r}")
        left = [self.mode != self.modes[0], self.plane != 17, self.compensation, bool(self.on) and self.tip_control]
        if self.home and not self.raised:
            raise TextError("end: no retract")
        if any(left):
            raise TextError(f"end: feed mode, plane, compensation, tip control still on: {left}")
        return reading

    def with_point(self, line: str) -> str:
        """Straight block or control point of a tool along Z, with a point of its axis that it does not name."""
        match = re.search(r" X(\S+) Y(\S+) Z(\S+)(?! U| R\d+\.\d{4,})", line)
        if match is None or " U" in line or line.startswith(("(", "G2 ", "G3 ")):
            return line
        above = f"{float(match[3]) + POINT:.{self.decimals[0]}f}"
        return f"{line[: match.end()]} U{match[1]} V{match[2]} W{above}{line[match.end() :]}"

    def tilted(self, words: tuple[str, ...]) -> bool:
        """Whether the words behind the tip lean the tool in the part: X Y alone go aside or down on the machine."""
        numbers = [float(word) for word in words]
        if self.turn == "great circle":
            return numbers[2] < 1 - 1e-6
        if self.turn != "angles":
            return False
        angles = {name: np.array([number]) for name, number in zip(self.words[3:], numbers, strict=True)}
        return bool(tool_direction(self.machine, angles)[0, 2] < 1 - 1e-6)

    def blocks(self, text: str) -> list[tuple[int, str]]:
        """Line numbers and blocks without their own numbers; a block goes on behind ``~``."""
        found: list[tuple[int, str]] = []
        goes_on, count = False, 0
        for number, whole in enumerate(text.splitlines(), 1):
            if len(whole) > self.longest:
                raise TextError(f"{number}: {len(whole)} characters")
            line = whole
            if self.number and whole != "%" and not goes_on:
                prefix = self.number.format(number=count)
                if not whole.startswith(prefix):
                    raise TextError(f"{number}: no block number {prefix!r}: {whole!r}")
                line, count = whole.removeprefix(prefix), count + 1
            if goes_on:
                found[-1] = (found[-1][0], f"{found[-1][1]} {line.strip()}")
            else:
                found.append((number, line))
            goes_on = whole.endswith(" ~") and not line.startswith(";")
            if goes_on:
                found[-1] = (found[-1][0], found[-1][1].removesuffix(" ~"))
        return found

    def numbers(self, number: int, groups: tuple[str, ...]) -> Floats:
        """Numbers of a block in mm, vectors and degrees."""
        if any(NEGATIVE_ZERO.fullmatch(group) for group in groups):
            raise TextError(f"{number}: negative zero")
        values = np.array([float(group) for group in groups])
        values[: 6 if self.turn == "point" else 3] *= self.scale
        if self.turn == "great circle" and len(values) == 6:
            length = float(np.linalg.norm(values[3:]))
            if abs(length - 1) > UNIT_LENGTH:
                raise TextError(f"{number}: vector of length {length}")
        return values

    def check_motion(self, number: int, rapid: bool, feed: str | None) -> None:
        """Whether the control may move in its present state."""
        if not self.tip_control:
            raise TextError(f"{number}: motion without tip control or length")
        if not rapid and self.mode == "G93" and feed is None:
            raise TextError(f"{number}: no F under G93")

    def follow(self, number: int, line: str) -> None:
        """State of the control after a block without motion."""
        if self.on and re.fullmatch(self.on, line):
            self.tip_control = True
        elif self.off and re.fullmatch(self.off, line):
            if self.retracts_on and not self.raised:
                raise TextError(f"{number}: {line} may move by the length of the tool: retract before")
            self.tip_control = False
        elif line in self.modes:
            self.mode = line
        elif line in ("G17", "G18", "G19"):
            self.plane = int(line[1:])
        elif re.match("G4[12]", line):
            self.compensation = True
        elif line == "G40":
            self.compensation = False
        elif re.fullmatch(self.tool, line):
            if self.on and self.tip_control:
                raise TextError(f"{number}: tool change under tip control")
            if self.home and not self.raised:
                raise TextError(f"{number}: tool change without a retract")

    def direction(self, values: Floats) -> Floats:
        """Tool direction of the words behind the tip, (m, ...)."""
        if self.turn == "fixed":
            return np.broadcast_to((0.0, 0.0, 1.0), (len(values), 3))
        if self.turn == "point":
            return values[:, 3:] - values[:, :3]
        return tool_direction(self.machine, dict(zip(self.words[3:], values[:, 3:].T, strict=True)))

    def along(self, start: Floats, end: Floats, share: Floats) -> tuple[Floats, Floats]:
        """Tip and tool direction, (m,3), at shares (m,) of straight blocks between words (m,k)."""
        if self.turn == "great circle":
            return straight(start[:, :3], end[:, :3], share), great_circle(start[:, 3:], end[:, 3:], share)
        values = straight(start, end, share)
        if self.turn == "machine":
            angles = dict(zip(self.words[3:], values[:, 3:].T, strict=True))
            return tip_of(self.machine, values[:, :3], angles), self.direction(values)
        return values[:, :3], self.direction(values)

    def samples(self, start: Floats, end: Floats) -> NDArray[np.int64]:
        """How many samples each straight block between words (m,k) needs, (m,)."""
        if self.turn == "fixed":
            return np.ones(len(start), dtype=np.int64)
        if self.turn in ("angles", "machine"):
            turn = np.radians(np.abs(end[:, 3:] - start[:, 3:]).max(axis=1))
        elif self.turn == "point":  # tip and point run straight: the axis turns fastest in the middle
            turn = fastest_turn(angle_between(start[:, 3:] - start[:, :3], end[:, 3:] - end[:, :3]))
        else:
            turn = angle_between(start[:, 3:], end[:, 3:])
        least = np.where(turn > 0, 16, 1) if self.turn == "machine" else 1
        return np.maximum(least, np.ceil(turn / self.step)).astype(np.int64)

    def piece(self, number: int, rapid: bool, start: Floats, end: Floats, feed: float | None = None) -> Piece:
        """Straight block."""

        def at(share: Floats) -> tuple[Floats, Floats]:
            return self.along(*(np.broadcast_to(each, (len(share), len(each))) for each in (start, end)), share)

        return Piece(number, rapid, at, 0, feed, self.mode, (start, end))

    def arc(self, number: int, clockwise: bool, start: Floats, end: Floats, radius: float) -> Piece:
        """Circular block in R form: the shorter way, the tool axis stays."""
        radius *= self.scale
        arc = Arc(number, self.plane, clockwise, tuple(start), tuple(end), radius, None, False)  # type: ignore[arg-type]
        points = np.vstack((start[:3], arc_points(arc, float(np.sqrt(0.1 * self.limit / radius)))))

        def at(share: Floats) -> tuple[Floats, Floats]:
            tip = points[np.rint(share * (len(points) - 1)).astype(int)]
            values = np.hstack((tip, np.broadcast_to(start[3:], (len(tip), len(start) - 3))))
            if self.turn == "point":
                return tip, np.broadcast_to(start[3:] - start[:3], tip.shape)
            if self.turn == "great circle":
                return values[:, :3], values[:, 3:]
            return self.along(values, values, share)

        return Piece(number, False, at, len(points) - 1, None, self.mode)
