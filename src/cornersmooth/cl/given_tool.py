"""Tool and spindle for inputs that name none, such as tables of points: statements before the first pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cornersmooth.errors import SettingsError
from cornersmooth.model import Program, Statement

#: words that load a tool
_LOADS = ("LOADTL", "LOAD", "TURRET", "TOOLNO")


def with_tool(program: Program, number: int | None, spindle: tuple[float, str] | None) -> Program:
    """Return the program with a tool and a spindle speed of its own.

    Parameters
    ----------
    number : int or None
        Of the tool; None where the program keeps its own.
    spindle : (float, str) or None
        Revolutions per minute, and ``CLW`` or ``CCLW``; None as before.

    Raises
    ------
    SettingsError
        CS248: the program has such statements itself.
    """
    line = int(program.line[0]) if len(program) else 0
    given: list[Statement] = []
    if number is not None:
        _refuse(program, _LOADS, "loads a tool", "--tool-number")
        given.append(Statement(0, line, "LOADTL", (float(number),), f"LOADTL/{number}"))
    if spindle is not None:
        speed, direction = spindle
        _refuse(program, ("SPINDL",), "starts the spindle", "--spindle")
        given.append(Statement(0, line, "SPINDL", (speed, direction), f"SPINDL/{speed:g},{direction}"))
    return replace(program, statements=(*given, *program.statements)) if given else program


def _refuse(program: Program, words: Sequence[str], what: str, option: str) -> None:
    own = next((statement for statement in program.statements if statement.word in words), None)
    if own is not None:
        name = program.source.name
        raise SettingsError("CS248", f"the input {what} itself", f"leave out {option}", file=name, line=own.line)
