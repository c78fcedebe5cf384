"""What the reader remembers of a program from line to line."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from cornersmooth.nc_reader.execution import Modal
from cornersmooth.nc_reader.hole_cycles import HoleCycle
from cornersmooth.nc_reader.rotary import Rotary


@dataclass
class ModalState:
    """What holds between two lines; grammars read it, and set what has no `acts.Act`."""

    modal: Modal
    rotary: Rotary | None = None  #: with the length of the tool in the spindle
    tip_control: str = ""  #: name of the tool tip control that is on
    incremental: bool = False  #: G91 is in force, in which no motion is read
    high_speed: bool = False  #: look ahead of the kind that some controls ask for with curves is on
    clamped: dict[str, bool] = field(default_factory=dict)  #: rotary axes with a clamp: kept, or words let them turn
    keeps_tip: bool | None = None  #: whether the kinematics do, where the machine's file says what switches that
    shorter_way: bool = False  #: whether rotary axes go it
    speed: float = math.nan  #: of the spindle
    rigid: bool = False  #: M29 asks the spindle to turn with the feed
    height: float | None = None  #: at which a run of modal cycles began (G98), in units of the program
    cycle: HoleCycle | None = None  #: that a block defines for others to call
    centre: dict[str, float] = field(default_factory=dict)  #: of circles to come
    #: how the tool axis is interpolated, and in which coordinates
    orientation: str = ""
    axis_frame: str = ""
