"""Hole cycles of controls as the moves that they mean.

A cycle goes over its place in rapid, at the height where the tool is, down in rapid to where feeding begins, at feed to
the bottom, and out again. Everything that is measured of holes is measured on these moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cornersmooth.nc_reader.words import Line

if TYPE_CHECKING:
    from cornersmooth.nc_reader.reader import Reader

#: share of a peck that the tool stays above the last depth when it comes back
_ABOVE: Final = 0.05

#: by how much the sum of two printed heights may be off, in units of the text
_ROUNDING: Final = 1e-9

#: more pecks in one hole are not carried out
_MOST_PECKS: Final = 10_000


@dataclass(frozen=True)
class HoleCycle:
    """A hole cycle, in units of the text; heights are those of Z."""

    travel: float  #: where the tool goes in the end
    clearance: float  #: where feeding begins
    bottom: float
    feed: float | None = None  #: In units of F; None for the one in force.
    step: float = 0.0  #: of a peck; 0 for one feed
    from_clearance: bool = True  #: whether pecks are counted from `clearance`, or from `top`
    top: float = 0.0
    chip: bool = False  #: whether a peck only moves up a little
    dwell: float = 0.0
    feed_out: bool = False
    pitch: float | None = None  #: of a tap, per revolution


def drill(cycle: HoleCycle, x: float, y: float, line: Line, state: Reader) -> None:
    """Carry out a cycle at a place.

    Raises
    ------
    InputError
        CS503 where the height at which it begins is not known, or its heights make no hole.
    """
    if not cycle.bottom <= cycle.clearance <= cycle.travel + _ROUNDING:
        state.refuse(line, "a cycle whose heights are not one below another", "give them in their order")
    if cycle.step and (cycle.clearance - cycle.bottom) / cycle.step > _MOST_PECKS:
        state.refuse(line, "a cycle of more pecks than anybody wants", "give a larger step")
    free = [axis for axis, clamped in state.memory.clamped.items() if not clamped]
    if free:
        state.wrong("CS538", line, f"a hole cycle while {' and '.join(free)} is not clamped")
    before = state.modal
    # all moves up to the next event are carried out together
    state.move(line, {"G": 0.0, "X": x, "Y": y}, later=True)
    state.move(line, {"G": 0.0, "Z": cycle.clearance}, later=True)
    if cycle.pitch is not None:
        state.event(line, "G", 84.0)
        state.change(line, per_revolution=True)
    feed = {} if cycle.feed is None else {"F": cycle.feed}
    done = cycle.clearance if cycle.from_clearance else cycle.top
    while cycle.step and done - cycle.step > cycle.bottom + _ROUNDING:
        done -= cycle.step
        state.move(line, {"G": 1.0, "Z": done, **feed}, later=True)
        above = done + _ABOVE * cycle.step
        for height in (above,) if cycle.chip else (cycle.clearance, above):
            state.move(line, {"G": 0.0, "Z": min(height, cycle.clearance)}, later=True)
    state.move(line, {"G": 1.0, "Z": cycle.bottom, **feed}, later=True)
    if cycle.dwell:
        state.event(line, "G", 4.0, f"{cycle.dwell:.10g}")
    if cycle.feed_out or cycle.pitch is not None:
        state.move(line, {"G": 1.0, "Z": cycle.clearance}, later=True)
    state.move(line, {"G": 0.0, "Z": cycle.travel})
    state.change(line, code=math.nan, feed=before.feed, per_revolution=before.per_revolution)


def numbers(text: str) -> list[float | None]:
    """Arguments of a call, None for those that are left out; raises ValueError for what is no number."""
    return [float(part) if part.strip() else None for part in text.split(",")]
