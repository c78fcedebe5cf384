"""What the writers know about a control: its digits and what it can do."""

from __future__ import annotations

from dataclasses import dataclass

from cornersmooth.model import MM_PER_UNIT, Units


@dataclass(frozen=True)
class Form:
    """One way of writing the smoothed motion for a control.

    Parameters
    ----------
    control, name : str
        As on the command line.
    curves : bool
        Whether transitions are written as curves (control points) instead of lines.
    coordinate_words, other_words : tuple of bytes
        Addresses of the tip and of the tool vector or axis point.
    vectors : bool
        Whether `other_words` are unit vectors; otherwise they are axis points, in the units of the tip.
    tip_decimals : dict
        Decimals of lengths by unit.
    vector_decimals : int
    feed_decimals : int
        Most decimals of F; trailing zeros are not written.
    """

    control: str
    name: str
    curves: bool
    coordinate_words: tuple[bytes, ...]
    other_words: tuple[bytes, ...]
    vectors: bool
    tip_decimals: dict[Units, int]
    vector_decimals: int = 7
    feed_decimals: int = 4

    def decimals(self, units: Units) -> tuple[int, ...]:
        """Decimals of the six numbers of a motion block."""
        tip = self.tip_decimals[units]
        return (tip,) * 3 + ((self.vector_decimals if self.vectors else tip),) * 3

    def tip_resolution(self, units: Units) -> float:
        """Step of the written tip coordinates, mm."""
        return float(MM_PER_UNIT[units] * 10.0 ** -self.tip_decimals[units])

    def axis_point_resolution(self, units: Units, axis_length: float) -> float:
        """What the rounding of vector or axis point is worth at the axis point, as a step in mm.

        A rounded axis point moves b = tip + H·dir by at most its own rounding and, across the tool, that of the tip;
        the latter is in `tip_resolution` already.
        """
        if self.vectors:
            return axis_length * float(10.0**-self.vector_decimals)
        return self.tip_resolution(units)
