"""The limits that a time law keeps."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.model import Floats


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
    vector_jerk : float or None, mm/s³
        Jerk of the tip as a vector, across the path too; None for no limit. Transitions have curvature without jumps
        but their curvature changes quickly, so this costs time at corners.
    turn_speed, turn_accel, turn_jerk : float or None, deg/s, deg/s², deg/s³
        Limits of the turning of the tool axis in all moves; None for no limit.
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
    vector_jerk: float | None = None
    turn_speed: float | None = None
    turn_accel: float | None = None
    turn_jerk: float | None = None
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
        _, turn = self.vector_limits
        own = np.radians((self.angular_feed, self.angular_accel, self.angular_jerk))
        speed, accel, jerk = np.minimum(own, turn).tolist()
        return speed, accel, jerk

    @property
    def vector_limits(self) -> tuple[Floats, Floats]:
        """Speed, acceleration and jerk of tip (mm) and tool axis (rad) as vectors; inf for none."""
        tip = [math.inf, math.inf, math.inf if self.vector_jerk is None else self.vector_jerk]
        turn = [math.inf if x is None else math.radians(x) for x in (self.turn_speed, self.turn_accel, self.turn_jerk)]
        return np.array(tip), np.array(turn)

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
            "vector_jerk_mm_per_s3": self.vector_jerk,
            "turn_speed_deg_per_s": self.turn_speed,
            "turn_accel_deg_per_s2": self.turn_accel,
            "turn_jerk_deg_per_s3": self.turn_jerk,
            "period_s": self.period,
        }
