"""What the writers know about a control: its words, its digits and what it can do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cornersmooth.model import MM_PER_UNIT, FeedMode, Units

Blocks = tuple[str, ...]


@dataclass(frozen=True)
class Words:
    """Blocks by which a control is told what is not motion; each field holds zero or more blocks.

    Parameters
    ----------
    tool_change, tool_select : tuple of str
        With ``{tool}``; the latter only brings the tool near.
    tip_control_on, tip_control_off : tuple of str
        Tool tip control; with ``{offset}``, the length register.
    spindle_speed : tuple of str
        With ``{speed}`` and ``{direction}``, one of `spindle_on`.
    spindle_on : mapping
        Block for ``"clockwise"`` and ``"counterclockwise"``.
    coolant : mapping
        Blocks by CL word; other words are not translated.
    dwell : tuple of str
        With ``{milliseconds}`` or ``{seconds}``.
    compensation_left, compensation_right : tuple of str
        Cutter compensation, with ``{register}``.
    plane : mapping
        Block for the planes 17 (XY), 18 (ZX) and 19 (YZ).
    feed_mode : mapping
        Block by `FeedMode`.
    """

    tool_change: Blocks
    tool_select: Blocks
    tip_control_on: Blocks
    tip_control_off: Blocks
    spindle_speed: Blocks
    spindle_on: Mapping[str, str]
    spindle_off: Blocks
    spindle_orient: Blocks
    coolant: Mapping[str, Blocks]
    dwell: Blocks
    stop: Blocks
    optional_stop: Blocks
    compensation_left: Blocks
    compensation_right: Blocks
    compensation_off: Blocks
    plane: Mapping[int, str]
    feed_mode: Mapping[FeedMode, str]


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
    circles : bool
        Whether arcs may be written as circular blocks, the tool vector kept.
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
    circles: bool = False

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
