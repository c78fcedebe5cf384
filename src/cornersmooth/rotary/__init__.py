"""Rotary angles along a path: one solution for every pose, points where angles need them."""

from cornersmooth.rotary.angle_path import RotaryPath, reach_error, rewound_angles, rotary_angles
from cornersmooth.rotary.subdivision import FilledPath, filled_path

__all__ = [
    "FilledPath",
    "RotaryPath",
    "filled_path",
    "reach_error",
    "rewound_angles",
    "rotary_angles",
]
