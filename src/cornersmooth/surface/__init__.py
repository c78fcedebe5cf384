"""What smoothing does to the metal: the surface that the tool leaves, original against written.

``measure_surface`` takes points on the envelope of the original motion and says how far the written motion cuts below
(overcut) or stays above them (undercut). Tools are bodies of revolution: cylinder, cone, ball, corner radius.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cornersmooth.arrays import dot, norm, some_rows, square, unit
from cornersmooth.errors import SettingsError
from cornersmooth.geometry.tool import Tool
from cornersmooth.model import Bools, Floats, Ints, Program
from cornersmooth.nc_reader import NcProgram
from cornersmooth.surface.motion import (
    EnvelopePoints,
    RuledMotion,
    distance_to_motion,
    envelope_points,
    original_cuts,
    written_cuts,
)

__all__ = ["PassDifference", "SurfaceMap", "measure_surface"]

#: a point deeper than this inside the original volume, mm, is cut away by another part of the path
BURIED = 1e-3

#: classes of the histogram
_CLASSES = 40

SCHEMA = "cornersmooth-surface/1"


@dataclass(frozen=True)
class SurfaceMap:
    """Points of the original surface and how far the written motion is off there, k rows."""

    points: EnvelopePoints
    #: (k,) mm: Distance to the written volume less that to the original volume: negative where the written motion
    #: cuts below the original surface (overcut), positive where it leaves material (undercut); NaN beyond `reach`.
    off: Floats
    tool: Tool
    edge: float  #: mm
    tolerance: float  #: mm
    reach: float  #: mm
    #: points of the envelope that another part of the original path cuts away; they are not among the rows
    buried: int
    #: How differently neighbouring passes are off; None where no pass has a neighbour within the tool.
    passes: PassDifference | None = None

    def __len__(self) -> int:
        return len(self.off)

    @property
    def known(self) -> Bools:
        """(k,) bool: rows with a distance."""
        return np.isfinite(self.off)

    @property
    def span(self) -> float:
        """What scales reach to on both sides, mm: the largest distance, or the tolerance where all are 0."""
        return float(np.abs(self.off[self.known]).max(initial=0.0)) or self.tolerance

    @property
    def kept(self) -> bool:
        """Whether every point is known to be within the tolerance, give or take 1e-9 mm of arithmetic."""
        return bool((np.abs(self.off) <= self.tolerance + 1e-9).all())

    def histogram(self, classes: int = _CLASSES) -> tuple[Floats, Floats]:
        """Edges of equal classes, mm, and how many points are in each."""
        counts, edges = np.histogram(self.off[self.known], bins=classes, range=(-self.span, self.span))
        return edges, counts.astype(np.float64)

    def as_dict(self) -> dict[str, Any]:
        """Everything but the points, plain; keys carry their unit."""
        off = self.off[self.known]
        edges, counts = self.histogram()
        contents: dict[str, Any] = {
            "schema": SCHEMA,
            "tool": {"description": self.tool.describe(), **vars(self.tool)},
            "edge_mm": self.edge,
            "tolerance_mm": self.tolerance,
            "points": len(self),
            "points_cut_away_elsewhere": self.buried,
            "points_beyond_reach": int(np.count_nonzero(~self.known)),
            "mean_mm": float(off.mean()) if len(off) else None,
            "rms_mm": float(np.sqrt((off * off).mean())) if len(off) else None,
            "within_tolerance_percent": float(100.0 * (np.abs(off) <= self.tolerance).mean()) if len(off) else None,
            "histogram": {"edges_mm": edges.tolist(), "counts": counts.astype(int).tolist()},
        }
        contents["neighbouring_passes"] = self.passes and asdict(self.passes)
        for name, sign in (("overcut", -1), ("undercut", 1)):
            rows = np.flatnonzero(self.known & (sign * self.off > 0.0))
            own = np.abs(self.off[rows])
            row = int(rows[np.argmax(own)]) if len(rows) else None
            contents[name] = {
                "points": len(own),
                "max_mm": float(own.max(initial=0.0)),
                "mean_mm": float(own.mean()) if len(own) else 0.0,
                "percentile_95_mm": float(np.percentile(own, 95.0)) if len(own) else 0.0,
                "cl_line": 0 if row is None else int(self.points.line[row]),
                "at_mm": None if row is None else self.points.point[row].tolist(),
            }
        return contents


def measure_surface(
    program: Program,
    nc: NcProgram,
    tool: Tool,
    *,
    tolerance: float,
    edge: float = 10.0,
    levels: int = 7,
    stations: int = 2000,
) -> SurfaceMap:
    """Measure what the written motion leaves of the surface that the original one makes; the rest as `envelope_points`.

    CS271: nothing is cut.
    """
    original, written = original_cuts(program), written_cuts(nc)
    if not len(original):
        raise SettingsError("CS271", "there is no feed move, so no surface", "give a program that cuts")
    points = envelope_points(original, tool, edge, levels=levels, stations=stations)
    reach = max(10.0 * tolerance, 0.02 * tool.diameter)
    own = distance_to_motion(points.point, original, tool, edge, reach=reach, deepest=BURIED)
    on = own > -BURIED  # never NaN: the point is on the tool somewhere
    rows = np.flatnonzero(on)
    points, own = some_rows(points, rows), own[rows]
    off = distance_to_motion(points.point, written, tool, edge, reach=reach) - own
    passes = neighbouring_passes(original, written, tool.corner_radius, tool.diameter, stations=stations)
    return SurfaceMap(points, off, tool, edge, tolerance, reach, int(np.count_nonzero(~on)), passes)


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
