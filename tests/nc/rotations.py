"""Where the tool is at words of a machine's axes, from its description alone: rotations by scipy.

LinuxCNC's trunnions are computed by the formulas of its own trtfuncs.c (2.9).
"""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


@cache
def described(name: str) -> dict[str, Any]:
    """Table of a machine."""
    folder = resources.files("cornersmooth.kinematics") / "machines"
    return tomllib.loads((folder / f"{name}.toml").read_text())


def machine_letters(name: str) -> tuple[str, ...]:
    """Addresses of the rotary words of a machine, in the order of the alphabet."""
    return tuple(sorted(axis["name"] for axis in described(name)["axis"])) if name else ()


def _turn(axis: dict[str, Any], angles: dict[str, Floats]) -> Rotation:
    """Rotation of the tool as seen from the part by one axis."""
    direction = np.array(axis["direction"], float) / np.linalg.norm(axis["direction"])
    sign = -1.0 if axis.get("positive") == "table" else 1.0
    return Rotation.from_rotvec(sign * np.radians(angles[axis["name"]])[:, None] * direction)


def _sines(angles: dict[str, Floats]) -> tuple[dict[str, Floats], dict[str, Floats]]:
    sine = {letter: np.sin(np.radians(angle)) for letter, angle in angles.items()}
    return sine, {letter: np.cos(np.radians(angle)) for letter, angle in angles.items()}


def tool_direction(name: str, angles: dict[str, Floats]) -> Floats:
    """Tool axis in the part, (m, 3)."""
    sine, cosine = _sines(angles)
    if name == "xyzac-trt":
        return np.stack((sine["C"] * sine["A"], cosine["C"] * sine["A"], cosine["A"]), axis=-1)
    if name == "xyzbc-trt":
        return np.stack((-cosine["C"] * sine["B"], sine["C"] * sine["B"], cosine["B"]), axis=-1)
    first, second = described(name)["axis"]
    return (_turn(first, angles) * _turn(second, angles)).apply([0.0, 0.0, 1.0])


def tip_of(name: str, position: Floats, angles: dict[str, Floats]) -> Floats:
    """Tip in the part from positions of the axes, (m, 3), with the length of the tool in the control.

    With all rotary axes at zero the positions are the tip: heads swing it about their points, tables carry the part.
    """
    sine, cosine = _sines(angles)
    if name == "xyzac-trt":  # joints = M · tip, and M is a rotation: its transpose goes back
        a, c, b, d = sine["A"], sine["C"], cosine["A"], cosine["C"]
        zero = np.zeros_like(a)
        rows = ((d, -c, zero), (c * b, d * b, -a), (c * a, d * a, b))
        return np.einsum("ijm,mi->mj", np.array(rows), position)
    table = described(name)
    axes = table["axis"]
    tip = position
    if any(axis["carrier"] == "head" for axis in axes):
        end = np.array([0.0, 0.0, -table["tool_length"]])  # of the tool, from the spindle nose
        swung = np.broadcast_to(end, position.shape)
        for axis in reversed(axes):
            if axis["carrier"] == "head":
                point = np.array(axis["point"], float)
                swung = point + _turn(axis, angles).apply(swung - point)
        tip = tip + swung - end
    for axis in reversed(axes):
        if axis["carrier"] == "table":
            point = np.array(axis.get("point", (0.0, 0.0, 0.0)), float)
            tip = point + _turn(axis, angles).apply(tip - point)
    return tip
