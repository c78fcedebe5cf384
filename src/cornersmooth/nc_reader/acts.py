"""What a grammar makes of a block that is no plain motion block: acts, which the reader carries out in their order.

Hole cycles are acts, too: the moves that they mean. A cycle goes over its place in rapid, at the height where the tool
is, down in rapid to where feeding begins, at feed to the bottom, and out again. All that is measured of holes is
measured on these moves.

While a tilted plane is on, the position is that of the plane; what is executed is brought into the part, with the tool
along Z' of the plane. A plane is switched on and off above a retract, where the rotary axes may turn.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple, Self

import numpy as np

from cornersmooth.control.state import State
from cornersmooth.control.table import PRESET
from cornersmooth.control.words import Line, refused
from cornersmooth.model import Floats
from cornersmooth.nc_reader.elements import Elements, Problem
from cornersmooth.nc_reader.execution import Modal
from cornersmooth.nc_reader.rotary import Rotary

#: problem of a plane that is switched on or off where the tool is not above the part
NOT_ABOVE: Final = "CS539"

#: by how many steps of the last digit, beside half a step, rounding along X', Y', Z' may move a tip along X, Y or Z
ASIDE: Final = (math.sqrt(3.0) - 1.0) / 2.0


@dataclass(frozen=True)
class TiltedPlane:
    """A plane that is on."""

    frame: Floats  #: (3, 3): columns: its axes X', Y', Z' in the part
    room: float = 0.0  #: rad: by how much its printed angles leave the tool axis open
    needs: str = ""  #: tool tip control that its motion needs; empty for none
    turned: bool = True  #: whether the rotary axes have been sent to it
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: its zero in the part, in units of the text

    @classmethod
    def by(cls, turns: Sequence[tuple[str, float]], numbers: Sequence[str], **more: Any) -> Self:
        """Plane by turns about its own axes, one after another, by degrees that are printed as numbers."""
        return cls(
            _rotated_frame(turns), math.radians(10.0 ** -min(len(one.partition(".")[2]) for one in numbers)), **more
        )

    @property
    def tool(self) -> Floats:
        """(3,) unit vector of the tool."""
        return self.frame[:, 2]

    def in_part(self, run: Elements, factor: float) -> Elements:
        """Return a run in the coordinates of the part, both in mm; `factor` mm are a unit of the text."""
        out, origin = self.frame.T, factor * np.array(self.origin)
        return replace(
            run,
            tip=run.tip @ out + origin,
            second=np.tile(self.tool, (len(run.kind), 1)),
            arcs=replace(run.arcs, centre=run.arcs.centre @ out + origin, normal=run.arcs.normal @ out),
        )

    def left(self, modal: Modal, *, rotary: bool) -> Modal:
        """Return what holds behind the plane: where the rotary axes stand the text does not say."""
        known = np.array(modal.tip) @ self.frame.T + self.origin  # nothing where any of it is unknown
        second = (math.nan,) * 3 if rotary else tuple(self.tool.tolist())
        return replace(modal, tip=tuple(known.tolist()), second=second)


def _rotated_frame(turns: Sequence[tuple[str, float]]) -> Floats:
    """(3, 3) frame after turns by degrees about its own axes, one after another, as columns."""
    axes = [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])]
    for name, degrees in turns:
        about = "XYZ".index(name)
        one, other = (about + 1) % 3, (about + 2) % 3
        cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        axes[one], axes[other] = (
            cosine * axes[one] + sine * axes[other],
            cosine * axes[other] - sine * axes[one],
        )
    return np.stack(axes, axis=1)


def turned_frame(rotary: Rotary, angles: Sequence[float]) -> Floats | None:
    """(3, 3) frame of the machine in a part that its tables have turned by degrees; None with a head."""
    if any(axis.carrier != "table" for axis in rotary.machine.axes):
        return None
    degrees = np.tile(np.array(angles[:2]), (3, 1))
    frame: Floats = rotary.carried(np.eye(3), degrees).T
    return frame


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

    @classmethod
    def written(cls, match: re.Match[str]) -> HoleCycle:
        """Cycle by its numbers as named groups; depth, setup and above count from the top, the dwell in seconds."""
        given = {name: float(number or 0.0) for name, number in match.groupdict().items()}
        top, pitch = given["top"], given.get("pitch")
        return cls(
            given["travel"] if "travel" in given else top + given["above"],
            top + given["setup"],
            given["bottom"] if "bottom" in given else top + given["depth"],
            given.get("feed", pitch),
            step=given.get("step", 0.0),
            from_clearance=False,
            top=top,
            chip=given.get("out") == 0.0,
            dwell=1000.0 * given.get("dwell", 0.0),
            feed_out="back" in given,
            pitch=pitch,
        )


@dataclass
class Running:
    """What holds between two lines; grammars read it, and set what has no `acts.Act`."""

    machine: State  #: modal groups: the program's own, or those of the line that is read
    modal: Modal
    rotary: Rotary | None = None  #: with the length of the tool in the spindle
    clamped: dict[str, bool] = field(default_factory=dict)  #: rotary axes with a clamp: kept, or words let them turn
    speed: float = math.nan  #: of the spindle
    rigid: bool = False  #: M29 asks the spindle to turn with the feed
    height: float | None = None  #: at which a run of modal cycles began (G98), in units of the program
    cycle: HoleCycle | None = None  #: that a block defines for others to call
    centre: dict[str, float] = field(default_factory=dict)  #: of circles to come
    plane: TiltedPlane | None = None  #: that is on
    left_turned: bool = False  #: a plane that is off again has left the rotary axes where no word says
    #: degrees that rotary axes have turned while the tool axis stands
    idle: Floats = field(default_factory=lambda: np.zeros(2))

    @property
    def tip_control(self) -> str:
        """Words of the tool tip control, or of the tool length, that is on; empty for none."""
        groups, last = self.machine.groups, self.machine.last_words
        if groups["tip"] != "off":
            return " ".join(last[name].text for name in ("tip", "coordinates", "orientation") if name in last)
        length = groups.get("tool_length", PRESET)
        return "" if length in (PRESET, "off", None) else length


class Move(NamedTuple):
    """A motion block; one without position only changes what holds."""

    columns: Mapping[str, float]
    later: bool = False  #: whether it is carried out with those behind it


class Beside(NamedTuple):
    """A word beside the motion, as `elements.Event` has it."""

    letter: str
    value: float
    text: str = ""


class Tilt(NamedTuple):
    """A tilted plane is switched on, or off (None)."""

    plane: TiltedPlane | None
    turn: bool = False  #: neither: the rotary axes turn to the plane that is on


class ToMachine(NamedTuple):
    """Axes go to positions of the machine."""

    axes: str


#: problems are what breaks the rules of the control, or without a code what is not known and bears on the motion
Act = Move | Beside | Tilt | ToMachine | Problem
Acts = Iterator[Act]


def wrong(code: str, line: Line, text: str) -> Problem:
    """What breaks the rules of the control in a line."""
    return Problem(code, 0, line.number, text)


def drill(cycle: HoleCycle, x: float, y: float, line: Line, state: Running) -> Acts:
    """Give out the moves of a cycle at a place.

    Raises
    ------
    InputError
        CS503 where the height at which it begins is not known, or its heights make no hole.
    """
    if not cycle.bottom <= cycle.clearance <= cycle.travel + _ROUNDING:
        raise refused(line, "a cycle whose heights are not one below another", "give them in their order")
    if cycle.step and (cycle.clearance - cycle.bottom) / cycle.step > _MOST_PECKS:
        raise refused(line, f"more than {_MOST_PECKS:,} pecks in one hole", "give a larger step")
    feed_before, free = state.modal.feed, [axis for axis, kept in state.clamped.items() if not kept]
    if free:
        yield wrong("CS538", line, f"a hole cycle while {' and '.join(free)} is not clamped")
    # all moves up to the next event are carried out together
    yield Move({"G": 0.0, "X": x, "Y": y}, later=True)
    yield Move({"G": 0.0, "Z": cycle.clearance}, later=True)
    if cycle.pitch is not None:
        yield Beside("G", 84.0)
        machine, state.machine = state.machine, state.machine.but(feed="revolution")
        if cycle.dwell:
            yield wrong("CS506", line, "a tap that waits at the bottom of its thread")
    feed = {} if cycle.feed is None else {"F": cycle.feed}
    done = cycle.clearance if cycle.from_clearance else cycle.top
    while cycle.step and done - cycle.step > cycle.bottom + _ROUNDING:
        done -= cycle.step
        yield Move({"G": 1.0, "Z": done, **feed}, later=True)
        above = done + _ABOVE * cycle.step
        for height in (above,) if cycle.chip else (cycle.clearance, above):
            yield Move({"G": 0.0, "Z": min(height, cycle.clearance)}, later=True)
    yield Move({"G": 1.0, "Z": cycle.bottom, **feed}, later=True)
    if cycle.dwell:
        yield Beside("G", 4.0, f"{cycle.dwell:.10g}")
    if cycle.feed_out or cycle.pitch is not None:
        yield Move({"G": 1.0, "Z": cycle.clearance}, later=True)
    yield Move({"G": 0.0, "Z": cycle.travel})
    state.modal = replace(state.modal, code=math.nan, feed=feed_before)
    if cycle.pitch is not None:
        state.machine = machine
