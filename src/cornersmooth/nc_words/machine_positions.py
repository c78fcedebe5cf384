"""Positions of the machine in a text: those of its file, where tools are changed and where the program ends."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cornersmooth.control.table import Row, Table
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.words import Line

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: code of positions of the machine that its file does not have, or that are missing
POSITIONS: Final = "CS583"

_AXES: Final = r"( [XYZABC][-+]?\d*\.?\d*)+"

#: blocks of positions of the machine, by words that stand before and behind the axes
_BLOCKS: Final = (f"G53 G0{_AXES}", f"SUPA G0{_AXES} D0", rf"L{_AXES} R0 F ?MAX M91")

#: printed digits by which angles may differ, degrees
SAME: Final = 1e-5

#: digits by which a position may be off
_ROOM: Final = 5e-4


class MachinePositions:
    """Follows the machine's axes through blocks that name positions of the machine.

    Parameters
    ----------
    machine : Machine or None
        Without positions, or without a machine, none are asked for.
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
        home, change = ((), ()) if machine is None else (machine.home, machine.tool_change)
        units = dict.fromkeys("XYZ", mm_per_unit)
        self._home, self._change = (
            {axis: value / units.get(axis, 1.0) for axis, value in known} for known in (home, change)
        )
        self._at: dict[str, float] = {}
        self._axes = () if machine is None else machine.axes
        #: with its rotary axes
        self.machine = machine if self._axes else None
        self._switch = (machine.tip_control or ()) if machine is not None and self._axes and switches else ()
        #: whether words are those of the tip without any that switches that on
        self.keeps_tip = bool(switches and tcp and not self._switch)
        #: rows of blocks that the control's own table need not have
        self.rules: tuple[Row, ...] = ()
        if home or change:
            says = "position of the machine, as its file has it"
            self.rules = tuple(
                Row(
                    pattern=re.compile(pattern),
                    says=says,
                    block=True,
                    alone=True,
                    retract=retract,
                    drops="edge" * block.endswith("D0"),
                )
                for block in _BLOCKS
                for retract, pattern in ((True, f"(?=.* Z[-+.\\d]){block}"), (False, block))
            )

    def table(self, table: Table) -> Table:
        """Table of the control with the words that switch tip control of these kinematics."""
        for block, tip in zip(self._switch, ("both", "off"), strict=False):
            word, *others = block.split()
            beside = " ".join(f"{other}!" for other in others)
            rows = Row.all_of(word, f"tip={tip} place: {beside}; alone follows; tip control of the kinematics")
            table = replace(table, named={**table.named, word: rows[0]}, listed=(*rows, *table.listed))
        return table

    def away(self, angles: Mapping[str, float]) -> list[str]:
        """Names of axes that are not at zero, or at a full turn of an axis that turns without end."""
        endless = {axis.name for axis in self._axes if axis.limits is None}
        turns = {name: math.remainder(angle, 360.0) if name in endless else angle for name, angle in angles.items()}
        return sorted(name for name, angle in turns.items() if abs(angle) > SAME)

    def take(self, line: Line, text: str, *, retract: bool) -> list[Problem]:
        """Return what is wrong with a block that moves no tool at the part.

        A retract on the control's own list holds where the file says nothing of home.
        """
        if any(rule.pattern.fullmatch(text) for rule in self.rules):
            return list(self._goes(line, free="Z" if retract and "Z" not in self._home else ""))
        if any((word.name, word.value) == ("M", 6.0) for word in line.words) or re.match(r"TOOL CALL \d", text):
            wanted, what = self._change, "the tool is changed"
        elif re.fullmatch(r"M2|M30", text):
            wanted, what = self._home, "the program ends"
        else:
            self.leave({word.name for word in line.words})
            return []
        off = [
            f"{axis}{value:g}"
            for axis, value in wanted.items()
            if not abs(self._at.get(axis, math.nan) - value) <= _ROOM
        ]
        told = f"{what} away from {' '.join(off)} of the machine, which its file asks for"
        return [Problem(POSITIONS, 0, line.number, told)] if off else []

    def leave(self, names: Set[str]) -> None:
        """Take note of axes that move otherwise: words of the tip may move all of them."""
        gone = names & set("ABC") | (set(self._at) if names & set("XYZ") else set())
        self._at = {axis: value for axis, value in self._at.items() if axis not in gone}

    def _goes(self, line: Line, free: str) -> Iterator[Problem]:
        """Take note of a position; an axis that is free may be anywhere."""
        for word in line.words:
            if word.name not in "XYZABC":
                continue
            known = [own[word.name] for own in (self._home, self._change) if word.name in own]
            if known and word.name != free and min(abs(word.value - value) for value in known) > _ROOM:
                wanted = " or ".join(f"{word.name}{value:g}" for value in known)
                text = f"{word.name} goes to {word.value:g} of the machine, whose file says {wanted}"
                yield Problem(POSITIONS, 0, line.number, text)
            self._at[word.name] = word.value
