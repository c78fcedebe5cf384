"""A machine at given rotary angles, in words: which way the tool points, and where the linear axes stand."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics.dynamics import LINEAR
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import solutions, tool_axis
from cornersmooth.kinematics.position import machine_position
from cornersmooth.kinematics.travel import nose_position

_WORD = re.compile(r"([A-Za-z])\s*=?\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")

#: degrees below which angles are the same
_SAME = 1e-9


def parse_pose(machine: Machine, text: str) -> dict[str, float]:
    """Words of a pose: ``A30,C45``, with the tip in part coordinates ``A30,C45,X10,Z5``, or bare angles ``30,45``.

    Bare angles are those of the rotary axes in alphabetical order. What is not named is zero.

    Raises
    ------
    SettingsError
        CS375: the text is no pose of this machine.
    """
    names = sorted(machine.names)
    known = (*names, *LINEAR)
    example = ",".join([*(f"{name}{angle}" for name, angle in zip(names, (30, 45), strict=False)), "X10,Y0,Z5"])
    parts = [part for part in re.split(r"[,;\s]+", text.strip()) if part]
    if parts and all(_NUMBER.fullmatch(part) for part in parts) and len(parts) == len(names):
        return {**dict.fromkeys(known, 0.0), **dict(zip(names, map(float, parts), strict=True))}
    pose = dict.fromkeys(known, 0.0)
    given = set()
    for part in parts:
        word = _WORD.fullmatch(part)
        name = word[1].upper() if word else ""
        if word is None or name not in known or name in given:
            why = f"{name} twice" if name in given else part
            what = f"{text!r} is no pose of {machine.name}: {why}"
            raise SettingsError("CS375", what, f"write angles and, if you like, the tip, as in {example}")
        given.add(name)
        pose[name] = float(word[2])
    if not given:
        raise SettingsError("CS375", f"{text!r} is no pose of {machine.name}", f"write angles, as in {example}")
    return pose


def describe_pose(machine: Machine, pose: Mapping[str, float]) -> str:
    """Say which way the tool points and where the linear axes stand, in a few lines.

    Parameters
    ----------
    machine : Machine
    pose : mapping of str to float
        Degrees of the rotary words, mm of the tip in part coordinates: all of them, as `parse_pose` gives them.
    """
    angles = np.array([[*(pose[name] for name in machine.names), 0.0, 0.0][:2]])
    tip = np.array([[pose[name] for name in LINEAR]])
    axis = tool_axis(machine, angles)
    words, nose = machine_position(machine, tip, angles)[0], nose_position(machine, tip, angles)[0]
    lines = [
        f"{machine.name} at {_rotary(machine, angles[0])} deg" if machine.names else machine.name,
        f"  tool vector       {_words('IJK', axis[0], 7)}",
        f"  tip on the part   {_words(LINEAR, tip[0])} mm",
        f"  machine position  {_words(LINEAR, words)} mm, from the zero of the part, tool length taken off",
        f"  spindle nose      {_words(LINEAR, nose)} mm with the heads at zero, as travel and points are given",
    ]
    found = solutions(machine, axis)
    if found.singular[0]:
        lines.append(f"  at the pole: {machine.names[0]} does not turn the tool axis")
    elif len(machine.names) == 2:
        other = [pair for pair in found.angles[0] if np.abs(_turned(pair - angles[0])).max() > _SAME]
        told = " or ".join(_rotary(machine, pair) for pair in other[:1])
        lines += [f"  same tool vector  {told} deg"] * bool(told)
    for index, axis_of in enumerate(machine.axes):
        value = float(angles[0, index])
        if not axis_of.low <= value <= axis_of.high:
            lines.append(f"  beyond the limits: {axis_of.name} goes from {axis_of.low:g} to {axis_of.high:g} deg")
    for item in machine.travel:
        value = float(nose[LINEAR.index(item.name)])
        if not item.low <= value <= item.high:
            lines.append(f"  beyond the travel: {item.name} goes from {item.low:g} to {item.high:g} mm")
    return "\n".join(lines)


def _rotary(machine: Machine, angles: np.ndarray) -> str:
    """Rotary words in alphabetical order."""
    named = sorted(zip(machine.names, angles.tolist(), strict=False))
    return _words([name for name, _ in named], np.array([angle for _, angle in named]))


def _turned(angles: np.ndarray) -> np.ndarray:
    """Angles without whole turns."""
    turned: np.ndarray = angles - 360.0 * np.round(angles / 360.0)
    return turned


def _words(names: Sequence[str], values: np.ndarray, decimals: int = 4) -> str:
    """Words as in an NC text; never -0."""
    shown = [round(float(value), decimals) + 0.0 for value in values]
    return " ".join(f"{name}{value:.{decimals}f}" for name, value in zip(names, shown, strict=True))
