"""Arguments of CL statements: words, numbers, revolutions of the spindle as time, tools and where each begins."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.kinematics import Machine, check_travel
from cornersmooth.model import Floats, Ints, Program, Statement

_LONGEST = 86_400_000  #: longest dwell that is written, ms: one day
_MM_PER_MINUTE = {"SFM": 12.0 * 25.4, "SMM": 1000.0}  #: cutting speeds in mm per minute
_LIMITS = ("RANGE", "MAXRPM")  #: words of SPINDL whose number is no speed
GEARS = frozenset(("RANGE", "MAXRPM", "HIGH", "LOW", "MEDIUM"))  #: words of SPINDL about gears and limits of the speed


def numbers_of(statement: Statement) -> list[float]:
    """Numbers of a statement in order."""
    return [value for value in statement.args if isinstance(value, float)]


def words_of(statement: Statement) -> list[str]:
    """Words of a statement in order."""
    return [value for value in statement.args if isinstance(value, str) and value]


def ends(statement: Statement) -> bool:
    """Whether a statement ends what others of its word have begun."""
    return words_of(statement)[:1] in (["OFF"], ["NOMORE"])


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


#: of SPINDL, by the identity of statements: ORIENT, OFF, CLW, CCLW or ON, and the speed, rev/min; None where it is not
#: understood. A cutting speed counts at the cutter before; gears and limits of the speed are the control's own affair.
#: Of CUTCOM: the word, and the diameter of the cutter before, mm
Orders = dict[int, tuple[str, float | None] | None]


def spindle_orders(program: Program) -> Orders:
    """What the statements of a program ask of the spindle, and the cutter."""
    found, diameter = Orders(), 0.0
    for statement in program.statements:
        if statement.word in ("CUTTER", "TLDATA"):
            numbers = numbers_of(statement)
            mill = statement.word == "CUTTER" or {"MILL", "DRILL"} & set(words_of(statement))
            diameter = numbers[0] * program.mm_per_unit if mill and numbers else 0.0
        elif statement.word == "SPINDL":
            found[id(statement)] = _spindle_order(statement, diameter)
        elif statement.word == "CUTCOM":
            found[id(statement)] = statement.word, diameter
    return found


def _spindle_order(statement: Statement, diameter: float) -> tuple[str, float | None] | None:
    """What one SPINDL asks for, as of `Orders`, at a diameter in mm."""
    words, numbers = set(words_of(statement)), numbers_of(statement)
    if words & set(_LIMITS):
        words -= GEARS
        for number in (value for word in _LIMITS for value in number_after(statement, word)):
            numbers.remove(number)
    known = words <= {"RPM", "CLW", "CCLW", "ON", "OFF", "SFM", "SMM", "LOCK", "ORIENT", "NOMORE"}
    if not known or len(numbers) > 1 or any(number < 0.0 for number in numbers):
        return None
    if words & {"LOCK", "ORIENT"}:
        return ("ORIENT", None) if numbers in ([], [0.0]) else None
    if words & {"OFF", "NOMORE"} or numbers == [0.0]:
        return "OFF", None
    unit = cutting_unit(statement)
    if numbers and unit and not diameter > 0.0:
        return None
    speeds = [float(round(value * _MM_PER_MINUTE[unit] / (math.pi * diameter))) if unit else value for value in numbers]
    return next((word for word in ("CCLW", "CLW") if word in words), "ON"), next(iter(speeds), None)


def cutting_unit(statement: Statement) -> str:
    """Unit of a cutting speed; empty where the number is one of revolutions."""
    return next((unit for unit in _MM_PER_MINUTE if unit in statement.args), "")


TOOL_WORDS: Final = frozenset({"LOADTL", "LOAD", "TURRET"})  #: words that load a tool
_REGISTERS: Final = ("ADJUST", "OSETNO")  #: words of `TOOL_WORDS` with the number of a length register
_WAITING: Final = frozenset({"STOP", "OPSTOP", "DELAY"})  #: words at which the program waits for time or the operator


def loaded_tool(statement: Statement) -> tuple[int, int] | None:
    """Tool and length register of LOADTL/n, LOAD/TOOL,n[,ADJUST,m], TURRET/n[,OSETNO,m]; None where it loads none.

    A number after ADJUST, OSETNO or LENGTH is no tool: LOADTL/ADJUST,3 names none.
    """
    words = words_of(statement)
    if statement.word == "LOAD" and words[:1] != ["TOOL"]:
        return None
    registers = [value for word in _REGISTERS for value in number_after(statement, word)]
    behind = pairwise(("", *statement.args))
    numbers = [value for word, value in behind if isinstance(value, float) and word not in (*_REGISTERS, "LENGTH")]
    if not numbers and statement.word == "LOADTL" and words and words[0][:1] == "T" and words[0][1:].isdigit():
        numbers = [float(words[0][1:])]
    number = whole_number(numbers[:1])
    if number is None:
        return None
    if len(numbers) == 4 and not numbers[1]:  # LOADTL/tool,0,length,register of Autodesk's ISO 4343 post
        registers.append(numbers[3])
    offset = whole_number(registers[:1])
    return number, number if offset is None else offset


def tool_loads(program: Program) -> list[tuple[Statement, tuple[int, int]]]:
    """Statements that load a tool, with tool and length register: TOOLNO where no other word does."""
    words = TOOL_WORDS if TOOL_WORDS & {statement.word for statement in program.statements} else {"TOOLNO"}
    loads = [(statement, loaded_tool(statement)) for statement in program.statements if statement.word in words]
    return [(statement, tool) for statement, tool in loads if tool is not None]


def ahead_of_tools(program: Program) -> frozenset[int]:
    """Last statements of each word ahead of the first tool, if no motion and no wait comes before it; by identity."""
    found: dict[str, int] = {}
    for statement in program.statements:
        if statement.pose > program.statements[0].pose or statement.word in _WAITING:
            return frozenset()
        if statement.word in TOOL_WORDS and loaded_tool(statement) is not None:
            return frozenset(found.values())
        found[statement.word] = id(statement)
    return frozenset()


def tool_starts(program: Program) -> list[int]:
    """Poses at which another tool begins, the first pose among them; ascending."""
    starts, tool = [0], None
    for statement, loaded in tool_loads(program):
        if loaded != tool:
            starts.append(statement.pose)
            tool = loaded
    return sorted({min(pose, len(program)) for pose in starts})


def check_tool_travel(program: Program, machine: Machine, tip: Floats, angles: Floats, move: Ints) -> None:
    """Refuse rows (r,) of poses, tips in mm and angles in degrees, that the linear axes cannot reach (CS374).

    Each tool has its own length.
    """
    loads = tool_loads(program) if machine.travel and machine.tool_lengths else []
    numbers = np.array([-1, *(number for _, (number, _) in loads)], np.int64)
    tools = numbers[np.searchsorted(np.array([load.pose for load, _ in loads], np.int64), move, side="right")]
    for number in np.unique(tools).tolist():
        rows, file = tools == number, program.source.name
        check_travel(machine.with_tool(number), tip[rows], angles[rows], program.line[move[rows]], file)
