"""What the CL file asks for: tool changes, spindle, coolant, stops, dwells and compensation as tokens."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from cornersmooth.model import Ints, Move, Program, Statement
from cornersmooth.nc_reader.word_tables import Means
from cornersmooth.statements.tokens import PAUSES, SPEED_DECIMALS, Token, of_m

#: cutting speeds in mm per minute
_MM_PER_MINUTE = {"SMM": 1000.0, "SFM": 304.8}

#: planes of cutter compensation
_PLANES = {"XYPLAN", "ZXPLAN", "YZPLAN"}

#: one word for those that ask for the same
_ALIKE = {"ON": "FLOOD", "NOMORE": "OFF"}


class Asking:
    """Goes through the CL statements and notes what they ask for. What it cannot interpret asks for nothing.

    What words of the control say (`means_of`) is for AUXFUN.
    """

    def __init__(self, program: Program, means: Means | None = None) -> None:
        self.program, self.means = program, means or {}
        self.tokens: list[Token] = []
        self.place, self.line, self.moment = 0.0, 0, 0
        self.running, self.speed, self.diameter = "CLW", 0.0, 0.0
        self.tool, self.offset, self.offset_at = -1.0, 1.0, (-1, 0)
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
            "STOP": lambda words, numbers, statement: self.say("stop", "STOP"),
            "OPSTOP": lambda words, numbers, statement: self.say("stop", "OPSTOP"),
        }
        if not said & {"LOADTL", "LOAD", "TURRET"}:
            self.handlers["TOOLNO"] = self.load

    @cached_property
    def moving(self) -> Ints:
        """(m,) poses that are moved to."""
        return np.flatnonzero(self.program.kind != Move.FROM)

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

    def say(self, kind: str, value: float | str) -> None:
        """Note a token."""
        self.tokens.append(Token(kind, value, self.place, self.line, moment=self.moment))
        self.moment += kind in PAUSES

    def load(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Change the tool; ADJUST or OSETNO names another length register."""
        if statement.word == "LOAD" and words[:1] != ["TOOL"]:
            return
        registers = [_behind(statement, word) for word in ("ADJUST", "OSETNO")]
        before = ("", *statement.args)
        numbers = [  # what stands behind such a word is no tool
            value
            for k, value in enumerate(statement.args)
            if isinstance(value, float) and before[k] not in ("ADJUST", "OSETNO", "LENGTH")
        ]
        if not numbers and words and words[0][:1] == "T" and words[0][1:].isdigit():
            numbers = [float(words[0][1:])]
        if not numbers or not _whole(numbers[0]):
            return
        offset = next((number for number in registers if number is not None), numbers[0])
        self.tool, self.offset = numbers[0], offset if _whole(offset) else numbers[0]
        self.say("tool", self.tool)
        self.idle_from(statement.pose)
        self.say("offset", self.offset)
        self.offset_at = len(self.tokens) - 1, statement.pose

    def idle_from(self, pose: int) -> None:
        """Let the last offset be optional if nothing moves with its tool before a pose."""
        at, loaded = self.offset_at
        if at >= 0 and np.searchsorted(self.moving, loaded) == np.searchsorted(self.moving, pose):
            self.tokens[at] = replace(self.tokens[at], optional=True)

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
            if numbers in ([], [0.0]):
                self.say("spindle", "ORIENT")
            return
        if {"OFF", "NOMORE"} & set(words) or numbers == [0.0]:
            self.say("spindle", "OFF")
            return
        speed = numbers[0] if numbers else None
        cutting = next((_MM_PER_MINUTE[word] for word in words if word in _MM_PER_MINUTE), None)
        if cutting is not None and speed is not None:
            if not self.diameter > 0:
                return
            speed = float(round(speed * cutting / (math.pi * self.diameter)))
        if {"CLW", "CCLW"} & set(words):
            self.running = "CCLW" if "CCLW" in words else "CLW"
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
        if len(kinds) == 1 and not numbers:
            self.say("coolant", _ALIKE.get(kinds[0], kinds[0]))

    def compensation(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Cutter compensation left, right or off."""
        side = _ALIKE.get(words[0], words[0]) if words else ""
        register = (numbers or [self.offset])[0]
        if side not in ("LEFT", "RIGHT", "OFF") or not set(words[1:]) <= _PLANES or not _whole(register):
            return
        self.say("compensation", side)
        if side != "OFF":
            self.say("register", register)

    def delay(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Wait for seconds or revolutions."""
        if len(numbers) != 1 or numbers[0] <= 0 or words not in ([], ["DWELL"], ["REV"]):
            return
        turns = words == ["REV"]
        if turns and not self.speed:
            return
        seconds = numbers[0] * (60.0 / self.speed if turns else 1.0)
        self.say("dwell", max(1, round(1000.0 * seconds)))

    def cutter(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """Keep the diameter, for cutting speeds."""
        mill = bool({"MILL", "DRILL"} & set(words)) if statement.word == "TLDATA" else len(numbers) > 2
        self.diameter = numbers[0] * self.program.mm_per_unit if mill and numbers else 0.0

    def auxiliary(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """An M word by its number, unless it would end or change more than a word may."""
        if len(numbers) == 1 and not words and _whole(numbers[0]) and numbers[0] not in (2, 6, 30, 98, 99):
            self.say(*of_m(numbers[0], self.means))

    def end(self, words: list[str], numbers: list[float], statement: Statement) -> None:
        """END in the middle of the path is a stop."""
        if len(self.moving) and statement.pose <= self.moving[-1]:
            self.say("stop", "STOP")


def asked(
    program: Program,
    places: Sequence[float],
    end: float,
    means: Means,
    dwells: Sequence[Token] = (),
) -> list[Token]:
    """What the CL statements ask for.

    Parameters
    ----------
    places : sequence of float, mm
        Of the statements, along the path, whose length is `end`.
    means : mapping
        What words of the control say, as of `means_of`.
    dwells : sequence of Token
        What the cycles of holes ask for, in order.
    """
    asking = Asking(program, means)
    for statement, place in zip(program.statements, places, strict=True):
        asking.take(statement, place)
    asking.idle_from(len(program.kind))
    line = max((item.line for item in program.statements if item.word in ("FINI", "END")), default=0)
    tokens = sorted([*dwells, *asking.tokens], key=lambda token: token.place) if dwells else asking.tokens
    return [*tokens, Token("end", "", end, line)]


def _behind(statement: Statement, word: str) -> float | None:
    """Return the number right behind a word."""
    args = statement.args
    place = args.index(word) + 1 if word in args else len(args)
    following = args[place] if place < len(args) else None
    return following if isinstance(following, float) else None


def _whole(number: float) -> bool:
    return 0 <= number < 1e9 and number == int(number)
