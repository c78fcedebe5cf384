"""What CL files count in revolutions of the spindle, in time; and cutting speeds as revolutions."""

from __future__ import annotations

import math

#: longest dwell that is written, ms: one day
_LONGEST = 86_400_000

#: cutting speeds in mm per minute
_MM_PER_MINUTE = {"SMM": 1000.0, "SFM": 12.0 * 25.4}


def milliseconds(amount: float, in_revolutions: bool, speed: float | None) -> int | None:
    """Return a dwell of seconds, or of revolutions at a speed per minute, in whole ms; None where none is known."""
    if in_revolutions:
        if not speed:
            return None
        amount *= 60.0 / speed
    time = 1000.0 * amount
    if not (math.isfinite(time) and 0.0 <= time <= _LONGEST):
        return None
    return max(1, round(time)) if time > 0.0 else 0


def revolutions(cutting_speed: float, unit: str, diameter: float) -> float | None:
    """Revolutions per minute that give a cutting speed (SFM, SMM) at a diameter in mm; None without a diameter."""
    if not diameter > 0.0:
        return None
    return cutting_speed * _MM_PER_MINUTE[unit] / (math.pi * diameter)
