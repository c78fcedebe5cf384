"""What smoothing does to the metal: the surface that the tool leaves, original against written.

``measure_surface`` takes points on the envelope of the original motion and says how far the written motion cuts below
(overcut) or stays above them (undercut). Tools are bodies of revolution: cylinder, cone, ball, corner radius.
"""

from cornersmooth.surface.measuring import SurfaceMap, measure_surface
from cornersmooth.surface.passes import PassDifference

__all__ = ["PassDifference", "SurfaceMap", "measure_surface"]
