"""Positions of the machine in a text: those of its file, where tools are changed and where the program ends."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Set
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cornersmooth.control.table import Table

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: printed digits by which angles may differ, degrees
SAME: Final = 1e-5

#: digits by which a position may be off
_ROOM: Final = 5e-4


class MachinePositions:
    """Follows the machine's axes through blocks that name positions of the machine.

    Parameters
    ----------
    machine : Machine or None
        Without positions, or without a machine, none are required.
    mm_per_unit : float
        Of the text.
    switches : bool
        `Dialect.switches`.
    tcp : bool
        Whether words are those of the tip.
    """

    def __init__(
        self, machine: Machine | None, mm_per_unit: float, *, switches: bool = False, tcp: bool = True
    ) -> None:
        positions = {} if machine is None else {"home": machine.home, "change": machine.tool_change}
        units = dict.fromkeys("XYZ", mm_per_unit)
        self._known = {
            name: {axis: value / units.get(axis, 1.0) for axis, value in known} for name, known in positions.items()
        }
        self._at: dict[str, float] = {}
        self._axes = () if machine is None else machine.axes
        #: with its rotary axes
        self.machine = machine if self._axes else None
        self._switch = (machine.tip_control or ()) if machine is not None and self._axes and switches else ()
        #: whether words are those of the tip without any that switches that on
        self.keeps_tip = bool(switches and tcp and not self._switch)

    def __bool__(self) -> bool:
        return any(self._known.values())

    def table(self, table: Table) -> Table:
        """Table of the control with the words that switch tip control of these kinematics, and with positions."""
        table = table.switched(self._switch)
        return replace(table, blocks=(*table.blocks, *table.positions)) if self else table

    def away(self, angles: Mapping[str, float]) -> list[str]:
        """Names of axes that are not at zero, or at a full turn of an axis that turns without end."""
        endless = {axis.name for axis in self._axes if axis.limits is None}
        turns = {name: math.remainder(angle, 360.0) if name in endless else angle for name, angle in angles.items()}
        return sorted(name for name, angle in turns.items() if abs(angle) > SAME)

    def leave(self, names: Set[str]) -> None:
        """Take note of axes that move otherwise: words of the tip may move all of them."""
        gone = names & set("ABC") | (set(self._at) if names & set("XYZ") else set())
        self._at = {axis: value for axis, value in self._at.items() if axis not in gone}

    def missed(self, name: str) -> str:
        """Axes with the values of a position, "home" or "change", at which they are not."""
        wanted = self._known.get(name, {}).items()
        return " ".join(f"{axis}{value:g}" for axis, value in wanted if not self._is_at(axis, value))

    def _is_at(self, axis: str, value: float) -> bool:
        return abs(self._at.get(axis, math.nan) - value) <= _ROOM

    def go(self, given: Mapping[str, float], *, free_z: bool) -> Iterator[tuple[str, str]]:
        """Take note of a block of positions; yield those that the file does not have, and those that it has.

        `free_z`: the control's own table has the block as a retract, which holds where the file has no Z of home.
        """
        for axis in given.keys() & set("XYZABC"):
            self._at[axis] = given[axis]
            known = [position[axis] for position in self._known.values() if axis in position]
            free = free_z and axis == "Z" and "Z" not in self._known["home"]
            if known and not free and not any(self._is_at(axis, value) for value in known):
                yield f"{axis} goes to {given[axis]:g}", " or ".join(f"{axis}{value:g}" for value in known)
