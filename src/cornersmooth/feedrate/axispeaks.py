"""What the axes of a machine reach, against their limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.kinematics.dynamics import LINEAR

#: states looked at together
_TOGETHER = 65536


@dataclass(frozen=True)
class AxisPeaks:
    """Largest values of one axis met at the multiples of the period, and its limits; in mm or degrees, and seconds.

    Parameters
    ----------
    name : {"X", "Y", "Z", "A", "B", "C"}
    reached : (float, float, float)
        Speed, acceleration, jerk.
    limits : (float, float, float)
        Infinite where there is none.
    """

    name: str
    reached: tuple[float, float, float]
    limits: tuple[float, float, float]

    @property
    def used(self) -> tuple[float, float, float]:
        """What is reached over the limits."""
        v, a, j = (value / limit for value, limit in zip(self.reached, self.limits, strict=True))
        return v, a, j

    def as_dict(self) -> dict[str, float | None]:
        """Plain values with their units in the keys; None for no limit."""
        unit = "mm" if self.name in LINEAR else "deg"
        keys = [f"speed_{unit}_per_s", f"accel_{unit}_per_s2", f"jerk_{unit}_per_s3"]
        bounds = [limit if math.isfinite(limit) else None for limit in self.limits]
        return dict(zip(keys, self.reached, strict=True)) | {
            f"limit_{key}": bound for key, bound in zip(keys, bounds, strict=True)
        }


def axis_peaks(law: TimeLaw) -> list[AxisPeaks]:
    """Peaks of the five axes of a law's machine; none where it was planned without one."""
    if law.machine_axes is None:
        return []
    times = law.every_period()
    largest = np.zeros((3, len(law.machine_axes.names)))
    for begin in range(0, len(times), _TOGETHER):
        _, *orders = law.axes_at(times[begin : begin + _TOGETHER])
        largest = np.maximum(largest, [np.abs(order).max(axis=0) for order in orders])
    rows = zip(law.machine_axes.names, largest.T.tolist(), law.machine_axes.limits.T.tolist(), strict=True)
    return [AxisPeaks(name, (v, a, j), (most_v, most_a, most_j)) for name, (v, a, j), (most_v, most_a, most_j) in rows]
