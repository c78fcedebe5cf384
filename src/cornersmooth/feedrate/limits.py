"""The limits that a time law keeps."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from cornersmooth.errors import SettingsError


@dataclass(frozen=True)
class Limits:
    """Limits of the motion; the defaults are those of the paper's Example 2.

    Parameters
    ----------
    feed : float or None, mm/min
        Path speed of every feed move instead of the programmed one; None for the programmed feeds.
    accel : float, mm/s²
        Tangential acceleration of the tip.
    jerk : float, mm/s³
        Tangential jerk: the rate of change of the tangential acceleration.
    centripetal : float or None, mm/s²
        Centripetal acceleration κ·v² of the tip; None for the value of `accel`.
    rapid : float, mm/min
        Path speed of rapid moves and of the positions of hole cycles.
    rapid_accel, rapid_jerk : float or None
        Their acceleration and jerk; None for those of feed moves.
    angular_feed, angular_accel, angular_jerk : float, deg/s, deg/s², deg/s³
        Limits of moves that only turn the axis.
    period : float, s
        Interpolation period: a corner passed without a stop changes the velocity by at most ``accel · period``.
    """

    feed: float | None = None
    accel: float = 1000.0
    jerk: float = 5000.0
    centripetal: float | None = None
    rapid: float = 10000.0
    rapid_accel: float | None = None
    rapid_jerk: float | None = None
    angular_feed: float = 30.0
    angular_accel: float = 150.0
    angular_jerk: float = 3000.0
    period: float = 0.002

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise SettingsError("CS260", f"{item.name} is {value:g}", "give a positive number")

    @property
    def centripetal_accel(self) -> float:
        """Limit of κ·v², mm/s²."""
        return self.accel if self.centripetal is None else self.centripetal

    @property
    def rapid_limits(self) -> tuple[float, float, float]:
        """Speed mm/s, acceleration mm/s² and jerk mm/s³ of rapid moves."""
        return (
            self.rapid / 60.0,
            self.accel if self.rapid_accel is None else self.rapid_accel,
            self.jerk if self.rapid_jerk is None else self.rapid_jerk,
        )

    @property
    def angular_limits(self) -> tuple[float, float, float]:
        """Speed, acceleration and jerk of pure rotations in rad/s, rad/s², rad/s³."""
        speed, accel, jerk = np.radians((self.angular_feed, self.angular_accel, self.angular_jerk)).tolist()
        return speed, accel, jerk

    def as_dict(self) -> dict[str, Any]:
        """Plain values with their units in the keys, for reports."""
        return {
            "feed_mm_per_min": self.feed,
            "accel_mm_per_s2": self.accel,
            "jerk_mm_per_s3": self.jerk,
            "centripetal_mm_per_s2": self.centripetal_accel,
            "rapid_mm_per_min": self.rapid,
            "rapid_accel_mm_per_s2": self.rapid_limits[1],
            "rapid_jerk_mm_per_s3": self.rapid_limits[2],
            "angular_feed_deg_per_s": self.angular_feed,
            "angular_accel_deg_per_s2": self.angular_accel,
            "angular_jerk_deg_per_s3": self.angular_jerk,
            "period_s": self.period,
        }
