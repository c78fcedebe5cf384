"""A machine at given rotary angles, in words: which way the tool points, and where the linear axes stand."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics.machine import LINEAR, Machine
from cornersmooth.kinematics.poses import machine_position, nose_position, solutions, tool_axis, wrap
from cornersmooth.model import Floats

_POSE_WORD = re.compile(r"([A-Za-z]?)\s*=?\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_SAME = 1e-9  #: degrees below which angles are the same


def parse_pose(machine: Machine, text: str) -> dict[str, float]:
    """Words of a pose: ``A30,C45``, with the tip in part coordinates ``A30,C45,X10,Z5``, or bare angles ``30,45``.

    Bare angles are those of the rotary axes in alphabetical order. What is not named is zero. CS375: no pose of this
    machine.
    """
    names = sorted(machine.names)
    pose = dict.fromkeys((*names, *LINEAR), 0.0)
    example = ",".join([*(f"{name}{angle}" for name, angle in zip(names, (30, 45), strict=False)), "X10,Y0,Z5"])
    words = [(part, _POSE_WORD.fullmatch(part)) for part in re.split(r"[,;\s]+", text.strip()) if part]
    bare = len(words) == len(names) and all(word and not word[1] for _, word in words)
    given: dict[str, float] = {}
    for place, (part, word) in enumerate(words):
        name = names[place] if bare else word[1].upper() if word else ""
        if word is None or name not in pose or name in given:
            why = f"{name} twice" if name in given else part
            what = f"{text!r} is no pose of {machine.name}: {why}"
            raise SettingsError("CS375", what, f"write angles and, if you like, the tip, as in {example}")
        given[name] = float(word[2])
    if not given:
        raise SettingsError("CS375", f"{text!r} is no pose of {machine.name}", f"write angles, as in {example}")
    return pose | given


def pose_facts(machine: Machine, pose: Mapping[str, float]) -> dict[str, Any]:
    """Plain values of a machine at a pose, all words of it as `parse_pose` gives them; keys carry their unit.

    The machine position counts from the zero of the part, the length of the tool taken off. The spindle nose has the
    heads at zero, as travel and points are given.
    """
    angles = np.array([*(pose[name] for name in machine.names), 0.0, 0.0])[None, :2]
    tip, axis = np.array([[pose[name] for name in LINEAR]]), tool_axis(machine, angles)
    nose, found = nose_position(machine, tip, angles)[0], solutions(machine, axis)
    singular = bool(found.singular[0])
    others = [pair for pair in found.angles[0] if np.abs(wrap(pair - angles[0])).max() > _SAME]
    if singular or len(machine.names) != 2:
        others = []

    def named(some: Floats) -> dict[str, float]:
        return dict(zip(machine.names, some.tolist(), strict=False))

    rotary = zip(machine.axes, angles[0].tolist(), strict=False)
    linear = ((item, float(nose[LINEAR.index(item.name)])) for item in machine.travel)
    return {
        "schema": "cornersmooth-pose/1",
        "machine": machine.name,
        "angles_deg": named(angles[0]),
        "tool_vector": axis[0].tolist(),
        "tip_mm": tip[0].tolist(),
        "machine_position_mm": machine_position(machine, tip, angles)[0].tolist(),
        "spindle_nose_mm": nose.tolist(),
        "singular": singular,
        "other_angles_deg": named(others[0]) if others else None,
        "beyond": [
            f"beyond the {word}: {item.name} goes from {item.low:g} to {item.high:g} {unit}"
            for word, unit, places in (("limits", "deg", rotary), ("travel", "mm", linear))
            for item, value in places
            if not item.low <= value <= item.high
        ],
    }


def pose_lines(facts: Mapping[str, Any]) -> list[str]:
    """Lines for people of what `pose_facts` gives."""
    angles, other = facts["angles_deg"], facts["other_angles_deg"]
    places = ("tip_mm", "machine_position_mm", "spindle_nose_mm")
    tip, position, nose = (_words(dict(zip(LINEAR, facts[place], strict=True))) for place in places)
    lines = [
        f"{facts['machine']} at {_words(angles)} deg" if angles else facts["machine"],
        f"  tool vector       {_words(dict(zip('IJK', facts['tool_vector'], strict=True)), 7)}",
        f"  tip on the part   {tip} mm",
        f"  machine position  {position} mm, from the zero of the part, tool length taken off",
        f"  spindle nose      {nose} mm with the heads at zero, as travel and points are given",
    ]
    if facts["singular"]:
        lines.append(f"  at the pole: {next(iter(angles))} does not turn the tool axis")
    elif other:
        lines.append(f"  same tool vector  {_words(other)} deg")
    return lines + [f"  {text}" for text in facts["beyond"]]


def _words(named: Mapping[str, float], decimals: int = 4) -> str:
    """Words as in an NC text, in alphabetical order; never -0."""
    return " ".join(f"{name}{round(value, decimals) + 0.0:.{decimals}f}" for name, value in sorted(named.items()))
