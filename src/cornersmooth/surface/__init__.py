"""What smoothing does to the metal: the surface that the tool leaves, original against written.

``measure_surface`` takes points on the envelope of the original motion and says how far the written motion cuts below
(overcut) or stays above them (undercut). Tools are bodies of revolution: cylinder, cone, ball, corner radius.
"""

from __future__ import annotations

from cornersmooth.surface.distance import distance_to_motion
from cornersmooth.surface.envelope import EnvelopePoints, envelope_points
from cornersmooth.surface.measuring import SurfaceMap, measure_surface
from cornersmooth.surface.motion import RuledMotion, original_cuts, written_cuts
from cornersmooth.surface.passes import PassDifference, neighbouring_passes
from cornersmooth.surface.tool import Tool, parse_tool, tools_of

__all__ = [
    "EnvelopePoints",
    "PassDifference",
    "RuledMotion",
    "SurfaceMap",
    "Tool",
    "distance_to_motion",
    "envelope_points",
    "measure_surface",
    "neighbouring_passes",
    "original_cuts",
    "parse_tool",
    "tools_of",
    "written_cuts",
]
