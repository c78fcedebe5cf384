"""How many lines a curve is written in, so that the axes jump little in speed where lines meet."""

from __future__ import annotations

import math

import numpy as np

from cornersmooth.arrays import Floats
from cornersmooth.settings import Settings

#: Chord error below which lines are not divided for their feed, mm: half of a step of 0.0001 mm, the last digit of most
#: controls. Finer lines follow the digits.
FINEST_CHORD = 5e-5

#: Jumps in speed between two lines for which no line is divided, of the tip in mm/s and of the tool axis in deg/s: what
#: 1000 mm/s² and 150 deg/s² make in 2 ms, the limits of ``cornersmooth time``.
SMALL_JUMPS = (2.0, 0.3)


def lines_for_feed(
    settings: Settings, by_chord: Floats, length: Floats, feed: Floats, kinks: tuple[Floats, Floats]
) -> Floats:
    """Lines that a stretch of a curve is written in, so that the axes jump little in speed where they meet.

    Parameters
    ----------
    by_chord : (n,) float64
        Lines that the chord tolerance asks for; their chord error goes with the square of their number.
    length : (n,) float64, mm
        Way of the tip.
    feed : (n,) float64, mm/min
        NaN for none: then the chord tolerance alone counts.
    kinks : ((n,) float64, (n,) float64), rad, rad/mm
        By how much the direction of the tip, and the turning of the tool axis on its way, change in the stretch.
    """
    if not settings.block_time or settings.lines == "long" or settings.chord <= FINEST_CHORD:
        return by_chord
    finest = by_chord * math.sqrt(settings.chord / FINEST_CHORD)
    speed = feed / 60.0
    jump = np.maximum(speed * kinks[0] / SMALL_JUMPS[0], np.degrees(speed * kinks[1]) / SMALL_JUMPS[1])
    most = np.minimum(length / (speed * settings.block_time), jump)
    return np.maximum(by_chord, np.minimum(finest, np.nan_to_num(most, nan=0.0, posinf=0.0)))
