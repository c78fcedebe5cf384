"""A form of a control in one of its modes: everything that the writers go by."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cornersmooth.kinematics import Machine
from cornersmooth.model import MM_PER_UNIT, Units
from cornersmooth.nc.control import Blocks, Control, CurveStyle, Extra, Mode, Orientation
from cornersmooth.settings import Settings

#: share of ε, at the axis point, that rotary axes may take between and at the written words
ROTARY_SHARE = 0.1

#: share of ε that the tip may leave its line where the control knows nothing of the tip
TIP_SHARE = 0.1

#: share of ε that verification takes off for the lines that stand for blocks of rotary words, and for its proof
LINE_SHARE = 0.005


@dataclass(frozen=True)
class Form:
    """A form of a control in one of its modes: everything the writers go by."""

    table: Control
    name: str  #: as on the command line
    curve: CurveStyle
    orientation: Orientation
    mode: Mode
    machine: Machine | None = None  #: for rotary words
    extras: tuple[Extra, ...] = ()  #: functions of the control that were chosen
    upright: Mode | None = None  #: `FormTable.upright`
    #: mm; how far a cut is left along the tool where a rotary axis would pass its limit; 0 where that is an error
    rewind: float = 0.0
    plane: Mode | None = None  #: `FormTable.plane` where tilted planes are wanted

    @property
    def control(self) -> str:
        """Name of the control."""
        return self.table.name

    @property
    def begin(self) -> Blocks:
        """Steps before the first motion of each tool."""
        return self.table.program.begin if self.mode.begin is None else self.mode.begin

    @property
    def curves(self) -> bool:
        """Whether transitions are written as curves instead of lines."""
        return bool(self.curve)

    @property
    def long_lines(self) -> bool:
        """Whether the form can be written in long lines: the tip runs straight on them whatever the axis does."""
        return not self.curve and self.orientation in ("vector", "angles")

    @property
    def vectors(self) -> bool:
        """Whether the words after the tip are a tool vector."""
        return self.orientation == "vector"

    @property
    def rotary(self) -> bool:
        """Whether the words after the tip are angles."""
        return self.orientation in ("angles", "machine")

    @property
    def other_words(self) -> tuple[str, ...]:
        """Addresses after those of the tip; rotary ones in the order of the alphabet."""
        return tuple(sorted(self.machine.names)) if self.machine is not None and self.rotary else self.mode.words

    def tip_decimals(self, units: Units) -> int:
        """Decimals of lengths."""
        return self.table.digits.mm if units == "mm" else self.table.digits.inch

    def decimals(self, units: Units) -> tuple[int, ...]:
        """Decimals of the numbers of a motion block."""
        tip, digits = self.tip_decimals(units), self.table.digits
        other = {"vector": digits.vector, "point": tip, "angles": digits.angle, "machine": digits.angle, "fixed": 0}
        return (tip,) * 3 + (other[self.orientation],) * len(self.other_words)

    def rounding(self, units: Units) -> float:
        """Step of the written coordinates, mm."""
        return float(MM_PER_UNIT[units] * 10.0 ** -self.tip_decimals(units))

    def tip_resolution(self, units: Units, tolerance: float) -> float:
        """What is to be taken off ε at the tip, as a step of its coordinates: half of it per axis, mm."""
        share = {"machine": TIP_SHARE + LINE_SHARE, "angles": LINE_SHARE}.get(self.orientation, 0.0)
        return self.rounding(units) + 2.0 / math.sqrt(3.0) * share * tolerance

    def axis_point_resolution(self, units: Units, settings: Settings) -> float:
        """What the orientation is worth at the axis point, as a step in mm.

        A second point at the distance H′ moves b = tip + H·dir by at most H/H′ times its own rounding, besides that of
        the tip, which is in `tip_resolution` already. Rotary words have besides what `rotary_tolerance` leaves to them.
        """
        axis_length = settings.axis_length
        if self.orientation == "point":
            return self.rounding(units) / self.stretch(axis_length)
        if self.orientation == "fixed":
            return 2.0 / math.sqrt(3.0) * ROTARY_SHARE * settings.tolerance * (axis_length / settings.axis_scale)
        if self.rotary:
            between = self.rotary_tolerance(settings.tolerance, settings.axis_scale)
            reserve = axis_length * math.radians(between + self.angle_rounding)
            return 2.0 / math.sqrt(3.0) * reserve
        in_plane = 0.0 if self.plane is None else self.plane_reserve(settings.axis_point_allowed, axis_length)
        digits = self.table.digits
        return max(axis_length * float(10.0**-digits.vector / digits.vector_length), 2.0 / math.sqrt(3.0) * in_plane)

    def plane_reserve(self, tolerance: float, axis_length: float) -> float:
        """By how much the angles of a tilted plane may be off at the axis point, mm: a step of their last digit."""
        return min(axis_length * math.radians(self.angle_rounding), ROTARY_SHARE * tolerance)

    def stretch(self, axis_length: float) -> float:
        """By how many times farther from the tip than the axis point a second point is written."""
        return max(self.table.digits.lever / axis_length, 1.0)

    def rotary_tolerance(self, tolerance: float, axis_length: float) -> float:
        """Degrees by which rotary axes may leave the given axis, rounding of the words not counted.

        `axis_length` is the distance from the tip, mm, at which the axis may be off by the tolerance.
        """
        return math.degrees(ROTARY_SHARE * tolerance / axis_length)

    @property
    def angle_rounding(self) -> float:
        """Degrees by which the rounding of both rotary words may turn the axis."""
        return float(10.0**-self.table.digits.angle)
