"""What smoothing does to the metal: the surface that the tool leaves, original against written.

``measure_surface`` takes points on the envelope of the original motion and says how far the written motion cuts below
(overcut) or stays above them (undercut). Tools are bodies of revolution: cylinder, cone, ball, corner radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cornersmooth.arrays import some_rows
from cornersmooth.errors import SettingsError
from cornersmooth.geometry.tool import Tool
from cornersmooth.model import Bools, Floats, Program
from cornersmooth.nc_reader import NcProgram
from cornersmooth.surface.motion import (
    EnvelopePoints,
    distance_to_motion,
    envelope_points,
    original_cuts,
    written_cuts,
)

__all__ = ["SurfaceMap", "measure_surface"]

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

    def histogram(self) -> tuple[Floats, Floats]:
        """Edges of equal classes, mm, and how many points are in each."""
        counts, edges = np.histogram(self.off[self.known], bins=_CLASSES, range=(-self.span, self.span))
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
    return SurfaceMap(points, off, tool, edge, tolerance, reach, int(np.count_nonzero(~on)))
