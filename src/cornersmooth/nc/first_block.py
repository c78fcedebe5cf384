"""The block that leads a tilted tool from the height of the retract to its first position.

Tool tip control is on, and X Y Z stand in one block. X Y alone would be a motion in the plane of the part, which tables
have tilted: the axes would go far aside, or down. A tool along Z goes over its position first: there both planes are
one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine, check_travel, solutions
from cornersmooth.kinematics.position import nose_position
from cornersmooth.model import Floats
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.planes import Plane, turned_part

#: cosine of the angle from Z beyond which a tool is tilted
UPRIGHT: Final = 1.0 - 1e-6

#: places on the way that are looked at
_PLACES: Final = np.linspace(0.0, 1.0, 65)

#: Where X Y stand before, the program does not always say: as far aside as the tool is above, at most, is a fair guess.
_FLAT: Final = math.cos(math.radians(45.0))

#: mm by which the start may be below the position: digits
_BELOW: Final = 1e-3


@dataclass(frozen=True)
class FirstBlock:
    """The block, as the machine runs it."""

    form: Form
    machine: Machine | None  #: with the length of the tool
    plane: Plane | None  #: tilted plane that the block is written in
    tip: Floats  #: (3,), mm; its end, in the part
    axis: Floats  #: (3,) tool axis there
    angles: Floats | None  #: (2,), degrees; rotary words, where there are any
    line: int  #: of the CL file

    def check(self, place: Floats | None, findings: Findings, file: str | None) -> None:
        """Refuse the block, or warn of it; `place` (2,) mm is where X and Y of the spindle nose stand before, if known.

        CS374: it leaves the travel from wherever it starts. CS391: whether it stays within the travel depends on that
        place. CS392: it comes from below its end; tables and fixtures are below the part, and turned beside the tool.
        """
        machine, before, starts = self.machine, self._angles_before, self._starts(place)
        if machine is None or before is None or self.angles is None or not len(starts):
            if self._rise() < _FLAT:
                self._warn_of_below(findings)
            return
        turned = before + _PLACES[:, None] * (self.angles - before)
        frame = turned_part(machine, before)
        zero = nose_position(machine, np.zeros((1, 3)), before[None])[0]
        tips = [frame @ (start - zero) for start in starts]
        refused: list[InputError] = []
        for tip in tips:
            way = tip + _PLACES[:, None] * (self.tip - tip)
            try:
                check_travel(machine, way, turned, np.full(len(way), self.line), file)
            except InputError as error:
                refused.append(error)
        if len(refused) == len(tips):
            what = f"in the first block of a tool, from the height of the retract: {refused[0].what}"
            raise InputError(refused[0].code, what, refused[0].hint, file=file, line=self.line)
        if refused:
            text = (
                "the first block of a tool leaves the travel from some places of X and Y at the height of the retract; "
                "move X and Y near the position before, or give [tool_change] X and Y in the machine file"
            )
            findings.add("CS391", "warning", self.line, text)
        if any(tip[2] < self.tip[2] - _BELOW for tip in tips):
            self._warn_of_below(findings)

    def _warn_of_below(self, findings: Findings) -> None:
        text = (
            "the first block of a tool may come from below its end, as the part is turned far; "
            "see that table and fixture are clear of it, or bring X and Y near before"
        )
        findings.add("CS392", "warning", self.line, text)

    @property
    def _angles_before(self) -> Floats | None:
        """(2,) degrees of the rotary axes where the block begins."""
        if self.angles is None:
            return None
        assert self.machine is not None
        zero = np.clip(0.0, *self.machine.limits.T)
        return zero if "{rotary_zero}" in self.form.begin else self.angles

    def _starts(self, place: Floats | None) -> Floats:
        """Where the spindle nose may stand before, (k, 3) mm; none where the machine's file does not say enough."""
        machine, before = self.machine, self._angles_before
        if machine is None or before is None:
            return np.zeros((0, 3))
        travel = {item.name: (item.low, item.high) for item in machine.travel}
        nowhere = (math.nan, math.nan)
        top = dict(machine.home).get("Z", travel.get("Z", nowhere)[1])
        over = nose_position(machine, self.tip[None], before[None])[0, :2]
        ends = np.array([(x, y) for x in travel.get("X", nowhere) for y in travel.get("Y", nowhere)])
        places = np.vstack((ends, ends.mean(axis=0), over)) if place is None else place[None]
        starts = np.column_stack((places, np.full(len(places), top)))
        return starts[~np.isnan(starts).any(axis=1)]

    def _rise(self) -> float:
        """How far the block comes down along Z of the part for each mm of Z of the machine, at the least."""
        machine, before = self.machine, self._angles_before
        if machine is None:
            return float(self.axis[2])  # tables may have turned the part
        angles = solutions(machine, self.axis[None]).angles[0] if before is None else before[None]
        return min(float(turned_part(machine, one)[2, 2]) for one in angles)
