"""How fast the axes of a machine may go, and how far the linear ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cornersmooth.errors import SettingsError

#: addresses of the linear axes
LINEAR = ("X", "Y", "Z")


@dataclass(frozen=True)
class Travel:
    """Lowest and highest position of a linear axis."""

    name: str
    #: low, high: mm; of the spindle nose with the heads at zero, in the coordinates in which the points of the tables
    #: are given
    low: float
    high: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            what = f"travel of {self.name} is {self.low:g} and {self.high:g}"
            raise SettingsError("CS253", what, "give the lower one first, in mm")


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
            if not value > 0.0:
                raise SettingsError("CS253", f"dynamics of {self.name}: {key} is {value:g}", "give a positive number")

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
        told = ", ".join(f"{value:g} {unit}/{per}" for value, per in limits if math.isfinite(value))
        return f"{self.name} up to {told}" if told else f"{self.name} without limits"
