"""The methods of smoothing by name: what settings, command line and reports have to know of a method.

How a method makes its curves is in a module of its own, which is imported when the method is used. To add one, write
that module with a `cornersmooth.smoothing.construction.Construction` named ``CONSTRUCTION``, and an entry here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType


@dataclass(frozen=True)
class Method:
    """A way to make the pair of curves."""

    name: str  #: As on the command line and in reports
    summary: str  #: A few words for the help
    module: str  #: Where its `CONSTRUCTION` is
    #: Whether one parameter drives both curves. Only then do the errors at a common parameter bound the distances of
    #: the paths, and can rotary words follow the curves.
    one_parameter: bool = True
    #: Settings that the method does not leave open.
    prescribed: Mapping[str, object] = field(default_factory=lambda: MappingProxyType({}))


#: in the order of tables, the oldest first
METHODS: Mapping[str, Method] = MappingProxyType(
    {
        method.name: method
        for method in (
            Method(
                "zhang2016",
                "the paper as published",
                "cornersmooth.smoothing.zhang2016",
                one_parameter=False,
            ),
            Method(
                "proportional",
                "both segments cut at the same fraction, one parameter for both curves",
                "cornersmooth.smoothing.proportional",
            ),
            Method(
                "global",
                "one pair of curves for a whole run of corners, as smooth as the tolerance allows",
                "cornersmooth.smoothing.global_runs",
                prescribed=MappingProxyType({"weights": (1.0, 1.0)}),
            ),
        )
    }
)

#: what suits the form: see `Settings.with_method`
AUTO = "auto"

#: of lines, and of curves
DEFAULT_METHOD, CURVES_METHOD = "proportional", "global"

#: as published
PAPERS_METHOD = "zhang2016"
