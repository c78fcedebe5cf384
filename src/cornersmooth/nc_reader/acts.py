"""What a grammar makes of a block that is no plain motion block: acts, which the reader carries out in their order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cornersmooth.nc_reader.planes import TiltedPlane


@dataclass(frozen=True)
class Move:
    """A motion block; one without position only changes what holds."""

    columns: Mapping[str, float]
    later: bool = False  #: whether it is carried out with those behind it


@dataclass(frozen=True)
class Modes:
    """Fields of `Modal` that change."""

    values: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Beside:
    """A word beside the motion, as `elements.Event` has it."""

    letter: str
    value: float
    text: str = ""


@dataclass(frozen=True)
class Tilt:
    """A tilted plane is switched on, or off (None)."""

    plane: TiltedPlane | None


@dataclass(frozen=True)
class TurnToPlane:
    """The rotary axes turn to the tilted plane that is on."""


@dataclass(frozen=True)
class ToMachine:
    """Axes go to positions of the machine."""

    axes: str


@dataclass(frozen=True)
class Wrong:
    """Something that breaks the rules of the control."""

    code: str
    text: str


@dataclass(frozen=True)
class Unknown:
    """Something that this text does not say, and that bears on the motion."""

    text: str


Act = Move | Modes | Beside | Tilt | TurnToPlane | ToMachine | Wrong | Unknown
Acts = Iterator[Act]
