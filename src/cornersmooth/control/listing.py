"""The stream of a program as text: what the control does in each line, and what it remembers behind it.

``line  block  effects``. Effects are groups with their new values, places and the feed; ``?`` stands for what is not
known from there on. A motion has the place where it ends in full.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

from cornersmooth.control.program import Act, Stream
from cornersmooth.control.state import Rows, State
from cornersmooth.control.table import FRAME

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
