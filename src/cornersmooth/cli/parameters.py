"""What a value on the command line may look like, how it is read, and what a shell offers for it.

Lengths are millimetres; the suffixes ``mm`` and ``in`` are accepted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import click

_LENGTH = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(mm|in|inch|\")?")


if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    _ParamType = click.ParamType[Any]
else:  # click before 8.4 has no type for what it gives
    _ParamType = click.ParamType


class Value(_ParamType):
    """A value that a function reads from text; what its ValueError says is the message, and the name is in the help.

    `complete` gives what a shell offers for a word that has been begun.
    """

    def __init__(self, name: str, read: Callable[[str], Any], complete: Callable[[str], Any] | None = None) -> None:
        self.name, self._read, self._complete = name, read, complete

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Text to the value; what is one already stays."""
        if not isinstance(value, str):
            return value
        try:
            return self._read(value)
        except ValueError as wrong:
            self.fail(str(wrong), param, ctx)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Words that a shell offers."""
        return self._complete(incomplete) if self._complete else []


def _length(text: str) -> float:
    """Text to millimetres."""
    match = _LENGTH.fullmatch(text.strip())
    if not match:
        raise ValueError(f"{text!r} is not a length; write 0.04, 0.04mm or 0.0015in")
    number = float(match[1]) * (1.0 if match[2] in (None, "mm") else 25.4)
    if not (math.isfinite(number) and number > 0.0):
        raise ValueError(f"{text!r} is not a positive length")
    return number


def _duration(text: str) -> float:
    """Text to seconds."""
    match = re.fullmatch(r"(\d+\.?\d*|\.\d+)\s*(s|ms)?", text.strip())
    if not match or not float(match[1]):
        raise ValueError(f"{text!r} is not a time; write 2ms or 0.002s")
    return float(match[1]) * (1e-3 if match[2] == "ms" else 1.0)


def _processes(text: str) -> int:
    """Text to a count; 0 stands for all cores."""
    try:
        number = int(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a number of processes; put a bare -j after the file names") from None
    if number < 0:
        raise ValueError("the number of processes cannot be negative")
    return number


def _spindle(text: str) -> tuple[float, str]:
    """Text to a speed, and CLW or CCLW."""
    number, _, direction = text.partition(",")
    direction = direction.strip().upper() or "CLW"
    try:
        speed = float(number)
    except ValueError:
        speed = math.nan
    if not 0.0 < speed < math.inf or direction not in ("CLW", "CCLW"):
        raise ValueError(f"{text!r} is no speed; give it as 8000 or 8000,CCLW")
    return speed, direction


def _tool(text: str) -> Any:
    from cornersmooth.geometry.tool import parse_tool

    return parse_tool(text)


def _offer(kind: str, incomplete: str) -> list[CompletionItem]:
    """Names of controls or of machines; else files."""
    from click.shell_completion import CompletionItem

    from cornersmooth.kinematics import machine_names
    from cornersmooth.nc import control_names

    names = control_names() if kind == "controls" else machine_names()
    items = [CompletionItem(name) for name in names if name.startswith(incomplete)]
    return items or [CompletionItem(incomplete, type="file")]


Length = Annotated[float, Value("mm", _length)]
Duration = Annotated[float, Value("time", _duration)]
Processes = Annotated[int, Value("n", _processes)]
Spindle = Annotated[tuple[float, str], Value("RPM[,CCLW]", _spindle)]
ToolShape = Annotated[Any, Value("tool", _tool)]
#: names; what they name is loaded when it is needed
ControlName = Annotated[Any, Value("text", str, partial(_offer, "controls"))]
MachineName = Annotated[Any, Value("text", str, partial(_offer, "machines"))]
#: whether a file can be read shows where it is read, with the exit code of inputs
Path = Annotated[str, click.Path(readable=False)]
