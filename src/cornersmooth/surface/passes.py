"""How much neighbouring passes differ: rows show on a surface where they are smoothed differently.

It looks at the point as high as the centre of the tool's corner arc, tip + r·O: of a ball it is the centre, which makes
the surface. Across it lies the direction normal to the pass and to the way to its neighbour.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cornersmooth.arrays.vectors import dot, norm, square, unit
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.surface.motion import RuledMotion

#: ends of segments near a place that are looked at
_NEAREST = 48

#: way along the path to a neighbouring pass over the distance to it: on a half circle it is less
_WAY_BACK = 2.0

#: cosine of the angle up to which passes are parallel
_PARALLEL = 0.9

#: mm; a pass that is nearer is the same once more, and lies in no direction
_SAME = 1e-6

#: places worked on together
_TOGETHER = 2048


@dataclass(frozen=True)
class PassDifference:
    """By how much the written motion is off differently on neighbouring passes."""

    places: int  #: places with a neighbour
    apart_mm: float  #: mm: middle distance of neighbours
    #: of the difference of both deviations, across the surface
    rms_mm: float
    percentile_95_mm: float
    max_mm: float
    cl_line: int  #: CL line of the largest
    at_mm: tuple[float, float, float]  #: mm: tip there


def neighbouring_passes(
    original: RuledMotion, written: RuledMotion, radius: float, within: float, *, stations: int = 2000
) -> PassDifference | None:
    """Compare what neighbouring passes are off at about so many places; None where no pass has a neighbour.

    It looks at the centre of the tool's corner radius, mm; passes farther apart than `within`, mm, are no neighbours.
    """
    path, own = _Path(original, radius), _Path(written, radius)
    segment = np.unique(np.linspace(0, len(original) - 1, min(stations, len(original))).astype(np.int64))
    here = (path.start[segment] + path.end[segment]) / 2.0
    along = (path.length[segment] + path.length[segment + 1]) / 2.0
    beside = [
        path.nearest(here[part], path.way[segment[part]], along[part], within)
        for part in np.array_split(np.arange(len(segment)), -(-len(segment) // _TOGETHER))
    ]
    place, other = (np.concatenate(parts) for parts in zip(*beside, strict=True))
    found = np.flatnonzero(other >= 0)
    here, way, place, other = here[found], path.way[segment[found]], place[found], other[found]
    across = np.cross(way, place - here)
    size = norm(across)
    apart = own.off(here, way) - own.off(place, path.way[other])
    rows = np.flatnonzero((size > 0.0) & np.isfinite(apart).all(axis=1))
    if not len(rows):
        return None
    difference = np.abs(dot(apart[rows], across[rows] / size[rows, None]))
    worst = rows[np.argmax(difference)]
    row = segment[found[worst]]
    return PassDifference(
        places=len(rows),
        apart_mm=float(np.median(norm(place - here)[rows])),
        rms_mm=float(np.sqrt(np.square(difference).mean())),
        percentile_95_mm=float(np.percentile(difference, 95.0)),
        max_mm=float(difference.max()),
        cl_line=int(original.line[row]),
        at_mm=tuple(original.tip[row].mean(axis=0).tolist()),
    )


class _Path:
    """Chords of the looked-at point, m of them, their directions, and the length of the path up to each (m + 1,)."""

    def __init__(self, motion: RuledMotion, radius: float) -> None:
        self.start, self.end = (motion.tip[:, k] + radius * motion.axis[:, k] for k in (0, 1))
        self.way = unit(self.end - self.start)
        self.length = np.concatenate(([0.0], np.cumsum(norm(self.end - self.start))))
        self.tree = cKDTree(np.concatenate((self.start, self.end)))

    def _feet(self, points: Floats) -> tuple[Ints, Floats, Floats, Floats, Bools]:
        """Chords (q, c) near points (q, 3), feet on them, distances, lengths up to feet, and which are inside."""
        count = min(_NEAREST, self.tree.n)
        chord = self.tree.query(points, k=count)[1].reshape(len(points), count) % len(self.start)
        step = self.end[chord] - self.start[chord]
        gone = points[:, None] - self.start[chord]
        size = np.maximum(square(step), 1e-300)
        share = dot(gone, step) / size
        inside = (share >= -1e-9) & (share <= 1.0 + 1e-9)
        share = np.clip(share, 0.0, 1.0)
        foot = self.start[chord] + share[..., None] * step
        return chord, foot, norm(foot - points[:, None]), self.length[chord] + share * np.sqrt(size), inside

    def nearest(self, points: Floats, ways: Floats, along: Floats, within: float) -> tuple[Floats, Ints]:
        """Feet (q, 3) on the nearest parallel pass and their chords, -1 for none."""
        chord, foot, distance, length, inside = self._feet(points)
        parallel = np.abs(np.einsum("qcd,qd->qc", self.way[chord], ways)) > _PARALLEL
        other = np.abs(length - along[:, None]) > _WAY_BACK * distance
        good = inside & parallel & other & (distance > _SAME) & (distance <= within)
        best = np.where(good, distance, np.inf).argmin(axis=1)
        row = np.arange(len(points))
        return foot[row, best], np.where(good[row, best], chord[row, best], -1)

    def off(self, points: Floats, ways: Floats) -> Floats:
        """(q, 3) from points to this path where it runs the same way; NaN where it does not come by."""
        found = np.full((len(points), 3), np.nan)
        for begin in range(0, len(points), _TOGETHER):
            here = slice(begin, begin + _TOGETHER)
            chord, foot, distance, _, _ = self._feet(points[here])
            good = np.einsum("qcd,qd->qc", self.way[chord], ways[here]) > _PARALLEL
            row, best = np.arange(len(foot)), np.where(good, distance, np.inf).argmin(axis=1)
            found[here] = np.where(good[row, best][:, None], foot[row, best] - points[here], np.nan)
        return found
