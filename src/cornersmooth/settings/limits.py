"""The limits that a time law keeps."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

from cornersmooth.errors import SettingsError
from cornersmooth.settings.declared import key_of, option


@dataclass(frozen=True)
class Limits:
    """Limits of the motion; the defaults are those of the paper's Example 2."""

    feed: float | None = option(None, "Feed of all feed moves instead of the programmed ones.", unit="mm/min")
    accel: float = option(1000.0, "Acceleration along the path.", unit="mm/s2")
    jerk: float = option(5000.0, "Jerk along the path.", unit="mm/s3")
    centripetal: float | None = option(None, "Acceleration across the path.", unit="mm/s2", instead="accel")
    rapid: float = option(10000.0, "Speed of rapid moves.", unit="mm/min")
    rapid_accel: float | None = option(None, "Acceleration of rapids.", unit="mm/s2", instead="accel")
    rapid_jerk: float | None = option(None, "Jerk of rapids.", unit="mm/s3", instead="jerk")
    angular_feed: float = option(30.0, "Speed of moves that only turn the tool axis.", unit="deg/s")
    angular_accel: float = option(150.0, "Their acceleration.", unit="deg/s2")
    angular_jerk: float = option(3000.0, "Their jerk.", unit="deg/s3")
    period: float = option(
        0.002,
        "Interpolation period, as in 2ms: at corners that stay sharp the velocity changes by at most accel times "
        "period. [default: 2ms]",
        unit="s",
    )

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise SettingsError("CS260", f"{item.name} is {value:g}", "give a positive number")

    def _value(self, name: str) -> Any:
        """Value of a limit, or of that which counts instead."""
        value = getattr(self, name)
        return getattr(self, self.__dataclass_fields__[name].metadata["instead"] or name) if value is None else value

    @property
    def centripetal_accel(self) -> float:
        """Limit of κ·v², mm/s²."""
        return float(self._value("centripetal"))

    @property
    def rapid_limits(self) -> tuple[float, float, float]:
        """Speed mm/s, acceleration mm/s² and jerk mm/s³ of rapid moves."""
        return self.rapid / 60.0, self._value("rapid_accel"), self._value("rapid_jerk")

    @property
    def angular_limits(self) -> tuple[float, float, float]:
        """Speed, acceleration and jerk of pure rotations in rad/s, rad/s², rad/s³."""
        return math.radians(self.angular_feed), math.radians(self.angular_accel), math.radians(self.angular_jerk)

    def as_dict(self) -> dict[str, Any]:
        """Plain values with their units in the keys, for reports.

        Returns
        -------
        dict
            Numbers, or None for no limit; feeds in mm/min, all else in mm, degrees and s.
        """
        return {key_of(item.name, item.metadata["unit"]): self._value(item.name) for item in fields(self)}
