"""Rotary angles along a path: one solution for every pose, points where angles need them."""

from cornersmooth.rotary.angle_path import RotaryPath, reach_error, rewound_angles, rotary_angles
from cornersmooth.rotary.subdivision import FilledPath, Insertions, fill, insertions

__all__ = [
    "FilledPath",
    "Insertions",
    "RotaryPath",
    "fill",
    "insertions",
    "reach_error",
    "rewound_angles",
    "rotary_angles",
]
