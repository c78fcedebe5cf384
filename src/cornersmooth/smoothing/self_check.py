"""Which transitions of the paper's method keep the tolerance: measured, as its equations do not guarantee it.

Equation (10) bounds each of the two curves, not the motion that their synchronisation makes of them. So transitions,
and what they leave of the segments between them, are sampled and measured here against the original motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints, Program
from cornersmooth.vectors import dot, norm, square

#: parts of every segment of the original in which the nearest pose is looked for, and steps to it from there
_PARTS: Final = 24
_STEPS: Final = 3

#: length below which a direction has no meaning
_LEAST: Final = 1e-30


def distances(
    program: Program, axis_length: float, poses: Ints, tip: Floats, axis: Floats, *, own_axis: bool = False
) -> tuple[Floats, Floats, Floats, Floats]:
    """How far sampled poses (g, m) are from the original motion through some poses (g, q) of a program, mm.

    With `own_axis` the axis point is H times the axis wherever the tip is.

    Returns
    -------
    tip, axis_point, together : (g, m) float64
        From the path of the tip, from the path of the axis point, and of both from the pose that is nearest in six
        dimensions.
    backwards : (g,) float64
        By how much that pose goes back along the original, at most.
    """
    own = tip, axis_length * axis if own_axis else tip + axis_length * axis
    legs = [
        _Leg(program.tip[start], program.tip[end], program.axis[start], program.axis[end], axis_length, own_axis)
        for start, end in pairwise(poses.T)
    ]

    size = np.stack([np.sqrt(square(leg.tip_end - leg.tip_start) + square(leg.swing)) for leg in legs])
    start = np.cumsum(size, axis=0) - size

    def nearest(*chosen: int) -> tuple[Floats, Floats, Floats]:
        """Distances of both from the pose at which those `chosen` are nearest together, and its length."""
        found = [leg.nearest(own, chosen) for leg in legs]
        which = np.stack([row[0] for row in found]).argmin(axis=0)[None]
        share, *away = (np.take_along_axis(np.stack([row[k] for row in found]), which, axis=0)[0] for k in (1, 2, 3))
        row = np.arange(len(poses))[:, None]
        return *away, start[which[0], row] + share * size[which[0], row]

    *common, length = nearest(0, 1)
    back = (np.maximum.accumulate(length, axis=1) - length).max(axis=1)
    return nearest(0)[0], nearest(1)[1], np.maximum(*common), back


def passing(point: Floats, path: Floats) -> Floats:
    """(g,) distance of points (g, 3) from polylines (g, m, 3), mm."""
    start, way = path[:, :-1] - point[:, None], np.diff(path, axis=1)
    share = np.clip(-dot(start, way) / np.maximum(dot(way, way), _LEAST), 0.0, 1.0)
    nearest: Floats = norm(start + share[..., None] * way).min(axis=1)
    return nearest


@dataclass(frozen=True)
class _Leg:
    """A segment of the original at each of g corners, a ruled motion: tips and axes (g, 3) at both ends."""

    tip_start: Floats
    tip_end: Floats
    axis_start: Floats
    axis_end: Floats
    axis_length: float
    own_axis: bool

    @property
    def swing(self) -> Floats:
        """(g, 3) way of the axis point, mm."""
        turn = self.axis_length * (self.axis_end - self.axis_start)
        return turn if self.own_axis else self.tip_end - self.tip_start + turn

    def at(self, share: Floats) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Tips and axis points (g, m, 3) at shares (g, m) of it, and their slopes."""
        part = share[..., None]
        way, turn = (self.tip_end - self.tip_start)[:, None], (self.axis_end - self.axis_start)[:, None]
        ruled = self.axis_start[:, None] + part * turn
        size = np.maximum(norm(ruled), _LEAST)[..., None]
        across = turn - dot(ruled, turn)[..., None] * ruled / size**2
        tip = self.tip_start[:, None] + part * way
        lever, turning = self.axis_length * ruled / size, self.axis_length * across / size
        moving = np.broadcast_to(way, tip.shape)
        if self.own_axis:
            return (tip, lever), (moving, turning)
        return (tip, tip + lever), (moving, way + turning)

    def nearest(self, own: tuple[Floats, Floats], chosen: tuple[int, ...]) -> tuple[Floats, ...]:
        """Where those of tip and axis point (g, m, 3) that are `chosen` are nearest together, (g, m) each.

        Returned are the sum of the chosen squares of distances, the share of the segment, and both distances.
        """
        grid = np.linspace(0.0, 1.0, _PARTS + 1)
        points, _ = self.at(np.broadcast_to(grid, (len(self.tip_start), len(grid))))
        share = grid[_squares(own, [path[:, None] for path in points], chosen, spread=True).argmin(axis=-1)]
        best, found = np.full(share.shape, np.inf), share
        for step in range(_STEPS + 1):
            here, slope = self.at(share)
            away = _squares(own, here, chosen)
            found, best = np.where(away < best, share, found), np.minimum(away, best)
            if step < _STEPS:
                towards = sum(dot(own[k] - here[k], slope[k]) for k in chosen)
                steep = sum(dot(slope[k], slope[k]) for k in chosen)
                share = np.clip(share + towards / np.maximum(steep, _LEAST), 0.0, 1.0)
        here, _ = self.at(found)
        return best, found, norm(own[0] - here[0]), norm(own[1] - here[1])


def _squares(
    own: Sequence[Floats], other: Sequence[Floats], chosen: tuple[int, ...], *, spread: bool = False
) -> Floats:
    """Sum of the squares of the distances of those chosen; with `spread`, of every one from every other."""
    away = [(own[k][:, :, None] if spread else own[k]) - other[k] for k in chosen]
    total: Floats = np.sum([dot(one, one) for one in away], axis=0)
    return total
