"""Arguments of CL statements: words, numbers, revolutions of the spindle as time; statements that stand for poses."""

from __future__ import annotations

import math

import numpy as np

from cornersmooth.model import Move, Program, Statement

#: longest dwell that is written, ms: one day
_LONGEST = 86_400_000

#: cutting speeds in mm per minute
_MM_PER_MINUTE = {"SMM": 1000.0, "SFM": 12.0 * 25.4}

#: words of SPINDL whose number is no speed
_LIMITS = ("RANGE", "MAXRPM")

#: words of SPINDL about gears and limits of the speed
GEARS = frozenset(("RANGE", "MAXRPM", "HIGH", "LOW", "MEDIUM"))


def numbers_of(statement: Statement) -> list[float]:
    """Numbers of a statement in order."""
    return [value for value in statement.args if isinstance(value, float)]


def words_of(statement: Statement) -> list[str]:
    """Words of a statement in order."""
    return [value for value in statement.args if isinstance(value, str) and value]


def number_after(statement: Statement, word: str) -> list[float]:
    """Return the number that stands after a word, if any."""
    args = statement.args
    place = args.index(word) + 1 if word in args else len(args)
    return [value for value in args[place : place + 1] if isinstance(value, float)]


def whole_number(numbers: list[float]) -> int | None:
    """Return the only number, where it is a whole one that is not negative."""
    if len(numbers) != 1 or not 0.0 <= numbers[0] < 1e9 or numbers[0] != int(numbers[0]):
        return None
    return int(numbers[0])


def spoken_text(statement: Statement) -> str:
    """Text of a text statement without its word and quotes."""
    text = statement.args[0] if statement.args and isinstance(statement.args[0], str) else statement.text
    text = text.strip()
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] == "'" else text


def with_starts(program: Program) -> tuple[Statement, ...]:
    """Statements of the program, and one for every FROM, which is a pose there, after what stands before it."""
    starts = np.flatnonzero(program.kind == Move.FROM).tolist()
    if not starts:
        return program.statements
    stated = [
        Statement(pose, int(program.line[pose]), "FROM", tuple((program.tip[pose] / program.mm_per_unit).tolist()))
        for pose in starts
    ]
    return tuple(sorted((*program.statements, *stated), key=lambda one: (one.pose, one.word == "FROM")))


def milliseconds(amount: float, in_revolutions: bool, speed: float | None) -> int | None:
    """Return a dwell of seconds, or of revolutions at a speed per minute, in whole ms; None where none is known."""
    if in_revolutions:
        if not speed:
            return None
        amount *= 60.0 / speed
    time = 1000.0 * amount
    if not (math.isfinite(time) and 0.0 <= time <= _LONGEST):
        return None
    return max(1, round(time)) if time > 0.0 else 0


def revolutions(cutting_speed: float, unit: str, diameter: float) -> float | None:
    """Revolutions per minute that give a cutting speed (SFM, SMM) at a diameter in mm; None without a diameter."""
    if not diameter > 0.0:
        return None
    return cutting_speed * _MM_PER_MINUTE[unit] / (math.pi * diameter)


def spindle_args(statement: Statement) -> tuple[list[str], list[float]]:
    """Words and numbers of SPINDL without gears and limits, which are the control's own affair."""
    words, numbers = words_of(statement), numbers_of(statement)
    for word in _LIMITS:
        if word in words:
            words = [other for other in words if other not in GEARS]
            for number in number_after(statement, word):
                numbers.remove(number)
    return words, numbers


def cutting_unit(words: list[str]) -> str:
    """Unit of a cutting speed; empty where the number is one of revolutions."""
    return next((unit for unit in ("SFM", "SMM") if unit in words), "")
