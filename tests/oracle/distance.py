"""How far the written motion strays from the original, both ways and in order along the path.

A *matching* walks both paths from start to end, never back; the largest distance under any matching is an upper bound
of the deviation (of the Fréchet distance, to be exact), whatever way the matching was found. `deviation` first tries
one common matching of tip and b: every pose is paired with the nearest sample within the stretch of path that its
segment can fill, every sample in between with its foot on that segment. Where that bound exceeds the limit, the
free-space diagram (`oracle.frechet`) decides on tip and on b alone; so a verdict above the limit is never a weak
matching's fault, and one below it is a proof.

Own error: tips of straight blocks are exact. On curves and for b the distance is evaluated on the true paths at samples
with chords of at most `motion.SAGITTA_SHARE` of the limit; between samples both paths bend alike and the error is the
difference of two such bends: `test_oracle` finds it below a thousandth of the deviation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oracle.frechet import frechet_distance, leash_is_enough
from oracle.motion import Original, Path, angle_between
from oracle.motion import length as length_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: how much longer than its segment a stretch of path may be when the nearest sample is looked for, in limits
SLACK = 6.0
NEWTON_STEPS = 5
#: of a distance above the limit, in limits
RESOLUTION = 1e-3


@dataclass(frozen=True)
class Deviation:
    """Largest distances in mm, where on the original (pose + fraction), and how it was established."""

    tip: float
    point: float
    tip_at: float
    point_at: float
    exact: bool  #: decided by the free-space diagram

    @property
    def worst(self) -> float:
        return max(self.tip, self.point)


def match_poses(path: Path, original: Original, axis_length: float, limit: float) -> Ints:
    """(n,) sample paired with every pose, ascending; the ends with the ends."""
    tip, point = original.at(np.arange(len(original), dtype=float), axis_length)
    steps = length_of(np.diff(path.tip, axis=0)) + length_of(np.diff(path.point, axis=0))
    length = np.concatenate(([0.0], np.cumsum(steps)))
    turn = angle_between(original.axis[:-1], original.axis[1:])
    room = 2 * np.linalg.norm(np.diff(original.tip, axis=0), axis=1) + axis_length * turn + SLACK * limit
    found = np.zeros(len(original), np.int64)
    for pose in range(1, len(original) - 1):
        start = found[pose - 1]
        stop = int(np.searchsorted(length, length[start] + room[pose - 1], side="right"))
        near = np.maximum(
            np.sum((path.tip[start:stop] - tip[pose]) ** 2, axis=1),
            np.sum((path.point[start:stop] - point[pose]) ** 2, axis=1),
        )
        found[pose] = start + int(np.argmin(near))
    found[-1] = len(path) - 1 if len(original) > 1 else 0
    return found


def match_samples(path: Path, original: Original, poses: Ints, axis_length: float) -> Floats:
    """(m,) parameter on the original of every sample, never falling: the foot on the segment between matched poses."""
    if len(original) < 2:
        return np.zeros(len(path))
    segment = np.clip(np.searchsorted(poses, np.arange(len(path)), side="left") - 1, 0, len(original) - 2)
    # least squares of tip and b together; any outcome is a matching
    part = original.feet(segment, np.full(len(path), 0.5), path, axis_length, NEWTON_STEPS)
    return np.maximum.accumulate(segment + part)


def _strays(path: Path, original: Original, axis_length: float, limit: float) -> tuple[Floats, Floats, Floats]:
    """Places on the original of every sample and of every pose, and how far tip and b are from their partners."""
    poses = match_poses(path, original, axis_length, limit)
    matched = match_samples(path, original, poses, axis_length)
    parameter = np.concatenate((matched, np.arange(len(original), dtype=float)))
    sample = np.concatenate((np.arange(len(path)), poses))
    tip, point = original.at(parameter, axis_length)
    strays_tip = length_of(path.tip[sample] - tip)
    strays_point = length_of(path.point[sample] - point)
    return parameter, strays_tip, strays_point


def within(path: Path, original: Original, axis_length: float, limit: float) -> bool:
    """Whether one run deviates by `limit` at most: as `deviation`, without asking by how much it does not."""
    _, *strays = _strays(path, original, axis_length, limit)
    if max(float(stray.max()) for stray in strays) <= limit:
        return True
    lines = original.dense(axis_length, limit)
    return all(
        float(stray.max()) <= limit or leash_is_enough(samples, line, limit)
        for stray, samples, line in zip(strays, (path.tip, path.point), lines, strict=True)
    )


def deviation(path: Path, original: Original, axis_length: float, limit: float) -> Deviation:
    """Deviation of one run of feed motion from the poses it was made of; see the module text.

    Parameters
    ----------
    path : Path
        Dense samples from the first pose to the last.
    original : Original
    axis_length : float, mm
        H of b = tip + H·axis, in both.
    limit : float, mm
        The verdict looked for: distances at or below it are upper bounds, distances above it exact.
    """
    parameter, strays_tip, strays_point = _strays(path, original, axis_length, limit)
    worst_tip, worst_point = int(np.argmax(strays_tip)), int(np.argmax(strays_point))
    found = [float(strays_tip[worst_tip]), float(strays_point[worst_point])]
    exact = max(found) > limit
    if exact:
        lines = original.dense(axis_length, limit)
        samples = (path.tip, path.point)
        for which in (0, 1):
            if found[which] <= limit:
                continue
            enough = leash_is_enough(samples[which], lines[which], limit)
            found[which] = limit if enough else frechet_distance(samples[which], lines[which], limit * RESOLUTION)
    return Deviation(found[0], found[1], float(parameter[worst_tip]), float(parameter[worst_point]), exact)
