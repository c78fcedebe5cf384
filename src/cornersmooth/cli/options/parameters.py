"""What a value on the command line may look like, and how it is read.

Lengths are millimetres; the suffixes ``mm`` and ``in`` are accepted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import Any

import click

from cornersmooth.cli.headings import Decorator

_LENGTH = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(mm|in|inch|\")?")


class Length(click.ParamType[float]):
    """A length in mm, or in inches with the suffix ``in``."""

    name = "mm"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Text to millimetres."""
        if isinstance(value, float):
            return value
        match = _LENGTH.fullmatch(str(value).strip())
        if not match:
            self.fail(f"{value!r} is not a length; write 0.04, 0.04mm or 0.0015in", param, ctx)
        number = float(match[1]) * (1.0 if match[2] in (None, "mm") else 25.4)
        if not (math.isfinite(number) and number > 0.0):
            self.fail(f"{value!r} is not a positive length", param, ctx)
        return number


class Duration(click.ParamType[float]):
    """A time in seconds, or with a suffix ``s``, ``ms``."""

    name = "time"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Text to seconds."""
        if isinstance(value, float):
            return value
        match = re.fullmatch(r"(\d+\.?\d*|\.\d+)\s*(s|ms)?", str(value).strip())
        if not match or not float(match[1]):
            self.fail(f"{value!r} is not a time; write 2ms or 0.002s", param, ctx)
        return float(match[1]) * (1e-3 if match[2] == "ms" else 1.0)


class Weights(click.ParamType[tuple[float, float]]):
    """Two positive numbers with a comma between."""

    name = "w1,w2"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        """Text to two numbers."""
        if isinstance(value, tuple):
            return value
        try:
            first, second = (float(part) for part in str(value).split(","))
        except ValueError:
            self.fail(f"{value!r} is not two numbers; write 1,0.7", param, ctx)
        return first, second


class Jobs(click.ParamType[int]):
    """A number of processes."""

    name = "n"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Text to a count; 0 stands for all cores."""
        try:
            number = int(value)
        except ValueError:
            self.fail(f"{value!r} is not a number of processes; put a bare -j after the file names", param, ctx)
        if number < 0:
            self.fail("the number of processes cannot be negative", param, ctx)
        return number


class ToolShape(click.ParamType[Any]):
    """The shape of a tool: numbers with commas between."""

    name = "tool"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Text to a `Tool`."""
        from cornersmooth.surface.tool import parse_tool

        return parse_tool(value) if isinstance(value, str) else value


LENGTH = Length()
#: whether a file can be read is said where it is read, with the exit code of inputs
PATH = click.Path(readable=False)


def all_of(function: Callable[..., Any], options: Iterable[Decorator]) -> Callable[..., Any]:
    """Give a command several options, in this order."""
    for option in reversed(list(options)):
        function = option(function)
    return function
