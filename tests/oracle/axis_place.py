"""Whether the tool axis is within its own tolerance wherever the tip is within ε of the other motion.

Brute force: around the place where both motions are matched, places close together on the other motion are tried, and
again around the best of them. A *share* is the larger of tip and axis at one place, each over its tolerance; 1 or less
is what is promised.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oracle.distance import match_poses, match_samples
from oracle.motion import Original, Path, angle_between, length, unit

Floats = NDArray[np.float64]

#: segments of the original on either side that are tried, and samples of the written path; places tried at a time
SEGMENTS, SAMPLES = 3, 60
PLACES, FEWER = 24, 8
#: times that places are tried, each time closer to the best of before
ROUNDS = 9
#: rows taken together
TOGETHER = 256

Motion = Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class Shares:
    """Largest shares: of written samples, and of original poses and the middles between them."""

    written: float
    original: float

    @property
    def worst(self) -> float:
        return max(self.written, self.original)


def shares(path: Path, original: Original, axis_length: float, tolerance: float, degrees: float) -> Shares:
    """Largest shares of a run, both ways."""
    # points on the axis may be off by what their axis may
    limit = max(tolerance, axis_length * math.radians(degrees))
    at = match_samples(path, original, match_poses(path, original, axis_length, limit), axis_length)
    axis = unit(path.point - path.tip)

    def of_original(place: Floats) -> tuple[Floats, Floats]:
        tip, point = original.at(place, 1.0)
        return tip, point - tip

    def of_written(place: Floats) -> tuple[Floats, Floats]:
        one = np.clip(place.astype(np.int64), 0, len(path) - 2)
        part = (place - one)[:, None]
        return (
            path.tip[one] + part * (path.tip[one + 1] - path.tip[one]),
            unit(axis[one] + part * (axis[one + 1] - axis[one])),
        )

    limits = tolerance, math.radians(degrees)
    ends = 0.0, len(original) - 1.0
    written = _largest(of_original, (path.tip, axis), np.floor(at), SEGMENTS, PLACES, ends, limits)
    wanted = np.append(np.arange(len(original), dtype=float), np.arange(len(original) - 1) + 0.5)
    near = np.searchsorted(at, wanted).astype(float)
    ends = 0.0, len(path) - 1.0
    return Shares(written, _largest(of_written, of_original(wanted), near, SAMPLES, FEWER, ends, limits))


def _largest(
    motion: Motion,
    poses: tuple[Floats, Floats],
    middle: Floats,
    around: int,
    count: int,
    ends: tuple[float, float],
    limits: tuple[float, float],
) -> float:
    """Largest share of poses at their best places on so many pieces of a motion, which has kinks at whole places."""
    worst = 0.0
    for begin in range(0, len(middle), TOGETHER):
        rows = slice(begin, begin + TOGETHER)
        tip, axis = poses[0][rows, None, None], poses[1][rows, None, None]
        pieces = middle[rows, None] + np.arange(-around, around + 1)
        low = np.clip(pieces, *ends)[..., None]
        high = np.clip(pieces + 1.0, *ends)[..., None]
        places = low + (high - low) * np.linspace(0, 1, count + 1)
        step = (high - low) / count
        for _ in range(ROUNDS):  # in every piece for itself: they may be of very different length
            other_tip, other_axis = (part.reshape(*places.shape, 3) for part in motion(places.ravel()))
            turn = angle_between(axis, other_axis)
            found = np.maximum(length(tip - other_tip) / limits[0], turn / limits[1])
            best = np.take_along_axis(places, found.argmin(axis=2)[..., None], 2)
            places = np.clip(best + step * np.linspace(-1, 1, count + 1), low, high)
            step = step * (2.0 / count)
        worst = max(worst, float(found.min(axis=(1, 2)).max()))
    return worst
