"""Tilted planes: the frame that a control makes of the words of a plane, and motion in it as motion in the part.

While a plane is on, the modal position is that of the plane; what is executed is brought into the part, with the tool
along Z' of the plane. A plane is switched on and off above a retract, where the rotary axes may turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.nc_reader.elements import Elements
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


def rotated_frame(turns: Sequence[tuple[str, float]]) -> Floats:
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


def room_of(numbers: Sequence[str]) -> float:
    """Radians that a step of the last printed digit of angles is."""
    return math.radians(10.0 ** -min(len(number.partition(".")[2]) for number in numbers))
