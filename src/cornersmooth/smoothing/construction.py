"""What a method of smoothing has to be able to do; `cornersmooth.methods` lists the methods."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, ClassVar

from cornersmooth.methods import AUTO, DEFAULT_METHOD, METHODS
from cornersmooth.model import Corners, Floats, Ints, Program, SmoothProgram
from cornersmooth.settings import Settings
from cornersmooth.smoothing.corner_table import Legs, Placed, Remainders
from cornersmooth.smoothing.transition import place_corners

#: what `Corners.extra` may have: largest curvature of the curve of a run beside each of its corners, 1/mm
RUN_CURVATURE = "run_curvature"


class Construction(ABC):
    """A method: where it puts transitions, and where the tool is on them and between them."""

    #: names of what `Corners.extra` holds
    extra: ClassVar[tuple[str, ...]] = ()

    def smooth(
        self,
        program: Program,
        settings: Settings,
        progress: Callable[[int, int], None] | None = None,
        processes: int = 1,
    ) -> SmoothProgram:
        """Smooth a whole program, corner by corner; parameters are those of `cornersmooth.smooth`."""
        corners = place_corners(program, settings, self, progress)
        return SmoothProgram(program=program, corners=corners, settings=settings, findings=program.findings)

    @abstractmethod
    def place(self, legs: Legs, settings: Settings) -> Placed:
        """Transitions of g corners."""

    @abstractmethod
    def points(self, smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
        """Tips (mm) and vectors along the tool, (g, 1 + m, 3) each, on the transitions of rows (g,) of corners.

        They are those at u = 0 and at the parameters u (m,), ascending.
        """

    @abstractmethod
    def divide(
        self, program: Program, settings: Settings, remainders: Remainders, number: int
    ) -> tuple[Floats, Floats]:
        """Inner points of straight remainders that are written as `number` lines of equal change of axis.

        Returns
        -------
        fraction : (g, number - 1) float64
            Where the tip is on its segment.
        axis : (g, number - 1, 3) float64
            Unit vectors.
        """

    def axes(self, program: Program, corners: Corners, settings: Settings, rows: Ints, u: Floats) -> Floats | None:
        """Unit axis vectors (m, 3) on transitions `rows` (m,) at parameters u (m,); None where v = u gives them."""
        return None

    def report_columns(self, corners: Corners, rows: Ints) -> Mapping[str, Floats]:
        """Columns of the table of corners that only this method has, for some rows; names carry their unit."""
        return {}

    def report_summary(self, corners: Corners) -> Mapping[str, float]:
        """Entries of the report's summary that only this method has; names carry their unit."""
        return {}

    def summary_text(self, summary: Mapping[str, Any]) -> str:
        """One line on the screen about what `report_summary` gave; empty for none."""
        return ""


def construction_of(method: str) -> Construction:
    """The construction of a method, by its name; that of lines for "auto", which paths have that are not smoothed."""
    name = DEFAULT_METHOD if method == AUTO else method
    construction: Construction = import_module(METHODS[name].module).CONSTRUCTION
    return construction
