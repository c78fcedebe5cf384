"""A machine at given rotary angles, in words: which way the tool points, and where the linear axes stand."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics.machine import LINEAR, Machine
from cornersmooth.kinematics.poses import Solutions, machine_position, nose_position, solutions, tool_axis, wrap
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


@dataclass(frozen=True)
class Posed:
    """A machine at given rotary angles."""

    machine: Machine
    angles: Floats  #: (2,), degrees; in the order of the machine's axes; zero for those that it has not
    tip: Floats  #: (3,), mm; in part coordinates

    @classmethod
    def of(cls, machine: Machine, pose: Mapping[str, float]) -> Posed:
        """Take the words of a pose, all of them, as `parse_pose` gives them."""
        angles = [*(pose[name] for name in machine.names), 0.0, 0.0][:2]
        return cls(machine, np.array(angles), np.array([pose[name] for name in LINEAR]))

    @cached_property
    def axis(self) -> Floats:
        """(3,) unit vector from the tip to the spindle, in part coordinates."""
        return tool_axis(self.machine, self.angles[None])[0]

    @cached_property
    def position(self) -> Floats:
        """(3,) words of the linear axes, mm, from the zero of the part, the tool length taken off."""
        return machine_position(self.machine, self.tip[None], self.angles[None])[0]

    @cached_property
    def nose(self) -> Floats:
        """(3,) place of the spindle nose, mm, with the heads at zero: as travel and points are given."""
        return nose_position(self.machine, self.tip[None], self.angles[None])[0]

    @cached_property
    def _found(self) -> Solutions:
        return solutions(self.machine, self.axis[None])

    @property
    def other(self) -> Floats | None:
        """(2,) other angles with the same tool vector, degrees; None where there are none, and at the pole."""
        if self._found.singular[0] or len(self.machine.names) != 2:
            return None
        others = [pair for pair in self._found.angles[0] if np.abs(wrap(pair - self.angles)).max() > _SAME]
        return others[0] if others else None

    @property
    def beyond(self) -> list[str]:
        """What is beyond the limits of the rotary axes, and beyond the travel."""
        rotary = zip(self.machine.axes, self.angles.tolist(), strict=False)
        linear = ((item, float(self.nose[LINEAR.index(item.name)])) for item in self.machine.travel)
        return [
            f"beyond the {word}: {item.name} goes from {item.low:g} to {item.high:g} {unit}"
            for word, unit, places in (("limits", "deg", rotary), ("travel", "mm", linear))
            for item, value in places
            if not item.low <= value <= item.high
        ]

    def describe(self) -> str:
        """Say which way the tool points and where the linear axes stand, in a few lines."""
        machine = self.machine
        remark = "with the heads at zero, as travel and points are given"
        lines = [
            f"{machine.name} at {_words(self._named(self.angles))} deg" if machine.names else machine.name,
            f"  tool vector       {_words(dict(zip('IJK', self.axis, strict=True)), 7)}",
            f"  tip on the part   {_places(self.tip)} mm",
            f"  machine position  {_places(self.position)} mm, from the zero of the part, tool length taken off",
            f"  spindle nose      {_places(self.nose)} mm {remark}",
        ]
        if self._found.singular[0]:
            lines.append(f"  at the pole: {machine.names[0]} does not turn the tool axis")
        elif self.other is not None:
            lines.append(f"  same tool vector  {_words(self._named(self.other))} deg")
        return "\n".join((*lines, *(f"  {text}" for text in self.beyond)))

    def as_dict(self) -> dict[str, Any]:
        """Plain values; keys carry their unit."""
        return {
            "schema": "cornersmooth-pose/1",
            "machine": self.machine.name,
            "angles_deg": self._named(self.angles),
            "tool_vector": self.axis.tolist(),
            "tip_mm": self.tip.tolist(),
            "machine_position_mm": self.position.tolist(),
            "spindle_nose_mm": self.nose.tolist(),
            "singular": bool(self._found.singular[0]),
            "other_angles_deg": None if self.other is None else self._named(self.other),
            "beyond": self.beyond,
        }

    def _named(self, angles: Floats) -> dict[str, float]:
        return dict(zip(self.machine.names, angles.tolist(), strict=False))


def _words(named: Mapping[str, float], decimals: int = 4) -> str:
    """Words as in an NC text, in alphabetical order; never -0."""
    return " ".join(
        f"{name}{round(float(value), decimals) + 0.0:.{decimals}f}" for name, value in sorted(named.items())
    )


def _places(point: Floats) -> str:
    return _words(dict(zip(LINEAR, point, strict=True)))
