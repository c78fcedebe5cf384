"""A machine with up to two rotary axes: where they sit, which way they count, how far they go.

Machines are described by TOML text: those that come with the program, and the user's own.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeVar

import numpy as np

from cornersmooth.arrays import unit as unit_vector
from cornersmooth.errors import SettingsError
from cornersmooth.model import Floats
from cornersmooth.tables import Shelf, Table

LINEAR = ("X", "Y", "Z")  #: addresses of the linear axes


@dataclass(frozen=True)
class Travel:
    """Lowest and highest position of a linear axis."""

    name: str
    #: low, high: mm; of the spindle nose with the heads at zero, in the coordinates in which the points of the tables
    #: are given
    low: float
    high: float

    def __post_init__(self) -> None:
        what = f"travel of {self.name} is {self.low:g} and {self.high:g}"
        _need(-math.inf < self.low < self.high < math.inf, what, "give the lower one first, in mm")


@dataclass(frozen=True)
class Dynamics:
    """Limits of one axis of a machine, linear or rotary; infinite where there is none."""

    name: str
    velocity: float = math.inf  #: mm/min or deg/min
    acceleration: float = math.inf  #: mm/s² or deg/s²
    jerk: float = math.inf  #: mm/s³ or deg/s³

    def __post_init__(self) -> None:
        for key in ("velocity", "acceleration", "jerk"):
            value = getattr(self, key)
            _need(value > 0.0, f"dynamics of {self.name}: {key} is {value:g}", "give a positive number")

    @property
    def linear(self) -> bool:
        """Whether lengths are meant, not angles."""
        return self.name in LINEAR

    @property
    def per_second(self) -> tuple[float, float, float]:
        """Velocity, acceleration and jerk in mm or degrees per s, s², s³."""
        return self.velocity / 60.0, self.acceleration, self.jerk

    def describe(self) -> str:
        """One line for people."""
        unit = "mm" if self.linear else "deg"
        limits = ((self.velocity, "min"), (self.acceleration, "s2"), (self.jerk, "s3"))
        described = ", ".join(f"{value:g} {unit}/{per}" for value, per in limits if math.isfinite(value))
        return f"{self.name} up to {described}" if described else f"{self.name} without limits"


Vector = tuple[float, float, float]
PARALLEL = 1e-3  #: Two directions closer than this (rad) count as parallel: no second rotary axis can do its work then.


@dataclass(frozen=True)
class RotaryAxis:
    """One rotary axis at the position where both rotary axes stand at zero."""

    name: str  #: the address of its word in the NC text
    direction: Vector  #: along the axis, any length but zero
    #: whether it carries the part or the tool; none where it only stands for one that the machine has not
    carrier: Literal["table", "head", "none"]
    #: mm; a point on the axis: in machine coordinates for a table, from the spindle nose for a head
    point: Vector = (0.0, 0.0, 0.0)
    #: what turns right-handed about `direction` when the word grows: the tool as seen from the part (ISO 841), or the
    #: table itself (LinuxCNC's trunnions). For a head both are the same, and only ``"tool"`` is accepted.
    positive: Literal["tool", "table"] = "tool"
    #: degrees; lowest and highest word; None for an axis that turns without end
    limits: Annotated[tuple[float, float], "write limits = [lowest, highest] in degrees"] | None = None
    modulo: bool = False  #: whether its words are from 0 to 360 degrees, and it goes the shorter way to each
    #: M words that hold it, and let it turn
    clamp: Annotated[tuple[str, str], 'give two M words, as in ["M10", "M11"]'] | None = None

    def __post_init__(self) -> None:
        where = f"rotary axis {self.name}"
        if self.carrier == "none":
            return
        _need(self.name in ("A", "B", "C"), f"rotary axis name {self.name!r} is not an address", "use A, B or C")
        _need(self.carrier in ("table", "head"), f"{where}: carrier is {self.carrier!r}", "use table or head")
        turns = ("tool",) if self.carrier == "head" else ("tool", "table")
        _need(self.positive in turns, f"{where}: positive is {self.positive!r}", f"use {' or '.join(turns)}")
        _check_vectors(where, direction=self.direction, point=self.point)
        _need(any(self.direction), f"{where}: direction is zero", "give a vector along the axis")
        m_words = all(re.fullmatch(r"M[1-9]\d{0,3}", word) for word in self.clamp or ())
        _need(m_words, f"{where}: clamp is {self.clamp!r}", 'give two M words, as in ["M10", "M11"]')
        if self.limits is not None:
            _need(not self.modulo, f"{where}: a modulo axis with limits", "leave out one of both")
            what = f"{where}: limits are {self.low:g} and {self.high:g}"
            _need(-math.inf < self.low < self.high < math.inf, what, "give the lower one first, in degrees")

    @property
    def sign(self) -> float:
        """+1 where a growing word turns the tool right-handed about `direction` as seen from the part, else -1."""
        return 1.0 if self.positive == "tool" else -1.0

    @cached_property
    def unit(self) -> Floats:
        """(3,) unit vector along the axis."""
        return unit_vector(np.array(self.direction))

    @property
    def low(self) -> float:
        """Lowest word, degrees; -inf for an endless axis."""
        return -math.inf if self.limits is None else self.limits[0]

    @property
    def high(self) -> float:
        """Highest word, degrees; inf for an endless axis."""
        return math.inf if self.limits is None else self.limits[1]


_SWITCH: Final = r"[MG][1-9]\d*(\.\d)?( P\d+)?"  #: block that switches tip control of the kinematics
_NO_AXIS: Final = RotaryAxis("", (0.0, 0.0, 1.0), "none")  #: stands for a rotary axis that a machine has not


@dataclass(frozen=True)
class Machine:
    """Up to two rotary axes between the part and the tool; three linear axes along X, Y and Z."""

    name: str
    #: in the order in which they are met on the way from the part to the tool: for two tables the one that carries the
    #: part first, for two heads the one that carries the tool last. Those that a machine has not are made up to two by
    #: axes whose carrier is none, which never turn: angles are pairs on every machine.
    axes: tuple[RotaryAxis, ...]
    description: str = ""  #: one line for lists
    #: name of an axis and the sign (+1, -1) that it prefers where a program starts
    preferred: tuple[str, float] | None = None
    tool_direction: Vector = (0.0, 0.0, 1.0)  #: from the tip to the spindle with both rotary axes at zero
    #: mm; from the spindle nose to the tip; matters for heads without tool centre point control only
    tool_length: float = 0.0
    #: mm; where the zero of the part sits in the coordinates in which the points of the tables are given
    part_zero: Vector = (0.0, 0.0, 0.0)
    dynamics: tuple[Dynamics, ...] = ()  #: limits of any of the five axes; only the planning of the time asks for them
    #: how far any of X, Y and Z goes; what is written is checked against it (`check_travel`)
    travel: tuple[Travel, ...] = ()
    #: mm; the same by number of tool, for those that `tool_length` is not for
    tool_lengths: tuple[tuple[int, float], ...] = ()
    #: home, tool_change: axes and where they go in machine coordinates, mm or degrees, for retracts and the end of a
    #: program, and for a change of tool; the control's own words where there are none
    home: tuple[tuple[str, float], ...] = ()
    tool_change: tuple[tuple[str, float], ...] = ()
    #: blocks that switch on and off what keeps the tip, for controls whose kinematics do; empty where these always do;
    #: None where that is not known
    tip_control: Annotated[tuple[str, ...], 'give two blocks, as in ["M428", "M429"], or [] for none'] | None = None

    def __post_init__(self) -> None:
        where = f"machine {self.name}"
        _need(len(self.axes) <= 2, f"{where} has {len(self.axes)} rotary axes", "describe two at most")
        _check_vectors(where, tool_direction=self.tool_direction, part_zero=self.part_zero)
        _need(any(self.tool_direction), f"{where}: tool_direction is zero", "give a vector along the tool")
        for length in (self.tool_length, *dict(self.tool_lengths).values()):
            _need(0 <= length < math.inf, f"{where}: tool_length is {length:g}", "give 0 mm or more")
        object.__setattr__(self, "axes", (*self.axes, _NO_AXIS, _NO_AXIS)[:2])
        if len(self.names) == 2:
            self._check_pair(where, *self.axes)
        along_z = bool(self.names) or _parallel(self.tool, np.array((0.0, 0.0, 1.0)))
        hint = "leave out tool_direction: the tool is along Z"
        _need(along_z, f"{where}: no rotary axis, and a tool_direction that is not Z", hint)
        if self.preferred is not None:
            signed = [name + sign for name in self.names for sign in "+-"]
            hint = f"use {', '.join(signed[:-1])} or {signed[-1]}" if signed else "leave it out"
            known = self.preferred[0] in self.names and abs(self.preferred[1]) == 1.0
            _need(known, f"{where}: preferred names {self.preferred[0]!r}", hint)
        switch = self.tip_control or ()
        blocks = len(set(switch)) in (0, 2) and all(re.fullmatch(_SWITCH, block) for block in switch)
        hint = 'give the blocks that switch it on and off, as in ["M428", "M429"], or [] for none'
        _need(blocks, f"{where}: tip_control is {list(switch)!r}", hint)
        spans = {one.name: (one.low, one.high) for one in self.axes}
        spans |= {one.name: (one.low, one.high) for one in self.travel}
        for key, position in (("home", self.home), ("tool_change", self.tool_change)):
            for name, value in position:
                low, high = spans.get(name, (-math.inf, math.inf))
                hint = "give positions of the machine's axes that they can go to"
                _need(math.isfinite(value) and low <= value <= high, f"{where}: {key}: {name} is {value:g}", hint)
        known_axes = (*LINEAR, *self.names)
        for item in self.dynamics:
            what = f"{where}: dynamics of {item.name}, which it has not"
            _need(item.name in known_axes, what, f"use {', '.join(known_axes)}")

    def _check_pair(self, where: str, first: RotaryAxis, second: RotaryAxis) -> None:
        """Refuse two axes that do not make a machine."""
        one, two = first.name, second.name
        _need(one != two, f"{where}: both rotary axes are called {one}", "give two names")
        what = f"{where}: the head axis {one} comes before the table axis {two}"
        _need((first.carrier, second.carrier) != ("head", "table"), what, "list the axes from the part to the tool")
        what = f"{where}: {one} and {two} are parallel"
        _need(not _parallel(first.unit, second.unit), what, "give two different directions")
        hint = "check the directions and their order, from the part to the tool"
        _need(not _parallel(second.unit, self.tool), f"{where}: {two} turns the tool about itself", hint)

    def with_tool(self, number: int | None) -> Machine:
        """Return the machine with the length of a tool; None for one that is not known."""
        length = dict(self.tool_lengths).get(-1 if number is None else number, self.tool_length)
        return self if length == self.tool_length else replace(self, tool_length=length)

    def with_longest_tool(self) -> Machine:
        """Return the machine with the tool that a turn of the head moves most."""
        return replace(self, tool_length=max((self.tool_length, *dict(self.tool_lengths).values())))

    @cached_property
    def tool(self) -> Floats:
        """(3,) unit vector from the tip to the spindle with both rotary axes at zero."""
        return unit_vector(np.array(self.tool_direction))

    @property
    def names(self) -> tuple[str, ...]:
        """Addresses of the rotary words, from the part to the tool: as many as there are axes."""
        return tuple(axis.name for axis in self.axes if axis.carrier != "none")

    @property
    def limits(self) -> Floats:
        """(2, 2) lowest and highest word of each axis, degrees; infinite where there is none."""
        return np.array([(axis.low, axis.high) for axis in self.axes])

    @property
    def modulo(self) -> tuple[str, ...]:
        """Names of the axes whose words are from 0 to 360 degrees."""
        return tuple(axis.name for axis in self.axes if axis.modulo)

    @property
    def kind(self) -> str:
        """``"table-table"``, ``"table-head"``, ``"head-head"``, ``"table"``, ``"head"`` or ``""``."""
        return "-".join(axis.carrier for axis in self.axes if axis.carrier != "none")

    @property
    def swings_the_tool(self) -> bool:
        """Whether a rotary axis in the head moves the tip by the length of the tool."""
        return any(axis.carrier == "head" for axis in self.axes)

    def turns_like(self, other: Machine) -> bool:
        """Whether the same words bring tools of the same length to the same place."""
        shapes = (
            [(axis.name, axis.carrier, axis.direction, axis.point, axis.positive) for axis in machine.axes]
            for machine in (self, other)
        )
        alike = self.tool_direction == other.tool_direction and self.part_zero == other.part_zero
        return alike and next(shapes) == next(shapes)

    def describe(self) -> str:
        """Text of a few lines for people."""
        lines = [f"{self.name}: {self.description}" if self.description else self.name]
        if not self.names:
            lines.append("  no rotary axis: the tool is along Z")
        places = (", nearest to the part", ", nearest to the tool") if len(self.names) == 2 else ("",)
        for axis, place in zip(self.axes[: len(self.names)], places, strict=False):
            span = "without end" if axis.limits is None else f"from {axis.low:g} to {axis.high:g} deg"
            about, through = (", ".join(f"{x:.6g}" for x in vector) for vector in (axis.unit, axis.point))
            where = f"  {axis.name} in the {axis.carrier}{place}: about ({about}) through ({through}) mm"
            lines.append(f"{where}, {span}, positive turns the {axis.positive}")
        if self.preferred is not None:
            lines.append(f"  starts with {self.preferred[0]} {'positive' if self.preferred[1] > 0 else 'negative'}")
        if self.swings_the_tool:
            lines.append(f"  tool length {self.tool_length:g} mm")
        if any(self.part_zero):
            lines.append(f"  zero of the part at ({', '.join(f'{number:g}' for number in self.part_zero)}) mm")
        lines += [f"  {item.name} from {item.low:g} to {item.high:g} mm" for item in self.travel]
        if self.tip_control:
            lines.append("  tip control of the kinematics on by {}, off by {}".format(*self.tip_control))
        for key, position in (("home", self.home), ("tool change", self.tool_change)):
            described = " ".join(f"{name}{value:g}" for name, value in position)
            lines += [f"  {key} at {described} of the machine"] * bool(position)
        lines += [f"  {item.describe()}" for item in self.dynamics]
        return "\n".join(lines)


def with_dynamics(machine: Machine | None) -> Machine | None:
    """Return the machine where it says how fast its axes may go; otherwise the tip alone has limits."""
    return machine if machine is not None and machine.dynamics else None


def check_dynamics(machine: Machine, names: Iterable[str]) -> None:
    """Refuse a machine without velocity or acceleration of some axes that move (SettingsError CS263)."""
    known = {item.name for item in machine.dynamics if math.isfinite(item.velocity + item.acceleration)}
    if missing := [f"[dynamics.{name}]" for name in names if name not in known]:
        what = f"machine {machine.name} lacks {' and '.join(missing)}, with velocity and acceleration"
        raise SettingsError("CS263", what, "add them to the file: the program moves these axes")


def endless(machine: Machine) -> Machine:
    """Return the machine with rotary axes that turn without end: for plans of texts that turn back by themselves."""
    return replace(machine, axes=tuple(replace(axis, limits=None) for axis in machine.axes))


def _need(good: bool, what: str, hint: str) -> None:
    """Refuse what does not make a machine: CS253."""
    if not good:
        raise SettingsError("CS253", what, hint)


def _check_vectors(where: str, **vectors: Vector) -> None:
    for key, vector in vectors.items():
        point = len(vector) == 3 and all(map(math.isfinite, vector))
        _need(point, f"{where}: {key} is not a point of space", "give three numbers")


def _parallel(one: Floats, other: Floats) -> bool:
    return float(np.linalg.norm(np.cross(one, other))) < PARALLEL


Row = TypeVar("Row")
_SHELF = Shelf(
    "machine",
    Path(__file__).with_name("machines"),
    keys=(
        *("name", "description", "preferred", "tool_direction", "tool_length", "tool_lengths", "part_zero", "travel"),
        *("home", "tool_change", "tip_control", "axis", "dynamics"),
    ),
    unknown="CS250",
    unreadable="CS251",
    unknown_key="CS252",
    wrong_value="CS253",
)


machine_names, machine_table = _SHELF.names, _SHELF.built_in


def load_machine(name_or_path: str | Path) -> Machine:
    """Machine of that name, or described by that TOML file.

    A text that ends in ``.toml`` or holds a path separator is a file; anything else is a name.

    Returns
    -------
    Machine
        Axes, travel and limits in mm, degrees and minutes or seconds as its fields name them.

    Raises
    ------
    SettingsError
        The name is unknown (with the closest known one), the file cannot be read, or it does not describe a machine.
    """
    text, file, name = _SHELF.choose(name_or_path)
    return parse_machine(text, file=file, name=name)


def parse_machine(text: str | Table, *, file: str = "<machine>", name: str = "machine") -> Machine:
    """Machine that a TOML text, or a table read from one, describes; its keys are in docs/machines.md.

    `file` is for messages, `name` for a text that has none. SettingsError: the text is not TOML, has an unknown key
    (with the closest known one), or does not describe a machine.
    """
    with _SHELF.in_file(file):
        table, _ = _SHELF.parse(text)
        entries = table.get("axis", [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise _SHELF.wrong("axis is not a list of tables", "write [[axis]] for each")
        if len(entries) > 2:
            raise _SHELF.wrong(f"{len(entries)} rotary axes are described", "write [[axis]] twice at most")
        if "axis" not in table:
            raise _SHELF.wrong("no rotary axis is described", "write [[axis]], or axis = [] for a machine without")
        axes = tuple(_axis(entry, f"axis {number}") for number, entry in enumerate(entries, start=1))
        names = [axis.name for axis in axes]
        position = _named((*LINEAR, *sorted(names)), lambda name, value, at: (name, _SHELF.number(value, at)))
        return _SHELF.record(
            Machine,
            {"name": name} | {key: value for key, value in table.items() if key != "axis"},
            "",
            given={"axes": axes},
            preferred=_preferred,
            dynamics=_named((*LINEAR, *names), _dynamics),
            travel=_named(LINEAR, _travel),
            tool_lengths=_tool_lengths,
            home=position,
            tool_change=position,
        )


def _axis(entry: Table, where: str) -> RotaryAxis:
    if entry.get("carrier") == "none":  # which stands for axes that are not there
        raise _SHELF.wrong(f"{where}.carrier is 'none'", "use table or head")
    return _SHELF.record(RotaryAxis, entry, where, carrier=_SHELF.text, positive=_SHELF.text)


def _tool_lengths(given: Any, where: str) -> tuple[tuple[int, float], ...]:
    if not isinstance(given, dict) or not all(name.isdecimal() for name in given):
        raise _SHELF.wrong(f"{where} is not a table by number of tool", f"write [{where}] and 3 = 120.5 below")
    return tuple((int(name), _SHELF.number(value, f"{where}.{name}")) for name, value in given.items())


def _named(names: Sequence[str], read: Callable[[str, Any, str], Row]) -> Callable[[Any, str], tuple[Row, ...]]:
    """Reader of a table by names of axes: a row of each that it has, in the order of the names."""

    def rows(given: Any, where: str) -> tuple[Row, ...]:
        _SHELF.check_keys(_SHELF.table(given, where), names, f"{where}.")
        return tuple(read(name, given[name], f"{where}.{name}") for name in names if name in given)

    return rows


def _travel(name: str, value: Any, where: str) -> Travel:
    return Travel(name, *_SHELF.numbers(value, where, count=2, hint=f"write {name} = [lowest, highest] in mm"))


def _dynamics(name: str, value: Any, where: str) -> Dynamics:
    return _SHELF.record(Dynamics, value, where, given={"name": name})


def _preferred(value: Any, where: str) -> tuple[str, float]:
    if not isinstance(value, str) or len(value) != 2 or value[1] not in "+-":
        raise _SHELF.wrong(f"{where} is {value!r}", 'write an axis and its sign, as in preferred = "A+"')
    return value[0], 1.0 if value[1] == "+" else -1.0
