"""Rotary angles along a path: one solution for every pose, points where angles need them."""

from cornersmooth.rotary.angle_path import RotaryPath, rapid_moves, rewound_angles, rotary_angles, still_poses
from cornersmooth.rotary.subdivision import FilledPath, Insertions, fill, insertions

__all__ = [
    "FilledPath",
    "Insertions",
    "RotaryPath",
    "fill",
    "insertions",
    "rapid_moves",
    "rewound_angles",
    "rotary_angles",
    "still_poses",
]
