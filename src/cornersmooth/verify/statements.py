"""Statements: tool changes, spindle, coolant, stops, dwells and compensation, as the CL file and the text say them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cornersmooth.model import Move, Program, Statement
from cornersmooth.nc_reader.elements import Event

#: decimals of a spindle speed that count: FANUC's S takes whole numbers only
SPEED_DECIMALS = 0

#: value of a tap, whatever the control calls it
TAP = 84.0

#: cutting speeds in mm per minute
_MM_PER_MINUTE = {"SMM": 1000.0, "SFM": 304.8}

_COOLANT = {"ON": 8.0, "FLOOD": 8.0, "MIST": 7.0, "THRU": 88.0, "OFF": 9.0, "NOMORE": 9.0}

_COMPENSATION = {"LEFT": 41.0, "RIGHT": 42.0, "OFF": 40.0, "NOMORE": 40.0}


@dataclass(frozen=True, slots=True)
class Token:
    """One change of state, or one action.

    Parameters
    ----------
    kind : str
        ``"tool"``, ``"spindle"``, ``"speed"``, ``"coolant"``, ``"compensation"``, ``"stop"``, ``"dwell"``, ``"tap"``,
        ``"end"``.
    value : float
    place : float, mm
        Path length from the start of the original motion.
    line : int
        CL or NC line.
    room : float, mm
        How far the place is uncertain beyond what printed digits account for: rotary words near the pole.
    reach : float, mm
        How much farther along it may be, too: what the CL file has there leaves nothing in the text.
    moment : int
        Tokens of one moment have no motion, stop or dwell between them: of a state only the last one counts.
    element : int
        Element of the text that it stands before; -1 in the CL file.
    habit : bool
        Whether posts write it on their own: an optional stop right before another tool.
    others : tuple of float, mm
        Other places that it may have, where the path goes to and fro.
    idle : bool
        Whether a tool is changed for another, or the program ends, before anything moves.
    """

    kind: str
    value: float
    place: float
    line: int
    room: float = 0.0
    moment: int = 0
    habit: bool = False
    others: tuple[float, ...] = ()
    idle: bool = False
    reach: float = 0.0
    element: int = -1


#: kinds during which a state matters although nothing moves
_PAUSES = ("stop", "dwell")


class Asking:
    """Goes through the CL statements and notes what they ask for. What it cannot interpret asks for nothing."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.tokens: list[Token] = []
        self.place, self.line, self.moment = 0.0, 0, 0
        self.running, self.speed, self.diameter = 3.0, 0.0, 0.0
        self.tool, self.offset = -1.0, 1.0
        self.moving = np.flatnonzero(program.kind != Move.FROM)
        said = {statement.word for statement in program.statements}
        self.handlers: dict[str, Callable[[list[str], list[float], Statement], None]] = {
            "LOADTL": self.load,
            "LOAD": self.load,
            "TURRET": self.load,
            "SELECT": self.select,
            "SPINDL": self.spindle,
            "COOLNT": self.coolant,
            "CUTCOM": self.compensation,
            "DELAY": self.delay,
            "CUTTER": self.cutter,
            "TLDATA": self.cutter,
            "AUXFUN": self.auxiliary,
            "END": self.end,
            "STOP": lambda words, numbers, statement: self.say("stop", 0.0),
            "OPSTOP": lambda words, numbers, statement: self.say("stop", 1.0),
        }
        if not said & {"LOADTL", "LOAD", "TURRET"}:
            self.handlers["TOOLNO"] = self.load

    def take(self, statement: Statement, place: float) -> None:
        """Note one statement."""
        handler = self.handlers.get(statement.word)
        if handler is not None:
            numbers = [value for value in statement.args if isinstance(value, float)]
            words = [value for value in statement.args if isinstance(value, str) and value]
            if place != self.place:
                self.moment += 1
            self.place, self.line = place, statement.line
            handler(words, numbers, statement)

    def say(self, kind: str, value: float) -> None:
        """Note a token."""
        self.tokens.append(Token(kind, value, self.place, self.line, moment=self.moment))
        self.moment += kind in _PAUSES

    def load(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Change the tool; ADJUST or OSETNO names another length register."""
        if statement.word == "LOAD" and words[:1] != ["TOOL"]:
            return
        if not numbers and words and words[0][:1] == "T" and words[0][1:].isdigit():
            numbers = [float(words[0][1:])]
        if not numbers or not _whole(numbers[0]):
            return
        registers = [_behind(statement, word) for word in ("ADJUST", "OSETNO")]
        offset = next((number for number in registers if number is not None), numbers[0])
        self.tool, self.offset = numbers[0], offset if _whole(offset) else numbers[0]
        self.say("tool", self.tool)
        if len(self.moving) and statement.pose <= self.moving[-1]:  # nothing moves with a tool that comes last
            self.say("offset", self.offset)

    def select(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Bring the next tool near."""
        if words == ["TOOL"] and len(numbers) == 1 and _whole(numbers[0]) and numbers[0] != self.tool:
            self.say("next tool", numbers[0])

    def spindle(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Start, stop or orient the spindle; RANGE and MAXRPM say nothing about its speed."""
        for word in ("RANGE", "MAXRPM"):
            behind = _behind(statement, word) if word in words else None
            if behind is not None:
                numbers.remove(behind)
        known = {"RPM", "CLW", "CCLW", "ON", "OFF", "SFM", "SMM", "LOCK", "ORIENT", "NOMORE"}
        gears = {"RANGE", "MAXRPM", "HIGH", "LOW", "MEDIUM"}
        if not set(words) <= known | gears or len(numbers) > 1 or any(number < 0 for number in numbers):
            return
        if {"LOCK", "ORIENT"} & set(words):
            if not numbers:
                self.say("spindle", 19.0)
            return
        if {"OFF", "NOMORE"} & set(words) or numbers == [0.0]:
            self.say("spindle", 5.0)
            return
        speed = numbers[0] if numbers else None
        cutting = next((_MM_PER_MINUTE[word] for word in words if word in _MM_PER_MINUTE), None)
        if cutting is not None and speed is not None:
            if not self.diameter > 0:
                return
            speed = float(round(speed * cutting / (math.pi * self.diameter)))
        if {"CLW", "CCLW"} & set(words):
            self.running = 4.0 if "CCLW" in words else 3.0
        if speed is not None:
            self.speed = speed
            self.say("speed", round(speed, SPEED_DECIMALS))
        self.say("spindle", self.running)

    def coolant(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Coolant on, of a kind, or off."""
        if not words and "/" in statement.text:  # an empty list says nothing
            return
        words = words or ["ON"]
        kinds = ["OFF"] if "OFF" in words else [word for word in words if word != "ON"] or ["ON"]
        if len(kinds) == 1 and not numbers and kinds[0] in _COOLANT:
            self.say("coolant", _COOLANT[kinds[0]])

    def compensation(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Cutter compensation left, right or off."""
        code = _COMPENSATION.get((words or [""])[0])
        register = (numbers or [self.offset])[0]
        if code is None or not set(words[1:]) <= {"XYPLAN", "ZXPLAN", "YZPLAN"} or not _whole(register):
            return
        self.say("compensation", code)
        if code != _COMPENSATION["OFF"]:
            self.say("register", register)

    def delay(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Wait for seconds or revolutions."""
        if len(numbers) != 1 or numbers[0] <= 0 or words not in ([], ["REV"]):
            return
        if words and not self.speed:
            return
        seconds = numbers[0] * (60.0 / self.speed if words else 1.0)
        self.say("dwell", max(1, round(1000.0 * seconds)))

    def cutter(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Keep the diameter, for cutting speeds."""
        mill = bool({"MILL", "DRILL"} & set(words)) if statement.word == "TLDATA" else len(numbers) > 2
        self.diameter = numbers[0] * self.program.mm_per_unit if mill and numbers else 0.0

    def auxiliary(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """An M word by its number, unless it would end or change more than a word may."""
        if len(numbers) == 1 and not words and _whole(numbers[0]) and numbers[0] not in (2, 6, 30, 98, 99):
            for token in _of_m(numbers[0], self.place, self.line):
                self.say(token.kind, token.value)

    def end(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """END in the middle of the path is a stop."""
        if len(self.moving) and statement.pose <= self.moving[-1]:
            self.say("stop", 0.0)


def asked(program: Program, places: Sequence[float], end: float, dwells: Sequence[Token] = ()) -> list[Token]:
    """What the CL statements ask for.

    Parameters
    ----------
    program : Program
    places : sequence of float, mm
        Where the statements stand along the path.
    end : float, mm
        Length of the path.
    dwells : sequence of Token
        What the cycles of holes ask for, in order.
    """
    asking = Asking(program)
    for statement, place in zip(program.statements, places, strict=True):
        asking.take(statement, place)
    line = max((item.line for item in program.statements if item.word in ("FINI", "END")), default=0)
    tokens = sorted([*dwells, *asking.tokens], key=lambda token: token.place) if dwells else asking.tokens
    return [*tokens, Token("end", 30.0, end, line)]


def _behind(statement: Statement, word: str) -> float | None:
    """Return the number right behind a word."""
    args = statement.args
    place = args.index(word) + 1 if word in args else len(args)
    following = args[place] if place < len(args) else None
    return following if isinstance(following, float) else None


def _whole(number: float) -> bool:
    return 0 <= number < 1e9 and number == int(number)


def _of_m(value: float, place: float, line: int) -> list[Token]:
    """Token of an M word other than M6."""
    if value in (3, 4, 5, 19):
        return [Token("spindle", value, place, line)]
    if value in (7, 8, 9, 88):
        return [Token("coolant", value, place, line)]
    if value in (0, 1):
        return [Token("stop", value, place, line)]
    return [Token("auxiliary", value, place, line)]


def said(
    events: Sequence[Event],
    places: Sequence[float],
    rooms: Sequence[float],
    reaches: Sequence[float],
    others: Sequence[tuple[float, ...]],
) -> list[Token]:
    """What the words of the NC text do; the rest, in mm, is what `Token` has as place, room, reach and others."""
    tokens: list[Token] = []
    chosen: float | None = None
    moment = element = 0
    speaking = [event for event in events if event.letter != "("]
    rows = [row for row in zip(events, places, rooms, reaches, others, strict=True) if row[0].letter != "("]
    for k, (event, place, room, reach, elsewhere) in enumerate(rows):
        value, line, before = event.value, event.line, len(tokens)
        moment, element = moment + (event.element != element), event.element
        if event.letter == "T":
            chosen = value
            following = speaking[k + 1] if k + 1 < len(speaking) else None
            if following is None or (following.letter, following.value) != ("M", 6.0):
                tokens.append(Token("next tool", value, place, line))
        elif event.letter == "M" and value == 6:
            if chosen is not None:
                tokens.append(Token("tool", chosen, place, line))
        elif event.letter == "M" and value in (2, 30):
            tokens.append(Token("end", 30.0, place, line))
        elif event.letter == "M":
            tokens += _of_m(value, place, line)
        elif event.letter == "G" and value == 4:
            tokens.append(Token("dwell", round(float(event.text)), place, line))
        elif event.letter == "G" and value == TAP:
            tokens.append(Token("tap", value, place, line))
        elif event.letter == "G" and value in (40, 41, 42):
            tokens.append(Token("compensation", value, place, line))
        elif event.letter in _PLAIN:
            number = round(value, SPEED_DECIMALS) if event.letter == "S" else value
            tokens.append(Token(_PLAIN[event.letter], number, place, line))
        habit = (event.letter, value) == ("M", 1.0) and _before_a_tool(speaking, k)
        idle = (event.letter, value) == ("M", 6.0) and _is_idle(speaking, k)
        place_of = partial(replace, room=room, reach=reach, others=elsewhere, moment=moment, element=event.element)
        tokens[before:] = [place_of(token, habit=habit, idle=idle) for token in tokens[before:]]
        moment += any(token.kind in _PAUSES and not token.habit for token in tokens[before:])
    return tokens


def _before_a_tool(speaking: Sequence[Event], k: int) -> bool:
    """Whether the next word is that of a tool, with no motion between; and there has been one before."""
    event = speaking[k]
    behind = (other for other in speaking[k + 1 :] if (other.letter, other.value) != ("G", 40.0))  # R0 of M91
    following = next(behind, None)
    changes = following is not None and following.letter == "T" and following.element == event.element
    return changes and any(before.letter == "T" for before in speaking[:k])


def _is_idle(speaking: Sequence[Event], k: int) -> bool:
    """Whether the next tool, or the end of the program, comes before any motion."""
    here = speaking[k].element
    ends = (other for other in speaking[k + 1 :] if other.letter == "M" and other.value in (2.0, 6.0, 30.0))
    return next((other.element == here for other in ends), False)


#: letters whose words are tokens as they stand
_PLAIN = {"S": "speed", "H": "offset", "D": "register"}
